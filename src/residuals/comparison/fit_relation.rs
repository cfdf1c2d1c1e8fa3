//! Relation of samples to a calibration: whether it was fitted to them, and hence how much it may have absorbed.

use nalgebra::{DMatrix, DVector};

use crate::identify::Application;
use crate::identify::calibration::Calibration;
use crate::identify::problem::Use;
use crate::math::linalg::LinalgError;
use crate::measure::dataset::{Dataset, NamedDataset};
use crate::residuals::noise_floor::NoiseFloor;
use crate::residuals::views::{PriorKnowledge, Whitened};

/// Samples are taken as those of the fit if the best step from the calibration is shorter than this, in units of the
/// noise. A fit converges to 1e-8, or to 1e-3 at worst if loads depend on its values, and files keep fifteen digits;
/// for new samples the step is about the square root of the number of parameters.
const NO_STEP: f64 = 0.03;

/// Relation of the samples to the fit of a calibration.
#[derive(Debug, Clone, PartialEq)]
pub struct FitRelation {
    /// True if the calibration was fitted to these samples, or to some of them: its parameters have then absorbed what
    /// they could.
    pub fitted: bool,
    /// Number of parameters that count as free: if `fitted`, those without a prior; otherwise those of set-ups that the
    /// calibration does not contain.
    pub absorbed: usize,
    /// Number of parameters with prior knowledge: a certified or plausible size or, if not `fitted`, the covariance of
    /// the calibration.
    pub held: usize,
    /// Parameters of set-ups that the calibration does not contain, fitted to these samples.
    pub refitted: Vec<String>,
    /// Parameters of such set-ups fitted to other rows of the data, those of set `fit`.
    pub from_fit_rows: Vec<String>,
}

pub(super) fn of(
    calibration: &Calibration,
    application: &Application,
    datasets: &[NamedDataset<'_>],
    which: Use,
    noise: &NoiseFloor,
) -> Result<(FitRelation, PriorKnowledge), LinalgError> {
    let Application { problem, values, refitted, from_fit_rows, .. } = application;
    let as_fitted = as_fitted(application);
    let named = |d: &Dataset| !d.hash.is_empty() && calibration.dataset_hashes.contains(&d.hash);
    let rows_of_the_fit = which != Use::Validation && datasets.iter().any(|d| named(d.dataset));
    let under_another_name = calibration.fitted_rows.share(datasets, which).is_some_and(|share| share > 0.5);
    let known = if rows_of_the_fit || under_another_name || is_best(problem, values, &as_fitted)? {
        as_fitted
    } else {
        as_predicted(calibration, application, noise)
    };
    let names = |list: &[usize]| list.iter().map(|&p| problem.parameters()[p].name.clone()).collect();
    let fit_relation = FitRelation {
        fitted: known.fitted,
        absorbed: known.parameters.len() - known.informed.len(),
        held: known.informed.len(),
        refitted: names(refitted),
        from_fit_rows: names(from_fit_rows),
    };
    Ok((fit_relation, known))
}

fn is_best(problem: &crate::identify::problem::Problem, values: &[f64], known: &PriorKnowledge) -> Result<bool, LinalgError> {
    let whitened = Whitened::new(problem, values, known)?;
    let unit = if problem.noise_stated() { 1.0 } else { (whitened.squares / whitened.dof.max(1.0)).sqrt() };
    Ok(whitened.dof > 0.0 && whitened.step_left() < NO_STEP * unit)
}

/// One-sigma of a parameter's prior; `None` if it has none.
fn stated(application: &Application, p: usize) -> Option<f64> {
    Some(application.problem.parameters()[p].knowledge.sigma()).filter(|sigma| sigma.is_finite())
}

/// Knowledge if the calibration was fitted to these samples: parameters are free, except for their priors.
fn as_fitted(application: &Application) -> PriorKnowledge {
    let Application { problem, values, estimates, refitted, from_fit_rows } = application;
    let free = |p: &usize| estimates[*p].is_some() || refitted.contains(p) || from_fit_rows.contains(p);
    let parameters: Vec<usize> = (0..problem.parameters().len()).filter(free).collect();
    let informed: Vec<usize> = (0..parameters.len()).filter(|&i| stated(application, parameters[i]).is_some()).collect();
    let variances = informed.iter().filter_map(|&i| stated(application, parameters[i])).map(|sigma| sigma * sigma);
    let covariance = DMatrix::from_diagonal(&DVector::from_iterator(informed.len(), variances));
    let mut deviation = DVector::zeros(parameters.len());
    informed.iter().for_each(|&i| deviation[i] = values[parameters[i]]);
    PriorKnowledge { parameters, deviation, informed, covariance, fitted: true }
}

/// Knowledge if the calibration predicts these samples: its parameters with their covariance; those of set-ups that it
/// does not contain are free.
fn as_predicted(calibration: &Calibration, application: &Application, noise: &NoiseFloor) -> PriorKnowledge {
    let Application { problem, estimates, refitted, from_fit_rows, .. } = application;
    let free = |p: &usize| refitted.contains(p) || from_fit_rows.contains(p);
    let sigma = |p: usize| match estimates[p] {
        Some(e) => Some(calibration.estimates[e].sigma),
        None => stated(application, p),
    };
    let uncertain = |p: &usize| sigma(*p).is_some_and(|s| s > 0.0);
    let parameters: Vec<usize> = (0..problem.parameters().len()).filter(|p| free(p) || uncertain(p)).collect();
    let informed: Vec<usize> = (0..parameters.len()).filter(|&i| !free(&parameters[i])).collect();
    // Scores are in units of the samples' weights, whereas the knowledge of the parameters is absolute.
    let unit = match &noise.level {
        Some(level) => level.relative * level.relative,
        None if calibration.noise_stated || !calibration.chi2_per_dof.is_finite() => 1.0,
        None => calibration.chi2_per_dof,
    };
    let covariance = DMatrix::from_fn(informed.len(), informed.len(), |i, k| {
        let (a, b) = (parameters[informed[i]], parameters[informed[k]]);
        let correlation = match (estimates[a], estimates[b]) {
            _ if i == k => 1.0,
            (Some(a), Some(b)) => calibration.correlation[(a, b)],
            _ => 0.0,
        };
        correlation * sigma(a).unwrap_or(0.0) * sigma(b).unwrap_or(0.0) / unit
    });
    PriorKnowledge { deviation: DVector::zeros(parameters.len()), parameters, informed, covariance, fitted: false }
}
