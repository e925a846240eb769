//! The command `vastlight`: reads its arguments, does one thing, and says how it went by its exit code.

mod arguments;
mod commands;
mod exit;
mod findings;
mod interrupt;
mod output;
mod progress;
#[cfg(test)]
mod reference;
mod values;

use arguments::{Cli, Command};
use clap::Parser;
use exit::Exit;
use std::process::ExitCode;
use std::time::Instant;
use vastlight::Error;

fn main() -> ExitCode {
    let start = Instant::now();
    let cli = match Cli::try_parse() {
        Ok(cli) => cli,
        Err(error) => return exit::from_arguments(&error),
    };
    match run(&cli, start) {
        Ok(exit) => exit.into(),
        Err(error) => {
            eprintln!("error: {}", findings::one_line(&error.to_string()));
            Exit::from(error.class).into()
        }
    }
}

/// Runs the command in a pool of the requested number of threads.
fn run(cli: &Cli, start: Instant) -> Result<Exit, Error> {
    cli.common.check(&cli.command)?;
    let mut pool = rayon::ThreadPoolBuilder::new();
    if let Some(threads) = cli.common.threads {
        pool = pool.num_threads(threads as usize);
    }
    let pool = pool.build().map_err(|e| Error::usage(e.to_string(), "--threads", ""))?;
    pool.install(|| match &cli.command {
        Command::Render(arguments) => commands::render::run(arguments, &cli.common, start),
        Command::View(arguments) => commands::view::run(arguments, &cli.common),
        Command::Info(arguments) => commands::info::run(arguments, &cli.common),
        Command::Validate(arguments) => commands::validate::run(arguments, &cli.common),
        Command::Generate(arguments) => commands::generate::run(arguments, &cli.common, start),
        Command::Pack(arguments) => commands::pack::run(arguments, &cli.common, start),
        Command::Merge(arguments) => commands::merge::run(arguments, &cli.common),
        Command::Diff(arguments) => commands::diff::run(arguments),
        Command::Devices(arguments) => commands::devices::run(arguments, &cli.common),
        Command::Bench(arguments) => commands::bench::run(arguments, &cli.common, start),
        Command::Completions(arguments) => commands::completions::run(arguments),
        Command::Man(arguments) => commands::man::run(arguments),
    })
}
