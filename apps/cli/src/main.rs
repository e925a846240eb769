//! The command `vastlight`.

fn main() {}
