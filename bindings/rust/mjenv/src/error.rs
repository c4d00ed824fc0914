use std::fmt;

use mjenv_sys as sys;

use crate::text;

/// The result of a function that can fail.
pub type Result<T> = std::result::Result<T, Error>;

/// What kind of failure it was. Programs should decide by this kind, never by the message.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum ErrorKind {
    /// A text contains a NUL character, or the environment of a renderer was dropped.
    Argument,
    /// There is no id, option, array, field or object of this name. The message lists the valid names.
    Name,
    /// The option holds another kind of value than the one given or asked for.
    Type,
    /// A value is outside its bounds, or NaN or infinite where a finite number is needed.
    Value,
    /// A slice or a batch has another length than needed.
    Size,
    /// A row was never reset. For its random stream: it was neither seeded nor reset.
    NotReset,
    /// The episode of a row has ended. Reset the row first.
    EpisodeEnded,
    /// Rows are under way. Receive them first.
    Pending,
    /// No rows are under way, so there is nothing to receive.
    NotPending,
    /// Another thread is using the environment. Only a [`Renderer`](crate::Renderer) on another thread can cause this:
    /// the compiler prevents all other cases.
    Busy,
    /// This process was forked, and the threads of the environment stayed in its parent.
    Forked,
    /// The model file does not exist or cannot be read.
    File,
    /// A model is malformed, is refused, or lacks what the call needs.
    Model,
    /// MuJoCo reported an error in at least one row. The other rows were stepped.
    Physics,
    /// An image is damaged, or it comes from another environment: another id, model or options.
    Snapshot,
    /// There is not enough memory.
    Memory,
    /// OpenGL is missing or failed. The message names what to install.
    Render,
    /// A callback of a registered task failed, or a plug-in holds no tasks.
    Task,
    /// The library has a bug, or its version does not fit this crate. Please report it.
    Internal,
}

impl ErrorKind {
    /// Returns the kind of a status of the C interface that is no success.
    #[must_use]
    pub fn from_status(status: sys::mjenv_status) -> Self {
        match status {
            sys::MJENV_E_ARGUMENT => Self::Argument,
            sys::MJENV_E_NAME => Self::Name,
            sys::MJENV_E_TYPE => Self::Type,
            sys::MJENV_E_VALUE => Self::Value,
            sys::MJENV_E_SIZE => Self::Size,
            sys::MJENV_E_NOT_RESET => Self::NotReset,
            sys::MJENV_E_EPISODE_ENDED => Self::EpisodeEnded,
            sys::MJENV_E_PENDING => Self::Pending,
            sys::MJENV_E_NOT_PENDING => Self::NotPending,
            sys::MJENV_E_BUSY => Self::Busy,
            sys::MJENV_E_FORKED => Self::Forked,
            sys::MJENV_E_FILE => Self::File,
            sys::MJENV_E_MODEL => Self::Model,
            sys::MJENV_E_PHYSICS => Self::Physics,
            sys::MJENV_E_SNAPSHOT => Self::Snapshot,
            sys::MJENV_E_MEMORY => Self::Memory,
            sys::MJENV_E_RENDER => Self::Render,
            sys::MJENV_E_TASK => Self::Task,
            _ => Self::Internal,
        }
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
    #[must_use]
    pub fn new(kind: ErrorKind, message: String) -> Self {
        Self { kind, message }
    }

    /// Returns what kind of failure it was.
    #[must_use]
    pub fn kind(&self) -> ErrorKind {
        self.kind
    }

    /// Returns the reason in words. It names the wrong argument and, where there are some, the valid choices.
    #[must_use]
    pub fn message(&self) -> &str {
        &self.message
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
