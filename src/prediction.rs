//! Prediction: the error to expect over the workspace, at poses that nobody measured, with its spread.

pub(crate) mod at_new_poses;
mod chance;
pub mod field;
pub(crate) mod level;
mod map;
mod outside_range;
pub mod posterior;
pub mod worker;
pub(crate) mod workspace;

pub use map::{MapCell, WorkspaceMap};
pub use outside_range::{Extrapolation, OutsideRange};
pub use workspace::{
    Banded, ExpectedError, PoseSource, WORKSPACE_POSES, WorkspaceError, WorkspacePoses, undetermined, workspace_poses,
};
