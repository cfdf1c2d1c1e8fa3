//! One trial at one point: the whole procedure, and one row of numbers per method.

use calibench::assess::diagnose;
use calibench::identify::IdentifyError;
use calibench::units::MM;

use super::Point;
use super::rows::{Finding, Numbers, Row};
use calibench::files::with_reasons;
use calibench_sim::random::Streams;
use calibench_sim::run::{Method, Run, run as procedure};

/// The methods of every scenario, in the order of their rows.
pub const METHODS: [&str; 2] = ["trical", "tracker"];

/// Runs a point once: one row per method. Failures are reported in the rows.
pub(super) fn trial(point: &Point, diagnosed: bool, trial: u64) -> [Row; 2] {
    let failed = |reason: &str| METHODS.map(|method| Row { method, outcome: Err(reason.to_owned()) });
    let plans = match &point.plans {
        Ok(plans) => plans,
        Err(reason) => return failed(reason),
    };
    let streams = Streams { seed: point.scenario.seed, trial };
    match procedure(&point.scenario, plans.as_ref().clone(), streams, &mut ()) {
        Ok(run) => [&run.trical, &run.tracker].map(|method| row(&run, method, diagnosed)),
        Err(error) => failed(&with_reasons(&error)),
    }
}

fn row(run: &Run, method: &Method, diagnosed: bool) -> Row {
    let finding = if diagnosed { finding(method) } else { Ok(None) };
    Row { method: method.name, outcome: finding.map(|finding| numbers(run, method, finding)).map_err(|e| with_reasons(&e)) }
}

fn numbers(run: &Run, method: &Method, finding: Option<Finding>) -> Numbers {
    let (v, c) = (&method.validation, &method.calibration);
    let by_trical = method.name == METHODS[0];
    let [.., p95] = v.quantiles;
    let last = method.dataset.samples.iter().filter_map(|s| s.time_s).reduce(f64::max);
    // The tracker starts when the TriCal is done.
    let begun = if by_trical { Some(0.0) } else { method.dataset.samples.iter().filter_map(|s| s.time_s).reduce(f64::min) };
    Numbers {
        errors_mm: [v.mean, v.max, v.std, v.rms, p95].map(|e| e / MM),
        before_mm: [run.before.mean, run.before.max].map(|e| e / MM),
        residual_mm: c.rms / MM,
        chi2_per_dof: c.chi2_per_dof,
        dof: c.dof,
        rank: c.rank,
        measured: method.dataset.samples.len(),
        failed: if by_trical { run.campaign.probings.iter().filter(|p| p.probing.outcome.is_err()).count() } else { 0 },
        readings_mean: by_trical.then(|| run.readings_mean()),
        cell_s: last.zip(begun).map(|(last, begun)| last - begun),
        finding,
        z: method.score.parameters.iter().map(|p| (p.name.clone(), p.z())).collect(),
    }
}

fn finding(method: &Method) -> Result<Option<Finding>, IdentifyError> {
    let diagnosis = diagnose(&[(method.name, &method.dataset)], &method.calibration.model)?;
    let effect = diagnosis.findings.first().map(|f| f.hypothesis.in_model.clone()).unwrap_or_default();
    Ok(Some(Finding { verdict: diagnosis.verdict.name(), effect }))
}
