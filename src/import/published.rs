//! Tables that were published with robots measured by laser trackers, each read by a map of its own.

use std::path::{Path, PathBuf};

use super::column_map::ColumnMap;
use super::generic::by_map;
use super::{ImportError, ImportOptions, ImportReport};
use crate::measure::dataset::{Dataset, SampleSet};

/// Imports `ur10-ipa`: a UR10 measured with a laser tracker and T-Mac (github.com/christianlandgraf/ipa-robot-accuracy),
/// `measurements_grid.csv`, `measurements_joint_configurations.csv` or both.
///
/// Each file is a session: robot, tracker and T-Mac were set up again between them. Joints are the planned ones, not read back.
/// The world is the tracker's frame; positions are used, the T-Mac's rotations are not.
pub(super) fn ur10_ipa(files: &[PathBuf], options: &ImportOptions) -> Result<(Dataset, ImportReport), ImportError> {
    let (map, dataset) = ColumnMap::parse(Path::new("maps/ur10_ipa.toml"), include_str!("maps/ur10_ipa.toml"), Path::new(""))?;
    by_map(&map, dataset, files, &options.sets)
}

/// Imports `ur5-jacobi`, the grid and the random poses of a UR5 measured with a laser tracker
/// (github.com/pauljac7700/serial_robots_datasets).
///
/// The tracker's point is `target - dif`. The world is the robot's base as known to its controller, so all files share one base
/// and one tool. By default the first file is fitted and the others are for validation.
pub(super) fn ur5_jacobi(files: &[PathBuf], options: &ImportOptions) -> Result<(Dataset, ImportReport), ImportError> {
    let (map, dataset) =
        ColumnMap::parse(Path::new("maps/ur5_jacobi.toml"), include_str!("maps/ur5_jacobi.toml"), Path::new(""))?;
    let first_fits: Vec<SampleSet> =
        (0..files.len()).map(|k| if k == 0 { SampleSet::Fit } else { SampleSet::Validation }).collect();
    let sets = if options.sets.is_empty() { &first_fits } else { &options.sets };
    by_map(&map, dataset, files, sets)
}
