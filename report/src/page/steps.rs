//! The ladder of a page: all of it if requested, otherwise its first step only.

use serde_json::{Value, json};

use super::PageSubject;
use super::page_model::judge;
use crate::documents::{Ladder, LadderStep as StepDocument, joined, to_value};
use crate::{next_step_sentences, objection_sentence};
use calibench::identify::calibration::IdentifyError;
use calibench::selection::hold_out::HoldOut;
use calibench::selection::ladder::{self, LadderStep};
use calibench::selection::{Advice, Objection, ToDo};

/// The ladder as a document; its key `complete` is true if it was run to its end.
///
/// # Errors
/// Those of the ladder.
pub(super) fn ladder(subject: &PageSubject<'_>, first: &LadderStep, ground: HoldOut<'_>) -> Result<Value, IdentifyError> {
    if subject.whole_ladder {
        let mut whole = ladder::ladder(subject.datasets, subject.model, ground)?;
        whole.steps = whole.steps.into_iter().map(|r| judge(r, subject)).collect::<Result<_, _>>()?;
        whole.other = whole.other.map(|r| judge(r, subject)).transpose()?;
        let mut document = to_value(&Ladder::of(&whole));
        document["complete"] = json!(true);
        return Ok(document);
    }
    let judged = Advice::on(subject.datasets, first, ground)?;
    let advice = next_step_sentences(&judged, &first.diagnosis, &subject.commands).join(" ");
    if judged.to_do == ToDo::Nothing {
        return Ok(json!({"rungs": [StepDocument::of(first, &[])], "complete": true, "advice": advice}));
    }
    let command = subject.commands.verb("ladder");
    let complete = judged.to_do == ToDo::Stop;
    let (steps, step) = match judged.step.filter(|_| judged.to_do != ToDo::Choose) {
        Some(next) => {
            let next = judge(*next, subject)?;
            let step = step_json(&next.added.join(" + "), &next.objections(first));
            (vec![StepDocument::of(first, &[]), StepDocument::of(&next, &[first])], step)
        }
        None => {
            let step = judged.refused.first().map_or(Value::Null, |step| step_json(&joined(&step.effects), &step.objections));
            (vec![StepDocument::of(first, &[])], step)
        }
    };
    Ok(json!({"rungs": steps, "complete": complete, "step": step, "command": command, "advice": advice}))
}

fn step_json(effect: &str, objections: &[Objection]) -> Value {
    json!({"effect": effect, "objections": objections.iter().map(objection_sentence).collect::<Vec<_>>()})
}
