//! Whether a target lies in the arm that is to reach it.

use nalgebra::Vector3;

use crate::robot::{ClearanceCheck, FramePose, Posture, Robot, Solid, Surroundings};

/// Bodies are drawn by hand and a little too large: a TCP has to lie deeper in one than this, m.
const DEEP: f64 = 0.01;

/// The wrist begins so many joints before the last; a TCP may lie in it where the tool is short, or its length is not known.
const WRIST: usize = 4;

/// The TCP as a point against each body of the arm before the wrist.
pub(super) struct OwnBodies(Vec<ClearanceCheck>);

impl OwnBodies {
    /// Of an arm with a tool.
    pub fn of(robot: &Robot, tool: &FramePose) -> Self {
        let most = robot.joints().saturating_sub(WRIST);
        let tip = Solid::capsule("the TCP", robot.joints(), [Vector3::from(tool.xyz); 2], 0.0);
        let carried = Surroundings { carried: vec![tip], ..Surroundings::default() };
        let alone = |solid: &Solid| Robot { solids: vec![solid.clone()], ..robot.clone() };
        let low = robot.solids.iter().filter(|s| s.frame <= most);
        OwnBodies(low.map(|solid| ClearanceCheck::new(&alone(solid), &carried)).collect())
    }

    /// The body in which the TCP lies in a posture.
    pub fn holds_tcp(&mut self, posture: &Posture) -> Option<String> {
        let gaps = self.0.iter_mut().filter_map(|check| check.clearance(posture));
        gaps.into_iter().find(|gap| gap.distance < -DEEP).map(|gap| {
            let [body, _] = gap.between;
            body
        })
    }
}
