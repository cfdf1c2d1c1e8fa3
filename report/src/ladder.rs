//! A ladder as tables and JSON: the error after each step.

use serde_json::{Value, json};

use super::finding_notes::added_json;
use super::ladder_sentences::{added_words, advice, ladder_step_words, objection_sentence, symptom_sentence, why};
use super::tables::plain_rows;
use super::workspace::workspace_json;
use calibench::assess::{Choice, Gain, Ladder, LadderStep, Objection, StopReason, Validation};
use calibench::units::MM;

/// A step of the ladder as JSON; `below` holds the earlier ones, whose diagnoses give details of the effects it adds.
pub fn ladder_step_json(ladder_step: &LadderStep, below: &[&LadderStep]) -> Value {
    let validated = |v: &Validation| json!({"samples": v.samples, "mean_mm": v.mean / MM, "max_mm": v.max / MM, "std_mm": v.std / MM, "rms_mm": v.rms / MM});
    let sessions: Vec<Value> = ladder_step
        .sessions
        .iter()
        .map(|s| json!({"name": s.name, "cv_rms_mm": s.cross_validated / MM, "from_others_rms_mm": s.from_others.map(|v| v / MM)}))
        .collect();
    let checks: Vec<Value> = ladder_step
        .checks
        .iter()
        .map(|c| match &c.result {
            Ok(v) => json!({"name": c.name, "errors": validated(v), "refused": null}),
            Err(because) => json!({"name": c.name, "errors": null, "refused": because}),
        })
        .collect();
    let added: Vec<Value> = ladder_step
        .calibration
        .estimates
        .iter()
        .filter(|e| ladder_step.added.contains(&e.effect))
        .map(|e| {
            json!({"name": e.name, "effect": e.effect, "value": e.unit.from_si(e.value), "sigma": e.unit.from_si(e.sigma), "unit": e.unit.symbol})
        })
        .collect();
    json!({
        "added": ladder_step.added,
        "added_words": added_words(&ladder_step.added),
        "added_notes": added_json(&ladder_step.added, below),
        "parameters": added,
        "effects": ladder_step.model.effects,
        "fit_rms_mm": ladder_step.fit / MM,
        "residual_mm": ladder_step.fit / MM,
        "cross_validated_mm": ladder_step.cross_validated / MM,
        // Meaningless without stated noise.
        "chi2_per_dof": ladder_step.calibration.noise_stated.then_some(ladder_step.chi2_per_dof),
        "cv_rms_mm": ladder_step.cross_validated / MM,
        "workspace": ladder_step.workspace.as_ref().map(workspace_json),
        "undetermined": ladder_step.undetermined,
        "validation": ladder_step.validation.as_ref().map(validated),
        "noise_mm": ladder_step.noise / MM,
        "sessions": sessions,
        "checks": checks,
        "symptoms": ladder_step.symptoms.iter().map(symptom_sentence).collect::<Vec<_>>(),
        "gains": ladder_step.gains.iter().map(gain_json).collect::<Vec<_>>(),
        "verdict": ladder_step.diagnosis.verdict.name(),
        "set95": ladder_step.diagnosis.set95,
    })
}

/// A ladder as one JSON document.
pub fn ladder_json(ladder: &Ladder) -> Value {
    let all: Vec<&LadderStep> = ladder.rungs.iter().collect();
    let rungs: Vec<Value> = (0..all.len()).map(|k| ladder_step_json(all[k], &all[..k])).collect();
    let because = ladder.top.name();
    let stopped = match &ladder.top {
        StopReason::NotConverged(outcome) => json!({"because": because, "outcome": outcome.name()}),
        StopReason::NoStepHelps { tried } => {
            let tried: Vec<Value> = tried
                .iter()
                .map(|(effect, objections)| json!({"effect": effect, "objections": objections.iter().map(objection_sentence).collect::<Vec<_>>()}))
                .collect();
            json!({"because": because, "tried": tried})
        }
        _ => json!({"because": because}),
    };
    json!({
        "format": "calibench-ladder/1",
        "rungs": rungs,
        "stopped": stopped,
        "other": ladder.other.as_ref().map(|other| ladder_step_json(other, &all)),
        "choices": ladder.recommendation.choices.iter().map(choice_json).collect::<Vec<_>>(),
        "set_aside": ladder.recommendation.aside,
        "recommended": recommended_json(ladder),
        "advice": advice(ladder),
    })
}

/// One of the compared models.
fn choice_json(choice: &Choice) -> Value {
    json!({
        "kind": choice.kind.name(),
        "added": choice.added,
        "convinces": choice.convinces(),
        "gains": choice.gains.iter().map(gain_json).collect::<Vec<_>>(),
    })
}

/// The gain of a step for one division of the postures into blocks.
fn gain_json(gain: &Gain) -> Value {
    json!({
        "held_out_by": gain.division.name(),
        "postures": gain.postures,
        "before_mm": gain.rms[0] / MM,
        "after_mm": gain.rms[1] / MM,
        "gain": gain.share,
        "gain_sigma": gain.sigma,
    })
}

/// The model that a ladder recommends, and the reason.
pub fn recommended_json(ladder: &Ladder) -> Value {
    let choice = ladder.recommendation.choice();
    let ladder_step = ladder.recommended();
    let held_out =
        if ladder.withdrawn.is_some() { ladder.recommendation.choices[0].cross_validated() } else { choice.cross_validated() };
    json!({
        "kind": ladder.kind().name(),
        "model": ladder_step.model.effects,
        "why": why(ladder),
        "held_out_mm": held_out.map(|m| m / MM),
        "held_out_by": "postures",
        "withdrawn": ladder.withdrawn.is_some(),
    })
}

/// One step as one JSON document: the ladder before and after it, the objections to it, and whether it was accepted.
pub fn step_json(before: &LadderStep, after: &LadderStep, objections: &[Objection], accepted: bool) -> Value {
    json!({
        "format": "calibench-step/1",
        "before": ladder_step_json(before, &[]),
        "after": ladder_step_json(after, &[before]),
        "objections": objections.iter().map(objection_sentence).collect::<Vec<_>>(),
        "accepted": accepted,
    })
}

/// Steps as a table; one column per campaign if there are several, and one per campaign that was not fitted.
pub fn ladder_step_table(rungs: &[&LadderStep]) -> String {
    let Some(first) = rungs.first() else { return String::new() };
    let mm = |x: f64| format!("{:.4}", x / MM);
    let mut header: Vec<String> =
        ["model", "fit rms mm", "cross-validated", "predicted over the workspace"].map(String::from).into();
    let validated = rungs.iter().any(|r| r.validation.is_some());
    if validated {
        header.extend(["validation mean", "validation max"].map(String::from));
    }
    header.push("noise".into());
    let stated = first.calibration.noise_stated;
    if stated {
        header.push("chi2/dof".into());
    }
    let several = first.sessions.len() > 1;
    if several {
        for session in &first.sessions {
            header.push(format!("{}, cross-validated", session.name));
            if session.from_others.is_some() {
                header.push(format!("{}, from the others", session.name));
            }
        }
    }
    header.extend(first.checks.iter().map(|c| format!("check {}", c.name)));
    let row = |r: &&LadderStep| {
        let workspace = r
            .workspace
            .as_ref()
            .map(|w| format!("{:.3} ({:.3} to {:.3})", w.mean.expected / MM, w.mean.low / MM, w.mean.high / MM));
        let mut row = vec![ladder_step_words(r), mm(r.fit), mm(r.cross_validated), workspace.unwrap_or_default()];
        if validated {
            let of = |f: fn(&Validation) -> f64| r.validation.as_ref().map_or(String::new(), |v| mm(f(v)));
            row.extend([of(|v| v.mean), of(|v| v.max)]);
        }
        row.push(mm(r.noise));
        if stated {
            row.push(format!("{:.2}", r.chi2_per_dof));
        }
        if several {
            for (session, place) in r.sessions.iter().zip(&first.sessions) {
                row.push(mm(session.cross_validated));
                if place.from_others.is_some() {
                    row.push(session.from_others.map_or("-".into(), mm));
                }
            }
        }
        row.extend(r.checks.iter().map(|c| c.result.as_ref().map_or("-".into(), |v| mm(v.rms))));
        row
    };
    plain_rows(&header, &rungs.iter().map(row).collect::<Vec<_>>())
}
