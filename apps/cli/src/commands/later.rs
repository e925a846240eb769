//! Flags whose work is not done yet: each is one clear error, and none is silently ignored.

use clap::Args;
use vastlight::Error;

/// Flags that keep their names for later.
#[derive(Args, Debug)]
pub(crate) struct Later {
    #[arg(long, hide = true)]
    noise: Option<String>,
    #[arg(long, hide = true)]
    checkpoint: Option<String>,
    #[arg(long, hide = true)]
    resume: bool,
    #[arg(long, hide = true)]
    passes: Option<String>,
}

impl Later {
    /// Refuses what is not available yet.
    pub(crate) fn check(&self) -> Result<(), Error> {
        let given = [
            ("--noise", self.noise.is_some()),
            ("--checkpoint", self.checkpoint.is_some()),
            ("--resume", self.resume),
            ("--passes", self.passes.is_some()),
        ];
        match given.iter().find(|(_, given)| *given) {
            Some((flag, _)) => Err(Error::usage("this option is not available yet", *flag, "leave it out")),
            None => Ok(()),
        }
    }
}
