//! The joints that the robot's own controller computes for a pose: inverse kinematics of the nominal model.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::Refusal;
use crate::robot::inverse::{Chain, InverseKinematics, Outcome, SphericalWrist};
use crate::robot::{FramePose, Pose, Robot};

/// Number of starts of a search if there is no closed form; four of five find a pose within reach of a six-axis arm.
const STARTS: usize = 40;

/// Fixed seed, so that the same pose gives the same joints.
const SEED: u64 = 0x0fa4_e1a6;

/// Inverse kinematics of the nominal arm: in closed form if the wrist is spherical, otherwise by a search.
pub struct NominalInverse<'a> {
    robot: &'a Robot,
    wrist: Option<SphericalWrist>,
    arm: Chain<'a>,
    search: InverseKinematics,
}

impl<'a> NominalInverse<'a> {
    /// Creates the inverse of a nominal robot.
    pub fn new(robot: &'a Robot) -> Self {
        NominalInverse {
            robot,
            wrist: SphericalWrist::new(robot).ok(),
            arm: Chain::nominal(robot, &FramePose::default(), &FramePose::default()),
            search: InverseKinematics::new(robot.joints()),
        }
    }

    /// The closed form, if there is one: such arms have a status and a turn.
    pub fn wrist(&self) -> Option<&SphericalWrist> {
        self.wrist.as_ref()
    }

    /// Joints within the limits (rad, N) that put the last frame at `root_from_last`: among those with the given status and
    /// turn, if any, the nearest to `near` (rad, N).
    ///
    /// # Errors
    /// The reason, when there are none.
    pub fn joints(
        &mut self,
        root_from_last: &Pose,
        status: Option<u8>,
        turn: Option<u8>,
        near: &[f64],
    ) -> Result<Vec<f64>, Refusal> {
        if let (Some(wrist), Ok(near)) = (&self.wrist, <&[f64; 6]>::try_from(near)) {
            if let Some(q) = wrist.joints_of(root_from_last, status, turn, near) {
                return Ok(q.to_vec());
            }
            let (mut reachable, mut inside) = (false, false);
            wrist.branches(root_from_last, |branch| {
                reachable = true;
                wrist.whole_turns(&branch.q, 0.0, |_| inside = true);
            });
            return Err(match (reachable, inside) {
                (false, _) => Refusal::Unreachable,
                (true, false) => Refusal::JointLimit { joint: None },
                (true, true) => Refusal::NoSuchConfiguration,
            });
        }
        self.search(root_from_last, near, |_| true)
    }

    /// The joints within the limits (rad, N) that put the last frame at `root_from_last` nearest to `near`, of all postures of the
    /// arm.
    ///
    /// # Errors
    /// The reason, when there are none.
    pub fn nearest(&mut self, root_from_last: &Pose, near: &[f64]) -> Result<Vec<f64>, Refusal> {
        if self.wrist.is_some() {
            return self.joints(root_from_last, None, None, near);
        }
        let away = |q: &[f64]| q.iter().zip(near).map(|(q, near)| (q - near).powi(2)).sum::<f64>();
        let mut nearest: Option<Vec<f64>> = None;
        let last = self.search(root_from_last, near, |q| {
            if nearest.as_ref().is_none_or(|known| away(q) < away(known)) {
                nearest = Some(q.to_vec());
            }
            false
        });
        nearest.map_or(last, Ok)
    }

    /// The joints found first that are `enough`, of searches from `near` and from anywhere.
    fn search(
        &mut self,
        root_from_last: &Pose,
        near: &[f64],
        mut enough: impl FnMut(&[f64]) -> bool,
    ) -> Result<Vec<f64>, Refusal> {
        let mut random = ChaCha8Rng::seed_from_u64(SEED);
        let robot = self.robot;
        let mut start = near.to_vec();
        let mut why = Refusal::Unreachable;
        for _ in 0..STARTS {
            let found = self.search.solve(&mut self.arm, root_from_last, &start, |i| robot.links[i].limits);
            match found.outcome {
                Outcome::Converged if enough(&found.q) => return Ok(found.q),
                Outcome::JointLimit(joint) => why = Refusal::JointLimit { joint: Some(joint) },
                Outcome::Converged | Outcome::Unreachable | Outcome::NotConverged => {}
            }
            start.iter_mut().zip(&robot.links).for_each(|(q, link)| *q = random.random_range(link.limits[0]..link.limits[1]));
        }
        Err(why)
    }
}
