//! Datasets and a model, laid out for least squares: one residual equation, one row of terms per sample.
//!
//! `residual = ball_in_world - world_from_tool(joints, deviations) * gauge(reading)`, with the measured point in place of the
//! ball for tracker samples, and its projection on the line of sight for distances. A left-over reading is a point of the tool
//! frame, so it enters as a shifted TCP, exactly.

mod abreast;
mod assembly;
mod cell;
mod columns;
mod distance_row;
mod error;
mod linear_range;
mod linearised;
mod moves;
mod order;
mod parameter;
mod sample_row;
mod samples_view;
mod start;
mod weighing;

use std::sync::Arc;

use self::assembly::Assembly;
pub use self::assembly::missing;
use self::cell::Cell;
pub(crate) use self::columns::Circumstance;
use self::distance_row::DistanceRow;
pub use self::error::ProblemError;
pub(super) use self::linearised::{Linearised, Workspace};
use self::order::joints_before;
pub use self::parameter::{Knowledge, Parameter, Setup, Use};
use self::sample_row::SampleRow;
pub use self::samples_view::PosedSample;
pub(super) use self::weighing::{LoadState, WeighingRoom};
use super::{Model, TorquePosture};
use crate::measure::{Dataset, Sample};
use crate::robot::Robot;

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
    /// Under the loads of the nominal arm.
    drawn: LoadState,
    /// Under those at some values, where they were asked for beforehand; see [`Problem::settle_loads`].
    settled: Option<(Vec<f64>, LoadState)>,
    distances: Vec<DistanceRow>,
    row_count: usize,
    torque_posture: TorquePosture,
    /// Joint and parameter of every joint compliance sought.
    compliances: Vec<(usize, usize)>,
    /// Whether an effect acts through them.
    acts_through_compliance: bool,
    sample_ids: Vec<String>,
    room: Option<WeighingRoom>,
    /// Steps after which a fit gives up, where they are fewer than usual.
    most_steps: Option<usize>,
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
        if self.rows.iter().any(|row| row.q_before.is_some()) {
            let before = samples.iter().flat_map(|list| {
                let all = list.iter().zip(joints_before(list));
                all.filter(|(s, _)| which.takes(s)).map(|(_, before)| before)
            });
            for (row, before) in self.rows.iter_mut().zip(before) {
                row.q_before = before.map(<[f64]>::to_vec);
            }
        }
        self.load_nominal();
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

    /// The same, to be fitted in at most so many steps from each start: for who has no use for a fit that creeps.
    #[must_use]
    pub fn within_steps(self, most: usize) -> Self {
        Problem { most_steps: Some(most), ..self }
    }

    /// Steps after which a fit gives up, where they are fewer than usual.
    pub(super) fn most_steps(&self) -> Option<usize> {
        self.most_steps
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

    /// Whether what the parameters move depends on their values: by the posture that they give, or by the compliances among them.
    pub(super) fn depends_on_values(&self) -> bool {
        self.torque_posture == TorquePosture::Identified || self.acts_through_compliance
    }

    /// The loads of the nominal arm.
    pub(super) fn nominal_loads(&self) -> &LoadState {
        &self.drawn
    }

    /// Whether an effect of the model acts through the compliances sought.
    pub(super) fn acts_through_compliance(&self) -> bool {
        self.acts_through_compliance
    }

    /// That every effect has a value at every sample.
    fn check_values(&self) -> Result<(), ProblemError> {
        for ((row, terms), sample) in self.rows.iter().zip(&self.drawn.rows).zip(&self.sample_ids) {
            let moving = self.drawn.patterns[terms.pattern].iter().zip(&terms.weights);
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

    /// The value of every unknown where the fit starts, as deviation from the drawing, SI.
    pub fn start(&self) -> Vec<f64> {
        vec![0.0; self.parameters.len()]
    }
}
