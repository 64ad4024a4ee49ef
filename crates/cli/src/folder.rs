//! A folder of results, and files that are replaced.

use std::path::Path;

use anisobond::Result;
use anisobond_app::write_files;

/// Write files whose contents are ready, each whole or not at all, and say so on stderr. A folder that holds other results is
/// refused, or with `force` they are replaced whole.
pub fn write(folder: &Path, files: &[(&str, Vec<u8>)], force: bool) -> Result<()> {
    write_files(folder, files, force)?;
    let names: Vec<&str> = files.iter().map(|f| f.0).collect();
    eprintln!("wrote {} in {}", names.join(", "), folder.display());
    Ok(())
}
