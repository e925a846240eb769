//! The film: sums that merge to the same bits, tone curves, image files.
//!
//! A [`Film`] is a grid of [`FilmTile`]s. Tiles take samples in exact fixed-point arithmetic ([`Exact`]), so neither the
//! order of samples, nor the order of tiles, nor the grouping of merged films changes a bit. [`Film::develop`] turns
//! sums into a [`Picture`] of linear f32 planes, which [`write_exr`] and [`write_png`] put into files. An [`Accumulator`] is a film
//! under way: it knows which samples it has, goes into a file ([`write_sums`]), is taken up again and added to others; a [`Mosaic`] puts
//! parts of a picture together.

mod accumulator;
mod aov;
mod atomic;
mod blocks;
mod compare;
mod coverage;
mod cryptomatte;
mod error;
mod exr_header;
mod exr_write;
mod film;
mod fixed;
mod mosaic;
mod noise;
mod picture;
mod png_write;
mod read;
mod recipe;
mod samples;
mod tile;
mod tone;
mod vlc;

pub use accumulator::{Accumulator, Counters};
pub use aov::Aov;
pub use atomic::{check_writable, write_atomically};
pub use blocks::Blocks;
pub use compare::{Figures, compare, difference};
pub use cryptomatte::{Cryptomatte, float_from_hash, name_hash};
pub use error::FilmError;
pub use exr_write::{encode_exr, write_exr};
pub use film::{Film, FilmSettings, Window};
pub use fixed::{Exact, ExactUnit};
pub use mosaic::Mosaic;
pub use noise::{is_look, next_look};
pub use picture::{Picture, Plane};
pub use png_write::{BitDepth, PngOptions, encode_png, quantise, write_png};
pub use read::read_picture;
pub use recipe::Recipe;
pub use samples::SampleSet;
pub use tile::{FilmTile, PixelSample};
pub use tone::{ToneCurve, linear_from_srgb, srgb_from_linear};
pub use vlc::{SumsFile, decode_sums, encode_sums, write_sums};
