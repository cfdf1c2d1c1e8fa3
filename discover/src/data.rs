//! All that a search needs of the data.

use std::ops::Range;

use calibench::diagnosis::Examination;
use calibench::diagnosis::library::WhitenedRows;
use calibench::identify::calibration::IdentifyError;
use calibench::identify::problem::Use;
use calibench::measure::dataset::NamedDataset;
use calibench::measure::poses::Postures;
use calibench::units::{DEG, MM};
use nalgebra::{DMatrix, DVector};

use crate::catalogue::{self, Likely, Listed};
use crate::factors::{Factors, Known};
use crate::field::{Field, Found};
use crate::law::{Law, LawTerm, SeenRange};
use crate::metric::{Ground, Metrics};
use crate::samples::{Place, known, place_columns, places, spans};
use crate::variables::{Shown, Variable};

/// Log odds below which nothing is said to be significant: 20 to 1.
pub(crate) const SIGNIFICANT: f64 = 3.0;

/// Rms of an error of an angle, rad, beyond which it is none of a calibrated arm: a degree is a lost zero, not a law.
const LARGEST_TURN: f64 = 0.3 * DEG;

/// Rms of a displacement, m, beyond which it is none of a calibrated arm.
const LARGEST_SHIFT: f64 = 3.0 * MM;

/// Samples among which a search is made: of more, as many at equal steps.
const MOST_SAMPLES: usize = 400;

/// Number of effects of the catalogue that together may stand for one law.
const TOGETHER: usize = 8;

/// All that a search needs of the data.
pub(crate) struct Data {
    /// The places.
    pub places: Vec<Place>,
    /// Their whitened columns: places x residuals.
    pub columns: DMatrix<f64>,
    /// The variables.
    pub known: Vec<Known>,
    /// The factors.
    pub factors: Factors,
    /// Residuals of each sample.
    pub spans: Vec<Range<usize>>,
    /// Columns of the fitted parameters (residuals x parameters).
    pub fitted: DMatrix<f64>,
    /// Columns of the library (residuals x columns).
    catalogue: DMatrix<f64>,
    /// Effects of the library.
    listed: Vec<Listed>,
    /// Steps between two samples.
    steps: Vec<Listed>,
    /// The residuals.
    residual: DVector<f64>,
    /// Number of samples that count as one.
    repetition: f64,
}

impl Data {
    pub fn of(datasets: &[NamedDataset<'_>], examination: &Examination) -> Result<Self, IdentifyError> {
        let problem = examination.problem();
        let robot = problem.robot();
        let places = places(robot.joints(), |j| robot.kind(j));
        let spans = spans(examination);
        let step = spans.len().div_ceil(MOST_SAMPLES).max(1);
        let samples: Vec<usize> = (0..spans.len()).step_by(step).collect();
        let whitened = examination.whitened();
        let measured = spans.last().map_or(0, |s| s.end);
        // Rows of known distances and of priors, which no sample measures, stay.
        let rows: Vec<usize> = samples.iter().flat_map(|&i| spans[i].clone()).chain(measured..whitened.rows.ncols()).collect();
        let priors: Vec<Stated> = priors(&whitened);
        let residuals = rows.len() + priors.len();
        let mut fitted = DMatrix::zeros(residuals, whitened.fitted);
        fitted.rows_mut(0, rows.len()).copy_from(&whitened.rows.rows(0, whitened.fitted).select_columns(&rows).transpose());
        let mut residual = DVector::zeros(residuals);
        let last = whitened.rows.nrows() - 1;
        rows.iter().enumerate().for_each(|(i, &r)| residual[i] = whitened.rows[(last, r)]);
        for (k, prior) in priors.iter().enumerate() {
            fitted[(rows.len() + k, prior.parameter)] = prior.weight;
            residual[rows.len() + k] = -prior.weight * prior.value;
        }
        let mut first = 0;
        let spans: Vec<Range<usize>> = samples
            .iter()
            .map(|&i| {
                first += spans[i].len();
                first - spans[i].len()..first
            })
            .collect();
        let of_places = place_columns(datasets, examination, &places)?;
        let mut columns = DMatrix::zeros(places.len(), residuals);
        columns.columns_mut(0, rows.len()).copy_from(&of_places.select_columns(&rows));
        let known: Vec<Known> = known(datasets, examination)?
            .into_iter()
            .map(|k| Known { values: samples.iter().map(|&i| k.values[i]).collect(), ..k })
            .collect();
        let factors = Factors::of(robot, &known);
        let mut data = Data {
            places,
            columns,
            known,
            factors,
            spans,
            fitted,
            catalogue: DMatrix::zeros(residuals, 0),
            listed: catalogue::of_library(examination, &rows, residuals),
            steps: Vec::new(),
            residual,
            repetition: Postures::of(datasets, |s| Use::Fit.takes(s)).repetition(),
        };
        data.catalogue = data.listed.iter().fold(data.catalogue, |all, one| beside(&all, &one.columns));
        let ids: Vec<&str> = samples.iter().map(|&i| problem.sample_ids()[i].as_str()).collect();
        let times = data.known.iter().find(|k| k.variable == Variable::Time).map(|k| k.values.as_slice());
        data.steps = catalogue::steps(&data.field(), &ids, times);
        Ok(data)
    }

    /// What a search is made in.
    pub fn field(&self) -> Field<'_> {
        Field { places: &self.places, columns: &self.columns, factors: &self.factors, spans: &self.spans }
    }

    /// The residuals, with what is fitted or taken.
    pub fn ground(&self, taken: &DMatrix<f64>) -> Ground {
        Ground::new(taken, &self.catalogue, &DMatrix::from_columns(std::slice::from_ref(&self.residual)), self.repetition)
    }

    /// True if what was found is a law that nobody listed, of a size that can be.
    pub fn is_law(&self, found: &Found, metrics: &Metrics) -> bool {
        let largest = if self.places[found.shape.place].turns { LARGEST_TURN } else { LARGEST_SHIFT };
        catalogue::name_of(&found.shape, &self.places, &self.factors.all).is_none() && self.rms_of(found, metrics) < largest
    }

    /// Whitened sum of squares per degree of freedom that a law of these of its terms leaves.
    pub fn chi2_per_dof_with(&self, kept: &[usize], found: &Found, metrics: &Metrics) -> f64 {
        // Without a background, which would count as explained.
        let metric = &metrics.of_size[0];
        let columns = self.field().columns_of(&found.shape).select_columns(kept);
        let explained = metric.seen_columns(&columns).map_or(0.0, |seen| seen.explained());
        (metric.energies[0] - explained) / (metrics.free_residuals - kept.len() as f64).max(1.0)
    }

    fn rms_of(&self, found: &Found, metrics: &Metrics) -> f64 {
        let coefficients = Fitted::of(metrics, &self.field().columns_of(&found.shape)).coefficients;
        rms(&(self.factors.product(&found.shape.factors) * coefficients))
    }

    /// The best effect that somebody listed: of the library, a step, or a wave of a joint.
    pub fn best_listed(&self, metrics: &Metrics) -> Option<Likely> {
        let listed = [&self.listed, &self.steps].map(|listed| catalogue::best(listed, metrics));
        let wave = self.field().best_wave(metrics).and_then(|f| {
            let name = catalogue::name_of(&f.shape, &self.places, &self.factors.all)?;
            Some(Likely { listed: Listed { name, columns: self.field().columns_of(&f.shape) }, ln_odds: f.ln_odds })
        });
        { listed.into_iter().chain([wave]).flatten() }.reduce(|a, b| if b.ln_odds > a.ln_odds { b } else { a })
    }

    /// This listed effect, and those that are significant in addition to it, one after the other.
    pub fn together(&self, taken: &DMatrix<f64>, first: Likely) -> Vec<Likely> {
        let mut all = beside(taken, &first.listed.columns);
        let mut chain = vec![first];
        while chain.len() < TOGETHER {
            let metrics = self.ground(&all).metrics();
            let Some(next) = self.best_listed(&metrics).filter(|next| next.ln_odds > SIGNIFICANT) else { break };
            all = beside(&all, &next.listed.columns);
            chain.push(next);
        }
        chain
    }

    /// A law that was found, of these of its terms, with their coefficients.
    pub fn law(&self, found: &Found, kept: &[usize], metrics: &Metrics, p_false: f64) -> Law {
        let columns = self.field().columns_of(&found.shape).select_columns(kept);
        let fitted = Fitted::of(metrics, &columns);
        let values = self.factors.product(&found.shape.factors).select_columns(kept);
        let errors = &values * &fitted.coefficients;
        let place = &self.places[found.shape.place];
        let expressions = self.factors.expressions(&found.shape.factors);
        let term = |(k, &of): (usize, &usize)| LawTerm {
            basis: expressions[of].clone(),
            coefficient: fitted.coefficients[k],
            sigma: fitted.sigmas[k],
        };
        let factors = found.shape.factors.iter().map(|&k| &self.factors.all[k]);
        let seen = factors.filter_map(|f| {
            let known = self.known.iter().find(|k| k.variable == f.variable)?;
            let Shown { si, symbol } = f.variable.unit(self.factors.turns(f.variable));
            let low = known.values.iter().copied().fold(f64::INFINITY, f64::min) / si;
            let high = known.values.iter().copied().fold(f64::NEG_INFINITY, f64::max) / si;
            Some(SeenRange { name: f.variable.expression(), words: f.variable.words(), range: low..high, unit: symbol })
        });
        Law {
            site: place.site.clone(),
            place: place.words.clone(),
            turns: place.turns,
            terms: kept.iter().enumerate().map(term).collect(),
            variables: seen.collect(),
            rms: rms(&errors),
            explains: fitted.explains,
            ln_odds: found.ln_odds,
            p_false,
            p_place: 1.0,
            doubt: None,
            rivals: Vec::new(),
        }
    }
}

/// The columns of a law, fitted to the data.
pub(crate) struct Fitted {
    /// Coefficients, SI.
    pub coefficients: DVector<f64>,
    /// Their standard uncertainties, SI.
    pub sigmas: Vec<f64>,
    /// Share of the remaining sum of squares that they explain.
    pub explains: f64,
}

impl Fitted {
    /// Fits columns (residuals x columns) in the metric of the most probable background.
    pub fn of(metrics: &Metrics, columns: &DMatrix<f64>) -> Self {
        let metric = &metrics.of_size[metrics.likely_size(columns)];
        let k = columns.ncols();
        let Some(seen) = metric.seen_columns(columns) else {
            return Fitted { coefficients: DVector::zeros(k), sigmas: vec![f64::INFINITY; k], explains: 0.0 };
        };
        let explained = seen.explained();
        let unit = ((metric.energies[0] - explained) / (metrics.dof - k as f64).max(1.0)).max(0.0);
        let sigma = |i: usize| {
            let mut one = vec![0.0; k];
            one[i] = 1.0;
            (seen.products.coefficients(&one)[i] * unit).sqrt()
        };
        Fitted {
            coefficients: seen.coefficients(),
            sigmas: (0..k).map(sigma).collect(),
            explains: explained / metric.energies[0],
        }
    }
}

/// What a prior says of a fitted parameter: an equation of its own.
struct Stated {
    /// Its place among the fitted parameters.
    parameter: usize,
    /// Root of the information.
    weight: f64,
    /// The fitted value, as deviation from nominal, SI.
    value: f64,
}

fn priors(whitened: &WhitenedRows<'_>) -> Vec<Stated> {
    let of = |(parameter, (&information, &value)): (usize, (&f64, &f64))| {
        (information > 0.0).then(|| Stated { parameter, weight: information.sqrt(), value })
    };
    whitened.information.iter().zip(&whitened.values).enumerate().filter_map(of).collect()
}

/// Columns beside others.
pub(crate) fn beside(columns: &DMatrix<f64>, more: &DMatrix<f64>) -> DMatrix<f64> {
    let mut all = DMatrix::zeros(columns.nrows(), columns.ncols() + more.ncols());
    all.columns_mut(0, columns.ncols()).copy_from(columns);
    all.columns_mut(columns.ncols(), more.ncols()).copy_from(more);
    all
}

fn rms(errors: &DVector<f64>) -> f64 {
    (errors.norm_squared() / errors.len().max(1) as f64).sqrt()
}
