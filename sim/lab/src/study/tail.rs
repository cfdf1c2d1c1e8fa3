//! The tail of a distribution from weighted trials, in little memory.

use std::collections::BTreeMap;

use serde::Serialize;

use super::bands::HALF_WIDTH;
use super::distribution::{bin, middle};

/// A bound is stated only where the trials beyond it count like this many of equal weight: fewer have no reliable spread
/// (decision 0037).
const LEAST_BEYOND: f64 = 10.0;

/// Weights and squared weights of numbers by their leading bits, as [`Distribution`](super::Distribution) counts them.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Tail {
    bins: BTreeMap<u64, [f64; 2]>,
    /// Of trials without a number: a robot that could not be calibrated is within no error.
    beyond: [f64; 2],
    trials: u64,
}

/// The error that a share of the robots stay within.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct TailQuantile {
    /// Share of the robots.
    pub share: f64,
    /// The error, mm; `None` if more than the others fail.
    pub value: Option<f64>,
    /// Bounds for infinitely many trials, covered in 95 of 100 studies; `None` if too few trials are beyond.
    pub low: Option<f64>,
    /// Upper bound.
    pub high: Option<f64>,
    /// Number of trials.
    pub trials: u64,
    /// Trials of a study without weights that is as certain of the share beyond the error.
    pub plain_trials: Option<f64>,
}

impl Tail {
    /// Adds a trial; a number that is not finite lies beyond all others.
    pub fn add(&mut self, value: f64, weight: f64) {
        let place = if value.is_finite() { self.bins.entry(bin(value)).or_default() } else { &mut self.beyond };
        place[0] += weight;
        place[1] += weight * weight;
        self.trials += 1;
    }

    /// The error that `share` of the robots stay within.
    ///
    /// The weighted share of trials beyond an error is the mean of independent bounded numbers, with the standard error
    /// of their spread; the bounds are the errors at which 95 % intervals of that mean begin and cease to contain `1 - share`.
    pub fn quantile(&self, share: f64) -> TailQuantile {
        let (n, allowed) = (self.trials as f64, 1.0 - share);
        let of = |[w, w2]: [f64; 2]| {
            let mean = w / n;
            (mean, ((w2 / n - mean * mean).max(0.0) / n).sqrt())
        };
        let mut sums = self.beyond;
        let mut found = TailQuantile { share, value: None, low: None, high: None, trials: self.trials, plain_trials: None };
        // Places at which each is passed, from the largest number down; before the first they are beyond all numbers.
        let (mean, sigma) = of(sums);
        let passed = |mean: f64| mean > allowed;
        let [mut high, mut value] = [passed(mean + HALF_WIDTH * sigma), passed(mean)];
        if passed(mean - HALF_WIDTH * sigma) {
            return found;
        }
        for (&place, [w, w2]) in self.bins.iter().rev() {
            let enough = sums[0] * sums[0] >= LEAST_BEYOND * sums[1] && sums[1] > 0.0;
            sums = [sums[0] + w, sums[1] + w2];
            let (mean, sigma) = of(sums);
            if !high && passed(mean + HALF_WIDTH * sigma) {
                high = true;
                found.high = enough.then(|| middle(place));
            }
            if !value && passed(mean) {
                value = true;
                found.value = Some(middle(place));
                found.plain_trials = (sigma > 0.0).then(|| share * allowed / (sigma * sigma));
            }
            if passed(mean - HALF_WIDTH * sigma) {
                found.low = Some(middle(place));
                break;
            }
        }
        found
    }
}

#[cfg(test)]
mod tests {
    use calibench_sim::random::Streams;
    use calibench_sim::tilt::{QuadraticForm, Tilt};
    use nalgebra::{DMatrix, DVector};
    use rand::RngExt;
    use rand_distr::StandardNormal;

    use super::*;

    /// Number of sampled errors of a robot.
    const DRAWN: usize = 12;
    /// Number of poses at which they act.
    const POSES: usize = 60;

    /// Robots whose error is not the one that is tilted for: its mean, bent, with noise.
    struct Robots {
        response: DMatrix<f64>,
        tilt: Tilt,
    }

    impl Robots {
        fn new(share: f64) -> Self {
            let mut random = Streams { seed: 8, trial: 0 }.stream("response");
            let response = DMatrix::from_fn(POSES, DRAWN, |_, k| random.sample::<f64, _>(StandardNormal) / (1.0 + k as f64));
            let offset = DVector::repeat(POSES, 0.3);
            let tilt = Tilt::towards(QuadraticForm::of(&response, &offset), share).expect("it responds");
            Robots { response, tilt }
        }

        /// Error and weight of a trial; without weights as the scenario draws.
        fn trial(&self, streams: &Streams, weighted: bool) -> (f64, f64) {
            let mut random = streams.stream("effects");
            let standard: Vec<f64> = (0..DRAWN).map(|_| random.sample(StandardNormal)).collect();
            let x = if weighted { self.tilt.drawn(standard, streams) } else { standard };
            let weight = if weighted { self.tilt.weight(&x) } else { 1.0 };
            let felt = &self.response * DVector::from_vec(x);
            let noise = 0.2 * random.sample::<f64, _>(StandardNormal);
            let mean = felt.iter().map(|e| (e + 0.3 + 0.03 * e * e).abs()).sum::<f64>() / POSES as f64;
            (mean + noise.abs(), weight)
        }

        fn study(&self, seed: u64, trials: u64, weighted: bool) -> Tail {
            let mut tail = Tail::default();
            for trial in 0..trials {
                let (error, weight) = self.trial(&Streams { seed, trial }, weighted);
                tail.add(error, weight);
            }
            tail
        }
    }

    /// 300 studies of 500 trials against one of 400,000 without weights: the share beyond is unbiased, its standard error is
    /// the one stated, bounds hold what they promise, and 20 times the trials are saved.
    #[test]
    fn rare_studies_are_unbiased_honest_and_twenty_times_as_quick() {
        /// Quantile that is estimated.
        const SHARE: f64 = 0.999;
        /// Number of simulated studies.
        const STUDIES: u64 = 300;
        /// Number of trials of each study.
        const TRIALS: u64 = 500;
        let robots = Robots::new(SHARE);
        let plain = robots.study(1, 400_000, false).quantile(SHARE);
        let [truth, least, most] = [plain.value, plain.low, plain.high].map(|v| v.expect("trials enough"));
        let (mut held, mut stated, mut shares, mut saved) = (0, 0, Vec::new(), 0.0);
        for study in 0..STUDIES {
            let tail = robots.study(1000 + study, TRIALS, true);
            let found = tail.quantile(SHARE);
            // A bound that is not stated holds.
            let (low, high) = (found.low.unwrap_or(0.0), found.high.unwrap_or(f64::INFINITY));
            stated += usize::from(found.high.is_some());
            held += usize::from(low <= most && least <= high);
            saved += found.plain_trials.expect("beyond") / TRIALS as f64 / STUDIES as f64;
            let beyond: f64 = tail.bins.range(bin(truth)..).map(|(_, [w, _])| w).sum::<f64>() + tail.beyond[0];
            shares.push(beyond / TRIALS as f64);
        }
        let mean = shares.iter().sum::<f64>() / STUDIES as f64;
        let spread = (shares.iter().map(|s| (s - mean).powi(2)).sum::<f64>() / (STUDIES - 1) as f64).sqrt();
        let (here, there) = (spread / (STUDIES as f64).sqrt(), (0.001 / 400_000.0_f64).sqrt());
        assert!((mean - 0.001).abs() < 4.0 * here.hypot(there), "{mean} +- {here} +- {there}");
        // The spread of the studies themselves, not only the one they state.
        let gained = 0.001 * 0.999 / (spread * spread) / TRIALS as f64;
        assert!(gained > 20.0 && saved > 20.0, "{gained} {saved}");
        assert!((saved / gained).sqrt() > 0.8 && (saved / gained).sqrt() < 1.3, "stated {saved}, found {gained}");
        println!("saved {gained:.1}, stated {saved:.1}; {held} of {STUDIES} bands held, {stated} had an upper bound");
        assert!(stated as u64 > STUDIES * 9 / 10, "{stated} of {STUDIES}");
        // 95 % of 300: 285 +- 3.8.
        assert!(held as f64 / STUDIES as f64 > 0.95 - 4.0 * 0.0126, "{held} of {STUDIES}");
    }

    /// With weights of one, the quantile is that of the counts, and a study counts as its own number of trials.
    #[test]
    fn without_weights_a_tail_is_a_quantile() {
        let mut tail = Tail::default();
        (1..=2000).for_each(|k| tail.add(f64::from(k), 1.0));
        let found = tail.quantile(0.95);
        assert!((found.value.expect("a number") / 1900.0 - 1.0).abs() < 3e-4, "{found:?}");
        assert!((found.plain_trials.expect("a spread") / 2000.0 - 1.0).abs() < 0.03);
        let (low, high) = (found.low.expect("a bound"), found.high.expect("a bound"));
        // 100 +- 1.96 sqrt(95) beyond.
        assert!((low - 1881.0).abs() < 3.0 && (high - 1919.0).abs() < 3.0, "{low} {high}");
    }

    #[test]
    fn few_trials_bound_nothing_and_failures_are_beyond_all() {
        let mut tail = Tail::default();
        (0..50).for_each(|k| tail.add(f64::from(k), 1.0));
        let found = tail.quantile(0.99);
        assert_eq!(found.high, None, "{found:?}");
        (0..50).for_each(|_| tail.add(f64::NAN, 1.0));
        let found = tail.quantile(0.9);
        assert_eq!((found.value, found.low, found.high), (None, None, None));
    }
}
