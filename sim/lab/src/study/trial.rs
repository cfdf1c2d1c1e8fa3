//! One trial at one point: the whole procedure, and one row of numbers per method.

use calibench::diagnosis::diagnose;
use calibench::identify::calibration::IdentifyError;
use calibench::measure::campaign::CampaignRecord;
use calibench::measure::dataset::NamedDataset;
use calibench::residuals::Validation;
use calibench::units::MM;

use super::Point;
use super::rows::{Finding, Numbers, Row};
use calibench::files::with_reasons;
use calibench_sim::random::Streams;
use calibench_sim::run::{Method, Methods, RunError, Trial, trial as calibrate};

/// Runs a point once: one row per method. Failures are reported in the rows.
pub(super) fn trial(point: &Point, methods: Methods, diagnosed: bool, trial: u64) -> Vec<Row> {
    let failed = |reason: &str| {
        let row = |method: &&'static str| Row { method, outcome: Err(reason.to_owned()) };
        methods.each().iter().map(row).collect()
    };
    let plans = match &point.plans {
        Ok(plans) => plans,
        Err(reason) => return failed(reason),
    };
    let streams = Streams { seed: point.scenario.seed, trial };
    match calibrate(&point.scenario, plans, streams, methods) {
        Ok(Trial { campaign, methods: done, .. }) => {
            let row = |(&method, done): (&&'static str, Result<(Method, Validation), RunError>)| {
                let outcome = done.map_err(|e| with_reasons(&e)).and_then(|(done, before)| {
                    let finding = if diagnosed { Some(finding(&done).map_err(|e| with_reasons(&e))?) } else { None };
                    Ok(numbers(&campaign, &done, &before, finding))
                });
                Row { method, outcome }
            };
            methods.each().iter().zip(done).map(row).collect()
        }
        Err(error) => failed(&with_reasons(&error)),
    }
}

fn numbers(campaign: &CampaignRecord, method: &Method, before: &Validation, finding: Option<Finding>) -> Numbers {
    let (v, c) = (&method.validation, &method.calibration);
    let by_trical = method.name == Methods::Trical.name();
    let [.., p95] = v.quantiles;
    let last = method.dataset.samples.iter().filter_map(|s| s.time_s).reduce(f64::max);
    // The tracker starts when the TriCal is done.
    let begun = if by_trical { Some(0.0) } else { method.dataset.samples.iter().filter_map(|s| s.time_s).reduce(f64::min) };
    Numbers {
        errors_mm: [v.mean, v.max, v.std, v.rms, p95].map(|e| e / MM),
        before_mm: [before.mean, before.max].map(|e| e / MM),
        residual_mm: c.rms / MM,
        chi2_per_dof: c.chi2_per_dof,
        dof: c.dof,
        rank: c.rank,
        measured: method.dataset.samples.len(),
        failed: if by_trical { campaign.probings.iter().filter(|p| p.probing.outcome.is_err()).count() } else { 0 },
        readings_mean: by_trical.then(|| campaign.readings_mean()),
        cell_s: last.zip(begun).map(|(last, begun)| last - begun),
        finding,
        z: method.score.parameters.iter().map(|p| (p.name.clone(), p.z())).collect(),
    }
}

fn finding(method: &Method) -> Result<Finding, IdentifyError> {
    let diagnosis = diagnose(&[NamedDataset::new(method.name, &method.dataset)], &method.calibration.model)?;
    let effect = diagnosis.findings.first().map_or_else(String::new, |f| f.hypothesis.in_model.to_string());
    Ok(Finding { verdict: diagnosis.verdict.name(), effect })
}
