//! The recommended next step, in words: one advice on a model, whichever verb gives it.

use calibench::diagnosis::{Diagnosis, Verdict};
use calibench::effects;
use calibench::selection::ladder::{Ladder, RefusedStep};
use calibench::selection::{Advice, ToDo};

use super::effect_names::{all_called, called, each_called};
use super::ladder_sentences::objection_sentence;
use super::recommended::Recommended;

/// Refused effects that are named.
const MOST_REFUSED: usize = 3;

/// The advice in sentences, the first of which begins with `Next:` and names a command where there is one to give; then what was
/// refused before that step. `diagnosis` is that of the model.
#[must_use]
pub fn next_step_sentences(advice: &Advice, diagnosis: &Diagnosis, commands: &Recommended) -> Vec<String> {
    let next = match advice.to_do {
        _ if diagnosis.by_row_order.is_some() => {
            "Next: give the rows their times (column `time_s`; 0, 30, 60 ... will do), and diagnose again.".to_owned()
        }
        ToDo::Unknown => return Vec::new(),
        ToDo::Nothing if diagnosis.is_thin() => "Next: measure more postures; so few cannot show what is missing.".to_owned(),
        ToDo::Nothing if !diagnosis.abnormal.is_empty() => {
            "Next: put right what is abnormal, and measure again; with it as it is nothing is to be added to the model."
                .to_owned()
        }
        ToDo::Nothing => "Next: nothing is to be added; what remains is noise.".to_owned(),
        ToDo::Add => {
            let command = command(advice, diagnosis, commands);
            match advice.effects() {
                [one] if effects::catalogue::set_aside_by(one).is_some() => {
                    format!("Next: `{command}`: {}, which disagrees with all others.", called(&diagnosis.registry, one))
                }
                [one] => {
                    format!(
                        "Next: `{command}`: with {}, postures that were not fitted are predicted better.",
                        called(&diagnosis.registry, one)
                    )
                }
                several => format!(
                    "Next: `{command}` excludes the first of {} samples that disagree with all others; the ladder begins with all of them.",
                    several.len()
                ),
            }
        }
        ToDo::Distinguish => {
            let without = match advice.effects() {
                [] => String::new(),
                effects => format!(
                    " Without them `ladder` would add {}, which may be the wrong one.",
                    all_called(&diagnosis.registry, effects)
                ),
            };
            format!(
                "Next: `{}` names the few measurements that would distinguish them.{without}",
                command(advice, diagnosis, commands)
            )
        }
        ToDo::Choose => format!(
            "Next: `{}` recommends a model of all errors at once: no single effect predicts postures that were not fitted better, such a model does.",
            command(advice, diagnosis, commands)
        ),
        ToDo::Stop => format!(
            "Next: use this model: nothing that was tried predicts postures that were not fitted better. {}",
            commands.more_measurements()
        ),
    };
    // A step that is advised nevertheless, such as the exclusion of a sample that disagrees with all others, is not refused.
    let is_advised = |step: &&RefusedStep| step.effects.iter().all(|effect| advice.effects().contains(effect));
    let refused = advice.refused.iter().filter(|step| !is_advised(step)).take(MOST_REFUSED);
    let refused = refused.map(|step| {
        let why = step.objections.first().map(objection_sentence).unwrap_or_default();
        format!("Not added: {}: {why}.", each_called(&diagnosis.registry, &step.effects))
    });
    std::iter::once(next).chain(refused).collect()
}

/// The command that does it.
pub(super) fn command(advice: &Advice, diagnosis: &Diagnosis, commands: &Recommended) -> String {
    match (advice.to_do, advice.effects()) {
        (ToDo::Add, [one]) => {
            let shape = diagnosis.shapes().into_iter().find(|shape| shape.name == *one);
            commands.add(shape.as_ref().map_or(one, |shape| &shape.id))
        }
        (ToDo::Add, [first, ..]) => commands.add(first),
        (ToDo::Distinguish | ToDo::Stop, _) => commands.verb("plan next"),
        _ => commands.verb("ladder"),
    }
}

/// Question to settle before the steps of a ladder are believed, as [`next_step_sentences`] says before the ladder is run: its
/// first step adds one of several effects that the data cannot distinguish.
#[must_use]
pub fn in_question_sentence(ladder: &Ladder, commands: &Recommended) -> Option<String> {
    let first = &ladder.first().diagnosis;
    let verdict = first.verdict_of_the_rest();
    let step = ladder.steps.get(1).filter(|step| step.added != first.without_suspects())?;
    (verdict == Verdict::Indistinguishable).then(|| {
        format!(
            "Next: `{}` names the few measurements that would distinguish what may be missing; the first step, {}, may be the wrong one.",
            commands.verb("plan next"),
            all_called(&step.model.registry, &step.added)
        )
    })
}
