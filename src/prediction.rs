//! Prediction: the error to expect over the workspace, at poses that nobody measured, with its spread.

pub(crate) mod at_new_poses;
mod chance;
mod expected_error;
pub mod field;
pub(crate) mod level;
mod map;
mod outside_range;
pub(crate) mod poses;
pub mod posterior;
pub mod worker;
pub(crate) mod workspace;

pub use expected_error::{Banded, ExpectedError, WorkspaceError};
pub use map::{MapCell, WorkspaceMap};
pub use outside_range::{Extrapolation, OutsideRange};
pub use poses::{PoseSource, WORKSPACE_POSES, WorkspacePoses, undetermined, workspace_poses};
