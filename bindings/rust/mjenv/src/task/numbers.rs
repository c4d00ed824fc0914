//! The numbers that a row keeps for its task: carried ones and live parameters.

use std::marker::PhantomData;
use std::slice;

use crate::describe::size;

/// `N` numbers that a row carries for the task from step to step, declared by [`Builder::carry`](super::Builder::carry).
/// They are 0 at the start of an episode.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Carry<const N: usize> {
    pub(super) first: usize,
}

/// The `N` numbers of a live parameter, declared by [`Builder::live`](super::Builder::live).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Live<const N: usize> {
    pub(super) first: usize,
}

impl<const N: usize> Live<N> {
    /// Safety: `numbers` points to `count` numbers.
    pub(super) unsafe fn read(self, numbers: *const f64, count: usize) -> [f64; N] {
        let fits = self.first.checked_add(N).map_or(false, |end| end <= count);
        assert!(fits, "the live parameter was declared in another environment");
        // SAFETY: the sum stays within the numbers; an array of f64 has the alignment of f64.
        unsafe { (numbers.add(self.first) as *const [f64; N]).read() }
    }
}

/// The numbers that a row carries for the task.
#[derive(Debug)]
pub struct Carried<'a> {
    // No reference, because Sim reads the same memory.
    raw: *mut f64,
    count: usize,
    row: PhantomData<&'a mut f64>,
}

impl Carried<'_> {
    /// Safety: `raw` points to `count` numbers that live for `'a`, and no reference to them exists.
    pub(super) unsafe fn new(raw: *mut f64, count: usize) -> Self {
        Self { raw, count, row: PhantomData }
    }

    /// Reads numbers. Panics if they were not declared in this environment.
    pub fn get<const N: usize>(&self, numbers: Carry<N>) -> [f64; N] {
        // SAFETY: `place` checks that the numbers exist; an array of f64 has the alignment of f64.
        unsafe { (self.place(numbers) as *const [f64; N]).read() }
    }

    /// Writes numbers. Panics if they were not declared in this environment.
    pub fn set<const N: usize>(&mut self, numbers: Carry<N>, values: [f64; N]) {
        // SAFETY: as in `get`.
        unsafe { (self.place(numbers) as *mut [f64; N]).write(values) }
    }

    fn place<const N: usize>(&self, numbers: Carry<N>) -> *mut f64 {
        let fits = numbers.first.checked_add(N).map_or(false, |end| end <= self.count);
        assert!(fits, "the carried numbers were declared in another environment");
        // SAFETY: the sum stays within the numbers.
        unsafe { self.raw.add(numbers.first) }
    }
}

/// Safety: `array` points to `count` elements that do not change during `'a`.
pub(super) unsafe fn read<'a, T>(array: *const T, count: i32) -> &'a [T] {
    match size(count.into()) {
        0 => &[],
        // SAFETY: as the caller promises.
        count => unsafe { slice::from_raw_parts(array, count) },
    }
}
