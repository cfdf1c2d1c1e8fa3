//! Scores: the part of the residuals along given displacement patterns, and the part that is expected by chance.
//!
//! With whitened residuals `r`, patterns `A`, the model's columns `J` and the prior information `Lambda` of its
//! parameters (zero for those fitted to these very rows), the residuals of a correct model have the inverse covariance
//! `V⁻¹ = I - J (Lambda + JᵀJ)⁻¹ Jᵀ`. The scores `z = Aᵀ V⁻¹ r` then have covariance `K = Aᵀ V⁻¹ A`, and `zᵀ K⁺ z` is
//! chi-square with rank(K) degrees of freedom (Rao 1948). The part that the fit has absorbed is missing from both `r`
//! and `K`, so nothing is counted twice.

use nalgebra::{DMatrix, DVector, Matrix3, SymmetricEigen, Vector3};

use crate::identify::problem::Problem;
use crate::math::linalg::{self, LinalgError};
use crate::math::positive_definite::cholesky;

/// A pattern is visible only if the model leaves at least this share of its energy; a smaller remainder is the model's
/// curvature.
const SEEN: f64 = 1e-4;

/// Added to the unit diagonal of the parameters' normal matrix, so that dependent columns do no harm.
const RIDGE: f64 = 1e-12;

/// Prior knowledge of the model's parameters, from other sources than these rows.
pub(crate) struct PriorKnowledge {
    /// Indices in the problem of the parameters that may have absorbed part of the residuals.
    pub parameters: Vec<usize>,
    /// Their deviations from the prior means, SI.
    pub deviation: DVector<f64>,
    /// Indices in `parameters` of those with a prior covariance; the others are free.
    pub informed: Vec<usize>,
    /// Covariance of those, SI, in units of the squared noise by which the samples are weighted.
    pub covariance: DMatrix<f64>,
    /// True if the values are those that fit these rows best.
    pub fitted: bool,
}

/// Whitened residuals with the model's columns orthonormalised.
pub(crate) struct Whitened {
    /// `L⁻¹ Jᵀ`, parameters x residuals: `V⁻¹ = I - Bᵀ B`.
    basis: DMatrix<f64>,
    /// `V⁻¹ r`, one entry per scalar residual.
    residuals: DVector<f64>,
    /// `r`.
    plain: DVector<f64>,
    lower: DMatrix<f64>,
    scale: DVector<f64>,
    normal: DMatrix<f64>,
    /// `rᵀ V⁻¹ r`.
    pub squares: f64,
    /// Its degrees of freedom if the parameters deviate from the prior means as their covariance allows.
    pub dof: f64,
    /// Its degrees of freedom if the parameters do not deviate from the prior means at all.
    pub least_dof: f64,
}

/// Information matrix of a covariance.
fn information(covariance: &DMatrix<f64>) -> Result<DMatrix<f64>, LinalgError> {
    let n = covariance.nrows();
    let sigma = DVector::from_fn(n, |i, _| covariance[(i, i)].sqrt());
    let correlation =
        DMatrix::from_fn(n, n, |i, k| covariance[(i, k)] / (sigma[i] * sigma[k]) + if i == k { RIDGE } else { 0.0 });
    let inverse = cholesky(correlation)?.inverse();
    Ok(DMatrix::from_fn(n, n, |i, k| inverse[(i, k)] / (sigma[i] * sigma[k])))
}

impl Whitened {
    /// Whitens the residuals at `values` of the problem's parameters.
    ///
    /// # Errors
    /// When the covariance of what is known is not positive definite, as where an uncertainty is zero, or an entry is not finite.
    pub fn new(problem: &Problem, values: &[f64], known: &PriorKnowledge) -> Result<Self, LinalgError> {
        let PriorKnowledge { parameters, deviation, informed, covariance, .. } = known;
        let (p, rows) = (parameters.len(), problem.row_count());
        let transposed = problem.whitened(values, parameters);
        let mut normal = DMatrix::zeros(p + 1, p + 1);
        linalg::normal_matrix(&transposed, &mut normal);
        let mut known = DMatrix::zeros(p, p);
        let block = information(covariance)?;
        for (i, &a) in informed.iter().enumerate() {
            informed.iter().enumerate().for_each(|(k, &b)| known[(a, b)] = block[(i, k)]);
        }
        let pull = &known * deviation;
        let total = normal.view((0, 0), (p, p)) + &known;
        let scale = DVector::from_fn(p, |i, _| if total[(i, i)] > 0.0 { total[(i, i)].sqrt().recip() } else { 0.0 });
        let unit = DMatrix::from_fn(p, p, |i, k| total[(i, k)] * scale[i] * scale[k] + if i == k { RIDGE } else { 0.0 });
        let lower = cholesky(unit)?.unpack();
        let mut basis = transposed.rows(0, p).into_owned();
        for mut column in basis.column_iter_mut() {
            column.component_mul_assign(&scale);
        }
        lower.solve_lower_triangular_mut(&mut basis);
        let mut gradient = DVector::from_fn(p, |i, _| (normal[(i, p)] - pull[i]) * scale[i]);
        lower.solve_lower_triangular_mut(&mut gradient);
        let plain: DVector<f64> = transposed.row(p).transpose();
        let residuals = &plain - basis.tr_mul(&gradient);
        Ok(Whitened {
            squares: normal[(p, p)] + deviation.dot(&pull) - gradient.norm_squared(),
            dof: (rows + informed.len()) as f64 - p as f64,
            least_dof: rows as f64 - basis.norm_squared(),
            basis,
            residuals,
            plain,
            lower,
            scale,
            normal,
        })
    }

    /// Length of the step that would still improve the fit, in units of the noise; nearly zero if these rows were
    /// fitted.
    pub fn step_left(&self) -> f64 {
        (&self.plain - &self.residuals).norm()
    }

    /// Squared residual of a sample in units of its expected covariance after the fit, and its degrees of freedom.
    pub fn normalised(&self, first_row: usize, height: usize) -> (f64, usize) {
        let b = self.basis.columns(first_row, height);
        let mut left = Matrix3::zeros();
        for i in 0..height {
            for k in 0..height {
                left[(i, k)] = f64::from(u8::from(i == k)) - b.column(i).dot(&b.column(k));
            }
        }
        let r = Vector3::from_fn(|i, _| if i < height { self.residuals[first_row + i] } else { 0.0 });
        let eigen = SymmetricEigen::new(left);
        let seen = (0..3).filter(|&i| eigen.eigenvalues[i] > SEEN);
        seen.fold((0.0, 0), |(sum, dof), i| {
            (sum + eigen.eigenvectors.column(i).dot(&r).powi(2) / eigen.eigenvalues[i], dof + 1)
        })
    }
}

/// Displacement patterns of one sample: whitened vectors, and the pattern to which each belongs.
#[derive(Default)]
pub(crate) struct Patterns {
    pub vectors: Vec<Vector3<f64>>,
    /// (pattern, index of its vector); each pattern at most once.
    pub places: Vec<(usize, usize)>,
}

impl Patterns {
    /// Adds a vector with a pattern of its own.
    pub fn push(&mut self, pattern: usize, vector: Vector3<f64>) {
        self.places.push((pattern, self.vectors.len()));
        self.vectors.push(vector);
    }

    fn clear(&mut self) {
        self.vectors.clear();
        self.places.clear();
    }
}

/// Scores of many patterns at once.
#[derive(Clone)]
pub(crate) struct Scores {
    /// `Aᵀ V⁻¹ r`.
    z: DVector<f64>,
    /// `Aᵀ V⁻¹ A`.
    k: DMatrix<f64>,
    /// `Aᵀ A`.
    pub own: DMatrix<f64>,
    /// `Aᵀ r`.
    pub plain: DVector<f64>,
    /// Covariance of `Aᵀ r` if the model is correct.
    pub plain_covariance: DMatrix<f64>,
    /// Residual sum of squares.
    pub squares: f64,
    /// Its degrees of freedom.
    pub dof: f64,
}

/// Reduction of the residual sum of squares by a group of patterns.
#[derive(Debug, Clone)]
pub(crate) struct ScoreReduction {
    pub squares: f64,
    pub dof: usize,
    /// Sizes of the patterns that cause it (minimum norm).
    pub sizes: DVector<f64>,
    /// Their covariance, in units of the noise squared.
    pub covariance: DMatrix<f64>,
}

impl Scores {
    /// Computes the scores of `count` patterns; `show` fills in those of the sample with a given index. `samples` are
    /// the first row and height of each.
    ///
    /// # Errors
    /// When an entry is not finite.
    pub fn new(
        whitened: &Whitened,
        known: &PriorKnowledge,
        samples: &[(usize, usize)],
        count: usize,
        show: &mut dyn FnMut(usize, &mut Patterns),
    ) -> Result<Self, LinalgError> {
        let p = whitened.basis.nrows();
        let mut own = DMatrix::zeros(count, count);
        let mut along = DMatrix::zeros(p, count);
        let (mut plain, mut z) = (DVector::zeros(count), DVector::zeros(count));
        let mut patterns = Patterns::default();
        let mut shared = DVector::zeros(p);
        for (place, &(first_row, height)) in samples.iter().enumerate() {
            patterns.clear();
            show(place, &mut patterns);
            let Patterns { vectors, places } = &patterns;
            let (r, left) = (whitened.plain.rows(first_row, height), whitened.residuals.rows(first_row, height));
            let rows = whitened.basis.columns(first_row, height);
            for (v, vector) in vectors.iter().enumerate() {
                let vector = vector.rows(0, height);
                shared.gemv(1.0, &rows, &vector, 0.0);
                let (by_plain, by_left) = (vector.dot(&r), vector.dot(&left));
                for &(pattern, _) in places.iter().filter(|(_, of)| *of == v) {
                    let mut column = along.column_mut(pattern);
                    column += &shared;
                    plain[pattern] += by_plain;
                    z[pattern] += by_left;
                }
            }
            for &(a, va) in places {
                for &(b, vb) in places {
                    own[(a, b)] += vectors[va].dot(&vectors[vb]);
                }
            }
        }
        let k = &own - along.tr_mul(&along);
        let plain_covariance = if known.fitted { k.clone() } else { whitened.plain_covariance(&own, &along, known)? };
        Ok(Scores { z, k, own, plain, plain_covariance, squares: whitened.squares, dof: whitened.dof })
    }

    /// Computes the reduction by these patterns.
    pub fn reduction(&self, patterns: &[usize]) -> ScoreReduction {
        let n = patterns.len();
        let unit = DVector::from_fn(n, |i, _| {
            let own = self.own[(patterns[i], patterns[i])];
            if own > 0.0 { own.sqrt().recip() } else { 0.0 }
        });
        let k = DMatrix::from_fn(n, n, |i, j| self.k[(patterns[i], patterns[j])] * unit[i] * unit[j]);
        let z = DVector::from_fn(n, |i, _| self.z[patterns[i]] * unit[i]);
        let eigen = SymmetricEigen::new(k);
        let mut reduction = ScoreReduction { squares: 0.0, dof: 0, sizes: DVector::zeros(n), covariance: DMatrix::zeros(n, n) };
        for (value, direction) in eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter()).filter(|(v, _)| **v > SEEN) {
            let score = direction.dot(&z);
            reduction.squares += score * score / value;
            reduction.dof += 1;
            reduction.sizes += direction * (score / value);
            reduction.covariance += direction * direction.transpose() / *value;
        }
        reduction.sizes.component_mul_assign(&unit);
        for i in 0..n {
            for j in 0..n {
                reduction.covariance[(i, j)] *= unit[i] * unit[j];
            }
        }
        reduction
    }

    /// Computes the reduction by these patterns beyond that by `level` alone, which lies in their span.
    pub fn reduction_beyond(&self, patterns: &[usize], level: usize) -> ScoreReduction {
        let (all, level) = (self.reduction(patterns), self.reduction(&[level]));
        ScoreReduction { squares: (all.squares - level.squares).max(0.0), dof: all.dof.saturating_sub(level.dof), ..all }
    }

    /// Treats patterns as part of the model: the part that other patterns share with them no longer counts for those.
    pub fn give(&mut self, patterns: &[usize]) {
        let reduction = self.reduction(patterns);
        let across = DMatrix::from_fn(self.z.len(), patterns.len(), |i, j| self.k[(i, patterns[j])]);
        self.z -= &across * &reduction.sizes;
        self.k -= &across * &reduction.covariance * across.transpose();
        self.squares = (self.squares - reduction.squares).max(0.0);
        self.dof -= reduction.dof as f64;
    }
}

impl Whitened {
    /// Covariance of `Aᵀ r` for rows to which the informed parameters were not fitted: the noise that remains after the
    /// free ones are fitted, and the uncertainty of the informed ones.
    fn plain_covariance(
        &self,
        own: &DMatrix<f64>,
        along: &DMatrix<f64>,
        known: &PriorKnowledge,
    ) -> Result<DMatrix<f64>, LinalgError> {
        let p = known.parameters.len();
        let free: Vec<usize> = (0..p).filter(|i| !known.informed.contains(i)).collect();
        let mut crossed = &self.lower * along;
        for (mut row, scale) in crossed.row_iter_mut().zip(self.scale.iter()) {
            row /= if *scale > 0.0 { *scale } else { 1.0 };
        }
        let pick = |m: &DMatrix<f64>, rows: &[usize]| DMatrix::from_fn(rows.len(), m.ncols(), |i, c| m[(rows[i], c)]);
        let (by_free, mut by_informed) = (pick(&crossed, &free), pick(&crossed, &known.informed));
        let mut covariance = own.clone();
        if !free.is_empty() {
            let scale = DVector::from_fn(free.len(), |i, _| self.scale[free[i]]);
            let unit = DMatrix::from_fn(free.len(), free.len(), |i, k| {
                self.normal[(free[i], free[k])] * scale[i] * scale[k] + if i == k { RIDGE } else { 0.0 }
            });
            let scaled = DMatrix::from_fn(free.len(), own.ncols(), |i, c| by_free[(i, c)] * scale[i]);
            let solved = cholesky(unit)?.solve(&scaled);
            covariance -= scaled.tr_mul(&solved);
            let shared =
                DMatrix::from_fn(known.informed.len(), free.len(), |i, k| self.normal[(known.informed[i], free[k])] * scale[k]);
            by_informed -= shared * solved;
        }
        Ok(covariance + by_informed.tr_mul(&(&known.covariance * &by_informed)))
    }
}
