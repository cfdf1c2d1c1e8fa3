//! A look at every sample of a problem: how the arm stands in it, what is left over, and what the noise makes of that.

use nalgebra::{DMatrix, Matrix3, RowVector3, Vector3};

use super::{Linearised, Problem, Workspace};
use crate::robot::Posture;

/// One sample of a problem, the arm standing as the model says.
pub struct PosedSample<'a> {
    /// Its place among the samples.
    pub place: usize,
    /// Its dataset, by place.
    pub dataset: usize,
    /// Its set-up, by place.
    pub setup: usize,
    /// First of its scalar residuals among those of the problem.
    pub first_row: usize,
    /// How many scalar residuals it has: three, or one for a distance.
    pub height: usize,
    /// The arm.
    pub posture: &'a Posture,
    /// Measured minus predicted, world axes, m; of a distance along the line of sight.
    pub residual: Vector3<f64>,
    /// W (3 x 3, 1/m): a displacement of the TCP by `d` (world, m) takes `W d` off the whitened residual `W residual`. Of a distance
    /// only the first row is not zero.
    pub whitener: Matrix3<f64>,
    /// Sum of the variances of the residual's numbers, m²: of what is stated, or, where nothing is, taken for the weighting.
    pub variance: f64,
    /// From the anchor to the TCP, unit length, for a distance.
    pub sight: Option<Vector3<f64>>,
}

impl Problem {
    /// Shows every sample, in order, at `values`.
    pub fn for_each_sample(&self, values: &[f64], visit: &mut dyn FnMut(PosedSample<'_>)) {
        let mut work = Workspace::new(&self.robot);
        let state = self.load_state(values);
        for (place, row) in self.rows.iter().enumerate() {
            self.pose(place, values, &state, &mut work);
            let (residual, sight) = self.residual(row, &work);
            let w = row.whitener;
            let (residual, whitener, variance) = match sight {
                // d(distance)/d(TCP) is the line of sight, so a residual of the distance is one of the TCP along it.
                Some(sight) => {
                    let along = RowVector3::from(sight.transpose()) * w[(0, 0)];
                    let mut whitener = Matrix3::zeros();
                    whitener.set_row(0, &along);
                    (sight * residual.x, whitener, w[(0, 0)].powi(-2))
                }
                None => (residual, w, w.try_inverse().map_or(f64::NAN, |root| root.norm_squared())),
            };
            visit(PosedSample {
                place,
                dataset: row.cell,
                setup: row.setup,
                first_row: row.first_row,
                height: row.height(),
                posture: &work.posture,
                residual,
                whitener,
                variance,
                sight,
            });
        }
    }

    /// The whitened problem at `values`, transposed: a row for each of `parameters`, the last the residuals; a column a scalar residual.
    /// A parameter's row is what one of it (SI) takes off the residuals.
    pub fn whitened(&self, values: &[f64], parameters: &[usize]) -> DMatrix<f64> {
        let mut near = Linearised::new(self, parameters);
        self.linearise(values, &self.load_state(values), &mut Workspace::new(&self.robot), &mut near);
        near.transposed
    }
}
