//! Steps in time: the session in which something moved once, the samples between which it moved, and a credible
//! interval.

use std::borrow::Cow;
use std::collections::BTreeMap;

use nalgebra::{DMatrix, Vector6};
use rayon::prelude::*;

use super::hypothesis::{Hypothesis, Moment, Place};
use super::trial::{Trial, TriedPlace, plausible};
use crate::diagnosis::Examination;
use crate::diagnosis::background::Background;
use crate::diagnosis::evidence::ln_sum_exp;
use crate::diagnosis::library::Untestable;
use crate::diagnosis::sweep;
use crate::diagnosis::sweep::Sweep;
use crate::effects::EffectId;
use crate::effects::facts::{Follows, Offered};
use crate::effects::family::{Family, Origin, Scan};
use crate::identify::problem::{SampleContext, Use};
use crate::measure::dataset::{Measured, NamedDataset, Sample};

/// Largest number of gaps between samples that are tried at once. Of more gaps, this many are tried at even spacing,
/// then again between the neighbours of the best one.
const TRIED_AT_ONCE: usize = 128;

/// Probability of the credible interval of the moment.
const CREDIBLE: f64 = 0.95;

/// A gap between two samples of one session, in order of time, in which a step may have occurred.
struct Gap {
    setup: usize,
    /// Samples before and after the gap.
    samples: [usize; 2],
    /// Assumed time of the step, s.
    moment: f64,
}

/// Hypotheses of all steps that these data can show; as untestable effects if the samples have no time.
pub(super) fn steps(examination: &Examination, background: &Background) -> (Vec<Hypothesis>, Vec<Untestable>) {
    let ids = ids(examination);
    if let Some(needs) = lacking(examination) {
        return (Vec::new(), ids.into_iter().map(|effect| Untestable { effect: effect.into(), needs }).collect());
    }
    (ids.par_iter().filter_map(|id| step(examination, background, id)).collect(), Vec::new())
}

/// Name of the data that are missing to find a moment.
pub(super) fn lacking(examination: &Examination) -> Option<&'static str> {
    examination.contexts.iter().any(|c| c.time_s.is_none()).then_some("column time_s")
}

/// Ids without their moments: those of the base, the tool, the joints, then all others.
fn ids(examination: &Examination) -> Vec<String> {
    let library = &examination.library;
    let subject = examination.model.subject(examination.problem.robot(), &library.balls);
    let shown = |f: &&Family| match f.offered {
        Offered::BesideOtherTargets => library.other_targets,
        Offered::ByName => false,
        _ => true,
    };
    let rank = |f: &&'static Family| match (f.follows.first(), f.is_of_joint()) {
        (Some(Follows::World), _) => 0,
        (Some(Follows::Tool), _) => 1,
        (_, true) => 2,
        _ => 3,
    };
    let mut families: Vec<&'static Family> =
        examination.model.registry.families().filter(|f| f.scan == Scan::Time).filter(shown).collect();
    families.sort_by_key(rank);
    let ids = families.into_iter().flat_map(|f| f.scanned(&subject, ""));
    ids.map(|id| id.trim_end_matches(':').to_owned()).collect()
}

/// Finds the moment of a step; `None` if there is no gap to try.
pub(super) fn step(examination: &Examination, background: &Background, id: &str) -> Option<Hypothesis> {
    let contexts = &examination.contexts;
    let concerned = concerned(examination, id)?;
    let carriers = carriers(examination, id, &concerned)?;
    let plausible = plausible(examination, &format!("{id}:0"))?;
    let gaps = gaps(contexts, &concerned);
    let mut trials: BTreeMap<usize, Trial> = BTreeMap::new();
    let mut next = spread(0..gaps.len());
    while !next.is_empty() {
        let after = |i: usize, b: usize| {
            let Gap { setup, moment, .. } = gaps[next[b]];
            if contexts[i].setup == setup && contexts[i].time_s > Some(moment) { 1.0 } else { 0.0 }
        };
        let features = DMatrix::from_fn(contexts.len(), next.len(), after);
        let sweep = Sweep::new(examination, background, &carriers, Cow::Owned(features));
        let trial = |(b, &gap): (usize, &usize)| {
            let moment = gaps[gap].moment;
            let place = TriedPlace { place: Some(Place::Time(moment)), in_model: EffectId::new(&format!("{id}:{moment}")) };
            (gap, Trial::new(examination, background, place, &sweep.block(b, 1, plausible)))
        };
        trials.extend(next.iter().enumerate().map(trial));
        next = beside_the_best(&trials, gaps.len());
    }
    hypothesis(examination, id, trials, &gaps)
}

/// For each sample, true if an effect of this id can move it.
fn concerned(examination: &Examination, id: &str) -> Option<Vec<bool>> {
    let family = examination.model.family(id)?;
    let of_ball = family.follows.contains(&Follows::Ball);
    let ball = if of_ball {
        Some(examination.library.balls.iter().position(|b| Some(b.as_str()) == EffectId::new(id).rest())?)
    } else {
        None
    };
    let moved = |c: &SampleContext| match (family.origin, ball) {
        (_, Some(ball)) => c.ball == Some(ball),
        (Origin::Artifact, None) => c.ball.is_some(),
        _ => true,
    };
    Some(examination.contexts.iter().map(moved).collect())
}

/// Columns of what the effect moves: a joint, the tool, or the base relative to the balls.
fn carriers(examination: &Examination, id: &str, concerned: &[bool]) -> Option<Vec<Vec<Vector6<f64>>>> {
    let contexts = &examination.contexts;
    let family = examination.model.family(id)?;
    if family.is_of_joint() {
        return Some(sweep::joint(contexts, family.joint(&EffectId::new(id))?.checked_sub(1)?));
    }
    if family.follows.contains(&Follows::Tool) {
        return Some(sweep::tool(contexts));
    }
    let mut carriers = sweep::base(contexts);
    for carrier in &mut carriers {
        carrier.iter_mut().zip(concerned).filter(|(_, moved)| !**moved).for_each(|(c, _)| *c = Vector6::zeros());
    }
    Some(carriers)
}

/// Gaps between the samples concerned, session by session.
fn gaps(contexts: &[SampleContext], concerned: &[bool]) -> Vec<Gap> {
    let mut sessions: BTreeMap<usize, Vec<(f64, usize)>> = BTreeMap::new();
    for (i, c) in contexts.iter().enumerate().filter(|(i, _)| concerned[*i]) {
        if let Some(time) = c.time_s {
            sessions.entry(c.setup).or_default().push((time, i));
        }
    }
    let of_session = |(setup, mut samples): (usize, Vec<(f64, usize)>)| {
        samples.sort_by(|a, b| a.0.total_cmp(&b.0));
        let pairs = samples.windows(2).filter(|w| w[0].0 < w[1].0);
        pairs.map(|w| Gap { setup, samples: [w[0].1, w[1].1], moment: between(w[0].0, w[1].0) }).collect::<Vec<Gap>>()
    };
    sessions.into_iter().flat_map(of_session).collect()
}

/// A time from `before` on and earlier than `after`, s: the middle, rounded to a tenth, if that lies between them,
/// otherwise `before`.
fn between(before: f64, after: f64) -> f64 {
    let tenth = ((before + after) * 5.0).round() / 10.0;
    if before <= tenth && tenth < after { tenth } else { before }
}

/// Places of a range: all of them, or [`TRIED_AT_ONCE`] at even spacing.
fn spread(range: std::ops::Range<usize>) -> Vec<usize> {
    let (length, count) = (range.len(), range.len().min(TRIED_AT_ONCE));
    (0..count).map(|k| range.start + (2 * k + 1) * length / (2 * count)).collect()
}

/// Places to be tried next: those between the neighbours of the best one so far.
fn beside_the_best(trials: &BTreeMap<usize, Trial>, places: usize) -> Vec<usize> {
    let Some(best) = best(trials) else { return Vec::new() };
    let low = trials.range(..best).next_back().map_or(0, |(k, _)| k + 1);
    let high = trials.range(best + 1..).next().map_or(places, |(k, _)| *k);
    let untried: Vec<usize> = (low..high).filter(|k| *k != best).collect();
    spread(0..untried.len()).into_iter().map(|k| untried[k]).collect()
}

/// Place with the highest evidence against the background.
fn best(trials: &BTreeMap<usize, Trial>) -> Option<usize> {
    trials.iter().max_by(|a, b| a.1.ln_evidence[1].total_cmp(&b.1.ln_evidence[1])).map(|(k, _)| *k)
}

/// Logarithm of the share of all places that each tried place represents.
fn ln_shares(tried: &[usize], places: usize) -> Vec<f64> {
    let edge = |k: usize| match (k.checked_sub(1).map(|k| tried[k]), tried.get(k)) {
        (None, _) => 0.0,
        (_, None) => places as f64,
        (Some(a), Some(b)) => 0.5 * (a + b + 1) as f64,
    };
    (0..tried.len()).map(|k| ((edge(k + 1) - edge(k)) / places as f64).ln()).collect()
}

fn hypothesis(examination: &Examination, id: &str, trials: BTreeMap<usize, Trial>, gaps: &[Gap]) -> Option<Hypothesis> {
    let best = best(&trials)?;
    let tried: Vec<usize> = trials.keys().copied().collect();
    let shares = ln_shares(&tried, gaps.len());
    let weighed = |which: usize| -> Vec<f64> { trials.values().zip(&shares).map(|(t, s)| t.ln_evidence[which] + s).collect() };
    let (plain, aware) = (weighed(0), weighed(1));
    let trial = &trials[&best];
    let moment = moment(examination, gaps, &tried, &aware, best);
    Some(Hypothesis {
        effect: id.into(),
        in_model: trial.place.in_model.clone(),
        place: trial.place.place.clone(),
        ln_evidence: ln_sum_exp(plain.iter().copied()),
        ln_evidence_against_background: ln_sum_exp(aware.iter().copied()),
        explains: trial.explained.0 / examination.remainder.squares,
        coefficients: trial.explained.1,
        visible: trial.visible,
        places: gaps.len(),
        moment: Some(moment),
    })
}

/// The best gap, and the range of gaps about it, in its session, that holds the probability of the credible interval.
fn moment(examination: &Examination, gaps: &[Gap], tried: &[usize], aware: &[f64], best: usize) -> Moment {
    let own: Vec<(usize, f64)> =
        tried.iter().zip(aware).filter(|(k, _)| gaps[**k].setup == gaps[best].setup).map(|(k, ln)| (*k, *ln)).collect();
    let whole = ln_sum_exp(own.iter().map(|(_, ln)| *ln));
    let mut likely = own;
    likely.sort_by(|a, b| b.1.total_cmp(&a.1));
    let (mut mass, mut low, mut high) = (0.0, best, best);
    for (k, ln) in likely {
        if mass >= CREDIBLE {
            break;
        }
        mass += (ln - whole).exp();
        (low, high) = (low.min(k), high.max(k));
    }
    let setups = examination.problem.setups();
    let sample = |k: usize, side: usize| examination.problem.sample_ids()[gaps[k].samples[side]].clone();
    Moment {
        session: (setups.len() > 1).then(|| setups[gaps[best].setup].label.clone()),
        between: [sample(best, 0), sample(best, 1)],
        between_s: gaps[best].samples.map(|i| examination.contexts[i].time_s.unwrap_or(gaps[best].moment)),
        undecided: Vec::new(),
        credible: [sample(low, 0), sample(high, 1)],
    }
}

/// The hypothesis with the held-out rows that it moves or does not, nobody knows: those between the samples of its moment.
pub(crate) fn with_undecided(h: &Hypothesis, examination: &Examination, datasets: &[NamedDataset<'_>]) -> Hypothesis {
    let mut h = h.clone();
    let (Some(moment), Some(family)) = (&mut h.moment, examination.model.family(&h.in_model)) else { return h };
    let setups = examination.problem.setups();
    let Some(setup) = setups.iter().find(|s| moment.session.as_ref().is_none_or(|label| s.label == *label)) else { return h };
    let [of_dataset, of_session] = setup.name();
    let of_ball = family.follows.contains(&Follows::Ball);
    let [before, after] = moment.between_s;
    for NamedDataset { dataset, .. } in datasets.iter().filter(|d| d.name == of_dataset) {
        let concerned = |s: &&Sample| match s.measured {
            Measured::Ball { ball, .. } => !of_ball || dataset.balls.get(ball).map(|b| b.id.as_str()) == h.effect.rest(),
            _ => !of_ball && family.origin != Origin::Artifact,
        };
        let is_between = |s: &&Sample| s.time_s.is_some_and(|t| before < t && t < after);
        let of_setup = |s: &&Sample| s.session.as_deref().unwrap_or_default() == of_session && Use::Validation.takes(s);
        let rows = dataset.samples.iter().filter(of_setup).filter(is_between).filter(concerned);
        moment.undecided.extend(rows.map(|s| s.id.clone()));
    }
    h
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_moment_lies_between_its_samples() {
        assert_eq!(between(10.0, 20.0), 15.0);
        assert_eq!(between(10.01, 10.04), 10.01);
        assert_eq!(between(0.0, 0.1), 0.0);
    }

    #[test]
    fn shares_of_the_places_tried_add_up() {
        for tried in [vec![0, 1, 2, 3], vec![1, 4, 5, 6, 9], vec![7]] {
            let whole: f64 = ln_shares(&tried, 12).into_iter().map(f64::exp).sum();
            assert!((whole - 1.0).abs() < 1e-12, "{tried:?}: {whole}");
        }
        let all = ln_shares(&(0..12).collect::<Vec<_>>(), 12);
        assert!(all.iter().all(|s| (s.exp() - 1.0 / 12.0).abs() < 1e-12));
    }

    #[test]
    fn places_are_spread_evenly() {
        assert_eq!(spread(3..6), [3, 4, 5]);
        let many = spread(0..10_000);
        assert_eq!(many.len(), TRIED_AT_ONCE);
        assert!(many.windows(2).all(|w| (70..90).contains(&(w[1] - w[0]))));
    }
}
