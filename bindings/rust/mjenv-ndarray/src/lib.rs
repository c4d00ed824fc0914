//! Shows the outputs of [`mjenv`] as arrays of [`ndarray`], and takes actions from such arrays. Nothing is copied: the
//! arrays are views of the batch. Row `i` of an array belongs to row `i` of the environment.
//!
//! ```
//! use mjenv::{Env, Options};
//! use mjenv_ndarray::{BatchArrays, EnvArrays};
//! use ndarray::{Array2, Axis};
//!
//! fn main() -> Result<(), mjenv::Error> {
//!     let mut env = Env::new(&Options::new("HalfCheetah-v5")?, 16)?;
//!     let mut batch = env.batch::<f64>();
//!     env.reset(.., &mut batch)?;
//!     let weights = Array2::<f64>::from_elem((17, 6), 0.01);
//!     for _ in 0..100 {
//!         let actions = batch.obs_array().dot(&weights).mapv(f64::tanh);
//!         env.step_array(.., actions.view(), &mut batch)?;
//!     }
//!     println!("mean x = {}", batch.info_array("x_position")?.mean_axis(Axis(0)).unwrap());
//!     Ok(())
//! }
//! ```

#![warn(missing_docs)]

use mjenv::{Batch, Env, Error, Real, Rows};
use ndarray::{ArrayView1, ArrayView2};

/// Shows a batch as arrays.
pub trait BatchArrays<T> {
    /// Returns the observations, of shape `[rows, observation_space().count()]`.
    fn obs_array(&self) -> ArrayView2<'_, T>;

    /// Returns the rewards, of shape `[rows]`.
    fn reward_array(&self) -> ArrayView1<'_, f64>;

    /// Returns an info of the last step, of shape `[rows, count]`. Most infos have a `count` of 1. Errors:
    /// [`mjenv::ErrorKind::Name`].
    fn info_array(&self, name: &str) -> Result<ArrayView2<'_, f64>, Error>;

    /// Returns an info of the last reset of each row, of shape `[rows, count]`. Errors: [`mjenv::ErrorKind::Name`].
    fn reset_info_array(&self, name: &str) -> Result<ArrayView2<'_, f64>, Error>;

    /// Returns an mjData array that the option `arrays` names, of shape `[rows, count]`. Errors:
    /// [`mjenv::ErrorKind::Name`].
    fn data_array(&self, name: &str) -> Result<ArrayView2<'_, f64>, Error>;
}

impl<T: Real> BatchArrays<T> for Batch<T> {
    fn obs_array(&self) -> ArrayView2<'_, T> {
        of_rows(self.rows(), self.observations())
    }

    fn reward_array(&self) -> ArrayView1<'_, f64> {
        self.reward().into()
    }

    fn info_array(&self, name: &str) -> Result<ArrayView2<'_, f64>, Error> {
        Ok(of_rows(self.rows(), self.info(name)?))
    }

    fn reset_info_array(&self, name: &str) -> Result<ArrayView2<'_, f64>, Error> {
        Ok(of_rows(self.rows(), self.reset_info(name)?))
    }

    fn data_array(&self, name: &str) -> Result<ArrayView2<'_, f64>, Error> {
        Ok(of_rows(self.rows(), self.array(name)?))
    }
}

/// Lets an environment take arrays.
pub trait EnvArrays {
    /// Calls [`Env::step`] with `actions` of shape `[rows, action_space().count()]`; for a row or a list of rows, it
    /// has as many rows as these. They are copied only if they are not contiguous and row-major. Errors: those of
    /// [`Env::step`]. Panics if the actions have another number of columns.
    fn step_array<'a, A: Real, T: Real>(
        &mut self,
        rows: impl Into<Rows<'a>>,
        actions: ArrayView2<'_, A>,
        out: &mut Batch<T>,
    ) -> Result<(), Error>;
}

impl EnvArrays for Env {
    fn step_array<'a, A: Real, T: Real>(
        &mut self,
        rows: impl Into<Rows<'a>>,
        actions: ArrayView2<'_, A>,
        out: &mut Batch<T>,
    ) -> Result<(), Error> {
        assert_eq!(actions.ncols(), self.action_space().count(), "the columns of the actions");
        match actions.as_slice() {
            Some(slice) => self.step(rows, slice, out),
            None => self.step(rows, &actions.iter().copied().collect::<Vec<A>>(), out),
        }
    }
}

fn of_rows<T>(rows: usize, values: &[T]) -> ArrayView2<'_, T> {
    let count = values.len().checked_div(rows).unwrap_or(0);
    ArrayView2::from_shape((rows, count), values).expect("a batch holds the same for each row")
}

#[cfg(test)]
mod tests {
    use mjenv::Options;
    use ndarray::{Array2, ShapeBuilder};

    use super::*;

    fn ant() -> (Env, Batch) {
        let mut options = Options::new("Ant-v5").unwrap();
        options.set("arrays", "xpos").unwrap();
        let mut env = Env::new(&options, 3).unwrap();
        let mut batch = env.batch::<f64>();
        env.seed(.., &[1, 2, 3]).unwrap();
        env.reset(.., &mut batch).unwrap();
        (env, batch)
    }

    #[test]
    fn views_show_the_batch() {
        let (mut env, mut batch) = ant();
        assert_eq!(batch.reset_info_array("x_position").unwrap().dim(), (3, 1));
        env.step(.., &[0.5f32; 24], &mut batch).unwrap();
        assert_eq!(batch.obs_array().dim(), (3, 105));
        for row in 0..3 {
            assert_eq!(batch.obs_array().row(row).as_slice().unwrap(), batch.obs(row));
        }
        assert_eq!(batch.reward_array().as_slice().unwrap(), batch.reward());
        assert_eq!(batch.info_array("x_position").unwrap().column(0).to_vec(), batch.info("x_position").unwrap());
        assert_eq!(batch.data_array("xpos").unwrap().dim(), (3, 3 * 14));
        assert!(batch.info_array("no_such").unwrap_err().message().contains("x_position"));
    }

    #[test]
    fn actions_of_any_layout() {
        let action = |(row, i): (usize, usize)| (row as f64 - 1.0) * 0.1 + i as f64 * 0.05;
        let dense = Array2::from_shape_fn((3, 8), action);
        let columns = Array2::from_shape_fn((3, 8).f(), action);
        let (mut env, mut batch) = ant();
        let (mut other, mut same) = ant();
        for _ in 0..5 {
            env.step_array(.., dense.view(), &mut batch).unwrap();
            other.step_array(.., columns.view(), &mut same).unwrap();
            assert_eq!(batch.observations(), same.observations());
        }
        env.step_array(&[2, 0], columns.select(ndarray::Axis(0), &[2, 0]).view(), &mut batch).unwrap();
        other.step_array(&[true, false, true], dense.view(), &mut same).unwrap();
        assert_eq!(batch.observations(), same.observations());
        let short = env.step_array(.., dense.slice(ndarray::s![..2, ..]), &mut batch);
        assert_eq!(short.unwrap_err().kind(), mjenv::ErrorKind::Size);
    }

    #[test]
    fn a_rollout_of_no_steps() {
        let (env, _) = ant();
        let none = env.rollout_batch::<f64>(0);
        assert_eq!(none.obs_array().len(), 0);
        assert_eq!(none.info_array("x_position").unwrap().len(), 0);
    }

    #[test]
    #[should_panic(expected = "the columns of the actions")]
    fn another_number_of_columns() {
        let (mut env, mut batch) = ant();
        let _ = env.step_array(.., Array2::<f64>::zeros((8, 3)).view(), &mut batch);
    }
}
