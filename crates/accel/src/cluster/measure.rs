//! What a heuristic must know of clusters to say which two to join.

/// A measure of clusters. Of two clusters it is asked for the value of both together.
pub(super) trait Measure: Sync {
    /// What it keeps of a cluster.
    type Kept: Send + Sync;
    /// Room that it uses again and again.
    type Room: Default + Send;

    /// What is kept of one triangle.
    fn single(&self, triangle: u32) -> Self::Kept;

    /// The value of two clusters together, the more the better, from -2 to 2. They share edges of the length `shared`.
    fn value(&self, pair: [&Self::Kept; 2], shared: f32, room: &mut Self::Room) -> f32;

    /// What is kept of two clusters together.
    fn join(&self, pair: [Self::Kept; 2], shared: f32) -> Self::Kept;
}

/// Unions of sorted lists without repetition, in front of what `into` held.
pub(super) fn unite(a: &[u32], b: &[u32], into: &mut Vec<u32>) {
    into.clear();
    let (mut i, mut j) = (0, 0);
    while i < a.len() && j < b.len() {
        let (x, y) = (a[i], b[j]);
        into.push(x.min(y));
        i += usize::from(x <= y);
        j += usize::from(y <= x);
    }
    into.extend_from_slice(&a[i..]);
    into.extend_from_slice(&b[j..]);
}
