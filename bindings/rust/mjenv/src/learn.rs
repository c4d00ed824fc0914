//! Trains policies by PPO with the library's own learner (`libmjenv-learn`), and plays them. It needs the feature
//! `learn`.
//!
//! ```
//! use mjenv::learn::{self, Learner, Settings};
//! use mjenv::{Env, Options};
//!
//! fn main() -> Result<(), mjenv::Error> {
//!     let settings = Settings::new("InvertedPendulum-v5")?;
//!     let mut options = Options::new(&settings.id)?;
//!     options.set("autoreset_mode", "same_step")?;
//!     let mut learner = Learner::new(Env::new(&options, settings.rows)?, &settings)?;
//!     learner.train(50_000)?;
//!
//!     options.set("autoreset_mode", "disabled")?;
//!     let played = learn::evaluate(&mut Env::new(&options, 10)?, &learner.policy()?, 10, 0)?;
//!     assert_eq!(played.returns, [1000.0; 10]);
//!     Ok(())
//! }
//! ```
//!
//! The same settings, seed and environment give the same bits for any number of threads and any instruction set.

use std::ffi::CString;
use std::fmt;
use std::os::raw::c_char;
use std::path::Path;
use std::ptr::{self, NonNull};

use mjenv_sys as sys;

use crate::describe::{int64, size, size_of};
use crate::error::{Error, ErrorKind, Result};
use crate::text::{borrowed, c_string, lossy};
use crate::Env;

/// The activation function of the hidden layers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
#[allow(missing_docs)]
pub enum Activation {
    Tanh,
    Relu,
    Elu,
}

/// The precision in which a policy computes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Precision {
    /// The bits of `mjenv.policy` in Python and of the program `deploy` in the examples.
    Float64,
    /// As the learner computes: faster, and equal to `Float64` but for rounding.
    Float32,
}

/// Which policy of a learner is meant.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Which {
    /// That of the last update.
    Last,
    /// That of the update after which the mean return of the last episodes was greatest.
    Best,
}

/// How a learner learns. `mjenv/learn.h` describes the settings in more words.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// The id of the environment; copied to policies and checkpoints.
    pub id: String,
    /// How many rows the environment has.
    pub rows: usize,
    /// The steps of all rows together in the whole training.
    pub steps: usize,
    /// The steps of each row between two updates.
    pub rollout_steps: usize,
    /// How often an update uses each step.
    pub epochs: usize,
    /// In steps; at most `rows * rollout_steps`.
    pub minibatch_size: usize,
    /// In how many steps the learning rate falls to `final_learning_rate`; 0: in all of them.
    pub decay_steps: usize,
    /// The learning rate of Adam at the beginning.
    pub learning_rate: f64,
    /// The learning rate at the end.
    pub final_learning_rate: f64,
    /// The discount factor.
    pub gamma: f64,
    /// The lambda of the generalized advantage estimation.
    pub gae_lambda: f64,
    /// The ratio of probabilities is clipped to `1 - clip` to `1 + clip`.
    pub clip: f64,
    /// The same for changes of the value; 0: they are not clipped.
    pub value_clip: f64,
    /// The weight of the mean squared error of the value in the loss.
    pub value_coef: f64,
    /// The weight of the entropy.
    pub entropy_coef: f64,
    /// Longer gradients are shortened to this norm; 0: none is.
    pub max_grad_norm: f64,
    /// No further epoch of an update begins once the policy has moved farther than this; 0: no limit.
    pub target_kl: f64,
    /// The standard deviation of the actions at the beginning.
    pub initial_std: f64,
    /// Normalised observations are clipped to this size.
    pub obs_clip: f64,
    /// The same for rewards.
    pub reward_clip: f64,
    /// Whether observations get mean 0 and variance 1.
    pub normalize_obs: bool,
    /// Whether rewards are divided by the standard deviation of the discounted return.
    pub normalize_reward: bool,
    /// Whether advantages get mean 0 and variance 1 in each minibatch.
    pub normalize_advantage: bool,
    /// Whether -1 to 1 of the network's outputs are the bounds of the action.
    pub scale_actions: bool,
    /// The widths of the hidden layers of both networks.
    pub hidden: Vec<usize>,
    /// The activation function of the hidden layers.
    pub activation: Activation,
    /// Which elements of the observation the actor sees; empty: all.
    pub actor_obs: Vec<bool>,
    /// The same for the critic.
    pub critic_obs: Vec<bool>,
    /// The seed of the weights, of the exploration, and, increased by the row, of the rows.
    pub seed: u64,
    /// The threads of the networks; those of the environment are its own option.
    pub threads: usize,
    /// Of how many last episodes the mean return is computed.
    pub window: usize,
}

impl Settings {
    /// Returns the settings for an id: tuned ones for the robots of Gymnasium's v5, else one set of defaults.
    ///
    /// # Errors
    /// [`ErrorKind::Argument`], [`ErrorKind::Internal`] (the library's version does not fit this crate).
    pub fn new(id: &str) -> Result<Self> {
        check_abi()?;
        let name = c_string(format_args!("id {id:?}"), id)?;
        let mut raw =
            sys::mjenv_learn_settings { struct_size: size_of::<sys::mjenv_learn_settings>(), ..Default::default() };
        // SAFETY: all pointers are valid for the call.
        check(unsafe { sys::mjenv_learn_defaults(name.as_ptr(), &mut raw) })?;
        // SAFETY: the library says how long its static array is.
        let hidden = unsafe { std::slice::from_raw_parts(raw.hidden, size(raw.hidden_count)) };
        Ok(Self {
            id: id.to_string(),
            rows: size(raw.rows),
            steps: size(raw.steps),
            rollout_steps: size(raw.rollout_steps),
            epochs: size(raw.epochs),
            minibatch_size: size(raw.minibatch_size),
            decay_steps: size(raw.decay_steps),
            learning_rate: raw.learning_rate,
            final_learning_rate: raw.final_learning_rate,
            gamma: raw.gamma,
            gae_lambda: raw.gae_lambda,
            clip: raw.clip,
            value_clip: raw.value_clip,
            value_coef: raw.value_coef,
            entropy_coef: raw.entropy_coef,
            max_grad_norm: raw.max_grad_norm,
            target_kl: raw.target_kl,
            initial_std: raw.initial_std,
            obs_clip: raw.obs_clip,
            reward_clip: raw.reward_clip,
            normalize_obs: raw.normalize_obs != 0,
            normalize_reward: raw.normalize_reward != 0,
            normalize_advantage: raw.normalize_advantage != 0,
            scale_actions: raw.scale_actions != 0,
            hidden: hidden.iter().map(|&width| size(width)).collect(),
            activation: match raw.activation {
                sys::MJENV_ACTIVATION_RELU => Activation::Relu,
                sys::MJENV_ACTIVATION_ELU => Activation::Elu,
                _ => Activation::Tanh,
            },
            actor_obs: Vec::new(),
            critic_obs: Vec::new(),
            seed: raw.seed,
            threads: size(raw.threads.into()),
            window: size(raw.window),
        })
    }

    /// Passes the settings as the library takes them to `call`.
    fn with_raw(&self, call: impl FnOnce(&sys::mjenv_learn_settings) -> sys::mjenv_status) -> Result<()> {
        let id = c_string(format_args!("id {:?}", self.id), &self.id)?;
        let hidden: Vec<i64> = self.hidden.iter().map(|&width| int64(width)).collect();
        let masks = [&self.actor_obs, &self.critic_obs];
        let lengths = masks.map(Vec::len);
        if lengths[0] != lengths[1] && lengths[0] > 0 && lengths[1] > 0 {
            let message = format!("actor_obs has {} element(s), critic_obs {}", lengths[0], lengths[1]);
            return Err(Error::new(ErrorKind::Size, message));
        }
        let [actor_obs, critic_obs] =
            masks.map(|mask| if mask.is_empty() { ptr::null() } else { mask.as_ptr().cast::<u8>() });
        check(call(&sys::mjenv_learn_settings {
            struct_size: size_of::<sys::mjenv_learn_settings>(),
            activation: match self.activation {
                Activation::Tanh => sys::MJENV_ACTIVATION_TANH,
                Activation::Relu => sys::MJENV_ACTIVATION_RELU,
                Activation::Elu => sys::MJENV_ACTIVATION_ELU,
            },
            id: id.as_ptr(),
            rows: int64(self.rows),
            steps: int64(self.steps),
            rollout_steps: int64(self.rollout_steps),
            epochs: int64(self.epochs),
            minibatch_size: int64(self.minibatch_size),
            decay_steps: int64(self.decay_steps),
            learning_rate: self.learning_rate,
            final_learning_rate: self.final_learning_rate,
            gamma: self.gamma,
            gae_lambda: self.gae_lambda,
            clip: self.clip,
            value_clip: self.value_clip,
            value_coef: self.value_coef,
            entropy_coef: self.entropy_coef,
            max_grad_norm: self.max_grad_norm,
            target_kl: self.target_kl,
            initial_std: self.initial_std,
            obs_clip: self.obs_clip,
            reward_clip: self.reward_clip,
            normalize_obs: self.normalize_obs.into(),
            normalize_reward: self.normalize_reward.into(),
            normalize_advantage: self.normalize_advantage.into(),
            scale_actions: self.scale_actions.into(),
            hidden: hidden.as_ptr(),
            hidden_count: int64(hidden.len()),
            actor_obs,
            critic_obs,
            obs_count: int64(lengths[0].max(lengths[1])),
            seed: self.seed,
            threads: i32::try_from(self.threads).unwrap_or(i32::MAX),
            instructions: sys::MJENV_INSTRUCTIONS_AUTO,
            window: int64(self.window),
        }))
    }
}

/// What one update did, and how the episodes before it went. A mean of no episodes is NaN.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Report {
    /// How many updates there were so far.
    pub updates: usize,
    /// How many steps of all rows together.
    pub steps: usize,
    /// How many episodes have ended.
    pub episodes: usize,
    /// The mean return of the last episodes of the exploring policy.
    pub mean_return: f64,
    /// Their mean length in steps.
    pub mean_length: f64,
    /// The learning rate of the update.
    pub learning_rate: f64,
    /// The mean of the policy's loss over the update's minibatches.
    pub policy_loss: f64,
    /// The mean squared error of the value.
    pub value_loss: f64,
    /// The entropy of the policy after the update, in nats.
    pub entropy: f64,
    /// How far the policy has moved.
    pub approx_kl: f64,
    /// The share of steps whose ratio was clipped.
    pub clip_fraction: f64,
    /// The norm of the gradient before it was clipped.
    pub grad_norm: f64,
    /// `1 - var(returns - values) / var(returns)` before the update.
    pub explained_variance: f64,
    /// The mean standard deviation of the actions after the update.
    pub std: f64,
    /// How many epochs the update had.
    pub epochs: usize,
}

impl Report {
    fn read(call: impl FnOnce(*mut sys::mjenv_learn_report) -> sys::mjenv_status) -> Result<Self> {
        let mut raw =
            sys::mjenv_learn_report { struct_size: size_of::<sys::mjenv_learn_report>(), ..Default::default() };
        check(call(&mut raw))?;
        Ok(Self {
            updates: size(raw.updates),
            steps: size(raw.steps),
            episodes: size(raw.episodes),
            mean_return: raw.mean_return,
            mean_length: raw.mean_length,
            learning_rate: raw.learning_rate,
            policy_loss: raw.policy_loss,
            value_loss: raw.value_loss,
            entropy: raw.entropy,
            approx_kl: raw.approx_kl,
            clip_fraction: raw.clip_fraction,
            grad_norm: raw.grad_norm,
            explained_variance: raw.explained_variance,
            std: raw.std,
            epochs: size(raw.epochs),
        })
    }
}

/// Trains a policy in all rows of an environment.
pub struct Learner {
    raw: NonNull<sys::mjenv_learner>,
    env: Env,
}

// SAFETY: any thread may use a learner, and different learners are independent. It is not Sync, as Env is not.
unsafe impl Send for Learner {}

impl Learner {
    /// Makes a learner, and seeds and resets the environment, whose option `autoreset_mode` must be `same_step`.
    ///
    /// # Errors
    /// [`ErrorKind::Value`] (a setting, or infinite bounds), [`ErrorKind::Size`], those of [`Env::reset`].
    pub fn new(env: Env, settings: &Settings) -> Result<Self> {
        check_abi()?;
        let mut raw = ptr::null_mut();
        // SAFETY: all pointers are valid for the call, and the environment lives as long as the learner.
        settings.with_raw(|settings| unsafe { sys::mjenv_learner_create(&calls(), env.raw(), settings, &mut raw) })?;
        let raw = NonNull::new(raw).expect("libmjenv-learn creates a learner or fails");
        Ok(Self { raw, env })
    }

    fn raw(&self) -> *mut sys::mjenv_learner {
        self.raw.as_ptr()
    }

    /// Trains until at least so many more steps of all rows together are done. If this fails, the rollout under way is
    /// undone.
    ///
    /// # Errors
    /// [`ErrorKind::Value`] (a reward or observation is not finite: the row and step are named), those of
    /// [`Env::step`].
    pub fn train(&mut self, steps: usize) -> Result<()> {
        // SAFETY: the handle is alive.
        check(unsafe { sys::mjenv_learner_train(self.raw(), int64(steps)) })
    }

    /// Returns the environment.
    #[must_use]
    pub fn env(&self) -> &Env {
        &self.env
    }

    /// Returns the environment, for writing live parameters and values of rows. Its rows must not be stepped or reset.
    #[must_use]
    pub fn env_mut(&mut self) -> &mut Env {
        &mut self.env
    }

    /// Continues in another environment with the same spaces and number of rows, and returns the one before.
    ///
    /// # Errors
    /// As [`Learner::new`]. After an error the learner keeps its environment.
    pub fn replace_env(&mut self, env: Env) -> Result<Env> {
        // SAFETY: both handles are alive, and the environment lives as long as the learner.
        check(unsafe { sys::mjenv_learner_set_env(self.raw(), env.raw()) })?;
        Ok(std::mem::replace(&mut self.env, env))
    }

    /// Replaces the settings from the next rollout on. Those of the networks, the sizes of rollouts, the seed and the
    /// threads cannot change.
    ///
    /// # Errors
    /// [`ErrorKind::Value`], [`ErrorKind::Size`].
    pub fn set(&mut self, settings: &Settings) -> Result<()> {
        // SAFETY: handle and struct are valid for the call.
        settings.with_raw(|settings| unsafe { sys::mjenv_learner_set(self.raw(), settings) })
    }

    /// Describes the learner after its last update; before the first one, all means are NaN.
    ///
    /// # Errors
    /// [`ErrorKind::Memory`].
    pub fn report(&self) -> Result<Report> {
        // SAFETY: handle and struct are valid for the call.
        Report::read(|report| unsafe { sys::mjenv_learner_report(self.raw(), report) })
    }

    /// Returns the learning curve: the report of each update.
    ///
    /// # Errors
    /// [`ErrorKind::Memory`].
    pub fn curve(&self) -> Result<Vec<Report>> {
        // SAFETY: handle and struct are valid for the call.
        let at = |update| Report::read(|report| unsafe { sys::mjenv_learner_report_at(self.raw(), update, report) });
        (1..=int64(self.report()?.updates)).map(at).collect()
    }

    /// Saves a checkpoint: networks, optimizer, normalisation, random streams, curve, and the state of all rows. The
    /// file is replaced at once, when all of it is written.
    ///
    /// # Errors
    /// [`ErrorKind::File`], [`ErrorKind::Argument`] (the path).
    pub fn save(&self, path: impl AsRef<Path>) -> Result<()> {
        self.save_with_note(path, "")
    }

    /// Saves a checkpoint with a text that [`checkpoint_note`] reads, for example the options of the environment.
    ///
    /// # Errors
    /// Those of [`Learner::save`]; [`ErrorKind::Argument`] (a NUL in the note).
    pub fn save_with_note(&self, path: impl AsRef<Path>, note: &str) -> Result<()> {
        let (path, note) = (c_path(path.as_ref())?, c_string(format_args!("the note"), note)?);
        // SAFETY: all pointers are valid for the call.
        check(unsafe { sys::mjenv_learner_save(self.raw(), path.as_ptr(), note.as_ptr()) })
    }

    /// Continues from a checkpoint, bit for bit. The learner must have been made for the same id, sizes and spaces.
    ///
    /// # Errors
    /// [`ErrorKind::File`], [`ErrorKind::Snapshot`] (damaged, or of another id or size), [`ErrorKind::Argument`].
    pub fn load(&mut self, path: impl AsRef<Path>) -> Result<()> {
        let path = c_path(path.as_ref())?;
        // SAFETY: both pointers are valid for the call.
        check(unsafe { sys::mjenv_learner_load(self.raw(), path.as_ptr()) })
    }

    /// Returns a policy as text, which a file `policy.txt` contains.
    ///
    /// # Errors
    /// [`ErrorKind::Memory`].
    pub fn policy_text(&self, which: Which) -> Result<String> {
        let which = raw_which(which);
        // SAFETY: the learner is valid for the call, and `delivered` passes pointers that are.
        let text = delivered(|text, capacity, bytes| unsafe {
            sys::mjenv_learner_policy(self.raw(), which, text, capacity, bytes)
        })?;
        Ok(String::from_utf8(text).expect("texts of libmjenv-learn are UTF-8"))
    }

    /// Returns the policy of the last update.
    ///
    /// # Errors
    /// [`ErrorKind::Memory`].
    pub fn policy(&self) -> Result<Policy> {
        Policy::parse(&self.policy_text(Which::Last)?)
    }

    /// Writes a policy as a file `policy.txt`, which is replaced at once, when all of it is written.
    ///
    /// # Errors
    /// [`ErrorKind::File`], [`ErrorKind::Argument`] (the path).
    pub fn save_policy(&self, which: Which, path: impl AsRef<Path>) -> Result<()> {
        let path = c_path(path.as_ref())?;
        // SAFETY: both pointers are valid for the call.
        check(unsafe { sys::mjenv_learner_save_policy(self.raw(), raw_which(which), path.as_ptr()) })
    }
}

/// Reads the note in a checkpoint, which may come from a stranger.
///
/// # Errors
/// [`ErrorKind::File`], [`ErrorKind::Snapshot`] (damaged), [`ErrorKind::Argument`] (the path).
pub fn checkpoint_note(path: impl AsRef<Path>) -> Result<String> {
    let path = c_path(path.as_ref())?;
    // SAFETY: the path is valid for the call, and `delivered` passes pointers that are.
    let note =
        delivered(|text, capacity, bytes| unsafe { sys::mjenv_checkpoint_note(path.as_ptr(), text, capacity, bytes) })?;
    Ok(String::from_utf8_lossy(&note).into_owned())
}

impl Drop for Learner {
    fn drop(&mut self) {
        // SAFETY: the handle is alive and owned; nobody uses it after this. The environment is dropped later.
        unsafe { sys::mjenv_learner_destroy(self.raw()) }
    }
}

impl fmt::Debug for Learner {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.debug_struct("Learner").field("env", &self.env).finish()
    }
}

/// A deterministic policy, as a file `policy.txt` contains it.
pub struct Policy {
    raw: NonNull<sys::mjenv_policy>,
}

// SAFETY: any thread may use a policy.
unsafe impl Send for Policy {}

// SAFETY: all methods only read, and the library lets several threads read a policy at the same time.
unsafe impl Sync for Policy {}

impl Policy {
    /// Reads the text of a policy.
    ///
    /// # Errors
    /// [`ErrorKind::Value`] (the line is named).
    pub fn parse(text: &str) -> Result<Self> {
        // SAFETY: all pointers are valid for the call, and the text has the given length.
        Self::made(|made| unsafe { sys::mjenv_policy_parse(text.as_ptr().cast(), int64(text.len()), made) })
    }

    /// Reads a policy from a file.
    ///
    /// # Errors
    /// [`ErrorKind::File`], [`ErrorKind::Value`] (the line is named), [`ErrorKind::Argument`] (the path).
    pub fn load(path: impl AsRef<Path>) -> Result<Self> {
        let path = c_path(path.as_ref())?;
        // SAFETY: both pointers are valid for the call.
        Self::made(|made| unsafe { sys::mjenv_policy_load(path.as_ptr(), made) })
    }

    fn made(call: impl FnOnce(*mut *mut sys::mjenv_policy) -> sys::mjenv_status) -> Result<Self> {
        check_abi()?;
        let mut raw = ptr::null_mut();
        check(call(&mut raw))?;
        Ok(Self { raw: NonNull::new(raw).expect("libmjenv-learn makes a policy or fails") })
    }

    /// Returns the id that the policy was trained for.
    #[must_use]
    pub fn id(&self) -> &str {
        // SAFETY: the handle is alive, and the text lives as long.
        unsafe { borrowed(sys::mjenv_policy_id(self.raw.as_ptr())) }
    }

    /// Returns how many elements an observation has, and how many actuators an action.
    #[must_use]
    pub fn sizes(&self) -> (usize, usize) {
        let (mut observations, mut actuators) = (0, 0);
        // SAFETY: all pointers are valid for the call.
        let status = unsafe { sys::mjenv_policy_sizes(self.raw.as_ptr(), &mut observations, &mut actuators) };
        check(status).expect("a policy has sizes");
        (size(observations), size(actuators))
    }

    /// Computes the actions for the observations of one or many rows, which follow each other.
    ///
    /// # Errors
    /// [`ErrorKind::Size`].
    pub fn act(&self, precision: Precision, observations: &[f64]) -> Result<Vec<f32>> {
        let (inputs, outputs) = self.sizes();
        let rows = observations.len() / inputs;
        let mut actions = vec![0.0; rows * outputs];
        let (obs, count) = (observations.as_ptr(), int64(observations.len()));
        let (to, room, policy) = (actions.as_mut_ptr(), int64(actions.len()), self.raw.as_ptr());
        // SAFETY: all pointers are valid for the call and for the given numbers of elements.
        check(unsafe { sys::mjenv_policy_act(policy, raw_precision(precision), int64(rows), obs, count, to, room) })?;
        Ok(actions)
    }
}

impl Drop for Policy {
    fn drop(&mut self) {
        // SAFETY: the handle is alive and owned; nobody uses it after this.
        unsafe { sys::mjenv_policy_destroy(self.raw.as_ptr()) }
    }
}

impl fmt::Debug for Policy {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.debug_struct("Policy").field("id", &self.id()).field("sizes", &self.sizes()).finish()
    }
}

/// Episodes that a policy has played.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Evaluation {
    /// The sum of the rewards of each episode.
    pub returns: Vec<f64>,
    /// The steps of each episode.
    pub lengths: Vec<usize>,
}

/// Plays whole episodes in all rows of an environment whose option `autoreset_mode` is `disabled`. Episode k begins with
/// a reset by `seed + k`, so that the result does not depend on the number of rows and threads. The actions are those of
/// [`Precision::Float64`].
///
/// # Errors
/// [`ErrorKind::Size`] (the policy is of another size), [`ErrorKind::Value`], those of [`Env::step`].
pub fn evaluate(env: &mut Env, policy: &Policy, episodes: usize, seed: u64) -> Result<Evaluation> {
    let (mut returns, mut lengths) = (vec![0.0; episodes], vec![0i64; episodes]);
    // SAFETY: all pointers are valid for the call, and there is room for all episodes.
    check(unsafe {
        sys::mjenv_evaluate(
            &calls(),
            env.raw(),
            policy.raw.as_ptr(),
            sys::MJENV_PRECISION_FLOAT64,
            seed,
            int64(episodes),
            returns.as_mut_ptr(),
            lengths.as_mut_ptr(),
        )
    })?;
    Ok(Evaluation { returns, lengths: lengths.into_iter().map(size).collect() })
}

/// The functions of libmjenv that libmjenv-learn calls.
fn calls() -> sys::mjenv_learn_calls {
    sys::mjenv_learn_calls {
        struct_size: size_of::<sys::mjenv_learn_calls>(),
        reserved: 0,
        last_error: Some(sys::mjenv_last_error),
        info_of: Some(sys::mjenv_info_of),
        options_of: Some(sys::mjenv_options_of),
        options_get_string: Some(sys::mjenv_options_get_string),
        space_of: Some(sys::mjenv_space_of),
        seed: Some(sys::mjenv_seed),
        reset: Some(sys::mjenv_reset),
        step: Some(sys::mjenv_step),
        snapshot: Some(sys::mjenv_snapshot),
        restore: Some(sys::mjenv_restore),
        field_at: Some(sys::mjenv_field_at),
    }
}

/// As [`crate::error::check`], for a status of libmjenv-learn.
fn check(status: sys::mjenv_status) -> Result<()> {
    // SAFETY: the text is valid until this thread's next failing call, and it is copied.
    crate::error::check_with(status, || unsafe { lossy(sys::mjenv_learn_last_error()) }.into_owned())
}

fn check_abi() -> Result<()> {
    // SAFETY: the function takes nothing.
    let found = unsafe { sys::mjenv_learn_abi_version() };
    crate::error::check_abi_of("libmjenv-learn", found, sys::MJENV_LEARN_ABI_VERSION)
}

/// Reads a text that a function of the library delivers. It has no more bytes than `capacity`, and a NUL at its end.
fn delivered(get: impl Fn(*mut c_char, i64, &mut i64) -> sys::mjenv_status) -> Result<Vec<u8>> {
    let mut bytes = 0;
    check(get(ptr::null_mut(), 0, &mut bytes))?;
    let mut text = vec![0u8; size(bytes)];
    check(get(text.as_mut_ptr().cast(), bytes, &mut bytes))?;
    text.pop(); // the NUL
    Ok(text)
}

fn c_path(path: &Path) -> Result<CString> {
    let text =
        path.to_str().ok_or_else(|| Error::new(ErrorKind::Argument, format!("the path {path:?} is not UTF-8")))?;
    c_string(format_args!("path {text:?}"), text)
}

fn raw_which(which: Which) -> sys::mjenv_learned {
    match which {
        Which::Last => sys::MJENV_LEARNED_LAST,
        Which::Best => sys::MJENV_LEARNED_BEST,
    }
}

fn raw_precision(precision: Precision) -> sys::mjenv_precision {
    match precision {
        Precision::Float64 => sys::MJENV_PRECISION_FLOAT64,
        Precision::Float32 => sys::MJENV_PRECISION_FLOAT32,
    }
}
