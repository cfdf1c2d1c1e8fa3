//! Detectability: the share of every candidate that the fitted model absorbs, and the smallest size at which it is
//! noticed.
//!
//! The test is the chi-square of the visible directions, `S = z^T K^+ z`, where K holds the inner products of a
//! candidate's whitened columns after projection orthogonal to the fitted model. Without the effect, S is chi-square
//! with p degrees of freedom; with coefficients beta it is non-central, with non-centrality `lambda = beta^T K beta`.
//! All candidates are tested, so the level is divided among them (Bonferroni).

use statrs::distribution::{ChiSquared, ContinuousCDF, Discrete, Poisson};

use super::examination::Examination;
use crate::effects::EffectId;
use crate::effects::registry::Registry;
use crate::identify::Model;
use crate::identify::calibration::IdentifyError;
use crate::measure::dataset::Dataset;
use crate::units::Unit;

/// Probability that noise alone raises an alarm for any of the candidates (docs/next.md).
const LEVEL: f64 = 0.05;

/// Probability that an effect of the smallest detectable size is noticed.
const POWER: f64 = 0.9;

/// Size in plausible sizes from which a candidate counts as undetectable: no robot has such a size, and the part that
/// the model does not absorb is rounding.
const ABSURD: f64 = 1e3;

/// Detectability of one candidate.
#[derive(Debug, Clone, PartialEq)]
pub struct Sight {
    /// Its id.
    pub effect: EffectId,
    /// Share of its energy that the fitted model absorbs into wrong parameter values.
    pub absorbed: f64,
    /// Remaining signal when each of its parameters has its plausible size: rms over all residuals, in units of their
    /// noise.
    pub visible: f64,
    /// Number of detectable directions of its parameters.
    pub directions: usize,
    /// Smallest size detected with 90 % power, rms over its parameters, in plausible sizes; `None` if it is
    /// undetectable.
    pub smallest: Option<f64>,
    /// Plausible size of its first parameter, SI.
    pub plausible: f64,
    /// Unit of its first parameter.
    pub unit: Unit,
}

impl Sight {
    /// Smallest detectable size of its first parameter, SI.
    pub fn smallest_size(&self) -> Option<f64> {
        Some(self.smallest? * self.plausible)
    }
}

/// Detectability of every candidate from a set of poses, the most detectable first, the undetectable last.
#[derive(Debug, Clone, PartialEq)]
pub struct Detectability {
    /// One entry per candidate.
    pub sights: Vec<Sight>,
    /// Level of each test.
    pub level: f64,
    /// Power at the smallest size.
    pub power: f64,
    /// Effects that cannot be tested, and the data that they need.
    pub untestable: Vec<super::library::Untestable>,
    /// The families to which the effects belong.
    pub registry: Registry,
}

impl Detectability {
    /// Computes the detectability for planned poses, given as samples at their nominal positions, as if the model had
    /// been fitted to them.
    ///
    /// ```
    /// use calibench::diagnosis::detectability::Detectability;
    /// use calibench::identify::Model;
    /// # use calibench::measure::dataset::{Dataset, Measured, Noise, Sample};
    /// # use calibench::robot::kinematics::world_from_tool;
    /// # use calibench::robot::{FramePose, built_in};
    /// use calibench::units::UM;
    /// # let robot = std::sync::Arc::new(built_in("ur5").ok_or("built in")?);
    /// # let sample = |k: usize| {
    /// #     let q: Vec<f64> = (1..=6).map(|i| 2.0 * ((k * i) as f64 * 0.618).fract() - 1.0).collect();
    /// #     let seen = world_from_tool(&robot, &FramePose::default(), &FramePose::default(), &q).translation.vector;
    /// #     Sample::new(format!("p{k}"), q, Measured::Point(seen))
    /// # };
    /// # let samples: Vec<Sample> = (0..40).map(sample).collect();
    /// # let plan = |noise_um: f64| {
    /// #     let noise = Noise { point: Some(noise_um * UM), ..Noise::default() };
    /// #     Dataset { robot: robot.clone(), noise, samples: samples.clone(), ..Dataset::default() }
    /// # };
    ///
    /// // Forty points of a tracker: with half the noise an eccentric joint of half the size is noticed.
    /// let model = Model::of(&["base_frame", "mdh"]);
    /// let smallest = |noise_um: f64| {
    ///     let shown = Detectability::of_plan(&plan(noise_um), &model)?;
    ///     let eccentric = shown.sights.iter().find(|sight| sight.effect == "harmonic1:3");
    ///     eccentric.and_then(|sight| sight.smallest).ok_or(Box::<dyn std::error::Error>::from("not seen"))
    /// };
    /// assert!((smallest(20.0)? / smallest(10.0)? - 2.0).abs() < 1e-6);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// When the poses do not determine the model.
    pub fn of_plan(planned: &Dataset, model: &Model) -> Result<Self, IdentifyError> {
        Ok(Detectability::of(&Examination::of_plan(planned, model)?))
    }

    /// Computes the detectability for the data of an examination.
    pub fn of(examination: &Examination) -> Self {
        let unit = if examination.fit.noise_stated { 1.0 } else { examination.remainder.unit() };
        let residuals = examination.rows.ncols().max(1) as f64;
        let candidates = &examination.library.candidates;
        let level = LEVEL / candidates.len().max(1) as f64;
        let sight = |k: usize| {
            let span = examination.spans[k];
            let energy = span.range().map(|c| examination.gram[(c, c)]).sum::<f64>().max(0.0) / unit;
            let visible = examination.visible(k);
            let directions = examination.seen(k).explained().1;
            let first = &examination.wide.parameters()[examination.columns[span.first].parameter].spec;
            Sight {
                effect: candidates[k].id.clone(),
                absorbed: 1.0 - visible,
                visible: (energy / residuals).sqrt(),
                directions,
                smallest: (directions > 0)
                    .then(|| (noncentrality(directions, level, POWER) / energy).sqrt())
                    .filter(|&size| size < ABSURD),
                plausible: first.prior,
                unit: first.unit,
            }
        };
        // A family without members on this robot has no parameters.
        let mut sights: Vec<Sight> = (0..candidates.len()).filter(|&k| examination.spans[k].count > 0).map(sight).collect();
        let size = |s: &Sight| s.smallest.unwrap_or(f64::INFINITY);
        sights.sort_by(|a, b| size(a).total_cmp(&size(b)));
        Detectability {
            sights,
            level,
            power: POWER,
            untestable: examination.library.untestable.clone(),
            registry: examination.model.registry.clone(),
        }
    }
}

/// Non-centrality at which a chi-square test with `directions` degrees of freedom at level `level` has power `power`.
///
/// The non-central chi-square is a mixture of central ones with Poisson weights of mean lambda/2 (Johnson, Kotz &
/// Balakrishnan 1995, ch. 29), `P(S > c) = sum_j Poisson(j; lambda/2) Q(c; p + 2j)`. The power increases with lambda,
/// so bisection finds it.
pub(crate) fn noncentrality(directions: usize, level: f64, power: f64) -> f64 {
    let critical = critical_value(directions, level);
    let (mut low, mut high) = (0.0, 1.0);
    while power_at(directions, critical, high) < power && high < 1e9 {
        (low, high) = (high, 2.0 * high);
    }
    while high - low > 1e-12 * high {
        let middle = 0.5 * (low + high);
        if middle <= low || middle >= high {
            break;
        }
        if power_at(directions, critical, middle) < power { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

/// Value that a chi-square variable exceeds with probability `level`.
pub(crate) fn critical_value(directions: usize, level: f64) -> f64 {
    let central = |c: f64| ChiSquared::new(directions as f64).map_or(f64::NAN, |d| d.sf(c));
    let (mut low, mut high) = (0.0, 1.0);
    while central(high) > level && high < 1e9 {
        (low, high) = (high, 2.0 * high);
    }
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if central(middle) > level { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

/// Probability that a non-central chi-square variable exceeds `critical`.
fn power_at(directions: usize, critical: f64, lambda: f64) -> f64 {
    let upper = |j: u64| ChiSquared::new(directions as f64 + 2.0 * j as f64).map_or(f64::NAN, |d| d.sf(critical));
    let Ok(weights) = Poisson::new(0.5 * lambda) else { return upper(0) };
    // Ten standard deviations of the weights on either side leave less than 1e-20.
    let (mean, reach) = (0.5 * lambda, 10.0 * (0.5 * lambda).sqrt() + 40.0);
    let (first, last) = ((mean - reach).max(0.0) as u64, (mean + reach) as u64);
    (first..=last).map(|j| weights.pmf(j) * upper(j)).sum()
}

#[cfg(test)]
mod tests {
    use nalgebra::{DMatrix, DVector};
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    use super::*;
    use crate::measure::dataset::{Measured, Sample};

    /// Reference values from R's and SciPy's non-central chi-square, to 1e-12: level, power, degrees of freedom,
    /// non-centrality.
    #[test]
    fn noncentrality_agrees_with_the_tables() {
        for (level, power, directions, expected) in [
            (0.05, 0.8, 1, 7.8488605093262045),
            (0.05, 0.9, 1, 10.507419409690758),
            (0.05, 0.9, 2, 12.653936039359188),
            (0.05, 0.9, 3, 14.171487304468291),
            (0.05, 0.9, 100, 49.29300398248798),
            (0.01, 0.99, 6, 35.02007281797014),
            (0.05 / 72.0, 0.9, 1, 21.83987034255517),
            (0.05 / 72.0, 0.9, 2, 24.798976815564462),
            (0.05 / 72.0, 0.99, 20, 61.48512587576238),
        ] {
            let found = noncentrality(directions, level, power);
            assert!((found / expected - 1.0).abs() < 1e-8, "{level} {power} {directions}: {found} for {expected}");
        }
    }

    /// Random poses, with the points at their nominal positions.
    fn planned(count: usize) -> Dataset {
        let robot = crate::robot::built_in("kr6_r700").unwrap();
        let mut random = ChaCha8Rng::seed_from_u64(4);
        let mut cell = Dataset { robot: std::sync::Arc::new(robot), ..Dataset::default() };
        cell.tool.xyz = [0.06, 0.0, -0.125];
        cell.payloads =
            vec![crate::robot::statics::Payload { name: "load".into(), mass: 6.0, com: [0.025, 0.0, -0.07].into() }];
        cell.noise.point = Some(20e-6);
        let sample = |k: usize| {
            let q: Vec<f64> = cell.robot.links.iter().map(|l| random.random_range(l.limits[0]..l.limits[1])).collect();
            let at = crate::robot::kinematics::world_from_tool(&cell.robot, &cell.base, &cell.tool, &q).translation.vector;
            Sample::new(k.to_string(), q, Measured::Point(at))
        };
        let samples = (0..count).map(sample).collect();
        Dataset { samples, ..cell }
    }

    /// Simulates data of the linear model with an effect of the smallest detectable size, projects them by reflections
    /// (not by the examination's normal equations) and tests them. Nine in ten must raise the alarm, and noise alone at
    /// the stated level.
    #[test]
    fn effects_of_the_smallest_size_are_noticed_nine_times_in_ten() {
        let examination = Examination::of_plan(&planned(60), &Model::paper()).unwrap();
        let detectability = Detectability::of(&examination);
        let mut random = ChaCha8Rng::seed_from_u64(5);
        let (m, n) = (examination.fitted.len(), examination.rows.ncols());
        let model = examination.rows.rows(0, m).transpose();
        let scaled = DMatrix::from_columns(&model.column_iter().map(|c| c / c.norm()).collect::<Vec<_>>());
        let q = scaled.qr().q();
        /// Number of simulated datasets: a power of 90 % has a standard error of 0.7 %.
        const TRIALS: usize = 2000;
        for effect in ["stiffening:3", "harmonic2:4", "harmonic1:1"] {
            let sight = detectability.sights.iter().find(|s| s.effect == effect).unwrap();
            let span = examination.spans[examination.library.place(effect).unwrap()];
            let columns = examination.rows.rows(m + span.first, span.count).transpose();
            let seen = (&columns - &q * q.tr_mul(&columns)).qr().q();
            let critical = critical_value(span.count, detectability.level);
            let mut alarms = |size: f64| {
                let alarm = |_: &usize| {
                    let noise = DVector::<f64>::from_fn(n, |_, _| StandardNormal.sample(&mut random));
                    // With several parameters: a random direction, scaled to the mean visibility over all directions.
                    let mut beta = DVector::<f64>::from_fn(span.count, |_, _| StandardNormal.sample(&mut random));
                    let own = examination.gram.view((span.first, span.first), (span.count, span.count));
                    beta *= size * (own.trace() / (own * &beta).dot(&beta)).sqrt();
                    let data = &columns * beta + noise;
                    let left = &data - &q * q.tr_mul(&data);
                    seen.tr_mul(&left).norm_squared() > critical
                };
                (0..TRIALS).filter(alarm).count() as f64 / TRIALS as f64
            };
            let power = alarms(sight.smallest.unwrap());
            // Three standard deviations of a proportion of 0.9 in 2000 trials.
            assert!((power - 0.9).abs() < 0.02, "{effect}: {power}");
            assert!(alarms(0.0) < 0.005, "{effect}: of noise alone");
        }
    }

    #[test]
    fn a_joint_that_carries_nothing_hides_what_loads_do_to_it() {
        let detectability = Detectability::of_plan(&planned(60), &Model::paper()).unwrap();
        let of = |id: &str| detectability.sights.iter().find(|s| s.effect == id).unwrap();
        assert_eq!(of("stiffening:1").smallest, None, "the first axis is upright");
        assert!(of("payload_mass").smallest.is_some(), "seen through the compliance that is plausible");
        let sizes: Vec<f64> = detectability.sights.iter().map(|s| s.smallest.unwrap_or(f64::INFINITY)).collect();
        assert!(sizes.is_sorted());
    }

    #[test]
    fn without_an_effect_the_power_is_the_level() {
        let critical = critical_value(3, 0.01);
        assert!((power_at(3, critical, 0.0) - 0.01).abs() < 1e-12 && (critical - 11.344866730144373).abs() < 1e-9);
    }
}
