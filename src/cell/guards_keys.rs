//! The keys of `[guards]` and `[trical]` in a cell file.

use std::sync::Arc;

use nalgebra::Vector3;
use serde::Deserialize;

use super::guards::Guards;
use super::{CellReading, TriCal};
use crate::files::FileError;
use crate::robot::{FramePose, Robot};
use crate::units::{DEG, MM};

/// Upper limit of any step, m: the paper's safe range of the gauge (section 2.1).
const LONGEST_STEP: f64 = TriCal::PAPER.safe_range;

/// Limits on the motions of the arm.
#[derive(Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, default)]
pub(crate) struct GuardsKeys {
    /// Longest step along an axis of the tool, mm; at most 5.
    #[cfg_attr(feature = "schema", schemars(extend("exclusiveMinimum" = 0)))]
    max_step_mm: f64,
    /// Margin that the joints keep from their limits, deg; `calibench plan cell.toml` keeps it too.
    #[cfg_attr(feature = "schema", schemars(range(min = 0.0)))]
    joint_margin_deg: f64,
    /// Lower and upper corner, world frame, mm, of the box that the TCP must not leave, including during motions; balls and
    /// their approaches must lie inside it. No box if not given.
    workspace_mm: Option<[[f64; 3]; 2]>,
}

impl Default for GuardsKeys {
    fn default() -> Self {
        GuardsKeys { max_step_mm: LONGEST_STEP / MM, joint_margin_deg: 0.0, workspace_mm: None }
    }
}

impl GuardsKeys {
    /// Reads the guards of an arm with this base and tool.
    ///
    /// # Errors
    /// When a value is invalid.
    pub(crate) fn guards(
        &self,
        reading: &CellReading<'_>,
        robot: &Arc<Robot>,
        base: FramePose,
        tool: FramePose,
    ) -> Result<Guards, FileError> {
        let max_step = reading.positive("guards.max_step_mm", self.max_step_mm)? * MM;
        // The factor allows for rounding.
        if max_step > LONGEST_STEP * (1.0 + 1e-12) {
            let problem = format!("{} mm are more than the safe range of the gauge", self.max_step_mm);
            return Err(reading.wrong("guards.max_step_mm", problem, "give 5 or less"));
        }
        if self.joint_margin_deg < 0.0 {
            let problem = format!("{} is negative", self.joint_margin_deg);
            return Err(reading.wrong("guards.joint_margin_deg", problem, "give zero or more"));
        }
        let workspace = self.workspace_mm.map(|corners| corners.map(|corner| Vector3::from(corner) * MM));
        if workspace.is_some_and(|[low, high]| (0..3).any(|k| low[k] >= high[k])) {
            let remedy = "give the lower corner, then the upper one";
            return Err(reading.wrong("guards.workspace_mm", "the box is empty", remedy));
        }
        Ok(Guards { robot: Arc::clone(robot), base, tool, joint_margin: self.joint_margin_deg * DEG, max_step, workspace })
    }
}

/// The gauge, its plungers and its balls.
#[derive(Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, default)]
pub(crate) struct TriCalKeys {
    /// Diameter of the balls that are centred, mm.
    #[cfg_attr(feature = "schema", schemars(extend("exclusiveMinimum" = 0)))]
    datum_diameter_mm: f64,
    /// Diameter of the master ball, mm; larger than the others.
    #[cfg_attr(feature = "schema", schemars(extend("exclusiveMinimum" = 0)))]
    master_diameter_mm: f64,
    /// Travel of the plungers, mm.
    #[cfg_attr(feature = "schema", schemars(extend("exclusiveMinimum" = 0)))]
    travel_mm: f64,
    /// Diameter of the flat tips of the plungers, mm.
    #[cfg_attr(feature = "schema", schemars(extend("exclusiveMinimum" = 0)))]
    tip_diameter_mm: f64,
}

impl Default for TriCalKeys {
    fn default() -> Self {
        let TriCal { datum_radius, master_radius, travel, tip_radius, .. } = TriCal::PAPER;
        TriCalKeys {
            datum_diameter_mm: 2.0 * datum_radius / MM,
            master_diameter_mm: 2.0 * master_radius / MM,
            travel_mm: travel / MM,
            tip_diameter_mm: 2.0 * tip_radius / MM,
        }
    }
}

impl TriCalKeys {
    /// Reads the gauge and its balls.
    ///
    /// # Errors
    /// When a value is invalid.
    pub(crate) fn trical(&self, reading: &CellReading<'_>) -> Result<TriCal, FileError> {
        let radius = |key: &str, diameter: f64| Ok(0.5 * reading.positive(key, diameter)? * MM);
        let trical = TriCal {
            datum_radius: radius("trical.datum_diameter_mm", self.datum_diameter_mm)?,
            master_radius: radius("trical.master_diameter_mm", self.master_diameter_mm)?,
            travel: reading.positive("trical.travel_mm", self.travel_mm)? * MM,
            tip_radius: radius("trical.tip_diameter_mm", self.tip_diameter_mm)?,
            safe_range: LONGEST_STEP,
        };
        if trical.master_radius <= trical.datum_radius {
            let remedy = "give the larger of the two as the master ball";
            return Err(reading.wrong(
                "trical.master_diameter_mm",
                "the master ball is not larger than the datum balls",
                remedy,
            ));
        }
        Ok(trical)
    }
}
