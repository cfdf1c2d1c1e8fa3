//! Datasets and a model, laid out for least squares: one residual equation, one row of terms per sample.
//!
//! `residual = ball_in_world - world_from_tool(joints, deviations) * gauge(reading)`, with the measured point in place of the
//! ball for tracker samples, and its projection on the line of sight for distances. A left-over reading is a point of the tool
//! frame, so it enters as a shifted TCP, exactly.

mod assembly;
mod start;

use std::collections::HashMap;
use std::ops::Range;
use std::sync::Arc;

use nalgebra::{DMatrix, DVector, Matrix3, Vector3};
use thiserror::Error;

use super::{Model, TorquePosture};
use crate::effects::{EffectError, Owner, ParameterSpec, Situation};
use crate::measure::{Dataset, Sample, SampleSet};
use crate::robot::{Axis6, FramePose, Loads, Payload, Posture, Robot, Site, SiteIndex};

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
    /// Two datasets of one name: their parameters could not be told apart.
    #[error("two datasets are named '{name}'; name each one differently")]
    SameName {
        /// The name.
        name: String,
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
    /// Its value where the fit starts, SI: the drawing's, but for a base that the drawing puts decimetres off.
    pub start: f64,
    /// Whose property it is.
    pub owner: Owner,
    /// The set-up that owns it, by place; for what belongs to an artifact, the first set-up of its dataset.
    pub setup: Option<usize>,
    /// Link that it belongs to, counted from 0, for parameters of one link.
    pub link: Option<usize>,
    /// Whether it defines the world: a number of a base that nothing known in the world contradicts. It stays where it is.
    pub defines_world: bool,
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
    /// Base that the fit starts from: the nominal one unless it is decimetres off.
    pub start: FramePose,
    /// What of the base defines the world, see [`Parameter::defines_world`].
    pub worlds_own: Vec<Axis6>,
    /// Nominal TCP frame.
    pub tool: FramePose,
    gravity: Vector3<f64>,
}

impl Setup {
    /// Its dataset and session, which name it.
    pub fn name(&self) -> [&str; 2] {
        [&self.dataset, &self.session]
    }
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

impl DistanceRow {
    /// From the second ball to the first, m.
    fn between(&self, values: &[f64]) -> Vector3<f64> {
        let position = |b: usize| match self.parameters[b] {
            Some(p) => self.balls[b] + Vector3::new(values[p], values[p + 1], values[p + 2]),
            None => self.balls[b],
        };
        position(0) - position(1)
    }

    /// Calls `emit(parameter, d(distance)/d(parameter))` for the coordinates that it depends on.
    fn columns(&self, values: &[f64], emit: &mut dyn FnMut(usize, f64)) {
        let between = self.between(values);
        let direction = between / between.norm().max(f64::MIN_POSITIVE);
        for (first, sign) in self.parameters.iter().zip([1.0, -1.0]) {
            if let Some(p) = first {
                (0..3).for_each(|axis| emit(p + axis, sign * direction[axis]));
            }
        }
    }
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
    effects: Vec<Vec<assembly::Placed>>,
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
        assembly::Assembly::new(datasets, model, which)?.rows()
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

    /// Weighs the arm in the posture of `values` until it rests: twice, the second time as deflected, leaves a millionth.
    pub fn settle_loads(&mut self, values: &[f64]) {
        self.reweigh(values);
        self.reweigh(values);
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
            r[first + k] = row.weight * (row.distance - row.between(values).norm());
            if let Some(j) = jacobian.as_deref_mut() {
                row.columns(values, &mut |p, slope| j[(first + k, p)] += row.weight * slope);
            }
        }
    }

    /// One-sigma of the whitened residuals: 1 where the noise is stated; elsewhere what they are at `values`.
    pub fn noise_at(&self, values: &[f64]) -> f64 {
        if self.noise_stated {
            return 1.0;
        }
        let mut r = DVector::zeros(self.row_count);
        self.evaluate(values, &mut self.workspace(), &mut r, None);
        r.norm() / (self.row_count.max(1) as f64).sqrt()
    }

    /// Jacobian of the positions in SI, without weighting, of those parameters: what observability indices are defined on. Of a
    /// distance only the first of its three rows is filled; known distances between balls follow, a row each.
    pub fn plain_jacobian(&self, values: &[f64], columns: &[usize]) -> DMatrix<f64> {
        let mut work = self.workspace();
        let mut j = DMatrix::zeros(3 * self.rows.len() + self.distances.len(), columns.len());
        let place: HashMap<usize, usize> = columns.iter().enumerate().map(|(k, &c)| (c, k)).collect();
        for (i, row) in self.rows.iter().enumerate() {
            self.pose(row, values, &mut work);
            let sight = self.residual(row, &work).1;
            for term in &self.terms[row.terms.clone()] {
                if let Some(&k) = place.get(&term.parameter) {
                    let column = work.posture.column(term.site) * term.weight;
                    match sight {
                        None => {
                            let mut cells = j.fixed_view_mut::<3, 1>(3 * i, k);
                            cells += column;
                        }
                        Some(sight) => j[(3 * i, k)] += sight.dot(&column),
                    }
                }
            }
        }
        for (i, row) in self.distances.iter().enumerate() {
            row.columns(values, &mut |p, slope| {
                if let Some(&k) = place.get(&p) {
                    j[(3 * self.rows.len() + i, k)] += slope;
                }
            });
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
