//! One command for every chore: see [`USAGE`].

mod axe;
mod book;
mod browser;
mod driver;
mod fuzz;
mod gallery;
mod process;
mod python;
mod sheet;
mod test;

use std::process::ExitCode;

const USAGE: &str = "usage: cargo xtask COMMAND

  test       everything that must pass: format, lints, documentation, all tests; counts what was skipped and why;
             looks for a software Vulkan driver, and asks apt-get for it where there is none; says where the
             browser is in which the interactive page is tested; tests the Python package where
             there is a Python
  lint       format, lints, documentation, licences and sources of dependencies alone
  soak       the long proofs (minutes to hours): 10^7 rays at closed meshes, reference pictures at
             high sample counts, stores damaged and processes killed by chance; every fuzz target for a minute
  fuzz [TARGET] [SECONDS]  runs the fuzz targets, or one of them (60 seconds each), with cargo-fuzz
  book       builds the documents as a site in target/book, by mdBook
  gallery [NAME]  renders the pictures of docs/gallery again, or one of them
  sheet DIR  renders a thumbnail of every model below DIR
  python     the tests of the Python package alone
  wheel      the Python package as it is published, tested in an environment of its own";

fn main() -> ExitCode {
    let command = std::env::args().nth(1).unwrap_or_default();
    let outcome = match command.as_str() {
        "test" => test::run(),
        "lint" => test::lint(),
        "soak" => test::soak(),
        "fuzz" => fuzz::run(),
        "book" => book::run(),
        "gallery" => gallery::run(),
        "sheet" => sheet::run(),
        "python" => test::python(),
        "wheel" => python::wheel(),
        _ => Err(USAGE.into()),
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(message) => {
            eprintln!("{message}");
            ExitCode::FAILURE
        }
    }
}
