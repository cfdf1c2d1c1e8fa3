//! The order of the methods over all divisions.

use std::collections::BTreeMap;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::Serialize;

use super::Judged;
use super::spread::{median, percentiles};

/// Resamples of the robots, for the interval of a mean ratio.
const RESAMPLES: usize = 2000;

/// Expected over measured mean error within these bounds is fair.
const FAIR: std::ops::RangeInclusive<f64> = 0.8..=1.25;

/// More than this over the default model is worse: the same bound as for the recommendation in docs/robots.
const WORSE: f64 = 1.02;

/// One method on one division.
#[derive(Debug, Clone, Serialize)]
pub struct Entry {
    /// Name of the method.
    pub method: String,
    /// Name of the robot.
    pub robot: String,
    /// Name of the data and of the division.
    pub division: String,
    /// Kind of division.
    pub kind: crate::prove::Division,
    /// Its errors; `None` if it gave no prediction.
    pub judged: Option<Judged>,
    /// Mean error over that of the default model; 1 without a prediction, since the default model then stays in use.
    pub ratio: f64,
    /// Time that it took, s.
    pub seconds: f64,
    /// Why it gave no prediction.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fault: Option<String>,
}

/// One method over all divisions.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Standing {
    /// Name of the method.
    pub method: String,
    /// Number of divisions.
    pub divisions: usize,
    /// Number of divisions without a prediction.
    pub failed: usize,
    /// Geometric mean over the robots of the geometric means over their divisions: mean error over that of the default model.
    pub ratio: f64,
    /// 95 % interval of that ratio over resampled robots.
    pub interval: [f64; 2],
    /// Largest ratio of a division.
    pub worst: f64,
    /// Number of divisions in which it is worse than the default model by more than 2 %.
    pub worse: usize,
    /// Median over the divisions with a prediction of the mean 3-D error, mm.
    pub median_mm: Option<f64>,
    /// Number of divisions with a statement of the expected error, and how many of these are fair, 0.8 to 1.25 of the measured.
    pub expected: usize,
    #[allow(missing_docs)]
    pub fair: usize,
    /// Median time of a division, s.
    pub seconds: f64,
}

/// All methods, the worst first.
pub fn standings(entries: &[Entry], seed: u64) -> Vec<Standing> {
    let mut of_method: BTreeMap<&str, Vec<&Entry>> = BTreeMap::new();
    for entry in entries {
        of_method.entry(&entry.method).or_default().push(entry);
    }
    let mut all: Vec<Standing> = of_method.into_iter().map(|(method, entries)| standing(method, &entries, seed)).collect();
    all.sort_by(|a, b| b.ratio.total_cmp(&a.ratio).then_with(|| a.method.cmp(&b.method)));
    all
}

fn standing(method: &str, entries: &[&Entry], seed: u64) -> Standing {
    let mut of_robot: BTreeMap<&str, Vec<f64>> = BTreeMap::new();
    for entry in entries {
        of_robot.entry(&entry.robot).or_default().push(entry.ratio.ln());
    }
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len().max(1) as f64;
    let robots: Vec<f64> = of_robot.values().map(|logs| mean(logs)).collect();
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut resampled = || {
        let drawn: Vec<f64> = (0..robots.len()).map(|_| robots[random.random_range(0..robots.len())]).collect();
        mean(&drawn).exp()
    };
    let means: Vec<f64> = (0..RESAMPLES).map(|_| resampled()).collect();
    let interval = percentiles(&means);
    let expected: Vec<f64> = entries.iter().filter_map(|e| e.judged.as_ref()?.expected_over_measured).collect();
    Standing {
        method: method.to_owned(),
        divisions: entries.len(),
        failed: entries.iter().filter(|e| e.judged.is_none()).count(),
        ratio: mean(&robots).exp(),
        interval,
        worst: entries.iter().map(|e| e.ratio).fold(0.0, f64::max),
        worse: entries.iter().filter(|e| e.ratio > WORSE).count(),
        median_mm: median(entries.iter().filter_map(|e| Some(e.judged.as_ref()?.mean_mm)).collect()),
        expected: expected.len(),
        fair: expected.iter().filter(|ratio| FAIR.contains(ratio)).count(),
        seconds: median(entries.iter().map(|e| e.seconds).collect()).unwrap_or(f64::NAN),
    }
}
