//! Device memory: buffers are kept and used again, within a budget.

use crate::device::{Device, Refusal, scoped};
use crate::error::GpuError;
use crate::recording::Resident;
use std::collections::BTreeMap;

const USAGE: wgpu::BufferUsages = wgpu::BufferUsages::STORAGE
    .union(wgpu::BufferUsages::COPY_SRC)
    .union(wgpu::BufferUsages::COPY_DST)
    .union(wgpu::BufferUsages::INDIRECT)
    .union(wgpu::BufferUsages::UNIFORM);

/// Buffers in sizes of which there are four between powers of two.
#[derive(Debug)]
pub(crate) struct Pool {
    free: BTreeMap<u64, Vec<wgpu::Buffer>>,
    resident: BTreeMap<u64, wgpu::Buffer>,
    next_resident: u64,
    held_bytes: u64,
    budget_bytes: u64,
}

impl Pool {
    pub(crate) const fn new(budget_bytes: u64) -> Self {
        Self {
            free: BTreeMap::new(),
            resident: BTreeMap::new(),
            next_resident: 0,
            held_bytes: 0,
            budget_bytes,
        }
    }

    pub(crate) const fn set_budget(&mut self, bytes: u64) {
        self.budget_bytes = bytes;
    }

    /// Bytes that buffers take on the device, used or free.
    pub(crate) const fn held_bytes(&self) -> u64 {
        self.held_bytes
    }

    /// A buffer of at least this size; it holds anything. Where it does not fit, `settle` hands over all commands that use
    /// what was given back, and unused buffers go.
    pub(crate) fn take(
        &mut self,
        device: &Device,
        label: &str,
        bytes: u64,
        settle: impl FnOnce(),
    ) -> Result<wgpu::Buffer, GpuError> {
        // In whole words.
        let limit = device.device.limits().max_buffer_size & !3;
        if bytes > limit {
            return Err(GpuError::Limit { what: format!("{label} in bytes"), wanted: bytes, limit });
        }
        let bytes = size_class(bytes).min(limit);
        if let Some(buffer) = self.free.get_mut(&bytes).and_then(Vec::pop) {
            return Ok(buffer);
        }
        let created = match self.create(device, label, bytes) {
            Err(Refusal::Memory) => {
                settle();
                self.trim(device);
                self.create(device, label, bytes)
            }
            other => other,
        };
        created.map_err(|refusal| match refusal {
            Refusal::Memory => self.out_of_memory(label, bytes),
            Refusal::Other(reason) => device.check().err().unwrap_or(GpuError::Rejected { reason }),
        })
    }

    /// Gives a buffer back, for others to use.
    pub(crate) fn give_back(&mut self, buffer: wgpu::Buffer) {
        self.free.entry(buffer.size()).or_default().push(buffer);
    }

    fn create(&mut self, device: &Device, label: &str, bytes: u64) -> Result<wgpu::Buffer, Refusal> {
        if self.held_bytes.saturating_add(bytes) > self.budget_bytes {
            return Err(Refusal::Memory);
        }
        create_buffer(device, label, bytes).inspect(|_| self.held_bytes += bytes)
    }

    fn out_of_memory(&self, label: &str, wanted_bytes: u64) -> GpuError {
        GpuError::OutOfMemory { what: label.to_owned(), wanted_bytes, held_bytes: self.held_bytes }
    }

    /// Lets all unused buffers go, and waits until the device has done with them.
    pub(crate) fn trim(&mut self, device: &Device) {
        for buffer in std::mem::take(&mut self.free).into_values().flatten() {
            self.held_bytes -= buffer.size();
            buffer.destroy();
        }
        // Fails where the device is lost only, which shows in what comes next.
        drop(device.device.poll(wgpu::PollType::wait_indefinitely()));
    }

    /// A buffer that stays.
    pub(crate) fn allocate(
        &mut self,
        device: &Device,
        label: &str,
        bytes: u64,
    ) -> Result<Resident, GpuError> {
        let bytes = bytes.max(4).div_ceil(4).saturating_mul(4);
        let buffer = self.take(device, label, bytes, || {})?;
        let id = self.next_resident;
        self.next_resident += 1;
        self.resident.insert(id, buffer);
        Ok(Resident { id, bytes })
    }

    /// Lets a buffer that stayed be used for others.
    pub(crate) fn release(&mut self, resident: Resident) {
        if let Some(buffer) = self.resident.remove(&resident.id) {
            self.give_back(buffer);
        }
    }

    /// The buffer behind a name.
    pub(crate) fn resident(&self, resident: Resident) -> Option<&wgpu::Buffer> {
        self.resident.get(&resident.id)
    }
}

fn create_buffer(device: &Device, label: &str, bytes: u64) -> Result<wgpu::Buffer, Refusal> {
    let descriptor =
        wgpu::BufferDescriptor { label: Some(label), size: bytes, usage: USAGE, mapped_at_creation: false };
    scoped(&device.device, || device.device.create_buffer(&descriptor))
}

/// The next size that buffers have: 256 bytes and more, a quarter of a power of two apart.
fn size_class(bytes: u64) -> u64 {
    let bytes = bytes.max(256);
    let step = (bytes.checked_next_power_of_two().unwrap_or(u64::MAX) / 8).max(64);
    bytes.div_ceil(step).saturating_mul(step)
}

#[cfg(test)]
mod tests {
    use super::size_class;

    #[test]
    fn sizes_waste_at_most_a_quarter_and_are_few() {
        let mut classes = Vec::new();
        for bytes in (0..100_000).step_by(4) {
            let class = size_class(bytes);
            assert!(class >= bytes && class.is_multiple_of(4), "{bytes}: {class}");
            assert!(bytes < 256 || class <= bytes + bytes / 4, "{bytes}: {class}");
            classes.push(class);
        }
        assert!(classes.is_sorted());
        classes.dedup();
        assert!(classes.len() < 50, "{}", classes.len());
        assert_eq!(size_class(u64::MAX), u64::MAX);
    }
}
