//! Gravity loads of every sample, and what each parameter moves under them.
//!
//! They depend on the posture, the posture on the parameters. [`Problem`] keeps those of the nominal arm alone; what holds at other values
//! is a [`LoadState`] of its own, so that no evaluation depends on an earlier one.

use std::borrow::Cow;

use nalgebra::Vector3;
use rayon::prelude::*;

use super::abreast::{ABREAST, Abreast, Deviating};
use super::moves::Moves;
use super::sample_row::Scale;
use super::{Problem, STRETCH};
use crate::identify::TorquePosture;
use crate::robot::{InLane, Loads, LoadsAbreast, Payload, Robot, Weights};

/// Workspace for the loads of several samples at once.
pub(in crate::identify) struct WeighingRoom {
    abreast: Abreast,
    weights: Weights<ABREAST>,
    all: LoadsAbreast<ABREAST>,
    loads: Loads,
}

impl WeighingRoom {
    pub(in crate::identify) fn new(robot: &Robot) -> Self {
        WeighingRoom {
            abreast: Abreast::new(robot),
            weights: Weights::of(&Payload::none(), &Vector3::zeros()),
            all: LoadsAbreast::new(robot.joints()),
            loads: Loads::new(robot.joints()),
        }
    }
}

/// How much of each parameter moves one sample.
#[derive(Debug, Clone, Default)]
pub(super) struct RowTerms {
    /// What moves the TCP, by place among the patterns: most samples are moved by the same parameters at the same sites.
    pub pattern: usize,
    /// How much of each parameter of the pattern.
    pub weights: Vec<f64>,
}

impl RowTerms {
    /// Calls `add(place, by)` for every site that deviates when the parameters that move them have `values`.
    #[inline]
    pub fn deviate(&self, pattern: &[Moves], values: &[f64], mut add: impl FnMut(usize, f64)) {
        for (moves, weight) in pattern.iter().zip(&self.weights) {
            let value = values[moves.parameter];
            // As all are where a fit starts, and those always that the data cannot tell.
            if value != 0.0 {
                add(moves.place, weight * value);
            }
        }
    }
}

/// How much of each parameter moves every sample, under the loads of one posture each.
#[derive(Debug, Clone, Default)]
pub(in crate::identify) struct LoadState {
    /// Compliance of each joint, rad/(N·m).
    pub(super) compliance: Vec<f64>,
    pub(super) patterns: Vec<Vec<Moves>>,
    pub(super) rows: Vec<RowTerms>,
}

impl LoadState {
    /// For evaluating at `values` the rows from `first` on.
    pub(super) fn deviating<'a>(&'a self, values: &'a [f64], first: usize) -> Deviating<'a> {
        Deviating { values, patterns: &self.patterns, terms: &self.rows[first..] }
    }
}

impl Problem {
    /// Computes the loads at `values`, so that evaluations at exactly these values need not compute them again.
    ///
    /// This changes no result.
    pub fn settle_loads(&mut self, values: &[f64]) {
        self.settled = match self.load_state(values) {
            Cow::Owned(state) => Some((values.to_vec(), state)),
            Cow::Borrowed(_) => return,
        };
    }

    /// The loads at `values`: those of the nominal arm where nothing deviates or nothing depends on the values.
    pub(in crate::identify) fn load_state(&self, values: &[f64]) -> Cow<'_, LoadState> {
        if !self.depends_on_values() || values.iter().all(|&v| v == 0.0) {
            return Cow::Borrowed(&self.drawn);
        }
        if let Some((_, state)) = self.settled.as_ref().filter(|(at, _)| at == values) {
            return Cow::Borrowed(state);
        }
        let (mut once, mut twice) = (LoadState::default(), LoadState::default());
        self.settle(values, [&mut once, &mut twice], &mut WeighingRoom::new(&self.robot));
        Cow::Owned(twice)
    }

    /// Computes the loads at `values` into the second of the two states: in the posture under the nominal loads, then in the posture under
    /// these, which leaves a millionth.
    pub(in crate::identify) fn settle(&self, values: &[f64], states: [&mut LoadState; 2], room: &mut WeighingRoom) {
        let [once, twice] = states;
        self.load(&self.drawn, values, once, room);
        self.load(once, values, twice, room);
    }

    /// Computes the loads of the arm in the posture that `values` give under the loads `under`.
    pub(in crate::identify) fn load(&self, under: &LoadState, values: &[f64], into: &mut LoadState, room: &mut WeighingRoom) {
        into.compliance.resize(self.robot.joints(), 0.0);
        into.compliance.fill(0.0);
        for &(joint, p) in &self.compliances {
            into.compliance[joint] += values[p];
        }
        let nominal = self.torque_posture == TorquePosture::Drawn;
        self.load_rows((!nominal).then_some((under, values)), into, room);
    }

    /// Computes the loads of the nominal arm, and states the noise there.
    ///
    /// Before anything is known of them, joints are taken to be as compliant as is plausible: what acts through them would else seem to
    /// move nothing.
    pub(super) fn load_nominal(&mut self) {
        self.settled = None;
        let mut state = std::mem::take(&mut self.drawn);
        let mut room = std::mem::replace(&mut self.room, None).unwrap_or_else(|| WeighingRoom::new(&self.robot));
        state.compliance.resize(self.robot.joints(), 0.0);
        state.compliance.fill(0.0);
        for &(joint, p) in &self.compliances {
            state.compliance[joint] += self.parameters[p].spec.prior;
        }
        self.load_rows(None, &mut state, &mut room);
        self.drawn = state;
        self.state_noise(&mut room.abreast);
        self.room = Some(room);
    }

    fn state_noise(&mut self, abreast: &mut Abreast) {
        let Problem { robot, setups, cells, rows, .. } = self;
        for few in rows.chunks_mut(ABREAST) {
            abreast.pose(robot, setups, few, None);
            for (lane, row) in few.iter_mut().enumerate() {
                row.state_noise(&cells[row.cell], &InLane { postures: abreast.postures(), lane });
            }
        }
    }

    /// Computes the loads of every sample's arm in the posture of the values under those loads; of the nominal one without them.
    fn load_rows(&self, standing: Option<(&LoadState, &[f64])>, into: &mut LoadState, room: &mut WeighingRoom) {
        let LoadState { compliance, patterns, rows: terms } = into;
        if patterns.is_empty() {
            patterns.clone_from(&self.drawn.patterns);
        }
        if terms.len() != self.rows.len() {
            terms.clone_from(&self.drawn.rows);
            terms.resize_with(self.rows.len(), RowTerms::default);
        }
        let compliance: &[f64] = compliance;
        let few = |first: usize, terms: &mut [RowTerms], patterns: &[Vec<Moves>], room: &mut WeighingRoom| {
            let deviating = standing.map(|(state, values)| state.deviating(values, first));
            self.load_few(first, deviating, compliance, patterns, terms, room)
        };
        // The first rows' pattern is mostly that of all.
        let begun = if terms.len() <= STRETCH { terms.len() } else { ABREAST };
        for (chunk, terms) in terms[..begun].chunks_mut(ABREAST).enumerate() {
            let others = few(chunk * ABREAST, terms, patterns, room);
            remember(terms, others, patterns);
        }
        if begun == terms.len() {
            return;
        }
        let others: Vec<_> = terms[begun..]
            .par_chunks_mut(ABREAST)
            .enumerate()
            .with_min_len(STRETCH / ABREAST)
            .map_init(
                || WeighingRoom::new(&self.robot),
                |room, (chunk, terms)| few(begun + chunk * ABREAST, terms, patterns, room),
            )
            .collect();
        for (terms, others) in terms[begun..].chunks_mut(ABREAST).zip(others) {
            remember(terms, others, patterns);
        }
    }

    /// The same of no more than [`ABREAST`] rows; what moves each, where that is other than the pattern it has.
    fn load_few(
        &self,
        first: usize,
        deviating: Option<Deviating<'_>>,
        compliance: &[f64],
        patterns: &[Vec<Moves>],
        terms: &mut [RowTerms],
        room: &mut WeighingRoom,
    ) -> [Option<Vec<Moves>>; ABREAST] {
        let WeighingRoom { abreast, weights, all, loads } = room;
        let few = first..first + terms.len();
        let (rows, samples) = (&self.rows[few.clone()], &self.sample_ids[few]);
        abreast.pose(&self.robot, &self.setups, rows, deviating);
        for (lane, row) in rows.iter().enumerate() {
            weights.put(lane, row.payload(&self.cells[row.cell]), &self.setups[row.setup].gravity);
        }
        all.weigh(&self.robot, abreast.postures(), weights);
        let mut others = [const { None }; ABREAST];
        for (lane, ((row, sample), terms)) in rows.iter().zip(samples).zip(terms).enumerate() {
            let (setup, cell) = (&self.setups[row.setup], &self.cells[row.cell]);
            let posture = InLane { postures: abreast.postures(), lane };
            all.put_into(lane, weights, loads);
            let mut scale = Scale { robot: &self.robot, setup, posture: &posture, compliance, sample, loads };
            let expected = patterns.get(terms.pattern).map_or(&[][..], Vec::as_slice);
            others[lane] = row.weigh_moves(cell, &mut scale, expected, &mut terms.weights);
        }
        others
    }
}

fn remember(terms: &mut [RowTerms], others: [Option<Vec<Moves>>; ABREAST], patterns: &mut Vec<Vec<Moves>>) {
    for (terms, other) in terms.iter_mut().zip(others) {
        if let Some(other) = other {
            terms.pattern = patterns.iter().position(|pattern| *pattern == other).unwrap_or_else(|| {
                patterns.push(other);
                patterns.len() - 1
            });
        }
    }
}
