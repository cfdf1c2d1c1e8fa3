//! RelTool: the small straight move along the tool's own axes by which a controller, using only the nominal arm, nulls the
//! indicators.

use nalgebra::{Matrix6, Matrix6xX, Rotation3, Vector3, Vector6};
use thiserror::Error;

use super::kinematics::Posture;
use super::sites::SiteIndex;
use super::{FramePose, Robot};
use crate::math::positive_definite::cholesky;

/// After a Newton step this small (rad) the next would be its square, below the rounding of the pose.
const LAST_STEP: f64 = 1e-7;
/// A move of a few millimetres takes two or three steps; one that needs more crosses a singularity.
const MOST_STEPS: usize = 12;
/// A step larger than this (rad) is not a small move: the Jacobian is singular there.
const LARGEST_STEP: f64 = 1.0;

/// The reason why the tool cannot be moved as requested.
#[derive(Debug, Error, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum RelToolError {
    /// The move ends outside a joint's limits.
    #[error("joint {joint} would leave its limits")]
    JointLimit {
        /// Counted from 1.
        joint: usize,
    },
    /// The arm cannot move its tool in this direction from here, or not as far.
    #[error("the arm is at a singularity, or the move leaves its reach")]
    Singular,
}

/// The controller's solver, reused between moves to avoid allocation.
#[derive(Debug, Clone)]
pub struct RelTool {
    stop_after: Option<usize>,
    /// Rotates the tool's axes into those of the flange.
    turned: Rotation3<f64>,
    posture: Posture,
    /// Base and tool of the arm's last set-up.
    set_up: Option<(FramePose, FramePose)>,
    nominal: Vec<f64>,
    wide: Matrix6xX<f64>,
    moved: Vec<f64>,
}

impl RelTool {
    /// A solver for this arm, exact to rounding.
    pub fn new(robot: &Robot) -> Self {
        let n = robot.joints();
        RelTool {
            stop_after: None,
            turned: Rotation3::identity(),
            posture: Posture::new(robot),
            set_up: None,
            nominal: vec![0.0; SiteIndex::new(n).len()],
            wide: Matrix6xX::zeros(n),
            moved: vec![0.0; n],
        }
    }

    /// A controller that stops after `steps` Newton steps, as some do.
    pub fn stopping_after(robot: &Robot, steps: usize) -> Self {
        RelTool { stop_after: Some(steps), ..RelTool::new(robot) }
    }

    /// Moves joints `q` (rad or m, N) of the solver's arm so that its TCP moves by `offset` (m) along the axes of `tool` and
    /// keeps its orientation to 1e-12. On an error `q` is unchanged.
    ///
    /// Newton iteration on the pose: `J dq = (p* - p, 1/2 vee(E - E^T))` with `E = R* R^T`; the smallest dq if the arm is
    /// redundant.
    ///
    /// # Errors
    /// When a joint would leave its limits, or the Jacobian is singular on the way.
    pub fn shift(
        &mut self,
        robot: &Robot,
        base: &FramePose,
        tool: &FramePose,
        q: &mut [f64],
        offset: &Vector3<f64>,
    ) -> Result<(), RelToolError> {
        self.moved.copy_from_slice(q);
        if self.set_up == Some((*base, *tool)) {
            self.posture.turn_to(robot, &self.moved, &self.nominal);
        } else {
            self.posture.set(robot, base, tool, &self.moved, &self.nominal);
            self.turned = tool.pose().rotation;
            self.set_up = Some((*base, *tool));
        }
        let flange = self.posture.flange();
        let target = self.posture.tcp() + flange.direction(&(self.turned * offset));
        for step in 1..=MOST_STEPS {
            let is = self.posture.flange();
            let turn = (is.x.cross(&flange.x) + is.y.cross(&flange.y) + is.z.cross(&flange.z)) * 0.5;
            let slide = target - self.posture.tcp();
            let error = Vector6::new(slide.x, slide.y, slide.z, turn.x, turn.y, turn.z);
            let largest = self.step(&error).ok_or(RelToolError::Singular)?;
            if largest < LAST_STEP || self.stop_after.is_some_and(|most| step >= most) {
                if let Some(joint) = robot.outside_limits(&self.moved, 0.0) {
                    return Err(RelToolError::JointLimit { joint: joint + 1 });
                }
                q.copy_from_slice(&self.moved);
                return Ok(());
            }
            self.posture.turn_to(robot, &self.moved, &self.nominal);
        }
        Err(RelToolError::Singular)
    }

    /// Performs one Newton step; returns the largest joint motion in it, `None` at a singular posture or if it is too large.
    fn step(&mut self, error: &Vector6<f64>) -> Option<f64> {
        let n = self.moved.len();
        let mut largest = 0.0;
        let mut turn = |joint: usize, by: f64| {
            self.moved[joint] += by;
            largest = f64::max(largest, by.abs());
        };
        if n == 6 {
            let mut jacobian = Matrix6::zeros();
            for i in 0..6 {
                jacobian.set_column(i, &screw(&self.posture, i));
            }
            let dq = jacobian.lu().solve(error)?;
            (0..6).for_each(|i| turn(i, dq[i]));
        } else {
            for i in 0..n {
                self.wide.set_column(i, &screw(&self.posture, i));
            }
            let mut gram = Matrix6::zeros();
            for column in self.wide.column_iter() {
                gram.ger(1.0, &column, &column, 1.0);
            }
            let weights = cholesky(gram).ok()?.solve(error);
            (0..n).for_each(|i| turn(i, self.wide.column(i).dot(&weights)));
        }
        (largest < LARGEST_STEP).then_some(largest)
    }
}

/// Velocity of the TCP (m) over angular velocity of the tool (rad), world axes, per rad of joint `i` (counted from 0), or per m
/// of a prismatic one.
pub(crate) fn screw(posture: &Posture, i: usize) -> Vector6<f64> {
    let v = posture.motion(i);
    let axis = if posture.slides(i) { Vector3::zeros() } else { posture.joint_axis(i).0 };
    Vector6::new(v.x, v.y, v.z, axis.x, axis.y, axis.z)
}

/// The joints (rad) that move the TCP of the nominal arm from its position at `q` by `offset` (m) along the tool's axes.
///
/// ```
/// use calibench::nalgebra::Vector3;
/// use calibench::robot::kinematics::world_from_tool;
/// use calibench::robot::rel_tool::rel_tool;
/// use calibench::robot::{FramePose, built_in};
/// use calibench::units::MM;
///
/// // One millimetre along the tool's z axis.
/// let robot = built_in("kr6_r700").ok_or("built in")?;
/// let (base, tool) = (FramePose::default(), FramePose::default());
/// let q = vec![0.0, -1.2, 1.4, 0.4, 0.9, 0.0];
/// let moved = rel_tool(&robot, &base, &tool, &q, &Vector3::new(0.0, 0.0, 1.0 * MM))?;
/// let [from, to] = [&q, &moved].map(|q| world_from_tool(&robot, &base, &tool, q));
/// let shift = (from.inverse() * to).translation.vector;
/// assert!((shift - Vector3::new(0.0, 0.0, 1.0 * MM)).norm() < 1e-12);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// As [`RelTool::shift`].
pub fn rel_tool(
    robot: &Robot,
    base: &FramePose,
    tool: &FramePose,
    q: &[f64],
    offset: &Vector3<f64>,
) -> Result<Vec<f64>, RelToolError> {
    let mut moved = q.to_vec();
    RelTool::new(robot).shift(robot, base, tool, &mut moved, offset)?;
    Ok(moved)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robot::built_in;
    use crate::robot::kinematics::world_from_tool;

    const TOOL: FramePose = FramePose { xyz: [0.06, 0.0, -0.125], rz_ry_rx: [0.4, -0.3, 1.1] };

    #[test]
    fn the_tcp_moves_by_the_offset_and_does_not_turn() {
        for (name, q) in [
            ("kr6_r700", vec![0.2, -1.2, 1.4, 0.4, 0.9, -0.3]),
            ("ur10", vec![0.2, -1.2, 1.4, 0.4, 0.9, -0.3]),
            ("panda", vec![0.2, -0.8, 0.1, -2.2, 0.1, 1.7, 0.8]),
        ] {
            let robot = built_in(name).unwrap();
            let base = FramePose { xyz: [-0.5, 0.1, 0.0], rz_ry_rx: [0.3, 0.0, 0.1] };
            for offset in [Vector3::new(0.001, -0.002, 0.0005), Vector3::new(0.0, 0.0, 0.05), Vector3::zeros()] {
                let before = world_from_tool(&robot, &base, &TOOL, &q);
                let moved = rel_tool(&robot, &base, &TOOL, &q, &offset).unwrap();
                let after = world_from_tool(&robot, &base, &TOOL, &moved);
                let step = before.inv_mul(&after);
                assert!((step.translation.vector - offset).norm() < 1e-12, "{name} {offset:?}");
                assert!((step.rotation.matrix() - nalgebra::Matrix3::identity()).amax() < 1e-12, "{name} {offset:?}");
            }
        }
    }

    #[test]
    fn limits_and_singularities_are_told_and_change_nothing() {
        let robot = built_in("kr6_r700").unwrap();
        let base = FramePose::default();
        let tool = FramePose { xyz: [0.0, 0.0, -0.1], ..FramePose::default() };
        let mut solver = RelTool::new(&robot);
        let at_limit = [170f64.to_radians(), -1.2, 1.4, 0.0, 0.9, 0.0];
        let mut q = at_limit;
        let outcomes: Vec<_> = [0.01, -0.01]
            .map(|y| {
                q = at_limit;
                let outcome = solver.shift(&robot, &base, &tool, &mut q, &Vector3::new(0.0, y, 0.0));
                assert!(outcome.is_ok() || q == at_limit);
                outcome
            })
            .into();
        assert!(outcomes.contains(&Ok(())) && outcomes.contains(&Err(RelToolError::JointLimit { joint: 1 })), "{outcomes:?}");
        // Stretched out along x: the limit of the reach.
        let mut stretched = [0.0, 0.0, 35f64.atan2(365.0), 0.0, 0.3, 0.0];
        let far = solver.shift(&robot, &base, &tool, &mut stretched, &Vector3::new(0.0, 0.0, -0.2));
        assert_eq!(far, Err(RelToolError::Singular));
        // Wrist aligned: the tool cannot be moved sideways without rotating.
        let mut lined_up = [0.0, -1.2, 1.4, 0.0, 0.0, 0.0];
        let sideways = solver.shift(&robot, &base, &tool, &mut lined_up, &Vector3::new(0.0, 0.002, 0.0));
        assert_eq!(sideways, Err(RelToolError::Singular));
        assert_eq!(lined_up[0], 0.0);
    }
}
