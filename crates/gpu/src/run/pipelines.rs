//! Compiled kernels, each compiled once a process.
//!
//! Nothing is kept on the disk: wgpu trusts what it would read back (`create_pipeline_cache` is unsafe), and drivers
//! keep such a cache of their own.

use crate::device::{Device, Refusal, scoped};
use crate::error::GpuError;
use crate::kernel::Kernel;
use std::collections::BTreeMap;
use std::time::Instant;

/// How compiling goes; told after each kernel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CompileProgress {
    /// The kernel that is ready.
    pub kernel: &'static str,
    /// Kernels that are ready, of those asked for.
    pub done: usize,
    /// Kernels asked for.
    pub total: usize,
    /// What this one took; 0 if it was ready before.
    pub ms: f64,
}

/// Pipelines by the name of their kernel.
#[derive(Debug, Default)]
pub(crate) struct Pipelines {
    ready: BTreeMap<&'static str, wgpu::ComputePipeline>,
}

impl Pipelines {
    /// Compiles those of `kernels` that are not ready.
    pub(crate) fn prepare(
        &mut self,
        device: &Device,
        kernels: &[&'static Kernel],
        progress: &mut dyn FnMut(CompileProgress),
    ) -> Result<(), GpuError> {
        for (i, kernel) in kernels.iter().enumerate() {
            let start = Instant::now();
            let was_ready = self.ready.contains_key(kernel.name);
            if !was_ready {
                self.ready.insert(kernel.name, compile(device, kernel)?);
            }
            let ms = if was_ready { 0.0 } else { start.elapsed().as_secs_f64() * 1e3 };
            progress(CompileProgress { kernel: kernel.name, done: i + 1, total: kernels.len(), ms });
        }
        Ok(())
    }

    pub(crate) fn get(&self, kernel: &Kernel) -> Option<&wgpu::ComputePipeline> {
        self.ready.get(kernel.name)
    }
}

fn compile(device: &Device, kernel: &'static Kernel) -> Result<wgpu::ComputePipeline, GpuError> {
    let source = wgpu::ShaderSource::Wgsl(kernel.wgsl().into());
    let compiled = scoped(&device.device, || {
        let label = Some(kernel.name);
        let module = device.device.create_shader_module(wgpu::ShaderModuleDescriptor { label, source });
        // Every kernel writes what it reads of its workgroup's memory.
        let compilation_options = wgpu::PipelineCompilationOptions {
            zero_initialize_workgroup_memory: false,
            ..wgpu::PipelineCompilationOptions::default()
        };
        device.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label,
            layout: None,
            module: &module,
            entry_point: Some("main"),
            compilation_options,
            cache: None,
        })
    });
    compiled.map_err(|refusal| {
        let reason = match refusal {
            Refusal::Memory => "out of memory".to_owned(),
            Refusal::Other(words) => words,
        };
        device.check().err().unwrap_or(GpuError::Kernel { kernel: kernel.name, reason })
    })
}
