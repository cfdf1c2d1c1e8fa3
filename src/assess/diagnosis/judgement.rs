//! From evidence to a verdict.

use super::findings::{Freely, contributions, findings};
use super::{Diagnosis, Explained, Finding, Scatter};
use crate::assess::background::Background;
use crate::assess::curve_families::CurveFamily;
use crate::assess::evidence::{ln_mean_exp, ln_sum_exp};
use crate::assess::examination::Examination;
use crate::assess::explanation::Explanation;
use crate::assess::heat_map::HeatMap;
use crate::assess::hypotheses::{Hypothesis, hypotheses};
use crate::assess::library::Candidate;
use crate::assess::noise_floor::chi2_chance;
use crate::assess::relevance::Relevance;
use crate::assess::verdict::Verdict;
use crate::effects::EffectId;
use crate::identify::IdentifyError;
use crate::measure::Dataset;

/// Something is missing when nothing at all is less credible than this; noise alone raises it in less than one case of a hundred.
const NOTHING: f64 = 0.05;

/// Mass of the credible set.
const CREDIBLE: f64 = 0.95;

/// Chance at which chi-square contradicts the noise as stated.
const LACK_OF_FIT: f64 = 1e-3;

/// A curve of any shape is believed over the library when it is so much more credible, and the library's best explains less than this
/// share of what the curve does: a shape that is a little off is no new effect.
const CURVE_ODDS: f64 = 20.0;
const CURVE_IS_NEW: f64 = 0.85;

/// An effect is all that is missing when no more than this is left with it: whitened squares per degree of freedom where the noise is
/// known, else the size of the background, in plausible sizes.
const ORDINARY_CHI2: f64 = 1.5;
const ORDINARY_SIZE: f64 = 0.8;

/// An effect that does not stick out of the background but explains this share of what is left is named.
const MAIN_SHARE: f64 = 0.5;

/// The background is there when the data are so many times likelier with it.
const BACKGROUND_ODDS: f64 = 20.0;

/// An effect of the user's own is not believable beyond so many plausible sizes.
const BELIEVABLE: f64 = 30.0;

/// Findings looked at closely: by evidence against the background, and as many again that explain most.
const SHORTLIST: usize = 8;

/// Whether a candidate is no larger than its family can be; an effect of the user's own, than so many plausible sizes.
fn is_believable(close: &Examination, candidate: usize, effect: &str) -> bool {
    let freely = Freely::of(close, candidate);
    let Some(family) = close.model.family(effect) else { return freely.least_size() <= BELIEVABLE };
    close.spans[candidate].range().enumerate().all(|(i, column)| {
        let column = &close.columns[column];
        let spec = &close.wide.parameters()[column.parameter].spec;
        family.linear_range.holds(spec, freely.least[i] * column.plausible)
    })
}

/// The hypotheses looked at closely, and what they came to.
struct Shortlist {
    close: Examination,
    hypotheses: Vec<Hypothesis>,
    believable: Vec<bool>,
}

impl Shortlist {
    /// Of hypotheses, the most credible first.
    fn of(datasets: &[(&str, &Dataset)], examination: &Examination, all: &[Hypothesis]) -> Result<Self, IdentifyError> {
        let set = credible(all).clamp(SHORTLIST, 2 * SHORTLIST).min(all.len());
        let mut places: Vec<usize> = (0..set).collect();
        let mut plain: Vec<usize> = (0..all.len()).collect();
        plain.sort_by(|&a, &b| all[b].ln_evidence.total_cmp(&all[a].ln_evidence).then(a.cmp(&b)));
        places.extend(plain.into_iter().filter(|k| *k >= set).take(SHORTLIST));
        let hypotheses: Vec<Hypothesis> = places.into_iter().map(|k| all[k].clone()).collect();
        let candidates = hypotheses.iter().map(|h| Candidate::new(h.in_model.clone()));
        let close = examination.beside(datasets, candidates.collect())?;
        let is_sample = |h: &Hypothesis| EffectId::new(&h.effect).family() == "outlier";
        let believable =
            hypotheses.iter().enumerate().map(|(k, h)| is_sample(h) || is_believable(&close, k, &h.effect)).collect();
        Ok(Shortlist { close, hypotheses, believable })
    }

    fn place(&self, effect: &str) -> Option<usize> {
        self.hypotheses.iter().position(|h| h.in_model == effect || h.effect == effect)
    }
}

/// How many of the hypotheses, the most credible first, make up the credible set.
fn credible(all: &[Hypothesis]) -> usize {
    let ln_all = ln_sum_exp(all.iter().map(|h| h.ln_evidence_against_background));
    let (mut set, mut mass) = (0, 0.0);
    while mass < CREDIBLE && set < all.len() {
        mass += (all[set].ln_evidence_against_background - ln_all).exp();
        set += 1;
    }
    set
}

/// What the numbers say, before it is put into a verdict.
struct Evidence<'a> {
    examination: &'a Examination,
    background: &'a Background,
    best: Option<&'a Hypothesis>,
    /// The effect that explains most of a joint explanation.
    main: Option<&'a Hypothesis>,
    set: usize,
    nothing: f64,
    curve_wins: bool,
    family: Option<&'a Hypothesis>,
    lack_of_fit: bool,
}

impl Evidence<'_> {
    /// Whether no more than noise, or what is ordinary, is left with an effect.
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
        let main = self.main.filter(|h| self.is_main(h));
        if self.curve_wins {
            return match self.family.or(main) {
                Some(first) => (Verdict::Partly, Some(first)),
                None => (Verdict::Unexplained, self.best),
            };
        }
        if self.nothing < NOTHING
            && let Some(best) = self.best
        {
            return match (self.is_all(best), self.set) {
                (true, 1) => (Verdict::Identified, Some(best)),
                (true, _) => (Verdict::Indistinguishable, Some(best)),
                (false, _) => (Verdict::Partly, self.main.or(Some(best))),
            };
        }
        if !self.lack_of_fit {
            return (Verdict::NothingLeft, self.best);
        }
        match main {
            _ if !self.is_structured() => (Verdict::NoiseLargerThanStated, self.best),
            Some(main) => (Verdict::Partly, Some(main)),
            None => (Verdict::Unexplained, self.best),
        }
    }

    /// Whether what is left looks like a robot at all, and not like noise.
    fn is_structured(&self) -> bool {
        let [none, sizes @ ..] = &self.background.ln_evidence[..] else { return false };
        ln_mean_exp(sizes) - none > BACKGROUND_ODDS.ln() || self.main.is_some()
    }
}

/// The diagnosis of an examination, all samples taken at their word.
pub(super) fn judged(datasets: &[(&str, &Dataset)], examination: &Examination) -> Result<Diagnosis, IdentifyError> {
    let background = Background::new(examination)?;
    let (mut all, mut untestable) = hypotheses(examination, &background);
    untestable.splice(0..0, examination.library.untestable.iter().cloned());
    let heat_map = HeatMap::new(examination, &background);
    let relevance = Relevance::beside(examination, &background)?;
    let tests = all.len().max(1);
    let by_evidence =
        |a: &Hypothesis, b: &Hypothesis| b.ln_evidence_against_background.total_cmp(&a.ln_evidence_against_background);
    all.sort_by(by_evidence);
    let mut list = Shortlist::of(datasets, examination, &all)?;
    let beyond: Vec<usize> = (0..list.hypotheses.len()).filter(|&k| !list.believable[k]).collect();
    let mut unbelievable = Vec::new();
    if !beyond.is_empty() {
        // Of what the data hardly see any size may come out: only what they surely show is worth a word.
        let surely = findings(datasets, &list.close, &list.hypotheses, tests, |_| 0.0);
        let is_sure = |h: &Hypothesis| surely.iter().any(|f| f.hypothesis.in_model == h.in_model && f.p_family < LACK_OF_FIT);
        let names: Vec<String> = beyond.iter().map(|&k| list.hypotheses[k].in_model.clone()).collect();
        let told = beyond.iter().filter(|&&k| is_sure(&list.hypotheses[k]));
        unbelievable = told.map(|&k| (list.hypotheses[k].in_model.clone(), Freely::of(&list.close, k).size())).collect();
        all.retain(|h| !names.contains(&h.in_model));
        list = Shortlist::of(datasets, examination, &all)?;
    }
    let aware: Vec<f64> = all.iter().map(|h| h.ln_evidence_against_background).collect();
    let ln_mean = if aware.is_empty() { f64::NEG_INFINITY } else { ln_sum_exp(aware.iter().copied()) - (tests as f64).ln() };
    let ln_curve = heat_map.ln_evidence_against_background();
    let ln_whole = ln_sum_exp([0.0, ln_mean].into_iter());
    let probability = |h: &Hypothesis| (h.ln_evidence_against_background - (tests as f64).ln() - ln_whole).exp();
    let set = credible(&all);
    let together = Explanation::of(&list.close, &list.believable, tests);

    let remainder = &examination.remainder;
    let best = all.first();
    let curve_takes = heat_map.best_cell().map_or(0.0, |c| c.explains);
    let curve_wins = ln_curve > CURVE_ODDS.ln()
        && ln_curve - ln_mean > CURVE_ODDS.ln()
        && best.map_or(0.0, |h| h.explains) < CURVE_IS_NEW * curve_takes;
    let curve_family = heat_map.curve.as_ref().and_then(CurveFamily::of);
    let family = curve_family.as_ref().and_then(|f| list.place(&f.effect)).map(|k| &list.hypotheses[k]);
    let mut scatter = Scatter::of(datasets, examination);
    let lack_of_fit_p = scatter.lack_of_fit_p;
    let evidence = Evidence {
        examination,
        background: &background,
        best,
        main: together.members.first().map(|&k| &list.hypotheses[k]),
        set,
        nothing: (-ln_whole).exp(),
        curve_wins,
        family,
        lack_of_fit: lack_of_fit_p.is_some_and(|p| p < LACK_OF_FIT),
    };
    let (verdict, first) = evidence.verdict();
    let first = first.cloned();
    let nothing = evidence.nothing;

    let mut findings = findings(datasets, &list.close, &list.hypotheses, tests, probability);
    put_first(&mut findings, first.as_ref());
    let mut set95: Vec<String> = Vec::new();
    if verdict.names_effects() {
        set95.extend(all[..set].iter().map(|h| h.effect.clone()));
        if let Some(first) = first.as_ref().filter(|f| !set95.contains(&f.effect)) {
            set95.insert(0, first.effect.clone());
        }
    }
    if verdict == Verdict::NoiseLargerThanStated {
        scatter.larger_than_stated = scatter.larger_than_stated.or_else(|| white(examination, &relevance));
    }
    let fit = &examination.fit;
    let (explained, coefficients) = first.as_ref().map_or((0.0, 0), |h| (h.explains * remainder.squares, h.coefficients));
    let unit = scatter.unit().unwrap_or_else(|| {
        let share = 1.0 - explained / remainder.squares;
        fit.chi2 * share / fit.dof.saturating_sub(coefficients).max(1) as f64
    });
    // Samples count by their own noise: what is missing may sit where the noise is large.
    let variance = examination.mean_variance() * unit * fit.dof as f64 / examination.problem.row_count().max(1) as f64;
    let noise = variance.sqrt().min(fit.rms);
    let relative = scatter.noise.level.map_or(1.0, |l| l.relative);
    let share = |squares: f64| (squares / remainder.squares).clamp(0.0, 1.0);
    Ok(Diagnosis {
        samples: examination.problem.sample_count(),
        dof: fit.dof,
        rms: fit.rms,
        noise,
        unexplained: (fit.rms * fit.rms - noise * noise).max(0.0).sqrt(),
        chi2_per_dof: fit.chi2 / fit.dof.max(1) as f64 / relative.powi(2),
        lack_of_fit_p,
        verdict,
        verdict_without_suspects: None,
        outcome: fit.outcome,
        set95,
        explains: first.as_ref().map(|h| h.explains),
        chi2_per_dof_with_it: examination.chi2_per_dof_with(explained, coefficients),
        together: together
            .members
            .iter()
            .zip(&together.takes)
            .map(|(&k, &takes)| Explained { effect: list.hypotheses[k].in_model.clone(), share: share(takes) })
            .collect(),
        together_explain: share(together.together),
        unbelievable,
        curve_family,
        scatter,
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

/// The finding that is named first leads.
fn put_first(findings: &mut [Finding], first: Option<&Hypothesis>) {
    if let Some(place) = first.and_then(|h| findings.iter().position(|f| f.hypothesis.in_model == h.in_model)) {
        findings[..=place].rotate_right(1);
    }
}

/// By what factor the part of the remainder that nothing explains is larger than the noise as stated; `None` where it is not at 1e-3.
fn white(examination: &Examination, relevance: &Relevance) -> Option<f64> {
    let product = &examination.gram * &relevance.root;
    let effective = product.component_mul(&relevance.root).sum() / relevance.noise.max(f64::MIN_POSITIVE);
    let dof = (examination.remainder.dof - effective).max(1.0);
    let p = chi2_chance(relevance.noise * dof, dof).unwrap_or(1.0);
    (p < LACK_OF_FIT && relevance.noise > 1.0).then(|| relevance.noise.sqrt())
}
