//! What may have happened to a calibrated robot, and by what displacements of its samples it shows.

use std::collections::HashMap;

use nalgebra::{DMatrix, DVector, Matrix3, Vector3};

use super::noise::{ComparisonNoise, NoiseOf, Whitening};
use super::{CheckError, Pair, SAME_POSE, counterparts};
use crate::assess::noise::moments;
use crate::assess::residual_views::SeenSample;
use crate::identify::{Application, Calibration, Use};
use crate::measure::{Dataset, Measured, Sample};
use crate::robot::{Axis6, Link, MdhEntry, Robot, Site};

/// A condition in which a robot may be found.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub enum Condition {
    /// As it was calibrated.
    Valid,
    /// The tool sits on the flange otherwise.
    ToolMoved,
    /// The base or the artifact moved; where only balls are measured the two are the same.
    BaseMoved,
    /// One ball of the artifact moved.
    BallMoved(String),
    /// One measured point of the tool moved on it: its name, or `None` for the TCP.
    TargetMoved(Option<String>),
    /// A joint lost its zero, counted from 1.
    JointSlipped(usize),
    /// The arm is warmer, or colder: all its links have grown in proportion.
    Warm,
    /// The flange carries another mass than entered.
    OtherPayload,
    /// A single sample disagrees with all others.
    SingleSample(String),
    /// Something else, or several things.
    Recalibrate,
}

impl Condition {
    /// The name in files.
    pub fn name(&self) -> String {
        match self {
            Condition::Valid => "valid".into(),
            Condition::ToolMoved => "tool_moved".into(),
            Condition::BaseMoved => "base_or_artifact_moved".into(),
            Condition::BallMoved(ball) => format!("ball_moved:{ball}"),
            Condition::TargetMoved(target) => format!("target_moved:{}", target.as_deref().unwrap_or("tcp")),
            Condition::JointSlipped(joint) => format!("joint_slipped:{joint}"),
            Condition::Warm => "warm".into(),
            Condition::OtherPayload => "payload_not_as_entered".into(),
            Condition::SingleSample(id) => format!("sample:{id}"),
            Condition::Recalibrate => "recalibrate".into(),
        }
    }

    /// True if it displaces all samples, along columns that are linear in its size.
    pub(super) fn is_of_all(&self) -> bool {
        !matches!(
            self,
            Condition::BallMoved(_) | Condition::TargetMoved(_) | Condition::SingleSample(_) | Condition::Recalibrate
        )
    }

    /// Conditions of one kind share the probability that the kind has before any data.
    pub(super) fn kind(&self) -> usize {
        match self {
            Condition::Valid => 0,
            Condition::ToolMoved => 1,
            Condition::BaseMoved => 2,
            Condition::BallMoved(_) => 3,
            Condition::JointSlipped(_) => 4,
            Condition::Warm => 5,
            Condition::OtherPayload => 6,
            Condition::SingleSample(_) => 7,
            Condition::Recalibrate => 8,
            Condition::TargetMoved(_) => 9,
        }
    }
}

/// A change of one number, of which a chart is kept.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Elementary {
    /// The zero of a joint, counted from 1; rad, or m.
    Joint(usize),
    /// The tool along an axis of the flange, counted from 0; m.
    Tool(usize),
    /// The base along an axis of the world, counted from 0; m.
    Base(usize),
    /// The size of the arm, as a share.
    Growth,
}

/// A sample as it is measured again: its whitened displacements.
pub(super) struct Seen {
    /// Id of the sample.
    pub id: String,
    /// Name of the ball, for a ball.
    pub ball: Option<String>,
    /// Name of the measured point of the tool; `None` for the TCP.
    pub point: Option<String>,
    /// First of its scalar differences, and their number.
    pub rows: (usize, usize),
    /// Samples of equal number are of one pose of the arm, of one stay there, and of one target there.
    pub pose: usize,
    pub event: usize,
    pub target: usize,
    /// Number of measurements that it is compared with.
    pub counterparts: f64,
    /// Whitened motions of all targets of a pose from one stay there to the next, one-sigma each.
    pub common: Vec<Vector3<f64>>,
    /// Whitened displacement per unit, by condition, of those that act on all samples.
    tool: Vec<Vector3<f64>>,
    base: Vec<Vector3<f64>>,
    joints: Vec<Vector3<f64>>,
    growth: Vector3<f64>,
    mass: Option<Vector3<f64>>,
    moved: Vec<Vector3<f64>>,
}

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
pub(super) fn noise_of(calibration: &Calibration, (name, dataset): (&str, &Dataset)) -> Result<ComparisonNoise, CheckError> {
    let data = [(name, dataset)];
    let Application { problem, values, .. } = calibration.apply(&data, Use::All)?;
    let samples: Vec<&Sample> = dataset.samples.iter().collect();
    let seen = SeenSample::all(&problem, &values, &samples, &data);
    ComparisonNoise::of(&seen, problem.noise_stated()).ok_or(CheckError::NoNoise)
}

impl Scene {
    pub fn new(
        calibration: &Calibration,
        noise: &ComparisonNoise,
        then: (&str, &Dataset),
        now: (&str, &Dataset),
    ) -> Result<Self, CheckError> {
        if now.1.samples.is_empty() {
            return Err(CheckError::Nothing);
        }
        let (before, after) = (applied(calibration, noise, then)?, applied(calibration, noise, now)?);
        let rows = after.seen.last().map_or(0, |s| s.rows.0 + s.rows.1);
        let mut differences = DMatrix::zeros(rows, 1);
        let mut pairs = Vec::with_capacity(after.seen.len());
        let mut seen = after.seen;
        let mut compared: Vec<Vec<usize>> = Vec::with_capacity(seen.len());
        for (k, sample) in now.1.samples.iter().enumerate() {
            let same = counterparts(sample, now.1, then.1);
            if same.is_empty() {
                return Err(CheckError::NoCounterpart { sample: sample.id.clone() });
            }
            let count = same.len() as f64;
            let earlier: Vector3<f64> = same.iter().map(|&s| before.residuals[s]).sum::<Vector3<f64>>() / count;
            let change = after.residuals[k] - earlier;
            let whitened = after.whiteners[k] * change;
            let (first, height) = seen[k].rows;
            (0..height).for_each(|i| differences[(first + i, 0)] = whitened[i]);
            let pose = (0..k).find(|&l| seen[l].pose == l && near(&now.1.samples[l], sample)).unwrap_or(k);
            seen[k].target = (0..k).find(|&l| seen[l].pose == pose && compared[l] == same).unwrap_or(k);
            (seen[k].pose, seen[k].counterparts) = (pose, count);
            pairs.push(Pair { now: sample.id.clone(), then: then.1.samples[same[0]].id.clone(), change, noise: f64::NAN });
            compared.push(same);
        }
        let whitening = Whitening::of(&seen.iter().collect::<Vec<_>>());
        whitening.apply(&mut differences);
        for (k, pair) in pairs.iter_mut().enumerate() {
            let one = after.whiteners[k].try_inverse().map_or(f64::NAN, |root| root.norm() / 3f64.sqrt());
            pair.noise = whitening.variance(k).sqrt() * one;
        }
        Ok(Scene { pairs, seen, whitening, differences: differences.column(0).into_owned() })
    }

    /// The whitened displacement of all samples, one after the other, per unit of every elementary change.
    pub fn elementary(&self) -> Vec<(Elementary, DVector<f64>)> {
        let laid_out = |of: &dyn Fn(&Seen) -> Vector3<f64>| {
            let mut column = DMatrix::zeros(self.differences.len(), 1);
            for one in &self.seen {
                let moved = of(one);
                (0..one.rows.1).for_each(|i| column[(one.rows.0 + i, 0)] = moved[i]);
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
    pub fn of_campaign(calibration: &Calibration, then: (&str, &Dataset)) -> Result<Vec<Seen>, CheckError> {
        Ok(applied(calibration, &noise_of(calibration, then)?, then)?.seen)
    }
}

/// True if two samples are of one pose.
pub(super) fn near(a: &Sample, b: &Sample) -> bool {
    a.q.len() == b.q.len() && a.q.iter().zip(&b.q).all(|(a, b)| (a - b).abs() <= SAME_POSE)
}

/// Every sample stands for itself: a pose of its own with one counterpart.
fn applied(
    calibration: &Calibration,
    noise: &ComparisonNoise,
    (name, dataset): (&str, &Dataset),
) -> Result<Applied, CheckError> {
    let data = [(name, dataset)];
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
    problem.for_each_sample(&values, &mut |at| {
        let k = applied.seen.len();
        let (common, factor) = noise.common(&measured[k]);
        let whitener = at.whitener / factor;
        let sample = &dataset.samples[at.place];
        let column = |site: Site| at.posture.column(site);
        let ball = match &sample.measured {
            Measured::Ball { ball, .. } => dataset.balls.get(*ball).map(|b| b.id.clone()),
            _ => None,
        };
        let next = applied.seen.last().map_or(0, |s: &Seen| s.rows.0 + s.rows.1);
        let mass = compliance.iter().any(|c| *c != 0.0).then(|| {
            let centre = dataset.payloads.get(sample.payload).map_or_else(Vector3::zeros, |p| p.com);
            let centre = at.posture.flange().point(&centre);
            let twist = |(j, c): (usize, &f64)| {
                let (axis, origin) = at.posture.joint_axis(j);
                column(Site::mdh(j, MdhEntry::Theta)) * (c * axis.dot(&(centre - origin).cross(&dataset.gravity)))
            };
            compliance.iter().enumerate().map(twist).sum::<Vector3<f64>>()
        });
        let whitened = |columns: Vec<Vector3<f64>>| columns.into_iter().map(|c| whitener * c).collect();
        applied.residuals.push(at.residual);
        applied.whiteners.push(whitener);
        applied.seen.push(Seen {
            id: sample.id.clone(),
            rows: (next, at.height),
            pose: k,
            event: *first_of_stay.entry(stays[k]).or_insert(k),
            target: k,
            counterparts: 1.0,
            common,
            tool: whitened((0..3).map(|k| column(Site::tool(k))).collect()),
            base: whitened(Axis6::ALL.iter().map(|axis| column(Site::Base(*axis))).collect()),
            joints: whitened((0..robot.joints()).map(|j| column(Site::mdh(j, MdhEntry::Theta))).collect()),
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

/// Every condition but "valid" with its columns: scalar differences of these samples, one after the other, x parameters of
/// arbitrary scale, whitened.
pub(super) fn of_samples(seen: &[&Seen], whitening: &Whitening) -> Vec<(Condition, DMatrix<f64>)> {
    let rows: usize = seen.iter().map(|s| s.rows.1).sum();
    let laid_out = |width: usize, of: &dyn Fn(&Seen, usize) -> Vector3<f64>| {
        let mut matrix = DMatrix::zeros(rows, width);
        let mut first = 0;
        for one in seen {
            for k in 0..width {
                let column = of(one, k);
                (0..one.rows.1).for_each(|i| matrix[(first + i, k)] = column[i]);
            }
            first += one.rows.1;
        }
        matrix
    };
    let mut all = vec![
        (Condition::ToolMoved, laid_out(3, &|s, k| s.tool[k])),
        (Condition::BaseMoved, laid_out(6, &|s, k| s.base[k])),
        (Condition::Warm, laid_out(1, &|s, _| s.growth)),
    ];
    let joints = seen.first().map_or(0, |s| s.joints.len());
    all.extend((0..joints).map(|j| (Condition::JointSlipped(j + 1), laid_out(1, &|s, _| s.joints[j]))));
    if seen.iter().all(|s| s.mass.is_some()) {
        all.push((Condition::OtherPayload, laid_out(1, &|s, _| s.mass.unwrap_or_default())));
    }
    let mut balls: Vec<&String> = seen.iter().filter_map(|s| s.ball.as_ref()).collect();
    balls.sort();
    balls.dedup();
    let of_ball = |ball: &String| {
        let moved = |s: &Seen, k: usize| if s.ball.as_ref() == Some(ball) { s.moved[k] } else { Vector3::zeros() };
        (Condition::BallMoved(ball.clone()), laid_out(3, &moved))
    };
    // Of a single ball its own motion is that of the artifact.
    if balls.len() > 1 {
        all.extend(balls.into_iter().map(of_ball));
    }
    let mut points: Vec<&Option<String>> = seen.iter().map(|s| &s.point).collect();
    points.sort();
    points.dedup();
    let of_point = |point: &Option<String>| {
        let moved = |s: &Seen, k: usize| if s.point == *point { s.tool[k] } else { Vector3::zeros() };
        (Condition::TargetMoved(point.clone()), laid_out(3, &moved))
    };
    // As with balls: of a single point its own motion is that of the tool.
    if points.len() > 1 {
        all.extend(points.into_iter().map(of_point));
    }
    if seen.len() > 1 {
        let of_one = |one: &&Seen| {
            let moved = |s: &Seen, k: usize| if std::ptr::eq(s, *one) { Vector3::ith(k, 1.0) } else { Vector3::zeros() };
            (Condition::SingleSample(one.id.clone()), laid_out(one.rows.1, &moved))
        };
        all.extend(seen.iter().map(of_one));
    }
    all.push((Condition::Recalibrate, DMatrix::identity(rows, rows)));
    // What the poses do not show cannot be checked.
    all.retain(|(_, matrix)| matrix.amax() > 0.0);
    all.iter_mut().for_each(|(_, matrix)| whitening.apply(matrix));
    all
}
