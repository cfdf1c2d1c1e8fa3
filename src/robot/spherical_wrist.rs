//! Closed-form inverse kinematics for arms with a spherical wrist (Pieper's case).
//!
//! Accepted: six joints, no skew (beta = 0), axis 2 at right angles to axis 1 (`alpha_1` = +-90 deg), axis 3 parallel to
//! axis 2 (`alpha_2` = 0 or 180 deg), axes 4, 5, 6 through one point (`a_4 = a_5 = d_5 = 0`) and each at right angles to
//! the next (`alpha_4`, `alpha_5` = +-90 deg). Free: how the base carries axis 1 (`alpha_0`, `a_0`), all of `d_1, a_1, d_2,
//! a_2, d_3, a_3, alpha_3, d_4, d_6`, and the joint offsets. The wrist's centre fixes joints 1 to 3 as two circles and a
//! triangle; the hand's orientation fixes joints 4 to 6.

use std::f64::consts::{PI, TAU};

use nalgebra::{Matrix3, Vector3};
use thiserror::Error;

use super::{Pose, Robot};

/// Angles and lengths closer to their special value than this (rad, m) count as special.
const EXACT: f64 = 1e-9;
/// Below this sine of joint 5, axes 4 and 6 are collinear and joint 4 is set to its nominal zero (its offset undone).
const WRIST_LINED_UP: f64 = 1e-13;

/// The reason why an arm does not have the accepted geometry.
#[derive(Debug, Error, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum NotSphericalWrist {
    /// Another number of joints.
    #[error("the arm has {0} joints, not six")]
    Joints(usize),
    /// A joint that slides, counted from 0.
    #[error("joint {} is prismatic", .0 + 1)]
    Prismatic(usize),
    /// A Hayati skew.
    #[error("beta_{0} is not zero")]
    Skew(usize),
    /// Axis 2 is not at right angles to axis 1.
    #[error("alpha_1 is not +-90 deg")]
    Shoulder,
    /// Axes 2 and 3 are not parallel, or the upper arm or the forearm has no length.
    #[error("axes 2 and 3 are not parallel and apart")]
    UpperArm,
    /// Axes 4, 5, 6 do not meet in one point.
    #[error("axes 4, 5 and 6 do not meet: a_4, a_5 and d_5 must be zero")]
    WristCentre,
    /// Axes 4, 5, 6 are not at right angles.
    #[error("axes 4, 5 and 6 are not at right angles: alpha_4 and alpha_5 must be +-90 deg")]
    WristAngles,
}

/// The closed form for one arm.
///
/// ```
/// use calibench::robot::inverse::{SphericalWrist, StatusTurn};
/// use calibench::robot::kinematics::world_from_tool;
/// use calibench::robot::{FramePose, built_in};
///
/// let robot = built_in("kr6_r700").ok_or("built in")?;
/// let wrist = SphericalWrist::new(&robot)?;
/// let q = [0.3, -1.2, 1.4, 0.4, 0.9, 0.1];
/// let pose = world_from_tool(&robot, &FramePose::default(), &FramePose::default(), &q);
/// let StatusTurn { status, turn } = StatusTurn::of(&wrist, &q);
/// let found = wrist.joints_of(&pose, Some(status), Some(turn), &[0.0; 6]).ok_or("a posture")?;
/// assert!(q.iter().zip(found).all(|(q, found)| (q - found).abs() < 1e-9));
///
/// // The last three axes of a UR10 do not meet.
/// let ur10 = built_in("ur10").ok_or("built in")?;
/// assert!(SphericalWrist::new(&ur10).is_err());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
pub struct SphericalWrist {
    /// From the base to the line of joint 1.
    base_from_first: Pose,
    d1: f64,
    a1: f64,
    /// sin(alpha_1), +-1.
    s1: f64,
    a2: f64,
    /// cos(alpha_2), +-1.
    c2: f64,
    /// Position along axis 2 of the plane in which the wrist's centre moves, m.
    plane: f64,
    /// Elbow to wrist centre in that plane: length (m) and direction (rad) in frame 3.
    forearm: f64,
    forearm_angle: f64,
    alpha3: Matrix3<f64>,
    s4: f64,
    s5: f64,
    d6: f64,
    offsets: [f64; 6],
    limits: [[f64; 2]; 6],
}

/// Joint angles that put the flange at the requested pose, with the configuration of the arm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Branch {
    /// Joint angles in (-pi, pi], rad.
    pub q: [f64; 6],
    /// Reaching backwards, over the shoulder.
    pub backward: bool,
    /// Elbow on the other side.
    pub elbow: bool,
    /// Wrist flipped: joint 5 of the other sign.
    pub flip: bool,
}

impl SphericalWrist {
    /// Checks and stores the geometry of `robot`.
    ///
    /// # Errors
    /// The condition that fails, when the geometry is not accepted.
    pub fn new(robot: &Robot) -> Result<Self, NotSphericalWrist> {
        let n = robot.joints();
        if n != 6 {
            return Err(NotSphericalWrist::Joints(n));
        }
        let m: [_; 6] = std::array::from_fn(|i| robot.links[i].mdh);
        if let Some(i) = robot.first_prismatic() {
            return Err(NotSphericalWrist::Prismatic(i));
        }
        if let Some(i) = m.iter().position(|l| l.beta.abs() > EXACT) {
            return Err(NotSphericalWrist::Skew(i));
        }
        if m[1].alpha.cos().abs() > EXACT {
            return Err(NotSphericalWrist::Shoulder);
        }
        // Position of the wrist's centre in frame 3, before joint 4.
        let (sin3, cos3) = m[3].alpha.sin_cos();
        let wrist = Vector3::new(m[3].a, -m[3].d * sin3, m[3].d * cos3);
        let forearm = wrist.xy().norm();
        if m[2].alpha.sin().abs() > EXACT || m[2].a.abs() < EXACT || forearm < EXACT {
            return Err(NotSphericalWrist::UpperArm);
        }
        if [m[4].a, m[5].a, m[4].d].iter().any(|v| v.abs() > EXACT) {
            return Err(NotSphericalWrist::WristCentre);
        }
        if m[4].alpha.cos().abs() > EXACT || m[5].alpha.cos().abs() > EXACT {
            return Err(NotSphericalWrist::WristAngles);
        }
        let c2 = m[2].alpha.cos().signum();
        let first = super::MdhLink { theta: 0.0, d: 0.0, ..m[0] };
        Ok(SphericalWrist {
            base_from_first: first.transform(0.0),
            d1: m[0].d,
            a1: m[1].a,
            s1: m[1].alpha.sin().signum(),
            a2: m[2].a,
            c2,
            plane: m[1].d + c2 * (m[2].d + wrist.z),
            forearm,
            forearm_angle: wrist.y.atan2(wrist.x),
            alpha3: Matrix3::new(1.0, 0.0, 0.0, 0.0, cos3, -sin3, 0.0, sin3, cos3),
            s4: m[4].alpha.sin().signum(),
            s5: m[5].alpha.sin().signum(),
            d6: m[5].d,
            offsets: m.map(|l| l.theta),
            limits: std::array::from_fn(|i| robot.links[i].limits),
        })
    }

    /// Calls `found` with each of the up to eight postures that put frame 6 at `base_from_flange`, regardless of limits.
    pub fn branches(&self, base_from_flange: &Pose, mut found: impl FnMut(Branch)) {
        let first_from_flange = self.base_from_first.inv_mul(base_from_flange);
        let rotation = first_from_flange.rotation.matrix();
        let centre = first_from_flange.translation.vector - rotation.column(2) * self.d6;
        let side = -self.s1 * self.plane;
        let radius = centre.xy().norm();
        let Some(reach) = root(radius * radius - side * side, radius) else { return };
        let azimuth = centre.y.atan2(centre.x);
        let rise = self.s1 * (centre.z - self.d1);
        for backward in [false, true] {
            let reach = if backward { -reach } else { reach };
            let theta1 = azimuth - side.atan2(reach);
            let ahead = reach - self.a1;
            let (upper, lower) = (self.a2, self.forearm);
            let cosine = (ahead * ahead + rise * rise - upper * upper - lower * lower) / (2.0 * upper * lower);
            let Some(sine) = root(1.0 - cosine * cosine, 1.0) else { continue };
            for elbow in [false, true] {
                let sine = if elbow { -sine } else { sine };
                let bend = sine.atan2(cosine);
                let theta2 = rise.atan2(ahead) - (lower * sine).atan2(upper + lower * cosine);
                let theta3 = self.c2 * bend - self.forearm_angle;
                let hand = self.hand(rotation, theta1, theta2, theta3);
                for flip in [false, true] {
                    let [theta4, theta5, theta6] = self.wrist(&hand, flip);
                    let theta = [theta1, theta2, theta3, theta4, theta5, theta6];
                    let q = std::array::from_fn(|i| wrapped(theta[i] - self.offsets[i]));
                    found(Branch { q, backward, elbow, flip });
                }
            }
        }
    }

    /// Configuration of the arm at joints `q` (rad): distance of the wrist's centre in front of axis 1 (m; negative behind
    /// it, or overhead), bend of the elbow (rad; zero if upper arm and forearm are in line), and joint 5 (rad), each of
    /// which is zero at a singularity.
    pub fn bends(&self, q: &[f64; 6]) -> [f64; 3] {
        let theta2 = q[1] + self.offsets[1];
        let bend = self.c2 * (q[2] + self.offsets[2] + self.forearm_angle);
        let reach = self.a1 + self.a2 * theta2.cos() + self.forearm * (theta2 + bend).cos();
        [reach, wrapped(bend), wrapped(q[4] + self.offsets[4])]
    }

    /// Rotation that joints 4 to 6 must make.
    fn hand(&self, rotation: &Matrix3<f64>, theta1: f64, theta2: f64, theta3: f64) -> Matrix3<f64> {
        let about_z = |angle: f64| {
            let (s, c) = angle.sin_cos();
            Matrix3::new(c, -s, 0.0, s, c, 0.0, 0.0, 0.0, 1.0)
        };
        let about_x = |s: f64, c: f64| Matrix3::new(1.0, 0.0, 0.0, 0.0, c, -s, 0.0, s, c);
        let arm =
            about_z(theta1) * about_x(self.s1, 0.0) * about_z(theta2) * about_x(0.0, self.c2) * about_z(theta3) * self.alpha3;
        arm.tr_mul(rotation)
    }

    /// Joints 4 to 6 of `hand = Rz(4) Rx(alpha4) Rz(5) Rx(alpha5) Rz(6)`.
    fn wrist(&self, hand: &Matrix3<f64>, flip: bool) -> [f64; 3] {
        let (s4, s5) = (self.s4, self.s5);
        let across = hand[(0, 2)].hypot(hand[(1, 2)]);
        let sin5 = if flip { -across } else { across };
        let cos5 = -s4 * s5 * hand[(2, 2)];
        let theta4 = if across < WRIST_LINED_UP {
            self.offsets[3]
        } else {
            let sign = s5 * sin5.signum();
            (sign * hand[(1, 2)]).atan2(sign * hand[(0, 2)])
        };
        // Joint 6 compensates joints 4 and 5, so that an ill-defined joint 4 does no harm: Rz(6) is the remaining factor of
        // the product, of which the first column is sufficient.
        let (sin4, cos4) = theta4.sin_cos();
        let x = cos4 * hand[(0, 0)] + sin4 * hand[(1, 0)];
        let y = cos4 * hand[(1, 0)] - sin4 * hand[(0, 0)];
        let cos6 = cos5 * x + sin5 * s4 * hand[(2, 0)];
        let sin6 = -s4 * s5 * y;
        [theta4, sin5.atan2(cos5), sin6.atan2(cos6)]
    }

    /// Calls `found` with every set of joint angles inside the limits less `margin` (rad) that differs from `q` by full
    /// revolutions.
    pub fn whole_turns(&self, q: &[f64; 6], margin: f64, mut found: impl FnMut(&[f64; 6])) {
        let mut lowest = *q;
        let mut most = [0u32; 6];
        for i in 0..6 {
            let [low, high] = [self.limits[i][0] + margin, self.limits[i][1] - margin];
            lowest[i] += TAU * ((low - q[i]) / TAU).ceil();
            if lowest[i] > high {
                return;
            }
            most[i] = ((high - lowest[i]) / TAU) as u32;
        }
        // Counts through all combinations like an odometer.
        let mut turns = [0u32; 6];
        loop {
            found(&std::array::from_fn(|i| lowest[i] + TAU * f64::from(turns[i])));
            let Some(i) = (0..6).find(|&i| turns[i] < most[i]) else { break };
            turns[..i].fill(0);
            turns[i] += 1;
        }
    }

    /// All joint angles inside the limits less `margin` (rad) that put frame 6 at `base_from_flange`: every branch, every
    /// full revolution.
    pub fn solutions(&self, base_from_flange: &Pose, margin: f64, mut found: impl FnMut(&[f64; 6])) {
        self.branches(base_from_flange, |branch| self.whole_turns(&branch.q, margin, &mut found));
    }
}

/// Square root that treats values negative by rounding (relative to `scale` squared) as zero.
fn root(square: f64, scale: f64) -> Option<f64> {
    if square < -1e-12 * scale * scale { None } else { Some(square.max(0.0).sqrt()) }
}

/// Wraps the angle to (-pi, pi].
fn wrapped(angle: f64) -> f64 {
    let turned = angle - TAU * ((angle + PI) / TAU).floor();
    if turned <= -PI { turned + TAU } else { turned }
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;
    use crate::robot::kinematics::world_from_tool;
    use crate::robot::{FramePose, Link, built_in};

    /// Six sines of metre-sized chains round to a few 1e-16.
    const EXACT_POSE: f64 = 1e-12;

    fn flange(robot: &Robot, q: &[f64]) -> Pose {
        world_from_tool(robot, &FramePose::default(), &FramePose::default(), q)
    }

    fn apart(a: &Pose, b: &Pose) -> f64 {
        (a.to_homogeneous() - b.to_homogeneous()).amax()
    }

    /// An arm that uses every accepted freedom: offsets everywhere, twists of either sign.
    fn odd_arm(random: &mut ChaCha8Rng) -> Robot {
        let mut robot = built_in("kr6_r700").unwrap();
        let mut number = |scale: f64| random.random_range(-scale..scale);
        for (i, Link { mdh, .. }) in robot.links.iter_mut().enumerate() {
            mdh.theta = number(3.0);
            let sign = number(1.0).signum();
            mdh.alpha = match i {
                0 | 3 => number(3.0),
                2 => {
                    if sign > 0.0 {
                        0.0
                    } else {
                        PI
                    }
                }
                _ => sign * PI / 2.0,
            };
            if i < 4 {
                (mdh.a, mdh.d) = (number(0.5), number(0.5));
            }
        }
        robot
    }

    #[test]
    fn every_branch_reaches_and_one_of_them_is_where_we_came_from() {
        let mut random = ChaCha8Rng::seed_from_u64(2);
        for trial in 0..300 {
            let robot = if trial < 200 { built_in("kr6_r700").unwrap() } else { odd_arm(&mut random) };
            let wrist = SphericalWrist::new(&robot).unwrap();
            let q: Vec<f64> = robot.links.iter().map(|l| random.random_range(l.limits[0]..l.limits[1])).collect();
            let target = flange(&robot, &q);
            let (mut branches, mut nearest) = (0, f64::INFINITY);
            wrist.branches(&target, |branch| {
                branches += 1;
                let error = apart(&flange(&robot, &branch.q), &target);
                assert!(error < EXACT_POSE, "trial {trial}: {branch:?} misses by {error:e}");
                let off = branch.q.iter().zip(&q).map(|(a, b)| wrapped(a - b).abs()).fold(0.0, f64::max);
                nearest = f64::min(nearest, off);
            });
            assert!([4, 8].contains(&branches), "{branches} branches");
            // Near a singularity the joints are determined less well than the pose.
            assert!(nearest < 1e-6, "trial {trial}: nearest branch {nearest:e} away");
        }
    }

    #[test]
    fn solutions_are_inside_the_limits_and_count_whole_turns() {
        let robot = built_in("kr6_r700").unwrap();
        let wrist = SphericalWrist::new(&robot).unwrap();
        // Joint 4 at 176 deg can also be -184; joint 6 at 100 can also be -260: four of one branch.
        let q = [10.0, -60.0, 70.0, 176.0, 50.0, 100.0].map(|v: f64| v.to_radians());
        let target = flange(&robot, &q);
        let mut same_branch = 0;
        wrist.solutions(&target, 0.0, |found| {
            assert_eq!(robot.outside_limits(found, 0.0), None);
            assert!(apart(&flange(&robot, found), &target) < EXACT_POSE);
            same_branch += usize::from((found[4] - q[4]).abs() < 1e-9 && (found[1] - q[1]).abs() < 1e-9);
        });
        assert_eq!(same_branch, 4);
        let mut with_margin = 0;
        wrist.solutions(&target, 2f64.to_radians(), |found| {
            with_margin += usize::from((found[4] - q[4]).abs() < 1e-9 && (found[1] - q[1]).abs() < 1e-9);
        });
        assert_eq!(with_margin, 2, "-184 deg is within 2 deg of the limit");
    }

    #[test]
    fn lined_up_wrist_and_stretched_elbow_still_reach() {
        let robot = built_in("kr6_r700").unwrap();
        let wrist = SphericalWrist::new(&robot).unwrap();
        for q5 in [0.0, 1e-14, 1e-10, 1e-7, -1e-4] {
            let target = flange(&robot, &[0.3, -0.9, 1.2, 0.7, q5, -0.4]);
            let mut branches = 0;
            wrist.branches(&target, |branch| {
                branches += 1;
                assert!(apart(&flange(&robot, &branch.q), &target) < EXACT_POSE, "q5 = {q5:e}: {branch:?}");
            });
            assert!(branches >= 4);
        }
        // atan2(35, 365) is the bend that stretches elbow and forearm into one line; there the branches merge.
        let target = flange(&robot, &[0.3, -0.9, (35f64).atan2(365.0), 0.7, 0.5, -0.4]);
        let mut branches = 0;
        wrist.branches(&target, |branch| {
            branches += 1;
            // The square root of a rounding error of 1e-16 enters the joints, but the pose only squared.
            assert!(apart(&flange(&robot, &branch.q), &target) < 1e-9);
        });
        assert!(branches >= 4);
        let far = Pose::translation(2.0, 0.0, 0.5);
        wrist.branches(&far, |branch| panic!("out of reach, yet {branch:?}"));
    }

    #[test]
    fn other_geometries_are_refused_for_their_reason() {
        assert_eq!(SphericalWrist::new(&built_in("panda").unwrap()).unwrap_err(), NotSphericalWrist::Joints(7));
        assert_eq!(SphericalWrist::new(&built_in("ur10").unwrap()).unwrap_err(), NotSphericalWrist::WristCentre);
        let changed = |change: fn(&mut Robot)| {
            let mut robot = built_in("kr6_r700").unwrap();
            change(&mut robot);
            SphericalWrist::new(&robot).unwrap_err()
        };
        assert_eq!(changed(|r| r.links[2].mdh.beta = 1e-4), NotSphericalWrist::Skew(2));
        assert_eq!(changed(|r| r.links[1].mdh.alpha = 1.5), NotSphericalWrist::Shoulder);
        assert_eq!(changed(|r| r.links[2].mdh.alpha = 0.1), NotSphericalWrist::UpperArm);
        assert_eq!(changed(|r| r.links[5].mdh.a = 1e-4), NotSphericalWrist::WristCentre);
        assert_eq!(changed(|r| r.links[4].mdh.alpha = -1.5), NotSphericalWrist::WristAngles);
    }
}
