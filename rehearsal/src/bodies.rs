//! The least gap of every body of the arm.

use calibench::measure::campaign::cell::Cell;
use calibench::robot::solids::{Clearance, Solid, Surroundings, SweptCheck};

use crate::motion::{Phase, Rehearsed};

/// The least gap of a body of the arm over all motions.
#[derive(Debug, Clone, PartialEq)]
pub struct LeastGap {
    /// The body.
    pub body: String,
    /// The other body.
    pub other: String,
    /// The gap, m, to half a millimetre; not more than zero if they overlap.
    pub gap: f64,
    /// Index of the motion.
    pub motion: usize,
}

/// Finds the gaps of all motions, which are written into them, and the least of every body that moves, the smallest first.
pub(super) fn find_gaps(cell: &Cell, bodies: &Surroundings, motions: &mut [Rehearsed]) -> Vec<LeastGap> {
    let (robot, dataset) = (&cell.dataset.robot, &cell.dataset);
    let mut names: Vec<&str> = Vec::new();
    for solid in robot.solids.iter().filter(|solid| solid.frame > 0).chain(&bodies.carried) {
        if !names.contains(&solid.name.as_str()) {
            names.push(&solid.name);
        }
    }
    let mut least: Vec<LeastGap> = names
        .iter()
        .filter_map(|name| {
            let mut swept = SweptCheck::new(robot, &dataset.base, &dataset.tool, bodies).of_body(name);
            let mut least: Option<LeastGap> = None;
            let mut onto: Option<Clearance> = None;
            for (k, motion) in motions.iter_mut().enumerate() {
                let found = if motion.phase == Phase::Retreat {
                    // The same path as onto the ball.
                    onto.take()
                } else {
                    let touched =
                        motion.ball.filter(|_| motion.phase == Phase::Contact).and_then(|ball| dataset.balls.get(ball));
                    let except = touched.and_then(|ball| swept.fixed_named(&Solid::ball_name(&ball.id)));
                    swept.narrowest(&motion.from, &motion.to, f64::NEG_INFINITY, except).map(|narrowest| narrowest.clearance)
                };
                let Some(gap) = found else { continue };
                if motion.phase == Phase::Contact {
                    onto = Some(gap.clone());
                }
                if least.as_ref().is_none_or(|least| gap.distance < least.gap) {
                    let [a, b] = &gap.between;
                    let other = if a == name { b } else { a };
                    least = Some(LeastGap { body: (*name).to_owned(), other: other.clone(), gap: gap.distance, motion: k });
                }
                if motion.clearance.as_ref().is_none_or(|known| gap.distance < known.distance) {
                    motion.clearance = Some(gap);
                }
            }
            least
        })
        .collect();
    least.sort_by(|a, b| a.gap.total_cmp(&b.gap));
    least
}
