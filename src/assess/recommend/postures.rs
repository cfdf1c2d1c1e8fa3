//! The posture is the unit of information: repeats and several targets at one posture share what the arm does there.

use std::collections::BTreeMap;

use crate::identify::Circumstance;
use crate::units::DEG;

/// Joints that all agree to this are the same posture, rad.
const SAME: f64 = 0.01 * DEG;

/// Samples by posture, in the order in which the postures were first taken.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Postures {
    /// Posture of each sample.
    pub of: Vec<usize>,
    /// Samples of each posture.
    pub samples: Vec<Vec<usize>>,
}

impl Postures {
    /// Groups samples whose joint angles agree, whatever their set-up.
    pub fn new(circumstances: &[Circumstance]) -> Self {
        let mut place: BTreeMap<Vec<i64>, usize> = BTreeMap::new();
        let mut postures = Postures { of: Vec::with_capacity(circumstances.len()), samples: Vec::new() };
        for (sample, at) in circumstances.iter().enumerate() {
            let posture = same_cell(&at.q, &place).unwrap_or_else(|| {
                place.insert(cell(&at.q), postures.samples.len());
                postures.samples.push(Vec::new());
                postures.samples.len() - 1
            });
            postures.of.push(posture);
            postures.samples[posture].push(sample);
        }
        postures
    }

    /// Number of postures.
    pub fn len(&self) -> usize {
        self.samples.len()
    }
}

fn cell(q: &[f64]) -> Vec<i64> {
    q.iter().map(|q| (q / SAME).round() as i64).collect()
}

/// The posture in the cell of these joints; a reading that falls just across a boundary is sought on its other side.
fn same_cell(q: &[f64], place: &BTreeMap<Vec<i64>, usize>) -> Option<usize> {
    let own = cell(q);
    if let Some(posture) = place.get(&own) {
        return Some(*posture);
    }
    let near = |(k, q): (usize, &f64)| {
        let off = q / SAME - own[k] as f64;
        (off.abs() > 0.4).then_some((k, if off > 0.0 { 1 } else { -1 }))
    };
    let steps: Vec<(usize, i64)> = q.iter().enumerate().filter_map(near).collect();
    steps.iter().find_map(|&(k, step)| {
        let mut other = own.clone();
        other[k] += step;
        place.get(&other).copied()
    })
}
