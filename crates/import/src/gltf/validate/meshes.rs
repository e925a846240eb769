//! Checks of meshes: attributes and their formats, indices, morph targets, texture coordinates that materials need.

use super::layout::{Usage, Usages};
use super::schema::pointer;
use super::semantics::Semantic;
use crate::gltf::accessor::Data;
use crate::gltf::findings::Findings;
use crate::gltf::json::Json;
use crate::gltf::model::{Accessor, Component, Shape};

struct Checker<'a> {
    root: &'a Json<'a>,
    data: &'a Data,
    usages: &'a mut Usages,
    findings: &'a mut Findings,
    quantized: bool,
    /// Texture coordinates that each material needs, with the name of the texture.
    needed_uvs: Vec<Vec<(usize, String)>>,
}

/// Checks all meshes.
pub(super) fn check(root: &Json<'_>, data: &Data, usages: &mut Usages, findings: &mut Findings) {
    let quantized = root.list("extensionsUsed").iter().any(|e| e.text() == Some("KHR_mesh_quantization"));
    let needed_uvs = root.list("materials").iter().map(needed_uvs).collect();
    let mut checker = Checker { root, data, usages, findings, quantized, needed_uvs };
    for (i, mesh) in root.list("meshes").iter().enumerate() {
        checker.mesh(mesh, &format!("/meshes/{i}"));
    }
}

impl Checker<'_> {
    fn error(&mut self, code: &'static str, what: impl Into<String>, place: &str) {
        self.findings.error(code, what, place, "");
    }

    fn mesh(&mut self, mesh: &Json<'_>, place: &str) {
        let primitives = mesh.list("primitives");
        let targets = primitives.first().map_or(0, |p| p.list("targets").len());
        for (i, primitive) in primitives.iter().enumerate() {
            let place = format!("{place}/primitives/{i}");
            if primitive.list("targets").len() != targets {
                let what = "all primitives of a mesh need the same number of morph targets";
                self.error("MESH_PRIMITIVES_UNEQUAL_TARGETS_COUNT", what, &place);
            }
            self.primitive(primitive, &place);
        }
        let weights = mesh.list("weights").len();
        if weights != 0 && weights != targets {
            let what = format!("there are {weights} weights for {targets} morph targets");
            self.error("MESH_INVALID_WEIGHTS_COUNT", what, &format!("{place}/weights"));
        }
    }

    fn primitive(&mut self, primitive: &Json<'_>, place: &str) {
        let attributes = primitive.at("attributes");
        self.names(attributes, &format!("{place}/attributes"));
        let mut count = None;
        for (name, value) in attributes.members() {
            let place = pointer(&format!("{place}/attributes"), name);
            let Some((index, accessor)) = self.accessor(value) else { continue };
            if let Some(semantic) = Semantic::parse(name) {
                self.attribute(semantic, index, &accessor, &place);
            }
            if *count.get_or_insert(accessor.count) != accessor.count {
                let what = "all attributes of a primitive need the same count";
                self.error("MESH_PRIMITIVE_UNEQUAL_ACCESSOR_COUNT", what, &place);
            }
        }
        self.indices(primitive, count, place);
        self.targets(primitive, place);
        self.material(primitive, place);
    }

    fn accessor(&self, value: &Json<'_>) -> Option<(usize, Accessor)> {
        let index = value.integer()?;
        Some((index, *self.data.accessor(index)?))
    }

    /// Names are known, numbered without gaps, and complete.
    fn names(&mut self, attributes: &Json<'_>, place: &str) {
        for (name, _) in attributes.members() {
            if Semantic::parse(name).is_none() {
                let hint = "own attributes start with an underscore";
                let what = format!("\"{name}\" is no name of an attribute");
                self.findings.error("MESH_PRIMITIVE_INVALID_ATTRIBUTE", what, &pointer(place, name), hint);
            }
        }
        if attributes.members().is_empty() {
            return;
        }
        if attributes.get("POSITION").is_none() {
            let what = "the primitive has no positions";
            self.findings.warn("MESH_PRIMITIVE_NO_POSITION", what, place, "it is left out");
        }
        if attributes.get("TANGENT").is_some() && attributes.get("NORMAL").is_none() {
            let what = "there are tangents without normals";
            let place = format!("{place}/TANGENT");
            self.findings.warn("MESH_PRIMITIVE_TANGENT_WITHOUT_NORMAL", what, &place, "they are ignored");
        }
        for word in ["TEXCOORD", "COLOR", "JOINTS", "WEIGHTS"] {
            let numbers = numbers_of(attributes, word);
            if numbers.iter().enumerate().any(|(i, n)| i != *n) {
                let what = format!("the numbers of {word}_n do not go on from 0 without a gap");
                self.error("MESH_PRIMITIVE_INDEXED_SEMANTIC_CONTINUITY", what, place);
            }
        }
        let (joints, weights) =
            (numbers_of(attributes, "JOINTS").len(), numbers_of(attributes, "WEIGHTS").len());
        if joints != weights {
            let what = format!("there are {joints} sets of joints and {weights} of weights");
            self.error("MESH_PRIMITIVE_JOINTS_WEIGHTS_MISMATCH", what, place);
        }
    }

    fn attribute(&mut self, semantic: Semantic, index: usize, accessor: &Accessor, place: &str) {
        self.usages.note(index, accessor, Usage::Vertices, place, self.findings);
        if semantic == Semantic::Position {
            self.bounds(index, place);
        }
        if !semantic.allows(accessor, self.quantized) {
            let what = format!("the format {} is not allowed here", accessor.format());
            self.error("MESH_PRIMITIVE_ATTRIBUTES_ACCESSOR_INVALID_FORMAT", what, place);
        } else if accessor.component == Component::U32 {
            let what = "vertex attributes cannot be UNSIGNED_INT";
            self.error("MESH_PRIMITIVE_ATTRIBUTES_ACCESSOR_UNSIGNED_INT", what, place);
        }
        self.vertex_layout(index, accessor, place);
    }

    fn bounds(&mut self, index: usize, place: &str) {
        let json = &self.root.list("accessors")[index];
        if json.get("min").is_none() || json.get("max").is_none() {
            let what = "accessors of positions need min and max";
            self.error("MESH_PRIMITIVE_POSITION_ACCESSOR_WITHOUT_BOUNDS", what, place);
        }
    }

    fn vertex_layout(&mut self, index: usize, accessor: &Accessor, place: &str) {
        let Some(view) = accessor.view.and_then(|v| self.data.view(v)) else { return };
        let step = view.stride.unwrap_or(accessor.element_size());
        if !accessor.offset.is_multiple_of(4) || !step.is_multiple_of(4) {
            let what = "vertex attributes start at multiples of 4 bytes";
            self.error("MESH_PRIMITIVE_ACCESSOR_UNALIGNED", what, place);
        }
        if !self.usages.note_vertices(index, accessor, self.data) {
            let what = "a view with several vertex attributes needs a byteStride";
            self.error("MESH_PRIMITIVE_ACCESSOR_WITHOUT_BYTESTRIDE", what, place);
        }
    }

    fn indices(&mut self, primitive: &Json<'_>, vertices: Option<usize>, place: &str) {
        let indices = primitive.get("indices").map(|value| self.accessor(value));
        let corners = match indices {
            Some(Some((index, accessor))) => {
                self.index_accessor(index, &accessor, &format!("{place}/indices"));
                accessor.count
            }
            Some(None) => return,
            None => match vertices {
                Some(count) => count,
                None => return,
            },
        };
        let fits = match primitive.index("mode").unwrap_or(4) {
            1 => corners >= 2 && corners.is_multiple_of(2),
            2 | 3 => corners >= 2,
            4 => corners >= 3 && corners.is_multiple_of(3),
            5 | 6 => corners >= 3,
            _ => true,
        };
        if !fits {
            let what = format!("{corners} vertices or indices do not suit the mode");
            self.findings.warn(
                "MESH_PRIMITIVE_INCOMPATIBLE_MODE",
                what,
                place,
                "the incomplete rest is left out",
            );
        }
    }

    fn index_accessor(&mut self, index: usize, accessor: &Accessor, place: &str) {
        self.usages.note(index, accessor, Usage::Indices, place, self.findings);
        let unsigned = matches!(accessor.component, Component::U8 | Component::U16 | Component::U32);
        if accessor.shape != Shape::Scalar || !unsigned || accessor.normalized {
            let what = format!("the format {} is not allowed for indices", accessor.format());
            self.error("MESH_PRIMITIVE_INDICES_ACCESSOR_INVALID_FORMAT", what, place);
        }
        if accessor.view.and_then(|v| self.data.view(v)).is_some_and(|v| v.stride.is_some()) {
            let what = "the view of indices must not have a byteStride";
            self.error("MESH_PRIMITIVE_INDICES_ACCESSOR_WITH_BYTESTRIDE", what, place);
        }
    }

    fn targets(&mut self, primitive: &Json<'_>, place: &str) {
        for (i, target) in primitive.list("targets").iter().enumerate() {
            for (name, value) in target.members() {
                let place = pointer(&format!("{place}/targets/{i}"), name);
                self.target_attribute(primitive, name, value, &place);
            }
        }
    }

    fn target_attribute(&mut self, primitive: &Json<'_>, name: &str, value: &Json<'_>, place: &str) {
        let semantic = Semantic::parse(name).filter(|s| s.is_morphable());
        if semantic.is_none() {
            self.error("MESH_PRIMITIVE_INVALID_ATTRIBUTE", format!("\"{name}\" cannot be morphed"), place);
        }
        let base = primitive.at("attributes").get(name);
        if base.is_none() {
            let what = format!("the primitive itself has no {name}");
            self.error("MESH_PRIMITIVE_MORPH_TARGET_NO_BASE_ACCESSOR", what, place);
        }
        let Some((index, accessor)) = self.accessor(value) else { return };
        self.usages.note(index, &accessor, Usage::Vertices, place, self.findings);
        if let Some(semantic) = semantic {
            if semantic == Semantic::Position {
                self.bounds(index, place);
            }
            if !semantic.allows_displacement(&accessor, self.quantized) {
                let what = format!("the format {} is not allowed here", accessor.format());
                self.error("MESH_PRIMITIVE_ATTRIBUTES_ACCESSOR_INVALID_FORMAT", what, place);
            }
            self.vertex_layout(index, &accessor, place);
        }
        if base.and_then(|b| self.accessor(b)).is_some_and(|(_, b)| b.count != accessor.count) {
            let what = "the count differs from that of the primitive's own attribute";
            self.error("MESH_PRIMITIVE_MORPH_TARGET_INVALID_ATTRIBUTE_COUNT", what, place);
        }
    }

    fn material(&mut self, primitive: &Json<'_>, place: &str) {
        let Some(needed) = primitive.index("material").and_then(|m| self.needed_uvs.get(m)) else { return };
        let sets = numbers_of(primitive.at("attributes"), "TEXCOORD");
        for (set, texture) in needed {
            if !sets.contains(set) {
                let what =
                    format!("the material's {texture} needs TEXCOORD_{set}, which the primitive lacks");
                self.findings.error(
                    "MESH_PRIMITIVE_TOO_FEW_TEXCOORDS",
                    what,
                    &format!("{place}/material"),
                    "",
                );
            }
        }
    }
}

/// The numbers of attributes `WORD_n`, sorted.
fn numbers_of(attributes: &Json<'_>, word: &str) -> Vec<usize> {
    let number = |semantic| match semantic {
        Semantic::TexCoord(n) if word == "TEXCOORD" => Some(n),
        Semantic::Color(n) if word == "COLOR" => Some(n),
        Semantic::Joints(n) if word == "JOINTS" => Some(n),
        Semantic::Weights(n) if word == "WEIGHTS" => Some(n),
        _ => None,
    };
    let names = attributes.members().iter().filter_map(|(name, _)| Semantic::parse(name));
    let mut numbers: Vec<usize> = names.filter_map(number).collect();
    numbers.sort_unstable();
    numbers
}

/// Texture coordinate sets that a material's textures use, those of its extensions included.
fn needed_uvs(material: &Json<'_>) -> Vec<(usize, String)> {
    let mut needed = Vec::new();
    collect_uvs(material, 0, &mut needed);
    needed
}

fn collect_uvs(json: &Json<'_>, depth: usize, needed: &mut Vec<(usize, String)>) {
    const DEPTH: usize = 4;
    for (name, value) in json.members() {
        if value.index("index").is_some() && name.ends_with("Texture") {
            let transform = value.extension("KHR_texture_transform");
            let set = transform.and_then(|t| t.index("texCoord")).or_else(|| value.index("texCoord"));
            needed.push((set.unwrap_or(0), name.to_string()));
        } else if depth < DEPTH && name != "extras" {
            collect_uvs(value, depth + 1, needed);
        }
    }
}
