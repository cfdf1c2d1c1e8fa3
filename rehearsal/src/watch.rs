//! A measurement while it runs: what the arm does now, how each ball was centred, how far the nominal arm is off, and a request to
//! stop.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use calibench::cell::StopRequest;
use calibench::math::rigid_fit;
use calibench::measure::campaign::{CampaignObserver, Progress};
use calibench::measure::centring::{Iteration, Phase, Probing};
use calibench::measure::dataset::{Dataset, Measured, Sample};
use calibench::measure::poses::{PlannedPose, ProbingPlan};
use calibench::robot::kinematics::world_from_tool;
use calibench::units::MM;
use calibench_loopback::{Answer, Refusal, Site};
use nalgebra::{Point3, Vector3};
use serde::Serialize;
use serde_json::json;

/// Fewest measurements of which the nominal arm's errors are shown: fewer lie close to any arm, its base fitted.
const TELLING: usize = 4;

const PAGE: &str = include_str!("page/watch.html");
const STYLE: &str = include_str!("page/watch.css");
const SCRIPT: &str = include_str!("page/watch.js");

/// A measurement that is watched. Its copies are of the same measurement.
#[derive(Clone)]
pub struct Watch {
    seen: Arc<Mutex<Seen>>,
    stop: StopRequest,
    cell: Arc<Dataset>,
    /// The poses in the order of the plan, without reserves.
    order: Arc<Vec<String>>,
    samples: Arc<Mutex<Vec<Sample>>>,
}

/// What the page shows.
#[derive(Debug, Clone, Default, Serialize)]
struct Seen {
    /// What is measured: `probings` or `points`.
    what: &'static str,
    wanted: usize,
    /// Where the arm is or goes.
    now: Option<Now>,
    /// The pose after it, in the order of the plan.
    next: Option<String>,
    /// Seconds to go, at the pace so far.
    remaining_s: Option<f64>,
    /// Largest reading of each stop of the centring under way or just ended, mm.
    centring_mm: Vec<f64>,
    /// Below which a ball is centred, mm.
    tolerance_mm: Option<f64>,
    results: Vec<Outcome>,
    /// True once a stop was requested, here or elsewhere.
    is_stopping: bool,
}

#[derive(Debug, Clone, Serialize)]
struct Now {
    pose: String,
    ball: Option<String>,
    attempt: usize,
}

#[derive(Debug, Clone, Serialize)]
struct Outcome {
    pose: String,
    ball: Option<String>,
    /// Why there is no measurement.
    failure: Option<String>,
    /// Distance of the nominal arm from what was measured, its base fitted to all so far, mm.
    off_mm: Option<f64>,
}

impl Watch {
    /// A measurement of `what` (`probings` or `points`) of a plan in the cell, which this request stops. Balls are centred within
    /// `tolerance`, m.
    pub fn new(cell: &Dataset, plan: &ProbingPlan, what: &'static str, tolerance: Option<f64>, stop: StopRequest) -> Self {
        let seen = Seen { what, wanted: plan.wanted(), tolerance_mm: tolerance.map(|t| t / MM), ..Seen::default() };
        let order = plan.poses.iter().filter(|pose| !pose.reserve).map(|pose| pose.id.clone()).collect();
        let cell = Arc::new(Dataset { samples: Vec::new(), ..cell.clone() });
        Watch { seen: Arc::new(Mutex::new(seen)), stop, cell, order: Arc::new(order), samples: Arc::default() }
    }

    /// The arm goes to a pose.
    pub fn goes_to(&self, pose: &PlannedPose, attempt: usize, remaining_s: Option<f64>) {
        let mut seen = self.seen();
        seen.now = Some(Now { pose: pose.id.clone(), ball: self.ball(pose), attempt });
        seen.remaining_s = remaining_s.or(seen.remaining_s);
        let is_done = |id: &String| *id == pose.id || seen.results.iter().any(|outcome| outcome.pose == *id);
        seen.next = self.order.iter().find(|id| !is_done(id)).cloned();
        seen.centring_mm.clear();
    }

    /// A pose was measured, or not and why.
    pub fn measured(&self, pose: &PlannedPose, sample: Option<&Sample>, failure: Option<String>) {
        let outcome = Outcome { pose: pose.id.clone(), ball: self.ball(pose), failure, off_mm: None };
        let mut samples = self.samples.lock().unwrap_or_else(PoisonError::into_inner);
        samples.extend(sample.cloned());
        let off = self.off(&samples);
        drop(samples);
        let mut seen = self.seen();
        seen.results.push(outcome);
        let measured = seen.results.iter_mut().filter(|outcome| outcome.failure.is_none());
        measured.zip(off).for_each(|(outcome, off)| outcome.off_mm = Some(off / MM));
    }

    fn seen(&self) -> MutexGuard<'_, Seen> {
        self.seen.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn ball(&self, pose: &PlannedPose) -> Option<String> {
        self.cell.balls.get(pose.ball?).map(|ball| ball.id.clone())
    }

    /// Distances of the nominal arm from what was measured, its base fitted to all of it, m; empty where they tell nothing.
    fn off(&self, samples: &[Sample]) -> Vec<f64> {
        let Dataset { robot, base, tool, balls, .. } = &*self.cell;
        let pair = |sample: &Sample| -> Option<(Vector3<f64>, Vector3<f64>)> {
            let at = world_from_tool(robot, base, tool, &sample.q);
            match sample.measured {
                Measured::Ball { ball, reading } => {
                    let centred = at * Point3::from(-reading.unwrap_or_default());
                    Some((centred.coords, balls.get(ball)?.position))
                }
                Measured::Point(point) => Some((at.translation.vector, point)),
                _ => None,
            }
        };
        let pairs: Vec<_> = samples.iter().filter_map(pair).collect();
        let fitted = (pairs.len() >= TELLING).then(|| rigid_fit(&pairs)).flatten();
        let Some(moved) = fitted else { return Vec::new() };
        pairs.iter().map(|(nominal, measured)| (moved * Point3::from(*nominal) - Point3::from(*measured)).norm()).collect()
    }
}

impl CampaignObserver for Watch {
    fn probing_started(&mut self, pose: &PlannedPose, attempt: usize, progress: &Progress) {
        self.goes_to(pose, attempt, Some(progress.remaining_s));
    }

    fn iteration(&mut self, _: &PlannedPose, iteration: &Iteration) {
        if let (Phase::Centring, Some(reading)) = (iteration.phase, iteration.reading) {
            self.seen().centring_mm.push(reading.amax() / MM);
        }
    }

    fn probing_finished(&mut self, pose: &PlannedPose, probing: &Probing, sample: Option<&Sample>) {
        self.measured(pose, sample, probing.outcome.as_ref().err().map(ToString::to_string));
    }

    fn recalled(&mut self, pose: &PlannedPose, probing: &Probing, sample: Option<&Sample>) {
        self.measured(pose, sample, probing.outcome.as_ref().err().map(ToString::to_string));
    }
}

impl Site for Watch {
    fn html(&self, policy: &str, nonce: &str) -> String {
        // The marks are ours, and none of the parts has one of them.
        let page = PAGE.replace("@POLICY@", policy).replace("@NONCE@", nonce);
        page.replace("@STYLE@", STYLE).replace("@SCRIPT@", SCRIPT)
    }

    fn views(&self) -> &'static [&'static str] {
        &["state"]
    }

    fn actions(&self) -> &'static [&'static str] {
        &["stop"]
    }

    fn ask(&self, what: &str, _: &[u8]) -> Answer {
        match what {
            "stop" => self.stop.make(),
            "state" => {}
            other => return Err(Refusal::Unknown(format!("there is no '{other}'"))),
        }
        let mut seen = self.seen().clone();
        seen.is_stopping = self.stop.is_made();
        Ok(json!(seen))
    }
}
