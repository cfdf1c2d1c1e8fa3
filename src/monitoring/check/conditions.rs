//! Possible changes of a calibrated robot, and the displacements of the samples that each causes.

use nalgebra::{DMatrix, Vector3};

use super::noise::Whitening;
use super::seen::Seen;
use crate::effects::EffectId;
use crate::effects::facts::Intervention;
use crate::effects::registry::Registry;

/// A true change displaces the samples as its columns say but for this share of their root mean square: columns are linear, and
/// those of a mass know its place and the springs of the arm only so well. Without it a large change would be taken for one of
/// more freedom that fits a little better (docs/check.md).
pub(super) const IN_SHAPE: f64 = 0.03;

/// The same for a mass and for a gear that gives way: the place of the mass is unknown, a calibration determines the compliance of
/// a joint to some tenths of it only, and masses of links are stated as roughly (docs/check.md).
const LOAD_IN_SHAPE: f64 = 0.25;

/// Torque, N m, of which a joint must carry more at a sample for its gear to be asked about: less is not known from masses, and
/// what stands by it would be taken for the gear (docs/check.md).
const LEAST_TORQUE: f64 = 0.5;

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
    /// The gear of a joint, counted from 1, gives way more to the load, or less.
    GearGivesWay(usize),
    /// A joint, counted from 1, stops short by another amount on the side from which it comes.
    LostMotion(usize),
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
            Condition::GearGivesWay(joint) => format!("gear_gives_way:{joint}"),
            Condition::LostMotion(joint) => format!("lost_motion:{joint}"),
            Condition::Warm => "warm".into(),
            Condition::OtherPayload => "payload_not_as_entered".into(),
            Condition::SingleSample(id) => format!("sample:{id}"),
            Condition::Recalibrate => "recalibrate".into(),
        }
    }

    /// What is done about it, as the family of effects of which it is an event says; `None` if nothing has changed, or nobody
    /// knows what.
    pub fn intervention(&self) -> Option<Intervention> {
        let family = match self {
            Condition::Valid | Condition::Recalibrate => return None,
            Condition::ToolMoved => EffectId::TOOL_STEP,
            Condition::BaseMoved => EffectId::BASE_STEP,
            Condition::BallMoved(_) => EffectId::BALL_STEP,
            Condition::TargetMoved(_) => EffectId::TARGET,
            Condition::JointSlipped(_) => EffectId::JOINT_STEP,
            // A gear that was as soft when the robot was calibrated is corrected in the model; one that became softer is worn.
            Condition::GearGivesWay(_) => EffectId::GRAVITY_BACKLASH,
            Condition::LostMotion(_) => EffectId::HYSTERESIS,
            Condition::Warm => EffectId::THERMAL_GROWTH,
            Condition::OtherPayload => EffectId::PAYLOAD_MASS,
            Condition::SingleSample(_) => EffectId::OUTLIER,
        };
        Registry::catalogue().family(family).map(|family| family.meaning.intervention)
    }

    /// True if it displaces all samples, along columns that are linear in its size.
    pub(super) fn is_of_all(&self) -> bool {
        !matches!(
            self,
            Condition::BallMoved(_) | Condition::TargetMoved(_) | Condition::SingleSample(_) | Condition::Recalibrate
        )
    }

    /// True if it acts through a load, which is known by its proportions only.
    pub(super) fn is_of_load(&self) -> bool {
        matches!(self, Condition::OtherPayload | Condition::GearGivesWay(_))
    }

    /// The share of its size by which it may be off its columns.
    pub(super) fn in_shape(&self) -> f64 {
        match self {
            _ if self.is_of_load() => LOAD_IN_SHAPE,
            // What one sample misses says nothing of the others.
            Condition::SingleSample(_) => 0.0,
            _ => IN_SHAPE,
        }
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
            Condition::GearGivesWay(_) => 10,
            Condition::LostMotion(_) => 11,
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

/// What a condition displaces: scalar differences of the samples, one after the other, x parameters of arbitrary scale, whitened.
pub(super) struct Columns {
    /// The condition.
    pub condition: Condition,
    /// The first scalar difference that it displaces.
    pub first: usize,
    /// From there on to the last that it displaces. Without columns for any change at all, which displaces whatever it will.
    pub block: DMatrix<f64>,
}

/// Every condition but "valid" with its columns.
pub(super) fn of_samples(seen: &[&Seen], whitening: &Whitening) -> Vec<Columns> {
    let mut all = of_several(seen, whitening);
    if seen.len() > 1 {
        let mut end = 0;
        for one in seen {
            end += one.rows.len();
            let (first, block) = whitening.unit_columns(end - one.rows.len()..end);
            all.push(Columns { condition: Condition::SingleSample(one.id.clone()), first, block });
        }
    }
    all.push(Columns { condition: Condition::Recalibrate, first: 0, block: DMatrix::zeros(0, 0) });
    all
}

/// The conditions that may displace several samples.
pub(super) fn of_several(seen: &[&Seen], whitening: &Whitening) -> Vec<Columns> {
    let rows: usize = seen.iter().map(|s| s.rows.len()).sum();
    let laid_out = |width: usize, of: &dyn Fn(&Seen, usize) -> Vector3<f64>| {
        let mut matrix = DMatrix::zeros(rows, width);
        let mut first = 0;
        for one in seen {
            for k in 0..width {
                let column = of(one, k);
                (0..one.rows.len()).for_each(|i| matrix[(first + i, k)] = column[i]);
            }
            first += one.rows.len();
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
    let is_loaded = |j: &usize| seen.iter().any(|s| s.torques[*j].abs() >= LEAST_TORQUE);
    let gear = |j: usize| (Condition::GearGivesWay(j + 1), laid_out(1, &|s, _| s.joints[j] * s.torques[j]));
    all.extend((0..joints).filter(is_loaded).map(gear));
    let lost =
        |j: usize| (Condition::LostMotion(j + 1), laid_out(1, &|s, _| s.joints[j] * s.sides.get(j).copied().unwrap_or(0.0)));
    all.extend((0..joints).map(lost));
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
    // What the poses do not show cannot be checked.
    all.retain(|(_, matrix)| matrix.amax() > 0.0);
    let whitened = |(condition, mut block): (Condition, DMatrix<f64>)| {
        whitening.apply(&mut block);
        Columns { condition, first: 0, block }
    };
    all.into_iter().map(whitened).collect()
}

/// Directions of a condition that displace the samples by less than this share of the largest are not seen.
const SEEN: f64 = 1e-6;

/// Orthonormal columns that span those of a matrix.
pub(super) fn orthonormal(matrix: &DMatrix<f64>) -> DMatrix<f64> {
    // Parameters of different units are made alike first.
    if matrix.is_empty() {
        return DMatrix::zeros(matrix.nrows(), 0);
    }
    let mut scaled = matrix.clone();
    for mut column in scaled.column_iter_mut() {
        let norm = column.norm();
        if norm > 0.0 {
            column /= norm;
        }
    }
    let svd = scaled.svd(true, false);
    let largest = svd.singular_values.max();
    let rank = svd.singular_values.iter().filter(|s| **s > SEEN * largest && **s > 0.0).count();
    svd.u.map_or_else(
        || DMatrix::zeros(matrix.nrows(), 0),
        |u| {
            // Singular values are in descending order.
            u.columns(0, rank).into_owned()
        },
    )
}
