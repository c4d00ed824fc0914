//! What a task reads of its row.

use std::marker::PhantomData;
use std::os::raw::c_void;

use mjenv_sys as sys;

use super::numbers::{read, Carried, Carry, Live};
use super::Dtype;
use crate::numpy::{sum_of, Scalar};

/// A contact between two geoms.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C)]
#[non_exhaustive]
pub struct Contact {
    /// The index of the first geom.
    pub geom1: i32,
    /// The index of the second geom.
    pub geom2: i32,
    /// The distance between the geoms, m; negative if they overlap.
    pub distance: f64,
    /// The point midway between the geoms, m.
    pub position: [f64; 3],
    /// The contact frame: one axis per row. The first is the normal, from `geom1` to `geom2`.
    pub frame: [[f64; 3]; 3],
    /// The force (N), then the torque (N m), in the contact frame.
    pub force: [f64; 6],
}

// The library's array is read as an array of this struct.
const _: () = assert!(std::mem::size_of::<Contact>() == std::mem::size_of::<sys::mjenv_contact>());
const _: () = assert!(std::mem::align_of::<Contact>() == std::mem::align_of::<sys::mjenv_contact>());

mod sealed {
    pub trait Sealed {}
}

/// The element types of MuJoCo's arrays: `f64`, `f32`, `i32` and `u8`.
pub trait Element: sealed::Sealed + Copy + 'static {
    #[doc(hidden)]
    const TYPE: i32;
}

/// Implements Element for a type.
macro_rules! elements {
    ($($type:ty: $constant:ident;)*) => {$(
        impl sealed::Sealed for $type {}

        impl Element for $type {
            const TYPE: i32 = sys::$constant;
        }
    )*};
}

elements! {
    f64: MJENV_DTYPE_FLOAT64;
    f32: MJENV_DTYPE_FLOAT32;
    i32: MJENV_DTYPE_INT32;
    u8: MJENV_DTYPE_UINT8;
}

/// An array of mjData or mjModel that [`Builder::array`](super::Builder::array) looked up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Array<T> {
    pub(super) index: usize,
    pub(super) element: PhantomData<T>,
}

/// What the library told in build about its arrays.
#[derive(Debug, Default)]
pub(super) struct Shape {
    /// The element type and the number of elements of each array that was looked up.
    pub(super) arrays: Vec<(i32, usize)>,
    pub(super) carried: usize,
    /// How many numbers the live parameters have that were declared.
    pub(super) live: usize,
    /// The indices of the rows' own arrays among `arrays`.
    pub(super) own: Vec<usize>,
}

impl Shape {
    /// One of the library's `arrays`. Safety: `arrays` are those that this tells of, and keep their values during `'a`.
    pub(super) unsafe fn array<'a, T: Element>(&self, arrays: *const *const c_void, array: Array<T>) -> &'a [T] {
        let count = match self.arrays.get(array.index) {
            Some(&(element_type, count)) if element_type == T::TYPE => count,
            _ => panic!("the array was not looked up in this environment"),
        };
        match count {
            0 => &[],
            // SAFETY: the array has this element type and length.
            _ => unsafe { std::slice::from_raw_parts(*arrays.add(array.index) as *const T, count) },
        }
    }
}

/// A row's action. Only [`Task::step`](super::Task::step), `before_step` and `before_substep` see one; elsewhere its values are
/// NaN.
#[derive(Clone, Copy, Debug)]
#[non_exhaustive]
pub struct Action<'a> {
    /// The values. They hold a float32 exactly.
    pub values: &'a [f64],
    /// The dtype that the caller passed: `Dtype::Float32` or `Dtype::Float64`.
    pub dtype: Dtype,
}

impl Action<'_> {
    /// `numpy.square(action).sum()`, computed in the action's dtype as NumPy does.
    pub fn sum_square(&self) -> Scalar {
        match self.dtype {
            Dtype::Float32 => Scalar::Float32(sum_of(self.values, |value| value as f32 * value as f32)),
            _ => Scalar::Float64(sum_of(self.values, |value| value * value)),
        }
    }
}

/// One row's simulation. The methods have MuJoCo's names and return its arrays, of which each element belongs to one
/// body, joint, geom and so on. Arrays marked "on demand" cost time in each step; [`Builder::need`](super::Builder::need) asks for them.
#[derive(Debug)]
pub struct Sim<'a> {
    raw: *const sys::mjenv_sim,
    shape: &'a Shape,
}

/// Defines methods that return arrays. Those that build did not ask for are null.
macro_rules! arrays {
    ($($(#[$doc:meta])* $name:ident: $count:ident, $element:ty;)*) => {$(
        $(#[$doc])*
        #[inline]
        pub fn $name(&self) -> &'a [$element] {
            let (array, count) = (self.raw().$name as *const $element, self.raw().$count);
            assert!(
                !array.is_null() || count == 0,
                concat!(stringify!($name), " is computed on demand: call b.need(\"", stringify!($name), "\") in build")
            );
            // SAFETY: the library's array has this length and keeps its values during the call of the task's method.
            unsafe { read(array, count) }
        }
    )*};
}

impl<'a> Sim<'a> {
    /// Safety: `raw` is the library's, with the arrays that `shape` tells, and nothing changes it during `'a`.
    pub(super) unsafe fn new(raw: *const sys::mjenv_sim, shape: &'a Shape) -> Self {
        Self { raw, shape }
    }

    fn raw(&self) -> &'a sys::mjenv_sim {
        // SAFETY: nothing changes the struct during the call of the task's method.
        unsafe { &*self.raw }
    }

    methods! {
        self;
        /// The time of one mj_step, s.
        timestep() -> f64 { self.raw().timestep }
        /// The time of one step of the environment, s.
        dt() -> f64 { self.raw().dt }
    }

    /// The time since the reset, s.
    pub fn time(&self) -> f64 {
        // SAFETY: the pointer is valid during the call of the task's method.
        unsafe { *self.raw().time }
    }

    /// The row's action, which [`Task::step`](super::Task::step), `before_step` and `before_substep` see. Elsewhere its values
    /// are NaN.
    pub fn action(&self) -> Action<'a> {
        // SAFETY: as in `timestep`; the array has this length.
        let (values, dtype) = unsafe { (read(self.raw().action, self.raw().action_count), self.raw().action_dtype) };
        let dtype = if dtype == sys::MJENV_DTYPE_FLOAT32 { Dtype::Float32 } else { Dtype::Float64 };
        Action { values, dtype }
    }

    /// The row's numbers of a live parameter. Panics if it was not declared in this environment.
    pub fn live<const N: usize>(&self, parameter: Live<N>) -> [f64; N] {
        // SAFETY: the library's parameters are those that the task has declared.
        unsafe { parameter.read(self.raw().parameters, self.shape.live) }
    }

    /// Numbers that the row carries. Panics if they were not declared in this environment.
    pub fn carried<const N: usize>(&self, numbers: Carry<N>) -> [f64; N] {
        // SAFETY: the numbers live during the call of the task's method, and nobody has a reference to them. `get` only
        // reads.
        unsafe { Carried::new(self.raw().carried as *mut f64, self.shape.carried) }.get(numbers)
    }

    /// An array of mjData or mjModel. Panics if it was not looked up in this environment.
    pub fn array<T: Element>(&self, array: Array<T>) -> &'a [T] {
        // SAFETY: the library's arrays are those that were looked up, and keep their values during the call of the task's
        // method.
        unsafe { self.shape.array(self.raw().arrays, array) }
    }

    /// The values of a sensor. Panics if the model does not have it.
    pub fn sensor(&self, sensor: super::Sensor) -> &'a [f64] {
        &self.sensordata()[sensor.first..][..sensor.count]
    }

    /// The contacts; on demand. Panics if build did not ask for them.
    pub fn contacts(&self) -> &'a [Contact] {
        // SAFETY: the array, if it is there, has this many contacts, which have the layout of Contact.
        unsafe {
            let contacts = self.raw().contacts;
            assert!(!contacts.is_null(), "contacts are computed on demand: call b.need(\"contacts\") in build");
            read(contacts as *const Contact, self.raw().contact_count)
        }
    }

    arrays! {
        /// The positions.
        qpos: nq, f64;
        /// The velocities.
        qvel: nv, f64;
        /// The activations of actuators.
        act: na, f64;
        /// The controls.
        ctrl: nu, f64;
        /// The accelerations.
        qacc: nv, f64;
        /// The positions of bodies, m.
        xpos: nbody, [f64; 3];
        /// The orientations of bodies: w, x, y, z.
        xquat: nbody, [f64; 4];
        /// The orientations of bodies as matrices, row by row.
        xmat: nbody, [f64; 9];
        /// The centres of mass of bodies, m.
        xipos: nbody, [f64; 3];
        /// The orientations of bodies' inertias as matrices, row by row.
        ximat: nbody, [f64; 9];
        /// The anchors of joints, m.
        xanchor: njnt, [f64; 3];
        /// The axes of joints.
        xaxis: njnt, [f64; 3];
        /// The positions of sites, m.
        site_xpos: nsite, [f64; 3];
        /// The orientations of sites as matrices, row by row.
        site_xmat: nsite, [f64; 9];
        /// The centres of mass of subtrees, m.
        subtree_com: nbody, [f64; 3];
        /// The inertias of bodies about the centre of mass of their tree.
        cinert: nbody, [f64; 10];
        /// The velocities of bodies about the centre of mass of their tree: rotation, then translation.
        cvel: nbody, [f64; 6];
        /// The values of all sensors.
        sensordata: nsensordata, f64;
        /// The lengths of actuators.
        actuator_length: nu, f64;
        /// The velocities of actuators.
        actuator_velocity: nu, f64;
        /// The forces of actuators.
        actuator_force: nu, f64;
        /// The forces of actuators on the degrees of freedom.
        qfrc_actuator: nv, f64;
        /// The passive forces on the degrees of freedom.
        qfrc_passive: nv, f64;
        /// The Coriolis, centrifugal and gravitational forces on the degrees of freedom.
        qfrc_bias: nv, f64;
        /// The forces of constraints on the degrees of freedom.
        qfrc_constraint: nv, f64;
        /// The lengths of tendons.
        ten_length: ntendon, f64;
        /// The velocities of tendons.
        ten_velocity: ntendon, f64;
        /// The model's initial positions.
        qpos0: nq, f64;
        /// The masses of bodies, kg.
        body_mass: nbody, f64;
        // These panic if build did not ask for them.
        /// The positions of geoms, m; on demand.
        geom_xpos: ngeom, [f64; 3];
        /// The orientations of geoms as matrices, row by row; on demand.
        geom_xmat: ngeom, [f64; 9];
        /// The external forces on bodies: torque, then force; on demand.
        cfrc_ext: nbody, [f64; 6];
    }
}
