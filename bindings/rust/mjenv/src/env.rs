use std::borrow::Cow;
use std::ffi::CStr;
use std::fmt;
use std::os::raw::c_void;
use std::ptr::{self, NonNull};
use std::time::Duration;

use mjenv_sys as sys;

use crate::describe::{int64, size, size_of};
use crate::error::{check, check_length, Error, ErrorKind, Result};
use crate::text::{borrowed, c_string, lossy};
use crate::{Batch, Dtype, Field, Options, Real, Role, Space, Spec};

/// How many rows each thread of an environment steps together, see [`Env::lanes`].
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Lanes {
    /// How many; 0: each row is stepped alone.
    pub count: usize,
    /// Why all or some of the rows are stepped alone; empty if none is.
    pub reason: String,
}

/// An environment of one or many rows. Each row is an episode; rows do not influence each other.
///
/// Rows and actuators are numbered from 0. Arrays of actions and outputs hold one row after the other.
///
/// Dropping the environment waits for its threads and frees it. It takes a few megabytes.
pub struct Env {
    raw: NonNull<sys::mjenv_env>,
    options: Options,
    rows: usize,
    /// Row numbers on their way to and from the library, so that sending and receiving allocate nothing.
    numbers: Vec<i64>,
}

// SAFETY: any thread may use an environment, and different environments are independent. The library keeps only the
// text of the last error by thread, and this crate copies it on the thread of the failing call. An Env is not Sync,
// because the library refuses the later of two threads: here the compiler refuses it.
unsafe impl Send for Env {}

impl Env {
    /// Builds an environment of `rows` rows with a copy of the options. Errors: [`ErrorKind::Value`] (`rows` is 0),
    /// [`ErrorKind::Name`] (the option `arrays` contains an unknown name), [`ErrorKind::Model`], [`ErrorKind::Memory`].
    pub fn new(options: &Options, rows: usize) -> Result<Self> {
        let options = options.try_clone()?;
        let mut raw = ptr::null_mut();
        // SAFETY: all pointers are valid for the call.
        check(unsafe { sys::mjenv_create(options.raw(), int64(rows), &mut raw) })?;
        let raw = NonNull::new(raw).expect("libmjenv creates an environment or fails");
        Ok(Self { raw, options, rows, numbers: Vec::with_capacity(rows) })
    }

    pub(crate) fn raw(&self) -> *mut sys::mjenv_env {
        self.raw.as_ptr()
    }

    /// Returns the number of rows.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Returns how many simulation steps of MuJoCo (mj_step) one step takes.
    pub fn frame_skip(&self) -> usize {
        // SAFETY: the handle is alive.
        size(unsafe { sys::mjenv_frame_skip(self.raw()) })
    }

    /// Returns how many rows each thread steps together in the lanes of the CPU's vector unit, and why rows are stepped
    /// alone. The answer may change when rows get values or forces of their own.
    pub fn lanes(&mut self) -> Result<Lanes> {
        let (mut count, mut reason) = (0, ptr::null());
        // SAFETY: the handle is alive.
        check(unsafe { sys::mjenv_lanes(self.raw(), &mut count, &mut reason) })?;
        // SAFETY: the text lives until the next call with the environment, which is borrowed.
        Ok(Lanes { count: size(count), reason: unsafe { borrowed(reason) }.to_string() })
    }

    /// Returns what Gymnasium registers for the id.
    pub fn spec(&self) -> Spec {
        self.options.spec()
    }

    /// Returns the options with which the environment was built.
    pub fn options(&self) -> &Options {
        &self.options
    }

    /// Allocates outputs for this environment with observations in `f64`, as Gymnasium has them.
    pub fn batch(&self) -> Batch<f64> {
        Batch::new(self, self.rows)
    }

    /// Allocates outputs for this environment with observations rounded to `f32`.
    pub fn batch_f32(&self) -> Batch<f32> {
        Batch::new(self, self.rows)
    }

    /// Allocates outputs for [`Env::rollout`] of `steps` steps.
    ///
    /// # Panics
    /// If they do not fit into the address space.
    pub fn rollout_batch(&self, steps: usize) -> Batch<f64> {
        Batch::new(self, self.rows.checked_mul(steps).expect("the batch fits into the address space"))
    }

    /// Does what [`Env::rollout_batch`] does, with observations rounded to `f32`.
    ///
    /// # Panics
    /// If they do not fit into the address space.
    pub fn rollout_batch_f32(&self, steps: usize) -> Batch<f32> {
        Batch::new(self, self.rows.checked_mul(steps).expect("the batch fits into the address space"))
    }

    /// Returns the space of one row's observation.
    pub fn observation_space(&self) -> Space<'_> {
        self.space(Role::Observation)
    }

    /// Returns the space of one row's action.
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
        let dtype = if raw.dtype == sys::MJENV_DTYPE_FLOAT32 { Dtype::Float32 } else { Dtype::Float64 };
        Space { dtype, low: bound(raw.low), high: bound(raw.high) }
    }

    /// Returns the fields of a role, in Gymnasium's order.
    pub fn fields(&self, role: Role) -> impl ExactSizeIterator<Item = Field<'_>> + '_ {
        // SAFETY: the handle is alive.
        let count = size(unsafe { sys::mjenv_field_count(self.raw(), role.raw()) });
        (0..count).map(move |index| self.field(role, index))
    }

    /// Returns how many elements the fields of a role have together, for one row.
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

    /// Gives every row a new random stream from its own seed: a row with the seed `s` draws what NumPy's
    /// `default_rng(s)` draws. `seeds` has an element for each row. A row that is never seeded gets its seed from the
    /// system's entropy at its first reset. Errors: [`ErrorKind::Size`].
    pub fn seed(&mut self, seeds: &[u64]) -> Result<()> {
        check_length("seeds", seeds.len(), self.rows)?;
        // SAFETY: there is a seed for each row; a null mask means all rows.
        check(unsafe { sys::mjenv_seed(self.raw(), seeds.as_ptr(), ptr::null()) })
    }

    /// Does what [`Env::seed`] does, for the rows where `mask` is true. `mask` and `seeds` have an element for each row
    /// of the environment. Errors: [`ErrorKind::Size`].
    pub fn seed_where(&mut self, mask: &[bool], seeds: &[u64]) -> Result<()> {
        check_length("mask", mask.len(), self.rows)?;
        check_length("seeds", seeds.len(), self.rows)?;
        // SAFETY: there are a seed and a flag for each row.
        check(unsafe { sys::mjenv_seed(self.raw(), seeds.as_ptr(), mask.as_ptr() as *const u8) })
    }

    /// Seeds one row from an integer of any size, given as its 32-bit digits, the least significant first.
    /// Errors: [`ErrorKind::Value`] (there is no such row), [`ErrorKind::Size`] (`digits` is empty).
    pub fn seed_digits(&mut self, row: usize, digits: &[u32]) -> Result<()> {
        // SAFETY: the pointer is valid for the given number of digits.
        check(unsafe { sys::mjenv_seed_digits(self.raw(), int64(row), digits.as_ptr(), digits.len()) })
    }

    /// Returns the random stream of a row, a PCG64 as NumPy has it: the low and high half of the state, the low and
    /// high half of the increment, and `has_uint32` and `uinteger`, which keep the half of a 64-bit draw that is not
    /// used yet. Errors: [`ErrorKind::Value`] (there is no such row), [`ErrorKind::NotReset`] (the row was neither seeded
    /// nor reset).
    pub fn stream(&self, row: usize) -> Result<[u64; 6]> {
        let mut words = [0; 6];
        // SAFETY: the pointer is valid for the given number of words.
        check(unsafe { sys::mjenv_get_stream(self.raw(), int64(row), words.as_mut_ptr(), words.len()) })?;
        Ok(words)
    }

    /// Replaces the random stream of a row by `words`, in the order of [`Env::stream`]. Errors: [`ErrorKind::Value`]
    /// (there is no such row, or the increment is even).
    pub fn set_stream(&mut self, row: usize, words: &[u64; 6]) -> Result<()> {
        // SAFETY: the pointer is valid for the given number of words.
        check(unsafe { sys::mjenv_set_stream(self.raw(), int64(row), words.as_ptr(), words.len()) })
    }

    /// Begins a new episode in every row. The start is drawn from the row's random stream. Writes the observations and
    /// the reset infos into `out`. Errors: [`ErrorKind::Size`] (`out` is of another environment),
    /// [`ErrorKind::Physics`].
    pub fn reset<T: Real>(&mut self, out: &mut Batch<T>) -> Result<()> {
        let out = out.raw();
        // SAFETY: the arrays of the batch have the sizes in `out`.
        check(unsafe { sys::mjenv_reset(self.raw(), ptr::null(), &out) })
    }

    /// Does what [`Env::reset`] does, for the rows where `mask` is true; `mask` has an element for each row. The
    /// outputs of the other rows keep their values. Errors: [`ErrorKind::Size`], [`ErrorKind::Physics`].
    pub fn reset_where<T: Real>(&mut self, mask: &[bool], out: &mut Batch<T>) -> Result<()> {
        check_length("mask", mask.len(), self.rows)?;
        let out = out.raw();
        // SAFETY: the arrays of the batch have the sizes in `out`, and the mask has an element for each row.
        check(unsafe { sys::mjenv_reset(self.raw(), mask.as_ptr() as *const u8, &out) })
    }

    /// Steps every row. `actions` is `[rows][action_space().count()]`, one row after the other. `f32` and `f64` actions
    /// give different bits, as in NumPy.
    ///
    /// With the option `autoreset_mode` a step also resets rows whose episodes have ended, as Gymnasium's SyncVectorEnv
    /// does. If MuJoCo fails in a row, that row keeps its state, [`Batch::failed`] returns true for it, and the other
    /// rows are stepped.
    ///
    /// Errors: [`ErrorKind::Size`], [`ErrorKind::NotReset`], [`ErrorKind::EpisodeEnded`],
    /// [`ErrorKind::Value`] (an action is NaN or infinite), [`ErrorKind::Physics`] (MuJoCo failed in a row). The option
    /// `strict` turns the checks of episodes and actions off.
    pub fn step<A: Real, T: Real>(&mut self, actions: &[A], out: &mut Batch<T>) -> Result<()> {
        let out = out.raw();
        let action = actions.as_ptr() as *const c_void;
        // SAFETY: the arrays of the batch have the sizes in `out`, and the actions have the given length and type.
        check(unsafe { sys::mjenv_step(self.raw(), ptr::null(), action, actions.len(), A::DTYPE, &out) })
    }

    /// Does what [`Env::step`] does, for the rows where `mask` is true; `mask` has an element for each row. `actions` has
    /// the elements of all rows, of which those of the other rows are ignored. The other rows and their outputs keep
    /// their values. Errors: those of [`Env::step`].
    pub fn step_where<A: Real, T: Real>(&mut self, mask: &[bool], actions: &[A], out: &mut Batch<T>) -> Result<()> {
        check_length("mask", mask.len(), self.rows)?;
        let out = out.raw();
        let (mask, action, count) = (mask.as_ptr() as *const u8, actions.as_ptr() as *const c_void, actions.len());
        // SAFETY: the arrays of the batch have the sizes in `out`, the mask has an element for each row, and the actions
        // have the given length and type.
        check(unsafe { sys::mjenv_step(self.raw(), mask, action, count, A::DTYPE, &out) })
    }

    /// Begins a step of every row and returns at once, so that the program can work while the rows are stepped.
    /// `actions` is `[rows][action_space().count()]` and is copied. [`Env::recv`] returns the results.
    ///
    /// While rows are under way, functions other than [`Env::send`], [`Env::send_rows`] and [`Env::recv`] that read or
    /// change rows return [`ErrorKind::Pending`].
    ///
    /// ```
    /// # fn main() -> Result<(), mjenv::Error> {
    /// let mut options = mjenv::Options::new("Reacher-v5")?;
    /// options.set("num_threads", 2)?.set("autoreset_mode", "next_step")?;
    /// let mut env = mjenv::Env::new(&options, 8)?;
    /// let (mut batch, mut rows) = (env.batch(), Vec::new());
    /// env.reset(&mut batch)?;
    /// env.send(&[0.0f32; 8 * 2])?;
    /// for _ in 0..100 {
    ///     env.recv(4, None, &mut rows, &mut batch)?;
    ///     let actions: Vec<_> = rows.iter().flat_map(|&row| [batch.obs(row)[0], 0.0]).collect();
    ///     env.send_rows(&rows, &actions)?;
    /// }
    /// # Ok(())
    /// # }
    /// ```
    ///
    /// Errors: those of [`Env::step`] except for [`ErrorKind::Physics`], which [`Env::recv`] returns;
    /// [`ErrorKind::Pending`] (a row is under way already).
    pub fn send<A: Real>(&mut self, actions: &[A]) -> Result<()> {
        let action = actions.as_ptr() as *const c_void;
        // SAFETY: the actions have the given length and type, and null rows mean all rows.
        check(unsafe { sys::mjenv_send(self.raw(), ptr::null(), 0, action, actions.len(), A::DTYPE) })
    }

    /// Does what [`Env::send`] does, for some rows. `actions` is `[rows.len()][action_space().count()]`.
    /// Errors: those of [`Env::send`], [`ErrorKind::Value`] (there is no such row).
    pub fn send_rows<A: Real>(&mut self, rows: &[usize], actions: &[A]) -> Result<()> {
        if rows.is_empty() {
            // To the library, null rows mean all rows, and the pointer of an empty slice means nothing.
            return check_length("actions", actions.len(), 0);
        }
        self.numbers.clear();
        self.numbers.extend(rows.iter().map(|&row| int64(row)));
        let (numbers, action) = (self.numbers.as_ptr(), actions.as_ptr() as *const c_void);
        // SAFETY: rows and actions have the given lengths and type.
        check(unsafe { sys::mjenv_send(self.raw(), numbers, rows.len(), action, actions.len(), A::DTYPE) })
    }

    /// Waits until at least `least` of the rows that were sent have been stepped, or until `timeout` has passed. Writes
    /// the numbers of all rows that are done into `rows`, which it empties first, and their outputs into `out`, each at
    /// the row's own place. Each row is reported once.
    ///
    /// Errors: [`ErrorKind::NotPending`], [`ErrorKind::Size`] (fewer than `least` rows are under way,
    /// or `out` is of another environment), [`ErrorKind::Physics`] (MuJoCo failed in a row, for which [`Batch::failed`]
    /// returns true). If a row failed, `rows` and `out` are written all the same.
    pub fn recv<T: Real>(
        &mut self,
        least: usize,
        timeout: Option<Duration>,
        rows: &mut Vec<usize>,
        out: &mut Batch<T>,
    ) -> Result<()> {
        rows.clear();
        self.numbers.resize(self.rows, 0);
        // The library waits without limit for a negative time.
        let seconds = timeout.map_or(-1.0, |timeout| timeout.as_secs_f64());
        let (env, numbers, room, mut count) = (self.raw(), self.numbers.as_mut_ptr(), self.rows, 0);
        let out = out.raw();
        // SAFETY: there is room for the number of every row, and the arrays of the batch have the sizes in `out`.
        let result = check(unsafe { sys::mjenv_recv(env, least, seconds, numbers, room, &mut count, &out) });
        rows.extend(self.numbers[..count].iter().map(|&row| size(row)));
        result
    }

    /// Steps every row `steps` times, beginning at its present state. `actions` is
    /// `[rows][steps][action_space().count()]`, and `out` comes from [`Env::rollout_batch`]. A row whose episode ends
    /// stays there: for the steps that remain, its flags and its observation repeat, and its rewards and infos are 0.
    /// No row is reset. Errors: those of [`Env::step`].
    pub fn rollout<A: Real, T: Real>(&mut self, actions: &[A], steps: usize, out: &mut Batch<T>) -> Result<()> {
        let out = out.raw();
        let (env, action, count) = (self.raw(), actions.as_ptr() as *const c_void, actions.len());
        // SAFETY: the arrays of the batch have the sizes in `out`, and the actions have the given length and type.
        check(unsafe { sys::mjenv_rollout(env, action, count, A::DTYPE, int64(steps), &out) })
    }

    /// Writes the present observations of all rows, without a step, and the arrays that the option `arrays` names. The
    /// other outputs keep their values. Errors: [`ErrorKind::Size`], [`ErrorKind::Physics`].
    pub fn observe<T: Real>(&self, out: &mut Batch<T>) -> Result<()> {
        let out = out.raw();
        // SAFETY: the arrays of the batch have the sizes in `out`.
        check(unsafe { sys::mjenv_observe(self.raw(), &out) })
    }

    /// Seeds the random stream of [`Env::sample_actions`], as Gymnasium's `action_space.seed(seed)` does.
    pub fn seed_actions(&mut self, seed: u64) -> Result<()> {
        // SAFETY: the handle is alive.
        check(unsafe { sys::mjenv_seed_actions(self.raw(), seed) })
    }

    /// Draws an action for each row, as Gymnasium's `action_space.sample()` does, and writes them into `actions`,
    /// `[rows][action_space().count()]`. All rows draw from one stream, one after the other. Errors:
    /// [`ErrorKind::Size`], [`ErrorKind::Model`] (an actuator has no bounds).
    pub fn sample_actions(&mut self, actions: &mut [f32]) -> Result<()> {
        // SAFETY: the pointer is valid for the given number of elements.
        check(unsafe { sys::mjenv_sample_actions(self.raw(), actions.as_mut_ptr(), actions.len()) })
    }

    /// Reads an array of the row's mjData or of the mjModel by its MuJoCo name: `"xpos"`, `"body_mass"`, `"nq"`,
    /// `"opt.timestep"`. The values are those of Gymnasium's `env.unwrapped.data` after the last step, row-major.
    /// [`Env::fields`] lists the arrays with their shapes and units under [`Role::Data`] and [`Role::Model`].
    /// Errors: [`ErrorKind::Name`], [`ErrorKind::Value`] (there is no such row), [`ErrorKind::Physics`].
    pub fn read(&self, row: usize, array: &str) -> Result<Vec<f64>> {
        let name = c_string(format_args!("array {array:?}"), array)?;
        let mut values = vec![0.0; self.read_raw(row, &name, &mut [])?];
        self.read_raw(row, &name, &mut values)?;
        Ok(values)
    }

    /// Does what [`Env::read`] does, and writes into the first elements of `values`. Returns how many it wrote.
    /// Errors: those of [`Env::read`], [`ErrorKind::Size`] (`values` is too short).
    pub fn read_into(&self, row: usize, array: &str, values: &mut [f64]) -> Result<usize> {
        let name = c_string(format_args!("array {array:?}"), array)?;
        let count = self.read_raw(row, &name, values)?;
        if values.is_empty() && count > 0 {
            let message = format!("there is room for 0, but array {array:?} has {count} element(s)");
            return Err(Error::new(ErrorKind::Size, message));
        }
        Ok(count)
    }

    /// Returns the array's length. If `values` is empty, it reads nothing else.
    fn read_raw(&self, row: usize, array: &CStr, values: &mut [f64]) -> Result<usize> {
        let mut count = 0;
        let (to, room) = (values.as_mut_ptr(), values.len());
        // SAFETY: all pointers are valid for the call, and `values` has the given room.
        check(unsafe { sys::mjenv_read(self.raw(), int64(row), array.as_ptr(), to, room, &mut count) })?;
        Ok(count)
    }

    /// Returns how many objects of a kind the model has. `kind` is `"body"`, `"joint"`, `"geom"`, `"site"`, `"camera"`,
    /// `"actuator"`, `"tendon"`, `"sensor"` or `"light"`. Errors: [`ErrorKind::Name`].
    pub fn object_count(&self, kind: &str) -> Result<usize> {
        let kind = c_string(format_args!("type {kind:?}"), kind)?;
        let mut count = 0;
        // SAFETY: all pointers are valid for the call.
        check(unsafe { sys::mjenv_object_count(self.raw(), kind.as_ptr(), &mut count) })?;
        Ok(size(count))
    }

    /// Returns the index of a named object; [`Env::object_count`] lists the kinds.
    /// Errors: [`ErrorKind::Name`] (the kind or the object).
    pub fn object_index(&self, kind: &str, name: &str) -> Result<usize> {
        let (kind, name) =
            (c_string(format_args!("type {kind:?}"), kind)?, c_string(format_args!("name {name:?}"), name)?);
        let mut index = 0;
        // SAFETY: all pointers are valid for the call.
        check(unsafe { sys::mjenv_object_index(self.raw(), kind.as_ptr(), name.as_ptr(), &mut index) })?;
        Ok(size(index))
    }

    /// Returns the name of an object; it is empty if the object has none. Errors: [`ErrorKind::Name`] (the kind),
    /// [`ErrorKind::Value`] (there is no such object).
    pub fn object_name(&self, kind: &str, index: usize) -> Result<Cow<'_, str>> {
        let kind = c_string(format_args!("type {kind:?}"), kind)?;
        let mut name = ptr::null();
        // SAFETY: all pointers are valid for the call.
        check(unsafe { sys::mjenv_object_name(self.raw(), kind.as_ptr(), int64(index), &mut name) })?;
        // SAFETY: the name belongs to the environment and never changes.
        Ok(unsafe { lossy(name) })
    }

    /// Sets the positions and velocities of a row, in MuJoCo's units, and computes what depends on them, as Gymnasium's
    /// `set_state` does. `qpos` has nq elements and `qvel` has nv. The count of steps goes on. After it the row may be
    /// stepped, even if it was never reset or its episode had ended. Errors: [`ErrorKind::Value`] (there is no such
    /// row, or a number is NaN or infinite), [`ErrorKind::Size`], [`ErrorKind::Physics`].
    pub fn set_state(&mut self, row: usize, qpos: &[f64], qvel: &[f64]) -> Result<()> {
        let env = self.raw();
        // SAFETY: the pointers are valid for the given number of elements.
        check(unsafe { sys::mjenv_set_state(env, int64(row), qpos.as_ptr(), qpos.len(), qvel.as_ptr(), qvel.len()) })
    }

    /// Writes an array of a row's mjModel, or an input of its mjData, by its MuJoCo name: `"body_mass"`,
    /// `"geom_friction"`, `"opt.timestep"`, `"xfrc_applied"`. `values` has all elements of the array, as many as
    /// [`Env::read`] returns. The effect is that of the same assignment in Gymnasium
    /// (`env.unwrapped.model.body_mass[:] = values`): values of the mjModel stay over resets, and a reset clears the
    /// inputs. mjenv.h lists what can be written.
    ///
    /// ```
    /// # fn main() -> Result<(), mjenv::Error> {
    /// let mut env = mjenv::Env::new(&mjenv::Options::new("Hopper-v5")?, 2)?;
    /// let mut masses = env.read(1, "body_mass")?;
    /// masses[1] *= 1.5; // the torso of row 1
    /// env.write(1, "body_mass", &masses)?;
    /// # assert_eq!(env.read(1, "body_mass")?[1], env.read(0, "body_mass")?[1] * 1.5);
    /// # Ok(())
    /// # }
    /// ```
    ///
    /// Errors: [`ErrorKind::Name`] (there is no such array, or it cannot be written), [`ErrorKind::Value`] (there is no
    /// such row, or MuJoCo could not compute with a value), [`ErrorKind::Size`]. After an error nothing was written.
    pub fn write(&mut self, row: usize, array: &str, values: &[f64]) -> Result<()> {
        self.write_raw(int64(row), array, values)
    }

    /// Does what [`Env::write`] does, for all rows, which then have the same values. Errors: those of [`Env::write`].
    pub fn write_all(&mut self, array: &str, values: &[f64]) -> Result<()> {
        self.write_raw(sys::MJENV_ALL_ROWS.into(), array, values)
    }

    fn write_raw(&mut self, row: i64, array: &str, values: &[f64]) -> Result<()> {
        let name = c_string(format_args!("array {array:?}"), array)?;
        // SAFETY: all pointers are valid for the call, and `values` has the given number of elements.
        check(unsafe { sys::mjenv_write(self.raw(), row, name.as_ptr(), values.as_ptr(), values.len()) })
    }

    /// Writes an array of all rows, each with values of its own: `values` is `[rows][elements of the array]`, one row
    /// after the other. Errors: those of [`Env::write`].
    pub fn write_rows(&mut self, array: &str, values: &[f64]) -> Result<()> {
        self.write_rows_raw(ptr::null(), array, values)
    }

    /// Does what [`Env::write_rows`] does, for the rows where `mask` is true; `mask` has an element for each row.
    /// `values` has the elements of all rows, of which those of the other rows are ignored. Errors: those of
    /// [`Env::write`].
    pub fn write_rows_where(&mut self, mask: &[bool], array: &str, values: &[f64]) -> Result<()> {
        check_length("mask", mask.len(), self.rows)?;
        self.write_rows_raw(mask.as_ptr() as *const u8, array, values)
    }

    fn write_rows_raw(&mut self, mask: *const u8, array: &str, values: &[f64]) -> Result<()> {
        let name = c_string(format_args!("array {array:?}"), array)?;
        // SAFETY: all pointers are valid for the call, `values` has the given number of elements, and a mask that is
        // not null has an element for each row.
        check(unsafe { sys::mjenv_write_rows(self.raw(), mask, name.as_ptr(), values.as_ptr(), values.len()) })
    }

    /// Calls mj_setConst for a row: MuJoCo computes anew what it computes from masses, sizes and `qpos0` when it
    /// compiles a model, for instance `body_subtreemass` and `dof_invweight0`. The row ends in the position
    /// `qpos_spring`, for which mj_setConst computes last: reset the row, or set its state. Errors:
    /// [`ErrorKind::Value`] (there is no such row), [`ErrorKind::Physics`], [`ErrorKind::Model`] (it would change what
    /// all rows share).
    pub fn set_constants(&mut self, row: usize) -> Result<()> {
        // SAFETY: the handle is alive.
        check(unsafe { sys::mjenv_set_constants(self.raw(), int64(row)) })
    }

    /// Does what [`Env::set_constants`] does, for all rows. Errors: those of [`Env::set_constants`].
    pub fn set_constants_all(&mut self) -> Result<()> {
        // SAFETY: the handle is alive.
        check(unsafe { sys::mjenv_set_constants(self.raw(), sys::MJENV_ALL_ROWS.into()) })
    }

    /// Advances the simulation of a row by `frames` steps of MuJoCo (mj_step) with the controls `ctrl`, a number for
    /// each actuator, as Gymnasium's `do_simulation` does. It counts no step of the environment and gives no reward.
    /// Errors: [`ErrorKind::Value`] (there is no such row, or `frames` is 0), [`ErrorKind::Size`],
    /// [`ErrorKind::Physics`].
    pub fn simulate(&mut self, row: usize, ctrl: &[f64], frames: usize) -> Result<()> {
        let (env, frames) = (self.raw(), int64(frames));
        // SAFETY: the pointer is valid for the given number of elements.
        check(unsafe { sys::mjenv_simulate(env, int64(row), ctrl.as_ptr(), ctrl.len(), frames) })
    }

    /// Copies the row `from` into all rows where `to` is true: simulation, random stream, counters and
    /// written arrays. `to` has an element for each row. Errors: [`ErrorKind::Value`] (there is no such row), [`ErrorKind::Size`].
    pub fn copy_row(&mut self, from: usize, to: &[bool]) -> Result<()> {
        check_length("mask", to.len(), self.rows)?;
        // SAFETY: there is a flag for each row.
        check(unsafe { sys::mjenv_copy_row(self.raw(), int64(from), to.as_ptr() as *const u8) })
    }

    /// Saves a row as bytes, called an image: simulation, random stream, counters and written arrays.
    /// [`Env::restore`] continues from it. Errors: [`ErrorKind::Value`] (there is no such row).
    pub fn snapshot(&self, row: usize) -> Result<Vec<u8>> {
        self.image(int64(row))
    }

    /// Saves all rows as one image, for [`Env::restore_all`].
    pub fn snapshot_all(&self) -> Result<Vec<u8>> {
        self.image(sys::MJENV_ALL_ROWS.into())
    }

    fn image(&self, row: i64) -> Result<Vec<u8>> {
        let mut size = 0;
        // SAFETY: all pointers are valid for the call; it reads only the size.
        check(unsafe { sys::mjenv_snapshot(self.raw(), row, ptr::null_mut(), 0, &mut size) })?;
        let mut image = vec![0u8; size];
        let (to, room) = (image.as_mut_ptr() as *mut c_void, image.len());
        // SAFETY: all pointers are valid for the call, and `values` has the given room.
        check(unsafe { sys::mjenv_snapshot(self.raw(), row, to, room, &mut size) })?;
        Ok(image)
    }

    /// Sets a row to the state that [`Env::snapshot`] saved. The row continues with the same bits, also in another
    /// process and with another number of threads. The environment must have the same id, model and options as the one
    /// that was saved, except for `num_threads`, `lanes`, `cpu_affinity` and `arrays`. Errors: [`ErrorKind::Value`] (there
    /// is no such row), [`ErrorKind::Snapshot`].
    pub fn restore(&mut self, row: usize, image: &[u8]) -> Result<()> {
        self.set_image(int64(row), image)
    }

    /// Sets all rows to the state that [`Env::snapshot_all`] saved, as [`Env::restore`] does for one. The image must
    /// hold as many rows as the environment has. Errors: [`ErrorKind::Snapshot`].
    pub fn restore_all(&mut self, image: &[u8]) -> Result<()> {
        self.set_image(sys::MJENV_ALL_ROWS.into(), image)
    }

    fn set_image(&mut self, row: i64, image: &[u8]) -> Result<()> {
        let (from, size) = (image.as_ptr() as *const c_void, image.len());
        // SAFETY: the pointer is valid for the given number of bytes.
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
