//! What a robot is going to do at a measurement, before anything moves, and what it does while it moves.
//!
//! [`Rehearsal::of`] goes through the motions of a plan in the order in which they will be made: the limits that each respects, and
//! the gap of every body of the arm to everything around it. It says what it does not know. [`rehearsal_page`] shows it as one
//! HTML file with a film of the arm. [`Watch`] is the page of a measurement that runs.

mod bodies;
mod film;
mod motion;
mod page;
mod rehearsal;
mod unchecked;
mod watch;

pub use bodies::LeastGap;
pub use motion::{Phase, Rehearsed};
pub use page::{Sources, rehearsal_page};
pub use rehearsal::{ChangedGap, MotionTime, PlannedGap, Rehearsal};
pub use watch::Watch;
