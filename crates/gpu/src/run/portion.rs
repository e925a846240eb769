//! A recording on its way to the device, in portions.

use super::executor::ExecutorConfig;
use super::pipelines::Pipelines;
use super::pool::Pool;
use crate::device::Device;
use crate::error::GpuError;
use crate::kernel::Kernel;
use crate::recording::{Buffer, Command, Groups, PARAMETER_BYTES, Recording};
use std::num::NonZeroU64;

/// Where in a buffer uniforms may start: WebGPU's default.
const UNIFORM_STEP: usize = PARAMETER_BYTES as usize;
/// Workgroups that an indirect dispatch counts for; how many it has is known on the device only.
const INDIRECT_GROUPS: u32 = 1 << 10;

/// Bytes on their way back.
pub(crate) struct Arrival {
    pub(crate) buffer: wgpu::Buffer,
    pub(crate) bytes: u64,
}

/// A recording and its buffers on their way.
pub(crate) struct Run<'a> {
    device: &'a Device,
    pool: &'a mut Pool,
    pipelines: &'a Pipelines,
    config: &'a ExecutorConfig,
    recording: &'a Recording,
    /// The buffers that are alive.
    buffers: Vec<Option<wgpu::Buffer>>,
    /// Parameters of all dispatches, one after the other.
    parameters: wgpu::Buffer,
    downloads: Vec<Arrival>,
    portion: Portion,
    dispatched: u64,
}

/// Commands that were not handed over yet, and their workgroups.
#[derive(Default)]
struct Portion {
    encoder: Option<wgpu::CommandEncoder>,
    groups: u32,
}

impl Portion {
    fn encoder(&mut self, device: &Device) -> &mut wgpu::CommandEncoder {
        let new = || device.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        self.encoder.get_or_insert_with(new)
    }

    fn submit(&mut self, device: &Device) {
        if let Some(encoder) = self.encoder.take() {
            device.queue.submit([encoder.finish()]);
        }
        self.groups = 0;
    }
}

impl<'a> Run<'a> {
    pub(crate) fn new(
        device: &'a Device,
        pool: &'a mut Pool,
        pipelines: &'a Pipelines,
        config: &'a ExecutorConfig,
        recording: &'a Recording,
    ) -> Result<Self, GpuError> {
        let mut bytes: Vec<u8> = Vec::new();
        for command in recording.commands() {
            if let Command::Dispatch { parameters, .. } = command {
                bytes.extend_from_slice(parameters);
                bytes.resize(bytes.len().next_multiple_of(UNIFORM_STEP), 0);
            }
        }
        let parameters = pool.take(device, "parameters", bytes.len() as u64, || {})?;
        device.queue.write_buffer(&parameters, 0, &bytes);
        let buffers = vec![None; recording.buffers.len()];
        Ok(Self {
            device,
            pool,
            pipelines,
            config,
            recording,
            buffers,
            parameters,
            downloads: Vec::new(),
            portion: Portion::default(),
            dispatched: 0,
        })
    }

    /// Issues every command in turn; buffers come before their first use and go after their last.
    pub(crate) fn all(&mut self) -> Result<(), GpuError> {
        let last = self.recording.last_uses();
        for (i, command) in self.recording.commands().iter().enumerate() {
            let used = command.buffers();
            used.iter().try_for_each(|&buffer| self.bring(buffer))?;
            self.issue(command)?;
            for buffer in used {
                if last[buffer.0 as usize] == i {
                    self.dismiss(buffer);
                }
            }
        }
        self.portion.submit(self.device);
        Ok(())
    }

    /// Gives all buffers back but those to be read.
    pub(crate) fn end(self) -> Vec<Arrival> {
        for (buffer, declared) in self.buffers.into_iter().zip(&self.recording.buffers) {
            if let Some(buffer) = buffer.filter(|_| declared.resident.is_none()) {
                self.pool.give_back(buffer);
            }
        }
        self.pool.give_back(self.parameters);
        self.downloads
    }

    /// Makes a buffer ready for use.
    fn bring(&mut self, buffer: Buffer) -> Result<(), GpuError> {
        let place = buffer.0 as usize;
        if self.buffers[place].is_some() {
            return Ok(());
        }
        let declared = &self.recording.buffers[place];
        let Some(resident) = declared.resident else {
            let taken = self.pool.take(self.device, declared.label, declared.bytes, || {
                self.portion.submit(self.device);
            })?;
            if let Some(poison) = self.config.poison {
                let words = vec![poison; declared.bytes.div_ceil(4) as usize];
                self.write(&taken, bytemuck::cast_slice(&words));
            }
            self.buffers[place] = Some(taken);
            return Ok(());
        };
        let reason = || format!("{} was released before its use", declared.label);
        let found = self.pool.resident(resident).cloned();
        self.buffers[place] = Some(found.ok_or_else(|| GpuError::Rejected { reason: reason() })?);
        Ok(())
    }

    fn dismiss(&mut self, buffer: Buffer) {
        let place = buffer.0 as usize;
        if let Some(done) = self.buffers[place].take()
            && self.recording.buffers[place].resident.is_none()
        {
            self.pool.give_back(done);
        }
    }

    /// The driver's buffer behind one that [`Run::bring`] brought.
    fn at(&self, buffer: Buffer) -> Result<wgpu::Buffer, GpuError> {
        let found = self.buffers[buffer.0 as usize].clone();
        found.ok_or_else(|| GpuError::Rejected { reason: format!("buffer {} is not there", buffer.0) })
    }

    fn issue(&mut self, command: &Command) -> Result<(), GpuError> {
        match command {
            Command::Upload { to, bytes } => {
                let to = self.at(*to)?;
                self.write(&to, bytes);
            }
            Command::Clear(buffer) => {
                let buffer = self.at(*buffer)?;
                self.portion.encoder(self.device).clear_buffer(&buffer, 0, None);
            }
            Command::Copy { from, offset, to, to_offset, bytes } => {
                let (from, to) = (self.at(*from)?, self.at(*to)?);
                let encoder = self.portion.encoder(self.device);
                encoder.copy_buffer_to_buffer(&from, *offset, &to, *to_offset, *bytes);
            }
            Command::Parameter { from, offset } => {
                let (from, place) = (self.at(*from)?, self.dispatched * PARAMETER_BYTES + offset);
                let encoder = self.portion.encoder(self.device);
                encoder.copy_buffer_to_buffer(&from, 0, &self.parameters, place, 4);
            }
            Command::Dispatch { kernel, parameters, buffers, groups } => {
                self.dispatch(kernel, parameters.len() as u64, buffers, *groups)?;
            }
            Command::Download { from, bytes } => self.download(*from, *bytes)?,
        }
        Ok(())
    }

    /// Writes to a buffer after all commands before.
    fn write(&mut self, to: &wgpu::Buffer, bytes: &[u8]) {
        self.portion.submit(self.device);
        self.device.queue.write_buffer(to, 0, bytes);
    }

    fn download(&mut self, from: Buffer, bytes: u64) -> Result<(), GpuError> {
        let from = self.at(from)?;
        let to = self.device.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("download"),
            size: bytes.max(4),
            usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
            mapped_at_creation: false,
        });
        self.portion.encoder(self.device).copy_buffer_to_buffer(&from, 0, &to, 0, bytes);
        self.downloads.push(Arrival { buffer: to, bytes });
        Ok(())
    }

    fn dispatch(
        &mut self,
        kernel: &'static Kernel,
        parameter_bytes: u64,
        buffers: &[Buffer],
        groups: Groups,
    ) -> Result<(), GpuError> {
        let pipeline = self.pipelines.get(kernel);
        let reason = "not compiled".to_owned();
        let pipeline = pipeline.ok_or(GpuError::Kernel { kernel: kernel.name, reason })?;
        let seen = buffers.iter().map(|&buffer| self.at(buffer)).collect::<Result<Vec<_>, _>>()?;
        let parameters = range(&self.parameters, self.dispatched * UNIFORM_STEP as u64, parameter_bytes);
        let mut entries = vec![entry(0, parameters)];
        for ((binding, buffer), declared) in (1..).zip(&seen).zip(buffers) {
            let bytes = self.recording.buffers[declared.0 as usize].bytes;
            self.check_binding(kernel, bytes)?;
            entries.push(entry(binding, range(buffer, 0, bytes)));
        }
        let group = self.device.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some(kernel.name),
            layout: &pipeline.get_bind_group_layout(0),
            entries: &entries,
        });
        let arguments = if let Groups::Indirect(buffer, _) = groups { Some(self.at(buffer)?) } else { None };
        let mut pass = self.portion.encoder(self.device).begin_compute_pass(&wgpu::ComputePassDescriptor {
            label: Some(kernel.name),
            timestamp_writes: None,
        });
        pass.set_pipeline(pipeline);
        pass.set_bind_group(0, &group, &[]);
        match (groups, arguments) {
            (Groups::Direct(groups), _) => pass.dispatch_workgroups(groups, 1, 1),
            (Groups::Indirect(_, offset), Some(buffer)) => pass.dispatch_workgroups_indirect(&buffer, offset),
            (Groups::Indirect(..), None) => {}
        }
        drop(pass);
        self.dispatched += 1;
        self.count(groups);
        Ok(())
    }

    fn check_binding(&self, kernel: &Kernel, bytes: u64) -> Result<(), GpuError> {
        let limit = self.device.adapter().limits.binding_bytes;
        if bytes <= limit {
            return Ok(());
        }
        Err(GpuError::Limit { what: format!("a binding of {} in bytes", kernel.name), wanted: bytes, limit })
    }

    /// Hands the portion over when it is large enough.
    fn count(&mut self, groups: Groups) {
        let groups = if let Groups::Direct(groups) = groups { groups } else { INDIRECT_GROUPS };
        self.portion.groups = self.portion.groups.saturating_add(groups);
        if self.portion.groups >= self.config.groups_per_submission {
            self.portion.submit(self.device);
        }
    }
}

fn entry(binding: u32, buffer: wgpu::BufferBinding<'_>) -> wgpu::BindGroupEntry<'_> {
    wgpu::BindGroupEntry { binding, resource: wgpu::BindingResource::Buffer(buffer) }
}

fn range(buffer: &wgpu::Buffer, offset: u64, bytes: u64) -> wgpu::BufferBinding<'_> {
    wgpu::BufferBinding { buffer, offset, size: NonZeroU64::new(bytes) }
}
