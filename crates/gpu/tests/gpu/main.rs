//! Kernels, recordings and devices, on the software adapter where one is needed.

mod build;
mod common;
mod devices;
mod executor;
mod kd;
mod kernels;
mod lights;
mod lights_scenes;
mod maths;
mod paging;
mod parts;
mod path;
mod path_scenes;
mod photon;
mod photon_caustics;
mod primitives;
mod quiet;
mod random;
mod scattering;
mod streams;
mod trace;
