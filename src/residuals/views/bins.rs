//! Bins of a variable: equal counts, or one bin per value if there are few values.

/// Largest number of bins, for a variable with many values.
const MOST: usize = 10;

/// Number of samples that a bin should contain at least.
const FEWEST: usize = 8;

/// A variable with no more values than this has one bin per value.
const FEW_VALUES: usize = 6;

/// Samples sorted into bins by one variable.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Bins {
    /// Bin of every sample; `None` if the variable is unknown.
    pub of: Vec<Option<u8>>,
    /// Mean, smallest and largest value in each bin.
    pub x: Vec<[f64; 3]>,
    /// Number of samples in each bin.
    pub counts: Vec<usize>,
}

impl Bins {
    /// Sorts samples into bins; `None` if the variable does not vary or is known for too few samples.
    pub fn new(values: impl Iterator<Item = Option<f64>>) -> Option<Self> {
        let values: Vec<Option<f64>> = values.collect();
        let mut order: Vec<(f64, usize)> =
            values.iter().enumerate().filter_map(|(i, v)| Some(((*v).filter(|v| v.is_finite())?, i))).collect();
        order.sort_by(|a, b| a.0.total_cmp(&b.0));
        let n = order.len();
        let steps = order.windows(2).filter(|w| w[1].0 > w[0].0).count();
        if steps == 0 {
            return None;
        }
        let wanted = if steps < FEW_VALUES { n } else { (n / FEWEST).clamp(2, MOST) };
        let mut bins = Bins { of: vec![None; values.len()], x: Vec::new(), counts: Vec::new() };
        let mut start = 0;
        while start < n {
            // The remaining samples are divided evenly; a bin ends only where the value changes.
            let left = wanted.saturating_sub(bins.counts.len()).max(1);
            let mut end = (start + (n - start).div_ceil(left)).clamp(start + 1, n);
            while end < n && order[end].0 == order[end - 1].0 {
                end += 1;
            }
            let inside = &order[start..end];
            inside.iter().for_each(|&(_, i)| bins.of[i] = Some(bins.counts.len() as u8));
            let mean = inside.iter().map(|(v, _)| v).sum::<f64>() / inside.len() as f64;
            bins.x.push([mean, inside[0].0, inside[inside.len() - 1].0]);
            bins.counts.push(inside.len());
            start = end;
        }
        (bins.counts.len() > 1).then_some(bins)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn many_values_make_ten_equal_bins() {
        let bins = Bins::new((0..1000).map(|k| Some(f64::from((k * 7) % 1000)))).expect("it varies");
        assert_eq!(bins.counts, [100; 10]);
        assert_eq!(bins.x[0], [49.5, 0.0, 99.0]);
        assert_eq!(bins.of[1], Some(0));
    }

    #[test]
    fn few_values_make_a_bin_each_and_ties_stay_together() {
        let bins = Bins::new([1.0, -1.0, 1.0, 0.0, 1.0].into_iter().map(Some).chain([None])).expect("it varies");
        assert_eq!((bins.counts, bins.of[5]), (vec![1, 1, 3], None));
        let bins = Bins::new((0..200).map(|k| Some(f64::from(k / 20)))).expect("it varies");
        assert_eq!(bins.counts, [20; 10]);
        let heap = (0..100).map(|k| Some(if k < 90 { 5.0 } else { f64::from(k) }));
        let bins = Bins::new(heap).expect("it varies");
        assert_eq!((bins.counts[0], bins.counts.iter().sum::<usize>()), (90, 100));
        assert!(Bins::new((0..9).map(|_| Some(3.0))).is_none());
    }
}
