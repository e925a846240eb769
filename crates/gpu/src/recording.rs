//! Work for a device, written down without one: vello's recordings (Levien 2022, "Requiem for piet-gpu-hal").
//!
//! A recording can be made, looked at and counted in a test that has no adapter; the [`Executor`](crate::Executor)
//! alone touches the driver. Commands take effect in the order in which they were recorded.

use crate::error::GpuError;
use crate::kernel::Kernel;
use crate::limits::WORKGROUPS_PER_AXIS;
use bytemuck::NoUninit;

/// Most bytes of parameters.
pub(crate) const PARAMETER_BYTES: u64 = 256;

/// A buffer of one recording.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Buffer(pub(crate) u32);

/// A buffer that stays on the device between recordings; see [`Executor::allocate`](crate::Executor::allocate).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Resident {
    pub(crate) id: u64,
    /// Its size.
    pub bytes: u64,
}

impl Resident {
    /// No buffer.
    pub(crate) const NOTHING: Self = Self { id: u64::MAX, bytes: 0 };
}

/// Which of a recording's downloads.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Download(pub(crate) usize);

/// How many workgroups run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Groups {
    /// So many.
    Direct(u32),
    /// As many as three u32 at this byte of a buffer say.
    Indirect(Buffer, u64),
}

/// One step of a recording.
#[derive(Clone, Debug, PartialEq)]
pub enum Command {
    /// Bytes from here to the start of a buffer.
    Upload {
        /// Where to.
        to: Buffer,
        /// What.
        bytes: Vec<u8>,
    },
    /// Zeros all over a buffer.
    Clear(Buffer),
    /// Bytes from a buffer to another.
    Copy {
        /// Where from.
        from: Buffer,
        /// First byte there, a multiple of 4.
        offset: u64,
        /// Where to.
        to: Buffer,
        /// First byte there, a multiple of 4.
        to_offset: u64,
        /// How many, a multiple of 4.
        bytes: u64,
    },
    /// A word from the start of a buffer to the parameters of the next dispatch.
    Parameter {
        /// Where from.
        from: Buffer,
        /// The byte of the parameters, a multiple of 4.
        offset: u64,
    },
    /// A kernel over workgroups.
    Dispatch {
        /// Which.
        kernel: &'static Kernel,
        /// Its parameters as they lie in memory.
        parameters: Vec<u8>,
        /// The buffers it sees, in the order of its bindings.
        buffers: Vec<Buffer>,
        /// How many workgroups.
        groups: Groups,
    },
    /// Bytes from the start of a buffer to here.
    Download {
        /// Where from.
        from: Buffer,
        /// How many.
        bytes: u64,
    },
}

/// What a buffer of a recording is.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Declared {
    pub(crate) label: &'static str,
    pub(crate) bytes: u64,
    pub(crate) resident: Option<Resident>,
}

/// Commands in order, and the buffers they use.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Recording {
    pub(crate) buffers: Vec<Declared>,
    pub(crate) commands: Vec<Command>,
    downloads: usize,
}

impl Recording {
    /// Nothing to do yet.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// A buffer for `words` u32 (at least one) that lives as long as it is used; it holds anything at first.
    pub fn buffer(&mut self, label: &'static str, words: u64) -> Buffer {
        self.declare(Declared { label, bytes: words.max(1).saturating_mul(4), resident: None })
    }

    /// A buffer that is on the device already.
    pub fn resident(&mut self, label: &'static str, resident: Resident) -> Buffer {
        self.declare(Declared { label, bytes: resident.bytes, resident: Some(resident) })
    }

    fn declare(&mut self, declared: Declared) -> Buffer {
        self.buffers.push(declared);
        Buffer(self.buffers.len() as u32 - 1)
    }

    /// A buffer with this content.
    pub fn upload<T: NoUninit>(&mut self, label: &'static str, content: &[T]) -> Buffer {
        let bytes = bytemuck::cast_slice(content).to_vec();
        let to = self.buffer(label, bytes.len().div_ceil(4) as u64);
        self.write(to, bytes);
        to
    }

    /// Replaces the start of a buffer.
    pub fn write(&mut self, to: Buffer, mut bytes: Vec<u8>) {
        bytes.resize(bytes.len().next_multiple_of(4), 0);
        self.commands.push(Command::Upload { to, bytes });
    }

    /// Fills a buffer with zeros.
    pub fn clear(&mut self, buffer: Buffer) {
        self.commands.push(Command::Clear(buffer));
    }

    /// Copies `words` u32 from the word `first` of a buffer to the start of another.
    pub fn copy(&mut self, from: Buffer, first: u64, to: Buffer, words: u64) {
        self.copy_to((from, first), (to, 0), words);
    }

    /// Copies `words` u32 from a word of a buffer to a word of another.
    pub fn copy_to(&mut self, (from, first): (Buffer, u64), (to, at): (Buffer, u64), words: u64) {
        let [offset, to_offset, bytes] = [first, at, words].map(|words| words.saturating_mul(4));
        self.commands.push(Command::Copy { from, offset, to, to_offset, bytes });
    }

    /// Takes the word at byte `offset` of the next dispatch's parameters from the start of a buffer: what only the device knows.
    pub fn parameter(&mut self, from: Buffer, offset: u64) {
        self.commands.push(Command::Parameter { from, offset });
    }

    /// Runs a kernel with these parameters over these buffers.
    pub fn dispatch<P: NoUninit>(
        &mut self,
        kernel: &'static Kernel,
        parameters: &P,
        buffers: &[Buffer],
        groups: Groups,
    ) {
        self.dispatch_bytes(kernel, bytemuck::bytes_of(parameters).to_vec(), buffers, groups);
    }

    /// The same with parameters as they lie in memory.
    pub fn dispatch_bytes(
        &mut self,
        kernel: &'static Kernel,
        parameters: Vec<u8>,
        buffers: &[Buffer],
        groups: Groups,
    ) {
        self.commands.push(Command::Dispatch { kernel, parameters, buffers: buffers.to_vec(), groups });
    }

    /// Brings the first `words` u32 of a buffer back.
    pub fn download(&mut self, from: Buffer, words: u64) -> Download {
        self.commands.push(Command::Download { from, bytes: words.saturating_mul(4) });
        self.downloads += 1;
        Download(self.downloads - 1)
    }

    /// The commands, in order.
    #[must_use]
    pub fn commands(&self) -> &[Command] {
        &self.commands
    }

    /// The first so many commands alone.
    pub(crate) fn up_to(&self, commands: usize) -> Self {
        let commands = self.commands[..commands.min(self.commands.len())].to_vec();
        let downloads = commands.iter().filter(|c| matches!(c, Command::Download { .. })).count();
        Self { buffers: self.buffers.clone(), commands, downloads }
    }

    /// How many dispatches there are.
    #[must_use]
    pub fn dispatches(&self) -> usize {
        self.commands.iter().filter(|command| matches!(command, Command::Dispatch { .. })).count()
    }

    /// The kernels that are used, each once, in the order of their first use.
    #[must_use]
    pub fn kernels(&self) -> Vec<&'static Kernel> {
        let mut kernels: Vec<&'static Kernel> = Vec::new();
        for command in &self.commands {
            if let Command::Dispatch { kernel, .. } = command
                && !kernels.iter().any(|k| k.name == kernel.name)
            {
                kernels.push(kernel);
            }
        }
        kernels
    }

    /// Whether the commands make sense: buffers of this recording, ranges within them, as many buffers as the kernel
    /// has bindings, as many workgroups as a dispatch may have.
    ///
    /// # Errors
    /// The first command that does not.
    pub fn check(&self) -> Result<(), GpuError> {
        self.commands.iter().try_for_each(|command| match command {
            Command::Upload { to, bytes } => self.holds("upload", *to, 0, bytes.len() as u64),
            Command::Clear(buffer) => self.holds("clear", *buffer, 0, 0),
            Command::Copy { from, offset, to, to_offset, bytes } => {
                self.holds("copy", *from, *offset, *bytes)?;
                self.holds("copy", *to, *to_offset, *bytes)
            }
            Command::Parameter { from, offset } => {
                self.holds("parameter", *from, 0, 4)?;
                Self::check_parameter(*offset)
            }
            Command::Dispatch { kernel, parameters, buffers, groups } => {
                self.check_dispatch(kernel, parameters, buffers, *groups)
            }
            Command::Download { from, bytes } => self.holds("download", *from, 0, *bytes),
        })
    }

    fn check_parameter(offset: u64) -> Result<(), GpuError> {
        if offset.is_multiple_of(4) && offset < PARAMETER_BYTES {
            return Ok(());
        }
        Err(GpuError::Rejected { reason: format!("a parameter at byte {offset}") })
    }

    fn check_dispatch(
        &self,
        kernel: &Kernel,
        parameters: &[u8],
        buffers: &[Buffer],
        groups: Groups,
    ) -> Result<(), GpuError> {
        buffers.iter().try_for_each(|&buffer| self.holds(kernel.name, buffer, 0, 0))?;
        if buffers.len() != kernel.buffers || parameters.len() != kernel.parameters.bytes {
            let reason = format!(
                "{}: {} buffers and {} bytes of parameters, not {} and {}",
                kernel.name,
                buffers.len(),
                parameters.len(),
                kernel.buffers,
                kernel.parameters.bytes
            );
            return Err(GpuError::Rejected { reason });
        }
        match groups {
            Groups::Direct(groups) if groups > WORKGROUPS_PER_AXIS => Err(GpuError::Limit {
                what: format!("{} in workgroups", kernel.name),
                wanted: groups.into(),
                limit: WORKGROUPS_PER_AXIS.into(),
            }),
            Groups::Direct(_) => Ok(()),
            Groups::Indirect(buffer, offset) => self.holds(kernel.name, buffer, offset, 12),
        }
    }

    fn holds(&self, what: &str, buffer: Buffer, offset: u64, bytes: u64) -> Result<(), GpuError> {
        let held = self.buffers.get(buffer.0 as usize).map(|declared| declared.bytes);
        let within = held.zip(offset.checked_add(bytes)).is_some_and(|(held, needed)| needed <= held);
        if within && offset.is_multiple_of(4) && bytes.is_multiple_of(4) {
            return Ok(());
        }
        let reason = format!("{what}: {bytes} bytes at {offset} of buffer {} with {held:?}", buffer.0);
        Err(GpuError::Rejected { reason })
    }

    /// For each buffer, the number of the last command that uses it.
    pub(crate) fn last_uses(&self) -> Vec<usize> {
        let mut last = vec![0; self.buffers.len()];
        for (i, command) in self.commands.iter().enumerate() {
            for buffer in command.buffers() {
                last[buffer.0 as usize] = i;
            }
        }
        last
    }
}

impl Command {
    /// The buffers that a command uses.
    pub(crate) fn buffers(&self) -> Vec<Buffer> {
        match self {
            Self::Upload { to, .. } => vec![*to],
            Self::Clear(buffer) => vec![*buffer],
            Self::Copy { from, to, .. } => vec![*from, *to],
            Self::Parameter { from, .. } | Self::Download { from, .. } => vec![*from],
            Self::Dispatch { buffers, groups, .. } => {
                let mut used = buffers.clone();
                if let Groups::Indirect(buffer, _) = groups {
                    used.push(*buffer);
                }
                used
            }
        }
    }
}
