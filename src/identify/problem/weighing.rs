//! Weighing the arm of every sample: the loads in its posture, and what each parameter moves under them.

use rayon::prelude::*;

use super::linearised::Workspace;
use super::sample_row::{Moves, SampleRow, Scale};
use super::{Problem, STRETCH};
use crate::identify::TorquePosture;
use crate::robot::{Loads, Robot};

/// Room for weighing the arm.
pub(super) struct WeighingRoom {
    work: Workspace,
    loads: Loads,
}

impl WeighingRoom {
    pub(super) fn new(robot: &Robot) -> Self {
        WeighingRoom { work: Workspace::new(robot), loads: Loads::new(robot.joints()) }
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
        let weigh = |row: &mut SampleRow, sample: &str, patterns: &[Vec<Moves>], room: &mut WeighingRoom| {
            let WeighingRoom { work, loads } = room;
            let (setup, cell) = (&setups[row.setup], &cells[row.cell]);
            work.deviations.fill(0.0);
            if let Some(values) = values.filter(|_| !drawn) {
                row.deviate(&patterns[row.pattern], values, |place, by| work.deviations[place] += by);
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
}
