//! What a task may change of its row: the initial state, carried numbers and the random stream.

use std::fmt;
use std::marker::PhantomData;
use std::slice;

use mjenv_sys as sys;

use crate::describe::{int64, size};

/// A row's random stream. Each method returns what the method of `numpy.random.Generator` returns and leaves the stream
/// in the same state. Arguments that NumPy refuses make the task's method fail.
#[derive(Debug)]
pub struct Rng<'a> {
    raw: *mut sys::mjenv_random,
    row: PhantomData<&'a mut sys::mjenv_random>,
}

/// Calls one of the library's functions for the random stream.
macro_rules! call {
    ($rng:ident.$function:ident($($argument:expr),*)) => {
        // SAFETY: the stream lives as long as this value, and the library's functions are static and complete.
        unsafe { ((*(*$rng.raw).api).$function.expect("the library has this function"))($rng.raw $(, $argument)*) }
    };
}

impl Rng<'_> {
    /// # Safety
    /// `raw` is the library's, and nothing else uses it during `'a`.
    pub(super) unsafe fn new(raw: *mut sys::mjenv_random) -> Self {
        Self { raw, row: PhantomData }
    }

    /// `random()`: a number in [0, 1).
    pub fn random(&mut self) -> f64 {
        call!(self.random())
    }

    /// `uniform(low, high)`: a number in [low, high). `high - low` must be finite and not negative.
    pub fn uniform(&mut self, low: f64, high: f64) -> f64 {
        call!(self.uniform(low, high))
    }

    /// `standard_normal()`. NumPy computes `normal(mean, deviation)` as `mean + deviation * standard_normal()`.
    pub fn normal(&mut self) -> f64 {
        call!(self.normal())
    }

    /// `integers(low, high)`: an integer in [low, high). `low` must be less than `high`.
    pub fn integers(&mut self, low: i64, high: i64) -> i64 {
        call!(self.integers(low, high))
    }

    /// `choice(count)`: an integer in [0, count). `count` must be at least 1.
    pub fn choice(&mut self, count: usize) -> usize {
        size(call!(self.choice(int64(count), std::ptr::null())))
    }

    /// `choice(len(p), p=p)`: an integer in [0, len(p)). The sum of the probabilities must be 1.
    pub fn choice_weighted(&mut self, p: &[f64]) -> usize {
        size(call!(self.choice(int64(p.len()), p.as_ptr())))
    }

    /// `choice(count, size, replace=False)`: `size` different integers of [0, count). `size` must not exceed `count`.
    pub fn sample(&mut self, count: usize, size: usize) -> Vec<i64> {
        // The library refuses a size above the count before it writes.
        let mut chosen = vec![0; if size > count { 0 } else { size }];
        call!(self.sample(int64(count), int64(size), chosen.as_mut_ptr()));
        chosen
    }

    /// `permutation(count)`: the integers of [0, count) in random order.
    pub fn permutation(&mut self, count: usize) -> Vec<i64> {
        let mut order = vec![0; count];
        call!(self.permutation(int64(count), order.as_mut_ptr()));
        order
    }
}

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
    /// # Safety
    /// `numbers` points to `count` numbers.
    pub(super) unsafe fn read(self, numbers: *const f64, count: usize) -> [f64; N] {
        let fits = self.first.checked_add(N).map_or(false, |end| end <= count);
        assert!(fits, "the live parameter was declared in another environment");
        // SAFETY: the sum stays within the numbers; an array of f64 has the alignment of f64.
        unsafe { (numbers.add(self.first) as *const [f64; N]).read() }
    }
}

/// The numbers that a row carries for the task.
pub struct Carried<'a> {
    // No reference, because Sim reads the same memory.
    raw: *mut f64,
    count: usize,
    row: PhantomData<&'a mut f64>,
}

impl Carried<'_> {
    /// # Safety
    /// `raw` points to `count` numbers that live for `'a`, and no reference to them exists.
    pub(super) unsafe fn new(raw: *mut f64, count: usize) -> Self {
        Self { raw, count, row: PhantomData }
    }

    /// Reads numbers.
    ///
    /// # Panics
    /// If they were not declared in this environment.
    #[must_use]
    pub fn get<const N: usize>(&self, numbers: Carry<N>) -> [f64; N] {
        // SAFETY: `place` checks that the numbers exist; an array of f64 has the alignment of f64.
        unsafe { (self.place(numbers) as *const [f64; N]).read() }
    }

    /// Writes numbers.
    ///
    /// # Panics
    /// If they were not declared in this environment.
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

impl fmt::Debug for Carried<'_> {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.debug_struct("Carried").field("count", &self.count).finish_non_exhaustive()
    }
}

/// The initial state of an episode, which [`Task::reset`](super::Task::reset) changes.
#[derive(Debug)]
#[non_exhaustive]
pub struct Start<'a> {
    /// The model's initial positions.
    pub qpos0: &'a [f64],
    /// The positions; equal to `qpos0` at first.
    pub qpos: &'a mut [f64],
    /// The velocities; 0 at first.
    pub qvel: &'a mut [f64],
    /// The activations of actuators; 0 at first.
    pub act: &'a mut [f64],
    /// The carried numbers; 0 at first, or what the row has kept ([`Builder::keep`](super::Builder::keep)).
    pub carried: Carried<'a>,
    parameters: (*const f64, usize),
}

impl Start<'_> {
    /// The row's numbers of a live parameter.
    ///
    /// # Panics
    /// If it was not declared in this environment.
    #[must_use]
    pub fn live<const N: usize>(&self, parameter: Live<N>) -> [f64; N] {
        // SAFETY: `new` was given these numbers.
        unsafe { parameter.read(self.parameters.0, self.parameters.1) }
    }

    /// # Safety
    /// `raw` is the library's, and nothing else uses it during `'a`. It has `live` numbers of live parameters.
    pub(super) unsafe fn new(raw: *const sys::mjenv_start, live: usize) -> Self {
        // SAFETY: as the caller promises, the arrays have these lengths and do not overlap.
        unsafe {
            Self {
                qpos0: read((*raw).qpos0, (*raw).nq),
                qpos: write((*raw).qpos, (*raw).nq),
                qvel: write((*raw).qvel, (*raw).nv),
                act: write((*raw).act, (*raw).na),
                carried: Carried::new((*raw).carried, size((*raw).carry_count.into())),
                parameters: ((*raw).parameters, live),
            }
        }
    }
}

/// What [`Task::step`](super::Task::step) may change of its row.
#[derive(Debug)]
#[non_exhaustive]
pub struct Row<'a> {
    /// The row's random stream.
    pub rng: Rng<'a>,
    /// The numbers that the row carried into the step.
    pub carried: Carried<'a>,
}

impl<'a> Row<'a> {
    pub(super) fn new(rng: Rng<'a>, carried: Carried<'a>) -> Self {
        Self { rng, carried }
    }
}

/// # Safety
/// `array` points to `count` elements that do not change during `'a`.
pub(super) unsafe fn read<'a, T>(array: *const T, count: i32) -> &'a [T] {
    match size(count.into()) {
        0 => &[],
        // SAFETY: as the caller promises.
        count => unsafe { slice::from_raw_parts(array, count) },
    }
}

/// # Safety
/// `array` points to `count` elements that nothing else uses during `'a`.
unsafe fn write<'a>(array: *mut f64, count: i32) -> &'a mut [f64] {
    match size(count.into()) {
        0 => &mut [],
        // SAFETY: as the caller promises.
        count => unsafe { slice::from_raw_parts_mut(array, count) },
    }
}
