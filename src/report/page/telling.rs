//! The one picture that tells most of what is wrong.

use serde_json::{Value, json};

use super::candidate::{Candidate, curve_id};
use super::residuals::Residuals;
use super::shorts;
use crate::assess::{Comparison, Diagnosis, Verdict};
use crate::units::URAD;

/// Which picture it is, and of which candidate (by place):
///
/// * `phase`: what repeats with a joint, over one period;
/// * `curve`: the joint whose error follows something, and the curve that it follows;
/// * `view`, `balls`: of all views of the residuals the one in which most of the candidate is seen, in units of what chance makes of it;
/// * `samples`: a sample that disagrees with all others, or the length of every residual where there is nothing to tell.
pub(super) fn telling(d: &Diagnosis, points: &Residuals, candidates: &[Candidate], comparison: &Comparison) -> Value {
    if d.verdict == Verdict::NothingLeft {
        return json!({"kind": "samples", "candidate": null});
    }
    let Some(first) = candidates.first() else { return json!({"kind": "samples", "candidate": null}) };
    if d.verdict == Verdict::Unexplained {
        let curve = d.heat_map.curve.as_ref().filter(|c| first.effect == curve_id(c));
        return match curve {
            Some(curve) => {
                let (unit, si) = curve.variable.unit();
                let value = |&i: &usize| Some(points.points[i].value(curve.variable)? / si);
                let values: Option<Vec<f64>> = points.shown.iter().map(value).collect();
                json!({"kind": "curve", "candidate": 0, "joint": curve.joint + 1, "against": curve.variable.name(), "unit": unit,
                    "x": values.map(shorts), "at": shorts(curve.at.iter().map(|x| x / si)),
                    "mean_urad": shorts(curve.mean.iter().map(|x| x / URAD)),
                    "sigma_urad": shorts(curve.sigma.iter().map(|x| x / URAD))})
            }
            None => json!({"kind": "contributions", "candidate": null}),
        };
    }
    if let Some(sample) = first.effect.strip_prefix("outlier:") {
        return json!({"kind": "samples", "candidate": 0, "sample": sample});
    }
    if first.phase.is_some() {
        return json!({"kind": "phase", "candidate": 0});
    }
    let squares = |size: f64, sigma: f64| if sigma > 0.0 { (size / sigma).powi(2) } else { 0.0 };
    let of_view = |k: usize| {
        let bins = first.of_views[k].iter().flatten().zip(&comparison.joints[k].bins);
        bins.map(|(size, bin)| squares(*size, bin.sigma)).sum::<f64>()
    };
    let of_balls: f64 = first
        .of_balls
        .iter()
        .zip(&comparison.balls)
        .flat_map(|(size, ball)| (0..3).map(move |k| squares(size[k], ball.sigma[k])))
        .sum();
    let best = (0..comparison.joints.len()).map(|k| (of_view(k), k)).max_by(|a, b| a.0.total_cmp(&b.0));
    match best {
        Some((most, view)) if most > of_balls => json!({"kind": "view", "candidate": 0, "view": view}),
        _ if of_balls > 0.0 => json!({"kind": "balls", "candidate": 0}),
        _ => json!({"kind": "samples", "candidate": 0}),
    }
}
