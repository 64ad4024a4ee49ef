//! `anisobond report`, and `--report` of the commands that write a folder.

use std::ffi::OsString;
use std::path::Path;
use std::sync::{Mutex, MutexGuard, PoisonError};

use anisobond::Result;
use anisobond::io::{report_page, write_atomically};

use crate::text::in_shell;
use crate::{Ending, args};

/// What was typed last, for pages.
static COMMAND: Mutex<String> = Mutex::new(String::new());

fn command() -> MutexGuard<'static, String> {
    COMMAND.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Keeps what was typed.
pub fn typed(words: &[OsString]) {
    let rest = words.iter().skip(1).map(|word| in_shell(&word.to_string_lossy()));
    *command() = std::iter::once("anisobond".into()).chain(rest).collect::<Vec<_>>().join(" ");
}

/// The page of a folder that was just written, `report.html` in it, where it is asked for.
pub fn beside(asked: bool, folder: &Path) -> Result<()> {
    if asked { write(folder, &folder.join("report.html"), &command()) } else { Ok(()) }
}

fn write(folder: &Path, path: &Path, command: &str) -> Result<()> {
    write_atomically(path, report_page(folder, command)?)?;
    eprintln!("wrote {}", path.display());
    Ok(())
}

pub fn run(args: &args::Report) -> Result<Ending> {
    let path = args.output.clone().unwrap_or_else(|| args.folder.join("report.html"));
    write(&args.folder, &path, "").map(|()| Ending::Done)
}
