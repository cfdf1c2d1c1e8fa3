//! Iterative inverse kinematics for any chain and model: redundant arms, and arms with identified deviations.
//!
//! Levenberg-Marquardt on the six components of the pose error, `dq = J^T (J J^T + lambda I)^-1 e`, which is also the
//! shortest step of a redundant arm (Nakamura and Hanafusa 1986); joints pressed against a limit are held there.

pub use super::dexterity::dexterity;
pub(crate) use super::spherical_wrist::Branch;
pub use super::spherical_wrist::SphericalWrist;
pub use super::status_turn::StatusTurn;

use nalgebra::{Matrix6, Matrix6xX, Vector6};

use super::kinematics::Posture;
use super::rel_tool::screw;
use super::sites::SiteIndex;
use super::{FramePose, Pose, Robot, rotation_vector};
use crate::math::positive_definite::cholesky;

/// A kinematic model that gives the pose of the tool and its motion with each joint: the nominal arm, or a calibrated one.
pub trait Kinematics {
    /// Number of joints.
    fn joints(&self) -> usize;

    /// `world_from_tool` at joints `q` (rad, N). Fills column i of `jacobian` (6 x N) with the TCP's velocity (m/rad) over
    /// the tool's angular velocity (rad/rad), world axes, for a motion of joint i. Small terms may be omitted: the solution
    /// remains exact, only convergence slows.
    fn evaluate(&mut self, q: &[f64], jacobian: &mut Matrix6xX<f64>) -> Pose;
}

/// An arm with deviations independent of its posture; none for the nominal arm.
#[derive(Debug, Clone)]
pub struct Chain<'a> {
    robot: &'a Robot,
    base: FramePose,
    tool: FramePose,
    deviations: Vec<f64>,
    posture: Posture,
}

impl<'a> Chain<'a> {
    /// The nominal arm.
    pub fn nominal(robot: &'a Robot, base: &FramePose, tool: &FramePose) -> Self {
        Chain::deviating(robot, base, tool, vec![0.0; SiteIndex::new(robot.joints()).len()])
    }

    /// The arm with these deviations (one SI value per site, see [`SiteIndex`]).
    pub fn deviating(robot: &'a Robot, base: &FramePose, tool: &FramePose, deviations: Vec<f64>) -> Self {
        Chain { robot, base: *base, tool: *tool, deviations, posture: Posture::new(robot) }
    }
}

impl Kinematics for Chain<'_> {
    fn joints(&self) -> usize {
        self.robot.joints()
    }

    fn evaluate(&mut self, q: &[f64], jacobian: &mut Matrix6xX<f64>) -> Pose {
        self.posture.set(self.robot, &self.base, &self.tool, q, &self.deviations);
        for i in 0..q.len() {
            jacobian.set_column(i, &screw(&self.posture, i));
        }
        self.posture.world_from_tool(&self.tool)
    }
}

/// Outcome of the search.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Outcome {
    /// The pose is met.
    Converged,
    /// It would be met, or approached, if this joint (counted from 0) could go beyond its limit.
    JointLimit(usize),
    /// No small motion of any joint comes nearer; from another start one may.
    Unreachable,
    /// Still coming nearer when the step limit was reached.
    NotConverged,
}

/// The end point of the search.
#[derive(Debug, Clone, PartialEq)]
pub struct Solution {
    /// Joint angles, inside the limits, rad (N).
    pub q: Vec<f64>,
    /// Outcome of the search.
    pub outcome: Outcome,
    /// Number of steps.
    pub steps: usize,
    /// Remaining distance of the TCP, m.
    pub position_error: f64,
    /// Remaining angle of the tool, rad.
    pub rotation_error: f64,
}

/// The solver, reused between targets so that only solutions are allocated.
///
/// ```
/// use calibench::robot::inverse::{Chain, InverseKinematics, Outcome};
/// use calibench::robot::kinematics::world_from_tool;
/// use calibench::robot::{FramePose, built_in};
///
/// let robot = built_in("ur5").ok_or("built in")?;
/// let (base, tool) = (FramePose::default(), FramePose::default());
/// let goal = world_from_tool(&robot, &base, &tool, &[0.1, -1.1, 1.3, 0.2, 0.8, 0.0]);
/// let mut chain = Chain::nominal(&robot, &base, &tool);
/// let start = [0.0, -1.0, 1.2, 0.0, 0.7, 0.0];
/// let found = InverseKinematics::new(6).solve(&mut chain, &goal, &start, |i| robot.links[i].limits);
/// assert_eq!(found.outcome, Outcome::Converged);
/// let reached = world_from_tool(&robot, &base, &tool, &found.q);
/// assert!((reached.translation.vector - goal.translation.vector).norm() < 1e-9);
/// # Ok::<(), &str>(())
/// ```
#[derive(Debug, Clone)]
pub struct InverseKinematics {
    /// Tolerance of position (m) and angle (rad).
    pub tolerance: [f64; 2],
    /// Step limit.
    pub most_steps: usize,
    /// Lever, m, that converts radians to metres in the error.
    lever: f64,
    jacobian: Matrix6xX<f64>,
    tried: Matrix6xX<f64>,
    q: Vec<f64>,
    next: Vec<f64>,
    held: Vec<bool>,
}

/// Lever, m, that converts radians to metres in the error: about the size of a hand and its tool, so that neither is
/// neglected.
pub(super) const LEVER: f64 = 0.3;
/// The same for an arm of fewer than six joints, which cannot meet every pose: it meets the position, and the orientation as nearly as
/// it can.
const POSITION_FIRST: f64 = 1e-4;
/// Distance, m, at which the position of such a pose is met.
const NEARLY: f64 = 1e-8;
/// Initial damping (m²), its lower limit, and the value at which the search is abandoned; the arm's J J^T is of order 0.1
/// m².
const DAMPING: [f64; 3] = [1e-4, 1e-14, 1e4];
/// The largest joint motion in one step, rad: the linearisation is not valid beyond.
const LARGEST_STEP: f64 = 0.5;
/// Ratio of slope to error below which no motion comes nearer.
const FLAT: f64 = 1e-7;

impl InverseKinematics {
    /// Creates a solver for arms with `joints` joints; poses are met to 1e-11 m and rad in at most 200 steps. Arms of fewer than six
    /// joints meet positions to 1e-8 m, and orientations as nearly as they can.
    pub fn new(joints: usize) -> Self {
        InverseKinematics {
            tolerance: [1e-11; 2],
            most_steps: 200,
            lever: if joints < 6 { POSITION_FIRST } else { LEVER },
            jacobian: Matrix6xX::zeros(joints),
            tried: Matrix6xX::zeros(joints),
            q: vec![0.0; joints],
            next: vec![0.0; joints],
            held: vec![false; joints],
        }
    }

    /// Searches for joints that put the tool at `world_from_tool`, from `start` (rad, N), inside `limits` (rad, N).
    pub fn solve(
        &mut self,
        kinematics: &mut impl Kinematics,
        world_from_tool: &Pose,
        start: &[f64],
        limits: impl Fn(usize) -> [f64; 2],
    ) -> Solution {
        for (i, (q, start)) in self.q.iter_mut().zip(start).enumerate() {
            let [low, high] = limits(i);
            *q = start.clamp(low, high);
        }
        let mut damping = DAMPING[0];
        let lever = self.lever;
        let mut error = pose_error(&kinematics.evaluate(&self.q, &mut self.jacobian), world_from_tool, lever);
        level(&mut self.jacobian, lever);
        let mut outcome = Outcome::NotConverged;
        let mut steps = 0;
        while steps < self.most_steps {
            if self.met(&error) {
                outcome = Outcome::Converged;
                break;
            }
            steps += 1;
            let slope = self.step(&error, damping, &limits);
            let mut tried = pose_error(&kinematics.evaluate(&self.next, &mut self.tried), world_from_tool, lever);
            level(&mut self.tried, lever);
            if tried.norm_squared() < error.norm_squared() {
                std::mem::swap(&mut self.q, &mut self.next);
                std::mem::swap(&mut self.jacobian, &mut self.tried);
                std::mem::swap(&mut error, &mut tried);
                damping = (damping * 0.1).max(DAMPING[1]);
            } else {
                damping *= 10.0;
            }
            if slope < FLAT * error.norm() || damping > DAMPING[2] {
                outcome = self.held.iter().position(|&h| h).map_or(Outcome::Unreachable, Outcome::JointLimit);
                break;
            }
        }
        let is_near = self.q.len() < 6 && error.fixed_rows::<3>(0).norm() < NEARLY;
        if self.met(&error) || is_near {
            outcome = Outcome::Converged;
        }
        Solution {
            q: self.q.clone(),
            outcome,
            steps,
            position_error: error.fixed_rows::<3>(0).norm(),
            rotation_error: error.fixed_rows::<3>(3).norm() / lever,
        }
    }

    fn met(&self, error: &Vector6<f64>) -> bool {
        let [position, rotation] = self.tolerance;
        error.fixed_rows::<3>(0).norm() < position && error.fixed_rows::<3>(3).norm() < rotation * self.lever
    }

    /// Sets `next` to the result of one damped step, holding the joints that press against a limit; returns the slope of
    /// the free ones.
    fn step(&mut self, error: &Vector6<f64>, damping: f64, limits: &impl Fn(usize) -> [f64; 2]) -> f64 {
        let n = self.q.len();
        self.held.fill(false);
        // Each round holds at least one more joint, so there are at most n + 1.
        loop {
            let mut gram = Matrix6::identity() * damping;
            for i in (0..n).filter(|&i| !self.held[i]) {
                let column = self.jacobian.column(i);
                gram.ger(1.0, &column, &column, 1.0);
            }
            // Damped, it is positive definite while it is finite. A slope of zero ends the search, and the pose counts as not reached.
            let Ok(factor) = cholesky(gram) else { return 0.0 };
            let weights = factor.solve(error);
            let step = |i: usize| self.jacobian.column(i).dot(&weights);
            let largest = (0..n).filter(|&i| !self.held[i]).map(|i| step(i).abs()).fold(0.0, f64::max);
            let scale = (LARGEST_STEP / largest).min(1.0);
            let mut pressed = None;
            for i in 0..n {
                let [low, high] = limits(i);
                let target = if self.held[i] { self.q[i] } else { self.q[i] + scale * step(i) };
                self.next[i] = target.clamp(low, high);
                let stuck = self.q[i] == low || self.q[i] == high;
                if !self.held[i] && stuck && self.next[i] == self.q[i] && target != self.q[i] {
                    pressed = Some(i);
                }
            }
            let Some(i) = pressed else { break };
            self.held[i] = true;
        }
        let free = (0..n).filter(|&i| !self.held[i]);
        free.map(|i| self.jacobian.column(i).dot(error).powi(2)).sum::<f64>().sqrt()
    }
}

/// Remaining translation and rotation, world axes; the rotation in metres at the lever.
fn pose_error(is: &Pose, target: &Pose, lever: f64) -> Vector6<f64> {
    let slide = target.translation.vector - is.translation.vector;
    // Via the quaternion: the angle from a matrix's trace has no resolution below 1e-8 rad.
    let turn = rotation_vector(&(target.rotation * is.rotation.inverse())) * lever;
    Vector6::new(slide.x, slide.y, slide.z, turn.x, turn.y, turn.z)
}

/// Multiplies the rotation rows of a Jacobian by the lever of the error.
fn level(jacobian: &mut Matrix6xX<f64>, lever: f64) {
    jacobian.rows_mut(3, 3).scale_mut(lever);
}

#[cfg(test)]
mod tests {
    use nalgebra::Translation3;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;
    use crate::robot::built_in;
    use crate::robot::sites::{MdhEntry, Site};
    use crate::units::{DEG, MM};

    const TOOL: FramePose = FramePose { xyz: [0.06, 0.0, -0.125], rz_ry_rx: [0.4, -0.3, 1.1] };

    fn limits(robot: &Robot) -> impl Fn(usize) -> [f64; 2] + '_ {
        |i| robot.links[i].limits
    }

    #[test]
    fn any_arm_finds_back_from_half_a_radian_away() {
        let mut random = ChaCha8Rng::seed_from_u64(3);
        for name in ["kr6_r700", "ur10", "ur5", "panda"] {
            let robot = built_in(name).unwrap();
            let n = robot.joints();
            let mut deviations = vec![0.0; SiteIndex::new(n).len()];
            deviations[SiteIndex::new(n).of(Site::mdh(2, MdhEntry::Beta))] = 0.02;
            deviations[SiteIndex::new(n).of(Site::mdh(4, MdhEntry::A))] = 0.5 * MM;
            let mut arm = Chain::deviating(&robot, &FramePose::default(), &TOOL, deviations);
            let mut solver = InverseKinematics::new(n);
            let mut jacobian = Matrix6xX::zeros(n);
            let mut converged = 0;
            for _ in 0..100 {
                let q: Vec<f64> =
                    robot.links.iter().map(|l| random.random_range(l.limits[0] * 0.8..l.limits[1] * 0.8)).collect();
                let target = arm.evaluate(&q, &mut jacobian);
                let start: Vec<f64> = q.iter().map(|q| q + random.random_range(-0.5..0.5)).collect();
                let found = solver.solve(&mut arm, &target, &start, limits(&robot));
                if found.outcome == Outcome::Converged {
                    converged += 1;
                    let reached = arm.evaluate(&found.q, &mut jacobian);
                    assert!((reached.to_homogeneous() - target.to_homogeneous()).amax() < 1e-10);
                    assert_eq!(robot.outside_limits(&found.q, 0.0), None);
                }
            }
            // Some starts lie beyond a singularity, or lead to a limit.
            assert!(converged >= 90, "{name}: {converged} of 100");
        }
    }

    #[test]
    fn an_arm_of_five_joints_meets_the_position() {
        let whole = built_in("ur5").unwrap();
        let robot = Robot { links: whole.links[..5].to_vec(), ..whole.clone() };
        let mut deviations = vec![0.0; SiteIndex::new(5).len()];
        deviations[SiteIndex::new(5).of(Site::mdh(2, MdhEntry::Beta))] = 0.01;
        deviations[SiteIndex::new(5).of(Site::mdh(1, MdhEntry::A))] = 0.5 * MM;
        let mut nominal = Chain::nominal(&robot, &FramePose::default(), &TOOL);
        let mut arm = Chain::deviating(&robot, &FramePose::default(), &TOOL, deviations);
        let mut jacobian = Matrix6xX::zeros(5);
        let q = [0.4, -1.1, 1.3, 0.5, 0.8];
        // No posture of the arm as it is has the orientation of the arm as drawn.
        let target = nominal.evaluate(&q, &mut jacobian);
        let found = InverseKinematics::new(5).solve(&mut arm, &target, &q, limits(&robot));
        assert_eq!(found.outcome, Outcome::Converged, "{found:?}");
        let reached = arm.evaluate(&found.q, &mut jacobian);
        assert!((reached.translation.vector - target.translation.vector).norm() < 1e-8, "{found:?}");
        assert!(found.rotation_error > 1e-4 && found.rotation_error < 0.02, "{found:?}");
    }

    #[test]
    fn a_target_out_of_reach_leaves_its_distance() {
        let robot = built_in("kr6_r700").unwrap();
        let mut arm = Chain::nominal(&robot, &FramePose::default(), &FramePose::default());
        let mut jacobian = Matrix6xX::zeros(6);
        let q = [0.1, -0.4, 0.9, 0.2, 0.6, 0.3];
        let near = arm.evaluate(&q, &mut jacobian);
        let far = Pose::from_parts(Translation3::new(2.0, 0.2, 0.5), near.rotation);
        let found = InverseKinematics::new(6).solve(&mut arm, &far, &q, limits(&robot));
        assert_ne!(found.outcome, Outcome::Converged);
        // The arm reaches about 0.785 m from the axis; the compromise with the rotation costs a little.
        assert!(found.position_error > 1.1 && found.position_error < 1.6, "{found:?}");
    }

    #[test]
    fn a_limit_in_the_way_is_named() {
        let robot = built_in("kr6_r700").unwrap();
        let mut arm = Chain::nominal(&robot, &FramePose::default(), &TOOL);
        let mut jacobian = Matrix6xX::zeros(6);
        let beyond = [175.0 * DEG, -1.2, 1.4, 0.3, 0.9, -0.2];
        let target = arm.evaluate(&beyond, &mut jacobian);
        let start = [165.0 * DEG, -1.2, 1.4, 0.3, 0.9, -0.2];
        let found = InverseKinematics::new(6).solve(&mut arm, &target, &start, limits(&robot));
        assert_eq!(found.outcome, Outcome::JointLimit(0), "{found:?}");
        assert_eq!(found.q[0], robot.links[0].limits[1]);
    }
}
