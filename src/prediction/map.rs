//! Map of the expected error over the workspace, by distance from axis 1 and height.

use super::expected_error::{ExpectedError, WorkspaceError, expected_errors};
use crate::measure::dataset::Dataset;

/// Number of cells in each direction.
const CELLS: usize = 5;

/// One cell of the map: a ring around axis 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MapCell {
    /// Mean of the expected errors of its poses, m.
    pub error: f64,
    /// Number of poses in it.
    pub poses: usize,
}

/// The workspace divided into rings around axis 1.
#[derive(Debug, Clone, PartialEq)]
pub struct WorkspaceMap {
    /// Edges in distance from axis 1, m, ascending; one more than there are cells.
    pub radius: Vec<f64>,
    /// Edges in height above the base, along axis 1, m, ascending; one more than there are cells.
    pub height: Vec<f64>,
    /// Row by row, lowest first, each from axis 1 outwards; `None` if a cell contains no pose.
    pub cells: Vec<Vec<Option<MapCell>>>,
}

impl WorkspaceError {
    /// Maps the error over radius and height, with five cells each between the extremes of the poses.
    ///
    /// ```
    /// use calibench::nalgebra::Vector3;
    /// use calibench::prediction::{Banded, ExpectedError, MapCell, PoseSource, WorkspaceError};
    ///
    /// // Two poses at the axis, one far out and high.
    /// let pose = |radius, height, error| ExpectedError { q: Vec::new(), tcp: Vector3::zeros(), radius, height, error };
    /// let poses = vec![pose(0.0, 0.0, 1.0), pose(0.1, 0.0, 3.0), pose(1.0, 2.0, 5.0)];
    /// # let none = Banded { expected: 0.0, low: 0.0, high: 0.0 };
    /// # let (at, mean, max, ranges_seen, elsewhere, noise, at_least) = (PoseSource::Limits, none, none, None, None, 0.0, false);
    /// # let expected = WorkspaceError { at, mean, max, ranges_seen, elsewhere, poses, noise, at_least };
    /// let map = expected.map();
    /// assert_eq!(map.cells[0][0], Some(MapCell { error: 2.0, poses: 2 }));
    /// assert_eq!(map.cells[4][4], Some(MapCell { error: 5.0, poses: 1 }));
    /// assert_eq!(map.cells[2][2], None);
    /// ```
    pub fn map(&self) -> WorkspaceMap {
        WorkspaceMap::of(&self.poses)
    }
}

impl WorkspaceMap {
    /// The map of some other length, m, of each posture (rad, N) of the robot and set-up of a dataset.
    pub(crate) fn over(dataset: &Dataset, postures: &[Vec<f64>], length: impl Fn(usize) -> f64) -> Self {
        WorkspaceMap::of(&expected_errors(dataset, postures, length))
    }

    fn of(all: &[ExpectedError]) -> Self {
        let edges = |of: &dyn Fn(usize) -> f64| {
            let range = (0..all.len()).map(of).fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)));
            (0..=CELLS).map(|k| range.0 + (range.1 - range.0) * k as f64 / CELLS as f64).collect::<Vec<f64>>()
        };
        let (radius, height) = (edges(&|p| all[p].radius), edges(&|p| all[p].height));
        let mut cells = vec![vec![None; CELLS]; CELLS];
        let within = |edges: &[f64], x: f64| edges[1..CELLS].iter().filter(|edge| x >= **edge).count();
        for pose in all {
            let cell = &mut cells[within(&height, pose.height)][within(&radius, pose.radius)];
            let MapCell { error, poses } = cell.unwrap_or(MapCell { error: 0.0, poses: 0 });
            *cell = Some(MapCell { error: error + pose.error, poses: poses + 1 });
        }
        cells.iter_mut().flatten().flatten().for_each(|cell| cell.error /= cell.poses as f64);
        WorkspaceMap { radius, height, cells }
    }
}

#[cfg(test)]
mod tests {
    use super::super::expected_error::Banded;
    use super::super::poses::PoseSource;
    use super::*;
    use nalgebra::Vector3;

    #[test]
    fn every_pose_is_in_one_cell_and_empty_cells_stay_empty() {
        let pose = |radius, height, error| ExpectedError { q: Vec::new(), tcp: Vector3::zeros(), radius, height, error };
        let none = Banded { expected: 0.0, low: 0.0, high: 0.0 };
        let poses = vec![pose(0.0, 0.0, 1.0), pose(0.1, 0.0, 3.0), pose(1.0, 2.0, 5.0)];
        let map = WorkspaceError {
            at: PoseSource::Limits,
            mean: none,
            max: none,
            ranges_seen: None,
            elsewhere: None,
            poses,
            noise: 0.0,
            at_least: false,
        }
        .map();
        assert_eq!(map.cells[0][0], Some(MapCell { error: 2.0, poses: 2 }));
        assert_eq!(map.cells[4][4], Some(MapCell { error: 5.0, poses: 1 }));
        assert_eq!(map.cells.iter().flatten().flatten().map(|c| c.poses).sum::<usize>(), 3);
        assert_eq!((map.radius[0], map.radius[5], map.height[5]), (0.0, 1.0, 2.0));
    }
}
