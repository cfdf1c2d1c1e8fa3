//! A diagnosis, and its repetition without the samples that disagree with all others.

use super::Examination;
use super::Verdict;
use super::hypotheses::Hypothesis;
use super::judgement::judged;
use super::{Diagnosis, Finding, Scatter, all_aside};
use crate::effects::facts::Follows;
use crate::effects::family::Family;
use crate::identify::Model;
use crate::identify::calibration::{Calibration, IdentifyError};
use crate::measure::dataset::{Dataset, NamedDataset};
use crate::residuals::misfit::{Abnormal, abnormal};
use crate::residuals::noise::{Suspect, suspects_of};

/// Finds the effect that `model` is missing, from the rows of set `fit`.
///
/// ```
/// use std::sync::Arc;
///
/// use calibench::diagnosis::{Verdict, diagnose};
/// use calibench::identify::Model;
/// use calibench::measure::dataset::{Dataset, Measured, NamedDataset, Noise, Sample};
/// use calibench::robot::kinematics::world_from_tool;
/// use calibench::robot::{FramePose, built_in};
/// use calibench::units::{UM, URAD};
///
/// let robot = Arc::new(built_in("kr6_r700").ok_or("built in")?);
/// let (base, tool) = (FramePose::default(), FramePose { xyz: [0.06, 0.01, -0.125], rz_ry_rx: [0.0; 3] });
/// let sample = |k: usize| {
///     let q: Vec<f64> = (1..=6).map(|i| 3.0 * ((k * i) as f64 * 0.618).fract() - 1.5).collect();
///     // Joint 1 turns too far by a fixed share of its angle.
///     let mut truly = q.clone();
///     truly[0] *= 1.0 + 500.0 * URAD;
///     let seen = world_from_tool(&robot, &base, &tool, &truly).translation.vector;
///     let rounded = seen.map(|x| (x / (20.0 * UM)).round() * 20.0 * UM);
///     Sample::new(format!("p{k}"), q, Measured::Point(rounded))
/// };
/// let samples = (0..60).map(sample).collect();
/// let noise = Noise { point: Some(6.0 * UM), ..Noise::default() };
/// let data = Dataset { robot: robot.clone(), base, tool, noise, samples, ..Dataset::default() };
///
/// let diagnosis = diagnose(&[NamedDataset::new("campaign", &data)], &Model::of(&["base_frame"]))?;
/// assert_eq!(diagnosis.verdict, Verdict::Identified);
/// assert_eq!(diagnosis.set95, ["joint_scale:1"]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// When the data do not fit the model, or do not determine the unknowns.
pub fn diagnose(datasets: &[NamedDataset<'_>], model: &Model) -> Result<Diagnosis, IdentifyError> {
    let examination = Examination::new(datasets, model)?;
    diagnose_examined(datasets, &examination)
}

/// As [`diagnose`], for an examination.
///
/// If single samples disagree with all others, the rest of the diagnosis excludes them by `outlier` effects, unless too few
/// would remain or an effect explains the data better.
///
/// # Errors
/// As [`diagnose`].
pub fn diagnose_examined(datasets: &[NamedDataset<'_>], examination: &Examination) -> Result<Diagnosis, IdentifyError> {
    let mut diagnosis = without_suspects(datasets, examination)?;
    if let Some(crowded) = by_crowd(datasets, examination, &diagnosis.scatter.suspects)? {
        return Ok(crowded);
    }
    // What is only supposed makes no diagnosis fail.
    let supposed = by_row_order(datasets, examination, &diagnosis).unwrap_or_default();
    // A base that moved on the way bends the zeros of joints: it comes first.
    let happened = diagnosis.findings.first().filter(|f| diagnosis.verdict.names_effects() && is_event(&diagnosis, f));
    if happened.is_some() {
        diagnosis.abnormal.clear();
    }
    let is_other = diagnosis.verdict.names_effects() || diagnosis.verdict.is_noise();
    Ok(match supposed {
        Some(event) if is_other => explained_by(event, diagnosis),
        Some(event) => beside(event, diagnosis),
        None => diagnosis,
    })
}

/// A diagnosis beside what happened if the rows stand in their order: what was found without it, as abnormal or as contributing, takes
/// its place.
fn beside(event: Finding, diagnosis: Diagnosis) -> Diagnosis {
    Diagnosis { by_row_order: Some(event), abnormal: Vec::new(), contributions: Vec::new(), ..diagnosis }
}

/// The same, where what happened is the answer: nothing else is named, and the noise is not larger than stated.
fn explained_by(event: Finding, diagnosis: Diagnosis) -> Diagnosis {
    let diagnosis = beside(event, diagnosis);
    let scatter = Scatter { larger_than_stated: None, ..diagnosis.scatter };
    Diagnosis { verdict: Verdict::Unexplained, scatter, set95: Vec::new(), explains: None, ..diagnosis }
}

/// True for something that happened once and explains much of the residual, and for a set-up that moves all the time and explains
/// nearly all.
fn is_event(diagnosis: &Diagnosis, finding: &Finding) -> bool {
    let Hypothesis { moment, explains, in_model, .. } = &finding.hypothesis;
    let moves = |family: &Family| {
        let of = |what: &[Follows]| family.follows.iter().any(|follows| what.contains(follows));
        of(&[Follows::Time]) && of(&[Follows::World, Follows::Tool])
    };
    match moment {
        Some(_) => *explains > SUPPOSED,
        None => *explains > NEARLY_ALL && diagnosis.registry.family(in_model).is_some_and(moves),
    }
}

impl Diagnosis {
    /// The abnormal parameters of a calibration of these data, as their diagnosis names them: none where something that happened on
    /// the way bends them.
    #[must_use]
    pub fn abnormal_in(datasets: &[NamedDataset<'_>], calibration: &Calibration) -> Vec<Abnormal> {
        let all = abnormal(calibration);
        let is_bent = || diagnose(datasets, &calibration.model).is_ok_and(|d| d.abnormal.is_empty());
        if all.is_empty() || is_bent() { Vec::new() } else { all }
    }
}

/// Interval at which rows without times are supposed to have been measured, s.
const ROW_S: f64 = 30.0;

/// Share of the residual that an event in the order of the rows must explain to be supposed.
const SUPPOSED: f64 = 0.4;

/// Share of the residual that a set-up must explain that moves all the time: it can follow much of what depends on postures.
const NEARLY_ALL: f64 = 0.9;

/// An event must leave at most this share of what the effects leave that are named without it.
const LEAVES: f64 = 0.6;

/// What happened in the order of the rows, where no row has a time, and neighbours err alike or nothing is named: an event that
/// explains much of the residual, at the odds of the diagnosis, and of which far less remains than of the effects that it names.
fn by_row_order(
    datasets: &[NamedDataset<'_>],
    examination: &Examination,
    diagnosis: &Diagnosis,
) -> Result<Option<Finding>, IdentifyError> {
    let has_time = has_time(datasets);
    let named = diagnosis.explains.filter(|_| diagnosis.verdict.names_effects()).unwrap_or(0.0);
    let is_open = diagnosis.verdict == Verdict::Unexplained || diagnosis.scatter.serial.is_significant();
    if has_time || !is_open {
        return Ok(None);
    }
    let timed = with_times(datasets);
    let timed = named_alike(datasets, &timed);
    let supposed = judged(&timed, &Examination::new(&timed, &examination.model)?)?;
    let names = supposed.verdict.names_effects();
    let first = supposed.findings.first().filter(|f| is_event(&supposed, f));
    Ok(first.filter(|f| names && 1.0 - f.hypothesis.explains < LEAVES * (1.0 - named)).cloned())
}

fn has_time(datasets: &[NamedDataset<'_>]) -> bool {
    datasets.iter().any(|d| d.dataset.samples.iter().any(|s| s.time_s.is_some()))
}

/// The same data, one row after the other.
fn with_times(datasets: &[NamedDataset<'_>]) -> Vec<Dataset> {
    let mut timed: Vec<Dataset> = datasets.iter().map(|d| d.dataset.clone()).collect();
    for samples in timed.iter_mut().map(|d| &mut d.samples) {
        samples.iter_mut().enumerate().for_each(|(k, s)| s.time_s = Some(ROW_S * k as f64));
    }
    timed
}

/// The same data under the names of others.
fn named_alike<'a>(names: &[NamedDataset<'a>], data: &'a [Dataset]) -> Vec<NamedDataset<'a>> {
    names.iter().zip(data).map(|(d, data)| NamedDataset::new(d.name, data)).collect()
}

/// Fewest suspects that make a crowd.
const CROWD: usize = 3;

/// Probability that so many rows stand so near to each other, or to the first or last row, by chance, below which they are a crowd.
const CROWDED: f64 = 3e-3;

/// True if suspects crowd together in the order of `rows` rows, or at its begin or end: by the range of as many uniform variates, and
/// by the farthest of them from that end.
fn is_crowd(suspects: &[Suspect], rows: usize) -> bool {
    let (Some(first), Some(last)) = (suspects.iter().map(|s| s.place).min(), suspects.iter().map(|s| s.place).max()) else {
        return false;
    };
    let k = suspects.len() as f64;
    let share = |count: usize| count as f64 / rows.max(1) as f64;
    let range = share(last - first + 1);
    let together = k * range.powf(k - 1.0) - (k - 1.0) * range.powf(k);
    let chance = together.min(2.0 * share((last + 1).min(rows - first)).powf(k));
    suspects.len() >= CROWD && suspects.iter().all(|s| s.dataset == suspects[0].dataset) && chance < CROWDED
}

/// What happened in the order of the rows, where the rows that disagree with all others crowd together in it and no row has a time: not
/// these rows are wrong then, but something warmed up, or moved, while they were measured. It must explain the data better than
/// setting them aside does.
fn by_crowd(
    datasets: &[NamedDataset<'_>],
    examination: &Examination,
    suspects: &[Suspect],
) -> Result<Option<Diagnosis>, IdentifyError> {
    if has_time(datasets) || !is_crowd(suspects, examination.problem.sample_count()) {
        return Ok(None);
    }
    let timed = with_times(datasets);
    let timed = named_alike(datasets, &timed);
    let in_order = Examination::new(&timed, &examination.model)?;
    let supposed = judged(&timed, &in_order)?;
    let happens = |f: &&Finding| {
        let family = supposed.registry.family(&f.hypothesis.in_model);
        f.hypothesis.moment.is_some() || family.is_some_and(|family| family.follows.contains(&Follows::Time))
    };
    let Some(event) = supposed.findings.first().filter(happens).cloned() else { return Ok(None) };
    let aside = all_aside(suspects).iter().fold(examination.model.clone(), |m, id| m.with(id));
    let without = Examination::new(datasets, &aside)?;
    if !explains_as_much(&in_order, &supposed, &without, suspects) {
        return Ok(None);
    }
    Ok(Some(explained_by(event, judged(datasets, examination)?)))
}

/// As [`diagnose_examined`], without regard to the order of the rows.
fn without_suspects(datasets: &[NamedDataset<'_>], examination: &Examination) -> Result<Diagnosis, IdentifyError> {
    let diagnosis = judged(datasets, examination)?;
    let suspects = suspects_of(datasets, &examination.problem, &examination.fit);
    if suspects.is_empty() {
        return Ok(diagnosis);
    }
    let aside = all_aside(&suspects).iter().fold(examination.model.clone(), |m, id| m.with(id));
    // Samples without which the model is not determined cannot be excluded.
    let Ok(without) = Examination::new(datasets, &aside) else { return Ok(diagnosis) };
    if explains_as_much(examination, &diagnosis, &without, &suspects) {
        return Ok(diagnosis);
    }
    let mut rest = judged(datasets, &without)?;
    // The finding that excludes the worst sample comes first, since it is the first step to take.
    if let Some(worst) = diagnosis.findings.iter().find(|f| f.is_sample()) {
        rest.findings.insert(0, worst.clone());
    }
    Ok(Diagnosis {
        samples: diagnosis.samples,
        verdict: Verdict::SuspectSamples,
        verdict_without_suspects: Some(rest.verdict),
        fitted: diagnosis.fitted,
        scatter: Scatter { suspects, ..rest.scatter },
        ..rest
    })
}

/// True if the first effect found without regard to the suspects explains the data better than excluding them does
/// (Bayesian information criterion): the suspects are then no accidents.
fn explains_as_much(examination: &Examination, diagnosis: &Diagnosis, without: &Examination, suspects: &[Suspect]) -> bool {
    let named = diagnosis.findings.first().filter(|f| diagnosis.verdict.names_effects() && !f.is_sample());
    let Some(first) = named else { return false };
    let n = examination.fit.dof as f64;
    let cost = |squares: f64, coefficients: usize| n * squares.max(f64::MIN_POSITIVE).ln() + coefficients as f64 * n.ln();
    let chi2 = examination.fit.chi2;
    let with_effect = cost(chi2 * (1.0 - first.hypothesis.explains), first.hypothesis.coefficients);
    with_effect < cost(without.fit.chi2, 3 * suspects.len())
}
