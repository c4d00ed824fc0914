//! What a task calls to read its options and to look up names in the model.

use std::ffi::CString;
use std::marker::PhantomData;
use std::ops::RangeInclusive;
use std::os::raw::c_char;

use mjenv_sys as sys;

use super::numbers::{Carry, Live};
use super::row::{Own, Rng};
use super::sim::{Array, Element, Shape, Sim};
use super::Dtype;
use crate::describe::{int64, size, size_of};
use crate::numpy::Norm;

/// A joint's index, and its first elements in qpos and qvel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct Joint {
    /// The index of the joint.
    pub index: usize,
    /// The index of its first element in qpos.
    pub qpos: usize,
    /// The index of its first element in qvel.
    pub qvel: usize,
}

/// A sensor's first element in sensordata, and how many it has. [`Sim::sensor`] reads it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct Sensor {
    /// The index of its first element in sensordata.
    pub first: usize,
    /// How many elements it has.
    pub count: usize,
}

/// An option that a task declared.
#[derive(Debug)]
pub(super) struct Declared {
    pub(super) kind: sys::mjenv_kind,
    pub(super) name: CString,
    pub(super) doc: CString,
    pub(super) text: Option<CString>,
    pub(super) choices: Option<CString>,
    pub(super) values: Vec<f64>,
    pub(super) several: bool,
    pub(super) low: f64,
    pub(super) high: f64,
    pub(super) live: bool,
}

/// Prepares an environment. Each method of an option declares it with its default and documentation, and returns its
/// value. Each method that looks up a name fails the build if the model does not have it, so it need not return a
/// `Result`. The methods panic if a name contains a NUL character.
#[derive(Debug)]
pub struct Builder<'a> {
    /// Null in the run that lists the options.
    raw: *mut sys::mjenv_builder,
    environment: PhantomData<&'a mut sys::mjenv_builder>,
    pub(super) options: Vec<Declared>,
    pub(super) shape: Shape,
    pub(super) structure: Option<Option<usize>>,
}

/// Calls one of the library's functions for build.
macro_rules! call {
    ($builder:ident.$function:ident($($argument:expr),*)) => {
        // SAFETY: the builder lives as long as this value, the library's functions are static and complete, and the
        // arguments are valid for the call.
        unsafe { ((*(*$builder.raw).api).$function.expect("the library has this function"))($builder.raw $(, $argument)*) }
    };
}

impl<'a> Builder<'a> {
    /// A builder for the run that lists the options.
    pub(super) fn listing() -> Self {
        // SAFETY: null is the builder of this run.
        unsafe { Self::new(std::ptr::null_mut()) }
    }

    /// Safety: `raw` is null, or the library's, and nothing else uses it during `'a`.
    pub(super) unsafe fn new(raw: *mut sys::mjenv_builder) -> Self {
        Self { raw, environment: PhantomData, options: Vec::new(), shape: Shape::default(), structure: None }
    }

    pub(super) fn lists(&self) -> bool {
        self.raw.is_null()
    }

    // ---- Options ----

    /// An option that is one number. It may have any value.
    pub fn real(&mut self, name: &str, default: f64, doc: &str) -> f64 {
        self.real_within(name, default, f64::NEG_INFINITY..=f64::INFINITY, doc)
    }

    /// An option that is one number with bounds.
    pub fn real_within(&mut self, name: &str, default: f64, bounds: RangeInclusive<f64>, doc: &str) -> f64 {
        let declared = Declared::new(sys::MJENV_KIND_REALS, name, doc, &[default], bounds);
        let mut value = default;
        if let Some(name) = self.declare(declared) {
            call!(self.reals(name.as_ptr(), &mut value, 1));
        }
        value
    }

    /// A live parameter of `N` numbers: each row has its own, at first the option's, which the program changes while the
    /// task runs (`env.write(.., "parameters.NAME", &values)`). Methods read them with [`Sim::live`] and [`Start::live`](super::Start::live).
    pub fn live<const N: usize>(&mut self, name: &str, default: [f64; N], doc: &str) -> Live<N> {
        self.live_within(name, default, f64::NEG_INFINITY..=f64::INFINITY, doc)
    }

    /// The same with closed bounds for each number.
    pub fn live_within<const N: usize>(
        &mut self,
        name: &str,
        default: [f64; N],
        bounds: RangeInclusive<f64>,
        doc: &str,
    ) -> Live<N> {
        let declared = Declared::new(sys::MJENV_KIND_REALS, name, doc, &default, bounds);
        let declared = Declared { several: N != 1, live: true, ..declared };
        let first = match self.declare(declared) {
            Some(name) => size(call!(self.parameter(name.as_ptr()))),
            None => 0,
        };
        self.shape.live = self.shape.live.max(first + N);
        Live { first }
    }

    /// An option that is `N` numbers; with `N` = 2 a range.
    pub fn reals<const N: usize>(&mut self, name: &str, default: [f64; N], doc: &str) -> [f64; N] {
        let declared = Declared::new(sys::MJENV_KIND_REALS, name, doc, &default, f64::NEG_INFINITY..=f64::INFINITY);
        let declared = Declared { several: true, ..declared };
        let mut values = default;
        if let Some(name) = self.declare(declared) {
            call!(self.reals(name.as_ptr(), values.as_mut_ptr(), int64(N)));
        }
        values
    }

    /// An option that is a `bool`.
    pub fn flag(&mut self, name: &str, default: bool, doc: &str) -> bool {
        let value = f64::from(u8::from(default));
        match self.declare(Declared::new(sys::MJENV_KIND_FLAG, name, doc, &[value], 0.0..=1.0)) {
            Some(name) => call!(self.integer(name.as_ptr())) != 0,
            None => default,
        }
    }

    /// An option that is an integer with bounds. They must be less than 2^53 in size.
    pub fn integer(&mut self, name: &str, default: i64, bounds: RangeInclusive<i64>, doc: &str) -> i64 {
        let bounds = *bounds.start() as f64..=*bounds.end() as f64;
        match self.declare(Declared::new(sys::MJENV_KIND_INTEGER, name, doc, &[default as f64], bounds)) {
            Some(name) => call!(self.integer(name.as_ptr())),
            None => default,
        }
    }

    /// An option that is a text. `choices` are the valid texts; if there are none, any text is valid.
    pub fn text(&mut self, name: &str, default: &str, choices: &[&str], doc: &str) -> String {
        let declared = Declared {
            text: Some(c_text(default)),
            choices: Some(c_text(&choices.join(" "))).filter(|_| !choices.is_empty()),
            ..Declared::new(sys::MJENV_KIND_STRING, name, doc, &[], 0.0..=0.0)
        };
        match self.declare(declared) {
            Some(name) => {
                let text = call!(self.text(name.as_ptr()));
                // SAFETY: the text is valid until build returns; it is copied here.
                unsafe { crate::text::lossy(text) }.into_owned()
            }
            None => default.to_string(),
        }
    }

    /// An option that names an object of the model or gives its index. `object` is the type of the object: `"body"`,
    /// `"joint"` and so on. Returns the index; fails the build if the model does not have the object.
    pub fn object_option(&mut self, name: &str, object: &str, default: usize, doc: &str) -> usize {
        let (kind, bounds) = (sys::MJENV_KIND_STRING_OR_INT, 0.0..=i32::MAX.into());
        let declared = Declared::new(kind, name, doc, &[default as f64], bounds);
        match self.declare(declared) {
            Some(name) => index(call!(self.option_index(name.as_ptr(), c_text(object).as_ptr()))),
            None => 0,
        }
    }

    /// The option `reset_noise_scale`: the spread of the random initial state.
    pub fn noise(&mut self, default: f64) -> f64 {
        self.real_within("reset_noise_scale", default, 0.0..=f64::MAX / 2.0, "spread of the random initial state")
    }

    methods! {
        self;
        /// Whether the caller set an option of real numbers to an integer. In Python, the product of such an option and
        /// a bool is an int.
        is_integer(option: &str) -> bool { !self.lists() && call!(self.is_integer(c_text(option).as_ptr())) != 0 }
        /// How Euclidean norms are rounded: the option `norm`.
        norm() -> Norm { Norm::new(!self.lists() && call!(self.norm_is_fused()) != 0) }
        /// The index of a body.
        body(name: &str) -> usize { self.index("body", name) }
        /// The index of a geom.
        geom(name: &str) -> usize { self.index("geom", name) }
        /// The index of a site.
        site(name: &str) -> usize { self.index("site", name) }
        /// The index of an actuator.
        actuator(name: &str) -> usize { self.index("actuator", name) }
        /// The index of a tendon.
        tendon(name: &str) -> usize { self.index("tendon", name) }
    }

    // ---- The model ----

    /// The index of a named object of the model. `object` is its type: `"body"`, `"joint"` and so on.
    pub fn index(&self, object: &str, name: &str) -> usize {
        match self.lists() {
            true => 0,
            false => index(call!(self.index(c_text(object).as_ptr(), c_text(name).as_ptr()))),
        }
    }

    /// A joint.
    pub fn joint(&mut self, name: &str) -> Joint {
        let at = self.index("joint", name);
        Joint { index: at, qpos: self.element("jnt_qposadr", at), qvel: self.element("jnt_dofadr", at) }
    }

    /// A sensor.
    pub fn sensor(&mut self, name: &str) -> Sensor {
        let at = self.index("sensor", name);
        Sensor { first: self.element("sensor_adr", at), count: self.element("sensor_dim", at) }
    }

    /// An array of mjData or mjModel, by its name in MuJoCo, for [`Sim::array`]. Fails the build if there is no such
    /// array, or if its elements have another type.
    pub fn array<T: Element>(&mut self, name: &str) -> Array<T> {
        let (index, element_type) = self.share(name);
        if let Some(element_type) = element_type {
            assert!(element_type == T::TYPE, "the elements of {name:?} are no {}", std::any::type_name::<T>());
        }
        Array { index, element: PhantomData }
    }

    /// Makes an array that is computed on demand available: `"contacts"`, `"cfrc_ext"`, `"geom_xpos"` (for geom_xmat,
    /// too), or another one that [`Builder::array`] looks up: `"cfrc_int"`, `"cacc"`, `"cam_xpos"`, `"cam_xmat"`,
    /// `"light_xpos"`, `"light_xdir"`.
    pub fn need(&mut self, array: &str) {
        if !self.lists() {
            call!(self.need(c_text(array).as_ptr()));
        }
    }

    /// Lets the methods see the new state. After the last mj_step of a step, the library computes the stages of mj_step1,
    /// so positions, velocities, contacts and the sensors that depend on them belong to the new qpos and qvel. Forces and
    /// accelerations belong to the state before.
    pub fn current(&mut self) {
        if !self.lists() {
            call!(self.current());
        }
    }

    /// Gives each row its own array: an array of mjModel that [`Task::reset`](super::Task::reset) and
    /// [`Task::step`](super::Task::step) write; or `"qfrc_applied"` or `"xfrc_applied"`, which
    /// [`Task::before_step`](super::Task::before_step), `before_substep` and `step` write. If the method fails, the row
    /// keeps its old values. Numbers are rounded if MuJoCo's array is `f32` (`"hfield_data"`, `"geom_rgba"`).
    pub fn own(&mut self, name: &str) -> Own {
        let (index, _) = self.share(name);
        if self.lists() {
            return Own { index: 0, count: 0 };
        }
        let count = self.shape.arrays.get(index).map_or(0, |&(_, count)| count);
        let own = call!(self.own(c_text(name).as_ptr()));
        self.shape.own.push(index);
        Own { index: size(own.into()), count }
    }

    /// Gives each row a stream of NumPy's `RandomState` besides its [`Rng`], whose methods `state_rand` and so on draw from it
    /// in reset.
    pub fn random_state(&mut self) {
        if !self.lists() {
            call!(self.random_state());
        }
    }

    /// Sets the action space: the bounds of each number of an action, which [`Task::before_step`](super::Task::before_step)
    /// turns into ctrl.
    pub fn action(&mut self, bounds: &[RangeInclusive<f64>]) {
        if !self.lists() {
            let low: Vec<f64> = bounds.iter().map(|bounds| *bounds.start()).collect();
            let high: Vec<f64> = bounds.iter().map(|bounds| *bounds.end()).collect();
            call!(self.action(int64(bounds.len()), low.as_ptr(), high.as_ptr()));
        }
    }

    /// The model's initial state; `None` in the run that lists the options.
    pub fn sim(&self) -> Option<Sim<'_>> {
        // SAFETY: the struct is the library's, and methods that change it need a `&mut self`.
        (!self.lists()).then(|| unsafe { Sim::new((*self.raw).sim, &self.shape) })
    }

    /// Declares `N` numbers that a row carries from step to step. The type of the struct's field tells `N`.
    pub fn carry<const N: usize>(&mut self) -> Carry<N> {
        let first = self.shape.carried;
        self.shape.carried += N;
        if !self.lists() {
            call!(self.carry(int64(self.shape.carried)));
        }
        Carry { first }
    }

    /// The same with closed bounds for each number, which must contain 0: `b.carry_within(0.0..=4.0)`. A method that writes
    /// a number out of the bounds fails, and an image with one is refused. Bound numbers that the task uses as indices or
    /// sizes, because an image may come from a stranger.
    pub fn carry_within<const N: usize>(&mut self, bounds: RangeInclusive<f64>) -> Carry<N> {
        let numbers = self.carry();
        if !self.lists() {
            call!(self.carry_bounds(int64(numbers.first), int64(N), *bounds.start(), *bounds.end()));
        }
        numbers
    }

    /// Declares `N` numbers that a row carries from step to step, and that resets keep, for instance the level of a
    /// terrain. They are 0 until the row's first reset.
    pub fn keep<const N: usize>(&mut self) -> Carry<N> {
        self.keep_within(f64::NEG_INFINITY..=f64::INFINITY)
    }

    /// The same with closed bounds for each number, as in [`Builder::carry_within`].
    pub fn keep_within<const N: usize>(&mut self, bounds: RangeInclusive<f64>) -> Carry<N> {
        let numbers = self.carry_within(bounds);
        if !self.lists() {
            call!(self.keep(int64(numbers.first), int64(N)));
        }
        numbers
    }

    // ---- Descriptions ----

    /// Adds Gymnasium's `observation_structure`: how many elements of qpos the observation leaves out (`None`: not
    /// listed), then the length of each term.
    pub fn observation_structure(&mut self, skipped_qpos: Option<usize>) {
        self.structure = Some(skipped_qpos);
    }

    /// Sets the type that the reward has in Python; by default np.float64.
    pub fn reward_dtype(&mut self, dtype: Dtype) {
        self.describe(sys::MJENV_ROLE_REWARD, "reward", "", dtype, None, "");
    }

    pub(super) fn describe(
        &mut self,
        role: sys::mjenv_role,
        name: &str,
        doc: &str,
        dtype: Dtype,
        length: Option<usize>,
        group: &str,
    ) {
        if self.lists() {
            return;
        }
        let (name, doc, group) = (c_text(name), c_text(doc), c_text(group));
        let field = sys::mjenv_task_field {
            struct_size: size_of::<sys::mjenv_task_field>(),
            role,
            name: name.as_ptr(),
            doc: doc.as_ptr(),
            dtype: dtype as i32,
            ndim: length.is_some().into(),
            shape: [length.map_or(0, int64), 0, 0, 0],
            group: group.as_ptr(),
        };
        call!(self.field(&field));
    }

    /// The stream for trial calls.
    pub(super) fn trial_rng(&mut self) -> Rng<'_> {
        // SAFETY: the stream is the library's, and is used by nothing else.
        unsafe { Rng::new((*self.raw).random) }
    }

    /// Records an option in the run that lists them; in other runs returns its name for the library.
    fn declare(&mut self, option: Declared) -> Option<CString> {
        if !self.lists() {
            return Some(option.name);
        }
        if self.options.iter().all(|other| other.name != option.name) {
            self.options.push(option);
        }
        None
    }

    /// Makes an array available; returns its index and the type of its elements, which is `None` if it has none yet.
    fn share(&mut self, name: &str) -> (usize, Option<i32>) {
        if self.lists() {
            return (0, None);
        }
        let mut field = sys::mjenv_field { struct_size: size_of::<sys::mjenv_field>(), ..Default::default() };
        let at = index(call!(self.array(c_text(name).as_ptr(), &mut field)));
        if field.name.is_null() {
            return (0, None); // the build fails
        }
        if self.shape.arrays.len() <= at {
            self.shape.arrays.resize(at + 1, (0, 0));
        }
        self.shape.arrays[at] = (field.dtype, size(field.count));
        (at, Some(field.dtype))
    }

    /// An element of an array of int32; 0 in the run that lists the options.
    pub(super) fn element(&mut self, array: &str, at: usize) -> usize {
        self.found(array, at).map_or(0, index)
    }

    /// An element of an array of f64; 0 in the run that lists the options.
    pub(super) fn number(&mut self, array: &str, at: usize) -> f64 {
        self.found(array, at).unwrap_or(0.0)
    }

    fn found<T: Element>(&mut self, array: &str, at: usize) -> Option<T> {
        let array = self.array(array);
        self.sim()?.array(array).get(at).copied()
    }
}

impl Declared {
    fn new(kind: sys::mjenv_kind, name: &str, doc: &str, values: &[f64], bounds: RangeInclusive<f64>) -> Self {
        let (low, high) = bounds.into_inner();
        let (name, doc, values) = (c_text(name), c_text(doc), values.to_vec());
        Self { kind, name, doc, text: None, choices: None, values, several: false, low, high, live: false }
    }

    /// The option as the library takes it. It points into this value.
    pub(super) fn raw(&self) -> sys::mjenv_task_option {
        let pointer =
            |text: &Option<CString>| text.as_ref().map_or(std::ptr::null(), |text| text.as_ptr() as *const c_char);
        sys::mjenv_task_option {
            struct_size: size_of::<sys::mjenv_task_option>(),
            kind: self.kind,
            name: self.name.as_ptr(),
            doc: self.doc.as_ptr(),
            value: self.values.first().copied().unwrap_or(0.0),
            low: self.low,
            high: self.high,
            values: self.values.as_ptr(),
            count: if self.several { int64(self.values.len()) } else { 0 },
            text: pointer(&self.text),
            choices: pointer(&self.choices),
            live: self.live.into(),
            reserved: 0,
        }
    }
}

/// A text for the library.
pub(super) fn c_text(text: &str) -> CString {
    CString::new(text).unwrap_or_else(|_| panic!("{text:?} contains a NUL character"))
}

/// An index from the library, which is never negative.
fn index(raw: i32) -> usize {
    size(raw.into())
}
