//! Error curves of all joints as one choice: the bands of orders that a campaign supports, and the size of each.

use nalgebra::DMatrix;

use super::linear::Linear;
use super::shrinkage::Shrinkage;
use crate::diagnosis::Examination;
use crate::diagnosis::examination::Span;
use crate::effects::EffectId;
use crate::identify::Model;
use crate::identify::fit::FitError;
use crate::measure::dataset::NamedDataset;
use crate::robot::{JointKind, Robot};

/// Bands of orders per turn.
const BANDS: [[usize; 2]; 5] = [[1, 4], [5, 10], [11, 20], [21, 40], [41, 80]];

/// Fewest postures for each band.
const BANDS_FROM: [usize; 5] = [0, 0, 20, 300, 300];

/// A band whose effect at plausible size, as a sum of squares, is less than this share of the largest is left out.
const MOVES: f64 = 1e-4;

/// Ids of the bands of all joints of a robot that turn, measured in this number of postures.
pub(crate) fn bands(robot: &Robot, postures: usize) -> Vec<String> {
    let turning: Vec<usize> = (1..=robot.joints()).filter(|j| robot.kind(j - 1) == JointKind::Revolute).collect();
    let bands = BANDS.iter().zip(BANDS_FROM).filter(|(_, from)| postures >= *from).map(|(band, _)| band);
    bands.flat_map(|[low, high]| turning.iter().map(move |j| format!("{}:{j}:{low}:{high}", EffectId::ERROR_CURVE))).collect()
}

/// Estimates the prior information of those of `bands` that have an effect on the target, in addition to the fitted
/// columns and `others`, each with its own information. `all` are the inner products of all rows.
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

/// Variance of each of the groups that end the columns of `products`, by evidence; `base` is the number of columns before them and
/// their prior information.
pub(crate) fn shrunk(
    products: &DMatrix<f64>,
    base: usize,
    information: &[f64],
    groups: &[Span],
    rows: usize,
) -> Result<Vec<f64>, FitError> {
    let found = Shrinkage::new(products, base, information, groups, rows)?;
    Ok(found.variance.iter().map(|v| v / found.noise).collect())
}

/// A model with the error curves that are the candidates of an examination of it, each regularised by the size that the evidence
/// gives it.
pub(crate) fn curve_model(datasets: &[NamedDataset<'_>], examination: &Examination, model: &Model) -> Result<Model, FitError> {
    let linear = Linear::new(examination, datasets);
    let candidates = &examination.library().candidates;
    let mut with = model.clone();
    for (place, information) in held(examination, &linear, &linear.all_products(), 0..candidates.len(), &[])? {
        let id = &candidates[place].id;
        with = with.with(id);
        with.width.insert(id.to_string(), information.sqrt().recip());
    }
    Ok(with)
}
