//! Tests of the tracer, in one program: each program compiles the tracer's walks anew.

mod brute_force;
mod bundles;
mod common;
mod implicit;
mod odd_rays;
mod paged;
mod pose;
mod shutter;
mod sorting;
mod splitting;
mod steps;
mod watertight;
