//! The one picture that tells most of what is wrong.

use serde_json::{Value, json};

use super::candidate::{Candidate, curve_id};
use super::residuals::{Point, Residuals};
use super::shorts;
use crate::assess::{Comparison, Diagnosis, Verdict};
use crate::effects;
use crate::units::URAD;

/// Means that show less than this share of what a candidate takes are no picture of it.
const WORTH_A_VIEW: f64 = 0.25;

/// Which picture it is, and of which candidate (by place):
///
/// * `phase`: what repeats with a joint, over one period;
/// * `curve`: the joint whose error follows something, and the curve that it follows;
/// * `view`, `balls`: of all views of the residuals the one whose means show most of what the candidate takes;
/// * `agreement`: where they show little, what is left against what the candidate takes;
/// * `samples`: a sample that disagrees with all others, or the length of every residual where there is nothing to tell.
pub(super) fn telling(d: &Diagnosis, points: &Residuals, candidates: &[Candidate], comparison: &Comparison) -> Value {
    let nothing = d.verdict.is_noise();
    let Some(first) = candidates.first().filter(|_| !nothing) else { return json!({"kind": "samples", "candidate": null}) };
    if d.verdict == Verdict::Unexplained && !first.effect.starts_with("curve:") {
        return json!({"kind": "contributions", "candidate": null});
    }
    telling_of(d, points, first, comparison)
}

/// The same of one candidate, which is taken to be the first.
pub(super) fn telling_of(d: &Diagnosis, points: &Residuals, first: &Candidate, comparison: &Comparison) -> Value {
    if let Some(curve) = d.heat_map.curve.as_ref().filter(|c| first.effect == curve_id(c)) {
        let (unit, si) = curve.variable.unit();
        let value = |&i: &usize| Some(points.points[i].value(curve.variable)? / si);
        let values: Option<Vec<f64>> = points.shown.iter().map(value).collect();
        return json!({"kind": "curve", "candidate": 0, "joint": curve.joint + 1, "against": curve.variable.name(), "unit": unit,
            "x": values.map(shorts), "at": shorts(curve.at.iter().map(|x| x / si)),
            "mean_urad": shorts(curve.mean.iter().map(|x| x / URAD)),
            "sigma_urad": shorts(curve.sigma.iter().map(|x| x / URAD))});
    }
    if let Some(sample) = effects::set_aside_by(&first.effect) {
        return json!({"kind": "samples", "candidate": 0, "sample": sample});
    }
    if first.phase.is_some() {
        return json!({"kind": "phase", "candidate": 0});
    }
    let whole: f64 = first.takes.iter().map(|d| d.norm_squared()).sum();
    let best =
        (0..comparison.joints.len()).map(|k| (of_view(points, first, comparison, k), k)).max_by(|a, b| a.0.total_cmp(&b.0));
    let of_balls = of_balls(points, first, comparison);
    match best {
        Some((most, view)) if most >= of_balls && most > WORTH_A_VIEW * whole => {
            json!({"kind": "view", "candidate": 0, "view": view})
        }
        _ if of_balls > WORTH_A_VIEW * whole => json!({"kind": "balls", "candidate": 0}),
        _ => json!({"kind": "agreement", "candidate": 0}),
    }
}

/// Squares of what a candidate takes that the means of its bins show in a view of a joint, m².
fn of_view(points: &Residuals, candidate: &Candidate, comparison: &Comparison, view: usize) -> f64 {
    let (curve, Some(means)) = (&comparison.joints[view], &candidate.of_views[view]) else { return 0.0 };
    let si = curve.against.unit().1;
    let of_point = |p: &Point| {
        let x = points.value(p, curve.against)? / si;
        // Edges have gone through another unit.
        let near = 1e-9 * x.abs();
        let bin = curve.bins.iter().position(|b| b.from - near <= x && x <= b.to + near)?;
        Some(p.levers[curve.joint - 1].norm_squared() * means[bin] * means[bin])
    };
    points.points.iter().filter_map(of_point).sum()
}

/// The same of the means of the balls.
fn of_balls(points: &Residuals, candidate: &Candidate, comparison: &Comparison) -> f64 {
    let of_point = |p: &Point| candidate.of_balls.get(points.ball_view(p, comparison)?).map(|mean| mean.norm_squared());
    points.points.iter().filter_map(of_point).sum()
}
