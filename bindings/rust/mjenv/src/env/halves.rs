//! Resets and steps whose outputs the program computes.

use std::os::raw::c_void;
use std::ptr;

use mjenv_sys as sys;

use super::Env;
use crate::describe::{int64, size_of};
use crate::error::{call, check_length, Result};
use crate::{Batch, Real, Role, Rows};

/// What the program has computed for all rows, one row after the other ([`Env::finish`]). Empty slices are zeros.
#[derive(Clone, Copy, Debug, Default)]
pub struct Computed<'a, T> {
    /// The task's own observations, without time and history.
    pub obs: &'a [T],
    /// The rewards.
    pub reward: &'a [f64],
    /// Which rows have terminated.
    pub terminated: &'a [bool],
    /// The infos of steps, field by field.
    pub info: &'a [f64],
    /// The infos of resets, field by field.
    pub reset_info: &'a [f64],
}

fn pointer<T>(slice: &[T]) -> *const T {
    if slice.is_empty() {
        ptr::null()
    } else {
        slice.as_ptr()
    }
}

/// Steps and resets in parts, for `"Batch-v0"` and other tasks whose observations, rewards and infos the program
/// computes from [`Batch::array`]. `docs/c.md` has the rules.
impl Env {
    /// Begins new episodes in the positions and velocities of all rows, of which those of `rows` are used; empty: in
    /// the model's initial ones. Writes the exported arrays into `out`. Then compute the observations and call
    /// [`Env::finish`]. Errors: `ErrorKind::Size`, `ErrorKind::Task` (a number is not finite, or the task computes its
    /// own outputs); those of [`Rows`] and [`Env::reset`].
    pub fn begin<'a, T: Real>(
        &mut self,
        rows: impl Into<Rows<'a>>,
        qpos: &[f64],
        qvel: &[f64],
        out: &mut Batch<T>,
    ) -> Result<()> {
        let (mask, out, nq, nv) = (self.room.mask(rows.into())?, out.raw(), int64(qpos.len()), int64(qvel.len()));
        call!(self.mjenv_begin(mask, pointer(qpos), nq, pointer(qvel), nv, &out))
    }

    /// Computes the actions that the task sees in the next step: transformed, delayed and with noise. `actions` and
    /// `seen` are of all rows. Changes nothing. Errors: those of [`Env::advance`].
    pub fn act<'a, A: Real>(&mut self, rows: impl Into<Rows<'a>>, actions: &[A], seen: &mut [A]) -> Result<()> {
        check_length("seen", seen.len(), actions.len())?;
        let (mask, count) = (self.room.mask(rows.into())?, int64(actions.len()));
        call!(self.mjenv_act(mask, actions.as_ptr().cast(), count, A::DTYPE, seen.as_mut_ptr().cast()))
    }

    /// Simulates a step, and writes the exported arrays and [`Batch::was_reset`] into `out`. `actions` are of all rows.
    /// `ctrl`: what the program makes of the actions, of all rows; empty: the actions. Rows that `was_reset` names were
    /// not stepped: call [`Env::begin`] for them. Then compute the outputs and call [`Env::finish`]. Errors: those of
    /// [`Env::step`]; `ErrorKind::Pending` (a step was not finished).
    pub fn advance<'a, A: Real, T: Real>(
        &mut self,
        rows: impl Into<Rows<'a>>,
        actions: &[A],
        ctrl: &[f64],
        out: &mut Batch<T>,
    ) -> Result<()> {
        let (mask, out) = (self.room.mask(rows.into())?, out.raw());
        let (count, ctrl_count) = (int64(actions.len()), int64(ctrl.len()));
        call!(self.mjenv_advance(mask, actions.as_ptr().cast(), count, A::DTYPE, pointer(ctrl), ctrl_count, &out))
    }

    /// Ends the step or reset of rows, and writes its outputs into `out`. `None` gives it up. With the option
    /// `autoreset_mode` `same_step`, begin and finish the rows that [`Batch::was_reset`] then names. Errors:
    /// `ErrorKind::Size`, `ErrorKind::Task` (a number is NaN).
    pub fn finish<'a, T: Real>(
        &mut self,
        rows: impl Into<Rows<'a>>,
        computed: Option<Computed<'_, T>>,
        out: &mut Batch<T>,
    ) -> Result<()> {
        let (count, infos, reset_infos) = (self.rows, self.count(Role::Info), self.count(Role::ResetInfo));
        let given = computed.map(|computed| -> Result<_> {
            let optional = |what, given: usize, needed| check_length(what, given, if given == 0 { 0 } else { needed });
            optional("reward", computed.reward.len(), count)?;
            optional("terminated", computed.terminated.len(), count)?;
            optional("info", computed.info.len(), infos * count)?;
            optional("reset_info", computed.reset_info.len(), reset_infos * count)?;
            let obs_count = computed.obs.len() / count;
            check_length("obs", computed.obs.len(), obs_count * count)?;
            Ok(sys::mjenv_batch {
                struct_size: size_of::<sys::mjenv_batch>(),
                obs_dtype: T::DTYPE,
                rows: int64(count),
                obs_count: int64(obs_count),
                info_count: int64(infos),
                reset_info_count: int64(reset_infos),
                // The library only reads these.
                obs: pointer(computed.obs) as *mut c_void,
                reward: pointer(computed.reward) as *mut f64,
                terminated: pointer(computed.terminated) as *mut u8,
                info: pointer(computed.info) as *mut f64,
                reset_info: pointer(computed.reset_info) as *mut f64,
                ..Default::default()
            })
        });
        let given = given.transpose()?;
        let (mask, out) = (self.room.mask(rows.into())?, out.raw());
        call!(self.mjenv_finish(mask, given.as_ref().map_or(ptr::null(), |given| given), &out))
    }
}
