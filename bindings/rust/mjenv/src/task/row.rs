//! The parts of its row that a task may change: the initial state, carried numbers and the random stream.

use std::marker::PhantomData;
use std::slice;

use mjenv_sys as sys;

use super::numbers::{read, Carried, Live};
use super::sim::{Array, Element, Shape, Sim};
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
    /// Safety: `raw` is the library's, and nothing else uses it during `'a`.
    pub(super) unsafe fn new(raw: *mut sys::mjenv_random) -> Self {
        Self { raw, row: PhantomData }
    }

    methods! {
        mut self;
        /// `random()`: a number in [0, 1).
        random() -> f64 { call!(self.random()) }
        /// `uniform(low, high)`: a number in [low, high). `high - low` must be finite and not negative.
        uniform(low: f64, high: f64) -> f64 { call!(self.uniform(low, high)) }
        /// `standard_normal()`. NumPy computes `normal(mean, deviation)` as `mean + deviation * standard_normal()`.
        normal() -> f64 { call!(self.normal()) }
        /// `integers(low, high)`: an integer in [low, high). `low` must be less than `high`.
        integers(low: i64, high: i64) -> i64 { call!(self.integers(low, high)) }
        /// `choice(count)`: an integer in [0, count). `count` must be at least 1.
        choice(count: usize) -> usize { size(call!(self.choice(int64(count), std::ptr::null()))) }
        /// `choice(len(p), p=p)`: an integer in [0, len(p)). The sum of the probabilities must be 1.
        choice_weighted(p: &[f64]) -> usize { size(call!(self.choice(int64(p.len()), p.as_ptr()))) }
        /// `RandomState.rand()`: a number in [0, 1). Only in reset, of tasks that called
        /// [`Builder::random_state`](super::Builder::random_state), as the methods below.
        state_rand() -> f64 { call!(self.state_rand()) }
        /// `RandomState.uniform(low, high)`: a number in [low, high).
        state_uniform(low: f64, high: f64) -> f64 { call!(self.state_uniform(low, high)) }
        /// `RandomState.randn()`: a standard normal number.
        state_randn() -> f64 { call!(self.state_randn()) }
        /// `RandomState.randint(low, high)`: an integer in [low, high).
        state_randint(low: i64, high: i64) -> i64 { call!(self.state_randint(low, high)) }
        /// `RandomState.choice(count)`: an integer in [0, count). `count` must be at least 1.
        state_choice(count: usize) -> usize { size(call!(self.state_choice(int64(count), std::ptr::null()))) }
        /// `RandomState.choice(len(p), p=p)`: an integer in [0, len(p)). The sum of the probabilities must be 1.
        state_choice_weighted(p: &[f64]) -> usize { size(call!(self.state_choice(int64(p.len()), p.as_ptr()))) }
    }

    /// `choice(count, size, replace=False)`: `size` different integers of [0, count). `size` must not exceed `count`.
    pub fn sample(&mut self, count: usize, size: usize) -> Vec<i64> {
        // The library refuses a size above the count before it writes.
        let mut chosen = vec![0; if size > count { 0 } else { size }];
        call!(self.sample(int64(count), int64(size), chosen.as_mut_ptr()));
        chosen
    }

    /// `RandomState.permutation(count)`: the integers of [0, count) in random order.
    pub fn state_permutation(&mut self, count: usize) -> Vec<i64> {
        let mut order = vec![0; count];
        call!(self.state_permutation(int64(count), order.as_mut_ptr()));
        order
    }

    /// `RandomState.shuffle(values)`.
    pub fn state_shuffle<T: Clone>(&mut self, values: &mut [T]) {
        let old = values.to_vec();
        for (value, &from) in values.iter_mut().zip(&self.state_permutation(old.len())) {
            value.clone_from(&old[size(from)]);
        }
    }

    /// `permutation(count)`: the integers of [0, count) in random order.
    pub fn permutation(&mut self, count: usize) -> Vec<i64> {
        let mut order = vec![0; count];
        call!(self.permutation(int64(count), order.as_mut_ptr()));
        order
    }
}

/// One of the row's own arrays, declared by [`Builder::own`](super::Builder::own).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Own {
    pub(super) index: usize,
    pub(super) count: usize,
}

impl Own {
    /// Safety: `arrays` is null or the library's, from the environment in which this was declared, and nothing else
    /// uses the array during `'a`.
    unsafe fn array<'a>(self, arrays: *const *mut f64, count: usize, where_to: &str) -> &'a mut [f64] {
        assert!(self.index < count, "the own array was declared in another environment");
        // SAFETY: as the caller promises; there are `count` arrays.
        let array = if arrays.is_null() { std::ptr::null_mut() } else { unsafe { *arrays.add(self.index) } };
        assert!(!array.is_null(), "{where_to}");
        // SAFETY: the array has this length.
        unsafe { slice::from_raw_parts_mut(array, self.count) }
    }
}

/// The controls and forces of a step, which [`Task::before_step`](super::Task::before_step) and `before_substep` write.
#[derive(Debug)]
pub struct Control<'a> {
    // No slice of ctrl, because Sim reads the same memory.
    raw: *mut sys::mjenv_control,
    nu: usize,
    owned: usize,
    row: PhantomData<&'a mut f64>,
}

impl Control<'_> {
    /// Safety: `raw` is the library's, and nothing else uses it during `'a`. There are `nu` actuators and `owned` own
    /// arrays.
    pub(super) unsafe fn new(raw: *mut sys::mjenv_control, nu: usize, owned: usize) -> Self {
        Self { raw, nu, owned, row: PhantomData }
    }

    /// Which mj_step of the step comes next, from 0 on.
    pub fn substep(&self) -> usize {
        // SAFETY: as `new` requires.
        unsafe { size((*self.raw).substep.into()) }
    }

    /// The control of an actuator. In `before_step` it is that of the last step, or 0 after a reset. In
    /// `before_substep` it is that of `before_step` or the call before; without `before_step` it is at first the
    /// action. Panics if there is no such actuator.
    pub fn get(&self, actuator: usize) -> f64 {
        assert!(actuator < self.nu, "there is no actuator {actuator}");
        // SAFETY: ctrl has `nu` elements.
        unsafe { (*self.raw).ctrl.add(actuator).read() }
    }

    /// Sets the control of an actuator. Panics if there is no such actuator.
    pub fn set(&mut self, actuator: usize, value: f64) {
        assert!(actuator < self.nu, "there is no actuator {actuator}");
        // SAFETY: ctrl has `nu` elements.
        unsafe { (*self.raw).ctrl.add(actuator).write(value) }
    }

    /// The row's `qfrc_applied` or `xfrc_applied`, which act until they are written again or the row is reset. Panics
    /// if it is an array of the model.
    pub fn own(&mut self, own: Own) -> &mut [f64] {
        // SAFETY: as `new` requires.
        unsafe { own.array((*self.raw).own, self.owned, "only reset and step can write own arrays of mjModel") }
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
    raw: *mut sys::mjenv_start,
    shape: &'a Shape,
}

impl<'a> Start<'a> {
    /// Calls `look` with the simulation, which is up to date at the beginning and after the methods below. This and the
    /// following methods are for tasks that called [`Builder::current`](super::Builder::current). Panics if the task is
    /// not current.
    pub fn see<R>(&mut self, look: impl FnOnce(&Sim<'_>) -> R) -> R {
        // SAFETY: as `new` requires; `qpos` and so on are not used meanwhile, and borrowed anew.
        unsafe {
            assert!(!(*self.raw).sim.is_null(), "call b.current() in build to see the simulation in reset");
            let seen = look(&Sim::new((*self.raw).sim, self.shape));
            self.borrow();
            seen
        }
    }

    methods! {
        mut self;
        /// Calls mj_forward with actuation disabled, on the state that reset has written. Errors: if MuJoCo fails. The
        /// reset then fails even if it returns `Ok`.
        forward() -> super::Result { self.simulate(|api, raw| api.forward.map_or(1, |forward| unsafe { forward(raw) })) }
        /// Simulates `count` timesteps, at least 1, and then computes the stages of mj_step1. With the integrator Euler,
        /// the first timestep uses the arrays that were computed last, even if `qpos` was written since. Errors: as
        /// [`Start::forward`].
        advance(count: usize) -> super::Result {
            self.simulate(|api, raw| api.advance.map_or(1, |advance| unsafe { advance(raw, int64(count)) }))
        }
        /// Begins again: calls mj_resetData, after which the row's own arrays keep their values, and then
        /// [`Start::forward`]. Errors: as [`Start::forward`].
        restart() -> super::Result { self.simulate(|api, raw| api.restart.map_or(1, |restart| unsafe { restart(raw) })) }
    }

    /// The number of contacts that the last of these calls has found.
    pub fn contact_count(&mut self) -> usize {
        let mut count = 0;
        let counted = self.simulate(|api, raw| {
            count = api.contact_count.map_or(0, |contact_count| unsafe { contact_count(raw) });
            0
        });
        counted.map_or(0, |()| size(count))
    }

    /// Sets the time of the simulation, s. Panics if the task is not current.
    pub fn set_time(&mut self, time: f64) {
        // SAFETY: as `new` requires.
        unsafe {
            assert!(!(*self.raw).time.is_null(), "call b.current() in build to set the time in reset");
            *(*self.raw).time = time;
        }
    }

    /// The row's own array of the model. It keeps its values until they are written again. Panics if the array is
    /// `qfrc_applied` or `xfrc_applied`.
    pub fn own(&mut self, own: Own) -> &mut [f64] {
        // SAFETY: as `new` requires.
        unsafe {
            own.array((*self.raw).own, self.shape.own.len(), "reset can write own arrays of mjModel only, not forces")
        }
    }

    /// Calls the library with the start, which changes the state.
    fn simulate(&mut self, call: impl FnOnce(&sys::mjenv_task_api, *mut sys::mjenv_start) -> i32) -> super::Result {
        // SAFETY: as `new` requires; the library's functions are static.
        unsafe {
            let failed = call(&*(*self.raw).api, self.raw);
            self.borrow();
            (failed == 0).then_some(()).ok_or_else(|| "the simulation failed".into())
        }
    }

    /// Borrows the state anew, because the library has used it. Safety: as `new` requires.
    unsafe fn borrow(&mut self) {
        // SAFETY: as the caller promises.
        unsafe {
            self.qpos = write((*self.raw).qpos, (*self.raw).nq);
            self.qvel = write((*self.raw).qvel, (*self.raw).nv);
            self.act = write((*self.raw).act, (*self.raw).na);
        }
    }
}

impl<'a> Start<'a> {
    /// An array of mjModel; those of mjData are the memory of `qpos` and so on. Panics if it was not looked up in this
    /// environment.
    pub(super) fn array_of_model<T: Element>(&self, array: Array<T>) -> &[T] {
        // SAFETY: `new` was given these arrays; methods that change those of mjModel need a `&mut self`.
        unsafe { self.shape.array((*self.raw).arrays, array) }
    }

    /// The row's numbers of a live parameter. Panics if it was not declared in this environment.
    pub fn live<const N: usize>(&self, parameter: Live<N>) -> [f64; N] {
        // SAFETY: `new` was given these numbers.
        unsafe { parameter.read((*self.raw).parameters, self.shape.live) }
    }

    /// Safety: `raw` is the library's, and nothing else uses it during `'a`. It has what `shape` says.
    pub(super) unsafe fn new(raw: *mut sys::mjenv_start, shape: &'a Shape) -> Self {
        // SAFETY: as the caller promises, the arrays have these lengths and do not overlap.
        unsafe {
            Self {
                qpos0: read((*raw).qpos0, (*raw).nq),
                qpos: write((*raw).qpos, (*raw).nq),
                qvel: write((*raw).qvel, (*raw).nv),
                act: write((*raw).act, (*raw).na),
                carried: Carried::new((*raw).carried, size((*raw).carry_count.into())),
                raw,
                shape,
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
    own: (*const *mut f64, usize),
    qvel: Option<&'a mut [f64]>,
}

impl<'a> Row<'a> {
    pub(super) fn new(rng: Rng<'a>, carried: Carried<'a>) -> Self {
        Self { rng, carried, own: (std::ptr::null(), 0), qvel: None }
    }

    /// The velocities, which a step can change.
    pub(super) fn with_qvel(mut self, qvel: &'a mut [f64]) -> Self {
        self.qvel = Some(qvel);
        self
    }

    /// Safety: `own` points to `count` arrays, which nothing else uses during `'a`.
    pub(super) unsafe fn with_own(mut self, own: *const *mut f64, count: usize) -> Self {
        self.own = (own, count);
        self
    }

    /// The row's velocities. The methods `carry` and `observe` and the next step see what a step writes, such as a
    /// kick; what `MuJoCo` has computed still belongs to the old velocities. Panics in `before_step` and
    /// `before_substep`.
    pub fn qvel(&mut self) -> &mut [f64] {
        self.qvel.as_deref_mut().expect("only step can write the velocities")
    }

    /// The row's own array, in a step. What the step writes holds from the next one on. Panics in `before_step` and
    /// `before_substep`, which write forces with [`Control::own`].
    pub fn own(&mut self, own: Own) -> &mut [f64] {
        // SAFETY: as `with_own` requires.
        unsafe { own.array(self.own.0, self.own.1, "only step can write own arrays with its row") }
    }
}

/// Safety: `array` points to `count` elements that nothing else uses during `'a`.
unsafe fn write<'a>(array: *mut f64, count: i32) -> &'a mut [f64] {
    match size(count.into()) {
        0 => &mut [],
        // SAFETY: as the caller promises.
        count => unsafe { slice::from_raw_parts_mut(array, count) },
    }
}
