//! A diagnosis as tables and JSON.

use serde_json::{Value, json};

use super::diagnosis_sentences::{sentences, sizes};
use super::finding_notes::put_notes;
use super::heat_map::{curve_line, heat_map_text};
use super::recommended::Recommended;
use super::scatter::scatter_json;
use super::tables::plain_table;
use super::workspace::{Forecast, extrapolation_json};
use calibench::assess::{Diagnosis, Finding, HeatMap, Place, Verdict};
use calibench::units::{MM, URAD};

/// Format tag.
const FORMAT: &str = "calibench-diagnosis/1";

/// A diagnosis as one JSON document.
pub fn diagnosis_json(d: &Diagnosis, outlook: Option<&Forecast>, commands: &Recommended) -> Value {
    let findings: Vec<Value> = d.findings.iter().enumerate().map(|(k, f)| finding_json(k + 1, f)).collect();
    let together: Vec<Value> =
        d.together.iter().map(|e| json!({"effect": e.effect, "explains_percent": 100.0 * e.share})).collect();
    let unbelievable: Vec<Value> =
        d.unbelievable.iter().map(|(effect, size)| json!({"effect": effect, "size_plausible": size})).collect();
    let untestable: Vec<Value> = d.untestable.iter().map(|u| json!({"effect": u.effect, "needs": u.needs})).collect();
    let contributions: Vec<Value> =
        d.contributions.iter().map(|c| json!({"effect": c.effect, "share": c.share, "size_plausible": c.size})).collect();
    let mut document = json!({
        "format": FORMAT,
        "samples": d.samples,
        "dof": d.dof,
        "rms_mm": d.rms / MM,
        "noise_mm": d.noise / MM,
        "unexplained_mm": d.unexplained / MM,
        // Meaningless without stated noise.
        "chi2_per_dof": d.lack_of_fit_p.map(|_| d.chi2_per_dof),
        "lack_of_fit_p": d.lack_of_fit_p,
        "verdict": d.verdict.name(),
        "outcome": d.outcome.name(),
        "verdict_without_suspects": d.verdict_without_suspects.map(Verdict::name),
        "explains_percent": d.explains.map(|share| 100.0 * share),
        "chi2_per_dof_with_it": d.chi2_per_dof_with_it,
        "together": together,
        "together_explain_percent": 100.0 * d.together_explain,
        "not_believable": unbelievable,
        "curve_family": d.curve_family.as_ref().map(|f| json!({"effect": f.effect, "share": f.share})),
        "set95": d.set95,
        "nothing_probability": d.nothing,
        "background_plausible": d.background,
        "findings": findings,
        "contributions": contributions,
        "heat_map": heat_map_json(&d.heat_map),
        "untestable": untestable,
        "fitted": d.fitted,
        "workspace": outlook.map(Forecast::json),
        "outside_range": outlook.map_or(Value::Null, |o| extrapolation_json(&o.extrapolation)),
        "sentences": sentences(d, commands),
    });
    if let (Value::Object(all), Value::Object(scatter)) = (&mut document, scatter_json(&d.scatter)) {
        all.extend(scatter);
    }
    document
}

fn finding_json(rank: usize, f: &Finding) -> Value {
    let h = &f.hypothesis;
    let parameters: Vec<Value> = f
        .parameters
        .iter()
        .map(|p| json!({"name": p.name, "value": p.unit.from_si(p.value), "sigma": p.unit.from_si(p.sigma), "unit": p.unit.symbol}))
        .collect();
    let at = match &h.place {
        None => Value::Null,
        Some(Place::Order(k)) => json!({"order": k}),
        Some(Place::Time(t)) => json!({"time_s": t}),
        Some(Place::Sample(id)) => json!({"sample": id}),
    };
    let mut finding = json!({
        "rank": rank,
        "effect": h.effect,
        "in_model": h.in_model,
        "at": at,
        "probability": f.probability,
        "explains": h.explains,
        "p_family": f.p_family,
        "delta_bic": f.delta_bic,
        "cv_gain": f.cv_gain,
        "visible": h.visible,
        "ln_evidence": h.ln_evidence,
        "ln_evidence_against_background": h.ln_evidence_against_background,
        "size_plausible": f.size,
        "rivals": f.rivals,
        "parameters": parameters,
    });
    put_notes(&mut finding, f);
    finding
}

fn heat_map_json(map: &HeatMap) -> Value {
    let cells: Vec<Value> = map
        .cells
        .iter()
        .map(|c| {
            json!({"joint": c.joint + 1, "against": c.variable.expression(), "ln_evidence": c.ln_evidence,
                "ln_evidence_against_background": c.ln_evidence_against_background, "explains": c.explains})
        })
        .collect();
    let best = map.best_cell().zip(map.curve.as_ref()).map(|(cell, curve)| {
        let (unit, si) = cell.variable.unit();
        let points: Vec<Value> = (0..curve.at.len())
            .map(|k| json!({"x": curve.at[k] / si, "mean_urad": curve.mean[k] / URAD, "sigma_urad": curve.sigma[k] / URAD}))
            .collect();
        json!({"joint": cell.joint + 1, "against": cell.variable.expression(), "x_unit": unit, "curve": points})
    });
    json!({"cells": cells, "best": best})
}

/// A diagnosis as tables for a terminal; `outlook` is the expected error over the workspace, or the reason why it cannot be
/// predicted.
pub fn diagnosis_text(
    d: &Diagnosis,
    outlook: &Result<Forecast, String>,
    commands: &Recommended,
    with_heat_map: bool,
) -> String {
    let mut out = String::new();
    for sentence in sentences(d, commands).into_iter().chain([outlook.as_ref().map_or_else(String::clone, Forecast::sentence)])
    {
        out.push_str(&sentence);
        out.push('\n');
    }
    let rows: Vec<[String; 9]> = d
        .findings
        .iter()
        .map(|f| {
            let h = &f.hypothesis;
            [
                h.in_model.clone(),
                format!("{:.3}", f.probability),
                format!("{:+.1}", h.ln_evidence_against_background),
                format!("{:+.1}", h.ln_evidence),
                format!("{:.0}", 100.0 * h.explains),
                format!("{:+.0}", 100.0 * f.cv_gain),
                format!("{:.1}", 100.0 * h.visible),
                sizes(f),
                f.rivals.join(", "),
            ]
        })
        .collect();
    out.push_str("\nEFFECTS THAT STAND OUT\n");
    out.push_str(&plain_table(
        &[
            "effect",
            "probability",
            "log evidence vs. background",
            "log evidence vs. noise",
            "explains %",
            "cv gain %",
            "detectability %",
            "as it would be fitted",
            "same in these data",
        ],
        &rows,
    ));
    let rows: Vec<[String; 3]> = d
        .contributions
        .iter()
        .take(10)
        .map(|c| [c.effect.clone(), format!("{:.1}", 100.0 * c.share), format!("{:.2}", c.size)])
        .collect();
    out.push_str("\n\nWHAT CONTRIBUTES MOST when everything is fitted at once\n");
    out.push_str(&plain_table(&["effect", "share of the residual %", "size, plausible sizes"], &rows));
    if with_heat_map || d.verdict == Verdict::Unexplained {
        out.push_str("\n\nJOINT ERROR BY VARIABLE, of any shape: log evidence vs. background, the best marked with a star\n");
        out.push_str(&heat_map_text(&d.heat_map));
        if let Some(curve) = &d.heat_map.curve {
            out.push_str(&format!("\n{}", curve_line(curve)));
        }
    }
    out
}
