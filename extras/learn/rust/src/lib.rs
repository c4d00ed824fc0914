//! Trains policies in the environments of the crate `mjenv` by PPO, with `libmjenv-learn`, and plays them.
//!
//! ```
//! use mjenv_learn::{evaluate, Learner, Settings};
//! use mjenv::{Env, Options};
//!
//! fn main() -> Result<(), mjenv::Error> {
//!     let settings = Settings::new("InvertedPendulum-v5")?;
//!     let mut options = Options::new(settings.id())?;
//!     options.set("autoreset_mode", "same_step")?;
//!     let mut learner = Learner::new(Env::new(&options, settings.get("rows")?)?, &settings)?;
//!     learner.train(50_000)?;
//!
//!     options.set("autoreset_mode", "disabled")?;
//!     let played = evaluate(&mut Env::new(&options, 10)?, &learner.policy()?, 10, 0)?;
//!     assert_eq!(played.returns, [1000.0; 10]);
//!     Ok(())
//! }
//! ```
//!
//! The same settings, seed and environment give the same bits for any number of threads and any instruction set.

#![warn(missing_docs, missing_debug_implementations, unsafe_op_in_unsafe_fn)]
#![warn(clippy::missing_errors_doc, clippy::must_use_candidate)]

use std::ffi::{CStr, CString};
use std::fmt;
use std::os::raw::c_char;
use std::path::Path;
use std::ptr::{self, NonNull};
use std::str::FromStr;

use mjenv::{Env, Error, ErrorKind, Result, Role};
use mjenv_sys::{mjenv_status, MJENV_OK};

#[rustfmt::skip]
#[allow(dead_code, non_camel_case_types)]
mod sys;

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

/// How a learner learns: values with names, such as `gamma` and `hidden`, which extras/learn/settings.def lists.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    id: String,
    words: String, // all settings, as NAME=VALUE
}

impl Settings {
    /// Returns the settings for an id: tuned ones for the robots of Gymnasium's v5, else one set of defaults.
    ///
    /// # Errors
    /// [`ErrorKind::Argument`], [`ErrorKind::Internal`] (the library's version does not fit this crate).
    pub fn new(id: &str) -> Result<Self> {
        check_abi()?;
        Ok(Self { id: id.to_string(), words: all_settings(id, "")? })
    }

    /// Returns the id of the environment.
    #[must_use]
    pub fn id(&self) -> &str {
        &self.id
    }

    /// Sets a setting to a number, a `bool` or a text, such as `"64,64"` for `hidden`.
    ///
    /// # Errors
    /// [`ErrorKind::Name`], [`ErrorKind::Type`], [`ErrorKind::Value`].
    pub fn set(&mut self, name: &str, value: impl ToString) -> Result<&mut Self> {
        self.words = all_settings(&self.id, &format!("{} {}", self.words, word(name, &value)?))?;
        Ok(self)
    }

    /// Reads a setting as an integer, a floating-point number, a `bool` or a `String`.
    ///
    /// # Errors
    /// [`ErrorKind::Name`], [`ErrorKind::Type`].
    pub fn get<T: FromStr>(&self, name: &str) -> Result<T> {
        let value = |word: &'_ str| word.split_once('=').filter(|pair| pair.0 == name).map(|pair| pair.1.to_string());
        let no_setting = || Error::new(ErrorKind::Name, format!("there is no setting {name:?}"));
        let text = self.words.split(' ').find_map(value).ok_or_else(no_setting)?;
        let other_type = |_| Error::new(ErrorKind::Type, format!("the setting {name} is {text:?}, of another type"));
        text.parse().map_err(other_type)
    }
}

/// A setting as the library reads it. A blank would end it.
fn word(name: &str, value: &impl ToString) -> Result<String> {
    let word = format!("{name}={}", value.to_string());
    match word.contains(char::is_whitespace) {
        true => Err(Error::new(ErrorKind::Value, format!("the setting {word:?} has a blank"))),
        false => Ok(word),
    }
}

/// All settings of an id, of which `words` replaces some.
fn all_settings(id: &str, words: &str) -> Result<String> {
    let (id, words) = (c_string(format_args!("id {id:?}"), id)?, c_string(format_args!("the settings"), words)?);
    // SAFETY: the texts are valid for the call, and `delivered` passes pointers that are.
    let text = delivered(|text, capacity, bytes| unsafe {
        sys::mjenv_learn_settings(id.as_ptr(), words.as_ptr(), text, capacity, bytes)
    })?;
    Ok(String::from_utf8(text).expect("texts of libmjenv-learn are UTF-8"))
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
    fn read(call: impl FnOnce(*mut sys::mjenv_learn_report) -> mjenv_status) -> Result<Self> {
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
        let id = c_string(format_args!("id {:?}", settings.id), &settings.id)?;
        let words = c_string(format_args!("the settings"), &settings.words)?;
        // SAFETY: all pointers are valid for the call, and the environment lives as long as the learner.
        check(unsafe { sys::mjenv_learner_create(&calls(), env.raw(), id.as_ptr(), words.as_ptr(), &mut raw) })?;
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

    /// Changes a setting from the next rollout on. Those of the networks, the sizes of rollouts, the seed and the
    /// threads cannot change.
    ///
    /// # Errors
    /// [`ErrorKind::Name`], [`ErrorKind::Type`], [`ErrorKind::Value`].
    pub fn set(&mut self, name: &str, value: impl ToString) -> Result<()> {
        let words = c_string(format_args!("the setting {name}"), &word(name, &value)?)?;
        // SAFETY: handle and text are valid for the call.
        check(unsafe { sys::mjenv_learner_set(self.raw(), words.as_ptr()) })
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

    fn made(call: impl FnOnce(*mut *mut sys::mjenv_policy) -> mjenv_status) -> Result<Self> {
        check_abi()?;
        let mut raw = ptr::null_mut();
        check(call(&mut raw))?;
        Ok(Self { raw: NonNull::new(raw).expect("libmjenv-learn makes a policy or fails") })
    }

    /// Returns the id that the policy was trained for.
    #[must_use]
    pub fn id(&self) -> &str {
        // SAFETY: the handle is alive, and the text lives as long.
        unsafe { CStr::from_ptr(sys::mjenv_policy_id(self.raw.as_ptr())) }.to_str().expect("an id is ASCII")
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

    /// Returns where the numbers that the policy sees are in an observation of the environment.
    ///
    /// # Errors
    /// [`ErrorKind::Name`] (the observation lacks a term, which is named), [`ErrorKind::Size`] (a term has another size).
    pub fn places(&self, env: &Env) -> Result<Vec<usize>> {
        let fields: Vec<_> = env.fields(Role::Observation).collect();
        let texts: Vec<_> = fields.iter().map(|field| CString::new(&*field.name).expect("a name has no NUL")).collect();
        let names: Vec<_> = texts.iter().map(|text| text.as_ptr()).collect();
        let counts: Vec<_> = fields.iter().map(|field| int64(field.count)).collect();
        let mut places = vec![0; self.sizes().0];
        let (terms, found, room) = (int64(counts.len()), places.as_mut_ptr(), int64(places.len()));
        // SAFETY: all pointers are valid for the call and for the given numbers of elements.
        check(unsafe {
            sys::mjenv_policy_find(self.raw.as_ptr(), names.as_ptr(), counts.as_ptr(), terms, found, room)
        })?;
        Ok(places.into_iter().map(size).collect())
    }

    /// Computes the actions for what the policy sees ([`Policy::places`]) of one or many rows, which follow each other.
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
        last_error: Some(mjenv_sys::mjenv_last_error),
        info_of: Some(mjenv_sys::mjenv_info_of),
        options_of: Some(mjenv_sys::mjenv_options_of),
        options_get_string: Some(mjenv_sys::mjenv_options_get_string),
        space_of: Some(mjenv_sys::mjenv_space_of),
        seed: Some(mjenv_sys::mjenv_seed),
        reset: Some(mjenv_sys::mjenv_reset),
        step: Some(mjenv_sys::mjenv_step),
        snapshot: Some(mjenv_sys::mjenv_snapshot),
        restore: Some(mjenv_sys::mjenv_restore),
        field_at: Some(mjenv_sys::mjenv_field_at),
    }
}

/// Turns the status that a call of libmjenv-learn on this thread has just returned into a result.
fn check(status: mjenv_status) -> Result<()> {
    if status == MJENV_OK {
        return Ok(());
    }
    // SAFETY: the text is valid until this thread's next failing call, and it is copied.
    let reason = unsafe { CStr::from_ptr(sys::mjenv_learn_last_error()) }.to_string_lossy().into_owned();
    Err(Error::new(ErrorKind::from_status(status), reason))
}

fn check_abi() -> Result<()> {
    // SAFETY: the function takes nothing.
    let found = unsafe { sys::mjenv_learn_abi_version() };
    if found == sys::MJENV_LEARN_ABI_VERSION {
        return Ok(());
    }
    let needed = sys::MJENV_LEARN_ABI_VERSION;
    let message = format!("libmjenv-learn has ABI version {found}, this program was built for {needed}");
    Err(Error::new(ErrorKind::Internal, message))
}

/// Converts a count of the library.
fn size(count: i64) -> usize {
    usize::try_from(count).unwrap_or(0)
}

/// Converts a count for the library, which refuses the one that it gets if this one does not fit.
fn int64(size: usize) -> i64 {
    i64::try_from(size).unwrap_or(i64::MAX)
}

/// The value of `struct_size` for a struct.
fn size_of<T>() -> u32 {
    std::mem::size_of::<T>() as u32
}

fn c_string(what: fmt::Arguments<'_>, text: &str) -> Result<CString> {
    CString::new(text).map_err(|_| Error::new(ErrorKind::Argument, format!("{what} contains a NUL character")))
}

/// Reads a text that a function of the library delivers. It has no more bytes than `capacity`, and a NUL at its end.
fn delivered(get: impl Fn(*mut c_char, i64, &mut i64) -> mjenv_status) -> Result<Vec<u8>> {
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
