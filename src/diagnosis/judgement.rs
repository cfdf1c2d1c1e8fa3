//! Judgement of the evidence: the verdict of a diagnosis.

use super::CurveFamily;
use super::Examination;
use super::Relevance;
use super::Verdict;
use super::background::Background;
use super::evidence::{ln_mean_exp, ln_sum_exp};
use super::explanation::{Explanation, in_company};
use super::findings::{contributions, findings};
use super::heat_map::HeatMap;
use super::hypotheses::{Hypothesis, hypotheses};
use super::library::Untestable;
use super::shortlist::{Shortlist, credible};
use super::surfaces::Surface;
use super::whiteness::whiteness;
use super::{Diagnosis, Explained, Finding, Scatter};
use crate::effects::EffectId;
use crate::identify::calibration::IdentifyError;
use crate::identify::fit::FitError;
use crate::measure::dataset::NamedDataset;
use crate::residuals::misfit::abnormal;
use crate::residuals::noise::beyond_noise;
use crate::residuals::noise_floor::{NoiseSource, chi2_chance};
use crate::residuals::{noise_left, unexplained};

/// An effect is missing if the probability that none is missing is below this; noise alone causes that in less than one
/// case of a hundred (decision 0012).
const NOTHING: f64 = 0.05;

/// Level at which the residual contradicts the noise.
const LACK_OF_FIT: f64 = 1e-3;

/// Level at which a residual shows order, so that it is not called noise: noise does so in one case of a hundred.
const DISORDER: f64 = 0.01;

/// Odds against the background, and against the library, from which a curve of any shape is preferred to the library.
const CURVE_ODDS: f64 = 20.0;
/// Share of what the curve explains that the most credible effect must not reach for the curve to be preferred: a slightly
/// different shape is not a new effect.
const CURVE_IS_NEW: f64 = 0.85;

/// An effect is all that is missing if the whitened sum of squares per degree of freedom, with the effect included, is at most
/// this (dimensionless).
const ORDINARY_CHI2: f64 = 1.5;
/// The same if the noise is unknown: size of the background, in plausible sizes.
const ORDINARY_SIZE: f64 = 0.8;

/// An effect that is not significant above the background is named if it explains this share of the remaining sum of squares.
const MAIN_SHARE: f64 = 0.5;

/// The background is present if the data are this many times likelier with it.
const BACKGROUND_ODDS: f64 = 20.0;

/// Times that a shortlist is drawn up again without what cannot be.
const SHORTLISTS: usize = 4;

/// Evidence from the data, before it is judged.
struct Evidence<'a> {
    datasets: &'a [NamedDataset<'a>],
    examination: &'a Examination,
    background: Background,
    heat_map: HeatMap,
    surface: Option<Surface>,
    /// Computed where a verdict depends on it.
    whiteness_p: Option<f64>,
    curve_family: Option<CurveFamily>,
    relevance: Relevance,
    scatter: Scatter,
    untestable: Vec<Untestable>,
    /// Number of hypotheses tested, those of implausible size included.
    tests: usize,
    /// Hypotheses without those of implausible size on the first shortlist, the most credible first.
    hypotheses: Vec<Hypothesis>,
    /// Number of them in the credible set.
    set: usize,
    list: Shortlist,
    unbelievable: Vec<(EffectId, f64)>,
    together: Explanation,
    /// Probability of each of the list beside the others of the joint explanation, if that has several.
    in_company: Option<Vec<f64>>,
    /// Logarithm of the mean evidence of a hypothesis against the background, and of the evidence of all cases
    /// together, the background alone included.
    ln_mean: f64,
    ln_whole: f64,
}

impl<'a> Evidence<'a> {
    fn new(datasets: &'a [NamedDataset<'a>], examination: &'a Examination) -> Result<Self, IdentifyError> {
        let background = Background::new(examination)?;
        let (mut all, mut untestable) = hypotheses(examination, &background);
        untestable.splice(0..0, examination.library.untestable.iter().cloned());
        let heat_map = HeatMap::new(examination, &background)?;
        let surface = Surface::best(examination, &background)?;
        let relevance = Relevance::beside(examination, &background)?;
        let tests = all.len().max(1);
        all.sort_by(|a, b| b.ln_evidence_against_background.total_cmp(&a.ln_evidence_against_background));
        let mut list = Shortlist::of(datasets, examination, &all)?;
        let (mut unbelievable, mut with_impossible) = (Vec::new(), None);
        for _ in 0..SHORTLISTS {
            if list.unbelievable().next().is_none() {
                break;
            }
            unbelievable.extend(list.surely_unbelievable(datasets, tests)?);
            if with_impossible.is_none() && list.impossible().next().is_some() {
                let is_too_large = |h: &&Hypothesis| list.too_large().any(|beyond| beyond.in_model == h.in_model);
                let rest = all.iter().filter(|h| !is_too_large(h)).cloned().collect();
                with_impossible = Some((rest, unbelievable.clone()));
            }
            all.retain(|h| !list.unbelievable().any(|(_, beyond)| beyond.in_model == h.in_model));
            list = Shortlist::of(datasets, examination, &all)?;
        }
        // Where nothing else is credible, an impossible value is a symptom, and its effect the best name for it.
        let is_credible = all.first().is_some_and(|h| h.ln_evidence_against_background > CURVE_ODDS.ln());
        if let Some(with_impossible) = with_impossible.filter(|_| !is_credible) {
            (all, unbelievable) = with_impossible;
            list = Shortlist::of(datasets, examination, &all)?;
        }
        let together = Explanation::of(&list.close, &list.believable, tests)?;
        let aware = all.iter().map(|h| h.ln_evidence_against_background);
        let ln_mean = if all.is_empty() { f64::NEG_INFINITY } else { ln_sum_exp(aware) - (tests as f64).ln() };
        Ok(Evidence {
            datasets,
            examination,
            background,
            curve_family: heat_map.curve.as_ref().and_then(|curve| CurveFamily::of(curve, &examination.model.registry)),
            heat_map,
            surface,
            whiteness_p: None,
            relevance,
            scatter: Scatter::of(datasets, examination),
            untestable,
            tests,
            set: credible(&all),
            hypotheses: all,
            in_company: in_company(&list.close, &together, &list.believable, tests),
            together,
            list,
            unbelievable,
            ln_mean,
            ln_whole: ln_sum_exp([0.0, ln_mean].into_iter()),
        })
    }

    /// The most credible hypothesis.
    fn best(&self) -> Option<&Hypothesis> {
        self.hypotheses.first()
    }

    /// The effect that explains most in the joint explanation.
    fn main(&self) -> Option<&Hypothesis> {
        self.together.members.first().map(|&k| &self.list.hypotheses[k])
    }

    /// What is named first where no effect alone leaves noise: the main effect of the joint explanation, unless `best`, which explains
    /// most alone, is more probable beside the others. What is far less probable than others is not named before them.
    fn first_of_several<'h>(&'h self, best: &'h Hypothesis) -> &'h Hypothesis {
        let is_credible = |main: &Hypothesis| match &self.in_company {
            Some(_) => self.probability(main) >= self.probability(best),
            None => self.hypotheses[..self.set].iter().any(|h| h.in_model == main.in_model),
        };
        self.main().filter(|main| is_credible(main)).unwrap_or(best)
    }

    /// Probability that nothing is missing beyond the background.
    fn nothing(&self) -> f64 {
        (-self.ln_whole).exp()
    }

    /// Probability that this effect is a missing one: among all those tested and the case that nothing is missing; or, where no
    /// effect alone leaves noise, beside the others of the joint explanation.
    fn probability(&self, h: &Hypothesis) -> f64 {
        let in_company = self.in_company.as_ref().filter(|_| self.best().is_some_and(|best| !self.is_all(best)));
        if let Some(in_company) = in_company {
            let place = self.list.hypotheses.iter().position(|listed| listed.in_model == h.in_model);
            return place.and_then(|k| in_company.get(k)).copied().unwrap_or(0.0);
        }
        (h.ln_evidence_against_background - (self.tests as f64).ln() - self.ln_whole).exp()
    }

    /// True if the residual contradicts the noise, whether stated or known from replicates.
    fn lack_of_fit(&self) -> bool {
        self.scatter.lack_of_fit_p.is_some_and(|p| p < LACK_OF_FIT)
    }

    /// The surface, if it is more credible than every curve.
    fn surface_wins(&self) -> Option<&Surface> {
        let ln_curve = self.heat_map.ln_evidence_against_background();
        self.surface.as_ref().filter(|s| s.ln_evidence_against_background > ln_curve)
    }

    /// True if a shape, a curve or a surface, is preferred to the library.
    fn shape_wins(&self) -> bool {
        let curve_takes = || self.heat_map.best_cell().map_or(0.0, |c| c.explains);
        let (ln_shape, takes) = match self.surface_wins() {
            Some(surface) => (surface.ln_evidence_against_background, surface.explains),
            None => (self.heat_map.ln_evidence_against_background(), curve_takes()),
        };
        ln_shape > CURVE_ODDS.ln()
            && ln_shape - self.ln_mean > CURVE_ODDS.ln()
            && self.best().map_or(0.0, |h| h.explains) < CURVE_IS_NEW * takes
    }

    /// True if an effect leaves no more than noise or, if the noise is unknown, if the background is ordinary.
    fn is_all(&self, h: &Hypothesis) -> bool {
        let explained = h.explains * self.examination.remainder.squares;
        match self.examination.chi2_per_dof_with(explained, h.coefficients) {
            Some(chi2) => chi2 <= ORDINARY_CHI2,
            None => self.background.size() <= ORDINARY_SIZE,
        }
    }

    fn is_main(&self, h: &Hypothesis) -> bool {
        h.explains >= MAIN_SHARE
    }

    /// The verdict, and the effect to be named first.
    fn verdict(&self) -> (Verdict, Option<&Hypothesis>) {
        let main = self.main().filter(|h| self.is_main(h));
        if self.shape_wins() {
            let family = self.curve_family.as_ref().filter(|_| self.surface_wins().is_none());
            let family = family.and_then(|f| self.list.named(&f.effect));
            return match family.or(main) {
                Some(first) => (Verdict::Partly, Some(first)),
                None => (Verdict::Unexplained, self.best()),
            };
        }
        if self.nothing() < NOTHING
            && let Some(best) = self.best()
        {
            return match (self.is_all(best), self.set) {
                (true, 1) => (Verdict::Identified, Some(best)),
                (true, _) => (Verdict::Indistinguishable, Some(best)),
                (false, _) => (Verdict::Partly, Some(self.first_of_several(best))),
            };
        }
        if !self.lack_of_fit() && (self.scatter.lack_of_fit_p.is_some() || self.is_white()) {
            return (Verdict::NothingLeft, self.best());
        }
        match main {
            // Replicates know the noise: what exceeds it is not noise.
            _ if !self.is_structured() && self.noise_is_only_stated() && self.is_white() && self.may_be_noise() => {
                (Verdict::NoiseLargerThanStated, self.best())
            }
            Some(main) => (Verdict::Partly, Some(main)),
            None => (Verdict::Unexplained, self.best()),
        }
    }

    /// True if the remainder looks like errors of a robot rather than noise.
    fn is_structured(&self) -> bool {
        let [none, sizes @ ..] = &self.background.ln_evidence[..] else { return false };
        ln_mean_exp(sizes) - none > BACKGROUND_ODDS.ln() || self.main().is_some()
    }

    /// True if the remainder is no larger than a noise that somebody stated wrongly.
    fn may_be_noise(&self) -> bool {
        let fit = &self.examination.fit;
        beyond_noise(fit.chi2 / fit.dof.max(1) as f64).is_none()
    }

    fn noise_is_only_stated(&self) -> bool {
        self.scatter.noise.source == NoiseSource::Stated
    }

    /// True if the residual shows no order: only then is it noise.
    fn is_white(&self) -> bool {
        self.whiteness_p.is_none_or(|p| p >= DISORDER)
    }

    /// Effects of the credible set, including the one to be named first; empty if the verdict names no effects.
    fn set95(&self, verdict: Verdict, first: Option<&Hypothesis>) -> Vec<EffectId> {
        let mut set95: Vec<EffectId> = Vec::new();
        if verdict.names_effects() {
            set95.extend(self.hypotheses[..self.set].iter().map(|h| h.effect.clone()));
            if let Some(first) = first.filter(|f| !set95.contains(&f.effect)) {
                set95.insert(0, first.effect.clone());
            }
        }
        set95
    }

    /// Part of the rms due to noise, m; if the noise is unknown, the part that remains once `coefficients` parameters
    /// have explained `explained` of the sum of squares.
    fn noise(&self, explained: f64, coefficients: usize) -> f64 {
        let (examination, fit) = (self.examination, &self.examination.fit);
        let unit = self.scatter.unit().unwrap_or_else(|| {
            let share = 1.0 - explained / examination.remainder.squares;
            fit.chi2 * share / fit.dof.saturating_sub(coefficients).max(1) as f64
        });
        // Whitened squares weight each sample by its own noise, so the result could exceed the unweighted rms.
        let noise = (examination.mean_variance() * unit).sqrt();
        noise_left(noise, fit.dof as f64, examination.problem.row_count()).min(fit.rms)
    }

    /// Effects of the joint explanation with their shares, and the share that they explain together.
    fn explained_together(&self) -> (Vec<Explained>, f64) {
        let share = |squares: f64| (squares / self.examination.remainder.squares).clamp(0.0, 1.0);
        let name = |k: usize| self.list.hypotheses[k].in_model.clone();
        let members = self.together.members.iter().zip(&self.together.takes);
        let explained = members.map(|(&k, &takes)| Explained { effect: name(k), share: share(takes) });
        (explained.collect(), share(self.together.together))
    }

    /// Findings for the shortlist, with the one to be named first at the front.
    fn findings(&self, first: Option<&Hypothesis>) -> Result<Vec<Finding>, FitError> {
        let probability = |h: &Hypothesis| self.probability(h);
        let mut findings = findings(self.datasets, &self.list.close, &self.list.hypotheses, self.tests, probability)?;
        put_first(&mut findings, first);
        Ok(findings)
    }

    /// The diagnosis with all samples, suspects included.
    fn diagnosis(mut self) -> Result<Diagnosis, FitError> {
        let (examination, fit) = (self.examination, &self.examination.fit);
        if self.examination.fit.dof > 0 && (self.lack_of_fit() || self.scatter.lack_of_fit_p.is_none()) {
            self.whiteness_p = whiteness(examination, &self.background);
        }
        let (verdict, first) = self.verdict();
        let first = first.cloned();
        if verdict == Verdict::NoiseLargerThanStated {
            let larger = self.scatter.larger_than_stated.or_else(|| white(examination, &self.relevance));
            self.scatter.larger_than_stated = larger;
        }
        let squares = examination.remainder.squares;
        let (explained, coefficients) = first.as_ref().map_or((0.0, 0), |h| (h.explains * squares, h.coefficients));
        let noise = self.noise(explained, coefficients);
        let relative = self.scatter.noise.level.map_or(1.0, |l| l.relative);
        let (together, together_explain) = self.explained_together();
        Ok(Diagnosis {
            samples: examination.problem.sample_count(),
            residuals: examination.problem.row_count(),
            dof: fit.dof,
            rms: fit.rms,
            noise,
            unexplained: unexplained(fit.rms, noise),
            chi2_per_dof: fit.chi2 / fit.dof.max(1) as f64 / relative.powi(2),
            lack_of_fit_p: self.scatter.lack_of_fit_p,
            verdict,
            verdict_without_suspects: None,
            outcome: fit.outcome,
            set95: self.set95(verdict, first.as_ref()),
            explains: first.as_ref().map(|h| h.explains),
            chi2_per_dof_with_it: examination.chi2_per_dof_with(explained, coefficients),
            together,
            together_explain,
            nothing: self.nothing(),
            background: self.background.size(),
            findings: self.findings(first.as_ref())?,
            contributions: contributions(examination, &self.relevance),
            fitted: examination.model.ids(),
            registry: examination.model.registry.clone(),
            masses_guessed: self.datasets.iter().any(|d| d.dataset.robot.masses_guessed),
            abnormal: abnormal(&examination.calibration(self.datasets)),
            by_row_order: None,
            unbelievable: self.unbelievable,
            curve_family: self.curve_family,
            scatter: self.scatter,
            relevance: self.relevance,
            heat_map: self.heat_map,
            surface: self.surface,
            whiteness_p: self.whiteness_p,
            untestable: self.untestable,
        })
    }
}

/// Diagnosis of an examination, without excluding any suspects.
pub(crate) fn judged(datasets: &[NamedDataset<'_>], examination: &Examination) -> Result<Diagnosis, IdentifyError> {
    Ok(Evidence::new(datasets, examination)?.diagnosis()?)
}

/// Moves the finding to be named first to the front.
fn put_first(findings: &mut [Finding], first: Option<&Hypothesis>) {
    if let Some(place) = first.and_then(|h| findings.iter().position(|f| f.hypothesis.in_model == h.in_model)) {
        findings[..=place].rotate_right(1);
    }
}

/// Factor by which the part of the remainder that the library does not explain exceeds the stated noise; `None` unless
/// significant at 1e-3.
fn white(examination: &Examination, relevance: &Relevance) -> Option<f64> {
    let product = &examination.gram * &relevance.root;
    let effective = product.component_mul(&relevance.root).sum() / relevance.noise.max(f64::MIN_POSITIVE);
    let dof = (examination.remainder.dof - effective).max(1.0);
    let p = chi2_chance(relevance.noise * dof, dof).unwrap_or(1.0);
    (p < LACK_OF_FIT && relevance.noise > 1.0).then(|| relevance.noise.sqrt())
}
