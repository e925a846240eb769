//! Small files made here, one feature each, and hostile variants of them.

mod animation;
mod builder;
mod compression;
mod geometry;
mod hostile;
mod materials;
mod nodes;
mod posing;
mod reports;
mod streaming;
