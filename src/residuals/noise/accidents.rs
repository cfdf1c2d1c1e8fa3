//! Bad postures: the accidents that they come from, in the order of measurement, and whether they stand together in the angle of one
//! joint: what errs there is the arm, and no accident.

use crate::identify::problem::Use;
use crate::measure::dataset::{NamedDataset, Sample};

/// Probability by chance, of all joints together, below which postures stand together.
const BY_CHANCE: f64 = 0.01;

/// The postures in the order in which they were measured: by the times of their first samples where all have one, otherwise in
/// that of the rows; dataset after dataset.
pub(super) fn in_time(datasets: &[NamedDataset<'_>], postures: &[Vec<usize>]) -> Vec<usize> {
    let of_dataset = |(d, data): (usize, &NamedDataset<'_>)| {
        let taken: Vec<&Sample> = data.dataset.samples.iter().filter(|s| Use::Fit.takes(s)).collect();
        let timed = taken.iter().all(|s| s.time_s.is_some());
        let time = |(k, s): (usize, &&Sample)| (d, if timed { s.time_s.unwrap_or_default() } else { k as f64 });
        taken.iter().enumerate().map(time).collect::<Vec<(usize, f64)>>()
    };
    let moments: Vec<(usize, f64)> = datasets.iter().enumerate().flat_map(of_dataset).collect();
    let mut order: Vec<usize> = (0..postures.len()).collect();
    let moment = |p: usize| moments[postures[p][0]];
    order.sort_by(|&a, &b| moment(a).0.cmp(&moment(b).0).then(moment(a).1.total_cmp(&moment(b).1)));
    order
}

/// Number of runs that these postures form: neighbours in time, or next but one, are of one accident.
pub(super) fn accidents(bad: &[usize], order: &[usize]) -> usize {
    let places: Vec<usize> = (0..order.len()).filter(|&k| bad.contains(&order[k])).collect();
    places.len() - places.windows(2).filter(|pair| pair[1] - pair[0] <= 2).count()
}

/// True if the chosen of these postures (rad or m, one entry a joint) lie in so small a part of the angles of one joint that chance
/// is no explanation: of k drawn from n, all are among w that follow each other with a probability of about k (w / n)^(k - 1).
pub(super) fn stand_together(postures: &[&[f64]], chosen: &[usize]) -> bool {
    let joints = postures.first().map_or(0, |q| q.len());
    let (all, count) = (postures.len() as f64, chosen.len() as f64);
    if chosen.len() < 3 {
        return false;
    }
    let is_narrow = |joint: usize| {
        let angles = || chosen.iter().map(|&k| postures[k][joint]);
        let (low, high) = angles().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)));
        let among = postures.iter().filter(|q| (low..=high).contains(&q[joint])).count() as f64;
        count * (among / all).powf(count - 1.0) * (joints as f64) < BY_CHANCE
    };
    (0..joints).any(is_narrow)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn neighbours_in_time_are_one_accident() {
        let order = [4, 2, 0, 1, 3, 5, 7, 6];
        assert_eq!(accidents(&[], &order), 0);
        assert_eq!(accidents(&[2, 0, 1], &order), 1);
        // One good one between them does not part two.
        assert_eq!(accidents(&[4, 0], &order), 1);
        assert_eq!(accidents(&[4, 1, 6], &order), 3);
    }

    #[test]
    fn a_narrow_range_of_one_joint_is_told_from_chance() {
        let postures: Vec<Vec<f64>> = (0..80).map(|k| (1..=6).map(|j| ((k * j) as f64 * 0.618).fract()).collect()).collect();
        let all: Vec<&[f64]> = postures.iter().map(Vec::as_slice).collect();
        let narrow: Vec<usize> = (0..80).filter(|&k| (0.4..0.5).contains(&postures[k][2])).collect();
        assert!(narrow.len() >= 5 && stand_together(&all, &narrow));
        assert!(!stand_together(&all, &[3, 20, 37, 55, 71]) && !stand_together(&all, &[3, 4]));
    }
}
