//! A file that appears under its name only when it is complete.

use crate::ExportError;
use std::fs::File;
use std::io::{BufWriter, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

/// A buffered file beside the target. Dropped without [`Target::finish`] it is removed.
pub(crate) struct Target {
    path: PathBuf,
    temporary: PathBuf,
    file: Option<BufWriter<File>>,
    written: u64,
}

impl Target {
    pub(crate) fn create(path: &Path) -> Result<Self, ExportError> {
        let mut name = path.file_name().unwrap_or_default().to_os_string();
        name.push(format!(".{}.part", std::process::id()));
        let temporary = path.with_file_name(name);
        let file = File::create(&temporary).map_err(|e| ExportError::io(path, e))?;
        let file = Some(BufWriter::with_capacity(1 << 20, file));
        Ok(Self { path: path.into(), temporary, file, written: 0 })
    }

    /// Bytes written so far.
    pub(crate) fn written(&self) -> u64 {
        self.written
    }

    /// Appends bytes.
    pub(crate) fn put(&mut self, bytes: &[u8]) -> Result<(), ExportError> {
        self.written += bytes.len() as u64;
        self.step(|file| file.write_all(bytes))
    }

    /// Appends `value` until the length is a multiple of four.
    pub(crate) fn pad(&mut self, value: u8) -> Result<(), ExportError> {
        while !self.written.is_multiple_of(4) {
            self.put(&[value])?;
        }
        Ok(())
    }

    /// Replaces bytes written before.
    pub(crate) fn patch(&mut self, offset: u64, bytes: &[u8]) -> Result<(), ExportError> {
        self.step(|file| {
            file.seek(SeekFrom::Start(offset))?;
            file.write_all(bytes)?;
            file.seek(SeekFrom::End(0)).map(|_| ())
        })
    }

    /// Gives the file its name.
    pub(crate) fn finish(mut self) -> Result<(), ExportError> {
        self.step(|file| file.flush())?;
        self.file = None;
        let renamed = std::fs::rename(&self.temporary, &self.path);
        renamed.map_err(|e| {
            std::fs::remove_file(&self.temporary).ok();
            ExportError::io(&self.path, e)
        })
    }

    fn step(
        &mut self,
        action: impl FnOnce(&mut BufWriter<File>) -> std::io::Result<()>,
    ) -> Result<(), ExportError> {
        match &mut self.file {
            Some(file) => action(file).map_err(|e| ExportError::io(&self.path, e)),
            None => Ok(()),
        }
    }
}

impl Drop for Target {
    fn drop(&mut self) {
        if self.file.take().is_some() {
            // Nothing can be done here if it stays.
            std::fs::remove_file(&self.temporary).ok();
        }
    }
}
