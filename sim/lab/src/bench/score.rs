//! The judgement of one method on one division.

use std::collections::{BTreeMap, BTreeSet};

use calibench::units::MM;
use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::Serialize;

use super::spread::percentiles;
use crate::prove::{LEAST_JUDGED, Row};

/// Resamples of the postures: the ends of a 95 % interval then scatter by some 3 % of its width.
const RESAMPLES: usize = 1000;

/// What a method says of a row.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Prediction {
    /// Position of the measured point in the frame of the robot's base, m.
    pub position: Vector3<f64>,
    /// The 3-D error that it expects there, m, if it says.
    pub expected: Option<f64>,
}

/// Errors of a method on the judged rows of a division.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Judged {
    /// Mean 3-D error, mm.
    pub mean_mm: f64,
    /// 95 % interval of the mean over resampled postures, mm.
    pub interval_mm: [f64; 2],
    /// Root mean square of the 3-D error, mm.
    pub rms_mm: f64,
    /// Largest 3-D error, mm.
    pub max_mm: f64,
    /// Expected over measured mean error, if the method says what it expects and enough postures are judged.
    pub expected_over_measured: Option<f64>,
}

/// Judges predictions of the judged rows. A ball that occurs in no fitted row is where these rows say under each method: the
/// mean of its errors is subtracted.
pub fn judge(fitted: &[Row], judged: &[Row], predictions: &[Prediction], seed: u64) -> Judged {
    let mut errors: Vec<Vector3<f64>> =
        judged.iter().zip(predictions).map(|(row, p)| row.predicted + row.error - p.position).collect();
    let known: BTreeSet<&str> = fitted.iter().filter_map(|row| row.free_ball.as_deref()).collect();
    let mut unknown: BTreeMap<&str, Vec<usize>> = BTreeMap::new();
    for (k, row) in judged.iter().enumerate() {
        if let Some(ball) = row.free_ball.as_deref().filter(|ball| !known.contains(ball)) {
            unknown.entry(ball).or_default().push(k);
        }
    }
    for places in unknown.values() {
        let mean = places.iter().map(|&k| errors[k]).sum::<Vector3<f64>>() / places.len() as f64;
        places.iter().for_each(|&k| errors[k] -= mean);
    }
    let lengths: Vec<f64> = errors.iter().map(|e| e.norm() / MM).collect();
    let n = lengths.len().max(1) as f64;
    let mean_mm = lengths.iter().sum::<f64>() / n;
    let postures: BTreeSet<usize> = judged.iter().map(|row| row.posture).collect();
    let expected: Option<f64> = predictions.iter().map(|p| p.expected).sum::<Option<f64>>().map(|sum| sum / MM / n);
    Judged {
        mean_mm,
        interval_mm: interval(judged, &lengths, seed),
        rms_mm: (lengths.iter().map(|l| l * l).sum::<f64>() / n).sqrt(),
        max_mm: lengths.iter().copied().fold(0.0, f64::max),
        expected_over_measured: expected.filter(|_| postures.len() >= LEAST_JUDGED).map(|e| e / mean_mm),
    }
}

/// The middle 95 % of the mean over postures drawn with replacement: repeats of a posture share most of their error.
fn interval(judged: &[Row], lengths: &[f64], seed: u64) -> [f64; 2] {
    let mut of_posture: BTreeMap<usize, (f64, f64)> = BTreeMap::new();
    for (row, length) in judged.iter().zip(lengths) {
        let (sum, count) = of_posture.entry(row.posture).or_default();
        *sum += length;
        *count += 1.0;
    }
    let postures: Vec<(f64, f64)> = of_posture.into_values().collect();
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut mean = || {
        let drawn = (0..postures.len()).map(|_| postures[random.random_range(0..postures.len())]);
        let (sum, count) = drawn.fold((0.0, 0.0), |(sum, count), (s, c)| (sum + s, count + c));
        sum / count
    };
    let means: Vec<f64> = (0..RESAMPLES).map(|_| mean()).collect();
    percentiles(&means)
}
