//! Datasets and a model, laid out for least squares: one residual equation, one row of terms per sample.
//!
//! `residual = ball_in_world - world_from_tool(joints, deviations) * gauge(reading)`, with the measured point in place of the
//! ball for tracker samples, and its projection on the line of sight for distances. A left-over reading is a point of the tool
//! frame, so it enters as a shifted TCP, exactly.

mod assembly;
mod columns;
mod sample_row;
mod samples_view;
mod start;

use std::collections::HashMap;
use std::sync::Arc;

use nalgebra::{DMatrix, Vector3};
use rayon::prelude::*;
use thiserror::Error;

use self::assembly::Assembly;
pub use self::assembly::missing;
pub(crate) use self::columns::Circumstance;
use self::sample_row::{Cell, DistanceRow, Moves, SampleRow, Scale};
pub use self::samples_view::PosedSample;
use super::{Model, TorquePosture};
use crate::effects::{EffectError, Owner, ParameterSpec};
use crate::measure::{Dataset, Sample, SampleSet};
use crate::robot::{Axis6, FramePose, Loads, Posture, Robot, Site, SiteIndex};

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
    /// What an effect multiplies has no value at a sample.
    #[error("effect '{effect}' has no value at sample '{sample}'{expression}; leave the sample or the effect out")]
    NoValue {
        /// The effect.
        effect: String,
        /// The sample.
        sample: String,
        /// The user's expression in words, where it is one; else empty.
        expression: String,
    },
    /// Samples of another campaign that was not made to the same plan.
    #[error("the samples are not those of the campaign that the problem was laid out for: {found}; lay it out anew")]
    AnotherPlan {
        /// The first that differs, or how many there are.
        found: String,
    },
}

/// How well a parameter is known beforehand, and why it is in the fit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Knowledge {
    /// Nothing but the data.
    Flat,
    /// Stated with a one-sigma uncertainty (SI): a certified ball or TCP, carried along so that its uncertainty is not lost.
    Stated(f64),
    /// Of ordinary size, one-sigma (SI): an effect of the catalogue, about which nothing else is known. Without that, terms that the
    /// data see faintly would take absurd sizes and do harm where nothing was measured.
    Plausible(f64),
}

impl Knowledge {
    /// One-sigma before any data, SI; infinite when nothing is known.
    pub fn sigma(self) -> f64 {
        match self {
            Knowledge::Flat => f64::INFINITY,
            Knowledge::Stated(sigma) | Knowledge::Plausible(sigma) => sigma,
        }
    }

    /// Information that it carries, 1/sigma², SI; zero when nothing is known.
    pub fn information(self) -> f64 {
        self.sigma().powi(-2)
    }
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
    /// Longest time of its samples, s.
    duration_s: Option<f64>,
}

impl Setup {
    /// Its dataset and session, which name it.
    pub fn name(&self) -> [&str; 2] {
        [&self.dataset, &self.session]
    }

    /// Whether a sample of its dataset belongs to it.
    fn holds(&self, sample: &Sample) -> bool {
        sample.session.as_deref().unwrap_or_default() == self.session
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

/// Samples that one thread takes at once: a plan of ordinary size is not worth two.
const STRETCH: usize = 512;

/// Samples, unknowns, and what joins them.
pub struct Problem {
    robot: Arc<Robot>,
    which: Use,
    setups: Vec<Setup>,
    parameters: Vec<Parameter>,
    cells: Vec<Cell>,
    rows: Vec<SampleRow>,
    patterns: Vec<Vec<Moves>>,
    distances: Vec<DistanceRow>,
    row_count: usize,
    torque_posture: TorquePosture,
    /// Joint and parameter of every joint compliance sought.
    compliances: Vec<(usize, usize)>,
    /// Compliance of each joint when the arm was last weighed, rad/(N·m).
    compliance: Vec<f64>,
    /// Whether an effect acts through them.
    acts_through_compliance: bool,
    sample_ids: Vec<String>,
    scale: WeighingRoom,
}

/// Room for weighing the arm.
struct WeighingRoom {
    work: Workspace,
    loads: Loads,
}

impl WeighingRoom {
    fn new(robot: &Robot) -> Self {
        WeighingRoom { work: Workspace::new(robot), loads: Loads::new(robot.joints()) }
    }
}

/// Reused from evaluation to evaluation.
pub(super) struct Workspace {
    posture: Posture,
    deviations: Vec<f64>,
    /// Column of every site but the flex displacements'.
    columns: Vec<Vector3<f64>>,
}

impl Workspace {
    pub(super) fn new(robot: &Robot) -> Self {
        let sites = SiteIndex::new(robot.joints()).len();
        Workspace { posture: Posture::new(robot), deviations: vec![0.0; sites], columns: vec![Vector3::zeros(); sites] }
    }
}

/// The whitened problem near some values, `r - J step`, transposed: one row a parameter, the last the residuals themselves, and one
/// column a scalar residual, so that a sample writes one stretch of memory and `[J r]^T [J r]` is all that a step needs.
pub(super) struct Linearised {
    /// Row of each parameter of the problem.
    row_of: Vec<Option<usize>>,
    /// (Parameters + 1) x residuals.
    pub transposed: DMatrix<f64>,
}

impl Linearised {
    /// Room for the derivatives by these parameters.
    pub fn new(problem: &Problem, parameters: &[usize]) -> Self {
        let mut row_of = vec![None; problem.parameters.len()];
        parameters.iter().enumerate().for_each(|(k, &p)| row_of[p] = Some(k));
        Linearised { row_of, transposed: DMatrix::zeros(parameters.len() + 1, problem.row_count) }
    }

    /// Sum of the squared residuals.
    pub fn chi2(&self) -> f64 {
        self.transposed.row(self.transposed.nrows() - 1).norm_squared()
    }

    /// The Jacobian: residuals x parameters.
    pub fn jacobian(&self) -> DMatrix<f64> {
        self.transposed.rows(0, self.transposed.nrows() - 1).transpose()
    }
}

impl Problem {
    /// Lays out the samples of `datasets` (with a label each) that `which` selects, under `model`.
    ///
    /// # Errors
    /// When an effect is unknown or lacks its data, the robots differ, or no sample is left.
    pub fn new(datasets: &[(&str, &Dataset)], model: &Model, which: Use) -> Result<Self, ProblemError> {
        Assembly::new(datasets, model, which)?.problem()
    }

    /// Takes the samples of another campaign of the same plan, a list for each dataset, in place of those that it was laid out for:
    /// other joints, readings, points, torques, times; the same balls and anchors in the same order.
    ///
    /// Parameters, set-ups and where the fit starts stay as they are. This is how a study of many campaigns is cheap.
    ///
    /// # Errors
    /// When the samples are not of the same plan; nothing has then changed.
    pub fn renew(&mut self, samples: &[&[Sample]]) -> Result<(), ProblemError> {
        let which = self.which;
        let mut taken =
            samples.iter().enumerate().flat_map(|(d, list)| list.iter().filter(move |s| which.takes(s)).map(move |s| (d, s)));
        for row in &self.rows {
            match taken.next() {
                Some((d, sample)) if d == row.cell && row.is_like(sample) && self.setups[row.setup].holds(sample) => {}
                Some((_, other)) => return Err(ProblemError::AnotherPlan { found: format!("sample '{}' differs", other.id) }),
                None => return Err(ProblemError::AnotherPlan { found: "there are fewer".into() }),
            }
        }
        if taken.next().is_some() {
            return Err(ProblemError::AnotherPlan { found: "there are more".into() });
        }
        let taken = samples.iter().flat_map(|list| list.iter().filter(|s| which.takes(s)));
        for ((row, id), sample) in self.rows.iter_mut().zip(&mut self.sample_ids).zip(taken) {
            row.take(&self.cells[row.cell], sample);
            id.clone_from(&sample.id);
        }
        self.weigh(None);
        self.check_values()
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
        self.rows.iter().all(SampleRow::noise_stated)
    }

    /// Smallest and largest angle of each joint among the samples, rad.
    pub fn joint_ranges(&self) -> Vec<[f64; 2]> {
        let mut ranges = vec![[f64::INFINITY, f64::NEG_INFINITY]; self.robot.joints()];
        for row in &self.rows {
            for (range, &q) in ranges.iter_mut().zip(row.q()) {
                *range = [range[0].min(q), range[1].max(q)];
            }
        }
        ranges
    }

    /// Weighs every sample's arm in the posture that `values` give, and so renews what effects depend on loads.
    ///
    /// Returns whether anything may have changed: not when the model takes its torques from the drawing's posture, and no effect acts
    /// through the compliances sought.
    pub fn reweigh(&mut self, values: &[f64]) -> bool {
        if !self.depends_on_values() {
            return false;
        }
        self.weigh(Some(values));
        true
    }

    /// Weighs the arm in the posture of `values` until it rests: twice, the second time as deflected, leaves a millionth.
    pub fn settle_loads(&mut self, values: &[f64]) {
        self.reweigh(values);
        self.reweigh(values);
    }

    /// Whether what the parameters move depends on their values: by the posture that they give, or by the compliances among them.
    pub(super) fn depends_on_values(&self) -> bool {
        self.torque_posture == TorquePosture::Identified || self.acts_through_compliance
    }

    /// Whether an effect of the model acts through the compliances sought.
    pub(super) fn acts_through_compliance(&self) -> bool {
        self.acts_through_compliance
    }

    /// That every effect has a value at every sample.
    fn check_values(&self) -> Result<(), ProblemError> {
        for (row, sample) in self.rows.iter().zip(&self.sample_ids) {
            let moving = self.patterns[row.pattern].iter().zip(&row.weights);
            if let Some((moves, _)) = { moving }.find(|(_, weight)| !weight.is_finite()) {
                let effect = &self.parameters[moves.parameter].effect;
                return Err(ProblemError::NoValue {
                    effect: effect.clone(),
                    sample: sample.clone(),
                    expression: self.cells[row.cell].expression(effect, moves.site),
                });
            }
        }
        Ok(())
    }

    /// Weighs every sample's arm in the posture that `values` give; without values where the fit starts, and states the noise there.
    ///
    /// Before anything is known of them, joints are taken to be as compliant as is plausible: what acts through them would else seem to
    /// move nothing.
    fn weigh(&mut self, values: Option<&[f64]>) {
        let drawn = self.torque_posture == TorquePosture::Drawn;
        let Problem { robot, setups, cells, rows, patterns, parameters, compliances, compliance, sample_ids, scale, .. } = self;
        let robot: &Robot = robot;
        compliance.fill(0.0);
        for &(joint, p) in compliances.iter() {
            compliance[joint] += values.map_or(parameters[p].spec.prior, |values| values[p]);
        }
        let weigh = |row: &mut SampleRow, sample: &str, patterns: &[Vec<Moves>], room: &mut WeighingRoom| {
            let WeighingRoom { work, loads } = room;
            let (setup, cell) = (&setups[row.setup], &cells[row.cell]);
            match values {
                Some(values) if !drawn => row.deviate(&patterns[row.pattern], values, &mut work.deviations),
                _ => work.deviations.fill(0.0),
            }
            row.pose(robot, setup, &mut work.posture, &work.deviations);
            if values.is_none() {
                row.state_noise(cell, &work.posture);
            }
            let mut scale = Scale { robot, setup, posture: &work.posture, compliance, sample, loads };
            let expected = patterns.get(row.pattern).map_or(&[][..], Vec::as_slice);
            row.weigh_moves(cell, &mut scale, expected)
        };
        let remember = |row: &mut SampleRow, pattern: Vec<Moves>, patterns: &mut Vec<Vec<Moves>>| {
            row.pattern = patterns.iter().position(|p| *p == pattern).unwrap_or_else(|| {
                patterns.push(pattern);
                patterns.len() - 1
            });
        };
        if rows.len() <= STRETCH {
            for (row, sample) in rows.iter_mut().zip(sample_ids) {
                if let Some(other) = weigh(row, sample, patterns, scale) {
                    remember(row, other, patterns);
                }
            }
            return;
        }
        // The first row's pattern is mostly that of all.
        if let Some(other) = weigh(&mut rows[0], &sample_ids[0], patterns, scale) {
            remember(&mut rows[0], other, patterns);
        }
        let others: Vec<Option<Vec<Moves>>> = rows
            .par_iter_mut()
            .zip(sample_ids)
            .with_min_len(STRETCH)
            .map_init(|| WeighingRoom::new(robot), |room, (row, sample)| weigh(row, sample, patterns, room))
            .collect();
        for (row, other) in rows.iter_mut().zip(others) {
            if let Some(other) = other {
                remember(row, other, patterns);
            }
        }
    }

    fn pose(&self, row: &SampleRow, values: &[f64], work: &mut Workspace) {
        row.deviate(&self.patterns[row.pattern], values, &mut work.deviations);
        row.pose(&self.robot, &self.setups[row.setup], &mut work.posture, &work.deviations);
    }

    /// Residual of one sample, m, of the arm as posed; with the line of sight for a distance.
    fn residual(&self, row: &SampleRow, work: &Workspace) -> (Vector3<f64>, Option<Vector3<f64>>) {
        let at = SiteIndex::new(self.robot.joints()).target();
        row.residual(&work.posture, &work.deviations[at..at + 3])
    }

    /// Residuals in metres, three a sample (a distance has one and two zeros), without weighting.
    pub fn residuals(&self, values: &[f64]) -> Vec<Vector3<f64>> {
        let mut work = Workspace::new(&self.robot);
        self.rows
            .iter()
            .map(|row| {
                self.pose(row, values, &mut work);
                self.residual(row, &work).0
            })
            .collect()
    }

    /// Evaluates whitened residuals and derivatives of the model side at `values`.
    pub(super) fn linearise(&self, values: &[f64], work: &mut Workspace, near: &mut Linearised) {
        let Linearised { row_of, transposed } = near;
        let width = transposed.nrows();
        let cells = transposed.as_mut_slice();
        cells.fill(0.0);
        let (mut of_samples, of_distances) = cells.split_at_mut((self.row_count - self.distances.len()) * width);
        if self.rows.len() <= STRETCH {
            self.linearise_rows(&self.rows, values, work, row_of, width, of_samples);
        } else {
            let mut tasks = Vec::new();
            for rows in self.rows.chunks(STRETCH) {
                let height: usize = rows.iter().map(SampleRow::height).sum();
                let (own, others) = of_samples.split_at_mut(height * width);
                tasks.push((rows, own));
                of_samples = others;
            }
            let task = |work: &mut Workspace, (rows, own): (&[SampleRow], &mut [f64])| {
                self.linearise_rows(rows, values, work, row_of, width, own);
            };
            tasks.into_par_iter().for_each_init(|| Workspace::new(&self.robot), task);
        }
        let m = width - 1;
        for (row, cells) in self.distances.iter().zip(of_distances.chunks_exact_mut(width)) {
            row.columns(values, &mut |p, slope| {
                if let Some(k) = row_of[p] {
                    cells[k] += slope;
                }
            });
            cells[m] = row.distance - row.between(values).norm();
            cells.iter_mut().for_each(|x| *x *= row.weight);
        }
    }

    /// The same of some rows alone, into their own stretch of memory.
    fn linearise_rows(
        &self,
        rows: &[SampleRow],
        values: &[f64],
        work: &mut Workspace,
        row_of: &[Option<usize>],
        width: usize,
        mut cells: &mut [f64],
    ) {
        let m = width - 1;
        for row in rows {
            self.pose(row, values, work);
            let (residual, sight) = self.residual(row, work);
            let (own, others) = cells.split_at_mut(row.height() * (m + 1));
            cells = others;
            let moving = self.patterns[row.pattern].iter().zip(&row.weights);
            let columns = moving.filter_map(|(moves, weight)| Some((row_of[moves.parameter]?, moves, *weight)));
            if let Some(sight) = sight {
                columns.for_each(|(k, moves, weight)| own[k] += weight * sight.dot(&work.posture.column(moves.site)));
                own[m] = residual.x;
                own.iter_mut().for_each(|x| *x *= row.whitener[(0, 0)]);
                continue;
            }
            let (x, yz) = own.split_at_mut(m + 1);
            let (y, z) = yz.split_at_mut(m + 1);
            work.posture.columns(&mut work.columns);
            for (k, moves, weight) in columns {
                let flex;
                let column = if matches!(moves.site, Site::Flex(..)) {
                    flex = work.posture.column(moves.site);
                    &flex
                } else {
                    &work.columns[moves.place]
                };
                x[k] += weight * column.x;
                y[k] += weight * column.y;
                z[k] += weight * column.z;
            }
            (x[m], y[m], z[m]) = (residual.x, residual.y, residual.z);
            row.whiten(x, y, z);
        }
    }

    /// One-sigma of the whitened residuals: 1 where the noise is stated; elsewhere what they are at `values`.
    pub fn noise_at(&self, values: &[f64]) -> f64 {
        if self.noise_stated() {
            return 1.0;
        }
        let mut near = Linearised::new(self, &[]);
        self.linearise(values, &mut Workspace::new(&self.robot), &mut near);
        (near.chi2() / self.row_count.max(1) as f64).sqrt()
    }

    /// Jacobian of the positions in SI, without weighting, of those parameters: what observability indices are defined on. Of a
    /// distance only the first of its three rows is filled; known distances between balls follow, a row each.
    pub fn plain_jacobian(&self, values: &[f64], columns: &[usize]) -> DMatrix<f64> {
        let mut work = Workspace::new(&self.robot);
        let mut j = DMatrix::zeros(3 * self.rows.len() + self.distances.len(), columns.len());
        let place: HashMap<usize, usize> = columns.iter().enumerate().map(|(k, &c)| (c, k)).collect();
        for (i, row) in self.rows.iter().enumerate() {
            self.pose(row, values, &mut work);
            let sight = self.residual(row, &work).1;
            for (moves, weight) in self.patterns[row.pattern].iter().zip(&row.weights) {
                if let Some(&k) = place.get(&moves.parameter) {
                    let column = work.posture.column(moves.site) * *weight;
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
