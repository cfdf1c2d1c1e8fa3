//! Datasets and a model, laid out for least squares: one residual equation, one row of terms per sample.
//!
//! `residual = ball_in_world - world_from_tool(joints, deviations) * gauge(reading)`, with the measured point in place of the
//! ball for tracker samples, and its projection on the line of sight for distances. A left-over reading is a point of the tool
//! frame, so it enters as a shifted TCP, exactly.

use std::collections::{HashMap, HashSet};
use std::ops::Range;
use std::sync::Arc;

use nalgebra::{DMatrix, DVector, Matrix3, Vector3};
use thiserror::Error;

use super::{Model, TorquePosture};
use crate::effects::{self, Effect, EffectError, Needs, Owner, ParameterSpec, Situation, Subject};
use crate::measure::{Dataset, Measured, Sample, SampleSet};
use crate::robot::{FramePose, Loads, Payload, Posture, Robot, Site, SiteIndex};
use crate::units::MM;

/// One-sigma taken for the weighting of samples whose noise is not stated; their common scale is then estimated from the fit.
const UNSTATED_SIGMA: f64 = 0.1 * MM;

/// A joint that gravity loads less than this, N·m, is taken as unloaded.
const UNLOADED: f64 = 1e-6;

/// Why datasets and model do not make a problem.
#[derive(Debug, Error)]
pub enum ProblemError {
    /// An effect id is not in the catalogue or does not fit.
    #[error(transparent)]
    Effect(#[from] EffectError),
    /// The datasets are of different robots.
    #[error("the datasets are of different robots: '{first}' and '{other}'; identify one robot at a time")]
    DifferentRobots {
        /// Robot of the first dataset.
        first: String,
        /// Another robot.
        other: String,
    },
    /// Nothing to fit.
    #[error("there are no samples {of}; the dataset needs rows of that set")]
    NoSamples {
        /// Which samples were wanted.
        of: &'static str,
    },
    /// An effect needs what the data do not hold.
    #[error("effect '{effect}' needs {needs}; add it to the data, or leave the effect out of the model")]
    Missing {
        /// The effect.
        effect: String,
        /// The column or fact.
        needs: &'static str,
    },
}

/// How well a parameter is known beforehand, and why it is in the fit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Knowledge {
    /// Nothing but the data.
    Flat,
    /// Stated with a one-sigma uncertainty (SI): a certified ball or TCP, carried along so that its uncertainty is not lost.
    Stated(f64),
}

/// One unknown of the fit.
#[derive(Debug, Clone, PartialEq)]
pub struct Parameter {
    /// Unique; parameters of a set-up end in `@label` when there are several.
    pub name: String,
    /// Unit, drawing value, plausible size.
    pub spec: ParameterSpec,
    /// The effect that it belongs to.
    pub effect: String,
    /// What is known beforehand.
    pub knowledge: Knowledge,
    /// Its value where the fit starts, SI: the drawing's, but for a base that the drawing puts centimetres off.
    pub start: f64,
    /// Whose property it is.
    pub owner: Owner,
    /// The set-up that owns it, by place.
    pub setup: Option<usize>,
    /// Link that it belongs to, counted from 0, for parameters of one link.
    pub link: Option<usize>,
}

/// Robot base and tool of one session, as drawn, and as the fit starts.
#[derive(Debug, Clone, PartialEq)]
pub struct Setup {
    /// What its parameters' names end in; empty when there is only one set-up.
    pub label: String,
    /// Name of its dataset.
    pub dataset: String,
    /// Name of its session; may be empty.
    pub session: String,
    /// Nominal base in the world.
    pub base: FramePose,
    /// Base that the fit starts from: the nominal one unless it is centimetres off.
    pub start: FramePose,
    /// Nominal TCP frame.
    pub tool: FramePose,
    gravity: Vector3<f64>,
}

#[derive(Debug, Clone, Copy)]
struct Term {
    parameter: usize,
    site: Site,
    place: usize,
    weight: f64,
}

/// What one row group compares the TCP with.
#[derive(Debug, Clone, Copy)]
enum Target {
    Position(Vector3<f64>),
    Distance { anchor: Vector3<f64>, distance: f64 },
}

#[derive(Debug, Clone)]
struct Row {
    setup: usize,
    q: Vec<f64>,
    tool: FramePose,
    target: Target,
    terms: Range<usize>,
    /// W with W^T W = Sigma^-1; only (0, 0) for a distance.
    whitener: Matrix3<f64>,
    first_row: usize,
    circumstances: Circumstances,
}

/// What effects may depend on besides the posture.
#[derive(Debug, Clone)]
struct Circumstances {
    dataset: usize,
    payload: Payload,
    /// Force of the plungers on the tool, in the axes of the last frame, N.
    contact_force: Vector3<f64>,
    tau: Option<Vec<f64>>,
    ball: Option<usize>,
    time_s: Option<f64>,
    temp_c: Option<f64>,
    approach: Option<Vec<i8>>,
}

/// Rows of the known distances between balls: `d - |b1 - b2|`.
#[derive(Debug, Clone)]
struct DistanceRow {
    balls: [Vector3<f64>; 2],
    /// First of three parameters of each ball, where it has them.
    parameters: [Option<usize>; 2],
    distance: f64,
    weight: f64,
    known: bool,
}

/// Which samples enter.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Use {
    /// Rows of set `fit`.
    Fit,
    /// Rows of set `validation`.
    Validation,
    /// All rows.
    All,
}

impl Use {
    /// Whether a sample enters.
    pub fn takes(self, sample: &Sample) -> bool {
        match self {
            Use::All => true,
            Use::Fit => sample.set == SampleSet::Fit,
            Use::Validation => sample.set == SampleSet::Validation,
        }
    }
}

/// Samples, unknowns and the terms that join them.
pub struct Problem {
    robot: Arc<Robot>,
    setups: Vec<Setup>,
    parameters: Vec<Parameter>,
    effects: Vec<Vec<Placed>>,
    rows: Vec<Row>,
    terms: Vec<Term>,
    distances: Vec<DistanceRow>,
    row_count: usize,
    noise_stated: bool,
    torque_posture: TorquePosture,
    sample_ids: Vec<String>,
    joint_ranges: Vec<[f64; 2]>,
}

impl Problem {
    /// Lays out the samples of `datasets` (with a label each) that `which` selects, under `model`.
    ///
    /// # Errors
    /// When an effect is unknown or lacks its data, the robots differ, or no sample is left.
    pub fn new(datasets: &[(&str, &Dataset)], model: &Model, which: Use) -> Result<Self, ProblemError> {
        Assembly::new(datasets, model, which)?.rows()
    }

    /// The robot.
    pub fn robot(&self) -> &Arc<Robot> {
        &self.robot
    }

    /// The unknowns.
    pub fn parameters(&self) -> &[Parameter] {
        &self.parameters
    }

    /// Base and tool of each session.
    pub fn setups(&self) -> &[Setup] {
        &self.setups
    }

    /// Number of scalar residuals.
    pub fn row_count(&self) -> usize {
        self.row_count
    }

    /// Number of samples.
    pub fn sample_count(&self) -> usize {
        self.rows.len()
    }

    /// Names of the samples, in order.
    pub fn sample_ids(&self) -> &[String] {
        &self.sample_ids
    }

    /// Whether the noise of every sample is stated, so that chi-square means something.
    pub fn noise_stated(&self) -> bool {
        self.noise_stated
    }

    /// Smallest and largest angle of each joint among the samples, rad.
    pub fn joint_ranges(&self) -> &[[f64; 2]] {
        &self.joint_ranges
    }

    /// A workspace of this problem's size.
    pub fn workspace(&self) -> Workspace {
        Workspace { posture: Posture::new(&self.robot), deviations: vec![0.0; SiteIndex::new(self.robot.joints()).len()] }
    }

    /// Weighs every sample's arm in the posture that `values` give, and so renews what effects depend on loads.
    ///
    /// Returns whether anything may have changed: not when the model takes its torques from the drawing's posture.
    pub fn reweigh(&mut self, values: &[f64]) -> bool {
        if self.torque_posture == TorquePosture::Drawn {
            return false;
        }
        self.weigh(values);
        true
    }

    fn weigh(&mut self, values: &[f64]) {
        let sites = SiteIndex::new(self.robot.joints());
        let mut work = self.workspace();
        let mut loads = Loads::new(self.robot.joints());
        let mut terms = Vec::with_capacity(self.terms.len());
        for r in 0..self.rows.len() {
            self.pose(&self.rows[r], values, &mut work);
            let row = &self.rows[r];
            let at = &row.circumstances;
            let setup = &self.setups[row.setup];
            loads.weigh(&self.robot, &work.posture, &at.payload, &setup.gravity, &Vector3::zeros());
            if at.contact_force != Vector3::zeros() {
                let force = work.posture.flange().direction(&at.contact_force);
                push(&mut loads, &work.posture, &force);
            }
            if let Some(tau) = &at.tau {
                loads.tau.copy_from_slice(tau);
            }
            let situation = Situation {
                robot: &self.robot,
                q: &row.q,
                posture: &work.posture,
                loads: &loads,
                payload: &at.payload,
                ball: at.ball,
                time_s: at.time_s,
                temp_c: at.temp_c,
                approach: at.approach.as_deref(),
            };
            let from = terms.len();
            for placed in &self.effects[at.dataset] {
                let first = placed.first[if placed.first.len() > 1 { row.setup } else { 0 }];
                placed.effect.terms(&situation, &mut |k, site, weight| {
                    if weight != 0.0 {
                        terms.push(Term { parameter: first + k, site, place: sites.of(site), weight });
                    }
                });
            }
            self.rows[r].terms = from..terms.len();
        }
        self.terms = terms;
    }

    fn pose(&self, row: &Row, values: &[f64], work: &mut Workspace) {
        work.deviations.fill(0.0);
        for term in &self.terms[row.terms.clone()] {
            work.deviations[term.place] += term.weight * values[term.parameter];
        }
        work.posture.set(&self.robot, &self.setups[row.setup].start, &row.tool, &row.q, &work.deviations);
    }

    /// Residual of one sample, m: three numbers, or one and two zeros for a distance; with the line of sight for a distance.
    fn residual(&self, row: &Row, work: &Workspace) -> (Vector3<f64>, Option<Vector3<f64>>) {
        let tcp = work.posture.tcp();
        match row.target {
            Target::Position(target) => {
                let at = SiteIndex::new(self.robot.joints()).target();
                let moved = &work.deviations[at..at + 3];
                (target + Vector3::new(moved[0], moved[1], moved[2]) - tcp, None)
            }
            Target::Distance { anchor, distance } => {
                let sight = tcp - anchor;
                let length = sight.norm();
                (Vector3::new(distance - length, 0.0, 0.0), Some(sight / length.max(f64::MIN_POSITIVE)))
            }
        }
    }

    /// Residuals in metres, three a sample (a distance has one and two zeros), without weighting.
    pub fn residuals(&self, values: &[f64]) -> Vec<Vector3<f64>> {
        let mut work = self.workspace();
        self.rows
            .iter()
            .map(|row| {
                self.pose(row, values, &mut work);
                self.residual(row, &work).0
            })
            .collect()
    }

    /// Whitened residuals (`row_count`) and, where wanted, the whitened Jacobian of the model side: residual ~ r - J step.
    pub fn evaluate(
        &self,
        values: &[f64],
        work: &mut Workspace,
        r: &mut DVector<f64>,
        mut jacobian: Option<&mut DMatrix<f64>>,
    ) {
        if let Some(j) = jacobian.as_deref_mut() {
            j.fill(0.0);
        }
        for row in &self.rows {
            self.pose(row, values, work);
            let (residual, sight) = self.residual(row, work);
            let at = row.first_row;
            match sight {
                None => r.fixed_rows_mut::<3>(at).copy_from(&(row.whitener * residual)),
                Some(_) => r[at] = row.whitener[(0, 0)] * residual.x,
            }
            if let Some(j) = jacobian.as_deref_mut() {
                for term in &self.terms[row.terms.clone()] {
                    let column = work.posture.column(term.site) * term.weight;
                    match sight {
                        None => {
                            let mut cells = j.fixed_view_mut::<3, 1>(at, term.parameter);
                            cells += row.whitener * column;
                        }
                        Some(sight) => j[(at, term.parameter)] += row.whitener[(0, 0)] * sight.dot(&column),
                    }
                }
            }
        }
        let first = self.row_count - self.distances.len();
        for (k, row) in self.distances.iter().enumerate() {
            let position = |b: usize| match row.parameters[b] {
                Some(p) => row.balls[b] + Vector3::new(values[p], values[p + 1], values[p + 2]),
                None => row.balls[b],
            };
            let between = position(0) - position(1);
            let length = between.norm();
            r[first + k] = row.weight * (row.distance - length);
            if let Some(j) = jacobian.as_deref_mut() {
                let direction = between / length.max(f64::MIN_POSITIVE);
                for (b, sign) in [(0, 1.0), (1, -1.0)] {
                    if let Some(p) = row.parameters[b] {
                        for axis in 0..3 {
                            j[(first + k, p + axis)] += row.weight * sign * direction[axis];
                        }
                    }
                }
            }
        }
    }

    /// Jacobian of the positions in SI, without weighting, of those parameters: what observability indices are defined on.
    pub fn plain_jacobian(&self, values: &[f64], columns: &[usize]) -> DMatrix<f64> {
        let mut work = self.workspace();
        let mut j = DMatrix::zeros(3 * self.rows.len(), columns.len());
        let place: HashMap<usize, usize> = columns.iter().enumerate().map(|(k, &c)| (c, k)).collect();
        for (i, row) in self.rows.iter().enumerate() {
            self.pose(row, values, &mut work);
            for term in &self.terms[row.terms.clone()] {
                if let Some(&k) = place.get(&term.parameter) {
                    let mut cells = j.fixed_view_mut::<3, 1>(3 * i, k);
                    cells += work.posture.column(term.site) * term.weight;
                }
            }
        }
        j
    }

    /// The value of every unknown where the fit starts, as deviation from the drawing, SI.
    pub fn start(&self) -> Vec<f64> {
        vec![0.0; self.parameters.len()]
    }
}

/// Reused from evaluation to evaluation.
pub struct Workspace {
    posture: Posture,
    deviations: Vec<f64>,
}

/// Everything of a problem but its rows.
struct Assembly<'a> {
    datasets: &'a [(&'a str, &'a Dataset)],
    robot: Arc<Robot>,
    which: Use,
    measured_torques: bool,
    torque_posture: TorquePosture,
    setups: Vec<Setup>,
    /// Set-up of (dataset, session).
    setup_of: HashMap<(usize, Option<&'a str>), usize>,
    parameters: Vec<Parameter>,
    /// Effects of each dataset, with the first parameter of each for every owner: robot, or set-up, or dataset.
    effects: Vec<Vec<Placed>>,
}

struct Placed {
    effect: Box<dyn Effect>,
    /// First parameter by set-up; one entry where the owner is the robot or the artifact.
    first: Vec<usize>,
}

impl<'a> Assembly<'a> {
    fn new(datasets: &'a [(&'a str, &'a Dataset)], model: &Model, which: Use) -> Result<Self, ProblemError> {
        let (_, first) = datasets.first().ok_or(ProblemError::NoSamples { of: "at all" })?;
        let robot = first.robot.clone();
        let other = datasets.iter().find(|(_, d)| !d.robot.is_same_arm(&robot));
        if let Some((_, other)) = other {
            return Err(ProblemError::DifferentRobots { first: robot.name.clone(), other: other.robot.name.clone() });
        }
        let mut assembly = Assembly {
            datasets,
            robot,
            which,
            measured_torques: model.measured_torques,
            torque_posture: model.torque_posture,
            setups: Vec::new(),
            setup_of: HashMap::new(),
            parameters: Vec::new(),
            effects: Vec::new(),
        };
        assembly.find_setups();
        assembly.place_effects(model)?;
        Ok(assembly)
    }

    fn find_setups(&mut self) {
        for (d, (name, dataset)) in self.datasets.iter().enumerate() {
            for sample in dataset.samples.iter().filter(|s| self.which.takes(s)) {
                let key = (d, sample.session.as_deref());
                if self.setup_of.contains_key(&key) {
                    continue;
                }
                self.setup_of.insert(key, self.setups.len());
                self.setups.push(Setup {
                    label: String::new(),
                    dataset: (*name).into(),
                    session: sample.session.clone().unwrap_or_default(),
                    base: dataset.base,
                    start: starting_base(&self.robot, dataset, sample.session.as_deref()),
                    tool: dataset.tool,
                    gravity: dataset.gravity,
                });
            }
        }
        if self.setups.len() > 1 {
            let sessions: HashSet<&str> = self.setups.iter().map(|s| s.session.as_str()).filter(|s| !s.is_empty()).collect();
            let distinct = sessions.len() == self.setups.len();
            for setup in &mut self.setups {
                setup.label = match (distinct, setup.session.is_empty()) {
                    (true, _) => setup.session.clone(),
                    (false, true) => setup.dataset.clone(),
                    (false, false) => format!("{}/{}", setup.dataset, setup.session),
                };
            }
        }
    }

    /// Effects of the model, and those that the datasets themselves ask for (free or uncertain balls and tools).
    fn place_effects(&mut self, model: &Model) -> Result<(), ProblemError> {
        let mut robot_owned: HashMap<String, usize> = HashMap::new();
        for (d, (label, dataset)) in self.datasets.iter().enumerate() {
            let balls = dataset.ball_ids();
            let subject = Subject { robot: &self.robot, balls: &balls };
            let mut wanted: Vec<(String, Knowledge)> = Vec::new();
            let probed = |b: usize| {
                let on = |s: &&Sample| matches!(s.measured, Measured::Ball { ball, .. } if ball == b);
                dataset.samples.iter().filter(|s| self.which.takes(s)).any(|s| on(&s))
            };
            // Free balls first: where no ball is known, it is the base that cannot be told.
            for (b, ball) in dataset.balls.iter().enumerate() {
                if ball.free && probed(b) {
                    wanted.push((format!("ball:{}", ball.id), Knowledge::Flat));
                }
            }
            wanted.extend(model.effects.iter().map(|e| (e.clone(), Knowledge::Flat)));
            if dataset.tool_free {
                wanted.push(("tool_frame".into(), Knowledge::Flat));
            } else if dataset.tool_sigma > 0.0 {
                wanted.push(("tool_frame".into(), Knowledge::Stated(dataset.tool_sigma)));
            }
            for (b, ball) in dataset.balls.iter().enumerate() {
                if !ball.free && ball.sigma > 0.0 && probed(b) {
                    wanted.push((format!("ball:{}", ball.id), Knowledge::Stated(ball.sigma)));
                }
            }
            let mut placed: Vec<Placed> = Vec::new();
            for (id, knowledge) in wanted {
                if placed.iter().any(|p| p.effect.id() == id) {
                    continue; // named by the model as well: the model's word counts
                }
                let effect = effects::build(&id, &subject)?;
                check_needs(effect.as_ref(), &self.robot, dataset, self.measured_torques)?;
                let all = &mut self.parameters;
                let first = match effect.owner() {
                    Owner::Robot => vec![*robot_owned.entry(id).or_insert_with(|| add(all, effect.as_ref(), "", knowledge))],
                    Owner::Artifact => {
                        let first = add(all, effect.as_ref(), if self.datasets.len() > 1 { label } else { "" }, knowledge);
                        let ball = dataset.balls.iter().find(|b| effect.id() == format!("ball:{}", b.id));
                        if let Some(ball) = ball {
                            place(&mut all[first..], ball.position.as_slice(), ball.position.as_slice());
                        }
                        vec![first]
                    }
                    Owner::Session => {
                        let mine = |s: usize| self.setup_of.iter().any(|(key, &setup)| key.0 == d && setup == s);
                        let mut first = vec![usize::MAX; self.setups.len()];
                        for s in (0..self.setups.len()).filter(|&s| mine(s)) {
                            let setup = &self.setups[s];
                            first[s] = add(all, effect.as_ref(), &setup.label, knowledge);
                            all[first[s]..].iter_mut().for_each(|p| p.setup = Some(s));
                            match effect.id() {
                                "base_frame" => place(&mut all[first[s]..], &setup.base.to_array(), &setup.start.to_array()),
                                "tool_frame" => place(&mut all[first[s]..], &setup.tool.xyz, &setup.tool.xyz),
                                _ => {}
                            }
                        }
                        first
                    }
                };
                placed.push(Placed { effect, first });
            }
            self.effects.push(placed);
        }
        Ok(())
    }

    fn rows(self) -> Result<Problem, ProblemError> {
        let zero = vec![0.0; SiteIndex::new(self.robot.joints()).len()];
        let mut posture = Posture::new(&self.robot);
        let mut problem = Problem {
            robot: self.robot.clone(),
            setups: self.setups,
            parameters: self.parameters,
            effects: self.effects,
            torque_posture: self.torque_posture,
            rows: Vec::new(),
            terms: Vec::new(),
            distances: Vec::new(),
            row_count: 0,
            noise_stated: true,
            sample_ids: Vec::new(),
            joint_ranges: vec![[f64::INFINITY, f64::NEG_INFINITY]; self.robot.joints()],
        };
        for (d, (_, dataset)) in self.datasets.iter().enumerate() {
            let tool_turn = FramePose { xyz: [0.0; 3], ..dataset.tool }.pose().rotation;
            for sample in dataset.samples.iter().filter(|s| self.which.takes(s)) {
                let s = self.setup_of[&(d, sample.session.as_deref())];
                let setup = &problem.setups[s];
                posture.set(&self.robot, &setup.start, &setup.tool, &sample.q, &zero);
                let mut tool = dataset.tool;
                let mut contact_force = Vector3::zeros();
                let (target, ball) = match &sample.measured {
                    Measured::Ball { ball, reading } => {
                        contact_force = tool_turn * dataset.contact_force;
                        if let Some(reading) = reading {
                            let shift = tool_turn * reading;
                            for axis in 0..3 {
                                tool.xyz[axis] += shift[axis];
                            }
                        }
                        (Target::Position(dataset.balls[*ball].position), Some(*ball))
                    }
                    Measured::Point(point) => (Target::Position(*point), None),
                    Measured::Distance { anchor, distance } => {
                        (Target::Distance { anchor: dataset.anchors[*anchor].position, distance: *distance }, None)
                    }
                };
                let circumstances = Circumstances {
                    dataset: d,
                    payload: dataset.payloads.get(sample.payload).cloned().unwrap_or_else(Payload::none),
                    contact_force,
                    tau: sample.tau.clone().filter(|_| self.measured_torques),
                    ball,
                    time_s: sample.time_s,
                    temp_c: sample.temp_c,
                    approach: sample.approach.clone(),
                };
                let (whitener, stated) = whitener(&self.robot, dataset, sample, &posture);
                problem.noise_stated &= stated;
                let height = if matches!(target, Target::Distance { .. }) { 1 } else { 3 };
                let first_row = problem.row_count;
                problem.row_count += height;
                for (range, &q) in problem.joint_ranges.iter_mut().zip(&sample.q) {
                    *range = [range[0].min(q), range[1].max(q)];
                }
                problem.sample_ids.push(sample.id.clone());
                problem.rows.push(Row {
                    setup: s,
                    q: sample.q.clone(),
                    tool,
                    target,
                    terms: 0..0,
                    whitener,
                    first_row,
                    circumstances,
                });
            }
            for known in &dataset.ball_distances {
                let ids = known.between.map(|b| format!("ball:{}", dataset.balls[b].id));
                let parameters = ids.map(|id| problem.effects[d].iter().find(|p| p.effect.id() == id).map(|p| p.first[0]));
                // A free ball that none of these samples probes has no position to measure from.
                let known_ball = |k: usize| parameters[k].is_some() || !dataset.balls[known.between[k]].free;
                problem.distances.push(DistanceRow {
                    balls: known.between.map(|b| dataset.balls[b].position),
                    parameters,
                    known: known_ball(0) && known_ball(1),
                    distance: known.distance,
                    weight: 1.0 / known.sigma,
                });
            }
        }
        if problem.rows.is_empty() {
            let of = match self.which {
                Use::Fit => "of set 'fit'",
                Use::Validation => "of set 'validation'",
                Use::All => "at all",
            };
            return Err(ProblemError::NoSamples { of });
        }
        let start = problem.start();
        problem.weigh(&start);
        for term in &problem.terms {
            if let Site::Mdh(i, _) = term.site {
                problem.parameters[term.parameter].link = Some(i);
            }
        }
        problem.distances.retain(|d| d.parameters.iter().any(Option::is_some) && d.known);
        problem.row_count += problem.distances.len();
        Ok(problem)
    }
}

/// Adds a force on the TCP (world, N) to the loads of gravity, but not on joints that gravity leaves unloaded: the springs' force is
/// known from a data sheet only, and a compliance seen through nothing else would be a calibration of the springs.
fn push(loads: &mut Loads, posture: &Posture, force: &Vector3<f64>) {
    for i in 0..loads.tau.len() {
        let (axis, origin) = posture.joint_axis(i);
        let moment = (posture.tcp() - origin).cross(force);
        loads.moment[i + 1] += moment;
        if loads.tau[i].abs() > UNLOADED {
            loads.tau[i] += axis.dot(&moment);
        }
        loads.force[i + 1] += force;
    }
    loads.moment[0] += (posture.tcp() - posture.frame(0).o).cross(force);
    loads.force[0] += force;
}

/// Appends the parameters of an effect; returns the place of the first.
fn add(all: &mut Vec<Parameter>, effect: &dyn Effect, label: &str, knowledge: Knowledge) -> usize {
    let first = all.len();
    all.extend(effect.parameters().iter().map(|spec| Parameter {
        name: if label.is_empty() { spec.name.clone() } else { format!("{}@{label}", spec.name) },
        spec: spec.clone(),
        effect: effect.id().into(),
        knowledge,
        start: spec.nominal,
        owner: effect.owner(),
        setup: None,
        link: None,
    }));
    first
}

/// Gives parameters of a set-up their drawing values and starts.
fn place(parameters: &mut [Parameter], nominal: &[f64], start: &[f64]) {
    for (p, (&nominal, &start)) in parameters.iter_mut().zip(nominal.iter().zip(start)) {
        p.spec.nominal = nominal;
        p.start = start;
    }
}

fn check_needs(effect: &dyn Effect, robot: &Robot, dataset: &Dataset, measured_torques: bool) -> Result<(), ProblemError> {
    let samples = &dataset.samples;
    for need in effect.needs() {
        let missing = match need {
            Needs::Masses if measured_torques => {
                samples.iter().any(|s| s.tau.is_none()).then_some("columns tau1_nm ... tauN_nm")
            }
            Needs::Masses => (!robot.has_masses()).then_some("link masses in the robot's description"),
            Needs::Approach => samples.iter().any(|s| s.approach.is_none()).then_some("columns approach1 ... approachN"),
            Needs::Time => samples.iter().any(|s| s.time_s.is_none()).then_some("column time_s"),
            Needs::Temperature => samples.iter().any(|s| s.temp_c.is_none()).then_some("column temp_c"),
            Needs::Balls => {
                samples.iter().all(|s| !matches!(s.measured, Measured::Ball { .. })).then_some("samples of kind 'ball'")
            }
        };
        if let Some(needs) = missing {
            return Err(ProblemError::Missing { effect: effect.id().into(), needs });
        }
    }
    Ok(())
}

/// W with W^T W = Sigma^-1, `Sigma = sigma² I + J_q diag(sigma_q²) J_q^T`, at the nominal posture; and whether sigma was stated.
fn whitener(robot: &Robot, dataset: &Dataset, sample: &Sample, posture: &Posture) -> (Matrix3<f64>, bool) {
    let noise = &dataset.noise;
    let stated = sample.sigma.or(match sample.measured {
        Measured::Ball { .. } => noise.ball,
        Measured::Point(_) | Measured::Distance { .. } => noise.point,
    });
    let sigma = stated.unwrap_or(UNSTATED_SIGMA);
    let mut covariance = Matrix3::identity() * (sigma * sigma);
    for (i, &sigma_q) in noise.joint.iter().enumerate().take(robot.joints()) {
        let column = posture.column(Site::Mdh(i, crate::robot::MdhEntry::Theta)) * sigma_q;
        covariance += column * column.transpose();
    }
    if let Measured::Distance { anchor, .. } = sample.measured {
        let sight = (posture.tcp() - dataset.anchors[anchor].position).normalize();
        let variance = sight.dot(&(covariance * sight)).max(sigma * sigma);
        return (Matrix3::identity() / variance.sqrt(), stated.is_some());
    }
    let whitener = covariance.cholesky().and_then(|c| c.l().try_inverse()).unwrap_or_else(|| Matrix3::identity() / sigma);
    (whitener, stated.is_some())
}

/// A nominal base further than this from what the points say (rms) is replaced by a closed-form start.
const NOMINAL_BASE_IS_CLOSE: f64 = 20.0 * MM;

/// The base from which Gauss-Newton starts: the nominal one, or, where tracker points contradict it by centimetres, the rigid
/// motion that carries the nominal TCPs onto the points (Kabsch 1976).
fn starting_base(robot: &Robot, dataset: &Dataset, session: Option<&str>) -> FramePose {
    let pairs: Vec<(Vector3<f64>, Vector3<f64>)> = dataset
        .samples
        .iter()
        .filter(|s| s.session.as_deref() == session)
        .filter_map(|s| match s.measured {
            Measured::Point(point) => {
                let pose = crate::robot::world_from_tool(robot, &FramePose::default(), &dataset.tool, &s.q);
                Some((pose.translation.vector, point))
            }
            _ => None,
        })
        .collect();
    let base = dataset.base.pose();
    let mean_square = pairs
        .iter()
        .map(|(tcp, p)| (base * nalgebra::Point3::from(*tcp) - nalgebra::Point3::from(*p)).norm_squared())
        .sum::<f64>()
        / pairs.len().max(1) as f64;
    if pairs.len() < 3 || mean_square.sqrt() < NOMINAL_BASE_IS_CLOSE {
        return dataset.base;
    }
    crate::robot::rigid_fit(&pairs).map_or(dataset.base, |pose| FramePose::from_pose(&pose))
}
