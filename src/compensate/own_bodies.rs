//! Test for targets that lie inside the arm.

use nalgebra::Vector3;

use crate::robot::kinematics::Posture;
use crate::robot::solids::{ClearanceCheck, Solid, Surroundings};
use crate::robot::{FramePose, Robot};

/// Bodies are modelled by hand and slightly too large: a TCP has to lie deeper in one than this, m.
const DEEP: f64 = 0.01;

/// Number of joints from the wrist's beginning to the last; a TCP may lie in the wrist if the tool is short, or its length
/// unknown.
const WRIST: usize = 4;

/// The TCP as a point, checked against each body of the arm before the wrist.
pub(super) struct OwnBodies(Vec<ClearanceCheck>);

impl OwnBodies {
    /// Creates the check for an arm with a tool.
    pub fn of(robot: &Robot, tool: &FramePose) -> Self {
        let most = robot.joints().saturating_sub(WRIST);
        let tip = Solid::capsule("the TCP", robot.joints(), [Vector3::from(tool.xyz); 2], 0.0);
        let carried = Surroundings { carried: vec![tip], ..Surroundings::default() };
        let alone = |solid: &Solid| Robot { solids: vec![solid.clone()], ..robot.clone() };
        let low = robot.solids.iter().filter(|s| s.frame <= most);
        OwnBodies(low.map(|solid| ClearanceCheck::new(&alone(solid), &carried)).collect())
    }

    /// The body that contains the TCP in a posture.
    pub fn holds_tcp(&mut self, posture: &Posture) -> Option<String> {
        let gaps = self.0.iter_mut().filter_map(|check| check.clearance(posture));
        gaps.into_iter().find(|gap| gap.distance < -DEEP).map(|gap| {
            let [body, _] = gap.between;
            body
        })
    }
}
