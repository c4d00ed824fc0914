//! Converts texts to and from C.

use std::borrow::Cow;
use std::ffi::CStr;
use std::os::raw::c_char;

#[cfg(feature = "library")]
pub(crate) fn c_string(what: std::fmt::Arguments<'_>, text: &str) -> crate::Result<std::ffi::CString> {
    use crate::{Error, ErrorKind};
    std::ffi::CString::new(text)
        .map_err(|_| Error::new(ErrorKind::Argument, format!("{what} contains a NUL character")))
}

/// Reads a text of which this crate knows that it is UTF-8: the library's own, or one that this crate passed in.
/// Safety: `text` is a C string that lives for `'a`.
pub(crate) unsafe fn borrowed<'a>(text: *const c_char) -> &'a str {
    // SAFETY: as the caller promises.
    unsafe { CStr::from_ptr(text) }.to_str().expect("texts of libmjenv are UTF-8")
}

/// Reads a name from a model file, which may contain any bytes. Safety: `text` is a C string that lives for `'a`.
pub(crate) unsafe fn lossy<'a>(text: *const c_char) -> Cow<'a, str> {
    // SAFETY: as the caller promises.
    unsafe { CStr::from_ptr(text) }.to_string_lossy()
}
