//! The decisive figure: the position error expected over the workspace, its map, and the extrapolation beyond the identified
//! ranges.

use serde_json::{Value, json};

use super::tables::plain_rows;
use calibench::assess::{Banded, Extrapolation, PoseSource, WorkspaceError};
use calibench::units::{DEG, MM};

/// A predicted error over the workspace and the origin of its poses.
#[derive(Debug, Clone, PartialEq)]
pub struct Forecast {
    /// The prediction.
    pub error: WorkspaceError,
    /// Origin of the poses.
    pub source: PoseSource,
    /// Extent of the poses beyond those of the fit.
    pub extrapolation: Extrapolation,
}

fn banded(b: &Banded) -> String {
    format!("{:.3} mm ({:.3} to {:.3})", b.expected / MM, b.low / MM, b.high / MM)
}

impl Forecast {
    /// Describes the poses in words.
    pub fn poses(&self) -> String {
        let count = self.error.poses.len();
        match self.source {
            PoseSource::Validation => format!("the {count} validation poses"),
            PoseSource::Drawn => {
                format!(
                    "{count} poses drawn uniformly within the joint limits, clear of the robot itself (no validation rows name better ones)"
                )
            }
        }
    }

    /// The prediction in a sentence.
    pub fn sentence(&self) -> String {
        format!(
            "Position error to expect of this calibration over the workspace: mean {}, largest {} (in brackets 10 to 90 % of the draws; docs/comparing.md tells how far to trust them); at {}.",
            banded(&self.error.mean),
            banded(&self.error.max),
            self.poses()
        )
    }

    /// Mean and largest error with their bands, the poses, and the map.
    pub fn json(&self) -> Value {
        let map = self.error.map();
        let mm = |edges: &[f64]| edges.iter().map(|x| x / MM).collect::<Vec<f64>>();
        let cells: Vec<Vec<Value>> = map
            .cells
            .iter()
            .map(|row| {
                row.iter().map(|c| c.map_or(Value::Null, |c| json!({"mean_mm": c.error / MM, "poses": c.poses}))).collect()
            })
            .collect();
        let mut value = workspace_json(&self.error);
        value["poses"] = json!(self.error.poses.len());
        value["from"] = json!(match self.source {
            PoseSource::Validation => "validation",
            PoseSource::Drawn => "drawn",
        });
        value["map"] = json!({"radius_mm": mm(&map.radius), "height_mm": mm(&map.height), "cells": cells});
        value
    }

    /// Expected error by distance from axis 1 (columns) and height over the base (rows, highest first), mm; blank cells hold no
    /// poses.
    pub fn map_table(&self) -> String {
        let map = self.error.map();
        let between =
            |edges: &[f64]| edges.windows(2).map(|e| format!("{:.0} .. {:.0}", e[0] / MM, e[1] / MM)).collect::<Vec<_>>();
        let header: Vec<String> = std::iter::once("height \\ radius, mm".to_owned()).chain(between(&map.radius)).collect();
        let rows: Vec<Vec<String>> = between(&map.height)
            .into_iter()
            .zip(&map.cells)
            .rev()
            .map(|(height, cells)| {
                let cells = cells.iter().map(|c| c.map_or_else(String::new, |c| format!("{:.3}", c.error / MM)));
                std::iter::once(height).chain(cells).collect()
            })
            .collect();
        plain_rows(&header, &rows)
    }
}

/// Explains why no error over the workspace is predicted: set-up numbers not determined by the data, by name, or a lack of
/// poses.
pub fn no_forecast_sentence(undetermined: &[String]) -> String {
    const WHAT: &str = "The position error to expect over the workspace cannot be predicted";
    match undetermined {
        [] => format!("{WHAT}: no pose of the robot is clear of itself."),
        [one] => {
            format!("{WHAT}: {one} is kept at its nominal value, and these data do not determine it. Measure at more places.")
        }
        several => format!(
            "{WHAT}: {} are kept at their nominal values, and these data do not determine them. Measure at more places.",
            several.join(", ")
        ),
    }
}

/// Mean and largest error with their bands.
pub(super) fn workspace_json(w: &WorkspaceError) -> Value {
    let part = |b: &Option<Banded>| {
        b.as_ref().map(|b| json!({"expected_mm": b.expected / MM, "expected_band_mm": [b.low / MM, b.high / MM]}))
    };
    json!({"ranges_seen": part(&w.ranges_seen), "elsewhere": part(&w.elsewhere),
        "mean_mm": w.mean.expected / MM, "mean_band_mm": [w.mean.low / MM, w.mean.high / MM],
        "max_mm": w.max.expected / MM, "max_band_mm": [w.max.low / MM, w.max.high / MM]})
}

/// Poses beyond the joint ranges of a calibration, for the key `outside_range` of the documents; null if there are none.
pub fn extrapolation_json(e: &Extrapolation) -> Value {
    if e.outside == 0 {
        return Value::Null;
    }
    let joints: Vec<Value> = e
        .joints
        .iter()
        .map(|j| {
            json!({"joint": j.joint, "identified_deg": [j.identified[0] / DEG, j.identified[1] / DEG], "samples": j.poses,
                "farthest_deg": j.farthest / DEG})
        })
        .collect();
    json!({"samples": e.outside, "of": e.poses, "joints": joints, "shapes": e.shapes})
}

/// The same as a warning; `None` if every pose lies within the ranges.
pub fn extrapolation_sentence(e: &Extrapolation) -> Option<String> {
    if e.outside == 0 {
        return None;
    }
    let joint = |j: &calibench::assess::OutsideRange| {
        format!(
            "joint {} in {} (up to {:.1} deg outside {:.1} .. {:.1})",
            j.joint,
            j.poses,
            j.farthest / DEG,
            j.identified[0] / DEG,
            j.identified[1] / DEG
        )
    };
    let joints: Vec<String> = e.joints.iter().map(joint).collect();
    let plain = format!(
        "{} of {} poses lie outside the joint ranges in which the calibration was identified: {}.",
        e.outside,
        e.poses,
        joints.join(", ")
    );
    Some(if e.shapes.is_empty() {
        format!("warning: {plain}")
    } else {
        format!(
            "WARNING: {plain} The shapes of {} are known only where they were seen: THERE THEIR CORRECTION IS A GUESS. Measure there, or leave them out.",
            e.shapes.join(", ")
        )
    })
}
