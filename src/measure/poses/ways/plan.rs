//! The ways of a whole plan: from every pose home and back, and from pose to pose.

use std::collections::BTreeMap;

use nalgebra::{Unit, Vector3};
use thiserror::Error;

use super::home::home_postures;
use super::polyline::turn;
use super::request::WayRequest;
use super::{Blocked, Way, WayFinder};
use crate::measure::poses::PlannedPose;
use crate::robot::kinematics::world_from_tool;
use crate::robot::solids::Clearance;
use crate::robot::{FramePose, Robot};
use crate::units::DEG;

/// Position of the arm in a campaign, as far as its ways know it.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub enum ArmAt {
    /// Anywhere: no path from there is known.
    #[default]
    Unknown,
    /// At the home posture.
    Home,
    /// At the approach of the pose of this id.
    Approach(String),
}

/// Where the gauge is mastered.
#[derive(Debug, Clone, PartialEq)]
pub struct MasteringPlace {
    /// Posture with the socket upwards, rad (N).
    pub q: Vec<f64>,
    /// The way there from home.
    pub way: Way,
}

/// The ways from home. Those from pose to pose are in the poses themselves.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct HomeWays {
    /// The home posture, rad (N).
    pub home: Vec<f64>,
    /// Where the gauge is mastered; `None` if no posture for it is clear.
    pub mastering: Option<MasteringPlace>,
    /// From home to the approach of each pose, by its id.
    pub to: BTreeMap<String, Way>,
}

impl HomeWays {
    /// The joints on the path from the approach of one pose to that of another, through home; both ends excluded, rad.
    ///
    /// ```
    /// use std::collections::BTreeMap;
    ///
    /// use calibench::measure::poses::ways::{HomeWays, Way};
    ///
    /// let way = |via: &[f64]| Way { via: via.iter().map(|&q| vec![q]).collect(), narrowest: None };
    /// let to = BTreeMap::from([("a".to_owned(), way(&[1.0, 2.0])), ("b".to_owned(), way(&[5.0]))]);
    /// let ways = HomeWays { home: vec![0.0], mastering: None, to };
    /// // Back along the way to `a`, through home, out along the way to `b`.
    /// assert_eq!(ways.between("a", "b"), [[2.0], [1.0], [0.0], [5.0]]);
    /// ```
    pub fn between(&self, from: &str, to: &str) -> Vec<Vec<f64>> {
        [self.home_from(from), self.from_home(to).to_vec()].concat()
    }

    /// The joints on the path from the approach of a pose to home, the approach excluded, rad.
    pub fn home_from(&self, from: &str) -> Vec<Vec<f64>> {
        let back = self.from_home(from).iter().rev().cloned();
        back.chain([self.home.clone()]).collect()
    }

    /// The joints on the path from home to the approach of a pose, both excluded, rad.
    pub fn from_home(&self, to: &str) -> &[Vec<f64>] {
        self.to.get(to).map_or(&[], |way| &way.via)
    }
}

/// Reason why a plan has no ways.
#[derive(Debug, Error, Clone, PartialEq)]
#[non_exhaustive]
pub enum WaysError {
    /// No posture of the arm is clear by the margin.
    #[error("no posture of the arm is clear of everything, from which its ways could begin")]
    NoHome,
    /// Some poses cannot be reached without contact; there is at least one.
    #[error("{}", .0.iter().take(3).map(ToString::to_string).collect::<Vec<_>>().join("; "))]
    Blocked(Vec<BlockedPose>),
}

/// A pose to which no clear way is found.
#[derive(Debug, Error, Clone, PartialEq)]
#[error("pose '{pose}'{} cannot be reached: {why}", ball.as_ref().map_or(String::new(), |ball| format!(" at {ball}")))]
pub struct BlockedPose {
    /// Its id.
    pub pose: String,
    /// The body of its ball, if it has one.
    pub ball: Option<String>,
    /// The obstruction.
    pub why: Blocked,
}

/// Largest number of unreachable poses before a home is rejected.
const MOST_BLOCKED: usize = 8;

/// Largest tilt of the socket that still holds the master ball, rad off the vertical.
const UPRIGHT: f64 = 10.0 * DEG;

/// Finds the ways of `poses`: those from home, and that of each pose from the preceding one, which is written into the pose.
/// Reserves are reached from home. `bodies` are the names of the balls' own bodies, which the gauge may touch; `socket` is the
/// opening's direction in the axes of the tool.
///
/// # Errors
/// [`WaysError`]: every pose that has no way, by its id.
pub fn plan_ways(
    request: WayRequest<'_>,
    bodies: &[String],
    socket: &Unit<Vector3<f64>>,
    poses: &mut [PlannedPose],
) -> Result<HomeWays, WaysError> {
    let approaches: Vec<&[f64]> = poses.iter().map(|p| p.approach.as_slice()).collect();
    let homes = home_postures(&request, &approaches);
    let mut least_blocked: Option<Vec<BlockedPose>> = None;
    // A home from which all are reached as they are comes before one that needs other turns of a joint.
    for (home, may_turn) in [false, true].into_iter().flat_map(|may_turn| homes.iter().map(move |home| (home, may_turn))) {
        let mut finder = WayFinder::new(request, home.clone());
        let mut to = BTreeMap::new();
        let mut blocked = Vec::new();
        for pose in poses.iter_mut() {
            let way = match finder.home_from(&pose.approach) {
                Err(_) if may_turn => by_another_turn(&mut finder, pose),
                way => way.map(reversed),
            };
            match way {
                Ok(way) => drop(to.insert(pose.id.clone(), way)),
                Err(why) => blocked.push(blocked_pose(pose, bodies, why)),
            }
            // Another home may reach more.
            if blocked.len() > MOST_BLOCKED {
                break;
            }
        }
        if blocked.is_empty() {
            let mut ways = HomeWays { home: home.clone(), mastering: None, to };
            blocked = join(&mut finder, &ways, bodies, poses);
            if blocked.is_empty() {
                ways.mastering = mastering(&mut finder, &request, socket, &ways.home);
                return Ok(ways);
            }
        }
        if least_blocked.as_ref().is_none_or(|least| blocked.len() < least.len()) {
            least_blocked = Some(blocked);
        }
    }
    Err(least_blocked.map_or(WaysError::NoHome, WaysError::Blocked))
}

/// The way from home to a pose at other whole turns of its joints, which are written into the pose.
fn by_another_turn(finder: &mut WayFinder<'_>, pose: &mut PlannedPose) -> Result<Way, Blocked> {
    let home = finder.home().to_vec();
    let (reached, way) = finder.to_any_turn(&home, &pose.approach)?;
    for (joint, angle) in reached.into_iter().enumerate() {
        pose.contact[joint] += angle - pose.approach[joint];
        pose.approach[joint] = angle;
    }
    Ok(way)
}

fn blocked_pose(pose: &PlannedPose, bodies: &[String], why: Blocked) -> BlockedPose {
    BlockedPose { pose: pose.id.clone(), ball: pose.ball.and_then(|ball| bodies.get(ball)).cloned(), why }
}

fn reversed(way: Way) -> Way {
    Way { via: way.via.into_iter().rev().collect(), ..way }
}

/// Writes into every pose its path from the preceding one, from home for the first; returns the poses that cannot be reached.
fn join(finder: &mut WayFinder<'_>, ways: &HomeWays, bodies: &[String], poses: &mut [PlannedPose]) -> Vec<BlockedPose> {
    let mut blocked = Vec::new();
    let mut before: Option<(String, Vec<f64>, usize)> = None;
    for pose in poses.iter_mut() {
        let from_home = ways.to.get(&pose.id).cloned().unwrap_or_default();
        let body = pose.ball.and_then(|ball| bodies.get(ball)).and_then(|name| finder.fixed_named(name));
        let onto = finder.narrowest(&pose.approach, &pose.contact, body).map(|n| n.clearance);
        if onto.as_ref().is_some_and(|gap| gap.distance <= 0.0) {
            blocked.push(blocked_pose(pose, bodies, Blocked { narrowest: onto }));
            continue;
        }
        // Another payload is mounted at home.
        let way = match before.as_ref().filter(|(.., payload)| !pose.reserve && *payload == pose.payload) {
            None => from_home.clone(),
            Some((id, from, _)) => {
                let home_from = ways.to.get(id).cloned().map(reversed).unwrap_or_default();
                let home_to = reversed(from_home.clone());
                match finder.between(from, &home_from, &pose.approach, &home_to) {
                    Ok(way) => way,
                    Err(why) => {
                        blocked.push(blocked_pose(pose, bodies, why));
                        continue;
                    }
                }
            }
        };
        pose.clearance = narrower(way.narrowest.as_ref(), onto.as_ref()).map(|gap| gap.distance);
        pose.via = way.via;
        if !pose.reserve {
            before = Some((pose.id.clone(), pose.approach.clone(), pose.payload));
        }
    }
    blocked
}

fn narrower<'c>(a: Option<&'c Clearance>, b: Option<&'c Clearance>) -> Option<&'c Clearance> {
    match (a, b) {
        (Some(a), Some(b)) => Some(if b.distance < a.distance { b } else { a }),
        (a, b) => a.or(b),
    }
}

/// A posture near home in which the socket opens upwards, and the way there: home with its last three joints turned.
fn mastering(
    finder: &mut WayFinder<'_>,
    request: &WayRequest<'_>,
    socket: &Unit<Vector3<f64>>,
    home: &[f64],
) -> Option<MasteringPlace> {
    let WayRequest { robot, base, tool, .. } = *request;
    let mut upright: Vec<Vec<f64>> =
        turned_wrists(robot, home).filter(|q| tilt(robot, base, tool, q, socket) < UPRIGHT).collect();
    upright.sort_by(|a, b| turn(home, a).total_cmp(&turn(home, b)));
    upright.into_iter().take(MOST_TRIED).find_map(|q| {
        let way = finder.home_from(&q).ok()?;
        Some(MasteringPlace { q, way: reversed(way) })
    })
}

/// Maximum number of postures tried for mastering.
const MOST_TRIED: usize = 12;

/// The angle between the socket's opening and the vertical, rad.
fn tilt(robot: &Robot, base: &FramePose, tool: &FramePose, q: &[f64], socket: &Unit<Vector3<f64>>) -> f64 {
    (world_from_tool(robot, base, tool, q).rotation * socket.into_inner()).angle(&Vector3::z())
}

/// Home with its last three joints at every 15 degrees of their ranges.
fn turned_wrists<'r>(robot: &'r Robot, home: &'r [f64]) -> impl Iterator<Item = Vec<f64>> + 'r {
    let step = 15.0 * DEG;
    let angles = move |joint: usize| {
        let [low, high] = robot.links[joint].limits;
        let count = ((high - low) / step).min(24.0) as usize;
        (0..=count).map(move |k| low + k as f64 * step)
    };
    let first = robot.joints().saturating_sub(3);
    angles(first).flat_map(move |a| {
        angles(first + 1).flat_map(move |b| angles(robot.joints() - 1).map(move |c| [&home[..first], &[a, b, c]].concat()))
    })
}
