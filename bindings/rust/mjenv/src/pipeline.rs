use std::fmt;
use std::os::raw::c_void;

use mjenv_sys as sys;

use crate::batch::Record;
use crate::describe::{int64, size};
use crate::error::{check, Error, ErrorKind, Result};
use crate::{Batch, Env, Real};

/// Steps in two halves, so that rows are simulated while the caller computes: [`Pipeline::send`] returns at once,
/// [`Pipeline::recv`] waits for the first rows that are done.
///
/// ```
/// # fn main() -> Result<(), mjenv::Error> {
/// let mut options = mjenv::Options::new("Reacher-v5")?;
/// options.set("num_threads", 2)?.set("autoreset_mode", "next_step")?;
/// let mut pipeline = mjenv::Env::new(&options, 8)?.pipeline();
/// pipeline.reset()?;
/// pipeline.send(&[0.0f32; 8 * 2])?;
/// for _ in 0..100 {
///     let rows = pipeline.recv(4)?.to_vec();
///     let actions: Vec<_> = rows.iter().flat_map(|&row| [pipeline.row(row).unwrap().obs()[0], 0.0]).collect();
///     pipeline.send_rows(&rows, &actions)?;
/// }
/// let (env, batch) = pipeline.finish();
/// assert_eq!(env.rows(), batch.rows());
/// # Ok(())
/// # }
/// ```
///
/// It owns the environment and the outputs, because the library's threads write these until the rows are received.
/// Dropped, it waits for them.
pub struct Pipeline<T: Real = f64> {
    env: Env, // dropped before the batch that its threads write
    batch: Batch<T>,
    under_way: Vec<bool>,
    count: usize,
    raw_rows: Vec<i64>,
    received: Vec<usize>,
}

impl<T: Real> Pipeline<T> {
    pub(crate) fn new(env: Env, batch: Batch<T>) -> Self {
        let rows = env.rows();
        assert_eq!(rows, batch.rows());
        Self {
            env,
            batch,
            under_way: vec![false; rows],
            count: 0,
            raw_rows: vec![0; rows],
            received: Vec::with_capacity(rows),
        }
    }

    /// The number of rows.
    pub fn rows(&self) -> usize {
        self.under_way.len()
    }

    /// How many rows are under way: sent, and not yet received.
    pub fn under_way(&self) -> usize {
        self.count
    }

    /// As [`Env::reset`], into the outputs. Errors: those of it, [`ErrorKind::State`] (rows are under way).
    pub fn reset(&mut self) -> Result<()> {
        self.env.reset(&mut self.batch)
    }

    /// As [`Env::reset_where`], into the outputs. Errors: those of it, [`ErrorKind::State`] (rows are under way).
    pub fn reset_where(&mut self, mask: &[bool]) -> Result<()> {
        self.env.reset_where(mask, &mut self.batch)
    }

    /// Begins a step of every row: actions `[rows][action_space().count()]`, which are copied. Errors: those of
    /// [`Env::step`] but for [`ErrorKind::Physics`], which [`Pipeline::recv`] tells; [`ErrorKind::State`] (a row is under way).
    pub fn send<A: Real>(&mut self, actions: &[A]) -> Result<()> {
        self.send_raw(None, actions)?;
        self.under_way.fill(true);
        self.count = self.rows();
        Ok(())
    }

    /// Begins a step of some rows: actions `[rows.len()][action_space().count()]`. Errors: those of [`Pipeline::send`],
    /// [`ErrorKind::Value`] (row), [`ErrorKind::Size`].
    pub fn send_rows<A: Real>(&mut self, rows: &[usize], actions: &[A]) -> Result<()> {
        if rows.len() > self.rows() {
            let message = format!("{} rows were given, of {}", rows.len(), self.rows());
            return Err(Error::new(ErrorKind::Size, message));
        }
        self.raw_rows.iter_mut().zip(rows).for_each(|(raw, &row)| *raw = int64(row));
        self.send_raw(Some(rows.len()), actions)?;
        rows.iter().for_each(|&row| self.under_way[row] = true);
        self.count += rows.len();
        Ok(())
    }

    /// Sends the first `count` of raw_rows, or all rows.
    fn send_raw<A: Real>(&mut self, count: Option<usize>, actions: &[A]) -> Result<()> {
        let rows = count.map_or(std::ptr::null(), |_| self.raw_rows.as_ptr());
        let (action, env) = (actions.as_ptr() as *const c_void, self.env.raw());
        // SAFETY: rows and actions hold as many elements as are told, and are copied. The arrays of the batch have the
        // sizes that it tells. The library's threads write a row of them until it is received: until then `row` gives no
        // reference into it, and the batch outlives the environment, whose drop waits for the threads.
        check(unsafe { sys::mjenv_send(env, rows, count.unwrap_or(0), action, actions.len(), A::DTYPE) })
    }

    /// Waits until at least `least` rows have been stepped, and tells the numbers of all that have. Errors:
    /// [`ErrorKind::State`] (nothing is under way), [`ErrorKind::Size`] (fewer are under way), [`ErrorKind::Physics`] (MuJoCo
    /// failed in rows, which [`Row::failed`] tells; [`Pipeline::received`] has the numbers).
    pub fn recv(&mut self, least: usize) -> Result<&[usize]> {
        let (rows, room, mut count) = (self.raw_rows.as_mut_ptr(), self.raw_rows.len(), 0);
        let out = self.batch.raw();
        // SAFETY: there is as much room as is told.
        let status = unsafe { sys::mjenv_recv(self.env.raw(), least, -1.0, rows, room, &mut count, &out) };
        let result = check(status);
        // A failure in a row, for want of memory, too, is told as the rows are; any other tells none.
        if status == sys::MJENV_OK || count > 0 {
            self.received.clear();
            self.received.extend(self.raw_rows[..count].iter().map(|&row| size(row)));
            self.received.iter().for_each(|&row| self.under_way[row] = false);
            self.count -= count;
        }
        result.map(|()| &self.received[..])
    }

    /// The rows that the last [`Pipeline::recv`] told.
    pub fn received(&self) -> &[usize] {
        &self.received
    }

    /// The outputs of a row; `None` while it is under way.
    ///
    /// # Panics
    /// If there is no such row.
    pub fn row(&self, row: usize) -> Option<Row<'_, T>> {
        let settled = !self.under_way[row];
        settled.then_some(Row { batch: &self.batch, row })
    }

    /// Waits for the rows under way, and gives the environment and its outputs back. Where MuJoCo failed,
    /// [`Batch::failed`] tells.
    pub fn finish(mut self) -> (Env, Batch<T>) {
        while self.count > 0 {
            match self.recv(self.count) {
                // A renderer on another thread is inside, if only to be told that rows are under way.
                Err(error) if error.kind() == ErrorKind::Busy => std::thread::yield_now(),
                // Only MuJoCo can fail here; or the threads were left behind by a fork, and will never write.
                _ => break,
            }
        }
        (self.env, self.batch)
    }
}

impl<T: Real> fmt::Debug for Pipeline<T> {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.debug_struct("Pipeline").field("env", &self.env).field("under_way", &self.count).finish()
    }
}

/// The outputs of one row of a [`Pipeline`], while others may be under way.
#[derive(Clone, Copy)]
pub struct Row<'a, T: Real> {
    batch: &'a Batch<T>,
    row: usize,
}

impl<'a, T: Real> Row<'a, T> {
    /// The observation.
    pub fn obs(&self) -> &'a [T] {
        self.part(&self.batch.obs, 0, self.batch.obs_count)
    }

    /// The reward.
    pub fn reward(&self) -> f64 {
        self.one(&self.batch.reward)
    }

    /// Whether the row has reached a terminal state.
    pub fn terminated(&self) -> bool {
        self.one(&self.batch.terminated)
    }

    /// Whether the row has reached its step limit.
    pub fn truncated(&self) -> bool {
        self.one(&self.batch.truncated)
    }

    /// Whether the episode is over: terminated or truncated.
    pub fn ended(&self) -> bool {
        self.terminated() || self.truncated()
    }

    /// Whether the step failed: MuJoCo reported an error, or found the state diverged and restarted it.
    pub fn failed(&self) -> bool {
        self.one(&self.batch.status) != sys::MJENV_OK
    }

    /// Whether the step began an episode.
    pub fn was_reset(&self) -> bool {
        self.one(&self.batch.was_reset)
    }

    /// An info of the step; 0 where the step reset the row. Errors: [`ErrorKind::Name`].
    pub fn info(&self, name: &str) -> Result<&'a [f64]> {
        self.field(&self.batch.info, "info", name)
    }

    /// An info of the row's last reset. Errors: [`ErrorKind::Name`].
    pub fn reset_info(&self, name: &str) -> Result<&'a [f64]> {
        self.field(&self.batch.reset_info, "reset info", name)
    }

    /// The last observation of the episode that the step has ended and reset: see [`Batch::final_obs`].
    pub fn final_obs(&self) -> Option<&'a [T]> {
        let last = self.batch.last.as_ref()?;
        (self.was_reset() && self.ended()).then(|| self.part(&last.obs, 0, self.batch.obs_count))
    }

    /// An info of the last step of that episode: see [`Batch::final_info`]. Errors: [`ErrorKind::Name`],
    /// [`ErrorKind::State`] (another autoreset_mode).
    pub fn final_info(&self, name: &str) -> Result<&'a [f64]> {
        self.field(&self.batch.last()?.info, "final info", name)
    }

    /// An mjData array that the option `arrays` names. Errors: [`ErrorKind::Name`].
    pub fn array(&self, name: &str) -> Result<&'a [f64]> {
        self.field(&self.batch.arrays, "exported array", name)
    }

    fn field(&self, record: &'a Record, what: &str, name: &str) -> Result<&'a [f64]> {
        let field = record.named(what, name)?;
        Ok(self.part(&record.values, field.offset * record.rows, field.count))
    }

    /// This row's `count` elements of an array that begins at `start`, and no reference to those of others: threads
    /// may be writing them.
    #[allow(clippy::ptr_arg)] // a slice would be a reference to all rows
    fn part<U>(&self, array: &'a Vec<U>, start: usize, count: usize) -> &'a [U] {
        assert!(start + (self.row + 1) * count <= array.len());
        // SAFETY: within the array, as asserted; this row is not under way as long as the pipeline is borrowed.
        unsafe { std::slice::from_raw_parts(array.as_ptr().add(start + self.row * count), count) }
    }

    fn one<U: Copy>(&self, array: &'a Vec<U>) -> U {
        self.part(array, 0, 1)[0]
    }
}

impl<T: Real> fmt::Debug for Row<'_, T> {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.debug_struct("Row").field("row", &self.row).finish()
    }
}
