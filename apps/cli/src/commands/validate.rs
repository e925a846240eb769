//! `vastlight validate FILE`: every problem with its place and a hint.

use crate::arguments::Common;
use crate::exit::Exit;
use crate::findings::one_line;
use clap::Args;
use vastlight::scene::{Diagnostic, Scene, Severity};
use vastlight::{Error, describe};

/// Check a scene file: prints every problem with its place and a hint; exit code 3 if there is an error
#[derive(Args, Debug)]
pub(crate) struct Validate {
    /// glTF, GLB, OBJ, PLY or STL file, or demo:NAME
    file: String,
}

pub(crate) fn run(arguments: &Validate, common: &Common) -> Result<Exit, Error> {
    let desc = describe(&arguments.file, &common.load_options())?;
    let imported = desc.diagnostics.items().to_vec();
    match Scene::new(desc) {
        Ok(scene) => Ok(report(&arguments.file, scene.diagnostics().items())),
        Err(error) => {
            // The first error is among the importer's findings, or was found by the scene's own checks.
            let mut findings = imported;
            if !findings.iter().any(|f| f.severity == Severity::Error) {
                let (what, place, hint) = (error.what, error.place, error.hint);
                findings.push(Diagnostic { severity: Severity::Error, what, place, hint });
            }
            Ok(report(&arguments.file, &findings))
        }
    }
}

/// Prints the findings, the worst first, and a summary.
fn report(file: &str, findings: &[Diagnostic]) -> Exit {
    let of = |severity| findings.iter().filter(move |f| f.severity == severity);
    of(Severity::Error).for_each(|f| println!("error: {}", one_line(&f.to_string())));
    of(Severity::Warning).for_each(|f| println!("warning: {}", one_line(&f.to_string())));
    let (errors, warnings) = (of(Severity::Error).count(), of(Severity::Warning).count());
    println!("{file}: {errors} errors, {warnings} warnings");
    if errors > 0 { Exit::Scene } else { Exit::Done }
}
