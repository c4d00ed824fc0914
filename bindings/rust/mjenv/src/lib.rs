//! Gymnasium's MuJoCo environments (v4 and v5 of eleven robots) in native code, without a Python process.
//! For a seed and a list of actions every output equals Gymnasium 1.3.0 on MuJoCo 2.2.2, bit for bit.
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
//! An [`Env`] holds one or many independent rows, each an episode of its own; a single environment is one row. What
//! [`Env::reset`] and [`Env::step`] compute goes into a [`Batch`], which is allocated once and used again and again.
//! Ids, options, fields and spaces are learned from the library at run time: [`ids`], [`Options::schema`],
//! [`Env::fields`].
//!
//! The crate `mjenv-ndarray` shows a batch as arrays of ndarray.
//!
//! # Errors
//!
//! A call that fails returns an [`Error`], whose message names the culprit and the valid choices. It leaves the outputs
//! untouched and the environment usable.
//!
//! # Threads
//!
//! An [`Env`] may move to another thread, and different environments run in parallel. One environment serves one
//! thread at a time, which the compiler enforces: it is [`Send`], not [`Sync`].
//!
//! The library calls nothing of its user's, so no panic can pass through it, and no C++ exception leaves it.
//!
//! # Linking
//!
//! `libmjenv.so` is taken from the folder in the environment variable `MJENV_LIB_DIR`, else from pkg-config's `mjenv`,
//! else it is built with CMake, which needs a C++17 compiler and a few minutes. A program that is started other than by
//! cargo must find it too; with this line in the `main` of its own `build.rs` it does:
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
mod pipeline;
mod render;
mod text;

pub use batch::{Batch, Real};
pub use describe::{Dtype, Field, Role, Space, ValueType};
pub use env::Env;
pub use error::{Error, ErrorKind, Result};
pub use options::{Kind, OptionInfo, Options, Value};
pub use pipeline::{Pipeline, Row};
pub use render::{Camera, Gl, Image, RenderSettings, Renderer, Window};

use mjenv_sys as sys;

/// The version of the library and of MuJoCo: `"major.minor.patch (MuJoCo x.y.z)"`.
pub fn version() -> &'static str {
    // SAFETY: the text is static.
    unsafe { text::borrowed(sys::mjenv_version()) }
}

/// The environment ids, sorted.
pub fn ids() -> impl ExactSizeIterator<Item = &'static str> {
    // SAFETY: the function takes nothing.
    let count = describe::size(unsafe { sys::mjenv_id_count() });
    // SAFETY: the index is in range, so the result is a static text.
    (0..count).map(|index| unsafe { text::borrowed(sys::mjenv_id_at(index as i64)) })
}

/// What an id promises before anything is built.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Spec {
    /// The id, `"Ant-v5"` for instance.
    pub id: &'static str,
    /// The id without its version: `"Ant"`.
    pub robot: &'static str,
    /// 4 or 5.
    pub version: i32,
    /// Steps after which an episode is truncated, unless the option `max_episode_steps` says otherwise.
    pub max_episode_steps: i64,
    /// The return at which the task counts as solved; `None` where Gymnasium has none.
    pub reward_threshold: Option<f64>,
}

/// What an id promises. Errors: [`ErrorKind::Name`].
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
