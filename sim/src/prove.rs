//! Does the advice hold? Measured campaigns are divided, the whole procedure is carried out on one part as a user would, and what it
//! recommends is judged on the other, which it has not seen.

use std::time::Instant;

use calibench::assess::{ProvingGround, Validation, WorkspaceError, ladder};
use calibench::identify::{Calibration, IdentifyError, Model, Use, identify};
use calibench::measure::{Dataset, Postures, SampleSet};
use calibench::units::MM;
use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;
use serde::Serialize;

/// Poses of a campaign that was left out from which its base and tool are found.
const FRAME_POSES: usize = 50;

/// Rows judged are too few below this: a mean of n postures scatters by 0.42/sqrt(n).
const LEAST_JUDGED: usize = 15;

/// Mean of the length of a vector of three normal numbers of one-sigma 1.
const MEAN_LENGTH: f64 = 1.595_769_121_605_731;

/// One division of the data, and what came of it.
#[derive(Debug, Clone, Serialize)]
pub struct Proof {
    /// The data.
    pub robot: String,
    /// How they were divided.
    pub fold: String,
    /// Postures fitted and judged.
    pub postures: [usize; 2],
    /// Rms of the 3-D error on rows left out, mm: base, tool and links alone; the default model; what is recommended.
    pub geometry_mm: Option<f64>,
    #[allow(missing_docs)]
    pub default_mm: f64,
    #[allow(missing_docs)]
    pub recommended_mm: f64,
    /// What kind of model is recommended.
    pub kind: &'static str,
    /// Mean error there as predicted for the default and the recommended model, the instrument's noise with it, over what was measured.
    pub predicted_over_measured: [Option<f64>; 2],
    /// The verdict on the default model.
    pub verdict: &'static str,
    /// Time of the whole ladder, s.
    pub seconds: f64,
}

impl Proof {
    /// Recommended over default.
    pub fn ratio(&self) -> f64 {
        self.recommended_mm / self.default_mm
    }
}

/// A division: the rows that are fitted, by place, and those that are judged.
struct Division {
    name: String,
    is_judged: Vec<bool>,
}

/// Whole postures of a dataset left out at random, `folds` parts of them, one after the other.
///
/// # Errors
/// When the default model does not go with the data.
pub fn by_postures(name: &str, dataset: &Dataset, folds: usize, seed: u64) -> Result<Vec<Proof>, IdentifyError> {
    let of = shuffled(dataset, seed);
    let postures = of.iter().max().map_or(0, |p| p + 1);
    let division = |f: usize| Division {
        name: format!("postures {}/{folds}", f + 1),
        is_judged: of.iter().map(|p| p * folds / postures.max(1) == f).collect(),
    };
    (0..folds).map(|f| prove(name, dataset, &division(f))).collect()
}

/// Campaigns of only so many postures drawn at random, judged on all the others.
///
/// # Errors
/// When the default model does not go with the data.
pub fn by_short_campaigns(
    name: &str,
    dataset: &Dataset,
    postures: usize,
    draws: usize,
    seed: u64,
) -> Result<Vec<Proof>, IdentifyError> {
    let proof = |k: usize| {
        let is_judged = shuffled(dataset, seed.wrapping_mul(1000) + k as u64).iter().map(|p| *p >= postures).collect();
        prove(name, dataset, &Division { name: format!("{postures} postures, draw {}", k + 1), is_judged })
    };
    (0..draws).map(proof).collect()
}

/// Places of an artifact (the balls whose names agree before a `/`) left out one after the other.
///
/// # Errors
/// When the default model does not go with the data.
pub fn by_places(name: &str, dataset: &Dataset) -> Result<Vec<Proof>, IdentifyError> {
    use calibench::measure::Measured;
    let place_of = |ball: usize| dataset.balls[ball].id.split('/').next().unwrap_or_default().to_owned();
    let mut places: Vec<String> = (0..dataset.balls.len()).map(place_of).collect();
    places.dedup();
    if places.len() < 3 {
        return Ok(Vec::new());
    }
    let division = |place: &String| Division {
        name: format!("place {place}"),
        is_judged: dataset
            .samples
            .iter()
            .map(|s| matches!(s.measured, Measured::Ball { ball, .. } if place_of(ball) == *place))
            .collect(),
    };
    places.iter().map(|p| prove(name, dataset, &division(p))).collect()
}

/// Each campaign predicted by the robot of the others, its base and tool found from fifty of its poses.
///
/// # Errors
/// When the default model does not go with the data.
pub fn by_campaigns(datasets: &[(&str, &Dataset)], seed: u64) -> Result<Vec<Proof>, IdentifyError> {
    let proof = |k: usize| {
        let others: Vec<(&str, &Dataset)> = (0..datasets.len()).filter(|i| *i != k).map(|i| datasets[i]).collect();
        let (name, left_out) = datasets[k];
        let order = shuffled(left_out, seed);
        let mut judged = left_out.clone();
        for (sample, p) in judged.samples.iter_mut().zip(order) {
            sample.set = if p < FRAME_POSES { SampleSet::Fit } else { SampleSet::Validation };
        }
        let trained: Vec<&str> = others.iter().map(|(name, _)| *name).collect();
        judge(name, &format!("robot of {}", trained.join(" and ")), &others, &[(name, &judged)], true)
    };
    (0..datasets.len()).map(proof).collect()
}

/// Postures numbered in an order drawn at random, row by row.
fn shuffled(dataset: &Dataset, seed: u64) -> Vec<usize> {
    let joints: Vec<&[f64]> = dataset.samples.iter().map(|s| s.q.as_slice()).collect();
    let postures = Postures::of_joints(&joints, &vec![0; joints.len()]);
    let mut order: Vec<usize> = (0..postures.count()).collect();
    order.shuffle(&mut ChaCha8Rng::seed_from_u64(seed));
    postures.of_samples().iter().map(|&p| order[p]).collect()
}

fn prove(name: &str, dataset: &Dataset, division: &Division) -> Result<Proof, IdentifyError> {
    let part = |judged: bool| {
        let kept = dataset.samples.iter().zip(&division.is_judged).filter(|(_, j)| **j == judged);
        let set = if judged { SampleSet::Validation } else { SampleSet::Fit };
        let samples = kept.map(|(s, _)| calibench::measure::Sample { set, ..s.clone() }).collect();
        Dataset { samples, ..dataset.clone() }
    };
    judge(name, &division.name, &[(name, &part(false))], &[(name, &part(true))], false)
}

/// Carries out the ladder on `fitted`, as a user would, and judges its advice on the validation rows of `judged`.
fn judge(
    robot: &str,
    fold: &str,
    fitted: &[(&str, &Dataset)],
    judged: &[(&str, &Dataset)],
    anew: bool,
) -> Result<Proof, IdentifyError> {
    let model = Model::default_for(fitted[0].1);
    let takes = |s: &calibench::measure::Sample| Use::Validation.takes(s);
    let poses: Vec<Vec<f64>> = judged[0].1.samples.iter().filter(|s| takes(s)).map(|s| s.q.clone()).collect();
    let began = Instant::now();
    let climbed = ladder(fitted, &model, ProvingGround { poses: &poses, checks: &[] }, &mut |_| ())?;
    let seconds = began.elapsed().as_secs_f64();
    let errors = |c: &Calibration| -> Result<Option<Validation>, IdentifyError> {
        let c = if anew { c.set_up_anew() } else { c.clone() };
        Ok(Validation::of(&c.predict(judged, Use::Validation)?))
    };
    let (first, advised) = (climbed.first(), climbed.recommended());
    let measured = [errors(&first.calibration)?, errors(&advised.calibration)?];
    let geometry = identify(fitted, &Model::of(&["base_frame", "mdh"])).and_then(|c| errors(&c)).ok().flatten();
    let rms = |v: &Option<Validation>| v.as_ref().map_or(f64::NAN, |v| v.rms / MM);
    let postures = [Postures::of(fitted, |s| Use::Fit.takes(s)).count(), Postures::of(judged, takes).count()];
    // Whoever measures an error measures the instrument's noise with it.
    let seen = |w: &WorkspaceError| w.mean.expected.hypot(MEAN_LENGTH * w.noise);
    let predicted = [first, advised].map(|r| r.workspace.as_ref().map(seen));
    let over = |k: usize| {
        let measured = measured[k].as_ref().filter(|_| postures[1] >= LEAST_JUDGED)?;
        Some(predicted[k]? / measured.mean)
    };
    Ok(Proof {
        robot: robot.into(),
        fold: fold.into(),
        postures,
        geometry_mm: geometry.map(|v| v.rms / MM),
        default_mm: rms(&measured[0]),
        recommended_mm: rms(&measured[1]),
        kind: climbed.kind().name(),
        predicted_over_measured: [over(0), over(1)],
        verdict: first.diagnosis.verdict.name(),
        seconds,
    })
}

/// All proofs in a few figures.
#[derive(Debug, Clone, Serialize)]
pub struct Summary {
    /// Divisions.
    pub proofs: usize,
    /// Mean of recommended over default.
    pub mean_ratio: f64,
    /// The largest of them.
    pub worst_ratio: f64,
    /// Share that is at most 1.02.
    pub harmless: f64,
    /// Share of predicted over measured from 0.8 to 1.25: default model, recommended model.
    pub predictions_fair: [f64; 2],
}

impl Summary {
    /// Of some proofs.
    pub fn of(proofs: &[Proof]) -> Self {
        let ratios: Vec<f64> = proofs.iter().map(Proof::ratio).filter(|r| r.is_finite()).collect();
        let n = ratios.len().max(1) as f64;
        let fair = |k: usize| {
            let known: Vec<f64> = proofs.iter().filter_map(|p| p.predicted_over_measured[k]).collect();
            known.iter().filter(|r| (0.8..=1.25).contains(*r)).count() as f64 / known.len().max(1) as f64
        };
        Summary {
            proofs: proofs.len(),
            mean_ratio: ratios.iter().sum::<f64>() / n,
            worst_ratio: ratios.iter().copied().fold(0.0, f64::max),
            harmless: ratios.iter().filter(|r| **r <= 1.02).count() as f64 / n,
            predictions_fair: [fair(0), fair(1)],
        }
    }
}
