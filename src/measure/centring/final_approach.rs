//! The last motion before a measurement, in a chosen direction.
//!
//! The rest position of a joint depends on the direction of its approach. A centring approaches in whatever direction its last
//! small steps take; to observe the difference, the same place is measured again with every joint arriving in the opposite
//! direction.

use super::{CenteringController, Centred, CentringFailure, Iteration, Phase};
use crate::cell::{Indicator, Manipulator};
use crate::units::DEG;

/// Excursion of every joint, rad. 0.05 deg: thirty times the lost motion of a poor joint, and at most 2 mm at the TCP of a
/// small robot, within the safe range of the gauge and the clearance of its poses.
const ASIDE: f64 = 0.05 * DEG;

impl<M: Manipulator, I: Indicator> CenteringController<M, I> {
    /// Moves away from a centred ball and back to the same joints, joint i in the direction opposite to `last_motion[i]` (a
    /// zero counts as +1). The ball is not centred again, which would undo it: the residual readings, about ten micrometres,
    /// are the measurement.
    ///
    /// # Errors
    /// When the robot does not obey or the ball is lost.
    pub(super) fn arrive_against(
        &mut self,
        last_motion: &[i8],
        centred: &Centred,
        note: &mut dyn FnMut(&Iteration),
    ) -> Result<Centred, CentringFailure> {
        let aside = |(q, &sign): (&f64, &i8)| if sign < 0 { q - ASIDE } else { q + ASIDE };
        let aside: Vec<f64> = centred.joints.iter().zip(last_motion).map(aside).collect();
        self.stop(Phase::Centring, &[aside], note, |cell, _, reading| cell.contact(&reading?))?;
        self.stop(Phase::Centring, std::slice::from_ref(&centred.joints), note, |cell, at, reading| {
            let reading = reading?;
            cell.contact(&reading)?;
            Ok(cell.centred(at, reading, centred.steps + 2))
        })
    }
}
