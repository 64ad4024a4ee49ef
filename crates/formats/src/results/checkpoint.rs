//! Checkpoints: the whole state of a run in one file, atomic and checksummed; the one before is kept.
//!
//! The layout is safetensors: a JSON header, then the arrays, which NumPy and others read as they are.

use std::collections::HashMap;
use std::fs;
use std::path::{Path, PathBuf};

use safetensors::tensor::{Dtype, SafeTensors, TensorView};
use twox_hash::XxHash3_128;

use crate::write_atomically;
use anisobond::{Error, Result};

/// Key of the checksum in the header.
const CHECKSUM: &str = "xxh3-128";

/// Key of what the run says of itself.
const ABOUT: &str = "run";

/// What a file keeps: a text and arrays by name.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Checkpoint {
    /// What the run says of itself (JSON).
    pub about: String,
    /// Arrays of numbers.
    pub numbers: Vec<(String, Vec<f64>)>,
    /// Arrays of bits.
    pub words: Vec<(String, Vec<u64>)>,
}

/// A state as the bytes of a file.
fn encode(state: &Checkpoint) -> Result<Vec<u8>> {
    let numbers = state.numbers.iter().map(|(name, values)| (name, Dtype::F64, bytes_of(values, |v| v.to_le_bytes())));
    let words = state.words.iter().map(|(name, values)| (name, Dtype::U64, bytes_of(values, |v| v.to_le_bytes())));
    let arrays: Vec<_> = numbers.chain(words).collect();
    let checksum = checksum(&state.about, arrays.iter().map(|(name, _, bytes)| (name.as_str(), bytes.as_slice())));
    let views = arrays.iter().map(|(name, kind, bytes)| {
        TensorView::new(*kind, vec![bytes.len() / 8], bytes).map(|view| ((*name).clone(), view))
    });
    let views: std::result::Result<Vec<_>, _> = views.collect();
    let about = HashMap::from([(CHECKSUM.to_string(), checksum), (ABOUT.to_string(), state.about.clone())]);
    views.and_then(|views| safetensors::serialize(views, Some(about))).map_err(|e| unusable(&e.to_string()))
}

/// The state in a file's bytes, if they are whole.
fn decode(bytes: &[u8]) -> Result<Checkpoint> {
    let said = |e: safetensors::SafeTensorError| unusable(&e.to_string());
    let (_, header) = SafeTensors::read_metadata(bytes).map_err(said)?;
    let about = header.metadata().clone().unwrap_or_default();
    let file = SafeTensors::deserialize(bytes).map_err(said)?;
    let mut state = Checkpoint { about: about.get(ABOUT).cloned().unwrap_or_default(), ..Checkpoint::default() };
    let mut arrays = file.tensors();
    arrays.sort_by(|a, b| a.0.cmp(&b.0));
    let sum = checksum(&state.about, arrays.iter().map(|(name, view)| (name.as_str(), view.data())));
    if about.get(CHECKSUM) != Some(&sum) {
        return Err(unusable("its checksum is wrong"));
    }
    for (name, view) in arrays {
        let data = view.data().as_chunks::<8>().0;
        match view.dtype() {
            Dtype::F64 => state.numbers.push((name, data.iter().map(|b| f64::from_le_bytes(*b)).collect())),
            _ => state.words.push((name, data.iter().map(|b| u64::from_le_bytes(*b)).collect())),
        }
    }
    Ok(state)
}

/// The message of a checkpoint that cannot be used.
fn unusable(why: &str) -> Error {
    Error::input(format!("the checkpoint cannot be used: {why}"), "start the run anew in another folder")
}

/// What is wrong, and where, without the remedy.
fn reason(error: &Error) -> String {
    match error {
        Error::Failure { place, problem, .. } => format!("{place}: {problem}"),
        other => other.to_string(),
    }
}

/// Numbers as little-endian bytes.
fn bytes_of<T: Copy>(values: &[T], bytes: impl Fn(T) -> [u8; 8]) -> Vec<u8> {
    values.iter().flat_map(|v| bytes(*v)).collect()
}

/// xxh3 of 128 bits over description, names and bytes, in the order of the names.
fn checksum<'a>(about: &str, arrays: impl Iterator<Item = (&'a str, &'a [u8])>) -> String {
    let mut arrays: Vec<_> = arrays.collect();
    arrays.sort_by_key(|a| a.0);
    let mut hash = XxHash3_128::new();
    hash.write(about.as_bytes());
    for (name, bytes) in arrays {
        hash.write(name.as_bytes());
        hash.write(bytes);
    }
    format!("{:032x}", hash.finish_128())
}

/// The checkpoints of a run: the newest and the one before.
pub struct Checkpoints {
    newest: PathBuf,
    before: PathBuf,
}

impl Checkpoints {
    /// The checkpoints in a folder.
    pub fn in_folder(folder: impl AsRef<Path>) -> Self {
        let folder = folder.as_ref();
        Checkpoints {
            newest: folder.join("checkpoint.safetensors"),
            before: folder.join("checkpoint-before.safetensors"),
        }
    }

    /// Whether there is any.
    pub fn exist(&self) -> bool {
        self.newest.exists() || self.before.exists()
    }

    /// Save a state; the newest so far becomes the one before. At every moment at least one whole file is there.
    ///
    /// # Errors
    /// A file that cannot be written; the checkpoints so far are kept.
    pub fn save(&self, state: &Checkpoint) -> Result<()> {
        let bytes = encode(state)?;
        if self.newest.exists() {
            // A link, so that the newest is in place until the new one takes its name.
            let spare = self.before.with_extension("link");
            let _ = fs::remove_file(&spare);
            let linked = fs::hard_link(&self.newest, &spare).or_else(|_| fs::copy(&self.newest, &spare).map(|_| ()));
            linked
                .and_then(|()| fs::rename(&spare, &self.before))
                .map_err(|e| Error::file("write", &self.before, e))?;
        }
        write_atomically(&self.newest, bytes)
    }

    /// The newest state that is whole, and what is wrong with a newer one that is not.
    ///
    /// # Errors
    /// None that is whole.
    pub fn load(&self) -> Result<(Checkpoint, Option<String>)> {
        match read(&self.newest) {
            Ok(state) => Ok((state, None)),
            Err(error) => match read(&self.before) {
                Ok(state) => Ok((state, Some(error.to_string()))),
                Err(_) if !self.before.exists() => Err(error),
                Err(before) => Err(Error::input(
                    format!("both checkpoints are damaged: {}; {}", reason(&error), reason(&before)),
                    "start the run anew in another folder",
                )),
            },
        }
    }

    /// Remove the checkpoints of a run that has ended.
    pub fn remove(&self) {
        let _ = fs::remove_file(&self.newest);
        let _ = fs::remove_file(&self.before);
    }
}

/// A file's state, with its path in front of what is wrong.
fn read(path: &Path) -> Result<Checkpoint> {
    let bytes = fs::read(path).map_err(|e| Error::file("read", path, e))?;
    decode(&bytes).map_err(|e| e.at(path.display()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn state(step: u64) -> Checkpoint {
        Checkpoint {
            about: format!("{{\"step\":{step}}}"),
            numbers: vec![("u".into(), vec![1.0 / 3.0, f64::MIN_POSITIVE, step as f64]), ("v".into(), vec![-0.0])],
            words: vec![("bits".into(), vec![u64::MAX, 1, 0])],
        }
    }

    #[test]
    fn a_state_comes_back_to_the_bit() {
        let folder = tempfile::tempdir().unwrap();
        let files = Checkpoints::in_folder(folder.path());
        assert!(!files.exist() && files.load().is_err());
        for step in 1..4 {
            files.save(&state(step)).unwrap();
            let (loaded, trouble) = files.load().unwrap();
            assert_eq!((&loaded, trouble), (&state(step), None));
            let bits = |state: &Checkpoint| {
                state.numbers.iter().flat_map(|(_, values)| values.iter().map(|x| x.to_bits())).collect::<Vec<u64>>()
            };
            assert_eq!(bits(&loaded), bits(&state(step)));
        }
    }

    /// Every single damaged byte and every cut is seen, and the one before is used.
    #[test]
    fn a_damaged_checkpoint_is_seen() {
        let folder = tempfile::tempdir().unwrap();
        let files = Checkpoints::in_folder(folder.path());
        files.save(&state(1)).unwrap();
        files.save(&state(2)).unwrap();
        let whole = fs::read(&files.newest).unwrap();
        for at in 0..whole.len() {
            let mut bytes = whole.clone();
            bytes[at] ^= 0x20;
            // A space in the header's padding carries nothing.
            if decode(&bytes).is_ok_and(|s| s == decode(&whole).unwrap()) {
                continue;
            }
            fs::write(&files.newest, &bytes).unwrap();
            let (loaded, trouble) = files.load().unwrap();
            assert_eq!(loaded.about, state(1).about, "byte {at}");
            assert!(trouble.unwrap().contains("checkpoint.safetensors"));
        }
        for length in [0, 7, 100, whole.len() - 1] {
            fs::write(&files.newest, &whole[..length]).unwrap();
            assert!(files.load().unwrap().1.is_some());
        }
    }
}
