//! Noise of a comparison: the difference of two measurements of a pose while nothing has changed.
//!
//! Stated noise is that of an instrument. A robot does not come back to a pose exactly, and what it misses displaces all
//! targets that are seen there together. Where the campaign came back to its poses, the scatter of these repeats tells both
//! parts; taken for white noise, 40 urad that joint 1 of an arm loses (FANUC R-2000iC, public data) are a moved base in one
//! check of three.

use std::ops::Range;

use nalgebra::{DMatrix, Vector3};

use super::seen::{Seen, ends};
use crate::identify::calibration::IdentifyError;
use crate::identify::fit::FitError;
use crate::math::linalg::LinalgError;
use crate::math::positive_definite::cholesky;
use crate::residuals::noise::{RepeatScatter, patterns};
use crate::residuals::views::SeenSample;

/// Source of the noise of a comparison.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum NoiseOf {
    /// Stated in the dataset. The campaign came back to too few of its poses to estimate the robot's repeatability.
    Stated,
    /// Repeats of the campaign.
    Repeats(RepeatScatter),
}

/// Noise of one measurement, by which samples are whitened: from the campaign, for all checks after it.
pub(super) struct ComparisonNoise {
    pub of: NoiseOf,
    /// By this factor white noise is larger than stated.
    pub factor: f64,
    /// One-sigma of the motions of [`patterns`]; empty if they are unknown.
    common: Vec<f64>,
}

impl ComparisonNoise {
    /// From the samples of a campaign; `None` if it neither states its noise nor has repeats that tell it.
    ///
    /// Repeats within an hour do not know what an instrument does from day to day, so that the noise is nowhere less than stated.
    pub fn of(campaign: &[SeenSample<'_>], stated: bool) -> Option<Self> {
        let Some(scatter) = RepeatScatter::of(campaign) else {
            return stated.then_some(ComparisonNoise { of: NoiseOf::Stated, factor: 1.0, common: Vec::new() });
        };
        let mut common = scatter.of_patterns();
        let numbers = campaign.iter().map(|s| s.height as f64).sum::<f64>();
        let of_stated = campaign.iter().map(|s| s.variance).sum::<f64>() / numbers;
        let moved = |s: &SeenSample<'_>| patterns(s).iter().zip(&common).map(|(p, c)| (p * *c).norm_squared()).sum::<f64>();
        let together = campaign.iter().map(moved).sum::<f64>() / numbers;
        let least = if stated { of_stated - together } else { 0.0 };
        // Of a scatter that is motion alone to the last digit nothing would be left to divide by.
        let white = scatter.white.powi(2).max(least).max(1e-6 * together);
        let tails = scatter.tails;
        common.iter_mut().for_each(|c| *c *= tails);
        Some(ComparisonNoise { factor: tails * (white / of_stated).sqrt(), common, of: NoiseOf::Repeats(scatter) })
    }

    /// Motions of a sample that all targets of its pose share, whitened, one-sigma each.
    pub fn common(&self, seen: &SeenSample<'_>) -> Vec<Vector3<f64>> {
        let whitener = seen.whitener / self.factor;
        let all = if self.common.is_empty() { Vec::new() } else { patterns(seen) };
        let there = all.into_iter().zip(&self.common).filter(|(_, sigma)| **sigma > 0.0);
        there.map(|(pattern, sigma)| whitener * pattern * *sigma).collect()
    }
}

/// Whitening: the transformation of the differences of each sample to unit variance without correlation, in the order of the
/// samples.
pub(super) struct Whitening {
    /// For each pose: its scalar rows, and the lower triangular root of their covariance.
    poses: Vec<(Vec<usize>, DMatrix<f64>)>,
    /// For each sample the variance of its rows, on average.
    variances: Vec<f64>,
}

impl Whitening {
    /// For differences to counterparts. Samples of one pose share the noise of their counterparts, and those of one event in it
    /// the motions of the arm as well.
    ///
    /// # Errors
    /// When a motion of the arm is not finite: every sample has noise of its own, so that its covariance is positive definite.
    pub fn of(seen: &[&Seen]) -> Result<Self, IdentifyError> {
        let covariance = |a: usize, b: usize| -> DMatrix<f64> {
            let (one, other) = (seen[a], seen[b]);
            let shared = 1.0 / (one.counterparts * other.counterparts).sqrt();
            let mut block = DMatrix::zeros(one.rows.len(), other.rows.len());
            let times = shared + f64::from(u8::from(one.event == other.event));
            for (x, y) in one.common.iter().zip(&other.common) {
                for (i, k) in (0..one.rows.len()).flat_map(|i| (0..other.rows.len()).map(move |k| (i, k))) {
                    block[(i, k)] += times * x[i] * y[k];
                }
            }
            if one.target == other.target {
                let times = shared * (one.earlier * other.earlier).sqrt() + f64::from(u8::from(a == b));
                (0..one.rows.len().min(other.rows.len())).for_each(|i| block[(i, i)] += times);
            }
            block
        };
        let mut names: Vec<usize> = seen.iter().map(|s| s.pose).collect();
        names.sort_unstable();
        names.dedup();
        let mut variances = vec![0.0; seen.len()];
        let ends = ends(seen);
        let of_pose = |pose: usize| {
            let members: Vec<usize> = (0..seen.len()).filter(|&k| seen[k].pose == pose).collect();
            let rows: Vec<usize> = members.iter().flat_map(|&k| ends[k] - seen[k].rows.len()..ends[k]).collect();
            let mut whole = DMatrix::zeros(rows.len(), rows.len());
            let mut i = 0;
            for &a in &members {
                let mut k = 0;
                for &b in &members {
                    let block = covariance(a, b);
                    if a == b {
                        variances[a] = block.trace() / block.nrows().max(1) as f64;
                    }
                    whole.view_mut((i, k), block.shape()).copy_from(&block);
                    k += seen[b].rows.len();
                }
                i += seen[a].rows.len();
            }
            Ok((rows, cholesky(whole)?.l()))
        };
        let poses = names.into_iter().map(of_pose).collect::<Result<_, LinalgError>>().map_err(FitError::from)?;
        Ok(Whitening { poses, variances })
    }

    /// Whitens the columns of a matrix.
    pub fn apply(&self, matrix: &mut DMatrix<f64>) {
        for (rows, root) in &self.poses {
            let mut part = matrix.select_rows(rows);
            root.solve_lower_triangular_mut(&mut part);
            rows.iter().zip(part.row_iter()).for_each(|(&row, values)| matrix.set_row(row, &values));
        }
    }

    /// The whitened columns of the displacements of these rows, those of one sample, one by one: the first row that they displace,
    /// and the rows from there to the last.
    pub fn unit_columns(&self, rows: Range<usize>) -> (usize, DMatrix<f64>) {
        let place = |(members, _): &(Vec<usize>, DMatrix<f64>)| members.binary_search(&rows.start).ok();
        let Some(((members, root), at)) = self.poses.iter().find_map(|pose| Some((pose, place(pose)?))) else {
            return (rows.start, DMatrix::identity(rows.len(), rows.len()));
        };
        let mut part = DMatrix::zeros(members.len(), rows.len());
        (0..rows.len()).for_each(|k| part[(at + k, k)] = 1.0);
        root.solve_lower_triangular_mut(&mut part);
        // The whitening of a pose goes down its rows: those before the sample's own stay as they are.
        let last = members.last().map_or(rows.end, |last| last + 1);
        let mut block = DMatrix::zeros(last - rows.start, rows.len());
        members.iter().zip(part.row_iter()).skip(at).for_each(|(&row, values)| block.set_row(row - rows.start, &values));
        (rows.start, block)
    }

    /// Variance of a difference, in units of that of one measurement, on average over its rows.
    pub fn variance(&self, sample: usize) -> f64 {
        self.variances[sample]
    }
}
