//! Files that are either whole or absent.

use std::fs::{self, File};
use std::io::{self, Write};
use std::path::Path;

use super::StoreError;

/// Writes `bytes` to `path`, as [`write_atomically_with`].
///
/// # Errors
/// As [`write_atomically_with`].
pub fn write_atomically(path: &Path, bytes: &[u8]) -> Result<(), StoreError> {
    write_atomically_with(path, |file| file.write_all(bytes))
}

/// Writes a file so that `path` holds either what it held or all of the new content, whatever
/// happens: temporary file in the same folder, flush, fsync, rename, fsync of the folder.
///
/// # Errors
/// If any of these fails; the old file is then untouched.
pub fn write_atomically_with(
    path: &Path,
    write: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> Result<(), StoreError> {
    let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let fail = |e: &io::Error| StoreError::io(path, "cannot be written", e);
    let file = tempfile::Builder::new()
        .prefix(&temporary_prefix())
        .tempfile_in(folder)
        .map_err(|e| fail(&e))?;
    let mut buffer = io::BufWriter::new(file);
    write(&mut buffer).map_err(|e| fail(&e))?;
    // `into_inner` flushes and says so if it cannot; dropping the buffer would not.
    let file = buffer.into_inner().map_err(|e| fail(e.error()))?;
    file.as_file().sync_all().map_err(|e| fail(&e))?;
    // Temporary files are private; results are as readable as any file the user makes.
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        let readable = fs::Permissions::from_mode(0o644);
        file.as_file().set_permissions(readable).map_err(|e| fail(&e))?;
    }
    file.persist(path).map_err(|e| fail(&e.error))?;
    sync_folder(folder).map_err(|e| fail(&e))
}

pub(super) fn sync_folder(folder: &Path) -> io::Result<()> {
    // Folders cannot be opened for syncing on every platform; where they cannot, the rename is as
    // durable as the platform makes it.
    if cfg!(unix) { File::open(folder)?.sync_all() } else { Ok(()) }
}

/// Names this process, so that leftovers of dead ones can be told from work in progress.
pub(super) fn temporary_prefix() -> String {
    format!(".tmp-{}-{}-", host(), std::process::id())
}

fn host() -> String {
    let name = fs::read_to_string("/proc/sys/kernel/hostname").unwrap_or_default();
    let name: String = name.chars().filter(char::is_ascii_alphanumeric).collect();
    if name.is_empty() { "host".into() } else { name }
}

/// Whether `name` is a temporary of a process of this machine that no longer runs.
pub(super) fn is_stale(name: &str) -> bool {
    let Some(rest) = name.strip_prefix(&format!(".tmp-{}-", host())) else { return false };
    let Some(pid) = rest.split('-').next().and_then(|p| p.parse::<u32>().ok()) else {
        return false;
    };
    pid != std::process::id() && cfg!(target_os = "linux") && !runs(pid)
}

/// Whether a process of this machine runs. One that has been killed may take a while to vanish,
/// longer than whoever waited for the process that it belonged to.
fn runs(pid: u32) -> bool {
    const KILLED: u64 = 1 << 8;
    let Ok(status) = fs::read_to_string(format!("/proc/{pid}/status")) else {
        return Path::new(&format!("/proc/{pid}")).exists();
    };
    let field = |name: &str| status.lines().find_map(|l| l.strip_prefix(name)).map(str::trim);
    let is_dead = field("State:").is_some_and(|state| state.starts_with(['Z', 'X']));
    let pending = field("ShdPnd:").and_then(|mask| u64::from_str_radix(mask, 16).ok());
    !is_dead && pending.unwrap_or(0) & KILLED == 0
}
