//! `vastlight completions SHELL`: a script for the shell, from the flags.

use crate::arguments::Cli;
use crate::exit::Exit;
use crate::output::print;
use clap::{Args, CommandFactory};
use clap_complete::Shell;
use vastlight::Error;

/// Print the script by which a shell completes commands and flags
///
/// bash: vastlight completions bash > ~/.local/share/bash-completion/completions/vastlight
#[derive(Args, Debug)]
pub(crate) struct Completions {
    /// The shell
    shell: Shell,
}

pub(crate) fn run(arguments: &Completions) -> Result<Exit, Error> {
    let mut command = Cli::command();
    let name = command.get_name().to_owned();
    let mut script = Vec::new();
    clap_complete::generate(arguments.shell, &mut command, name, &mut script);
    print(&script)?;
    Ok(Exit::Done)
}
