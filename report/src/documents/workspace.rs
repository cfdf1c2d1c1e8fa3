//! The error expected over the workspace, and the extrapolation beyond the identified joint ranges.

use calibench::prediction;
use calibench::prediction::{Banded, Extrapolation, PoseSource, WorkspaceError};
use calibench::robot::JointKind;
use calibench::units::{DEG, MM};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::ids;
use crate::workspace::Forecast;

/// Error expected in a part of the workspace.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ExpectedPart {
    /// Mean position error, mm.
    pub expected_mm: f64,
    /// Its 10-90 % band, mm.
    pub expected_band_mm: [f64; 2],
}

/// A cell of the map of the workspace.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct MapCell {
    /// Mean position error, mm.
    pub mean_mm: f64,
    /// Number of poses.
    pub poses: usize,
}

/// Map of the error by distance from axis 1 and height over the base.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct WorkspaceMap {
    /// Edges of the cells in radius, mm.
    pub radius_mm: Vec<f64>,
    /// Edges of the cells in height, mm.
    pub height_mm: Vec<f64>,
    /// Rows of cells, lowest first; null where there are no poses.
    pub cells: Vec<Vec<Option<MapCell>>>,
}

/// The position error expected over the workspace.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Workspace {
    /// Within the joint ranges of the data; null without such poses.
    pub ranges_seen: Option<ExpectedPart>,
    /// Outside of them; null without such poses.
    pub elsewhere: Option<ExpectedPart>,
    /// Mean over all poses, mm.
    pub mean_mm: f64,
    /// Its 10-90 % band, mm.
    pub mean_band_mm: [f64; 2],
    /// Largest over all poses, mm.
    pub max_mm: f64,
    /// Its 10-90 % band, mm.
    pub max_band_mm: [f64; 2],
    /// True if the poses are so far from the data that the figures are least ones; otherwise not there.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub at_least: bool,
    /// Number of poses.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub poses: Option<usize>,
    /// Origin of the poses: `validation`, or drawn in the measured `ranges` of the joints, or `drawn` in their limits.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub from: Option<String>,
    /// Map of the error.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub map: Option<WorkspaceMap>,
}

/// A joint whose angles leave the range in which it was identified.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct JointOutside {
    /// Joint, counted from 1.
    pub joint: usize,
    /// Identified range, deg.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub identified_deg: Option<[f64; 2]>,
    /// Identified range of a prismatic joint, mm.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub identified_mm: Option<[f64; 2]>,
    /// Number of poses outside of it.
    pub samples: usize,
    /// Largest distance from the range, deg.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub farthest_deg: Option<f64>,
    /// Largest distance from the range of a prismatic joint, mm.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub farthest_mm: Option<f64>,
}

/// Poses outside the joint ranges of a calibration.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct OutsideRange {
    /// Number of poses outside.
    pub samples: usize,
    /// Number of all poses.
    pub of: usize,
    /// The joints concerned.
    pub joints: Vec<JointOutside>,
    /// Effects whose shape is known only where it was measured.
    pub shapes: Vec<String>,
}

impl ExpectedPart {
    fn of(b: &Banded) -> Self {
        ExpectedPart { expected_mm: b.expected / MM, expected_band_mm: [b.low / MM, b.high / MM] }
    }
}

impl Workspace {
    /// The error without poses and map.
    #[must_use]
    pub fn of(w: &WorkspaceError) -> Self {
        let [mean, max] = [&w.mean, &w.max].map(ExpectedPart::of);
        let from = match w.at {
            PoseSource::Validation => "validation",
            PoseSource::Ranges => "ranges",
            PoseSource::Limits => "drawn",
        };
        Workspace {
            ranges_seen: w.ranges_seen.as_ref().map(ExpectedPart::of),
            elsewhere: w.elsewhere.as_ref().map(ExpectedPart::of),
            at_least: w.at_least,
            mean_mm: mean.expected_mm,
            mean_band_mm: mean.expected_band_mm,
            max_mm: max.expected_mm,
            max_band_mm: max.expected_band_mm,
            poses: Some(w.poses.len()),
            from: Some(from.into()),
            map: None,
        }
    }

    /// The whole forecast.
    #[must_use]
    pub fn of_forecast(forecast: &Forecast) -> Self {
        Workspace { map: Some(WorkspaceMap::of(&forecast.error.map())), ..Workspace::of(&forecast.error) }
    }
}

impl WorkspaceMap {
    pub(crate) fn of(map: &prediction::WorkspaceMap) -> Self {
        let mm = |edges: &[f64]| edges.iter().map(|x| x / MM).collect::<Vec<f64>>();
        WorkspaceMap {
            radius_mm: mm(&map.radius),
            height_mm: mm(&map.height),
            cells: map.cells.iter().map(|row| MapCell::row(row)).collect(),
        }
    }
}

impl MapCell {
    /// A row of a map.
    pub(crate) fn row(row: &[Option<prediction::MapCell>]) -> Vec<Option<MapCell>> {
        row.iter().map(|c| c.map(|c| MapCell { mean_mm: c.error / MM, poses: c.poses })).collect()
    }
}

impl OutsideRange {
    /// The poses beyond the ranges, or `None` if there are none.
    #[must_use]
    pub fn of(e: &Extrapolation) -> Option<Self> {
        let turns = |j: &prediction::OutsideRange| j.kind == JointKind::Revolute;
        let joint = |j: &prediction::OutsideRange| JointOutside {
            joint: j.joint,
            identified_deg: turns(j).then(|| j.identified.map(|x| x / DEG)),
            identified_mm: (!turns(j)).then(|| j.identified.map(|x| x / MM)),
            samples: j.poses,
            farthest_deg: turns(j).then_some(j.farthest / DEG),
            farthest_mm: (!turns(j)).then_some(j.farthest / MM),
        };
        (e.outside > 0).then(|| OutsideRange {
            samples: e.outside,
            of: e.poses,
            joints: e.joints.iter().map(joint).collect(),
            shapes: ids(&e.shapes),
        })
    }
}
