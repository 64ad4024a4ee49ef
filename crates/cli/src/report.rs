//! `anisobond report`, and `--report` of the commands that write a folder.

use std::path::Path;

use anisobond::Result;
use anisobond::io::{report_page, write_atomically};

use crate::{Ending, args};

/// The page of a folder that was just written, `report.html` in it, where it is asked for.
pub fn beside(asked: bool, folder: &Path) -> Result<()> {
    if asked { write(folder, &folder.join("report.html")) } else { Ok(()) }
}

fn write(folder: &Path, path: &Path) -> Result<()> {
    write_atomically(path, report_page(folder)?)?;
    eprintln!("wrote {}", path.display());
    Ok(())
}

pub fn run(args: &args::Report) -> Result<Ending> {
    let path = args.output.clone().unwrap_or_else(|| args.folder.join("report.html"));
    write(&args.folder, &path).map(|()| Ending::Done)
}
