use std::collections::BTreeMap;
use std::ffi::CStr;
use std::fmt;
use std::ptr::{self, NonNull};

use mjenv_sys as sys;

use crate::describe::{int64, size, size_of};
use crate::error::{call, check, owned, Error, ErrorKind, Result};
use crate::text::{borrowed, c_string};
use crate::Spec;

/// What kind of value an option holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
#[repr(i32)]
pub enum Kind {
    /// A `bool`.
    Flag = sys::MJENV_KIND_FLAG,
    /// An `i64`.
    Integer = sys::MJENV_KIND_INTEGER,
    /// One or more `f64`.
    Reals = sys::MJENV_KIND_REALS,
    /// A text.
    String = sys::MJENV_KIND_STRING,
    /// A name or an index of an object: a text or an `i64`.
    StringOrInteger = sys::MJENV_KIND_STRING_OR_INT,
    /// A kind that this version of the crate does not know.
    Unknown = i32::MAX,
}

impl Kind {
    fn from_raw(raw: sys::mjenv_kind) -> Self {
        let known = [Self::Flag, Self::Integer, Self::Reals, Self::String, Self::StringOrInteger];
        known.into_iter().find(|kind| *kind as i32 == raw).unwrap_or(Self::Unknown)
    }
}

/// Describes one constructor option.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct OptionInfo<'a> {
    /// Gymnasium's name for it.
    pub name: &'a str,
    /// What the option does.
    pub doc: &'a str,
    /// What kind of value it holds.
    pub kind: Kind,
    /// The lowest valid value of each number; infinite if there is no bound. It has no meaning for a text.
    pub low: f64,
    /// The highest valid value of each number; infinite if there is no bound. It has no meaning for a text.
    pub high: f64,
    /// How many numbers it holds: 2 for a range.
    pub count: usize,
    choices: &'a str,
}

impl<'a> OptionInfo<'a> {
    /// Returns the valid texts. If there are none, every text may be tried.
    pub fn choices(&self) -> impl Iterator<Item = &'a str> {
        self.choices.split_whitespace()
    }
}

/// The value of an option.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Value {
    /// The value of a [`Kind::Flag`].
    Flag(bool),
    /// The value of a [`Kind::Integer`], or the index in a [`Kind::StringOrInteger`]. You may also set a
    /// [`Kind::Reals`] of one number to an integer: some infos and rewards are then integers in Gymnasium, and
    /// [`Field::dtype`](crate::Field::dtype) says so.
    Integer(i64),
    /// All numbers of a [`Kind::Reals`].
    Reals(Vec<f64>),
    /// The value of a [`Kind::String`], or the name in a [`Kind::StringOrInteger`].
    Text(String),
}

/// Values from the types that always fit.
macro_rules! values {
    ($($type:ty: $value:ident => $made:expr;)*) => {$(
        impl From<$type> for Value {
            fn from($value: $type) -> Self {
                $made
            }
        }
    )*};
}

values! {
    bool: flag => Self::Flag(flag);
    f32: real => Self::Reals(vec![real.into()]);
    f64: real => Self::Reals(vec![real]);
    &str: text => Self::Text(text.to_string());
    String: text => Self::Text(text);
}

/// Values from the types of integers that `i64` holds, and from those that may not fit.
macro_rules! integers {
    ($($small:ty)*; $($wide:ty)*) => {
        values! { $($small: integer => Self::Integer(integer.into());)* }
        $(
            /// Fails if the number does not fit into an `i64`.
            impl TryFrom<$wide> for Value {
                type Error = Error;

                fn try_from(integer: $wide) -> Result<Self> {
                    let too_wide = |_| Error::new(ErrorKind::Value, format!("{integer} does not fit into an i64"));
                    integer.try_into().map(Self::Integer).map_err(too_wide)
                }
            }
        )*
        values_to! { $($small: Value::Integer(number) => (*number).try_into().ok();)* }
        values_to! { $($wide: Value::Integer(number) => (*number).try_into().ok();)* }
    };
}

/// The values that a type holds.
macro_rules! values_to {
    ($($type:ty: $pattern:pat => $made:expr;)*) => {$(
        impl TryFrom<Value> for $type {
            type Error = Value;

            fn try_from(value: Value) -> std::result::Result<Self, Value> {
                let made: Option<Self> = match &value {
                    $pattern => $made,
                    _ => None,
                };
                made.ok_or(value)
            }
        }
    )*};
}

integers!(i8 i16 i32 i64 u8 u16 u32; isize u64 usize i128 u128);

values_to! {
    bool: Value::Flag(flag) => Some(*flag);
    f64: Value::Reals(reals) => <[f64; 1]>::try_from(&reals[..]).ok().map(|[real]| real);
    Vec<f64>: Value::Reals(reals) => Some(reals.clone());
    String: Value::Text(text) => Some(text.clone());
}

/// For the types that an `f64` holds exactly, as the two below.
impl<T: Into<f64> + Copy> From<&[T]> for Value {
    fn from(reals: &[T]) -> Self {
        Self::Reals(reals.iter().map(|&real| real.into()).collect())
    }
}

impl<T: Into<f64> + Copy, const N: usize> From<[T; N]> for Value {
    fn from(reals: [T; N]) -> Self {
        reals[..].into()
    }
}

impl<T: Into<f64> + Copy> From<Vec<T>> for Value {
    fn from(reals: Vec<T>) -> Self {
        reals[..].into()
    }
}

/// The constructor options of one environment id.
///
/// ```
/// # fn main() -> Result<(), mjenv::Error> {
/// let mut options = mjenv::Options::new("Humanoid-v5")?;
/// options.set("healthy_reward", 4.5)?.set("include_cvel_in_observation", false)?;
/// assert_eq!(options.get::<f64>("healthy_reward")?, 4.5);
/// for option in options.schema() {
///     println!("{} in [{}, {}]: {}", option.name, option.low, option.high, option.doc);
/// }
/// # Ok(())
/// # }
/// ```
pub struct Options {
    raw: NonNull<sys::mjenv_options>,
    spec: Spec,
    /// What was set; a clone sets it again. Reading the options cannot tell whether a real number was set to an
    /// integer.
    changes: BTreeMap<String, Value>,
}

// SAFETY: any thread may use options, and different options are independent.
unsafe impl Send for Options {}

// SAFETY: methods that take `&self` only read, and the library lets several threads read options at the same time.
unsafe impl Sync for Options {}

impl Options {
    /// Returns the options of an id at their defaults. Errors: [`ErrorKind::Name`], [`ErrorKind::Memory`].
    pub fn new(id: &str) -> Result<Self> {
        let spec = crate::spec(id)?;
        let id = c_string(format_args!("id {id:?}"), id)?;
        let mut raw = ptr::null_mut();
        // SAFETY: both pointers are valid for the call.
        check(unsafe { sys::mjenv_options_create(id.as_ptr(), &mut raw) })?;
        let raw = NonNull::new(raw).expect("libmjenv creates options or fails");
        Ok(Self { raw, spec, changes: BTreeMap::new() })
    }

    /// Clones the options; returns an error if there is not enough memory.
    pub(crate) fn try_clone(&self) -> Result<Self> {
        let mut copy = Self::new(self.spec.id)?;
        for (name, value) in &self.changes {
            copy.set(name, value.clone())?;
        }
        Ok(copy)
    }

    /// Returns what Gymnasium registers for the id.
    pub fn spec(&self) -> Spec {
        self.spec
    }

    /// Describes all options, in Gymnasium's order.
    pub fn schema(&self) -> impl ExactSizeIterator<Item = OptionInfo<'_>> + '_ {
        // SAFETY: the handle is alive.
        let count = size(unsafe { sys::mjenv_options_count(self.raw()) });
        (0..count).map(move |index| self.info(index))
    }

    fn info(&self, index: usize) -> OptionInfo<'_> {
        let mut raw = sys::mjenv_option { struct_size: size_of::<sys::mjenv_option>(), ..Default::default() };
        call!(self.mjenv_options_at(int64(index), &mut raw)).expect("an option has a description");
        // SAFETY: the texts belong to the options; setting an option changes none of them.
        unsafe {
            OptionInfo {
                name: borrowed(raw.name),
                doc: borrowed(raw.doc),
                kind: Kind::from_raw(raw.kind),
                low: raw.low,
                high: raw.high,
                count: size(raw.count),
                choices: if raw.choices.is_null() { "" } else { borrowed(raw.choices) },
            }
        }
    }

    /// Sets an option; returns the options, so that calls can be chained with `?`.
    ///
    /// `value` is a `bool`, a text, an integer of any type, an `f32` or `f64`, or for several numbers an array, a slice
    /// or a `Vec`. Errors: [`ErrorKind::Name`], [`ErrorKind::Type`], [`ErrorKind::Value`] (also for an integer that
    /// does not fit into an `i64`), [`ErrorKind::Size`], [`ErrorKind::Argument`].
    pub fn set<V>(&mut self, name: &str, value: V) -> Result<&mut Self>
    where
        V: TryInto<Value>,
        V::Error: fmt::Display,
    {
        let refusal = |reason| Error::new(ErrorKind::Value, format!("option {name:?}: {reason}"));
        let value = value.try_into().map_err(refusal)?;
        let name_c = c_string(format_args!("option {name:?}"), name)?;
        let (raw, key) = (self.raw.as_ptr(), name_c.as_ptr());
        // SAFETY: all pointers are valid for the call, and the library keeps none of them.
        check(unsafe {
            match &value {
                Value::Flag(flag) => sys::mjenv_options_set_integer(raw, key, (*flag).into()),
                Value::Integer(integer) => sys::mjenv_options_set_integer(raw, key, *integer),
                Value::Reals(reals) => sys::mjenv_options_set_reals(raw, key, reals.as_ptr(), int64(reals.len())),
                Value::Text(text) => {
                    let text = c_string(format_args!("the text for option {name:?}"), text)?;
                    sys::mjenv_options_set_string(raw, key, text.as_ptr())
                }
            }
        })?;
        self.changes.insert(name.to_string(), value);
        Ok(self)
    }

    /// Reads an option as a `bool`, an integer of any type, an `f64`, a `Vec<f64>` or a `String`. Errors:
    /// [`ErrorKind::Name`], [`ErrorKind::Type`] (also for an integer that the type does not hold),
    /// [`ErrorKind::Argument`].
    pub fn get<T: TryFrom<Value, Error = Value>>(&self, name: &str) -> Result<T> {
        T::try_from(self.value(name)?).map_err(|held| {
            let message = format!("option {name:?} holds {held:?}, not a {}", std::any::type_name::<T>());
            Error::new(ErrorKind::Type, message)
        })
    }

    /// Reads an option of any kind. Errors: [`ErrorKind::Name`], [`ErrorKind::Argument`].
    pub fn value(&self, name: &str) -> Result<Value> {
        let kind = self.schema().find(|option| option.name == name).map(|option| option.kind);
        let name = c_string(format_args!("option {name:?}"), name)?;
        match kind {
            Some(Kind::Flag) => Ok(Value::Flag(self.integer(&name)? != 0)),
            Some(Kind::Reals) => self.reals(&name),
            Some(Kind::String) => self.text(&name),
            Some(Kind::StringOrInteger) => self.integer(&name).map(Value::Integer).or_else(|_| self.text(&name)),
            // For an unknown name this fails, and the library's message lists the valid names.
            _ => self.integer(&name).map(Value::Integer),
        }
    }

    fn integer(&self, name: &CStr) -> Result<i64> {
        let mut value = 0;
        call!(self.mjenv_options_get_integer(name.as_ptr(), &mut value))?;
        Ok(value)
    }

    fn reals(&self, name: &CStr) -> Result<Value> {
        let mut count = 0;
        call!(self.mjenv_options_get_reals(name.as_ptr(), ptr::null_mut(), 0, &mut count))?;
        let mut values = vec![0.0; size(count)];
        call!(self.mjenv_options_get_reals(name.as_ptr(), values.as_mut_ptr(), count, &mut count))?;
        Ok(Value::Reals(values))
    }

    fn text(&self, name: &CStr) -> Result<Value> {
        let mut text = ptr::null();
        call!(self.mjenv_options_get_string(name.as_ptr(), &mut text))?;
        // SAFETY: the text lives until the option is set again; it is copied here.
        Ok(Value::Text(unsafe { borrowed(text) }.to_string()))
    }
}

/// Panics if there is not enough memory.
impl Clone for Options {
    fn clone(&self) -> Self {
        self.try_clone().expect("the library accepted these options before")
    }
}

owned! { Options: mjenv_options, mjenv_options_destroy; }

impl fmt::Debug for Options {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut values = formatter.debug_struct(self.spec.id);
        for option in self.schema() {
            if let Ok(value) = self.value(option.name) {
                values.field(option.name, &value);
            }
        }
        values.finish()
    }
}
