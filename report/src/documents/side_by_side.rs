//! `calibench-side-by-side/1`, printed by `compare` of several calibrations.

use calibench::judgement::side_by_side;
use calibench::judgement::side_by_side::JudgedOn;
use calibench::prediction::PoseSource;
use calibench::units::MM;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{WorkspaceMap, format_tag};
use crate::side_by_side::paired_sentence;

format_tag!(SideBySideFormat, "calibench-side-by-side/1");

/// Position errors of a calibration against those of the first, pose by pose.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct DifferenceOfErrors {
    /// Mean of its errors minus those of the first, mm; negative if it errs less.
    pub mean_mm: f64,
    /// Two standard errors of that mean, mm; null for a single pose.
    pub two_errors_mm: Option<f64>,
    /// Number of poses at which it errs less.
    pub better_at: usize,
    /// Name of the better of the two; null if these poses do not tell.
    pub better: Option<String>,
    /// The same in a sentence.
    pub sentence: String,
}

/// Distance between the tool positions that two calibrations predict for the same joint angles.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct DistanceApart {
    /// Origin of the poses: drawn in the measured `ranges` of the joints, or `drawn` in their limits.
    pub from: String,
    /// Mean, mm.
    pub mean_mm: f64,
    /// Largest, mm.
    pub max_mm: f64,
    /// Where it is how large.
    pub map: WorkspaceMap,
}

/// A calibration, judged.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct JudgedCalibration {
    /// Its file.
    pub name: String,
    /// Mean position error, mm.
    pub mean_mm: f64,
    /// The error below which 95 % of the poses lie, mm.
    pub p95_mm: f64,
    /// Largest error, mm.
    pub max_mm: f64,
    /// Against the first; null for the first itself.
    pub difference: Option<DifferenceOfErrors>,
    /// Distances from the tool positions of the first; none for the first itself, and where base or tool are not known of both.
    pub apart: Vec<DistanceApart>,
}

/// Calibrations of one robot, judged on the same rows.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SideBySide {
    /// The format.
    pub format: SideBySideFormat,
    /// Rows that judge: `held_out` of every fit, of `other_data`, or each `left_out` of a fit in turn.
    pub judged_on: String,
    /// Number of poses.
    pub poses: usize,
    /// The calibrations, in the order given.
    pub calibrations: Vec<JudgedCalibration>,
}

impl SideBySide {
    /// The document of a comparison.
    #[must_use]
    pub fn of(all: &side_by_side::SideBySide) -> Self {
        let judged_on = match all.judged_on {
            JudgedOn::HeldOut => "held_out",
            JudgedOn::OtherData => "other_data",
            JudgedOn::LeftOut => "left_out",
        };
        let first = all.all.first().map_or("", |one| one.name.as_str());
        let apart = |apart: &side_by_side::Apart| DistanceApart {
            from: if apart.at == PoseSource::Ranges { "ranges" } else { "drawn" }.into(),
            mean_mm: apart.mean / MM,
            max_mm: apart.max / MM,
            map: WorkspaceMap::of(&apart.map),
        };
        let calibration = |one: &side_by_side::Judged| JudgedCalibration {
            name: one.name.clone(),
            mean_mm: one.errors.mean / MM,
            p95_mm: one.errors.quantiles[4] / MM,
            max_mm: one.errors.max / MM,
            difference: one.difference.map(|d| DifferenceOfErrors {
                mean_mm: d.mean / MM,
                two_errors_mm: d.two_errors.is_finite().then_some(d.two_errors / MM),
                better_at: d.better_at,
                better: d.better().map(|k| [first, &one.name][k].to_owned()),
                sentence: paired_sentence(&d, [first, &one.name], all.judged_on),
            }),
            apart: one.apart.iter().map(apart).collect(),
        };
        SideBySide {
            format: SideBySideFormat::Current,
            judged_on: judged_on.into(),
            poses: all.all.first().map_or(0, |one| one.errors.samples),
            calibrations: all.all.iter().map(calibration).collect(),
        }
    }
}
