//! The only intrinsics: feature levels and eight-lane vectors.
