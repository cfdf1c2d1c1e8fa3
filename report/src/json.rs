//! JSON documents for other programs.

use serde_json::{Value, json};

use calibench::assess::Validation;
use calibench::identify::{Calibration, Outcome};
use calibench::units::MM;

/// The calibration document, `calibench-calibration/1`.
pub fn calibration_json(c: &Calibration) -> Value {
    let parameters: Vec<Value> = c
        .estimates
        .iter()
        .filter(|e| e.stated_sigma.is_none())
        .map(|e| {
            json!({"name": e.name, "value": e.unit.from_si(e.value), "sigma": e.unit.from_si(e.sigma), "sigma_noise": e.unit.from_si(e.sigma_noise), "unit": e.unit.symbol,
                   "nominal": e.unit.from_si(e.nominal), "effect": e.effect})
        })
        .collect();
    let stated: Vec<Value> = c
        .estimates
        .iter()
        .filter_map(|e| {
            let stated = e.stated_sigma?;
            Some(json!({"name": e.name, "value": e.unit.from_si(e.value), "sigma": e.unit.from_si(e.sigma), "sigma_noise": e.unit.from_si(e.sigma_noise), "unit": e.unit.symbol,
                   "nominal": e.unit.from_si(e.nominal), "effect": e.effect, "stated_sigma": e.unit.from_si(stated)}))
        })
        .collect();
    let o = &c.observability;
    json!({
        "format": "calibench-calibration/1",
        "robot": c.robot_reference,
        "effects": c.model.effects,
        "parameters": parameters,
        "stated_parameters": stated,
        "outcome": c.outcome.map(Outcome::name),
        "samples": c.samples,
        "residual_mm": c.rms / MM,
        "rms_mm": c.rms / MM,
        "chi2_per_dof": c.chi2_per_dof,
        "dof": c.dof,
        "rank": c.rank,
        "condition": c.condition,
        "noise_stated": c.noise_stated,
        "observability": {"O1": o.o1, "O2": o.o2, "O3": o.o3, "O4": o.o4, "O5": o.o5},
        "unresolved": c.unresolved,
    })
}

/// The validation document, `calibench-validation/1`.
pub fn validation_json(v: &Validation) -> Value {
    let [q05, q25, q50, q75, q95] = v.quantiles.map(|q| q / MM);
    let histogram: Vec<Value> =
        v.histogram(12).iter().map(|b| json!({"from_mm": b.from / MM, "to_mm": b.to / MM, "count": b.count})).collect();
    json!({
        "format": "calibench-validation/1",
        "samples": v.samples,
        "mean_mm": v.mean / MM,
        "max_mm": v.max / MM,
        "std_mm": v.std / MM,
        "rms_mm": v.rms / MM,
        "quantiles_mm": {"5": q05, "25": q25, "50": q50, "75": q75, "95": q95},
        "histogram": histogram,
        "refitted": v.refitted,
        "from_fit_rows": v.from_fit_rows,
    })
}
