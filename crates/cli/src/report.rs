//! `anisobond report`.

use anisobond::Result;
use anisobond::io::{report_page, write_atomically};

use crate::{Ending, args};

pub fn run(args: &args::Report) -> Result<Ending> {
    let page = report_page(&args.folder)?;
    let path = args.output.clone().unwrap_or_else(|| args.folder.join("report.html"));
    write_atomically(&path, page)?;
    eprintln!("wrote {}", path.display());
    Ok(Ending::Done)
}
