//! Memory that is asked for ahead of its use.

/// Bytes of a line of the cache.
const LINE: usize = 64;

/// Stretches of memory that will soon be needed, to be brought into the second cache line by line between other work. The
/// processor foresees no such stretches by itself: rows are visited in an order of their own.
#[derive(Default)]
pub struct Ahead {
    /// Next address, end, and lines at a time.
    stretches: Vec<(usize, usize, usize)>,
}

impl Ahead {
    /// Forget what is left.
    pub fn clear(&mut self) {
        self.stretches.clear();
    }

    /// Add the memory of a slice, to be brought in so many times.
    pub fn add<T>(&mut self, slice: &[T], times: usize) {
        let begin = slice.as_ptr() as usize;
        let end = begin + size_of_val(slice);
        self.stretches.push((begin, end, (end - begin).div_ceil(LINE * times.max(1))));
    }

    /// Ask for the next lines of every stretch.
    #[inline]
    pub fn advance(&mut self) {
        for (next, end, lines) in &mut self.stretches {
            let stop = (*next + *lines * LINE).min(*end);
            while *next < stop {
                prefetch(*next);
                *next += LINE;
            }
        }
    }
}

#[cfg(target_arch = "x86_64")]
#[inline(always)]
fn prefetch(address: usize) {
    use std::arch::x86_64::{_MM_HINT_T1, _mm_prefetch};
    // SAFETY: a hint, which reads nothing and is valid for any address.
    unsafe { _mm_prefetch::<_MM_HINT_T1>(address as *const i8) }
}

#[cfg(not(target_arch = "x86_64"))]
fn prefetch(_: usize) {}
