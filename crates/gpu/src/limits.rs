//! What every kernel stays within: the limits that WebGPU promises on any device.

/// Most storage buffers that a kernel may see: WebGPU's default.
pub const STORAGE_BUFFERS: u32 = 8;
/// Most invocations of a workgroup.
pub const WORKGROUP_INVOCATIONS: u32 = 256;
/// Most bytes that a workgroup shares.
pub const WORKGROUP_BYTES: u32 = 16 << 10;
/// Most workgroups along an axis of a dispatch.
pub const WORKGROUPS_PER_AXIS: u32 = 65_535;
/// Most bytes of a buffer that a kernel may see at once.
pub const BINDING_BYTES: u64 = 128 << 20;

type Limit = (&'static str, fn(&wgpu::Limits) -> u64);

/// The limits that computing meets; those of textures and vertices do not matter.
const COMPUTE: [Limit; 11] = [
    ("storage buffers a kernel", |l| l.max_storage_buffers_per_shader_stage.into()),
    ("uniform buffers a kernel", |l| l.max_uniform_buffers_per_shader_stage.into()),
    ("bytes of uniforms a binding", |l| l.max_uniform_buffer_binding_size),
    ("bytes a binding", |l| l.max_storage_buffer_binding_size),
    ("bytes a buffer", |l| l.max_buffer_size),
    ("bytes of workgroup memory", |l| l.max_compute_workgroup_storage_size.into()),
    ("invocations a workgroup", |l| l.max_compute_invocations_per_workgroup.into()),
    ("invocations along x", |l| l.max_compute_workgroup_size_x.into()),
    ("invocations along y", |l| l.max_compute_workgroup_size_y.into()),
    ("workgroups a dispatch", |l| l.max_compute_workgroups_per_dimension.into()),
    ("bind groups", |l| l.max_bind_groups.into()),
];

/// In what `has` is below `needs`, one phrase each.
pub(crate) fn shortfalls(has: &wgpu::Limits, needs: &wgpu::Limits) -> Vec<String> {
    let lacks = COMPUTE.iter().filter(|(_, of)| of(has) < of(needs));
    lacks.map(|(name, of)| format!("{} {name}, {} are needed", of(has), of(needs))).collect()
}

/// What is asked of a device: what WebGPU promises, with the sizes of buffers raised to what the adapter has.
pub(crate) fn to_request(has: &wgpu::Limits) -> wgpu::Limits {
    wgpu::Limits {
        max_storage_buffer_binding_size: has.max_storage_buffer_binding_size,
        max_buffer_size: has.max_buffer_size,
        ..wgpu::Limits::defaults().or_worse_values_from(has)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn our_own_limits_are_those_of_webgpu() {
        let webgpu = wgpu::Limits::defaults();
        assert_eq!(STORAGE_BUFFERS, webgpu.max_storage_buffers_per_shader_stage);
        assert_eq!(WORKGROUP_INVOCATIONS, webgpu.max_compute_invocations_per_workgroup);
        assert_eq!(WORKGROUP_BYTES, webgpu.max_compute_workgroup_storage_size);
        assert_eq!(WORKGROUPS_PER_AXIS, webgpu.max_compute_workgroups_per_dimension);
        assert_eq!(BINDING_BYTES, webgpu.max_storage_buffer_binding_size);
    }

    #[test]
    fn what_is_missing_is_named_and_nothing_else() {
        let webgpu = wgpu::Limits::defaults();
        assert_eq!(shortfalls(&webgpu, &webgpu), Vec::<String>::new());
        let old = wgpu::Limits {
            max_storage_buffers_per_shader_stage: 4,
            max_compute_workgroup_storage_size: 16_352,
            max_texture_dimension_2d: 1,
            ..webgpu.clone()
        };
        let lacks = shortfalls(&old, &webgpu);
        assert_eq!(
            lacks,
            ["4 storage buffers a kernel, 8 are needed", "16352 bytes of workgroup memory, 16384 are needed"]
        );
    }

    #[test]
    fn requests_stay_within_the_adapter_and_take_its_buffer_sizes() {
        let large =
            wgpu::Limits { max_buffer_size: 1 << 34, max_color_attachments: 4, ..wgpu::Limits::defaults() };
        let asked = to_request(&large);
        assert!(asked.check_limits(&large));
        assert_eq!((asked.max_buffer_size, asked.max_compute_workgroup_size_x), (1 << 34, 256));
    }
}
