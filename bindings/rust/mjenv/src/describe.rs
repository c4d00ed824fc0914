//! How the library describes an environment: fields and spaces.

use std::borrow::Cow;

use mjenv_sys as sys;

use crate::text;

/// What the fields of a list describe.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
#[repr(i32)]
pub enum Role {
    /// The terms of an observation, in order.
    Observation = sys::MJENV_ROLE_OBSERVATION,
    /// The actuators.
    Action = sys::MJENV_ROLE_ACTION,
    /// The info of a step.
    Info = sys::MJENV_ROLE_INFO,
    /// The info of a reset.
    ResetInfo = sys::MJENV_ROLE_RESET_INFO,
    /// The reward, which is one field.
    Reward = sys::MJENV_ROLE_REWARD,
    /// Gymnasium's `observation_structure`: names and numbers of elements. It is empty where Gymnasium has none.
    Structure = sys::MJENV_ROLE_STRUCTURE,
    /// The arrays of a row's mjData that [`Env::read`](crate::Env::read) takes.
    Data = sys::MJENV_ROLE_DATA,
    /// The sizes, options and arrays of the mjModel that [`Env::read`](crate::Env::read) takes.
    Model = sys::MJENV_ROLE_MODEL,
    /// The mjData arrays that the option `arrays` names, see [`Batch::array`](crate::Batch::array).
    Arrays = sys::MJENV_ROLE_ARRAYS,
    /// The live parameters of a task, which [`Env::read`](crate::Env::read) and [`Env::write`](crate::Env::write) take.
    Parameters = sys::MJENV_ROLE_PARAMETERS,
    /// The keys of an observation that is a Gymnasium Dict: its groups, and the terms without a group. Each is a part of
    /// the observation, see [`Batch::group`](crate::Batch::group). There are none if it is a Box.
    Groups = sys::MJENV_ROLE_GROUPS,
}

/// A type of numbers. That of a field is the one that Gymnasium gives its values; in this crate all of them are `f64`, which
/// holds each exactly.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
#[repr(i32)]
pub enum Dtype {
    /// `np.float64`
    Float64 = sys::MJENV_DTYPE_FLOAT64,
    /// `np.float32` when the action is float32, else `np.float64`
    Action = sys::MJENV_DTYPE_ACTION,
    /// `float`
    NativeFloat = sys::MJENV_DTYPE_NATIVE_FLOAT,
    /// `int`
    NativeInt = sys::MJENV_DTYPE_NATIVE_INT,
    /// `np.int64`
    Int64 = sys::MJENV_DTYPE_INT64,
    /// `np.float32`: some mjModel arrays
    Float32 = sys::MJENV_DTYPE_FLOAT32,
    /// `np.int32`: mjModel and mjData arrays
    Int32 = sys::MJENV_DTYPE_INT32,
    /// `np.uint8`: flags and pixels in mjModel
    Uint8 = sys::MJENV_DTYPE_UINT8,
    /// A type that this version of the crate does not know.
    Unknown = i32::MAX,
}

impl Dtype {
    pub(crate) fn from_raw(raw: sys::mjenv_dtype) -> Self {
        use Dtype::*;
        let known = [Float64, Action, NativeFloat, NativeInt, Int64, Float32, Int32, Uint8];
        known.into_iter().find(|dtype| *dtype as i32 == raw).unwrap_or(Unknown)
    }
}

/// A term of an observation, an actuator, an info, or an array of MuJoCo.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Field<'a> {
    /// Its name in Gymnasium or MuJoCo.
    pub name: Cow<'a, str>,
    /// What it is, with its unit. It is empty if the name says enough.
    pub doc: &'a str,
    /// The position of its first element among the elements of one row.
    pub offset: usize,
    /// The number of its elements: the product of the shape.
    pub count: usize,
    /// The type that Gymnasium gives its values.
    pub dtype: Dtype,
    shape: [usize; 4],
    ndim: usize,
}

impl<'a> Field<'a> {
    /// Safety: the texts of `raw` live for `'a`.
    pub(crate) unsafe fn from_raw(raw: &sys::mjenv_field) -> Self {
        // SAFETY: as the caller promises. The name may be that of an actuator in the user's model, of any bytes.
        let (name, doc) = unsafe { (text::lossy(raw.name), text::borrowed(raw.doc)) };
        Self {
            name,
            doc,
            offset: size(raw.offset),
            count: size(raw.count),
            dtype: Dtype::from_raw(raw.dtype),
            shape: raw.shape.map(size),
            ndim: size(raw.ndim.into()).min(4),
        }
    }

    /// Returns the shape; it is empty for a scalar.
    pub fn shape(&self) -> &[usize] {
        &self.shape[..self.ndim]
    }
}

/// The space of one row's observation or action: Gymnasium's `Box`. The bounds may be infinite.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Space<'a> {
    /// The type that Gymnasium declares: float64 for observations, float32 for actions.
    pub dtype: Dtype,
    /// The lowest value of each element.
    pub low: &'a [f64],
    /// The highest value of each element.
    pub high: &'a [f64],
    pub(crate) ndim: usize,
    pub(crate) shape: [usize; 4],
}

impl Space<'_> {
    methods! {
        self;
        /// Returns the number of elements.
        count() -> usize { self.low.len() }
        /// Returns the length of each dimension: two if the option `history` stacks whole observations, else one.
        shape() -> &[usize] { &self.shape[..self.ndim] }
    }
}

/// Converts a size from the library, which counts in signed integers.
pub(crate) fn size(count: i64) -> usize {
    usize::try_from(count).unwrap_or(0)
}

/// Converts an index or a size for the library. If it does not fit, the library gets a number that it refuses.
pub(crate) fn int64(size: usize) -> i64 {
    i64::try_from(size).unwrap_or(i64::MAX)
}

/// Returns the value of `struct_size` for a struct.
pub(crate) fn size_of<T>() -> u32 {
    std::mem::size_of::<T>() as u32
}
