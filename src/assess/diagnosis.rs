//! Which effect is missing: the verdict, the findings, and what they rest on.

use rayon::prelude::*;
use statrs::distribution::{ChiSquared, ContinuousCDF, FisherSnedecor};

use super::cross_validation::{cross_validated, folds};
use super::evidence::{ln_mean_exp, ln_sum_exp};
use super::examination::Examination;
use super::heat_map::HeatMap;
use super::hypotheses::{Hypothesis, Place, hypotheses};
use super::library::{Candidate, Untestable};
use super::relevance::Relevance;
use crate::effects::EffectId;
use crate::identify::{IdentifyError, Model, ORDINARY_WIDTH};
use crate::measure::Dataset;
use crate::units::Unit;

/// Something is missing when nothing at all is less credible than this; noise alone raises it in less than one case of a hundred.
const NOTHING: f64 = 0.05;

/// Mass of the credible set.
const CREDIBLE: f64 = 0.95;

/// Two effects are near-aliases when less than this share of what one explains is left to it beside the other.
const NEAR_ALIAS: f64 = 0.03;

/// A noise is taken to be stated to within this factor: lack of fit below its square proves nothing.
const STATED_WITHIN: f64 = 1.5;

/// Lack of fit at this level.
const LACK_OF_FIT: f64 = 0.01;

/// A curve of any shape is believed over the library when it is so much more credible, and the library's best explains less than this
/// share of what the curve does: a shape that is a little off is no new effect.
const CURVE_ODDS: f64 = 20.0;
const CURVE_IS_NEW: f64 = 0.85;

/// Findings looked at closely.
const SHORTLIST: usize = 8;

/// What a diagnosis comes to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// What remains is noise.
    NothingLeft,
    /// The credible set names one effect.
    Identified,
    /// The set names several that these data cannot separate.
    Indistinguishable,
    /// Something is left, and no effect of the catalogue explains it.
    Unexplained,
}

impl Verdict {
    /// As in files.
    pub fn name(self) -> &'static str {
        match self {
            Verdict::NothingLeft => "nothing_left",
            Verdict::Identified => "identified",
            Verdict::Indistinguishable => "indistinguishable",
            Verdict::Unexplained => "unexplained",
        }
    }
}

/// A number of an effect as it would be fitted now, held to an ordinary size.
#[derive(Debug, Clone, PartialEq)]
pub struct FoundParameter {
    /// Name within its effect.
    pub name: String,
    /// Estimate, SI.
    pub value: f64,
    /// One-sigma, SI.
    pub sigma: f64,
    /// Unit to show it in.
    pub unit: Unit,
}

/// An effect that may be missing.
#[derive(Debug, Clone, PartialEq)]
pub struct Finding {
    /// The effect, its evidence and its visible share.
    pub hypothesis: Hypothesis,
    /// Probability that this is what is missing, that nothing is included in the count.
    pub probability: f64,
    /// Chance that noise alone explains so much with any of the effects tried (F test, Bonferroni).
    pub p_family: f64,
    /// Change of the Bayesian information criterion: positive speaks for the effect.
    pub delta_bic: f64,
    /// Share of the blocked cross-validated rms that it takes away.
    pub cv_gain: f64,
    /// Effects that explain the same in these data.
    pub rivals: Vec<String>,
    /// Its numbers.
    pub parameters: Vec<FoundParameter>,
}

/// How much an effect contributes when all are fitted at once.
#[derive(Debug, Clone, PartialEq)]
pub struct Contribution {
    /// The effect.
    pub effect: String,
    /// Share of the squares beyond noise.
    pub share: f64,
    /// Its size in plausible sizes, rms over its numbers.
    pub size: f64,
}

/// What may be missing in a model, as the data see it.
#[derive(Debug, Clone)]
pub struct Diagnosis {
    /// Samples fitted.
    pub samples: usize,
    /// Residuals minus unknowns.
    pub dof: usize,
    /// Root mean square of the 3-D residual, m.
    pub rms: f64,
    /// What noise alone would leave of it, m: as stated, or as the best explanation leaves.
    pub noise: f64,
    /// The rest, m.
    pub unexplained: f64,
    /// Whitened squares per degree of freedom.
    pub chi2_per_dof: f64,
    /// Chance of so large a chi-square by the noise as stated; `None` when it is not.
    pub lack_of_fit_p: Option<f64>,
    /// What it comes to.
    pub verdict: Verdict,
    /// The credible set.
    pub set95: Vec<String>,
    /// Probability that nothing is missing beyond the ordinary small stuff.
    pub nothing: f64,
    /// Size of that ordinary small stuff, in plausible sizes.
    pub background: f64,
    /// Best first.
    pub findings: Vec<Finding>,
    /// Largest first.
    pub contributions: Vec<Contribution>,
    /// The whole library fitted to what the model leaves: what the contributions, and predictions, rest on.
    pub relevance: Relevance,
    /// What the library does not hold.
    pub heat_map: HeatMap,
    /// What these data cannot test.
    pub untestable: Vec<Untestable>,
    /// Effects of the fitted model.
    pub fitted: Vec<String>,
}

/// Finds which effect is missing in `model`, as the rows of set `fit` see it.
///
/// # Errors
/// When data and model do not go together, or do not determine the unknowns.
pub fn diagnose(datasets: &[(&str, &Dataset)], model: &Model) -> Result<Diagnosis, IdentifyError> {
    let examination = Examination::new(datasets, model)?;
    diagnose_examined(datasets, &examination)
}

/// The same, of an examination.
///
/// # Errors
/// As [`diagnose`].
pub fn diagnose_examined(datasets: &[(&str, &Dataset)], examination: &Examination) -> Result<Diagnosis, IdentifyError> {
    let remainder = &examination.remainder;
    let background = examination.background()?;
    let (mut all, mut untestable) = hypotheses(examination, &background);
    untestable.splice(0..0, examination.library.untestable.iter().cloned());
    let heat_map = HeatMap::new(examination, &background);
    let relevance = Relevance::beside(examination, &background)?;

    let tests = all.len().max(1);
    let aware: Vec<f64> = all.iter().map(|h| h.ln_evidence_against_background).collect();
    let ln_mean = if aware.is_empty() { f64::NEG_INFINITY } else { ln_mean_exp(&aware) };
    let ln_curve = heat_map.ln_evidence_against_background();
    let ln_whole = ln_sum_exp([0.0, ln_mean].into_iter());
    let nothing = (-ln_whole).exp();
    all.sort_by(|a, b| b.ln_evidence_against_background.total_cmp(&a.ln_evidence_against_background));
    let probability = |h: &Hypothesis| (h.ln_evidence_against_background - (tests as f64).ln() - ln_whole).exp();
    let of_set = |h: &Hypothesis| (h.ln_evidence_against_background - (tests as f64).ln() - ln_mean).exp();
    let mut set = 0;
    let mut mass = 0.0;
    while mass < CREDIBLE && set < all.len() {
        mass += of_set(&all[set]);
        set += 1;
    }

    let findings =
        findings(datasets, examination, &all[..all.len().min(SHORTLIST.max(set.min(2 * SHORTLIST)))], tests, probability)?;

    let fit = &examination.fit;
    let (rms, chi2) = (fit.rms, fit.chi2);
    let best = all.first();
    let explained = best.map_or(0.0, |h| h.explains * remainder.squares);
    let stated = fit.noise_stated;
    let chi2_per_dof = chi2 / fit.dof.max(1) as f64;
    let lack = |squares: f64, dof: usize| ChiSquared::new(dof.max(1) as f64).map_or(f64::NAN, |d| d.sf(squares));
    let lack_of_fit_p = stated.then(|| lack(chi2, fit.dof));
    let lacks = |squares: f64, dof: usize| stated && lack(squares / (STATED_WITHIN * STATED_WITHIN), dof) < LACK_OF_FIT;
    let detected = nothing < NOTHING;
    let coefficients = best.map_or(0, |h| h.coefficients);
    let curve_takes = heat_map.best_cell().map_or(0.0, |c| c.explains * remainder.squares);
    let curve_is_credible = ln_curve > CURVE_ODDS.ln();
    let curve_wins = curve_is_credible && ln_curve - ln_mean > CURVE_ODDS.ln() && explained < CURVE_IS_NEW * curve_takes;
    let verdict = if curve_wins {
        Verdict::Unexplained
    } else if detected {
        if set == 1 { Verdict::Identified } else { Verdict::Indistinguishable }
    } else if lacks(chi2, fit.dof) {
        Verdict::Unexplained
    } else {
        Verdict::NothingLeft
    };
    let left_dof = fit.dof.saturating_sub(coefficients);
    let unit = if stated { 1.0 } else { (chi2 - explained) / left_dof.max(1) as f64 };
    let noise = (rms * rms * (unit * fit.dof as f64 / chi2.max(f64::MIN_POSITIVE)).min(1.0)).sqrt();
    let set95 = if matches!(verdict, Verdict::Identified | Verdict::Indistinguishable) {
        all[..set].iter().map(|h| h.effect.clone()).collect()
    } else {
        Vec::new()
    };
    Ok(Diagnosis {
        samples: examination.problem.sample_count(),
        dof: fit.dof,
        rms,
        noise,
        unexplained: (rms * rms - noise * noise).max(0.0).sqrt(),
        chi2_per_dof,
        lack_of_fit_p,
        verdict,
        set95,
        nothing,
        background: background.size(),
        findings,
        contributions: contributions(examination, &relevance),
        relevance,
        heat_map,
        untestable,
        fitted: examination.model.effects.clone(),
    })
}

fn contributions(examination: &Examination, relevance: &Relevance) -> Vec<Contribution> {
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

/// Looks at the most credible hypotheses side by side.
fn findings(
    datasets: &[(&str, &Dataset)],
    examination: &Examination,
    hypotheses: &[Hypothesis],
    tests: usize,
    probability: impl Fn(&Hypothesis) -> f64 + Sync,
) -> Result<Vec<Finding>, IdentifyError> {
    let candidates = hypotheses.iter().map(|h| Candidate::new(h.in_model.clone()));
    let close = examination.beside(datasets, candidates.collect())?;
    let remainder = &close.remainder;
    let unit = remainder.unit();
    let folds = folds(&close.circumstances);
    let before: f64 = cross_validated(&close, &folds, 0..0).iter().sum();
    let best_places: usize = hypotheses.iter().map(|h| h.places).max().unwrap_or(1);
    let finding = |(k, h): (usize, &Hypothesis)| {
        let span = close.spans[k];
        let explained = h.explains * remainder.squares;
        let left = (remainder.squares - explained).max(f64::MIN_POSITIVE);
        let (p, nu) = (h.coefficients as f64, remainder.dof);
        let f = (explained / p) / (left / (nu - p));
        let p_value = FisherSnedecor::new(p.max(1.0), (nu - p).max(1.0)).map_or(1.0, |d| d.sf(f.max(0.0)));
        let after: f64 = cross_validated(&close, &folds, span.range()).iter().sum();
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
            parameters: parameters.collect(),
        }
    };
    Ok(hypotheses.par_iter().enumerate().map(finding).collect())
}

/// A parameter's name without what the effect's id already says.
fn short_name(effect: &str, name: &str) -> String {
    let family = EffectId::new(effect).family();
    [format!("{effect}."), format!("{family}."), format!("{family}:")]
        .iter()
        .find_map(|prefix| name.strip_prefix(prefix.as_str()))
        .unwrap_or(name)
        .to_owned()
}

/// Place of a hypothesis in words.
impl std::fmt::Display for Place {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Place::Order(k) => write!(f, "{k} per turn"),
            Place::Time(t) => write!(f, "after {t} s"),
            Place::Sample(id) => write!(f, "at sample {id}"),
        }
    }
}
