//! Memory aligned to a cache line, as vector loads want it.

use std::marker::PhantomData;

/// A cache line.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
struct Line([u64; 8]);

/// A vector of numbers or words of fixed length, zero at first, aligned to 64 bytes.
#[derive(Clone, Debug)]
pub struct Aligned<T> {
    lines: Vec<Line>,
    len: usize,
    of: PhantomData<T>,
}

/// Types of which every pattern of bits is a value, zero bits the number zero.
pub trait Plain: Copy + Send + Sync + 'static {}
impl Plain for f64 {}
impl Plain for u8 {}
impl Plain for u16 {}

impl<T: Plain> Aligned<T> {
    /// So many zeros.
    pub fn zeros(len: usize) -> Self {
        let lines = (len * size_of::<T>()).div_ceil(size_of::<Line>());
        // From zeroed pages: rows are then placed by the threads that first write them.
        Aligned { lines: vec![Line([0; 8]); lines], len, of: PhantomData }
    }

    /// The numbers.
    pub fn slice(&self) -> &[T] {
        // SAFETY: the lines hold at least `len` values of T, whose alignment is below a line's; all bits are values of T.
        unsafe { std::slice::from_raw_parts(self.lines.as_ptr().cast(), self.len) }
    }

    /// The numbers, to be changed.
    pub fn slice_mut(&mut self) -> &mut [T] {
        // SAFETY: as in `slice`; the borrow is exclusive.
        unsafe { std::slice::from_raw_parts_mut(self.lines.as_mut_ptr().cast(), self.len) }
    }

    /// Bytes.
    pub fn bytes(&self) -> usize {
        self.lines.len() * size_of::<Line>()
    }
}
