//! What all targets share; what they try is in `crates/harness`.

use std::panic::PanicHookInfo;

/// A target that runs the harness of this name.
#[macro_export]
macro_rules! target {
    ($name:literal) => {
        libfuzzer_sys::fuzz_target!(init: $crate::prepare(), |bytes: &[u8]| {
            $crate::run($name, bytes);
        });
    };
}

/// Runs the harness of this name.
pub fn run(name: &str, bytes: &[u8]) {
    let harness = vastlight_harness::named(name).expect("a harness of this name");
    harness(bytes);
}

/// Ends the process at panics of vastlight's own code. Panics of decoders that others wrote may go on: vastlight catches
/// those and makes them errors, and what it does not catch ends the process as well.
pub fn prepare() {
    let abort = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |info| {
        if !is_foreign(info) {
            abort(info);
        }
    }));
}

fn is_foreign(info: &PanicHookInfo<'_>) -> bool {
    info.location().is_some_and(|place| place.file().contains("/registry/src/"))
}
