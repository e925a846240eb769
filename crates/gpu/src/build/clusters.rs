//! Trees over precomputed clusters of triangles ([`Clusters`]) on the device: the clusters' boxes of a frame, over which any builder
//! builds. K. V. Garanzha's thesis of 2014, chapter 3.

use super::{Builder, DeviceTree, Stages, boxes, check_fits};
use crate::error::GpuError;
use crate::kernel::{device_struct, kernel};
use crate::primitives::GROUP;
use crate::recording::{Buffer, Groups, Recording};
use vastlight_accel::Clusters;

device_struct! {
    struct Parameters as "Parameters" { count }
}
kernel!(pub(crate) CLUSTERS = "build_clusters", Parameters, 4);

/// Clusters on the device, uploaded once for all frames.
#[derive(Clone, Copy, Debug)]
pub struct DeviceClusters {
    /// Where each cluster's triangles start in `order`, and the end of all.
    pub first: Buffer,
    /// Triangles by cluster.
    pub order: Buffer,
    /// Clusters.
    pub count: u32,
}

/// The words of [`DeviceClusters::first`] and [`DeviceClusters::order`].
#[must_use]
pub fn words(clusters: &Clusters) -> [Vec<u32>; 2] {
    let (mut first, mut order) = (vec![0], Vec::with_capacity(clusters.of_triangle().len()));
    for cluster in 0..clusters.len() as u32 {
        order.extend_from_slice(clusters.triangles(cluster));
        first.push(order.len() as u32);
    }
    [first, order]
}

/// The boxes of clusters over boxes of triangles, both in words; what [`record_boxes`] gives.
#[must_use]
pub fn cluster_boxes(clusters: &Clusters, triangles: &[u32]) -> Vec<u32> {
    let of_triangle = |&t: &u32| triangles.as_chunks::<6>().0[t as usize];
    let of_cluster =
        |cluster| clusters.triangles(cluster).iter().map(of_triangle).fold(boxes::EMPTY, boxes::join);
    (0..clusters.len() as u32).flat_map(of_cluster).collect()
}

/// Records the boxes of clusters over the boxes of their triangles.
///
/// # Errors
/// There are too many.
pub fn record_boxes(
    recording: &mut Recording,
    triangles: Buffer,
    clusters: &DeviceClusters,
) -> Result<Buffer, GpuError> {
    let &DeviceClusters { first, order, count } = clusters;
    check_fits(count)?;
    let around = recording.buffer("cluster boxes", boxes::BOX_WORDS * u64::from(count));
    if count > 0 {
        let groups = Groups::Direct(count.div_ceil(GROUP));
        recording.dispatch(&CLUSTERS, &Parameters { count }, &[triangles, first, order, around], groups);
    }
    Ok(around)
}

/// Records a frame's tree over clusters, one in each leaf, from the vertices of the frame on; arguments as in [`boxes::record`].
///
/// # Errors
/// There are too many.
pub fn record(
    recording: &mut Recording,
    builder: Builder,
    [positions, triangles]: [Buffer; 2],
    (count, clusters): (u32, &DeviceClusters),
    stages: &mut Stages,
) -> Result<DeviceTree, GpuError> {
    let boxes = boxes::record(recording, positions, triangles, count)?;
    let around = record_boxes(recording, boxes, clusters)?;
    stages.push(("clusters", recording.commands().len()));
    super::record(recording, builder, around, (clusters.count, 1), stages)
}
