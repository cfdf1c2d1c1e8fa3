//! Notes on an effect named by a diagnosis: its size, the effects aliased with it in the data, and the time of a step.

use calibench::diagnosis::hypotheses::Moment;
use calibench::diagnosis::{Finding, FoundParameter};
use calibench::effects::EffectId;
use calibench::effects::facts::Alias;
use calibench::effects::family::Scan;
use calibench::effects::registry::Registry;
use calibench::selection::ladder::LadderStep;

use super::effect_names::{called, capital, few_of};

/// The measurement that would separate an effect from those exactly aliased with it.
pub(super) fn parted_by(f: &Finding, registry: &Registry) -> Option<String> {
    if f.exactly_same.is_empty() {
        return None;
    }
    let id = &f.hypothesis.in_model;
    let family = registry.family(id)?;
    let ball = match (family.alias, family.scan) {
        (Alias::OnBalls(_), _) => {
            return Some("only a look at either from outside (a level, a dial gauge, a tracker on the floor)".into());
        }
        (_, Scan::Time) => id.rest().and_then(|rest| rest.rsplit_once(':')).map(|(ball, _)| ball),
        _ => id.rest(),
    };
    ball.map(|ball| format!("probing ball {ball} once more"))
}

/// Names the aliased effects, e.g. "... (base_step:9) or ... (artifact_step:9): aliased in these data; ... would separate them".
pub(super) fn same_words(f: &Finding, registry: &Registry) -> Option<String> {
    let parted = parted_by(f, registry)?;
    let all: Vec<String> =
        std::iter::once(&f.hypothesis.in_model).chain(&f.exactly_same).map(|id| called(registry, id)).collect();
    Some(format!("{}: aliased in these data; {parted} would separate them", all.join(" or ")))
}

/// Describes the moment of a step, e.g. "between samples 79 and 80 (95 %: 77 to 82)".
pub(super) fn moment_words(m: &Moment) -> String {
    let [before, after] = &m.between;
    let [low, high] = &m.credible;
    let session = m.session.as_ref().map_or(String::new(), |s| format!(" of session {s}"));
    let undecided = match m.undecided.as_slice() {
        [] => String::new(),
        [one] => format!(", and on which side of it the held-out {one} lies is not known"),
        several => format!(", and on which side of it the held-out {} lie is not known", few_of(several)),
    };
    format!("between samples {before} and {after}{session} (95 %: {low} to {high}){undecided}")
}

/// The effect of a finding in a sentence that says when it was: without the time in its id, which is known no better.
pub(super) fn called_beside_moment(f: &Finding, registry: &Registry) -> String {
    let id = &f.hypothesis.in_model;
    let words = called(registry, id);
    match (&f.hypothesis.moment, id.last_argument()) {
        (Some(_), Some(seconds)) => words.replacen(&format!(" after {seconds} s"), "", 1),
        _ => words,
    }
}

/// The moment of a step with the times between which it was: the time in the id of the step is one in their midst.
pub(super) fn timed_moment_words(m: &Moment) -> String {
    let [before, after] = m.between_s;
    format!("between {before:.1} s and {after:.1} s, {}", moment_words(m))
}

/// The most recent finding, in the diagnoses of earlier steps, of each effect that a step adds.
pub(super) fn found<'a>(added: &'a [EffectId], below: &'a [&LadderStep]) -> impl Iterator<Item = &'a Finding> {
    let named = |ladder_step: &&'a LadderStep, effect: &str| {
        ladder_step.diagnosis.findings.iter().find(|f| f.hypothesis.in_model == effect)
    };
    added.iter().filter_map(move |effect| below.iter().rev().find_map(|ladder_step| named(ladder_step, effect)))
}

/// Notes on the effects `added`, one line each: the time of a step and the effects aliased with it; `below` holds the
/// earlier steps in order.
pub fn added_sentences(added: &[EffectId], below: &[&LadderStep]) -> Vec<String> {
    let Some(last) = below.last() else { return Vec::new() };
    let registry = &last.model.registry;
    let one = |f: &Finding| {
        let when = f
            .hypothesis
            .moment
            .as_ref()
            .map(|m| format!("{}: {}.", capital(&called_beside_moment(f, registry)), timed_moment_words(m)));
        when.into_iter().chain(same_words(f, registry).map(|same| format!("{}.", capital(&same)))).collect::<Vec<String>>()
    };
    found(added, below).flat_map(one).collect()
}

/// The size of a finding with one number, and its sigma, in brackets.
pub(crate) fn size_words(f: &Finding) -> String {
    let [only] = &f.parameters[..] else { return String::new() };
    let [value, sigma] = [only.value, only.sigma].map(|x| only.unit.from_si(x));
    let digits = digits_of(sigma);
    format!(" ({value:.digits$} ± {sigma:.digits$} {})", only.unit.printed())
}

/// Digits after the point of a number with this sigma: as many as show two of the sigma, four at most.
#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // within 0 and 4
pub(crate) fn digits_of(sigma: f64) -> usize {
    (1.0 - sigma.abs().max(1e-4).log10().floor()).clamp(0.0, 4.0) as usize
}

/// At most three fitted numbers of a finding.
pub(crate) fn sizes(f: &Finding) -> String {
    let one = |p: &FoundParameter| {
        format!("{} {:.3} ± {:.3} {}", p.name, p.unit.from_si(p.value), p.unit.from_si(p.sigma), p.unit.printed())
    };
    let shown: Vec<String> = f.parameters.iter().take(3).map(one).collect();
    let more = if f.parameters.len() > 3 { format!(", and {} more", f.parameters.len() - 3) } else { String::new() };
    shown.join(", ") + &more
}
