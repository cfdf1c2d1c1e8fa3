//! Free postures, for validation by a laser tracker.

use nalgebra::{Unit, Vector3};

use super::draws::{Margins, PoolError, Purpose, Refusals, between, drawn, stream, within};
use crate::robot::inverse::dexterity;
use crate::robot::kinematics::Posture;
use crate::robot::sites::SiteIndex;
use crate::robot::solids::{ClearanceCheck, Surroundings};
use crate::robot::{FramePose, Pose, Robot};
use crate::units::MM;

/// Radius of the tracker's beam with some clearance, m.
const BEAM: f64 = 10.0 * MM;

/// Distance from the reflector's centre at which the beam starts, m (a 1.5-inch reflector): its holder is not checked.
const REFLECTOR: f64 = 19.05 * MM;

/// Condition that the reflector at the TCP faces the tracker.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Facing {
    /// Viewing direction of the reflector, in the tool's axes.
    pub looks: Unit<Vector3<f64>>,
    /// The tracker in the world, m.
    pub tracker: Vector3<f64>,
    /// Largest angle between the two directions, rad; a 1.5-inch reflector accepts about 30 deg. It is not turned from pose to
    /// pose.
    pub within: f64,
}

impl Facing {
    /// Ends of the beam: its exit from the reflector, and the tracker, m.
    fn beam(&self, world_from_tool: &Pose) -> [Vector3<f64>; 2] {
        let reflector = world_from_tool.translation.vector;
        [reflector + (self.tracker - reflector).cap_magnitude(REFLECTOR), self.tracker]
    }

    fn holds(&self, world_from_tool: &Pose) -> bool {
        let looks = world_from_tool.rotation * self.looks.into_inner();
        looks.angle(&(self.tracker - world_from_tool.translation.vector)) <= self.within
    }
}

/// Request for free postures.
#[derive(Debug, Clone, Copy)]
pub struct FreePosesRequest<'a> {
    /// The nominal model of the robot.
    pub robot: &'a Robot,
    /// Its nominal base in the world.
    pub base: &'a FramePose,
    /// The TCP frame in the last frame.
    pub tool: &'a FramePose,
    /// Bodies that must not be touched.
    pub surroundings: &'a Surroundings,
    /// Margins to keep.
    pub margins: Margins,
    /// Condition on the reflector; `None` for any direction.
    pub facing: Option<Facing>,
    /// Number of postures requested.
    pub count: usize,
    /// Seed.
    pub seed: u64,
}

/// Returns up to `count` postures, uniform in the joints (rad, N), without contact, in which the reflector faces the tracker
/// and the line of sight is clear of the arm and all bodies of the cell.
///
/// # Errors
/// When there is none.
pub fn free_poses(request: &FreePosesRequest<'_>) -> Result<Vec<Vec<f64>>, PoolError> {
    let FreePosesRequest { robot, base, tool, margins, .. } = *request;
    let none = vec![0.0; SiteIndex::new(robot.joints()).len()];
    let workspace = || (Posture::new(robot), ClearanceCheck::new(robot, request.surroundings));
    let draw = |(posture, clearance): &mut (Posture, ClearanceCheck), number: u64| {
        let mut random = stream(request.seed, Purpose::Free, number);
        let q: Vec<f64> = robot.links.iter().map(|l| between(within(l.limits, margins.limit), &mut random)).collect();
        posture.set(robot, base, tool, &q, &none);
        let mut refusals = Refusals::default();
        let reflector = posture.world_from_tool(tool);
        if request.facing.is_some_and(|facing| !facing.holds(&reflector)) {
            refusals.facing += 1;
        } else if dexterity(posture, q.len()) < margins.dexterity {
            refusals.singular += 1;
        } else if !clearance.is_clear(posture, margins.free, None) {
            refusals.touching += 1;
        } else if request.facing.is_some_and(|facing| !clearance.is_in_sight(posture, facing.beam(&reflector), BEAM)) {
            refusals.hidden += 1;
        } else {
            return (vec![q], refusals);
        }
        (Vec::new(), refusals)
    };
    let (found, tried, because) = drawn(request.count, workspace, draw);
    if found.is_empty() && request.count > 0 {
        return Err(PoolError::NoFreePose { tried, because });
    }
    Ok(found)
}
