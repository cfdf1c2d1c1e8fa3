//! W4 again and again: how many trials a second one thread does and how many two, that both come to the same, and what memory it takes.
//!
//! `cargo bench -p calibench --bench throughput -- 1000000` for a million; 20,000 by default.
#![allow(clippy::unwrap_used, missing_docs)]

mod works;

use std::time::Instant;

use rayon::ThreadPoolBuilder;
use rayon::prelude::*;
use works::golden::{self, GoldenModel};
use works::trial::Trial;

/// Trials by default.
const TRIALS: u64 = 20_000;
/// Trials that a thread takes at a time.
const SHARE: u64 = 500;

/// Totals over many trials, in whole nanometres, so that the order of summation does not matter.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Sums {
    mean_nm: u64,
    max_nm: u64,
}

fn run(model: &GoldenModel, truths: &[Vec<f64>], trials: u64, threads: usize) -> (Sums, f64) {
    let pool = ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    let began = Instant::now();
    let share = |trial: &mut Trial<'_>, share: u64| {
        let mut sums = Sums::default();
        for seed in share * SHARE..((share + 1) * SHARE).min(trials) {
            let outcome = trial.run(&truths[seed as usize % truths.len()], seed);
            sums.mean_nm += (outcome.mean * 1e9).round() as u64;
            sums.max_nm += (outcome.max * 1e9).round() as u64;
        }
        sums
    };
    let shares = (0..trials.div_ceil(SHARE)).into_par_iter();
    let add = |a: Sums, b: Sums| Sums { mean_nm: a.mean_nm + b.mean_nm, max_nm: a.max_nm + b.max_nm };
    let sums = pool.install(|| shares.map_init(|| Trial::new(model), share).reduce(Sums::default, add));
    (sums, began.elapsed().as_secs_f64())
}

/// The most memory that this process ever held, MB, where the system tells.
fn most_memory_mb() -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    Some(line.trim().strip_suffix("kB")?.trim().parse::<f64>().ok()? / 1e3)
}

fn main() {
    let model = golden::golden_model();
    let truths = works::truths();
    let trials = std::env::args().find_map(|a| a.parse().ok()).unwrap_or(TRIALS);
    // In turn, and the best of each: what else runs on the machine counts less.
    let mut best = [f64::INFINITY; 2];
    let mut came_to = Vec::new();
    for _ in 0..if trials > 10 * TRIALS { 1 } else { 3 } {
        for (threads, best) in (1..).zip(&mut best) {
            let (sums, seconds) = run(&model, &truths, trials, threads);
            *best = best.min(seconds);
            came_to.push(sums);
        }
    }
    assert!(came_to.iter().all(|sums| *sums == came_to[0]), "threads changed what trials come to: {came_to:?}");
    let [one, two] = best.map(|seconds| seconds / trials as f64 * 1e6);
    println!("{trials} trials: {one:.1} us each by one thread, {two:.1} by two, {:.2} times as many a second", one / two);
    let (mean, max) = (came_to[0].mean_nm as f64 / trials as f64, came_to[0].max_nm as f64 / trials as f64);
    println!("mean error {mean:.2} nm, largest {max:.2}");
    if let Some(memory) = most_memory_mb() {
        println!("{memory:.1} MB at most");
    }
}
