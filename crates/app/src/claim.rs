//! One folder, one writer, one result: the lock of a folder, and whose results it holds.
//!
//! Whose they are is told by content: a folder holds *the same* results if every file that would be written is absent or
//! has the same bytes (pictures and pages are not looked at), and no file of another command tells of another result.

use std::fs::{self, File, TryLockError};
use std::io::{ErrorKind, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use anisobond::{Error, Result, Wording};
use anisobond_formats::atomic::{TEMPORARY, write_atomically};

/// Name of the lock's file; it is there while a program writes.
const LOCK: &str = ".anisobond.lock";

/// Files that tell what a folder is of, and what that is.
const HEADS: [(&str, &str); 12] = [
    ("calibration.json", "a calibration"),
    ("calibrations.csv", "the calibrations of a table"),
    ("journal.jsonl", "the calibrations of a table"),
    ("rank.json", "a ranking"),
    ("lattice.json", "a lattice"),
    ("element-test.json", "an element test"),
    ("results.sqlite", "a sweep"),
    ("summary.json", "a run"),
    ("checkpoint.safetensors", "a run"),
    ("checkpoint-before.safetensors", "a run"),
    ("probes.csv", "a run"),
    ("expected.csv", "an export"),
];

/// What stands beside them.
const COMPANIONS: [&str; 60] = [
    "bonds.csv",
    "journal.inputs.json",
    "neighbourhood.vtp",
    "neighbourhood.svg",
    "neighbourhood.png",
    "neighbourhood-tangential.svg",
    "neighbourhood-tangential.png",
    "material.toml",
    "case.toml",
    "report.html",
    "rank.html",
    "rank.csv",
    "packing.csv",
    "lattice.vtp",
    "spheres.svg",
    "spheres.png",
    "bonds.svg",
    "bonds.png",
    "directional.svg",
    "directional.png",
    "directional.csv",
    "results.sqlite.lock",
    "results.sqlite-journal",
    "results.csv",
    "stiffness.svg",
    "stiffness.png",
    "stiffness.csv",
    "case.json",
    "crack.csv",
    "crack-nodes.csv",
    "stress-strain.png",
    "frames.pvd",
    "checkpoint-before.link",
    "measured.csv",
    "bonds.data",
    "bonds.coeffs",
    "in.element_test",
    "element_test.inp",
    "element_test.dat",
    "element_test.py",
    "cell.txt",
    "spheres.txt",
    "bonds.txt",
    "mesh.txt",
    "nodes.txt",
    "measure.py",
    "stiffness.mtx",
    "forces.mtx",
    "uniform.mtx",
    "volume.txt",
    "cell.npy",
    "nodes.npy",
    "bonds.npy",
    "branches.npy",
    "stiffness.npy",
    "radii.npy",
    "nodal_stiffness.npy",
    "nodal_volumes.npy",
    "nodal_weights.npy",
    "logs",
];

/// What a folder is of, if it holds results: the file that tells, and what they are.
fn told_by(name: &str) -> Option<&'static str> {
    let of_shard = name.starts_with("results.") && name.ends_with(".sqlite");
    HEADS.iter().find(|(head, _)| *head == name).map(|(_, what)| *what).or(of_shard.then_some("a sweep"))
}

/// Whether a file is of results that the program writes.
fn is_result(name: &str) -> bool {
    let numbered = ["frame-", "slice-", "strain_"].iter().filter_map(|start| name.strip_prefix(start));
    let numbered = numbered.into_iter().any(|rest| rest.starts_with(|c: char| c.is_ascii_digit()));
    let of_shard = name.starts_with("results.") && name.contains("-of-");
    told_by(name).is_some() || COMPANIONS.contains(&name) || numbered || of_shard
}

/// The lock of a folder: one program at a time writes there. It is the operating system's, and ends with its process however
/// that ends. Where a file system knows no locks there is none.
#[derive(Debug)]
pub struct FolderLock {
    folder: PathBuf,
    file: File,
    alone: bool,
    /// Folders that were made for it, the outermost first.
    made: Vec<PathBuf>,
}

impl FolderLock {
    /// Locks a folder, which is made if need be and goes away again if nothing is written to it. What killed programs left
    /// half written is removed.
    ///
    /// # Errors
    /// A folder in which another program writes, with its process and command; one that cannot be made or written.
    pub fn alone(folder: impl AsRef<Path>) -> Result<Self> {
        Self::taken(folder.as_ref(), true)
    }

    /// Locks a folder for a program whose files have locks of their own, as the shards of a sweep.
    ///
    /// # Errors
    /// As [`FolderLock::alone`].
    pub fn shared(folder: impl AsRef<Path>) -> Result<Self> {
        Self::taken(folder.as_ref(), false)
    }

    fn taken(folder: &Path, alone: bool) -> Result<Self> {
        // The current folder has an empty name.
        let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
        let path = folder.join(LOCK);
        let made: Vec<PathBuf> = folder.ancestors().take_while(|f| !f.exists()).map(Path::to_path_buf).collect();
        // Who unlocks removes the file, maybe between these steps: then once more.
        for _ in 0..100 {
            fs::create_dir_all(folder).map_err(|e| Error::file("create", folder, e))?;
            let mut file = match File::options().create(true).truncate(false).read(true).write(true).open(&path) {
                Err(e) if e.kind() == ErrorKind::NotFound => continue,
                opened => opened.map_err(|e| Error::file("write", &path, e))?,
            };
            match if alone { file.try_lock() } else { file.try_lock_shared() } {
                Ok(()) | Err(TryLockError::Error(_)) => {}
                Err(TryLockError::WouldBlock) => return Err(in_use(folder, &mut file)),
            }
            if is_at(&file, &path) {
                let _ = say_who(&mut file);
                remove_leftovers(folder);
                let made = made.into_iter().rev().collect();
                return Ok(FolderLock { folder: folder.to_path_buf(), file, alone, made });
            }
        }
        Err(Error::input(format!("{} is locked and unlocked without end", folder.display()), "try again"))
    }
}

impl Drop for FolderLock {
    /// Unlocks, and does not only close: a process that is just being started has a copy of every open file.
    fn drop(&mut self) {
        // Others that share the lock go by the file.
        if self.alone && cfg!(unix) {
            let _ = fs::remove_file(self.folder.join(LOCK));
        }
        let _ = self.file.unlock();
        // Only what is empty goes.
        for folder in self.made.iter().rev() {
            let _ = fs::remove_dir(folder);
        }
    }
}

/// Whether an open file is still the one of a name.
#[cfg(unix)]
fn is_at(file: &File, path: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;
    let id = |of: fs::Metadata| (of.dev(), of.ino());
    fs::metadata(path).is_ok_and(|there| file.metadata().is_ok_and(|own| id(own) == id(there)))
}

#[cfg(not(unix))]
fn is_at(_file: &File, _path: &Path) -> bool {
    true
}

/// Notes process and command in the lock's file.
pub(super) fn say_who(file: &mut File) -> std::io::Result<()> {
    let words: Vec<String> = std::env::args().take(12).collect();
    let who = format!("process {} ({})", std::process::id(), words.join(" "));
    file.set_len(0)?;
    file.seek(SeekFrom::Start(0))?;
    file.write_all(who.as_bytes())
}

/// Who has noted itself in a lock's file.
pub(super) fn who(file: &mut File) -> String {
    let mut who = Vec::new();
    let _ = file.take(400).read_to_end(&mut who);
    let who: String = String::from_utf8_lossy(&who).chars().map(|c| if c.is_control() { ' ' } else { c }).collect();
    if who.is_empty() { "another process".into() } else { who }
}

fn in_use(folder: &Path, file: &mut File) -> Error {
    let problem = format!("{} is being written by {}", folder.display(), who(file));
    Error::input(problem, "wait for it, stop it, or give this one a folder of its own")
}

/// Removes temporary files that nobody writes any more: their writers hold locks on them.
fn remove_leftovers(folder: &Path) {
    let Ok(entries) = fs::read_dir(folder) else { return };
    for path in entries.flatten().map(|entry| entry.path()) {
        let temporary = path.file_name().is_some_and(|name| name.to_string_lossy().starts_with(TEMPORARY));
        if temporary && File::open(&path).is_ok_and(|file| file.try_lock().is_ok()) {
            let _ = fs::remove_file(&path);
        }
    }
}

/// Names in a folder; none if it is not there.
fn names(folder: &Path) -> Result<Vec<String>> {
    match fs::read_dir(folder) {
        Err(e) if e.kind() == ErrorKind::NotFound => Ok(Vec::new()),
        Err(e) => Err(Error::file("read", folder, e)),
        Ok(entries) => {
            let mut names: Vec<String> =
                entries.flatten().map(|entry| entry.file_name().to_string_lossy().into_owned()).collect();
            names.sort();
            Ok(names)
        }
    }
}

/// What to do where a folder holds other results.
pub fn replace() -> Wording {
    Wording::from("give another folder, or ").choice("force", "").words(" to replace them whole")
}

/// Refuses a folder that holds results of another kind than those of `ours` ("a run").
///
/// # Errors
/// Such a folder, with the file that tells; one that cannot be read.
pub fn refuse_other_kind(folder: &Path, ours: &str) -> Result<()> {
    let other = |name: &String| told_by(name).is_some_and(|what| what != ours);
    match names(folder)?.iter().find(|name| other(name)) {
        Some(name) => Err(holds(folder, name, told_by(name).unwrap_or("another command"))),
        None => Ok(()),
    }
}

fn holds(folder: &Path, name: &str, what: &str) -> Error {
    Error::input(format!("{} holds results of {what} ({name})", folder.display()), replace())
}

/// Names, those first that tell what a folder is of.
fn telling_first(mut names: Vec<String>) -> Vec<String> {
    names.sort_by_key(|name| told_by(name).is_none());
    names
}

/// Pictures and pages follow from the rest, and may be drawn again in another way.
fn is_drawn(name: &Path) -> bool {
    name.extension().is_some_and(|e| ["svg", "png", "html"].iter().any(|drawn| e == *drawn))
}

/// Refuses a folder that holds other results than these files.
fn refuse_other_results(folder: &Path, files: &[(impl AsRef<Path>, Vec<u8>)]) -> Result<()> {
    for name in telling_first(names(folder)?) {
        let own = files.iter().find(|(own, _)| own.as_ref() == Path::new(&name));
        match (own, told_by(&name)) {
            (None, Some(what)) => return Err(holds(folder, &name, what)),
            (Some((path, bytes)), what) if !is_drawn(path.as_ref()) => {
                let there = fs::read(folder.join(&name)).map_err(|e| Error::file("read", folder.join(&name), e))?;
                if there != *bytes {
                    let what = what.map_or("another command".into(), |what| format!("{what}, another one"));
                    return Err(holds(folder, &name, &what));
                }
            }
            _ => {}
        }
    }
    Ok(())
}

/// Removes the results in a folder, whatever they are of; other files stay. What tells of them goes first.
///
/// # Errors
/// What cannot be removed.
pub fn remove_results(folder: &Path) -> Result<()> {
    let results = telling_first(names(folder)?.into_iter().filter(|name| is_result(name)).collect());
    for path in results.iter().map(|name| folder.join(name)) {
        let removed = if path.is_dir() { fs::remove_dir_all(&path) } else { fs::remove_file(&path) };
        removed.map_err(|e| Error::file("remove", &path, e))?;
    }
    Ok(())
}

/// Writes the files of a result into a folder, under its lock, each whole or not at all; the file that tells what they are
/// comes last. The same results are written again; others are refused, or with `force` removed first.
///
/// # Errors
/// A folder in use, or with other results; one that cannot be made, a file that cannot be written.
pub fn write_files(folder: impl AsRef<Path>, files: &[(impl AsRef<Path>, Vec<u8>)], force: bool) -> Result<()> {
    let folder = folder.as_ref();
    let _lock = FolderLock::alone(folder)?;
    if force {
        remove_results(folder)?;
    } else {
        refuse_other_results(folder, files)?;
    }
    let tells = |name: &Path| name.to_str().and_then(told_by).is_some();
    let (last, first): (Vec<_>, Vec<_>) = files.iter().partition(|(name, _)| tells(name.as_ref()));
    first.into_iter().chain(last).try_for_each(|(name, bytes)| write_atomically(folder.join(name), bytes))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn files(of: &str) -> Vec<(&'static str, Vec<u8>)> {
        vec![("calibration.json", of.into()), ("bonds.csv", format!("bonds {of}").into())]
    }

    #[test]
    fn one_writer_at_a_time() {
        let folder = tempfile::tempdir().unwrap();
        let new = folder.path().join("a/b");
        let lock = FolderLock::alone(&new).unwrap();
        let message = FolderLock::alone(&new).unwrap_err().to_string();
        assert!(message.contains(&format!("process {}", std::process::id())), "{message}");
        assert!(FolderLock::shared(&new).is_err() && write_files(&new, &files("x"), true).is_err());
        drop(lock);
        assert!(!folder.path().join("a").exists(), "nothing was written, and nothing is left");
        let (one, two) = (FolderLock::shared(&new).unwrap(), FolderLock::shared(&new).unwrap());
        assert!(FolderLock::alone(&new).is_err());
        drop((one, two));
        drop(FolderLock::alone(&new).unwrap());
    }

    /// Many that want the folder at once: never two at a time, whoever removes the lock's file.
    #[test]
    fn of_many_one_has_it() {
        use std::sync::atomic::{AtomicUsize, Ordering};
        let folder = tempfile::tempdir().unwrap();
        let (new, inside, had) = (folder.path().join("new"), AtomicUsize::new(0), AtomicUsize::new(0));
        std::thread::scope(|scope| {
            for _ in 0..8 {
                scope.spawn(|| {
                    for _ in 0..100 {
                        if let Ok(_lock) = FolderLock::alone(&new) {
                            assert_eq!(inside.fetch_add(1, Ordering::SeqCst), 0, "two at once");
                            had.fetch_add(1, Ordering::SeqCst);
                            inside.fetch_sub(1, Ordering::SeqCst);
                        }
                    }
                });
            }
        });
        assert!(had.into_inner() > 0);
    }

    #[test]
    fn leftovers_go_and_files_that_are_written_stay() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(format!("{TEMPORARY}{name}"));
        fs::write(path("dead"), "half").unwrap();
        let alive = File::create(path("alive")).unwrap();
        alive.lock().unwrap();
        drop(FolderLock::alone(folder.path()).unwrap());
        assert!(!path("dead").exists() && path("alive").exists());
    }

    #[test]
    fn other_results_are_refused_or_replaced_whole() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        write_files(folder.path(), &files("x"), false).unwrap();
        fs::write(at("mine.txt"), "kept").unwrap();
        fs::write(at("neighbourhood.png"), "another view").unwrap();
        // The same again, and after a kill that left a part.
        write_files(folder.path(), &files("x"), false).unwrap();
        fs::remove_file(at("calibration.json")).unwrap();
        let message = write_files(folder.path(), &files("y"), false).unwrap_err().to_string();
        assert!(message.contains("bonds.csv") && message.contains("force"), "{message}");
        write_files(folder.path(), &files("x"), false).unwrap();
        let message = write_files(folder.path(), &files("y"), false).unwrap_err().to_string();
        assert!(message.contains("a calibration, another one"), "{message}");
        let lattice = vec![("lattice.json", b"z".to_vec())];
        assert!(write_files(folder.path(), &lattice, false).unwrap_err().to_string().contains("(calibration.json)"));
        assert!(refuse_other_kind(folder.path(), "a run").is_err());
        assert!(refuse_other_kind(folder.path(), "a calibration").is_ok());
        write_files(folder.path(), &lattice, true).unwrap();
        assert_eq!(names(folder.path()).unwrap(), ["lattice.json", "mine.txt"]);
    }

    #[test]
    fn results_are_known_by_name() {
        for name in
            ["frame-00001.vti", "slice-1-00000.npy", "results.0-of-2.sqlite", "results.0-of-2.csv", "summary.json"]
        {
            assert!(is_result(name), "{name}");
        }
        for name in ["frames", "frame-work.csv", "notes.csv", "results.md", "slices.txt", ".anisobond.lock"] {
            assert!(!is_result(name), "{name}");
        }
    }
}
