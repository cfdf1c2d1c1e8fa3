//! Actions for further measurements, each with its candidates and its set-up time.

use nalgebra::{Unit, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use super::pool::{CellLayout, Pool};
use crate::diagnosis::Examination;
use crate::measure::dataset::{Ball, Dataset, Measured, Sample, SampleSet};
use crate::measure::poses::PlannedPose;
use crate::measure::poses::free_poses::{FreePosesRequest, free_poses};
use crate::measure::poses::pool::{Candidate as Probing, PoolError, PoolRequest, ProbedBall, feasible_pool};
use crate::robot::kinematics::world_from_tool;
use crate::robot::rel_tool::RelTool;
use crate::robot::statics::Payload;
use crate::units::{MM, UM};

/// Number of candidate poses, for all balls together.
const BALL_POSES: usize = 480;
/// Number of candidate points.
const POINTS: usize = 500;
/// Assumed duration of a centring with its approach, s; of this and the following, only the order of magnitude matters.
const CENTRING: f64 = 60.0;
/// Assumed duration of a tracker point, s.
const POINT: f64 = 20.0;
/// Assumed duration of a change of payload, s.
const OTHER_PAYLOAD: f64 = 10.0 * 60.0;
/// Assumed time to bring, warm up and register the tracker, with the artifact removed, s.
const TRACKER: f64 = 60.0 * 60.0;
/// Assumed time to move and clamp the artifact, s.
const ARTIFACT: f64 = 30.0 * 60.0;
/// Assumed time after the end of the session at which a repeated sample distinguishes a drift from a step, s.
const LATER: f64 = 60.0 * 60.0;
/// One-sigma per axis of a tracker point if the data do not state it, m: a laser tracker at a distance of some metres.
const TRACKER_SIGMA: f64 = 18.0 * UM;
/// Displacements of the artifact, m: nearer or farther, and up, so that every joint takes other angles.
const SHIFTS: [[f64; 3]; 3] = [[-0.12, 0.0, 0.15], [0.10, 0.0, 0.20], [0.05, 0.20, 0.10]];

/// Kind of measurement.
#[derive(Debug, Clone, PartialEq)]
pub enum Kind {
    /// Poses on the balls in their present positions.
    Balls {
        /// Name of the payload.
        payload: String,
        /// True if the data contain this payload.
        known: bool,
    },
    /// Measured poses repeated, with all joints arriving from the opposite direction.
    OtherSide,
    /// Measured poses repeated an hour later.
    Later,
    /// Poses on the balls with the artifact moved.
    MovedArtifact {
        /// Displacement from its present position, m.
        shift: Vector3<f64>,
    },
    /// Points over the whole workspace, measured by a tracker.
    Points,
}

impl Kind {
    /// True if balls are probed with the gauge (TriCal).
    pub fn is_probing(&self) -> bool {
        !matches!(self, Kind::Points)
    }
}

/// A set of possible measurements of one kind.
#[derive(Debug, Clone)]
pub struct Action {
    /// Kind of the measurements.
    pub kind: Kind,
    /// Time for setting up before the first measurement, s.
    pub setup_s: f64,
    /// Time per measurement, s.
    pub each_s: f64,
    /// The candidate measurements.
    pub pool: Pool,
    /// For every candidate on a ball, the joint angles at the far end of the approach, rad (N).
    approaches: Vec<Vec<f64>>,
}

/// An action that is not offered, with the reason.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct NotOffered {
    /// Description of the action.
    pub what: String,
    /// Reason why it is not offered.
    pub because: String,
}

impl Action {
    /// Describes the action in a few words.
    pub fn words(&self) -> String {
        match &self.kind {
            Kind::Balls { payload, known: true } => format!("poses with payload '{payload}'"),
            Kind::Balls { payload, known: false } => format!("poses with payload '{payload}', which would have to be made"),
            Kind::OtherSide => "poses repeated, arriving from the other side".into(),
            Kind::Later => "poses repeated an hour later".into(),
            Kind::MovedArtifact { shift } => {
                let [x, y, z] = [shift.x, shift.y, shift.z].map(|v| v / MM);
                format!("poses with the artifact moved by ({x:.0}, {y:.0}, {z:.0}) mm")
            }
            Kind::Points => "tracker points over the workspace".into(),
        }
    }

    /// Candidate `k` of the pool.
    pub fn candidate(&self, k: usize) -> Option<&Sample> {
        self.pool.dataset.samples.get(k)
    }

    /// Returns the chosen measurements as poses to probe; empty for points.
    pub fn poses(&self, chosen: &[usize]) -> Vec<PlannedPose> {
        let pose = |(n, &k): (usize, &usize)| {
            let sample = self.candidate(k)?;
            let Measured::Ball { ball, .. } = sample.measured else { return None };
            let forth = PlannedPose {
                id: format!("n{:02}", n + 1),
                ball: Some(ball),
                payload: sample.payload,
                contact: sample.q.clone(),
                approach: self.approaches.get(k)?.clone(),
                reserve: false,
                reverses: None,
                via: Vec::new(),
                clearance: None,
            };
            let back = PlannedPose { id: format!("{}b", forth.id), reverses: Some(forth.id.clone()), ..forth.clone() };
            Some(if self.kind == Kind::OtherSide { vec![forth, back] } else { vec![forth] })
        };
        chosen.iter().enumerate().filter_map(pose).flatten().collect()
    }

    /// Time for `count` measurements, including the set-up, s.
    pub fn duration(&self, count: usize) -> f64 {
        self.setup_s + self.each_s * count as f64
    }
}

/// Returns all actions that are possible for an examined robot in the first set-up of its data, and those that are not.
/// `needs_sides` is true if the direction from which joints arrive is in question.
pub fn actions(
    dataset: &Dataset,
    examination: &Examination,
    layout: &CellLayout,
    needs_sides: bool,
    seed: u64,
) -> (Vec<Action>, Vec<NotOffered>) {
    let bench = Bench::new(dataset, examination, layout, seed);
    let (mut offered, mut not_offered) = (Vec::new(), Vec::new());
    let mut take = |found: Result<Action, NotOffered>| match found {
        Ok(action) => offered.push(action),
        Err(not) => not_offered.push(not),
    };
    if !dataset.balls.is_empty() {
        let as_it_stands = bench.probings(layout, &Vector3::zeros());
        for payload in 0..dataset.payloads.len().max(1) {
            take(bench.balls(payload, &as_it_stands));
        }
        if dataset.payloads.len() == 1 {
            take(bench.lighter(&as_it_stands));
        }
        if needs_sides {
            take(bench.other_side());
        }
        take(bench.later());
        SHIFTS.iter().for_each(|shift| take(bench.moved(Vector3::from(*shift))));
    }
    take(bench.points());
    (offered, not_offered)
}

/// Data shared by all actions.
struct Bench<'a> {
    dataset: &'a Dataset,
    layout: &'a CellLayout,
    /// The cell with the samples of the session. The base is the start value of the fit; tracker noise is assumed if
    /// only that of balls is stated.
    cell: Dataset,
    session: Option<String>,
    /// End of the session, s.
    end_s: Option<f64>,
    temp_c: Option<f64>,
    measured_torques: bool,
    seed: u64,
}

impl<'a> Bench<'a> {
    fn new(dataset: &'a Dataset, examination: &Examination, layout: &'a CellLayout, seed: u64) -> Self {
        let setup = &examination.problem().setups()[0];
        let session = (!setup.session.is_empty()).then(|| setup.session.clone());
        let mut cell = Dataset { base: setup.start, ball_distances: Vec::new(), ..dataset.clone() };
        cell.samples.retain(|s| s.set == SampleSet::Fit && s.session == session);
        if cell.noise.ball.is_some() {
            cell.noise.point.get_or_insert(TRACKER_SIGMA);
        }
        let last = |of: fn(&Sample) -> Option<f64>| cell.samples.iter().filter_map(of).reduce(f64::max);
        Bench {
            dataset,
            layout,
            session,
            end_s: last(|s| s.time_s),
            temp_c: last(|s| s.temp_c),
            measured_torques: examination.model.measured_torques,
            seed,
            cell,
        }
    }

    /// Returns a sample for a planned measurement, `after` s after the end of the session. Directions of approach of
    /// joints and plungers are random.
    fn sample(&self, id: String, q: &[f64], measured: Measured, after: f64, random: &mut ChaCha8Rng) -> Sample {
        let mut side = || if random.random::<bool>() { 1 } else { -1 };
        let approach = Some(q.iter().map(|_| side()).collect());
        let plungers = Some([side(), side(), side()]);
        let distance = |s: &Sample| s.q.iter().zip(q).map(|(a, b)| (a - b).powi(2)).sum::<f64>();
        // The controller is assumed to report the same torques as in the nearest sample.
        let near = || self.cell.samples.iter().filter(|s| s.tau.is_some()).min_by(|a, b| distance(a).total_cmp(&distance(b)));
        Sample {
            time_s: self.end_s.map(|t| t + after),
            temp_c: self.temp_c,
            approach,
            plungers,
            session: self.session.clone(),
            q_commanded: Some(q.to_vec()),
            tau: if self.measured_torques { near().and_then(|s| s.tau.clone()) } else { None },
            ..Sample::new(id, q.to_vec(), measured)
        }
    }

    fn random(&self) -> ChaCha8Rng {
        ChaCha8Rng::seed_from_u64(self.seed)
    }

    fn action(&self, kind: Kind, [setup_s, each_s]: [f64; 2], candidates: Vec<(Sample, Vec<f64>)>) -> Action {
        let artifact_moved = matches!(kind, Kind::MovedArtifact { .. });
        let mut dataset = self.cell.clone();
        if let Kind::MovedArtifact { shift } = &kind {
            dataset.balls.iter_mut().for_each(|b| b.position += shift);
        }
        let (samples, approaches): (Vec<Sample>, _) = candidates.into_iter().unzip();
        dataset.samples = samples;
        Action { kind, setup_s, each_s, pool: Pool { dataset, artifact_moved }, approaches }
    }

    /// Finds postures that probe the balls, each with the far end of its approach.
    fn probings(&self, layout: &CellLayout, shift: &Vector3<f64>) -> Result<Vec<Probing>, PoolError> {
        let of_ball = |(b, ball): (usize, &Ball)| {
            let probed = ProbedBall {
                id: ball.id.clone(),
                centre: ball.position + shift,
                outward: layout.outward.get(b).copied().unwrap_or(Vector3::z_axis()),
                body: layout.bodies.get(b).cloned(),
            };
            feasible_pool(&PoolRequest {
                robot: &self.cell.robot,
                base: &self.cell.base,
                tool: &self.cell.tool,
                balls: std::slice::from_ref(&probed),
                approach: retreat(),
                approach_length: layout.retreat,
                cone: layout.cone,
                surroundings: &layout.surroundings,
                margins: layout.margins,
                count_per_ball: (BALL_POSES / self.cell.balls.len().max(1)).max(4),
                seed: self.seed.wrapping_add(b as u64),
            })
        };
        let pools: Vec<_> = self.cell.balls.par_iter().enumerate().map(of_ball).collect();
        let mut found = Vec::new();
        let mut refused = None;
        for (b, pool) in pools.into_iter().enumerate() {
            match pool {
                Ok(pool) => found.extend(pool.into_iter().map(|c| Probing { ball: b, ..c })),
                Err(e) => refused = Some(e),
            }
        }
        match refused {
            Some(refused) if found.is_empty() => Err(refused),
            _ => Ok(found),
        }
    }

    fn on_balls(&self, kind: Kind, times: [f64; 2], payload: usize, probings: &[Probing]) -> Action {
        let mut random = self.random();
        let candidate = |(k, c): (usize, &Probing)| {
            let measured = Measured::Ball { ball: c.ball, reading: None };
            let sample = self.sample(format!("next {k}"), &c.q, measured, times[0], &mut random);
            (Sample { payload, ..sample }, c.q_approach.clone())
        };
        self.action(kind, times, probings.iter().enumerate().map(candidate).collect())
    }

    fn balls(&self, payload: usize, probings: &Result<Vec<Probing>, PoolError>) -> Result<Action, NotOffered> {
        let name = self.dataset.payloads.get(payload).map_or("none".into(), |p| p.name.clone());
        let refused = |e: &PoolError| NotOffered { what: format!("poses with payload '{name}'"), because: e.to_string() };
        let probings = probings.as_ref().map_err(refused)?;
        let setup = if self.last_payload() == payload { 0.0 } else { OTHER_PAYLOAD };
        Ok(self.on_balls(Kind::Balls { payload: name, known: true }, [setup, CENTRING], payload, probings))
    }

    /// Payload now on the flange: that of the last sample.
    fn last_payload(&self) -> usize {
        self.cell.samples.last().map_or(0, |s| s.payload)
    }

    /// Poses without the load disks: the gauge alone weighs 1.3 kg (paper, section 3); its centre of mass is assumed a
    /// fifth as far out.
    fn lighter(&self, probings: &Result<Vec<Probing>, PoolError>) -> Result<Action, NotOffered> {
        let present = &self.dataset.payloads[0];
        let what = "poses with a lighter payload";
        if present.mass <= 1.3 {
            return Err(NotOffered { what: what.into(), because: "the payload is light already".into() });
        }
        let refused = |e: &PoolError| NotOffered { what: what.into(), because: e.to_string() };
        let probings = probings.as_ref().map_err(refused)?;
        let mut bench = Bench { cell: self.cell.clone(), session: self.session.clone(), ..*self };
        let name = "1.3 kg".to_owned();
        bench.cell.payloads.push(Payload { name: name.clone(), mass: 1.3, com: present.com / 5.0 });
        Ok(bench.on_balls(Kind::Balls { payload: name, known: false }, [OTHER_PAYLOAD, CENTRING], 1, probings))
    }

    /// Offers the measured samples on balls that `chosen` selects as candidates for repetition.
    fn repeated(&self, kind: Kind, times: [f64; 2], chosen: impl Fn(&Sample) -> bool) -> Action {
        let mut random = self.random();
        let mut rel_tool = RelTool::new(&self.cell.robot);
        let offset = retreat().into_inner() * self.layout.retreat;
        let candidate = |(k, made): (usize, &Sample)| {
            let Measured::Ball { ball, .. } = made.measured else { return None };
            let mut approach = made.q.clone();
            rel_tool.shift(&self.cell.robot, &self.cell.base, &self.cell.tool, &mut approach, &offset).ok()?;
            let measured = Measured::Ball { ball, reading: None };
            let mut sample = self.sample(format!("next {k}"), &made.q, measured, times[0], &mut random);
            sample.payload = made.payload;
            if kind == Kind::OtherSide {
                sample.approach = made.approach.as_ref().map(|signs| signs.iter().map(|s| -s).collect());
            }
            Some((sample, approach))
        };
        let made = self.cell.samples.iter().filter(|s| chosen(s)).enumerate();
        let candidates = made.filter_map(candidate).collect();
        self.action(kind.clone(), times, candidates)
    }

    fn other_side(&self) -> Result<Action, NotOffered> {
        let action = self.repeated(Kind::OtherSide, [0.0, 2.0 * CENTRING], |s| s.approach.is_some());
        let because = "the data hold no columns approach1 ... approachN".into();
        if action.pool.is_empty() { Err(NotOffered { what: action.words(), because }) } else { Ok(action) }
    }

    fn later(&self) -> Result<Action, NotOffered> {
        let action = self.repeated(Kind::Later, [LATER, CENTRING], |s| s.time_s.is_some());
        let because = "the data hold no column time_s".into();
        if action.pool.is_empty() { Err(NotOffered { what: action.words(), because }) } else { Ok(action) }
    }

    fn moved(&self, shift: Vector3<f64>) -> Result<Action, NotOffered> {
        let kind = Kind::MovedArtifact { shift };
        let layout = self.layout.shifted(self.dataset, &shift);
        let pool = self.probings(&layout, &shift);
        let payload = self.last_payload();
        let action = |probings: &[Probing]| self.on_balls(kind.clone(), [ARTIFACT, CENTRING], payload, probings);
        match pool {
            Ok(probings) => Ok(action(&probings)),
            Err(e) => Err(NotOffered { what: action(&[]).words(), because: e.to_string() }),
        }
    }

    fn points(&self) -> Result<Action, NotOffered> {
        let found = free_poses(&FreePosesRequest {
            robot: &self.cell.robot,
            base: &self.cell.base,
            tool: &self.cell.tool,
            surroundings: &self.layout.without_artifact,
            margins: self.layout.margins,
            facing: self.layout.facing,
            count: POINTS,
            seed: self.seed,
        });
        let mut random = self.random();
        let mut point = |(k, q): (usize, &Vec<f64>)| {
            let at = world_from_tool(&self.cell.robot, &self.cell.base, &self.cell.tool, q).translation.vector;
            (self.sample(format!("next {k}"), q, Measured::Point(at), TRACKER, &mut random), Vec::new())
        };
        match found {
            Ok(found) => Ok(self.action(Kind::Points, [TRACKER, POINT], found.iter().enumerate().map(&mut point).collect())),
            Err(e) => Err(NotOffered { what: self.action(Kind::Points, [0.0; 2], Vec::new()).words(), because: e.to_string() }),
        }
    }
}

/// Direction of retreat from a ball, in the tool's axes: the diagonal between the three plunger axes.
fn retreat() -> Unit<Vector3<f64>> {
    Unit::new_normalize(Vector3::repeat(1.0))
}
