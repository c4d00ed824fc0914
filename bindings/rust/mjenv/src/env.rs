use std::borrow::Cow;
use std::ffi::CStr;
use std::fmt;
use std::ptr::{self, NonNull};
use std::slice;
use std::time::Duration;

use mjenv_sys as sys;

use crate::describe::{int64, size, size_of};
use crate::error::{call, check, check_length, owned, Error, ErrorKind, Result};
use crate::text::{borrowed, c_string, lossy};
use crate::{Batch, Dtype, Field, Options, Real, Role, Rows, Space, Spec};

mod halves;
pub use halves::Computed;

/// How many rows each thread of an environment steps together, see [`Env::lanes`].
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub struct Lanes {
    /// The number of rows; 0: rows are stepped one by one.
    pub count: usize,
    /// Why all or some rows are stepped one by one; empty if all are stepped together.
    pub reason: String,
}

mod sealed {
    pub trait Seed: Copy {
        /// How many 64-bit words a seed has.
        const WORDS: usize;
    }

    impl Seed for u64 {
        const WORDS: usize = 1;
    }

    impl<const N: usize> Seed for [u64; N] {
        const WORDS: usize = N;
    }
}

/// A seed: a `u64`, or a larger integer as the array of its 64-bit words, the least significant first.
pub trait Seed: sealed::Seed {}

impl<T: sealed::Seed> Seed for T {}

/// An environment of one or many rows. Each row is an episode; rows do not influence each other.
///
/// Rows and actuators are numbered from 0. Arrays of actions and outputs hold one row after the other. The functions
/// that are for one or many rows take [`Rows`].
///
/// Dropping the environment waits for its threads and frees it. It takes a few megabytes.
pub struct Env {
    raw: NonNull<sys::mjenv_env>,
    options: Options,
    rows: usize,
    frame_skip: usize,
    threads: usize,
    room: Room,
}

/// Memory for what is passed to the library, so that steps allocate nothing.
struct Room {
    /// Row numbers.
    numbers: Vec<i64>,
    /// A flag for each row.
    mask: Vec<bool>,
    /// An element for each row and actuator.
    actions: Vec<f64>,
}

// SAFETY: any thread may use an environment, and different environments are independent. The library keeps only the
// text of the last error for each thread, and this crate copies it on the thread of the failing call. An Env is not Sync,
// so the compiler refuses two threads in one environment, which the library would refuse at run time.
unsafe impl Send for Env {}

impl Room {
    fn new(rows: usize, actuators: usize) -> Self {
        Self { numbers: vec![0; rows], mask: vec![false; rows], actions: vec![0.0; rows * actuators] }
    }

    /// Returns the mask of the rows as the library takes it: a null pointer for all rows. It is valid as long as `rows`
    /// and until the room is used again.
    fn mask(&mut self, rows: Rows<'_>) -> Result<*const u8> {
        if let Some(list) = rows.list() {
            self.mask.fill(false);
            for &row in list {
                let count = self.mask.len();
                *self.mask.get_mut(row).ok_or_else(|| no_row(row, count))? = true;
            }
        }
        let flags = match rows {
            Rows::All => return Ok(ptr::null()),
            Rows::Mask(mask) => {
                check_length("mask", mask.len(), self.mask.len())?;
                mask
            }
            Rows::One(_) | Rows::List(_) => &self.mask,
        };
        Ok(flags.as_ptr().cast())
    }

    /// Returns the actions of all rows; those of some rows are put at the places of these rows.
    fn spread_actions<'a, A: Real>(&'a mut self, rows: Rows<'_>, actions: &'a [A]) -> Result<&'a [A]> {
        match rows.list() {
            Some(list) => {
                let count = self.mask.len();
                spread("action", list, actions, self.actions(), count)
            }
            None => Ok(actions),
        }
    }

    /// Returns the row numbers as the library takes them, and the actions of these rows alone.
    fn sent<'a, A: Real>(&'a mut self, rows: Rows<'_>, actions: &'a [A]) -> Result<(&'a [i64], &'a [A])> {
        self.numbers.clear();
        let mask = match rows {
            Rows::Mask(mask) => mask,
            _ => {
                let all = 0..self.mask.len();
                match rows.list() {
                    Some(list) => self.numbers.extend(list.iter().map(|&row| int64(row))),
                    None => self.numbers.extend(all.map(int64)),
                }
                return Ok((&self.numbers, actions));
            }
        };
        check_length("mask", mask.len(), self.mask.len())?;
        check_length("action", actions.len(), self.actions.len())?;
        let width = actions.len() / mask.len();
        let mut count = 0;
        for row in (0..mask.len()).filter(|&row| mask[row]) {
            self.numbers.push(int64(row));
            self.actions()[count..][..width].copy_from_slice(&actions[row * width..][..width]);
            count += width;
        }
        let Self { numbers, actions, .. } = self;
        Ok((numbers, &typed(actions)[..count]))
    }

    fn actions<A: Real>(&mut self) -> &mut [A] {
        typed(&mut self.actions)
    }
}

/// Uses memory for numbers of either type.
fn typed<A: Real>(numbers: &mut [f64]) -> &mut [A] {
    // SAFETY: A is f64 or f32, which needs no more room and no stricter alignment, and for which all bits are valid.
    unsafe { slice::from_raw_parts_mut(numbers.as_mut_ptr().cast(), numbers.len()) }
}

/// Copies the values of the rows in `list` to the places of these rows in `all`, which has room for `rows` rows.
fn spread<'a, T: Copy>(what: &str, list: &[usize], values: &[T], all: &'a mut [T], rows: usize) -> Result<&'a [T]> {
    let width = all.len() / rows;
    check_length(what, values.len(), list.len() * width)?;
    for (index, &row) in list.iter().enumerate() {
        let place = all.get_mut(row * width..(row + 1) * width).ok_or_else(|| no_row(row, rows))?;
        place.copy_from_slice(&values[index * width..][..width]);
    }
    Ok(all)
}

fn no_row(row: usize, rows: usize) -> Error {
    Error::new(ErrorKind::Value, format!("row {row} is outside 0..{}", rows - 1))
}

impl Env {
    /// Builds an environment of `rows` rows with a copy of the options. Errors: [`ErrorKind::Value`] (`rows` is 0),
    /// [`ErrorKind::Name`] (the option `arrays` contains an unknown name), [`ErrorKind::File`], [`ErrorKind::Model`],
    /// [`ErrorKind::Memory`].
    pub fn new(options: &Options, rows: usize) -> Result<Self> {
        let options = options.try_clone()?;
        let mut raw = ptr::null_mut();
        // SAFETY: all pointers are valid for the call.
        check(unsafe { sys::mjenv_create(options.raw(), int64(rows), &mut raw) })?;
        let raw = NonNull::new(raw).expect("libmjenv creates an environment or fails");
        let mut env = Self { raw, options, rows, frame_skip: 0, threads: 0, room: Room::new(0, 0) };
        let info = env.info()?;
        env.frame_skip = size(info.frame_skip);
        env.threads = size(info.threads.into());
        env.room = Room::new(rows, env.action_space().count());
        Ok(env)
    }

    methods! {
        self;
        /// Returns the number of rows.
        rows() -> usize { self.rows }
        /// Returns how many simulation steps of MuJoCo (mj_step) one step takes.
        frame_skip() -> usize { self.frame_skip }
        /// Returns how many threads step the rows.
        threads() -> usize { self.threads }
        /// Returns what Gymnasium registers for the id.
        spec() -> Spec { self.options.spec() }
        /// Returns the options with which the environment was built.
        options() -> &Options { &self.options }
        /// Returns the space of one row's observation.
        observation_space() -> Space<'_> { self.space(Role::Observation) }
        /// Returns the space of one row's action.
        action_space() -> Space<'_> { self.space(Role::Action) }
    }

    /// Returns how many rows each thread steps together in the lanes of the CPU's vector unit, and why rows are stepped
    /// one by one. Errors: [`ErrorKind::Pending`].
    pub fn lanes(&mut self) -> Result<Lanes> {
        let info = self.info()?;
        // SAFETY: the text lives until the library is asked again, and the environment is borrowed.
        Ok(Lanes { count: size(info.lanes), reason: unsafe { borrowed(info.lanes_reason) }.to_string() })
    }

    /// Returns how lanes compute each stage of a step: its name, and `"lanes"`, `"row by row: WHY"`, `"lanes; row by
    /// row: WHAT"` or `"absent"`. Empty if the library has no lanes. Errors: [`ErrorKind::Busy`].
    pub fn lane_stages(&mut self) -> Result<Vec<(String, String)>> {
        // SAFETY: the handle is alive.
        let text = unsafe { sys::mjenv_lane_stages_of(self.raw()) };
        if text.is_null() {
            check(sys::MJENV_E_BUSY)?;
        }
        // SAFETY: the text belongs to the environment, which is borrowed.
        let lines = unsafe { borrowed(text) }.lines();
        Ok(lines.filter_map(|line| line.split_once(": ")).map(|(stage, how)| (stage.into(), how.into())).collect())
    }

    fn info(&mut self) -> Result<sys::mjenv_info> {
        let mut info = sys::mjenv_info { struct_size: size_of::<sys::mjenv_info>(), ..Default::default() };
        call!(self.mjenv_info_of(&mut info))?;
        Ok(info)
    }

    /// Allocates outputs for this environment. Their observations are `f64`, as Gymnasium has them, or rounded to `f32`:
    /// `env.batch::<f64>()`.
    pub fn batch<T: Real>(&self) -> Batch<T> {
        Batch::new(self, self.rows)
    }

    /// Allocates outputs for [`Env::rollout`] of `steps` steps. Panics if they do not fit into the address space.
    pub fn rollout_batch<T: Real>(&self, steps: usize) -> Batch<T> {
        Batch::new(self, self.rows.checked_mul(steps).expect("the batch fits into the address space"))
    }

    fn space(&self, role: Role) -> Space<'_> {
        let mut raw = sys::mjenv_space { struct_size: size_of::<sys::mjenv_space>(), ..Default::default() };
        call!(self.mjenv_space_of(role as i32, &mut raw)).expect("an environment has two spaces");
        let bound = |values: *const f64| match size(raw.count) {
            0 => &[],
            // SAFETY: the bounds hold `count` values that belong to the environment and never change.
            count => unsafe { slice::from_raw_parts(values, count) },
        };
        let ndim = usize::try_from(raw.ndim).unwrap_or(0).min(raw.shape.len());
        let (low, high) = (bound(raw.low), bound(raw.high));
        Space { dtype: Dtype::from_raw(raw.dtype), low, high, ndim, shape: raw.shape.map(size) }
    }

    /// Returns the fields of a role, in Gymnasium's order.
    pub fn fields(&self, role: Role) -> impl ExactSizeIterator<Item = Field<'_>> + '_ {
        // SAFETY: the handle is alive.
        let count = size(unsafe { sys::mjenv_field_count(self.raw(), role as i32) });
        (0..count).map(move |index| self.field(role, index))
    }

    /// Returns how many elements the fields of a role have together, for one row.
    pub(crate) fn count(&self, role: Role) -> usize {
        self.fields(role).map(|field| field.count).sum()
    }

    fn field(&self, role: Role, index: usize) -> Field<'_> {
        let mut raw = sys::mjenv_field { struct_size: size_of::<sys::mjenv_field>(), ..Default::default() };
        call!(self.mjenv_field_at(role as i32, int64(index), &mut raw)).expect("a field has a description");
        // SAFETY: the texts belong to the environment and never change.
        unsafe { Field::from_raw(&raw) }
    }

    /// Gives each of the rows a new random stream from its own seed: a row with the seed `s` draws what NumPy's
    /// `default_rng(s)` draws. `seeds` has an element for each row, a `u64` or an array of words. A row that is never
    /// seeded gets its seed from the system's entropy at its first reset.
    ///
    /// ```
    /// # fn main() -> Result<(), mjenv::Error> {
    /// # let mut env = mjenv::Env::new(&mjenv::Options::new("Reacher-v5")?, 2)?;
    /// env.seed(.., &[42, 43])?;
    /// env.seed(1, &[[0, 1]])?; // 2 to the power of 64
    /// # Ok(())
    /// # }
    /// ```
    /// Errors: [`ErrorKind::Size`] (there are more or fewer seeds, or a seed has no words); those of [`Rows`].
    pub fn seed<'a, S: Seed>(&mut self, rows: impl Into<Rows<'a>>, seeds: &[S]) -> Result<()> {
        let rows = rows.into();
        if let (Rows::One(row), [seed]) = (rows, seeds) {
            return call!(self.mjenv_seed_row(int64(row), (seed as *const S).cast(), int64(S::WORDS)));
        }
        let mask = self.room.mask(rows)?;
        let mut all;
        let seeds = match (rows.list(), seeds) {
            (Some([]), []) => return Ok(()),
            (Some(list), [first, ..]) => {
                all = vec![*first; self.rows];
                spread("seeds", list, seeds, &mut all, self.rows)?
            }
            _ => seeds,
        };
        check_length("seeds", seeds.len(), self.rows)?;
        call!(self.mjenv_seed(mask, seeds.as_ptr().cast(), int64(seeds.len() * S::WORDS)))
    }

    /// Computes the rewards of pairs of goals by the task's `compute_reward`, for hindsight experience replay.
    /// `achieved` and `desired` hold one goal after the other, and `rewards` one number for each pair. Errors:
    /// [`ErrorKind::Task`] (the task has no `compute_reward`, or it failed), [`ErrorKind::Size`] (the lengths do not
    /// fit together).
    pub fn compute_reward(&self, achieved: &[f64], desired: &[f64], rewards: &mut [f64]) -> Result<()> {
        check_length("desired", desired.len(), achieved.len())?;
        let (from, to, rewards, count) =
            (achieved.as_ptr(), desired.as_ptr(), rewards.as_mut_ptr(), int64(rewards.len()));
        call!(self.mjenv_compute_reward(from, to, int64(achieved.len()), rewards, count))
    }

    /// Returns the random stream of a row, a PCG64 as NumPy has it: the low and high half of the state, the low and
    /// high half of the increment, and `has_uint32` and `uinteger`, which hold the half of a 64-bit draw that is not
    /// yet used. Errors: [`ErrorKind::Value`] (there is no such row), [`ErrorKind::NotReset`] (the row was neither
    /// seeded nor reset).
    pub fn stream(&self, row: usize) -> Result<[u64; 6]> {
        let mut words = [0; 6];
        call!(self.mjenv_get_stream(int64(row), words.as_mut_ptr(), 6))?;
        Ok(words)
    }

    /// Replaces the random stream of a row by `words`, in the order of [`Env::stream`]. Errors: [`ErrorKind::Value`]
    /// (there is no such row, or the increment is even).
    pub fn set_stream(&mut self, row: usize, words: &[u64; 6]) -> Result<()> {
        call!(self.mjenv_set_stream(int64(row), words.as_ptr(), 6))
    }

    /// Begins a new episode in each of the rows. The start is drawn from the row's random stream. Writes the
    /// observations and the reset infos into `out`, where the other rows keep their values. Errors: [`ErrorKind::Size`]
    /// (`out` is of another environment), [`ErrorKind::Physics`]; those of [`Rows`].
    pub fn reset<'a, T: Real>(&mut self, rows: impl Into<Rows<'a>>, out: &mut Batch<T>) -> Result<()> {
        let (mask, out) = (self.room.mask(rows.into())?, out.raw());
        call!(self.mjenv_reset(mask, &out))
    }

    /// Steps the rows. `actions` has `action_space().count()` numbers for each row. `f32` and `f64` actions give
    /// different bits, as in NumPy. Writes the outputs into `out`; the other rows keep their state, and their outputs
    /// keep their values.
    ///
    /// With the option `autoreset_mode` a step also resets rows whose episodes have ended, as Gymnasium's SyncVectorEnv
    /// does. If MuJoCo fails in a row, that row keeps its state, [`Batch::failed`] returns true for it, and the other
    /// rows are stepped. Errors: [`ErrorKind::Size`], [`ErrorKind::NotReset`], [`ErrorKind::EpisodeEnded`],
    /// [`ErrorKind::Value`] (an action is NaN or infinite), [`ErrorKind::Physics`] (MuJoCo failed in a row); those of
    /// [`Rows`]. The option `strict` turns the checks of episodes and actions off.
    pub fn step<'a, A: Real, T: Real>(
        &mut self,
        rows: impl Into<Rows<'a>>,
        actions: &[A],
        out: &mut Batch<T>,
    ) -> Result<()> {
        let (rows, env, out) = (rows.into(), self.raw(), out.raw());
        let mask = self.room.mask(rows)?;
        let actions = self.room.spread_actions(rows, actions)?;
        // SAFETY: as in `call!`; the actions are of the type that is passed.
        check(unsafe { sys::mjenv_step(env, mask, actions.as_ptr().cast(), int64(actions.len()), A::DTYPE, &out) })
    }

    /// Begins a step of the rows and returns at once, so that the program can work while the rows are stepped. `actions`
    /// are those of [`Env::step`], and are copied. [`Env::recv`] returns the results.
    ///
    /// While rows are under way, functions other than [`Env::send`] and [`Env::recv`] that read or change rows return
    /// [`ErrorKind::Pending`].
    ///
    /// ```
    /// # fn main() -> Result<(), mjenv::Error> {
    /// let mut options = mjenv::Options::new("Reacher-v5")?;
    /// options.set("num_threads", 2)?.set("autoreset_mode", "next_step")?;
    /// let mut env = mjenv::Env::new(&options, 8)?;
    /// let (mut batch, mut rows) = (env.batch::<f64>(), Vec::new());
    /// env.reset(.., &mut batch)?;
    /// env.send(.., &[0.0f32; 8 * 2])?;
    /// for _ in 0..100 {
    ///     env.recv(4, None, &mut rows, &mut batch)?;
    ///     let actions: Vec<_> = rows.iter().flat_map(|&row| [batch.obs(row)[0], 0.0]).collect();
    ///     env.send(&rows, &actions)?;
    /// }
    /// # Ok(())
    /// # }
    /// ```
    /// Errors: those of [`Env::step`] except for [`ErrorKind::Physics`], which [`Env::recv`] returns;
    /// [`ErrorKind::Pending`] (a row is under way already).
    pub fn send<'a, A: Real>(&mut self, rows: impl Into<Rows<'a>>, actions: &[A]) -> Result<()> {
        let env = self.raw();
        let (rows, actions) = self.room.sent(rows.into(), actions)?;
        if rows.is_empty() {
            // To the library, null rows mean all rows, and the pointer of an empty slice means nothing.
            return check_length("action", actions.len(), 0);
        }
        let (count, actions, numbers) = (int64(rows.len()), actions.as_ptr().cast(), int64(actions.len()));
        // SAFETY: as in `step`.
        check(unsafe { sys::mjenv_send(env, rows.as_ptr(), count, actions, numbers, A::DTYPE) })
    }

    /// Waits until at least `least` of the rows that were sent have been stepped, or until `timeout` has passed. Writes
    /// the numbers of all rows that are done into `rows`, which it empties first, and their outputs into `out`, each at
    /// the row's own place. Each row is reported once. Errors: [`ErrorKind::NotPending`], [`ErrorKind::Size`] (fewer
    /// than `least` rows are under way, or `out` is of another environment), [`ErrorKind::Physics`] (MuJoCo failed in a
    /// row, for which [`Batch::failed`] returns true). If a row failed, `rows` and `out` are written all the same.
    pub fn recv<T: Real>(
        &mut self,
        least: usize,
        timeout: Option<Duration>,
        rows: &mut Vec<usize>,
        out: &mut Batch<T>,
    ) -> Result<()> {
        rows.clear();
        self.room.numbers.resize(self.rows, 0);
        // The library waits without limit for a negative time.
        let seconds = timeout.map_or(-1.0, |timeout| timeout.as_secs_f64());
        let (numbers, room, mut count, out) = (self.room.numbers.as_mut_ptr(), int64(self.rows), 0, out.raw());
        let result = call!(self.mjenv_recv(int64(least), seconds, numbers, room, &mut count, &out));
        rows.extend(self.room.numbers[..size(count)].iter().map(|&row| size(row)));
        result
    }

    /// Steps every row `steps` times from its present state. `actions` is `[rows][steps][action_space().count()]`, and
    /// `out` comes from [`Env::rollout_batch`]. A row whose episode ends stays there: for the steps that remain, its
    /// flags and its observation repeat, and its rewards and infos are 0. No row is reset. Errors: those of
    /// [`Env::step`].
    pub fn rollout<A: Real, T: Real>(&mut self, actions: &[A], steps: usize, out: &mut Batch<T>) -> Result<()> {
        let (actions, count, out) = (actions.as_ptr().cast(), int64(actions.len()), out.raw());
        call!(self.mjenv_rollout(actions, count, A::DTYPE, int64(steps), &out))
    }

    /// Writes the present observations of all rows, without a step, and the arrays that the option `arrays` names. The
    /// other outputs keep their values. Errors: [`ErrorKind::Size`], [`ErrorKind::Physics`].
    pub fn observe<T: Real>(&self, out: &mut Batch<T>) -> Result<()> {
        call!(self.mjenv_observe(&out.raw()))
    }

    /// Seeds the random stream of [`Env::sample_actions`], as Gymnasium's `action_space.seed(seed)` does. Errors:
    /// [`ErrorKind::Busy`].
    pub fn seed_actions(&mut self, seed: u64) -> Result<()> {
        call!(self.mjenv_seed_actions(seed))
    }

    /// Draws an action for each row, as Gymnasium's `action_space.sample()` does, and writes them into `actions`,
    /// `[rows][action_space().count()]`. All rows draw from one stream, one after the other. Errors:
    /// [`ErrorKind::Size`], [`ErrorKind::Model`] (an actuator has no bounds).
    pub fn sample_actions(&mut self, actions: &mut [f32]) -> Result<()> {
        call!(self.mjenv_sample_actions(actions.as_mut_ptr(), int64(actions.len())))
    }

    /// Reads an array of the row's mjData or of the mjModel by its MuJoCo name: `"xpos"`, `"body_mass"`, `"nq"`,
    /// `"opt.timestep"`. The values are those of Gymnasium's `env.unwrapped.data` after the last step, row-major.
    /// [`Env::fields`] lists the arrays with their shapes and units under [`Role::Data`] and [`Role::Model`]. Errors:
    /// [`ErrorKind::Name`], [`ErrorKind::Value`] (there is no such row), [`ErrorKind::Physics`].
    pub fn read(&self, row: usize, array: &str) -> Result<Vec<f64>> {
        let name = c_string(format_args!("array {array:?}"), array)?;
        let mut values = vec![0.0; self.read_raw(row, &name, &mut [])?];
        self.read_raw(row, &name, &mut values)?;
        Ok(values)
    }

    /// Does what [`Env::read`] does, and writes into the first elements of `values`. Returns how many it wrote. Errors:
    /// those of [`Env::read`], [`ErrorKind::Size`] (`values` is too short).
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
        let (to, room) = (values.as_mut_ptr(), int64(values.len()));
        call!(self.mjenv_read(int64(row), array.as_ptr(), to, room, &mut count))?;
        Ok(size(count))
    }

    /// Returns how many objects of a kind the model has. `kind` is its name in MJCF: `"body"`, `"joint"`, `"mesh"`,
    /// `"key"` and so on. The error for another name lists all. Errors: [`ErrorKind::Name`].
    pub fn object_count(&self, kind: &str) -> Result<usize> {
        let (kind, mut count) = (c_string(format_args!("type {kind:?}"), kind)?, 0);
        call!(self.mjenv_object_count(kind.as_ptr(), &mut count))?;
        Ok(size(count))
    }

    /// Returns the index of a named object; [`Env::object_count`] lists the kinds. Errors: [`ErrorKind::Name`] (the
    /// kind or the object).
    pub fn object_index(&self, kind: &str, name: &str) -> Result<usize> {
        let (kind, mut index) = (c_string(format_args!("type {kind:?}"), kind)?, 0);
        let name = c_string(format_args!("name {name:?}"), name)?;
        call!(self.mjenv_object_index(kind.as_ptr(), name.as_ptr(), &mut index))?;
        Ok(size(index))
    }

    /// Returns the name of an object; it is empty if the object has none. Errors: [`ErrorKind::Name`] (the kind),
    /// [`ErrorKind::Value`] (there is no such object).
    pub fn object_name(&self, kind: &str, index: usize) -> Result<Cow<'_, str>> {
        let (kind, mut name) = (c_string(format_args!("type {kind:?}"), kind)?, ptr::null());
        call!(self.mjenv_object_name(kind.as_ptr(), int64(index), &mut name))?;
        // SAFETY: the name belongs to the environment and never changes.
        Ok(unsafe { lossy(name) })
    }

    /// Sets the positions and velocities of a row, in MuJoCo's units, and computes what depends on them, as Gymnasium's
    /// `set_state` does. `qpos` has nq elements and `qvel` has nv. The step count does not change. Afterwards the row
    /// can be stepped, even if it was never reset or its episode had ended. Errors: [`ErrorKind::Value`] (there is no
    /// such row, or a number is NaN or infinite), [`ErrorKind::Size`], [`ErrorKind::Physics`].
    pub fn set_state(&mut self, row: usize, qpos: &[f64], qvel: &[f64]) -> Result<()> {
        let (nq, nv) = (int64(qpos.len()), int64(qvel.len()));
        call!(self.mjenv_set_state(int64(row), qpos.as_ptr(), nq, qvel.as_ptr(), nv))
    }

    /// Writes an array of the mjModel of the rows, or an input of their mjData, by its MuJoCo name: `"body_mass"`,
    /// `"geom_friction"`, `"opt.timestep"`, `"xfrc_applied"`. `values` has all elements of the array, as many as
    /// [`Env::read`] returns, and each of the rows gets these; or it has the elements of one row after the other. The
    /// effect is that of the same assignment in Gymnasium (`env.unwrapped.model.body_mass[:] = values`). Resets keep
    /// values of the mjModel, and clear the inputs. docs/c.md lists what can be written.
    ///
    /// ```
    /// # fn main() -> Result<(), mjenv::Error> {
    /// let mut env = mjenv::Env::new(&mjenv::Options::new("Hopper-v5")?, 3)?;
    /// let mut masses = env.read(1, "body_mass")?;
    /// masses[1] *= 1.5; // the torso of row 1
    /// env.write(1, "body_mass", &masses)?;
    /// env.write(.., "opt.timestep", &[0.002, 0.003, 0.004])?; // each row its own
    /// env.write(.., "opt.timestep", &[0.002])?;
    /// # assert_eq!(env.read(1, "body_mass")?[1], env.read(0, "body_mass")?[1] * 1.5);
    /// # Ok(())
    /// # }
    /// ```
    /// Errors: [`ErrorKind::Name`] (there is no such array, or it cannot be written), [`ErrorKind::Value`] (MuJoCo
    /// could not compute with a value), [`ErrorKind::Size`]; those of [`Rows`]. After an error nothing was written.
    pub fn write<'a>(&mut self, rows: impl Into<Rows<'a>>, array: &str, values: &[f64]) -> Result<()> {
        let rows = rows.into();
        let name = c_string(format_args!("array {array:?}"), array)?;
        if let Rows::One(row) = rows {
            return call!(self.mjenv_write_row(int64(row), name.as_ptr(), values.as_ptr(), int64(values.len())));
        }
        let mask = self.room.mask(rows)?;
        let mut all;
        let values = match (rows.list(), self.read_raw(0, &name, &mut [])?) {
            (Some(list), elements) if elements != values.len() => {
                all = vec![0.0; self.rows * elements];
                spread(&format!("array {array:?}"), list, values, &mut all, self.rows)?
            }
            _ => values,
        };
        call!(self.mjenv_write(mask, name.as_ptr(), values.as_ptr(), int64(values.len())))
    }

    /// Calls mj_setConst for the rows: MuJoCo computes again what it computes from masses, sizes and `qpos0` when it
    /// compiles a model, for instance `body_subtreemass` and `dof_invweight0`. The rows end in the position
    /// `qpos_spring`, for which mj_setConst computes last: reset them, or set their state. Errors:
    /// [`ErrorKind::Physics`], [`ErrorKind::Model`] (it would change what all rows share); those of [`Rows`].
    pub fn set_constants<'a>(&mut self, rows: impl Into<Rows<'a>>) -> Result<()> {
        let rows = rows.into();
        if let Rows::One(row) = rows {
            return call!(self.mjenv_set_constants_row(int64(row)));
        }
        let mask = self.room.mask(rows)?;
        call!(self.mjenv_set_constants(mask))
    }

    /// Advances the simulation of a row by `frames` steps of MuJoCo (mj_step) with the controls `ctrl`, a number for
    /// each actuator, as Gymnasium's `do_simulation` does. This is not a step of the episode and gives no reward.
    /// Errors: [`ErrorKind::Value`] (there is no such row, or `frames` is 0), [`ErrorKind::Size`],
    /// [`ErrorKind::Physics`].
    pub fn simulate(&mut self, row: usize, ctrl: &[f64], frames: usize) -> Result<()> {
        call!(self.mjenv_simulate(int64(row), ctrl.as_ptr(), int64(ctrl.len()), int64(frames)))
    }

    /// Copies the row `from` into the rows `to`: simulation, random stream, counters and written arrays. Errors:
    /// [`ErrorKind::Value`] (there is no row `from`); those of [`Rows`].
    pub fn copy_row<'a>(&mut self, from: usize, to: impl Into<Rows<'a>>) -> Result<()> {
        let mask = self.room.mask(to.into())?;
        call!(self.mjenv_copy_row(mask, int64(from)))
    }

    /// Saves one row or all rows as bytes, called an image: simulation, random stream, counters and written arrays.
    /// [`Env::restore`] continues from it. Errors: [`ErrorKind::Argument`] (`rows` is a list or a mask),
    /// [`ErrorKind::Value`] (there is no such row).
    pub fn snapshot<'a>(&self, rows: impl Into<Rows<'a>>) -> Result<Vec<u8>> {
        let (row, mut bytes) = (one_or_all(rows.into())?, 0);
        call!(self.mjenv_snapshot(row, ptr::null_mut(), 0, &mut bytes))?;
        let mut image = vec![0u8; size(bytes)];
        call!(self.mjenv_snapshot(row, image.as_mut_ptr().cast(), bytes, &mut bytes))?;
        Ok(image)
    }

    /// Sets one row or all rows to the state that [`Env::snapshot`] saved. They continue with the same bits, also in
    /// another process and with another number of threads. The environment must have the same id, model and options as
    /// the one that was saved, except for options such as `num_threads` and `arrays` (docs/rows.md lists them), and the
    /// image must hold as many rows. Errors: [`ErrorKind::Argument`] (`rows` is a list or a mask), [`ErrorKind::Value`]
    /// (there is no such row), [`ErrorKind::Snapshot`].
    pub fn restore<'a>(&mut self, rows: impl Into<Rows<'a>>, image: &[u8]) -> Result<()> {
        call!(self.mjenv_restore(one_or_all(rows.into())?, image.as_ptr().cast(), int64(image.len())))
    }
}

/// Returns the row as the library takes it.
fn one_or_all(rows: Rows<'_>) -> Result<i64> {
    match rows {
        Rows::All => Ok(sys::MJENV_ALL_ROWS.into()),
        Rows::One(row) => Ok(int64(row)),
        _ => Err(Error::new(ErrorKind::Argument, "an image holds one row or all rows, not some".to_string())),
    }
}

owned! { Env: mjenv_env, mjenv_destroy; }

impl fmt::Debug for Env {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.debug_struct("Env").field("rows", &self.rows).field("options", self.options()).finish()
    }
}
