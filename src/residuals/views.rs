//! Four views of the residuals: per ball (artifact), in the tool's axes (gauge), in the world's axes (base), and as
//! apparent angle errors of each joint (arm).
//!
//! Residuals after a fit are not the errors, since the parameters have absorbed a part: a ball that is displaced by a
//! tenth of a millimetre may leave a mean residual of a hundredth. Hence every one-sigma here is that of the noise
//! remaining after the fit, every test counts only directions that the fit cannot absorb, and for balls the
//! displacement that would leave the mean is given as well. For rows that were not fitted, the one-sigma includes the
//! uncertainty of the calibration.

mod bins;
mod joint_variable;
mod scores;
mod seen_sample;
mod worst;

use nalgebra::Vector3;

pub(crate) use self::bins::Bins;
pub use self::joint_variable::JointVariable;
pub(crate) use self::scores::{Patterns, PriorKnowledge, ScoreReduction, Scores, Whitened};
pub use self::seen_sample::SeenSample;
pub use self::worst::WorstSample;
pub(crate) use self::worst::{MOST_WORST, remarks};

/// Significance of a view: its sum of squares compared with the noise, and with the remaining residuals.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ViewTest {
    /// Reduction of the residual sum of squares by the view, in units of the noise squared, or of the mean squared
    /// residual if the noise is unknown.
    pub chi2: f64,
    /// Number of its directions that the fit has not absorbed.
    pub dof: usize,
    /// Probability that a correct model shows as much here, the larger of two: compared with the noise (if known), and
    /// with the remaining residuals, so that not every view is significant if the model is wrong elsewhere. Multiplied by
    /// the number of views of its kind (Bonferroni), at most 1.
    pub p_family: f64,
    /// Share of the residual sum of squares that it explains alone, less the share expected by chance.
    pub explains: f64,
}

/// Residuals of the probings of one ball.
#[derive(Debug, Clone, PartialEq)]
pub struct BallView {
    /// Dataset of the ball.
    pub dataset: String,
    /// Name of the ball.
    pub ball: String,
    /// Number of probings of the ball.
    pub samples: usize,
    /// Root mean square of the 3-D residual, m.
    pub rms: f64,
    /// Mean residual (ball minus TCP), weighted, world axes, m.
    pub mean: Vector3<f64>,
    /// One-sigma of the mean by chance, m.
    pub sigma: Vector3<f64>,
    /// Displacement of the ball from its stated position that would leave this mean, with the parameters refitted, and
    /// its one-sigma, m; `None` if the parameters can absorb any displacement, or were not fitted to these rows.
    pub displacement: Option<[Vector3<f64>; 2]>,
    /// Significance of the mean.
    pub test: ViewTest,
}

/// Mean residual in the tool's axes, which are those of the three indicators.
#[derive(Debug, Clone, PartialEq)]
pub struct ToolView {
    /// Mean, m.
    pub mean: Vector3<f64>,
    /// One-sigma of the mean by chance, m.
    pub sigma: Vector3<f64>,
    /// Significance of the mean.
    pub test: ViewTest,
}

/// Mean residual in the world's axes, and the motion of the base that would best remove the residuals.
#[derive(Debug, Clone, PartialEq)]
pub struct WorldView {
    /// Mean, m.
    pub mean: Vector3<f64>,
    /// One-sigma of the mean by chance, m.
    pub sigma: Vector3<f64>,
    /// Translation of the base, world axes, m.
    pub translation: Vector3<f64>,
    /// One-sigma of the translation by chance, m.
    pub translation_sigma: Vector3<f64>,
    /// Rotation of the base about its own origin, world axes, rad.
    pub rotation: Vector3<f64>,
    /// One-sigma of the rotation by chance, rad.
    pub rotation_sigma: Vector3<f64>,
    /// Root mean square of the 3-D residual with that motion removed, m.
    pub rms_after: f64,
    /// Significance of the motion.
    pub test: ViewTest,
}

/// Residuals of one set-up (base and tool).
#[derive(Debug, Clone, PartialEq)]
pub struct SetupView {
    /// Name of the dataset.
    pub dataset: String,
    /// Name of the session; may be empty.
    pub session: String,
    /// Number of samples.
    pub samples: usize,
    /// Root mean square of the 3-D residual, m.
    pub rms: f64,
    /// In the tool's axes.
    pub tool: ToolView,
    /// In the world's axes.
    pub world: WorldView,
}

/// One bin of a curve.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointBin {
    /// Mean of the variable, in its unit.
    pub x: f64,
    /// Smallest value of the variable.
    pub from: f64,
    /// Largest value of the variable.
    pub to: f64,
    /// Mean apparent angle error of the joint, actual minus reported, rad.
    pub mean: f64,
    /// One-sigma of the mean by chance, rad.
    pub sigma: f64,
    /// Number of samples.
    pub samples: usize,
}

/// Apparent angle error of a joint, `j . r / |j|²` with the joint's column `j`, as a function of a variable.
#[derive(Debug, Clone, PartialEq)]
pub struct JointCurve {
    /// Joint, counted from 1.
    pub joint: usize,
    /// The variable.
    pub against: JointVariable,
    /// The bins of the curve.
    pub bins: Vec<JointBin>,
    /// Significance of its variation: analysis of variance between bins.
    pub test: ViewTest,
}

impl JointCurve {
    /// Difference of the largest and the smallest bin mean, rad.
    pub fn swing(&self) -> f64 {
        let ends = self.bins.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |e, b| [e[0].min(b.mean), e[1].max(b.mean)]);
        ends[1] - ends[0]
    }
}

/// Mean apparent angle error of a joint over all samples.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointOffset {
    /// Joint, counted from 1.
    pub joint: usize,
    /// Actual minus reported, rad.
    pub mean: f64,
    /// One-sigma of the mean by chance, rad.
    pub sigma: f64,
    /// Significance of the mean.
    pub test: ViewTest,
}

/// Residual of one sample.
#[derive(Debug, Clone, PartialEq)]
pub struct SampleResidual {
    /// Name of the sample.
    pub id: String,
    /// Index of its set-up.
    pub setup: usize,
    /// Measured minus predicted, world axes, m; for a distance, along the line of sight.
    pub world: Vector3<f64>,
    /// Measured minus predicted, tool axes, m.
    pub tool: Vector3<f64>,
    /// Root mean square of its components in units of the noise remaining after the fit, or of the mean residual if the
    /// noise is unknown.
    pub normalised: f64,
}
