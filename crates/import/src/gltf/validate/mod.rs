//! The checks of the specification. Findings carry the codes of the Khronos glTF validator; errors are what it calls
//! errors, its warnings are warnings here where they concern a picture, its hints are left out.

mod animations;
mod data;
mod document;
mod layout;
mod mesh_data;
mod meshes;
mod nodes;
mod objects;
mod schema;
mod semantics;
mod skins;
mod tables;
mod tables_extensions;

use super::accessor::Data;
use super::findings::Findings;
use super::json::Json;

/// Checks types, ranges, required properties, and references.
pub(super) fn check_schema(root: &Json<'_>, findings: &mut Findings) {
    schema::check(root, &tables::DOCUMENT, findings);
    document::check(root, findings);
}

/// Checks what the parts of a document say about each other.
pub(super) fn check_rules(root: &Json<'_>, data: &Data, findings: &mut Findings) {
    let lengths = layout::buffer_lengths(root);
    layout::check_views(root, data, &lengths, findings);
    layout::check_accessors(root, data, findings);
    objects::check(root, data, findings);
    let mut usages = layout::Usages::new(root, data);
    meshes::check(root, data, &mut usages, findings);
    skins::check(root, data, &mut usages, findings);
    animations::check(root, data, &mut usages, findings);
    nodes::check(root, findings);
}

/// Checks the values that accessors hold.
pub(super) fn check_data(root: &Json<'_>, data: &Data, findings: &mut Findings) {
    data::check(root, data, findings);
    mesh_data::check(root, data, findings);
    skins::check_data(root, data, findings);
    animations::check_data(root, data, findings);
}
