//! Joint angles rounded by the controller: a read-out in hundredths of a degree is a measurement with noise of its own.

use crate::identify::problem::{Problem, Use};
use crate::measure::dataset::{NamedDataset, Sample};
use crate::robot::{JointKind, Robot};
use crate::units::DEG;

/// Rounding steps of controllers, deg, coarse to fine. Coarser steps are those of commanded poses, which are exact.
const STEPS: [f64; 6] = [0.05, 0.02, 0.01, 0.005, 0.002, 0.001];

/// Tolerance for a multiple of the step, as a share of the step.
const EXACT: f64 = 1e-5;

/// Fewest samples: all angles of ten samples of six joints are practically never multiples of a step by chance.
const FEWEST: usize = 10;

/// The rounding step of joint angles, and its effect on the TCP.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointSteps {
    /// The step, rad.
    pub step: f64,
    /// Displacement of the TCP by rounding, per axis, root mean square, m; the one-sigma of each joint is
    /// `step / sqrt(12)`.
    pub per_axis: f64,
}

/// The joints that turn, counted from 0.
fn turning(robot: &Robot) -> impl Iterator<Item = usize> + '_ {
    (0..robot.joints()).filter(|&j| robot.kind(j) == JointKind::Revolute)
}

impl JointSteps {
    /// Finds the step of the rows of set `fit`, with the arm at `values` of its parameters; `None` if the angles are
    /// not rounded.
    pub(crate) fn of(datasets: &[NamedDataset<'_>], problem: &Problem, values: &[f64]) -> Option<Self> {
        let (mut levers, mut samples) = (0.0, 0.0);
        problem.for_each_sample(values, &mut |posed| {
            let lever = |j| posed.posture.motion(j).norm_squared();
            levers += turning(problem.robot()).map(lever).sum::<f64>();
            samples += 1.0;
        });
        JointSteps::with_levers(datasets, levers / f64::max(samples, 1.0))
    }

    /// Finds the largest step of which all angles of the rows of set `fit` are multiples. `levers` is the sum over the
    /// joints of the squared TCP displacement per angle, m²/rad², averaged over the samples.
    fn with_levers(datasets: &[NamedDataset<'_>], levers: f64) -> Option<Self> {
        let NamedDataset { dataset: first, .. } = datasets.first()?;
        let robot = &first.robot;
        let angles = |s: &Sample| -> Vec<f64> {
            let of_joints = s.q.iter().enumerate();
            of_joints.filter(|(j, _)| robot.kind(*j) == JointKind::Revolute).map(|(_, q)| *q).collect()
        };
        let taken = || datasets.iter().flat_map(|d| d.dataset.samples.iter()).filter(|s| Use::Fit.takes(s));
        if taken().count() < FEWEST {
            return None;
        }
        let multiple = |q: f64, step: f64| {
            let x = q / (step * DEG);
            (x - x.round()).abs() < EXACT
        };
        let step = STEPS.into_iter().find(|&step| taken().all(|s| angles(s).into_iter().all(|q| multiple(q, step))))?;
        // Multiples of a coarse step are multiples of finer ones too; angles on a step coarser than the list were
        // commanded.
        if taken().all(|s| angles(s).into_iter().all(|q| multiple(q, 10.0 * STEPS[0]))) {
            return None;
        }
        let step = step * DEG;
        Some(JointSteps { step, per_axis: (step * step / 12.0 * levers / 3.0).sqrt() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measure::dataset::{Dataset, Measured, Sample};
    use nalgebra::Vector3;

    fn data(step: f64) -> Dataset {
        let angle = |k: usize, j: usize| ((k * 37 + j * 101) as f64 * 0.7312 % 170.0 / step).round() * step * DEG;
        let sample = |k: usize| Sample::new("", (0..6).map(|j| angle(k, j)).collect(), Measured::Point(Vector3::zeros()));
        Dataset { samples: (0..30).map(sample).collect(), ..Dataset::default() }
    }

    #[test]
    fn hundredths_are_seen_and_what_is_finer_or_commanded_is_not() {
        let of = |step: f64| JointSteps::with_levers(&[NamedDataset::new("", &data(step))], 3.0);
        let found = of(0.01).map(|s| (s.step / DEG, s.per_axis));
        assert!(
            found.is_some_and(|(step, size)| (step - 0.01).abs() < 1e-12 && (size - 0.01 * DEG / 12f64.sqrt()).abs() < 1e-12)
        );
        assert_eq!(of(1e-7), None);
        assert_eq!(of(0.5), None);
    }
}
