//! Postures in the order in which they were measured, and the accidents that bad ones among them come from.

use crate::identify::problem::Use;
use crate::measure::dataset::{NamedDataset, Sample};

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
}
