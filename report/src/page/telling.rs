//! Selection of the most informative picture.

use serde_json::{Value, json};

use super::candidate::Candidate;
use super::residuals::{Point, Residuals};
use super::shorts;
use calibench::diagnosis::{Diagnosis, Verdict};
use calibench::effects;
use calibench::residuals::comparison::Comparison;
use calibench::units::URAD;

/// Share of a candidate's effect below which a view of means does not represent it.
const WORTH_A_VIEW: f64 = 0.25;

/// Selects the picture and its candidate, by index:
///
/// * `phase`: a periodic effect of a joint, over one period;
/// * `curve`: the joint whose error follows a variable, and the curve;
/// * `view`, `balls`: the view of the residuals whose means show most of the candidate's effect;
/// * `agreement`: residual against the candidate's effect, if the means show little of it;
/// * `samples`: a sample that disagrees with all others, or the length of every residual if there is nothing to show, or something
///   happened between two rows;
/// * `contributions`: if the verdict is "unexplained" and no curve is offered.
pub(super) fn telling(d: &Diagnosis, points: &Residuals, first: Option<&Candidate>, comparison: &Comparison) -> Value {
    // What happened once shows in the length of every residual, in the order of the rows.
    let nothing = d.verdict.is_noise() || d.by_row_order.is_some();
    let Some(first) = first.filter(|_| !nothing) else { return json!({"kind": "samples", "candidate": null}) };
    if d.verdict == Verdict::Unexplained && !first.effect.starts_with("curve:") {
        return json!({"kind": "contributions", "candidate": null});
    }
    telling_of(d, points, first, comparison)
}

/// Selects the picture for one candidate; the result refers to it by index 0.
pub(super) fn telling_of(d: &Diagnosis, points: &Residuals, first: &Candidate, comparison: &Comparison) -> Value {
    if let Some(curve) = d.heat_map.curve.as_ref().filter(|c| first.effect == c.id()) {
        let (unit, si) = curve.variable.unit();
        let value = |&i: &usize| Some(points.points[i].value(curve.variable)? / si);
        let values: Option<Vec<f64>> = points.shown.iter().map(value).collect();
        return json!({"kind": "curve", "candidate": 0, "joint": curve.joint + 1, "against": curve.variable.name(), "unit": unit,
            "x": values.map(shorts), "at": shorts(curve.at.iter().map(|x| x / si)),
            "mean_urad": shorts(curve.mean.iter().map(|x| x / URAD)),
            "sigma_urad": shorts(curve.sigma.iter().map(|x| x / URAD))});
    }
    if let Some(sample) = effects::catalogue::set_aside_by(&first.effect) {
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

/// Sum of squares of a candidate's effect shown by the bin means of a joint's view, m².
fn of_view(points: &Residuals, candidate: &Candidate, comparison: &Comparison, view: usize) -> f64 {
    let (curve, Some(means)) = (&comparison.joints[view], &candidate.of_views[view]) else { return 0.0 };
    let si = curve.against.unit().1;
    let of_point = |p: &Point| {
        let x = points.value(p, curve.against)? / si;
        // Bin edges have gone through a unit conversion.
        let near = 1e-9 * x.abs();
        let bin = curve.bins.iter().position(|b| b.from - near <= x && x <= b.to + near)?;
        Some(p.levers[curve.joint - 1].norm_squared() * means[bin] * means[bin])
    };
    points.points.iter().filter_map(of_point).sum()
}

/// Sum of squares of a candidate's effect shown by the means of the balls, m².
fn of_balls(points: &Residuals, candidate: &Candidate, comparison: &Comparison) -> f64 {
    let of_point = |p: &Point| candidate.of_balls.get(points.ball_view(p, comparison)?).map(|mean| mean.norm_squared());
    points.points.iter().filter_map(of_point).sum()
}
