//! The header of a PLY file: encoding, elements, properties.

use crate::ImportError;
use crate::number::parse_i64;
use crate::scan::{Source, Words};
use std::io::Read;

const MAX_HEADER_LINES: u64 = 100_000;

/// Order of the bytes of a binary number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ByteOrder {
    Little,
    Big,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Encoding {
    Ascii,
    Binary(ByteOrder),
}

/// Type of a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Kind {
    fn parse(name: &[u8]) -> Option<Self> {
        Some(match name {
            b"char" | b"int8" => Self::I8,
            b"uchar" | b"uint8" => Self::U8,
            b"short" | b"int16" => Self::I16,
            b"ushort" | b"uint16" => Self::U16,
            b"int" | b"int32" => Self::I32,
            b"uint" | b"uint32" => Self::U32,
            b"float" | b"float32" => Self::F32,
            b"double" | b"float64" => Self::F64,
            _ => return None,
        })
    }

    /// Size in a binary file.
    pub(super) const fn bytes(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }
}

#[derive(Clone, Debug)]
pub(super) enum Property {
    Scalar { name: String, kind: Kind },
    List { name: String, count: Kind, item: Kind },
}

#[derive(Clone, Debug)]
pub(super) struct Element {
    pub(super) name: String,
    pub(super) count: u64,
    pub(super) properties: Vec<Property>,
}

impl Element {
    /// Number of the property that lists vertex indices.
    pub(super) fn index_list(&self) -> Option<usize> {
        let is_index_list = |p: &Property| match p {
            Property::List { name, .. } => matches!(name.as_str(), "vertex_indices" | "vertex_index"),
            Property::Scalar { .. } => false,
        };
        self.properties.iter().position(is_index_list)
    }
}

#[derive(Clone, Debug)]
pub(super) struct Header {
    pub(super) encoding: Encoding,
    pub(super) elements: Vec<Element>,
}

impl Header {
    /// Reads up to and including `end_header`.
    pub(super) fn read<R: Read>(source: &mut Source<R>) -> Result<Self, ImportError> {
        let magic = source.line()?.map(<[u8]>::trim_ascii);
        if magic != Some(b"ply") {
            return Err(source.error("a PLY file starts with the line \"ply\""));
        }
        let (mut encoding, mut elements) = (None, Vec::new());
        loop {
            if source.line_number() > MAX_HEADER_LINES {
                return Err(source.error("the header has too many lines"));
            }
            let Some(line) = source.line()? else {
                return Err(source.error("the file ends within the header"));
            };
            let mut words = Words(line);
            let parsed = match words.next().unwrap_or_default() {
                b"" | b"comment" | b"obj_info" => Ok(()),
                b"end_header" => break,
                b"format" => parse_format(words).map(|found| encoding = Some(found)),
                b"element" => parse_element(words).map(|element| elements.push(element)),
                b"property" => parse_property(words, elements.last_mut()),
                other => Err(format!("unknown keyword \"{}\" in the header", String::from_utf8_lossy(other))),
            };
            parsed.map_err(|what| source.error(what))?;
        }
        let encoding = encoding.ok_or_else(|| source.error("the header has no \"format\" line"))?;
        let header = Self { encoding, elements };
        if header.element("vertex").is_none() {
            return Err(source.error("the file has no vertices"));
        }
        Ok(header)
    }

    pub(super) fn element(&self, name: &str) -> Option<&Element> {
        self.elements.iter().find(|e| e.name == name)
    }
}

fn parse_format(mut words: Words<'_>) -> Result<Encoding, String> {
    match words.next().unwrap_or_default() {
        b"ascii" => Ok(Encoding::Ascii),
        b"binary_little_endian" => Ok(Encoding::Binary(ByteOrder::Little)),
        b"binary_big_endian" => Ok(Encoding::Binary(ByteOrder::Big)),
        other => Err(format!("unknown format \"{}\"", String::from_utf8_lossy(other))),
    }
}

fn parse_element(mut words: Words<'_>) -> Result<Element, String> {
    let name = text(words.next())?;
    let count = words.next().and_then(parse_i64).and_then(|n| u64::try_from(n).ok());
    let count = count.ok_or_else(|| format!("element \"{name}\" has no count"))?;
    Ok(Element { name, count, properties: Vec::new() })
}

fn parse_property(mut words: Words<'_>, element: Option<&mut Element>) -> Result<(), String> {
    let element = element.ok_or("a property stands before the first element")?;
    let mut kind = || {
        let word = words.next().unwrap_or_default();
        Kind::parse(word).ok_or_else(|| format!("unknown type \"{}\"", String::from_utf8_lossy(word)))
    };
    let property = match kind() {
        Ok(kind) => Property::Scalar { kind, name: text(words.next())? },
        Err(e) if !e.contains("\"list\"") => return Err(e),
        Err(_) => {
            let (count, item) = (kind()?, kind()?);
            Property::List { count, item, name: text(words.next())? }
        }
    };
    element.properties.push(property);
    Ok(())
}

fn text(word: Option<&[u8]>) -> Result<String, String> {
    word.map(|w| String::from_utf8_lossy(w).into_owned()).ok_or_else(|| "a name is missing".to_owned())
}
