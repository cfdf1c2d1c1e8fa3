//! Read access to every sample of a problem: the posture of the arm, the residual and its noise.

use nalgebra::{DMatrix, Matrix3, RowVector3, Vector3};

use super::{Linearised, Problem, Workspace};
use crate::math::positive_definite::inverse;
use crate::robot::kinematics::Posture;

/// One sample of a problem, the arm posed according to the model.
pub struct PosedSample<'a> {
    /// Its index among the samples.
    pub place: usize,
    /// Index of its dataset.
    pub dataset: usize,
    /// Index of its set-up.
    pub setup: usize,
    /// First of its scalar residuals among those of the problem.
    pub first_row: usize,
    /// Number of its scalar residuals that are of its position, the first ones: three, or one for a distance.
    pub height: usize,
    /// Number of all its scalar residuals: three more if its orientation was measured.
    pub rows: usize,
    /// The arm.
    pub posture: &'a Posture,
    /// Measured minus predicted, world axes, m; for a distance, along the line of sight.
    pub residual: Vector3<f64>,
    /// W (3 x 3, 1/m): a displacement of the TCP by `d` (world, m) subtracts `W d` from the whitened residual `W residual`.
    /// For a distance only the first row is non-zero.
    pub whitener: Matrix3<f64>,
    /// Sum of the variances of the residual's components, m²: as stated, or as assumed for the weighting if not stated.
    pub variance: f64,
    /// Measured minus predicted orientation, a rotation vector in world axes, rad, if it was measured.
    pub turn: Option<Vector3<f64>>,
    /// Unit vector from the anchor to the TCP, for a distance.
    pub sight: Option<Vector3<f64>>,
}

impl Problem {
    /// Calls `visit` for every sample, in order, at `values`.
    pub fn for_each_sample(&self, values: &[f64], visit: &mut dyn FnMut(PosedSample<'_>)) {
        let mut work = Workspace::new(&self.robot);
        let state = self.load_state(values);
        for (place, row) in self.rows.iter().enumerate() {
            self.pose(place, values, &state, &mut work);
            let seen = self.seen_orientation(row, &work);
            let (residual, sight) = self.residual(row, seen.as_ref(), &work);
            let w = row.whitener;
            let (residual, whitener, variance) = match sight {
                // d(distance)/d(TCP) is the line of sight, so a distance residual is a TCP residual along it.
                Some(sight) => {
                    let along = RowVector3::from(sight.transpose()) * w[(0, 0)];
                    let mut whitener = Matrix3::zeros();
                    whitener.set_row(0, &along);
                    (sight * residual.x, whitener, w[(0, 0)].powi(-2))
                }
                // The whitener of a position was made by inverting a root of its covariance.
                None => (residual, w, inverse(w).map_or(f64::NAN, |root| root.norm_squared())),
            };
            visit(PosedSample {
                place,
                dataset: row.cell,
                setup: row.setup,
                first_row: row.first_row,
                height: row.positions(),
                rows: row.height(),
                turn: seen.map(|seen| seen.residual),
                posture: &work.posture,
                residual,
                whitener,
                variance,
                sight,
            });
        }
    }

    /// The whitened problem at `values`, transposed: one row per parameter of `parameters`, the last row the residuals; one
    /// column per scalar residual. A parameter's row is the amount that one SI unit of it subtracts from the residuals.
    pub fn whitened(&self, values: &[f64], parameters: &[usize]) -> DMatrix<f64> {
        let mut near = Linearised::new(self, parameters);
        self.linearise(values, &self.load_state(values), &mut Workspace::new(&self.robot), &mut near);
        near.transposed
    }
}
