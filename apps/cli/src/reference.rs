//! docs/command-line.md follows the flags: a test writes the page and compares.

use crate::arguments::Cli;
use clap::{Arg, ArgAction, Command};
use std::fmt::Write;

const FILE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/command-line.md");
/// Set to write the page instead.
const REWRITE: &str = "VASTLIGHT_REWRITE";

const HEAD: &str = "# Command line

Made from the flags of the command; `vastlight COMMAND --help` says the same, and `vastlight man` makes manual pages of it.
";

/// The whole page.
fn page() -> String {
    let root = Cli::described();
    let mut page = HEAD.to_owned();
    let _ = write!(page, "\n{}\n", description(&root));
    page += "\n## Common options\n\nOf every command.\n\n";
    root.get_arguments().filter(|arg| arg.is_global_set()).for_each(|arg| page += &item(arg));
    root.get_subcommands().for_each(|command| write_command(command, &mut page));
    page
}

/// A command, then those below it.
fn write_command(command: &Command, page: &mut String) {
    let name = command.get_bin_name().unwrap_or_default();
    let usage = command.clone().render_usage().to_string();
    let usage = usage.trim_start_matches("Usage: ");
    let _ = write!(page, "\n## {name}\n\n{}\n\n```text\n{usage}\n```\n", description(command));
    if command.has_subcommands() {
        page.push('\n');
        command.get_subcommands().for_each(|below| {
            let name = below.get_bin_name().unwrap_or_default();
            let _ = writeln!(page, "- [`{name}`](#{})", name.replace(' ', "-"));
        });
    }
    for heading in headings(command) {
        let _ = write!(page, "\n**{}**\n\n", heading.unwrap_or("Arguments and options"));
        own(command).filter(|arg| arg.get_help_heading() == heading).for_each(|arg| *page += &item(arg));
    }
    command.get_subcommands().for_each(|below| write_command(below, page));
}

/// The arguments of a command that others have not.
fn own(command: &Command) -> impl Iterator<Item = &Arg> {
    let is_usual = |arg: &Arg| {
        matches!(
            arg.get_action(),
            ArgAction::Help | ArgAction::HelpShort | ArgAction::HelpLong | ArgAction::Version
        )
    };
    command.get_arguments().filter(move |arg| !arg.is_global_set() && !arg.is_hide_set() && !is_usual(arg))
}

/// The headings of a command's arguments in their order.
fn headings(command: &Command) -> Vec<Option<&str>> {
    own(command).map(Arg::get_help_heading).fold(Vec::new(), |mut headings, heading| {
        if !headings.contains(&heading) {
            headings.push(heading);
        }
        headings
    })
}

fn description(command: &Command) -> String {
    let text = command.get_long_about().or_else(|| command.get_about());
    text.map(|text| escaped(&text.to_string())).unwrap_or_default()
}

/// An argument as an item of a list.
fn item(arg: &Arg) -> String {
    let help = arg.get_long_help().or_else(|| arg.get_help()).map(ToString::to_string).unwrap_or_default();
    let mut item = format!("- `{}`: {}", arg.to_string().trim(), escaped(&help));
    if let Some(short) = arg.get_short() {
        item = item.replacen("- `", &format!("- `-{short}`, `"), 1);
    }
    let defaults: Vec<_> = arg.get_default_values().iter().map(|value| value.to_string_lossy()).collect();
    let takes_value = arg.get_action().takes_values();
    if takes_value && !defaults.is_empty() && defaults != [""] {
        let _ = write!(item, " (default `{}`)", defaults.join(","));
    }
    item.push('\n');
    // Those of --simd are what the processor has.
    let values = if arg.get_id() == "simd" { Vec::new() } else { arg.get_possible_values() };
    for value in values.iter().filter(|value| takes_value && !value.is_hide_set()) {
        let _ = match value.get_help() {
            Some(help) => writeln!(item, "  - `{}`: {}", value.get_name(), escaped(&help.to_string())),
            None => writeln!(item, "  - `{}`", value.get_name()),
        };
    }
    item
}

/// A text in which nothing but code is markup.
fn escaped(text: &str) -> String {
    let mut escaped = String::new();
    let mut in_code = false;
    for c in text.chars() {
        in_code ^= c == '`';
        if !in_code && "*_<>[]|#".contains(c) {
            escaped.push('\\');
        }
        escaped.push(c);
    }
    escaped
}

#[test]
fn the_reference_of_the_command_line_is_that_of_the_flags() {
    let page = page();
    if std::env::var_os(REWRITE).is_some() {
        std::fs::write(FILE, &page).expect("written");
    }
    let file = std::fs::read_to_string(FILE).unwrap_or_default();
    let differs = page.lines().zip(file.lines()).find(|(page, file)| page != file);
    assert!(
        page == file,
        "docs/command-line.md is old, write it again: {REWRITE}=1 cargo test -p vastlight-cli reference\n{differs:?}"
    );
}
