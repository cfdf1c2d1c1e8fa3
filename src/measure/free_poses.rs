//! Postures that stand free, for judging by a laser tracker.

use nalgebra::{Unit, Vector3};

use super::draws::{Margins, PoolError, Purpose, Refusals, between, drawn, stream, within};
use crate::robot::{ClearanceCheck, FramePose, Pose, Posture, Robot, SiteIndex, Surroundings, dexterity};
use crate::units::MM;

/// Radius of the tracker's beam with some air around it, m.
const BEAM: f64 = 10.0 * MM;

/// Where the beam comes out of the reflector: so far from its centre nothing that holds it is looked at, m (a 1.5-inch reflector).
const REFLECTOR: f64 = 19.05 * MM;

/// That the reflector at the TCP looks at the tracker.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Facing {
    /// Along which, in the tool's axes, the reflector looks.
    pub looks: Unit<Vector3<f64>>,
    /// The tracker in the world, m.
    pub tracker: Vector3<f64>,
    /// The largest angle between the two, rad; a 1.5-inch reflector takes about 30 deg. Nobody turns it from pose to pose.
    pub within: f64,
}

impl Facing {
    /// The beam's ends: where it leaves the reflector, and the tracker, m.
    fn beam(&self, world_from_tool: &Pose) -> [Vector3<f64>; 2] {
        let reflector = world_from_tool.translation.vector;
        [reflector + (self.tracker - reflector).cap_magnitude(REFLECTOR), self.tracker]
    }

    fn holds(&self, world_from_tool: &Pose) -> bool {
        let looks = world_from_tool.rotation * self.looks.into_inner();
        looks.angle(&(self.tracker - world_from_tool.translation.vector)) <= self.within
    }
}

/// What is asked of free postures.
#[derive(Debug, Clone, Copy)]
pub struct FreePosesRequest<'a> {
    /// The robot as drawn.
    pub robot: &'a Robot,
    /// Its nominal base in the world.
    pub base: &'a FramePose,
    /// The TCP frame in the last frame.
    pub tool: &'a FramePose,
    /// What must not be touched.
    pub surroundings: &'a Surroundings,
    /// How far to keep from trouble.
    pub margins: Margins,
    /// Where the reflector must look; `None` for anywhere.
    pub facing: Option<Facing>,
    /// Postures wanted.
    pub count: usize,
    /// Seed.
    pub seed: u64,
}

/// Up to `count` postures, uniform in the joints (rad, N), in which nothing touches and the reflector faces the tracker, which sees it past
/// the arm and all that stands in the cell.
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
