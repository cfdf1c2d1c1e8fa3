//! Gravity loads of every sample, and the effect of each parameter under them.
//!
//! The loads depend on the posture, the posture on the parameters. [`Problem`] stores only those of the nominal arm; those
//! at other values are in a separate [`LoadState`], so that no evaluation depends on an earlier one.

use std::borrow::Cow;

use nalgebra::Vector3;
use rayon::prelude::*;

use super::Problem;
use super::batch::{BATCH, Batch, STRETCH};
use super::error::ProblemError;
use super::jacobian_pattern::JacobianPattern;
use super::load_state::{Deviating, LoadState, RowTerms};
use super::sample_row::EvaluationContext;
use crate::identify::TorquePosture;
use crate::robot::Robot;
use crate::robot::kinematics::LanePosture;
use crate::robot::statics::{Loads, LoadsBatch, Payload, Weights};

/// Workspace for the loads of a batch of samples.
pub(in crate::identify) struct LoadWorkspace {
    pub(super) batch: Batch,
    pub(super) weights: Weights<BATCH>,
    pub(super) all: LoadsBatch<BATCH>,
    pub(super) loads: Loads,
}

impl LoadWorkspace {
    pub(in crate::identify) fn new(robot: &Robot) -> Self {
        LoadWorkspace {
            batch: Batch::new(robot),
            weights: Weights::of(&Payload::none(), &Vector3::zeros()),
            all: LoadsBatch::new(robot.joints()),
            loads: Loads::new(robot.joints()),
        }
    }
}

/// The arm of a batch of rows.
struct ArmState<'a> {
    /// Its deviations; `None` for the nominal arm.
    deviating: Option<Deviating<'a>>,
    /// Compliance of each joint, rad/(N·m).
    compliance: &'a [f64],
    /// Known patterns of the Jacobian.
    patterns: &'a [Vec<JacobianPattern>],
}

impl Problem {
    /// Computes the loads at `values`, so that evaluations at exactly these values need not compute them again.
    ///
    /// This changes no result.
    pub fn update_loads(&mut self, values: &[f64]) {
        self.cached = match self.load_state(values) {
            Cow::Owned(state) => Some((values.to_vec(), state)),
            Cow::Borrowed(_) => return,
        };
    }

    /// The loads at `values`: those of the nominal arm if nothing deviates or nothing depends on the values.
    pub(in crate::identify) fn load_state(&self, values: &[f64]) -> Cow<'_, LoadState> {
        if !self.depends_on_values() || values.iter().all(|&v| v == 0.0) {
            return Cow::Borrowed(&self.nominal);
        }
        if let Some((_, state)) = self.cached.as_ref().filter(|(at, _)| at == values) {
            return Cow::Borrowed(state);
        }
        let (mut once, mut twice) = (LoadState::default(), LoadState::default());
        self.settle(values, [&mut once, &mut twice], &mut LoadWorkspace::new(&self.robot));
        Cow::Owned(twice)
    }

    /// Computes the loads at `values` into the second of the two states: in the posture under the nominal loads, then in
    /// the posture under these, which leaves an error of a millionth.
    pub(in crate::identify) fn settle(&self, values: &[f64], states: [&mut LoadState; 2], room: &mut LoadWorkspace) {
        let [once, twice] = states;
        self.load(&self.nominal, values, once, room);
        self.load(once, values, twice, room);
    }

    /// Computes the loads of the arm in the posture given by `values` under the loads `under`.
    pub(in crate::identify) fn load(&self, under: &LoadState, values: &[f64], into: &mut LoadState, room: &mut LoadWorkspace) {
        into.compliance.resize(self.robot.joints(), 0.0);
        into.compliance.fill(0.0);
        for &(joint, p) in &self.compliances {
            into.compliance[joint] += values[p];
        }
        let nominal = self.torque_posture == TorquePosture::Drawn;
        self.load_rows((!nominal).then_some((under, values)), into, room);
    }

    /// Computes the loads of the nominal arm, and the noise there.
    ///
    /// Until the compliances are known, joints are assumed to have their plausible compliance: otherwise effects acting
    /// through them would seem to move nothing.
    ///
    /// # Errors
    /// When the noise of a sample is not finite.
    pub(super) fn load_nominal(&mut self) -> Result<(), ProblemError> {
        self.cached = None;
        let mut state = std::mem::take(&mut self.nominal);
        let mut room = self.room.take().unwrap_or_else(|| LoadWorkspace::new(&self.robot));
        state.compliance.resize(self.robot.joints(), 0.0);
        state.compliance.fill(0.0);
        for &(joint, p) in &self.compliances {
            state.compliance[joint] += self.parameters[p].spec.prior;
        }
        self.load_rows(None, &mut state, &mut room);
        self.nominal = state;
        let stated = self.state_noise(&mut room.batch);
        self.room = Some(room);
        stated
    }

    fn state_noise(&mut self, batch: &mut Batch) -> Result<(), ProblemError> {
        let Problem { robot, setups, cells, rows, sample_ids, .. } = self;
        for (few, ids) in rows.chunks_mut(BATCH).zip(sample_ids.chunks(BATCH)) {
            batch.pose(robot, setups, few, None);
            for ((lane, row), id) in few.iter_mut().enumerate().zip(ids) {
                row.state_noise(&cells[row.cell], &LanePosture { postures: batch.postures(), lane })
                    .map_err(|_| ProblemError::NoiseNotFinite { sample: id.clone() })?;
            }
        }
        Ok(())
    }

    /// Computes the loads of every sample's arm in the posture of the given values and loads; of the nominal arm if there
    /// are none.
    fn load_rows(&self, state: Option<(&LoadState, &[f64])>, into: &mut LoadState, room: &mut LoadWorkspace) {
        let LoadState { compliance, patterns, rows: terms } = into;
        if patterns.is_empty() {
            patterns.clone_from(&self.nominal.patterns);
        }
        if terms.len() != self.rows.len() {
            terms.clone_from(&self.nominal.rows);
            terms.resize_with(self.rows.len(), RowTerms::default);
        }
        let compliance: &[f64] = compliance;
        let few = |first: usize, terms: &mut [RowTerms], patterns: &[Vec<JacobianPattern>], room: &mut LoadWorkspace| {
            let deviating = state.map(|(state, values)| state.deviating(values, first));
            self.load_few(first, &ArmState { deviating, compliance, patterns }, terms, room)
        };
        // The pattern of the first rows usually applies to all.
        let begun = if terms.len() <= STRETCH { terms.len() } else { BATCH };
        for (chunk, terms) in terms[..begun].chunks_mut(BATCH).enumerate() {
            let others = few(chunk * BATCH, terms, patterns, room);
            remember(terms, others, patterns);
        }
        if begun == terms.len() {
            return;
        }
        let others: Vec<_> = terms[begun..]
            .par_chunks_mut(BATCH)
            .enumerate()
            .with_min_len(STRETCH / BATCH)
            .map_init(
                || LoadWorkspace::new(&self.robot),
                |room, (chunk, terms)| few(begun + chunk * BATCH, terms, patterns, room),
            )
            .collect();
        for (terms, others) in terms[begun..].chunks_mut(BATCH).zip(others) {
            remember(terms, others, patterns);
        }
    }

    /// The same for at most [`BATCH`] rows; returns the moves of each row that differ from its pattern.
    fn load_few(
        &self,
        first: usize,
        arm: &ArmState<'_>,
        terms: &mut [RowTerms],
        room: &mut LoadWorkspace,
    ) -> [Option<Vec<JacobianPattern>>; BATCH] {
        let &ArmState { deviating, compliance, patterns } = arm;
        let LoadWorkspace { batch, weights, all, loads } = room;
        let few = first..first + terms.len();
        let (rows, samples) = (&self.rows[few.clone()], &self.sample_ids[few]);
        batch.pose(&self.robot, &self.setups, rows, deviating);
        for (lane, row) in rows.iter().enumerate() {
            weights.put(lane, row.payload(&self.cells[row.cell]), &self.setups[row.setup].gravity);
        }
        all.compute(&self.robot, batch.postures(), weights);
        let mut others = [const { None }; BATCH];
        for (lane, ((row, sample), terms)) in rows.iter().zip(samples).zip(terms).enumerate() {
            let (setup, cell) = (&self.setups[row.setup], &self.cells[row.cell]);
            let posture = LanePosture { postures: batch.postures(), lane };
            all.put_into(lane, weights, loads);
            let mut context = EvaluationContext { robot: &self.robot, setup, posture: &posture, compliance, sample, loads };
            let expected = patterns.get(terms.pattern).map_or(&[][..], Vec::as_slice);
            others[lane] = row.weighted_terms(cell, &mut context, expected, &mut terms.weights);
        }
        others
    }
}

fn remember(terms: &mut [RowTerms], others: [Option<Vec<JacobianPattern>>; BATCH], patterns: &mut Vec<Vec<JacobianPattern>>) {
    for (terms, other) in terms.iter_mut().zip(others) {
        if let Some(other) = other {
            terms.pattern = patterns.iter().position(|pattern| *pattern == other).unwrap_or_else(|| {
                patterns.push(other);
                patterns.len() - 1
            });
        }
    }
}
