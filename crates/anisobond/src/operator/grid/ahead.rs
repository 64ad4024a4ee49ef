//! Memory that is asked for ahead of its use.

/// Bytes of a line of the cache.
pub const LINE: usize = 64;

/// Stretches of memory that will soon be needed, which the kernels ask for line by line between their bonds, so that it
/// comes into the second cache meanwhile. The processor does not foresee them: rows are visited in an order of their own.
#[derive(Default)]
pub struct Ahead {
    /// First address and end, the last added first.
    stretches: Vec<(usize, usize)>,
    /// Where there is nothing left to ask for: what has been asked for before, so that asking is cheap.
    last: usize,
}

impl Ahead {
    /// Add the memory of a slice.
    pub fn add<T>(&mut self, slice: &[T]) {
        let begin = slice.as_ptr() as usize;
        self.stretches.push((begin, begin + size_of_val(slice)));
    }

    /// Forget what is left.
    pub fn clear(&mut self) {
        self.stretches.clear();
    }

    /// The address from which on so many lines are to be asked for next; they may go beyond the end of a stretch.
    #[inline]
    pub fn take(&mut self, lines: usize) -> usize {
        if let Some((next, end)) = self.stretches.last_mut() {
            self.last = *next;
            *next += lines * LINE;
            if *next >= *end {
                self.stretches.pop();
            }
        }
        self.last
    }
}

/// Ask for the line that is so many lines behind an address.
#[cfg(target_arch = "x86_64")]
#[inline(always)]
pub fn ask(address: usize, lines: usize) {
    use std::arch::x86_64::{_MM_HINT_T1, _mm_prefetch};
    // SAFETY: a hint, which reads nothing and is valid for any address.
    unsafe { _mm_prefetch::<_MM_HINT_T1>(address.wrapping_add(lines * LINE) as *const i8) }
}

/// Other processors are left to themselves.
#[cfg(not(target_arch = "x86_64"))]
#[inline(always)]
pub fn ask(_: usize, _: usize) {}
