//! The problem linearised about given values: residuals and their derivatives.

use std::ops::Range;

use nalgebra::{DMatrix, Vector3};
use rayon::prelude::*;

use super::Problem;
use super::batch::{BATCH, Batch, STRETCH};
use super::jacobian_pattern::JacobianPattern;
use super::load_state::{LoadState, RowTerms};
use super::orientation::SeenOrientation;
use super::sample_row::SampleRow;
use crate::robot::Robot;
use crate::robot::kinematics::Posture;
use crate::robot::sites::{MdhEntry, Site, SiteIndex};

/// Buffers reused between evaluations.
pub(in crate::identify) struct Workspace {
    pub(super) posture: Posture,
    pub(super) deviations: Vec<f64>,
    batch: Batch,
    destinations: Destinations,
    products: Vec<Product>,
    /// Columns of one sample's orientation before they are whitened.
    turns: Vec<Vector3<f64>>,
}

/// An effect of a joint's compliance besides its own torque.
struct Product {
    /// Row of the compliance.
    row: usize,
    /// Site of the joint's angle, and its index.
    site: Site,
    place: usize,
    weight: f64,
}

/// The point of evaluation: values of the parameters, SI, and loads.
#[derive(Clone, Copy)]
struct At<'a> {
    values: &'a [f64],
    state: &'a LoadState,
}

/// The destinations of a pattern's terms.
#[derive(Default)]
struct Destinations {
    /// Index of the pattern.
    of: Option<usize>,
    /// For each term with a destination: its number, the row of its parameter, and the index of its site, or [`NONE`] for a
    /// flex displacement.
    all: Vec<[usize; 3]>,
}

impl Destinations {
    fn lay_out(&mut self, pattern: usize, moves: &[JacobianPattern], row_of: &[usize]) {
        let going = moves.iter().enumerate().filter(|(_, moves)| row_of[moves.parameter] != NONE);
        let place = |moves: &JacobianPattern| if matches!(moves.site, Site::Flex(..)) { NONE } else { moves.place };
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
            batch: Batch::new(robot),
            destinations: Destinations::default(),
            products: Vec::new(),
            turns: Vec::new(),
        }
    }
}

/// No row: an index beyond any row.
const NONE: usize = usize::MAX;

/// The whitened problem linearised about given values, `r - J step`, transposed: one row per parameter, the last row the
/// residuals themselves, and one column per scalar residual, so that a sample writes contiguous memory and `[J r]^T [J r]`
/// is all that a step needs.
pub(in crate::identify) struct Linearised {
    /// Row of each parameter of the problem; [`NONE`] for those not included.
    row_of: Vec<usize>,
    /// (Parameters + 1) x residuals.
    pub transposed: DMatrix<f64>,
}

impl Linearised {
    /// Allocates the derivatives with respect to these parameters.
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
    /// Poses the arm of one sample, by index, under the given loads.
    pub(super) fn pose(&self, place: usize, values: &[f64], state: &LoadState, work: &mut Workspace) {
        let (row, terms): (&SampleRow, &RowTerms) = (&self.rows[place], &state.rows[place]);
        work.deviations.fill(0.0);
        terms.deviate(&state.patterns[terms.pattern], values, |place, by| work.deviations[place] += by);
        row.pose(&self.robot, &self.setups[row.setup], &mut work.posture, &work.deviations);
    }

    /// Residual of one sample, m, with the arm as posed and the orientation that it measured; with the line of sight for a distance.
    pub(super) fn residual(
        &self,
        row: &SampleRow,
        seen: Option<&SeenOrientation>,
        work: &Workspace,
    ) -> (Vector3<f64>, Option<Vector3<f64>>) {
        let at = SiteIndex::new(self.robot.joints()).target();
        let moved = seen.map_or(Vector3::zeros(), SeenOrientation::moved);
        row.residual(&(work.posture.tcp() + moved), &Vector3::from_column_slice(&work.deviations[at..at + 3]))
    }

    /// Orientation of one sample, with the arm as posed; `None` if it was not measured.
    pub(super) fn seen_orientation(&self, row: &SampleRow, work: &Workspace) -> Option<SeenOrientation> {
        let at = SiteIndex::new(self.robot.joints()).probe();
        let turned = Vector3::from_column_slice(&work.deviations[at..at + 3]);
        row.seen_orientation(&self.setups[row.setup], &work.posture.flange(), &turned)
    }

    /// Residuals of the orientations, rotation vectors in the world, rad; `None` for samples that measured none.
    pub fn orientation_residuals(&self, values: &[f64]) -> Vec<Option<Vector3<f64>>> {
        let mut residuals = vec![None; self.rows.len()];
        if self.rows.iter().any(|row| row.orientation.is_some()) {
            self.for_each_sample(values, &mut |posed| residuals[posed.place] = posed.turn);
        }
        residuals
    }

    /// Unweighted residuals in metres, three per sample (a distance has one and two zeros), under the loads at `values`.
    pub fn residuals(&self, values: &[f64]) -> Vec<Vector3<f64>> {
        self.residuals_under(values, &self.load_state(values))
    }

    /// The same under the loads `state` at these values.
    pub(in crate::identify) fn residuals_under(&self, values: &[f64], state: &LoadState) -> Vec<Vector3<f64>> {
        let mut batch = Batch::new(&self.robot);
        let mut residuals = Vec::with_capacity(self.rows.len());
        for (chunk, rows) in self.rows.chunks(BATCH).enumerate() {
            batch.pose(&self.robot, &self.setups, rows, Some(state.deviating(values, chunk * BATCH)));
            let residual = |(lane, row): (usize, &SampleRow)| {
                let sees_origin = row.orientation.as_ref().is_some_and(|o| o.sees_origin());
                let seen = sees_origin.then(|| batch.seen_orientation(lane, row, &self.setups[row.setup])).flatten();
                let moved = seen.as_ref().map_or(Vector3::zeros(), SeenOrientation::moved);
                row.residual(&(batch.tcp(lane) + moved), &batch.target_moved(lane)).0
            };
            residuals.extend(rows.iter().enumerate().map(residual));
        }
        residuals
    }

    /// Evaluates whitened residuals and derivatives of the model side at `values` under the loads `state`.
    ///
    /// The derivatives neglect the effect of the posture on the loads, which is smaller by the ratio of deflection to arm
    /// length.
    pub(in crate::identify) fn linearise(
        &self,
        values: &[f64],
        state: &LoadState,
        work: &mut Workspace,
        near: &mut Linearised,
    ) {
        let at = At { values, state };
        let Linearised { row_of, transposed } = near;
        let width = transposed.nrows();
        let cells = transposed.as_mut_slice();
        let (mut of_samples, of_distances) =
            cells.split_at_mut((self.row_count - self.distances.len() - self.priors.len()) * width);
        if self.rows.len() <= STRETCH {
            self.linearise_rows(0..self.rows.len(), at, work, row_of, of_samples);
        } else {
            let mut tasks = Vec::new();
            for (stretch, rows) in self.rows.chunks(STRETCH).enumerate() {
                let height: usize = rows.iter().map(SampleRow::height).sum();
                let (own, others) = of_samples.split_at_mut(height * width);
                tasks.push((stretch * STRETCH..stretch * STRETCH + rows.len(), own));
                of_samples = others;
            }
            let task = |work: &mut Workspace, (rows, own): (Range<usize>, &mut [f64])| {
                self.linearise_rows(rows, at, work, row_of, own);
            };
            tasks.into_par_iter().for_each_init(|| Workspace::new(&self.robot), task);
        }
        let m = width - 1;
        let (of_distances, of_priors) = of_distances.split_at_mut(self.distances.len() * width);
        for (row, cells) in self.priors.iter().zip(of_priors.chunks_exact_mut(width)) {
            cells.fill(0.0);
            if let Some(cell) = cells[..m].get_mut(row_of[row.parameter]) {
                *cell = row.weight;
            }
            cells[m] = (row.mean - values[row.parameter]) * row.weight;
        }
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

    /// The same for a range of rows, into their own part of memory, which holds the same number of cells for each component.
    fn linearise_rows(&self, rows: Range<usize>, at: At<'_>, work: &mut Workspace, row_of: &[usize], mut cells: &mut [f64]) {
        if rows.is_empty() {
            return;
        }
        let width = cells.len() / self.rows[rows.clone()].iter().map(SampleRow::height).sum::<usize>().max(1);
        let m = width - 1;
        let At { values, state } = at;
        let Workspace { batch, destinations, products, turns, .. } = work;
        destinations.of = None;
        let places = rows.clone().step_by(BATCH);
        for (first, rows) in places.zip(self.rows[rows].chunks(BATCH)) {
            batch.pose(&self.robot, &self.setups, rows, Some(state.deviating(values, first)));
            batch.find_columns();
            for (lane, (row, terms)) in rows.iter().zip(&state.rows[first..]).enumerate() {
                let pattern = &state.patterns[terms.pattern];
                if destinations.of != Some(terms.pattern) {
                    destinations.lay_out(terms.pattern, pattern, row_of);
                }
                self.find_products(terms, at, row_of, products);
                let (residual, sight) = row.residual(&batch.tcp(lane), &batch.target_moved(lane));
                let (own, others) = cells.split_at_mut(row.height() * width);
                cells = others;
                // Cleared here, not all at once, while it is in the cache.
                own.fill(0.0);
                if let Some(sight) = sight {
                    for &[term, k, place] in &destinations.all {
                        let flex = || batch.flex_column(lane, pattern[term].site);
                        let column = batch.columns().get(place).map_or_else(flex, |columns| columns.at(lane));
                        own[k] += terms.weights[term] * sight.dot(&column);
                    }
                    for product in products.iter() {
                        own[product.row] += product.weight * sight.dot(&batch.columns()[product.place].at(lane));
                    }
                    own[m] = residual.x;
                    own.iter_mut().for_each(|x| *x *= row.whitener[(0, 0)]);
                    continue;
                }
                let (own, of_orientation) = own.split_at_mut(3 * width);
                let (x, yz) = own.split_at_mut(width);
                let (y, z) = yz.split_at_mut(width);
                let z = &mut z[..width];
                for &[term, k, place] in &destinations.all {
                    let weight = terms.weights[term];
                    // Each component separately: assembling a column first would stall on its parts.
                    if let Some(column) = batch.columns().get(place) {
                        x[k] += weight * column.x[lane];
                        y[k] += weight * column.y[lane];
                        z[k] += weight * column.z[lane];
                    } else {
                        let column = batch.flex_column(lane, pattern[term].site);
                        x[k] += weight * column.x;
                        y[k] += weight * column.y;
                        z[k] += weight * column.z;
                    }
                }
                for product in products.iter() {
                    let (k, column) = (product.row, batch.columns()[product.place].at(lane));
                    x[k] += product.weight * column.x;
                    y[k] += product.weight * column.y;
                    z[k] += product.weight * column.z;
                }
                (x[m], y[m], z[m]) = (residual.x, residual.y, residual.z);
                if let Some(seen) = batch.seen_orientation(lane, row, &self.setups[row.setup]) {
                    let residual = residual - seen.moved();
                    (x[m], y[m], z[m]) = (residual.x, residual.y, residual.z);
                    turns.clear();
                    turns.resize(width, Vector3::zeros());
                    let mut turn = |k: usize, site: Site, weight: f64| {
                        let axis = batch.turning(lane, site);
                        turns[k] += seen.column(site, &axis) * weight;
                        let shift = seen.shift(site, &axis) * weight;
                        (x[k], y[k], z[k]) = (x[k] + shift.x, y[k] + shift.y, z[k] + shift.z);
                    };
                    for &[term, k, _] in &destinations.all {
                        let site = pattern[term].site;
                        turn(k, site, terms.weights[term]);
                    }
                    products.iter().for_each(|product| turn(product.row, product.site, product.weight));
                    turns[m] = seen.residual;
                    row.whiten_orientation([x, y, z], turns, of_orientation);
                }
                row.whiten(x, y, z);
            }
        }
    }

    /// Effects of a joint's compliance besides its own torque: an effect that acts through it is a product of both.
    fn find_products(&self, terms: &RowTerms, at: At<'_>, row_of: &[usize], products: &mut Vec<Product>) {
        products.clear();
        if !self.acts_through_compliance {
            return;
        }
        for (moves, weight) in at.state.patterns[terms.pattern].iter().zip(&terms.weights) {
            let (Site::Mdh(joint, MdhEntry::Theta), true) = (moves.site, self.parameters[moves.parameter].through) else {
                continue;
            };
            let compliance = at.state.compliance[usize::from(joint)];
            let own = self.compliances.iter().filter(|(j, p)| *j == usize::from(joint) && row_of[*p] != NONE);
            if compliance != 0.0 && at.values[moves.parameter] != 0.0 {
                let weight = at.values[moves.parameter] * weight / compliance;
                products.extend(own.map(|&(_, p)| Product { row: row_of[p], site: moves.site, place: moves.place, weight }));
            }
        }
    }

    /// 1 sigma of the whitened residuals: 1 if the noise is stated; otherwise that of the residuals at `values`.
    pub fn noise_at(&self, values: &[f64]) -> f64 {
        if self.noise_stated() {
            return 1.0;
        }
        let mut near = Linearised::new(self, &[]);
        self.linearise(values, &self.load_state(values), &mut Workspace::new(&self.robot), &mut near);
        (near.chi2() / self.row_count.max(1) as f64).sqrt()
    }

    /// Unweighted Jacobian of the positions with respect to these parameters, SI, on which observability indices are
    /// defined. For a distance only the first of its three rows is filled; known distances between balls follow, one row
    /// each, then orientations, three rows each, as displacements at the end of a lever that makes both equally certain.
    pub fn plain_jacobian(&self, values: &[f64], columns: &[usize]) -> DMatrix<f64> {
        let mut work = Workspace::new(&self.robot);
        let after_distances = 3 * self.rows.len() + self.distances.len();
        let oriented = self.rows.iter().filter(|row| row.orientation.is_some()).count();
        let mut j = DMatrix::zeros(after_distances + 3 * oriented, columns.len());
        let mut row_of = vec![NONE; self.parameters.len()];
        columns.iter().enumerate().for_each(|(k, &c)| row_of[c] = k);
        let state = self.load_state(values);
        let mut products = Vec::new();
        let mut next = after_distances;
        for (i, (row, terms)) in self.rows.iter().zip(&state.rows).enumerate() {
            self.pose(i, values, &state, &mut work);
            let seen = self.seen_orientation(row, &work);
            let sight = self.residual(row, seen.as_ref(), &work).1;
            let mut add = |k: usize, site: Site, weight: f64| {
                let axis = work.posture.turning(site);
                let shift = seen.as_ref().map_or(Vector3::zeros(), |seen| seen.shift(site, &axis));
                let column = (work.posture.column(site) + shift) * weight;
                match sight {
                    None => {
                        let mut cells = j.fixed_view_mut::<3, 1>(3 * i, k);
                        cells += column;
                    }
                    Some(sight) => j[(3 * i, k)] += sight.dot(&column),
                }
                if let Some(seen) = &seen {
                    let mut cells = j.fixed_view_mut::<3, 1>(next, k);
                    cells += seen.column(site, &axis) * (weight * row.lever());
                }
            };
            let pattern = &state.patterns[terms.pattern];
            for (moves, weight) in pattern.iter().zip(&terms.weights) {
                if row_of[moves.parameter] != NONE {
                    add(row_of[moves.parameter], moves.site, *weight);
                }
            }
            self.find_products(terms, At { values, state: &state }, &row_of, &mut products);
            products.iter().for_each(|product| add(product.row, product.site, product.weight));
            next += if seen.is_some() { 3 } else { 0 };
        }
        for (i, row) in self.distances.iter().enumerate() {
            row.columns(values, &mut |p, slope| {
                if row_of[p] != NONE {
                    j[(3 * self.rows.len() + i, row_of[p])] += slope;
                }
            });
        }
        j
    }
}
