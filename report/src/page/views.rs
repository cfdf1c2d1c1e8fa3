//! Views of a fit's residuals, and the share of them that candidates would explain.

use serde_json::{Value, json};

use super::PageSubject;
use super::candidate::{Candidate, MOST, Offered};
use super::page_model::PageModel;
use super::residuals::Residuals;
use super::shorts;
use super::space::Stance;
use super::telling::{telling, telling_of};
use crate::documents;
use calibench::assess::{Comparison, Extrapolation, Place};
use calibench::identify::{IdentifyError, Use};
use calibench::units::UM;

/// The parts of a page that show individual samples.
pub struct Views {
    comparison: Comparison,
    residuals: Residuals,
    beyond: Extrapolation,
    /// The candidates fitted so far, the best first unless requested by name.
    candidates: Vec<Candidate>,
}

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
        Ok(Views {
            comparison: Comparison::of(calibration, datasets, Use::Fit)?,
            residuals: Residuals::new(datasets, model, spoken_of)?,
            beyond: Extrapolation::of_samples(&calibration.robot, &calibration.joint_ranges, model, datasets, |s| {
                Use::Fit.takes(s)
            }),
            candidates: Vec::new(),
        })
    }

    /// The same, showing the samples that `other` shows.
    pub(super) fn showing_as(mut self, other: &Views) -> Self {
        self.residuals.shown.clone_from(&other.residuals.shown);
        self
    }

    /// The comparison by views.
    pub(super) fn comparison(&self) -> &Comparison {
        &self.comparison
    }

    /// The arm at every sample.
    pub(super) fn stances(&self) -> &[Stance] {
        &self.residuals.stances
    }

    /// Indices of the samples that are drawn.
    pub(super) fn shown(&self) -> &[usize] {
        &self.residuals.shown
    }

    /// Lengths of the residuals of the drawn samples, um.
    pub(super) fn lengths_um(&self) -> Value {
        let Residuals { points, shown, .. } = &self.residuals;
        shorts(shown.iter().map(|&i| points[i].residual.norm() / UM))
    }

    /// Fits the best candidates one by one, skipping those that the data do not determine.
    pub fn look_at_the_best(&mut self, subject: &PageSubject<'_>, page_model: &PageModel) {
        let best: Vec<Offered> =
            Offered::all(subject.model, &page_model.ladder_step.diagnosis).into_iter().take(MOST).collect();
        for offered in best {
            self.look(subject, offered).ok();
        }
    }

    /// Fits a candidate of the diagnosis, unless that has been done, and returns its index among those fitted. `effect` is the
    /// id by which a model accepts it; without one the first candidate is taken. `None` if the diagnosis does not name it.
    ///
    /// # Errors
    /// If the data do not determine it.
    pub fn look_at(
        &mut self,
        subject: &PageSubject<'_>,
        page_model: &PageModel,
        effect: Option<&str>,
    ) -> Result<Option<usize>, IdentifyError> {
        let mut all = Offered::all(subject.model, &page_model.ladder_step.diagnosis).into_iter();
        let Some(offered) = all.find(|o| effect.is_none_or(|e| o.effect == e)) else { return Ok(None) };
        if let Some(place) = self.candidates.iter().position(|c| c.effect == offered.effect) {
            return Ok(Some(place));
        }
        self.look(subject, offered)?;
        Ok(Some(self.candidates.len() - 1))
    }

    fn look(&mut self, subject: &PageSubject<'_>, offered: Offered) -> Result<(), IdentifyError> {
        self.candidates.push(Candidate::of(offered, subject.datasets, &self.residuals, &self.comparison)?);
        Ok(())
    }

    /// The part of the document that shows individual samples.
    pub fn json(&self, page_model: &PageModel) -> Value {
        let Views { comparison, residuals, beyond, candidates } = self;
        json!({
            "telling": telling(&page_model.ladder_step.diagnosis, residuals, candidates, comparison),
            "comparison": documents::Comparison::of(comparison, page_model.forecast().as_ref(), beyond),
            "residuals": residuals.json(comparison),
            "candidates": candidates.iter().map(Candidate::json).collect::<Vec<_>>(),
        })
    }

    /// A fitted candidate and its most informative picture; null if the index is out of range.
    pub fn candidate_json(&self, page_model: &PageModel, place: usize) -> Value {
        let Some(candidate) = self.candidates.get(place) else { return Value::Null };
        let picture = telling_of(&page_model.ladder_step.diagnosis, &self.residuals, candidate, &self.comparison);
        json!({"candidate": candidate.json(), "telling": picture})
    }
}
