//! The problem near some values: residuals and their derivatives.

use std::collections::HashMap;

use nalgebra::{DMatrix, Vector3};
use rayon::prelude::*;

use super::abreast::{ABREAST, Abreast};
use super::moves::Moves;
use super::sample_row::SampleRow;
use super::{Problem, STRETCH};
use crate::robot::{Posture, Robot, Site, SiteIndex};

/// Reused from evaluation to evaluation.
pub(in crate::identify) struct Workspace {
    pub(super) posture: Posture,
    pub(super) deviations: Vec<f64>,
    abreast: Abreast,
    destinations: Destinations,
}

/// Where the terms of a pattern go.
#[derive(Default)]
struct Destinations {
    /// The pattern, by its place.
    of: Option<usize>,
    /// Of each term that goes anywhere: its number, the row of its parameter, and the place of its site, or [`NONE`] for a flex
    /// displacement.
    all: Vec<[usize; 3]>,
}

impl Destinations {
    fn lay_out(&mut self, pattern: usize, moves: &[Moves], row_of: &[usize]) {
        let going = moves.iter().enumerate().filter(|(_, moves)| row_of[moves.parameter] != NONE);
        let place = |moves: &Moves| if matches!(moves.site, Site::Flex(..)) { NONE } else { moves.place };
        self.of = Some(pattern);
        self.all.clear();
        self.all.extend(going.map(|(term, moves)| [term, row_of[moves.parameter], place(moves)]));
    }
}

impl Workspace {
    pub(in crate::identify) fn new(robot: &Robot) -> Self {
        let sites = SiteIndex::new(robot.joints()).len();
        Workspace {
            posture: Posture::new(robot),
            deviations: vec![0.0; sites],
            abreast: Abreast::new(robot),
            destinations: Destinations::default(),
        }
    }
}

/// No row: further than any.
const NONE: usize = usize::MAX;

/// The whitened problem near some values, `r - J step`, transposed: one row a parameter, the last the residuals themselves, and one
/// column a scalar residual, so that a sample writes one stretch of memory and `[J r]^T [J r]` is all that a step needs.
pub(in crate::identify) struct Linearised {
    /// Row of each parameter of the problem; [`NONE`] for the others'.
    row_of: Vec<usize>,
    /// (Parameters + 1) x residuals.
    pub transposed: DMatrix<f64>,
}

impl Linearised {
    /// Room for the derivatives by these parameters.
    pub fn new(problem: &Problem, parameters: &[usize]) -> Self {
        let mut row_of = vec![NONE; problem.parameters.len()];
        parameters.iter().enumerate().for_each(|(k, &p)| row_of[p] = k);
        Linearised { row_of, transposed: DMatrix::zeros(parameters.len() + 1, problem.row_count) }
    }

    /// Sum of the squared residuals.
    pub fn chi2(&self) -> f64 {
        self.transposed.row(self.transposed.nrows() - 1).norm_squared()
    }

    /// The Jacobian: residuals x parameters.
    pub fn jacobian(&self) -> DMatrix<f64> {
        self.transposed.rows(0, self.transposed.nrows() - 1).transpose()
    }
}

impl Problem {
    pub(super) fn pose(&self, row: &SampleRow, values: &[f64], work: &mut Workspace) {
        work.deviations.fill(0.0);
        row.deviate(&self.patterns[row.pattern], values, |place, by| work.deviations[place] += by);
        row.pose(&self.robot, &self.setups[row.setup], &mut work.posture, &work.deviations);
    }

    /// Residual of one sample, m, of the arm as posed; with the line of sight for a distance.
    pub(super) fn residual(&self, row: &SampleRow, work: &Workspace) -> (Vector3<f64>, Option<Vector3<f64>>) {
        let at = SiteIndex::new(self.robot.joints()).target();
        row.residual(&work.posture.tcp(), &Vector3::from_column_slice(&work.deviations[at..at + 3]))
    }

    /// Residuals in metres, three a sample (a distance has one and two zeros), without weighting.
    pub fn residuals(&self, values: &[f64]) -> Vec<Vector3<f64>> {
        let mut abreast = Abreast::new(&self.robot);
        let mut residuals = Vec::with_capacity(self.rows.len());
        for rows in self.rows.chunks(ABREAST) {
            abreast.pose(&self.robot, &self.setups, &self.patterns, rows, Some(values));
            let residual = |(lane, row): (usize, &SampleRow)| row.residual(&abreast.tcp(lane), &abreast.target_moved(lane)).0;
            residuals.extend(rows.iter().enumerate().map(residual));
        }
        residuals
    }

    /// Evaluates whitened residuals and derivatives of the model side at `values`.
    pub(in crate::identify) fn linearise(&self, values: &[f64], work: &mut Workspace, near: &mut Linearised) {
        let Linearised { row_of, transposed } = near;
        let width = transposed.nrows();
        let cells = transposed.as_mut_slice();
        let (mut of_samples, of_distances) = cells.split_at_mut((self.row_count - self.distances.len()) * width);
        if self.rows.len() <= STRETCH {
            self.linearise_rows(&self.rows, values, work, row_of, width, of_samples);
        } else {
            let mut tasks = Vec::new();
            for rows in self.rows.chunks(STRETCH) {
                let height: usize = rows.iter().map(SampleRow::height).sum();
                let (own, others) = of_samples.split_at_mut(height * width);
                tasks.push((rows, own));
                of_samples = others;
            }
            let task = |work: &mut Workspace, (rows, own): (&[SampleRow], &mut [f64])| {
                self.linearise_rows(rows, values, work, row_of, width, own);
            };
            tasks.into_par_iter().for_each_init(|| Workspace::new(&self.robot), task);
        }
        let m = width - 1;
        for (row, cells) in self.distances.iter().zip(of_distances.chunks_exact_mut(width)) {
            cells.fill(0.0);
            row.columns(values, &mut |p, slope| {
                if let Some(cell) = cells[..m].get_mut(row_of[p]) {
                    *cell += slope;
                }
            });
            cells[m] = row.distance - row.between(values).norm();
            cells.iter_mut().for_each(|x| *x *= row.weight);
        }
    }

    /// The same of some rows alone, into their own stretch of memory.
    fn linearise_rows(
        &self,
        rows: &[SampleRow],
        values: &[f64],
        work: &mut Workspace,
        row_of: &[usize],
        width: usize,
        mut cells: &mut [f64],
    ) {
        let m = width - 1;
        let Workspace { abreast, destinations, .. } = work;
        destinations.of = None;
        for rows in rows.chunks(ABREAST) {
            abreast.pose(&self.robot, &self.setups, &self.patterns, rows, Some(values));
            abreast.find_columns();
            for (lane, row) in rows.iter().enumerate() {
                let pattern = &self.patterns[row.pattern];
                if destinations.of != Some(row.pattern) {
                    destinations.lay_out(row.pattern, pattern, row_of);
                }
                let (residual, sight) = row.residual(&abreast.tcp(lane), &abreast.target_moved(lane));
                let (own, others) = cells.split_at_mut(row.height() * width);
                cells = others;
                // Here and not all at once, while it is near.
                own.fill(0.0);
                if let Some(sight) = sight {
                    for &[term, k, place] in &destinations.all {
                        let flex = || abreast.flex_column(lane, pattern[term].site);
                        let column = abreast.columns().get(place).map_or_else(flex, |columns| columns.at(lane));
                        own[k] += row.weights[term] * sight.dot(&column);
                    }
                    own[m] = residual.x;
                    own.iter_mut().for_each(|x| *x *= row.whitener[(0, 0)]);
                    continue;
                }
                let (x, yz) = own.split_at_mut(width);
                let (y, z) = yz.split_at_mut(width);
                let z = &mut z[..width];
                for &[term, k, place] in &destinations.all {
                    let weight = row.weights[term];
                    // Each on its own: put together in one place, a column would wait there for its parts.
                    if let Some(column) = abreast.columns().get(place) {
                        x[k] += weight * column.x[lane];
                        y[k] += weight * column.y[lane];
                        z[k] += weight * column.z[lane];
                    } else {
                        let column = abreast.flex_column(lane, pattern[term].site);
                        x[k] += weight * column.x;
                        y[k] += weight * column.y;
                        z[k] += weight * column.z;
                    }
                }
                (x[m], y[m], z[m]) = (residual.x, residual.y, residual.z);
                row.whiten(x, y, z);
            }
        }
    }

    /// One-sigma of the whitened residuals: 1 where the noise is stated; elsewhere what they are at `values`.
    pub fn noise_at(&self, values: &[f64]) -> f64 {
        if self.noise_stated() {
            return 1.0;
        }
        let mut near = Linearised::new(self, &[]);
        self.linearise(values, &mut Workspace::new(&self.robot), &mut near);
        (near.chi2() / self.row_count.max(1) as f64).sqrt()
    }

    /// Jacobian of the positions in SI, without weighting, of those parameters: what observability indices are defined on. Of a
    /// distance only the first of its three rows is filled; known distances between balls follow, a row each.
    pub fn plain_jacobian(&self, values: &[f64], columns: &[usize]) -> DMatrix<f64> {
        let mut work = Workspace::new(&self.robot);
        let mut j = DMatrix::zeros(3 * self.rows.len() + self.distances.len(), columns.len());
        let place: HashMap<usize, usize> = columns.iter().enumerate().map(|(k, &c)| (c, k)).collect();
        for (i, row) in self.rows.iter().enumerate() {
            self.pose(row, values, &mut work);
            let sight = self.residual(row, &work).1;
            for (moves, weight) in self.patterns[row.pattern].iter().zip(&row.weights) {
                if let Some(&k) = place.get(&moves.parameter) {
                    let column = work.posture.column(moves.site) * *weight;
                    match sight {
                        None => {
                            let mut cells = j.fixed_view_mut::<3, 1>(3 * i, k);
                            cells += column;
                        }
                        Some(sight) => j[(3 * i, k)] += sight.dot(&column),
                    }
                }
            }
        }
        for (i, row) in self.distances.iter().enumerate() {
            row.columns(values, &mut |p, slope| {
                if let Some(&k) = place.get(&p) {
                    j[(3 * self.rows.len() + i, k)] += slope;
                }
            });
        }
        j
    }
}
