//! What several tests are given to read.
#![allow(dead_code)]

pub mod case;
pub mod reading;
