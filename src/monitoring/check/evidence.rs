//! Likelihood ratios of the conditions to "nothing has changed", after any number of samples.

use nalgebra::{DMatrix, DVector, DVectorView, Dyn, SymmetricEigen};
use statrs::distribution::{ChiSquared, ContinuousCDF};

use super::conditions::{Columns, Condition, IN_SHAPE, orthonormal};
use super::{CHANGED_BEFOREHAND, FALSE_ALARM, Judged};
use crate::diagnosis::evidence::{ln_mean_exp, ln_sum_exp};

/// Sizes of a change for which evidence is averaged: root mean square of the displacement over all samples, in units of the
/// noise of one comparison. From what can hardly be seen to a collision.
const SIZES: [f64; 7] = [1.5, 3.0, 10.0, 30.0, 100.0, 300.0, 1000.0];

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
    /// The first scalar difference that it displaces.
    first: usize,
    /// Scalar differences from there on x directions; unit columns. Without columns for any change at all.
    basis: DMatrix<f64>,
    /// Scale of the columns at which a size displaces all samples by as much, rms.
    scale: f64,
    /// What numbers of samples show of it, one after the other; equal ones once.
    shown: Vec<Shown>,
    /// The place in `shown` for each number of samples.
    so_far: Vec<usize>,
}

/// What the rows so far show of a condition, of columns scaled to an rms displacement of one.
struct Shown {
    /// Eigenvectors and eigenvalues of their Gram matrix.
    eigen: SymmetricEigen<f64, Dyn>,
    /// For each size the share of the squared components along the eigenvectors in the logarithm of the likelihood ratio, that of
    /// all squares, and what does not depend on the differences, by row and at all.
    sizes: [OfSize; SIZES.len()],
}

/// The logarithm of the likelihood ratio of one size, as a function of the differences.
struct OfSize {
    along: Vec<f64>,
    squares: f64,
    by_row: f64,
    always: f64,
}

impl Shown {
    fn of(gram: DMatrix<f64>, is_of_all: bool) -> Self {
        let eigen = SymmetricEigen::new(gram);
        let sizes = SIZES.map(|size| {
            // Of covariance a I + s² G Gᵀ, with the noise and what the shape is off by in a.
            let variance = size * size;
            let off = 1.0 + if is_of_all { IN_SHAPE * IN_SHAPE * variance } else { 0.0 };
            let spread = |g: &f64| 1.0 + variance * g.max(0.0) / off;
            OfSize {
                along: eigen.eigenvalues.iter().map(|g| variance / (off * off * spread(g))).collect(),
                squares: 1.0 - 1.0 / off,
                by_row: -off.ln(),
                always: -eigen.eigenvalues.iter().map(|g| spread(g).ln()).sum::<f64>(),
            }
        });
        Shown { eigen, sizes }
    }
}

/// The first differences, and the sum of their squares.
#[derive(Clone, Copy)]
struct Seen<'a> {
    differences: DVectorView<'a, f64>,
    squares: f64,
    samples: usize,
}

/// All conditions at the poses of a check.
pub(super) struct Evidence {
    hypotheses: Vec<Hypothesis>,
    /// Number of scalar differences after each sample.
    ends: Vec<usize>,
}

impl Evidence {
    /// From the columns of every condition but "valid"; `ends` is the number of scalar differences after each sample.
    pub fn new(columns: &[Columns], ends: Vec<usize>) -> Self {
        let of_kind = |kind: usize| columns.iter().filter(|c| c.condition.kind() == kind).count();
        let mut kinds: Vec<usize> = columns.iter().map(|c| c.condition.kind()).collect();
        kinds.sort_unstable();
        kinds.dedup();
        let weight = |condition: &Condition| 1.0 / (kinds.len() * of_kind(condition.kind())) as f64;
        let hypotheses = columns.iter().map(|columns| Hypothesis::new(columns, weight(&columns.condition), &ends)).collect();
        Evidence { hypotheses, ends }
    }

    /// Logarithm of the average likelihood ratio of all changes to none after the first `samples`.
    pub fn ln_ratio(&self, differences: &DVector<f64>, samples: usize) -> f64 {
        let seen = self.so_far(differences, samples);
        ln_sum_exp(self.hypotheses.iter().map(|h| h.weight.ln() + h.ln_ratio(seen)))
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

    fn so_far<'a>(&self, differences: &'a DVector<f64>, samples: usize) -> Seen<'a> {
        let differences = differences.rows(0, self.ends[samples - 1]);
        Seen { squares: differences.norm_squared(), differences, samples }
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
            let ln = (changed * h.weight).ln() + h.ln_ratio(seen);
            let explains = !h.is_general() && h.left(seen).fits;
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
        let weighed = single().map(|h| (h, h.weight.ln() + h.ln_ratio(seen)));
        let most_probable = || weighed.max_by(|a, b| a.1.total_cmp(&b.1)).map(|(h, _)| h);
        let first = single().find(|h| h.condition == *named).or_else(most_probable)?;
        Some((first.condition.clone(), first.left(seen)))
    }

    /// True if the evidence of any change in all samples is reported, that of one condition being looked at first.
    pub fn is_reported(&self, index: usize, differences: &DVector<f64>) -> bool {
        let seen = self.so_far(differences, self.samples());
        let h = &self.hypotheses[index];
        let reported = -FALSE_ALARM.ln();
        h.weight.ln() + h.ln_ratio(seen) >= reported || self.ln_ratio(differences, self.samples()) >= reported
    }

    /// Conditions that the first `samples` cannot distinguish from this one: nested in it or it in them, and fitting as well.
    pub fn aliased_with(&self, condition: &Condition, differences: &DVector<f64>, samples: usize) -> Vec<Condition> {
        // Any change at all is none that could be mistaken for another.
        let named = self.hypotheses.iter().find(|h| h.condition == *condition && !h.is_general());
        let Some(named) = named else { return Vec::new() };
        let seen = self.so_far(differences, samples);
        // Of the rows so far, where the condition displaces some.
        let basis = |h: &Hypothesis| {
            let rows = h.rows_of(seen.differences.nrows());
            (h.first.min(seen.differences.nrows()), orthonormal(&h.basis.rows(0, rows).into_owned()))
        };
        let along = |(first, basis): &(usize, DMatrix<f64>)| basis.tr_mul(&seen.differences.rows(*first, basis.nrows()));
        let left = |of: &(usize, DMatrix<f64>)| seen.squares - along(of).norm_squared();
        let nested = |(first, inner): &(usize, DMatrix<f64>), (start, outer): &(usize, DMatrix<f64>)| {
            // Of what the inner one displaces, the outer one can explain what both displace.
            let (from, to) = (*first.max(start), (first + inner.nrows()).min(start + outer.nrows()));
            let shared = if from < to {
                outer.rows(from - start, to - from).tr_mul(&inner.rows(from - first, to - from)).norm_squared()
            } else {
                0.0
            };
            let left = (inner.ncols() as f64 - shared).max(0.0);
            left.sqrt() <= NESTED * (inner.ncols() as f64).sqrt()
        };
        let of_named = basis(named);
        let others = self.hypotheses.iter().filter(|h| h.condition != *condition && !h.is_general());
        others
            .filter(|h| {
                let other = basis(h);
                (nested(&other, &of_named) || nested(&of_named, &other)) && left(&other) - left(&of_named) <= WORSE
            })
            .map(|h| h.condition.clone())
            .collect()
    }

    /// A condition.
    pub fn condition(&self, index: usize) -> &Condition {
        &self.hypotheses[index].condition
    }

    /// Number of directions in which a condition displaces.
    pub fn directions(&self, index: usize) -> usize {
        let h = &self.hypotheses[index];
        if h.is_general() { self.rows() } else { h.basis.ncols() }
    }

    /// The displacement of all differences, whitened, by a condition along its directions, of length one.
    pub fn displaced(&self, index: usize, direction: &DVector<f64>) -> DVector<f64> {
        let h = &self.hypotheses[index];
        if h.is_general() {
            return direction.clone();
        }
        let mut displaced = DVector::zeros(self.rows());
        displaced.rows_mut(h.first, h.basis.nrows()).copy_from(&(&h.basis * direction));
        displaced
    }

    /// Number of scalar differences of all samples.
    pub fn rows(&self) -> usize {
        self.ends.last().copied().unwrap_or(0)
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
    fn new(columns: &Columns, weight: f64, ends: &[usize]) -> Self {
        let Columns { condition, first, block } = columns;
        let basis = orthonormal(block);
        let rows = ends.last().copied().unwrap_or(0);
        let scale = (rows as f64 / basis.ncols().max(1) as f64).sqrt();
        let is_of_all = condition.is_of_all();
        if basis.is_empty() {
            let (shown, so_far) = (Vec::new(), Vec::new());
            return Hypothesis { condition: condition.clone(), weight, first: *first, basis, scale, shown, so_far };
        }
        let mut gram = DMatrix::zeros(basis.ncols(), basis.ncols());
        let mut shown = vec![Shown::of(gram.clone(), is_of_all)];
        let (mut so_far, mut before) = (Vec::with_capacity(ends.len()), 0);
        for end in ends {
            let now = end.saturating_sub(*first).min(basis.nrows());
            if now > before {
                let rows = basis.rows(before, now - before) * scale;
                gram += rows.tr_mul(&rows);
                shown.push(Shown::of(gram.clone(), is_of_all));
                before = now;
            }
            so_far.push(shown.len() - 1);
        }
        Hypothesis { condition: condition.clone(), weight, first: *first, basis, scale, shown, so_far }
    }

    /// True if it is any change at all.
    fn is_general(&self) -> bool {
        matches!(self.condition, Condition::Recalibrate)
    }

    /// Number of rows of its basis within the first `end` differences.
    fn rows_of(&self, end: usize) -> usize {
        end.saturating_sub(self.first).min(self.basis.nrows())
    }

    fn shown(&self, seen: Seen<'_>) -> &Shown {
        &self.shown[self.so_far[seen.samples - 1]]
    }

    /// Components of the differences along the eigenvectors of its Gram matrix.
    fn along(&self, seen: Seen<'_>) -> DVector<f64> {
        let rows = self.rows_of(seen.differences.nrows());
        if rows == 0 {
            return DVector::zeros(self.basis.ncols());
        }
        let along = self.basis.rows(0, rows).tr_mul(&seen.differences.rows(self.first, rows)) * self.scale;
        self.shown(seen).eigen.eigenvectors.tr_mul(&along)
    }

    /// Residual of the differences after its best size. It may leave some per cent of the change besides the noise: the slip of
    /// a joint by one degree is off its column by 0.9 %, and the model knows the arm only so well.
    fn left(&self, seen: Seen<'_>) -> Left {
        let gram = &self.shown(seen).eigen.eigenvalues;
        let least = ROUNDING * gram.max();
        let along = self.along(seen);
        let (mut explained, mut rank) = (0.0_f64, 0_usize);
        for (g, y) in gram.iter().zip(&along).filter(|(g, _)| **g > least) {
            explained += y * y / g;
            rank += 1;
        }
        let rows = seen.differences.nrows();
        let squares = (seen.squares - explained).max(0.0);
        let dof = rows.saturating_sub(rank);
        let shape = self.condition.in_shape();
        let off = 1.0 + shape * shape * explained / rows as f64;
        let chance = ChiSquared::new(dof as f64).map_or(1.0, |chi2| chi2.sf(squares / off));
        Left { squares, dof, fits: chance >= MISFIT }
    }

    /// Logarithm of the likelihood ratio to "nothing has changed", averaged over the sizes.
    fn ln_ratio(&self, seen: Seen<'_>) -> f64 {
        let rows = seen.differences.nrows() as f64;
        if self.is_general() {
            // Its columns are those of all differences, so that its Gram matrix is one for each of those so far.
            let of_size = |size: f64| {
                let spread = 1.0 + size * size;
                0.5 * (seen.squares * (1.0 - 1.0 / spread) - rows * spread.ln())
            };
            return ln_mean_exp(&SIZES.map(of_size));
        }
        let along = self.along(seen);
        let of_size = |of: &OfSize| {
            let explained: f64 = of.along.iter().zip(&along).map(|(w, y)| w * y * y).sum();
            0.5 * (explained + seen.squares * of.squares + rows * of.by_row + of.always)
        };
        ln_mean_exp(&self.shown(seen).sizes.each_ref().map(of_size))
    }
}
