//! Measured luminaires: ANSI/IESNA LM-63 files of 1986, 1991, 1995, 2002 and 2019.

mod unfold;

#[cfg(test)]
mod tests;

use crate::environment::read_file;
use crate::number::parse_f32;
use crate::{ImportError, Limits};
use std::path::Path;
use unfold::{Photometry, Table};
use vastlight_scene::{Diagnostics, IesProfile};

/// More angles than this in one direction are not a measurement.
const MAX_ANGLES: usize = 3600;

/// Reads an IES file; see [`parse_ies`].
///
/// # Errors
/// The file cannot be read or breaks the format.
pub fn load_ies(
    path: &Path,
    limits: &Limits,
    diagnostics: &mut Diagnostics,
) -> Result<IesProfile, ImportError> {
    let place = path.display().to_string();
    limits.check_count(read_file_size(path)?, 64 << 20, "bytes", &place)?;
    parse_ies(&read_file(path, limits)?, &place, diagnostics)
}

fn read_file_size(path: &Path) -> Result<u64, ImportError> {
    Ok(std::fs::metadata(path).map_err(|e| ImportError::io(&e, path))?.len())
}

/// The far field of a luminaire from the text of an IES file. `name` is for messages.
///
/// Symmetries are unfolded to the whole circle; photometry of types B and A (floodlights, headlamps) is resampled about
/// its axis, which becomes the light's -z. Factors of the ballast are applied; factors for a tilted lamp are not.
///
/// # Errors
/// The text breaks the format.
pub fn parse_ies(bytes: &[u8], name: &str, diagnostics: &mut Diagnostics) -> Result<IesProfile, ImportError> {
    let mut numbers = Numbers::after_tilt(bytes, name, diagnostics)?;
    let _lamps = numbers.next()?;
    let _lumens = numbers.next()?;
    let multiplier = numbers.next()?;
    let vertical_count = numbers.count("vertical angles")?;
    let horizontal_count = numbers.count("horizontal angles")?;
    let photometry = match numbers.next()? {
        1.0 => Photometry::C,
        2.0 => Photometry::B,
        3.0 => Photometry::A,
        other => return Err(numbers.error(format!("the photometric type {other} is not 1, 2 or 3"))),
    };
    let _units_width_length_height = [numbers.next()?, numbers.next()?, numbers.next()?, numbers.next()?];
    let (ballast, lamp_ballast, _watts) = (numbers.next()?, numbers.next()?, numbers.next()?);
    let vertical = numbers.ascending(vertical_count, "vertical")?;
    let horizontal = numbers.ascending(horizontal_count, "horizontal")?;
    // The second factor is "for future use" in the newer revisions, and some programs leave it 0.
    let scale = multiplier * [ballast, lamp_ballast].into_iter().filter(|&f| f > 0.0).product::<f32>();
    let mut candela = Vec::with_capacity(vertical_count * horizontal_count);
    for _ in 0..vertical_count * horizontal_count {
        candela.push((numbers.next()? * scale).max(0.0));
    }
    let table = Table { vertical, horizontal, candela };
    let table = table.unfolded(photometry).map_err(|what| ImportError::malformed(what, name))?;
    normalized(table, name)
}

fn normalized(table: Table, name: &str) -> Result<IesProfile, ImportError> {
    let peak = table.candela.iter().copied().fold(0.0, f32::max);
    if !(peak > 0.0 && peak.is_finite()) {
        return Err(ImportError::malformed("the luminaire gives no light", name));
    }
    Ok(IesProfile {
        vertical: table.vertical,
        horizontal: table.horizontal,
        candela: table.candela.iter().map(|c| c / peak).collect(),
        peak_candela: peak,
    })
}

/// The numbers of the file, separated by blanks, commas or line ends.
struct Numbers<'a> {
    rest: &'a [u8],
    name: &'a str,
    whole: &'a [u8],
}

impl<'a> Numbers<'a> {
    /// Skips labels and keywords up to the line `TILT=`, and the tilt table if there is one.
    fn after_tilt(
        bytes: &'a [u8],
        name: &'a str,
        diagnostics: &mut Diagnostics,
    ) -> Result<Self, ImportError> {
        let mut numbers = Self { rest: bytes, name, whole: bytes };
        let tilt = loop {
            let Some(line) = numbers.line() else {
                return Err(
                    ImportError::malformed("there is no line TILT=", name).with_hint("is it an IES file?")
                );
            };
            let line = line.trim_ascii();
            if line.len() >= 5 && line[..5].eq_ignore_ascii_case(b"TILT=") {
                break line[5..].trim_ascii().to_ascii_uppercase();
            }
        };
        match tilt.as_slice() {
            b"NONE" => {}
            b"INCLUDE" => {
                let _geometry = numbers.next()?;
                for _ in 0..2 * numbers.count("tilt angles")? {
                    numbers.next()?;
                }
            }
            _ => diagnostics.warn("the tilt table stands in another file", name, "the lamp is not tilted"),
        }
        Ok(numbers)
    }

    fn line(&mut self) -> Option<&'a [u8]> {
        if self.rest.is_empty() {
            return None;
        }
        let end = self.rest.iter().position(|&c| c == b'\n' || c == b'\r').unwrap_or(self.rest.len());
        let line = &self.rest[..end];
        self.rest = self.rest.get(end + 1..).unwrap_or_default();
        Some(line)
    }

    fn next(&mut self) -> Result<f32, ImportError> {
        let separates = |c: &u8| *c <= b' ' || *c == b',';
        let Some(first) = self.rest.iter().position(|c| !separates(c)) else {
            self.rest = &[];
            return Err(self.error("the file ends before all numbers are there"));
        };
        let word = &self.rest[first..];
        let length = word.iter().position(separates).unwrap_or(word.len());
        let value = parse_f32(&word[..length]).filter(|v| v.is_finite());
        let Some(value) = value else {
            return Err(self.error(format!("\"{}\" is not a number", word[..length].escape_ascii())));
        };
        self.rest = &word[length..];
        Ok(value)
    }

    fn count(&mut self, what: &str) -> Result<usize, ImportError> {
        let value = self.next()?;
        if value >= 1.0 && value <= MAX_ANGLES as f32 && value.fract() == 0.0 {
            return Ok(value as usize);
        }
        Err(self.error(format!("{value} is not a number of {what}")))
    }

    fn ascending(&mut self, count: usize, what: &str) -> Result<Vec<f32>, ImportError> {
        let mut angles = Vec::with_capacity(count);
        for _ in 0..count {
            angles.push(self.next()?);
        }
        if angles.windows(2).all(|w| w[0] < w[1]) {
            return Ok(angles);
        }
        Err(self.error(format!("the {what} angles do not ascend")))
    }

    fn error(&self, what: impl Into<String>) -> ImportError {
        let read = &self.whole[..self.whole.len() - self.rest.len()];
        let line = 1 + read.iter().filter(|&&c| c == b'\n').count();
        ImportError::malformed(what, format!("{}:{line}", self.name))
    }
}
