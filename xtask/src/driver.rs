//! The software Vulkan driver, on which kernels for graphics processors are tested.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// The packages of Debian that bring it.
const PACKAGES: [&str; 2] = ["mesa-vulkan-drivers", "libvulkan1"];
/// Where drivers say that they are there.
const FOLDERS: [&str; 3] = ["/usr/share/vulkan/icd.d", "/usr/local/share/vulkan/icd.d", "/etc/vulkan/icd.d"];

/// Finds the driver or, where that is allowed, installs it; says in one line how that went.
pub(crate) fn find_or_install() {
    if let Some(found) = find(&FOLDERS) {
        eprintln!("== software Vulkan driver: {}", found.display());
        return;
    }
    let packages = PACKAGES.join(" ");
    if install()
        && let Some(found) = find(&FOLDERS)
    {
        eprintln!("== software Vulkan driver: installed {packages}, {}", found.display());
    } else {
        eprintln!(
            "== software Vulkan driver: missing, kernels will not run (Debian: apt-get install {packages})"
        );
    }
}

/// The file by which Mesa's lavapipe says that it is there.
fn find(folders: &[impl AsRef<Path>]) -> Option<PathBuf> {
    let files = folders.iter().filter_map(|folder| std::fs::read_dir(folder).ok()).flatten();
    let mut paths = files.filter_map(|file| Some(file.ok()?.path()));
    paths.find(|path| path.file_name().is_some_and(|name| name.to_string_lossy().starts_with("lvp_icd")))
}

/// Asks the package manager; it refuses without the rights, or is not there. It asks nothing back, and does not wait for
/// locks or for servers that do not answer.
fn install() -> bool {
    let mut command = Command::new("apt-get");
    command.env("DEBIAN_FRONTEND", "noninteractive");
    for option in ["DPkg::Lock::Timeout=0", "Acquire::Retries=0", "Acquire::http::Timeout=20"] {
        command.args(["-o", option]);
    }
    command.args(["install", "-y", "--no-install-recommends"]).args(PACKAGES);
    command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    command.status().is_ok_and(|status| status.success())
}

#[cfg(test)]
mod tests {
    use super::find;

    #[test]
    fn the_driver_is_found_by_its_name_or_not_at_all() {
        let folder = std::env::temp_dir().join(format!("vastlight-icd-{}", std::process::id()));
        let folders = [folder.join("none"), folder.clone()];
        assert_eq!(find(&folders), None);
        std::fs::create_dir_all(&folder).expect("a folder");
        std::fs::write(folder.join("other_icd.json"), "").expect("a file");
        assert_eq!(find(&folders), None);
        let driver = folder.join("lvp_icd.x86_64.json");
        std::fs::write(&driver, "").expect("a file");
        assert_eq!(find(&folders), Some(driver));
        std::fs::remove_dir_all(&folder).expect("removed");
    }
}
