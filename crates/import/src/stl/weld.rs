//! Shares vertices with equal coordinates.

use vastlight_math::Vec3;

const EMPTY: u32 = u32::MAX;

/// Slots that are tried for a vertex; beyond this it is no longer shared, so that no file makes this slow.
const MAX_PROBES: usize = 64;

/// Vertices that are looked through: one is shared with those that came after the last multiple of so many.
pub(super) const WINDOW: usize = 1 << 20;

/// Bytes of a full table, with what is on its way.
pub(super) const TABLE_BYTES: u64 = 80 << 20;

/// An open-addressing table over vertices.
#[derive(Debug)]
pub(super) struct Welder {
    slots: Vec<u32>,
    positions: Vec<Vec3>,
    /// A tag for each vertex (its colour); vertices with different tags stay apart.
    tags: Vec<u16>,
    /// Vertices that were taken.
    taken: u64,
}

impl Welder {
    pub(super) fn new() -> Self {
        Self { slots: vec![EMPTY; 1024], positions: Vec::new(), tags: Vec::new(), taken: 0 }
    }

    /// Whether it is time to take the vertices.
    #[inline]
    pub(super) fn is_full(&self) -> bool {
        self.positions.len() >= WINDOW
    }

    /// Number of all vertices that there were.
    pub(super) fn vertices(&self) -> u64 {
        self.taken + self.positions.len() as u64
    }

    /// Takes positions and tags of the vertices that were not taken yet; no vertex will be shared with them.
    pub(super) fn take(&mut self) -> (Vec<Vec3>, Vec<u16>) {
        self.taken += self.positions.len() as u64;
        self.slots.fill(EMPTY);
        (std::mem::take(&mut self.positions), std::mem::take(&mut self.tags))
    }

    /// The number of the vertex at `position` with `tag`.
    #[inline]
    pub(super) fn vertex(&mut self, position: Vec3, tag: u16) -> u32 {
        if self.positions.len() * 2 >= self.slots.len() {
            self.grow();
        }
        // Minus zero is zero.
        let position = position + Vec3::ZERO;
        let mask = self.slots.len() - 1;
        let first = hash(position, tag);
        for probe in 0..MAX_PROBES {
            let slot = (first + probe) & mask;
            let vertex = self.slots[slot];
            if vertex == EMPTY {
                self.slots[slot] = self.positions.len() as u32;
                break;
            }
            if self.is(vertex, position, tag) {
                return self.number(vertex);
            }
        }
        self.positions.push(position);
        self.tags.push(tag);
        self.number(self.positions.len() as u32 - 1)
    }

    /// The number among all of a vertex that was not taken yet.
    fn number(&self, vertex: u32) -> u32 {
        (self.taken as u32).wrapping_add(vertex)
    }

    fn is(&self, vertex: u32, position: Vec3, tag: u16) -> bool {
        let bits = |p: Vec3| p.to_array().map(f32::to_bits);
        bits(self.positions[vertex as usize]) == bits(position) && self.tags[vertex as usize] == tag
    }

    fn grow(&mut self) {
        let mask = self.slots.len() * 4 - 1;
        self.slots.clear();
        self.slots.resize(mask + 1, EMPTY);
        for (vertex, (&position, &tag)) in self.positions.iter().zip(&self.tags).enumerate() {
            let first = hash(position, tag);
            let free = (0..MAX_PROBES).map(|probe| (first + probe) & mask).find(|&s| self.slots[s] == EMPTY);
            if let Some(slot) = free {
                self.slots[slot] = vertex as u32;
            }
        }
    }
}

fn hash(position: Vec3, tag: u16) -> usize {
    let [x, y, z] = position.to_array().map(|c| u64::from(c.to_bits()));
    let mut h = (x ^ (y << 32)).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    h = (h ^ (h >> 29) ^ z ^ (u64::from(tag) << 40)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    (h ^ (h >> 32)) as usize
}
