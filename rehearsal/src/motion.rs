//! The motions of a plan, in the order in which they will be made.

use std::fmt;

use calibench::cell::guards::Forbidden;
use calibench::measure::poses::ways::HomeWays;
use calibench::measure::poses::{PlannedPose, ProbingPlan};
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
    /// Joints at its beginning, rad (N); `None` if the arm may come from anywhere.
    pub from: Option<Vec<f64>>,
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
    /// Both ends, rad. Of a motion from anywhere only its end is known.
    pub fn ends(&self) -> [&[f64]; 2] {
        [self.from.as_deref().unwrap_or(&self.to), &self.to]
    }

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
        let [from, to] = self.ends();
        from.iter().zip(to).map(|(a, b)| (b - a).abs()).fold(0.0, f64::max)
    }
}

/// Motions in the making.
struct Sequence {
    motions: Vec<Rehearsed>,
    at: Option<Vec<f64>>,
    spare: bool,
}

impl Sequence {
    fn go(&mut self, pose: Option<&PlannedPose>, phase: Phase, to: &[f64]) {
        let motion = Rehearsed {
            pose: pose.map(|pose| pose.id.clone()).unwrap_or_default(),
            spare: self.spare,
            ball: pose.map(|pose| pose.ball),
            phase,
            from: self.at.take(),
            to: to.to_vec(),
            clearance: None,
            forbidden: None,
            off_its_ball: None,
        };
        self.at = Some(to.to_vec());
        self.motions.push(motion);
    }

    fn probe(&mut self, pose: &PlannedPose) {
        pose.via.iter().for_each(|q| self.go(Some(pose), Phase::Way, q));
        self.go(Some(pose), Phase::Approach, &pose.approach);
        self.go(Some(pose), Phase::Contact, &pose.contact);
        self.go(Some(pose), Phase::Retreat, &pose.approach);
    }

    fn go_home(&mut self, ways: Option<&HomeWays>, from: &PlannedPose) {
        let back = ways.map(|ways| ways.home_from(&from.id)).unwrap_or_default();
        let Some((home, via)) = back.split_last() else { return };
        via.iter().for_each(|q| self.go(Some(from), Phase::Homeward, q));
        self.go(Some(from), Phase::Home, home);
    }
}

/// The motions of a plan: the gauge is mastered first where the plan has a place for it, and the arm goes home before another
/// payload is mounted and at the end. After them those that may be needed: reserves, from home and back, and the ways home from
/// all other poses.
pub(super) fn motions(plan: &ProbingPlan) -> Vec<Rehearsed> {
    let ways = plan.ways.as_ref();
    let home = || ways.map(|ways| ways.home.clone());
    let mut sequence = Sequence { motions: Vec::new(), at: home(), spare: false };
    if let Some((ways, place)) = ways.and_then(|ways| Some((ways, ways.mastering.as_ref()?))) {
        let via = &place.way.via;
        via.iter().for_each(|q| sequence.go(None, Phase::Way, q));
        sequence.go(None, Phase::Mastering, &place.q);
        via.iter().rev().for_each(|q| sequence.go(None, Phase::Homeward, q));
        sequence.go(None, Phase::Home, &ways.home);
    }
    let mut before: Option<&PlannedPose> = None;
    let mut stops_early: Vec<&PlannedPose> = Vec::new();
    for pose in plan.poses.iter().filter(|pose| !pose.reserve) {
        if let Some(last) = before {
            if last.payload == pose.payload {
                stops_early.push(last);
            } else {
                sequence.go_home(ways, last);
            }
        }
        sequence.probe(pose);
        before = Some(pose);
    }
    if let Some(last) = before {
        sequence.go_home(ways, last);
    }
    sequence.spare = true;
    for pose in plan.poses.iter().filter(|pose| pose.reserve) {
        sequence.at = home();
        sequence.probe(pose);
        sequence.go_home(ways, pose);
    }
    for pose in stops_early {
        sequence.at = Some(pose.approach.clone());
        sequence.go_home(ways, pose);
    }
    sequence.motions
}
