//! The residuals of a fit from every side, and what candidates would take of them.

use serde_json::{Value, json};

use super::PageSubject;
use super::candidate::{Candidate, MOST, Offered};
use super::residuals::Residuals;
use super::standing::Standing;
use super::telling::{telling, telling_of};
use crate::assess::{Comparison, Extrapolation, Place};
use crate::identify::{IdentifyError, Use};
use crate::report::comparison_json;

/// What a page shows of every sample.
pub struct Views {
    comparison: Comparison,
    residuals: Residuals,
    beyond: Extrapolation,
    /// Those that were looked at, the best first where they were not asked for by name.
    candidates: Vec<Candidate>,
}

impl Views {
    /// Looks at every sample of a standing; at no candidate yet.
    ///
    /// # Errors
    /// When the data do not determine the model.
    pub fn new(subject: &PageSubject<'_>, standing: &Standing) -> Result<Self, IdentifyError> {
        let PageSubject { datasets, model, .. } = subject;
        let diagnosis = &standing.rung.diagnosis;
        let calibration = &standing.rung.calibration;
        let spoken_of = |id: &str| diagnosis.findings.iter().any(|f| f.hypothesis.place == Some(Place::Sample(id.into())));
        Ok(Views {
            comparison: Comparison::of(calibration, datasets, Use::Fit)?,
            residuals: Residuals::new(datasets, model, spoken_of)?,
            beyond: Extrapolation::of_samples(&calibration.joint_ranges, model, datasets, |s| Use::Fit.takes(s)),
            candidates: Vec::new(),
        })
    }

    /// Fits the best candidates one by one; those that the data do not determine are left out.
    pub fn look_at_the_best(&mut self, subject: &PageSubject<'_>, standing: &Standing) {
        let best: Vec<Offered> = Offered::all(subject.model, &standing.rung.diagnosis).into_iter().take(MOST).collect();
        for offered in best {
            self.look(subject, offered).ok();
        }
    }

    /// Fits a candidate of the diagnosis, by the id under which a model takes it, if that has not been done, or the first of them; its
    /// place among those that were looked at. `None` when the diagnosis does not name it.
    ///
    /// # Errors
    /// When the data do not determine it.
    pub fn look_at(
        &mut self,
        subject: &PageSubject<'_>,
        standing: &Standing,
        effect: Option<&str>,
    ) -> Result<Option<usize>, IdentifyError> {
        let mut all = Offered::all(subject.model, &standing.rung.diagnosis).into_iter();
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

    /// The part of the document that shows samples.
    pub fn json(&self, standing: &Standing) -> Value {
        let Views { comparison, residuals, beyond, candidates } = self;
        json!({
            "telling": telling(&standing.rung.diagnosis, residuals, candidates, comparison),
            "comparison": comparison_json(comparison, standing.outlook().as_ref(), beyond),
            "residuals": residuals.json(comparison),
            "candidates": candidates.iter().map(Candidate::json).collect::<Vec<_>>(),
        })
    }

    /// A candidate that was looked at, and the picture that tells most of it; null where there is none at that place.
    pub fn candidate_json(&self, standing: &Standing, place: usize) -> Value {
        let Some(candidate) = self.candidates.get(place) else { return Value::Null };
        let picture = telling_of(&standing.rung.diagnosis, &self.residuals, candidate, &self.comparison);
        json!({"candidate": candidate.json(), "telling": picture})
    }
}
