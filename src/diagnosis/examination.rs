//! A fitted model and the columns of every candidate, reduced to inner products after projection orthogonal to the
//! model. Every statement of a diagnosis is computed from these.

mod wide;

use nalgebra::{DMatrix, DVector};

use super::evidence::{LEAST_UNIT, Remainder, Seen};
use super::library::{Candidate, Library};
use super::projection::Projection;
use crate::effects::EffectId;
use crate::identify::Model;
use crate::identify::calibration::{Calibration, IdentifyError};
use crate::identify::fit::{Fit, FitError, Outcome, by_own_noise, fit};
use crate::identify::problem::{Problem, SampleContext, Use};
use crate::math::linalg;
use crate::math::positive_definite;
use crate::measure::dataset::{Dataset, NamedDataset};
use crate::residuals::noise::NoiseScale;
use crate::residuals::noise_floor::NoiseFloor;

use wide::Wide;
pub(crate) use wide::{Column, Span};

/// Degrees of freedom that a stated noise is worth: a stated value is often wrong by a factor of 1.5.
pub(crate) const STATED_NOISE_DOF: f64 = 4.0;

/// A model fitted to data, and its candidates.
pub struct Examination {
    pub(crate) model: Model,
    pub(crate) library: Library,
    /// The fitted problem.
    pub(crate) problem: Problem,
    pub(crate) fit: Fit,
    /// The fitted problem, extended by the parameters of every candidate.
    pub(crate) wide: Problem,
    /// Values of the wide problem's parameters, SI: those of the fit, and zero for the candidates.
    pub(crate) values: Vec<f64>,
    /// Parameters of the wide problem that the fit estimated.
    pub(crate) fitted: Vec<usize>,
    /// Columns of all candidates.
    pub(crate) columns: Vec<Column>,
    /// Columns of each candidate.
    pub(crate) spans: Vec<Span>,
    pub(crate) contexts: Vec<SampleContext>,
    /// Size of the noise, and the number of samples that count as one.
    pub(crate) noise_scale: NoiseScale,
    /// Rows whitened by the noise of the noise_scale: one row per parameter of `fitted`, then one per candidate column in
    /// plausible sizes, then the residuals.
    pub(crate) rows: DMatrix<f64>,
    pub(crate) projection: Projection,
    /// Inner products of the candidates' projected columns.
    pub(crate) gram: DMatrix<f64>,
    /// Inner products of the candidates' projected columns with the remainder.
    pub(crate) z: DVector<f64>,
    /// Squared norm of each candidate column before projection.
    pub(crate) whole: Vec<f64>,
    pub(crate) remainder: Remainder,
}

/// A candidate that moves nothing by more than this share of the noise moves nothing: the rest of its columns is rounding.
const NOTHING: f64 = 1e-9;

/// If the model absorbs all but this share of a candidate, its remainder is rounding.
const ABSORBED: f64 = 1e-12;

/// Sets the columns of a candidate that moves nothing to zero.
fn silence(rows: &mut DMatrix<f64>, candidate: usize) {
    let mut row = rows.row_mut(candidate);
    if row.amax() < NOTHING {
        row.fill(0.0);
    }
}

/// The model by which residuals are judged: in another ratio than that of their noise, those of orientations would seem to show
/// effects beside those of positions, and the other way round.
fn judging(model: &Model) -> Model {
    Model { only_weighed_orientations: true, ..model.clone() }
}

impl Examination {
    /// Fits `model` to the rows of set `fit` and adds the columns of every candidate.
    ///
    /// # Errors
    /// When the data do not fit the model, or do not determine the unknowns.
    pub fn new(datasets: &[NamedDataset<'_>], model: &Model) -> Result<Self, IdentifyError> {
        Examination::as_identified(datasets, &judging(model))
    }

    /// As [`Examination::new`], by everything that counts when `model` is identified: by orientations whose weight is a guess, too.
    ///
    /// # Errors
    /// As [`Examination::new`].
    pub(crate) fn as_identified(datasets: &[NamedDataset<'_>], model: &Model) -> Result<Self, IdentifyError> {
        let problem = Problem::new(datasets, model, Use::Fit)?;
        let fit = fit(&problem)?;
        Examination::fitted(datasets, model, problem, fit, Library::new(datasets, model))
    }

    /// As [`Examination::new`], but `None` unless the fit converges within `most` steps.
    ///
    /// # Errors
    /// As [`Examination::new`].
    pub(crate) fn within_steps(
        datasets: &[NamedDataset<'_>],
        model: &Model,
        most: usize,
    ) -> Result<Option<Self>, IdentifyError> {
        let model = &judging(model);
        let problem = Problem::new(datasets, model, Use::Fit)?.within_steps(most);
        let fit = fit(&problem)?;
        if fit.outcome != Outcome::Converged || fit.iterations > most {
            return Ok(None);
        }
        Examination::fitted(datasets, model, problem, fit, Library::new(datasets, model)).map(Some)
    }

    /// The same fit with the columns of every candidate, as [`Examination::new`] adds them.
    ///
    /// # Errors
    /// When a matrix cannot be factored.
    pub(crate) fn with_library(self, datasets: &[NamedDataset<'_>]) -> Result<Self, IdentifyError> {
        let Examination { model, problem, fit, noise_scale, .. } = self;
        Examination::of(datasets, &model, problem, fit, Library::new(datasets, &model), noise_scale)
    }

    /// Adds the columns of every candidate of the library to a fit, by its own noise if none is stated.
    fn fitted(
        datasets: &[NamedDataset<'_>],
        model: &Model,
        problem: Problem,
        fit: Fit,
        library: Library,
    ) -> Result<Self, IdentifyError> {
        let (problem, fit) = by_own_noise(datasets, problem, fit);
        let noise_scale = NoiseScale::of(datasets, &problem, &fit);
        Examination::of(datasets, model, problem, fit, library, noise_scale)
    }

    /// As [`Examination::new`], with these candidates in place of the library.
    ///
    /// # Errors
    /// As [`Examination::new`].
    pub(crate) fn with(
        datasets: &[NamedDataset<'_>],
        model: &Model,
        candidates: Vec<Candidate>,
    ) -> Result<Self, IdentifyError> {
        let model = &judging(model);
        let problem = Problem::new(datasets, model, Use::Fit)?;
        let fit = fit(&problem)?;
        Examination::fitted(datasets, model, problem, fit, Library { candidates, ..Library::default() })
    }

    /// Examines planned poses, given as samples at their nominal positions. Joint compliances are set to their
    /// plausible size; otherwise effects that act through them would seem to move nothing.
    ///
    /// # Errors
    /// When the poses do not determine the model.
    pub fn of_plan(planned: &Dataset, model: &Model) -> Result<Self, IdentifyError> {
        let datasets = [NamedDataset::new("plan", planned)];
        let mut problem = Problem::new(&datasets, model, Use::Fit)?;
        let mut fit = fit(&problem)?;
        for (value, parameter) in fit.values.iter_mut().zip(problem.parameters()) {
            if parameter.effect.family() == EffectId::JOINT_COMPLIANCE {
                *value = parameter.spec.prior;
            }
        }
        problem.update_loads(&fit.values);
        let noise_scale = NoiseScale::as_stated(problem.noise_stated());
        Examination::of(&datasets, model, problem, fit, Library::new(&datasets, model), noise_scale)
    }

    /// As this examination, with the same fit but other candidates.
    pub(crate) fn beside(&self, datasets: &[NamedDataset<'_>], candidates: Vec<Candidate>) -> Result<Self, IdentifyError> {
        let mut problem = Problem::new(datasets, &self.model, Use::Fit)?.at_unit_variance(self.problem.unit_variance());
        problem.update_loads(&self.fit.values);
        let library = Library { candidates, ..Library::default() };
        Examination::of(datasets, &self.model, problem, self.fit.clone(), library, self.noise_scale.clone())
    }

    fn of(
        datasets: &[NamedDataset<'_>],
        model: &Model,
        problem: Problem,
        fit: Fit,
        library: Library,
        noise_scale: NoiseScale,
    ) -> Result<Self, IdentifyError> {
        let wide = Wide::of(datasets, model, &problem, &fit, &library)?;
        let weight = noise_scale.weight();
        let mut rows = wide.rows() * weight;
        let Wide { problem: wide, values, fitted, columns, spans } = wide;
        (fitted.len()..fitted.len() + columns.len()).for_each(|k| silence(&mut rows, k));
        let mut products = DMatrix::zeros(rows.nrows(), rows.nrows());
        linalg::normal_matrix(&rows, &mut products);
        let (m, n) = (fitted.len(), columns.len());
        let (projection, squares) = Projection::of(&products, n, weight, &problem, &fit)?;
        let absorbed = linalg::product_of_transposed(&projection.of_columns, &projection.of_columns);
        let mut gram = products.view((m, m), (n, n)) - absorbed;
        let mut z = products.view((m, m + n), (n, 1)).column(0) - projection.of_columns.tr_mul(&projection.of_residual);
        let absorbed: Vec<usize> = (0..n).filter(|&k| gram[(k, k)] <= ABSORBED * products[(m + k, m + k)]).collect();
        for k in absorbed {
            gram.row_mut(k).fill(0.0);
            gram.column_mut(k).fill(0.0);
            z[k] = 0.0;
        }
        let left = (squares - projection.of_residual.norm_squared()).max(f64::MIN_POSITIVE);
        let parameters = fit.kept.len() as f64;
        let dof = ((fit.dof as f64 + parameters) / noise_scale.repetition - parameters).max(1.0);
        let remainder = if noise_scale.is_known() {
            Remainder { squares: left + STATED_NOISE_DOF, dof: dof + STATED_NOISE_DOF }
        } else {
            Remainder { squares: left, dof }
        };
        let mut contexts = wide.contexts(&values);
        contexts.iter_mut().for_each(|c| c.scale(weight));
        Ok(Examination {
            model: model.clone(),
            contexts,
            noise_scale,
            whole: (0..n).map(|k| products[(m + k, m + k)]).collect(),
            library,
            problem,
            fit,
            wide,
            values,
            fitted,
            columns,
            spans,
            rows,
            projection,
            gram,
            z,
            remainder,
        })
    }

    /// Factor that converts the whitened sum of squares of each sample to m².
    pub(crate) fn squared_units(&self) -> Vec<f64> {
        let mut unit = vec![0.0; self.contexts.len()];
        let weight2 = self.noise_scale.weight().powi(2);
        self.problem.for_each_sample(&self.fit.values, &mut |s| unit[s.place] = s.variance / s.height as f64 / weight2);
        unit
    }

    /// Mean over the samples of the variance of the 3-D noise used for whitening, m².
    pub(crate) fn mean_variance(&self) -> f64 {
        let mut sum = 0.0;
        self.problem.for_each_sample(&self.fit.values, &mut |s| sum += s.variance);
        sum / self.problem.sample_count().max(1) as f64
    }

    /// The fit.
    pub fn fit(&self) -> &Fit {
        &self.fit
    }

    /// The fitted model.
    pub fn model(&self) -> &Model {
        &self.model
    }

    /// The fitted problem.
    pub fn problem(&self) -> &Problem {
        &self.problem
    }

    /// Returns the fit as a calibration.
    pub fn calibration(&self, datasets: &[NamedDataset<'_>]) -> Calibration {
        Calibration::of(datasets, &self.model, &self.problem, &self.fit)
    }

    /// The noise as known from the data, independent of what the model may be missing.
    pub fn noise(&self) -> &NoiseFloor {
        &self.noise_scale.noise
    }

    /// Whitened sum of squares per degree of freedom, in units of the noise, of a model with an additional effect that
    /// explains `explained` of the remainder with `coefficients` parameters; `None` if the noise is unknown.
    pub(crate) fn chi2_per_dof_with(&self, explained: f64, coefficients: usize) -> Option<f64> {
        let squares = self.remainder.squares - STATED_NOISE_DOF - explained;
        let dof = self.remainder.dof - STATED_NOISE_DOF - coefficients as f64;
        self.noise_scale.is_known().then(|| squares.max(0.0) / dof.max(1.0))
    }

    /// The candidates.
    pub fn library(&self) -> &Library {
        &self.library
    }

    /// The projected columns of a candidate and their inner products with the remainder.
    pub(crate) fn seen(&self, candidate: usize) -> Seen {
        let Span { first, count } = self.spans[candidate];
        self.seen_with(candidate, &self.z.rows(first, count).into_owned())
    }

    /// The projected columns of a candidate, with these inner products.
    fn seen_with(&self, candidate: usize, products: &DVector<f64>) -> Seen {
        let Span { first, count } = self.spans[candidate];
        Seen::new(self.gram.view((first, first), (count, count)).into_owned(), products)
    }

    /// Posterior mean and covariance of a candidate's coefficients, in plausible sizes, for a prior of `width`
    /// plausible sizes and whitened residuals of variance `unit`.
    ///
    /// # Errors
    /// When an inner product is not finite: with a prior, the precision is positive definite.
    pub(crate) fn posterior(&self, candidate: usize, width: f64, unit: f64) -> Result<(DVector<f64>, DMatrix<f64>), FitError> {
        let Span { first, count } = self.spans[candidate];
        let unit = unit.max(LEAST_UNIT);
        let precision =
            self.gram.view((first, first), (count, count)) / unit + DMatrix::identity(count, count) / (width * width);
        let covariance = positive_definite::inverse(precision)?;
        Ok((&covariance * self.z.rows(first, count) / unit, covariance))
    }

    /// True if `other` is nearly aliased with `candidate`: it leaves less than `share` of what `candidate` explains.
    pub(crate) fn is_near_alias(&self, candidate: usize, other: usize, share: f64) -> Result<bool, FitError> {
        let (a, b) = (self.spans[candidate], self.spans[other]);
        let (mean, _) = self.posterior(candidate, 10.0, self.remainder.unit())?;
        let own = self.gram.view((a.first, a.first), (a.count, a.count));
        let energy = (own * &mean).dot(&mean);
        let with_other = self.gram.view((b.first, a.first), (b.count, a.count)) * &mean;
        Ok(energy > 0.0 && energy - self.seen_with(other, &with_other).explained().0 < share * energy)
    }

    /// Size of the signal of the given effects (id in a model, sizes in SI) beyond what the fitted model absorbs: rms
    /// over the whitened residuals, hence in units of their noise.
    ///
    /// # Errors
    /// When an id does not fit the data.
    pub fn visible_rms(
        &self,
        datasets: &[NamedDataset<'_>],
        effects: &[(String, Vec<f64>)],
    ) -> Result<Vec<f64>, IdentifyError> {
        let candidates = effects.iter().map(|(id, _)| Candidate::new(id.as_str()));
        let beside = self.beside(datasets, candidates.collect())?;
        let rms = |(k, (_, sizes)): (usize, &(String, Vec<f64>))| {
            let Span { first, count } = beside.spans[k];
            let of = |i: usize| sizes.get(i % sizes.len().max(1)).copied().unwrap_or(0.0);
            let sizes = DVector::from_fn(count, |i, _| of(i) / beside.columns[first + i].plausible);
            let energy = (beside.gram.view((first, first), (count, count)) * &sizes).dot(&sizes);
            (energy.max(0.0) / beside.rows.ncols() as f64).sqrt()
        };
        Ok(effects.iter().enumerate().map(rms).collect())
    }

    /// The other effects that could pass for one of the given size (id in a model, sizes in SI) in these data: each with the
    /// share that it takes, at best, of what the fitted model does not absorb of that effect. They are those of the library,
    /// and `more`; largest share first, ties in their order.
    ///
    /// # Errors
    /// When an id does not fit the data.
    pub fn imitators(
        &self,
        datasets: &[NamedDataset<'_>],
        id: &str,
        sizes: &[f64],
        more: &[String],
    ) -> Result<Vec<(String, f64)>, IdentifyError> {
        let known = |id: &&String| self.library.place(id).is_none();
        let others = self.library.candidates.iter().map(|c| c.id.whole()).chain(more.iter().filter(known).map(String::as_str));
        let all = std::iter::once(id).chain(others.filter(|other| *other != id)).map(Candidate::new).collect();
        let beside = self.beside(datasets, all)?;
        let Span { first, count } = beside.spans[0];
        let sizes = DVector::from_fn(count, |i, _| {
            sizes.get(i % sizes.len().max(1)).copied().unwrap_or(0.0) / beside.columns[first + i].plausible
        });
        let energy = (beside.gram.view((first, first), (count, count)) * &sizes).dot(&sizes);
        let share = |k: usize| {
            let other = beside.spans[k];
            let with = beside.gram.view((other.first, first), (other.count, count)) * &sizes;
            if energy > 0.0 && other.count > 0 { (beside.seen_with(k, &with).explained().0 / energy).min(1.0) } else { 0.0 }
        };
        let mut shares: Vec<(String, f64)> =
            (1..beside.spans.len()).map(|k| (beside.library.candidates[k].id.to_string(), share(k))).collect();
        shares.sort_by(|(_, a), (_, b)| b.total_cmp(a));
        Ok(shares)
    }

    /// Share of a candidate's energy that the fitted model does not absorb.
    pub(crate) fn visible(&self, candidate: usize) -> f64 {
        let energy = |of: &dyn Fn(usize) -> f64| self.spans[candidate].range().map(of).sum::<f64>();
        let whole = energy(&|k| self.whole[k]);
        if whole > 0.0 { (energy(&|k| self.gram[(k, k)]) / whole).clamp(0.0, 1.0) } else { 0.0 }
    }
}
