//! The fitted problem, extended by the parameters of every candidate.

use std::ops::Range;

use nalgebra::DMatrix;

use super::super::library::{Candidate, CandidateRows, Library, WhitenedRows};
use super::super::projection::information;
use super::Examination;
use crate::effects::own::OwnEffect;
use crate::identify::Model;
use crate::identify::calibration::IdentifyError;
use crate::identify::fit::Fit;
use crate::identify::problem::{Problem, Use};
use crate::measure::dataset::NamedDataset;

/// Columns of one candidate: its parameters in plausible sizes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Span {
    pub first: usize,
    pub count: usize,
}

impl Span {
    pub fn range(self) -> Range<usize> {
        self.first..self.first + self.count
    }
}

/// A parameter of a candidate effect.
#[derive(Debug, Clone)]
pub(crate) struct Column {
    /// Index of the parameter in the wide problem.
    pub parameter: usize,
    /// Plausible size, SI.
    pub plausible: f64,
}

/// The extended problem, and the columns of fit and candidates in it.
pub(super) struct Wide {
    pub problem: Problem,
    /// Values of its parameters, SI: those of the fit, and zero for the candidates.
    pub values: Vec<f64>,
    /// Its parameters that the fit estimated.
    pub fitted: Vec<usize>,
    /// Columns of all candidates.
    pub columns: Vec<Column>,
    /// Columns of each candidate.
    pub spans: Vec<Span>,
}

impl Wide {
    pub fn of(
        datasets: &[NamedDataset<'_>],
        model: &Model,
        narrow: &Problem,
        fit: &Fit,
        library: &Library,
    ) -> Result<Self, IdentifyError> {
        let mut wide_model = model.clone();
        wide_model.effects.extend(library.candidates.iter().map(|c| c.id.clone()));
        let mut problem = Problem::new(datasets, &wide_model, Use::Fit)?;
        let mut values = problem.start();
        let of_name = |name: &str| problem.parameters().iter().position(|p| p.name == name);
        let mut fitted = Vec::with_capacity(fit.kept.len());
        for (p, parameter) in narrow.parameters().iter().enumerate() {
            let Some(place) = of_name(&parameter.name) else { continue };
            values[place] = fit.values[p];
            if fit.kept.binary_search(&p).is_ok() {
                fitted.push(place);
            }
        }
        problem.update_loads(&values);
        let mut columns = Vec::new();
        let mut spans = Vec::with_capacity(library.candidates.len());
        for candidate in &library.candidates {
            let first = columns.len();
            let parameters = problem.parameters().iter().enumerate().filter(|(_, p)| p.effect == candidate.id);
            columns.extend(parameters.map(|(k, p)| Column { parameter: k, plausible: p.spec.prior }));
            spans.push(Span { first, count: columns.len() - first });
        }
        Ok(Wide { problem, values, fitted, columns, spans })
    }

    /// Whitened columns of the fitted parameters (SI) and of the candidates (plausible sizes), then the residuals;
    /// transposed.
    pub fn rows(&self) -> DMatrix<f64> {
        let Wide { problem, values, fitted, columns, .. } = self;
        // A certified ball is both fitted and a candidate: its columns are computed once and copied.
        let mut parameters: Vec<usize> = fitted.iter().copied().chain(columns.iter().map(|c| c.parameter)).collect();
        parameters.sort_unstable();
        parameters.dedup();
        let all = problem.whitened(values, &parameters);
        let place = |p: usize| parameters.binary_search(&p).unwrap_or_else(|_| unreachable!("listed above"));
        let sources: Vec<(usize, f64)> = fitted
            .iter()
            .map(|&p| (place(p), 1.0))
            .chain(columns.iter().map(|c| (place(c.parameter), c.plausible)))
            .chain([(parameters.len(), 1.0)])
            .collect();
        let mut rows = DMatrix::zeros(sources.len(), all.ncols());
        for (mut to, from) in rows.column_iter_mut().zip(all.column_iter()) {
            for (x, (source, scale)) in to.iter_mut().zip(&sources) {
                *x = from[*source] * scale;
            }
        }
        rows
    }
}

impl Examination {
    /// The whitened rows from which everything else is computed: what a search among other shapes begins with.
    pub fn whitened(&self) -> WhitenedRows<'_> {
        let fitted = self.fitted.len();
        let columns =
            self.library.candidates.iter().zip(&self.spans).map(|(candidate, span)| CandidateRows {
                id: &candidate.id,
                rows: fitted + span.first..fitted + span.range().end,
            });
        let weight = self.noise_scale.weight();
        let information = self.fit.kept.iter().map(|&p| information(&self.problem, p, weight)).collect();
        let values = self.fit.kept.iter().map(|&p| self.fit.values[p]).collect();
        WhitenedRows { rows: &self.rows, fitted, information, values, candidates: columns.collect() }
    }

    /// Whitened columns, per SI unit, of the terms of a user-defined effect beside this fit: one row for each of its parameters.
    ///
    /// # Errors
    /// When the effect does not fit the data.
    pub fn columns_of(&self, datasets: &[NamedDataset<'_>], effect: &OwnEffect) -> Result<DMatrix<f64>, IdentifyError> {
        let mut model = self.model.clone();
        model.own.push(effect.clone());
        let library = Library { candidates: vec![Candidate::new(effect.name.as_str())], ..Library::default() };
        let wide = Wide::of(datasets, &model, &self.problem, &self.fit, &library)?;
        let parameters: Vec<usize> = wide.columns.iter().map(|c| c.parameter).collect();
        let rows = wide.problem.whitened(&wide.values, &parameters) * self.noise_scale.weight();
        Ok(rows.rows(0, parameters.len()).into_owned())
    }
}
