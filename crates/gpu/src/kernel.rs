//! Kernels: their WGSL, put together from shared parts, and what they expect.
//!
//! A line `//#include NAME` stands for the shared part of that name, which is put in once.

use crate::{build, page, path, photon, primitives, trace};

/// A kernel: one file of `wgsl/` with one entry point, `main`.
#[derive(Debug, PartialEq, Eq)]
pub struct Kernel {
    /// The name of its file, without the ending.
    pub name: &'static str,
    /// Its text, before shared parts are put in.
    pub source: &'static str,
    /// Its parameters: binding 0, uniform.
    pub parameters: &'static StructLayout,
    /// How many storage buffers it sees: bindings 1, 2, ...
    pub buffers: usize,
}

/// How a struct that both sides know lies in memory.
#[derive(Debug, PartialEq, Eq)]
pub struct StructLayout {
    /// Its name in WGSL.
    pub name: &'static str,
    /// Its size.
    pub bytes: usize,
    /// Name, offset and size of each field.
    pub fields: &'static [(&'static str, usize, usize)],
}

/// Declares a struct of u32 as it lies in memory, and its layout for the comparison with naga's.
macro_rules! device_struct {
    ($(#[$meta:meta])* $visibility:vis struct $name:ident as $wgsl:literal { $($(#[$doc:meta])* $field:ident),+ $(,)? }) => {
        $(#[$meta])*
        #[repr(C)]
        #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, bytemuck::Pod, bytemuck::Zeroable)]
        $visibility struct $name { $($(#[$doc])* $visibility $field: u32,)+ }

        impl $name {
            /// As it lies in memory.
            $visibility const LAYOUT: $crate::kernel::StructLayout = $crate::kernel::StructLayout {
                name: $wgsl,
                bytes: size_of::<Self>(),
                fields: &[$((stringify!($field), core::mem::offset_of!($name, $field), 4)),+],
            };
        }
    };
}
pub(crate) use device_struct;

/// Declares a kernel from its file.
macro_rules! kernel {
    ($visibility:vis $constant:ident = $name:literal, $parameters:ty, $buffers:literal) => {
        $visibility static $constant: $crate::kernel::Kernel = $crate::kernel::Kernel {
            name: $name,
            source: include_str!(concat!("../wgsl/", $name, ".wgsl")),
            parameters: &<$parameters>::LAYOUT,
            buffers: $buffers,
        };
    };
}
pub(crate) use kernel;

/// Parts that several kernels share.
const SHARED: &[(&str, &str)] = &[
    ("accept_all", include_str!("wgsl/shared/accept_all.wgsl")),
    ("box_sides", include_str!("wgsl/shared/box_sides.wgsl")),
    ("boxes", include_str!("wgsl/shared/boxes.wgsl")),
    ("bsdf", include_str!("wgsl/shared/path/bsdf.wgsl")),
    ("bsdf/albedo", include_str!("wgsl/shared/path/bsdf/albedo.wgsl")),
    ("bsdf/coat", include_str!("wgsl/shared/path/bsdf/coat.wgsl")),
    ("bsdf/cosine", include_str!("wgsl/shared/path/bsdf/cosine.wgsl")),
    ("bsdf/focus", include_str!("wgsl/shared/path/bsdf/focus.wgsl")),
    ("bsdf/fresnel", include_str!("wgsl/shared/path/bsdf/fresnel.wgsl")),
    ("bsdf/ggx", include_str!("wgsl/shared/path/bsdf/ggx.wgsl")),
    ("bsdf/interface", include_str!("wgsl/shared/path/bsdf/interface.wgsl")),
    ("bsdf/iridescence", include_str!("wgsl/shared/path/bsdf/iridescence.wgsl")),
    ("bsdf/lambert", include_str!("wgsl/shared/path/bsdf/lambert.wgsl")),
    ("bsdf/layered", include_str!("wgsl/shared/path/bsdf/layered.wgsl")),
    ("bsdf/numbers", include_str!("wgsl/shared/path/bsdf/numbers.wgsl")),
    ("bsdf/reflectance", include_str!("wgsl/shared/path/bsdf/reflectance.wgsl")),
    ("bsdf/sheen", include_str!("wgsl/shared/path/bsdf/sheen.wgsl")),
    ("bsdf_params", include_str!("wgsl/shared/path/bsdf_params.wgsl")),
    ("cell_sizes", include_str!("wgsl/shared/cell_sizes.wgsl")),
    ("closest_answer", include_str!("wgsl/shared/closest_answer.wgsl")),
    ("clusters", include_str!("wgsl/shared/clusters.wgsl")),
    ("compact", include_str!("wgsl/shared/compact.wgsl")),
    ("doubled_centre", include_str!("wgsl/shared/doubled_centre.wgsl")),
    ("frame", include_str!("wgsl/shared/path/frame.wgsl")),
    ("group", include_str!("wgsl/shared/group.wgsl")),
    ("group_scan", include_str!("wgsl/shared/group_scan.wgsl")),
    ("instance_ray", include_str!("wgsl/shared/instance_ray.wgsl")),
    ("kd", include_str!("wgsl/shared/kd.wgsl")),
    ("kd_leaf", include_str!("wgsl/shared/kd_leaf.wgsl")),
    ("layouts", include_str!("wgsl/shared/path/layouts.wgsl")),
    ("light_environment", include_str!("wgsl/shared/path/light_environment.wgsl")),
    ("light_grid", include_str!("wgsl/shared/path/light_grid.wgsl")),
    ("light_ies", include_str!("wgsl/shared/path/light_ies.wgsl")),
    ("light_local", include_str!("wgsl/shared/path/light_local.wgsl")),
    ("light_node", include_str!("wgsl/shared/path/light_node.wgsl")),
    ("light_punctual", include_str!("wgsl/shared/path/light_punctual.wgsl")),
    ("light_sample", include_str!("wgsl/shared/path/light_sample.wgsl")),
    ("light_surfaces", include_str!("wgsl/shared/path/light_surfaces.wgsl")),
    ("light_tree", include_str!("wgsl/shared/path/light_tree.wgsl")),
    ("light_triangle", include_str!("wgsl/shared/path/light_triangle.wgsl")),
    ("light_words", include_str!("wgsl/shared/path/light_words.wgsl")),
    ("lights", include_str!("wgsl/shared/path/lights.wgsl")),
    ("material", include_str!("wgsl/shared/path/material.wgsl")),
    ("medium", include_str!("wgsl/shared/path/medium.wgsl")),
    ("morton", include_str!("wgsl/shared/morton.wgsl")),
    ("occluded_answer", include_str!("wgsl/shared/occluded_answer.wgsl")),
    ("page", include_str!("wgsl/shared/page.wgsl")),
    ("page_table", include_str!("wgsl/shared/page_table.wgsl")),
    ("page_words", include_str!("wgsl/shared/page_words.wgsl")),
    ("path_queues", include_str!("wgsl/shared/path/path_queues.wgsl")),
    ("path_rays", include_str!("wgsl/shared/path/path_rays.wgsl")),
    ("path_start", include_str!("wgsl/shared/path/path_start.wgsl")),
    ("path_state", include_str!("wgsl/shared/path/path_state.wgsl")),
    ("path_walk", include_str!("wgsl/shared/path/path_walk.wgsl")),
    ("path_walk_settled", include_str!("wgsl/shared/path/path_walk_settled.wgsl")),
    ("phong", include_str!("wgsl/shared/path/phong.wgsl")),
    ("photon_direction", include_str!("wgsl/shared/photon/photon_direction.wgsl")),
    ("photon_flight", include_str!("wgsl/shared/photon/photon_flight.wgsl")),
    ("photon_gather", include_str!("wgsl/shared/photon/photon_gather.wgsl")),
    ("photon_grid", include_str!("wgsl/shared/photon/photon_grid.wgsl")),
    ("photon_kept", include_str!("wgsl/shared/photon/photon_kept.wgsl")),
    ("photon_words", include_str!("wgsl/shared/photon/photon_words.wgsl")),
    ("place_of", include_str!("wgsl/shared/place_of.wgsl")),
    ("pool", include_str!("wgsl/shared/pool.wgsl")),
    ("pool_one", include_str!("wgsl/shared/pool_one.wgsl")),
    ("pyramid", include_str!("wgsl/shared/pyramid.wgsl")),
    ("queue", include_str!("wgsl/shared/queue.wgsl")),
    ("quotient", include_str!("wgsl/shared/quotient.wgsl")),
    ("radix", include_str!("wgsl/shared/radix.wgsl")),
    ("radix_emit", include_str!("wgsl/shared/radix_emit.wgsl")),
    ("radix_rank", include_str!("wgsl/shared/radix_rank.wgsl")),
    ("random", include_str!("wgsl/shared/path/random.wgsl")),
    ("range_box", include_str!("wgsl/shared/range_box.wgsl")),
    ("ray", include_str!("wgsl/shared/ray.wgsl")),
    ("ray_batch", include_str!("wgsl/shared/ray_batch.wgsl")),
    ("ray_batch_first", include_str!("wgsl/shared/ray_batch_first.wgsl")),
    ("ray_batch_left", include_str!("wgsl/shared/ray_batch_left.wgsl")),
    ("real", include_str!("wgsl/shared/path/real.wgsl")),
    ("records", include_str!("wgsl/shared/path/records.wgsl")),
    ("region", include_str!("wgsl/shared/region.wgsl")),
    ("region_cells", include_str!("wgsl/shared/region_cells.wgsl")),
    ("region_codes", include_str!("wgsl/shared/region_codes.wgsl")),
    ("runs", include_str!("wgsl/shared/runs.wgsl")),
    ("select_count", include_str!("wgsl/shared/select_count.wgsl")),
    ("select_emit", include_str!("wgsl/shared/select_emit.wgsl")),
    ("settled", include_str!("wgsl/shared/settled.wgsl")),
    ("shading", include_str!("wgsl/shared/path/shading.wgsl")),
    ("splits", include_str!("wgsl/shared/splits.wgsl")),
    ("stream_leaf", include_str!("wgsl/shared/path/stream_leaf.wgsl")),
    ("stream_put", include_str!("wgsl/shared/path/stream_put.wgsl")),
    ("stream_state", include_str!("wgsl/shared/path/stream_state.wgsl")),
    ("stream_sum", include_str!("wgsl/shared/path/stream_sum.wgsl")),
    ("stream_walk", include_str!("wgsl/shared/path/stream_walk.wgsl")),
    ("surface", include_str!("wgsl/shared/path/surface.wgsl")),
    ("table_access", include_str!("wgsl/shared/path/table_access.wgsl")),
    ("tables", include_str!("wgsl/shared/path/tables.wgsl")),
    ("tested", include_str!("wgsl/shared/path/tested.wgsl")),
    ("texture", include_str!("wgsl/shared/path/texture.wgsl")),
    ("tree_node", include_str!("wgsl/shared/tree_node.wgsl")),
    ("unsettled", include_str!("wgsl/shared/unsettled.wgsl")),
    ("veils", include_str!("wgsl/shared/path/veils.wgsl")),
    ("vertex", include_str!("wgsl/shared/path/vertex.wgsl")),
    ("walk", include_str!("wgsl/shared/walk.wgsl")),
    ("warp", include_str!("wgsl/shared/path/warp.wgsl")),
    ("whole_numbers", include_str!("wgsl/shared/whole_numbers.wgsl")),
    ("wide_number", include_str!("wgsl/shared/wide_number.wgsl")),
    ("wide_slots", include_str!("wgsl/shared/wide_slots.wgsl")),
];

/// Every kernel.
#[must_use]
pub fn all() -> Vec<&'static Kernel> {
    [
        &primitives::KERNELS[..],
        &trace::KERNELS,
        &path::KERNELS,
        &path::STREAM_KERNELS,
        &path::PHOTON_KERNELS,
        &page::KERNELS,
        &photon::KERNELS,
        &build::KERNELS,
    ]
    .concat()
}

impl Kernel {
    /// The whole text, shared parts put in; a part that does not exist stays a comment, and what it defines is missing.
    #[must_use]
    pub fn wgsl(&self) -> String {
        let (mut text, mut done) = (String::new(), Vec::new());
        compose(self.source, &mut text, &mut done);
        text
    }
}

fn compose(source: &str, text: &mut String, done: &mut Vec<&'static str>) {
    for line in source.lines() {
        let name = line.strip_prefix("//#include ").map(str::trim);
        if let Some((name, part)) = SHARED.iter().find(|(part, _)| Some(*part) == name) {
            if !done.contains(name) {
                done.push(name);
                compose(part, text, done);
            }
        } else {
            text.push_str(line);
            text.push('\n');
        }
    }
}
