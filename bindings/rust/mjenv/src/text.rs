//! Texts on their way to and from C.

use std::borrow::Cow;
use std::ffi::{CStr, CString};
use std::fmt;
use std::os::raw::c_char;

use crate::error::{Error, ErrorKind, Result};

pub(crate) fn c_string(what: fmt::Arguments<'_>, text: &str) -> Result<CString> {
    CString::new(text).map_err(|_| Error::new(ErrorKind::Argument, format!("{what} contains a NUL character")))
}

/// A text that the library wrote or was given by this crate.
///
/// # Safety
/// `text` is a C string that lives for `'a`.
pub(crate) unsafe fn borrowed<'a>(text: *const c_char) -> &'a str {
    // SAFETY: as the caller promises.
    unsafe { CStr::from_ptr(text) }.to_str().expect("texts of libmjenv are UTF-8")
}

/// A name out of a model file, which may hold any bytes.
///
/// # Safety
/// `text` is a C string that lives for `'a`.
pub(crate) unsafe fn lossy<'a>(text: *const c_char) -> Cow<'a, str> {
    // SAFETY: as the caller promises.
    unsafe { CStr::from_ptr(text) }.to_string_lossy()
}
