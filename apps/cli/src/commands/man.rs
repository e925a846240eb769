//! `vastlight man`: manual pages, from the flags.

use crate::arguments::Cli;
use crate::exit::Exit;
use crate::output::print;
use clap::{Args, Command};
use clap_mangen::Man;
use std::path::PathBuf;
use vastlight::{Error, ErrorClass, film};

/// Print the manual page, or write one for each command
///
/// vastlight man | man -l - shows the page; man -M DIR vastlight-render one that was written to DIR/man1.
#[derive(Args, Debug)]
pub(crate) struct ManPages {
    /// Folder for the pages of all commands, made where it is missing
    #[arg(short, long, value_name = "DIR")]
    output: Option<PathBuf>,
}

pub(crate) fn run(arguments: &ManPages) -> Result<Exit, Error> {
    let root = Cli::described();
    let Some(folder) = &arguments.output else {
        print(&page(&root)?.1)?;
        return Ok(Exit::Done);
    };
    std::fs::create_dir_all(folder)
        .map_err(|e| Error::new(ErrorClass::Output, e.to_string(), folder.display().to_string(), ""))?;
    for command in with_subcommands(&root) {
        let (name, text) = page(command)?;
        film::write_atomically(&folder.join(name), |w| w.write_all(&text))?;
    }
    Ok(Exit::Done)
}

/// A command and all below it.
fn with_subcommands(command: &Command) -> Vec<&Command> {
    let below = command.get_subcommands().flat_map(with_subcommands);
    std::iter::once(command).chain(below).collect()
}

/// The file's name and the text of a command's page.
fn page(command: &Command) -> Result<(String, Vec<u8>), Error> {
    let source = format!("vastlight {}", env!("CARGO_PKG_VERSION"));
    let man = Man::new(command.clone()).source(source).manual("vastlight");
    let name = man.get_filename();
    let mut text = Vec::new();
    man.render(&mut text).map_err(|e| Error::new(ErrorClass::Output, e.to_string(), &name, ""))?;
    Ok((name, text))
}
