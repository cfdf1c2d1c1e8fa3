//! The repeatability of a simulated robot, measured with the gauge: the stations and the visits.
//!
//! The ground truth is not used here: the session supplies readings of indicators and encoders, and the library evaluates them.

use calibench::cell::{Manipulator, ManipulatorError};
use calibench::measure::campaign::repeatability::{RepeatabilitySettings, Station, StationRecord};
use calibench::measure::centring::ProbingFailure;
use calibench::measure::dataset::Dataset;
use calibench::measure::poses::PlannedPose;
use calibench::measure::poses::pool::Candidate;
use calibench::measure::poses::ways::WaysError;
use calibench::residuals::Repeatability;
use thiserror::Error;

use crate::planning::{PlanError, find_ways, pool};
use crate::plans::session_s;
use crate::random::Streams;
use crate::scenario::Scenario;
use crate::session::{Session, SessionError};
use crate::world::READING_S;

/// Size of the pool per ball from which stations are chosen: with this many, the weakest lever of the best choice is twice
/// that of a random choice.
const POOL_PER_BALL: usize = 200;

/// Reasons why no repeatability was obtained.
#[derive(Debug, Error)]
pub enum RepeatabilityError {
    /// A ball cannot be probed.
    #[error(transparent)]
    Plan(#[from] PlanError),
    /// A ball has fewer feasible postures than requested.
    #[error("{found} feasible postures were found on ball {ball}, {wanted} are required")]
    TooFewPostures {
        /// Name of the ball.
        ball: String,
        /// Postures found.
        found: usize,
        /// Postures requested.
        wanted: usize,
    },
    /// The session could not begin.
    #[error(transparent)]
    Session(#[from] SessionError),
    /// A visit ended early.
    #[error("going back to {station} ended early")]
    Visit {
        /// Name of the station.
        station: String,
        /// The reason.
        #[source]
        failure: ProbingFailure,
    },
}

/// Measured visits and their evaluation.
pub struct Visited {
    /// Records by station.
    pub records: Vec<StationRecord>,
    /// The repeatability evaluated from them.
    pub repeatability: Repeatability,
}

impl Visited {
    /// Evaluates these records.
    pub fn of(records: Vec<StationRecord>) -> Self {
        // The command line and every caller here request counts of two and more, which is all that is required.
        let repeatability =
            Repeatability::of(&records).unwrap_or(Repeatability { stations: Vec::new(), lost_motion: Vec::new() });
        Visited { records, repeatability }
    }
}

/// Chooses this many stations on each of these balls (by index), so that over all of them the joint that moves the TCP least
/// moves it as much as possible.
///
/// # Errors
/// When a ball cannot be probed in that many postures.
pub fn stations(scenario: &Scenario, balls: &[usize], postures: usize, seed: u64) -> Result<Vec<Station>, RepeatabilityError> {
    let cell = scenario.dataset();
    let pool = pool(scenario, balls, POOL_PER_BALL.max(postures), seed).map_err(PlanError::Pool)?;
    let station = |c: &Candidate| {
        let pose = PlannedPose {
            id: String::new(),
            ball: Some(balls[c.ball]),
            payload: 0,
            contact: c.q.clone(),
            approach: c.q_approach.clone(),
            reserve: false,
            reverses: None,
            via: Vec::new(),
            clearance: None,
        };
        Station::new(&cell.robot, &cell.base, &cell.tool, pose)
    };
    let mut reachable: Vec<Station> = pool.iter().map(station).collect();
    loop {
        let mut chosen = most_telling(&cell, reachable.clone(), balls, postures)?;
        chosen.iter_mut().enumerate().for_each(|(k, station)| station.pose.id = format!("s{:02}", k + 1));
        let mut poses: Vec<PlannedPose> = chosen.iter().map(|s| s.pose.clone()).collect();
        match find_ways(scenario, seed, None, &mut poses) {
            Ok(_) => {
                chosen.iter_mut().zip(poses).for_each(|(station, pose)| station.pose = pose);
                return Ok(chosen);
            }
            // A posture that cannot be reached is useless.
            Err(WaysError::Blocked(blocked)) => {
                let is_blocked =
                    |s: &Station| poses.iter().any(|p| p.contact == s.pose.contact && blocked.iter().any(|b| b.pose == p.id));
                reachable.retain(|s| !is_blocked(s));
            }
            Err(why) => return Err(PlanError::Ways(why).into()),
        }
    }
}

/// Chooses the stations over which the joint that moves the TCP least moves it as much as possible.
///
/// # Errors
/// When a ball has too few postures.
pub fn most_telling(
    cell: &Dataset,
    mut left: Vec<Station>,
    balls: &[usize],
    postures: usize,
) -> Result<Vec<Station>, RepeatabilityError> {
    let mut squares = vec![0.0; cell.robot.joints()];
    let mut chosen: Vec<Station> = Vec::new();
    for &ball in balls.iter().cycle().take(balls.len() * postures) {
        let weakest = |s: &Station| {
            let with = s.levers.iter().zip(&squares).map(|(lever, square)| lever.norm_squared() + square);
            with.fold(f64::INFINITY, f64::min)
        };
        let on_ball = left.iter().enumerate().filter(|(_, s)| s.pose.ball == Some(ball));
        let Some((best, _)) = on_ball.max_by(|a, b| weakest(a.1).total_cmp(&weakest(b.1))) else {
            let found = chosen.iter().filter(|s| s.pose.ball == Some(ball)).count();
            return Err(RepeatabilityError::TooFewPostures { ball: cell.balls[ball].id.clone(), found, wanted: postures });
        };
        let station = left.swap_remove(best);
        squares.iter_mut().zip(&station.levers).for_each(|(square, lever)| *square += lever.norm_squared());
        chosen.push(station);
    }
    Ok(chosen)
}

/// Masters the gauge of the scenario's cell and visits the stations in sequence.
///
/// # Errors
/// When the session cannot begin, or a visit ends early.
pub fn visit(
    scenario: &Scenario,
    streams: Streams,
    stations: &[Station],
    settings: &RepeatabilitySettings,
) -> Result<Visited, RepeatabilityError> {
    let session = Session::begin(scenario, streams, visits_s(scenario, stations, settings))?;
    let mut poses: Vec<PlannedPose> = stations.iter().map(|s| s.pose.clone()).collect();
    let ways = find_ways(scenario, streams.seed, None, &mut poses).map_err(PlanError::Ways)?;
    session.world().begin_at(&ways.home);
    let visit = |(station, pose): (&Station, &PlannedPose)| {
        let failed = |failure| RepeatabilityError::Visit { station: station.pose.id.clone(), failure };
        let lost = |error: ManipulatorError| failed(ProbingFailure { reason: error.into(), backed_off: false });
        session.world().robot().move_along(&pose.via).map_err(lost)?;
        session.revisit(station, settings).map_err(failed)
    };
    let records = stations.iter().zip(&poses).map(visit).collect::<Result<Vec<_>, _>>()?;
    Ok(Visited::of(records))
}

/// Approximate duration of the visits, s: the meaning of "by the end of the session" in a truth.
fn visits_s(scenario: &Scenario, stations: &[Station], settings: &RepeatabilitySettings) -> f64 {
    let poses: Vec<PlannedPose> = stations.iter().map(|s| s.pose.clone()).collect();
    let stop = scenario.truth().keys().controller.settle_s + 3.0 * READING_S;
    let joints = scenario.robot().joints();
    // There and back with some five stops in between, and four stops per reversal.
    let returns = (stations.len() * settings.returns * 6) as f64;
    let reversals = (stations.len() * settings.reversals * joints * 4) as f64;
    session_s(scenario, &poses, 0) + (returns + reversals) * stop
}
