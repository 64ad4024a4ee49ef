//! Files that are either the old one or the new one, never half of each.

use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use anisobond::{Error, Result};

/// How the names of temporary files begin. Who writes one holds a lock on it, so that what a killed program left is known.
pub const TEMPORARY: &str = ".anisobond-";

/// Writes a whole file: under a temporary name in the same folder, flushed to the disk, then renamed.
///
/// On failure nothing is left behind and an old file of that name is untouched. A new file has the mode of any newly
/// made file, a replaced one keeps its mode; a symbolic link is followed. What is not a regular file (a pipe, a
/// terminal) cannot be replaced and is written directly.
///
/// # Errors
/// [`Error::File`] with the path and the operating system's reason.
pub fn write_atomically(path: impl AsRef<Path>, bytes: impl AsRef<[u8]>) -> Result<()> {
    let path = path.as_ref();
    write(path, bytes.as_ref()).map_err(|source| Error::file("write", path, source))
}

fn write(path: &Path, bytes: &[u8]) -> io::Result<()> {
    match fs::metadata(path) {
        Ok(old) if old.is_file() => replace(&fs::canonicalize(path)?, bytes, Some(old.permissions())),
        Ok(_) => fs::OpenOptions::new().write(true).open(path)?.write_all(bytes),
        Err(_) => replace(path, bytes, None),
    }
}

/// Writes beside the target and renames; the temporary file goes away if anything fails before the rename.
fn replace(target: &Path, bytes: &[u8], mode: Option<fs::Permissions>) -> io::Result<()> {
    let folder = folder_of(target);
    let mut file = builder().tempfile_in(&folder)?;
    // Where a file system knows no locks, leftovers stay.
    let _ = file.as_file().try_lock();
    file.write_all(bytes)?;
    if let Some(mode) = mode {
        if mode.readonly() {
            return Err(io::Error::new(io::ErrorKind::PermissionDenied, "the existing file is read-only"));
        }
        file.as_file().set_permissions(mode)?;
    }
    file.as_file().sync_all()?;
    file.persist(target).map_err(|failed| failed.error)?;
    sync_folder(&folder);
    Ok(())
}

fn folder_of(path: &Path) -> PathBuf {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder.to_path_buf(),
        _ => PathBuf::from("."),
    }
}

/// Temporary files with the mode of an ordinary new file: 0666 less the user's mask.
fn builder() -> tempfile::Builder<'static, 'static> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(TEMPORARY);
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        builder.permissions(fs::Permissions::from_mode(0o666));
    }
    builder
}

/// Makes the rename itself durable. The file is complete either way, and some file systems cannot do this, so a
/// failure is not one of the write.
fn sync_folder(folder: &Path) {
    if let Ok(folder) = File::open(folder) {
        let _ = folder.sync_all();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let mut names: Vec<_> =
            fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    #[test]
    fn writes_and_replaces() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.txt");
        write_atomically(&path, "one").unwrap();
        write_atomically(&path, "two").unwrap();
        assert_eq!(fs::read_to_string(&path).unwrap(), "two");
        assert_eq!(names(folder.path()), ["a.txt"]);
    }

    #[test]
    fn a_failure_leaves_nothing_and_keeps_the_old() {
        let folder = tempfile::tempdir().unwrap();
        let missing = folder.path().join("missing").join("a.txt");
        assert!(matches!(write_atomically(&missing, "x"), Err(Error::File { action: "write", .. })));
        // A folder in the way.
        let taken = folder.path().join("taken");
        fs::create_dir(&taken).unwrap();
        assert!(matches!(write_atomically(&taken, "x"), Err(Error::File { .. })));
        // A read-only file.
        let kept = folder.path().join("kept");
        fs::write(&kept, "old").unwrap();
        let mut mode = fs::metadata(&kept).unwrap().permissions();
        mode.set_readonly(true);
        fs::set_permissions(&kept, mode).unwrap();
        assert!(matches!(write_atomically(&kept, "new"), Err(Error::File { .. })));
        assert_eq!(fs::read_to_string(&kept).unwrap(), "old");
        assert_eq!(names(folder.path()), ["kept", "taken"]);
    }

    #[cfg(unix)]
    #[test]
    fn modes_are_ordinary_and_links_are_followed() {
        use std::os::unix::fs::PermissionsExt;
        let mode = |path: &Path| fs::metadata(path).unwrap().permissions().mode() & 0o777;
        let folder = tempfile::tempdir().unwrap();
        let (plain, ours) = (folder.path().join("plain"), folder.path().join("ours"));
        fs::write(&plain, "x").unwrap();
        write_atomically(&ours, "x").unwrap();
        assert_eq!(mode(&ours), mode(&plain));
        fs::set_permissions(&ours, fs::Permissions::from_mode(0o640)).unwrap();
        let link = folder.path().join("link");
        std::os::unix::fs::symlink(&ours, &link).unwrap();
        write_atomically(&link, "y").unwrap();
        assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
        assert_eq!((fs::read_to_string(&ours).unwrap().as_str(), mode(&ours)), ("y", 0o640));
    }

    #[cfg(unix)]
    #[test]
    fn a_device_is_written_directly() {
        write_atomically("/dev/null", "gone").unwrap();
        assert!(!fs::metadata("/dev/null").unwrap().is_file());
    }
}
