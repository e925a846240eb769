#![no_main]

vastlight_fuzz::target!("draco");
