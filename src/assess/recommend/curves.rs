//! Error curves of all joints, as one candidate: which bands of orders a campaign bears, and how large each is.

use nalgebra::DMatrix;

use super::linear::Linear;
use super::shrinkage::Shrinkage;
use crate::assess::examination::{Examination, Span};
use crate::identify::FitError;

/// Bands of orders per turn.
const BANDS: [[usize; 2]; 5] = [[1, 4], [5, 10], [11, 20], [21, 40], [41, 80]];

/// Bands tried with at least so many postures.
const BANDS_FROM: [usize; 5] = [0, 0, 20, 300, 300];

/// A joint whose curve of plausible size moves the target less than this share of the one that moves it most is left out.
const MOVES: f64 = 1e-4;

/// Ids of the bands for a robot of so many joints, measured in so many postures.
pub(super) fn bands(joints: usize, postures: usize) -> Vec<String> {
    let bands = BANDS.iter().zip(BANDS_FROM).filter(|(_, from)| postures >= *from).map(|(band, _)| band);
    bands.flat_map(|[low, high]| (1..=joints).map(move |j| format!("error_curve:{j}:{low}:{high}"))).collect()
}

/// The information that holds each of these candidates, bands that move the target at all, beside a base of the fitted columns and
/// `others`, each of those with its own information; `all` are the products of all rows.
pub(super) fn held(
    examination: &Examination,
    linear: &Linear<'_>,
    all: &DMatrix<f64>,
    bands: std::ops::Range<usize>,
    others: &[(usize, f64)],
) -> Result<Vec<(usize, f64)>, FitError> {
    let energy = |k: usize| linear.spans[k].range().map(|c| examination.whole[c]).sum::<f64>();
    let most = bands.clone().map(energy).fold(0.0, f64::max);
    let kept: Vec<usize> = bands.filter(|&k| energy(k) > MOVES * most).collect();
    let base = linear.with(others.iter().copied());
    let mut columns = base.columns.clone();
    let mut groups = Vec::new();
    for &k in &kept {
        groups.push(Span { first: columns.len(), count: linear.spans[k].count });
        columns.extend(linear.spans[k].range().map(|c| linear.fitted + c));
    }
    columns.push(all.nrows() - 1);
    let chosen = all.select_columns(&columns).select_rows(&columns);
    let found = Shrinkage::new(&chosen, base.columns.len(), &base.information, &groups, linear.scalars())?;
    Ok(kept.into_iter().zip(found.variance.iter().map(|v| found.noise / v / linear.weight2)).collect())
}
