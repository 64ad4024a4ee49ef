//! VTK XML files whose arrays are appended in binary, compressed with zlib.

use std::fmt::Write as _;
use std::io::Write as _;

use flate2::Compression;
use flate2::write::ZlibEncoder;
use rayon::prelude::*;

use anisobond::experiment::FieldName;
use anisobond::{Error, Result};

/// Bytes before compression of a block; readers unpack block by block.
const BLOCK: usize = 1 << 16;

/// The values of one field at the points of a file.
#[derive(Clone, Debug, PartialEq)]
pub struct FieldArray {
    /// Name shown by viewers, with its unit.
    pub name: String,
    /// Names of its components, in the order of the values of a point; none of a scalar. Viewers show them in capitals.
    pub components: &'static [&'static str],
    /// Values, point by point.
    pub values: Vec<f32>,
}

impl FieldArray {
    /// Values of a field of the register.
    pub fn of(field: FieldName, values: Vec<f32>) -> Self {
        FieldArray { name: field.labelled(), components: field.about().components, values }
    }
}

/// Numbers that arrays are made of.
pub(super) trait Number: Copy + Send + Sync {
    /// VTK's name of them.
    const KIND: &'static str;
    /// Put its bytes, the lowest first, at the end of a list.
    fn append(self, bytes: &mut Vec<u8>);
}

macro_rules! number {
    ($($number:ty, $kind:literal;)*) => {$(
        impl Number for $number {
            const KIND: &'static str = $kind;
            fn append(self, bytes: &mut Vec<u8>) {
                bytes.extend_from_slice(&self.to_le_bytes());
            }
        }
    )*};
}

number! { f32, "Float32"; i64, "Int64"; u8, "UInt8"; }

/// A file in the making.
pub(super) struct Appended {
    kind: &'static str,
    header: String,
    data: Vec<u8>,
}

impl Appended {
    /// A file of one data set, ImageData or PolyData.
    pub fn new(kind: &'static str) -> Self {
        let header = format!(
            "<?xml version=\"1.0\"?>\n<VTKFile type=\"{kind}\" version=\"1.0\" byte_order=\"LittleEndian\" \
             header_type=\"UInt64\" compressor=\"vtkZLibDataCompressor\">\n"
        );
        Appended { kind, header, data: Vec::new() }
    }

    /// Lines of XML.
    pub fn lines(&mut self, text: &str) {
        self.header.push_str(text);
        self.header.push('\n');
    }

    /// An array of one number per tuple, or of named components.
    pub fn array<T: Number>(&mut self, name: &str, components: &[&str], values: &[T]) {
        let named = components.iter().enumerate();
        let named: String =
            named.map(|(i, c)| format!(" ComponentName{i}=\"{}\"", escaped(&c.to_uppercase()))).collect();
        let _ = writeln!(
            self.header,
            "<DataArray type=\"{}\" Name=\"{}\" NumberOfComponents=\"{}\"{named} format=\"appended\" offset=\"{}\"/>",
            T::KIND,
            escaped(name),
            components.len().max(1),
            self.data.len()
        );
        append(&mut self.data, values);
    }

    /// Arrays of point data.
    ///
    /// # Errors
    /// An array whose length is not that of the points.
    pub fn fields(&mut self, points: usize, arrays: &[FieldArray]) -> Result<()> {
        for FieldArray { name, components, values } in arrays {
            let each = components.len().max(1);
            if values.len() != each * points {
                return Err(Error::input(
                    format!("{} values of {name} for {points} nodes", values.len()),
                    format!("give {each} per node"),
                ));
            }
            self.array(name, components, values);
        }
        Ok(())
    }

    /// The bytes of the file.
    pub fn finish(self) -> Vec<u8> {
        let Appended { kind, header, mut data } = self;
        let mut file = format!("{header}</{kind}>\n<AppendedData encoding=\"raw\">\n_").into_bytes();
        file.append(&mut data);
        file.extend_from_slice(b"\n</AppendedData>\n</VTKFile>\n");
        file
    }
}

/// One array: number of blocks, block size, size of the last partial block, compressed sizes; then the blocks.
fn append<T: Number>(data: &mut Vec<u8>, values: &[T]) {
    let per_block = BLOCK / size_of::<T>();
    let blocks: Vec<Vec<u8>> = values.par_chunks(per_block).map(compressed).collect();
    let last = (values.len() % per_block) * size_of::<T>();
    let numbers = [blocks.len(), BLOCK, last].into_iter().chain(blocks.iter().map(Vec::len));
    numbers.for_each(|n| data.extend_from_slice(&(n as u64).to_le_bytes()));
    blocks.iter().for_each(|block| data.extend_from_slice(block));
}

/// A block packed by zlib, fast.
fn compressed<T: Number>(values: &[T]) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(size_of_val(values));
    values.iter().for_each(|v| v.append(&mut bytes));
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::fast());
    // Writing into memory does not fail.
    let _ = encoder.write_all(&bytes);
    encoder.finish().unwrap_or_default()
}

/// Text inside an XML attribute.
fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('"', "&quot;")
}

#[cfg(test)]
pub(super) mod tests {
    use std::io::Read;

    /// The bytes of an array, unpacked as a viewer does, from the file's bytes alone.
    pub fn bytes(file: &[u8], name: &str) -> Vec<u8> {
        let start = file.windows(2).position(|w| w == b"\n_").unwrap() + 2;
        let header = std::str::from_utf8(&file[..start - 1]).unwrap().to_string() + "</AppendedData></VTKFile>";
        let xml = roxmltree::Document::parse(&header).unwrap();
        let array = xml.descendants().find(|n| n.attribute("Name") == Some(name)).unwrap();
        let mut at = start + array.attribute("offset").unwrap().parse::<usize>().unwrap();
        let mut number = || {
            at += 8;
            u64::from_le_bytes(file[at - 8..at].try_into().unwrap()) as usize
        };
        let (blocks, block, last) = (number(), number(), number());
        let sizes: Vec<usize> = (0..blocks).map(|_| number()).collect();
        let mut bytes = Vec::new();
        for (i, size) in sizes.iter().enumerate() {
            let mut out = Vec::new();
            flate2::read::ZlibDecoder::new(&file[at..at + size]).read_to_end(&mut out).unwrap();
            assert_eq!(out.len(), if i + 1 == blocks && last > 0 { last } else { block });
            at += size;
            bytes.append(&mut out);
        }
        bytes
    }

    /// An array of numbers in single precision.
    pub fn unpack(file: &[u8], name: &str) -> Vec<f32> {
        bytes(file, name).as_chunks::<4>().0.iter().map(|b| f32::from_le_bytes(*b)).collect()
    }

    /// An array of whole numbers.
    pub fn unpack_whole(file: &[u8], name: &str) -> Vec<i64> {
        bytes(file, name).as_chunks::<8>().0.iter().map(|b| i64::from_le_bytes(*b)).collect()
    }
}
