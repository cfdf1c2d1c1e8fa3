//! Scores: how much of the residuals runs along given displacement patterns, and how much of that chance would explain.
//!
//! With whitened residuals `r`, patterns `A`, the model's columns `J` and what is known beforehand of its parameters (information
//! `Lambda`, zero for those fitted to these very rows), residuals of a right model have the inverse covariance
//! `V⁻¹ = I - J (Lambda + JᵀJ)⁻¹ Jᵀ`. The scores `z = Aᵀ V⁻¹ r` then have covariance `K = Aᵀ V⁻¹ A`, and `zᵀ K⁺ z` is chi-square of
//! rank(K) degrees of freedom (Rao 1948). What the fit has absorbed is missing from `r` and from `K` alike, so nothing is counted twice.

use nalgebra::{DMatrix, DVector, Matrix3, SymmetricEigen, Vector3};

use crate::identify::Problem;
use crate::math::linalg;

/// A pattern of which the model takes up all but this share of its energy is not seen: what is left of it is the model's curvature.
const SEEN: f64 = 1e-4;

/// Added to the unit diagonal of the parameters' normal matrix, so that dependent columns do no harm.
const RIDGE: f64 = 1e-12;

/// What is known of the model's parameters besides these rows.
pub(crate) struct Beforehand {
    /// Parameters that may have followed the residuals, by place in the problem.
    pub parameters: Vec<usize>,
    /// Their deviation from what was known beforehand, SI.
    pub deviation: DVector<f64>,
    /// Those with a covariance, by place in `parameters`; the others are free.
    pub informed: Vec<usize>,
    /// Covariance of those, SI, in units of the noise (squared) that the samples are weighted by.
    pub covariance: DMatrix<f64>,
    /// Whether the values are those that fit these rows best.
    pub fitted: bool,
}

/// Residuals with the model's columns orthonormalised, and what follows from them.
pub(crate) struct Whitened {
    /// `L⁻¹ Jᵀ`, parameters x residuals: `V⁻¹ = I - Bᵀ B`.
    basis: DMatrix<f64>,
    /// `V⁻¹ r`, every scalar residual.
    residuals: DVector<f64>,
    /// `r`.
    plain: DVector<f64>,
    lower: DMatrix<f64>,
    scale: DVector<f64>,
    normal: DMatrix<f64>,
    /// `rᵀ V⁻¹ r`.
    pub squares: f64,
    /// Its degrees of freedom, if what was known beforehand is as far off as it may be.
    pub dof: f64,
    /// Its degrees of freedom, if what was known beforehand is not off at all.
    pub least_dof: f64,
}

/// Information matrix of a covariance; zero where it cannot be inverted.
fn information(covariance: &DMatrix<f64>) -> DMatrix<f64> {
    let n = covariance.nrows();
    let sigma = DVector::from_fn(n, |i, _| covariance[(i, i)].sqrt());
    let correlation =
        DMatrix::from_fn(n, n, |i, k| covariance[(i, k)] / (sigma[i] * sigma[k]) + if i == k { RIDGE } else { 0.0 });
    let inverse = correlation.cholesky().map_or_else(|| DMatrix::zeros(n, n), |c| c.inverse());
    DMatrix::from_fn(n, n, |i, k| inverse[(i, k)] / (sigma[i] * sigma[k]))
}

impl Whitened {
    /// At `values` of the problem's parameters.
    pub fn new(problem: &Problem, values: &[f64], beforehand: &Beforehand) -> Self {
        let Beforehand { parameters, deviation, informed, covariance, .. } = beforehand;
        let (p, rows) = (parameters.len(), problem.row_count());
        let transposed = problem.whitened(values, parameters);
        let mut normal = DMatrix::zeros(p + 1, p + 1);
        linalg::normal_matrix(&transposed, &mut normal);
        let mut known = DMatrix::zeros(p, p);
        let block = information(covariance);
        for (i, &a) in informed.iter().enumerate() {
            informed.iter().enumerate().for_each(|(k, &b)| known[(a, b)] = block[(i, k)]);
        }
        let pull = &known * deviation;
        let total = normal.view((0, 0), (p, p)) + &known;
        let scale = DVector::from_fn(p, |i, _| if total[(i, i)] > 0.0 { total[(i, i)].sqrt().recip() } else { 0.0 });
        let unit = DMatrix::from_fn(p, p, |i, k| total[(i, k)] * scale[i] * scale[k] + if i == k { RIDGE } else { 0.0 });
        let lower = unit.cholesky().map_or_else(|| DMatrix::identity(p, p), |c| c.unpack());
        let mut basis = transposed.rows(0, p).into_owned();
        for mut column in basis.column_iter_mut() {
            column.component_mul_assign(&scale);
        }
        lower.solve_lower_triangular_mut(&mut basis);
        let mut gradient = DVector::from_fn(p, |i, _| (normal[(i, p)] - pull[i]) * scale[i]);
        lower.solve_lower_triangular_mut(&mut gradient);
        let plain: DVector<f64> = transposed.row(p).transpose();
        let residuals = &plain - basis.tr_mul(&gradient);
        Whitened {
            squares: normal[(p, p)] + deviation.dot(&pull) - gradient.norm_squared(),
            dof: (rows + informed.len()) as f64 - p as f64,
            least_dof: rows as f64 - basis.norm_squared(),
            basis,
            residuals,
            plain,
            lower,
            scale,
            normal,
        }
    }

    /// Length of the step that would still improve the fit, in units of the noise: next to nothing where these rows were fitted.
    pub fn step_left(&self) -> f64 {
        (&self.plain - &self.residuals).norm()
    }

    /// Square of a sample's residual in units of what chance would leave of it, and its degrees of freedom.
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

/// Displacement patterns of one sample: whitened vectors, and which of them belongs to which pattern.
#[derive(Default)]
pub(crate) struct Patterns {
    pub vectors: Vec<Vector3<f64>>,
    /// (pattern, place among the vectors); each pattern at most once.
    pub places: Vec<(usize, usize)>,
}

impl Patterns {
    /// A vector of a pattern of its own.
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
    /// Covariance of `Aᵀ r` when the model is right.
    pub plain_covariance: DMatrix<f64>,
    /// Residual sum of squares.
    pub squares: f64,
    /// Its degrees of freedom.
    pub dof: f64,
}

/// What a group of patterns takes off the residual sum of squares.
#[derive(Debug, Clone)]
pub(crate) struct Taken {
    pub squares: f64,
    pub dof: usize,
    /// Sizes of the patterns that take it (the shortest that do).
    pub sizes: DVector<f64>,
    /// Their covariance, in units of the noise squared.
    pub covariance: DMatrix<f64>,
}

impl Scores {
    /// Scores of `count` patterns; `show` fills those of the sample at a place. `samples` are the first row and height of each.
    pub fn new(
        whitened: &Whitened,
        beforehand: &Beforehand,
        samples: &[(usize, usize)],
        count: usize,
        show: &mut dyn FnMut(usize, &mut Patterns),
    ) -> Self {
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
        let plain_covariance = if beforehand.fitted { k.clone() } else { whitened.plain_covariance(&own, &along, beforehand) };
        Scores { z, k, own, plain, plain_covariance, squares: whitened.squares, dof: whitened.dof }
    }

    /// What patterns take.
    pub fn taken(&self, patterns: &[usize]) -> Taken {
        let n = patterns.len();
        let unit = DVector::from_fn(n, |i, _| {
            let own = self.own[(patterns[i], patterns[i])];
            if own > 0.0 { own.sqrt().recip() } else { 0.0 }
        });
        let k = DMatrix::from_fn(n, n, |i, j| self.k[(patterns[i], patterns[j])] * unit[i] * unit[j]);
        let z = DVector::from_fn(n, |i, _| self.z[patterns[i]] * unit[i]);
        let eigen = SymmetricEigen::new(k);
        let mut taken = Taken { squares: 0.0, dof: 0, sizes: DVector::zeros(n), covariance: DMatrix::zeros(n, n) };
        for (value, direction) in eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter()).filter(|(v, _)| **v > SEEN) {
            let score = direction.dot(&z);
            taken.squares += score * score / value;
            taken.dof += 1;
            taken.sizes += direction * (score / value);
            taken.covariance += direction * direction.transpose() / *value;
        }
        taken.sizes.component_mul_assign(&unit);
        for i in 0..n {
            for j in 0..n {
                taken.covariance[(i, j)] *= unit[i] * unit[j];
            }
        }
        taken
    }

    /// What patterns take beyond what `level`, which lies among their sums, takes alone.
    pub fn taken_beyond(&self, patterns: &[usize], level: usize) -> Taken {
        let (all, level) = (self.taken(patterns), self.taken(&[level]));
        Taken { squares: (all.squares - level.squares).max(0.0), dof: all.dof.saturating_sub(level.dof), ..all }
    }

    /// Lets patterns follow the residuals, as if the model had them: what others share with them is theirs no more.
    pub fn give(&mut self, patterns: &[usize]) {
        let taken = self.taken(patterns);
        let across = DMatrix::from_fn(self.z.len(), patterns.len(), |i, j| self.k[(i, patterns[j])]);
        self.z -= &across * &taken.sizes;
        self.k -= &across * &taken.covariance * across.transpose();
        self.squares = (self.squares - taken.squares).max(0.0);
        self.dof -= taken.dof as f64;
    }
}

impl Whitened {
    /// Covariance of `Aᵀ r` for rows that the informed parameters were not fitted to: what the free ones leave of the noise, and the
    /// uncertainty of the informed ones.
    fn plain_covariance(&self, own: &DMatrix<f64>, along: &DMatrix<f64>, beforehand: &Beforehand) -> DMatrix<f64> {
        let p = beforehand.parameters.len();
        let free: Vec<usize> = (0..p).filter(|i| !beforehand.informed.contains(i)).collect();
        let mut crossed = &self.lower * along;
        for (mut row, scale) in crossed.row_iter_mut().zip(self.scale.iter()) {
            row /= if *scale > 0.0 { *scale } else { 1.0 };
        }
        let pick = |m: &DMatrix<f64>, rows: &[usize]| DMatrix::from_fn(rows.len(), m.ncols(), |i, c| m[(rows[i], c)]);
        let (by_free, mut by_informed) = (pick(&crossed, &free), pick(&crossed, &beforehand.informed));
        let mut covariance = own.clone();
        if !free.is_empty() {
            let scale = DVector::from_fn(free.len(), |i, _| self.scale[free[i]]);
            let unit = DMatrix::from_fn(free.len(), free.len(), |i, k| {
                self.normal[(free[i], free[k])] * scale[i] * scale[k] + if i == k { RIDGE } else { 0.0 }
            });
            if let Some(factor) = unit.cholesky() {
                let scaled = DMatrix::from_fn(free.len(), own.ncols(), |i, c| by_free[(i, c)] * scale[i]);
                let solved = factor.solve(&scaled);
                covariance -= scaled.tr_mul(&solved);
                let shared = DMatrix::from_fn(beforehand.informed.len(), free.len(), |i, k| {
                    self.normal[(beforehand.informed[i], free[k])] * scale[k]
                });
                by_informed -= shared * solved;
            }
        }
        covariance + by_informed.tr_mul(&(&beforehand.covariance * &by_informed))
    }
}
