//! Everything that can go wrong with a graphics processor, and what the user can do.

use vastlight_transport::PagesError;

/// Why work on a graphics processor could not be done.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum GpuError {
    /// The system names no adapter at all.
    #[error("no graphics adapter was found")]
    NoAdapter,
    /// There are adapters, but none of the kind that was asked for.
    #[error("no {wanted} adapter was found, only {found}")]
    NoSuchKind {
        /// `hardware` or `software`.
        wanted: &'static str,
        /// The names of those that are there.
        found: String,
    },
    /// An adapter was asked for by a number that no adapter has.
    #[error("there is no adapter {index}, only {count}")]
    NoSuchIndex {
        /// The number asked for.
        index: u32,
        /// How many adapters there are.
        count: usize,
    },
    /// The adapter cannot run the kernels.
    #[error("adapter {adapter} is not usable: {reason}")]
    Unusable {
        /// Its name.
        adapter: String,
        /// What it lacks.
        reason: String,
    },
    /// The driver refused to open the adapter.
    #[error("adapter {adapter} cannot be opened: {reason}")]
    Refused {
        /// Its name.
        adapter: String,
        /// The driver's words.
        reason: String,
    },
    /// A request is beyond what the device can do.
    #[error("{what} needs {wanted}, the device has at most {limit}")]
    Limit {
        /// What was asked for, with its unit.
        what: String,
        /// How much of it.
        wanted: u64,
        /// How much there can be.
        limit: u64,
    },
    /// Memory on the device was refused, by its driver or by the budget.
    #[error("{what} needs {wanted_bytes} bytes beside {held_bytes} in use on the device")]
    OutOfMemory {
        /// What the memory was for.
        what: String,
        /// Bytes asked for.
        wanted_bytes: u64,
        /// Bytes that were in use.
        held_bytes: u64,
    },
    /// The device is gone: it was reset, unplugged, or the driver crashed.
    #[error("adapter {adapter} was lost: {reason}")]
    Lost {
        /// Its name.
        adapter: String,
        /// The driver's words.
        reason: String,
    },
    /// There is no way to bring a scene to a device, or to render it there.
    #[error("{reason}")]
    Scene {
        /// Why.
        reason: String,
    },
    /// A page of a scene in a store cannot be had.
    #[error(transparent)]
    Pages(#[from] PagesError),
    /// A kernel did not compile.
    #[error("kernel {kernel} does not compile: {reason}")]
    Kernel {
        /// Its name.
        kernel: &'static str,
        /// The compiler's words.
        reason: String,
    },
    /// A recording is not well formed, or the driver failed in a way that has no other name.
    #[error("the device refused its commands: {reason}")]
    Rejected {
        /// What is wrong.
        reason: String,
    },
}

impl GpuError {
    /// What the user can do about it.
    #[must_use]
    pub const fn hint(&self) -> &'static str {
        match self {
            Self::NoAdapter => {
                "install a Vulkan driver (software: Debian's mesa-vulkan-drivers and libvulkan1), or use --device cpu"
            }
            Self::NoSuchKind { .. } => "choose one by --device gpu:N, or use --device cpu",
            Self::NoSuchIndex { .. } => "see vastlight devices",
            Self::Unusable { .. } => {
                "update its driver, choose another with --device gpu:N, or use --device cpu"
            }
            Self::Refused { .. } => "see whether another program holds it, or use --device cpu",
            Self::Scene { .. } => "use --device cpu",
            Self::Pages(_) => "see whether the store is whole and can be reached",
            Self::Limit { .. } => "use a smaller batch or scene, or --device cpu",
            Self::OutOfMemory { .. } => {
                "close other programs on the device, change --gpu-memory, or use --device cpu"
            }
            Self::Lost { .. } => "start again, or use --device cpu",
            Self::Kernel { .. } | Self::Rejected { .. } => {
                "report this with the adapter's name, or use --device cpu"
            }
        }
    }
}
