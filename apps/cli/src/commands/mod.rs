//! One file a command.

pub(crate) mod bench;
pub(crate) mod completions;
pub(crate) mod devices;
pub(crate) mod diff;
pub(crate) mod generate;
pub(crate) mod info;
pub(crate) mod keep;
pub(crate) mod man;
pub(crate) mod merge;
pub(crate) mod pack;
pub(crate) mod render;
pub(crate) mod validate;
pub(crate) mod view;
pub(crate) mod write;
