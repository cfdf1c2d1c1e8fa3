//! Datasets and a model, laid out for least squares: one residual equation and one row of terms per sample.
//!
//! `residual = ball_in_world - world_from_tool(joints, deviations) * gauge(reading)`, with the measured point in place of
//! the ball for tracker samples, and its projection on the line of sight for distances. A residual reading is a point of
//! the tool frame, so it enters exactly, as a shifted TCP.

mod assembly;
mod batch;
mod cell;
mod columns;
mod distance_row;
mod error;
mod jacobian_pattern;
mod linear_range;
mod linearised;
mod load_state;
mod load_updates;
mod missing;
mod order;
mod orientation;
mod parameter;
mod prior_row;
mod sample_row;
mod samples_view;
mod start;
mod wanted;

use std::sync::Arc;

use self::cell::Cell;
pub(crate) use self::cell::takes_orientations;
pub(crate) use self::columns::SampleContext;
use self::distance_row::DistanceRow;
pub use self::error::ProblemError;
pub(super) use self::linearised::{Linearised, Workspace};
pub(super) use self::load_state::LoadState;
pub(super) use self::load_updates::LoadWorkspace;
pub use self::missing::missing;
use self::order::inherited;
pub use self::parameter::{Parameter, Prior, Setup, Use};
use self::prior_row::PriorRow;
use self::sample_row::SampleRow;
pub(crate) use self::sample_row::UNSTATED_SIGMA;
pub use self::samples_view::PosedSample;
use super::TorquePosture;
use crate::measure::dataset::Sample;
use crate::robot::Robot;

/// Samples, unknowns, and the terms that connect them.
pub struct Problem {
    robot: Arc<Robot>,
    which: Use,
    setups: Vec<Setup>,
    parameters: Vec<Parameter>,
    cells: Vec<Cell>,
    rows: Vec<SampleRow>,
    /// Terms under the loads of the nominal arm.
    nominal: LoadState,
    /// Values and the terms under the loads there, if computed beforehand; see [`Problem::update_loads`].
    cached: Option<(Vec<f64>, LoadState)>,
    distances: Vec<DistanceRow>,
    priors: Vec<PriorRow>,
    /// Effective number of parameters of a field of joint errors, which are not among the unknowns.
    field_numbers: f64,
    row_count: usize,
    torque_posture: TorquePosture,
    /// Joint and parameter of every unknown joint compliance.
    compliances: Vec<(usize, usize)>,
    /// True if an effect acts through them.
    acts_through_compliance: bool,
    sample_ids: Vec<String>,
    room: Option<LoadWorkspace>,
    /// Step limit of a fit, if lower than usual.
    most_steps: Option<usize>,
    /// True if a fit gives no observability indices.
    without_indices: bool,
    /// Variance of unit weight against which plausible sizes are held: 1 if the noise is stated, or taken for what it is without.
    unit_variance: f64,
}

impl Problem {
    /// Replaces the samples by those of another campaign of the same plan, one list per dataset: other joints, readings,
    /// points, torques, times; the same balls and anchors in the same order.
    ///
    /// Parameters, set-ups and the start of the fit are unchanged. This makes studies of many campaigns cheap.
    ///
    /// # Errors
    /// When the samples are not of the same plan; the problem is then unchanged.
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
        if self.rows.iter().any(|row| row.inherited.is_some()) {
            let inherited = samples.iter().flat_map(|list| {
                let all = list.iter().zip(inherited(list));
                all.filter(|(s, _)| which.takes(s)).map(|(_, inherited)| inherited)
            });
            for (row, inherited) in self.rows.iter_mut().zip(inherited) {
                row.inherited = Some(inherited);
            }
        }
        self.load_nominal()?;
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

    /// Number of those that are priors of parameters, after all others.
    pub fn prior_count(&self) -> usize {
        self.priors.len()
    }

    /// Degrees of freedom of a fit with this many unknowns without a prior.
    pub(super) fn dof(&self, flat: usize) -> usize {
        let numbers = self.field_numbers.round().max(0.0) as usize;
        (self.row_count - flat).saturating_sub(self.priors.len() + numbers)
    }

    /// Number of samples.
    pub fn sample_count(&self) -> usize {
        self.rows.len()
    }

    /// Names of the samples, in order.
    pub fn sample_ids(&self) -> &[String] {
        &self.sample_ids
    }

    /// The same problem with a limit on the steps from each start, for callers that cannot use a slowly converging fit.
    #[must_use]
    pub fn within_steps(self, most: usize) -> Self {
        Problem { most_steps: Some(most), ..self }
    }

    /// The same problem, of whose fits no observability indices and no condition number are wanted: both are NaN. They belong
    /// to the plan, and cost as much as the fit itself.
    #[must_use]
    pub fn without_indices(self) -> Self {
        Problem { without_indices: true, ..self }
    }

    /// Information on parameter `p` beside the samples, 1/SI², in the unit of the whitened residuals: that of its prior, and of a
    /// plausible size in the unit of the [noise of its own](super::fit::by_own_noise).
    pub(crate) fn information(&self, p: usize) -> f64 {
        let knowledge = self.parameters[p].knowledge;
        knowledge.information() * if matches!(knowledge, Prior::Plausible(_)) { self.unit_variance } else { 1.0 }
    }

    /// Variance of unit weight against which plausible sizes are held.
    pub(crate) fn unit_variance(&self) -> f64 {
        self.unit_variance
    }

    /// The same problem, whose plausible sizes are held against this variance of unit weight.
    #[must_use]
    pub(crate) fn at_unit_variance(self, unit_variance: f64) -> Self {
        Problem { unit_variance, ..self }
    }

    /// True if what is known beside the samples is of their size alone, as it is in the catalogue.
    pub(super) fn is_held_plausibly(&self) -> bool {
        self.priors.is_empty() && self.field_numbers == 0.0
    }

    /// True if a fit gives observability indices and a condition number.
    pub(super) fn gives_indices(&self) -> bool {
        !self.without_indices
    }

    /// Step limit of a fit, if lower than usual.
    pub(super) fn most_steps(&self) -> Option<usize> {
        self.most_steps
    }

    /// True if the noise of every sample is stated, so that chi-square is meaningful.
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

    /// True if the effect of the parameters depends on their values: through the posture they give, or through compliances
    /// among them.
    pub(super) fn depends_on_values(&self) -> bool {
        self.torque_posture == TorquePosture::Identified || self.acts_through_compliance
    }

    /// The loads of the nominal arm.
    pub(super) fn nominal_loads(&self) -> &LoadState {
        &self.nominal
    }

    /// True if an effect of the model acts through the unknown compliances.
    pub(super) fn acts_through_compliance(&self) -> bool {
        self.acts_through_compliance
    }

    /// Checks that every effect has a value at every sample.
    fn check_values(&self) -> Result<(), ProblemError> {
        for ((row, terms), sample) in self.rows.iter().zip(&self.nominal.rows).zip(&self.sample_ids) {
            let moving = self.nominal.patterns[terms.pattern].iter().zip(&terms.weights);
            if let Some((moves, _)) = { moving }.find(|(_, weight)| !weight.is_finite()) {
                let effect = &self.parameters[moves.parameter].effect;
                return Err(ProblemError::NoValue {
                    effect: effect.to_string(),
                    sample: sample.clone(),
                    expression: self.cells[row.cell].expression(effect, moves.site),
                });
            }
        }
        Ok(())
    }

    /// The value of every unknown at the start of the fit, as deviation from nominal, SI.
    pub fn start(&self) -> Vec<f64> {
        vec![0.0; self.parameters.len()]
    }
}
