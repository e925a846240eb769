#![no_main]

vastlight_fuzz::target!("ies");
