//! The samples of a component that are in memory while rows come.

use super::upsample::Filter;
use zune_jpeg::PlaneInfo;

/// Samples on a side of a block.
const BLOCK: usize = 8;

/// The samples of a component that are in memory.
pub(super) struct Plane {
    info: PlaneInfo,
    filter: Filter,
    /// Rows of samples, one behind the other.
    samples: Vec<u8>,
    /// The number of the first row that is there.
    first: usize,
    /// How many are there.
    rows: usize,
    /// A row of texels.
    texels: Vec<u8>,
}

impl Plane {
    /// No samples of a component; `most` are the largest sampling factors of the image, across and down.
    pub(super) fn new(info: PlaneInfo, most: [usize; 2]) -> Self {
        Self {
            info,
            filter: Filter::new(&info, most),
            samples: Vec::new(),
            first: 0,
            rows: 0,
            texels: Vec::new(),
        }
    }

    /// Samples of a row.
    pub(super) fn width(&self) -> usize {
        self.info.width
    }

    /// Samples of a row of blocks.
    pub(super) fn block_row_samples(&self) -> u64 {
        (self.info.stride * self.block_rows()) as u64
    }

    /// Samples of all blocks.
    pub(super) fn all_samples(&self) -> u64 {
        self.block_row_samples() * self.info.height.div_ceil(self.block_rows()) as u64
    }

    /// Whether all samples are there that the row of texels `y` needs.
    pub(super) fn has(&self, y: usize) -> bool {
        let [near, far] = self.filter.rows(y, self.info.height);
        near.max(far) < self.first + self.rows
    }

    /// Room for the next row of blocks; samples above those that the row of texels `y` needs go.
    pub(super) fn room(&mut self, y: usize) -> &mut [u8] {
        let ([near, far], width) = (self.filter.rows(y, self.info.height), self.info.width);
        let gone = near.min(far).saturating_sub(self.first).min(self.rows);
        self.samples.drain(..gone * width);
        (self.first, self.rows) = (self.first + gone, self.rows - gone);
        self.samples.resize((self.rows + self.block_rows()) * width, 0);
        &mut self.samples[self.rows * width..]
    }

    /// Takes over so many rows that were written into the room for them.
    pub(super) fn took(&mut self, rows: usize) {
        self.rows += rows.min(self.block_rows());
    }

    /// The row of texels `y` of an image of this width, whose samples must be there.
    pub(super) fn texels(&mut self, y: usize, width: usize) -> &[u8] {
        let [near, far] = self.filter.rows(y, self.info.height).map(|row| {
            let first = row.saturating_sub(self.first) * self.info.width;
            &self.samples[first..first + self.info.width]
        });
        self.texels.resize(width, 0);
        self.filter.apply([near, far], y, &mut self.texels);
        &self.texels
    }

    /// Another filter, to see that it matters.
    #[cfg(test)]
    pub(super) fn take_nearest(&mut self) {
        self.filter = self.filter.nearest();
    }

    fn block_rows(&self) -> usize {
        self.info.vertical_sampling_factor * BLOCK
    }
}
