//! Vertex attribute semantics and the accessor formats that they allow.

use crate::gltf::model::{Accessor, Component, Shape};

/// An attribute's meaning.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Semantic {
    Position,
    Normal,
    Tangent,
    TexCoord(usize),
    Color(usize),
    Joints(usize),
    Weights(usize),
    /// A name that starts with an underscore: the application's own.
    Custom,
}

impl Semantic {
    /// From the attribute's name.
    pub(super) fn parse(name: &str) -> Option<Self> {
        if name.starts_with('_') {
            return Some(Self::Custom);
        }
        match name {
            "POSITION" => return Some(Self::Position),
            "NORMAL" => return Some(Self::Normal),
            "TANGENT" => return Some(Self::Tangent),
            _ => {}
        }
        let (word, number) = name.split_once('_')?;
        let index = parse_index(number)?;
        match word {
            "TEXCOORD" => Some(Self::TexCoord(index)),
            "COLOR" => Some(Self::Color(index)),
            "JOINTS" => Some(Self::Joints(index)),
            "WEIGHTS" => Some(Self::Weights(index)),
            _ => None,
        }
    }

    /// Whether morph targets may have it.
    pub(super) fn is_morphable(self) -> bool {
        !matches!(self, Self::Joints(_) | Self::Weights(_))
    }

    /// Whether an accessor's format is allowed for a vertex attribute; `quantized` under KHR_mesh_quantization.
    pub(super) fn allows(self, accessor: &Accessor, quantized: bool) -> bool {
        let Accessor { shape, component, normalized, .. } = *accessor;
        let float = component == Component::F32;
        let unsigned = matches!(component, Component::U8 | Component::U16);
        let signed = matches!(component, Component::I8 | Component::I16);
        let small = unsigned || signed;
        match self {
            Self::Position => shape == Shape::Vec3 && (float || quantized && small),
            Self::Normal => shape == Shape::Vec3 && (float || quantized && signed && normalized),
            Self::Tangent => shape == Shape::Vec4 && (float || quantized && signed && normalized),
            Self::TexCoord(_) => {
                shape == Shape::Vec2 && (float || unsigned && normalized || quantized && small)
            }
            Self::Color(_) => matches!(shape, Shape::Vec3 | Shape::Vec4) && (float || unsigned && normalized),
            Self::Joints(_) => shape == Shape::Vec4 && unsigned && !normalized,
            Self::Weights(_) => shape == Shape::Vec4 && (float || unsigned && normalized),
            Self::Custom => true,
        }
    }

    /// Whether an accessor's format is allowed for a morph target's attribute.
    pub(super) fn allows_displacement(self, accessor: &Accessor, quantized: bool) -> bool {
        let Accessor { shape, component, normalized, .. } = *accessor;
        let float = component == Component::F32;
        let signed = matches!(component, Component::I8 | Component::I16);
        let small = component.size() <= 2;
        match self {
            Self::Position => shape == Shape::Vec3 && (float || quantized && signed),
            Self::Normal | Self::Tangent => {
                shape == Shape::Vec3 && (float || quantized && signed && normalized)
            }
            Self::TexCoord(_) => shape == Shape::Vec2 && (float || small && normalized || quantized && small),
            Self::Color(_) => matches!(shape, Shape::Vec3 | Shape::Vec4) && (float || small && normalized),
            Self::Joints(_) | Self::Weights(_) => false,
            Self::Custom => true,
        }
    }
}

/// A number without leading zeros.
fn parse_index(text: &str) -> Option<usize> {
    let canonical = text == "0" || (!text.starts_with('0') && text.bytes().all(|b| b.is_ascii_digit()));
    if canonical { text.parse().ok() } else { None }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_understood() {
        assert_eq!(Semantic::parse("TEXCOORD_12"), Some(Semantic::TexCoord(12)));
        assert_eq!(Semantic::parse("_x"), Some(Semantic::Custom));
        for name in
            ["", "TEXCOORD", "TEXCOORD_", "TEXCOORD_00", "TEXCOORD_+1", "COLOR_1_1", "UNKNOWN", "position"]
        {
            assert_eq!(Semantic::parse(name), None, "{name}");
        }
    }
}
