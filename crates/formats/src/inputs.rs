//! What results depend on, known by what is in it: files by their bytes as they were read, statements by their text.

use std::cell::RefCell;
use std::fs::File;
use std::io::Read;
use std::path::Path;

use serde::{Deserialize, Serialize};
use twox_hash::XxHash3_128;

use crate::words::enumeration;
use anisobond::{Error, Result};

/// Largest file that is read (bytes): of the larger ones none is a statement, a table or a surface.
const MOST_BYTES: u64 = 2 << 30;

/// Inputs of a computation, by name, each with a checksum of its content. What is the same has the same contents in the same
/// order, whatever its files are called.
///
/// ```
/// use anisobond_formats::Inputs;
/// let inputs = |horizon: &str| Inputs::default().and("material", b"KIO3").and("horizon", horizon.as_bytes());
/// assert_eq!(inputs("3").changed_since(&inputs("3")), None);
/// assert_eq!(inputs("4").changed_since(&inputs("3")).unwrap(), "horizon has changed");
/// ```
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Inputs(Vec<(String, String)>);

impl Inputs {
    /// What every result depends on: the program's version.
    pub fn of_program() -> Self {
        Inputs::default().and("the program's version", env!("CARGO_PKG_VERSION").as_bytes())
    }

    /// With one more.
    #[must_use]
    pub fn and(mut self, name: impl Into<String>, content: &[u8]) -> Self {
        self.add(name.into(), content);
        self
    }

    fn add(&mut self, name: String, content: &[u8]) {
        let input = (name, checksum([content]));
        // A file that is read twice is one input, unless it has changed between.
        if !self.0.contains(&input) {
            self.0.push(input);
        }
    }

    /// With those of another.
    #[must_use]
    pub fn with(mut self, others: &Inputs) -> Self {
        for input in &others.0 {
            if !self.0.contains(input) {
                self.0.push(input.clone());
            }
        }
        self
    }

    /// What is not as it was before, in words; `None` if all contents are the same.
    pub fn changed_since(&self, before: &Inputs) -> Option<String> {
        if self.0.iter().map(|i| &i.1).eq(before.0.iter().map(|i| &i.1)) {
            return None;
        }
        let known = |all: &Inputs, name: &str| all.0.iter().any(|i| i.0 == name);
        let names = |some: &dyn Fn(&(String, String)) -> bool, of: &Inputs| -> Vec<String> {
            let mut names: Vec<String> = of.0.iter().filter(|i| some(i)).map(|i| i.0.clone()).collect();
            names.dedup();
            names
        };
        let changed = names(&|i| known(before, &i.0) && !before.0.contains(i), self);
        let new = names(&|i| !known(before, &i.0), self);
        let gone = names(&|i| !known(self, &i.0), before);
        let words = |names: Vec<String>, one: &str, many: &str| match names.len() {
            0 => None,
            1 => Some(format!("{} {one}", names[0])),
            _ => Some(format!("{} {many}", enumeration(&names))),
        };
        let parts = [
            words(changed, "has changed", "have changed"),
            words(new, "is new", "are new"),
            words(gone, "is no longer there", "are no longer there"),
        ];
        let said: Vec<String> = parts.into_iter().flatten().collect();
        Some(if said.is_empty() { "the order of the inputs has changed".into() } else { said.join("; ") })
    }

    /// One checksum of all contents.
    pub fn digest(&self) -> String {
        checksum(self.0.iter().map(|i| i.1.as_bytes()))
    }

    /// As the text of a record.
    pub fn text(&self) -> String {
        serde_json::json!(self.0).to_string()
    }

    /// From the text of a record; none where that is no such text.
    pub fn of_text(text: &str) -> Self {
        serde_json::from_str(text).unwrap_or_default()
    }
}

/// A checksum (xxh3, 128 bits, hexadecimal) of pieces, each with its length, so that pieces cannot run into each other.
pub fn checksum<'a>(pieces: impl IntoIterator<Item = &'a [u8]>) -> String {
    let mut hash = XxHash3_128::new();
    for piece in pieces {
        hash.write(&(piece.len() as u64).to_le_bytes());
        hash.write(piece);
    }
    format!("{:032x}", hash.finish_128())
}

thread_local! {
    /// The files read by this thread while somebody wants to know.
    static READ: RefCell<Option<Inputs>> = const { RefCell::new(None) };
}

/// Does work, and says which files it read on this thread.
pub fn recorded<T>(work: impl FnOnce() -> T) -> (T, Inputs) {
    let outer = READ.replace(Some(Inputs::default()));
    let done = work();
    let read = READ.replace(None).unwrap_or_default();
    READ.set(outer.map(|outer| outer.with(&read)));
    (done, read)
}

/// A file's bytes. Everything that a user's files say is read here.
///
/// # Errors
/// A file that cannot be read, or of more than 2 GiB.
pub fn read_bytes(path: &Path) -> Result<Vec<u8>> {
    let failed = |e| Error::file("read", path, e);
    let file = File::open(path).map_err(failed)?;
    let size = file.metadata().map_err(failed)?.len();
    let mut bytes = Vec::new();
    // A device has no size, and may have no end.
    if size <= MOST_BYTES {
        file.take(MOST_BYTES + 1).read_to_end(&mut bytes).map_err(failed)?;
    }
    if size > MOST_BYTES || bytes.len() as u64 > MOST_BYTES {
        let problem = format!("the file is larger than {} GB", MOST_BYTES >> 30);
        return Err(Error::input(problem, "give a smaller one; is it the right file?").at(path.display()));
    }
    READ.with_borrow_mut(|read| {
        if let Some(read) = read {
            read.add(path.display().to_string(), &bytes);
        }
    });
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pieces_do_not_run_into_each_other() {
        let of = |pieces: &[&str]| checksum(pieces.iter().map(|p| p.as_bytes()));
        assert_ne!(of(&["a", "bc"]), of(&["ab", "c"]));
        assert_ne!(of(&["a", ""]), of(&["a"]));
        assert_eq!(of(&["a", "bc"]), of(&["a", "bc"]));
    }

    #[test]
    fn what_changed_is_named() {
        let before = Inputs::default().and("a", b"1").and("b", b"2");
        let now = |a: &str, b: &str| Inputs::default().and(a, b"1").and(b, b"2");
        assert_eq!(now("x", "y").changed_since(&before), None, "only names differ");
        let changed = Inputs::default().and("a", b"1").and("b", b"3").and("c", b"4");
        assert_eq!(changed.changed_since(&before).unwrap(), "b has changed; c is new");
        assert_eq!(before.changed_since(&changed).unwrap(), "b has changed; c is no longer there");
        assert!(Inputs::default().and("b", b"2").and("a", b"1").changed_since(&before).unwrap().contains("order"));
    }

    #[test]
    fn files_are_recorded_as_they_are_read() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        for (name, text) in [("a", "1"), ("b", "2")] {
            std::fs::write(path(name), text).unwrap();
        }
        let ((), outer) = recorded(|| {
            read_bytes(&path("a")).unwrap();
            let ((), inner) = recorded(|| drop(read_bytes(&path("b")).unwrap()));
            assert_eq!(inner.0.len(), 1);
        });
        assert_eq!(outer.0.len(), 2, "what was read inside was read outside, too");
        read_bytes(&path("a")).unwrap();
        let ((), nothing) = recorded(|| ());
        assert_eq!(nothing, Inputs::default());
    }

    #[cfg(unix)]
    #[test]
    fn a_large_file_is_refused_before_it_is_read() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("large.toml");
        File::create(&path).unwrap().set_len(3 << 30).unwrap();
        assert!(read_bytes(&path).unwrap_err().to_string().contains("larger than 2 GB"));
    }
}
