//! Where a fit begins: the base of every set-up, found in closed form where the drawing of the cell is no guide, and which part of it
//! no measurement can tell because nothing in the world is known.

use std::collections::HashMap;

use nalgebra::{DMatrix, Matrix3, Point3, Vector3};

use super::Use;
use crate::identify::linalg;
use crate::measure::{Ball, Dataset, Measured, Sample};
use crate::robot::{Axis6, FramePose, Robot, rigid_fit, world_from_tool};
use crate::units::MM;

/// A nominal base further than this from what the measured places say (rms) is replaced by a closed-form start, and a free ball further
/// than this from where it was probed. Gauss-Newton needs no
/// help within a decimetre, and a base turned to make up for a wrong tool would be a worse start than the drawing's.
const NOMINAL_IS_CLOSE: f64 = 100.0 * MM;

/// Known places that spread by less than this share of their distance from the base are one place: they hold no direction.
const SPREAD: f64 = 1e-3;

/// Where the sessions of a dataset begin.
pub(super) struct Start {
    /// Base of each session.
    pub bases: Vec<FramePose>,
    /// Position of every ball: the stated one, or, of a free ball decimetres from where the arm probed it, the mean of the TCPs.
    pub balls: Vec<Vector3<f64>>,
}

/// Base of each session of a dataset, from which Gauss-Newton starts: the nominal one, or, where measured places contradict it by
/// decimetres, the rigid motion that carries the nominal TCPs onto them (Kabsch 1976).
///
/// Places are tracker points and the balls whose position is known; a free ball is a place from the second session on, where the
/// first has put it.
pub(super) fn start(robot: &Robot, dataset: &Dataset, which: Use, sessions: &[Option<&str>], base_is_sought: bool) -> Start {
    let mut found: HashMap<usize, Vector3<f64>> = HashMap::new();
    let mut bases = Vec::with_capacity(sessions.len());
    for session in sessions {
        let samples = || dataset.samples.iter().filter(|s| which.takes(s) && s.session.as_deref() == *session);
        let pairs: Vec<(Vector3<f64>, Vector3<f64>)> =
            samples().filter_map(|s| Some((tcp(robot, dataset, s), place(dataset, s, &found)?))).collect();
        let base = if base_is_sought { closer_base(dataset.base, &pairs) } else { dataset.base };
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
    Start { bases, balls: dataset.balls.iter().enumerate().map(position).collect() }
}

fn closer_base(nominal: FramePose, pairs: &[(Vector3<f64>, Vector3<f64>)]) -> FramePose {
    let pose = nominal.pose();
    let squares: f64 = pairs.iter().map(|(tcp, p)| (pose * Point3::from(*tcp) - Point3::from(*p)).norm_squared()).sum();
    if (squares / pairs.len().max(1) as f64).sqrt() < NOMINAL_IS_CLOSE {
        return nominal;
    }
    rigid_fit(pairs).map_or(nominal, |pose| FramePose::from_pose(&pose))
}

/// Nominal TCP of a sample in the robot's base, a left-over reading taken in.
fn tcp(robot: &Robot, dataset: &Dataset, sample: &Sample) -> Vector3<f64> {
    let tool = world_from_tool(robot, &FramePose::default(), &dataset.tool, &sample.q);
    match &sample.measured {
        Measured::Ball { reading: Some(reading), .. } => tool.transform_point(&Point3::from(*reading)).coords,
        _ => tool.translation.vector,
    }
}

/// Where in the world the TCP was, for samples that say so.
fn place(dataset: &Dataset, sample: &Sample, found: &HashMap<usize, Vector3<f64>>) -> Option<Vector3<f64>> {
    match sample.measured {
        Measured::Point(point) => Some(point),
        Measured::Ball { ball, .. } if dataset.balls[ball].free => found.get(&ball).copied(),
        Measured::Ball { ball, .. } => Some(dataset.balls[ball].position),
        Measured::Distance { .. } => None,
    }
}

/// Which numbers of a base (x, y, z, rz, ry, rx) define the world of a session instead of lying in it: those that could be changed at
/// will, with everything unknown in the world carried along, since no known place is there to contradict them.
///
/// `earlier` holds the sessions of the dataset that were set up before: the free balls they probed are places by now.
pub(super) fn worlds_own(
    dataset: &Dataset,
    which: Use,
    session: Option<&str>,
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
    let arms: Vec<Vector3<f64>> =
        dataset.samples.iter().filter(|s| of(session, s)).filter_map(known).map(|place| place - origin).collect();
    if arms.is_empty() {
        return Axis6::ALL.to_vec();
    }
    // d(place)/d(base): a shift, and a turn about each axis of the world, which span what a base can do.
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
