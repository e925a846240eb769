//! The software Vulkan driver, on which kernels for graphics processors are tested.

use std::path::PathBuf;
use std::process::{Command, Stdio};

/// The packages of Debian that bring it.
const PACKAGES: [&str; 2] = ["mesa-vulkan-drivers", "libvulkan1"];
/// Where drivers say that they are there.
const FOLDERS: [&str; 3] = ["/usr/share/vulkan/icd.d", "/usr/local/share/vulkan/icd.d", "/etc/vulkan/icd.d"];

/// Finds the driver or, where that is allowed, installs it; says in one line how that went.
pub(crate) fn find_or_install() {
    if let Some(found) = find() {
        eprintln!("== software Vulkan driver: {}", found.display());
        return;
    }
    let packages = PACKAGES.join(" ");
    if install()
        && let Some(found) = find()
    {
        eprintln!("== software Vulkan driver: installed {packages}, {}", found.display());
    } else {
        eprintln!(
            "== software Vulkan driver: missing, kernels will not run (Debian: apt-get install {packages})"
        );
    }
}

/// The file by which Mesa's lavapipe says that it is there.
fn find() -> Option<PathBuf> {
    let files = FOLDERS.iter().filter_map(|folder| std::fs::read_dir(folder).ok()).flatten();
    let mut paths = files.filter_map(|file| Some(file.ok()?.path()));
    paths.find(|path| path.file_name().is_some_and(|name| name.to_string_lossy().starts_with("lvp_icd")))
}

/// Asks the package manager; it refuses without the rights, or is not there.
fn install() -> bool {
    let mut command = Command::new("apt-get");
    command.args(["install", "-y", "--no-install-recommends"]).args(PACKAGES);
    command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    command.status().is_ok_and(|status| status.success())
}
