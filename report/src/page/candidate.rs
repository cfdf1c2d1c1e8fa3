//! The effect of a candidate, sample by sample: the model is refitted with it, all other unknowns free.

use std::collections::BTreeSet;

use nalgebra::Vector3;
use serde_json::{Value, json};

use super::residuals::Residuals;
use super::{short, shorts};
use crate::gallery::gallery_page;
use crate::meaning::{intervention_words, meaning, what};
use crate::symptom_sentence;
use calibench::diagnosis::heat_map::Curve;
use calibench::diagnosis::surfaces::Surface;
use calibench::diagnosis::{Diagnosis, Finding, Symptom};
use calibench::effects::EffectId;
use calibench::effects::registry::Registry;
use calibench::identify::Model;
use calibench::identify::calibration::{Calibration, IdentifyError};
use calibench::identify::fit::{Outcome, fit};
use calibench::identify::problem::{Problem, Use};
use calibench::measure::dataset::NamedDataset;
use calibench::residuals::comparison::Comparison;
use calibench::selection::ladder::READILY;
use calibench::units::{DEG, MM, UM, URAD};

/// Number of candidates shown with their curves.
pub(super) const MOST: usize = 4;

/// A fitted candidate.
pub(super) struct Candidate {
    /// The id by which a model accepts it.
    pub effect: EffectId,
    /// Residual before minus residual after, per sample, world axes, m.
    pub takes: Vec<Vector3<f64>>,
    /// Indices of the samples that are drawn.
    shown: Vec<usize>,
    /// These differences as an angle of each joint, urad, for the drawn samples.
    angles: Value,
    /// The change of each bin of every view of the comparison, rad; `None` if the refitted comparison lacks the view.
    pub of_views: Vec<Option<Vec<f64>>>,
    /// The change of the mean residual of every ball, m.
    pub of_balls: Vec<Vector3<f64>>,
    /// Residual with the candidate, rms, m.
    pub rms_after: f64,
    /// Parameters that are physically impossible with it.
    symptoms: Vec<Symptom>,
    /// For an effect periodic in a joint's angle: joint, order, and the phase of every drawn sample within a period, rad.
    pub phase: Option<(usize, u32, Vec<f64>)>,
}

/// A candidate named by a diagnosis, not yet fitted.
pub(super) struct Offered {
    /// The id by which a model accepts it.
    pub effect: EffectId,
    /// The model extended by it.
    wider: Model,
    /// Joint, counted from 0, and periods per revolution, for an effect periodic in a joint's angle.
    period: Option<(usize, u32)>,
}

impl Offered {
    /// The findings, best first, preceded by the shape that is found if no effect of the catalogue explains the residual.
    pub fn all(model: &Model, diagnosis: &Diagnosis) -> Vec<Self> {
        let shape = diagnosis.shape();
        let shape = shape.map(|s| Offered { effect: EffectId::new(&s.id), wider: s.added_to(model), period: None });
        let finding = |f: &Finding| {
            let effect = f.hypothesis.in_model.clone();
            Offered { wider: model.with(&effect), effect, period: period(f, &model.registry) }
        };
        shape.into_iter().chain(diagnosis.findings.iter().map(finding)).collect()
    }
}

impl Candidate {
    /// Fits the candidate.
    ///
    /// # Errors
    /// If the data do not determine it, or so little that its fit does not converge readily.
    pub fn of(
        offered: Offered,
        datasets: &[NamedDataset<'_>],
        before: &Residuals,
        comparison: &Comparison,
    ) -> Result<Self, IdentifyError> {
        let Offered { effect, wider, period } = offered;
        let problem = Problem::new(datasets, &wider, Use::Fit)?.within_steps(READILY);
        let fitted = fit(&problem)?;
        if fitted.outcome != Outcome::Converged {
            return Err(IdentifyError::Slow { steps: READILY });
        }
        let after = problem.residuals(&fitted.values);
        let takes: Vec<Vector3<f64>> = before.points.iter().zip(&after).map(|(p, r)| p.residual - r).collect();
        let calibration = Calibration::of(datasets, &wider, &problem, &fitted);
        let with = Comparison::of(&calibration, datasets, Use::Fit)?;
        let of_view = |curve: &calibench::residuals::views::JointCurve| {
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
            symptoms: Symptom::of(&calibration, datasets),
            phase: period.and_then(|(joint, order)| phase(before, joint, order)),
        })
    }

    /// The candidate as JSON, for drawing.
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
            "symptoms": self.symptoms.iter().map(|s| json!({"parameter": s.parameter, "words": symptom_sentence(s)})).collect::<Vec<_>>(),
        })
    }
}

/// Joint, counted from 0, and periods per revolution of an effect periodic in a joint's angle.
fn period(f: &Finding, registry: &Registry) -> Option<(usize, u32)> {
    let id = &f.hypothesis.in_model;
    let family = registry.family(id)?;
    Some((family.joint(id)?.checked_sub(1)?, family.period.per_turn(id)?))
}

fn phase(points: &Residuals, joint: usize, order: u32) -> Option<(usize, u32, Vec<f64>)> {
    let turn = std::f64::consts::TAU;
    let of_point = |q: &Vec<f64>| Some((f64::from(order) * q.get(joint)?).rem_euclid(turn));
    Some((joint, order, points.shown.iter().map(|&i| of_point(&points.points[i].q)).collect::<Option<Vec<f64>>>()?))
}

/// The name and meaning of every effect that the page mentions, and where to look for it.
pub(super) fn meanings(diagnosis: &Diagnosis, ladder: &Value) -> Value {
    let mut named: BTreeSet<String> = diagnosis.fitted.iter().cloned().collect();
    let findings = diagnosis.findings.iter();
    let ids = findings.flat_map(|f| std::iter::once(&f.hypothesis.in_model).chain(&f.rivals).chain(&f.exactly_same));
    let ids = ids.chain(diagnosis.contributions.iter().map(|c| &c.effect)).chain(&diagnosis.set95);
    let ids = ids.chain(diagnosis.together.iter().map(|t| &t.effect)).chain(diagnosis.curve_family.iter().map(|f| &f.effect));
    let ids = ids.chain(diagnosis.unbelievable.iter().map(|(effect, _)| effect));
    named.extend(ids.chain(diagnosis.untestable.iter().map(|u| &u.effect)).map(ToString::to_string));
    named.extend(diagnosis.heat_map.curve.as_ref().map(Curve::id));
    named.extend(diagnosis.surface.as_ref().map(Surface::id));
    effects_in(ladder, &mut named);
    Value::Object(named.into_iter().map(|id| meaning_of(&diagnosis.registry, id)).collect())
}

/// Adds the effects that the sentences of a document speak of to the meanings of its page.
pub(super) fn add_spoken_of(document: &Value, registry: &Registry, meanings: &mut Value) {
    let mut spoken = BTreeSet::new();
    effects_spoken_of(document, registry, false, &mut spoken);
    let Some(meanings) = meanings.as_object_mut() else { return };
    for id in spoken {
        meanings.entry(id.clone()).or_insert_with(|| meaning_of(registry, id).1);
    }
}

/// The name and meaning of an effect, by its id.
fn meaning_of(registry: &Registry, effect: String) -> (String, Value) {
    let m = meaning(registry, &effect);
    let said = json!({"name": registry.in_words(&effect), "what": what(registry, &effect), "physics": m.physics, "to_do": intervention_words(&m.intervention),
        "gallery": gallery_page(&effect)});
    (effect, said)
}

/// Collects the ids of effects in the sentences of a document.
fn effects_spoken_of(document: &Value, registry: &Registry, sentence: bool, ids: &mut BTreeSet<String>) {
    match document {
        Value::String(text) if sentence => {
            let words = text.split(|c: char| !(c.is_alphanumeric() || "_:.@+-".contains(c)));
            let id = |word: &str| word.trim_end_matches([':', '.']).to_owned();
            ids.extend(words.map(id).filter(|id| id.contains([':', '_']) && registry.family(id).is_some()));
        }
        Value::Array(items) => items.iter().for_each(|item| effects_spoken_of(item, registry, sentence, ids)),
        Value::Object(fields) => {
            for (key, value) in fields {
                let sentence = matches!(key.as_str(), "sentences" | "symptoms" | "words" | "objections" | "advice");
                effects_spoken_of(value, registry, sentence, ids);
            }
        }
        _ => {}
    }
}

/// Collects the ids of effects that a document of the ladder names.
fn effects_in(document: &Value, ids: &mut BTreeSet<String>) {
    match document {
        Value::Array(items) => items.iter().for_each(|item| effects_in(item, ids)),
        Value::Object(fields) => {
            for (key, value) in fields {
                match (key.as_str(), value) {
                    ("effect", Value::String(id)) => _ = ids.insert(id.clone()),
                    ("added" | "effects", Value::Array(list)) => {
                        ids.extend(list.iter().filter_map(Value::as_str).map(str::to_owned))
                    }
                    _ => effects_in(value, ids),
                }
            }
        }
        _ => {}
    }
}
