//! Which robot a dataset is of.

use std::path::Path;
use std::sync::Arc;

use crate::robot::{BUILT_IN, Robot, built_in};

/// The robot that `reference` names: a built-in, or a file relative to `folder`. The message of the error is the problem.
pub(crate) fn resolve_robot(reference: &str, _folder: &Path) -> Result<Arc<Robot>, String> {
    built_in(reference).map(Arc::new).ok_or_else(|| format!("there is no robot `{reference}`; built in are {}", BUILT_IN.join(", ")))
}
