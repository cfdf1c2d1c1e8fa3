//! The samples of a check beside those that they are compared with.

use std::collections::HashMap;

use nalgebra::{DMatrix, DVector, Matrix3, Vector3};

use super::conditions::Elementary;
use super::noise::{ComparisonNoise, NoiseOf, Whitening};
use super::seen::Seen;
use super::{CheckError, Pair};
use crate::identify::Application;
use crate::identify::calibration::Calibration;
use crate::identify::problem::Use;
use crate::math::positive_definite::inverse;
use crate::measure::dataset::{Dataset, Measured, NamedDataset, Sample};
use crate::residuals::noise::moments;
use crate::residuals::views::SeenSample;
use crate::robot::sites::{Axis6, MdhEntry, Site};
use crate::robot::statics::{Loads, Payload};
use crate::robot::{Link, Robot};
use crate::units::DEG;

/// Two samples are of one pose if no joint differs by more, rad or 0.01 m (docs/check.md).
const SAME_POSE: f64 = 1.0 * DEG;

/// The same for samples of one name: a joint that lost its zero stands elsewhere when the robot has found the ball again
/// (docs/check.md).
const SAME_POSE_BY_NAME: f64 = 5.0 * DEG;

/// Everything that the check needs of the two measurements.
pub(super) struct Scene {
    pub pairs: Vec<Pair>,
    pub seen: Vec<Seen>,
    pub whitening: Whitening,
    /// Whitened differences, of unit variance if nothing has changed.
    pub differences: DVector<f64>,
}

/// The samples of a dataset under a calibration: residuals, and displacements whitened by the noise of one measurement.
struct Applied {
    residuals: Vec<Vector3<f64>>,
    whiteners: Vec<Matrix3<f64>>,
    seen: Vec<Seen>,
}

/// The noise of the measurements of a campaign under a calibration.
pub(super) fn noise_of(
    calibration: &Calibration,
    NamedDataset { name, dataset }: NamedDataset<'_>,
) -> Result<ComparisonNoise, CheckError> {
    let data = [NamedDataset::new(name, dataset)];
    let Application { problem, values, .. } = calibration.apply(&data, Use::All)?;
    let samples: Vec<&Sample> = dataset.samples.iter().collect();
    let seen = SeenSample::all(&problem, &values, &samples, &data);
    ComparisonNoise::of(&seen, problem.noise_stated()).ok_or(CheckError::NoNoise)
}

impl Scene {
    pub fn new(
        calibration: &Calibration,
        noise: &ComparisonNoise,
        then: NamedDataset<'_>,
        now: NamedDataset<'_>,
    ) -> Result<Self, CheckError> {
        if now.dataset.samples.is_empty() {
            return Err(CheckError::Nothing);
        }
        let (before, after) = (applied(calibration, noise, then)?, applied(calibration, noise, now)?);
        let rows = after.seen.last().map_or(0, |s| s.rows.end);
        let mut differences = DMatrix::zeros(rows, 1);
        let mut pairs = Vec::with_capacity(after.seen.len());
        let mut seen = after.seen;
        let mut compared: Vec<Vec<usize>> = Vec::with_capacity(seen.len());
        for (k, sample) in now.dataset.samples.iter().enumerate() {
            let same = counterparts(sample, now.dataset, then.dataset);
            if same.is_empty() {
                return Err(CheckError::NoCounterpart { sample: sample.id.clone() });
            }
            let count = same.len() as f64;
            let earlier: Vector3<f64> = same.iter().map(|&s| before.residuals[s]).sum::<Vector3<f64>>() / count;
            let change = after.residuals[k] - earlier;
            let whitened = after.whiteners[k] * change;
            seen[k].rows.clone().zip(whitened.iter()).for_each(|(row, difference)| differences[(row, 0)] = *difference);
            let pose = (0..k).find(|&l| seen[l].pose == l && near(&now.dataset.samples[l], sample)).unwrap_or(k);
            seen[k].target = (0..k).find(|&l| seen[l].pose == pose && compared[l] == same).unwrap_or(k);
            (seen[k].pose, seen[k].counterparts) = (pose, count);
            // Whiteners are as the noise, inverted.
            let own = after.whiteners[k].norm();
            seen[k].earlier = same.iter().map(|&s| (own / before.whiteners[s].norm()).powi(2)).sum::<f64>() / count;
            pairs.push(Pair {
                now: sample.id.clone(),
                then: then.dataset.samples[same[0]].id.clone(),
                change,
                noise: f64::NAN,
            });
            compared.push(same);
        }
        let whitening = Whitening::of(&seen.iter().collect::<Vec<_>>())?;
        whitening.apply(&mut differences);
        for (k, pair) in pairs.iter_mut().enumerate() {
            // A distance, whose whitener has one row, has no noise in three directions.
            let one = inverse(after.whiteners[k]).map_or(f64::NAN, |root| root.norm() / 3f64.sqrt());
            pair.noise = whitening.variance(k).sqrt() * one;
        }
        Ok(Scene { pairs, seen, whitening, differences: differences.column(0).into_owned() })
    }

    /// Number of different poses of the arm.
    pub fn poses(&self) -> usize {
        self.seen.iter().enumerate().filter(|(k, s)| s.pose == *k).count()
    }

    /// Noise of one measurement, as stated, in units of that of its counterparts.
    pub fn noise_ratio(&self) -> f64 {
        let mean = self.seen.iter().map(|s| s.earlier).sum::<f64>() / self.seen.len().max(1) as f64;
        mean.sqrt().recip()
    }

    /// The whitened displacement of all samples, one after the other, per unit of every elementary change.
    pub fn elementary(&self) -> Vec<(Elementary, DVector<f64>)> {
        let laid_out = |of: &dyn Fn(&Seen) -> Vector3<f64>| {
            let mut column = DMatrix::zeros(self.differences.len(), 1);
            for one in &self.seen {
                let moved = of(one);
                (0..one.rows.len()).for_each(|i| column[(one.rows.start + i, 0)] = moved[i]);
            }
            self.whitening.apply(&mut column);
            column.column(0).into_owned()
        };
        let joints = self.seen.first().map_or(0, |s| s.joints.len());
        let joint = |j: usize| (Elementary::Joint(j + 1), laid_out(&|s| s.joints[j]));
        let tool = |k: usize| (Elementary::Tool(k), laid_out(&|s| s.tool[k]));
        let base = |k: usize| (Elementary::Base(k), laid_out(&|s| s.base[k]));
        let growth = std::iter::once((Elementary::Growth, laid_out(&|s| s.growth)));
        (0..joints).map(joint).chain((0..3).map(tool)).chain((0..3).map(base)).chain(growth).collect()
    }

    /// The samples of the campaign itself, as if each were measured once more.
    pub fn of_campaign(calibration: &Calibration, then: NamedDataset<'_>) -> Result<Vec<Seen>, CheckError> {
        Ok(applied(calibration, &noise_of(calibration, then)?, then)?.seen)
    }
}

/// True if two samples are of one pose.
fn near(a: &Sample, b: &Sample) -> bool {
    let within = if a.id == b.id { SAME_POSE_BY_NAME } else { SAME_POSE };
    a.q.len() == b.q.len() && a.q.iter().zip(&b.q).all(|(a, b)| (a - b).abs() <= within)
}

/// The counterparts of a sample: all rows of the same target, payload and pose.
pub(super) fn counterparts(sample: &Sample, now: &Dataset, then: &Dataset) -> Vec<usize> {
    let ball = |d: &Dataset, s: &Sample| match &s.measured {
        Measured::Ball { ball, .. } => d.balls.get(*ball).map(|b| b.id.clone()),
        Measured::Distance { anchor, .. } => d.anchors.get(*anchor).map(|a| format!("anchor {}", a.id)),
        Measured::Point(_) => None,
    };
    let payload = |d: &Dataset, s: &Sample| d.payloads.get(s.payload).map(|p| p.name.clone());
    let point = |d: &Dataset, s: &Sample| s.tool_target.and_then(|t| d.tool_targets.get(t)).map(|t| t.id.clone());
    let alike = |other: &Sample| {
        near(other, sample)
            && ball(then, other) == ball(now, sample)
            && payload(then, other) == payload(now, sample)
            && point(then, other) == point(now, sample)
            && std::mem::discriminant(&other.measured) == std::mem::discriminant(&sample.measured)
    };
    (0..then.samples.len()).filter(|&k| Use::All.takes(&then.samples[k]) && alike(&then.samples[k])).collect()
}

/// Every sample stands for itself: a pose of its own with one counterpart.
fn applied(
    calibration: &Calibration,
    noise: &ComparisonNoise,
    NamedDataset { name, dataset }: NamedDataset<'_>,
) -> Result<Applied, CheckError> {
    let data = [NamedDataset::new(name, dataset)];
    let Application { problem, values, refitted, .. } = calibration.apply(&data, Use::All)?;
    if !refitted.is_empty() {
        return Err(CheckError::OtherSetUp);
    }
    if noise.of == NoiseOf::Stated && !problem.noise_stated() {
        return Err(CheckError::NoNoise);
    }
    let robot = calibration.robot.as_ref();
    let compliance: Vec<f64> =
        (1..=robot.joints()).map(|j| calibration.estimate(&format!("c{j}")).map_or(0.0, |e| e.value)).collect();
    let samples: Vec<&Sample> = dataset.samples.iter().collect();
    let measured = SeenSample::all(&problem, &values, &samples, &data);
    let stays = moments(&measured);
    let mut first_of_stay = HashMap::new();
    let mut applied = Applied { residuals: Vec::new(), whiteners: Vec::new(), seen: Vec::new() };
    let mut loads = Loads::new(robot.joints());
    problem.for_each_sample(&values, &mut |at| {
        let k = applied.seen.len();
        let whitener = at.whitener / noise.factor;
        let sample = &dataset.samples[at.place];
        let column = |site: Site| at.posture.column(site);
        let ball = match &sample.measured {
            Measured::Ball { ball, .. } => dataset.balls.get(*ball).map(|b| b.id.clone()),
            _ => None,
        };
        let next = applied.seen.last().map_or(0, |s: &Seen| s.rows.end);
        let mass = compliance.iter().any(|c| *c != 0.0).then(|| {
            let centre = dataset.payloads.get(sample.payload).map_or_else(Vector3::zeros, |p| p.com);
            let centre = at.posture.flange().point(&centre);
            let twist = |(j, c): (usize, &f64)| {
                let (axis, origin) = at.posture.joint_axis(j);
                column(Site::mdh(j, MdhEntry::Theta)) * (c * axis.dot(&(centre - origin).cross(&dataset.gravity)))
            };
            compliance.iter().enumerate().map(twist).sum::<Vector3<f64>>()
        });
        let payload = dataset.payloads.get(sample.payload).cloned().unwrap_or_else(Payload::none);
        loads.compute(robot, at.posture, &payload, &dataset.gravity, &Vector3::zeros());
        let whitened = |columns: Vec<Vector3<f64>>| columns.into_iter().map(|c| whitener * c).collect();
        applied.residuals.push(at.residual);
        applied.whiteners.push(whitener);
        applied.seen.push(Seen {
            id: sample.id.clone(),
            rows: next..next + at.height,
            pose: k,
            event: *first_of_stay.entry(stays[k]).or_insert(k),
            target: k,
            counterparts: 1.0,
            earlier: 1.0,
            common: noise.common(&measured[k]),
            tool: whitened((0..3).map(|k| column(Site::tool(k))).collect()),
            base: whitened(Axis6::ALL.iter().map(|axis| column(Site::Base(*axis))).collect()),
            joints: whitened((0..robot.joints()).map(|j| column(Site::mdh(j, MdhEntry::Theta))).collect()),
            torques: loads.tau.clone(),
            sides: sample.approach.as_ref().map_or_else(Vec::new, |sides| sides.iter().map(|s| f64::from(*s)).collect()),
            growth: whitener * growth(robot, &column),
            mass: mass.map(|m| whitener * m),
            moved: whitened((0..3).map(|k| Vector3::ith(k, 1.0)).collect()),
            ball,
            point: sample.tool_target.and_then(|t| dataset.tool_targets.get(t)).map(|t| t.id.clone()),
        });
    });
    Ok(applied)
}

/// Displacement by links that all grow by the same share.
fn growth(robot: &Robot, column: &impl Fn(Site) -> Vector3<f64>) -> Vector3<f64> {
    let of = |(i, link): (usize, &Link)| {
        column(Site::mdh(i, MdhEntry::A)) * link.mdh.a + column(Site::mdh(i, MdhEntry::D)) * link.mdh.d
    };
    robot.links.iter().enumerate().map(of).sum()
}
