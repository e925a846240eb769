//! Progress on stderr: a bar, JSON lines, or nothing.

use clap::ValueEnum;
use indicatif::{ProgressBar, ProgressStyle};
use serde_json::json;
use std::io::IsTerminal;
use std::sync::Mutex;
use std::time::{Duration, Instant};
use vastlight::Progress;

/// How progress is shown.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum ProgressKind {
    /// A bar on a terminal, else nothing.
    Auto,
    /// A bar.
    Bar,
    /// One JSON object a line.
    Json,
    /// Nothing.
    None,
}

/// Receives the progress of a render.
pub(crate) enum Reporter {
    Bar(ProgressBar),
    Json(Mutex<Option<Instant>>),
    Silent,
}

/// Shortest time between two JSON lines.
const JSON_INTERVAL: Duration = Duration::from_millis(200);

impl Reporter {
    pub(crate) fn new(kind: ProgressKind, quiet: bool) -> Self {
        let bar = match kind {
            ProgressKind::Json => return Self::Json(Mutex::new(None)),
            ProgressKind::None => false,
            ProgressKind::Bar => true,
            ProgressKind::Auto => !quiet && std::io::stderr().is_terminal(),
        };
        if bar { Self::Bar(new_bar()) } else { Self::Silent }
    }

    /// Whether machine-readable lines are wanted.
    pub(crate) fn is_json(&self) -> bool {
        matches!(self, Self::Json(_))
    }

    /// Shows how far the work is.
    pub(crate) fn update(&self, progress: &Progress) {
        match self {
            Self::Bar(bar) => {
                bar.set_length(progress.samples_total);
                bar.set_position(progress.samples);
                bar.set_message(format!("{} spp, {} left", progress.spp, eta(progress)));
            }
            Self::Json(last) => {
                let Ok(mut last) = last.lock() else { return };
                if last.is_none_or(|t| t.elapsed() >= JSON_INTERVAL) {
                    *last = Some(Instant::now());
                    eprintln!("{}", json_line(progress));
                }
            }
            Self::Silent => {}
        }
    }

    /// Takes the bar away.
    pub(crate) fn finish(&self) {
        if let Self::Bar(bar) = self {
            bar.finish_and_clear();
        }
    }
}

fn new_bar() -> ProgressBar {
    let style = ProgressStyle::with_template("{bar:40} {percent:>3} %  {elapsed} {msg}");
    let bar = ProgressBar::new(1);
    bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
    bar
}

fn eta(progress: &Progress) -> String {
    let seconds = progress.remaining.map_or(0, |r| r.as_secs());
    match seconds {
        0..60 => format!("{seconds} s"),
        60..3600 => format!("{} min {:02} s", seconds / 60, seconds % 60),
        _ => format!("{} h {:02} min", seconds / 3600, seconds / 60 % 60),
    }
}

fn json_line(progress: &Progress) -> serde_json::Value {
    let elapsed = progress.elapsed.as_secs_f64();
    json!({
        "event": "progress",
        "samples": progress.samples,
        "samples_total": progress.samples_total,
        "fraction": progress.samples as f64 / progress.samples_total.max(1) as f64,
        "spp": progress.spp,
        "elapsed_s": elapsed,
        "eta_s": progress.remaining.map(|r| r.as_secs_f64()),
        "msamples_per_s": progress.samples as f64 / 1e6 / elapsed.max(1e-9),
    })
}
