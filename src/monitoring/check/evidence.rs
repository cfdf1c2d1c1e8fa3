//! Likelihood ratios of the conditions to "nothing has changed", after any number of samples.

use nalgebra::{DMatrix, DVector, DVectorView, SymmetricEigen};
use statrs::distribution::{ChiSquared, ContinuousCDF};

use super::conditions::Condition;
use super::{CHANGED_BEFOREHAND, FALSE_ALARM, Judged};
use crate::diagnosis::evidence::{ln_mean_exp, ln_sum_exp};

/// Sizes of a change for which evidence is averaged: root mean square of the displacement over all samples, in units of the
/// noise of one comparison. From what can hardly be seen to a collision.
const SIZES: [f64; 7] = [1.5, 3.0, 10.0, 30.0, 100.0, 300.0, 1000.0];

/// Directions of a condition that displace the samples by less than this share of the largest are not seen.
const SEEN: f64 = 1e-6;

/// A condition is nested in another if the latter leaves no more of its displacements than this, rms.
const NESTED: f64 = 0.02;

/// A change is named when it has this share of the probability of all changes (docs/check.md).
const NAMED: f64 = 0.95;

/// One pose or two tell that something has changed; what it is, a third must confirm: a gear that became softer looks like a slipped
/// joint until the load is another (docs/check.md).
const CONFIRMED: usize = 3;

/// Two nested conditions are distinguished if the narrower one fits worse by more than this sum of squares, in units of the
/// noise.
const WORSE: f64 = 9.0;

/// A true change displaces the samples as its columns say but for this share of their root mean square: columns are linear, and
/// those of a mass know its place and the springs of the arm only so well. Without it a large change would be taken for one of
/// more freedom that fits a little better (docs/check.md).
const IN_SHAPE: f64 = 0.03;

/// The same for a mass when its fit is judged: its place is unknown, and a calibration determines the compliance of a joint to
/// some tenths of it only (docs/check.md).
const MASS_IN_SHAPE: f64 = 0.25;

/// Significance level at which a change does not explain the differences: the probability of a residual at least as large
/// (docs/check.md).
const MISFIT: f64 = 1e-3;

/// Directions whose share of a Gram matrix is smaller, relative to the largest, are only rounding.
const ROUNDING: f64 = 1e-9;

/// Residual of the differences after the best size of a condition.
pub(super) struct Left {
    /// Sum of the squares of the residuals, whitened.
    squares: f64,
    /// Its degrees of freedom.
    dof: usize,
    /// True if chance, and what a change is off its shape, leave as much.
    pub fits: bool,
}

impl Left {
    /// Root mean square of the residual, in units of the noise of one comparison; `None` if nothing can be left.
    pub fn rms(&self) -> Option<f64> {
        (self.dof > 0).then(|| (self.squares / self.dof as f64).sqrt())
    }
}

/// One condition, with its columns orthonormal over all samples.
struct Hypothesis {
    condition: Condition,
    /// Its share of the probability of all changes before any data.
    weight: f64,
    /// Scalar differences x directions; unit columns.
    basis: DMatrix<f64>,
    /// For each number of samples the eigenvectors and eigenvalues of the Gram matrix of the rows so far, of columns scaled to
    /// an rms displacement of one.
    so_far: Vec<SymmetricEigen<f64, nalgebra::Dyn>>,
}

/// All conditions at the poses of a check.
pub(super) struct Evidence {
    hypotheses: Vec<Hypothesis>,
    /// Number of scalar differences after each sample.
    ends: Vec<usize>,
}

impl Evidence {
    /// From the columns of every condition but "valid"; `ends` is the number of scalar differences after each sample.
    pub fn new(columns: &[(Condition, DMatrix<f64>)], ends: Vec<usize>) -> Self {
        let of_kind = |kind: usize| columns.iter().filter(|(c, _)| c.kind() == kind).count();
        let mut kinds: Vec<usize> = columns.iter().map(|(c, _)| c.kind()).collect();
        kinds.sort_unstable();
        kinds.dedup();
        let hypothesis = |(condition, matrix): &(Condition, DMatrix<f64>)| {
            let basis = orthonormal(matrix);
            let scale = (matrix.nrows() as f64 / basis.ncols() as f64).sqrt();
            let gram = |&end: &usize| {
                let rows = basis.rows(0, end) * scale;
                SymmetricEigen::new(rows.tr_mul(&rows))
            };
            Hypothesis {
                weight: 1.0 / (kinds.len() * of_kind(condition.kind())) as f64,
                so_far: ends.iter().map(gram).collect(),
                condition: condition.clone(),
                basis,
            }
        };
        Evidence { hypotheses: columns.iter().map(hypothesis).collect(), ends }
    }

    /// Logarithm of the average likelihood ratio of all changes to none after the first `samples`.
    pub fn ln_ratio(&self, differences: &DVector<f64>, samples: usize) -> f64 {
        let seen = self.so_far(differences, samples);
        ln_sum_exp(self.hypotheses.iter().map(|h| h.weight.ln() + h.ln_ratio(seen, samples)))
    }

    /// Looks at one sample after the other until a change is found and named, or all are used. Returns the number of samples
    /// used, and true if something has changed.
    pub fn decide(&self, differences: &DVector<f64>) -> (usize, bool) {
        let mut changed = false;
        for samples in 1..=self.samples() {
            changed |= self.ln_ratio(differences, samples) >= -FALSE_ALARM.ln();
            if changed && self.is_settled(differences, samples) {
                return (samples, true);
            }
        }
        (self.samples(), changed)
    }

    /// True if one change is nearly sure to be the one that occurred, and no other that the samples cannot distinguish from it:
    /// then further samples are not needed.
    pub fn is_settled(&self, differences: &DVector<f64>, samples: usize) -> bool {
        let judged = self.probabilities(differences, samples, CHANGED_BEFOREHAND);
        let changes = || judged.iter().filter(|j| j.condition != Condition::Valid);
        let Some(first) = changes().next() else { return false };
        samples >= CONFIRMED
            && first.probability >= NAMED * changes().map(|j| j.probability).sum::<f64>()
            && self.aliased_with(&first.condition, differences, samples).is_empty()
    }

    fn so_far<'a>(&self, differences: &'a DVector<f64>, samples: usize) -> DVectorView<'a, f64> {
        differences.rows(0, self.ends[samples - 1])
    }

    /// All conditions with their probabilities after the first `samples`, the most probable first; `changed` is the share of
    /// checks before which something has changed.
    ///
    /// Where a change does not explain the differences alone, its probability is that of something else, or several things: of
    /// two changes at once the larger one would have it all, since the large sizes of a condition are also far off its shape.
    pub fn probabilities(&self, differences: &DVector<f64>, samples: usize, changed: f64) -> Vec<Judged> {
        let seen = self.so_far(differences, samples);
        let mut all: Vec<(Condition, f64)> = Vec::with_capacity(self.hypotheses.len() + 1);
        let mut something_else = Vec::new();
        for h in &self.hypotheses {
            let ln = (changed * h.weight).ln() + h.ln_ratio(seen, samples);
            let explains = !h.is_general() && h.left(seen, samples).fits;
            if !explains {
                something_else.push(ln);
            }
            if !h.is_general() {
                all.push((h.condition.clone(), if explains { ln } else { f64::NEG_INFINITY }));
            }
        }
        all.push((Condition::Recalibrate, ln_sum_exp(something_else.iter().copied())));
        all.push((Condition::Valid, (1.0 - changed).ln()));
        let total = ln_sum_exp(all.iter().map(|(_, ln)| *ln));
        let mut judged: Vec<Judged> =
            all.into_iter().map(|(condition, ln)| Judged { condition, probability: (ln - total).exp() }).collect();
        judged.sort_by(|a, b| b.probability.total_cmp(&a.probability));
        judged
    }

    /// The single change that comes closest to the differences of the first `samples`, and what it leaves of them: the one that
    /// is named, if it is a single one.
    pub fn closest(&self, named: &Condition, differences: &DVector<f64>, samples: usize) -> Option<(Condition, Left)> {
        let seen = self.so_far(differences, samples);
        let single = || self.hypotheses.iter().filter(|h| !h.is_general());
        let weighed = single().map(|h| (h, h.weight.ln() + h.ln_ratio(seen, samples)));
        let most_probable = || weighed.max_by(|a, b| a.1.total_cmp(&b.1)).map(|(h, _)| h);
        let first = single().find(|h| h.condition == *named).or_else(most_probable)?;
        Some((first.condition.clone(), first.left(seen, samples)))
    }

    /// True if the evidence of any change in all samples is reported, that of one condition being looked at first.
    pub fn is_reported(&self, index: usize, differences: &DVector<f64>) -> bool {
        let seen = self.so_far(differences, self.samples());
        let h = &self.hypotheses[index];
        let reported = -FALSE_ALARM.ln();
        h.weight.ln() + h.ln_ratio(seen, self.samples()) >= reported || self.ln_ratio(differences, self.samples()) >= reported
    }

    /// Conditions that the first `samples` cannot distinguish from this one: nested in it or it in them, and fitting as well.
    pub fn aliased_with(&self, condition: &Condition, differences: &DVector<f64>, samples: usize) -> Vec<Condition> {
        let Some(named) = self.hypotheses.iter().find(|h| h.condition == *condition) else { return Vec::new() };
        let end = self.ends[samples - 1];
        let seen = differences.rows(0, end);
        let left = |h: &Hypothesis| {
            let basis = orthonormal(&h.basis.rows(0, end).into_owned());
            seen.norm_squared() - basis.tr_mul(&seen).norm_squared()
        };
        let nested = |a: &Hypothesis, b: &Hypothesis| {
            let inner = orthonormal(&a.basis.rows(0, end).into_owned());
            let outer = orthonormal(&b.basis.rows(0, end).into_owned());
            let rest = &inner - &outer * outer.tr_mul(&inner);
            rest.norm() <= NESTED * (inner.ncols() as f64).sqrt()
        };
        self.hypotheses
            .iter()
            .filter(|h| h.condition != *condition && !h.is_general())
            .filter(|h| nested(h, named) || nested(named, h))
            .filter(|h| left(h) - left(named) <= WORSE)
            .map(|h| h.condition.clone())
            .collect()
    }

    /// The displacement of all samples, whitened, by a condition: its directions in unit columns.
    pub fn basis(&self, index: usize) -> (&Condition, &DMatrix<f64>) {
        let h = &self.hypotheses[index];
        (&h.condition, &h.basis)
    }

    /// Number of conditions beside "valid".
    pub fn count(&self) -> usize {
        self.hypotheses.len()
    }

    /// Number of samples.
    pub fn samples(&self) -> usize {
        self.ends.len()
    }
}

impl Hypothesis {
    /// True if it is any change at all.
    fn is_general(&self) -> bool {
        matches!(self.condition, Condition::Recalibrate)
    }

    /// Components of the differences along the eigenvectors of its Gram matrix.
    fn along(&self, seen: DVectorView<'_, f64>, samples: usize) -> DVector<f64> {
        let scale = (self.basis.nrows() as f64 / self.basis.ncols() as f64).sqrt();
        self.so_far[samples - 1].eigenvectors.tr_mul(&(self.basis.rows(0, seen.nrows()).tr_mul(&seen) * scale))
    }

    /// Residual of the differences after its best size. It may leave some per cent of the change besides the noise: the slip of
    /// a
    /// joint by one degree is off its column by 0.9 %, and the model knows the arm only so well.
    fn left(&self, seen: DVectorView<'_, f64>, samples: usize) -> Left {
        let gram = &self.so_far[samples - 1].eigenvalues;
        let least = ROUNDING * gram.max();
        let along = self.along(seen, samples);
        let (mut explained, mut rank) = (0.0_f64, 0_usize);
        for (g, y) in gram.iter().zip(&along).filter(|(g, _)| **g > least) {
            explained += y * y / g;
            rank += 1;
        }
        let rows = seen.nrows();
        let squares = (seen.norm_squared() - explained).max(0.0);
        let dof = rows.saturating_sub(rank);
        let shape = match self.condition {
            Condition::OtherPayload => MASS_IN_SHAPE,
            // What one sample misses says nothing of the others.
            Condition::SingleSample(_) => 0.0,
            _ => IN_SHAPE,
        };
        let off = 1.0 + shape * shape * explained / rows as f64;
        let chance = ChiSquared::new(dof as f64).map_or(1.0, |chi2| chi2.sf(squares / off));
        Left { squares, dof, fits: chance >= MISFIT }
    }

    /// Logarithm of the likelihood ratio to "nothing has changed", averaged over the sizes.
    fn ln_ratio(&self, seen: DVectorView<'_, f64>, samples: usize) -> f64 {
        let eigen = &self.so_far[samples - 1];
        let squares = seen.norm_squared();
        let rows = seen.nrows() as f64;
        let along = self.along(seen, samples);
        let of_size = |size: &f64| {
            // Of covariance a I + s² G Gᵀ, with the noise and what the shape is off by in a.
            let variance = size * size;
            let off = 1.0 + if self.condition.is_of_all() { IN_SHAPE * IN_SHAPE * variance } else { 0.0 };
            let terms = eigen.eigenvalues.iter().zip(&along).map(|(g, y)| {
                let spread = 1.0 + variance * g.max(0.0) / off;
                variance * y * y / (off * off * spread) - spread.ln()
            });
            let terms = terms.chain([squares * (1.0 - 1.0 / off) - rows * off.ln()]);
            0.5 * terms.sum::<f64>()
        };
        ln_mean_exp(&SIZES.map(|size| of_size(&size)))
    }
}

/// Orthonormal columns that span those of a matrix.
pub(super) fn orthonormal(matrix: &DMatrix<f64>) -> DMatrix<f64> {
    // Parameters of different units are made alike first.
    let mut scaled = matrix.clone();
    for mut column in scaled.column_iter_mut() {
        let norm = column.norm();
        if norm > 0.0 {
            column /= norm;
        }
    }
    let svd = scaled.svd(true, false);
    let largest = svd.singular_values.max();
    let rank = svd.singular_values.iter().filter(|s| **s > SEEN * largest && **s > 0.0).count();
    svd.u.map_or_else(
        || DMatrix::zeros(matrix.nrows(), 0),
        |u| {
            // Singular values are in descending order.
            u.columns(0, rank).into_owned()
        },
    )
}
