//! The storage type of the kernels.

use std::fmt::Debug;
use std::ops::{Add, AddAssign, BitAnd, BitAndAssign, BitOrAssign, Mul, Neg, Not, Sub};

use super::ahead::Ahead;
use super::aligned::Plain;
use super::lanes::{Avx2, Avx512, Lanes, Portable};
use super::nodal::{self, PullRow};
use super::strip::{self, Event, Scratch, Task};

/// One bit of every lane of a vector: which nodes of a vector have a bond.
pub trait Word:
    Plain + Debug + Default + PartialEq + BitAnd<Output = Self> + BitAndAssign + BitOrAssign + Not<Output = Self> + 'static
{
    /// The word with one bit set.
    fn bit(lane: usize) -> Self;
    /// The bits.
    fn bits(self) -> u32;
}

/// The storage type of displacements in the kernels.
pub trait Real:
    Plain
    + Debug
    + Default
    + PartialEq
    + PartialOrd
    + Add<Output = Self>
    + AddAssign
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Neg<Output = Self>
    + 'static
{
    /// Bits of a vector's lanes.
    type Word: Word;
    /// Vectors of the instruction sets.
    #[doc(hidden)]
    type Avx512: Lanes<T = Self>;
    #[doc(hidden)]
    type Avx2: Lanes<T = Self>;
    #[doc(hidden)]
    type Portable: Lanes<T = Self>;
    /// Forces of a strip's bulk vectors, compiled with this library.
    #[doc(hidden)]
    fn strip(task: &Task<Self>, scratch: &mut Scratch<Self>, ahead: &mut Ahead, events: &mut Vec<Event>);
    /// Forces of one of its rows in natural order, compiled with this library.
    #[doc(hidden)]
    fn natural(task: &Task<Self>, scratch: &mut Scratch<Self>, row: usize, events: &mut Vec<Event>);
    /// P of a row's nodes, compiled with this library.
    #[doc(hidden)]
    fn pulls(task: &PullRow<Self>, to: [&mut [Self]; 3]) -> Self;
    /// Rounded from f64.
    fn of(x: f64) -> Self;
    /// As f64.
    fn f64(self) -> f64;
}

macro_rules! real {
    ($real:ty, $word:ty, $narrow:literal) => {
        impl Word for $word {
            #[inline(always)]
            fn bit(lane: usize) -> Self {
                1 << lane
            }
            #[inline(always)]
            fn bits(self) -> u32 {
                u32::from(self)
            }
        }
        impl Real for $real {
            type Word = $word;
            type Avx512 = Avx512<$real>;
            type Avx2 = Avx2<$real>;
            type Portable = Portable<$real, $narrow>;
            fn strip(task: &Task<Self>, scratch: &mut Scratch<Self>, ahead: &mut Ahead, events: &mut Vec<Event>) {
                strip::strip(task, scratch, ahead, events);
            }
            fn natural(task: &Task<Self>, scratch: &mut Scratch<Self>, row: usize, events: &mut Vec<Event>) {
                strip::natural(task, scratch, row, events);
            }
            fn pulls(task: &PullRow<Self>, to: [&mut [Self]; 3]) -> Self {
                nodal::pulls(task, to)
            }
            #[inline(always)]
            fn of(x: f64) -> Self {
                x as $real
            }
            #[inline(always)]
            fn f64(self) -> f64 {
                self as f64
            }
        }
    };
}

real!(f64, u8, 4);
