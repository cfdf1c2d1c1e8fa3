//! A sample with all data that the views need.

use nalgebra::{Matrix3, Rotation3, Vector3};

use crate::identify::problem::Problem;
use crate::measure::dataset::{Measured, NamedDataset, Sample};
use crate::robot::FramePose;
use crate::robot::statics::{Loads, Payload};

/// A moment smaller than this, N·m, is a rounding error and set to zero.
const NO_MOMENT: f64 = 1e-6;

/// One sample, with the state of the calibrated arm; SI, world axes.
pub struct SeenSample<'a> {
    /// The sample as measured.
    pub sample: &'a Sample,
    /// Index of its dataset.
    pub dataset: usize,
    /// Index of its set-up.
    pub setup: usize,
    /// Index of its first row in the problem.
    pub first_row: usize,
    /// Number of its rows: three, or one for a distance.
    pub height: usize,
    /// Measured minus predicted, m.
    pub residual: Vector3<f64>,
    /// Matrix that whitens the residual to noise of unit size.
    pub whitener: Matrix3<f64>,
    /// Sum of the variances of the components of its residual, m².
    pub variance: f64,
    /// TCP relative to the origin of the robot's base, m.
    pub from_base: Vector3<f64>,
    /// Rotation from the tool's to the world's axes.
    pub world_from_tool: Rotation3<f64>,
    /// Displacement of the TCP per angle of each joint, m/rad.
    pub joint_columns: Vec<Vector3<f64>>,
    /// Moments of the load about the joints, N·m; empty if the masses of the links are unknown.
    pub tau: Vec<f64>,
    /// Mass on the flange, kg.
    pub payload: f64,
}

impl<'a> SeenSample<'a> {
    /// Returns the samples of a problem, which must be built from these datasets, at `values` of its parameters.
    pub fn all(problem: &Problem, values: &[f64], samples: &[&'a Sample], datasets: &[NamedDataset<'_>]) -> Vec<Self> {
        let robot = problem.robot();
        let n = robot.joints();
        let mut loads = Loads::new(n);
        let turns: Vec<Rotation3<f64>> =
            datasets.iter().map(|d| FramePose { xyz: [0.0; 3], ..d.dataset.tool }.pose().rotation).collect();
        let none = Payload::none();
        let mut seen = Vec::with_capacity(samples.len());
        problem.for_each_sample(values, &mut |posed| {
            let (sample, dataset) = (samples[posed.place], datasets[posed.dataset].dataset);
            let payload = dataset.payloads.get(sample.payload).unwrap_or(&none);
            let mut tau = Vec::new();
            if robot.has_masses() {
                loads.compute(robot, posed.posture, payload, &dataset.gravity, &Vector3::zeros());
                tau.extend(loads.tau.iter().map(|&t| if t.abs() < NO_MOMENT { 0.0 } else { t }));
            }
            let flange = posed.posture.flange();
            let turn = Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[flange.x, flange.y, flange.z]));
            seen.push(SeenSample {
                sample,
                dataset: posed.dataset,
                setup: posed.setup,
                first_row: posed.first_row,
                height: posed.height,
                residual: posed.residual,
                whitener: posed.whitener,
                variance: posed.variance,
                from_base: posed.posture.tcp() - posed.posture.frame(0).o,
                world_from_tool: turn * turns[posed.dataset],
                joint_columns: (0..n).map(|j| posed.posture.motion(j)).collect(),
                tau,
                payload: payload.mass,
            });
        });
        seen
    }

    /// Index of the ball probed, if any.
    pub fn ball(&self) -> Option<usize> {
        match self.sample.measured {
            Measured::Ball { ball, .. } => Some(ball),
            Measured::Point(_) | Measured::Distance { .. } => None,
        }
    }
}
