//! The linear model at a list of samples: what each coefficient moves there, by its parts.

use std::ops::Range;

use nalgebra::{DMatrix, DVector, DVectorView, DVectorViewMut};

use super::basis::{Basis, Group};
use crate::math::linalg;

/// Rows of a list of samples. A joint's function moves a sample's rows along the lever of the joint there, so its columns are
/// products of a lever and a number a sample.
#[derive(Debug, Clone)]
pub(super) struct Rows {
    /// Rows of each sample, in order and without gaps; rows after them belong to no sample.
    pub samples: Vec<Range<usize>>,
    /// Columns of the model, each times the one-sigma of its prior.
    pub smooth: DMatrix<f64>,
    /// Columns of the catalogue, each times its plausible size.
    pub effects: DMatrix<f64>,
    /// Displacement per angle, of each joint of the basis.
    pub levers: Vec<DVector<f64>>,
    /// Functions of each joint of the basis: samples x functions, rad.
    pub functions: Vec<DMatrix<f64>>,
}

/// Coefficients of a linear model, in the units of its priors.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Coefficients {
    pub smooth: DVector<f64>,
    pub effects: DVector<f64>,
    pub joints: Vec<DVector<f64>>,
}

impl Coefficients {
    pub fn zeros(rows: &Rows) -> Self {
        Coefficients {
            smooth: DVector::zeros(rows.smooth.ncols()),
            effects: DVector::zeros(rows.effects.ncols()),
            joints: rows.functions.iter().map(|f| DVector::zeros(f.ncols())).collect(),
        }
    }

    fn parts_mut(&mut self) -> impl Iterator<Item = &mut DVector<f64>> {
        [&mut self.smooth, &mut self.effects].into_iter().chain(&mut self.joints)
    }

    pub fn for_each(&mut self, mut visit: impl FnMut(&mut f64)) {
        self.parts_mut().flat_map(|part| part.iter_mut()).for_each(&mut visit);
    }

    /// Adds `factor` times others.
    pub fn axpy(&mut self, factor: f64, other: &Coefficients) {
        let others = [&other.smooth, &other.effects].into_iter().chain(&other.joints);
        self.parts_mut().zip(others).for_each(|(to, from)| to.axpy(factor, from, 1.0));
    }
}

/// The groups of a campaign: those of the catalogue, then those of each joint, with the columns of each.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Groups {
    pub all: Vec<Group>,
    /// Columns of each effect.
    pub effects: Vec<Range<usize>>,
    /// For each joint of the basis, its first group.
    pub first: Vec<usize>,
    /// For each joint of the basis, the functions of its groups.
    pub spans: Vec<Vec<Range<usize>>>,
}

impl Groups {
    /// The groups of a basis beside effects with this many columns each.
    pub fn of(basis: &Basis, effects: &[usize]) -> Self {
        let mut all: Vec<Group> = (0..effects.len()).map(Group::Effect).collect();
        let of_effects = effects.iter().scan(0, |first, count| {
            let span = *first..*first + count;
            *first = span.end;
            Some(span)
        });
        let effects = of_effects.collect();
        let mut first = Vec::new();
        for joint in &basis.joints {
            first.push(all.len());
            all.extend(joint.groups.iter().map(|&functions| Group::Joint(functions)));
        }
        Groups { all, effects, first, spans: basis.joints.iter().map(|j| j.spans().collect()).collect() }
    }

    /// Joint of the basis and functions of a group; `None` for an effect.
    pub fn place(&self, group: usize) -> Option<(usize, Range<usize>)> {
        let joint = self.first.iter().rposition(|&first| first <= group)?;
        Some((joint, self.spans[joint][group - self.first[joint]].clone()))
    }

    /// Number of coefficients of a group.
    pub fn width(&self, group: usize) -> usize {
        self.effects.get(group).map_or_else(|| self.all[group].width(), Range::len)
    }

    /// Coefficients of a group.
    pub fn part<'a>(&self, group: usize, of: &'a Coefficients) -> DVectorView<'a, f64> {
        match self.place(group) {
            Some((joint, span)) => of.joints[joint].rows(span.start, span.len()),
            None => of.effects.rows(self.effects[group].start, self.effects[group].len()),
        }
    }

    /// The same, to be changed.
    pub fn part_mut<'a>(&self, group: usize, of: &'a mut Coefficients) -> DVectorViewMut<'a, f64> {
        match self.place(group) {
            Some((joint, span)) => of.joints[joint].rows_mut(span.start, span.len()),
            None => of.effects.rows_mut(self.effects[group].start, self.effects[group].len()),
        }
    }

    /// Multiplies coefficients by the variances `sizes` of their groups, those of the model by 1.
    pub fn scale(&self, sizes: &[f64], coefficients: &mut Coefficients) {
        self.scale_by(|g| sizes[g], coefficients);
    }

    /// Multiplies the coefficients of every group by its own factor.
    pub fn scale_by(&self, factor: impl Fn(usize) -> f64, coefficients: &mut Coefficients) {
        (0..self.all.len()).for_each(|g| self.part_mut(g, coefficients).scale_mut(factor(g)));
    }
}

impl Rows {
    /// Indices of the rows of some of the samples, and of those that belong to none.
    pub fn places(&self, chosen: &[usize]) -> Vec<usize> {
        let end = self.samples.last().map_or(0, |last| last.end);
        chosen.iter().flat_map(|&s| self.samples[s].clone()).chain(end..self.count()).collect()
    }

    /// The same rows of the model alone, without any group.
    pub fn of_model(&self) -> Self {
        Rows {
            samples: self.samples.clone(),
            smooth: self.smooth.clone(),
            effects: DMatrix::zeros(self.count(), 0),
            levers: Vec::new(),
            functions: Vec::new(),
        }
    }

    /// Number of rows.
    pub fn count(&self) -> usize {
        self.smooth.nrows()
    }

    /// Adds what the coefficients move, times `factor`, to `to`; `room` holds one number a sample.
    pub fn apply(&self, factor: f64, coefficients: &Coefficients, room: &mut DVector<f64>, to: &mut DVector<f64>) {
        to.gemv(factor, &self.smooth, &coefficients.smooth, 1.0);
        to.gemv(factor, &self.effects, &coefficients.effects, 1.0);
        for ((functions, lever), b) in self.functions.iter().zip(&self.levers).zip(&coefficients.joints) {
            room.gemv(factor, functions, b, 0.0);
            self.turn(lever, room.as_slice(), to);
        }
    }

    /// Adds the displacements by these angles of a joint, one a sample.
    fn turn(&self, lever: &DVector<f64>, angles: &[f64], to: &mut DVector<f64>) {
        for (own, angle) in self.samples.iter().zip(angles) {
            own.clone().for_each(|r| to[r] += lever[r] * angle);
        }
    }

    /// What the coefficients move.
    pub fn applied(&self, coefficients: &Coefficients) -> DVector<f64> {
        let mut to = DVector::zeros(self.count());
        self.apply(1.0, coefficients, &mut DVector::zeros(self.samples.len()), &mut to);
        to
    }

    /// What each of several sets of coefficients moves, one column a set.
    pub fn applied_all(&self, all: &[Coefficients]) -> DMatrix<f64> {
        let matrix = |part: &dyn Fn(&Coefficients) -> &DVector<f64>, height: usize| {
            DMatrix::from_fn(height, all.len(), |r, c| part(&all[c])[r])
        };
        let mut to = linalg::product(&self.smooth, &matrix(&|c| &c.smooth, self.smooth.ncols()));
        to += linalg::product(&self.effects, &matrix(&|c| &c.effects, self.effects.ncols()));
        for (j, (functions, lever)) in self.functions.iter().zip(&self.levers).enumerate() {
            let angles = linalg::product(functions, &matrix(&|c| &c.joints[j], functions.ncols()));
            for (mut to, angles) in to.column_iter_mut().zip(angles.column_iter()) {
                for (own, angle) in self.samples.iter().zip(&angles) {
                    own.clone().for_each(|r| to[r] += lever[r] * angle);
                }
            }
        }
        to
    }

    /// What the functions `span` of a joint of the basis move.
    pub fn applied_part(&self, joint: usize, span: Range<usize>, coefficients: &Coefficients) -> DVector<f64> {
        let b = coefficients.joints[joint].rows(span.start, span.len());
        let angles = self.functions[joint].columns(span.start, span.len()) * b;
        let mut to = DVector::zeros(self.count());
        self.turn(&self.levers[joint], angles.as_slice(), &mut to);
        to
    }

    /// Inner products of a vector of rows with all columns, into `to`.
    pub fn pull(&self, vector: &DVector<f64>, room: &mut DVector<f64>, to: &mut Coefficients) {
        to.smooth.gemv_tr(1.0, &self.smooth, vector, 0.0);
        to.effects.gemv_tr(1.0, &self.effects, vector, 0.0);
        for ((functions, lever), to) in self.functions.iter().zip(&self.levers).zip(&mut to.joints) {
            self.along(lever, vector, room);
            to.gemv_tr(1.0, functions, room, 0.0);
        }
    }

    /// Inner product of a vector with a lever, sample by sample.
    pub fn along(&self, lever: &DVector<f64>, vector: &DVector<f64>, to: &mut DVector<f64>) {
        for (own, to) in self.samples.iter().zip(to.iter_mut()) {
            *to = own.clone().map(|r| lever[r] * vector[r]).sum();
        }
    }

    /// Covariance of these rows with those of `others`, for groups of the variances `sizes`.
    pub fn covariance(&self, others: &Rows, groups: &Groups, sizes: &[f64]) -> DMatrix<f64> {
        let mut effects = self.effects.clone();
        for (span, size) in groups.effects.iter().zip(sizes) {
            effects.columns_mut(span.start, span.len()).scale_mut(*size);
        }
        let mut all = linalg::product_with_transposed(&self.smooth, &others.smooth);
        all += linalg::product_with_transposed(&effects, &others.effects);
        for j in 0..self.functions.len() {
            let mut scaled = self.functions[j].clone();
            for (span, size) in groups.spans[j].iter().zip(&sizes[groups.first[j]..]) {
                scaled.columns_mut(span.start, span.len()).scale_mut(*size);
            }
            let angles = linalg::product_with_transposed(&scaled, &others.functions[j]);
            for (t, theirs) in others.samples.iter().enumerate() {
                for c in theirs.clone() {
                    let lever = others.levers[j][c];
                    let mut to = all.column_mut(c);
                    for (s, own) in self.samples.iter().enumerate() {
                        let by = lever * angles[(s, t)];
                        own.clone().for_each(|r| to[r] += self.levers[j][r] * by);
                    }
                }
            }
        }
        all
    }

    /// Prior variance of every row, for groups of the variances `sizes`.
    pub fn variance(&self, groups: &Groups, sizes: &[f64]) -> DVector<f64> {
        let mut all = DVector::zeros(self.count());
        let add = |to: &mut DVector<f64>, size: f64, column: &[f64]| {
            to.iter_mut().zip(column).for_each(|(to, x)| *to += size * x * x);
        };
        self.smooth.column_iter().for_each(|column| add(&mut all, 1.0, column.as_slice()));
        for (span, size) in groups.effects.iter().zip(sizes) {
            span.clone().for_each(|k| add(&mut all, *size, self.effects.column(k).as_slice()));
        }
        let mut angles = DVector::zeros(self.samples.len());
        for (j, functions) in self.functions.iter().enumerate() {
            angles.fill(0.0);
            for (span, size) in groups.spans[j].iter().zip(&sizes[groups.first[j]..]) {
                span.clone().for_each(|k| add(&mut angles, *size, functions.column(k).as_slice()));
            }
            for (own, angle2) in self.samples.iter().zip(&angles) {
                own.clone().for_each(|r| all[r] += angle2 * self.levers[j][r].powi(2));
            }
        }
        all
    }

    /// The rows of some of the samples, and those that belong to none.
    pub fn of_samples(&self, chosen: &[usize]) -> Self {
        let rows = self.places(chosen);
        let mut next = 0;
        let stretch = |&s: &usize| {
            next += self.samples[s].len();
            next - self.samples[s].len()..next
        };
        Rows {
            samples: chosen.iter().map(stretch).collect(),
            smooth: self.smooth.select_rows(&rows),
            effects: self.effects.select_rows(&rows),
            levers: self.levers.iter().map(|l| l.select_rows(&rows)).collect(),
            functions: self.functions.iter().map(|f| f.select_rows(chosen)).collect(),
        }
    }
}
