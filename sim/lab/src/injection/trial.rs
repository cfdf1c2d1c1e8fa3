//! One injection: measured, calibrated, diagnosed, and compared with what was injected.

use calibench::diagnosis::{Diagnosis, Examination, diagnose_examined};
use calibench::effects::ParameterSpec;
use calibench::identify::calibration::{Calibration, Estimate, IdentifyError};
use calibench::identify::problem::{Parameter, Problem, Use};
use calibench::identify::{Model, identify};
use calibench::measure::dataset::{Dataset, NamedDataset};
use calibench::residuals::Validation;
use calibench::units::{MM, Unit};
use calibench_sim::effect_names::{family_of, same};
use nalgebra::{DMatrix, DVector};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use serde::Serialize;
use statrs::distribution::{ChiSquared, ContinuousCDF};

use super::Subject;

/// Probability that a normal variable is within two sigma.
pub(super) const TWO_SIGMA: f64 = 0.9545;

/// A parameter of an injected effect, in the unit in which it is shown.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct InjectedParameter {
    /// Name.
    pub name: String,
    /// Unit.
    pub unit: String,
    /// Injected deviation from nominal.
    pub injected: f64,
    /// Estimated deviation and its one-sigma, if the effect was named and the data determine this parameter.
    pub found: Option<[f64; 2]>,
}

/// The outcome of one injection.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Injected {
    /// Id of the effect; empty if nothing was injected.
    pub effect: String,
    /// Its parameters.
    pub parameters: Vec<InjectedParameter>,
    /// Rms of what the fitted model does not absorb of it, in units of the noise.
    pub visible: f64,
    /// Smallest size at which these data detect it with 90 % power, in plausible sizes; `None` if at none.
    pub detectable_from: Option<f64>,
    /// The verdict.
    pub verdict: &'static str,
    /// The diagnosis says that something is missing.
    pub found: bool,
    /// The first finding is the effect, its family, or an effect that these data cannot distinguish from it.
    pub named: bool,
    /// The first finding; empty if nothing is named.
    pub first: String,
    /// The estimates together agree with the injected size as closely as two sigma; `None` unless it was named.
    pub within_2_sigma: Option<bool>,
    /// Mean position error over the workspace, mm: with the model, and with the first finding added.
    pub before_mm: Option<f64>,
    #[allow(missing_docs)]
    pub after_mm: Option<f64>,
}

impl Subject<'_> {
    /// Injects one effect at one plausible size, or nothing, and looks for it.
    pub(super) fn trial(&self, effect: Option<&str>, random: &mut ChaCha8Rng) -> Result<Injected, IdentifyError> {
        let (truth, injected) = self.truth(effect, random)?;
        let measured = self.measured(&truth, random)?;
        let data: Vec<NamedDataset<'_>> =
            self.datasets.iter().zip(&measured).map(|(of, d)| NamedDataset::new(of.name, d)).collect();
        let examination = Examination::new(&data, &self.model)?;
        let diagnosis = diagnose_examined(&data, &examination)?;
        let first = named_first(&diagnosis);
        let names = |id: &str| {
            first.is_some_and(|_| {
                let top = &diagnosis.findings[0];
                let is_it = |name: &str| same(name, id) || name == family_of(id);
                is_it(&top.hypothesis.in_model) || top.rivals.iter().any(|r| is_it(r))
            })
        };
        let named = effect.is_some_and(names);
        let with_first = first.and_then(|first| identify(&data, &self.model.with(first)).ok());
        let there = self.workspace(&truth);
        let error = |c: &Calibration| there.as_ref().and_then(|there| self.error_mm(c, there));
        let before_mm = error(&examination.calibration(&data));
        let after_mm = match &with_first {
            Some(calibration) => error(calibration),
            None => before_mm,
        };
        let with_it = effect.filter(|_| named).and_then(|id| match with_first {
            Some(calibration) if first == Some(id) => Some(calibration),
            _ => identify(&data, &self.model.with(id)).ok(),
        });
        let sizes = injected.iter().map(|e| e.value - e.nominal).collect();
        let visible = effect.and_then(|id| examination.visible_rms(&data, &[(id.to_owned(), sizes)]).ok());
        Ok(Injected {
            effect: effect.unwrap_or_default().to_owned(),
            visible: visible.and_then(|v| v.first().copied()).unwrap_or(0.0),
            detectable_from: effect.and_then(|id| self.smallest.get(id).copied().flatten()),
            verdict: diagnosis.verdict.name(),
            found: !diagnosis.verdict.is_noise(),
            named,
            first: first.unwrap_or_default().to_owned(),
            within_2_sigma: with_it.as_ref().and_then(|c| agrees(&injected, c)),
            parameters: injected.iter().map(|e| shown(e, with_it.as_ref())).collect(),
            before_mm,
            after_mm,
        })
    }

    /// The calibrated robot with the effect at one plausible size: random parameters whose rms, in plausible sizes, is one.
    pub(super) fn truth(
        &self,
        effect: Option<&str>,
        random: &mut ChaCha8Rng,
    ) -> Result<(Calibration, Vec<Estimate>), IdentifyError> {
        let known = Problem::new(self.datasets, &self.model, Use::Fit)?;
        let mut truth = self.baseline.clone();
        // Certified values are as uncertain as their certificate says, whatever the fit made of them.
        for estimate in &mut truth.estimates {
            let parameter = known.parameters().iter().find(|p| p.name == estimate.name);
            if let (Some(sigma), Some(parameter)) = (estimate.stated_sigma, parameter) {
                estimate.value = parameter.start + sigma * random.sample::<f64, _>(StandardNormal);
            }
        }
        let Some(id) = effect else { return Ok((truth, Vec::new())) };
        let (model, added) = self.added(id)?;
        let drawn: Vec<f64> = added.iter().map(|_| random.sample(StandardNormal)).collect();
        let rms = (drawn.iter().map(|d| d * d).sum::<f64>() / drawn.len().max(1) as f64).sqrt();
        Ok(with(truth, model, injected_of(&added, drawn.iter().map(|d| d / rms))))
    }

    /// The calibrated robot with an effect whose parameters deviate by `sizes`, in plausible sizes, from their nominal values.
    pub(crate) fn truth_of_size(&self, id: &str, sizes: &[f64]) -> Result<(Calibration, Vec<Estimate>), IdentifyError> {
        let (model, added) = self.added(id)?;
        Ok(with(self.baseline.clone(), model, injected_of(&added, sizes.iter().copied())))
    }

    /// The parameters of an effect.
    pub(crate) fn parameters_of(&self, id: &str) -> Result<Vec<ParameterSpec>, IdentifyError> {
        Ok(self.added(id)?.1.into_iter().map(|p| p.spec).collect())
    }

    /// The model with an effect, and the parameters that the effect adds to it, or frees; those of an effect that it holds.
    fn added(&self, id: &str) -> Result<(Model, Vec<Parameter>), IdentifyError> {
        if self.model.effects.iter().any(|e| e == id) {
            let problem = Problem::new(self.datasets, &self.model, Use::Fit)?;
            return Ok((self.model.clone(), problem.parameters().iter().filter(|p| p.effect == id).cloned().collect()));
        }
        let known = Problem::new(self.datasets, &self.model, Use::Fit)?;
        let model = self.model.with(id);
        let problem = Problem::new(self.datasets, &model, Use::Fit)?;
        let is_known = |p: &Parameter| known.parameters().iter().any(|k| k.name == p.name && k.knowledge == p.knowledge);
        Ok((model, problem.parameters().iter().filter(|p| !is_known(p)).cloned().collect()))
    }

    /// Mean position error over the workspace, mm.
    fn error_mm(&self, calibration: &Calibration, there: &Dataset) -> Option<f64> {
        let anew = self.anew.then(|| calibration.set_up_anew());
        let name = self.datasets[0].name;
        let prediction =
            anew.as_ref().unwrap_or(calibration).predict(&[NamedDataset::new(name, there)], Use::Validation).ok()?;
        Validation::of(&prediction).map(|v| v.mean / MM)
    }
}

/// The parameters of an effect as injected: `sizes` are in plausible sizes.
fn injected_of(added: &[Parameter], sizes: impl Iterator<Item = f64>) -> Vec<Estimate> {
    let estimate = |(p, size): (&Parameter, f64)| Estimate {
        name: p.name.clone(),
        effect: p.effect.clone(),
        unit: p.spec.unit,
        value: p.start + size * p.spec.prior,
        sigma: 0.0,
        sigma_noise: 0.0,
        nominal: p.start,
        stated_sigma: None,
    };
    added.iter().zip(sizes).map(estimate).collect()
}

/// A robot with these parameters in place of its own.
fn with(mut truth: Calibration, model: Model, injected: Vec<Estimate>) -> (Calibration, Vec<Estimate>) {
    truth.estimates.retain(|e| injected.iter().all(|i| i.name != e.name));
    truth.estimates.extend(injected.iter().cloned());
    (Calibration { model, ..truth }, injected)
}

/// The first finding of a diagnosis that names one.
fn named_first(diagnosis: &Diagnosis) -> Option<&str> {
    let first = diagnosis.findings.first().filter(|_| diagnosis.verdict.names_effects())?;
    Some(&first.hypothesis.in_model)
}

/// True if the estimates lie where they lie in 95.45 % of cases if all is well, jointly; `None` if the data determine none.
fn agrees(injected: &[Estimate], calibration: &Calibration) -> Option<bool> {
    let place = |e: &Estimate| calibration.estimates.iter().position(|c| c.name == e.name);
    let places: Vec<(usize, &Estimate)> = injected.iter().filter_map(|e| Some((place(e)?, e))).collect();
    let sigma = |k: usize| calibration.estimates[places[k].0].sigma;
    if places.is_empty() || (0..places.len()).any(|k| sigma(k) <= 0.0) {
        return None;
    }
    let off = DVector::from_fn(places.len(), |k, _| (calibration.estimates[places[k].0].value - places[k].1.value) / sigma(k));
    let correlation = DMatrix::from_fn(places.len(), places.len(), |r, c| calibration.correlation[(places[r].0, places[c].0)]);
    let squared = off.dot(&correlation.cholesky()?.solve(&off));
    Some(squared <= ChiSquared::new(places.len() as f64).ok()?.inverse_cdf(TWO_SIGMA))
}

/// A parameter, in the unit in which it is shown.
fn shown(injected: &Estimate, with_it: Option<&Calibration>) -> InjectedParameter {
    let unit: Unit = injected.unit;
    let found = with_it.and_then(|c| c.estimate(&injected.name));
    InjectedParameter {
        name: injected.name.clone(),
        unit: unit.printed().to_string(),
        injected: unit.from_si(injected.value - injected.nominal),
        found: found.map(|e| [e.value - injected.nominal, e.sigma].map(|x| unit.from_si(x))),
    }
}
