//! The middle of what was read while the arm stood, and how it scatters.

use crate::log::Track;
use crate::series::Series;
use crate::windows::Still;

/// Readings of an interval that scatter by more than this multiple of the median interval were taken while something moved.
const UNSTEADY: f64 = 8.0;
/// Fewest readings whose scatter is judged.
pub(crate) const FEWEST_READINGS: usize = 5;
/// Fewest intervals whose median scatter is a measure.
const FEWEST_INTERVALS: usize = 8;
/// Share of the range of a column beyond which two readings at rest are a jump from one end of its range to the other, as of an
/// angle at half a turn.
const JUMP: f64 = 0.5;

/// The middle of readings, and how they scatter.
#[derive(Debug, Clone)]
pub(crate) struct Middle {
    pub values: Vec<f64>,
    /// One-sigma of a reading of each number; zero if it cannot be known.
    pub scatter: Vec<f64>,
    pub readings: usize,
}

/// A rest, and the middle of what each track states then.
#[derive(Debug, Clone)]
pub(crate) struct Row {
    pub still: Still,
    pub middles: Vec<Option<Middle>>,
}

/// The middle of what a track states in an interval; `None` if it states nothing, or not all of a place.
pub(crate) fn middle(track: &Track, series: &Series, interval: [f64; 2]) -> Option<Middle> {
    let width = track.titles.len();
    let [from, to] = interval.map(|t| series.times.partition_point(|&at| at < t));
    let rows: Vec<&[f64]> = series.values[from * width..to * width].chunks_exact(width).collect();
    if rows.is_empty() {
        return None;
    }
    let quaternion = track.titles.iter().position(|title| title == "qx");
    let sign = |row: &[f64]| match quaternion {
        Some(at) if (0..4).map(|k| row[at + k] * rows[0][at + k]).sum::<f64>() < 0.0 => -1.0,
        _ => 1.0,
    };
    let mut middle = Middle { values: Vec::new(), scatter: Vec::new(), readings: rows.len() };
    for c in 0..width {
        let turned = quaternion.is_some_and(|at| (at..at + 4).contains(&c));
        let of = rows.iter().map(|row| row[c] * if turned { sign(row) } else { 1.0 });
        let mut column: Vec<f64> = of.filter(|v| v.is_finite()).collect();
        if column.is_empty() {
            middle.values.push(f64::NAN);
            middle.scatter.push(0.0);
            continue;
        }
        column.sort_unstable_by(f64::total_cmp);
        let (value, scatter) = mean_of_middle(&column, series.ranges[c]);
        middle.values.push(value);
        middle.scatter.push(scatter);
    }
    if let Some(at) = quaternion {
        let length = middle.values[at..at + 4].iter().map(|v| v * v).sum::<f64>().sqrt();
        middle.values[at..at + 4].iter_mut().for_each(|v| *v /= length);
    }
    middle.values.iter().any(|v| v.is_finite()).then_some(middle)
}

/// The mean of the middle half of sorted readings, which a few wrong ones do not move, and the one-sigma of a reading by the same
/// half. An angle that jumps between the ends of its range is taken at one end.
fn mean_of_middle(sorted: &[f64], range: f64) -> (f64, f64) {
    /// Half of the width of the middle half of a normal variate, in its one-sigma.
    const QUARTILE: f64 = 0.674_49;
    let n = sorted.len();
    if n > 1 && sorted[n - 1] - sorted[0] > JUMP * range && range > 0.0 && n >= 3 {
        return (sorted[n / 2], 0.0);
    }
    let (from, to) = (n / 4, n - n / 4);
    let half = &sorted[from..to];
    let mean = half.iter().sum::<f64>() / half.len() as f64;
    let scatter = if n >= FEWEST_READINGS { (sorted[n - 1 - n / 4] - sorted[n / 4]) / (2.0 * QUARTILE) } else { 0.0 };
    (mean, scatter)
}

/// Which rows scatter far more than others, in the ranges of their columns.
pub(crate) fn unsteady<'a>(rows: impl Iterator<Item = &'a [Option<Middle>]>, ranges: &[f64]) -> Vec<bool> {
    let size = |middle: &Middle| {
        let share = |c: usize| if ranges[c] > 0.0 { middle.scatter[c] / ranges[c] } else { 0.0 };
        (0..ranges.len()).map(|c| share(c).powi(2)).sum::<f64>().sqrt()
    };
    let of =
        |row: &'a [Option<Middle>]| row.first().and_then(Option::as_ref).filter(|m| m.readings >= FEWEST_READINGS).map(size);
    let sizes: Vec<Option<f64>> = rows.map(of).collect();
    let mut known: Vec<f64> = sizes.iter().flatten().copied().collect();
    if known.len() < FEWEST_INTERVALS {
        return vec![false; sizes.len()];
    }
    known.sort_unstable_by(f64::total_cmp);
    let usual = known[known.len() / 2];
    sizes.iter().map(|size| usual > 0.0 && size.is_some_and(|size| size > UNSTEADY * usual)).collect()
}
