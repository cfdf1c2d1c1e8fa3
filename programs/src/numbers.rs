//! The numbers of a position: what they mean, and how another target is written in their place.

use std::ops::Range;

use nalgebra::{Quaternion, Rotation3, Translation3, UnitQuaternion, UnitVector3, Vector3};

use super::scan::{Configuration, Layout, Number, Position};
use calibench::compensate::Fake;
use calibench::robot::{FramePose, Pose, rotation_vector};
use calibench::units::{DEG, MM, decimal};

/// Decimals of a length in mm: 0.1 nm.
const OF_MM: usize = 7;
/// Decimals of an angle in deg: 2e-11 rad.
const OF_DEG: usize = 9;
/// Decimals of a length in m: 0.1 nm.
const OF_M: usize = 10;
/// Decimals of an angle in rad: 1e-11 rad.
const OF_RAD: usize = 11;
/// Decimals of a quaternion: 1e-13, of a rotation of 2e-13 rad.
const OF_QUATERNION: usize = 13;

/// Largest deviation of a quaternion's length from one: programs have six decimals and more.
const NO_QUATERNION: f64 = 1e-2;

/// A replacement: the range of bytes, and the new text.
pub(super) type Edit = (Range<usize>, String);

/// Target given by the numbers of a position.
pub(super) enum Meaning {
    Pose(Pose),
    Joints(Vec<f64>),
}

impl Position {
    /// The target given by the numbers; an error if they give none.
    pub fn meaning(&self) -> Result<Meaning, &'static str> {
        let values: Vec<f64> = self.numbers.iter().map(|n| n.value).collect();
        meaning(self.layout, &values)
    }

    /// The numbers of the target to be commanded.
    pub fn texts(&self, fake: &Fake) -> Vec<String> {
        texts(self.layout, &self.numbers, fake)
    }

    /// Writes the target to be commanded in place of the numbers.
    pub fn edits(&self, fake: &Fake) -> Vec<Edit> {
        let texts = self.texts(fake).into_iter().enumerate().map(|(k, text)| match self.numbers.get(k) {
            // A number that is left out is written with its key.
            Some(number) if number.at.is_empty() => {
                let key = self.layout.keys().get(k).copied().unwrap_or_default();
                format!(" {key}=\"{text}\"")
            }
            _ => text,
        });
        let mut edits: Vec<Edit> = self.numbers.iter().map(|n| n.at.clone()).zip(texts).collect();
        let mut put = |number: &Number, value: i64| {
            if number.value != value as f64 {
                edits.push((number.at.clone(), value.to_string()));
            }
        };
        match &self.configuration {
            Configuration::Kuka { status, turn } => {
                let Some(own) = fake.status_turn else { return edits };
                // The bits above are the controller's own, and stay.
                for (number, mask, bits) in [(status, 7, own.status), (turn, 63, own.turn)] {
                    if let Some(number) = number {
                        put(number, (number.value as i64 & !mask) | i64::from(bits));
                    }
                }
            }
            Configuration::Abb(numbers) => {
                for (number, joint) in numbers.iter().zip([0, 3, 5]) {
                    put(number, quadrant(fake.q[joint]));
                }
            }
            // Positions whose turn numbers or flags would change are refused.
            Configuration::Fanuc { .. } | Configuration::Yaskawa { .. } => {}
            Configuration::Val3 { .. } | Configuration::Any | Configuration::Unreadable | Configuration::Near(_) => {}
        }
        edits
    }
}

/// ABB's quadrant of a joint (rad): 0 from 0 to 90 deg, -1 from -90 to 0.
pub(super) fn quadrant(q: f64) -> i64 {
    (q / (90.0 * DEG)).floor() as i64
}

/// FANUC's turn number of a joint (rad): 0 from -180 to 180 deg.
pub(super) fn whole_turn(q: f64) -> i64 {
    (0.5 + q / (360.0 * DEG)).floor() as i64
}

/// Joints that FANUC's three turn numbers are taken to count.
pub(super) const TURNING: [usize; 3] = [0, 3, 5];

/// True if the joints (rad) have other turn numbers than a configuration of FANUC's says, or other flags than one of Yaskawa's.
pub(super) fn turns_change(configuration: &Configuration, q: &[f64]) -> bool {
    match configuration {
        Configuration::Fanuc { turns, .. } => {
            turns.iter().zip(TURNING).any(|(number, joint)| q.get(joint).is_some_and(|q| whole_turn(*q) as f64 != number.value))
        }
        Configuration::Yaskawa { no_flip, beyond, .. } => {
            let is_beyond = |joint: usize| q.get(joint).is_some_and(|q| whole_turn(*q) != 0);
            let flips = q.get(3).is_some_and(|q| (beyond_flip(*q) > 0.0) != *no_flip);
            flips || beyond.iter().zip(YASKAWA_TURNING).any(|(beyond, joint)| is_beyond(joint) != *beyond)
        }
        _ => false,
    }
}

/// Joints R, T and S of Yaskawa's flags.
pub(super) const YASKAWA_TURNING: [usize; 3] = [3, 5, 0];

/// Distance (rad) of joint R (rad) beyond the half circle about its zero that Yaskawa calls flip.
pub(super) fn beyond_flip(r: f64) -> f64 {
    let half = 180.0 * DEG;
    let wrapped = r - 2.0 * half * whole_turn(r) as f64;
    wrapped.abs() - 0.5 * half
}

/// The pose or the joints that numbers mean.
pub(super) fn meaning(layout: Layout, values: &[f64]) -> Result<Meaning, &'static str> {
    let pose = |xyz: [f64; 3], rotation: Rotation3<f64>| {
        Meaning::Pose(Pose::from_parts(Translation3::from(Vector3::from(xyz)), rotation))
    };
    Ok(match (layout, values) {
        (Layout::Degrees | Layout::ValJoints, _) => Meaning::Joints(values.iter().map(|v| v * DEG).collect()),
        (Layout::Radians, _) => Meaning::Joints(values.to_vec()),
        (Layout::KukaFrame, &[x, y, z, a, b, c]) | (Layout::FanucPose, &[x, y, z, c, b, a]) => {
            let frame = FramePose { xyz: [x, y, z].map(|v| v * MM), rz_ry_rx: [a, b, c].map(|v| v * DEG) };
            Meaning::Pose(frame.pose())
        }
        (Layout::ValPose, &[x, y, z, rx, ry, rz]) => {
            let about = |axis: UnitVector3<f64>, angle: f64| Rotation3::from_axis_angle(&axis, angle * DEG);
            let rotation = about(Vector3::x_axis(), rx) * about(Vector3::y_axis(), ry) * about(Vector3::z_axis(), rz);
            pose([x, y, z].map(|v| v * MM), rotation)
        }
        (Layout::UrPose, &[x, y, z, rx, ry, rz]) => pose([x, y, z], Rotation3::new(Vector3::new(rx, ry, rz))),
        (Layout::AbbTarget, &[x, y, z, w, i, j, k]) => {
            let quaternion = Quaternion::new(w, i, j, k);
            if (quaternion.norm() - 1.0).abs() > NO_QUATERNION {
                return Err("its quaternion is not of length one");
            }
            let rotation = UnitQuaternion::from_quaternion(quaternion).to_rotation_matrix();
            pose([x, y, z].map(|v| v * MM), rotation)
        }
        _ => return Err("it has another number of values than its kind"),
    })
}

/// The numbers of the target to be commanded; of several that mean the same, those nearest to the original ones.
fn texts(layout: Layout, old: &[Number], fake: &Fake) -> Vec<String> {
    let xyz: [f64; 3] = fake.pose.translation.vector.into();
    let FramePose { rz_ry_rx: [a, b, c], .. } = FramePose::from_pose(&fake.pose);
    let all = |values: &[f64], unit: f64, decimals: usize| -> Vec<String> {
        values.iter().map(|v| decimal(v / unit, decimals)).collect()
    };
    match layout {
        Layout::KukaFrame => [all(&xyz, MM, OF_MM), all(&[a, b, c], DEG, OF_DEG)].concat(),
        Layout::FanucPose => [all(&xyz, MM, OF_MM), all(&[c, b, a], DEG, OF_DEG)].concat(),
        Layout::UrPose => {
            let before = Vector3::from_iterator(old.iter().skip(3).map(|n| n.value).chain([0.0; 3]).take(3));
            let vector = vector_near(&fake.pose, &before);
            [all(&xyz, 1.0, OF_M), all(vector.as_slice(), 1.0, OF_RAD)].concat()
        }
        Layout::AbbTarget => {
            let q = UnitQuaternion::from_rotation_matrix(&fake.pose.rotation);
            let q = [q.w, q.i, q.j, q.k];
            let along: f64 = q.iter().zip(&old[old.len().min(3)..]).map(|(q, old)| q * old.value).sum();
            let q = q.map(|v| if along < 0.0 { -v } else { v });
            [all(&xyz, MM, OF_MM), all(&q, 1.0, OF_QUATERNION)].concat()
        }
        Layout::ValPose => [all(&xyz, MM, OF_MM), all(&x_y_z(&fake.pose), DEG, OF_DEG)].concat(),
        Layout::Degrees | Layout::ValJoints => all(&fake.q, DEG, OF_DEG),
        Layout::Radians => all(&fake.q, 1.0, OF_RAD),
    }
}

/// Angles about x, the new y and the new z, rad. Where the second is a quarter turn the third is zero.
fn x_y_z(pose: &Pose) -> [f64; 3] {
    let r = pose.rotation.matrix();
    let cosine = r[(0, 0)].hypot(r[(0, 1)]);
    let y = r[(0, 2)].atan2(cosine);
    if cosine < 1e-9 {
        return [r[(2, 1)].atan2(r[(1, 1)]), y, 0.0];
    }
    [(-r[(1, 2)]).atan2(r[(2, 2)]), y, (-r[(0, 1)]).atan2(r[(0, 0)])]
}

/// The rotation vector of a pose nearest to the one before: near half a turn its sign is arbitrary, and programs hold longer
/// ones.
fn vector_near(pose: &Pose, before: &Vector3<f64>) -> Vector3<f64> {
    let vector = rotation_vector(&pose.rotation);
    let Some(axis) = vector.try_normalize(1e-12) else { return vector };
    let turns = ((before - vector).dot(&axis) / std::f64::consts::TAU).round();
    vector + axis * (turns.clamp(-9.0, 9.0) * std::f64::consts::TAU)
}
