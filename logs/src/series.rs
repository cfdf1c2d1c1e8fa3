//! Numbers over time in the order of their times, with how far each of them ranges.

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
