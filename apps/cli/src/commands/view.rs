//! `vastlight view [SCENE]`: the interactive page.

use crate::arguments::{Common, SceneOptions};
use crate::exit::Exit;
use crate::{interrupt, output, values};
use clap::Args;
use std::io::Write;
use std::net::IpAddr;
use std::path::PathBuf;
use std::process::{Command, Stdio};
use std::sync::atomic::Ordering;
use std::time::Duration;
use vastlight::math::Vec3;
use vastlight::{CameraChoice, Error};
use vastlight_viewer::{Server, Viewer};

/// Fly through a scene in the browser
///
/// Prints the page's address on the first line; Ctrl-C ends it. Whoever has the address can watch and steer: it holds a token.
#[derive(Args, Debug)]
pub(crate) struct View {
    /// What to open first: a file, a store (.vls), or demo:NAME; without it the page offers demos and the folder
    #[arg(value_name = "SCENE")]
    scene: Option<String>,
    #[command(flatten)]
    options: SceneOptions,
    /// Folder whose scenes the page may open, with those below it
    #[arg(long, value_name = "DIR")]
    folder: Option<PathBuf>,
    /// Port; 0 for a free one
    #[arg(long, value_name = "N", default_value_t = 0)]
    port: u16,
    /// Address to listen on. Any but this machine's own lets others in who have the page's address; the connection is not encrypted
    #[arg(long, value_name = "ADDR", default_value = "127.0.0.1")]
    host: IpAddr,
    /// Leave opening the browser to the user
    #[arg(long)]
    no_open: bool,
    /// Samples a pixel of a picture at rest
    #[arg(long, alias = "samples", value_name = "N", default_value_t = 64, value_parser = clap::value_parser!(u32).range(1..=1 << 16))]
    spp: u32,
    /// Camera by name, or by number from 0 [default: the first]
    #[arg(long, value_name = "NAME")]
    camera: Option<String>,
    /// Eye and target
    #[arg(long, value_name = "EX,EY,EZ,TX,TY,TZ", value_parser = values::look_at, allow_hyphen_values = true)]
    look_at: Option<[Vec3; 2]>,
    /// Full vertical angle of view, degrees
    #[arg(long, value_name = "DEG", value_parser = values::field_of_view)]
    fov: Option<f32>,
}

/// How often it is looked whether to stop.
const LOOK: Duration = Duration::from_millis(50);

pub(crate) fn run(arguments: &View, common: &Common) -> Result<Exit, Error> {
    let viewer = arguments.viewer(common)?;
    let cancel = interrupt::flag()?;
    let server = Server::start(viewer)?;
    let mut stdout = std::io::stdout().lock();
    writeln!(stdout, "{}", server.url())
        .and_then(|()| stdout.flush())
        .map_err(|e| output::stdout_error(&e))?;
    drop(stdout);
    if !arguments.host.is_loopback() && !common.quiet {
        eprintln!("warning: whoever has this address can see and steer; the connection is not encrypted");
    }
    if !arguments.no_open {
        open_browser(server.url());
    }
    while !cancel.load(Ordering::Relaxed) {
        std::thread::sleep(LOOK);
    }
    drop(server);
    Ok(Exit::Done)
}

impl View {
    fn viewer(&self, common: &Common) -> Result<Viewer, Error> {
        if let Some(folder) = self.folder.as_ref().filter(|folder| !folder.is_dir()) {
            let place = format!("--folder {}", folder.display());
            return Err(Error::usage("this is no folder", place, "name one that is there"));
        }
        Ok(Viewer {
            source: self.scene.clone(),
            options: self.options.load_options(common)?,
            scene_arguments: self.options.words(),
            camera: CameraChoice { name: self.camera.clone(), look_at: self.look_at, fov: self.fov },
            folder: self.folder.clone(),
            memory: common.memory,
            threads: common.threads.map(usize::from),
            spp: self.spp,
            host: self.host,
            port: self.port,
        })
    }
}

/// Opens the page where there is a desktop; where that fails, the address is on the screen.
fn open_browser(url: &str) {
    let has_desktop = ["DISPLAY", "WAYLAND_DISPLAY"].iter().any(|name| std::env::var_os(name).is_some());
    let mut command = match std::env::consts::OS {
        "macos" => Command::new("open"),
        "windows" => Command::new("explorer"),
        _ if has_desktop => Command::new("xdg-open"),
        _ => return,
    };
    let _ = command.arg(url).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null()).spawn();
}
