//! `calibench-calibration/2`, printed by `identify`.

use calibench::identify;
use calibench::units::{DEG, MM};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{FleetUsed, Shifts, finite, format_tag};

format_tag!(CalibrationFormat, "calibench-calibration/2");

/// An identified parameter.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Parameter {
    /// Name, unique in the calibration.
    pub name: String,
    /// Estimate, in `unit`.
    pub value: f64,
    /// One-sigma by noise and by model discrepancy, in `unit`; null if undetermined.
    pub sigma: Option<f64>,
    /// One-sigma by noise alone, in `unit`; null if undetermined.
    pub sigma_noise: Option<f64>,
    /// Symbol of the unit.
    pub unit: String,
    /// Nominal value, in `unit`.
    pub nominal: f64,
    /// Id of the effect that has this parameter.
    pub effect: String,
}

/// A parameter stated with its uncertainty before the fit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct StatedParameter {
    /// The parameter.
    #[serde(flatten)]
    pub parameter: Parameter,
    /// Stated one-sigma, in the parameter's unit.
    pub stated_sigma: f64,
}

/// Observability indices of the identification Jacobian.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[allow(non_snake_case, reason = "the field's names")]
pub struct ObservabilityIndices {
    /// Geometric mean of the singular values over the root of the number of poses.
    pub O1: Option<f64>,
    /// Smallest over largest singular value.
    pub O2: Option<f64>,
    /// Smallest singular value.
    pub O3: Option<f64>,
    /// Square of the smallest over the largest singular value.
    pub O4: Option<f64>,
    /// Inverse of the sum of the inverse singular values.
    pub O5: Option<f64>,
}

/// An identified robot.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Calibration {
    /// Format tag.
    pub format: CalibrationFormat,
    /// The robot, as the data name it.
    pub robot: String,
    /// True if the masses of its links are guessed from its geometry.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub masses_guessed: bool,
    /// Effects of the model.
    pub effects: Vec<String>,
    /// Identified parameters.
    pub parameters: Vec<Parameter>,
    /// Parameters with a stated uncertainty.
    pub stated_parameters: Vec<StatedParameter>,
    /// `converged`, `stalled`, `iteration_limit` or `left_linear_range`; null in calibrations from before 0.2.
    pub outcome: Option<String>,
    /// Number of fitted rows.
    pub samples: usize,
    /// Residual of the fitted rows, rms, mm.
    pub residual_mm: f64,
    /// Residual of the measured orientations, rms of the angles, deg; only if some were measured.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub residual_orientation_deg: Option<f64>,
    /// Sum of squared residuals over the noise, per degree of freedom; null without degrees of freedom.
    pub chi2_per_dof: Option<f64>,
    /// Degrees of freedom.
    pub dof: usize,
    /// Number of parameters that the data determine.
    pub rank: usize,
    /// Condition number of the scaled Jacobian; null if infinite.
    pub condition: Option<f64>,
    /// True if the data state their noise.
    pub noise_stated: bool,
    /// Observability indices.
    pub observability: ObservabilityIndices,
    /// Groups of parameters that the data do not separate.
    pub unresolved: Vec<Vec<String>>,
    /// Warning that the data do not fit the robot, if used nevertheless.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub misfit: Option<String>,
    /// Shifts of the parameters by effects that the model lacks, if requested.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub shifts: Option<Shifts>,
    /// Agreement of the robot with its fleet, if one was given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fleet: Option<FleetUsed>,
    /// Base and tool as found, only if orientations were measured.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub frames: Vec<FoundFrame>,
}

/// A frame as found, `Tr Rz Ry Rx`, as `dataset.toml` states it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct FoundFrame {
    /// Label of its set-up; empty if there is one only.
    pub setup: String,
    /// `base`, the robot in the world, or `tool`, in the flange.
    pub frame: String,
    /// x, y, z, mm.
    pub position_mm: [f64; 3],
    /// Rotations about z, the new y, the new x, deg.
    pub rotation_deg: [f64; 3],
    /// One-sigma of the position, mm.
    pub sigma_mm: [f64; 3],
    /// One-sigma of the rotations, deg.
    pub sigma_deg: [f64; 3],
}

impl FoundFrame {
    fn of(found: identify::calibration::FoundFrame) -> Self {
        let [x, y, z, a, b, c] = found.sigma;
        FoundFrame {
            frame: found.name().into(),
            setup: found.setup,
            position_mm: found.frame.xyz.map(|v| v / MM),
            rotation_deg: found.frame.rz_ry_rx.map(|v| v / DEG),
            sigma_mm: [x, y, z].map(|v| v / MM),
            sigma_deg: [a, b, c].map(|v| v / DEG),
        }
    }
}

impl Parameter {
    fn of(e: &identify::calibration::Estimate) -> Self {
        Parameter {
            name: e.name.clone(),
            value: e.unit.from_si(e.value),
            sigma: finite(e.unit.from_si(e.sigma)),
            sigma_noise: finite(e.unit.from_si(e.sigma_noise)),
            unit: e.unit.symbol.into(),
            nominal: e.unit.from_si(e.nominal),
            effect: e.effect.to_string(),
        }
    }
}

impl Calibration {
    /// The document of a calibration.
    #[must_use]
    pub fn of(c: &identify::calibration::Calibration) -> Self {
        let stated = |e: &identify::calibration::Estimate| {
            Some(StatedParameter { parameter: Parameter::of(e), stated_sigma: e.unit.from_si(e.stated_sigma?) })
        };
        let o = &c.observability;
        let [o1, o2, o3, o4, o5] = [o.o1, o.o2, o.o3, o.o4, o.o5].map(finite);
        Calibration {
            format: CalibrationFormat::Current,
            robot: c.robot_reference.clone(),
            masses_guessed: c.robot.masses_guessed,
            effects: c.model.ids(),
            parameters: c.estimates.iter().filter(|e| e.stated_sigma.is_none()).map(Parameter::of).collect(),
            stated_parameters: c.estimates.iter().filter_map(stated).collect(),
            outcome: c.outcome.map(|outcome| outcome.name().into()),
            samples: c.samples,
            residual_mm: c.rms / MM,
            residual_orientation_deg: c.rms_orientation.map(|r| r / DEG),
            chi2_per_dof: finite(c.chi2_per_dof),
            dof: c.dof,
            rank: c.rank,
            condition: finite(c.condition),
            noise_stated: c.noise_stated,
            observability: ObservabilityIndices { O1: o1, O2: o2, O3: o3, O4: o4, O5: o5 },
            unresolved: c.unresolved.clone(),
            misfit: None,
            shifts: None,
            fleet: None,
            frames: c.found_frames().into_iter().map(FoundFrame::of).collect(),
        }
    }
}
