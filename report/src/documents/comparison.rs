//! `calibench-comparison/2`, printed by `compare`.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{OutsideRange, Workspace, format_tag};

format_tag!(ComparisonFormat, "calibench-comparison/2");

/// Significance of a view of the residuals.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ViewTest {
    /// Sum of squares explained, in units of the noise squared.
    pub chi2: f64,
    /// Degrees of freedom.
    pub dof: usize,
    /// p-value after correction for the number of views of its kind.
    pub p_family: f64,
    /// Share of the residual sum of squares that the view alone explains.
    pub explains: f64,
}

/// Residuals of the probings of a ball.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct BallResiduals {
    /// Dataset of the ball.
    pub dataset: String,
    /// Id of the ball.
    pub ball: String,
    /// Number of probings.
    pub samples: usize,
    /// Residual, rms, um.
    pub rms_um: f64,
    /// Mean residual, world axes, um.
    pub mean_um: [f64; 3],
    /// One-sigma of the mean, um.
    pub sigma_um: [f64; 3],
    /// Displacement of the ball that would explain the mean, um; null if undetermined.
    pub displacement_um: Option<[f64; 3]>,
    /// One-sigma of the displacement, um.
    pub displacement_sigma_um: Option<[f64; 3]>,
    /// Significance.
    #[serde(flatten)]
    pub test: ViewTest,
}

/// Mean residual in the axes of the tool.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ToolShift {
    /// Mean, um.
    pub mean_um: [f64; 3],
    /// One-sigma, um.
    pub sigma_um: [f64; 3],
    /// Significance.
    #[serde(flatten)]
    pub test: ViewTest,
}

/// Mean residual in the world, and the motion of the base that would best explain the residuals.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct WorldShift {
    /// Mean, um.
    pub mean_um: [f64; 3],
    /// One-sigma, um.
    pub sigma_um: [f64; 3],
    /// Translation of the base, um.
    pub translation_um: [f64; 3],
    /// One-sigma, um.
    pub translation_sigma_um: [f64; 3],
    /// Rotation of the base, urad.
    pub rotation_urad: [f64; 3],
    /// One-sigma, urad.
    pub rotation_sigma_urad: [f64; 3],
    /// Residual without that motion, rms, mm.
    pub rms_after_mm: f64,
    /// Significance.
    #[serde(flatten)]
    pub test: ViewTest,
}

/// Residuals of a set-up.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SetupResiduals {
    /// Dataset.
    pub dataset: String,
    /// Session; may be empty.
    pub session: String,
    /// Number of samples.
    pub samples: usize,
    /// Residual, rms, mm.
    pub rms_mm: f64,
    /// In the axes of the tool.
    pub tool: ToolShift,
    /// In the world.
    pub world: WorldShift,
}

/// A bin of a joint's curve.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct CurveBin {
    /// Mean of the variable, in the curve's unit.
    pub x: f64,
    /// Smallest value.
    pub from: f64,
    /// Largest value.
    pub to: f64,
    /// Mean apparent error of the joint, urad.
    pub mean_urad: f64,
    /// One-sigma, urad.
    pub sigma_urad: f64,
    /// Number of samples.
    pub n: usize,
}

/// Apparent error of a joint against a variable.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct JointCurve {
    /// Joint, counted from 1.
    pub joint: usize,
    /// The variable: `q1`, `tau1`, `approach1`, `qcmd1-q1`, `payload`, `time` or `temp`.
    pub against: String,
    /// Unit of the variable.
    pub unit: String,
    /// Largest minus smallest bin, urad; null without bins.
    pub swing_urad: Option<f64>,
    /// The bins.
    pub bins: Vec<CurveBin>,
    /// Significance.
    #[serde(flatten)]
    pub test: ViewTest,
}

/// Mean apparent error of a joint.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct JointOffset {
    /// Joint, counted from 1.
    pub joint: usize,
    /// Mean, urad.
    pub mean_urad: f64,
    /// One-sigma, urad.
    pub sigma_urad: f64,
    /// Significance.
    #[serde(flatten)]
    pub test: ViewTest,
}

/// One of the samples with the largest residuals.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct WorstSample {
    /// Id of the sample.
    pub id: String,
    /// Its dataset.
    pub dataset: String,
    /// Its session.
    pub session: String,
    /// Residual, world axes, um.
    pub residual_um: [f64; 3],
    /// Its norm, um.
    pub norm_um: f64,
    /// The residual in units of its expected scatter.
    pub normalised: f64,
    /// p-value after correction for the number of samples.
    pub p_family: f64,
    /// Special circumstances of the sample.
    pub special: Vec<String>,
}

/// The view that is significant.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "view", rename_all = "snake_case")]
pub enum Place {
    /// A ball.
    Ball {
        /// Its dataset.
        dataset: String,
        /// Its id.
        ball: String,
    },
    /// The tool of a set-up.
    Tool {
        /// The dataset.
        dataset: String,
        /// The session.
        session: String,
    },
    /// The base of a set-up.
    World {
        /// The dataset.
        dataset: String,
        /// The session.
        session: String,
    },
    /// A joint's curve.
    Joint {
        /// Joint, counted from 1.
        joint: usize,
        /// The variable.
        against: String,
    },
    /// A joint's mean error.
    Offset {
        /// Joint, counted from 1.
        joint: usize,
    },
    /// A sample.
    Sample {
        /// Its id.
        id: String,
    },
}

/// A view that shows more than chance.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Standout {
    /// Name of the view.
    #[serde(flatten)]
    pub place: Place,
    /// Significance beyond the findings before it.
    #[serde(flatten)]
    pub test: ViewTest,
    /// Effects that the model lacks and that would show in this view.
    pub effects: Vec<String>,
}

/// Comparison of a model with measurements.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Comparison {
    /// Format tag.
    pub format: ComparisonFormat,
    /// Name of the robot.
    pub robot: String,
    /// Number of rows compared.
    pub samples: usize,
    /// True if the calibration was fitted to these rows.
    pub fitted: bool,
    /// Set-ups whose base and tool were fitted to these rows.
    pub refitted: Vec<String>,
    /// Set-ups whose base and tool come from rows that were fitted.
    pub from_fit_rows: Vec<String>,
    /// Residual, rms, mm.
    pub residual_mm: f64,
    /// Residual of the measured orientations, rms of the angles, deg; only if some were measured.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub residual_orientation_deg: Option<f64>,
    /// Noise, rms of the three axes, mm; null if unknown.
    pub noise_mm: Option<f64>,
    /// Noise, one-sigma per axis, um; null if unknown.
    pub noise_um_per_axis: Option<f64>,
    /// 95 % interval of `noise_mm`; null for a stated noise.
    pub noise_interval_mm: Option<[f64; 2]>,
    /// Degrees of freedom from which the noise is known.
    pub noise_dof: Option<f64>,
    /// Origin of the noise.
    pub noise_source: String,
    /// Stated noise, one-sigma per axis, um.
    pub noise_stated_um_per_axis: Option<f64>,
    /// p-value of the agreement of measured and stated noise.
    pub noise_agreement_p: Option<f64>,
    /// The part of the noise that remains in the residual, mm.
    pub noise_left_mm: Option<f64>,
    /// Residual beyond the noise, mm.
    pub unexplained_mm: Option<f64>,
    /// Its 95 % interval, mm.
    pub unexplained_interval_mm: Option<[f64; 2]>,
    /// Degrees of freedom of the residual.
    pub dof: f64,
    /// Sum of squared residuals over the noise, per degree of freedom.
    pub chi2_per_dof: Option<f64>,
    /// p-value of the lack of fit.
    pub lack_of_fit_p: Option<f64>,
    /// True if the residual is significantly smaller than the stated noise.
    pub noise_overstated: bool,
    /// Residuals by ball.
    pub balls: Vec<BallResiduals>,
    /// Mean residual in the axes of the tool.
    pub tool: ToolShift,
    /// Mean residual in the world.
    pub world: WorldShift,
    /// Residuals by set-up.
    pub setups: Vec<SetupResiduals>,
    /// Curves of the joints.
    pub joints: Vec<JointCurve>,
    /// Mean errors of the joints.
    pub offsets: Vec<JointOffset>,
    /// The largest residuals.
    pub worst: Vec<WorstSample>,
    /// Views that show more than chance, most significant first.
    pub findings: Vec<Standout>,
    /// Error expected over the workspace; null if it cannot be predicted.
    pub workspace: Option<Workspace>,
    /// Rows outside the identified joint ranges; null if there are none.
    pub outside_range: Option<OutsideRange>,
    /// The comparison in words.
    pub sentences: Vec<String>,
}
