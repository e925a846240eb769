//! Lines of the documents that no test runs, and why.

/// A beginning of lines, and the reason.
pub(crate) const EXCLUDED: &[(&str, &str)] = &[
    ("cargo install ", "builds the workspace again; a test of its own would take minutes"),
    ("cargo xtask ", "runs the tests, or needs tools that may be absent"),
    ("VASTLIGHT_SOAK=1 ", "takes minutes, and needs a browser"),
    ("git clone ", "needs the network"),
    ("rustup ", "needs the network"),
    ("podman ", "needs a container engine"),
    ("ssh ", "needs another machine"),
    ("sbatch ", "needs a cluster"),
    ("vastlight render house.glb -o house.png --spp 16 --denoise", "needs Open Image Denoise"),
    ("vastlight render https://", "needs a server"),
];

/// Flags of other programs that the text names.
pub(crate) const FOREIGN_FLAGS: &[&str] =
    &["--example", "--features", "--ignored", "--locked", "--nocapture", "--release", "--test"];
