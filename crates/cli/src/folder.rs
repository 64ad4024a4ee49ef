//! A folder of results.

use std::path::Path;

use anisobond::Result;
use anisobond::io::write_files;

/// Write files whose contents are ready, each whole or not at all, and say so on stderr.
pub fn write(folder: &Path, files: &[(&str, Vec<u8>)]) -> Result<()> {
    write_files(folder, files)?;
    let names: Vec<&str> = files.iter().map(|f| f.0).collect();
    eprintln!("wrote {} in {}", names.join(", "), folder.display());
    Ok(())
}
