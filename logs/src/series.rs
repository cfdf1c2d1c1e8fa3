//! Numbers over time in the order of their times, with how far each of them ranges.

use crate::log::Track;

/// Rows of numbers over time.
#[derive(Debug, Clone, Default)]
pub(crate) struct Series {
    /// When, s; they do not decrease.
    pub times: Vec<f64>,
    /// The numbers, a row for each time.
    pub values: Vec<f64>,
    /// How far each number of a row ranges over all rows; zero of one that never changes.
    pub ranges: Vec<f64>,
}

impl Series {
    /// The rows in the order of their times.
    pub fn sorted(times: &[f64], values: &[f64], width: usize) -> Self {
        let mut order: Vec<usize> = (0..times.len()).collect();
        order.sort_by(|&a, &b| times[a].total_cmp(&times[b]));
        let rows = order.iter().flat_map(|&k| values[k * width..(k + 1) * width].iter().copied());
        Self::new(order.iter().map(|&k| times[k]).collect(), rows.collect(), width)
    }

    /// The rows of a track in the order of their times; the two signs in which a rotation can be written do not alternate.
    pub fn turning(times: &[f64], track: &Track) -> Self {
        let mut series = Self::sorted(times, &track.values, track.titles.len());
        let Some(at) = track.titles.iter().position(|title| title == "qx") else { return series };
        let mut last: Option<[f64; 4]> = None;
        for row in series.values.chunks_exact_mut(track.titles.len()) {
            let turn = &mut row[at..at + 4];
            let agrees = last.is_none_or(|last| last.iter().zip(&*turn).map(|(a, b)| a * b).sum::<f64>() >= 0.0);
            if !agrees {
                turn.iter_mut().for_each(|v| *v = -*v);
            }
            if turn.iter().all(|v| v.is_finite()) {
                last = Some([turn[0], turn[1], turn[2], turn[3]]);
            }
        }
        series
    }

    /// Rows that are in the order of their times.
    pub fn new(times: Vec<f64>, values: Vec<f64>, width: usize) -> Self {
        let range = |c: usize| {
            let of = values.iter().skip(c).step_by(width).filter(|v| v.is_finite());
            let (low, high) = of.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), &v| (low.min(v), high.max(v)));
            if high > low { high - low } else { 0.0 }
        };
        let ranges = (0..width).map(range).collect();
        Series { times, values, ranges }
    }
}

/// The usual time from one row to the next, s: the median; `None` of fewer than two.
pub(crate) fn period(times: &[f64]) -> Option<f64> {
    let mut periods: Vec<f64> = times.windows(2).map(|w| w[1] - w[0]).collect();
    periods.sort_unstable_by(f64::total_cmp);
    periods.get(periods.len() / 2).copied()
}
