//! Session at a real cell: nothing moves before the whole plan is permitted, the arm gets off the ball first, and the gauge is
//! mastered before it measures.

mod start_error;

pub use start_error::StartError;

use std::fmt;

use crate::cell::Manipulator;
use crate::cell::gauge::{CellGauge, PresetManner};
use crate::measure::campaign::cell::Cell;
use crate::measure::campaign::journal::JournalSession;
use crate::measure::campaign::mastering::{Attendant, master, still_mastered};
use crate::measure::dataset::Dataset;
use crate::measure::poses::ways::{
    ArmAt, HomeWays, MasteringPlace, NOMINAL_WITHIN, WayFinder, WayRequest, Whereabouts, whereabouts,
};
use crate::measure::poses::{PlannedPose, ProbingPlan};
use crate::robot::solids::{Clearance, Solid, SweptCheck};
use crate::units::{DEG, MM};

/// Seed of the search for a way home: the same position gives the same way.
const WAY_SEED: u64 = 1;

/// Distance of a ball from the TCP beyond which the gauge is clear of it, m: more than the retreats of plans, and half the
/// distance between balls.
const CLEAR_OF_BALLS: f64 = 50.0 * MM;

/// Checks that the guards permit every motion of a plan, and that none touches a body that the cell names now; nothing moves.
///
/// # Errors
/// The forbidden motions.
pub fn preflight(cell: &Cell, plan: &ProbingPlan) -> Result<(), StartError> {
    let Dataset { robot, base, tool, .. } = &cell.dataset;
    let mut swept = cell.surroundings.as_ref().map(|bodies| SweptCheck::new(robot, base, tool, bodies));
    let (mut forbidden, mut touching) = (Vec::new(), Vec::new());
    for motion in motions(plan) {
        let legs = || motion.way.windows(2).map(|leg| (&leg[0], &leg[1]));
        if let Some(why) = legs().find_map(|(from, to)| cell.guards.joint_motion(from, to).err()) {
            forbidden.push(format!("{motion}: {why}"));
        }
        if let (Some(pose), WayPurpose::Contact) = (motion.pose, motion.purpose)
            && let Some(why) = off_its_ball(cell, pose)
        {
            forbidden.push(format!("{motion}: {why}"));
        }
        let gap = swept.as_mut().and_then(|swept| {
            let ball = motion.ball.and_then(|k| swept.fixed_named(&Solid::ball_name(&cell.dataset.balls.get(k)?.id)));
            let gaps = legs().filter_map(|(from, to)| Some(swept.narrowest(from, to, f64::NEG_INFINITY, ball)?.clearance));
            gaps.min_by(|a, b| a.distance.total_cmp(&b.distance)).filter(Clearance::is_contact)
        });
        touching.extend(gap.map(|Clearance { between: [a, b], .. }| format!("{motion}: {a} and {b} touch")));
    }
    let gapless = plan.poses.iter().filter(|pose| pose.clearance.is_some_and(|gap| gap <= 0.0));
    forbidden.extend(gapless.map(|pose| format!("pose '{}' has no clearance", pose.id)));
    match (forbidden.is_empty(), touching.is_empty()) {
        (true, true) => Ok(()),
        (true, false) => Err(StartError::Touching { motions: touching }),
        (false, _) => Err(StartError::Forbidden { motions: forbidden }),
    }
}

/// Why a contact is not one of its ball, if so: beyond the gauge's range and the deviation of an arm that is not calibrated, the ball
/// meets anything but the plungers.
pub fn off_its_ball(cell: &Cell, pose: &PlannedPose) -> Option<String> {
    let ball = cell.dataset.balls.get(pose.ball?)?;
    let apart = (cell.guards.tcp(&pose.contact) - ball.position).norm();
    let far = apart > cell.trical.safe_range + NOMINAL_WITHIN;
    far.then(|| format!("the TCP is {:.1} mm from the centre of ball '{}'", apart / MM, ball.id))
}

/// A way of a plan.
#[derive(Debug, Clone, PartialEq)]
pub struct PlannedWay<'a> {
    /// The pose to or from which it leads; `None` for the mastering posture.
    pub pose: Option<&'a PlannedPose>,
    /// What it is for.
    pub purpose: WayPurpose,
    /// The ball that the gauge may touch on it, by its index in the artifact.
    pub ball: Option<usize>,
    /// The joints on it, both ends included, rad (N).
    pub way: Vec<Vec<f64>>,
}

/// What a way of a plan is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WayPurpose {
    /// To the approach of a pose, from that of the pose before or from home.
    Approach,
    /// From the approach onto the ball; back it is the same.
    Contact,
    /// From the approach home.
    Home,
    /// From home to the mastering posture; back it is the same.
    Mastering,
}

impl fmt::Display for PlannedWay<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let id = self.pose.map_or("", |pose| pose.id.as_str());
        match self.purpose {
            WayPurpose::Approach => write!(f, "the way to '{id}'"),
            WayPurpose::Contact => write!(f, "onto the ball of '{id}'"),
            WayPurpose::Home => write!(f, "the way home from '{id}'"),
            WayPurpose::Mastering => f.write_str("the way to the mastering"),
        }
    }
}

/// Every way of a plan: from pose to pose, onto each ball, and to and from home.
pub fn motions(plan: &ProbingPlan) -> Vec<PlannedWay<'_>> {
    let mut all = Vec::new();
    let mut before: Option<&PlannedPose> = None;
    for pose in &plan.poses {
        let of_pose = |purpose, way| PlannedWay { pose: Some(pose), purpose, ball: None, way };
        let comes_from = before.filter(|b| !pose.reserve && b.payload == pose.payload);
        let from = match (comes_from, &plan.ways) {
            (Some(before), _) => vec![before.approach.clone()],
            (None, Some(ways)) => vec![ways.home.clone()],
            (None, None) => Vec::new(),
        };
        let to = [from.as_slice(), &pose.via, std::slice::from_ref(&pose.approach)].concat();
        // The position of the arm before the first motion is unknown; then only its end is checked.
        let to = if to.len() == 1 { vec![to[0].clone(), to[0].clone()] } else { to };
        all.push(of_pose(WayPurpose::Approach, to));
        if pose.ball.is_some() {
            let onto = vec![pose.approach.clone(), pose.contact.clone()];
            all.push(PlannedWay { ball: pose.ball, ..of_pose(WayPurpose::Contact, onto) });
        }
        if let Some(ways) = &plan.ways {
            let home = [std::slice::from_ref(&pose.approach), ways.home_from(&pose.id).as_slice()].concat();
            all.push(of_pose(WayPurpose::Home, home));
        }
        if !pose.reserve {
            before = Some(pose);
        }
    }
    if let Some((ways, place)) = plan.ways.as_ref().and_then(|ways| Some((ways, ways.mastering.as_ref()?))) {
        let way = [std::slice::from_ref(&ways.home), place.way.via.as_slice(), std::slice::from_ref(&place.q)].concat();
        all.push(PlannedWay { pose: None, purpose: WayPurpose::Mastering, ball: None, way });
    }
    all
}

/// The motion from the arm's present position to one from which the plan has ways.
pub struct FirstMotion {
    way: Vec<Vec<f64>>,
    station: ArmAt,
    /// Message for the operator.
    pub words: Option<String>,
    /// True if it leads off a ball.
    pub is_off_a_ball: bool,
}

impl FirstMotion {
    /// Finds the motion from joints `q` (rad); nothing moves. Where the arm is on no motion of the plan, a path home is searched
    /// for among the bodies of the cell.
    ///
    /// # Errors
    /// If no clear path is known from there.
    pub fn from(cell: &Cell, plan: &ProbingPlan, q: &[f64]) -> Result<Self, StartError> {
        let model = &cell.dataset;
        let here = whereabouts(&plan.poses, plan.ways.as_ref(), &model.robot, &model.base, &model.tool, q);
        match (here, &plan.ways) {
            (Whereabouts::AtBall(k), _) => {
                let pose = &plan.poses[k];
                let ball = pose.ball.and_then(|ball| model.balls.get(ball)).map_or("", |b| b.id.as_str());
                let words = format!("The arm stands at ball '{ball}': it first backs off to the approach of '{}'.", pose.id);
                let way = vec![pose.approach.clone()];
                Ok(FirstMotion { way, station: ArmAt::Approach(pose.id.clone()), words: Some(words), is_off_a_ball: true })
            }
            (Whereabouts::OnWay(way, station), _) => Ok(FirstMotion { way, station, words: None, is_off_a_ball: false }),
            (Whereabouts::AtMastering, Some(ways)) => Ok(FirstMotion {
                way: ways.mastering.iter().flat_map(|place| place.way.via.iter().rev()).chain([&ways.home]).cloned().collect(),
                station: ArmAt::Home,
                words: None,
                is_off_a_ball: false,
            }),
            (Whereabouts::Unknown, Some(ways)) => path_home(cell, ways, q),
            (Whereabouts::AtMastering | Whereabouts::Unknown, None) => {
                let words = "The plan contains no ways: nothing is known of what the arm may touch between its poses.";
                Ok(FirstMotion { way: Vec::new(), station: ArmAt::Unknown, words: Some(words.into()), is_off_a_ball: false })
            }
        }
    }

    /// Makes the motion and returns the posture in which the arm then is.
    ///
    /// # Errors
    /// If the robot does not reach the target.
    pub fn make(self, robot: &mut impl Manipulator) -> Result<ArmAt, StartError> {
        robot.move_along(&self.way)?;
        Ok(self.station)
    }
}

/// Plans a path home from a position off all motions of the plan, among the bodies of the cell.
fn path_home(cell: &Cell, ways: &HomeWays, q: &[f64]) -> Result<FirstMotion, StartError> {
    let home: Vec<String> = ways.home.iter().map(|q| format!("{:.1}", q / DEG)).collect();
    let home = home.join(", ");
    let Some(bodies) = &cell.surroundings else { return Err(StartError::BodiesUnknown { file: cell.file.clone(), home }) };
    let request = WayRequest { guards: Some(&cell.guards), ..WayRequest::of(&cell.dataset, bodies, WAY_SEED) };
    match WayFinder::new(request, ways.home.clone()).home_from(q) {
        Ok(way) => Ok(FirstMotion {
            way: [way.via.as_slice(), std::slice::from_ref(&ways.home)].concat(),
            station: ArmAt::Home,
            words: Some("The arm is on no motion of the plan: it first goes to the home posture.".into()),
            is_off_a_ball: false,
        }),
        Err(blocked) => Err(StartError::Blocked { blocked, home }),
    }
}

/// State of the gauge known before a session.
pub struct GaugeState<'a> {
    /// The previous session, if any.
    pub session: Option<&'a JournalSession>,
    /// True if the operator states that the gauge is mastered.
    pub mastered: bool,
    /// True if robot, artifact or gauge were moved since.
    pub moved: bool,
}

/// The devices of a cell that a session uses.
pub struct Devices<'a, M> {
    /// The robot.
    pub robot: &'a mut M,
    /// The indicators of the tool's x, y and z axis.
    pub gauges: &'a mut [CellGauge; 3],
}

/// Makes the first motion and ensures that the gauge is mastered: off a ball first, since a gauge is checked and preset by
/// readings without contact. If no questions are asked, the master ball lies in the socket from the start, and the gauge is
/// mastered before the arm moves.
///
/// # Errors
/// Those of [`FirstMotion::make`]; if an indicator fails, or if the gauge must be mastered and may touch a ball.
pub fn start_session<M: Manipulator>(
    cell: &Cell,
    plan: &ProbingPlan,
    first: FirstMotion,
    before: &GaugeState<'_>,
    attendant: &mut impl Attendant,
    devices: Devices<'_, M>,
) -> Result<(JournalSession, ArmAt), StartError> {
    if attendant.asks_nobody() && before.session.is_none() && !first.is_off_a_ball {
        let Devices { robot, gauges } = devices;
        let (session, _) = ensure_mastered(cell, plan, before, attendant, Devices { robot: &mut *robot, gauges }, None)?;
        return Ok((session, first.make(robot)?));
    }
    let stands = first.make(devices.robot)?;
    ensure_mastered(cell, plan, before, attendant, devices, Some(stands))
}

/// Begins a session with the arm clear of balls: the gauge is still mastered, or is mastered again at the plan's mastering
/// posture, or in place with the master ball in its socket if nothing has moved yet (`stands` is `None`). Returns the posture in
/// which the arm then is.
///
/// # Errors
/// If an indicator fails, or if the gauge must be mastered and may touch a ball.
fn ensure_mastered<M: Manipulator>(
    cell: &Cell,
    plan: &ProbingPlan,
    before: &GaugeState<'_>,
    attendant: &mut impl Attendant,
    devices: Devices<'_, M>,
    stands: Option<ArmAt>,
) -> Result<(JournalSession, ArmAt), StartError> {
    let Devices { robot, gauges } = devices;
    let here = stands.is_none();
    let stands = stands.unwrap_or(ArmAt::Unknown);
    let known = before.session.map(|session| &session.mastering);
    let forgetful = cell.indicators.iter().flatten().position(|i| i.settings.dialect.preset == PresetManner::Driver);
    let now = robot.clock_s();
    let kept = |gauges: &mut [CellGauge; 3]| still_mastered(gauges, known, &cell.trical, &cell.mastering, || now);
    let (mastering, mastering_kept, stands) = match forgetful {
        Some(axis) if before.mastered => return Err(StartError::KeepsNoPreset { axis }),
        None if before.mastered => (kept(gauges)?, before.session.is_some(), stands),
        None if before.session.is_some()
            && let Ok(mastering) = kept(gauges) =>
        {
            (mastering, true, stands)
        }
        _ => {
            let there = plan.ways.as_ref().filter(|_| !here).and_then(|ways| Some((ways, ways.mastering.as_ref()?)));
            match there {
                Some((ways, place)) => to_mastering(ways, place, robot, &stands)?,
                None => clear_of_balls(cell, robot)?,
            }
            let mastering = master(gauges, attendant, &cell.trical, &cell.mastering, || now)?;
            let stands = match there {
                Some((ways, place)) => {
                    let back: Vec<Vec<f64>> = place.way.via.iter().rev().chain([&ways.home]).cloned().collect();
                    robot.move_along(&back)?;
                    ArmAt::Home
                }
                None => stands,
            };
            (mastering, false, stands)
        }
    };
    let number = before.session.map_or(1, |session| session.number + usize::from(before.moved));
    Ok((JournalSession { number, mastering_kept, ..JournalSession::first(mastering) }, stands))
}

/// Goes to the mastering posture.
fn to_mastering(
    ways: &HomeWays,
    place: &MasteringPlace,
    robot: &mut impl Manipulator,
    stands: &ArmAt,
) -> Result<(), StartError> {
    let home = match stands {
        ArmAt::Approach(id) => ways.home_from(id),
        ArmAt::Home | ArmAt::Unknown => Vec::new(),
    };
    let to = [home.as_slice(), place.way.via.as_slice(), std::slice::from_ref(&place.q)].concat();
    Ok(robot.move_along(&to)?)
}

/// Checks that the gauge is clear of every ball: a preset written while a plunger touches one shifts all later measurements.
fn clear_of_balls(cell: &Cell, robot: &mut impl Manipulator) -> Result<(), StartError> {
    let tcp = cell.guards.tcp(&robot.joints()?);
    match cell.dataset.balls.iter().find(|ball| (ball.position - tcp).norm() < CLEAR_OF_BALLS) {
        Some(ball) => Err(StartError::NearBall { ball: ball.id.clone() }),
        None => Ok(()),
    }
}

/// The guards of a cell as conditions of a campaign.
pub fn guard_conditions(cell: &Cell) -> serde_json::Value {
    let workspace = cell.guards.workspace.map(|corners| corners.map(|c| [c.x / MM, c.y / MM, c.z / MM]));
    serde_json::json!({
        "joint_margin_deg": cell.guards.joint_margin / DEG,
        "max_step_mm": cell.guards.max_step / MM,
        "workspace_mm": workspace,
    })
}
