//! `ur5-jacobi`: a UR5 measured with a laser tracker (github.com/pauljac7700/serial_robots_datasets).
//!
//! The tracker's point is `target - dif`. The world is the robot's base as known to its controller, so all files share one base
//! and one tool. By default the first file is fitted and the others are for validation.

use std::path::{Path, PathBuf};

use super::column_map::ColumnMap;
use super::generic::by_map;
use super::{ImportError, ImportOptions, ImportReport};
use crate::measure::dataset::{Dataset, SampleSet};

/// Imports the grid and the random poses.
pub(super) fn import(files: &[PathBuf], options: &ImportOptions) -> Result<(Dataset, ImportReport), ImportError> {
    let (map, dataset) =
        ColumnMap::parse(Path::new("maps/ur5_jacobi.toml"), include_str!("maps/ur5_jacobi.toml"), Path::new(""))?;
    let first_fits: Vec<SampleSet> =
        (0..files.len()).map(|k| if k == 0 { SampleSet::Fit } else { SampleSet::Validation }).collect();
    let sets = if options.sets.is_empty() { &first_fits } else { &options.sets };
    by_map(&map, dataset, files, sets)
}
