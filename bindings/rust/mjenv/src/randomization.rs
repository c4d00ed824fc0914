//! Draws of resets for the model, and noise, delays and pushes, as a JSON document.

use std::borrow::Cow;
use std::ptr;

use crate::error::{call, Result};
use crate::text::{c_string, lossy};
use crate::Env;

impl Env {
    /// Replaces the parts of the document of draws, noise, delays and pushes that this one has, from each row's next
    /// reset on; null removes a part. docs/randomisation.md describes the document. Later, `env.write(&rows, "draws[0]",
    /// &[low, high])` changes the parameters of the first draw for some rows.
    /// Errors: `ErrorKind::Name`, `ErrorKind::Type`, `ErrorKind::Value`, `ErrorKind::Size`. After an error nothing has
    /// changed.
    pub fn randomize(&mut self, document: &str) -> Result<()> {
        let document = c_string(format_args!("the document"), document)?;
        call!(self.mjenv_randomize(document.as_ptr()))
    }

    /// The document with all parts that are set.
    pub fn randomization(&self) -> Result<Cow<'_, str>> {
        let mut document = ptr::null();
        call!(self.mjenv_randomization(&mut document))?;
        // SAFETY: the text belongs to the environment, and `randomize` needs it mutable to replace the text.
        Ok(unsafe { lossy(document) })
    }
}
