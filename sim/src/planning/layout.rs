//! The cell of a scenario, as needed to find postures and paths in it.

use calibench::measure::poses::free_poses::Facing;
use calibench::measure::poses::pool::Margins;
use calibench::measure::poses::ways::WAY_MARGIN;
use calibench::planning::pool::CellLayout;
use calibench::robot::solids::Solid;
use calibench::units::{DEG, MM};
use nalgebra::{Unit, Vector3};

use crate::scenario::Scenario;

/// Returns the cell of a scenario, as needed to find postures in it.
pub fn layout(scenario: &Scenario) -> CellLayout {
    CellLayout {
        surroundings: scenario.surroundings(),
        without_artifact: scenario.surroundings_without_artifact(),
        outward: scenario.outward().to_vec(),
        bodies: scenario.ball_ids().iter().map(|id| Solid::ball_name(id)).collect(),
        margins: Margins { clearance: scenario.plan.clearance_mm * MM, free: WAY_MARGIN, ..Margins::default() },
        retreat: scenario.plan.retreat_mm * MM,
        cone: scenario.plan.cone_deg * DEG,
        facing: Some(Facing {
            // The socket opens in the direction from which a ball enters; the reflector looks out of it.
            looks: -retreat(),
            tracker: Vector3::from(scenario.tracker.position_mm) * MM,
            within: scenario.tracker.facing_deg * DEG,
        }),
        is_known: true,
    }
}

/// Direction in which the gauge leaves a ball, in the tool's axes: the middle of the three channels.
pub fn retreat() -> Unit<Vector3<f64>> {
    Unit::new_normalize(Vector3::repeat(1.0))
}
