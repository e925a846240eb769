//! Progress on stderr: a bar, JSON lines, or nothing.

use clap::ValueEnum;
use indicatif::{ProgressBar, ProgressStyle};
use serde_json::json;
use std::io::IsTerminal;
use std::sync::Mutex;
use std::time::{Duration, Instant};
use vastlight::{PackProgress, Progress, Residency, human_bytes};

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

/// Receives the progress of a render or a pack.
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
                if let Some([ready, all]) = progress.kernels {
                    bar.set_message(format!("{ready} of {all} kernels compiled"));
                    return;
                }
                let pages = progress.residency.as_ref().map_or(String::new(), pages_in_words);
                bar.set_message(format!("{} spp, {} left{pages}", progress.spp, eta(progress)));
            }
            Self::Json(last) => print_seldom(last, || json_line(progress)),
            Self::Silent => {}
        }
    }

    /// Shows how far a pack is.
    pub(crate) fn update_pack(&self, progress: &PackProgress, elapsed: Duration) {
        let here = progress.triangles.saturating_sub(progress.resumed) as f64;
        let rate = here / elapsed.as_secs_f64().max(1e-3);
        let left = progress.total.map(|total| {
            let left = total.saturating_sub(progress.triangles) as f64;
            Duration::try_from_secs_f64(left / rate.max(1.0)).unwrap_or(Duration::MAX)
        });
        match self {
            Self::Bar(bar) => {
                let total = progress.total.unwrap_or(0).max(progress.triangles);
                bar.set_length(total.max(1));
                bar.set_position(progress.triangles);
                let millions = |n: u64| n as f64 / 1e6;
                let of = progress.total.map_or(String::new(), |n| format!(" of {:.1}", millions(n)));
                let left = left.map_or(String::new(), |left| format!(", {} left", in_words(left)));
                let done = millions(progress.triangles);
                bar.set_message(format!("{done:.1}{of} Mtri, {:.2} Mtri/s{left}", rate / 1e6));
            }
            Self::Json(last) => print_seldom(last, || pack_line(progress, elapsed, rate, left)),
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

/// Prints a line unless one was printed a moment ago.
fn print_seldom(last: &Mutex<Option<Instant>>, line: impl FnOnce() -> serde_json::Value) {
    let Ok(mut last) = last.lock() else { return };
    if last.is_none_or(|t| t.elapsed() >= JSON_INTERVAL) {
        *last = Some(Instant::now());
        eprintln!("{}", line());
    }
}

fn pack_line(
    progress: &PackProgress,
    elapsed: Duration,
    rate: f64,
    left: Option<Duration>,
) -> serde_json::Value {
    json!({
        "event": "progress",
        "triangles": progress.triangles,
        "triangles_total": progress.total,
        "triangles_resumed": progress.resumed,
        "elapsed_s": elapsed.as_secs_f64(),
        "eta_s": left.map(|left| left.as_secs_f64()),
        "mtriangles_per_s": rate / 1e6,
    })
}

fn pages_in_words(pages: &Residency) -> String {
    let [resident, store, read] =
        [pages.resident_bytes, pages.store_bytes, pages.bytes_read].map(human_bytes);
    format!(", {resident} of {store} resident, {read} read")
}

fn eta(progress: &Progress) -> String {
    in_words(progress.remaining.unwrap_or_default())
}

fn in_words(duration: Duration) -> String {
    let seconds = duration.as_secs();
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
        "residency": progress.residency,
        "kernels": progress.kernels,
    })
}
