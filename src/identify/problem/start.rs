//! The start of a fit: the base of every set-up, found in closed form if the nominal cell is not close, and the part of it
//! that no measurement can determine because nothing in the world is known.

use std::collections::HashMap;

use nalgebra::{DMatrix, Matrix3, Matrix6, Point3, Vector3};

use super::Use;
use super::batch::BATCH;
use crate::math::linalg;
use crate::math::positive_definite::cholesky;
use crate::math::{nearest_rotation, rigid_fit};
use crate::measure::dataset::{Ball, Dataset, Measured, Sample};
use crate::robot::kinematics::{BatchInput, Postures, world_from_tool};
use crate::robot::sites::{Axis6, SiteIndex};
use crate::robot::{FramePose, Robot, rotation_vector};
use crate::units::{DEG, MM};

/// A nominal base that disagrees with the measured positions by more than this (rms) is replaced by a closed-form start,
/// and so is a free ball further than this from where it was probed. Gauss-Newton needs no help within a decimetre, and a
/// base rotated to compensate a wrong tool would be a worse start than the nominal one.
const NOMINAL_IS_CLOSE: f64 = 100.0 * MM;

/// The same for axes of orientations, rad.
const NOMINAL_IS_CLOSE_ANGLE: f64 = 5.0 * DEG;

/// Known positions that spread by less than this share of their distance from the base count as one: they define no
/// direction.
const SPREAD: f64 = 1e-3;

/// Starting values of the sessions of a dataset.
pub(super) struct Start {
    /// Base of each session.
    pub bases: Vec<FramePose>,
    /// Rotation vector of the probe's axes relative to the tool's, of each session, rad.
    pub probes: Vec<Vector3<f64>>,
    /// Position of every ball: the stated one, or, for a free ball decimetres from where the arm probed it, the mean of the
    /// TCPs.
    pub balls: Vec<Vector3<f64>>,
}

/// Starting base of each session of a dataset: the nominal one, or, if measured positions contradict it by decimetres, the
/// rigid motion that maps the nominal TCPs onto them (Kabsch 1976).
///
/// The positions are tracker points and balls with known positions; a free ball counts from the second session on, with the
/// position found in the first.
pub(super) fn start(robot: &Robot, dataset: &Dataset, which: Use, sessions: &[Option<&str>], base_is_sought: bool) -> Start {
    let mut found: HashMap<usize, Vector3<f64>> = HashMap::new();
    let mut bases = Vec::with_capacity(sessions.len());
    for session in sessions {
        let samples = || dataset.samples.iter().filter(|s| which.takes(s) && s.session.as_deref() == *session);
        let placed = || samples().filter_map(|s| Some((s, place(dataset, s, &found)?)));
        let base = match bases.first() {
            Some(first) if dataset.shared.base => *first,
            _ if base_is_sought && !are_near(robot, dataset, placed()) => {
                let pairs: Vec<_> = placed().map(|(s, place)| (tcp(robot, dataset, s), place)).collect();
                closer_base(dataset.base, &pairs)
            }
            _ => dataset.base,
        };
        let mut sums: HashMap<usize, (Vector3<f64>, f64)> = HashMap::new();
        for sample in samples() {
            if let Measured::Ball { ball, .. } = sample.measured
                && dataset.balls[ball].free
            {
                let at = base.pose() * Point3::from(tcp(robot, dataset, sample));
                let (sum, count) = sums.entry(ball).or_insert((Vector3::zeros(), 0.0));
                *sum += at.coords;
                *count += 1.0;
            }
        }
        for (ball, (sum, count)) in sums {
            found.entry(ball).or_insert(sum / count);
        }
        bases.push(base);
    }
    let position = |(b, ball): (usize, &Ball)| match found.get(&b) {
        Some(at) if (at - ball.position).norm() > NOMINAL_IS_CLOSE => *at,
        _ => ball.position,
    };
    let probes = match dataset.tool_free {
        true => sessions.iter().zip(&bases).map(|(session, base)| probe(robot, dataset, which, *session, base)).collect(),
        false => vec![Vector3::zeros(); sessions.len()],
    };
    Start { bases, probes, balls: dataset.balls.iter().enumerate().map(position).collect() }
}

/// Rotation vector of the probe's axes relative to the tool's: the rotation nearest to all that a session measured (Moakher
/// 2002), or zero if that is near enough.
fn probe(robot: &Robot, dataset: &Dataset, which: Use, session: Option<&str>, base: &FramePose) -> Vector3<f64> {
    let samples = dataset.samples.iter().filter(|s| which.takes(s) && s.session.as_deref() == session);
    let turned = samples.filter_map(|s| {
        let nominal = world_from_tool(robot, base, &dataset.tool, &s.q).rotation;
        Some((nominal.inverse() * s.orientation?.world_from_tool()).into_inner())
    });
    let sum = turned.fold(Matrix3::zeros(), |sum: Matrix3<f64>, turn| sum + turn);
    let turned = nearest_rotation(&sum).map_or(Vector3::zeros(), |r| rotation_vector(&r));
    if turned.norm() < NOMINAL_IS_CLOSE_ANGLE { Vector3::zeros() } else { turned }
}

/// True if the nominal TCPs are certainly so near to the measured positions that [`closer_base`] keeps the nominal base:
/// computed in lanes, and left undecided within a hundredth of its limit.
fn are_near<'a>(robot: &Robot, dataset: &Dataset, placed: impl Iterator<Item = (&'a Sample, Vector3<f64>)>) -> bool {
    let deviations = vec![[0.0; BATCH]; SiteIndex::new(robot.joints()).len()];
    let base = dataset.base.to_array().map(|x| [x; BATCH]);
    let (mut tool, mut q) = ([[0.0; BATCH]; 3], vec![[0.0; BATCH]; robot.joints()]);
    let mut postures = Postures::new(robot);
    let (mut squares, mut count) = (0.0, 0usize);
    let mut batch: Vec<Vector3<f64>> = Vec::with_capacity(BATCH);
    let mut add = |batch: &mut Vec<Vector3<f64>>, tool: &[[f64; BATCH]; 3], q: &[[f64; BATCH]]| {
        postures.set_all(robot, &BatchInput { base: &base, tool, q, deviations: &deviations });
        let tcps = postures.tcps();
        squares += batch.drain(..).enumerate().map(|(lane, p)| (tcps.at(lane) - p).norm_squared()).sum::<f64>();
    };
    for (sample, place) in placed {
        let lane = batch.len();
        let point = point_of_tool(dataset, sample);
        tool.iter_mut().zip(&point).for_each(|(tool, x)| tool[lane] = *x);
        q.iter_mut().zip(&sample.q).for_each(|(q, angle)| q[lane] = *angle);
        batch.push(place);
        count += 1;
        if batch.len() == BATCH {
            add(&mut batch, &tool, &q);
        }
    }
    if !batch.is_empty() {
        add(&mut batch, &tool, &q);
    }
    (squares / count.max(1) as f64).sqrt() < 0.99 * NOMINAL_IS_CLOSE
}

/// Nominal place of a sample's measured point in the last frame, including a residual reading, m.
fn point_of_tool(dataset: &Dataset, sample: &Sample) -> Vector3<f64> {
    let tool = dataset.tool_at(sample.tool_target);
    match &sample.measured {
        Measured::Ball { reading: Some(reading), .. } => tool.pose().transform_point(&Point3::from(*reading)).coords,
        _ => Vector3::from(tool.xyz),
    }
}

fn closer_base(nominal: FramePose, pairs: &[(Vector3<f64>, Vector3<f64>)]) -> FramePose {
    let pose = nominal.pose();
    let squares: f64 = pairs.iter().map(|(tcp, p)| (pose * Point3::from(*tcp) - Point3::from(*p)).norm_squared()).sum();
    if (squares / pairs.len().max(1) as f64).sqrt() < NOMINAL_IS_CLOSE {
        return nominal;
    }
    rigid_fit(pairs).map_or(nominal, |pose| FramePose::from_pose(&pose))
}

/// True if known positions at these places from the base (m) certainly determine all six components of it: by the pivots of
/// the normal matrix, which are the squared parts of each column outside the span of the earlier ones. Closer to [`SPREAD`]
/// than ten times, rounding could decide, and it is left undecided.
fn spread_widely(arms: &[Vector3<f64>]) -> bool {
    let sum: Vector3<f64> = arms.iter().sum();
    let moments: Matrix3<f64> = arms.iter().map(|r| r * r.transpose()).sum();
    let (count, squares) = (arms.len() as f64, moments.trace());
    let axes = [Vector3::z(), Vector3::y(), Vector3::x()];
    let mut normal = Matrix6::zeros();
    for k in 0..3 {
        normal[(k, k)] = count;
        normal.fixed_view_mut::<3, 1>(0, 3 + k).copy_from(&axes[k].cross(&sum));
        for l in 0..3 {
            // (a x r) . (b x r) = (a . b) r² - (a . r) (b . r)
            normal[(3 + k, 3 + l)] = axes[k].dot(&axes[l]) * squares - axes[k].dot(&(moments * axes[l]));
        }
    }
    let lower = normal.transpose();
    normal.fixed_view_mut::<3, 3>(3, 0).copy_from(&lower.fixed_view::<3, 3>(3, 0));
    let Ok(factor) = cholesky(normal) else { return false };
    let l = factor.l_dirty();
    (0..6).all(|k| l[(k, k)] > 10.0 * SPREAD * normal[(k, k)].sqrt())
}

/// Nominal position of a sample's measured point in the robot's base, including a residual reading.
fn tcp(robot: &Robot, dataset: &Dataset, sample: &Sample) -> Vector3<f64> {
    let tool = world_from_tool(robot, &FramePose::default(), &dataset.tool_at(sample.tool_target), &sample.q);
    match &sample.measured {
        Measured::Ball { reading: Some(reading), .. } => tool.transform_point(&Point3::from(*reading)).coords,
        _ => tool.translation.vector,
    }
}

/// World position of the TCP, for samples that define it.
fn place(dataset: &Dataset, sample: &Sample, found: &HashMap<usize, Vector3<f64>>) -> Option<Vector3<f64>> {
    match sample.measured {
        Measured::Point(point) => Some(point),
        Measured::Ball { ball, .. } if dataset.balls[ball].free => found.get(&ball).copied(),
        Measured::Ball { ball, .. } => Some(dataset.balls[ball].position),
        Measured::Distance { .. } => None,
    }
}

/// The base components (x, y, z, rz, ry, rx) that define the world of a base instead of a pose in it: those that could be
/// changed arbitrarily, together with everything unknown in the world, because no known position contradicts them. `own` are
/// the sessions with that base.
///
/// `earlier` holds the sessions of the dataset already set up: the free balls they probed now have positions.
pub(super) fn datum_freedoms(
    dataset: &Dataset,
    which: Use,
    own: &[Option<&str>],
    earlier: &[Option<&str>],
    base: &FramePose,
) -> Vec<Axis6> {
    let of = |session: Option<&'_ str>, s: &Sample| which.takes(s) && s.session.as_deref() == session;
    let probed_before = |ball: usize| {
        let on = |s: &Sample| matches!(s.measured, Measured::Ball { ball: b, .. } if b == ball);
        dataset.samples.iter().any(|s| on(s) && earlier.iter().any(|e| of(*e, s)))
    };
    let before: HashMap<usize, Vector3<f64>> = (0..dataset.balls.len())
        .filter(|&b| dataset.balls[b].free && probed_before(b))
        .map(|b| (b, dataset.balls[b].position))
        .collect();
    let known = |s: &Sample| match s.measured {
        Measured::Distance { anchor, .. } => Some(dataset.anchors[anchor].position),
        _ => place(dataset, s, &before),
    };
    let origin = Vector3::from(base.xyz);
    let arms: Vec<Vector3<f64>> = dataset
        .samples
        .iter()
        .filter(|s| own.iter().any(|o| of(*o, s)))
        .filter_map(known)
        .map(|place| place - origin)
        .collect();
    if arms.is_empty() {
        return Axis6::ALL.to_vec();
    }
    if spread_widely(&arms) {
        return Vec::new();
    }
    // d(position)/d(base): a translation, and a rotation about each world axis, which span the motions of a base.
    let mut motions = DMatrix::zeros(3 * arms.len(), 6);
    for (k, arm) in arms.iter().enumerate() {
        motions.fixed_view_mut::<3, 3>(3 * k, 0).copy_from(&Matrix3::identity());
        for (column, axis) in [Vector3::z(), Vector3::y(), Vector3::x()].iter().enumerate() {
            motions.fixed_view_mut::<3, 1>(3 * k, 3 + column).copy_from(&axis.cross(arm));
        }
    }
    let rank = linalg::ordered_independent_columns(&motions, &[SPREAD; 6]);
    rank.dependent.iter().map(|d| Axis6::ALL[d.column]).collect()
}
