//! The statements of an OBJ file.

use super::builder::{Builder, Corner, NONE, NormalSource};
use crate::environment::linear;
use crate::number::{parse_f32, parse_i64};
use crate::polygon::Triangulator;
use crate::scan::{Source, Words};
use crate::{ErrorKind, ImportError, Limits};
use std::collections::HashMap;
use std::io::Read;
use vastlight_math::{Vec2, Vec3, Vec4};
use vastlight_scene::{Diagnostics, Mesh};

/// Triangles from `first_triangle` on that share object, group and material.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Run {
    pub(super) first_triangle: u32,
    pub(super) object: u32,
    pub(super) group: u32,
    pub(super) material: u32,
}

/// Names of one kind, each with its number in order of first appearance.
#[derive(Debug, Default)]
pub(super) struct Names {
    pub(super) list: Vec<String>,
    numbers: HashMap<String, u32>,
}

impl Names {
    pub(super) fn number(&mut self, name: &str) -> u32 {
        if let Some(&number) = self.numbers.get(name) {
            return number;
        }
        let number = self.list.len() as u32;
        self.list.push(name.to_owned());
        self.numbers.insert(name.to_owned(), number);
        number
    }
}

/// Names of objects and groups; number 0 is "before the first".
#[derive(Debug)]
pub(super) struct Sections {
    pub(super) objects: Names,
    pub(super) groups: Names,
}

/// A parsed file: one mesh, and where its triangles belong.
pub(super) struct Parsed {
    pub(super) mesh: Mesh,
    pub(super) runs: Vec<Run>,
    pub(super) names: Sections,
    /// Names of materials; the empty name stands for "none".
    pub(super) materials: Vec<String>,
    /// Arguments of `mtllib`.
    pub(super) libraries: Vec<String>,
    /// What cut the polygons.
    pub(super) triangulator: Triangulator,
}

struct Parser<'a> {
    builder: Builder,
    runs: Vec<Run>,
    names: Sections,
    materials: Names,
    libraries: Vec<String>,
    current: Run,
    smoothing_group: u32,
    corners: Vec<Corner>,
    joined: Vec<u8>,
    file: String,
    limits: &'a Limits,
    diagnostics: &'a mut Diagnostics,
    unknown: Names,
    small_faces: u64,
    statements: u64,
}

/// Reads all statements.
pub(super) fn parse<R: Read>(
    mut source: Source<R>,
    limits: &Limits,
    triangulator: Triangulator,
    diagnostics: &mut Diagnostics,
) -> Result<Parsed, ImportError> {
    let mut parser = Parser::new(source.file().to_owned(), limits, diagnostics);
    parser.builder.triangulator = triangulator;
    while let Some(line) = source.line()? {
        let outcome = parser.line(line);
        outcome.map_err(|(kind, what)| ImportError::new(kind, what, source.line_place()))?;
    }
    let outcome = parser.line(b"");
    outcome.map_err(|(kind, what)| ImportError::new(kind, what, source.line_place()))?;
    parser.finish()
}

type Outcome = Result<(), (ErrorKind, String)>;

fn wrong(what: impl Into<String>) -> (ErrorKind, String) {
    (ErrorKind::Malformed, what.into())
}

impl<'a> Parser<'a> {
    fn new(file: String, limits: &'a Limits, diagnostics: &'a mut Diagnostics) -> Self {
        let mut names = Sections { objects: Names::default(), groups: Names::default() };
        names.objects.number("");
        names.groups.number("");
        Self {
            builder: Builder::default(),
            runs: Vec::new(),
            names,
            materials: Names::default(),
            libraries: Vec::new(),
            current: Run { first_triangle: 0, object: 0, group: 0, material: NONE },
            smoothing_group: 0,
            corners: Vec::new(),
            joined: Vec::new(),
            file,
            limits,
            diagnostics,
            unknown: Names::default(),
            small_faces: 0,
            statements: 0,
        }
    }

    /// One line of the file; a backslash at its end continues it on the next.
    fn line(&mut self, line: &[u8]) -> Outcome {
        if let Some(start) = line.trim_ascii_end().strip_suffix(b"\\") {
            self.joined.extend_from_slice(start);
            self.joined.push(b' ');
            let fits = self.joined.len() <= self.limits.line_bytes;
            return if fits { Ok(()) } else { Err(wrong("a line is longer than the limits allow")) };
        }
        if self.joined.is_empty() {
            return self.statement(line);
        }
        let mut joined = std::mem::take(&mut self.joined);
        joined.extend_from_slice(line);
        self.statement(&joined)
    }

    fn statement(&mut self, line: &[u8]) -> Outcome {
        let mut words = Words(line);
        let Some(keyword) = words.next() else { return Ok(()) };
        match keyword {
            b"v" => self.position(words)?,
            b"vt" => self.uv(words)?,
            b"vn" => {
                let normal = numbers::<3>(&mut words)?;
                self.builder.normals.push(normal.into());
            }
            b"f" | b"fo" => self.face(words)?,
            b"o" => self.current.object = self.names.objects.number(&name(words)),
            b"g" => self.current.group = self.names.groups.number(&name(words)),
            b"usemtl" => self.current.material = self.materials.number(&name(words)),
            b"mtllib" => self.libraries.push(name(words)),
            b"s" => self.smoothing_group = smoothing_group(words),
            other => return self.ignored(other),
        }
        self.statements += 1;
        Ok(())
    }

    fn position(&mut self, words: Words<'_>) -> Outcome {
        let mut values = [0.0; 8];
        let mut count = 0;
        for word in words.take(8) {
            values[count] = number(word)?;
            count += 1;
        }
        let [x, y, z, r, g, b, a, _] = values;
        if count < 3 {
            return Err(wrong("a vertex has fewer than three coordinates"));
        }
        if self.builder.positions.len() as u64 >= self.limits.vertices.min(u64::from(u32::MAX - 1)) {
            return Err((ErrorKind::Limit, "more vertices than the limits allow".into()));
        }
        // x y z r g b (a), as editors and scanners write it; a fourth number alone is a weight.
        if count >= 6 {
            self.builder.colors.resize(self.builder.positions.len(), Vec4::ONE);
            let alpha = if count >= 7 { a } else { 1.0 };
            let [r, g, b] = [r, g, b].map(|c| linear(c.max(0.0)));
            self.builder.colors.push(Vec4::new(r, g, b, alpha));
        }
        self.builder.positions.push(Vec3::new(x, y, z));
        Ok(())
    }

    fn uv(&mut self, mut words: Words<'_>) -> Outcome {
        let u = words.next().map_or(Ok(0.0), number)?;
        let v = words.next().map_or(Ok(0.0), number)?;
        // In an OBJ file v grows upwards.
        self.builder.uvs.push(Vec2::new(u, 1.0 - v));
        Ok(())
    }

    fn face(&mut self, words: Words<'_>) -> Outcome {
        let mut corners = std::mem::take(&mut self.corners);
        corners.clear();
        for word in words {
            corners.push(self.corner(word)?);
        }
        if corners.len() < 3 {
            self.small_faces += 1;
        } else {
            self.begin_run();
            self.builder.face(&corners);
        }
        self.corners = corners;
        let limit = self.limits.triangles.min(u64::from(u32::MAX));
        if self.builder.triangles.len() as u64 > limit {
            return Err((ErrorKind::Limit, format!("more triangles than the limit of {limit}")));
        }
        Ok(())
    }

    fn begin_run(&mut self) {
        if self.current.material == NONE {
            self.current.material = self.materials.number("");
        }
        let run = Run { first_triangle: self.builder.triangles.len() as u32, ..self.current };
        let differs =
            |last: &Run| (last.object, last.group, last.material) != (run.object, run.group, run.material);
        if self.runs.last().is_none_or(differs) {
            self.runs.push(run);
        }
    }

    /// `v`, `v/vt`, `v//vn` or `v/vt/vn`.
    fn corner(&self, word: &[u8]) -> Result<Corner, (ErrorKind, String)> {
        let mut fields = word.split(|&c| c == b'/');
        let positions = self.builder.positions.len();
        let position = index(fields.next().unwrap_or_default(), positions, "vertex", word)?;
        let uv = match fields.next().unwrap_or_default() {
            b"" => NONE,
            field => index(field, self.builder.uvs.len(), "texture coordinate", word)?,
        };
        let given = match fields.next().unwrap_or_default() {
            b"" => None,
            field => Some(index(field, self.builder.normals.len(), "normal", word)?),
        };
        let normal = match (given, self.smoothing_group) {
            (Some(n), _) => NormalSource::Given(n),
            (None, 0) => NormalSource::Flat,
            (None, group) => NormalSource::Group(group),
        };
        Ok(Corner { position, uv, normal })
    }

    /// Statements that make no difference, and those that are named in a warning.
    fn ignored(&mut self, keyword: &[u8]) -> Outcome {
        const SILENT: [&[u8]; 12] = [
            b"vp",
            b"mg",
            b"bevel",
            b"c_interp",
            b"d_interp",
            b"lod",
            b"shadow_obj",
            b"trace_obj",
            b"usemap",
            b"maplib",
            b"end",
            b"cstype",
        ];
        const NAMED: [(&[u8], &str); 7] = [
            (b"l", "lines"),
            (b"p", "points"),
            (b"curv", "free-form curves"),
            (b"curv2", "free-form curves"),
            (b"surf", "free-form surfaces"),
            (b"call", "calls of other files"),
            (b"csh", "commands"),
        ];
        if keyword.starts_with(b"#") || SILENT.contains(&keyword) {
            return Ok(());
        }
        if let Some((_, what)) = NAMED.iter().find(|(k, _)| *k == keyword) {
            self.diagnostics.warn(format!("{what} are not supported"), &self.file, "they are left out");
            self.statements += 1;
            return Ok(());
        }
        const MOST_UNKNOWN: usize = 32;
        if self.unknown.list.len() < MOST_UNKNOWN {
            self.unknown.number(&String::from_utf8_lossy(&keyword[..keyword.len().min(40)]));
        }
        Ok(())
    }

    fn finish(self) -> Result<Parsed, ImportError> {
        if self.statements == 0 {
            let error = ImportError::malformed("there is no OBJ statement in this file", self.file);
            return Err(error.with_hint("is it of another format?"));
        }
        for keyword in &self.unknown.list {
            let what = format!("unknown statement \"{}\"", keyword.escape_default());
            self.diagnostics.warn(what, &self.file, "it is left out");
        }
        if self.small_faces > 0 {
            let what = format!("{} faces have fewer than three corners", self.small_faces);
            self.diagnostics.warn(what, &self.file, "they are left out");
        }
        if self.runs.is_empty() {
            self.diagnostics.warn("the file has no faces", &self.file, "");
        }
        let (mesh, triangulator) = self.builder.into_mesh();
        Ok(Parsed {
            mesh,
            triangulator,
            runs: self.runs,
            names: self.names,
            materials: self.materials.list,
            libraries: self.libraries,
        })
    }
}

fn number(word: &[u8]) -> Result<f32, (ErrorKind, String)> {
    parse_f32(word).ok_or_else(|| wrong(format!("\"{}\" is not a number", String::from_utf8_lossy(word))))
}

fn numbers<const N: usize>(words: &mut Words<'_>) -> Result<[f32; N], (ErrorKind, String)> {
    let mut values = [0.0; N];
    for value in &mut values {
        *value = number(words.next().unwrap_or_default())?;
    }
    Ok(values)
}

/// A number from 1, or from the end if negative, as a number from 0.
#[inline]
fn index(field: &[u8], count: usize, what: &str, word: &[u8]) -> Result<u32, (ErrorKind, String)> {
    let absolute = match parse_i64(field) {
        Some(i) if i > 0 => i - 1,
        Some(i) if i < 0 => i + count as i64,
        _ => -1,
    };
    if (0..count as i64).contains(&absolute) {
        return Ok(absolute as u32);
    }
    let word = String::from_utf8_lossy(word);
    Err(wrong(format!("{what} of the corner \"{word}\" does not exist, there are {count} so far")))
}

/// The rest of the line: names may contain blanks.
fn name(words: Words<'_>) -> String {
    String::from_utf8_lossy(words.0.trim_ascii()).into_owned()
}

fn smoothing_group(mut words: Words<'_>) -> u32 {
    match words.next().unwrap_or_default() {
        b"off" | b"" => 0,
        b"on" => 1,
        word => parse_i64(word).and_then(|n| u32::try_from(n).ok()).unwrap_or(0),
    }
}
