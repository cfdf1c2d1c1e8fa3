//! The comparison document, `calibench-comparison/1`.

use nalgebra::Vector3;
use serde_json::{Value, json};

use super::workspace::{Forecast, extrapolation_json};
use calibench::assess::{Comparison, Extrapolation, SetupView, Subject, ToolView, ViewTest, WorldView};
use calibench::units::{MM, UM, URAD};

fn um(v: &Vector3<f64>) -> Value {
    json!([v.x / UM, v.y / UM, v.z / UM])
}

fn urad(v: &Vector3<f64>) -> Value {
    json!([v.x / URAD, v.y / URAD, v.z / URAD])
}

/// Adds the keys of a test to `value`.
fn tested(mut value: Value, t: &ViewTest) -> Value {
    let test =
        [("chi2", json!(t.chi2)), ("dof", json!(t.dof)), ("p_family", json!(t.p_family)), ("explains", json!(t.explains))];
    test.into_iter().for_each(|(key, number)| value[key] = number);
    value
}

fn tool(view: &ToolView) -> Value {
    tested(json!({"mean_um": um(&view.mean), "sigma_um": um(&view.sigma)}), &view.test)
}

fn world(view: &WorldView) -> Value {
    let value = json!({
        "mean_um": um(&view.mean), "sigma_um": um(&view.sigma),
        "translation_um": um(&view.translation), "translation_sigma_um": um(&view.translation_sigma),
        "rotation_urad": urad(&view.rotation), "rotation_sigma_urad": urad(&view.rotation_sigma),
        "rms_after_mm": view.rms_after / MM,
    });
    tested(value, &view.test)
}

fn setup(s: &SetupView) -> Value {
    json!({"dataset": s.dataset, "session": s.session, "samples": s.samples, "rms_mm": s.rms / MM, "tool": tool(&s.tool), "world": world(&s.world)})
}

/// A comparison as one JSON document; the keys state the units: lengths in mm or um, angles in urad.
pub fn comparison_json(c: &Comparison, outlook: Option<&Forecast>, extrapolation: &Extrapolation) -> Value {
    let level = c.noise.level;
    let mm = |x: Option<f64>| x.map(|x| x / MM);
    let interval = |x: Option<[f64; 2]>| x.map(|x| x.map(|x| x / MM));
    let balls: Vec<Value> = c
        .balls
        .iter()
        .map(|b| {
            let value = json!({"dataset": b.dataset, "ball": b.ball, "samples": b.samples, "rms_um": b.rms / UM, "mean_um": um(&b.mean),
                "sigma_um": um(&b.sigma), "displacement_um": b.displacement.map(|[d, _]| um(&d)),
                "displacement_sigma_um": b.displacement.map(|[_, s]| um(&s))});
            tested(value, &b.test)
        })
        .collect();
    let joints: Vec<Value> = c
        .joints
        .iter()
        .map(|j| {
            let bins: Vec<Value> = j
                .bins
                .iter()
                .map(|b| json!({"x": b.x, "from": b.from, "to": b.to, "mean_urad": b.mean / URAD, "sigma_urad": b.sigma / URAD, "n": b.samples}))
                .collect();
            let value = json!({"joint": j.joint, "against": j.against.name(), "unit": j.against.unit().0, "swing_urad": j.swing() / URAD, "bins": bins});
            tested(value, &j.test)
        })
        .collect();
    let offsets: Vec<Value> = c
        .offsets
        .iter()
        .map(|o| tested(json!({"joint": o.joint, "mean_urad": o.mean / URAD, "sigma_urad": o.sigma / URAD}), &o.test))
        .collect();
    let worst: Vec<Value> = c
        .worst
        .iter()
        .map(|w| {
            let at = &c.setups[w.setup];
            json!({"id": w.id, "dataset": at.dataset, "session": at.session, "residual_um": um(&w.residual),
                "norm_um": w.residual.norm() / UM, "normalised": w.normalised, "p_family": w.test.p_family, "special": w.remarks})
        })
        .collect();
    let findings: Vec<Value> = c
        .findings
        .iter()
        .map(|f| {
            let about = match f.subject {
                Subject::Ball(k) => json!({"view": "ball", "dataset": c.balls[k].dataset, "ball": c.balls[k].ball}),
                Subject::Tool(k) => json!({"view": "tool", "dataset": c.setups[k].dataset, "session": c.setups[k].session}),
                Subject::World(k) => json!({"view": "world", "dataset": c.setups[k].dataset, "session": c.setups[k].session}),
                Subject::Curve(k) => {
                    json!({"view": "joint", "joint": c.joints[k].joint, "against": c.joints[k].against.name()})
                }
                Subject::Offset(k) => json!({"view": "offset", "joint": c.offsets[k].joint}),
                Subject::Sample(k) => json!({"view": "sample", "id": c.worst[k].id}),
            };
            let mut value = tested(about, &f.test);
            value["effects"] = json!(f.effects);
            value
        })
        .collect();
    json!({
        "format": "calibench-comparison/1",
        "robot": c.robot,
        "samples": c.samples,
        "fitted": c.standing.fitted,
        "refitted": c.standing.refitted,
        "from_fit_rows": c.standing.from_fit_rows,
        "rms_mm": c.rms / MM,
        "noise_mm": mm(level.map(|l| l.rms)),
        "noise_um_per_axis": level.map(|l| l.per_axis / UM),
        "noise_interval_mm": interval(level.and_then(|l| l.interval)),
        "noise_dof": level.and_then(|l| l.dof),
        "noise_source": c.noise.source.name(),
        "noise_stated_um_per_axis": c.noise.stated_per_axis.map(|x| x / UM),
        "noise_agreement_p": c.noise.agreement_p,
        "noise_left_mm": mm(c.lack_of_fit.noise_left),
        "unexplained_mm": mm(c.lack_of_fit.unexplained),
        "unexplained_interval_mm": interval(c.lack_of_fit.interval),
        "dof": c.lack_of_fit.dof,
        "chi2_per_dof": c.lack_of_fit.chi2_per_dof,
        "lack_of_fit_p": c.lack_of_fit.p,
        "noise_overstated": c.lack_of_fit.noise_overstated,
        "balls": balls,
        "tool": tool(&c.tool),
        "world": world(&c.world),
        "setups": c.setups.iter().map(setup).collect::<Vec<_>>(),
        "joints": joints,
        "offsets": offsets,
        "worst": worst,
        "findings": findings,
        "workspace": outlook.map(Forecast::json),
        "outside_range": extrapolation_json(extrapolation),
        "sentences": c.sentences(),
    })
}
