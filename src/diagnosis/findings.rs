//! Findings: the most credible effects, examined side by side.

use nalgebra::DVector;
use rayon::prelude::*;

use super::Examination;
use super::Relevance;
use super::cross_validation::{cross_validated, folds};
use super::exact_alias::exact_aliases;
use super::hypotheses::{Hypothesis, with_undecided};
use super::{Contribution, Finding, FoundParameter};
use crate::effects::EffectId;
use crate::identify::BACKGROUND_WIDTH;
use crate::identify::fit::FitError;
use crate::measure::dataset::NamedDataset;
use crate::residuals::noise_floor::fisher_chance;

/// Two effects are near-aliases if one leaves less than this share of what the other explains.
const NEAR_ALIAS: f64 = 0.03;

pub(crate) fn contributions(examination: &Examination, relevance: &Relevance) -> Vec<Contribution> {
    let whole: f64 = relevance.energy.iter().sum();
    let spans = examination.spans.iter().zip(&relevance.energy).zip(&examination.library.candidates);
    let mut all: Vec<Contribution> = spans
        .map(|((span, energy), candidate)| Contribution {
            effect: candidate.id.clone(),
            share: energy / whole.max(f64::MIN_POSITIVE),
            size: (span.range().map(|k| relevance.mean[k].powi(2)).sum::<f64>() / span.count.max(1) as f64).sqrt(),
        })
        .collect();
    all.sort_by(|a, b| b.share.total_cmp(&a.share));
    all
}

/// Prior width of an estimate that only the data determine, plausible sizes.
const FREE: f64 = 1e3;

/// Examines hypotheses side by side; the candidates of `close` are these hypotheses, in this order.
///
/// # Errors
/// When an inner product is not finite.
pub(crate) fn findings(
    datasets: &[NamedDataset<'_>],
    close: &Examination,
    hypotheses: &[Hypothesis],
    tests: usize,
    probability: impl Fn(&Hypothesis) -> f64 + Sync,
) -> Result<Vec<Finding>, FitError> {
    let remainder = &close.remainder;
    let unit = remainder.unit();
    let folds = folds(&close.contexts);
    let before: f64 = cross_validated(close, &folds, 0..0)?.iter().sum();
    let best_places: usize = hypotheses.iter().map(|h| h.places).max().unwrap_or(1);
    let finding = |(k, h): (usize, &Hypothesis)| {
        let span = close.spans[k];
        let explained = h.explains * remainder.squares;
        let left = (remainder.squares - explained).max(f64::MIN_POSITIVE);
        let (p, nu) = (h.coefficients as f64, remainder.dof);
        let f = (explained / p.max(1.0)) / (left / (nu - p));
        let p_value = fisher_chance(f, p.max(1.0), (nu - p).max(1.0)).unwrap_or(1.0);
        let after: f64 = cross_validated(close, &folds, span.range())?.iter().sum();
        let (mean, covariance) = close.posterior(k, BACKGROUND_WIDTH, unit * left / remainder.squares)?;
        let parameters = span.range().enumerate().map(|(i, c)| {
            let parameter = &close.wide.parameters()[close.columns[c].parameter];
            let plausible = close.columns[c].plausible;
            FoundParameter {
                name: short_name(&h.in_model, &parameter.name),
                value: mean[i] * plausible,
                sigma: covariance[(i, i)].max(0.0).sqrt() * plausible,
                unit: parameter.spec.unit,
            }
        });
        let mut rivals = Vec::new();
        for r in (0..hypotheses.len()).filter(|&r| r != k) {
            if close.is_near_alias(k, r, NEAR_ALIAS)? {
                rivals.push(hypotheses[r].effect.clone());
            }
        }
        Ok(Finding {
            hypothesis: with_undecided(h, close, datasets),
            probability: probability(h),
            p_family: (p_value * (tests + best_places) as f64).min(1.0),
            delta_bic: remainder.dof * (remainder.squares / left).ln() - p * (3.0 * close.contexts.len() as f64).ln(),
            cv_gain: 1.0 - (after / before).sqrt(),
            rivals,
            exactly_same: exact_aliases(&h.in_model, &close.model.registry, datasets),
            parameters: parameters.collect(),
            size: Freely::of(close, k)?.size(),
        })
    };
    hypotheses.par_iter().enumerate().map(finding).collect()
}

/// Estimate of a candidate from the data alone, in plausible sizes.
pub(crate) struct Freely {
    estimate: DVector<f64>,
    /// Smallest absolute value of each parameter that the data allow: two one-sigmas below the estimate, at least zero.
    pub least: DVector<f64>,
}

impl Freely {
    /// # Errors
    /// As [`Examination::posterior`].
    pub fn of(close: &Examination, candidate: usize) -> Result<Self, FitError> {
        let (estimate, covariance) = close.posterior(candidate, FREE, close.remainder.unit())?;
        let least = |i: usize, _: usize| (estimate[i].abs() - 2.0 * covariance[(i, i)].max(0.0).sqrt()).max(0.0);
        let least = DVector::from_fn(estimate.len(), least);
        Ok(Freely { estimate, least })
    }

    /// The value of a parameter nearest to zero that the data allow, in plausible sizes.
    pub fn nearest(&self, parameter: usize) -> f64 {
        self.least[parameter].copysign(self.estimate[parameter])
    }

    /// Size of the estimate, rms over its parameters.
    pub fn size(&self) -> f64 {
        rms(&self.estimate)
    }

    /// Smallest size that the data allow, rms over its parameters.
    pub fn least_size(&self) -> f64 {
        rms(&self.least)
    }
}

fn rms(numbers: &DVector<f64>) -> f64 {
    (numbers.norm_squared() / numbers.len().max(1) as f64).sqrt()
}

/// Name of a parameter without the prefix that repeats the effect's id.
fn short_name(effect: &str, name: &str) -> String {
    let id = EffectId::new(effect);
    let family = id.family();
    [format!("{effect}."), format!("{family}."), format!("{family}:")]
        .iter()
        .find_map(|prefix| name.strip_prefix(prefix.as_str()))
        .unwrap_or(name)
        .to_owned()
}
