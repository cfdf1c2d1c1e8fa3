//! The posture that a program means by status and turn, by confdata or by CONFIG.

use super::numbers::{TURNING, YASKAWA_TURNING, beyond_flip, quadrant, whole_turn};
use super::scan::{Configuration, Number};
use calibench::compensate::{Compensator, Refusal};
use calibench::robot::kinematics::Posture;
use calibench::robot::sites::SiteIndex;
use calibench::robot::{FramePose, Pose};
use calibench::units::DEG;

/// A posture may be this far (rad, m) on the other side of the border between two configurations: programs hold positions
/// rounded to 0.01 mm and 0.01 deg, and joints are at zero.
const ROUNDED: f64 = 0.1 * DEG;

/// A flange nearer to the wrist's centre than this, m, is at it.
const SAME_PLACE: f64 = 1e-6;

/// The sides of a posture that a configuration distinguishes; each is zero at a singularity.
struct Sides {
    /// The wrist's centre in front of axis 1, m.
    front: f64,
    /// The elbow above the line from shoulder to wrist, rad, for an arm that reaches forward.
    up: f64,
    /// The hand bent down where joint 4 is at zero and the arm reaches forward, rad; FANUC's joint 5 is negative there.
    bowed: f64,
}

/// Interpretation of a configuration.
pub(super) enum Meant {
    /// These joints (rad).
    Joints(Vec<f64>),
    /// The program says nothing: the posture nearest to the previous position.
    Default,
    /// The configuration does not exist for this arm: as above, with a remark.
    Unmapped,
}

/// The nominal joints (rad) that reach a pose (in the frame of the targets) in this configuration.
///
/// # Errors
/// When postures reach the pose and none is so configured.
pub(super) fn posture_of(
    compensator: &mut Compensator<'_>,
    pose: &Pose,
    configuration: &Configuration,
) -> Result<Meant, Refusal> {
    match configuration {
        Configuration::Any => return Ok(Meant::Default),
        Configuration::Unreadable => return Ok(Meant::Unmapped),
        Configuration::Near(q) => return Ok(Meant::Joints(q.clone())),
        Configuration::Kuka { status: None, turn: None } => return Ok(Meant::Default),
        Configuration::Val3 { righty: None, elbow: None, wrist: None } => return Ok(Meant::Default),
        Configuration::Kuka { .. } | Configuration::Abb(_) | Configuration::Fanuc { .. } => {}
        Configuration::Yaskawa { .. } | Configuration::Val3 { .. } => {}
    }
    let Some(postures) = compensator.nominal_postures(pose) else { return Ok(Meant::Unmapped) };
    if postures.is_empty() {
        // Out of reach, or beyond a limit: the search says which.
        return Ok(Meant::Default);
    }
    let wrong: Vec<f64> = postures.iter().map(|q| wrong_side(compensator, configuration, q)).collect();
    let near = compensator.near().to_vec();
    let away = |q: &[f64; 6]| -> f64 { q.iter().zip(&near).map(|(q, near)| (q - near).powi(2)).sum() };
    // What is exactly right comes before what is right but for rounding.
    let best = [1e-6, ROUNDED].into_iter().find_map(|most| {
        let right = postures.iter().zip(&wrong).filter(|(_, wrong)| **wrong <= most).map(|(q, _)| q);
        right.min_by(|a, b| away(a).total_cmp(&away(b)))
    });
    best.map(|q| Meant::Joints(q.to_vec())).ok_or(Refusal::NoSuchConfiguration)
}

/// Distance (rad, m) of the joints `q` beyond any border of the configuration.
fn wrong_side(compensator: &Compensator<'_>, configuration: &Configuration, q: &[f64; 6]) -> f64 {
    let below = |side: f64, is_negative: bool| if is_negative { side } else { -side };
    let outside = |q: f64, from: f64, to: f64| (from - q).max(q - to);
    let wrong = match configuration {
        Configuration::Kuka { status, turn } => {
            let Some(sides) = compensator.status_sides(q) else { return 0.0 };
            let of = |number: &Option<Number>, sides: &[f64]| match number {
                Some(number) => {
                    let bits = number.value as i64;
                    let over = |(k, side): (usize, &f64)| below(*side, bits >> k & 1 == 1);
                    sides.iter().enumerate().map(over).fold(0.0, f64::max)
                }
                None => 0.0,
            };
            of(status, &sides).max(of(turn, q))
        }
        Configuration::Abb([cf1, cf4, cf6, cfx]) => {
            let quarter = 90.0 * DEG;
            let of = |number: &Number, q: f64| {
                if quadrant(q) as f64 == number.value {
                    0.0
                } else {
                    outside(q, number.value * quarter, (number.value + 1.0) * quarter)
                }
            };
            let bits = cfx.value as i64;
            let Sides { front, up, .. } = sides(compensator, q);
            let arm = below(front, bits & 4 != 0).max(below(up, bits & 2 != 0)).max(below(q[4], bits & 1 != 0));
            of(cf1, q[0]).max(of(cf4, q[3])).max(of(cf6, q[5])).max(arm)
        }
        Configuration::Fanuc { flip, down, back, turns } => {
            let half = 180.0 * DEG;
            let of = |(number, joint): (&Number, usize)| {
                let middle = number.value * 2.0 * half;
                if whole_turn(q[joint]) as f64 == number.value { 0.0 } else { outside(q[joint], middle - half, middle + half) }
            };
            let Sides { front, up, bowed } = sides(compensator, q);
            // Above and below are of an arm that reaches forward; backward, the nearest is taken.
            let elbow = if *back { 0.0 } else { below(up, *down) };
            let turned = turns.iter().zip(TURNING).map(of).fold(0.0, f64::max);
            turned.max(below(front, *back)).max(elbow).max(below(bowed, *flip))
        }
        Configuration::Yaskawa { no_flip, lower, back, beyond } => {
            let half = 180.0 * DEG;
            let of = |(beyond, joint): (&bool, usize)| if *beyond { half - q[joint].abs() } else { q[joint].abs() - half };
            let turned = beyond.iter().zip(YASKAWA_TURNING).map(of).fold(0.0, f64::max);
            let Sides { front, up, .. } = sides(compensator, q);
            let elbow = if *back { 0.0 } else { below(up, *lower) };
            turned.max(below(-beyond_flip(q[3]), *no_flip)).max(below(front, *back)).max(elbow)
        }
        Configuration::Val3 { righty, elbow, wrist } => {
            let of = |positive: &Option<bool>, joint: usize| positive.map_or(0.0, |positive| below(q[joint], !positive));
            let shoulder = righty.map_or(0.0, |righty| below(sides(compensator, q).front, !righty));
            of(elbow, 2).max(of(wrist, 4)).max(shoulder)
        }
        Configuration::Any | Configuration::Unreadable | Configuration::Near(_) => 0.0,
    };
    wrong.max(0.0)
}

/// The sides by geometry, so that they do not depend on the directions in which a robot file counts its joints.
fn sides(compensator: &Compensator<'_>, q: &[f64; 6]) -> Sides {
    let robot = &compensator.calibration().robot;
    let none = vec![0.0; SiteIndex::new(6).len()];
    let mut posture = Posture::new(robot);
    let mut straight = *q;
    straight[3] = 0.0;
    posture.set(robot, &FramePose::default(), &FramePose::default(), &straight, &none);
    let [shoulder, elbow, wrist] = [2, 3, 5].map(|k| posture.frame(k).o);
    let front = compensator.status_sides(q).map_or(0.0, |[front, ..]| front);
    // Joint 1 turns about the vertical of the arm; the arm's own forward is where its wrist is, or opposite to it.
    let vertical = posture.frame(0).z;
    let out = wrist - posture.frame(1).o;
    let out = (out - vertical * out.dot(&vertical)) * if front < 0.0 { -1.0 } else { 1.0 };
    let forward = vertical.cross(&out).try_normalize(1e-12).unwrap_or_else(|| posture.joint_axis(1).0);
    let forearm = wrist - elbow;
    let axis = posture.joint_axis(3).0;
    let axis = if axis.dot(&forearm) < 0.0 { -axis } else { axis };
    // A file may count joint 6 about an axis that points back into the arm: the hand is where the flange is.
    let last = posture.frame(6);
    let flange = robot.flange.pose();
    let out_of_wrist = last.o + last.direction(&flange.translation.vector) - wrist;
    let faces = last.direction(&(flange.rotation * nalgebra::Vector3::z()));
    let side = last.z.dot(if out_of_wrist.norm() > SAME_PLACE { &out_of_wrist } else { &faces });
    let hand = if side < 0.0 { -last.z } else { last.z };
    let turn = |from: &nalgebra::Vector3<f64>, to: &nalgebra::Vector3<f64>| forward.dot(&from.cross(to)).atan2(from.dot(to));
    Sides { front, up: turn(&(elbow - shoulder), &forearm), bowed: turn(&axis, &hand) }
}
