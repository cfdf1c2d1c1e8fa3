//! Covariances of a campaign's rows, computed once for each group, and their sum for any sizes.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::rows::{Groups, Rows};
use crate::math::linalg;

/// Numbers of a joint's kernels from which on they are worth several threads.
const MANY: usize = 1 << 20;

/// Products of the functions of every group at every pair of samples. Only one of two equal numbers is kept: the lower
/// triangle by columns, one column of a matrix for each group.
pub(super) struct Kernels {
    /// For each joint of the basis: pairs of samples x groups.
    joints: Vec<DMatrix<f64>>,
    /// Covariance of the rows by the model's own columns.
    smooth: DMatrix<f64>,
}

/// Memory of a sum of kernels.
pub(super) struct Room {
    scaled: DMatrix<f64>,
    angles: Vec<DVector<f64>>,
    column: DVector<f64>,
    sample_of: Vec<usize>,
}

impl Room {
    pub fn new(rows: &Rows) -> Self {
        let pairs = rows.samples.len() * (rows.samples.len() + 1) / 2;
        Room {
            scaled: DMatrix::zeros(rows.count(), rows.effects.ncols()),
            angles: rows.levers.iter().map(|_| DVector::zeros(pairs)).collect(),
            column: DVector::zeros(rows.count()),
            sample_of: rows.samples.iter().enumerate().flat_map(|(s, own)| own.clone().map(move |_| s)).collect(),
        }
    }
}

/// First of the pairs of a sample with itself and those after it, of `count`.
fn first_pair(sample: usize, count: usize) -> usize {
    sample * count - sample * sample.saturating_sub(1) / 2
}

impl Kernels {
    pub fn new(rows: &Rows, groups: &Groups) -> Self {
        let n = rows.samples.len();
        let of_joint = |(functions, spans): (&DMatrix<f64>, &Vec<std::ops::Range<usize>>)| {
            let mut packed = DMatrix::zeros(n * (n + 1) / 2, spans.len());
            let length = packed.nrows().max(1);
            packed.as_mut_slice().par_chunks_mut(length).zip(spans).for_each(|(to, span)| {
                let mut whole = DMatrix::zeros(n, n);
                linalg::normal_matrix(&functions.columns(span.start, span.len()).into_owned(), &mut whole);
                for s in 0..n {
                    let first = first_pair(s, n);
                    to[first..first + n - s].copy_from_slice(&whole.column(s).as_slice()[s..]);
                }
            });
            packed
        };
        let joints = rows.functions.iter().zip(&groups.spans).map(of_joint).collect();
        let mut smooth = DMatrix::zeros(rows.count(), rows.count());
        linalg::normal_matrix(&rows.smooth, &mut smooth);
        Kernels { joints, smooth }
    }

    /// Writes the covariance of the rows for groups of the variances `sizes`, without noise, into the lower triangle of `to`.
    pub fn sum(&self, rows: &Rows, groups: &Groups, sizes: &[f64], room: &mut Room, to: &mut DMatrix<f64>) {
        let Room { scaled, angles, column, sample_of } = room;
        scaled.copy_from(&rows.effects);
        for (span, size) in groups.effects.iter().zip(sizes) {
            scaled.columns_mut(span.start, span.len()).scale_mut(size.sqrt());
        }
        linalg::normal_matrix(scaled, to);
        *to += &self.smooth;
        let n = rows.samples.len();
        for ((packed, first), angles) in self.joints.iter().zip(&groups.first).zip(angles.iter_mut()) {
            angles.fill(0.0);
            for (kernel, size) in packed.column_iter().zip(&sizes[*first..]) {
                angles.axpy(*size, &kernel, 1.0);
            }
        }
        let end = sample_of.len();
        for (t, own) in rows.samples.iter().enumerate() {
            let (start, pairs) = (own.start, first_pair(t, n));
            for (angles, lever) in angles.iter().zip(&rows.levers) {
                let of_samples = &angles.as_slice()[pairs..pairs + n - t];
                let cells = column.as_mut_slice()[start..end].iter_mut().zip(&lever.as_slice()[start..end]);
                cells.zip(&sample_of[start..end]).for_each(|((to, lever), s)| *to = lever * of_samples[s - t]);
                for c in own.clone() {
                    to.column_mut(c).rows_mut(c, end - c).axpy(lever[c], &column.rows(c, end - c), 1.0);
                }
            }
        }
    }

    /// For every group of a joint `g`, `a^T K_g a` and `tr C K_g`, for a vector `a` of rows and a symmetric matrix C, passed to
    /// `each` in the order of the groups.
    pub fn quadratic(
        &self,
        rows: &Rows,
        groups: &Groups,
        a: &DVector<f64>,
        c: &DMatrix<f64>,
        each: &mut dyn FnMut(usize, [f64; 2]),
    ) {
        let n = rows.samples.len();
        let mut along = DVector::zeros(n);
        for ((packed, first), lever) in self.joints.iter().zip(&groups.first).zip(&rows.levers) {
            rows.along(lever, a, &mut along);
            let mut pairs = DMatrix::zeros(packed.nrows(), 2);
            for t in 0..n {
                for s in t..n {
                    let twice = if s == t { 1.0 } else { 2.0 };
                    let place = first_pair(t, n) + s - t;
                    pairs[(place, 0)] = twice * along[s] * along[t];
                    let mut sum = 0.0;
                    for col in rows.samples[t].clone() {
                        let part: f64 = rows.samples[s].clone().map(|r| lever[r] * c[(r, col)]).sum();
                        sum += lever[col] * part;
                    }
                    pairs[(place, 1)] = twice * sum;
                }
            }
            let both = |g: usize| [0, 1].map(|k| packed.column(g).dot(&pairs.column(k)));
            let found: Vec<[f64; 2]> = if packed.len() < MANY {
                (0..packed.ncols()).map(both).collect()
            } else {
                (0..packed.ncols()).into_par_iter().map(both).collect()
            };
            found.into_iter().enumerate().for_each(|(g, both)| each(first + g, both));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::first_pair;

    #[test]
    fn pairs_are_counted_without_gaps() {
        assert_eq!([0, 1, 2, 3].map(|s| first_pair(s, 4)), [0, 4, 7, 9]);
    }
}
