//! Tests whether designed measurements separate rivals: robots whose diagnosis is ambiguous or wrong are measured again at
//! poses chosen in three ways, and diagnosed again.

use calibench::diagnosis::library::Library;
use calibench::diagnosis::{Examination, Verdict, diagnose_examined};
use calibench::effects::{self, Subject};
use calibench::identify::Model;
use calibench::identify::calibration::IdentifyError;
use calibench::measure::dataset::{Dataset, Measured, NamedDataset, Sample, SampleSet};
use calibench::planning::designer::{Criterion, Designer};
use calibench::planning::forecast::Rival;
use calibench::planning::pool::Pool;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use rayon::prelude::*;
use serde::Serialize;

use super::trial::TrialError;
use calibench_sim::plans::Plans;
use calibench_sim::random::Streams;
use calibench_sim::run::{RunError, measure_all};
use calibench_sim::scenario::{Scenario, written_sizes};

/// Poses per ball in the first campaign; the others form the pool to select from.
const FIRST: usize = 20;
/// Poses per ball that are measured in all.
const MEASURED: usize = 60;

/// Numbers of extra measurements.
const BATCHES: [usize; 2] = [5, 20];

/// Range of the hidden effect's detectability, in units of noise, in which it is found but not named with certainty.
const VISIBLE: std::ops::Range<f64> = 0.25..0.6;

/// Largest size, in plausible sizes, of a hidden effect; a larger one for that detectability is skipped.
const LARGEST: f64 = 5.0;

/// Performance of one way of choosing measurements.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[allow(missing_docs)] // the columns of the table
pub struct DesignRow {
    pub pool: &'static str,
    pub criterion: &'static str,
    pub measurements: usize,
    pub cases: usize,
    /// Mean probability of the ground truth.
    pub truth: f64,
    pub top_right: f64,
    /// Share with a credible set of one effect, the right one.
    pub resolved: f64,
    /// That share as expected by the designer.
    pub expected: f64,
}

/// A diagnosis compared with the ground truth.
#[derive(Clone, Copy, Default)]
struct Judged {
    truth: f64,
    top: bool,
    resolved: bool,
    expected: f64,
}

/// One way of choosing: pool, criterion, number of measurements, and the result.
type Way = (&'static str, &'static str, usize, Judged);

/// Tries `trials` robots, each with one hidden effect, and continues with those found but not named with certainty.
///
/// # Errors
/// If a robot cannot be measured or identified at all.
pub fn designs(scenario: &Scenario, seed: u64, trials: usize, done: &(dyn Fn() + Sync)) -> Result<Vec<DesignRow>, TrialError> {
    let mut scenario = scenario.clone();
    scenario.plan.poses_per_ball = MEASURED;
    scenario.plan.pool_per_ball = scenario.plan.pool_per_ball.max(4 * MEASURED);
    scenario.plan.starts = 1;
    scenario.tracker.validation_poses = 200;
    let plans = Plans::new(&scenario, seed).map_err(RunError::Plan)?;
    let data = measure_all(&scenario, Streams { seed, trial: u64::MAX }, &plans, &mut ())?.fit;
    let examination = Examination::new(&[NamedDataset::new("fit", &data)], &scenario.model)?;
    let known: Vec<String> = examination.library().candidates.iter().map(|c| c.id.to_string()).collect();
    let ids: Vec<String> = Library::of_robot(&scenario.dataset(), &scenario.model)
        .candidates
        .into_iter()
        .map(|c| c.id.into())
        .filter(|id| known.contains(id))
        .collect();
    let plain = Plain { examination, data, ids };
    let one = |trial: usize| {
        let case = followed(&scenario, &plans, &plain, Streams { seed, trial: trial as u64 });
        done();
        case
    };
    let followed: Vec<Option<Vec<Way>>> = (0..trials).into_par_iter().map(one).collect::<Result<_, _>>()?;
    let followed: Vec<Vec<Way>> = followed.into_iter().flatten().collect();
    let ways = followed.first().map_or(0, Vec::len);
    let row = |k: usize| {
        let (pool, criterion, measurements, _) = followed[0][k];
        let mean = |of: &dyn Fn(&Judged) -> f64| followed.iter().map(|w| of(&w[k].3)).sum::<f64>() / followed.len() as f64;
        DesignRow {
            pool,
            criterion,
            measurements,
            cases: followed.len(),
            truth: mean(&|j| j.truth),
            top_right: mean(&|j| f64::from(u8::from(j.top))),
            resolved: mean(&|j| f64::from(u8::from(j.resolved))),
            expected: mean(&|j| j.expected),
        }
    };
    Ok((0..ways).map(row).collect())
}

/// The robot without a hidden effect.
struct Plain {
    examination: Examination,
    data: Dataset,
    /// The effects that may be hidden.
    ids: Vec<String>,
}

/// One robot; `None` if no effect was found in it, or the right one was named with certainty at once.
fn followed(scenario: &Scenario, plans: &Plans, plain: &Plain, streams: Streams) -> Result<Option<Vec<Way>>, TrialError> {
    let mut random = streams.stream("designs");
    let cell = scenario.dataset();
    let balls = cell.ball_ids();
    let id = &plain.ids[random.random_range(0..plain.ids.len())];
    let Ok(effect) = effects::build(id, &Subject::new(&cell.robot, &balls)) else { return Ok(None) };
    let priors: Vec<f64> = effect.parameters().iter().map(|p| p.prior).collect();
    let drawn: Vec<f64> = priors.iter().map(|p| p * random.sample::<f64, _>(StandardNormal)).collect();
    let visible = plain.examination.visible_rms(&[NamedDataset::new("fit", &plain.data)], &[(id.clone(), drawn.clone())])?;
    let wanted = random.random_range(VISIBLE);
    let scale = wanted / visible.first().copied().unwrap_or(0.0).max(f64::MIN_POSITIVE);
    if drawn.iter().zip(&priors).any(|(d, p)| (scale * d / p).abs() > LARGEST) {
        return Ok(None);
    }
    let mut keys = scenario.truth().keys().clone();
    let sizes: Vec<f64> = drawn.iter().map(|d| scale * d).collect();
    keys.effects.entry(id.clone()).or_default().extend(written_sizes(effect.as_ref(), &sizes));
    let measured = match measure_all(&scenario.with_truth(keys)?, streams, plans, &mut ()) {
        Ok(measured) => measured,
        Err(RunError::Campaign(_)) => return Ok(None),
        Err(e) => return Err(e.into()),
    };
    let (first, probings) = split(&measured.fit, &mut random);
    let points = measured.validation.samples.iter().map(|s| Sample { set: SampleSet::Fit, ..s.clone() });
    let everywhere: Vec<Sample> = probings.iter().cloned().chain(points).collect();
    let data = [NamedDataset::new("fit", &first)];
    let examination = Examination::new(&data, &scenario.model)?;
    let diagnosis = diagnose_examined(&data, &examination)?;
    let now = judge(&first, &scenario.model, id)?;
    if now.resolved || !diagnosis.verdict.names_effects() {
        return Ok(None);
    }
    let rivals = Rival::of(&diagnosis, 3);
    let designer = Designer::new(&data, &examination, &rivals)?;
    let mut ways = vec![("none", "as it is", 0, now)];
    for (name, samples) in [("balls", &probings), ("balls and points", &everywhere)] {
        let pool = Pool { dataset: Dataset { samples: samples.clone(), ..first.clone() }, artifact_moved: false };
        let prospect = designer.before(&pool);
        let criteria = [
            ("designed", Criterion::Discrimination),
            ("D-optimal", Criterion::Determination),
            ("random", Criterion::Random(streams.trial)),
        ];
        for (criterion, how) in criteria {
            let chosen = prospect.choose(how, BATCHES[1])?;
            for count in BATCHES {
                let taken = &chosen[..count.min(chosen.len())];
                let more = taken.iter().map(|&k| samples[k].clone());
                let together = Dataset { samples: first.samples.iter().cloned().chain(more).collect(), ..first.clone() };
                let expected = prospect.forecast(taken)?.map_or(0.0, |o| o.resolved);
                ways.push((name, criterion, count, Judged { expected, ..judge(&together, &scenario.model, id)? }));
            }
        }
    }
    Ok(Some(ways))
}

/// The first campaign, a fixed number of random poses per ball, and the pool of the others.
fn split(data: &Dataset, random: &mut ChaCha8Rng) -> (Dataset, Vec<Sample>) {
    let mut order: Vec<usize> = (0..data.samples.len()).collect();
    for k in (1..order.len()).rev() {
        order.swap(k, random.random_range(0..=k));
    }
    let mut counts = vec![0; data.balls.len()];
    let mut is_first = vec![false; data.samples.len()];
    for k in order {
        if let Measured::Ball { ball, .. } = data.samples[k].measured
            && counts[ball] < FIRST
        {
            counts[ball] += 1;
            is_first[k] = true;
        }
    }
    let of = |first: bool| data.samples.iter().zip(&is_first).filter(move |(_, f)| **f == first).map(|(s, _)| s.clone());
    (Dataset { samples: of(true).collect(), ..data.clone() }, of(false).collect())
}

fn judge(data: &Dataset, model: &Model, truth: &str) -> Result<Judged, IdentifyError> {
    let data = [NamedDataset::new("fit", data)];
    let diagnosis = diagnose_examined(&data, &Examination::new(&data, model)?)?;
    let found = diagnosis.findings.iter().find(|f| f.hypothesis.effect == truth);
    Ok(Judged {
        truth: found.map_or(0.0, |f| f.probability),
        top: diagnosis.findings.first().is_some_and(|f| f.hypothesis.effect == truth),
        resolved: diagnosis.verdict == Verdict::Identified && diagnosis.set95 == [truth.to_owned()],
        expected: 0.0,
    })
}
