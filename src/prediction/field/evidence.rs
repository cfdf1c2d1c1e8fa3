//! Sizes by evidence: the fixed points of the marginal likelihood (MacKay 1992), with a weak prior that draws the sizes of one
//! kind together.

use nalgebra::{DMatrix, DVector};

use super::basis::{KINDS, Kind};
use super::conditional::{Conditional, Sizes};
use super::kernels::{Kernels, Room};
use super::rows::{Groups, Rows};
use crate::identify::fit::FitError;
use crate::math::CHI2_MEDIAN;
use crate::math::linalg::Cholesky;

/// Number of rounds; after 14 no prediction changes by more than a few per cent.
const ROUNDS: usize = 14;

/// Rounds for the noise of a model without groups.
const ROUNDS_OF_MODEL: usize = 8;

/// Weight of the common size in a size, in coefficients.
const COMMON_WEIGHT: f64 = 4.0;

/// Largest variance of a group, in plausible sizes squared.
const MOST: f64 = 4.0;

/// Smallest variance of a group.
const LEAST: f64 = 1e-6;

/// Smallest variance of the noise, as a share of the mean square of the residuals.
const LEAST_NOISE: f64 = 1e-6;

/// Share of the mean square of the residuals at which an unknown noise begins.
const BEGIN_NOISE: f64 = 0.3;

/// Degrees of freedom that a stated noise is worth: an error of a third is not unusual.
pub(super) const STATED_NOISE: f64 = 10.0;

/// Variance of a group at the beginning.
fn begin(kind: Kind) -> f64 {
    match kind {
        Kind::Effect => 0.3,
        Kind::Curve | Kind::FineCurve => 1.0,
        Kind::Angles | Kind::Load => 0.1,
    }
}

/// The noise that explains what is left, from the squares that are left, the number of rows that they are worth, and the noise
/// as stated; at least a millionth of the residuals.
fn noise(left: f64, worth: f64, stated: Option<f64>, y: &DVector<f64>) -> f64 {
    let (known, freedom) = stated.map_or((0.0, 0.0), |known| (known, STATED_NOISE));
    let least = LEAST_NOISE * y.norm_squared() / y.len().max(1) as f64;
    ((left + known * freedom) / (worth + freedom).max(1.0)).max(least).max(f64::MIN_POSITIVE)
}

/// Degrees of freedom of the noise by which bad samples are found.
const TAIL: f64 = 4.0;

/// Squared distance, in variances of the noise, from which on a sample counts less.
const FAR: f64 = 36.0;

/// Rounds by which it is found.
const ROUNDS_OF_TAIL: usize = 12;

/// Weights of the samples by a fit of the model alone with noise of Student's distribution: 1, but less beyond six sigma.
///
/// # Errors
/// When a matrix cannot be factored.
pub(super) fn weights(rows: &Rows, y: &DVector<f64>) -> Result<Vec<f64>, FitError> {
    let p = rows.smooth.ncols();
    let squares = (y.norm_squared() / y.len().max(1) as f64).max(f64::MIN_POSITIVE);
    let mut weights = vec![1.0; rows.samples.len()];
    let mut factor = Cholesky::new(p);
    for _ in 0..ROUNDS_OF_TAIL {
        let sizes = Sizes { groups: Vec::new(), noise: squares, weights: weights.clone() };
        let noise = sizes.noise_of_rows(rows);
        let mut weighted = rows.smooth.clone();
        weighted.row_iter_mut().zip(&noise).for_each(|(mut row, noise)| row /= *noise);
        let mut information = weighted.tr_mul(&rows.smooth);
        (0..p).for_each(|k| information[(k, k)] += 1.0);
        factor.factor(&information)?;
        let mut b = weighted.tr_mul(y);
        factor.solve_in_place(b.as_mut_slice());
        let left = y - &rows.smooth * b;
        let of_three =
            |own: &std::ops::Range<usize>| own.clone().map(|r| left[r] * left[r]).sum::<f64>() * 3.0 / own.len().max(1) as f64;
        let distances: Vec<f64> = rows.samples.iter().map(of_three).collect();
        let mut sorted = distances.clone();
        sorted.sort_by(f64::total_cmp);
        let unit = (sorted.get(sorted.len() / 2).copied().unwrap_or(1.0) / CHI2_MEDIAN[2]).max(f64::MIN_POSITIVE);
        weights.iter_mut().zip(distances).for_each(|(w, d2)| *w = (TAIL + 3.0) / (TAIL + d2 / unit));
    }
    let far = (TAIL + 3.0) / (TAIL + FAR);
    Ok(weights.into_iter().map(|w| if w < far { w } else { 1.0 }).collect())
}

/// Conditions the model alone, its noise by evidence; `stated` is the variance of the noise if that is known.
///
/// # Errors
/// When a matrix cannot be factored.
pub(super) fn of_model(rows: &Rows, y: &DVector<f64>, weights: &[f64], stated: Option<f64>) -> Result<Conditional, FitError> {
    let squares = y.norm_squared() / y.len().max(1) as f64;
    let mut sizes = Sizes {
        groups: Vec::new(),
        noise: stated.unwrap_or(BEGIN_NOISE * squares).max(f64::MIN_POSITIVE),
        weights: weights.to_vec(),
    };
    let (p, unit) = (rows.smooth.ncols(), Sizes { noise: 1.0, ..sizes.clone() }.noise_of_rows(rows));
    let mut weighted = rows.smooth.clone();
    weighted.row_iter_mut().zip(&unit).for_each(|(mut row, unit)| row /= *unit);
    let (products, z) = (weighted.tr_mul(&rows.smooth), weighted.tr_mul(y));
    let (mut factor, mut covariance) = (Cholesky::new(p), DMatrix::zeros(p, p));
    for _ in 0..ROUNDS_OF_MODEL {
        let information = DMatrix::from_fn(p, p, |r, c| products[(r, c)] / sizes.noise + f64::from(u8::from(r == c)));
        factor.factor(&information)?;
        factor.inverse(&mut covariance);
        let left = y - &rows.smooth * (&covariance * &z / sizes.noise);
        let squares = left.iter().zip(&unit).map(|(l, u)| l * l / u).sum();
        let taken = p as f64 - covariance.trace();
        sizes.noise = noise(squares, y.len() as f64 - taken, stated, y);
    }
    Conditional::of_few(rows, y, sizes)
}

/// Sizes of all groups, and the noise, by evidence, and the model conditioned with them.
///
/// # Errors
/// When a matrix cannot be factored.
pub(super) fn of_groups(
    rows: &Rows,
    groups: &Groups,
    y: &DVector<f64>,
    weights: &[f64],
    stated: Option<f64>,
) -> Result<Conditional, FitError> {
    let kernels = Kernels::new(rows, groups);
    let n = rows.count();
    let kinds: Vec<Kind> = groups.all.iter().map(|g| g.kind()).collect();
    let squares = y.norm_squared() / n.max(1) as f64;
    let mut sizes = Sizes {
        groups: kinds.iter().map(|&kind| begin(kind)).collect(),
        noise: stated.unwrap_or(0.0).max(BEGIN_NOISE * squares).max(f64::MIN_POSITIVE),
        weights: weights.to_vec(),
    };
    let mut room = Room::new(rows);
    let (mut covariance, mut inverse) = (DMatrix::zeros(n, n), DMatrix::zeros(n, n));
    let mut factor = Cholesky::new(n);
    for round in 0..=ROUNDS {
        covariance_of_rows(&kernels, rows, groups, &sizes, &mut room, &mut covariance);
        factor.factor(&covariance)?;
        if round == ROUNDS {
            break;
        }
        factor.inverse(&mut inverse);
        let a = &inverse * y;
        let mut found = vec![[0.0; 2]; groups.all.len()];
        let mut half = rows.effects.clone();
        factor.whiten(&mut half);
        let pulled = rows.effects.tr_mul(&a);
        for (span, found) in groups.effects.iter().zip(&mut found) {
            *found = [pulled.rows(span.start, span.len()).norm_squared(), half.columns(span.start, span.len()).norm_squared()];
        }
        kernels.quadratic(rows, groups, &a, &inverse, &mut |g, both| found[g] = both);
        for kind in KINDS {
            let own = || kinds.iter().enumerate().filter(|(_, k)| **k == kind).map(|(g, _)| g);
            let (count, sum) = own().fold((0.0, 0.0), |(n, s), g| (n + 1.0, s + sizes.groups[g].ln()));
            let common = (sum / f64::max(count, 1.0)).exp().min(1.0);
            for g in own() {
                let v = sizes.groups[g];
                let [squares, trace] = found[g];
                sizes.groups[g] = ((v * v * squares + COMMON_WEIGHT * common) / (v * trace + COMMON_WEIGHT)).clamp(LEAST, MOST);
            }
        }
        let noises = sizes.noise_of_rows(rows);
        let left: f64 = a.iter().zip(&noises).map(|(a, own)| a * a * own * own / (own / sizes.noise)).sum();
        let worth: f64 = noises.iter().enumerate().map(|(r, own)| inverse[(r, r)] * own).sum();
        sizes.noise = noise(left, worth, stated, y);
    }
    Ok(Conditional::of_factor(rows, y, groups, sizes, factor))
}

/// Writes the covariance of the rows, noise included.
pub(super) fn covariance_of_rows(
    kernels: &Kernels,
    rows: &Rows,
    groups: &Groups,
    sizes: &Sizes,
    room: &mut Room,
    covariance: &mut DMatrix<f64>,
) {
    kernels.sum(rows, groups, &sizes.groups, room, covariance);
    for (own, weight) in rows.samples.iter().zip(&sizes.weights) {
        own.clone().for_each(|r| covariance[(r, r)] += sizes.noise / weight);
    }
    let end = rows.samples.last().map_or(0, |last| last.end);
    (end..rows.count()).for_each(|r| covariance[(r, r)] += sizes.noise);
}
