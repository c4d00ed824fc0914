//! Gymnasium's MuJoCo environments (v4 and v5 of eleven robots) in native code, without a Python process.
//! For the same seed and actions, every output equals that of Gymnasium 1.3.0 on MuJoCo 2.2.2, bit for bit.
//!
//! ```
//! use mjenv::{Env, Options};
//!
//! fn main() -> Result<(), mjenv::Error> {
//!     let mut options = Options::new("Ant-v5")?;
//!     options.set("ctrl_cost_weight", 0.1)?.set("healthy_z_range", [0.3, 1.0])?;
//!     let mut env = Env::new(&options, 1)?;
//!     let mut batch = env.batch();
//!     let mut action = vec![0.0f32; env.action_space().count()];
//!
//!     env.seed(&[42])?;
//!     env.seed_actions(42)?;
//!     env.reset(&mut batch)?;
//!     let mut total = 0.0;
//!     while !batch.ended(0) {
//!         env.sample_actions(&mut action)?;
//!         env.step(&action, &mut batch)?;
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
//! The library never calls code of yours, so a panic cannot unwind through it. No C++ exception leaves it.
//!
//! # Linking
//!
//! The build script looks for `libmjenv.so` in the folder that the environment variable `MJENV_LIB_DIR` names, then
//! asks pkg-config for `mjenv`. If both fail it builds the library with CMake, which needs a C++17 compiler and takes a
//! few minutes. Cargo tells the programs that it starts where the library is. A program that you start in another way
//! finds the library if the `main` of its own `build.rs` contains this line:
//!
//! ```no_run
//! println!("cargo:rustc-link-arg=-Wl,-rpath,{}", std::env::var("DEP_MJENV_RUST_LIBDIR").unwrap());
//! ```

#![warn(missing_docs, missing_debug_implementations, unsafe_op_in_unsafe_fn)]

mod batch;
mod describe;
mod env;
mod error;
#[cfg(doctest)]
mod misuse;
mod options;
mod render;
mod text;

pub use batch::{Batch, Real};
pub use describe::{Dtype, Field, Role, Space, ValueType};
pub use env::Env;
pub use error::{Error, ErrorKind, Result};
pub use options::{Kind, OptionInfo, Options, Value};
pub use render::{Camera, Gl, Image, RenderSettings, Renderer, Window};

use mjenv_sys as sys;

/// Returns the versions of the library and of MuJoCo: `"major.minor.patch (MuJoCo x.y.z)"`.
pub fn version() -> &'static str {
    // SAFETY: the text is static.
    unsafe { text::borrowed(sys::mjenv_version()) }
}

/// Returns the ids of all environments, sorted.
pub fn ids() -> impl ExactSizeIterator<Item = &'static str> {
    // SAFETY: the function takes nothing.
    let count = describe::size(unsafe { sys::mjenv_id_count() });
    // SAFETY: the index is in range, so the result is a static text.
    (0..count).map(|index| unsafe { text::borrowed(sys::mjenv_id_at(index as i64)) })
}

/// What Gymnasium registers for an id.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Spec {
    /// The id, for example `"Ant-v5"`.
    pub id: &'static str,
    /// The id without its version: `"Ant"`.
    pub robot: &'static str,
    /// The version of the task: 4 or 5.
    pub version: i32,
    /// After this many steps an episode is truncated. It is the default of the option `max_episode_steps`.
    pub max_episode_steps: i64,
    /// The return at which Gymnasium counts the task as solved; `None` where Gymnasium states none.
    pub reward_threshold: Option<f64>,
}

/// Returns what Gymnasium registers for an id. Errors: [`ErrorKind::Name`] (there is no such id).
pub fn spec(id: &str) -> Result<Spec> {
    error::check_abi()?;
    let id = text::c_string(format_args!("id {id:?}"), id)?;
    let mut raw = sys::mjenv_spec { struct_size: describe::size_of::<sys::mjenv_spec>(), ..Default::default() };
    // SAFETY: both pointers are valid for the call.
    error::check(unsafe { sys::mjenv_spec_of(id.as_ptr(), &mut raw) })?;
    // SAFETY: the texts belong to no handle and are static.
    let (id, robot) = unsafe { (text::borrowed(raw.id), text::borrowed(raw.robot)) };
    Ok(Spec {
        id,
        robot,
        version: raw.version,
        max_episode_steps: raw.max_episode_steps,
        reward_threshold: Some(raw.reward_threshold).filter(|threshold| !threshold.is_nan()),
    })
}
