//! Diagnosis of missing effects: the verdict, the findings, and their evidence.

pub mod additions;
pub(crate) mod background;
pub(crate) mod cross_validation;
mod curve_families;
pub mod detectability;
mod diagnose;
pub(crate) mod evidence;
pub(crate) mod exact_alias;
pub(crate) mod examination;
pub(crate) mod explanation;
mod findings;
pub mod folds;
pub mod heat_map;
pub mod hypotheses;
mod judgement;
pub mod library;
pub(crate) mod projection;
pub(crate) mod relevance;
mod scatter;
pub mod shifts;
mod shortlist;
pub mod surfaces;
pub(crate) mod sweep;
mod symptoms;
mod verdict;
mod whiteness;

pub use curve_families::CurveFamily;
pub use diagnose::{diagnose, diagnose_examined};
pub use examination::Examination;
pub(crate) use relevance::Relevance;
pub use scatter::Scatter;
pub use symptoms::Symptom;
pub use verdict::Verdict;

use self::additions::Addition;
use self::heat_map::{Curve, HeatMap};
use self::hypotheses::{Hypothesis, Place};
use self::library::Untestable;
use self::surfaces::Surface;
use crate::residuals::misfit::Abnormal;
use crate::residuals::noise::{Suspect, beyond_noise};
use crate::residuals::noise_floor::NoiseSource;

use crate::effects::registry::Registry;
use crate::effects::{self, EffectId};
use crate::identify::fit::Outcome;
use crate::units::Unit;

/// Estimate of an effect's parameter if it were fitted now, with a prior of ordinary size.
#[derive(Debug, Clone, PartialEq)]
pub struct FoundParameter {
    /// Name within its effect.
    pub name: String,
    /// Estimate, SI.
    pub value: f64,
    /// One-sigma, SI.
    pub sigma: f64,
    /// Unit in which it is shown.
    pub unit: Unit,
}

/// An effect that may be missing.
#[derive(Debug, Clone, PartialEq)]
pub struct Finding {
    /// The effect, its evidence and its visible share.
    pub hypothesis: Hypothesis,
    /// Probability that this effect is the missing one; the case that nothing is missing is included.
    pub probability: f64,
    /// Probability that noise alone makes any of the tested effects explain as much (F test, Bonferroni).
    pub p_family: f64,
    /// Improvement of the Bayesian information criterion: positive values favour the effect.
    pub delta_bic: f64,
    /// Share by which it reduces the blocked cross-validated rms.
    pub cv_gain: f64,
    /// Effects that these data cannot distinguish from it.
    pub rivals: Vec<EffectId>,
    /// Effects, by their ids in a model, that are exactly aliased with it in these data, whatever its size.
    pub exactly_same: Vec<EffectId>,
    /// Estimates of its parameters.
    pub parameters: Vec<FoundParameter>,
    /// Its size in plausible sizes, rms over its parameters, estimated from the data alone.
    pub size: f64,
}

/// One of the effects that together explain the residual.
#[derive(Debug, Clone, PartialEq)]
pub struct Explained {
    /// Id of the effect in a model.
    pub effect: EffectId,
    /// Share of the remaining sum of squares that it explains in the joint fit.
    pub share: f64,
}

/// Contribution of an effect when all candidates are fitted at once.
#[derive(Debug, Clone, PartialEq)]
pub struct Contribution {
    /// The effect.
    pub effect: EffectId,
    /// Share of the sum of squares that all candidates explain beyond noise.
    pub share: f64,
    /// Its size in plausible sizes, rms over its parameters.
    pub size: f64,
}

/// Result of a diagnosis: effects that a model may be missing, according to the data.
#[derive(Debug, Clone)]
pub struct Diagnosis {
    /// Number of fitted samples.
    pub samples: usize,
    /// Number of scalar residuals.
    pub residuals: usize,
    /// Number of residuals minus number of unknowns.
    pub dof: usize,
    /// Root mean square of the 3-D residual, m.
    pub rms: f64,
    /// Part of the rms due to noise, m: the known noise, or if unknown the residual with the best explanation.
    pub noise: f64,
    /// Unexplained part of the rms, m: root of rms² less noise².
    pub unexplained: f64,
    /// Whitened sum of squares per degree of freedom.
    pub chi2_per_dof: f64,
    /// Probability of a larger chi-square under the known noise; `None` if the noise is unknown.
    pub lack_of_fit_p: Option<f64>,
    /// The verdict.
    pub verdict: Verdict,
    /// The verdict without the suspect samples, if there are any.
    pub verdict_without_suspects: Option<Verdict>,
    /// Outcome of the fit; unless it converged, the diagnosis is void.
    pub outcome: Outcome,
    /// The 95 % credible set of effects.
    pub set95: Vec<EffectId>,
    /// Share of the remaining sum of squares that the first finding explains.
    pub explains: Option<f64>,
    /// Whitened sum of squares per degree of freedom with the first finding included; `None` if the noise is unknown.
    pub chi2_per_dof_with_it: Option<f64>,
    /// Up to three effects that together explain the residual, the largest first.
    pub together: Vec<Explained>,
    /// Share of the remaining sum of squares that they explain.
    pub together_explain: f64,
    /// Parameters of the links far from what arms of its kind show.
    pub abnormal: Vec<Abnormal>,
    /// What the residual follows if the rows, of which no time is known, stand in the order in which they were measured.
    pub by_row_order: Option<Finding>,
    /// Effects that would explain much, but only at an implausible size: id, and size in plausible sizes.
    pub unbelievable: Vec<(EffectId, f64)>,
    /// Family of the catalogue to which the best curve of any shape belongs.
    pub curve_family: Option<CurveFamily>,
    /// Scatter of the data.
    pub scatter: Scatter,
    /// Probability that nothing is missing beyond the background.
    pub nothing: f64,
    /// Size of the background, in plausible sizes.
    pub background: f64,
    /// Findings, best first.
    pub findings: Vec<Finding>,
    /// Contributions, largest first.
    pub contributions: Vec<Contribution>,
    /// Fit of the whole library to the residual of the model; contributions and predictions are based on it.
    pub relevance: Relevance,
    /// Joint errors of any shape, beyond the library.
    pub heat_map: HeatMap,
    /// The joint error that follows two variables at once, if one is credible.
    pub surface: Option<Surface>,
    /// Probability that noise shows as much order as the residual; `None` if the verdict does not depend on it.
    pub whiteness_p: Option<f64>,
    /// Effects that these data cannot test.
    pub untestable: Vec<Untestable>,
    /// Effects of the fitted model.
    pub fitted: Vec<String>,
    /// The families to which all these effects belong.
    pub registry: Registry,
    /// True if the masses of the links are guessed, so that loads are known by their proportions only.
    pub masses_guessed: bool,
}

/// Odds against the background beyond which a single sample disagrees with all others.
const OUTLIER_ODDS: f64 = 20.0;

/// Number of findings, and of contributions, that are offered.
const TRIED: usize = 4;

impl Diagnosis {
    /// The verdict on the data without the suspect samples, or on all of them where none is suspect.
    #[must_use]
    pub fn verdict_of_the_rest(&self) -> Verdict {
        self.verdict_without_suspects.unwrap_or(self.verdict)
    }

    /// Withdraws a verdict that names no effect, for data that do not fit their robot and were accepted by force: that they do not
    /// fit is why their residual is neither noise nor what a robot beyond the model leaves.
    pub fn doubt(&mut self) {
        if !self.verdict_of_the_rest().names_effects() {
            (self.verdict, self.verdict_without_suspects) = (Verdict::DataDoNotFit, None);
        }
    }

    /// How many times the stated noise is left, where that is more than any noise that somebody stated wrongly.
    pub fn beyond_noise(&self) -> Option<f64> {
        beyond_noise(self.chi2_per_dof).filter(|_| self.scatter.noise.source == NoiseSource::Stated)
    }

    /// True if the residuals are fewer than two for each unknown: an effect that the model lacks would hardly show.
    pub fn is_thin(&self) -> bool {
        2 * self.dof < self.residuals
    }

    /// True if the residuals are smaller than the stated noise allows: it is stated too large, and hides what is smaller.
    pub fn noise_is_overstated(&self) -> bool {
        self.scatter.noise.is_overstated(self.lack_of_fit_p)
    }

    /// Index of the finding that a single sample disagrees with all others, if there is one.
    pub fn outlier(&self) -> Option<usize> {
        let sticks_out = |f: &Finding| f.is_sample() && f.hypothesis.ln_evidence_against_background > OUTLIER_ODDS.ln();
        self.findings.iter().position(sticks_out)
    }

    /// The shapes of a joint's error that are credible, the most credible first: those that the model has already are left out.
    pub fn shapes(&self) -> Vec<Addition> {
        let credible =
            |curve: &&Curve| self.heat_map.credible().iter().any(|c| (c.joint, c.variable) == (curve.joint, curve.variable));
        let curve = self.heat_map.curve.as_ref().filter(credible).map(Addition::from);
        let surface = self.surface.as_ref().map(Addition::from);
        let mut shapes: Vec<Addition> = match self.surface_wins() {
            true => surface.into_iter().chain(curve).collect(),
            false => curve.into_iter().chain(surface).collect(),
        };
        shapes.retain(|shape| !self.fitted.iter().any(|id| shape.name == *id));
        shapes
    }

    /// The shape that is the answer where no effect of the catalogue explains the residual.
    pub fn shape(&self) -> Option<Addition> {
        self.shapes().into_iter().next().filter(|_| self.verdict_of_the_rest() == Verdict::Unexplained)
    }

    /// True if the error of a joint follows two variables at once rather than one.
    pub fn surface_wins(&self) -> bool {
        let ln_curve = self.heat_map.ln_evidence_against_background();
        self.surface.as_ref().is_some_and(|s| s.ln_evidence_against_background > ln_curve)
    }

    /// The effects that may be added next, the first to be tried first: what is noticed is offered. A verdict that names effects
    /// puts them before the shapes; without one, shapes come first, then the largest contributions.
    pub fn additions(&self) -> Vec<Addition> {
        let found = self.findings.iter().map(|f| Addition::from(f.hypothesis.in_model.clone())).take(TRIED);
        let mut all: Vec<Addition> = if self.verdict == Verdict::Unexplained {
            let contributing = self.contributions.iter().take(TRIED).map(|c| Addition::from(c.effect.clone()));
            self.shapes().into_iter().chain(contributing).chain(found).collect()
        } else {
            found.chain(self.shapes()).collect()
        };
        let mut seen = std::collections::BTreeSet::new();
        all.retain(|addition| seen.insert(addition.name.clone()));
        all
    }

    /// The effects that exclude all suspect samples.
    pub fn without_suspects(&self) -> Vec<EffectId> {
        all_aside(&self.scatter.suspects)
    }

    /// True if the diagnosis advises to exclude a sample: as a suspect, as the first finding, or as a missing effect
    /// of the credible set.
    pub fn advises_to_set_aside(&self, sample: &str) -> bool {
        let is_it = |f: &Finding| f.is_sample() && f.hypothesis.in_model.rest() == Some(sample);
        let named = |(k, f): (usize, &Finding)| {
            is_it(f) && (self.outlier() == Some(k) && k == 0 || self.set95.contains(&f.hypothesis.effect))
        };
        self.scatter.suspects.iter().any(|s| s.sample == sample) || self.findings.iter().enumerate().any(named)
    }
}

impl Finding {
    /// True if the finding is a single sample that disagrees with the others.
    pub fn is_sample(&self) -> bool {
        self.hypothesis.effect.family() == EffectId::OUTLIER
    }
}

/// The effects that exclude these samples.
fn all_aside(suspects: &[Suspect]) -> Vec<EffectId> {
    suspects.iter().map(|s| effects::catalogue::setting_aside(&s.sample).into()).collect()
}

/// Formats the place of a hypothesis for people.
impl std::fmt::Display for Place {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Place::Order(k) => write!(f, "{k} per turn"),
            Place::Time(t) => write!(f, "after {t} s"),
            Place::Sample(id) => write!(f, "at sample {id}"),
        }
    }
}
