//! The error falling: the whole ladder where it was asked for, else the next step alone.

use serde_json::{Value, json};

use super::PageSubject;
use super::candidate::curve_id;
use super::standing::judge;
use crate::assess::{self, ProvingGround, Rung, Verdict, add, ladder as climb};
use crate::identify::IdentifyError;
use crate::report::{ladder_json, objection_sentence, rung_json};

/// The ladder as a document; its key `complete` tells whether it was climbed to its end.
///
/// # Errors
/// As the ladder's.
pub(super) fn ladder(subject: &PageSubject<'_>, first: &Rung, ground: ProvingGround<'_>) -> Result<Value, IdentifyError> {
    if subject.climb {
        let mut climbed = climb(subject.datasets, subject.model, ground, &mut |_| ())?;
        climbed.rungs = climbed.rungs.into_iter().map(|r| judge(r, subject.judged)).collect::<Result<_, _>>()?;
        climbed.other = climbed.other.map(|r| judge(r, subject.judged)).transpose()?;
        let mut whole = ladder_json(&climbed);
        whole["complete"] = json!(true);
        return Ok(whole);
    }
    let d = &first.diagnosis;
    if d.verdict.is_noise() {
        return Ok(
            json!({"rungs": [rung_json(first, &[])], "complete": true, "advice": "Nothing is left but noise: there is nothing to add."}),
        );
    }
    let command = format!("calibench ladder {}{}", subject.commands.datasets, subject.commands.model);
    let Some((effect, stepped)) = step(subject, first, ground) else {
        return Ok(json!({"rungs": [rung_json(first, &[])], "complete": false, "command": command}));
    };
    let (rungs, objections) = match stepped {
        Ok(next) => {
            let next = judge(next, subject.judged)?;
            let objections = next.objections(first);
            (
                vec![rung_json(first, &[]), rung_json(&next, &[first])],
                objections.iter().map(objection_sentence).collect::<Vec<_>>(),
            )
        }
        Err(e) => (vec![rung_json(first, &[])], vec![format!("the data do not determine it: {e}")]),
    };
    Ok(json!({"rungs": rungs, "complete": false, "step": {"effect": effect, "objections": objections}, "command": command}))
}

/// The step that is recommended, and how it went: the curve of a joint where no effect explains what is left, else what sticks out, else
/// what contributes most.
fn step(subject: &PageSubject<'_>, first: &Rung, ground: ProvingGround<'_>) -> Option<(String, Result<Rung, IdentifyError>)> {
    let d = &first.diagnosis;
    let unexplained = d.verdict == Verdict::Unexplained;
    if let Some(curve) = d.heat_map.curve.as_ref().filter(|_| unexplained && !d.heat_map.credible().is_empty()) {
        let stepped = assess::step(subject.datasets, first, &curve.added_to(subject.model), vec![curve_id(curve)], ground);
        return Some((curve_id(curve), stepped));
    }
    let found = d.findings.first().map(|f| f.hypothesis.in_model.clone());
    let contributing = d.contributions.first().map(|c| c.effect.clone());
    let effect = if unexplained { contributing.or(found) } else { found }?;
    let stepped = add(subject.datasets, first, std::slice::from_ref(&effect), ground);
    Some((effect, stepped))
}
