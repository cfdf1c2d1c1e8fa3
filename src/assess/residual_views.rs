//! Residuals seen from four sides: per ball (artifact), in the tool's axes (gauge), in the world (base), and as apparent angle errors of
//! each joint (arm).
//!
//! Residuals after a fit are not the errors: the model's parameters have taken up what they could. A ball that stands a tenth of a
//! millimetre off may leave a mean residual of a hundredth. So every one-sigma here is that of what noise leaves after the fit, every
//! test counts only directions that the fit cannot take, and for balls the displacement that would leave the mean is given beside it.
//! Of rows that were not fitted, the one-sigma holds the uncertainty of the calibration.

mod bins;
mod joint_variable;
mod scores;
mod seen_sample;
mod worst;

use nalgebra::Vector3;

pub(crate) use self::bins::Bins;
pub use self::joint_variable::JointVariable;
pub(crate) use self::scores::{Beforehand, Patterns, Scores, Taken, Whitened};
pub use self::seen_sample::SeenSample;
pub use self::worst::WorstSample;
pub(crate) use self::worst::{MOST_WORST, remarks};

/// Whether a view shows more than chance: its sum of squares against that of noise, and against what else is left.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ViewTest {
    /// What the view takes off the residual sum of squares, in units of the noise squared; of what is left, where the noise is unknown.
    pub chi2: f64,
    /// Directions in it that the fit has not taken up.
    pub dof: usize,
    /// Chance that a right model shows as much here, the larger of two: against the noise (where it is known) and against what else is
    /// left of the residuals, so that a model which is wrong elsewhere does not make everything stand out. Times the number of views of
    /// its kind (Bonferroni), at most 1.
    pub p_family: f64,
    /// Share of the residual sum of squares that it takes alone; what chance would take is left out.
    pub explains: f64,
}

/// Residuals of the probings of one ball.
#[derive(Debug, Clone, PartialEq)]
pub struct BallView {
    /// Dataset of the ball.
    pub dataset: String,
    /// Name of the ball.
    pub ball: String,
    /// Probings of it.
    pub samples: usize,
    /// Root mean square of the 3-D residual, m.
    pub rms: f64,
    /// Mean residual (ball minus TCP), weighted, world axes, m.
    pub mean: Vector3<f64>,
    /// What chance makes of it, one-sigma, m.
    pub sigma: Vector3<f64>,
    /// Displacement of the ball from its stated place that would leave this mean, the parameters free to follow as they did in the fit, m;
    /// `None` when they can follow any, or were not fitted to these rows.
    pub displacement: Option<[Vector3<f64>; 2]>,
    /// Whether the mean is more than chance.
    pub test: ViewTest,
}

/// Mean residual in the tool's axes, which are those of the three indicators.
#[derive(Debug, Clone, PartialEq)]
pub struct ToolView {
    /// Mean, m.
    pub mean: Vector3<f64>,
    /// What chance makes of it, one-sigma, m.
    pub sigma: Vector3<f64>,
    /// Whether it is more than chance.
    pub test: ViewTest,
}

/// Mean residual in the world's axes, and the motion of the base that would best take the residuals away.
#[derive(Debug, Clone, PartialEq)]
pub struct WorldView {
    /// Mean, m.
    pub mean: Vector3<f64>,
    /// What chance makes of it, one-sigma, m.
    pub sigma: Vector3<f64>,
    /// Shift of the base, world axes, m.
    pub translation: Vector3<f64>,
    /// What chance makes of it, one-sigma, m.
    pub translation_sigma: Vector3<f64>,
    /// Turn of the base about its own origin, world axes, rad.
    pub rotation: Vector3<f64>,
    /// What chance makes of it, one-sigma, rad.
    pub rotation_sigma: Vector3<f64>,
    /// Root mean square of the 3-D residual with that motion taken away, m.
    pub rms_after: f64,
    /// Whether the motion is more than chance.
    pub test: ViewTest,
}

/// Residuals of one base and tool.
#[derive(Debug, Clone, PartialEq)]
pub struct SetupView {
    /// Dataset.
    pub dataset: String,
    /// Session; may be empty.
    pub session: String,
    /// Samples of it.
    pub samples: usize,
    /// Root mean square of the 3-D residual, m.
    pub rms: f64,
    /// In the tool's axes.
    pub tool: ToolView,
    /// In the world.
    pub world: WorldView,
}

/// One bin of a curve.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointBin {
    /// Mean of the variable, in its unit.
    pub x: f64,
    /// Least value of the variable.
    pub from: f64,
    /// Largest value of the variable.
    pub to: f64,
    /// Mean apparent angle error of the joint, actual minus reported, rad.
    pub mean: f64,
    /// What chance makes of it, one-sigma, rad.
    pub sigma: f64,
    /// Samples.
    pub samples: usize,
}

/// Apparent angle error of a joint, `j . r / |j|²` with the joint's column `j`, against a variable.
#[derive(Debug, Clone, PartialEq)]
pub struct JointCurve {
    /// Joint, counted from 1.
    pub joint: usize,
    /// What it is drawn against.
    pub against: JointVariable,
    /// The curve.
    pub bins: Vec<JointBin>,
    /// Whether it is not flat: analysis of variance between bins.
    pub test: ViewTest,
}

impl JointCurve {
    /// Largest minus smallest bin, rad.
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
    /// What chance makes of it, one-sigma, rad.
    pub sigma: f64,
    /// Whether it is more than chance.
    pub test: ViewTest,
}

/// Residual of one sample.
#[derive(Debug, Clone, PartialEq)]
pub struct SampleResidual {
    /// Name of the sample.
    pub id: String,
    /// Its set-up, by place.
    pub setup: usize,
    /// Measured minus predicted, world axes, m; of a distance along the line of sight.
    pub world: Vector3<f64>,
    /// The same in the tool's axes, m.
    pub tool: Vector3<f64>,
    /// Root mean square of its numbers in units of what noise leaves of them; of the mean residual where the noise is unknown.
    pub normalised: f64,
}
