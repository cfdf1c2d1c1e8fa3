//! Information about the robot from the postures at one ball, and from all balls of an artifact.
//!
//! Whitened rows `A_i` of a posture (3 x parameters) and `B_i` (3 x the ball's own three numbers) add up to the information `M
//! = sum A_i^T A_i`; the ball, known to one-sigma `s` from its certificate, is eliminated (Schur complement): `M - N (K +
//! I/s²)^-1 N^T`, `N = sum A_i^T B_i`, `K = sum B_i^T B_i`. Balls share no numbers, so the information from an artifact is the
//! sum over its balls.

use calibench::effects::Owner;
use calibench::identify::Model;
use calibench::identify::fit::independent_parameters;
use calibench::identify::problem::{Parameter, Prior, Problem, Use};
use calibench::measure::dataset::{Dataset, Measured, NamedDataset, Sample};
use calibench::robot::kinematics::world_from_tool;
use calibench::units::UM;
use nalgebra::{DMatrix, DVector};

use calibench_sim::planning::{PlanError, shown};

/// Joint step for differences, rad: the error of a central difference is then far below a nanometre.
const STEP: f64 = 1e-5;

/// The unknowns of a layout: the model parameters that all places together can separate, then those with stated values (the
/// TCP).
#[derive(Debug, Clone)]
pub struct Sought {
    names: Vec<String>,
    /// Number of unknowns without prior knowledge.
    flat: usize,
    /// Prior information of each, 1/sigma², SI.
    prior: DVector<f64>,
}

fn positions(problem: &Problem, names: &[String]) -> Option<Vec<usize>> {
    names.iter().map(|name| problem.parameters().iter().position(|p| p.name == *name)).collect()
}

fn is_of_a_ball(p: &Parameter) -> bool {
    p.owner == Owner::Artifact && matches!(p.knowledge, Prior::Certified(_))
}

impl Sought {
    /// Finds the unknowns of a cell whose samples show everything that can be measured.
    ///
    /// # Errors
    /// If model and cell do not match.
    pub fn new(all: &Dataset, model: &Model) -> Result<Self, PlanError> {
        let mut certain = Dataset { tool_sigma: 0.0, ..all.clone() };
        certain.balls.iter_mut().for_each(|b| b.sigma = 0.0);
        let problem = Problem::new(&[NamedDataset::new("places", &certain)], &shown(model, &certain), Use::Fit)?;
        let mut names: Vec<String> =
            independent_parameters(&problem)?.into_iter().map(|p| problem.parameters()[p].name.clone()).collect();
        let flat = names.len();
        let mut one = all.clone();
        one.samples.truncate(1);
        let problem = Problem::new(&[NamedDataset::new("places", &one)], &shown(model, &one), Use::Fit)?;
        let mut prior = vec![0.0; flat];
        for p in problem.parameters().iter().filter(|p| matches!(p.knowledge, Prior::Certified(_)) && !is_of_a_ball(p)) {
            names.push(p.name.clone());
            prior.push(p.knowledge.information());
        }
        Ok(Sought { names, flat, prior: DVector::from_vec(prior) })
    }

    /// Number of unknowns without prior knowledge.
    pub fn flat(&self) -> usize {
        self.flat
    }

    /// Number of all unknowns.
    pub fn count(&self) -> usize {
        self.names.len()
    }

    /// The prior information.
    pub fn beforehand(&self) -> DMatrix<f64> {
        DMatrix::from_diagonal(&self.prior)
    }

    /// Information from probings of any balls, balls eliminated, with the prior; `None` if they do not involve all unknowns.
    ///
    /// # Errors
    /// If model and cell do not match.
    pub fn information(&self, cell: &Dataset, model: &Model) -> Result<Option<DMatrix<f64>>, PlanError> {
        let problem = Problem::new(&[NamedDataset::new("plan", cell)], &shown(model, cell), Use::Fit)?;
        let Some(mut all) = positions(&problem, &self.names) else { return Ok(None) };
        let of_balls: Vec<usize> =
            (0..problem.parameters().len()).filter(|&p| is_of_a_ball(&problem.parameters()[p])).collect();
        let sigma: Vec<f64> = of_balls.iter().map(|&p| problem.parameters()[p].knowledge.information()).collect();
        let (n, k) = (all.len(), of_balls.len());
        all.extend(of_balls);
        let rows = problem.whitened(&problem.start(), &all);
        let (a, b) = (rows.rows(0, n), rows.rows(n, k));
        Ok(Some(eliminated(a * a.transpose(), &(a * b.transpose()), b * b.transpose(), &sigma) + self.beforehand()))
    }
}

/// `M - N (K + diag(prior))^-1 N^T`.
fn eliminated(m: DMatrix<f64>, n: &DMatrix<f64>, mut k: DMatrix<f64>, prior: &[f64]) -> DMatrix<f64> {
    prior.iter().enumerate().for_each(|(i, p)| k[(i, i)] += p);
    // A ball without prior knowledge or observations removes no information.
    let seen: Vec<usize> = (0..prior.len()).filter(|&i| k[(i, i)] > 0.0).collect();
    if seen.is_empty() {
        return m;
    }
    let (n, k) = (n.select_columns(&seen), k.select_columns(&seen).select_rows(&seen));
    match k.cholesky() {
        Some(factor) => {
            let solved = factor.solve(&n.transpose());
            m - n * solved
        }
        // Observations that leave a ball undetermined give no information: a layout of such balls alone determines nothing.
        None => DMatrix::zeros(m.nrows(), m.ncols()),
    }
}

/// The postures found at one ball, and the information from each.
pub struct PlaceInformation {
    /// Whitened rows, transposed: the unknowns, then the ball's own numbers, by three columns per posture.
    rows: DMatrix<f64>,
    /// Plain rows of the unknowns without prior, for choosing postures; row-major, three per posture.
    plain: Vec<f64>,
    /// Prior information of the ball, 1/sigma², SI.
    ball: Vec<f64>,
    sought: usize,
}

impl PlaceInformation {
    /// Examines a cell with one ball and its postures as samples; `None` if they do not involve all unknowns.
    ///
    /// # Errors
    /// If model and cell do not match.
    pub fn new(cell: &Dataset, model: &Model, sought: &Sought) -> Result<Option<Self>, PlanError> {
        let problem = Problem::new(&[NamedDataset::new("place", cell)], &shown(model, cell), Use::Fit)?;
        let Some(mut all) = positions(&problem, &sought.names) else { return Ok(None) };
        let plain = problem.plain_jacobian(&problem.start(), &all[..sought.flat]).transpose().as_slice().to_vec();
        let of_ball: Vec<usize> = (0..problem.parameters().len()).filter(|&p| is_of_a_ball(&problem.parameters()[p])).collect();
        let ball = of_ball.iter().map(|&p| problem.parameters()[p].knowledge.information()).collect();
        all.extend(of_ball);
        let mut rows = problem.whitened(&problem.start(), &all);
        let kept = all.len();
        rows.resize_vertically_mut(kept, 0.0);
        Ok(Some(PlaceInformation { rows, plain, ball, sought: sought.count() }))
    }

    /// Number of postures.
    pub fn postures(&self) -> usize {
        self.rows.ncols() / 3
    }

    /// Plain rows of the unknowns without prior, row-major, three per posture.
    pub fn plain(&self) -> &[f64] {
        &self.plain
    }

    /// Information from `count` average postures.
    pub fn on_average(&self, count: usize) -> DMatrix<f64> {
        let share = count as f64 / self.postures() as f64;
        self.of_rows(&self.rows, share)
    }

    /// Information from the given postures.
    pub fn of(&self, postures: impl Iterator<Item = usize>) -> DMatrix<f64> {
        let columns: Vec<usize> = postures.flat_map(|p| 3 * p..3 * p + 3).collect();
        self.of_rows(&self.rows.select_columns(&columns), 1.0)
    }

    fn of_rows(&self, rows: &DMatrix<f64>, share: f64) -> DMatrix<f64> {
        let (a, b) = (rows.rows(0, self.sought), rows.rows(self.sought, self.ball.len()));
        eliminated(a * a.transpose() * share, &(a * b.transpose() * share), b * b.transpose() * share, &self.ball)
    }
}

/// Sensitivity of the TCP to the unknowns at poses of the workspace.
pub struct Workspace {
    /// Joint angles, rad.
    pub poses: Vec<Vec<f64>>,
    /// Derivatives: unknowns by three columns per pose, SI.
    fields: DMatrix<f64>,
    /// Variance of the TCP position from joint errors invisible to the encoders, m², per pose: not caused by the calibration.
    pub unseen: Vec<f64>,
}

/// One-sigma of the TCP position over the workspace, from the uncertainty of the calibration alone.
#[derive(Debug, Clone, PartialEq)]
pub struct Predicted {
    /// Square root of the summed variances of x, y and z, per pose, m.
    pub sigma: Vec<f64>,
}

impl Predicted {
    /// The largest, um, and the index of its pose.
    pub fn worst(&self) -> (f64, usize) {
        self.sigma.iter().enumerate().fold((0.0, 0), |w, (k, s)| if s / UM > w.0 { (s / UM, k) } else { w })
    }

    /// The mean, um.
    pub fn mean(&self) -> f64 {
        self.sigma.iter().sum::<f64>() / self.sigma.len() as f64 / UM
    }
}

/// Pivot of information scaled to a unit diagonal below which it is rounding error: some combination of the unknowns is
/// undetermined.
const LEAST_PIVOT: f64 = 1e-11;

impl Workspace {
    /// Computes the sensitivities at these poses (rad) of a cell.
    ///
    /// # Errors
    /// If model and cell do not match.
    pub fn new(cell: &Dataset, model: &Model, sought: &Sought, poses: Vec<Vec<f64>>) -> Result<Self, PlanError> {
        let at = |q: &[f64]| world_from_tool(&cell.robot, &cell.base, &cell.tool, q).translation.vector;
        let samples = poses.iter().enumerate().map(|(k, q)| Sample::new(k.to_string(), q.clone(), Measured::Point(at(q))));
        let there = Dataset { samples: samples.collect(), ..cell.clone() };
        let problem = Problem::new(&[NamedDataset::new("workspace", &there)], &shown(model, &there), Use::Fit)?;
        // Parameters that only balls involve do not move the TCP elsewhere.
        let mut fields = DMatrix::zeros(sought.count(), 3 * poses.len());
        for (k, name) in sought.names.iter().enumerate() {
            if let Some(p) = problem.parameters().iter().position(|p| p.name == *name) {
                let column = problem.plain_jacobian(&problem.start(), &[p]);
                fields.set_row(k, &column.column(0).transpose());
            }
        }
        let unseen = |q: &Vec<f64>| {
            let variance = |(j, sigma): (usize, &f64)| {
                let moved = |by: f64| {
                    let mut q = q.clone();
                    q[j] += by;
                    at(&q)
                };
                ((moved(STEP) - moved(-STEP)) / (2.0 * STEP) * *sigma).norm_squared()
            };
            cell.noise.joint.iter().enumerate().map(variance).sum()
        };
        let unseen = poses.iter().map(unseen).collect();
        Ok(Workspace { poses, fields, unseen })
    }

    /// Uncertainty of a calibration with this information; `None` if it leaves something undetermined.
    pub fn predicted(&self, information: &DMatrix<f64>) -> Option<Predicted> {
        let scale = information.diagonal().map(|d| 1.0 / d.sqrt());
        let n = information.nrows();
        let scaled = DMatrix::from_fn(n, n, |r, c| information[(r, c)] * scale[r] * scale[c]);
        let factor = scaled.cholesky()?;
        let l = factor.l_dirty();
        if (0..n).any(|k| l[(k, k)] * l[(k, k)] < LEAST_PIVOT) {
            return None;
        }
        let mut spread = self.fields.clone();
        spread.row_iter_mut().zip(scale.iter()).for_each(|(mut row, s)| row *= *s);
        l.solve_lower_triangular_mut(&mut spread);
        let sigma = (0..self.poses.len()).map(|p| spread.columns(3 * p, 3).norm_squared().sqrt()).collect();
        Some(Predicted { sigma })
    }
}
