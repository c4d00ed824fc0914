use std::fmt;

use mjenv_sys as sys;

use crate::text;

/// The result of a function that can fail.
pub type Result<T> = std::result::Result<T, Error>;

/// What kind of failure it was. Programs should decide by this kind, never by the message.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
#[repr(i32)]
pub enum ErrorKind {
    /// A text contains a NUL character, or the environment of a renderer was dropped.
    Argument = sys::MJENV_E_ARGUMENT,
    /// There is no id, option, array, field or object of this name. The message lists the valid names.
    Name = sys::MJENV_E_NAME,
    /// The option holds another kind of value than the one given or asked for.
    Type = sys::MJENV_E_TYPE,
    /// A value is outside its bounds, or NaN or infinite where a finite number is needed.
    Value = sys::MJENV_E_VALUE,
    /// A slice or a batch has another length than needed.
    Size = sys::MJENV_E_SIZE,
    /// A row was never reset. For its random stream: it was neither seeded nor reset.
    NotReset = sys::MJENV_E_NOT_RESET,
    /// The episode of a row has ended. Reset the row first.
    EpisodeEnded = sys::MJENV_E_EPISODE_ENDED,
    /// Rows are under way. Receive them first.
    Pending = sys::MJENV_E_PENDING,
    /// No rows are under way, so there is nothing to receive.
    NotPending = sys::MJENV_E_NOT_PENDING,
    /// Another thread is using the environment. Only a [`Renderer`](crate::Renderer) on another thread can cause this:
    /// the compiler prevents all other cases.
    Busy = sys::MJENV_E_BUSY,
    /// This process was forked, and the threads of the environment stayed in its parent.
    Forked = sys::MJENV_E_FORKED,
    /// The model file does not exist or cannot be read.
    File = sys::MJENV_E_FILE,
    /// A model is malformed, is refused, or lacks what the call needs.
    Model = sys::MJENV_E_MODEL,
    /// MuJoCo reported an error in at least one row. The other rows were stepped.
    Physics = sys::MJENV_E_PHYSICS,
    /// An image is damaged, or it comes from another environment: another id, model or options.
    Snapshot = sys::MJENV_E_SNAPSHOT,
    /// There is not enough memory.
    Memory = sys::MJENV_E_MEMORY,
    /// OpenGL is missing or failed. The message names what to install.
    Render = sys::MJENV_E_RENDER,
    /// A callback of a registered task failed, or a plug-in holds no tasks.
    Task = sys::MJENV_E_TASK,
    /// The library has a bug, or its version does not fit this crate. Please report it.
    Internal = sys::MJENV_E_INTERNAL,
}

impl ErrorKind {
    /// Returns the kind of a status of the C interface that is no success.
    pub fn from_status(status: sys::mjenv_status) -> Self {
        use ErrorKind::*;
        let known = [
            Argument,
            Name,
            Type,
            Value,
            Size,
            NotReset,
            EpisodeEnded,
            Pending,
            NotPending,
            Busy,
            Forked,
            File,
            Model,
            Physics,
            Snapshot,
            Memory,
            Render,
            Task,
        ];
        known.into_iter().find(|kind| *kind as i32 == status).unwrap_or(Internal)
    }
}

/// Why a call failed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Error {
    kind: ErrorKind,
    message: String,
}

impl Error {
    /// Makes an error, for crates that have functions of the same kind.
    pub fn new(kind: ErrorKind, message: String) -> Self {
        Self { kind, message }
    }

    methods! {
        self;
        /// Returns what kind of failure it was.
        kind() -> ErrorKind { self.kind }
        /// Returns the reason in words. It names the wrong argument and, where there are some, the valid choices.
        message() -> &str { &self.message }
    }
}

impl fmt::Display for Error {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(&self.message)
    }
}

impl std::error::Error for Error {}

/// Turns the status that a call on this thread has just returned into a result.
pub(crate) fn check(status: sys::mjenv_status) -> Result<()> {
    // SAFETY: the text is valid until this thread's next failing call, and it is copied here. It may quote names of a
    // model, which need not be UTF-8.
    match status {
        sys::MJENV_OK => Ok(()),
        _ => {
            let reason = unsafe { text::lossy(sys::mjenv_last_error()) }.into_owned();
            Err(Error::new(ErrorKind::from_status(status), reason))
        }
    }
}

/// Calls a function of the library with the handle of `raw()`.
macro_rules! call {
    ($owner:ident.$function:ident($($argument:expr),* $(,)?)) => {
        // SAFETY: the handle is alive. Pointers are valid for the call, to as many elements as are passed beside them; a
        // mask that is not null has a flag for each row, and the arrays of a batch have the sizes that it states.
        $crate::error::check(unsafe { mjenv_sys::$function($owner.raw() $(, $argument)*) })
    };
}
pub(crate) use call;

/// Handles that are destroyed with their owners.
macro_rules! owned {
    ($($owner:ident: $raw:ident, $destroy:ident;)*) => {$(
        impl $owner {
            /// Returns the handle in the C interface, for crates that call functions of `mjenv-sys`.
            pub fn raw(&self) -> *mut mjenv_sys::$raw {
                self.raw.as_ptr()
            }
        }

        impl Drop for $owner {
            fn drop(&mut self) {
                // SAFETY: the handle is alive and owned; nobody uses it after this.
                unsafe { mjenv_sys::$destroy(self.raw()) }
            }
        }
    )*};
}
pub(crate) use owned;

pub(crate) fn check_abi() -> Result<()> {
    // SAFETY: the function takes nothing.
    let (found, needed) = (unsafe { sys::mjenv_abi_version() }, sys::MJENV_ABI_VERSION);
    if found == needed {
        return Ok(());
    }
    let message = format!("libmjenv has ABI version {found}, this program was built for {needed}");
    Err(Error::new(ErrorKind::Internal, message))
}

pub(crate) fn check_length(what: &str, given: usize, needed: usize) -> Result<()> {
    if given == needed {
        return Ok(());
    }
    Err(Error::new(ErrorKind::Size, format!("{what} has {given} element(s), not {needed}")))
}
