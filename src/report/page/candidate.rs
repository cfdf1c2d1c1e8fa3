//! What a candidate would take away, sample by sample: the model is fitted once more with it, all else free to follow.

use nalgebra::Vector3;
use serde_json::{Map, Value, json};

use super::residuals::Residuals;
use super::{short, shorts};
use crate::assess::{Comparison, Curve, Diagnosis, Finding, Verdict};
use crate::effects::{EffectId, family};
use crate::identify::{Calibration, IdentifyError, Model, Problem, Use, fit};
use crate::measure::Dataset;
use crate::report::meaning::{meaning, what};
use crate::units::{DEG, MM, UM, URAD};

/// Candidates that are shown with their curves.
pub(super) const MOST: usize = 4;

/// A candidate fitted.
pub(super) struct Candidate {
    /// The id under which a model takes it.
    pub effect: String,
    /// Sample by sample, world axes, m: the residual before minus the residual after.
    pub takes: Vec<Vector3<f64>>,
    /// Samples that are drawn, by place.
    shown: Vec<usize>,
    /// The same as an angle of each joint, urad, of samples that are drawn.
    angles: Value,
    /// Bin by bin of every view of the comparison, rad; none where the view is no more.
    pub of_views: Vec<Option<Vec<f64>>>,
    /// Of every ball, m.
    pub of_balls: Vec<Vector3<f64>>,
    /// Residual that it leaves, m.
    pub rms_after: f64,
    /// Joint, order, and phase of every sample that is drawn within a period, rad: of what repeats with the angle of a joint.
    pub phase: Option<(usize, u32, Vec<f64>)>,
}

/// A candidate that a diagnosis names, not yet fitted.
pub(super) struct Offered {
    /// The id under which a model takes it.
    pub effect: String,
    /// The model with it.
    wider: Model,
    /// Joint, counted from 0, and periods per turn of what repeats with the angle of a joint.
    period: Option<(usize, u32)>,
}

impl Offered {
    /// The findings, best first; before them, where no effect of the catalogue explains what is left, the best curve.
    pub fn all(model: &Model, diagnosis: &Diagnosis) -> Vec<Self> {
        let unexplained = diagnosis.verdict == Verdict::Unexplained;
        let curve = diagnosis.heat_map.curve.as_ref().filter(|_| unexplained && !diagnosis.heat_map.credible().is_empty());
        let curve = curve.map(|c| Offered { effect: curve_id(c), wider: c.added_to(model), period: None });
        let finding = |f: &Finding| {
            let effect = f.hypothesis.in_model.clone();
            Offered { wider: model.with(&effect), effect, period: period(f) }
        };
        curve.into_iter().chain(diagnosis.findings.iter().map(finding)).collect()
    }
}

impl Candidate {
    /// Fits it.
    ///
    /// # Errors
    /// When the data do not determine it.
    pub fn of(
        offered: Offered,
        datasets: &[(&str, &Dataset)],
        before: &Residuals,
        comparison: &Comparison,
    ) -> Result<Self, IdentifyError> {
        let Offered { effect, wider, period } = offered;
        let problem = Problem::new(datasets, &wider, Use::Fit)?;
        let fitted = fit(&problem)?;
        let after = problem.residuals(&fitted.values);
        let takes: Vec<Vector3<f64>> = before.points.iter().zip(&after).map(|(p, r)| p.residual - r).collect();
        let with = Comparison::of(&Calibration::of(datasets, &wider, &problem, &fitted), datasets, Use::Fit)?;
        let of_view = |curve: &crate::assess::JointCurve| {
            let same = with.joints.iter().find(|c| c.joint == curve.joint && c.against == curve.against)?;
            (same.bins.len() == curve.bins.len())
                .then(|| curve.bins.iter().zip(&same.bins).map(|(b, a)| b.mean - a.mean).collect())
        };
        Ok(Candidate {
            effect,
            angles: before.as_angles(|i| takes[i]),
            of_views: comparison.joints.iter().map(of_view).collect(),
            of_balls: comparison.balls.iter().zip(&with.balls).map(|(b, a)| b.mean - a.mean).collect(),
            takes,
            shown: before.shown.clone(),
            rms_after: fitted.rms,
            phase: period.and_then(|(joint, order)| phase(before, joint, order)),
        })
    }

    /// All of it, for drawing.
    pub fn json(&self) -> Value {
        let of_views: Vec<Value> =
            self.of_views.iter().map(|v| v.as_ref().map_or(Value::Null, |v| shorts(v.iter().map(|x| x / URAD)))).collect();
        let phase = self.phase.as_ref().map(
            |(joint, order, phase)| json!({"joint": joint + 1, "order": order, "x_deg": shorts(phase.iter().map(|x| x / DEG))}),
        );
        json!({
            "effect": self.effect,
            "takes_um": self.shown.iter().map(|&i| shorts((0..3).map(|k| self.takes[i][k] / UM))).collect::<Vec<_>>(),
            "angles_urad": self.angles,
            "of_views_urad": of_views,
            "of_balls_um": self.of_balls.iter().map(|d| shorts((0..3).map(|k| d[k] / UM))).collect::<Vec<_>>(),
            "rms_after_mm": short(self.rms_after / MM),
            "phase": phase,
        })
    }
}

/// As `add` takes it.
pub(super) fn curve_id(curve: &Curve) -> String {
    format!("curve:{}:{}", curve.joint + 1, curve.variable.name())
}

/// Joint, counted from 0, and periods per turn of an effect that repeats with the angle of a joint.
fn period(f: &Finding) -> Option<(usize, u32)> {
    let id = EffectId::new(&f.hypothesis.in_model);
    let family = family(id.whole())?;
    Some((family.joint(&id)?.checked_sub(1)?, family.period.per_turn(&id)?))
}

fn phase(points: &Residuals, joint: usize, order: u32) -> Option<(usize, u32, Vec<f64>)> {
    let turn = std::f64::consts::TAU;
    let of_point = |q: &Vec<f64>| Some((f64::from(order) * q.get(joint)?).rem_euclid(turn));
    Some((joint, order, points.shown.iter().map(|&i| of_point(&points.points[i].q)).collect::<Option<Vec<f64>>>()?))
}

/// What every effect that is named means, and where to look.
pub(super) fn meanings(diagnosis: &Diagnosis) -> Value {
    let named = diagnosis.findings.iter().map(|f| f.hypothesis.in_model.as_str());
    let all = named.chain(diagnosis.contributions.iter().map(|c| c.effect.as_str()));
    let one = |effect: &str| {
        let m = meaning(effect);
        (effect.to_owned(), json!({"what": what(effect), "physics": m.physics, "look": m.look}))
    };
    Value::Object(all.map(one).collect::<Map<String, Value>>())
}
