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
use crate::symptom_sentence;
use calibench::identify::calibration::IdentifyError;
use calibench::identify::problem::Use;
use calibench::units::MM;

/// Number of blocks of consecutive poses, whose means are compared where neighbours err alike.
const BLOCKS: usize = 20;

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

    /// The errors of both models on every pose that was not fitted, and which is better there, in words.
    fn paired(&self, names: [&str; 2], subject: &PageSubject<'_>, first: &PageModel) -> Result<(Value, String), IdentifyError> {
        if !has_validation(subject.judged) {
            let sentence = "No rows were kept for validation, so neither model is preferred: the residual of the fit always prefers the model with more parameters. Import with `--holdout`, or measure poses that are not fitted.";
            return Ok((Value::Null, sentence.into()));
        }
        let predict = |page_model: &PageModel| page_model.ladder_step.calibration.predict(subject.judged, Use::Validation);
        let (a, b) = (predict(first)?, predict(&self.page_model)?);
        let lengths = |p: &calibench::identify::Prediction| p.residuals.iter().map(|r| r.norm()).collect::<Vec<f64>>();
        let (errors_a, errors_b) = (lengths(&a), lengths(&b));
        let differences: Vec<f64> = errors_b.iter().zip(&errors_a).map(|(b, a)| b - a).collect();
        let pair = Paired::of(&differences);
        let stride = differences.len().div_ceil(MOST_POINTS).max(1);
        let drawn = |errors: &[f64]| shorts(errors.iter().step_by(stride).map(|e| e / MM));
        let spread = if a.refitted.is_empty() && b.refitted.is_empty() {
            String::new()
        } else {
            " Base or tool of these rows were fitted to them first, so these are spreads, smaller than the errors.".into()
        };
        let mean_errors = [&errors_a, &errors_b].map(|errors| short(Paired::of(errors).two_errors / MM));
        let document = json!({
            "poses": differences.len(),
            "difference_mm": short(pair.mean / MM),
            "two_errors_mm": short(pair.two_errors / MM),
            "mean_errors_mm": mean_errors,
            "better": pair.better().map(|k| names[k]),
            "better_at": differences.iter().filter(|d| **d < 0.0).count(),
            "a_mm": drawn(&errors_a),
            "b_mm": drawn(&errors_b),
        });
        Ok((document, pair.sentence(names) + &spread))
    }
}

/// The mean of paired differences, B minus A, and two standard errors of it.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Paired {
    poses: usize,
    mean: f64,
    two_errors: f64,
}

impl Paired {
    /// Compares pose by pose. Neighbouring poses may err alike; then the means of blocks of them scatter more than independent
    /// poses would, and the larger of the two standard errors is taken.
    fn of(differences: &[f64]) -> Self {
        let standard_error = |x: &[f64]| {
            let n = x.len() as f64;
            let mean = x.iter().sum::<f64>() / n;
            (x.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>() / (n - 1.0) / n).sqrt()
        };
        let poses = differences.len();
        let mean = differences.iter().sum::<f64>() / poses.max(1) as f64;
        let plain = if poses > 1 { standard_error(differences) } else { f64::INFINITY };
        let blocks: Vec<f64> = if poses >= 2 * BLOCKS {
            let edge = |k: usize| k * poses / BLOCKS;
            let block = |k: usize| &differences[edge(k)..edge(k + 1)];
            (0..BLOCKS).map(|k| block(k).iter().sum::<f64>() / block(k).len() as f64).collect()
        } else {
            Vec::new()
        };
        let of_blocks = if blocks.is_empty() { 0.0 } else { standard_error(&blocks) };
        Paired { poses, mean, two_errors: 2.0 * plain.max(of_blocks) }
    }

    /// 0 if A is better beyond its error, 1 if B is; `None` if these poses do not tell.
    fn better(&self) -> Option<usize> {
        (self.mean.abs() > self.two_errors).then(|| usize::from(self.mean < 0.0))
    }

    fn sentence(&self, [a, b]: [&str; 2]) -> String {
        let (size, error) = (self.mean.abs() / MM, self.two_errors / MM);
        if !error.is_finite() {
            return format!("A single pose that was not fitted cannot tell whether {a} or {b} is better.");
        }
        match self.better() {
            Some(k) => {
                let [better, worse] = if k == 0 { [a, b] } else { [b, a] };
                format!(
                    "Better on rows not fitted: {better}. Its mean error at {} poses is {size:.4} ± {error:.4} mm smaller than that of {worse} (pose by pose, two standard errors).",
                    self.poses
                )
            }
            None => format!(
                "Rows not fitted do not tell which is better: at {} poses the mean errors differ by {size:.4} ± {error:.4} mm (pose by pose, two standard errors). Of two models that predict alike, the one with fewer parameters is the safer.",
                self.poses
            ),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn alternating(n: usize, mean: f64, swing: f64, run: usize) -> Vec<f64> {
        (0..n).map(|k| mean + if (k / run).is_multiple_of(2) { swing } else { -swing }).collect()
    }

    #[test]
    fn the_better_model_is_named_only_beyond_two_standard_errors() {
        // 100 poses, scatter 1: the standard error is 0.1.
        assert_eq!(Paired::of(&alternating(100, -0.3, 1.0, 1)).better(), Some(1));
        assert_eq!(Paired::of(&alternating(100, 0.3, 1.0, 1)).better(), Some(0));
        assert_eq!(Paired::of(&alternating(100, -0.15, 1.0, 1)).better(), None);
    }

    #[test]
    fn neighbours_that_err_alike_do_not_count_as_many() {
        let plain = Paired::of(&alternating(400, -0.15, 1.0, 1));
        let alike = Paired::of(&alternating(400, -0.15, 1.0, 20));
        assert_eq!(plain.better(), Some(1));
        assert!(alike.two_errors > 4.0 * plain.two_errors && alike.better().is_none());
    }

    #[test]
    fn a_single_pose_prefers_nobody() {
        let one = Paired::of(&[-1.0]);
        assert_eq!(one.better(), None);
        assert!(one.sentence(["A", "B"]).starts_with("A single pose"));
    }
}
