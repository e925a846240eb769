//! A stand-in for Open Image Denoise, built by the tests: it writes down what it is told, and halves the colour.
//!
//! `FAKE_LOG` is the file for that, `FAKE_FAIL` what fails ("device", "execute", or nothing); both when it is built.

use std::collections::BTreeMap;
use std::ffi::{CStr, c_char, c_int, c_void};
use std::io::Write;
use std::sync::Mutex;

struct Image {
    pixels: usize,
    count: usize,
}

static IMAGES: Mutex<BTreeMap<String, Image>> = Mutex::new(BTreeMap::new());
static ERROR: Mutex<bool> = Mutex::new(false);

fn log(line: String) {
    let file = std::fs::OpenOptions::new().create(true).append(true).open(env!("FAKE_LOG"));
    writeln!(file.expect("opens"), "{line}").expect("writes");
}

fn fail_in(what: &str) {
    *ERROR.lock().expect("sound") |= env!("FAKE_FAIL") == what;
}

fn text(name: *const c_char) -> String {
    // SAFETY: callers give C strings.
    unsafe { CStr::from_ptr(name) }.to_str().expect("UTF-8").to_owned()
}

fn numbers(image: &Image) -> &'static mut [f32] {
    // SAFETY: so many floats are there, as the caller has said.
    unsafe { std::slice::from_raw_parts_mut(image.pixels as *mut f32, image.count) }
}

#[unsafe(no_mangle)]
extern "C" fn oidnNewDevice(kind: c_int) -> *mut c_void {
    log(format!("new device {kind}"));
    fail_in("device");
    if env!("FAKE_FAIL") == "device" { std::ptr::null_mut() } else { 8 as *mut c_void }
}

#[unsafe(no_mangle)]
extern "C" fn oidnSetDeviceInt(_: *mut c_void, name: *const c_char, value: c_int) {
    log(format!("device {} {value}", text(name)));
}

#[unsafe(no_mangle)]
extern "C" fn oidnGetDeviceInt(_: *mut c_void, name: *const c_char) -> c_int {
    if text(name) == "version" { 20_399 } else { 0 }
}

#[unsafe(no_mangle)]
extern "C" fn oidnCommitDevice(_: *mut c_void) {}

#[unsafe(no_mangle)]
extern "C" fn oidnReleaseDevice(_: *mut c_void) {
    log("release device".into());
}

#[unsafe(no_mangle)]
extern "C" fn oidnGetDeviceError(_: *mut c_void, message: *mut *const c_char) -> c_int {
    let failed = std::mem::take(&mut *ERROR.lock().expect("sound"));
    if failed {
        // SAFETY: the caller gives a place for it.
        unsafe { *message = c"no luck today".as_ptr() };
    }
    c_int::from(failed)
}

#[unsafe(no_mangle)]
extern "C" fn oidnNewFilter(_: *mut c_void, kind: *const c_char) -> *mut c_void {
    log(format!("new filter {}", text(kind)));
    16 as *mut c_void
}

#[unsafe(no_mangle)]
extern "C" fn oidnSetSharedFilterImage(
    _: *mut c_void,
    name: *const c_char,
    pixels: *mut c_void,
    format: c_int,
    width: usize,
    height: usize,
    offset: usize,
    pixel_stride: usize,
    row_stride: usize,
) {
    assert_eq!((format, offset, pixel_stride, row_stride), (3, 0, 0, 0));
    let image = Image { pixels: pixels as usize, count: 3 * width * height };
    log(format!("image {} {width} x {height} starts {:?}", text(name), &numbers(&image)[..3]));
    IMAGES.lock().expect("sound").insert(text(name), image);
}

// Under the name that version 1 has.
#[unsafe(no_mangle)]
extern "C" fn oidnSetFilter1b(_: *mut c_void, name: *const c_char, value: bool) {
    log(format!("filter {} {value}", text(name)));
}

#[unsafe(no_mangle)]
extern "C" fn oidnSetFilterInt(_: *mut c_void, name: *const c_char, value: c_int) {
    log(format!("filter {} {value}", text(name)));
}

#[unsafe(no_mangle)]
extern "C" fn oidnCommitFilter(_: *mut c_void) {
    log("commit filter".into());
}

#[unsafe(no_mangle)]
extern "C" fn oidnExecuteFilter(_: *mut c_void) {
    log("execute filter".into());
    fail_in("execute");
    let images = IMAGES.lock().expect("sound");
    let output = numbers(&images["output"]).iter_mut();
    output.zip(numbers(&images["color"])).for_each(|(output, color)| *output = 0.5 * *color);
}

#[unsafe(no_mangle)]
extern "C" fn oidnReleaseFilter(_: *mut c_void) {
    log("release filter".into());
}
