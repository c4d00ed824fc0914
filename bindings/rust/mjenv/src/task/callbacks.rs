//! The functions of a task that the library calls. No panic unwinds out of them.

use std::any::Any;
use std::ffi::CString;
use std::mem;
use std::os::raw::c_void;
use std::panic::{self, AssertUnwindSafe};
use std::ptr;

use mjenv_sys as sys;

use super::builder::{c_text, Builder, Declared};
use super::fields::{Entry, Fields};
use super::numbers::Carried;
use super::row::{Control, Rng, Row, Start};
use super::sim::{Shape, Sim};
use super::{Absent, CameraConfig, Dtype, Failure, Model, Outcome, Result, Task};
use crate::describe::{int64, size, size_of};

/// A task in one environment, which the library knows as `self`.
struct Instance<T> {
    task: T,
    shape: Shape,
    observation: Vec<Entry>,
    info: Vec<Entry>,
    reset_info: Vec<Entry>,
}

impl<T: Task> Instance<T> {
    /// Safety: `raw` is the library's, and nothing else uses it during the call.
    unsafe fn build(raw: *mut sys::mjenv_builder) -> Result<Self> {
        // SAFETY: as the caller promises.
        let mut b = unsafe { Builder::new(raw) };
        let task = T::build(&mut b)?;
        let shape = mem::take(&mut b.shape);
        let mut this = Self { task, shape, observation: Vec::new(), info: Vec::new(), reset_info: Vec::new() };
        this.try_methods(&mut b, raw)?;
        if let Some(Some(skipped)) = b.structure {
            b.describe(sys::MJENV_ROLE_STRUCTURE, "skipped_qpos", "", Dtype::Float64, Some(skipped), "");
        }
        let roles = [sys::MJENV_ROLE_OBSERVATION, sys::MJENV_ROLE_INFO, sys::MJENV_ROLE_RESET_INFO];
        for (role, entries) in roles.into_iter().zip([&this.observation, &this.info, &this.reset_info]) {
            for entry in entries {
                b.describe(role, &entry.name, &entry.doc, entry.dtype, entry.length, &entry.group);
            }
        }
        if b.structure.is_some() {
            for entry in &this.observation {
                b.describe(sys::MJENV_ROLE_STRUCTURE, &entry.name, &entry.doc, entry.dtype, Some(entry.count()), "");
            }
        }
        Ok(this)
    }

    /// What the methods that write controls get. Safety: as for the callbacks.
    unsafe fn controlled<'a>(&self, raw: *const sys::mjenv_sim, to: *mut sys::mjenv_control) -> (Row<'a>, Control<'a>) {
        // SAFETY: as the caller promises.
        unsafe {
            let row = Row::new(Rng::new((*to).random), Carried::new((*to).carried, self.shape.carried));
            (row, Control::new(to, size((*raw).nu.into()), self.shape.own.len()))
        }
    }

    /// Makes the trial calls, which find out the fields, and which methods the task has.
    fn try_methods(&mut self, b: &mut Builder<'_>, raw: *const sys::mjenv_builder) -> Result {
        let Self { task, shape, observation, info, reset_info } = self;
        // SAFETY: the library's structs live until build returns; sim does not change any more, and only this function
        // uses the callbacks, which belong to this environment.
        let (sim, callbacks) = unsafe { (Sim::new((*raw).sim, shape), &mut *(*raw).task) };
        let mut numbers = vec![0.0; shape.carried];
        let to = numbers.as_mut_ptr();
        // SAFETY: the numbers outlive this, and nothing else uses them during a trial call.
        let carried = || unsafe { Carried::new(to, shape.carried) };
        let trial = |method: &str, result: Result| {
            result.map_err(|error| Failure::from(format!("trial call of {method}: {error}")))
        };
        let has = |method: &str, result: Result| match result {
            Err(error) if error.is::<Absent>() => Ok(false),
            result => trial(method, result).map(|()| true),
        };

        let mut fields = Fields::learn(observation);
        trial("observe", task.observe(&sim, &mut fields).and_then(|()| fields.finish()))?;
        let mut fields = Fields::learn(reset_info);
        if !has("reset_info", task.reset_info(&sim, &mut fields).and_then(|()| fields.finish()))? {
            callbacks.reset_info = None;
        }
        if !has("carry", task.carry(&sim, &mut carried()))? {
            callbacks.carry = None;
        }

        let mut values: Vec<Vec<f64>> = shape.own.iter().map(|&array| vec![0.0; shape.arrays[array].1]).collect();
        let own: Vec<*mut f64> = values.iter_mut().map(|array| array.as_mut_ptr()).collect();
        let mut ctrl = vec![0.0; sim.ctrl().len()];
        let mut controls = sys::mjenv_control {
            struct_size: size_of::<sys::mjenv_control>(),
            ctrl: ctrl.as_mut_ptr(),
            own: own.as_ptr(),
            ..Default::default()
        };
        let mut mapped = |method: &str, map: fn(&T, &Sim<'_>, &mut Row<'_>, &mut Control<'_>) -> Result| {
            let mut row = Row::new(b.trial_rng(), carried());
            // SAFETY: ctrl and the own arrays outlive this, and nothing else uses them.
            let mut control = unsafe { Control::new(&mut controls, ctrl.len(), own.len()) };
            has(method, map(task, &sim, &mut row, &mut control))
        };
        if !mapped("before_step", T::before_step)? {
            callbacks.before_step = None;
        }
        if !mapped("before_substep", T::before_substep)? {
            callbacks.before_substep = None;
        }

        // SAFETY: the arrays outlive this, and nothing else uses them.
        let mut row = unsafe { Row::new(b.trial_rng(), carried()).with_own(own.as_ptr(), own.len()) };
        let mut qvel = sim.qvel().to_vec();
        row = row.with_qvel(&mut qvel);
        let mut fields = Fields::learn(info);
        trial("step", task.step(&sim, &mut row, &mut fields).and_then(|_| fields.finish()))?;

        let goal = |name: &str| {
            let parts = observation.iter().filter(|entry| entry.name == name || entry.group == name);
            vec![0.0; parts.map(Entry::count).sum()]
        };
        // It may fail for these goals, which are all 0.
        let reward = task.compute_reward(&goal("achieved_goal"), &goal("desired_goal"));
        if reward.map_or_else(|error| error.is::<Absent>(), |_| false) {
            callbacks.compute_reward = None;
        }
        Ok(())
    }
}

/// Returns the message of a panic, and frees its payload.
fn text_of(payload: Box<dyn Any + Send>) -> String {
    let text = match (payload.downcast_ref::<&str>(), payload.downcast_ref::<String>()) {
        (Some(text), _) => text.to_string(),
        (_, Some(text)) => text.clone(),
        _ => "it is no text".to_string(),
    };
    // A payload may panic again when it is dropped.
    if let Err(again) = panic::catch_unwind(AssertUnwindSafe(|| drop(payload))) {
        mem::forget(again);
    }
    text
}

/// Calls the body. Returns its result, or the reason why it failed or panicked.
fn caught<R>(body: impl FnOnce() -> Result<R>) -> std::result::Result<R, String> {
    let result = panic::catch_unwind(AssertUnwindSafe(|| body().map_err(|error| error.to_string())));
    result.unwrap_or_else(|payload| Err(format!("it panicked: {}", text_of(payload))))
}

/// Calls the body and returns what a callback returns. Safety: `api` is the library's.
unsafe fn guarded(api: *const sys::mjenv_task_api, body: impl FnOnce() -> Result) -> i32 {
    match caught(body) {
        Ok(()) => 0,
        // SAFETY: as the caller promises.
        Err(reason) => unsafe { fail(api, &reason) },
    }
}

/// Tells the library why a callback fails. Safety: `api` is the library's.
unsafe fn fail(api: *const sys::mjenv_task_api, reason: &str) -> i32 {
    let reason = CString::new(reason.replace('\0', "\\0")).unwrap_or_default();
    // SAFETY: as the caller promises; the library copies the text.
    match unsafe { (*api).fail_with } {
        Some(fail_with) => unsafe { fail_with(reason.as_ptr()) },
        None => 1,
    }
}

// SAFETY of the callbacks: the library passes its own structs, which nothing else uses during the call, and `this` from
// `build`.

unsafe extern "C" fn build<T: Task>(raw: *mut sys::mjenv_builder, _: *mut c_void, this: *mut *mut c_void) -> i32 {
    unsafe {
        guarded((*raw).api, || {
            *this = Box::into_raw(Box::new(Instance::<T>::build(raw)?)) as *mut c_void;
            Ok(())
        })
    }
}

unsafe extern "C" fn destroy<T: Task>(this: *mut c_void) {
    // There is no way to report that it panicked; the panic has printed its message.
    let _ = caught(|| {
        drop(unsafe { Box::from_raw(this as *mut Instance<T>) });
        Ok(())
    });
}

/// Defines callbacks of an instance, `this`. The first argument after it has the library's functions.
macro_rules! callbacks {
    ($($name:ident($this:ident, $raw:ident: $raw_type:ty, $($argument:ident: $type:ty),*) $body:block)*) => {$(
        unsafe extern "C" fn $name<T: Task>($this: *const c_void, $raw: $raw_type, $($argument: $type),*) -> i32 {
            unsafe {
                let $this = &*($this as *const Instance<T>);
                guarded((*$raw).api, || $body)
            }
        }
    )*};
}

callbacks! {
    reset(this, raw: *mut sys::mjenv_start,) {
        this.task.reset(&mut Start::new(raw, &this.shape), &mut Rng::new((*raw).random))
    }

    reset_info(this, raw: *const sys::mjenv_sim, to: *mut f64) {
        let mut fields = Fields::write(&this.reset_info, to);
        this.task.reset_info(&Sim::new(raw, &this.shape), &mut fields)?;
        fields.finish()
    }

    carry(this, raw: *const sys::mjenv_sim, to: *mut f64) {
        this.task.carry(&Sim::new(raw, &this.shape), &mut Carried::new(to, this.shape.carried))
    }

    observe(this, raw: *const sys::mjenv_sim, to: *mut f64) {
        let mut fields = Fields::write(&this.observation, to);
        this.task.observe(&Sim::new(raw, &this.shape), &mut fields)?;
        fields.finish()
    }

    step(this, raw: *const sys::mjenv_sim, outcome: *mut sys::mjenv_outcome) {
        let row = Row::new(Rng::new((*outcome).random), Carried::new((*outcome).carried, this.shape.carried));
        let qvel = std::slice::from_raw_parts_mut((*outcome).qvel, size((*raw).nv.into()));
        let mut row = row.with_own((*outcome).own, this.shape.own.len()).with_qvel(qvel);
        let mut info = Fields::write(&this.info, (*outcome).info);
        let Outcome { reward, terminated } = this.task.step(&Sim::new(raw, &this.shape), &mut row, &mut info)?;
        info.finish()?;
        (*outcome).reward = reward;
        (*outcome).terminated = terminated.into();
        Ok(())
    }

    before_step(this, raw: *const sys::mjenv_sim, to: *mut sys::mjenv_control) {
        let (mut row, mut control) = this.controlled(raw, to);
        this.task.before_step(&Sim::new(raw, &this.shape), &mut row, &mut control)
    }

    before_substep(this, raw: *const sys::mjenv_sim, to: *mut sys::mjenv_control) {
        let (mut row, mut control) = this.controlled(raw, to);
        this.task.before_substep(&Sim::new(raw, &this.shape), &mut row, &mut control)
    }
}

unsafe extern "C" fn compute_reward<T: Task>(
    this: *const c_void,
    api: *const sys::mjenv_task_api,
    achieved: *const f64,
    desired: *const f64,
    count: i64,
    reward: *mut f64,
) -> i32 {
    unsafe {
        let this = &*(this as *const Instance<T>);
        guarded(api, || {
            let goal = |numbers| std::slice::from_raw_parts(numbers, size(count));
            *reward = this.task.compute_reward(goal(achieved), goal(desired))?;
            Ok(())
        })
    }
}

/// The library's description of a task, and the memory to which it points.
#[doc(hidden)]
#[allow(missing_debug_implementations)]
pub struct Description {
    id: CString,
    model: CString,
    camera: sys::mjenv_task_camera,
    declared: Vec<Declared>,
    options: Vec<sys::mjenv_task_option>,
    task: sys::mjenv_task,
}

impl Description {
    /// Describes a task. Errors: a text that names the id: `build` failed when it listed the options.
    pub fn of<T: Task>() -> std::result::Result<Box<Self>, String> {
        caught(|| {
            let mut b = Builder::listing();
            T::build(&mut b)?;
            Ok(Self::with_options::<T>(b.options))
        })
        .map_err(|reason| format!("{}: build: {reason}", T::ID))
    }

    fn with_options<T: Task>(declared: Vec<Declared>) -> Box<Self> {
        let (Model::File(model) | Model::Text(model)) = T::MODEL;
        let CameraConfig { trackbodyid, distance, lookat, elevation } = T::CAMERA;
        let mut this = Box::new(Self {
            id: c_text(T::ID),
            model: c_text(model),
            camera: sys::mjenv_task_camera {
                struct_size: size_of::<sys::mjenv_task_camera>(),
                // A number that does not fit becomes one that the library refuses.
                trackbodyid: trackbodyid.map_or(sys::MJENV_BODY_UNSET, |body| i32::try_from(body).unwrap_or(i32::MAX)),
                distance: distance.unwrap_or(f64::NAN),
                lookat: lookat.unwrap_or([f64::NAN; 3]),
                elevation: elevation.unwrap_or(f64::NAN),
            },
            options: declared.iter().map(Declared::raw).collect(),
            declared,
            task: Default::default(),
        });
        let is_file = matches!(T::MODEL, Model::File(_));
        let model_if = |wanted: bool| if wanted { this.model.as_ptr() } else { ptr::null() };
        this.task = sys::mjenv_task {
            struct_size: size_of::<sys::mjenv_task>(),
            revision: T::REVISION,
            id: this.id.as_ptr(),
            model: model_if(is_file),
            model_text: model_if(!is_file),
            // Numbers that do not fit become ones that the library refuses.
            frame_skip: i32::try_from(T::FRAME_SKIP).unwrap_or(i32::MAX),
            has_reward_threshold: T::REWARD_THRESHOLD.is_some().into(),
            reward_threshold: T::REWARD_THRESHOLD.unwrap_or(f64::NAN),
            time_limit: i64::try_from(T::TIME_LIMIT).unwrap_or(i64::MAX),
            camera: &this.camera,
            options: this.options.as_ptr(),
            option_count: int64(this.declared.len()),
            build: Some(build::<T>),
            destroy: Some(destroy::<T>),
            reset: Some(reset::<T>),
            reset_info: Some(reset_info::<T>),
            carry: Some(carry::<T>),
            observe: Some(observe::<T>),
            step: Some(step::<T>),
            before_step: Some(before_step::<T>),
            before_substep: Some(before_substep::<T>),
            compute_reward: Some(compute_reward::<T>),
            ..Default::default()
        };
        this
    }

    /// The library's description, which points into this value.
    pub(crate) fn raw(&self) -> *const sys::mjenv_task {
        &self.task
    }
}

/// Describes a plug-in's tasks to the library, which copies them; [`plugin!`](crate::plugin) calls this.
///
/// # Safety
/// `api` is what the library passes to `mjenv_tasks`.
#[doc(hidden)]
pub unsafe fn plugin(
    api: *const std::ffi::c_void,
    describe: impl FnOnce() -> std::result::Result<Vec<Box<Description>>, String>,
) -> *const std::ffi::c_void {
    let described = caught(|| {
        let described = describe()?;
        let tasks: Vec<_> = described.iter().map(|description| description.raw()).collect();
        let plugin = Box::new(sys::mjenv_plugin {
            struct_size: size_of::<sys::mjenv_plugin>(),
            abi_version: sys::MJENV_ABI_VERSION,
            tasks: tasks.as_ptr(),
            task_count: int64(tasks.len()),
        });
        // The library reads this after the return and does not free it.
        mem::forget((described, tasks));
        Ok(Box::into_raw(plugin) as *const c_void)
    });
    match described {
        Ok(plugin) => plugin,
        Err(reason) => {
            // SAFETY: as the caller promises.
            unsafe { fail(api as *const sys::mjenv_task_api, &reason) };
            ptr::null()
        }
    }
}
