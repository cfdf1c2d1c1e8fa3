//! Prediction of rows left out by the errors of an arm, sized by the other rows: data that leave more than is usual, and are right,
//! are those of an arm that errs more than is usual.

use nalgebra::{DMatrix, DVector};

use super::campaign::Campaign;
use super::expected::Designs;
use super::frames::{FrameFit, Frames, flanges};
use super::orientations::median;
use crate::math::positive_definite::cholesky;

/// Number of parts of the postures, each left out once.
const PARTS: usize = 5;
/// Sizes of the arm's errors that are tried, in those of a poorly assembled arm.
const SIZES: [f64; 2] = [1.0, 3.0];
/// Scatter about the arm's errors that is tried, as shares of the residual of the nominal arm.
const SCATTER: [f64; 3] = [0.5, 0.25, 0.125];
/// Largest median error at rows left out, as a share of that of the nominal arm and of the residual expected: chance, and mistakes
/// that are none of an arm, leave more.
const EXPLAINED: f64 = 0.5;
/// Largest residual of the nominal arm, in multiples of the largest one expected.
const MOST: f64 = 2.0;

/// Median error at rows left out, m, with frames and errors of the arm fitted to the others: single rows may be bad. `None` if that
/// does not explain `residual`, m, where `most` is expected.
pub(super) fn predicted_by_the_arm(campaign: &Campaign, frames: &Frames, residual: f64, most: f64) -> Option<f64> {
    if residual > MOST * most {
        return None;
    }
    let Designs { frames: set_up, arm } = Designs::of(campaign, frames);
    let own = flanges(&campaign.robot, campaign);
    let fit = FrameFit::new(campaign, &own);
    let rows = campaign.shots.len();
    let mut missed = DVector::<f64>::zeros(3 * rows);
    for k in 0..rows {
        missed.fixed_rows_mut::<3>(3 * k).copy_from(&fit.row(k, frames).residual);
    }
    let part = parts(campaign);
    let nominal: Vec<f64> = (0..rows).map(|k| missed.fixed_rows::<3>(3 * k).norm()).collect();
    let tried = SIZES.iter().flat_map(|size| SCATTER.map(|share| (*size, share * residual)));
    let errors = tried.filter_map(|(size, scatter)| left_out(&set_up, &(&arm * size), &missed, &part, scatter));
    let best = errors.map(|errors| median(&errors)).min_by(f64::total_cmp)?;
    (best <= EXPLAINED * median(&nominal).min(most)).then_some(best)
}

/// Part of each row; those of one posture are in one.
fn parts(campaign: &Campaign) -> Vec<usize> {
    let mut postures: Vec<&[f64]> = Vec::new();
    let of_row = |q| {
        postures.iter().position(|other| *other == q).unwrap_or_else(|| {
            postures.push(q);
            postures.len() - 1
        })
    };
    campaign.shots.iter().map(|shot| shot.q.as_slice()).map(of_row).map(|posture| posture % PARTS).collect()
}

/// Length of the error of every row, m, predicted from the rows of the other parts; `None` if a matrix is not finite. The errors of
/// the arm have unit size, the rows this scatter, m.
fn left_out(
    set_up: &DMatrix<f64>,
    arm: &DMatrix<f64>,
    missed: &DVector<f64>,
    part: &[usize],
    scatter: f64,
) -> Option<Vec<f64>> {
    let (frames, sizes) = (set_up.ncols(), arm.ncols());
    let mut design = DMatrix::<f64>::zeros(missed.len(), frames + sizes);
    design.columns_mut(0, frames).copy_from(set_up);
    design.columns_mut(frames, sizes).copy_from(arm);
    let mut errors = vec![0.0; part.len()];
    for left in 0..PARTS {
        let kept: Vec<usize> =
            (0..part.len()).filter(|&k| part[k] != left).flat_map(|k| (0..3).map(move |i| 3 * k + i)).collect();
        let seen = design.select_rows(&kept);
        let mut normal = seen.tr_mul(&seen);
        let size = normal.diagonal().max().max(f64::MIN_POSITIVE);
        for c in 0..normal.ncols() {
            normal[(c, c)] += if c < frames { 1e-12 * size } else { scatter * scatter };
        }
        let values = cholesky(normal).ok()?.solve(&seen.tr_mul(&missed.select_rows(&kept)));
        let predicted = &design * values;
        for (k, error) in errors.iter_mut().enumerate().filter(|(k, _)| part[*k] == left) {
            *error = (missed.fixed_rows::<3>(3 * k) - predicted.fixed_rows::<3>(3 * k)).norm();
        }
    }
    errors.iter().all(|e| e.is_finite()).then_some(errors)
}
