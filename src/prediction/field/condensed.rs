//! The posterior mean from all samples of a large campaign, by the columns that matter.
//!
//! Sizes are found by a few hundred samples; thousands then determine the coefficients. There are fewer columns than rows, and
//! those of which even all samples would learn next to nothing are left out.

use std::ops::Range;

use nalgebra::{DMatrix, DVector};

use super::campaign::Campaign;
use super::conditional::Sizes;
use super::evidence::weights;
use super::rows::{Coefficients, Groups, Rows};
use crate::diagnosis::Examination;
use crate::identify::fit::FitError;
use crate::math::linalg::{Cholesky, normal_matrix};

/// Samples whose rows are laid out at once.
const STRETCH: usize = 2048;

/// Information that all samples have on a column, over that of its prior, below which it is left out.
const NOTHING: f64 = 0.05;

/// Largest number of columns.
const MOST: usize = 1500;

/// A column of the rows.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Column {
    Smooth(usize),
    Effect(usize),
    Function { joint: usize, index: usize },
}

/// The columns that matter, with the one-sigma of each prior.
fn chosen(rows: &Rows, groups: &Groups, sizes: &Sizes, times: f64) -> Vec<(Column, f64)> {
    let smooth: Vec<(Column, f64)> = (0..rows.smooth.ncols()).map(|k| (Column::Smooth(k), 1.0)).collect();
    let mut others = Vec::new();
    for (span, size) in groups.effects.iter().zip(&sizes.groups) {
        others.extend(span.clone().map(|k| (Column::Effect(k), size * rows.effects.column(k).norm_squared(), size.sqrt())));
    }
    for (joint, (spans, first)) in groups.spans.iter().zip(&groups.first).enumerate() {
        let lever2: Vec<f64> =
            rows.samples.iter().map(|own| own.clone().map(|r| rows.levers[joint][r].powi(2)).sum()).collect();
        for (span, size) in spans.iter().zip(&sizes.groups[*first..]) {
            others.extend(span.clone().map(|index| {
                let energy: f64 = rows.functions[joint].column(index).iter().zip(&lever2).map(|(f, l)| f * f * l).sum();
                (Column::Function { joint, index }, size * energy, size.sqrt())
            }));
        }
    }
    others.retain(|(_, energy, _)| times * energy > NOTHING * sizes.noise);
    others.sort_by(|(_, a, _), (_, b, _)| b.total_cmp(a));
    others.truncate(MOST.saturating_sub(smooth.len()));
    smooth.into_iter().chain(others.into_iter().map(|(column, _, sigma)| (column, sigma))).collect()
}

/// Writes the columns of some rows, each over its noise, and the residuals after them, transposed.
fn write(columns: &[(Column, f64)], rows: &Rows, y: &DVector<f64>, noise: &DVector<f64>, range: Range<usize>) -> DMatrix<f64> {
    let mut all = DMatrix::zeros(columns.len() + 1, range.len());
    let mut sample_of = vec![None; rows.count()];
    rows.samples.iter().enumerate().for_each(|(s, own)| own.clone().for_each(|r| sample_of[r] = Some(s)));
    for (r, mut to) in range.zip(all.column_iter_mut()) {
        let per = noise[r].sqrt().recip();
        for ((column, sigma), to) in columns.iter().zip(to.iter_mut()) {
            let value = match *column {
                Column::Smooth(k) => rows.smooth[(r, k)],
                Column::Effect(k) => rows.effects[(r, k)],
                Column::Function { joint, index } => {
                    sample_of[r].map_or(0.0, |s| rows.levers[joint][r] * rows.functions[joint][(s, index)])
                }
            };
            *to = value * sigma * per;
        }
        to[columns.len()] = y[r] * per;
    }
    all
}

/// Posterior mean of all coefficients from all samples, for groups of known sizes; `groups` may be none.
///
/// # Errors
/// When a matrix cannot be factored.
pub(super) fn mean_of_all(
    examination: &Examination,
    campaign: &Campaign,
    rows: &Rows,
    groups: &Groups,
    sizes: &Sizes,
) -> Result<Coefficients, FitError> {
    let count = examination.contexts.len();
    let columns = chosen(rows, groups, sizes, count as f64 / rows.samples.len().max(1) as f64);
    let (alone, y) = campaign.of_model(examination);
    let weights = weights(&alone, &y)?;
    let p = columns.len();
    let mut sum = DMatrix::zeros(p + 1, p + 1);
    let mut products = DMatrix::zeros(p + 1, p + 1);
    for first in (0..count).step_by(STRETCH) {
        let own = first..(first + STRETCH).min(count);
        let (rows, y) = campaign.stretch(examination, own.clone());
        let noise = Sizes { groups: Vec::new(), noise: sizes.noise, weights: weights[own].to_vec() }.noise_of_rows(&rows);
        // What is no sample is written once.
        let end = if first == 0 { rows.count() } else { rows.samples.last().map_or(0, |last| last.end) };
        normal_matrix(&write(&columns, &rows, &y, &noise, 0..end), &mut products);
        sum += &products;
    }
    let mut information = sum.view((0, 0), (p, p)).into_owned();
    (0..p).for_each(|k| information[(k, k)] += 1.0);
    let mut factor = Cholesky::new(p);
    factor.factor(&information)?;
    let mut b = DVector::from_fn(p, |k, _| sum[(p, k)]);
    factor.solve_in_place(b.as_mut_slice());
    let mut mean = Coefficients::zeros(rows);
    for ((column, sigma), b) in columns.iter().zip(&b) {
        *match *column {
            Column::Smooth(k) => &mut mean.smooth[k],
            Column::Effect(k) => &mut mean.effects[k],
            Column::Function { joint, index } => &mut mean.joints[joint][index],
        } = sigma * b;
    }
    Ok(mean)
}
