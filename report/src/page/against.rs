//! Two models of the same data, side by side.
//!
//! The residual of the fit never prefers one: the model with more parameters always has the smaller one. What prefers is the error
//! on poses that neither was fitted to, pose by pose.

use serde_json::{Value, json};

use super::page_model::{PageModel, flagged, has_validation, key_figures};
use super::residuals::MOST_POINTS;
use super::space::arrows;
use super::views::Views;
use super::{PageSubject, short, shorts};
use crate::documents::{LadderStep as StepDocument, to_value};
use crate::side_by_side::paired_sentence;
use crate::symptom_sentence;
use calibench::identify::calibration::IdentifyError;
use calibench::identify::problem::Use;
use calibench::judgement::side_by_side::{JudgedOn, PairedDifference, left_out_errors};
use calibench::units::MM;

/// The second model of a page.
pub(super) struct Rival {
    page_model: PageModel,
    views: Views,
}

impl Rival {
    /// Fits the model of `subject`, which must differ from the page's in its model only, and looks at the same samples.
    ///
    /// # Errors
    /// If data and model do not match, or the data do not determine the unknowns.
    pub fn new(subject: &PageSubject<'_>, first: &Views) -> Result<Self, IdentifyError> {
        let page_model = PageModel::new(subject)?;
        let views = Views::new(subject, &page_model)?.showing_as(first);
        Ok(Rival { page_model, views })
    }

    /// The comparison as a document; `names` are those of the page's model and of this one.
    ///
    /// # Errors
    /// If the rows that were not fitted cannot be predicted.
    pub fn json(&self, names: [&str; 2], subject: &PageSubject<'_>, first: &PageModel) -> Result<Value, IdentifyError> {
        let [a, b] = [&first.ladder_step, &self.page_model.ladder_step];
        let forecast = self.page_model.forecast();
        let (held_out, paired) = (has_validation(subject.judged), self.paired(names, subject, first)?);
        let views = self.views.comparison().joints.iter().map(|curve| {
            let bins = curve.bins.iter().map(|b| json!({"x": short(b.x), "mean_urad": short(b.mean / calibench::units::URAD)}));
            json!({"joint": curve.joint, "against": curve.against.name(), "bins": bins.collect::<Vec<_>>()})
        });
        let effects = |step: &calibench::selection::ladder::LadderStep| step.model.ids();
        let all: Vec<String> = effects(a).into_iter().chain(effects(b)).collect();
        let words: serde_json::Map<String, Value> =
            all.into_iter().map(|id| (id.clone(), json!(b.model.registry.in_words(&id)))).collect();
        Ok(json!({
            "names": names,
            "effects": [effects(a), effects(b)],
            "in_words": words,
            "verdict": b.diagnosis.verdict.in_words(),
            "symptoms": b.symptoms.iter().map(symptom_sentence).collect::<Vec<_>>(),
            "figures": key_figures(b, forecast.as_ref()),
            "rung": to_value(&StepDocument::of(b, &[])),
            "parameters": flagged(super::page_model::fitted(&b.calibration), b)["parameters"],
            "held_out": held_out,
            "paired": paired.0,
            "sentence": paired.1,
            "views": views.collect::<Vec<_>>(),
            "residual_um": self.views.lengths_um(),
            "arrows_um": arrows(self.views.stances(), self.views.shown()),
            "maps": super::space::maps(self.views.stances()),
        }))
    }

    /// The errors of both models on every pose that no fit has seen, and which is better there, in words: held-out rows, or, without
    /// any, every fitted row left out of a fit in turn.
    fn paired(&self, names: [&str; 2], subject: &PageSubject<'_>, first: &PageModel) -> Result<(Value, String), IdentifyError> {
        let steps = [&first.ladder_step, &self.page_model.ladder_step];
        let (judged_on, [errors_a, errors_b], is_set_up) = if has_validation(subject.judged) {
            let [a, b] = steps.map(|step| step.calibration.predict(subject.judged, Use::Validation));
            let (a, b) = (a?, b?);
            let lengths = [&a, &b].map(|p| p.residuals.iter().map(|r| r.norm()).collect::<Vec<f64>>());
            (JudgedOn::HeldOut, lengths, !(a.refitted.is_empty() && b.refitted.is_empty()))
        } else {
            let models = steps.map(|step| &step.model);
            (JudgedOn::LeftOut, steps.map(|step| left_out_errors(&models, &step.blocks)), false)
        };
        let pair = PairedDifference::of(&errors_a, &errors_b);
        let stride = pair.poses.div_ceil(MOST_POINTS).max(1);
        let drawn = |errors: &[f64]| shorts(errors.iter().step_by(stride).map(|e| e / MM));
        let spread = if is_set_up {
            " Base or tool of these rows were fitted to them first, so these are spreads, smaller than the errors."
        } else {
            ""
        };
        let of_mean = |errors: &[f64]| PairedDifference::of(&vec![0.0; errors.len()], errors).two_errors;
        let mean_errors = [&errors_a, &errors_b].map(|errors| short(of_mean(errors) / MM));
        let document = json!({
            "poses": pair.poses,
            "difference_mm": short(pair.mean / MM),
            "two_errors_mm": short(pair.two_errors / MM),
            "mean_errors_mm": mean_errors,
            "better": pair.better().map(|k| names[k]),
            "better_at": pair.better_at,
            "a_mm": drawn(&errors_a),
            "b_mm": drawn(&errors_b),
        });
        Ok((document, paired_sentence(&pair, names, judged_on) + spread))
    }
}
