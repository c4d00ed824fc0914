//! What the library tells about an environment: fields and spaces.

use std::borrow::Cow;

use mjenv_sys as sys;

use crate::text;

/// What a list of fields describes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Role {
    /// The terms of an observation, in order.
    Observation,
    /// The actuators.
    Action,
    /// The info of a step.
    Info,
    /// The info of a reset.
    ResetInfo,
    /// The reward: one field.
    Reward,
    /// Gymnasium's `observation_structure`: names and counts; empty where Gymnasium has none.
    Structure,
    /// Arrays of a row's mjData, for [`Env::read`](crate::Env::read).
    Data,
    /// Sizes, options and arrays of the mjModel, for [`Env::read`](crate::Env::read).
    Model,
    /// The mjData arrays that the option `arrays` names, for [`Batch::array`](crate::Batch::array).
    Arrays,
}

impl Role {
    pub(crate) fn raw(self) -> sys::mjenv_role {
        match self {
            Self::Observation => sys::MJENV_ROLE_OBSERVATION,
            Self::Action => sys::MJENV_ROLE_ACTION,
            Self::Info => sys::MJENV_ROLE_INFO,
            Self::ResetInfo => sys::MJENV_ROLE_RESET_INFO,
            Self::Reward => sys::MJENV_ROLE_REWARD,
            Self::Structure => sys::MJENV_ROLE_STRUCTURE,
            Self::Data => sys::MJENV_ROLE_DATA,
            Self::Model => sys::MJENV_ROLE_MODEL,
            Self::Arrays => sys::MJENV_ROLE_ARRAYS,
        }
    }
}

/// The type that Gymnasium gives a value. Here all values are `f64`; each fits exactly.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum ValueType {
    /// `np.float64`
    Float64,
    /// `np.float32` when the action is float32, else `np.float64`
    Action,
    /// `float`
    NativeFloat,
    /// `int`
    NativeInt,
    /// `np.int64`
    Int64,
    /// `np.float32`: some mjModel arrays
    Float32,
    /// `np.int32`: mjModel and mjData arrays
    Int32,
    /// `np.uint8`: flags and pixels in mjModel
    Uint8,
    /// A type that this version of the crate does not know.
    Unknown,
}

impl ValueType {
    fn from_raw(raw: i32) -> Self {
        match raw {
            sys::MJENV_TYPE_FLOAT64 => Self::Float64,
            sys::MJENV_TYPE_ACTION => Self::Action,
            sys::MJENV_TYPE_NATIVE_FLOAT => Self::NativeFloat,
            sys::MJENV_TYPE_NATIVE_INT => Self::NativeInt,
            sys::MJENV_TYPE_INT64 => Self::Int64,
            sys::MJENV_TYPE_FLOAT32 => Self::Float32,
            sys::MJENV_TYPE_INT32 => Self::Int32,
            sys::MJENV_TYPE_UINT8 => Self::Uint8,
            _ => Self::Unknown,
        }
    }
}

/// One named term of an observation, an action or an info; one readable array.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Field<'a> {
    /// The name, Gymnasium's or MuJoCo's.
    pub name: Cow<'a, str>,
    /// What it is, with the unit where there is one; empty when the name says it all.
    pub doc: &'a str,
    /// Where its first element is within one row's record.
    pub offset: usize,
    /// How many elements it has: the product of the shape.
    pub count: usize,
    /// The type that Gymnasium gives its values.
    pub value_type: ValueType,
    shape: [usize; 4],
    ndim: usize,
}

impl<'a> Field<'a> {
    /// # Safety
    /// The texts of `raw` live for `'a`.
    pub(crate) unsafe fn from_raw(raw: &sys::mjenv_field) -> Self {
        // SAFETY: as the caller promises. A field may be named after an actuator of the user's model.
        let (name, doc) = unsafe { (text::lossy(raw.name), text::borrowed(raw.doc)) };
        Self {
            name,
            doc,
            offset: size(raw.offset),
            count: size(raw.count),
            value_type: ValueType::from_raw(raw.type_),
            shape: raw.shape.map(size),
            ndim: size(raw.ndim.into()).min(4),
        }
    }

    /// The extents, empty for a scalar.
    pub fn shape(&self) -> &[usize] {
        &self.shape[..self.ndim]
    }
}

/// A floating point type, as NumPy names it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Dtype {
    /// `f64`
    Float64,
    /// `f32`
    Float32,
}

/// Gymnasium's `Box` space of one row. The bounds may be infinite.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Space<'a> {
    /// As Gymnasium declares it: float64 observations, float32 actions.
    pub dtype: Dtype,
    /// The least value of each element.
    pub low: &'a [f64],
    /// The greatest value of each element.
    pub high: &'a [f64],
}

impl Space<'_> {
    /// How many elements a row has.
    pub fn count(&self) -> usize {
        self.low.len()
    }
}

/// A size that the library counts in a signed integer.
pub(crate) fn size(count: i64) -> usize {
    usize::try_from(count).unwrap_or(0)
}

/// An index or a size on its way to the library, which refuses what it cannot use.
pub(crate) fn int64(size: usize) -> i64 {
    i64::try_from(size).unwrap_or(i64::MAX)
}

/// The value of a `struct_size`.
pub(crate) fn size_of<T>() -> u32 {
    std::mem::size_of::<T>() as u32
}
