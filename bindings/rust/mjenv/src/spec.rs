//! What the library is and which environments it has.

use mjenv_sys as sys;

use crate::describe;
use crate::error::{self, Result};
use crate::text;

/// Returns the versions of the library and of MuJoCo: `"major.minor.patch (MuJoCo x.y.z)"`.
pub fn version() -> &'static str {
    // SAFETY: the text is static.
    unsafe { text::borrowed(sys::mjenv_version()) }
}

/// Returns the ids of all environments, sorted.
pub fn ids() -> impl ExactSizeIterator<Item = &'static str> {
    // SAFETY: the function takes nothing.
    let count = describe::size(unsafe { sys::mjenv_id_count() });
    // SAFETY: the index is in range, so the result is a static text.
    (0..count).map(|index| unsafe { text::borrowed(sys::mjenv_id_at(index as i64)) })
}

/// What Gymnasium registers for an id.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Spec {
    /// The id, for example `"Ant-v5"`.
    pub id: &'static str,
    /// The id without its version: `"Ant"`.
    pub robot: &'static str,
    /// The version of the task: 4 or 5.
    pub version: i32,
    /// After this many steps an episode is truncated. It is the default of the option `max_episode_steps`.
    pub max_episode_steps: i64,
    /// The return at which Gymnasium counts the task as solved; `None` where Gymnasium states none.
    pub reward_threshold: Option<f64>,
}

/// Returns what Gymnasium registers for an id. Errors: `ErrorKind::Name` (there is no such id).
pub fn spec(id: &str) -> Result<Spec> {
    error::check_abi()?;
    let id = text::c_string(format_args!("id {id:?}"), id)?;
    let mut raw = sys::mjenv_spec { struct_size: describe::size_of::<sys::mjenv_spec>(), ..Default::default() };
    // SAFETY: both pointers are valid for the call.
    error::check(unsafe { sys::mjenv_spec_of(id.as_ptr(), &mut raw) })?;
    // SAFETY: the texts belong to no handle and are static.
    let (id, robot) = unsafe { (text::borrowed(raw.id), text::borrowed(raw.robot)) };
    Ok(Spec {
        id,
        robot,
        version: raw.version,
        max_episode_steps: raw.max_episode_steps,
        reward_threshold: Some(raw.reward_threshold).filter(|threshold| !threshold.is_nan()),
    })
}
