//! `anisobond report`, and `--report` of the commands that write a folder.

use std::ffi::OsString;
use std::path::Path;
use std::sync::{Mutex, MutexGuard, PoisonError};

use anisobond::Result;
use anisobond_app::{FolderLock, report_page};
use anisobond_formats::write_atomically;

use crate::text::in_shell;
use crate::{Ending, args};

/// What was typed last, for pages.
static COMMAND: Mutex<String> = Mutex::new(String::new());

fn command() -> MutexGuard<'static, String> {
    COMMAND.lock().unwrap_or_else(PoisonError::into_inner)
}

/// What was typed last.
pub fn last_typed() -> String {
    command().clone()
}

/// Keeps what was typed.
pub fn typed(words: &[OsString]) {
    let rest = words.iter().skip(1).map(|word| in_shell(&word.to_string_lossy()));
    *command() = std::iter::once("anisobond".into()).chain(rest).collect::<Vec<_>>().join(" ");
}

/// The page of a folder that was just written, `report.html` in it, where it is asked for.
pub fn beside(asked: bool, folder: &Path) -> Result<()> {
    let _lock = asked.then(|| FolderLock::alone(folder)).transpose()?;
    locked(asked, folder)
}

/// [`beside`], where the folder is locked already.
pub fn locked(asked: bool, folder: &Path) -> Result<()> {
    if asked { write(folder, &folder.join(PAGE), &command()) } else { Ok(()) }
}

/// Name of a folder's page.
const PAGE: &str = "report.html";

fn write(folder: &Path, path: &Path, command: &str) -> Result<()> {
    write_atomically(path, report_page(folder, command)?)?;
    eprintln!("wrote {}", path.display());
    Ok(())
}

pub fn run(args: &args::Report) -> Result<Ending> {
    // A page elsewhere may be of a run that goes on; and a folder that is not there is not made.
    let beside = args.output.is_none() && args.folder.is_dir();
    let _lock = beside.then(|| FolderLock::alone(&args.folder)).transpose()?;
    let path = args.output.clone().unwrap_or_else(|| args.folder.join(PAGE));
    write(&args.folder, &path, "").map(|()| Ending::Done)
}
