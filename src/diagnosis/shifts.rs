//! Shifts of the fitted parameters that are caused by an effect missing in the model.
//!
//! A fit compensates for a missing effect by wrong values of its own parameters, as far as these can reproduce it. Let J
//! be the whitened derivatives with respect to the fitted parameters, and x those with respect to a parameter of the
//! effect. If that parameter truly has size s, a model without it gives estimates shifted by `s (J^T J)^-1 J^T x`
//! (omitted-variable bias; J includes the prior knowledge of balls and tool). Noise has no influence.

use nalgebra::DMatrix;

use super::examination::Examination;
use super::library::{Candidate, Library, Untestable, scanned_at};
use crate::effects::EffectId;
use crate::effects::registry::Registry;
use crate::identify::Model;
use crate::identify::calibration::IdentifyError;
use crate::identify::problem::{Prior, Use};
use crate::measure::dataset::{NamedDataset, Sample};
use crate::units::Unit;

/// Order, in periods per turn, assumed in the table for effects whose order is found by a diagnosis: the slowest one
/// that is searched, which a model of links and springs can reproduce best.
const SLOWEST_ORDER: &str = "3";

/// A parameter that the model contains and these data determine.
#[derive(Debug, Clone, PartialEq)]
pub struct Shifted {
    /// Its name.
    pub name: String,
    /// Its unit for display and files.
    pub unit: Unit,
}

/// Shift of every fitted parameter by one parameter of a missing effect at its plausible size.
#[derive(Debug, Clone, PartialEq)]
pub struct Shift {
    /// Id of the effect.
    pub effect: EffectId,
    /// Name of the effect's parameter.
    pub number: String,
    /// Its plausible size, SI.
    pub size: f64,
    /// Its unit for display and files.
    pub unit: Unit,
    /// Shift of each parameter, SI, in the order of [`Shifts::parameters`].
    pub by: Vec<f64>,
}

/// Shifts of the fitted parameters by every effect that the model does not contain.
#[derive(Debug, Clone, PartialEq)]
pub struct Shifts {
    /// The fitted parameters with an uninformative prior.
    pub parameters: Vec<Shifted>,
    /// One entry per parameter of each effect, grouped by effect: those of the library, then those found by a scan.
    pub shifts: Vec<Shift>,
    /// Effects that these data cannot show, and the data that they need.
    pub untestable: Vec<Untestable>,
    /// The families to which the effects belong.
    pub registry: Registry,
}

impl Shifts {
    /// Computes the shifts for the rows of set `fit`, linearised about the fit of `model`. Effects with an unknown
    /// order are given three periods per turn, those with a moment the middle of the session; effects of a single
    /// sample are omitted.
    ///
    /// # Errors
    /// When the data do not fit the model, or do not determine the unknowns.
    pub fn of(datasets: &[NamedDataset<'_>], model: &Model) -> Result<Self, IdentifyError> {
        let Library { mut candidates, untestable, .. } = Library::new(datasets, model);
        let middle = middle_s(datasets).map(|t| format!("{t:.0}"));
        for candidate in scanned_at(datasets, model, SLOWEST_ORDER, middle.as_deref()) {
            if candidates.iter().all(|c| c.id != candidate.id) {
                candidates.push(candidate);
            }
        }
        Ok(Shifts { untestable, ..Shifts::beside(&Examination::with(datasets, model, candidates)?) })
    }

    /// Computes the shifts by the candidates of an examination.
    fn beside(examination: &Examination) -> Self {
        let Examination { wide, fitted, columns, spans, library, projection, .. } = examination;
        let flat: Vec<usize> =
            (0..fitted.len()).filter(|&k| wide.parameters()[fitted[k]].knowledge == Prior::Uninformative).collect();
        let parameter = |&k: &usize| {
            let parameter = &wide.parameters()[fitted[k]];
            Shifted { name: parameter.name.clone(), unit: parameter.spec.unit }
        };
        let moved: DMatrix<f64> = projection.absorbed(projection.of_columns.clone());
        let shift = |candidate: &Candidate, c: usize| {
            let number = &wide.parameters()[columns[c].parameter];
            Shift {
                effect: candidate.id.clone(),
                number: number.name.clone(),
                size: columns[c].plausible,
                unit: number.spec.unit,
                by: flat.iter().map(|&k| moved[(k, c)]).collect(),
            }
        };
        let of_candidate = |(candidate, span): (&Candidate, &super::examination::Span)| {
            span.range().map(|c| shift(candidate, c)).collect::<Vec<_>>()
        };
        Shifts {
            parameters: flat.iter().map(parameter).collect(),
            shifts: library.candidates.iter().zip(spans).flat_map(of_candidate).collect(),
            untestable: Vec::new(),
            registry: examination.model.registry.clone(),
        }
    }

    /// The shifts grouped by effect.
    pub fn effects(&self) -> impl Iterator<Item = &[Shift]> {
        self.shifts.chunk_by(|a, b| a.effect == b.effect)
    }
}

/// One-sigma of the shift of fitted parameter `k`, SI, by independent parameters of an effect, each with its plausible
/// size as one sigma; for a single parameter, the absolute value of its shift.
pub fn shift_of(numbers: &[Shift], k: usize) -> f64 {
    numbers.iter().filter_map(|shift| shift.by.get(k)).map(|by| by * by).sum::<f64>().sqrt()
}

/// Middle of the measurement time of the fitted samples, s; `None` if any of them has no time.
fn middle_s(datasets: &[NamedDataset<'_>]) -> Option<f64> {
    let fitted = datasets.iter().flat_map(|d| d.dataset.samples.iter().filter(|s| Use::Fit.takes(s)));
    let times = fitted.map(|s: &Sample| s.time_s).collect::<Option<Vec<f64>>>()?;
    let (first, last) = (times.iter().copied().reduce(f64::min)?, times.iter().copied().reduce(f64::max)?);
    Some(0.5 * (first + last))
}
