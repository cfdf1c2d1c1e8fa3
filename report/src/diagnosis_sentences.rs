//! A diagnosis in words: the findings, their meaning and the recommended action.

use super::effect_names::{all_called, called, capital};
use super::figures::{NOISE_LEFT, RESIDUAL, UNEXPLAINED};
use super::finding_notes::{called_beside_moment, same_words, size_words, sizes, timed_moment_words};
use super::gallery::gallery_page;
use super::ladder_sentences::unconverged_sentence;
use super::meaning::{intervention_words, meaning};
use super::misfit::abnormal_sentences;
use super::printout::Sentence;
use super::row_order::{by_row_order, supposed_words};
use super::scatter::{scatter_sentences, suspects_named};
use super::unexplained::{shape_words, unexplained};
use calibench::diagnosis::hypotheses::Place;
use calibench::diagnosis::{Diagnosis, Finding, Verdict};
use calibench::effects;
use calibench::effects::EffectId;
use calibench::effects::facts::Follows;
use calibench::effects::registry::Registry;
use calibench::identify::fit::Outcome;
use calibench::units::MM;

/// Detectability below which an effect is called hidden, as the share of its energy that the fitted model does not absorb.
const HIDDEN: f64 = 0.5;

/// Number of untestable effects listed by name.
const MOST_NAMED: usize = 2;

/// The diagnosis in words: the main effect and how much is still missing; the residual, suspects and noise; the verdict; each
/// named effect with its observation, meaning and action; and finally what these data cannot test.
pub fn sentences(d: &Diagnosis) -> Vec<Sentence> {
    if let Some(warning) = unconverged(d) {
        return vec![Sentence::answer(warning), Sentence::detail(left(d))];
    }
    let mut all: Vec<Sentence> = abnormal_sentences(&d.abnormal).into_iter().map(Sentence::answer).collect();
    all.extend(main(d).map(Sentence::detail));
    all.push(Sentence::detail(left(d)));
    all.extend(suspects(d).map(Sentence::answer));
    all.extend(scatter_sentences(&d.scatter).into_iter().map(Sentence::detail));
    if d.noise_is_overstated() {
        all.push(Sentence::detail(format!(
            "Noise: the residual is smaller than the stated noise allows (chi2/dof {:.2}), so it is stated too large, and what is smaller than it is overlooked. Measure ten targets twice to know it, and correct [noise] of dataset.toml.",
            d.chi2_per_dof
        )));
    }
    if d.verdict != Verdict::SuspectSamples {
        all.extend(outlier(d).map(Sentence::detail));
    }
    all.extend(by_row_order(d).map(Sentence::answer));
    all.push(Sentence::answer(verdict(d)));
    let rest = verdict_explained(d).into_iter().chain(unbelievable(d)).chain(untestable(d));
    all.extend(rest.map(Sentence::detail));
    all
}

/// Warns that no statement about a fit that did not converge is valid.
fn unconverged(d: &Diagnosis) -> Option<String> {
    (d.outcome != Outcome::Converged).then(|| format!("WARNING: {}", unconverged_sentence(d.outcome)))
}

/// The first effect named, suspect samples excluded.
pub(super) fn first(d: &Diagnosis) -> Option<&Finding> {
    let aside = usize::from(d.verdict == Verdict::SuspectSamples && d.findings.first().is_some_and(Finding::is_sample));
    d.findings.get(aside)
}

/// The effect that explains most, its share, and how much is still missing.
fn main(d: &Diagnosis) -> Option<String> {
    let first = first(d).filter(|_| d.verdict_of_the_rest().names_effects())?;
    let share = d.explains?;
    // The share refers to squared residuals in units of the noise; in millimetres the residual cannot fall below the noise.
    let left = (d.rms * (1.0 - share).max(0.0).sqrt()).max(d.noise) / MM;
    let known = d.chi2_per_dof_with_it.map_or(String::new(), |chi2| format!(", chi2/dof {chi2:.2}"));
    let rest = match d.verdict_of_the_rest() {
        Verdict::Partly => format!("{left:.4} mm rms remain with it{known}: more is missing"),
        _ => format!("{left:.4} mm rms remain with it{known}, as expected of noise and the usual model discrepancy"),
    };
    Some(format!(
        "{} explains {:.0} % of the squares that the model leaves; {rest}.",
        capital(&called(&d.registry, &first.hypothesis.in_model)),
        100.0 * share
    ))
}

/// The effects that the data show to be missing in the model, in one sentence or two; `None` if there are none.
#[must_use]
pub fn lacking_sentence(d: &Diagnosis) -> Option<String> {
    if let Some(warning) = unconverged(d) {
        return Some(warning);
    }
    let named = d.findings.iter().filter(|f| d.set95.contains(&f.hypothesis.effect)).map(|f| &f.hypothesis.in_model);
    let lacking = match d.verdict_of_the_rest() {
        Verdict::NothingLeft if d.noise_is_overstated() => {
            Some("The noise is stated too large, and what is smaller than it is overlooked.".into())
        }
        Verdict::NoiseLargerThanStated => Some("What the model leaves is noise, and more of it than stated.".into()),
        Verdict::Unexplained => by_row_order(d).or_else(|| {
            let shape = shape_words(d).map_or(String::new(), |words| format!("; {words}"));
            Some(format!("What the model leaves exceeds the noise, and no effect of the catalogue explains it{shape}."))
        }),
        Verdict::DataDoNotFit => Some("The samples do not fit the robot.".into()),
        Verdict::Indistinguishable => Some(format!(
            "The model lacks one of these, and these samples cannot tell which: {}.",
            all_called(&d.registry, named)
        )),
        Verdict::Identified | Verdict::Partly => {
            let is_warmth = |f: &Finding| {
                let family = d.registry.family(&f.hypothesis.in_model);
                family.is_some_and(|f| f.follows.contains(&Follows::Temperature))
            };
            let warm_up = match first(d).is_some_and(is_warmth) {
                true => " The robot was warming up or cooling down: let it warm up, and measure again.",
                false => "",
            };
            main(d).map(|sentence| sentence + warm_up)
        }
        _ => None,
    };
    let suspects = d.verdict == Verdict::SuspectSamples || d.outlier().is_some();
    let suspects = suspects.then(|| "Single samples disagree with all others.".to_owned());
    let all: Vec<String> = suspects.into_iter().chain(lacking).collect();
    (!all.is_empty()).then(|| all.join(" "))
}

/// The cause of what a model leaves, in one clause: what is abnormal before what is missing.
#[must_use]
pub fn cause_words(d: &Diagnosis) -> String {
    if d.outcome != Outcome::Converged {
        return without_suspects(d, format!("it is not known, as the fit {}", d.outcome.in_words()));
    }
    match abnormal_sentences(&d.abnormal).first() {
        Some(first) => without_suspects(d, first.trim_end_matches('.').to_owned()),
        None => lacking_words(d),
    }
}

/// What holds without the samples that disagree with all others, which come first.
fn without_suspects(d: &Diagnosis, words: String) -> String {
    match d.scatter.suspects.as_slice() {
        [] => words,
        [one] => format!("{} disagrees with all others; without it, {words}", suspects_named(std::slice::from_ref(one))),
        suspects => format!("{} disagree with all others; without them, {words}", suspects_named(suspects)),
    }
}

/// What a model lacks, in one clause, whatever is abnormal.
pub(super) fn lacking_words(d: &Diagnosis) -> String {
    let share =
        |share: Option<f64>| share.map_or(String::new(), |s| format!(" explains {:.0} % of what the model leaves", 100.0 * s));
    let of_first = || first(d).map_or(String::new(), |f| called(&d.registry, &f.hypothesis.in_model) + &size_words(f));
    let lacking = match d.verdict_of_the_rest() {
        Verdict::DataDoNotFit => "the data do not fit the robot".to_owned(),
        Verdict::NothingLeft | Verdict::SuspectSamples if d.is_thin() => "too few samples to find any".to_owned(),
        Verdict::NothingLeft | Verdict::SuspectSamples => "what the model leaves is noise".to_owned(),
        Verdict::NoiseLargerThanStated => "what the model leaves is noise, and more of it than stated".to_owned(),
        Verdict::Identified => format!("{}{}", of_first(), share(d.explains)),
        Verdict::Partly => format!("{}{}; more is missing", of_first(), share(d.explains)),
        Verdict::Indistinguishable => {
            let rivals = named(d).map(|f| &f.hypothesis.in_model);
            format!("one of these, which the data cannot distinguish: {}", all_called(&d.registry, rivals))
        }
        Verdict::Unexplained => supposed_words(d)
            .or_else(|| shape_words(d))
            .unwrap_or_else(|| "none of the effects that are known by name".to_owned()),
        other => other.in_words(),
    };
    without_suspects(d, lacking)
}

/// True if a diagnosis that could have found something finds that nothing is lacking.
#[must_use]
pub fn finds_nothing(d: &Diagnosis) -> bool {
    d.outcome == Outcome::Converged && d.verdict == Verdict::NothingLeft && !d.is_thin() && !d.noise_is_overstated()
}

/// The effects that the diagnosis names.
fn named(d: &Diagnosis) -> impl Iterator<Item = &Finding> {
    d.findings.iter().filter(|f| d.set95.contains(&f.hypothesis.effect))
}

fn verdict(d: &Diagnosis) -> String {
    let word = if d.verdict == Verdict::SuspectSamples { "Without them" } else { "Verdict" };
    match d.verdict_of_the_rest() {
        Verdict::NothingLeft if d.is_thin() => format!(
            "{word}: nothing left, but hardly anything could be found: {} residuals are few for a model of {} unknowns. Measure more postures.",
            d.residuals,
            d.residuals - d.dof
        ),
        Verdict::DataDoNotFit => {
            format!("{word}: data do not fit. What the model leaves is not noise: correct the data, and diagnose again.")
        }
        Verdict::NothingLeft | Verdict::SuspectSamples => format!(
            "{word}: nothing left. What remains is noise; no effect of the catalogue is significant. That does not prove accuracy elsewhere: measure where the robot is to work."
        ),
        Verdict::NoiseLargerThanStated => format!(
            "{word}: noise larger than stated. What remains follows no joint, tool axis, load, time or previous posture{}; state the noise as it is, or measure targets twice to know it.",
            d.scatter.larger_than_stated.map_or(String::new(), |f| format!(" and is {f:.2} times the stated noise"))
        ),
        Verdict::Identified => {
            format!(
                "{word}: identified. Missing in the model: {}.",
                all_called(&d.registry, named(d).map(|f| &f.hypothesis.in_model))
            )
        }
        Verdict::Partly => partly(d, word),
        Verdict::Indistinguishable => format!(
            "{word}: indistinguishable. One of these is missing, and these data cannot tell which: {}.",
            all_called(&d.registry, named(d).map(|f| &f.hypothesis.in_model))
        ),
        Verdict::Unexplained => match supposed_words(d) {
            Some(event) => format!("{word}: unexplained without the times of the rows; {event}."),
            None => format!("{word}: unexplained. A residual remains that no single effect of the catalogue explains."),
        },
        other => format!("{word}: {}.", other.in_words()),
    }
}

/// What led to the verdict, what it means, and what to do.
fn verdict_explained(d: &Diagnosis) -> Vec<String> {
    match d.verdict_of_the_rest() {
        Verdict::NothingLeft | Verdict::DataDoNotFit | Verdict::SuspectSamples | Verdict::NoiseLargerThanStated => Vec::new(),
        Verdict::Unexplained => match &d.by_row_order {
            // What was seen of it is said before the verdict.
            Some(event) => saw_means_do(event, &d.registry).split_off(1),
            None => unexplained(d),
        },
        _ => named(d).flat_map(|f| saw_means_do(f, &d.registry)).collect(),
    }
}

fn partly(d: &Diagnosis, word: &str) -> String {
    let first = first(d).map_or("", |f| f.hypothesis.in_model.whole());
    let together = match &d.together[..] {
        [] | [_] => String::new(),
        several => {
            let each: Vec<String> =
                several.iter().map(|e| format!("{}, {:.0} %", called(&d.registry, &e.effect), 100.0 * e.share)).collect();
            format!(" Together these explain {:.0} %: {}.", 100.0 * d.together_explain, each.join("; "))
        }
    };
    let curve = match &d.curve_family {
        Some(f) if f.effect == first => {
            format!(" The curve of any shape that fits best is {:.0} % {}.", 100.0 * f.share, called(&d.registry, &f.effect))
        }
        _ => String::new(),
    };
    format!("{word}: partly. {} explains a part; more is missing.{together}{curve}", capital(&called(&d.registry, first)))
}

/// Effects that explain much, but only at an implausible size.
fn unbelievable(d: &Diagnosis) -> Option<String> {
    let named: Vec<String> =
        d.unbelievable.iter().map(|(e, size)| format!("{}, {size:.0} plausible sizes", called(&d.registry, e))).collect();
    (!named.is_empty()).then(|| {
        format!(
            "Not believable at this size: {}. Look for a wrong entry, load, sign or unit before an effect.",
            named.join("; ")
        )
    })
}

/// Single samples that disagree with all others.
fn suspects(d: &Diagnosis) -> Option<String> {
    d.scatter.suspects.first()?;
    let (is, it) = if d.scatter.suspects.len() == 1 { ("disagrees", "it") } else { ("disagree", "they") };
    Some(format!(
        "Verdict: suspect samples. {} {is} with all others: look there before anything else; {it} may be a wrong ball, a bad contact, a wrong row. Excluded from all that follows.",
        suspects_named(&d.scatter.suspects)
    ))
}

/// A sample that disagrees with all others: to be examined before anything else if it is the first finding, otherwise a
/// hint.
fn outlier(d: &Diagnosis) -> Option<String> {
    let place = d.outlier()?;
    let f = &d.findings[place];
    let sample = effects::catalogue::set_aside_by(&f.hypothesis.in_model)?;
    Some(if place == 0 {
        format!(
            "Look at sample {sample} before anything else: it disagrees with all others ({}). One bad sample spoils every judgement below; repeat it, or leave it out.",
            sizes(f)
        )
    } else {
        format!(
            "Look at sample {sample}: it disagrees with the others ({}), either alone or because what is missing shows most there.",
            sizes(f)
        )
    })
}

fn left(d: &Diagnosis) -> String {
    let (rms, noise, unexplained) = (d.rms / MM, d.noise / MM, d.unexplained / MM);
    if d.lack_of_fit_p.is_some() {
        format!(
            "{} {rms:.4} mm rms (3-D) on {} samples: {} {noise:.4} mm, {} {unexplained:.4} mm (chi2/dof {:.2} on {}).",
            capital(RESIDUAL.name),
            d.samples,
            NOISE_LEFT.name,
            UNEXPLAINED.name,
            d.chi2_per_dof,
            d.dof
        )
    } else {
        let balance = if d.verdict_of_the_rest().is_noise() {
            String::new()
        } else {
            format!(
                "; with the best explanation {noise:.4} mm would remain, so at least {unexplained:.4} mm are {}",
                UNEXPLAINED.name
            )
        };
        format!(
            "{} {rms:.4} mm rms (3-D) on {} samples{balance}. The data do not state their noise.",
            capital(RESIDUAL.name),
            d.samples
        )
    }
}

/// Effect, size, place and share; the physics; and where to look at the robot, if anywhere.
fn saw_means_do(f: &Finding, registry: &Registry) -> Vec<String> {
    let h = &f.hypothesis;
    let at = match (&h.place, &h.moment) {
        (None | Some(Place::Sample(_) | Place::Order(_)), _) => String::new(),
        (Some(Place::Time(_)), Some(moment)) => format!(", {}", timed_moment_words(moment)),
        (Some(Place::Time(t)), None) => format!(", after {t:.1} s"),
    };
    let hidden = if h.visible < HIDDEN {
        format!(
            "; the fitted model hides {:.1} % of it in its own numbers, so it does more harm elsewhere than it shows here",
            100.0 * (1.0 - h.visible)
        )
    } else {
        String::new()
    };
    let rivals = if f.rivals.is_empty() {
        String::new()
    } else {
        format!("; in these data the same as {}", all_called(registry, &f.rivals))
    };
    let saw = format!(
        "Saw: {}{at}: {}; explains {:.0} % of the residual, probability {:.2}{hidden}{rivals}.",
        called_beside_moment(f, registry),
        sizes(f),
        100.0 * h.explains,
        f.probability
    );
    let meaning = meaning(registry, &h.in_model);
    let page = gallery_page(&h.in_model).map_or(String::new(), |page| format!(" ({page} shows how it looks)"));
    let means = format!("Means: {}{}{page}.", meaning.physics, same_to_the_data(f, registry));
    [saw, means].into_iter().chain(intervention_words(&meaning.intervention)).collect()
}

/// The effects that no data of this kind can separate from this one, and the measurement that would separate them.
fn same_to_the_data(f: &Finding, registry: &Registry) -> String {
    // Ball data cannot separate a displaced ball from a displaced nest.
    let nest = match f.hypothesis.in_model.ball_name() {
        Some(_) => "; these data cannot distinguish an error of the ball from one of its nest",
        None => "",
    };
    format!("{nest}{}", same_words(f, registry).map_or(String::new(), |same| format!("; {same}")))
}

/// Effects that these data cannot test, grouped by the missing measurement.
fn untestable(d: &Diagnosis) -> Vec<String> {
    let is_first = |k: &usize| d.untestable[..*k].iter().all(|earlier| earlier.needs != d.untestable[*k].needs);
    let needs: Vec<&str> = (0..d.untestable.len()).filter(is_first).map(|k| d.untestable[k].needs).collect();
    let of = |need: &&str| {
        let effects: Vec<&EffectId> = d.untestable.iter().filter(|u| u.needs == *need).map(|u| &u.effect).collect();
        let more = effects.len().saturating_sub(MOST_NAMED);
        let named = all_called(&d.registry, effects[..effects.len() - more].iter().copied());
        let more = if more > 0 { format!(" and {more} more") } else { String::new() };
        format!("Not tested: {named}{more}: needs {need}.")
    };
    needs.iter().map(of).collect()
}
