//! `ur10-ipa`: a UR10 measured with a laser tracker and T-Mac (github.com/christianlandgraf/ipa-robot-accuracy).
//!
//! Each file is a session: robot, tracker and T-Mac were set up again between them. Joints are the planned ones, not read back.
//! The world is the tracker's frame; positions are used, the T-Mac's rotations are not.

use std::path::{Path, PathBuf};

use super::column_map::ColumnMap;
use super::generic::by_map;
use super::{ImportError, ImportOptions, ImportReport};
use crate::measure::dataset::Dataset;

/// Imports `measurements_grid.csv`, `measurements_joint_configurations.csv` or both.
pub(super) fn import(files: &[PathBuf], options: &ImportOptions) -> Result<(Dataset, ImportReport), ImportError> {
    let (map, dataset) = ColumnMap::parse(Path::new("maps/ur10_ipa.toml"), include_str!("maps/ur10_ipa.toml"), Path::new(""))?;
    by_map(&map, dataset, files, &options.sets)
}
