//! Checks of buffer views and accessors: bounds, alignment, strides, and what a view is used for.

use crate::gltf::accessor::Data;
use crate::gltf::findings::Findings;
use crate::gltf::json::Json;
use crate::gltf::model::{Accessor, Component, View};

/// The declared length of each buffer.
pub(super) fn buffer_lengths(root: &Json<'_>) -> Vec<Option<usize>> {
    root.list("buffers").iter().map(|b| b.index("byteLength")).collect()
}

/// Views lie within their buffers.
pub(super) fn check_views(root: &Json<'_>, data: &Data, lengths: &[Option<usize>], findings: &mut Findings) {
    for (i, json) in root.list("bufferViews").iter().enumerate() {
        let Some(view) = data.view(i) else { continue };
        let place = format!("/bufferViews/{i}");
        check_view(json, view, lengths.get(view.buffer).copied().flatten(), &place, findings);
    }
}

fn check_view(json: &Json<'_>, view: &View, length: Option<usize>, place: &str, findings: &mut Findings) {
    if let Some(length) = length {
        let what = format!("the view does not fit buffer {} of {length} bytes", view.buffer);
        if view.offset >= length {
            findings.error("BUFFER_VIEW_TOO_LONG", what, &format!("{place}/byteOffset"), "");
        } else if view.length > length - view.offset {
            findings.error("BUFFER_VIEW_TOO_LONG", what, &format!("{place}/byteLength"), "");
        }
    }
    let Some(stride) = view.stride else { return };
    let place = format!("{place}/byteStride");
    if !stride.is_multiple_of(4) {
        findings.error("VALUE_MULTIPLE_OF", format!("{stride} is not a multiple of 4"), &place, "");
    }
    if stride > view.length {
        let what = format!("the stride {stride} is greater than the view's length {}", view.length);
        findings.error("BUFFER_VIEW_TOO_BIG_BYTE_STRIDE", what, &place, "");
    }
    if json.index("target") == Some(34963) {
        stride_not_allowed(&place, findings);
    }
}

fn stride_not_allowed(place: &str, findings: &mut Findings) {
    let what = "only views of vertex attributes may have a byteStride";
    findings.error("BUFFER_VIEW_INVALID_BYTE_STRIDE", what, place, "");
}

/// Accessors lie within their views, aligned, and their sparse parts too.
pub(super) fn check_accessors(root: &Json<'_>, data: &Data, findings: &mut Findings) {
    for (i, json) in root.list("accessors").iter().enumerate() {
        let Some(accessor) = data.accessor(i) else { continue };
        let place = format!("/accessors/{i}");
        check_form(json, accessor, &place, findings);
        if let Some((number, view)) = accessor.view.and_then(|v| Some((v, data.view(v)?))) {
            check_stride(accessor, view, &place, findings);
            check_alignment(accessor, view, &place, findings);
            check_fit(accessor, view, number, &place, findings);
        }
        check_sparse(accessor, data, &place, findings);
    }
}

fn check_form(json: &Json<'_>, accessor: &Accessor, place: &str, findings: &mut Findings) {
    if accessor.normalized && matches!(accessor.component, Component::F32 | Component::U32) {
        let what = format!("{} cannot be normalized", accessor.component.name());
        findings.error("ACCESSOR_NORMALIZED_INVALID", what, &format!("{place}/normalized"), "");
    }
    for key in ["min", "max"] {
        let length = json.list(key).len();
        if length != 0 && length != accessor.shape.components() {
            let what = format!("{length} values for {} components", accessor.shape.components());
            findings.error("ARRAY_LENGTH_NOT_IN_LIST", what, &format!("{place}/{key}"), "");
        }
    }
}

fn check_stride(accessor: &Accessor, view: &View, place: &str, findings: &mut Findings) {
    let size = accessor.element_size();
    if let Some(stride) = view.stride
        && stride < size
    {
        let what = format!("the view's stride {stride} is less than the size of an element, {size}");
        findings.error("ACCESSOR_SMALL_BYTESTRIDE", what, place, "");
    }
}

fn check_alignment(accessor: &Accessor, view: &View, place: &str, findings: &mut Findings) {
    let size = accessor.component.size();
    if accessor.shape.is_matrix() && !accessor.offset.is_multiple_of(4) {
        let what = "matrices start at multiples of 4 bytes";
        findings.error("ACCESSOR_MATRIX_ALIGNMENT", what, &format!("{place}/byteOffset"), "");
        return;
    }
    if !accessor.offset.is_multiple_of(size) {
        let what = format!("the offset {} is not a multiple of the component's size {size}", accessor.offset);
        findings.error("ACCESSOR_OFFSET_ALIGNMENT", what, &format!("{place}/byteOffset"), "");
    }
    let total = view.offset.saturating_add(accessor.offset);
    if !total.is_multiple_of(size) {
        let what =
            format!("the offset {total} within the buffer is not a multiple of the component's size {size}");
        findings.error("ACCESSOR_TOTAL_OFFSET_ALIGNMENT", what, place, "");
    }
}

fn check_fit(accessor: &Accessor, view: &View, number: usize, place: &str, findings: &mut Findings) {
    let stride = view.stride.unwrap_or(accessor.element_size());
    let span = accessor.count.saturating_sub(1).saturating_mul(stride).saturating_add(accessor.tight_size());
    if accessor.offset.saturating_add(span) > view.length {
        let what = format!(
            "{} elements from byte {} on take {span} bytes, buffer view {number} has {}",
            accessor.count, accessor.offset, view.length
        );
        findings.error("ACCESSOR_TOO_LONG", what, place, "");
    }
}

fn check_sparse(accessor: &Accessor, data: &Data, place: &str, findings: &mut Findings) {
    let Some(sparse) = &accessor.sparse else { return };
    if sparse.count > accessor.count {
        let what = format!("{} elements of {} are replaced", sparse.count, accessor.count);
        findings.error("ACCESSOR_SPARSE_COUNT_OUT_OF_RANGE", what, &format!("{place}/sparse/count"), "");
    }
    let parts = [
        ("indices", sparse.index_view, sparse.index_offset, sparse.index_component.size()),
        ("values", sparse.value_view, sparse.value_offset, accessor.element_size()),
    ];
    for (key, number, offset, size) in parts {
        let Some(view) = data.view(number) else { continue };
        let place = format!("{place}/sparse/{key}");
        if view.stride.is_some() {
            stride_not_allowed(&format!("{place}/bufferView"), findings);
        }
        if offset.saturating_add(sparse.count.saturating_mul(size)) > view.length {
            let what = format!("the values do not fit buffer view {number} of {} bytes", view.length);
            findings.error("ACCESSOR_TOO_LONG", what, &place, "");
        }
        let component = if key == "indices" { size } else { accessor.component.size() };
        if !view.offset.saturating_add(offset).is_multiple_of(component) {
            let what = format!("the offset is not a multiple of the component's size {component}");
            findings.error("ACCESSOR_TOTAL_OFFSET_ALIGNMENT", what, &place, "");
        }
    }
}

/// What the data of a view, or of an accessor, is used for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Usage {
    Vertices,
    Indices,
    InverseBindMatrices,
    Animation,
}

impl Usage {
    fn name(self) -> &'static str {
        match self {
            Self::Vertices => "vertex attributes",
            Self::Indices => "vertex indices",
            Self::InverseBindMatrices => "inverse bind matrices",
            Self::Animation => "animation",
        }
    }
}

/// The first use of each view and accessor; later ones must agree.
#[derive(Debug)]
pub(super) struct Usages {
    views: Vec<Option<Usage>>,
    accessors: Vec<Option<Usage>>,
    /// First accessor with vertex attributes in each view.
    first_accessor: Vec<Option<usize>>,
}

impl Usages {
    /// Starts with what `bufferView.target` says.
    pub(super) fn new(root: &Json<'_>, data: &Data) -> Self {
        let target = |json: &Json<'_>| match json.index("target") {
            Some(34962) => Some(Usage::Vertices),
            Some(34963) => Some(Usage::Indices),
            _ => None,
        };
        let views: Vec<Option<Usage>> = root.list("bufferViews").iter().map(target).collect();
        Self {
            first_accessor: vec![None; views.len()],
            views,
            accessors: vec![None; data.accessors().count()],
        }
    }

    /// Notes a use; a contradiction is an error.
    pub(super) fn note(
        &mut self,
        index: usize,
        accessor: &Accessor,
        usage: Usage,
        place: &str,
        findings: &mut Findings,
    ) {
        let earlier = self.accessors.get_mut(index).map_or(usage, |slot| *slot.get_or_insert(usage));
        if earlier != usage {
            let what = format!("accessor {index} is used for {} and for {}", earlier.name(), usage.name());
            findings.error("ACCESSOR_USAGE_OVERRIDE", what, place, "");
        }
        let Some(view) = accessor.view else { return };
        let earlier = self.views.get_mut(view).map_or(usage, |slot| *slot.get_or_insert(usage));
        if earlier != usage {
            let what = format!("buffer view {view} is for {} and for {}", earlier.name(), usage.name());
            findings.error("BUFFER_VIEW_TARGET_OVERRIDE", what, place, "");
        }
    }

    /// Notes vertex attributes in a view; a second accessor there needs the view to have a stride.
    pub(super) fn note_vertices(&mut self, index: usize, accessor: &Accessor, data: &Data) -> bool {
        let Some(view) = accessor.view else { return true };
        let Some(slot) = self.first_accessor.get_mut(view) else { return true };
        *slot.get_or_insert(index) == index || data.view(view).is_none_or(|v| v.stride.is_some())
    }
}
