//! The error falling, rung by rung.

use serde_json::{Value, json};

use super::tables::plain_table;
use crate::assess::{Ladder, Objection, Rung, Top};
use crate::units::MM;

/// A rung as JSON.
pub fn rung_json(rung: &Rung) -> Value {
    let workspace = rung.workspace.as_ref().map(|w| {
        json!({"mean_mm": w.mean.expected / MM, "mean_band_mm": [w.mean.low / MM, w.mean.high / MM],
            "max_mm": w.max.expected / MM, "max_band_mm": [w.max.low / MM, w.max.high / MM]})
    });
    let validation = rung
        .validation
        .as_ref()
        .map(|v| json!({"samples": v.samples, "mean_mm": v.mean / MM, "max_mm": v.max / MM, "std_mm": v.std / MM, "rms_mm": v.rms / MM}));
    let sessions: Vec<Value> = rung
        .sessions
        .iter()
        .map(|s| json!({"name": s.name, "cv_rms_mm": s.cross_validated / MM, "from_others_rms_mm": s.from_others.map(|v| v / MM)}))
        .collect();
    json!({
        "added": rung.added,
        "effects": rung.model.effects,
        "fit_rms_mm": rung.fit / MM,
        "chi2_per_dof": rung.chi2_per_dof,
        "cv_rms_mm": rung.cross_validated / MM,
        "workspace": workspace,
        "validation": validation,
        "noise_mm": rung.noise / MM,
        "sessions": sessions,
        "verdict": rung.diagnosis.verdict.name(),
        "set95": rung.diagnosis.set95,
    })
}

/// A ladder as one JSON document.
pub fn ladder_json(ladder: &Ladder) -> Value {
    let rungs: Vec<Value> = ladder.rungs.iter().map(rung_json).collect();
    let stopped = match &ladder.top {
        Top::NothingLeft => json!({"because": "nothing_left"}),
        Top::Tired => json!({"because": "most_rungs"}),
        Top::NoStepHelps { tried } => {
            let tried: Vec<Value> = tried
                .iter()
                .map(|(effect, objections)| json!({"effect": effect, "objections": objections.iter().map(objection_sentence).collect::<Vec<_>>()}))
                .collect();
            json!({"because": "no_step_helps", "tried": tried})
        }
    };
    json!({"format": "calibench-ladder/1", "rungs": rungs, "stopped": stopped, "whole_library": ladder.whole.as_ref().map(rung_json)})
}

/// An objection in words.
pub fn objection_sentence(objection: &Objection) -> String {
    match objection {
        Objection::CrossValidation { rms } => {
            format!(
                "blocks that were not fitted are predicted no better: {:.4} mm before, {:.4} mm after",
                rms[0] / MM,
                rms[1] / MM
            )
        }
        Objection::Workspace { mean } => {
            format!(
                "the error predicted over the workspace does not fall: {:.3} mm before, {:.3} mm after",
                mean[0] / MM,
                mean[1] / MM
            )
        }
        Objection::Session { name, rms } => {
            format!("'{name}' is predicted worse: {:.4} mm before, {:.4} mm after", rms[0] / MM, rms[1] / MM)
        }
    }
}

/// Rungs as a table.
pub fn rung_table(rungs: &[&Rung]) -> String {
    let rows: Vec<[String; 8]> = rungs
        .iter()
        .map(|r| {
            let workspace = r
                .workspace
                .as_ref()
                .map(|w| format!("{:.3} ({:.3} to {:.3})", w.mean.expected / MM, w.mean.low / MM, w.mean.high / MM));
            let validation = |f: &dyn Fn(&crate::assess::Validation) -> f64| {
                r.validation.as_ref().map_or(String::new(), |v| format!("{:.4}", f(v) / MM))
            };
            [
                match r.added.len() {
                    0 => r.model.effects.join(" + "),
                    1 => format!("+ {}", r.added[0]),
                    n => format!("+ {n} effects at once"),
                },
                format!("{:.4}", r.fit / MM),
                format!("{:.4}", r.cross_validated / MM),
                workspace.unwrap_or_default(),
                validation(&|v| v.mean),
                validation(&|v| v.max),
                format!("{:.4}", r.noise / MM),
                format!("{:.2}", r.chi2_per_dof),
            ]
        })
        .collect();
    plain_table(
        &[
            "model",
            "fit rms mm",
            "cross-validated",
            "predicted over the workspace",
            "validation mean",
            "validation max",
            "noise",
            "chi2/dof",
        ],
        &rows,
    )
}
