//! Numbers in memory.

use std::ops::{Deref, DerefMut};

use nalgebra::DVector;

use super::Real;

/// Bytes of a cache line, and of the longest vector: vectors that lie across two lines take twice as
/// long to load.
const LINE: usize = 64;

/// A vector whose first number lies at the start of a cache line. Where it lies changes no result.
#[derive(Debug)]
pub struct Buffer<T: Real> {
    data: DVector<T>,
    start: usize,
    len: usize,
}

impl<T: Real> Buffer<T> {
    /// `len` zeros.
    pub fn zeros(len: usize) -> Self {
        let data = DVector::from_element(len + LINE / size_of::<T>(), T::default());
        let start = data.as_slice().as_ptr().align_offset(LINE);
        // The offset may be unknown (it is to an interpreter of Rust): then nothing is aligned.
        let start = if start <= LINE / size_of::<T>() { start } else { 0 };
        Self { data, start, len }
    }

    /// These numbers.
    pub fn of(values: &[T]) -> Self {
        let mut buffer = Self::zeros(values.len());
        buffer.copy_from_slice(values);
        buffer
    }
}

impl<T: Real> Clone for Buffer<T> {
    fn clone(&self) -> Self {
        Self::of(self)
    }
}

impl<T: Real> PartialEq for Buffer<T> {
    fn eq(&self, other: &Self) -> bool {
        **self == **other
    }
}

impl<T: Real> Deref for Buffer<T> {
    type Target = [T];

    #[inline]
    fn deref(&self) -> &[T] {
        &self.data.as_slice()[self.start..][..self.len]
    }
}

impl<T: Real> DerefMut for Buffer<T> {
    #[inline]
    fn deref_mut(&mut self) -> &mut [T] {
        &mut self.data.as_mut_slice()[self.start..][..self.len]
    }
}
