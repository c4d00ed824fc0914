//! The fields that a task writes: the terms of its observation, its info and its reset info.

use std::borrow::Borrow;
use std::marker::PhantomData;

use super::Dtype;
use crate::numpy::Scalar;

/// A number that [`Fields::put`] takes: `f64`, [`Scalar`], an integer or a `bool`.
pub trait Value {
    /// The type that the value has in Python.
    const TYPE: Dtype;

    /// Returns the value as the library stores it.
    fn number(self) -> f64;
}

/// Implements Value for a type.
macro_rules! values {
    ($($type:ty: $dtype:ident, $number:expr;)*) => {$(
        impl Value for $type {
            const TYPE: Dtype = Dtype::$dtype;

            #[inline]
            fn number(self) -> f64 {
                let number: fn(Self) -> f64 = $number;
                number(self)
            }
        }
    )*};
}

values! {
    f64: Float64, |value| value;
    Scalar: Action, f64::from;
    i32: NativeInt, f64::from;
    u32: NativeInt, f64::from;
    bool: NativeInt, |value| f64::from(u8::from(value));
}

/// A field that a trial call found.
#[derive(Debug)]
pub(super) struct Entry {
    pub(super) name: String,
    pub(super) doc: String,
    pub(super) group: String,
    pub(super) dtype: Dtype,
    /// The length of a vector; `None`: a scalar.
    pub(super) length: Option<usize>,
}

impl Entry {
    pub(super) fn count(&self) -> usize {
        self.length.unwrap_or(1)
    }
}

/// Receives named fields, one after the other. Each call of a method must write the same fields in the same order, and a
/// field must always have the same length.
#[derive(Debug)]
pub struct Fields<'a> {
    target: Target<'a>,
    wrong: Option<String>,
}

#[derive(Debug)]
enum Target<'a> {
    /// In a trial call.
    Learned(&'a mut Vec<Entry>),
    Memory {
        expected: &'a [Entry],
        to: *mut f64,
        memory: PhantomData<&'a mut f64>,
    },
}

impl<'a> Fields<'a> {
    pub(super) fn learn(entries: &'a mut Vec<Entry>) -> Self {
        Self { target: Target::Learned(entries), wrong: None }
    }

    /// Safety: there is memory at `to` for all fields in `expected`, and nothing else uses it during `'a`.
    pub(super) unsafe fn write(expected: &'a [Entry], to: *mut f64) -> Self {
        Self { target: Target::Memory { expected, to, memory: PhantomData }, wrong: None }
    }

    /// Writes a field that is one number. Its type in Python is np.float64 for an `f64`, the dtype of the action for a
    /// [`Scalar`], and int for an integer or a `bool`.
    #[inline]
    pub fn put<V: Value>(&mut self, name: &str, value: V) -> Put<'_> {
        match self.next(name) {
            Some((None, to)) => {
                // SAFETY: there is memory for the field.
                unsafe { to.write(value.number()) };
                Put(None)
            }
            Some((Some(needed), _)) => self.other(name, V::TYPE, None, Some(needed)),
            None => self.other(name, V::TYPE, None, None),
        }
    }

    /// Writes a field that is a vector of any length: a slice, an array, an iterator.
    #[inline]
    pub fn put_all<I>(&mut self, name: &str, values: I) -> Put<'_>
    where
        I: IntoIterator,
        I::Item: Borrow<f64>,
    {
        let mut values = values.into_iter();
        let (needed, to) = match self.next(name) {
            Some((Some(needed), to)) => (needed, to),
            Some((None, _)) => return self.other(name, Dtype::Float64, Some(values.count()), Some(1)),
            None => return self.other(name, Dtype::Float64, Some(values.count()), None),
        };
        let mut found = 0;
        for (place, value) in values.by_ref().take(needed).enumerate() {
            // SAFETY: there is memory for `needed` numbers.
            unsafe { to.add(place).write(*value.borrow()) };
            found += 1;
        }
        found += values.count();
        match found == needed {
            true => Put(None),
            false => self.other(name, Dtype::Float64, Some(found), Some(needed)),
        }
    }

    /// Moves to the next field if the expected field has this name and no field was wrong. Returns the length and the
    /// memory of the expected field; `None` if it has another name, or in a trial call.
    #[inline]
    fn next(&mut self, name: &str) -> Option<(Option<usize>, *mut f64)> {
        match &mut self.target {
            Target::Memory { expected, to, .. } if self.wrong.is_none() => {
                let (entry, rest) = expected.split_first().filter(|(entry, _)| entry.name == name)?;
                let place = *to;
                // SAFETY: there is memory for the fields that are expected, of which this is the next.
                *to = unsafe { to.add(entry.count()) };
                *expected = rest;
                Some((entry.length, place))
            }
            _ => None,
        }
    }

    /// Records a field in a trial call; in other calls records that a field is wrong.
    #[cold]
    fn other(&mut self, name: &str, dtype: Dtype, length: Option<usize>, needed: Option<usize>) -> Put<'_> {
        match &mut self.target {
            Target::Learned(entries) => {
                if entries.iter().any(|entry| entry.name == name) {
                    self.wrong.get_or_insert_with(|| format!("the field {name:?} is written twice"));
                }
                let (name, doc, group) = (name.to_string(), String::new(), String::new());
                entries.push(Entry { name, doc, group, dtype, length });
                Put(entries.last_mut())
            }
            Target::Memory { expected, .. } => {
                self.wrong.get_or_insert_with(|| match (length, needed, expected.first()) {
                    (None, Some(_), _) => {
                        format!("the field {name:?} is one number, but it was a vector in the trial call")
                    }
                    (Some(length), Some(needed), _) => {
                        format!("the field {name:?} has {length} number(s), but it had {needed} in the trial call")
                    }
                    (.., Some(next)) => {
                        format!("the field {name:?} is written where the trial call wrote {:?}", next.name)
                    }
                    (.., None) => format!("the field {name:?} is written, but the trial call did not write it"),
                });
                Put(None)
            }
        }
    }

    /// Returns what is wrong with the fields that were written, if something is.
    #[inline]
    pub(super) fn finish(self) -> super::Result {
        match (self.wrong, self.target) {
            (None, Target::Learned(_) | Target::Memory { expected: [], .. }) => Ok(()),
            (Some(wrong), _) => Err(wrong.into()),
            (None, Target::Memory { expected: [next, ..], .. }) => {
                Err(format!("the field {:?} is not written, but it was in the trial call", next.name).into())
            }
        }
    }
}

/// A field that has just been written, to say more about it.
#[derive(Debug)]
pub struct Put<'a>(Option<&'a mut Entry>);

impl Put<'_> {
    /// One line of documentation with the unit.
    pub fn doc(self, text: &str) -> Self {
        self.change(|entry| entry.doc = text.to_string())
    }

    /// The group to which a term of the observation belongs, such as `"policy"` or `"critic"`. Write the terms of a group
    /// one after the other. With groups, the observation is a Gymnasium Dict (the option `observation`).
    pub fn group(self, name: &str) -> Self {
        self.change(|entry| entry.group = name.to_string())
    }

    /// The type that the value has in Python.
    pub fn dtype(self, dtype: Dtype) -> Self {
        self.change(|entry| entry.dtype = dtype)
    }

    #[inline]
    fn change(mut self, set: impl FnOnce(&mut Entry)) -> Self {
        if let Some(entry) = &mut self.0 {
            set(entry);
        }
        self
    }
}
