//! Linear algebra on `nalgebra` matrices: singular values, normal equations, Cholesky, and rank in a given order of columns.
//!
//! The only file that uses faer. Single-threaded, or with a fixed order of summation, and without allocation in functions
//! called once per iteration of a plan of ordinary size, so that a fit is reproducible bit by bit on one machine regardless
//! of other load; between machines the last bits may differ, as faer follows the processor's vector width.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt;
use faer::linalg::matmul::triangular::{self, BlockStructure};
use faer::linalg::{triangular_inverse, triangular_solve};
use faer::{Accum, Mat, MatMut, MatRef, Par};
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use thiserror::Error;

/// The reason why a factorisation failed.
#[derive(Debug, Error, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum LinalgError {
    /// The singular values could not be separated, as happens when an entry is not finite.
    #[error("the singular value decomposition of a {rows} x {columns} matrix did not converge")]
    SvdDidNotConverge {
        /// Rows.
        rows: usize,
        /// Columns.
        columns: usize,
    },
    /// The eigenvalues could not be separated, as happens when an entry is not finite.
    #[error("the eigenvalues of a {size} x {size} matrix did not converge")]
    EigenDidNotConverge {
        /// Rows and columns.
        size: usize,
    },
    /// The columns up to and including this one are dependent to working precision.
    #[error("the normal matrix is not positive definite at column {column}")]
    NotPositiveDefinite {
        /// Counted from 0.
        column: usize,
    },
    /// A matrix without an inverse, or with an entry that is not finite.
    #[error("a matrix of {size} x {size} has no inverse")]
    Singular {
        /// Rows and columns.
        size: usize,
    },
}

fn view(a: &DMatrix<f64>) -> MatRef<'_, f64> {
    MatRef::from_column_major_slice(a.as_slice(), a.nrows(), a.ncols())
}

fn view_mut(a: &mut DMatrix<f64>) -> MatMut<'_, f64> {
    let (rows, columns) = a.shape();
    MatMut::from_column_major_slice_mut(a.as_mut_slice(), rows, columns)
}

/// Singular values of `a` (rows x columns), largest first.
///
/// # Errors
/// When they do not converge.
pub fn singular_values(a: &DMatrix<f64>) -> Result<Vec<f64>, LinalgError> {
    view(a).singular_values().map_err(|_| LinalgError::SvdDidNotConverge { rows: a.nrows(), columns: a.ncols() })
}

/// Columns of a wide matrix per task. The number determines the order of the sums, so it is the same on all machines.
const STRETCH: usize = 4096;

/// Writes `a a^T` (m x m, both triangles) for `a` (m x rows), the transposed Jacobian, into `out`, which must be m x m.
///
/// With thousands of rows each stretch is a separate task, and the products are added in order: the same sum on any number
/// of threads.
pub fn normal_matrix(a: &DMatrix<f64>, out: &mut DMatrix<f64>) {
    let m = a.nrows();
    if a.ncols() <= STRETCH {
        lower_product(view(a), out);
    } else {
        let stretch = |cells: &[f64]| {
            let mut product = DMatrix::zeros(m, m);
            lower_product(MatRef::from_column_major_slice(cells, m, cells.len() / m), &mut product);
            product
        };
        let products: Vec<DMatrix<f64>> = a.as_slice().par_chunks(STRETCH * m.max(1)).map(stretch).collect();
        out.fill(0.0);
        products.iter().for_each(|product| *out += product);
    }
    out.fill_upper_triangle_with_lower_triangle();
}

fn lower_product(a: MatRef<'_, f64>, out: &mut DMatrix<f64>) {
    let m = a.nrows();
    triangular::matmul(
        MatMut::from_column_major_slice_mut(out.as_mut_slice(), m, m),
        BlockStructure::TriangularLower,
        Accum::Replace,
        a,
        BlockStructure::Rectangular,
        a.transpose(),
        BlockStructure::Rectangular,
        1.0,
        Par::Seq,
    );
}

/// Eigenvalues (ascending) and eigenvectors (columns) of a symmetric matrix, of which the lower triangle is read.
///
/// # Errors
/// When they do not converge, as happens when an entry is not finite.
pub fn symmetric_eigen(a: &DMatrix<f64>) -> Result<(DVector<f64>, DMatrix<f64>), LinalgError> {
    let n = a.nrows();
    // faer computes n - 1 of its size, which ends in a panic where overflow is checked.
    if n == 0 {
        return Ok((DVector::zeros(0), DMatrix::zeros(0, 0)));
    }
    let failed = |_| LinalgError::EigenDidNotConverge { size: n };
    let eigen = view(a).self_adjoint_eigen(faer::Side::Lower).map_err(failed)?;
    let (values, vectors) = (eigen.S(), eigen.U());
    Ok((DVector::from_fn(n, |k, _| values[k]), DMatrix::from_fn(n, n, |r, c| vectors[(r, c)])))
}

/// `a b` for `a` (m x k) and `b` (k x n).
pub fn product(a: &DMatrix<f64>, b: &DMatrix<f64>) -> DMatrix<f64> {
    let mut out = DMatrix::zeros(a.nrows(), b.ncols());
    let to = MatMut::from_column_major_slice_mut(out.as_mut_slice(), a.nrows(), b.ncols());
    faer::linalg::matmul::matmul(to, Accum::Replace, view(a), view(b), 1.0, Par::Seq);
    out
}

/// `a^T b` for `a` (k x m) and `b` (k x n).
pub fn product_of_transposed(a: &DMatrix<f64>, b: &DMatrix<f64>) -> DMatrix<f64> {
    let mut out = DMatrix::zeros(a.ncols(), b.ncols());
    let to = MatMut::from_column_major_slice_mut(out.as_mut_slice(), a.ncols(), b.ncols());
    faer::linalg::matmul::matmul(to, Accum::Replace, view(a).transpose(), view(b), 1.0, Par::Seq);
    out
}

/// `a b^T` for `a` (m x k) and `b` (n x k).
pub fn product_with_transposed(a: &DMatrix<f64>, b: &DMatrix<f64>) -> DMatrix<f64> {
    let mut out = DMatrix::zeros(a.nrows(), b.nrows());
    let to = MatMut::from_column_major_slice_mut(out.as_mut_slice(), a.nrows(), b.nrows());
    faer::linalg::matmul::matmul(to, Accum::Replace, view(a), view(b).transpose(), 1.0, Par::Seq);
    out
}

/// The triangle R of `a = Q R`, by Householder reflections; its number of rows is the smaller dimension of `a`.
///
/// For a tall matrix, the triangle of its stretches' triangles, each computed as a separate task.
pub fn triangle(a: DMatrix<f64>) -> DMatrix<f64> {
    if a.nrows() > STRETCH {
        let firsts: Vec<usize> = (0..a.nrows()).step_by(STRETCH).collect();
        let stretch = |&first: &usize| a.rows(first, STRETCH.min(a.nrows() - first)).into_owned().qr().unpack_r();
        let triangles: Vec<DMatrix<f64>> = firsts.par_iter().map(stretch).collect();
        let mut stacked = DMatrix::zeros(triangles.iter().map(|r| r.nrows()).sum(), a.ncols());
        let mut first = 0;
        for r in &triangles {
            stacked.rows_mut(first, r.nrows()).copy_from(r);
            first += r.nrows();
        }
        return stacked.qr().unpack_r();
    }
    // At a few hundred rows nalgebra's unblocked reflections, which allocate once, are faster than faer's.
    a.qr().unpack_r()
}

/// The Cholesky factor `L L^T` of a symmetric positive definite m x m matrix, with memory reused between factorisations.
pub struct Cholesky {
    l: Mat<f64>,
    scratch: MemBuffer,
}

impl Cholesky {
    /// Allocates for matrices of m x m.
    pub fn new(m: usize) -> Self {
        let factor = llt::factor::cholesky_in_place_scratch::<f64>(m, Par::Seq, Default::default());
        let solve = llt::solve::solve_in_place_scratch::<f64>(m, m, Par::Seq);
        let inverse = llt::inverse::inverse_scratch::<f64>(m, Par::Seq);
        Cholesky { l: Mat::zeros(m, m), scratch: MemBuffer::new(factor.or(solve).or(inverse)) }
    }

    /// Factors `a` (m x m), of which the lower triangle is read.
    ///
    /// # Errors
    /// At the first pivot that is not positive; the factor is then invalid until the next success.
    pub fn factor(&mut self, a: &DMatrix<f64>) -> Result<(), LinalgError> {
        let m = self.l.nrows();
        assert_eq!(a.shape(), (m, m), "a Cholesky workspace serves one size");
        self.l.copy_from_triangular_lower(view(a));
        let stack = MemStack::new(&mut self.scratch);
        llt::factor::cholesky_in_place(self.l.as_mut(), Default::default(), Par::Seq, stack, Default::default())
            .map(drop)
            .map_err(|llt::factor::LltError::NonPositivePivot { index }| LinalgError::NotPositiveDefinite { column: index })
    }

    /// Replaces the right-hand side `b` (m) by the solution of `a x = b`.
    pub fn solve_in_place(&mut self, b: &mut [f64]) {
        let m = self.l.nrows();
        let b = MatMut::from_column_major_slice_mut(b, m, 1);
        llt::solve::solve_in_place(self.l.as_ref(), b, Par::Seq, MemStack::new(&mut self.scratch));
    }

    /// Replaces every column of `b` (m x any) by `L^-1 b`.
    pub fn whiten(&self, b: &mut DMatrix<f64>) {
        triangular_solve::solve_lower_triangular_in_place(self.l.as_ref(), view_mut(b), Par::Seq);
    }

    /// Replaces every column of `b` (m x any) by `L^-T b`.
    pub fn unwhiten(&self, b: &mut DMatrix<f64>) {
        triangular_solve::solve_upper_triangular_in_place(self.l.transpose(), view_mut(b), Par::Seq);
    }

    /// Natural logarithm of the determinant of the factored matrix.
    pub fn log_determinant(&self) -> f64 {
        2.0 * (0..self.l.nrows()).map(|i| self.l[(i, i)].ln()).sum::<f64>()
    }

    /// Writes `S = L^-T` (m x m, upper triangular) into `out`: the inverse is `S S^T`.
    pub fn inverse_root(&self, out: &mut DMatrix<f64>) {
        let m = self.l.nrows();
        out.fill(0.0);
        let transposed = MatMut::from_row_major_slice_mut(out.as_mut_slice(), m, m);
        triangular_inverse::invert_lower_triangular(transposed, self.l.as_ref(), Par::Seq);
    }

    /// Writes the inverse (m x m, both triangles) into `out`: the covariance, if the factored matrix is the information.
    pub fn inverse(&mut self, out: &mut DMatrix<f64>) {
        let m = self.l.nrows();
        let stack = MemStack::new(&mut self.scratch);
        llt::inverse::inverse(MatMut::from_column_major_slice_mut(out.as_mut_slice(), m, m), self.l.as_ref(), Par::Seq, stack);
        out.fill_upper_triangle_with_lower_triangle();
    }
}

/// A column in the span of the columns kept before it.
#[derive(Debug, Clone, PartialEq)]
pub struct Dependent {
    /// Its index.
    pub column: usize,
    /// The kept columns that combine to it, with coefficients for all columns at unit norm; coefficients below
    /// [`NEGLIGIBLE_COEFFICIENT`] of the largest are left out. Empty for a column of zeros.
    pub combination: Vec<(usize, f64)>,
    /// Norm of its component outside the span of the kept columns, at unit norm: the sine of its angle to the span.
    pub residual_ratio: f64,
}

/// The independent columns, with preference for earlier ones.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct OrderedRank {
    /// Indices of the independent columns, in order.
    pub kept: Vec<usize>,
    /// The others, in order.
    pub dependent: Vec<Dependent>,
}

/// Coefficients of a combination below this share of its largest are not reported: they carry no information for a reader.
pub const NEGLIGIBLE_COEFFICIENT: f64 = 1e-3;

/// A column whose norm is below this share of the largest is rounding, not signal: at unit norm it would look independent.
/// Columns of physical parameters in SI differ by 1e6 at most, and rounding is at 1e-16.
pub const ROUNDING_NORM: f64 = 1e-12;

/// Splits the columns of `j` (rows x m) into independent and dependent, in the given order, after scaling them to unit norm.
///
/// A column is dependent if the component outside the span of the kept columns before it is less than its tolerance (one
/// per column) of its norm. The tall matrix is first reduced to its triangle R by Householder reflections, which preserve
/// every inner product of the columns to about 1e-15 of their norms (Golub & Van Loan 2013, 5.2.1); the decisions are then
/// made on R by modified Gram–Schmidt, done twice (Giraud, Langou, Rozložník 2005). Tolerances down to 1e-12 are therefore
/// meaningful; 1e-14 would decide on rounding.
pub fn ordered_independent_columns(j: &DMatrix<f64>, tolerances: &[f64]) -> OrderedRank {
    assert_eq!(j.ncols(), tolerances.len(), "one tolerance a column");
    let norms: Vec<f64> = j.column_iter().map(|c| c.norm()).collect();
    let floor = ROUNDING_NORM * norms.iter().copied().fold(0.0, f64::max);
    let unit = DMatrix::from_fn(j.nrows(), j.ncols(), |r, c| if norms[c] > floor { j[(r, c)] / norms[c] } else { 0.0 });
    let triangle = triangle(unit);

    let mut rank = OrderedRank::default();
    let mut basis: Vec<Vec<f64>> = Vec::new();
    // Column k of the triangle of the kept columns: components of the k-th kept column along the basis.
    let mut factor: Vec<Vec<f64>> = Vec::new();
    for c in 0..j.ncols() {
        if norms[c] <= floor || norms[c].is_nan() {
            rank.dependent.push(Dependent { column: c, combination: Vec::new(), residual_ratio: 0.0 });
            continue;
        }
        // Below its diagonal the triangle is zero, and so is every basis vector below its own column's.
        let mut rest: Vec<f64> = triangle.column(c).iter().take(c + 1).copied().collect();
        let mut along = vec![0.0; basis.len()];
        for _ in 0..2 {
            for (q, along) in basis.iter().zip(&mut along) {
                let share: f64 = q.iter().zip(&rest).map(|(q, x)| q * x).sum();
                rest.iter_mut().zip(q).for_each(|(x, q)| *x -= share * q);
                *along += share;
            }
        }
        let residual_ratio = rest.iter().map(|x| x * x).sum::<f64>().sqrt();
        if residual_ratio > tolerances[c] {
            rest.iter_mut().for_each(|x| *x /= residual_ratio);
            basis.push(rest);
            along.push(residual_ratio);
            factor.push(along);
            rank.kept.push(c);
        } else {
            let combination = combination(&factor, &rank.kept, along);
            rank.dependent.push(Dependent { column: c, combination, residual_ratio });
        }
    }
    rank
}

/// Solves `R x = along` by back substitution and returns the columns with significant coefficients.
fn combination(factor: &[Vec<f64>], kept: &[usize], mut along: Vec<f64>) -> Vec<(usize, f64)> {
    for k in (0..along.len()).rev() {
        along[k] /= factor[k][k];
        for i in 0..k {
            along[i] -= factor[k][i] * along[k];
        }
    }
    let largest = along.iter().fold(0.0_f64, |a, x| a.max(x.abs()));
    kept.iter().copied().zip(along).filter(|(_, x)| x.abs() > NEGLIGIBLE_COEFFICIENT * largest).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    fn random(rows: usize, columns: usize, seed: u64) -> DMatrix<f64> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        DMatrix::from_fn(rows, columns, |_, _| rng.random_range(-1.0..1.0))
    }

    #[test]
    fn a_matrix_without_rows_has_no_eigenvalues() {
        let (values, vectors) = symmetric_eigen(&DMatrix::zeros(0, 0)).unwrap();
        assert_eq!((values.len(), vectors.shape()), (0, (0, 0)));
    }

    #[test]
    fn singular_values_come_largest_first_and_make_the_norm() {
        let a = random(40, 7, 1);
        let values = singular_values(&a).unwrap();
        assert!(values.windows(2).all(|w| w[0] >= w[1]));
        let oracle = a.singular_values();
        assert!(values.iter().zip(oracle.iter()).all(|(ours, theirs)| (ours - theirs).abs() < 1e-13));
    }

    #[test]
    fn normal_matrix_and_its_factor_agree_with_nalgebra() {
        let j = random(240, 31, 2);
        let mut normal = DMatrix::zeros(31, 31);
        normal_matrix(&j.transpose(), &mut normal);
        assert!((&normal - j.transpose() * &j).norm() < 1e-11);
        let mut cholesky = Cholesky::new(31);
        cholesky.factor(&normal).unwrap();
        let mut covariance = DMatrix::zeros(31, 31);
        cholesky.inverse(&mut covariance);
        assert!((&covariance * &normal - DMatrix::identity(31, 31)).norm() < 1e-12);
        let mut root = DMatrix::zeros(31, 31);
        cholesky.inverse_root(&mut root);
        assert!((&root * root.transpose() - &covariance).norm() < 1e-13 * covariance.norm());
        let oracle = nalgebra::Cholesky::new(normal.clone()).unwrap();
        assert!((cholesky.log_determinant() - oracle.ln_determinant()).abs() < 1e-11);
        let b = random(31, 1, 3);
        let mut halves = b.clone();
        cholesky.whiten(&mut halves);
        assert!((halves.norm_squared() - b.dot(&(&covariance * &b))).abs() < 1e-12);
        cholesky.unwhiten(&mut halves);
        assert!((&normal * halves - &b).norm() < 1e-12);
        let mut x = b.clone();
        cholesky.solve_in_place(x.as_mut_slice());
        assert!((normal * x - b).norm() < 1e-12);
    }

    #[test]
    fn an_indefinite_matrix_names_its_column_and_spoils_nothing_after_it() {
        let mut a = DMatrix::identity(5, 5);
        a[(3, 3)] = -1.0;
        let mut cholesky = Cholesky::new(5);
        assert_eq!(cholesky.factor(&a), Err(LinalgError::NotPositiveDefinite { column: 3 }));
        cholesky.factor(&DMatrix::identity(5, 5)).unwrap();
        assert_eq!(cholesky.log_determinant(), 0.0);
    }

    #[test]
    fn what_is_not_finite_is_an_error_or_not_a_number_but_no_panic() {
        let mut a = random(6, 3, 4);
        a[(2, 1)] = f64::NAN;
        assert!(singular_values(&a).is_err() || singular_values(&a).unwrap().iter().any(|s| s.is_nan()));
        assert_eq!(ordered_independent_columns(&a, &vec![1e-9; a.ncols()]).kept, [0, 2]);
    }

    #[test]
    fn earlier_columns_are_preferred_and_later_ones_explained() {
        // Column 2 is zero, column 4 is 2 c0 - c3 at any scale, column 5 is rounding relative to the others.
        let mut a = random(300, 7, 5);
        a.column_mut(2).fill(0.0);
        let sum = (a.column(0) * 2.0 - a.column(3)) * 1e-6;
        a.set_column(4, &sum);
        let speck = a.column(5) * 1e-17;
        a.set_column(5, &speck);
        let rank = ordered_independent_columns(&a, &vec![1e-10; a.ncols()]);
        assert_eq!(rank.kept, [0, 1, 3, 6]);
        let columns: Vec<usize> = rank.dependent.iter().map(|d| d.column).collect();
        assert_eq!(columns, [2, 4, 5]);
        assert!(rank.dependent[0].combination.is_empty());
        let d = &rank.dependent[1];
        assert!(d.residual_ratio < 1e-14);
        let n = |k: usize| a.column(k).norm();
        let expected = [(0, 2e-6 * n(0) / n(4)), (3, -1e-6 * n(3) / n(4))];
        assert_eq!(d.combination.len(), 2);
        for ((column, coefficient), (expected, value)) in d.combination.iter().zip(expected) {
            assert_eq!(*column, expected);
            assert!((coefficient - value).abs() < 1e-12);
        }
    }

    #[test]
    fn the_tolerance_is_the_sine_of_the_angle() {
        let mut a = random(200, 3, 6);
        let nearly = a.column(0) / a.column(0).norm();
        let aside = {
            let c = a.column(1) - &nearly * nearly.dot(&a.column(1));
            &c / c.norm()
        };
        a.set_column(2, &(nearly * (1.0 - 1e-12_f64).sqrt() + aside * 1e-6));
        let pair = a.clone().remove_column(1);
        assert_eq!(ordered_independent_columns(&pair, &[0.9e-6; 2]).kept, [0, 1]);
        let rank = ordered_independent_columns(&pair, &[1.1e-6; 2]);
        assert_eq!(rank.kept, [0]);
        assert!((rank.dependent[0].residual_ratio - 1e-6).abs() < 1e-13);
        assert_eq!(
            ordered_independent_columns(&a, &vec![1e-10; a.ncols()]).kept,
            [0, 1],
            "the aside lies in the span of the first two"
        );
    }

    #[test]
    fn more_columns_than_rows_leave_as_many_as_rows() {
        let rank = ordered_independent_columns(&random(5, 9, 7), &[1e-9; 9]);
        assert_eq!(rank.kept, [0, 1, 2, 3, 4]);
        assert_eq!(rank.dependent.len(), 4);
    }
}
