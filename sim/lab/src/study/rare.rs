//! Studies of rare robots: the worst are sampled more often than by the scenario, and every trial has a weight.
//!
//! Where to look is found from the response of the errors at the validation poses to every sampled size, by trials with the
//! same random streams in which one size is one sigma up or down. These trials have numbers that no study has.

use calibench::files::with_reasons;
use calibench::identify::problem::Use;
use calibench::measure::dataset::NamedDataset;
use calibench_sim::plans::Plans;
use calibench_sim::random::Streams;
use calibench_sim::run::{Methods, trial};
use calibench_sim::scenario::Scenario;
use calibench_sim::tilt::{QuadraticForm, Tilt};
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::Extent;

/// Number of trials without sampled errors, whose mean is the part of the errors that is not sampled.
const UNDRAWN: u64 = 16;

/// Draws the robots of a scenario so that errors which `share` of them stay below are ordinary; of the TriCal, unless the
/// tracker alone is studied.
pub(super) fn tilt(scenario: &Scenario, plans: &Plans, methods: Methods, share: f64) -> Result<Tilt, String> {
    let drawn = scenario.truth().drawn_count();
    if drawn == 0 {
        return Err("samples no error of the robot: all robots are alike".into());
    }
    let method = if methods == Methods::Tracker { Methods::Tracker } else { Methods::Trical };
    let errors = |drawn: DVector<f64>, number: u64| errors(scenario, plans, method, drawn, Extent::END + number);
    let undrawn: Vec<Result<DVector<f64>, String>> =
        (0..UNDRAWN).into_par_iter().map(|k| errors(DVector::zeros(drawn), k)).collect();
    let failed = undrawn.iter().find_map(|e| e.as_ref().err()).cloned();
    let undrawn: Vec<DVector<f64>> = undrawn.into_iter().flatten().collect();
    let Some(first) = undrawn.first() else {
        return Err(format!("cannot be calibrated without its sampled errors: {}", failed.unwrap_or_default()));
    };
    let offset = undrawn.iter().fold(DVector::zeros(first.len()), |sum, e| sum + e) / undrawn.len() as f64;
    let columns: Vec<DVector<f64>> = (0..drawn)
        .into_par_iter()
        .map(|k| {
            let at = |size: f64| errors(DVector::from_fn(drawn, |i, _| if i == k { size } else { 0.0 }), UNDRAWN + k as u64);
            // A trial that fails tells nothing of the response: its robots are then sampled as stated along this direction.
            match (at(1.0), at(-1.0)) {
                (Ok(up), Ok(down)) => (up - down) * 0.5,
                _ => DVector::zeros(offset.len()),
            }
        })
        .collect();
    let form = QuadraticForm::of(&DMatrix::from_columns(&columns), &offset);
    Tilt::towards(form, share).ok_or_else(|| "has sampled errors that change no error at the validation poses".into())
}

/// Errors at the validation poses after the calibration of the robot with these sampled errors, three components a pose, m.
fn errors(
    scenario: &Scenario,
    plans: &Plans,
    method: Methods,
    drawn: DVector<f64>,
    number: u64,
) -> Result<DVector<f64>, String> {
    let scenario = scenario.tilted(Tilt::fixed(drawn));
    let streams = Streams { seed: scenario.seed, trial: number };
    let done = trial(&scenario, plans, streams, method).map_err(|e| with_reasons(&e))?;
    let (method, _) = done.methods.into_iter().next().ok_or("no method")?.map_err(|e| with_reasons(&e))?;
    let prediction = method.calibration.predict(&[NamedDataset::new("validation", &done.validation)], Use::Validation);
    let residuals = prediction.map_err(|e| with_reasons(&e))?.residuals;
    Ok(DVector::from_iterator(3 * residuals.len(), residuals.iter().flat_map(|r| r.iter().copied())))
}
