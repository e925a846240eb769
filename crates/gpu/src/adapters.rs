//! Which adapters the system has, what they can do, and why one is not usable.

use crate::limits::shortfalls;
use serde::Serialize;
use std::fmt;

/// What an adapter is made of.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum AdapterKind {
    /// A card with its own memory.
    Discrete,
    /// A part of the processor, in the same memory.
    Integrated,
    /// A card lent to a virtual machine.
    Virtual,
    /// The driver does not say.
    Unknown,
    /// A program on the processor.
    Software,
}

impl AdapterKind {
    const fn new(kind: wgpu::DeviceType) -> Self {
        match kind {
            wgpu::DeviceType::DiscreteGpu => Self::Discrete,
            wgpu::DeviceType::IntegratedGpu => Self::Integrated,
            wgpu::DeviceType::VirtualGpu => Self::Virtual,
            wgpu::DeviceType::Other => Self::Unknown,
            wgpu::DeviceType::Cpu => Self::Software,
        }
    }
}

impl fmt::Display for AdapterKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Discrete => "discrete",
            Self::Integrated => "integrated",
            Self::Virtual => "virtual",
            Self::Unknown => "unknown",
            Self::Software => "software",
        })
    }
}

/// The limits that decide what kernels can do.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct AdapterLimits {
    /// Largest buffer that a kernel can see at once.
    pub binding_bytes: u64,
    /// Largest buffer.
    pub buffer_bytes: u64,
    /// Buffers that a kernel can see at once.
    pub storage_buffers: u32,
    /// Memory shared by a workgroup.
    pub workgroup_bytes: u32,
    /// Invocations in a workgroup.
    pub workgroup_invocations: u32,
    /// Workgroups in a dispatch, along each axis.
    pub workgroups_per_axis: u32,
    /// Least and most invocations that run in step; nothing here depends on it.
    pub subgroup: [u32; 2],
}

impl AdapterLimits {
    const fn new(limits: &wgpu::Limits, info: &wgpu::AdapterInfo) -> Self {
        Self {
            binding_bytes: limits.max_storage_buffer_binding_size,
            buffer_bytes: limits.max_buffer_size,
            storage_buffers: limits.max_storage_buffers_per_shader_stage,
            workgroup_bytes: limits.max_compute_workgroup_storage_size,
            workgroup_invocations: limits.max_compute_invocations_per_workgroup,
            workgroups_per_axis: limits.max_compute_workgroups_per_dimension,
            subgroup: [info.subgroup_min_size, info.subgroup_max_size],
        }
    }
}

/// An adapter as `vastlight devices` shows it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct AdapterReport {
    /// Its number in `--device gpu:N`: hardware first, software last.
    pub index: u32,
    /// The name that its driver gives it.
    pub name: String,
    /// Who made it.
    pub vendor: String,
    /// The interface that it is reached by: `vulkan`, `metal`, `dx12`.
    pub backend: String,
    /// The driver and its version.
    pub driver: String,
    /// What it is made of.
    pub kind: AdapterKind,
    /// What it can do.
    pub limits: AdapterLimits,
    /// Why it cannot be used; none where it can.
    pub unusable: Option<String>,
}

impl AdapterReport {
    fn new(adapter: &wgpu::Adapter, floor: &wgpu::Limits) -> Self {
        let (info, limits) = (adapter.get_info(), adapter.limits());
        let lacks = shortfalls(&limits, floor);
        let driver = [info.driver.as_str(), info.driver_info.as_str()].join(" ");
        Self {
            index: 0,
            vendor: vendor(info.vendor),
            backend: info.backend.to_string(),
            driver: driver.trim().to_owned(),
            kind: AdapterKind::new(info.device_type),
            limits: AdapterLimits::new(&limits, &info),
            unusable: (!lacks.is_empty()).then(|| lacks.join("; ")),
            name: info.name,
        }
    }

    /// Whether it is a card and not a program.
    #[must_use]
    pub fn is_hardware(&self) -> bool {
        self.kind != AdapterKind::Software
    }
}

/// An adapter and its report.
pub(crate) struct Listed {
    pub(crate) adapter: wgpu::Adapter,
    pub(crate) report: AdapterReport,
}

/// All adapters of these backends, best kind first.
pub(crate) fn list(instance: &wgpu::Instance, backends: wgpu::Backends, floor: &wgpu::Limits) -> Vec<Listed> {
    let adapters = pollster::block_on(instance.enumerate_adapters(backends));
    let listed = adapters.into_iter();
    let mut listed: Vec<Listed> =
        listed.map(|adapter| Listed { report: AdapterReport::new(&adapter, floor), adapter }).collect();
    listed.sort_by_key(|listed| listed.report.kind);
    for (index, listed) in (0..).zip(&mut listed) {
        listed.report.index = index;
    }
    listed
}

/// The name behind a PCI or Khronos vendor number.
fn vendor(id: u32) -> String {
    match id {
        0x1002 => "AMD",
        0x1010 => "Imagination",
        0x106b => "Apple",
        0x10de => "NVIDIA",
        0x13b5 => "ARM",
        0x1414 => "Microsoft",
        0x15ad => "VMware",
        0x1af4 => "Red Hat",
        0x5143 => "Qualcomm",
        0x8086 => "Intel",
        0x1_0005 => "Mesa",
        _ => return format!("vendor {id:#06x}"),
    }
    .to_owned()
}
