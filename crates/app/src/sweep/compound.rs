//! Compound files (.xls): sectors, chains of them that end, and the streams in such chains.

use super::bounded::Checked;

/// Larger numbers are no sectors; the largest but one ends a chain.
const LAST: u32 = 0xFFFF_FFFA;
const END: u32 = 0xFFFF_FFFE;

/// Bytes of a small sector, of an entry of the directory, and of the shortest stream that is not in small sectors.
const SMALL: usize = 64;
const ENTRY: usize = 128;
const SHORT: usize = 4096;

/// A compound file without circles.
pub(super) struct Compound<'b> {
    bytes: &'b [u8],
    /// Bytes of a sector.
    size: usize,
    /// What follows each sector.
    follows: Vec<u32>,
    directory: Vec<u8>,
}

impl<'b> Compound<'b> {
    pub fn new(bytes: &'b [u8]) -> Checked<Self> {
        let size = match bytes.get(30..32) {
            Some([9, 0]) => 512,
            Some([12, 0]) => 4096,
            _ => return Err(torn()),
        };
        let mut file = Compound { bytes, size, follows: Vec::new(), directory: Vec::new() };
        file.follows = file.table()?;
        refuse_circles(&file.follows)?;
        file.directory = file.large(word(bytes, 48)?, usize::MAX)?;
        // A mark of an encoding at the start of a name would let its reader see another name.
        let marked =
            |e: &[u8]| [&[0xFF, 0xFE][..], &[0xFE, 0xFF], &[0xEF, 0xBB, 0xBF]].iter().any(|mark| e.starts_with(mark));
        if file.directory.chunks_exact(ENTRY).any(marked) { Err(torn()) } else { Ok(file) }
    }

    /// The table of what follows each sector. Its own sectors are named by 109 words of the header, and by others in a chain.
    fn table(&self) -> Checked<Vec<u32>> {
        let mut sectors: Vec<u32> = (0..109).map(|n| word(self.bytes, 76 + 4 * n)).collect::<Checked<_>>()?;
        let (mut next, mut steps) = (word(self.bytes, 68)?, 0);
        while next < LAST {
            let mut more = words(self.sector(next)?);
            next = more.pop().ok_or_else(torn)?;
            sectors.extend(more);
            steps += 1;
            if steps * self.size > self.bytes.len() {
                return Err(circle());
            }
        }
        let mut follows = Vec::new();
        for id in sectors.into_iter().filter(|id| *id < LAST) {
            follows.extend(words(self.sector(id)?));
            if follows.len() * self.size > 2 * self.bytes.len() + self.size * self.size {
                return Err(circle());
            }
        }
        Ok(follows)
    }

    /// Bytes of a whole sector.
    fn sector(&self, id: u32) -> Checked<&'b [u8]> {
        let start = (id as usize + 1) * self.size;
        self.bytes.get(start..start + self.size).ok_or_else(torn)
    }

    fn large(&self, first: u32, length: usize) -> Checked<Vec<u8>> {
        chained(self.bytes.get(self.size..).ok_or_else(torn)?, self.size, &self.follows, first, length)
    }

    /// The first stream of each of the names, where there is one.
    pub fn streams(&self, names: &[&str]) -> impl Iterator<Item = Checked<Vec<u8>>> {
        let entries = || self.directory.chunks_exact(ENTRY);
        names
            .iter()
            .filter_map(move |name| entries().find(|e| self::name(e).eq_ignore_ascii_case(name)))
            .map(|e| self.stream(e))
    }

    fn stream(&self, entry: &[u8]) -> Checked<Vec<u8>> {
        let (first, length) = (word(entry, 116)?, self.length(entry)?);
        if length >= SHORT {
            return self.large(first, length);
        }
        let root = self.directory.get(..ENTRY).ok_or_else(torn)?;
        let small = self.large(word(root, 116)?, self.length(root)?)?;
        let follows = words(&self.large(word(self.bytes, 60)?, word(self.bytes, 64)? as usize * self.size)?);
        refuse_circles(&follows)?;
        chained(&small, SMALL, &follows, first, length)
    }

    /// Bytes of the stream of an entry.
    fn length(&self, entry: &[u8]) -> Checked<usize> {
        let high = if self.size == 512 { 0 } else { word(entry, 124)? };
        Ok(word(entry, 120)? as usize | (high as usize) << 32)
    }
}

/// The bytes of a chain of sectors, at most so many. Only its last sector may be cut off by the end of the file.
fn chained(sectors: &[u8], size: usize, follows: &[u32], first: u32, length: usize) -> Checked<Vec<u8>> {
    let (mut bytes, mut id) = (Vec::new(), first);
    while id != END && bytes.len() < length {
        if bytes.len() % size != 0 {
            return Err(torn());
        }
        let rest = sectors.get(id as usize * size..).filter(|rest| !rest.is_empty()).ok_or_else(torn)?;
        bytes.extend(&rest[..size.min(rest.len()).min(length - bytes.len())]);
        if bytes.len() < length {
            id = *follows.get(id as usize).ok_or_else(torn)?;
        }
    }
    Ok(bytes)
}

/// The name of an entry of the directory, up to its first zero.
fn name(entry: &[u8]) -> String {
    let letters =
        entry[..64].chunks_exact(2).map(|b| u16::from_le_bytes([b[0], b[1]])).take_while(|letter| *letter != 0);
    char::decode_utf16(letters).map(|letter| letter.unwrap_or(char::REPLACEMENT_CHARACTER)).collect()
}

fn word(bytes: &[u8], at: usize) -> Checked<u32> {
    bytes.get(at..at + 4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]])).ok_or_else(torn)
}

fn words(bytes: &[u8]) -> Vec<u32> {
    bytes.chunks_exact(4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect()
}

fn torn() -> String {
    "it is no compound file, or is torn".into()
}

fn circle() -> String {
    "its sectors lead in a circle".into()
}

/// Refuses a table of what follows what in which something follows itself.
fn refuse_circles(follows: &[u32]) -> Checked {
    let mut seen = vec![0_u32; follows.len()];
    for first in 0..follows.len() {
        let mut at = first;
        while at < follows.len() && seen[at] == 0 {
            seen[at] = first as u32 + 1;
            at = follows[at] as usize;
        }
        if seen.get(at).is_some_and(|by| *by == first as u32 + 1) && follows[first] < LAST {
            return Err(circle());
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn circles_are_seen_and_chains_are_not_circles() {
        let last = 0xFFFF_FFFE;
        assert!(refuse_circles(&[1, 2, last, 2, 3]).is_ok());
        for circle in [&[0][..], &[1, 0], &[1, 2, 1], &[last, 2, 3, 4, 2]] {
            assert!(refuse_circles(circle).is_err(), "{circle:?}");
        }
    }

    #[test]
    fn chains_are_followed_to_their_end() {
        let (sectors, follows) = ([1, 2, 3, 4, 5], [2, END, 1]);
        assert_eq!(chained(&sectors, 2, &follows, 0, 9), Err(torn()));
        assert_eq!(chained(&sectors, 2, &follows, 0, 3), Ok(vec![1, 2, 5]));
        assert_eq!(chained(&sectors, 2, &follows, 1, 9), Ok(vec![3, 4]));
        assert_eq!(chained(&sectors, 2, &follows, END, 9), Ok(vec![]));
        assert_eq!(chained(&sectors, 2, &follows, 3, 9), Err(torn()));
    }
}
