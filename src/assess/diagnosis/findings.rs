//! The most credible effects side by side.

use rayon::prelude::*;
use statrs::distribution::{ContinuousCDF, FisherSnedecor};

use super::{Contribution, Finding, FoundParameter};
use crate::assess::cross_validation::{cross_validated, folds};
use crate::assess::exact_alias::exact_aliases;
use crate::assess::examination::Examination;
use crate::assess::hypotheses::Hypothesis;
use crate::assess::relevance::Relevance;
use crate::identify::ORDINARY_WIDTH;
use crate::measure::Dataset;

/// Two effects are near-aliases when less than this share of what one explains is left to it beside the other.
const NEAR_ALIAS: f64 = 0.03;

pub(super) fn contributions(examination: &Examination, relevance: &Relevance) -> Vec<Contribution> {
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

/// Width at which an estimate is free for all that the data say.
const FREE: f64 = 1e3;

/// Looks at hypotheses side by side; `close` holds them as its candidates, in this order.
pub(super) fn findings(
    datasets: &[(&str, &Dataset)],
    close: &Examination,
    hypotheses: &[Hypothesis],
    tests: usize,
    probability: impl Fn(&Hypothesis) -> f64 + Sync,
) -> Vec<Finding> {
    let remainder = &close.remainder;
    let unit = remainder.unit();
    let folds = folds(&close.circumstances);
    let before: f64 = cross_validated(close, &folds, 0..0).iter().sum();
    let best_places: usize = hypotheses.iter().map(|h| h.places).max().unwrap_or(1);
    let finding = |(k, h): (usize, &Hypothesis)| {
        let span = close.spans[k];
        let explained = h.explains * remainder.squares;
        let left = (remainder.squares - explained).max(f64::MIN_POSITIVE);
        let (p, nu) = (h.coefficients as f64, remainder.dof);
        let f = (explained / p) / (left / (nu - p));
        let p_value = FisherSnedecor::new(p.max(1.0), (nu - p).max(1.0)).map_or(1.0, |d| d.sf(f.max(0.0)));
        let after: f64 = cross_validated(close, &folds, span.range()).iter().sum();
        let (mean, covariance) = close.posterior(k, ORDINARY_WIDTH, unit * left / remainder.squares);
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
        let rivals = (0..hypotheses.len()).filter(|&r| r != k && close.is_near_alias(k, r, NEAR_ALIAS));
        Finding {
            hypothesis: h.clone(),
            probability: probability(h),
            p_family: (p_value * (tests + best_places) as f64).min(1.0),
            delta_bic: remainder.dof * (remainder.squares / left).ln() - p * (3.0 * close.circumstances.len() as f64).ln(),
            cv_gain: 1.0 - (after / before).sqrt(),
            rivals: rivals.map(|r| hypotheses[r].effect.clone()).collect(),
            exactly_same: exact_aliases(&h.in_model, datasets),
            parameters: parameters.collect(),
            size: size(close, k).0,
        }
    };
    hypotheses.par_iter().enumerate().map(finding).collect()
}

/// Size of a candidate as the data alone would have it, and the least that they allow (two one-sigmas less), in plausible sizes, rms over
/// its numbers.
pub(super) fn size(close: &Examination, candidate: usize) -> (f64, f64) {
    let (mean, covariance) = close.posterior(candidate, FREE, close.remainder.unit());
    let n = mean.len().max(1) as f64;
    let least = |i: usize| (mean[i].abs() - 2.0 * covariance[(i, i)].max(0.0).sqrt()).max(0.0);
    let least = (0..mean.len()).map(|i| least(i).powi(2)).sum::<f64>() / n;
    ((mean.norm_squared() / n).sqrt(), least.sqrt())
}

/// A parameter's name without what the effect's id already says.
fn short_name(effect: &str, name: &str) -> String {
    let family = effect.split(':').next().unwrap_or(effect);
    [format!("{effect}."), format!("{family}."), format!("{family}:")]
        .iter()
        .find_map(|prefix| name.strip_prefix(prefix.as_str()))
        .unwrap_or(name)
        .to_owned()
}
