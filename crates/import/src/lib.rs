//! Scene files to scene descriptions, one file a format.
