//! Views of a fit's residuals, and the share of them that candidates would explain.

use std::sync::Arc;

use serde_json::{Value, json};

use super::PageSubject;
use super::candidate::{Candidate, MOST, Offered};
use super::page_model::PageModel;
use super::residuals::Residuals;
use super::shorts;
use super::space::ArmPose;
use super::telling::{telling, telling_of};
use crate::documents;
use calibench::diagnosis::hypotheses::Place;
use calibench::identify::calibration::IdentifyError;
use calibench::identify::problem::Use;
use calibench::prediction::Extrapolation;
use calibench::residuals::comparison::Comparison;
use calibench::units::UM;

/// The parts of a page that show individual samples. A clone shares their data.
#[derive(Clone)]
pub struct Views {
    samples: Arc<Samples>,
    /// The candidates fitted so far, the best first.
    candidates: Vec<Arc<Candidate>>,
}

/// The samples of a fit, without candidates.
struct Samples {
    comparison: Comparison,
    residuals: Residuals,
    beyond: Extrapolation,
}

/// A candidate of a diagnosis, fitted to the samples of its [`Views`].
pub struct FittedCandidate(Candidate);

impl Views {
    /// Computes the views of a fitted model's samples, without candidates.
    ///
    /// # Errors
    /// If the data do not determine the model.
    pub fn new(subject: &PageSubject<'_>, page_model: &PageModel) -> Result<Self, IdentifyError> {
        let PageSubject { datasets, model, .. } = subject;
        let diagnosis = &page_model.ladder_step.diagnosis;
        let calibration = &page_model.ladder_step.calibration;
        let spoken_of = |id: &str| diagnosis.findings.iter().any(|f| f.hypothesis.place == Some(Place::Sample(id.into())));
        let samples = Samples {
            comparison: Comparison::of(calibration, datasets, Use::Fit)?,
            residuals: Residuals::new(datasets, model, spoken_of)?,
            beyond: Extrapolation::of_samples(&calibration.robot, &calibration.joint_ranges, model, datasets, |s| {
                Use::Fit.takes(s)
            }),
        };
        Ok(Views { samples: Arc::new(samples), candidates: Vec::new() })
    }

    /// The same, showing the samples that `other` shows.
    pub(super) fn showing_as(mut self, other: &Views) -> Self {
        // Views that were just computed share their data with no clone yet.
        if let Some(samples) = Arc::get_mut(&mut self.samples) {
            samples.residuals.shown.clone_from(&other.samples.residuals.shown);
        }
        self
    }

    /// The comparison by views.
    pub(super) fn comparison(&self) -> &Comparison {
        &self.samples.comparison
    }

    /// The arm at every sample.
    pub(super) fn stances(&self) -> &[ArmPose] {
        &self.samples.residuals.stances
    }

    /// Indices of the samples that are drawn.
    pub(super) fn shown(&self) -> &[usize] {
        &self.samples.residuals.shown
    }

    /// Lengths of the residuals of the drawn samples, um.
    pub(super) fn lengths_um(&self) -> Value {
        let Residuals { points, shown, .. } = &self.samples.residuals;
        shorts(shown.iter().map(|&i| points[i].residual.norm() / UM))
    }

    /// Fits the best candidates one by one, skipping those that the data do not determine.
    pub fn look_at_the_best(&mut self, subject: &PageSubject<'_>, page_model: &PageModel) {
        let best: Vec<String> = page_model.candidates().into_iter().take(MOST).collect();
        for effect in best {
            if let Ok(Some(candidate)) = self.fit_candidate(subject, page_model, &effect) {
                self.keep(candidate, page_model);
            }
        }
    }

    /// Fits a candidate of the diagnosis, named by the id by which a model accepts it; `None` if the diagnosis does not name
    /// it.
    ///
    /// # Errors
    /// If the data do not determine it.
    pub fn fit_candidate(
        &self,
        subject: &PageSubject<'_>,
        page_model: &PageModel,
        effect: &str,
    ) -> Result<Option<FittedCandidate>, IdentifyError> {
        let mut all = Offered::all(subject.model, &page_model.ladder_step.diagnosis).into_iter();
        let Some(offered) = all.find(|o| o.effect == effect) else { return Ok(None) };
        let Samples { residuals, comparison, .. } = &*self.samples;
        Candidate::of(offered, subject.datasets, residuals, comparison).map(|c| Some(FittedCandidate(c)))
    }

    /// Keeps a fitted candidate, in the order of the diagnosis.
    pub fn keep(&mut self, FittedCandidate(candidate): FittedCandidate, page_model: &PageModel) {
        if self.has(&candidate.effect) {
            return;
        }
        let order = page_model.candidates();
        let rank = |effect: &str| order.iter().position(|e| e == effect);
        let place = self.candidates.partition_point(|c| rank(&c.effect) < rank(&candidate.effect));
        self.candidates.insert(place, Arc::new(candidate));
    }

    /// True if a candidate was fitted.
    pub fn has(&self, effect: &str) -> bool {
        self.candidates.iter().any(|c| c.effect == effect)
    }

    /// The part of the document that shows individual samples.
    pub fn json(&self, page_model: &PageModel) -> Value {
        let Samples { comparison, residuals, beyond } = &*self.samples;
        let first = self.candidates.first().map(Arc::as_ref);
        json!({
            "telling": telling(&page_model.ladder_step.diagnosis, residuals, first, comparison),
            "comparison": documents::Comparison::of(comparison, page_model.forecast().as_ref(), beyond),
            "residuals": residuals.json(comparison),
            "candidates": self.candidates.iter().map(|c| c.json()).collect::<Vec<_>>(),
        })
    }

    /// A fitted candidate and its most informative picture; `None` if it was not fitted.
    pub fn candidate_json(&self, page_model: &PageModel, effect: &str) -> Option<Value> {
        let candidate = self.candidates.iter().find(|c| c.effect == effect)?;
        let Samples { comparison, residuals, .. } = &*self.samples;
        let picture = telling_of(&page_model.ladder_step.diagnosis, residuals, candidate, comparison);
        Some(json!({"candidate": candidate.json(), "telling": picture}))
    }
}
