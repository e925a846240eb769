//! The documents are true: their links lead somewhere, their commands run, their examples parse.
// Commands run in a shell.
#![cfg(unix)]

#[path = "../../../../crates/vastlight/tests/common/animated.rs"]
mod animated;
mod commands;
#[path = "../common/mod.rs"]
mod common;
mod excluded;
mod fixtures;
mod links;
mod markdown;
mod reduce;
