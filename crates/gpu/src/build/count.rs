//! Numbers of elements, some of which only the device knows.

use crate::kernel::Kernel;
use crate::recording::{Buffer, Groups, Recording};
use bytemuck::NoUninit;

/// How many elements there are.
#[derive(Clone, Copy, Debug)]
pub struct Count {
    /// No more than so many.
    pub most: u32,
    /// One word that says how many, where only the device knows.
    pub known: Option<Buffer>,
}

impl Count {
    /// So many.
    #[must_use]
    pub const fn exactly(count: u32) -> Self {
        Self { most: count, known: None }
    }

    /// Records a dispatch whose parameter `count` is this.
    pub(super) fn dispatch<P: NoUninit>(
        &self,
        recording: &mut Recording,
        kernel: &'static Kernel,
        parameters: &P,
        buffers: &[Buffer],
        groups: Groups,
    ) {
        let field = kernel.parameters.fields.iter().find(|field| field.0 == "count");
        if let (Some(known), Some(&(_, offset, _))) = (self.known, field) {
            recording.parameter(known, offset as u64);
        }
        recording.dispatch(kernel, parameters, buffers, groups);
    }
}
