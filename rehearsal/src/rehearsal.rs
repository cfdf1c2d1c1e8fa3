//! The whole plan, gone through.

use std::collections::BTreeMap;

use calibench::cell::RobotSettings;
use calibench::measure::campaign::cell::Cell;
use calibench::measure::poses::ProbingPlan;
use calibench::robot::statics::Payload;
use calibench::units::{DEG, MM};

use crate::bodies::{LeastGap, find_gaps};
use crate::motion::{Phase, Rehearsed, motions};

/// A difference between the gap of a plan and that of the present scene that no tolerance explains, m: each is known to half a
/// millimetre.
const OTHER_SCENE: f64 = 1.0 * MM;

/// Speeds of the leading joint for which a time is given where the controller's is not known, rad/s.
const SPEEDS: [f64; 3] = [5.0 * DEG, 15.0 * DEG, 60.0 * DEG];

/// The motions of a plan as they will be made, with all that is known of them.
#[derive(Debug, Clone)]
pub struct Rehearsal {
    /// The motions in their order, then those that may be needed.
    pub motions: Vec<Rehearsed>,
    /// Number of probings, or of points.
    pub probings: usize,
    /// Number of poses that are probed only in place of others.
    pub reserves: usize,
    /// The least gap of every body of the arm, the smallest first; empty if the bodies in the cell are not known.
    pub gaps: Vec<LeastGap>,
    /// The least gap that the plan states.
    pub planned: Option<PlannedGap>,
    /// Poses whose gap is no longer that of the plan.
    pub changed: Vec<ChangedGap>,
    /// How long the motions take.
    pub times: Vec<MotionTime>,
    /// True if the plan holds ways.
    pub has_ways: bool,
    /// A sentence that tells of another payload than that of the plan, if the controller will be told one.
    pub other_payload: Option<String>,
}

/// The gap that a plan states for a pose: of the way to it and of the approach.
#[derive(Debug, Clone, PartialEq)]
pub struct PlannedGap {
    /// Id of the pose.
    pub pose: String,
    /// The gap, m.
    pub gap: f64,
}

/// A gap that is no longer that of the plan.
#[derive(Debug, Clone, PartialEq)]
pub struct ChangedGap {
    /// As it was planned.
    pub planned: PlannedGap,
    /// The gap in the present scene, m; not more than zero if bodies overlap.
    pub now: f64,
}

/// The time of all motions, without the centrings.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MotionTime {
    /// Speed of the joint that turns most, rad/s.
    pub speed: f64,
    /// The time, s.
    pub time: f64,
}

impl Rehearsal {
    /// Goes through a plan in a cell. Nothing is connected to.
    pub fn of(cell: &Cell, plan: &ProbingPlan) -> Self {
        let mut motions = motions(cell, plan);
        let gaps = cell.surroundings.as_ref().map(|bodies| find_gaps(cell, bodies, &mut motions)).unwrap_or_default();
        let planned = planned_gaps(plan).min_by(|a, b| a.gap.total_cmp(&b.gap));
        Rehearsal {
            probings: plan.wanted(),
            reserves: plan.poses.len() - plan.wanted(),
            changed: changed(plan, &motions),
            times: times(cell, &motions),
            has_ways: plan.ways.is_some(),
            other_payload: other_payload(cell, plan),
            motions,
            gaps,
            planned,
        }
    }

    /// The motions, counted, in words.
    pub fn count(&self) -> String {
        let spare = self.motions.iter().filter(|motion| motion.spare).count();
        let made = self.motions.len() - spare;
        if spare == 0 {
            return many(made, "motion");
        }
        let reserves = if self.reserves == 0 { String::new() } else { many(self.reserves, "reserve") + " and " };
        format!("{}, and {spare} that may be needed, of {reserves}ways home", many(made, "motion"))
    }

    /// Number of motions that the guards of the cell forbid.
    pub fn forbidden(&self) -> usize {
        self.motions.iter().filter(|motion| motion.forbidden.is_some()).count()
    }

    /// Number of contacts that are not of the balls of their poses.
    pub fn off_their_balls(&self) -> usize {
        self.motions.iter().filter(|motion| motion.off_its_ball.is_some()).count()
    }

    /// Number of motions on which two bodies touch.
    pub fn touching(&self) -> usize {
        self.motions.iter().filter(|motion| motion.touches()).count()
    }

    /// True if nothing that is known speaks against the plan.
    pub fn is_clear(&self) -> bool {
        self.forbidden() + self.off_their_balls() + self.touching() == 0
    }

    /// The least clearance, in a sentence.
    pub fn clearance_sentence(&self) -> String {
        match (self.gaps.first(), &self.planned) {
            (Some(LeastGap { body, other, gap, motion }), _) => {
                let motion = &self.motions[*motion];
                if motion.touches() {
                    return format!("there is no clearance {}: {body} and {other} touch", motion.place());
                }
                format!("the least clearance is {:.1} mm, {}: {body} and {other}", gap / MM, motion.place())
            }
            (None, Some(PlannedGap { pose, gap })) => format!(
                "the least clearance is {:.1} mm, of '{pose}', as the plan says: the cell file names no bodies, so that it is not checked here",
                gap / MM
            ),
            (None, None) => "the plan does not say how clear its motions are: plan with `calibench plan CELL`".into(),
        }
    }

    /// True if balls are probed; false if points are measured.
    pub fn probes(&self) -> bool {
        self.motions.iter().any(|motion| motion.ball.is_some())
    }

    /// The whole in a sentence or two.
    pub fn verdict(&self) -> String {
        let probings = format!("{} in {}", many(self.probings, if self.probes() { "probing" } else { "point" }), self.count());
        let against = [
            (self.forbidden(), "forbidden by the guards of the cell"),
            (self.off_their_balls(), "onto no ball"),
            (self.touching(), "with bodies that touch"),
        ];
        let against: Vec<String> =
            against.iter().filter(|(count, _)| *count > 0).map(|(count, what)| format!("{count} {what}")).collect();
        if against.is_empty() {
            return format!("{probings}; {}.", self.clearance_sentence());
        }
        format!("{probings}. Of the motions, {}; {}.", against.join(", "), self.clearance_sentence())
    }

    /// What does not forbid the plan but should be known, in sentences.
    pub fn warnings(&self) -> Vec<String> {
        let narrower = |changed: &ChangedGap| changed.planned.gap - changed.now;
        let worst = self.changed.iter().max_by(|a, b| narrower(a).total_cmp(&narrower(b)));
        let told = worst.map(|ChangedGap { planned: PlannedGap { pose, gap }, now }| {
            let now = if *now > 0.0 { format!("{:.1} mm", now / MM) } else { "none".into() };
            format!(
                "The clearance of {} is not that of the plan: scene, dataset or plan have changed since it was made. That of '{pose}' was {:.1} mm and is now {now}. Plan again with `calibench plan CELL`.",
                many(self.changed.len(), "pose"),
                gap / MM
            )
        });
        let direct =
            "The plan holds no ways: the arm moves directly from pose to pose, and nothing is known of the way to the first.";
        let direct = (!self.has_ways).then(|| direct.to_owned());
        direct.into_iter().chain(self.other_payload.clone()).chain(told).collect()
    }
}

/// The gaps that a plan states.
fn planned_gaps(plan: &ProbingPlan) -> impl Iterator<Item = PlannedGap> {
    plan.poses.iter().filter_map(|pose| Some(PlannedGap { pose: pose.id.clone(), gap: pose.clearance? }))
}

/// Poses with another gap than that of the plan.
fn changed(plan: &ProbingPlan, motions: &[Rehearsed]) -> Vec<ChangedGap> {
    let mut least: BTreeMap<&str, f64> = BTreeMap::new();
    for motion in motions.iter().filter(|motion| !matches!(motion.phase, Phase::Homeward | Phase::Home)) {
        if let Some(gap) = &motion.clearance {
            let known = least.entry(&motion.pose).or_insert(f64::INFINITY);
            *known = known.min(gap.distance);
        }
    }
    let differs = |planned: PlannedGap| {
        let now = *least.get(planned.pose.as_str())?;
        // How deep an overlap is, is not known.
        let differs = (planned.gap - now).abs() > OTHER_SCENE && planned.gap.max(now) > 0.0;
        differs.then_some(ChangedGap { planned, now })
    };
    planned_gaps(plan).filter_map(differs).collect()
}

/// Times of the motions: at the speed that the driver orders, or at some where only the controller knows it.
fn times(cell: &Cell, motions: &[Rehearsed]) -> Vec<MotionTime> {
    let made = || motions.iter().filter(|motion| !motion.spare);
    let override_share = f64::from(cell.speed_percent) / 100.0;
    let total =
        |speed: f64, acceleration: f64| -> f64 { made().map(|motion| duration(motion.turn(), speed, acceleration)).sum() };
    match &cell.robot {
        RobotSettings::Ur(settings) => {
            // The override slows a motion down as a whole.
            let motion = settings.motion;
            let time = total(motion.joint_speed, motion.joint_acceleration) / override_share;
            vec![MotionTime { speed: motion.joint_speed * override_share, time }]
        }
        _ => SPEEDS.map(|speed| MotionTime { speed, time: total(speed, f64::INFINITY) }).to_vec(),
    }
}

/// Time of a motion that speeds up, goes on and slows down, s.
fn duration(turn: f64, speed: f64, acceleration: f64) -> f64 {
    let speeding_up = speed / acceleration;
    if turn >= speed * speeding_up { turn / speed + speeding_up } else { 2.0 * (turn / acceleration).sqrt() }
}

/// Largest difference of two masses that are the same, kg: the rounding of a pendant.
const SAME_MASS: f64 = 0.01;

/// Tells of a payload of the plan that is not that of which the controller is told.
fn other_payload(cell: &Cell, plan: &ProbingPlan) -> Option<String> {
    let RobotSettings::Ur(settings) = &cell.robot else { return None };
    let told = settings.payload.as_ref()?.mass;
    let mut carried = plan.poses.iter().filter_map(|pose| cell.dataset.payloads.get(pose.payload));
    let other = carried.find(|payload| (payload.mass - told).abs() > SAME_MASS)?;
    let Payload { name, mass, .. } = other;
    Some(format!("The plan carries the payload '{name}' of {mass:.3} kg, and the controller will be told {told:.3} kg."))
}

/// A count with its noun.
fn many(count: usize, noun: &str) -> String {
    format!("{count} {noun}{}", if count == 1 { "" } else { "s" })
}
