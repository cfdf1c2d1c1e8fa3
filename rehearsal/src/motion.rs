//! The motions of a plan, in the order in which they will be made.

use std::collections::BTreeSet;
use std::fmt;

use calibench::cell::guards::Forbidden;
use calibench::measure::campaign::cell::Cell;
use calibench::measure::poses::{PlannedPose, ProbingPlan};
use calibench::measure::session::{self, PlannedWay, WayPurpose, off_its_ball};
use calibench::robot::solids::Clearance;

/// What a motion is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Phase {
    /// To an intermediate point.
    Way,
    /// To the approach of a pose.
    Approach,
    /// Onto the ball.
    Contact,
    /// Off the ball, back to the approach.
    Retreat,
    /// To the posture in which the gauge is mastered.
    Mastering,
    /// To an intermediate point on the way home.
    Homeward,
    /// To the home posture.
    Home,
}

impl fmt::Display for Phase {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Phase::Way => "way",
            Phase::Approach => "approach",
            Phase::Contact => "contact",
            Phase::Retreat => "retreat",
            Phase::Mastering => "mastering",
            Phase::Homeward => "way home",
            Phase::Home => "home",
        })
    }
}

/// A motion of the plan: all joints from one posture to the next.
#[derive(Debug, Clone)]
pub struct Rehearsed {
    /// Id of the pose to or from which it leads; empty for the way to the mastering.
    pub pose: String,
    /// True if it is made only in case: onto a reserve, or home from a pose after which the campaign stops.
    pub spare: bool,
    /// The ball of that pose, by its index in the artifact.
    pub ball: Option<usize>,
    /// What it is for.
    pub phase: Phase,
    /// Joints at its beginning, rad (N); those at its end if the arm may come from anywhere.
    pub from: Vec<f64>,
    /// Joints at its end, rad (N).
    pub to: Vec<f64>,
    /// The narrowest gap on it, m, to half a millimetre; `None` if the bodies in the cell are not known.
    pub clearance: Option<Clearance>,
    /// Why the guards of the cell forbid it.
    pub forbidden: Option<Forbidden>,
    /// Why its contact is not one of the ball of its pose.
    pub off_its_ball: Option<String>,
}

impl Rehearsed {
    /// True if two bodies touch on it.
    pub fn touches(&self) -> bool {
        self.clearance.as_ref().is_some_and(Clearance::is_contact)
    }

    /// Where in the plan it is.
    pub(super) fn place(&self) -> String {
        match (self.phase, self.pose.as_str()) {
            (Phase::Contact, pose) => format!("onto the ball of '{pose}'"),
            (Phase::Retreat, pose) => format!("off the ball of '{pose}'"),
            (Phase::Mastering, _) => "on the way to the mastering".into(),
            (Phase::Home | Phase::Homeward, "") => "on the way from the mastering".into(),
            (Phase::Home | Phase::Homeward, pose) => format!("on the way home from '{pose}'"),
            (_, "") => "on the way to the mastering".into(),
            (_, pose) => format!("on the way to '{pose}'"),
        }
    }

    /// Why it must not be made, if so.
    pub fn wrong(&self) -> Option<String> {
        let touches = || {
            let [a, b] = &self.clearance.as_ref().filter(|_| self.touches())?.between;
            Some(format!("{a} and {b} touch"))
        };
        let forbidden = self.forbidden.map(|why| format!("FORBIDDEN: {why}"));
        forbidden.or_else(|| self.off_its_ball.clone()).or_else(touches)
    }

    /// The largest angle by which a joint turns, rad.
    pub fn turn(&self) -> f64 {
        self.from.iter().zip(&self.to).map(|(a, b)| (b - a).abs()).fold(0.0, f64::max)
    }
}

/// The motions of a plan: the gauge is mastered first where the plan has a place for it, and the arm goes home before another
/// payload is mounted and at the end. After them those that may be needed: reserves, from home and back, and the ways home from
/// all other poses.
pub(super) fn motions(cell: &Cell, plan: &ProbingPlan) -> Vec<Rehearsed> {
    let made: Vec<&PlannedPose> = plan.poses.iter().filter(|pose| !pose.reserve).collect();
    // After the last pose with a payload the arm goes home in any case.
    let is_last = |(k, pose): &(usize, &&PlannedPose)| made.get(k + 1).is_none_or(|next| next.payload != pose.payload);
    let last: BTreeSet<&str> = made.iter().enumerate().filter(is_last).map(|(_, pose)| pose.id.as_str()).collect();
    let (mut first, mut main, mut reserves, mut home) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for planned in session::motions(plan) {
        let list = match (planned.pose, planned.purpose) {
            (None, _) => &mut first,
            (Some(pose), _) if pose.reserve => &mut reserves,
            (Some(pose), WayPurpose::Home) if !last.contains(pose.id.as_str()) => &mut home,
            _ => &mut main,
        };
        add(list, cell, &planned);
    }
    let spare = reserves.into_iter().chain(home).map(|motion| Rehearsed { spare: true, ..motion });
    first.into_iter().chain(main).chain(spare).collect()
}

/// Adds the motions of a way; of one that is gone back, there and back.
fn add(to: &mut Vec<Rehearsed>, cell: &Cell, planned: &PlannedWay<'_>) {
    let (between, last) = match planned.purpose {
        WayPurpose::Approach => (Phase::Way, Phase::Approach),
        WayPurpose::Contact => (Phase::Way, Phase::Contact),
        WayPurpose::Home => (Phase::Homeward, Phase::Home),
        WayPurpose::Mastering => (Phase::Way, Phase::Mastering),
    };
    let mut go = |way: &[Vec<f64>], between: Phase, last: Phase| {
        for (k, leg) in way.windows(2).enumerate() {
            let phase = if k + 2 == way.len() { last } else { between };
            to.push(Rehearsed {
                pose: planned.pose.map(|pose| pose.id.clone()).unwrap_or_default(),
                spare: false,
                ball: planned.pose.and_then(|pose| pose.ball),
                phase,
                from: leg[0].clone(),
                to: leg[1].clone(),
                clearance: None,
                forbidden: cell.guards.joint_motion(&leg[0], &leg[1]).err(),
                off_its_ball: planned.pose.filter(|_| phase == Phase::Contact).and_then(|pose| off_its_ball(cell, pose)),
            });
        }
    };
    go(&planned.way, between, last);
    let back: Vec<Vec<f64>> = planned.way.iter().rev().cloned().collect();
    match planned.purpose {
        WayPurpose::Contact => go(&back, Phase::Way, Phase::Retreat),
        WayPurpose::Mastering => go(&back, Phase::Homeward, Phase::Home),
        WayPurpose::Approach | WayPurpose::Home => {}
    }
}
