//! Scatter of the data: samples that disagree with all others, repeats, serial correlation, rounded joint angles.

mod accidents;
mod joint_steps;
mod noise_scale;
mod repeats;
mod serial;
mod suspects;

pub use joint_steps::JointSteps;
pub(crate) use noise_scale::NoiseScale;
pub use repeats::{JointScatter, RepeatScatter};
pub(crate) use repeats::{moments, patterns};
pub use serial::{LagCorrelation, SerialCorrelation};
pub(crate) use suspects::suspects_of;
pub use suspects::{Suspect, suspects};

use nalgebra::Vector3;

use crate::identify::problem::Problem;

/// The data of one sample that the tests of scatter need.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Row {
    /// Index of the set-up.
    pub setup: usize,
    /// Index of its first scalar residual, and the number of those of its position.
    pub first_row: usize,
    pub height: usize,
    /// Number of all its scalar residuals, those of its orientation included.
    pub rows: usize,
    /// Whitened residual; for a distance only the first component is used.
    pub whitened: Vector3<f64>,
    /// Sum of the variances of its components by which it was whitened, m².
    pub variance: f64,
}

/// The rows of a problem at `values`, in the order of its samples.
pub(crate) fn rows(problem: &Problem, values: &[f64]) -> Vec<Row> {
    let mut rows = Vec::with_capacity(problem.sample_count());
    problem.for_each_sample(values, &mut |posed| {
        rows.push(Row {
            setup: posed.setup,
            first_row: posed.first_row,
            height: posed.height,
            rows: posed.rows,
            whitened: posed.whitener * posed.residual,
            variance: posed.variance,
        });
    });
    rows
}

/// Samples that are judged together, and their rows.
#[derive(Clone)]
struct Unit {
    samples: Vec<usize>,
    rows: Vec<usize>,
}

impl Unit {
    /// Number of independent components: at most three, as all targets and repeats of a posture share its error.
    fn numbers(&self) -> usize {
        self.rows.len().clamp(1, 3)
    }
}

/// Largest multiple of a stated noise that may be noise.
const MOST_NOISE: f64 = 10.0;

/// How many times the stated noise a residual is, from its chi-square per degree of freedom; `None` if that may be noise that
/// somebody stated wrongly. What is far larger may follow nothing that was tried, and is a mistake in the data rather than an
/// instrument.
pub(crate) fn beyond_noise(chi2_per_dof: f64) -> Option<f64> {
    Some(chi2_per_dof.sqrt()).filter(|times| *times > MOST_NOISE)
}
