//! The measurements that a robot with an injected effect would have given: the user's own samples, displaced by what the effect
//! does to them, with noise sampled again.

use calibench::identify::calibration::{Calibration, IdentifyError};
use calibench::identify::fit::FitError;
use calibench::identify::problem::Use;
use calibench::math::LinalgError;
use calibench::measure::dataset::{Dataset, Measured, NamedDataset, Noise, Sample, SampleSet};
use calibench::robot::kinematics::Posture;
use calibench::robot::rotation_vector;
use nalgebra::{DMatrix, Rotation3, Vector3};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

use super::Subject;

/// Corrections of the joint angles until a centred ball is centred: each leaves the square of the last.
const CENTRINGS: usize = 3;

/// Noise sampled for one row, in units of its standard deviation.
struct Draw {
    position: Vector3<f64>,
    turn: Vector3<f64>,
}

/// The datasets as the robot `truth` would have given them, with noise of `factor` times the stated one.
///
/// # Errors
/// If the datasets are of another robot.
pub(crate) fn measured_by(
    named: &[NamedDataset<'_>],
    truth: &Calibration,
    factor: f64,
    random: &mut ChaCha8Rng,
) -> Result<Vec<Dataset>, IdentifyError> {
    let mut datasets: Vec<Dataset> = named.iter().map(|d| d.dataset.clone()).collect();
    let mut normal = || Vector3::from_fn(|_, _| random.sample::<f64, _>(StandardNormal) * factor);
    let draws: Vec<Draw> = fitted(&mut datasets).map(|_| Draw { position: normal(), turn: normal() }).collect();
    let balls = fitted(&mut datasets).any(|s| matches!(s.measured, Measured::Ball { .. }));
    for _ in 0..if balls { CENTRINGS } else { 1 } {
        let now: Vec<NamedDataset<'_>> = named.iter().zip(&datasets).map(|(of, d)| NamedDataset::new(of.name, d)).collect();
        let corrections = corrections(truth, &now, &draws)?;
        for (sample, correction) in fitted(&mut datasets).zip(corrections) {
            correction.apply(sample);
        }
    }
    datasets.iter_mut().for_each(|d| state(d, factor));
    Ok(datasets)
}

/// Change of each sample for which its residual under `truth` is the noise sampled for it.
fn corrections(truth: &Calibration, named: &[NamedDataset<'_>], draws: &[Draw]) -> Result<Vec<Correction>, IdentifyError> {
    let truly = truth.apply(named, Use::Fit)?;
    let samples: Vec<(&Dataset, &Sample)> = named
        .iter()
        .flat_map(|d| d.dataset.samples.iter().filter(|s| Use::Fit.takes(s)).map(move |s| (d.dataset, s)))
        .collect();
    let mut corrections = Vec::with_capacity(samples.len());
    let mut singular = None;
    truly.problem.for_each_sample(&truly.values, &mut |posed| {
        let ((dataset, sample), draw) = (samples[posed.place], &draws[posed.place]);
        let noise = match posed.sight {
            Some(sight) => sight * posed.variance.sqrt() * draw.position.x,
            None => match posed.whitener.try_inverse() {
                Some(root) => root * draw.position,
                None => {
                    singular = Some(LinalgError::Singular { size: 3 });
                    return;
                }
            },
        };
        let too_far = posed.residual - noise;
        let turn = posed.turn.zip(dataset.sigma_orientation(sample));
        corrections.push(Correction {
            shift: too_far,
            along_sight: posed.sight.map_or(0.0, |sight| sight.dot(&too_far)),
            joints: if matches!(sample.measured, Measured::Ball { .. }) {
                joints_for(posed.posture, sample.q.len(), &too_far)
            } else {
                Vec::new()
            },
            turn: turn.map(|(residual, sigma)| Rotation3::new(draw.turn * sigma) * Rotation3::new(-residual)),
        });
    });
    match singular {
        Some(error) => Err(FitError::from(error).into()),
        None => Ok(corrections),
    }
}

impl Subject<'_> {
    /// The datasets as the robot `truth` would have given them.
    pub(crate) fn measured(&self, truth: &Calibration, random: &mut ChaCha8Rng) -> Result<Vec<Dataset>, IdentifyError> {
        measured_by(self.datasets, truth, self.noise.factor, random)
    }

    /// Poses of the workspace, measured without noise on the robot `truth`, at the end of the first session; `None` if the data
    /// do not tell the base or the tool there.
    pub(super) fn workspace(&self, truth: &Calibration) -> Option<Dataset> {
        let NamedDataset { name, dataset: first } = self.datasets.first()?;
        let fitted = || first.samples.iter().filter(|s| Use::Fit.takes(s));
        let session = &fitted().next()?.session;
        let last = fitted().rfind(|s| s.session == *session)?;
        let pose = |(k, q): (usize, &Vec<f64>)| Sample {
            set: SampleSet::Validation,
            session: last.session.clone(),
            time_s: last.time_s,
            temp_c: last.temp_c,
            ..Sample::new(format!("workspace {k}"), q.clone(), Measured::Point(Vector3::zeros()))
        };
        let samples = self.poses.iter().enumerate().map(pose).collect();
        let mut there = Dataset { samples, ..(*first).clone() };
        let truly = truth.predict(&[NamedDataset::new(name, &there)], Use::Validation).ok()?;
        if !truly.refitted.is_empty() || !truly.from_fit_rows.is_empty() {
            return None;
        }
        for (sample, residual) in there.samples.iter_mut().zip(&truly.residuals) {
            sample.measured = Measured::Point(-residual);
        }
        Some(there)
    }
}

/// The change of one sample.
struct Correction {
    /// Displacement of the TCP in the world, m.
    shift: Vector3<f64>,
    /// Its part along the line of sight, m.
    along_sight: f64,
    /// Joint angles that cause it, rad; for balls only.
    joints: Vec<f64>,
    /// Rotation of the measured orientation.
    turn: Option<Rotation3<f64>>,
}

impl Correction {
    fn apply(self, sample: &mut Sample) {
        match &mut sample.measured {
            Measured::Point(point) => *point -= self.shift,
            Measured::Distance { distance, .. } => *distance -= self.along_sight,
            // The robot centres itself: it ends at other joint angles.
            Measured::Ball { .. } => {
                let moved = |q: &mut Vec<f64>| q.iter_mut().zip(&self.joints).for_each(|(q, d)| *q += d);
                moved(&mut sample.q);
                sample.q_commanded.as_mut().map(moved);
            }
        }
        if let (Some(orientation), Some(turn)) = (&mut sample.orientation, self.turn) {
            orientation.rotation = rotation_vector(&(turn * orientation.world_from_tool()));
        }
    }
}

/// The samples that are fitted.
fn fitted(datasets: &mut [Dataset]) -> impl Iterator<Item = &mut Sample> {
    datasets.iter_mut().flat_map(|d| d.samples.iter_mut().filter(|s| Use::Fit.takes(s)))
}

/// The smallest motion of the joints that moves the TCP by `shift`.
fn joints_for(posture: &Posture, joints: usize, shift: &Vector3<f64>) -> Vec<f64> {
    let motions: Vec<Vector3<f64>> = (0..joints).map(|i| posture.motion(i)).collect();
    let jacobian = DMatrix::from_fn(3, joints, |r, c| motions[c][r]);
    let solved = jacobian.svd(true, true).solve(shift, 1e-6);
    solved.map_or_else(|_| vec![0.0; joints], |q| q.iter().copied().collect())
}

/// States noise that is `factor` times the noise stated.
fn state(dataset: &mut Dataset, factor: f64) {
    let Noise { ball, point, orientation, joint, .. } = &mut dataset.noise;
    [ball, point, orientation].into_iter().flatten().chain(joint).for_each(|sigma| *sigma *= factor);
    for sample in &mut dataset.samples {
        sample.sigma.iter_mut().for_each(|sigma| *sigma *= factor);
        sample.orientation.iter_mut().filter_map(|o| o.sigma.as_mut()).for_each(|sigma| *sigma *= factor);
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use calibench::identify::Model;
    use calibench::measure::dataset::{Anchor, Ball, Orientation};
    use calibench::robot::kinematics::world_from_tool;
    use calibench::robot::{FramePose, built_in};
    use calibench::units::UM;
    use calibench_sim::random::Streams;

    use super::super::{InjectedNoise, NoiseChoice};
    use super::*;

    /// Postures of an arm that measure points, poses, distances and balls, all where the nominal arm puts them.
    fn nominal() -> Dataset {
        let robot = Arc::new(built_in("kr6_r700").unwrap());
        let tool = FramePose { xyz: [0.05, 0.0, 0.1], ..FramePose::default() };
        let (mut samples, mut balls) = (Vec::new(), Vec::new());
        let anchor = Vector3::new(2.0, 0.3, 0.4);
        for k in 0..48 {
            let q: Vec<f64> = (1..=6).map(|i| 2.0 * ((k * i) as f64 * 0.618 + 0.1 * i as f64).fract() - 1.0).collect();
            let at = world_from_tool(&robot, &FramePose::default(), &tool, &q);
            let place = at.translation.vector;
            let measured = match k % 4 {
                0 => Measured::Distance { anchor: 0, distance: (place - anchor).norm() },
                1 => {
                    balls.push(Ball { id: format!("b{k}"), position: place, sigma: 1.0 * UM, free: false });
                    Measured::Ball { ball: balls.len() - 1, reading: None }
                }
                _ => Measured::Point(place),
            };
            let rotation = rotation_vector(&at.rotation);
            let orientation = (k % 4 == 3).then_some(Orientation { rotation, sigma: Some(1e-4) });
            samples.push(Sample { orientation, ..Sample::new(format!("p{k}"), q, measured) });
        }
        let noise = Noise { point: Some(20.0 * UM), ball: Some(5.0 * UM), joint: vec![2e-5; 6], ..Noise::default() };
        let anchors = vec![Anchor { id: "a".into(), position: anchor }];
        Dataset { robot, tool, balls, anchors, noise, samples, ..Dataset::default() }
    }

    #[test]
    fn whatever_was_measured_the_residual_under_the_injected_robot_is_the_noise_that_was_drawn() {
        let data = nominal();
        let named = [NamedDataset::new("data", &data)];
        let model = Model::of(&["base_frame", "mdh"]);
        let noise = InjectedNoise::of(&named, &model, NoiseChoice::Instrument).unwrap();
        let subject = Subject::new(&named, &model, noise, 1).unwrap();
        for effect in [None, Some("joint_scale:2"), Some("harmonic1:4"), Some("ball:b1")] {
            let mut random = Streams { seed: 3, trial: 0 }.stream("injection");
            let (truth, _) = subject.truth(effect, &mut random).unwrap();
            let drawn = random.clone();
            let measured = subject.measured(&truth, &mut random).unwrap();
            let mut drawn = drawn;
            let mut normal = || Vector3::from_fn(|_, _| drawn.sample::<f64, _>(StandardNormal) * subject.noise.factor);
            let draws: Vec<[Vector3<f64>; 2]> = measured[0].samples.iter().map(|_| [normal(), normal()]).collect();
            let truly = truth.apply(&[NamedDataset::new("data", &measured[0])], Use::Fit).unwrap();
            truly.problem.for_each_sample(&truly.values, &mut |posed| {
                let [position, turn] = draws[posed.place];
                let whitened = posed.whitener * posed.residual;
                let expected = if posed.sight.is_some() { Vector3::new(position.x, 0.0, 0.0) } else { position };
                let off = (whitened - expected).norm();
                assert!(off < 1e-3, "{effect:?}, sample {}: {whitened:?}, drawn {expected:?}", posed.place);
                if let Some(residual) = posed.turn {
                    assert!((residual - turn * 1e-4).norm() < 1e-9, "{effect:?}, sample {}", posed.place);
                }
            });
        }
        let moved =
            |d: &Dataset| d.samples.iter().filter(|s| matches!(s.measured, Measured::Ball { .. })).map(|s| s.q[0]).sum::<f64>();
        let (truth, _) = subject.truth(Some("joint_scale:1"), &mut Streams { seed: 3, trial: 0 }.stream("injection")).unwrap();
        let measured = subject.measured(&truth, &mut Streams { seed: 3, trial: 1 }.stream("injection")).unwrap();
        assert!((moved(&measured[0]) - moved(&data)).abs() > 1e-5, "the arm centres itself by its joints");
    }
}
