//! What an effect that the model leaves out does to the parameters that it holds.
//!
//! A fit takes what is missing for wrong values of its own parameters, as far as these can follow it: with J the whitened derivatives by
//! the fitted parameters and x those by a number of the effect, a truth with that number at size s and a model without it shift the
//! estimates by `s (J^T J)^-1 J^T x` (omitted-variable bias; in J also what is stated of balls and tool). Noise does not enter.

use nalgebra::DMatrix;

use super::examination::Examination;
use super::library::{Candidate, Library, Untestable, scanned_at};
use crate::identify::{IdentifyError, Model, Prior, Use};
use crate::measure::{Dataset, Sample};
use crate::units::Unit;

/// Periods per turn at which an effect stands in the table whose order a diagnosis has to find: the slowest that is sought, which a model
/// of links and springs can follow best.
const SLOWEST_ORDER: &str = "3";

/// A parameter that the model holds and these data determine.
#[derive(Debug, Clone, PartialEq)]
pub struct Shifted {
    /// Its name.
    pub name: String,
    /// Its unit for people and files.
    pub unit: Unit,
}

/// What one number of an effect does, at its plausible size, to every parameter that is fitted.
#[derive(Debug, Clone, PartialEq)]
pub struct Shift {
    /// Id of the effect.
    pub effect: String,
    /// Name of the number.
    pub number: String,
    /// Its plausible size, SI.
    pub size: f64,
    /// Its unit for people and files.
    pub unit: Unit,
    /// Shift of each parameter, SI, in the order of [`Shifts::parameters`].
    pub by: Vec<f64>,
}

/// Shifts of the fitted parameters by every effect that the model does not hold.
#[derive(Debug, Clone, PartialEq)]
pub struct Shifts {
    /// The fitted parameters of which nothing but the data is known.
    pub parameters: Vec<Shifted>,
    /// Number by number, the numbers of an effect side by side: of the library, then of effects that are found by a scan.
    pub shifts: Vec<Shift>,
    /// Effects that these data cannot show, and what that would need.
    pub untestable: Vec<Untestable>,
}

impl Shifts {
    /// Of the rows of set `fit`, near what `model` makes of them. Effects with an order to be found stand at three per turn, those with a
    /// moment in the middle of the session, and those of a single sample are left out.
    ///
    /// # Errors
    /// When data and model do not go together, or do not determine the unknowns.
    pub fn of(datasets: &[(&str, &Dataset)], model: &Model) -> Result<Self, IdentifyError> {
        let Library { mut candidates, untestable, .. } = Library::new(datasets, model);
        let middle = middle_s(datasets).map(|t| format!("{t:.0}"));
        for candidate in scanned_at(datasets, model, SLOWEST_ORDER, middle.as_deref()) {
            if candidates.iter().all(|c| c.id != candidate.id) {
                candidates.push(candidate);
            }
        }
        Ok(Shifts { untestable, ..Shifts::beside(&Examination::with(datasets, model, candidates)?) })
    }

    /// Of the candidates of an examination.
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
        }
    }

    /// The effects, each with its numbers.
    pub fn effects(&self) -> impl Iterator<Item = &[Shift]> {
        self.shifts.chunk_by(|a, b| a.effect == b.effect)
    }
}

/// One-sigma of the shift of parameter `k`, SI, by numbers that are independent, each of its plausible size one-sigma; of a single number
/// the amount of its shift.
pub fn shift_of(numbers: &[Shift], k: usize) -> f64 {
    numbers.iter().filter_map(|shift| shift.by.get(k)).map(|by| by * by).sum::<f64>().sqrt()
}

/// The middle of the time in which the fitted samples were taken, s; `None` where one of them has no time.
fn middle_s(datasets: &[(&str, &Dataset)]) -> Option<f64> {
    let fitted = datasets.iter().flat_map(|(_, d)| d.samples.iter().filter(|s| Use::Fit.takes(s)));
    let times = fitted.map(|s: &Sample| s.time_s).collect::<Option<Vec<f64>>>()?;
    let (first, last) = (times.iter().copied().reduce(f64::min)?, times.iter().copied().reduce(f64::max)?);
    Some(0.5 * (first + last))
}
