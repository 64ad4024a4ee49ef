//! NumPy arrays (`.npy`) in two dimensions.

use anisobond::{Error, Result};

/// A kind of number that arrays are written of.
pub trait NpyNumber: Copy {
    /// NumPy's name of it.
    const KIND: &'static str;
    /// Its bytes, lowest first, at the end of a file.
    fn append(self, file: &mut Vec<u8>);
}

macro_rules! npy_number {
    ($($number:ty, $kind:literal;)*) => {$(
        impl NpyNumber for $number {
            const KIND: &'static str = $kind;
            fn append(self, file: &mut Vec<u8>) {
                file.extend_from_slice(&self.to_le_bytes());
            }
        }
    )*};
}

npy_number! { f32, "<f4"; f64, "<f8"; u32, "<u4"; }

/// An array of shape rows × columns, row by row, as the bytes of a `.npy` file (format 1.0).
pub fn npy<T: NpyNumber>(values: &[T], shape: [usize; 2]) -> Vec<u8> {
    let [rows, columns] = shape;
    let mut header = format!("{{'descr': '{}', 'fortran_order': False, 'shape': ({rows}, {columns}), }}", T::KIND);
    // Magic, version and length take 10 bytes; the data begins at a multiple of 64.
    header.push_str(&" ".repeat((64 - (11 + header.len()) % 64) % 64));
    header.push('\n');
    let mut file = b"\x93NUMPY\x01\x00".to_vec();
    file.extend_from_slice(&(header.len() as u16).to_le_bytes());
    file.extend_from_slice(header.as_bytes());
    values.iter().for_each(|v| v.append(&mut file));
    file
}

/// Reads what [`npy`] writes of single precision.
///
/// # Errors
/// Bytes that are not such a file.
pub fn read_npy(bytes: &[u8]) -> Result<(Vec<f32>, [usize; 2])> {
    parse(bytes).ok_or_else(|| Error::input("not a NumPy file of single precision in two dimensions", "write it again"))
}

fn parse(bytes: &[u8]) -> Option<(Vec<f32>, [usize; 2])> {
    let length = bytes.strip_prefix(b"\x93NUMPY\x01\x00")?.first_chunk::<2>()?;
    let start = 10 + usize::from(u16::from_le_bytes(*length));
    let header = std::str::from_utf8(bytes.get(10..start)?).ok()?;
    let shape = header.strip_prefix("{'descr': '<f4', 'fortran_order': False, 'shape': (")?;
    let (rows, rest) = shape.split_once(", ")?;
    let shape = [rows.parse().ok()?, rest.split_once(')')?.0.parse().ok()?];
    let data = bytes.get(start..)?;
    let values = data.as_chunks::<4>().0.iter().map(|b| f32::from_le_bytes(*b)).collect::<Vec<_>>();
    (data.len() == 4 * shape[0] * shape[1]).then_some((values, shape))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_is_read() {
        for shape in [[1, 1], [3, 5], [100, 40]] {
            let values: Vec<f32> = (0..shape[0] * shape[1]).map(|i| i as f32 * 0.25 - 1.0).collect();
            let file = npy(&values, shape);
            assert_eq!((file.len() - 4 * values.len()) % 64, 0);
            assert_eq!(read_npy(&file).unwrap(), (values, shape));
            assert!(read_npy(&file[..file.len() - 1]).is_err());
        }
        assert!(read_npy(b"\x93NUMPY\x01\x00").is_err());
        assert!(read_npy(b"").is_err());
    }
}
