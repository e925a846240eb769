//! The library's functions, and safe handles of its device and filter.
#![expect(unsafe_code, reason = "calls into a C library; each block says why its arguments are valid")]

use crate::DenoiseError;
use libloading::Library;
use std::ffi::{CStr, c_char, c_int, c_void};
use std::marker::PhantomData;
use std::path::PathBuf;
use std::ptr;

type Object = *mut c_void;

/// `OIDN_DEVICE_TYPE_CPU`: it alone reads memory that is not its own, and gives the same bits on every machine.
const CPU: c_int = 1;
/// `OIDN_FORMAT_FLOAT3`.
const FLOAT3: c_int = 3;

/// The functions that are called.
#[derive(Clone, Copy, Debug)]
struct Functions {
    new_device: unsafe extern "C" fn(c_int) -> Object,
    set_device_int: unsafe extern "C" fn(Object, *const c_char, c_int),
    get_device_int: unsafe extern "C" fn(Object, *const c_char) -> c_int,
    commit_device: unsafe extern "C" fn(Object),
    release_device: unsafe extern "C" fn(Object),
    get_device_error: unsafe extern "C" fn(Object, *mut *const c_char) -> c_int,
    new_filter: unsafe extern "C" fn(Object, *const c_char) -> Object,
    set_shared_filter_image:
        unsafe extern "C" fn(Object, *const c_char, Object, c_int, usize, usize, usize, usize, usize),
    set_filter_bool: unsafe extern "C" fn(Object, *const c_char, bool),
    set_filter_int: unsafe extern "C" fn(Object, *const c_char, c_int),
    commit_filter: unsafe extern "C" fn(Object),
    execute_filter: unsafe extern "C" fn(Object),
    release_filter: unsafe extern "C" fn(Object),
}

/// Loads the first of these libraries that can be, and looks up its functions. It stays loaded to the end of the process,
/// since it has threads of its own.
fn load(candidates: &[PathBuf]) -> Result<Functions, DenoiseError> {
    let mut why = String::new();
    for path in candidates {
        // SAFETY: the file is one that the user names, or the system finds under the name of Open Image Denoise; what
        // such a library does when it is loaded is its own, and asks for nothing here.
        match unsafe { Library::new(path) } {
            Ok(library) => {
                let library: &'static Library = Box::leak(Box::new(library));
                let foreign = |function| DenoiseError::Foreign { library: path.clone(), function };
                return functions(library).map_err(foreign);
            }
            Err(error) => why = error.to_string(),
        }
    }
    Err(DenoiseError::Missing { looked_for: candidates.to_vec(), why })
}

/// The functions, those that version 1 calls otherwise under their other name too; or the name of one that is missing.
fn functions(library: &'static Library) -> Result<Functions, &'static str> {
    // SAFETY: the types are those of the functions' declarations in `oidn.h`, the same in versions 1 and 2.
    unsafe {
        Ok(Functions {
            new_device: function(library, &["oidnNewDevice"])?,
            set_device_int: function(library, &["oidnSetDeviceInt", "oidnSetDevice1i"])?,
            get_device_int: function(library, &["oidnGetDeviceInt", "oidnGetDevice1i"])?,
            commit_device: function(library, &["oidnCommitDevice"])?,
            release_device: function(library, &["oidnReleaseDevice"])?,
            get_device_error: function(library, &["oidnGetDeviceError"])?,
            new_filter: function(library, &["oidnNewFilter"])?,
            set_shared_filter_image: function(library, &["oidnSetSharedFilterImage"])?,
            set_filter_bool: function(library, &["oidnSetFilterBool", "oidnSetFilter1b"])?,
            set_filter_int: function(library, &["oidnSetFilterInt", "oidnSetFilter1i"])?,
            commit_filter: function(library, &["oidnCommitFilter"])?,
            execute_filter: function(library, &["oidnExecuteFilter"])?,
            release_filter: function(library, &["oidnReleaseFilter"])?,
        })
    }
}

/// The function of the first of these names, or the first name if there is none.
///
/// # Safety
/// `F` must be the type of the functions of these names.
unsafe fn function<F: Copy>(
    library: &'static Library,
    names: &'static [&'static str],
) -> Result<F, &'static str> {
    // SAFETY: the type is the caller's word.
    let found = names.iter().find_map(|name| unsafe { library.get::<F>(name.as_bytes()) }.ok());
    found.map(|function| *function).ok_or(names[0])
}

/// A device on the processor.
#[derive(Debug)]
pub(crate) struct Device {
    functions: Functions,
    object: Object,
}

impl Device {
    /// Loads the first of these libraries that can be, and starts a device with so many threads.
    pub(crate) fn new(candidates: &[PathBuf], threads: usize) -> Result<Self, DenoiseError> {
        let functions = load(candidates)?;
        // SAFETY: no argument is a pointer.
        let object = unsafe { (functions.new_device)(CPU) };
        let device = Self { functions, object };
        if object.is_null() {
            device.check()?;
            return Err(DenoiseError::Failed("it has no device".into()));
        }
        let threads = c_int::try_from(threads).unwrap_or(c_int::MAX);
        // SAFETY: the device is not released before `device` is dropped, and the name is a C string.
        unsafe {
            (functions.set_device_int)(object, c"numThreads".as_ptr(), threads);
            (functions.commit_device)(object);
        }
        device.check()?;
        Ok(device)
    }

    /// The library's version: major, minor, patch.
    pub(crate) fn version(&self) -> [u32; 3] {
        // SAFETY: as in `new`.
        let version = unsafe { (self.functions.get_device_int)(self.object, c"version".as_ptr()) };
        let version = version.max(0) as u32;
        [version / 10_000, version / 100 % 100, version % 100]
    }

    /// What went wrong since it was asked last.
    fn check(&self) -> Result<(), DenoiseError> {
        let mut message: *const c_char = ptr::null();
        // SAFETY: the device is one, or null, which stands for the calling thread; the message is written.
        let code = unsafe { (self.functions.get_device_error)(self.object, &raw mut message) };
        if code == 0 {
            return Ok(());
        }
        if message.is_null() {
            return Err(DenoiseError::Failed(format!("error {code}")));
        }
        // SAFETY: the message is a C string that lives until the device is asked for the next error.
        let message = unsafe { CStr::from_ptr(message) };
        Err(DenoiseError::Failed(message.to_string_lossy().into_owned()))
    }
}

impl Drop for Device {
    fn drop(&mut self) {
        if !self.object.is_null() {
            // SAFETY: filters borrow the device, so that none is left that uses it.
            unsafe { (self.functions.release_device)(self.object) };
        }
    }
}

/// A filter for pictures of ray tracing, over images that it borrows.
#[derive(Debug)]
pub(crate) struct Filter<'i> {
    device: &'i Device,
    object: Object,
    size: [usize; 2],
    images: PhantomData<&'i mut [[f32; 3]]>,
}

impl<'i> Filter<'i> {
    /// A filter over images of so many columns and rows.
    pub(crate) fn new(device: &'i Device, size: [usize; 2]) -> Result<Self, DenoiseError> {
        // SAFETY: the device is one, the name a C string.
        let object = unsafe { (device.functions.new_filter)(device.object, c"RT".as_ptr()) };
        let filter = Self { device, object, size, images: PhantomData };
        device.check()?;
        if object.is_null() { Err(DenoiseError::Failed("it has no filter".into())) } else { Ok(filter) }
    }

    /// Sets an image to read or to write.
    pub(crate) fn set_image(&mut self, name: &CStr, pixels: &'i mut [[f32; 3]]) -> Result<(), DenoiseError> {
        let [width, height] = self.size;
        if pixels.len() != width * height {
            return Err(DenoiseError::Shape(width * height));
        }
        let memory = pixels.as_mut_ptr().cast();
        // SAFETY: there are width * height pixels of three floats without gaps (zeros stand for that), borrowed for as
        // long as the filter lives.
        unsafe {
            let set = self.device.functions.set_shared_filter_image;
            set(self.object, name.as_ptr(), memory, FLOAT3, width, height, 0, 0, 0);
        }
        Ok(())
    }

    /// Sets a switch.
    pub(crate) fn set_bool(&mut self, name: &CStr, value: bool) {
        // SAFETY: the filter is one, the name a C string.
        unsafe { (self.device.functions.set_filter_bool)(self.object, name.as_ptr(), value) };
    }

    /// Sets a number.
    pub(crate) fn set_int(&mut self, name: &CStr, value: c_int) {
        // SAFETY: the filter is one, the name a C string.
        unsafe { (self.device.functions.set_filter_int)(self.object, name.as_ptr(), value) };
    }

    /// Runs over the images.
    pub(crate) fn run(self) -> Result<(), DenoiseError> {
        // SAFETY: the filter is one, and its images are borrowed.
        unsafe { (self.device.functions.commit_filter)(self.object) };
        self.device.check()?;
        // SAFETY: likewise, and it is committed without an error; the call returns when all is done.
        unsafe { (self.device.functions.execute_filter)(self.object) };
        self.device.check()
    }
}

impl Drop for Filter<'_> {
    fn drop(&mut self) {
        if !self.object.is_null() {
            // SAFETY: nothing else has the filter.
            unsafe { (self.device.functions.release_filter)(self.object) };
        }
    }
}
