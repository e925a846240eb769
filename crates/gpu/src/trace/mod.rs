//! Tracing rays on a device, over the same page bytes as the CPU: one mesh, wholly on the device.
//!
//! The counterpart on the CPU is the closest hit of `vastlight-trace` over the layout `compact`. Triangles that a ray sees
//! so much edge-on that single precision does not settle the hit are missed here, and tested in double precision there.

use crate::error::GpuError;
use crate::kernel::{Kernel, device_struct, kernel};
use crate::limits::WORKGROUPS_PER_AXIS;
use crate::recording::{Buffer, Groups, Recording, Resident};
use crate::run::Executor;
use vastlight_accel::compact::{CompactMesh, PackedPage};
use vastlight_accel::ray::ScaledRay;
use vastlight_accel::wide::ChildRef;
use vastlight_math::Vec3;

/// Nodes that a ray can have put aside in the kernel.
pub const STACK: usize = 96;
/// Rays that a workgroup takes.
const RAYS_PER_GROUP: u32 = 64;
/// Most rays of a batch: one dispatch.
pub const MAX_RAYS: u32 = WORKGROUPS_PER_AXIS * RAYS_PER_GROUP;
/// Parameters of rays that go on for ever.
const FAR: f32 = 3e38;

device_struct! {
    struct Parameters as "Parameters" { count, root, extent }
}
kernel!(pub(crate) CLOSEST = "closest", Parameters, 5);

/// Every kernel of this module.
pub(crate) static KERNELS: [&Kernel; 1] = [&CLOSEST];

/// A mesh on the device.
#[derive(Clone, Copy, Debug)]
pub struct DeviceMesh {
    nodes: Resident,
    roots: Resident,
    pages: Resident,
    root: ChildRef,
    extent: f32,
    scale: f32,
}

impl DeviceMesh {
    /// Brings a mesh and its pages, numbered from 0, to the device.
    ///
    /// # Errors
    /// The tree is too deep, a page is missing, a binding too small for them, or memory does not suffice.
    pub fn new(executor: &mut Executor, mesh: &CompactMesh, pages: &[PackedPage]) -> Result<Self, GpuError> {
        let most = 7 * mesh.levels + 1;
        if most > STACK {
            let what = "the stack of rays in nodes".to_owned();
            return Err(GpuError::Limit { what, wanted: most as u64, limit: STACK as u64 });
        }
        let (words, starts) = page_words(pages);
        let (wanted, limit) = (4 * words.len() as u64, executor.adapter().limits.binding_bytes);
        if wanted > limit {
            return Err(GpuError::Limit { what: "the pages in bytes".to_owned(), wanted, limit });
        }
        let root = |root: &vastlight_accel::compact::PageRoot| {
            let start = starts.get(root.page as usize).map(|start| start + root.node().index() as u32);
            start.ok_or_else(|| GpuError::Rejected { reason: format!("page {} is missing", root.page) })
        };
        let roots = mesh.roots.iter().map(root).collect::<Result<Vec<u32>, _>>()?;
        let nodes = executor.keep("nodes", &mesh.nodes)?;
        let roots = executor.keep("roots", &roots).inspect_err(|_| executor.release(nodes))?;
        let pages = executor.keep("pages", &words).inspect_err(|_| {
            executor.release(nodes);
            executor.release(roots);
        })?;
        Ok(Self {
            nodes,
            roots,
            pages,
            root: mesh.root.unwrap_or(ChildRef::NONE),
            extent: mesh.extent,
            scale: mesh.scale,
        })
    }

    /// Gives its memory back.
    pub fn release(self, executor: &mut Executor) {
        [self.nodes, self.roots, self.pages].into_iter().for_each(|resident| executor.release(resident));
    }

    /// A ray in the mesh's own space as [`record_closest`] takes it, with t from 0 to `t_max`. Rays that meet nothing
    /// by definition (not finite, without direction, too far away) become rays that end before they begin.
    #[must_use]
    pub fn ray(&self, origin: Vec3, direction: Vec3, t_max: f32) -> DeviceRay {
        let scaled = ScaledRay::new(origin * self.scale, direction * self.scale);
        let fits = scaled.filter(|scaled| scaled.for_triangles(self.extent).is_some());
        let Some(scaled) = fits else {
            return DeviceRay { words: [0.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, -1.0], t_scale: 1.0 };
        };
        let (o, d) = ((origin * self.scale).to_array(), scaled.direction().to_array());
        let t_max = (t_max / scaled.t_scale).min(FAR);
        DeviceRay { words: [o[0], o[1], o[2], 0.0, d[0], d[1], d[2], t_max], t_scale: scaled.t_scale }
    }
}

/// A ray as the kernel reads it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DeviceRay {
    /// Origin and least t, direction and greatest t.
    pub words: [f32; 8],
    /// What the kernel's t are to be multiplied with: a power of two.
    pub t_scale: f32,
}

/// A hit as the kernel writes it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DeviceHit {
    /// Where along the kernel's ray.
    pub t: f32,
    /// Weights of the triangle's second and third corner.
    pub weights: [f32; 2],
    /// Number of the triangle.
    pub prim: u32,
}

impl DeviceHit {
    /// The hits, or misses, of words that a kernel wrote.
    #[must_use]
    pub fn from_words(words: &[u32]) -> Vec<Option<Self>> {
        let hit = |hit: &[u32]| Self {
            t: f32::from_bits(hit[0]),
            weights: [f32::from_bits(hit[1]), f32::from_bits(hit[2])],
            prim: hit[3],
        };
        words.chunks_exact(4).map(|words| (words[3] != u32::MAX).then(|| hit(words))).collect()
    }
}

/// Records the closest hits of `count` rays (eight words each) with a mesh; the answer is four words a ray.
///
/// # Errors
/// There are more than [`MAX_RAYS`].
pub fn record_closest(
    recording: &mut Recording,
    mesh: &DeviceMesh,
    rays: Buffer,
    count: u32,
) -> Result<Buffer, GpuError> {
    if count > MAX_RAYS {
        let what = "a batch in rays".to_owned();
        return Err(GpuError::Limit { what, wanted: count.into(), limit: MAX_RAYS.into() });
    }
    let nodes = recording.resident("nodes", mesh.nodes);
    let roots = recording.resident("roots", mesh.roots);
    let pages = recording.resident("pages", mesh.pages);
    let hits = recording.buffer("hits", 4 * u64::from(count.max(1)));
    if count == 0 {
        return Ok(hits);
    }
    let parameters = Parameters { count, root: mesh.root.0, extent: mesh.extent.to_bits() };
    let groups = Groups::Direct(count.div_ceil(RAYS_PER_GROUP));
    recording.dispatch(&CLOSEST, &parameters, &[nodes, roots, pages, rays, hits], groups);
    Ok(hits)
}

/// All pages in a row, and the word at which each starts.
fn page_words(pages: &[PackedPage]) -> (Vec<u32>, Vec<u32>) {
    let (mut words, mut starts) = (Vec::new(), Vec::new());
    for page in pages {
        starts.push(words.len() as u32);
        let (whole, rest) = page.bytes.split_at(page.bytes.len() / 4 * 4);
        words.extend(bytemuck::pod_collect_to_vec::<u8, u32>(whole));
        let mut last = [0; 4];
        last[..rest.len()].copy_from_slice(rest);
        words.push(u32::from_le_bytes(last));
    }
    (words, starts)
}
