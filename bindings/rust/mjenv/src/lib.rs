//! Gymnasium's MuJoCo environments (v4 and v5 of eleven robots) in native code, without a Python process.
//! For the same seed and actions, every output equals that of Gymnasium 1.4.0 on MuJoCo 2.2.2, bit for bit; with the
//! feature `mujoco4`, that of Gymnasium 1.4.0 on MuJoCo 4.0.
//!
//! ```
//! use mjenv::{Env, Options};
//!
//! fn main() -> Result<(), mjenv::Error> {
//!     let mut options = Options::new("Ant-v5")?;
//!     options.set("ctrl_cost_weight", 0.1)?.set("healthy_z_range", [0.3, 1.0])?;
//!     let mut env = Env::new(&options, 1)?;
//!     let mut batch = env.batch::<f64>();
//!     let mut action = vec![0.0f32; env.action_space().count()];
//!
//!     env.seed(.., &[42])?;
//!     env.seed_actions(42)?;
//!     env.reset(.., &mut batch)?;
//!     let mut total = 0.0;
//!     while !batch.ended(0) {
//!         env.sample_actions(&mut action)?;
//!         env.step(.., &action, &mut batch)?;
//!         total += batch.reward()[0];
//!     }
//!     println!("return {total}, last at x = {}", batch.info("x_position")?[0]);
//!     Ok(())
//! }
//! ```
//!
//! An [`Env`] holds one or many rows. A row is an episode; rows do not influence each other. [`Env::reset`] and
//! [`Env::step`] write their results into a [`Batch`], which you allocate once and reuse. To learn which ids, options,
//! fields and spaces there are, call [`ids`], [`Options::schema`], [`Env::fields`], [`Env::observation_space`] and
//! [`Env::action_space`].
//!
//! A robot and a task of your own are a type that implements [`task::Task`]; see the module [`task`].
//!
//! The crate `mjenv-ndarray` shows a batch as arrays of ndarray.
//!
//! # Errors
//!
//! A call that fails returns an [`Error`]. Its [`kind`](Error::kind) is for programs; its message is for people and
//! names the wrong argument and the valid choices. The outputs keep their values, and the environment stays usable.
//! Where this differs, the function says so.
//!
//! Every function may also return [`ErrorKind::Memory`]. Functions that need the environment's threads return
//! [`ErrorKind::Forked`] in a forked child process, because a fork does not copy threads.
//!
//! # Threads
//!
//! An [`Env`] is [`Send`] and not [`Sync`]: you may move it to another thread, and the compiler prevents that two
//! threads use it at the same time. Different environments run in parallel. [`Options`] are both: several threads may
//! build environments from the same ones.
//!
//! The library calls no code of yours, except for tasks that you register ([`task`]); it runs these on several threads at
//! the same time. A panic does not unwind through the library, and no C++ exception leaves it.
//!
//! # Linking
//!
//! The build script looks for `libmjenv.so` in the folder that the environment variable `MJENV_LIB_DIR` names, then
//! asks pkg-config for `mjenv`. If both fail it builds the library with CMake. docs/start/rust.md says how programs find
//! the library that Cargo does not start, and what the feature `mujoco4` needs. With it, the library is
//! `libmjenv-mujoco4.so`, which has the same interface and refuses snapshots of the other.
//!
//! Without the feature `library`, which is on by default, the crate has only the modules [`task`] and [`numpy`], and
//! neither needs nor links `libmjenv.so`. Plug-ins use it in this way.

#![warn(missing_docs, missing_debug_implementations, unsafe_op_in_unsafe_fn)]

/// Defines public methods that are one expression: `name(arguments) -> type { value }`, for `self` or `mut self`.
macro_rules! methods {
    (mut $this:ident; $($(#[$doc:meta])* $name:ident($($argument:ident: $of:ty),*) -> $type:ty { $value:expr })*) => {$(
        $(#[$doc])*
        pub fn $name(&mut $this $(, $argument: $of)*) -> $type {
            $value
        }
    )*};
    ($this:ident; $($(#[$doc:meta])* $name:ident($($argument:ident: $of:ty),*) -> $type:ty { $value:expr })*) => {$(
        $(#[$doc])*
        pub fn $name(&$this $(, $argument: $of)*) -> $type {
            $value
        }
    )*};
}

#[cfg(feature = "library")]
mod batch;
#[cfg_attr(not(feature = "library"), allow(dead_code))]
mod describe;
#[cfg(feature = "library")]
mod env;
#[cfg(feature = "library")]
mod error;
#[cfg(all(doctest, feature = "library"))]
mod misuse;
pub mod numpy;
#[cfg(feature = "library")]
mod options;
#[cfg(feature = "library")]
mod randomization;
#[cfg(feature = "library")]
mod registration;
#[cfg(feature = "library")]
mod render;
#[cfg(feature = "library")]
mod rows;
#[cfg(feature = "library")]
mod spec;
pub mod task;
#[cfg_attr(not(feature = "library"), allow(dead_code))]
mod text;

#[cfg(feature = "library")]
pub use {
    batch::{Batch, Real},
    describe::{Field, Role, Space},
    env::{Computed, Env, Lanes, Seed},
    error::{Error, ErrorKind, Result},
    options::{Kind, OptionInfo, Options, Value},
    registration::{load_tasks, register},
    render::{Camera, Frame, Gl, Image, Label, RenderSettings, Renderer, Window},
    rows::Rows,
    spec::{ids, spec, version, Spec},
};

pub use describe::Dtype;
