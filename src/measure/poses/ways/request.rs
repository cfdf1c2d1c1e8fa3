//! The request for a way.

use crate::cell::guards::Guards;
use crate::measure::dataset::Dataset;
use crate::robot::solids::{Clearance, Surroundings, SweptCheck};
use crate::robot::{FramePose, Robot};
use crate::units::MM;

/// Largest deviation of an uncalibrated arm from its nominal position, m (docs/cell.md).
pub(crate) const NOMINAL_WITHIN: f64 = 5.0 * MM;

/// Clearance of ways, m: 3 mm of gap, and 5 mm for the deviation of an uncalibrated arm from its nominal position
/// (docs/cell.md).
pub const WAY_MARGIN: f64 = 3.0 * MM + NOMINAL_WITHIN;

/// The cell in which a way is searched for, and the clearance to keep.
#[derive(Debug, Clone, Copy)]
pub struct WayRequest<'a> {
    /// The nominal model of the robot.
    pub robot: &'a Robot,
    /// Its nominal base in the world.
    pub base: &'a FramePose,
    /// The TCP frame in the last frame.
    pub tool: &'a FramePose,
    /// Bodies that must not be touched.
    pub surroundings: &'a Surroundings,
    /// Clearance to keep, m. If an end of a way has less, the way has no less than that end.
    pub margin: f64,
    /// Limits on the robot's motions, if known: joint limits with a margin, a box for the TCP.
    pub guards: Option<&'a Guards>,
    /// Seed of the search, where one is needed.
    pub seed: u64,
}

impl<'a> WayRequest<'a> {
    /// Asks for ways of the nominal arm of a cell among these bodies, with the usual clearance and no guards.
    #[must_use]
    pub fn of(cell: &'a Dataset, surroundings: &'a Surroundings, seed: u64) -> Self {
        let Dataset { robot, base, tool, .. } = cell;
        WayRequest { robot, base, tool, surroundings, margin: WAY_MARGIN, guards: None, seed }
    }

    /// The narrowest gap of a straight motion that keeps `margin` (m).
    ///
    /// # Errors
    /// The narrowest gap of one that does not; `None` if the guards forbid it.
    pub(super) fn leg(
        &self,
        swept: &mut SweptCheck<'_>,
        [from, to]: [&[f64]; 2],
        margin: f64,
    ) -> Result<Option<Clearance>, Option<Clearance>> {
        if !self.is_allowed(from, to) {
            return Err(None);
        }
        let narrowest = swept.narrowest(from, to, margin, None).map(|n| n.clearance);
        // An overlap is never clear, however small the margin.
        match &narrowest {
            Some(gap) if gap.distance < margin || gap.distance <= 0.0 => Err(narrowest),
            _ => Ok(narrowest),
        }
    }

    /// True if the guards allow this motion.
    pub(super) fn is_allowed(&self, from: &[f64], to: &[f64]) -> bool {
        self.guards.is_none_or(|guards| guards.joint_motion(from, to).is_ok())
    }
}
