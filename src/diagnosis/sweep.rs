//! Columns that depend on a scanned position: an order, a change point, a length scale. Each is a carrier (derivative
//! of a sample's residual with respect to a site of the arm) times a feature (one number per sample), so thousands of
//! columns cost one matrix product.

use std::borrow::Cow;

use nalgebra::{DMatrix, DVector, Vector6};

use super::background::Background;
use super::evidence::Seen;
use super::examination::Examination;
use crate::identify::problem::SampleContext;
use crate::math::linalg;

/// Projected columns `carrier_c(i) feature_b(i)`; column `b * carriers + c`.
pub(crate) struct Sweep<'a> {
    /// Inner product of carriers c and d at every sample, at index `c * carriers + d`.
    among: Vec<DVector<f64>>,
    carriers: usize,
    /// Samples x features.
    features: Cow<'a, DMatrix<f64>>,
    /// Result of [`Projection::half`](super::projection::Projection::half) for the products with the fitted parameters.
    half: DMatrix<f64>,
    /// Projected inner products with the candidates' columns, in the background's principal directions.
    along: DMatrix<f64>,
    z: DVector<f64>,
}

/// A range of columns of a sweep, as one candidate.
pub(crate) struct Block {
    pub k: DMatrix<f64>,
    pub z: DVector<f64>,
    along: DMatrix<f64>,
    /// Squared norm before projection.
    pub whole: f64,
}

impl<'a> Sweep<'a> {
    /// Multiplies these carriers (one vector per sample each) by these features (samples x features).
    pub fn new(
        examination: &Examination,
        background: &Background,
        carriers: &[Vec<Vector6<f64>>],
        features: Cow<'a, DMatrix<f64>>,
    ) -> Self {
        let mut products = DMatrix::zeros(examination.rows.nrows(), features.ncols() * carriers.len());
        for (c, carrier) in carriers.iter().enumerate() {
            let of_carrier = linalg::product(&moved(examination, carrier), &features);
            for (b, column) in of_carrier.column_iter().enumerate() {
                products.set_column(b * carriers.len() + c, &column);
            }
        }
        Sweep::of(examination, background, carriers, features, products)
    }

    /// A sweep over the samples: the carriers at one sample after the other.
    pub fn of_each_sample(examination: &Examination, background: &Background, carriers: &[Vec<Vector6<f64>>]) -> Self {
        let samples = examination.contexts.len();
        let mut products = DMatrix::zeros(examination.rows.nrows(), samples * carriers.len());
        for (c, carrier) in carriers.iter().enumerate() {
            for (i, column) in moved(examination, carrier).column_iter().enumerate() {
                products.set_column(i * carriers.len() + c, &column);
            }
        }
        Sweep::of(examination, background, carriers, Cow::Owned(DMatrix::zeros(samples, 0)), products)
    }

    fn of(
        examination: &Examination,
        background: &Background,
        carriers: &[Vec<Vector6<f64>>],
        features: Cow<'a, DMatrix<f64>>,
        products: DMatrix<f64>,
    ) -> Self {
        let (m, n) = (examination.fitted.len(), examination.columns.len());
        let projection = &examination.projection;
        let half = projection.half(products.rows(0, m).into_owned());
        let cross = products.rows(m, n) - linalg::product_of_transposed(&projection.of_columns, &half);
        let z = products.row(m + n).transpose() - half.tr_mul(&projection.of_residual);
        let along = background.along(&cross);
        let contexts = &examination.contexts;
        let product = |c: &[Vector6<f64>], d: &[Vector6<f64>]| {
            DVector::from_fn(contexts.len(), |i, _| (0..contexts[i].height).map(|a| c[i][a] * d[i][a]).sum::<f64>())
        };
        let among = carriers.iter().flat_map(|c| carriers.iter().map(move |d| product(c, d))).collect();
        Sweep { among, carriers: carriers.len(), features, half, along, z }
    }

    /// Returns the columns of features `first` ... `first + count` as one candidate; each has the plausible size
    /// `plausible` (SI).
    pub fn block(&self, first: usize, count: usize, plausible: f64) -> Block {
        let carriers = self.carriers;
        let (from, wide) = (first * carriers, count * carriers);
        let features = self.features.columns(first, count).into_owned();
        let mut own = DMatrix::zeros(wide, wide);
        for (place, among) in self.among.iter().enumerate() {
            let mut weighted = features.clone();
            weighted.column_iter_mut().for_each(|mut column| column.component_mul_assign(among));
            let products = linalg::product_of_transposed(&features, &weighted);
            let (c, d) = (place / carriers, place % carriers);
            for (k, x) in products.iter().enumerate() {
                own[(k % count * carriers + c, k / count * carriers + d)] = *x;
            }
        }
        self.projected(own, from, wide, plausible)
    }

    fn projected(&self, own: DMatrix<f64>, from: usize, wide: usize, plausible: f64) -> Block {
        let half = self.half.columns(from, wide);
        let s2 = plausible * plausible;
        Block {
            whole: own.trace() * s2,
            k: (own - half.tr_mul(&half)) * s2,
            z: self.z.rows(from, wide) * plausible,
            along: self.along.columns(from, wide) * plausible,
        }
    }

    /// Returns the carriers at sample `i` as one candidate, from a sweep [over each sample](Sweep::of_each_sample).
    pub fn of_sample(&self, i: usize, plausible: f64) -> Block {
        let among = DMatrix::from_fn(self.carriers, self.carriers, |c, d| self.among[c * self.carriers + d][i]);
        self.projected(among, i * self.carriers, self.carriers, plausible)
    }
}

/// Inner products of a carrier at each sample with all rows of the examination: rows x samples.
fn moved(examination: &Examination, carrier: &[Vector6<f64>]) -> DMatrix<f64> {
    let rows = &examination.rows;
    let mut moved = DMatrix::zeros(rows.nrows(), carrier.len());
    for ((i, at), carrier) in examination.contexts.iter().enumerate().zip(carrier) {
        let mut to = moved.column_mut(i);
        for axis in 0..at.height {
            to.axpy(carrier[axis], &rows.column(at.first_row + axis), 1.0);
        }
    }
    moved
}

impl Block {
    /// Log evidence vs. noise alone, and vs. background.
    pub fn ln_evidence(&self, examination: &Examination, background: &Background, sizes: &[f64]) -> [f64; 2] {
        let plain = Seen::new(self.k.clone(), &self.z).ln_evidence(&examination.remainder, sizes);
        [plain, background.ln_evidence_of(&self.k, &self.z, &self.along, sizes)]
    }
}

/// Carrier: the angle of joint `j`.
pub(crate) fn joint(contexts: &[SampleContext], j: usize) -> Vec<Vec<Vector6<f64>>> {
    vec![contexts.iter().map(|c| c.joints[j]).collect()]
}

/// Carriers: the position of the base in the world.
pub(crate) fn base(contexts: &[SampleContext]) -> Vec<Vec<Vector6<f64>>> {
    (0..3).map(|k| contexts.iter().map(|c| c.base[k]).collect()).collect()
}

/// Carriers: the position of the TCP in the last frame.
pub(crate) fn tool(contexts: &[SampleContext]) -> Vec<Vec<Vector6<f64>>> {
    (0..3).map(|k| contexts.iter().map(|c| c.tool[k]).collect()).collect()
}
