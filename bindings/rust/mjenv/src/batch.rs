use std::os::raw::c_void;

use mjenv_sys as sys;

use crate::describe::{int64, size_of};
use crate::env::Env;
use crate::error::{Error, ErrorKind, Result};
use crate::{Field, Role};

mod sealed {
    pub trait Sealed: Copy + Default {
        const DTYPE: mjenv_sys::mjenv_dtype;
    }

    impl Sealed for f64 {
        const DTYPE: mjenv_sys::mjenv_dtype = mjenv_sys::MJENV_DTYPE_FLOAT64;
    }

    impl Sealed for f32 {
        const DTYPE: mjenv_sys::mjenv_dtype = mjenv_sys::MJENV_DTYPE_FLOAT32;
    }
}

/// The element types of actions and observations: `f32` and `f64`.
pub trait Real: sealed::Sealed {}

impl Real for f32 {}
impl Real for f64 {}

/// The outputs of all rows. [`Env::reset`], [`Env::step`] and [`Env::rollout`] write into it, so that these calls need
/// not allocate.
///
/// Observations are `f64`, as Gymnasium has them, or `f32`, rounded to nearest. Everything is zero until it is written.
/// A batch fits every environment that has as many rows and outputs of the same sizes.
#[derive(Clone, Debug)]
pub struct Batch<T: Real = f64> {
    rows: usize,
    obs_count: usize,
    obs: Vec<T>,
    reward: Vec<f64>,
    terminated: Vec<bool>,
    truncated: Vec<bool>,
    status: Vec<i32>,
    info: Record,
    was_reset: Vec<bool>,
    reset_info: Record,
    arrays: Record,
    groups: Record,
    last: Option<Last<T>>,
}

/// The last observations and infos of episodes that a step with the autoreset_mode "same_step" has ended and reset.
#[derive(Clone, Debug)]
struct Last<T> {
    obs: Vec<T>,
    info: Record,
}

impl<T: Real> Batch<T> {
    pub(crate) fn new(env: &Env, rows: usize) -> Self {
        let obs_count = env.observation_space().count();
        let obs = vec![T::default(); product(rows, obs_count)];
        let info = Record::new(env, Role::Info, rows);
        let same_step = env.options().value("autoreset_mode") == Ok("same_step".into());
        Self {
            rows,
            obs_count,
            reward: vec![0.0; rows],
            terminated: vec![false; rows],
            truncated: vec![false; rows],
            status: vec![sys::MJENV_OK; rows],
            was_reset: vec![false; rows],
            reset_info: Record::new(env, Role::ResetInfo, rows),
            arrays: Record::new(env, Role::Arrays, rows),
            groups: Record::new(env, Role::Groups, 0),
            last: same_step.then(|| Last { obs: obs.clone(), info: info.clone() }),
            obs,
            info,
        }
    }

    /// Returns pointers to all arrays. They are valid until the batch is used again.
    pub(crate) fn raw(&mut self) -> sys::mjenv_batch {
        let mut raw = sys::mjenv_batch {
            struct_size: size_of::<sys::mjenv_batch>(),
            obs_dtype: T::DTYPE,
            rows: int64(self.rows),
            obs_count: int64(self.obs_count),
            info_count: int64(self.info.count),
            reset_info_count: int64(self.reset_info.count),
            arrays_count: int64(self.arrays.count),
            obs: self.obs.as_mut_ptr() as *mut c_void,
            reward: self.reward.as_mut_ptr(),
            // The library writes 0 or 1 where the batch has a `bool`.
            terminated: self.terminated.as_mut_ptr() as *mut u8,
            truncated: self.truncated.as_mut_ptr() as *mut u8,
            status: self.status.as_mut_ptr(),
            info: self.info.values.as_mut_ptr(),
            was_reset: self.was_reset.as_mut_ptr() as *mut u8,
            reset_info: self.reset_info.values.as_mut_ptr(),
            arrays: self.arrays.values.as_mut_ptr(),
            ..Default::default()
        };
        if let Some(last) = &mut self.last {
            raw.final_obs = last.obs.as_mut_ptr() as *mut c_void;
            raw.final_info = last.info.values.as_mut_ptr();
        }
        raw
    }

    methods! {
        self;
        /// Returns the number of rows. In the batch of a rollout this is rows * steps, and step `t` of a row is at
        /// `row * steps + t`.
        rows() -> usize { self.rows }
        /// Returns the observation of a row: `[observation_space().count()]`. Panics if there is no such row.
        obs(row: usize) -> &[T] { &self.obs[row * self.obs_count..][..self.obs_count] }
        /// Returns the observations of all rows, one after the other: `[rows][observation_space().count()]`.
        observations() -> &[T] { &self.obs }
        /// Returns the reward of each row; 0 after a reset.
        reward() -> &[f64] { &self.reward }
        /// Returns for each row whether it has reached a terminal state; false after a reset.
        terminated() -> &[bool] { &self.terminated }
        /// Returns for each row whether it has reached its limit of steps; false after a reset.
        truncated() -> &[bool] { &self.truncated }
        /// Returns whether the episode of a row is over: terminated or truncated. Panics if there is no such row.
        ended(row: usize) -> bool { self.terminated[row] || self.truncated[row] }
        /// Returns whether the last step failed in a row: MuJoCo reported an error, and the row kept its state. Panics
        /// if there is no such row.
        failed(row: usize) -> bool { self.status[row] < sys::MJENV_OK }
        /// Returns whether the state of a row diverged in the last step, so that MuJoCo restarted the row. Panics if
        /// there is no such row.
        diverged(row: usize) -> bool { self.status[row] == sys::MJENV_DIVERGED }
        /// Returns an info of the last step: `[rows][count]`. Most infos have a `count` of 1. The value is 0 for a row
        /// that the step reset. Errors: [`ErrorKind::Name`].
        info(name: &str) -> Result<&[f64]> { self.info.get("info", name) }
        /// Returns the names and values of all infos of the last step, in Gymnasium's order.
        infos() -> impl ExactSizeIterator<Item = (&str, &[f64])> + '_ { self.info.iter() }
        /// Returns for each row whether the last call began an episode.
        was_reset() -> &[bool] { &self.was_reset }
        /// Returns an info of the last reset of each row: `[rows][count]`. Errors: [`ErrorKind::Name`].
        reset_info(name: &str) -> Result<&[f64]> { self.reset_info.get("reset info", name) }
        /// Returns the names and values of all infos of the last reset of each row, in Gymnasium's order.
        reset_infos() -> impl ExactSizeIterator<Item = (&str, &[f64])> + '_ { self.reset_info.iter() }
    }

    /// Returns a group of the observation of a row, or a term without a group ([`Role::Groups`]). Errors:
    /// [`ErrorKind::Name`] (also if the observation has no groups; see the option `observation`). Panics if there is no
    /// such row.
    pub fn group(&self, row: usize, name: &str) -> Result<&[T]> {
        let group = self.groups.named("group of the observation", name)?;
        Ok(&self.obs(row)[group.offset..][..group.count])
    }

    /// Returns the last observation of the episode that the last step ended and reset. It is `None` for rows where this
    /// did not happen, and without the option `autoreset_mode` at `"same_step"`. Panics if there is no such row.
    pub fn final_obs(&self, row: usize) -> Option<&[T]> {
        let last = self.last.as_ref()?;
        (self.was_reset[row] && self.ended(row)).then(|| &last.obs[row * self.obs_count..][..self.obs_count])
    }

    /// Returns an info of the last step of the episodes that the last step ended and reset: `[rows][count]`. It is
    /// valid for the rows that have a [`Batch::final_obs`]. Errors: [`ErrorKind::Name`] (also if the option
    /// `autoreset_mode` is not `"same_step"`).
    pub fn final_info(&self, name: &str) -> Result<&[f64]> {
        let message = "final info needs the option \"autoreset_mode\" at \"same_step\"";
        let last = self.last.as_ref().ok_or_else(|| Error::new(ErrorKind::Name, message.to_string()))?;
        last.info.get("final info", name)
    }

    /// Returns an mjData array that the option `arrays` names: `[rows][count]`. Errors: [`ErrorKind::Name`].
    pub fn array(&self, name: &str) -> Result<&[f64]> {
        self.arrays.get("exported array", name)
    }
}

/// Multiplies and panics on overflow, because an array of the wrapped size would be too small.
fn product(rows: usize, count: usize) -> usize {
    rows.checked_mul(count).expect("the batch fits into the address space")
}

/// The values of several fields. Each field holds its values of all rows.
#[derive(Clone, Debug)]
struct Record {
    rows: usize,
    count: usize,
    fields: Vec<Named>,
    values: Vec<f64>,
}

#[derive(Clone, Debug)]
struct Named {
    name: String,
    offset: usize,
    count: usize,
}

impl Record {
    fn new(env: &Env, role: Role, rows: usize) -> Self {
        let named = |field: Field| Named { name: field.name.into_owned(), offset: field.offset, count: field.count };
        let count = env.count(role);
        Self { rows, count, fields: env.fields(role).map(named).collect(), values: vec![0.0; product(rows, count)] }
    }

    fn values_of(&self, field: &Named) -> &[f64] {
        &self.values[field.offset * self.rows..][..field.count * self.rows]
    }

    fn iter(&self) -> impl ExactSizeIterator<Item = (&str, &[f64])> + '_ {
        self.fields.iter().map(|field| (field.name.as_str(), self.values_of(field)))
    }

    fn named(&self, what: &str, name: &str) -> Result<&Named> {
        self.fields.iter().find(|field| field.name == name).ok_or_else(|| {
            let names: Vec<_> = self.fields.iter().map(|field| field.name.as_str()).collect();
            let names = if names.is_empty() { "none".to_string() } else { names.join(", ") };
            Error::new(ErrorKind::Name, format!("no {what} {name:?}; there are {names}"))
        })
    }

    fn get(&self, what: &str, name: &str) -> Result<&[f64]> {
        Ok(self.values_of(self.named(what, name)?))
    }
}
