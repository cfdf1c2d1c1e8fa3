//! The position error to expect at poses, as figures with bands.

use nalgebra::{Point3, Vector3};

use super::level::MEAN_LENGTH;
use super::poses::PoseSource;
use crate::measure::dataset::Dataset;
use crate::robot::kinematics::world_from_tool;

/// Position error expected at one pose.
#[derive(Debug, Clone, PartialEq)]
pub struct ExpectedError {
    /// Joint angles, rad (N).
    pub q: Vec<f64>,
    /// TCP in the world, m.
    pub tcp: Vector3<f64>,
    /// Distance of the TCP from axis 1, m.
    pub radius: f64,
    /// Height of the TCP above the base, along axis 1, m.
    pub height: f64,
    /// Expected length of the error, m.
    pub error: f64,
}

/// A figure with the band of its draws.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Banded {
    /// Expected value.
    pub expected: f64,
    /// 10 % quantile.
    pub low: f64,
    /// 90 % quantile.
    pub high: f64,
}

impl Banded {
    pub(super) fn of(mut draws: Vec<f64>) -> Self {
        draws.sort_by(f64::total_cmp);
        let at = |share: f64| draws[((draws.len() - 1) as f64 * share).round() as usize];
        Banded { expected: draws.iter().sum::<f64>() / draws.len() as f64, low: at(0.1), high: at(0.9) }
    }
}

/// Expected position error of a calibration over the workspace.
#[derive(Debug, Clone, PartialEq)]
pub struct WorkspaceError {
    /// Where the robot is expected to err so.
    pub at: PoseSource,
    /// Mean over the poses, m.
    pub mean: Banded,
    /// Largest error among the poses, m.
    pub max: Banded,
    /// Mean over the poses inside the joint ranges and the TCP box of the fit, each extended by a tenth, m; `None` if
    /// there are none.
    pub ranges_seen: Option<Banded>,
    /// Mean over the other poses, m; `None` if there are none.
    pub elsewhere: Option<Banded>,
    /// One entry per pose.
    pub poses: Vec<ExpectedError>,
    /// One-sigma of the instrument noise per axis, m, which a measured error would contain as well; zero if unknown.
    pub noise: f64,
    /// True if nothing that was left out is as far from the rest as these poses are from the campaign: the figures are then
    /// least ones.
    pub at_least: bool,
}

impl WorkspaceError {
    /// The mean error that an instrument would measure, including its own noise, m.
    ///
    /// ```
    /// use std::f64::consts::PI;
    ///
    /// use calibench::prediction::{Banded, PoseSource, WorkspaceError};
    /// use calibench::units::UM;
    ///
    /// // Of a perfect robot an instrument of 10 µm per axis measures its own noise: 2 sqrt(2 / pi) times that, by Maxwell.
    /// let none = Banded { expected: 0.0, low: 0.0, high: 0.0 };
    /// # let (ranges_seen, elsewhere, poses) = (None, None, Vec::new());
    /// let (noise, at_least) = (10.0 * UM, false);
    /// let perfect = WorkspaceError { at: PoseSource::Limits, mean: none, max: none, ranges_seen, elsewhere, poses, noise, at_least };
    /// assert!((perfect.mean_as_measured() - 2.0 * (2.0 / PI).sqrt() * 10.0 * UM).abs() < 1e-15);
    /// ```
    pub fn mean_as_measured(&self) -> f64 {
        self.as_measured(self.mean.expected)
    }

    /// The 10 and 90 % quantiles of that mean, m.
    pub fn band_as_measured(&self) -> [f64; 2] {
        [self.mean.low, self.mean.high].map(|x| self.as_measured(x))
    }

    /// Each figure as drawn, or as the campaign measures at left-out postures as far away, where that is larger: draws know of
    /// effects that a campaign absorbs, and a campaign of effects that nobody draws.
    pub(super) fn or_as_measured(self, measured: &WorkspaceError) -> Self {
        let larger = |drawn: Banded, measured: Banded| if measured.expected > drawn.expected { measured } else { drawn };
        let both = |drawn: Option<Banded>, measured: Option<Banded>| match (drawn, measured) {
            (Some(drawn), Some(measured)) => Some(larger(drawn, measured)),
            (one, other) => one.or(other),
        };
        let factor = (measured.mean.expected / self.mean.expected).max(1.0);
        WorkspaceError {
            at: self.at,
            mean: larger(self.mean, measured.mean),
            max: larger(self.max, measured.max),
            ranges_seen: both(self.ranges_seen, measured.ranges_seen),
            elsewhere: both(self.elsewhere, measured.elsewhere),
            poses: self.poses.into_iter().map(|pose| ExpectedError { error: factor * pose.error, ..pose }).collect(),
            noise: self.noise,
            at_least: measured.at_least,
        }
    }

    fn as_measured(&self, error: f64) -> f64 {
        error.hypot(MEAN_LENGTH * self.noise)
    }
}

/// The poses with the error of each, m, in the cell of `there`.
pub(super) fn expected_errors(there: &Dataset, poses: &[Vec<f64>], error: impl Fn(usize) -> f64) -> Vec<ExpectedError> {
    let base_from_world = there.base.pose().inverse();
    let expected = |(p, q): (usize, &Vec<f64>)| {
        let tcp = world_from_tool(&there.robot, &there.base, &there.tool, q).translation.vector;
        let in_base = base_from_world * Point3::from(tcp);
        let (radius, height) = (in_base.x.hypot(in_base.y), in_base.z);
        ExpectedError { q: q.clone(), tcp, radius, height, error: error(p) }
    };
    poses.iter().enumerate().map(expected).collect()
}
