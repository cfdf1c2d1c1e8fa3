//! Weighing the arm of every sample: the loads in its posture, and what each parameter moves under them.

use nalgebra::Vector3;
use rayon::prelude::*;

use super::abreast::{ABREAST, Abreast};
use super::moves::Moves;
use super::sample_row::{SampleRow, Scale};
use super::{Problem, STRETCH};
use crate::identify::TorquePosture;
use crate::robot::{InLane, Loads, LoadsAbreast, Payload, Robot, Weights};

/// Room for weighing the arm, of several samples at once.
pub(super) struct WeighingRoom {
    abreast: Abreast,
    weights: Weights<ABREAST>,
    all: LoadsAbreast<ABREAST>,
    loads: Loads,
}

impl WeighingRoom {
    pub(super) fn new(robot: &Robot) -> Self {
        WeighingRoom {
            abreast: Abreast::new(robot),
            weights: Weights::of(&Payload::none(), &Vector3::zeros()),
            all: LoadsAbreast::new(robot.joints()),
            loads: Loads::new(robot.joints()),
        }
    }
}

impl Problem {
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

    /// Weighs every sample's arm in the posture that `values` give; without values where the fit starts, and states the noise there.
    ///
    /// Before anything is known of them, joints are taken to be as compliant as is plausible: what acts through them would else seem to
    /// move nothing.
    pub(super) fn weigh(&mut self, values: Option<&[f64]>) {
        let drawn = self.torque_posture == TorquePosture::Drawn;
        let Problem { robot, setups, cells, rows, patterns, parameters, compliances, compliance, sample_ids, scale, .. } = self;
        let robot: &Robot = robot;
        compliance.fill(0.0);
        for &(joint, p) in compliances.iter() {
            compliance[joint] += values.map_or(parameters[p].spec.prior, |values| values[p]);
        }
        let standing = values.filter(|_| !drawn);
        // What moves each of a few rows, where that is other than the pattern it has.
        let weigh = |few: &mut [SampleRow], samples: &[String], patterns: &[Vec<Moves>], room: &mut WeighingRoom| {
            let WeighingRoom { abreast, weights, all, loads } = room;
            abreast.pose(robot, setups, patterns, few, standing);
            for (lane, row) in few.iter().enumerate() {
                weights.put(lane, row.payload(&cells[row.cell]), &setups[row.setup].gravity);
            }
            all.weigh(robot, abreast.postures(), weights);
            let mut others = [const { None }; ABREAST];
            for (lane, ((row, sample), other)) in few.iter_mut().zip(samples).zip(&mut others).enumerate() {
                let (setup, cell) = (&setups[row.setup], &cells[row.cell]);
                let posture = InLane { postures: abreast.postures(), lane };
                if values.is_none() {
                    row.state_noise(cell, &posture);
                }
                all.put_into(lane, weights, loads);
                let mut scale = Scale { robot, setup, posture: &posture, compliance, sample, loads };
                let expected = patterns.get(row.pattern).map_or(&[][..], Vec::as_slice);
                *other = row.weigh_moves(cell, &mut scale, expected);
            }
            others
        };
        let remember = |few: &mut [SampleRow], others: [Option<Vec<Moves>>; ABREAST], patterns: &mut Vec<Vec<Moves>>| {
            for (row, other) in few.iter_mut().zip(others) {
                if let Some(other) = other {
                    row.pattern = patterns.iter().position(|pattern| *pattern == other).unwrap_or_else(|| {
                        patterns.push(other);
                        patterns.len() - 1
                    });
                }
            }
        };
        // The first rows' pattern is mostly that of all.
        let begun = if rows.len() <= STRETCH { rows.len() } else { ABREAST };
        for (few, samples) in rows[..begun].chunks_mut(ABREAST).zip(sample_ids.chunks(ABREAST)) {
            let others = weigh(few, samples, patterns, scale);
            remember(few, others, patterns);
        }
        if begun == rows.len() {
            return;
        }
        let others: Vec<_> = rows[begun..]
            .par_chunks_mut(ABREAST)
            .zip(sample_ids[begun..].par_chunks(ABREAST))
            .with_min_len(STRETCH / ABREAST)
            .map_init(|| WeighingRoom::new(robot), |room, (few, samples)| weigh(few, samples, patterns, room))
            .collect();
        for (few, others) in rows[begun..].chunks_mut(ABREAST).zip(others) {
            remember(few, others, patterns);
        }
    }
}
