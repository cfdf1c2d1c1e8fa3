//! Factorisation of symmetric positive definite matrices, and inverses of small ones.
//!
//! Nothing here falls back: a matrix that cannot be factored is an error, and its caller says what that means.

use nalgebra::allocator::Allocator;
use nalgebra::{Cholesky as SmallCholesky, DMatrix, DVector, DefaultAllocator, Dim, OMatrix};

use super::linalg::{Cholesky, LinalgError};

/// The Cholesky factor of a normal matrix scaled to a unit diagonal: `S A S + R = L L^T`, with S and the ridge R diagonal.
///
/// Parameters in metres and in radians differ by powers of ten; unscaled, their units would decide which pivot is rounding.
pub struct ScaledCholesky {
    factor: Cholesky,
    scale: DVector<f64>,
    scaled: DMatrix<f64>,
}

impl ScaledCholesky {
    /// Allocates for matrices of m x m.
    pub fn new(m: usize) -> Self {
        ScaledCholesky { factor: Cholesky::new(m), scale: DVector::zeros(m), scaled: DMatrix::zeros(m, m) }
    }

    /// Factors `a` (m x m), of which the lower triangle is read, scaled by its own diagonal.
    ///
    /// # Errors
    /// When `a` is not positive definite, with the column at which it is not.
    pub fn of(a: &DMatrix<f64>) -> Result<Self, LinalgError> {
        let mut new = ScaledCholesky::new(a.nrows());
        new.factor(|k| 1.0 / a[(k, k)].sqrt(), |r, c| a[(r, c)], |_, _| 0.0)?;
        Ok(new)
    }

    /// Factors the matrix of which `a` gives the lower triangle by row and column; `ridge` is added to the scaled diagonal, by
    /// column and its scale.
    ///
    /// # Errors
    /// When the matrix is not positive definite; the factor is then invalid until the next success.
    pub fn factor(
        &mut self,
        scale: impl Fn(usize) -> f64,
        a: impl Fn(usize, usize) -> f64,
        ridge: impl Fn(usize, f64) -> f64,
    ) -> Result<(), LinalgError> {
        let ScaledCholesky { factor, scale: by, scaled } = self;
        let m = by.len();
        (0..m).for_each(|k| by[k] = scale(k));
        for c in 0..m {
            for r in c..m {
                scaled[(r, c)] = a(r, c) * by[r] * by[c];
            }
            scaled[(c, c)] += ridge(c, by[c]);
        }
        factor.factor(scaled)
    }

    /// The diagonal of S.
    pub fn scale(&self) -> &DVector<f64> {
        &self.scale
    }

    /// Replaces the right-hand side `b` (m) by the solution of `A x = b`.
    pub fn solve_in_place(&mut self, b: &mut DVector<f64>) {
        b.component_mul_assign(&self.scale);
        self.factor.solve_in_place(b.as_mut_slice());
        b.component_mul_assign(&self.scale);
    }

    /// Natural logarithm of the determinant of A, where no ridge was added.
    pub fn log_determinant(&self) -> f64 {
        self.factor.log_determinant() - 2.0 * self.scale.iter().map(|s| s.ln()).sum::<f64>()
    }

    /// `L^-1 S b`, for `b` of m rows.
    pub fn half(&self, mut b: DMatrix<f64>) -> DMatrix<f64> {
        self.scale_rows(&mut b);
        self.factor.whiten(&mut b);
        b
    }

    /// `S L^-T b`: applied to [`half`](Self::half), the solution of `A x = b`.
    pub fn other_half(&self, mut b: DMatrix<f64>) -> DMatrix<f64> {
        self.factor.unwhiten(&mut b);
        self.scale_rows(&mut b);
        b
    }

    /// The inverse of A (m x m, both triangles).
    pub fn inverse(&mut self) -> DMatrix<f64> {
        let mut inverse = self.inverse_of_scaled();
        let m = inverse.nrows();
        for c in 0..m {
            for r in 0..m {
                inverse[(r, c)] *= self.scale[r] * self.scale[c];
            }
        }
        inverse
    }

    /// The inverse of `S A S + R` (m x m, both triangles).
    pub fn inverse_of_scaled(&mut self) -> DMatrix<f64> {
        let m = self.scale.len();
        let mut inverse = DMatrix::zeros(m, m);
        self.factor.inverse(&mut inverse);
        inverse
    }

    fn scale_rows(&self, b: &mut DMatrix<f64>) {
        for (mut row, scale) in b.row_iter_mut().zip(&self.scale) {
            row *= *scale;
        }
    }
}

/// Factors a small symmetric matrix `A = L L^T`, of which the lower triangle is read.
///
/// # Errors
/// When it is not positive definite, with the column at which it is not.
pub(crate) fn cholesky<D: Dim>(a: OMatrix<f64, D, D>) -> Result<SmallCholesky<f64, D>, LinalgError>
where
    DefaultAllocator: Allocator<D, D>,
{
    let n = a.nrows();
    let unfactored = a.clone();
    let is_finite = |factor: &SmallCholesky<f64, D>| (0..n).all(|k| factor.l_dirty()[(k, k)].is_finite());
    let factor = SmallCholesky::new(a).filter(is_finite);
    factor.ok_or_else(|| LinalgError::NotPositiveDefinite { column: first_bad_pivot(unfactored) })
}

/// Index of the first pivot that is not a positive number.
fn first_bad_pivot<D: Dim>(mut a: OMatrix<f64, D, D>) -> usize
where
    DefaultAllocator: Allocator<D, D>,
{
    let n = a.nrows();
    for k in 0..n {
        let pivot = a[(k, k)];
        if !(pivot > 0.0 && pivot.is_finite()) {
            return k;
        }
        for c in k + 1..n {
            for r in c..n {
                a[(r, c)] -= a[(r, k)] * a[(c, k)] / pivot;
            }
        }
    }
    n.saturating_sub(1)
}

/// `L^-1` of a covariance `L L^T`, lower triangular: it makes numbers of this covariance independent, each of variance one.
///
/// # Errors
/// When the covariance is not positive definite, with the column at which it is not.
pub(crate) fn whitener<D: Dim>(covariance: OMatrix<f64, D, D>) -> Result<OMatrix<f64, D, D>, LinalgError>
where
    DefaultAllocator: Allocator<D, D>,
{
    inverse(cholesky(covariance)?.l())
}

/// The inverse of a small square matrix.
///
/// # Errors
/// When it has none, or an entry is not finite.
pub(crate) fn inverse<D: Dim>(a: OMatrix<f64, D, D>) -> Result<OMatrix<f64, D, D>, LinalgError>
where
    DefaultAllocator: Allocator<D, D>,
{
    let size = a.nrows();
    let is_finite = |inverse: &OMatrix<f64, D, D>| inverse.iter().all(|x| x.is_finite());
    a.try_inverse().filter(is_finite).ok_or(LinalgError::Singular { size })
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Matrix3;

    /// Normal matrix of columns in units that differ by a million.
    fn normal() -> DMatrix<f64> {
        let j = DMatrix::from_fn(40, 5, |r, c| (0.7 * (r * (c + 1)) as f64).sin() * 10f64.powi(3 * (c as i32 % 3) - 3));
        j.tr_mul(&j)
    }

    #[test]
    fn a_scaled_factor_solves_and_inverts() {
        let a = normal();
        let mut factor = ScaledCholesky::of(&a).unwrap();
        let b = DVector::from_fn(5, |k, _| a[(k, k)].sqrt() * (k as f64 - 1.5));
        let mut x = b.clone();
        factor.solve_in_place(&mut x);
        assert!((&a * &x - &b).component_div(&b).amax() < 1e-12);
        let by_inverse = factor.inverse() * &b;
        let by_halves = factor.other_half(factor.half(DMatrix::from_columns(std::slice::from_ref(&b))));
        for other in [by_inverse, by_halves.column(0).into_owned()] {
            assert!((other - &x).component_div(&x).amax() < 1e-12);
        }
    }

    #[test]
    fn what_the_data_do_not_determine_is_named() {
        let dependent = |column: usize| {
            let mut a = normal();
            let twin = a.column(0) * 2.0;
            a.set_column(column, &twin);
            let twin = a.row(0) * 2.0;
            a.set_row(column, &twin);
            a[(column, column)] = 4.0 * a[(0, 0)] * (1.0 - 1e-9);
            a
        };
        let at = |a: &DMatrix<f64>| ScaledCholesky::of(a).map(drop);
        for column in [1, 3] {
            assert_eq!(at(&dependent(column)), Err(LinalgError::NotPositiveDefinite { column }));
            let small = cholesky(dependent(column)).map(drop);
            assert_eq!(small, Err(LinalgError::NotPositiveDefinite { column }));
        }
    }

    #[test]
    fn zero_infinity_and_no_number_are_errors_everywhere() {
        for bad in [0.0, f64::NAN, f64::INFINITY, -1.0] {
            let mut a = Matrix3::identity();
            a[(1, 1)] = bad;
            let expected = LinalgError::NotPositiveDefinite { column: 1 };
            assert_eq!(cholesky(a).map(drop), Err(expected), "{bad}");
            assert_eq!(whitener(a).map(drop), Err(expected), "{bad}");
            let wide = DMatrix::from_fn(3, 3, |r, c| a[(r, c)]);
            assert!(ScaledCholesky::of(&wide).is_err(), "{bad}");
            if bad != -1.0 {
                assert!(inverse(a).is_err() || bad == f64::INFINITY, "{bad}");
            }
        }
    }
}
