//! Exit codes, and the one line that an error is.

use clap::error::ErrorKind;
use std::io::Write;
use std::process::ExitCode;
use vastlight::ErrorClass;

/// How the command ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Exit {
    /// Done.
    Done,
    /// `diff --tolerance`: the pictures differ by more.
    Different,
    /// The arguments make no sense.
    Usage,
    /// A scene or input file cannot be used.
    Scene,
    /// The memory budget is too small.
    Memory,
    /// The device cannot be used.
    Device,
    /// A file cannot be written.
    Output,
    /// Samples were not finite, and `--strict` was given.
    NonFinite,
    /// Ctrl-C, or a request to terminate.
    Interrupted,
}

impl Exit {
    const fn code(self) -> u8 {
        match self {
            Self::Done => 0,
            Self::Different => 1,
            Self::Usage => 2,
            Self::Scene => 3,
            Self::Memory => 4,
            Self::Device => 5,
            Self::Output => 6,
            Self::NonFinite => 7,
            Self::Interrupted => 130,
        }
    }
}

impl From<Exit> for ExitCode {
    fn from(exit: Exit) -> Self {
        Self::from(exit.code())
    }
}

impl From<ErrorClass> for Exit {
    fn from(class: ErrorClass) -> Self {
        match class {
            ErrorClass::Usage => Self::Usage,
            ErrorClass::Scene => Self::Scene,
            ErrorClass::Memory => Self::Memory,
            ErrorClass::Device => Self::Device,
            ErrorClass::Output => Self::Output,
            ErrorClass::NonFinite => Self::NonFinite,
            ErrorClass::Interrupted => Self::Interrupted,
        }
    }
}

/// Prints help as it is and a mistake in the arguments as one line.
pub(crate) fn from_arguments(error: &clap::Error) -> ExitCode {
    match error.kind() {
        ErrorKind::DisplayHelp | ErrorKind::DisplayVersion => {
            // Whoever reads may have seen enough.
            let _ = write!(std::io::stdout(), "{error}");
            Exit::Done.into()
        }
        ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand => {
            eprint!("{error}");
            Exit::Usage.into()
        }
        _ => {
            eprintln!("{}", one_line(&error.to_string()));
            Exit::Usage.into()
        }
    }
}

/// The message of the argument parser without its usage text, on one line.
fn one_line(message: &str) -> String {
    let before_usage = message.split("Usage:").next().unwrap_or(message);
    let before_usage = before_usage.split("For more information").next().unwrap_or(before_usage);
    let lines: Vec<&str> = before_usage.lines().map(str::trim).filter(|l| !l.is_empty()).collect();
    format!("{} (see --help)", lines.join("; ").replace(":; ", ": "))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mistake_is_one_line() {
        let message = "error: unexpected argument '--ssp' found\n\n  tip: a similar argument exists: '--spp'\n\nUsage: vastlight render\n\nFor more information, try '--help'.\n";
        let expected =
            "error: unexpected argument '--ssp' found; tip: a similar argument exists: '--spp' (see --help)";
        assert_eq!(one_line(message), expected);
    }
}
