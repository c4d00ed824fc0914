//! Your own robots and tasks, which then work like the built-in ones.
//!
//! A type that implements [`Task`] describes a robot and its task. [`mjenv::register`](crate::register) makes its id
//! known to this program; [`plugin!`](crate::plugin) makes it known to any program, in any language.
//!
//! ```
//! use mjenv::task::*;
//!
//! /// A pole that hangs from a cart has to be swung up.
//! struct Swingup {
//!     ctrl_cost_weight: f64,
//!     noise: f64,
//!     tip: usize,
//!     hinge: Joint,
//! }
//!
//! impl Task for Swingup {
//!     const ID: &'static str = "Swingup-v0";
//!     const MODEL: Model = Model::Text(
//!         r#"<mujoco>
//!              <worldbody>
//!                <body>
//!                  <joint name="slide" type="slide" axis="1 0 0"/>
//!                  <geom type="box" size="0.15 0.1 0.07" mass="1"/>
//!                  <body>
//!                    <joint name="hinge" axis="0 1 0"/>
//!                    <geom type="capsule" fromto="0 0 0 0 0 0.6" size="0.03" mass="0.1"/>
//!                    <site name="tip" pos="0 0 0.6"/>
//!                  </body>
//!                </body>
//!              </worldbody>
//!              <actuator><motor joint="slide" gear="10" ctrllimited="true" ctrlrange="-1 1"/></actuator>
//!            </mujoco>"#,
//!     );
//!     const FRAME_SKIP: u32 = 5;
//!     const TIME_LIMIT: u64 = 500;
//!
//!     fn build(b: &mut Builder) -> Result<Self> {
//!         Ok(Self {
//!             ctrl_cost_weight: b.real("ctrl_cost_weight", 0.01, "weight of the squared action"),
//!             noise: b.noise(0.05),
//!             tip: b.site("tip"),
//!             hinge: b.joint("hinge"),
//!         })
//!     }
//!
//!     fn reset(&self, start: &mut Start, rng: &mut Rng) -> Result {
//!         start.qpos[self.hinge.qpos] = std::f64::consts::PI + rng.uniform(-self.noise, self.noise);
//!         Ok(())
//!     }
//!
//!     fn observe(&self, sim: &Sim, observation: &mut Fields) -> Result {
//!         let angle = sim.qpos()[self.hinge.qpos];
//!         observation.put("cart", sim.qpos()[0]).doc("position of the cart, m");
//!         observation.put_all("pole", [angle.cos(), angle.sin()]);
//!         observation.put_all("qvel", sim.qvel());
//!         Ok(())
//!     }
//!
//!     fn step(&self, sim: &Sim, _: &mut Row, info: &mut Fields) -> Result<Outcome> {
//!         let height = sim.site_xpos()[self.tip][2];
//!         let cost = self.ctrl_cost_weight * sim.ctrl()[0].powi(2);
//!         info.put("height", height).doc("of the tip, m");
//!         Ok(Outcome { reward: height / 0.6 - cost, terminated: sim.qpos()[0].abs() > 1.8 })
//!     }
//! }
//! # #[cfg(feature = "library")]
//! # fn main() -> std::result::Result<(), mjenv::Error> {
//!
//! mjenv::register::<Swingup>()?;
//! let mut options = mjenv::Options::new("Swingup-v0")?;
//! options.set("ctrl_cost_weight", 0.1)?.set("num_threads", 2)?;
//! let mut envs = mjenv::Env::new(&options, 64)?;
//! let mut batch = envs.batch::<f64>();
//! envs.reset(.., &mut batch)?;
//! envs.step(.., &[0.5f32; 64], &mut batch)?;
//! assert_eq!(batch.info("height")?.len(), 64);
//! # Ok(())
//! # }
//! # #[cfg(not(feature = "library"))]
//! # fn main() {}
//! ```
//!
//! # When the methods are called
//!
//! [`Task::build`] runs once when the task is registered, to list its options. There is no model then: the methods of
//! [`Builder`] return the options' defaults and indices of 0. It runs again whenever an environment is created, with the
//! caller's options and the model. Then each other method except `reset` is called once on the model's initial state, to
//! learn the names and lengths of the fields, and which methods the task has ([`Absent`]).
//!
//! In a step, the library calls `before_step`, `before_substep` before each mj_step, `step`, `carry` and `observe`, in this
//! order. In a reset, it calls `reset`, `carry`, `observe` and `reset_info`. It leaves out `observe` and `reset_info` when
//! the caller does not want their output.
//!
//! After a step, a task sees mjData as mj_step leaves it, which is also what Gymnasium sees: `qpos`, `qvel`, `act` and
//! `time` are new, but what MuJoCo computes from them (`xpos`, contacts, `sensordata`, ...) is one timestep older,
//! because mj_step computes it before it integrates. After a reset, everything belongs to the same state.
//!
//! # Threads
//!
//! One value of the task serves all rows of an environment, from several threads at the same time. So [`Task`] requires
//! `Send + Sync`, and the methods take `&self`. Declare numbers that a row has to remember from step to step with
//! [`Builder::carry`]; snapshots save them. Declare those that are used as indices or sizes with
//! [`Builder::carry_within`], because a snapshot may come from a stranger. Do not keep such numbers in the task in a `Mutex`
//! or an atomic, because then rows would influence each other, and results would depend on the number of threads.
//!
//! # Errors
//!
//! A method that returns `Err` or panics makes the call of its row fail with
//! [`ErrorKind::Task`](crate::ErrorKind::Task). The error's text names the id, the method and the row and quotes the
//! reason. The row keeps its state, and the other rows are stepped. Nothing unwinds through the library. A panic also
//! prints its message to stderr, as any panic does (`std::panic::set_hook` changes that), and ends the process if the
//! program is compiled with `panic = "abort"`.
//!
//! A method must not step or change the environment that it runs for. Such calls return
//! [`ErrorKind::Busy`](crate::ErrorKind::Busy).
//!
//! # Plug-ins
//!
//! A crate of the type `cdylib` can hold tasks for all languages. It uses this crate without the feature `library`, and
//! so it neither needs nor links libmjenv:
//!
//! ```toml
//! [lib]
//! crate-type = ["cdylib"]
//!
//! [dependencies]
//! mjenv = { version = "0.1", default-features = false }
//! ```
//!
//! Its `src/lib.rs` contains the tasks and one line, `mjenv::plugin!(Swingup);`, which names them. Python then says
//! `mjenv.load_tasks("target/release/libmy_robots.so")` and `mjenv.make_vec("Swingup-v0", 64)`, and a Rust program
//! [`mjenv::load_tasks`](crate::load_tasks). To test the tasks in the crate itself, name `mjenv` with its features
//! under `[dev-dependencies]`, and add `"rlib"` to the crate types.

mod builder;
mod callbacks;
mod fields;
mod locomotion;
mod numbers;
mod row;
mod sim;

pub use builder::{Builder, Joint, Sensor};
pub use fields::{Fields, Put, Value};
pub use locomotion::{air_time, Terrain, View};
pub use numbers::{Carried, Carry, Live};
pub use row::{Control, Own, Rng, Row, Start};
pub use sim::{Action, Array, Contact, Element, Sim};

#[doc(hidden)]
pub use callbacks::{plugin, Description};

pub use crate::describe::Dtype;

/// Why a method of a task fails. A text becomes one by `"the reason".into()`, and `?` converts any error.
pub type Failure = Box<dyn std::error::Error + Send + Sync>;

/// The failure by which a method that a task need not have says that the task lacks it, as those that [`Task`] provides
/// do. The library never calls such a method. A method under an option returns it where the option is off:
/// `if !self.servo { return Err(Absent.into()); }`.
#[derive(Clone, Copy, Debug)]
pub struct Absent;

impl std::fmt::Display for Absent {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.write_str("the task lacked this method when its environment was built")
    }
}

impl std::error::Error for Absent {}

/// The result of a task's method.
pub type Result<T = (), E = Failure> = std::result::Result<T, E>;

/// A robot and its task. The [module](self) explains it and has an example.
pub trait Task: Sized + Send + Sync + 'static {
    /// The id: letters, digits, `_`, `.` and `-`, then `-v` and a number: `"Cartpole-v0"`.
    const ID: &'static str;

    /// The model.
    const MODEL: Model;

    /// How many mj_steps make a step.
    const FRAME_SKIP: u32 = 1;

    /// The number of steps after which an episode is truncated; 0: never.
    const TIME_LIMIT: u64 = 0;

    /// The return from which the task counts as solved.
    const REWARD_THRESHOLD: Option<f64> = None;

    /// The camera with which pictures begin.
    const CAMERA: CameraConfig = CameraConfig::DEFAULT;

    /// Increase it when the task changes, so that snapshots of the old task are refused.
    const REVISION: i32 = 0;

    /// Reads the options and looks up names in the model.
    fn build(b: &mut Builder<'_>) -> Result<Self>;

    /// Draws the initial state of an episode. Afterwards, all numbers in it must be finite.
    fn reset(&self, start: &mut Start<'_>, rng: &mut Rng<'_>) -> Result;

    /// Writes the info of a reset.
    fn reset_info(&self, sim: &Sim<'_>, info: &mut Fields<'_>) -> Result {
        let _ = (sim, info);
        Err(Absent.into())
    }

    /// Writes what the next step needs to know about the present state. It is called at the end of each reset and step,
    /// and after [`Env::set_state`](crate::Env::set_state) and [`Env::simulate`](crate::Env::simulate). Numbers that it
    /// does not write keep their values.
    fn carry(&self, sim: &Sim<'_>, carried: &mut Carried<'_>) -> Result {
        let _ = (sim, carried);
        Err(Absent.into())
    }

    /// Writes the observation, which must depend only on `sim`. An observation with a NaN is refused, unless the
    /// option `strict` is false.
    fn observe(&self, sim: &Sim<'_>, observation: &mut Fields<'_>) -> Result;

    /// Turns the action into ctrl, once in each step, before its first mj_step; without it, ctrl is the action. In `sim`, what MuJoCo computes from the state is not valid: it belongs to other rows or older
    /// states. A control that is not finite is refused, unless the option `strict` is false.
    fn before_step(&self, sim: &Sim<'_>, row: &mut Row<'_>, control: &mut Control<'_>) -> Result {
        let _ = (sim, row, control);
        Err(Absent.into())
    }

    /// Changes ctrl or forces before each mj_step. `sim` is as valid as in [`Task::before_step`].
    fn before_substep(&self, sim: &Sim<'_>, row: &mut Row<'_>, control: &mut Control<'_>) -> Result {
        let _ = (sim, row, control);
        Err(Absent.into())
    }

    /// Computes the reward of one pair of goals, for hindsight experience replay
    /// ([`Env::compute_reward`](crate::Env::compute_reward)). The observation needs the groups or terms `achieved_goal`
    /// and `desired_goal`. `step` may call it, too. Errors: the reason why it failed.
    fn compute_reward(&self, achieved: &[f64], desired: &[f64]) -> Result<f64> {
        let _ = (achieved, desired);
        Err(Absent.into())
    }

    /// Computes the reward, the info and whether the episode has terminated. It is called once in each step, after the
    /// simulation has advanced by `frame_skip` mj_steps. A reward of NaN is refused, unless the option `strict` is false.
    fn step(&self, sim: &Sim<'_>, row: &mut Row<'_>, info: &mut Fields<'_>) -> Result<Outcome>;
}

/// Where a task's model comes from. It is the default of the options `xml_file` and `xml_string`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Model {
    /// A built-in model (`"hopper.xml"`), or a path that begins with `./`, `/` or `~`. `./` means the folder of the
    /// program or shared object that contains the task.
    File(&'static str),
    /// The text of an MJCF model, for example `include_str!("cartpole.xml")`.
    Text(&'static str),
}

/// Gymnasium's `default_camera_config`. `None` means MuJoCo's default.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CameraConfig {
    /// The index of the body that the camera follows.
    pub trackbodyid: Option<u32>,
    /// The distance from the point that it looks at, m.
    pub distance: Option<f64>,
    /// The point that it looks at, m.
    pub lookat: Option<[f64; 3]>,
    /// The angle above the horizontal plane, degrees. Negative: the camera looks down.
    pub elevation: Option<f64>,
}

impl CameraConfig {
    /// MuJoCo's defaults.
    pub const DEFAULT: Self = Self { trackbodyid: None, distance: None, lookat: None, elevation: None };
}

/// The result of a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Outcome {
    /// The reward.
    pub reward: f64,
    /// Whether the state is a terminal one.
    pub terminated: bool,
}

/// Makes a crate of the type `cdylib` a plug-in with these tasks, of which there must be at least one:
/// `mjenv::plugin!(Cartpole, Reach);`. A crate does this once.
///
/// ```
/// # mod tasks {
/// # use mjenv::task::*;
/// # pub struct Fall;
/// # impl Task for Fall {
/// #     const ID: &'static str = "Fall-v0";
/// #     const MODEL: Model = Model::Text("<mujoco><worldbody><body><freejoint/><geom size='1'/></body></worldbody></mujoco>");
/// #     fn build(_: &mut Builder) -> Result<Self> { Ok(Self) }
/// #     fn reset(&self, _: &mut Start, _: &mut Rng) -> Result { Ok(()) }
/// #     fn observe(&self, sim: &Sim, observation: &mut Fields) -> Result {
/// #         observation.put_all("qpos", sim.qpos());
/// #         Ok(())
/// #     }
/// #     fn step(&self, _: &Sim, _: &mut Row, _: &mut Fields) -> Result<Outcome> {
/// #         Ok(Outcome { reward: 0.0, terminated: false })
/// #     }
/// # }
/// # }
/// # use tasks::Fall;
/// mjenv::plugin!(Fall);
/// # fn main() {}
/// ```
#[macro_export]
macro_rules! plugin {
    ($($task:ty),+ $(,)?) => {
        /// The entry of the plug-in, which the library calls when it loads it.
        #[no_mangle]
        pub unsafe extern "C" fn mjenv_tasks(api: *const ::std::ffi::c_void) -> *const ::std::ffi::c_void {
            // SAFETY: the library calls this with its functions for callbacks.
            unsafe {
                $crate::task::plugin(api, || {
                    Ok(::std::vec![$($crate::task::Description::of::<$task>()?),+])
                })
            }
        }
    };
}
