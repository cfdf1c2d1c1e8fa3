//! Joints from the pose of the flange or TCP that a controller states, where a table has no joints: hand-eye files. Of the postures
//! of an arm at one pose it is supposed to be in the one nearest to joints that the map states.

use super::column_map::MappedFlange;
use crate::compensate::NominalInverse;
use crate::measure::dataset::samples_text::number;
use crate::robot::{Pose, Robot};
use crate::units::DEG;

/// Computes the joints of the rows.
pub(super) struct JointsOfFlange<'a> {
    map: &'a MappedFlange,
    robot: &'a Robot,
    inverse: NominalInverse<'a>,
}

impl<'a> JointsOfFlange<'a> {
    pub fn new(map: &'a MappedFlange, robot: &'a Robot) -> Self {
        JointsOfFlange { map, robot, inverse: NominalInverse::new(robot) }
    }

    /// The joints at a pose as stated, deg as text, or the reason why there are none.
    pub fn at(&mut self, stated: &Pose) -> Result<Vec<String>, String> {
        let flange = stated * self.map.tool.inverse();
        let root_from_last = self.robot.root.pose().inverse() * flange * self.robot.flange.pose().inverse();
        let found = self.inverse.nearest(&root_from_last, &self.map.near);
        let joints = found.map_err(|why| format!("the nominal arm has no joints for the pose of the flange: {why}"))?;
        Ok(joints.iter().map(|angle| number(*angle, DEG)).collect())
    }
}
