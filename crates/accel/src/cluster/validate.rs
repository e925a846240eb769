//! Whether clusters are what they should be.

use super::{Clusters, connect};
use crate::Violation;
use crate::wide::MeshView;

/// What sound clusters hold.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ClusterReport {
    /// Clusters.
    pub clusters: usize,
    /// Of one triangle.
    pub singles: usize,
    /// Triangles of the largest.
    pub largest: usize,
    /// Blocks of triangles.
    pub blocks: usize,
}

impl Clusters {
    /// Checks that every triangle of `mesh` is in one cluster, and that shared edges connect each cluster.
    ///
    /// # Errors
    /// The first violation; its node is the cluster.
    pub fn validate(&self, mesh: &MeshView<'_>) -> Result<ClusterReport, Violation> {
        let mut report = ClusterReport {
            clusters: self.len(),
            blocks: self.treelets.lanes.len(),
            ..ClusterReport::default()
        };
        let shape = |cluster: u32, what| Err(Violation::Shape { node: cluster as usize, what });
        let mut times = vec![0; mesh.triangles.len()];
        for cluster in 0..self.len() as u32 {
            let triangles = self.triangles(cluster);
            report.largest = report.largest.max(triangles.len());
            report.singles += usize::from(triangles.len() == 1);
            for &triangle in triangles {
                match times.get_mut(triangle as usize) {
                    Some(times) => *times += 1,
                    None => return shape(cluster, "names a triangle that does not exist"),
                }
                if self.of_triangle.get(triangle as usize) != Some(&cluster) {
                    return shape(cluster, "has a triangle that says otherwise");
                }
            }
        }
        if let Some(prim) = times.iter().position(|&times| times != 1) {
            return Err(Violation::Coverage { prim, times: times[prim] });
        }
        match self.disconnected(mesh) {
            Some(cluster) => shape(cluster, "is not connected"),
            None => Ok(report),
        }
    }

    /// A cluster that shared edges do not connect.
    fn disconnected(&self, mesh: &MeshView<'_>) -> Option<u32> {
        let neighbours = connect::Neighbours::new(mesh.triangles.len(), &connect::links(mesh));
        let mut reached = vec![false; mesh.triangles.len()];
        (0..self.len() as u32).find(|&cluster| {
            let triangles = self.triangles(cluster);
            let mut waiting: Vec<u32> = triangles.first().copied().into_iter().collect();
            waiting.iter().for_each(|&first| reached[first as usize] = true);
            let mut count = waiting.len();
            while let Some(triangle) = waiting.pop() {
                for &next in neighbours.of(triangle) {
                    if self.of_triangle[next as usize] == cluster && !reached[next as usize] {
                        reached[next as usize] = true;
                        count += 1;
                        waiting.push(next);
                    }
                }
            }
            count != triangles.len()
        })
    }
}
