//! A folder of results.

use std::path::Path;

use anisobond::io::write_atomically;
use anisobond::{Error, Result};
use serde::Serialize;

/// Write files whose contents are ready, each whole or not at all, and say so on stderr.
pub fn write(folder: &Path, files: &[(&str, Vec<u8>)]) -> Result<()> {
    std::fs::create_dir_all(folder).map_err(|e| Error::file("create", folder, e))?;
    for (name, bytes) in files {
        write_atomically(folder.join(name), bytes)?;
    }
    let names: Vec<&str> = files.iter().map(|f| f.0).collect();
    eprintln!("wrote {} in {}", names.join(", "), folder.display());
    Ok(())
}

/// A report as the bytes of a JSON file.
pub fn json(report: &impl Serialize, folder: &Path) -> Result<Vec<u8>> {
    let text = serde_json::to_string_pretty(report).map_err(|e| Error::file("write", folder, e.into()))?;
    Ok((text + "\n").into_bytes())
}
