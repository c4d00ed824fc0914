//! Registers tasks and loads plug-ins.

use std::ffi::CString;
use std::os::unix::ffi::OsStrExt;
use std::path::Path;

use mjenv_sys as sys;

use crate::error::{check, check_abi, Error, ErrorKind, Result};
use crate::task::{Description, Task};

/// Registers a task for the rest of the process: its id can then be used like a built-in one. Any thread may call this
/// at any time. Errors: [`ErrorKind::Value`] (the id is malformed or already registered, or a number is out of its
/// bounds), [`ErrorKind::Argument`] (a name is missing), [`ErrorKind::Task`] (`build` failed when it listed the
/// options).
pub fn register<T: Task>() -> Result<()> {
    check_abi()?;
    let description = Description::of::<T>().map_err(|reason| Error::new(ErrorKind::Task, reason))?;
    // SAFETY: the library copies the description; the callbacks are code of this program.
    check(unsafe { sys::mjenv_register_task(description.raw()) })
}

/// Loads a plug-in, a shared object with tasks, and registers them: all, or none if one is refused. The plug-in is
/// never unloaded. Loading it again does nothing. Any thread may call this at any time.
///
/// A plug-in is code that runs in this process, in whatever language it is written. So load only what you trust.
///
/// The environment variable `MJENV_TASKS` lists plug-ins, separated by `:`, that the library loads by itself. Errors:
/// [`ErrorKind::Task`] (the file is no plug-in, or was built for another ABI version), and those of [`register`].
pub fn load_tasks(path: impl AsRef<Path>) -> Result<()> {
    check_abi()?;
    let path = path.as_ref();
    let text = CString::new(path.as_os_str().as_bytes())
        .map_err(|_| Error::new(ErrorKind::Argument, format!("path {path:?} contains a NUL character")))?;
    // SAFETY: the text is valid for the call.
    check(unsafe { sys::mjenv_load_tasks(text.as_ptr()) })
}
