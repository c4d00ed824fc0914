use std::borrow::Cow;
use std::ffi::CStr;
use std::fmt;
use std::os::raw::c_void;
use std::ptr::{self, NonNull};

use mjenv_sys as sys;

use crate::describe::{int64, size, size_of};
use crate::error::{check, check_length, Error, ErrorKind, Result};
use crate::text::{c_string, lossy};
use crate::{Batch, Dtype, Field, Options, Pipeline, Real, Role, Space, Spec};

/// An environment of one or many rows, each an episode of its own.
///
/// Rows and actuators are counted from 0. Actions and outputs are row-major: one row behind the other.
pub struct Env {
    raw: NonNull<sys::mjenv_env>,
    options: Options,
    rows: usize,
}

// SAFETY: the library ties an environment to no thread: the one thing it keeps by thread is the text of the last error,
// which this crate copies on the thread of the failing call. Distinct environments are independent. An Env is not Sync:
// of two threads in one environment the later would be refused, so the compiler refuses it instead.
unsafe impl Send for Env {}

impl Env {
    /// Builds an environment of `rows` >= 1 rows. The options are copied. Errors: [`ErrorKind::Value`] (rows),
    /// [`ErrorKind::Name`] (in the option `arrays`), [`ErrorKind::Model`], [`ErrorKind::Memory`].
    pub fn new(options: &Options, rows: usize) -> Result<Self> {
        let options = options.try_clone()?;
        let mut raw = ptr::null_mut();
        // SAFETY: all pointers are valid for the call.
        check(unsafe { sys::mjenv_create(options.raw(), int64(rows), &mut raw) })?;
        let raw = NonNull::new(raw).expect("libmjenv creates an environment or fails");
        Ok(Self { raw, options, rows })
    }

    pub(crate) fn raw(&self) -> *mut sys::mjenv_env {
        self.raw.as_ptr()
    }

    /// The number of rows.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// How many mj_steps make a step.
    pub fn frame_skip(&self) -> usize {
        // SAFETY: the handle is alive.
        size(unsafe { sys::mjenv_frame_skip(self.raw()) })
    }

    /// What the id promises.
    pub fn spec(&self) -> Spec {
        self.options.spec()
    }

    /// The options the environment was built with.
    pub fn options(&self) -> &Options {
        &self.options
    }

    /// Outputs for this environment with observations in `f64`, as Gymnasium's.
    pub fn batch(&self) -> Batch<f64> {
        Batch::new(self, self.rows)
    }

    /// Outputs for this environment with observations rounded to `f32`.
    pub fn batch_f32(&self) -> Batch<f32> {
        Batch::new(self, self.rows)
    }

    /// Outputs for [`Env::rollout`] over so many steps.
    ///
    /// # Panics
    /// If they do not fit the address space.
    pub fn rollout_batch(&self, steps: usize) -> Batch<f64> {
        Batch::new(self, self.rows.checked_mul(steps).expect("a batch fits the address space"))
    }

    /// Like [`Env::rollout_batch`], with observations rounded to `f32`.
    ///
    /// # Panics
    /// If they do not fit the address space.
    pub fn rollout_batch_f32(&self, steps: usize) -> Batch<f32> {
        Batch::new(self, self.rows.checked_mul(steps).expect("a batch fits the address space"))
    }

    /// Steps in two halves, with outputs in `f64`.
    pub fn pipeline(self) -> Pipeline<f64> {
        let batch = self.batch();
        Pipeline::new(self, batch)
    }

    /// Steps in two halves, with observations rounded to `f32`.
    pub fn pipeline_f32(self) -> Pipeline<f32> {
        let batch = self.batch_f32();
        Pipeline::new(self, batch)
    }

    /// The space of one row's observation.
    pub fn observation_space(&self) -> Space<'_> {
        self.space(Role::Observation)
    }

    /// The space of one row's action.
    pub fn action_space(&self) -> Space<'_> {
        self.space(Role::Action)
    }

    fn space(&self, role: Role) -> Space<'_> {
        let mut raw = sys::mjenv_space { struct_size: size_of::<sys::mjenv_space>(), ..Default::default() };
        // SAFETY: handle and struct are valid for the call.
        check(unsafe { sys::mjenv_space_of(self.raw(), role.raw(), &mut raw) }).expect("an environment has two spaces");
        let bound = |values: *const f64| match size(raw.count) {
            0 => &[],
            // SAFETY: the bounds hold `count` values that belong to the environment and never change.
            count => unsafe { std::slice::from_raw_parts(values, count) },
        };
        let dtype = if raw.dtype as sys::mjenv_dtype == sys::MJENV_FLOAT32 { Dtype::Float32 } else { Dtype::Float64 };
        Space { dtype, low: bound(raw.low), high: bound(raw.high) }
    }

    /// The fields of a role, in Gymnasium's order.
    pub fn fields(&self, role: Role) -> impl ExactSizeIterator<Item = Field<'_>> + '_ {
        // SAFETY: the handle is alive.
        let count = size(unsafe { sys::mjenv_field_count(self.raw(), role.raw()) });
        (0..count).map(move |index| self.field(role, index))
    }

    /// The elements of one row's record.
    pub(crate) fn count(&self, role: Role) -> usize {
        self.fields(role).map(|field| field.count).sum()
    }

    fn field(&self, role: Role, index: usize) -> Field<'_> {
        let mut raw = sys::mjenv_field { struct_size: size_of::<sys::mjenv_field>(), ..Default::default() };
        // SAFETY: handle and struct are valid for the call.
        check(unsafe { sys::mjenv_field_at(self.raw(), role.raw(), int64(index), &mut raw) })
            .expect("a field has a description");
        // SAFETY: the texts belong to the environment and never change.
        unsafe { Field::from_raw(&raw) }
    }

    /// Gives every row a new random stream from its own seed, NumPy's `default_rng(seed)`. A row that is never seeded
    /// takes entropy from the system. Errors: [`ErrorKind::Size`].
    pub fn seed(&mut self, seeds: &[u64]) -> Result<()> {
        check_length("seeds", seeds.len(), self.rows)?;
        // SAFETY: there is a seed for each row; a null mask stands for all rows.
        check(unsafe { sys::mjenv_seed(self.raw(), seeds.as_ptr(), ptr::null()) })
    }

    /// Like [`Env::seed`], for the rows where `mask` is true; there is a seed for each row all the same.
    /// Errors: [`ErrorKind::Size`].
    pub fn seed_where(&mut self, mask: &[bool], seeds: &[u64]) -> Result<()> {
        check_length("mask", mask.len(), self.rows)?;
        check_length("seeds", seeds.len(), self.rows)?;
        // SAFETY: there are a seed and a flag for each row.
        check(unsafe { sys::mjenv_seed(self.raw(), seeds.as_ptr(), mask.as_ptr() as *const u8) })
    }

    /// Seeds one row from an integer of any size: its 32-bit digits, the least significant first.
    /// Errors: [`ErrorKind::Value`] (row), [`ErrorKind::Size`] (no digits).
    pub fn seed_digits(&mut self, row: usize, digits: &[u32]) -> Result<()> {
        // SAFETY: the pointer is valid for as many digits as are told.
        check(unsafe { sys::mjenv_seed_digits(self.raw(), int64(row), digits.as_ptr(), digits.len()) })
    }

    /// The random stream of a row as NumPy's PCG64 has it: state low and high, increment low and high.
    /// Errors: [`ErrorKind::Value`] (row), [`ErrorKind::State`] (neither seeded nor reset).
    pub fn stream(&self, row: usize) -> Result<[u64; 4]> {
        let mut words = [0; 4];
        // SAFETY: the pointer is valid for as many words as are told.
        check(unsafe { sys::mjenv_get_stream(self.raw(), int64(row), words.as_mut_ptr(), words.len()) })?;
        Ok(words)
    }

    /// Replaces the random stream of a row. Errors: [`ErrorKind::Value`] (row, an even increment).
    pub fn set_stream(&mut self, row: usize, words: &[u64; 4]) -> Result<()> {
        // SAFETY: the pointer is valid for as many words as are told.
        check(unsafe { sys::mjenv_set_stream(self.raw(), int64(row), words.as_ptr(), words.len()) })
    }

    /// Begins a new episode in every row, going on with the row's random stream. Writes the observation and the reset
    /// info. Errors: [`ErrorKind::Size`] (a batch of another environment), [`ErrorKind::Physics`].
    pub fn reset<T: Real>(&mut self, out: &mut Batch<T>) -> Result<()> {
        let out = out.reset_raw();
        // SAFETY: the arrays of the batch have the sizes that it tells.
        check(unsafe { sys::mjenv_reset(self.raw(), ptr::null(), &out) })
    }

    /// Like [`Env::reset`], for the rows where `mask` is true; the outputs of the others stay as they are.
    /// Errors: [`ErrorKind::Size`], [`ErrorKind::Physics`].
    pub fn reset_where<T: Real>(&mut self, mask: &[bool], out: &mut Batch<T>) -> Result<()> {
        check_length("mask", mask.len(), self.rows)?;
        let out = out.reset_raw();
        // SAFETY: the arrays of the batch have the sizes that it tells; there is a flag for each row.
        check(unsafe { sys::mjenv_reset(self.raw(), mask.as_ptr() as *const u8, &out) })
    }

    /// Steps every row with its action: `[rows][action_space().count()]`. Whether it is `f32` or `f64` takes part in the
    /// arithmetic, as it does in NumPy. The option `autoreset_mode` resets finished rows, as Gymnasium's SyncVectorEnv
    /// does. When MuJoCo fails in a row, that row keeps its state, [`Batch::failed`] tells so, and the others are stepped. Errors: [`ErrorKind::Size`], [`ErrorKind::State`], [`ErrorKind::Value`] (a non-finite
    /// action), [`ErrorKind::Physics`].
    pub fn step<A: Real, T: Real>(&mut self, actions: &[A], out: &mut Batch<T>) -> Result<()> {
        let out = out.step_raw();
        let action = actions.as_ptr() as *const c_void;
        // SAFETY: the arrays of the batch have the sizes that it tells; so have the actions, of which the type is told.
        check(unsafe { sys::mjenv_step(self.raw(), action, actions.len(), A::DTYPE, &out) })
    }

    /// Plays actions `[rows][steps][action_space().count()]` from the rows' present states and leaves the rows at their
    /// ends; `out` is of [`Env::rollout_batch`]. A row that ends stays there: what follows in its flags repeats, its
    /// rewards and infos are 0. No row is reset. Errors: those of [`Env::step`].
    pub fn rollout<A: Real, T: Real>(&mut self, actions: &[A], steps: usize, out: &mut Batch<T>) -> Result<()> {
        let out = out.step_raw();
        let (env, action, count) = (self.raw(), actions.as_ptr() as *const c_void, actions.len());
        // SAFETY: the arrays of the batch have the sizes that it tells; so have the actions, of which the type is told.
        check(unsafe { sys::mjenv_rollout(env, action, int64(steps), count, A::DTYPE, &out) })
    }

    /// Writes the observations of all rows as they are, without stepping, and the exported arrays; the other outputs stay.
    /// Errors: [`ErrorKind::Size`], [`ErrorKind::Physics`].
    pub fn observe<T: Real>(&self, out: &mut Batch<T>) -> Result<()> {
        let out = out.step_raw();
        // SAFETY: the arrays of the batch have the sizes that it tells.
        check(unsafe { sys::mjenv_observe(self.raw(), &out) })
    }

    /// Seeds the stream of [`Env::sample_actions`], as Gymnasium's `action_space.seed` does.
    pub fn seed_actions(&mut self, seed: u64) -> Result<()> {
        // SAFETY: the handle is alive.
        check(unsafe { sys::mjenv_seed_actions(self.raw(), seed) })
    }

    /// Draws one action a row, as Gymnasium's `action_space.sample()` does: row by row from one stream, into
    /// `[rows][action_space().count()]`. Errors: [`ErrorKind::Size`], [`ErrorKind::State`] (an unbounded actuator).
    pub fn sample_actions(&mut self, actions: &mut [f32]) -> Result<()> {
        // SAFETY: the pointer is valid for as many numbers as are told.
        check(unsafe { sys::mjenv_sample_actions(self.raw(), actions.as_mut_ptr(), actions.len()) })
    }

    /// Reads an array of the row's mjData or of the mjModel by its MuJoCo name (`"xpos"`, `"body_mass"`, `"nq"`,
    /// `"opt.timestep"`), as Gymnasium's `env.unwrapped.data` holds it after the last step; [`Role::Data`] and
    /// [`Role::Model`] list them. Errors: [`ErrorKind::Name`], [`ErrorKind::Value`] (row), [`ErrorKind::Physics`].
    pub fn read(&self, row: usize, array: &str) -> Result<Vec<f64>> {
        let name = c_string(format_args!("array {array:?}"), array)?;
        let mut values = vec![0.0; self.read_raw(row, &name, &mut [])?];
        self.read_raw(row, &name, &mut values)?;
        Ok(values)
    }

    /// Like [`Env::read`], into the first elements of `values`; returns how many. Errors: those of [`Env::read`],
    /// [`ErrorKind::Size`] (too few elements).
    pub fn read_into(&self, row: usize, array: &str, values: &mut [f64]) -> Result<usize> {
        let name = c_string(format_args!("array {array:?}"), array)?;
        let count = self.read_raw(row, &name, values)?;
        if values.is_empty() && count > 0 {
            let message = format!("there is room for 0, but array {array:?} has {count} element(s)");
            return Err(Error::new(ErrorKind::Size, message));
        }
        Ok(count)
    }

    /// Tells the array's length alone if `values` is empty.
    fn read_raw(&self, row: usize, array: &CStr, values: &mut [f64]) -> Result<usize> {
        let mut count = 0;
        let (to, room) = (values.as_mut_ptr(), values.len());
        // SAFETY: all pointers are valid for the call, and there is as much room as is told.
        check(unsafe { sys::mjenv_read(self.raw(), int64(row), array.as_ptr(), to, room, &mut count) })?;
        Ok(count)
    }

    /// The index of a named object: `kind` is `"body"`, `"joint"`, `"geom"`, `"site"`, `"camera"`, `"actuator"`,
    /// `"tendon"`, `"sensor"` or `"light"`. Errors: [`ErrorKind::Name`].
    pub fn object_index(&self, kind: &str, name: &str) -> Result<usize> {
        let (kind, name) =
            (c_string(format_args!("type {kind:?}"), kind)?, c_string(format_args!("name {name:?}"), name)?);
        let mut index = 0;
        // SAFETY: all pointers are valid for the call.
        check(unsafe { sys::mjenv_object_index(self.raw(), kind.as_ptr(), name.as_ptr(), &mut index) })?;
        Ok(size(index))
    }

    /// The name of an object, empty if it has none. Errors: [`ErrorKind::Name`] (kind), [`ErrorKind::Value`] (index).
    pub fn object_name(&self, kind: &str, index: usize) -> Result<Cow<'_, str>> {
        let kind = c_string(format_args!("type {kind:?}"), kind)?;
        let mut name = ptr::null();
        // SAFETY: all pointers are valid for the call.
        check(unsafe { sys::mjenv_object_name(self.raw(), kind.as_ptr(), int64(index), &mut name) })?;
        // SAFETY: the name belongs to the environment and never changes.
        Ok(unsafe { lossy(name) })
    }

    /// Sets positions and velocities of a row and computes what follows from them, as Gymnasium's `set_state` does. The
    /// step count goes on; a row that was never reset, or had ended, may be stepped again. Errors: [`ErrorKind::Value`]
    /// (row, a non-finite number), [`ErrorKind::Size`], [`ErrorKind::Physics`].
    pub fn set_state(&mut self, row: usize, qpos: &[f64], qvel: &[f64]) -> Result<()> {
        let env = self.raw();
        // SAFETY: the pointers are valid for as many numbers as are told.
        check(unsafe { sys::mjenv_set_state(env, int64(row), qpos.as_ptr(), qpos.len(), qvel.as_ptr(), qvel.len()) })
    }

    /// `frames` times mj_step of a row under `ctrl`, one number for each actuator, as Gymnasium's `do_simulation` does:
    /// no step is counted and the task sees only the new state. Errors: [`ErrorKind::Value`] (row, no frames),
    /// [`ErrorKind::Size`], [`ErrorKind::Physics`].
    pub fn simulate(&mut self, row: usize, ctrl: &[f64], frames: usize) -> Result<()> {
        let (env, frames) = (self.raw(), int64(frames));
        // SAFETY: the pointer is valid for as many numbers as are told.
        check(unsafe { sys::mjenv_simulate(env, int64(row), ctrl.as_ptr(), ctrl.len(), frames) })
    }

    /// Makes the rows where `to` is true equal to the row `from`: simulation, random stream, counters.
    /// Errors: [`ErrorKind::Value`] (row), [`ErrorKind::Size`].
    pub fn copy_row(&mut self, from: usize, to: &[bool]) -> Result<()> {
        check_length("mask", to.len(), self.rows)?;
        // SAFETY: there is a flag for each row.
        check(unsafe { sys::mjenv_copy_row(self.raw(), int64(from), to.as_ptr() as *const u8) })
    }

    /// Copies a row into an image: simulation, random stream, counters. Errors: [`ErrorKind::Value`] (row).
    pub fn snapshot(&self, row: usize) -> Result<Vec<u8>> {
        self.image(int64(row))
    }

    /// Copies all rows into one image.
    pub fn snapshot_all(&self) -> Result<Vec<u8>> {
        self.image(sys::MJENV_ALL_ROWS.into())
    }

    fn image(&self, row: i64) -> Result<Vec<u8>> {
        let mut size = 0;
        // SAFETY: all pointers are valid for the call; nothing but the size is asked for.
        check(unsafe { sys::mjenv_snapshot(self.raw(), row, ptr::null_mut(), 0, &mut size) })?;
        let mut image = vec![0u8; size];
        let (to, room) = (image.as_mut_ptr() as *mut c_void, image.len());
        // SAFETY: all pointers are valid for the call, and there is as much room as is told.
        check(unsafe { sys::mjenv_snapshot(self.raw(), row, to, room, &mut size) })?;
        Ok(image)
    }

    /// Continues a row from an image of a row, bit for bit, also in another process. The environment must have the id,
    /// the model and the options (`num_threads`, `cpu_affinity`, `arrays` aside) of the one that the image was taken from.
    /// Errors: [`ErrorKind::Value`] (row), [`ErrorKind::Snapshot`].
    pub fn restore(&mut self, row: usize, image: &[u8]) -> Result<()> {
        self.set_image(int64(row), image)
    }

    /// Continues all rows from an image of as many, as [`Env::restore`] does. Errors: [`ErrorKind::Snapshot`].
    pub fn restore_all(&mut self, image: &[u8]) -> Result<()> {
        self.set_image(sys::MJENV_ALL_ROWS.into(), image)
    }

    fn set_image(&mut self, row: i64, image: &[u8]) -> Result<()> {
        let (from, size) = (image.as_ptr() as *const c_void, image.len());
        // SAFETY: the pointer is valid for as many bytes as are told.
        check(unsafe { sys::mjenv_restore(self.raw(), row, from, size) })
    }
}

impl Drop for Env {
    fn drop(&mut self) {
        // SAFETY: the handle is alive and owned; nobody uses it after this.
        unsafe { sys::mjenv_destroy(self.raw.as_ptr()) }
    }
}

impl fmt::Debug for Env {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.debug_struct("Env").field("rows", &self.rows).field("options", self.options()).finish()
    }
}
