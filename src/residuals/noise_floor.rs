//! The noise floor: the residual that measurement noise alone would leave, and how it is known.
//!
//! The stated noise is used, including the contribution of the joints at the TCP,
//! `Sigma = sigma² I + J_q diag(sigma_q²) J_q^T`, unless replicates of ten degrees of freedom or more contradict it. If they
//! do, or if nothing is stated, the noise is estimated from replicates: rows of one set-up and target with the same posture (all joints within 0.01
//! deg), payload and approach, or with the same `repeat` name. The scatter of their residuals about the group mean,
//! pooled over groups, is noise whatever the model. Residuals are used rather than readings, as the joint angles may
//! differ slightly. Otherwise the noise is unknown.

use std::collections::HashMap;

use nalgebra::Vector3;
use statrs::distribution::{ChiSquared, ContinuousCDF, FisherSnedecor};

/// Confidence level of all intervals.
pub(crate) const CONFIDENCE: f64 = 0.95;

/// Replicates contradict the stated noise if the probability of their scatter is below this (docs/comparing.md).
pub(crate) const CONTRADICTION: f64 = 1e-3;

/// Replicates count from this number of degrees of freedom: fewer, such as one seating that was recorded twice, may be an
/// accident.
pub(crate) const FEWEST_REPLICATES: f64 = 10.0;

/// Source of the noise estimate.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NoiseSource {
    /// From the scatter of replicates.
    Replicates,
    /// As stated with the data.
    Stated,
    /// The noise is unknown.
    Unknown,
}

impl NoiseSource {
    /// Value of the key `noise_from` in files: `repeats`, `stated`, `unknown`.
    pub fn noise_from(self) -> &'static str {
        match self {
            NoiseSource::Replicates => "repeats",
            NoiseSource::Stated | NoiseSource::Unknown => self.name(),
        }
    }

    /// Name in files: `replicates`, `stated`, `unknown`.
    pub fn name(self) -> &'static str {
        match self {
            NoiseSource::Replicates => "replicates",
            NoiseSource::Stated => "stated",
            NoiseSource::Unknown => "unknown",
        }
    }
}

/// The scatter of replicates about their group means.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Replicates {
    /// Number of groups with two or more samples.
    pub groups: usize,
    /// Number of samples in them.
    pub samples: usize,
    /// Pooled sum of squares of the whitened residuals about the group means.
    pub squares: f64,
    /// Degrees of freedom: for each group three per sample beyond the first, or one per sample for distances.
    pub dof: f64,
}

/// Size of the noise.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NoiseLevel {
    /// One-sigma per axis, m.
    pub per_axis: f64,
    /// Root mean square of the 3-D error that noise alone causes, m.
    pub rms: f64,
    /// 95 % confidence interval of `rms`, m (chi-square); `None` for stated noise.
    pub interval: Option<[f64; 2]>,
    /// Ratio of the noise to that by which the samples were weighted: 1 if the latter is accepted.
    pub relative: f64,
    /// Degrees of freedom of the estimate; `None` for stated noise, which is taken as exact.
    pub dof: Option<f64>,
}

/// Noise of a set of samples, with its source.
#[derive(Debug, Clone, PartialEq)]
pub struct NoiseFloor {
    /// Source of the estimate.
    pub source: NoiseSource,
    /// Size of the noise; `None` if unknown.
    pub level: Option<NoiseLevel>,
    /// Scatter of the replicates, whether or not it is used instead of the stated noise; `None` if there are none.
    pub replicates: Option<Replicates>,
    /// Stated one-sigma per axis including the contribution of the joints, m, root mean square over samples.
    pub stated_per_axis: Option<f64>,
    /// Probability of such replicates under the stated noise (two-sided chi-square); `None` if either is missing, or if they
    /// are too few to count.
    pub agreement_p: Option<f64>,
}

/// The data of one sample that the noise floor needs.
#[derive(Debug, Clone, Copy)]
pub struct NoisySample {
    /// Group of [replicates](crate::measure::poses::Postures::replicates) that it belongs to.
    pub group: usize,
    /// Whitened residual; for a distance only the first component is used.
    pub whitened: Vector3<f64>,
    /// Number of scalar residuals: 3, or 1 for a distance.
    pub height: usize,
    /// Sum of the variances of those residuals by which they were whitened, m².
    pub variance: f64,
}

impl NoiseFloor {
    /// Finds the noise of samples; `stated` is true if the data state it.
    pub fn of(samples: &[NoisySample], stated: bool) -> Self {
        let replicates = pooled(samples);
        let numbers: usize = samples.iter().map(|s| s.height).sum();
        let variance: f64 = samples.iter().map(|s| s.variance).sum();
        let level = |relative: f64, dof: Option<f64>| {
            let rms = relative * (variance / samples.len().max(1) as f64).sqrt();
            NoiseLevel {
                per_axis: relative * (variance / numbers.max(1) as f64).sqrt(),
                rms,
                interval: dof.and_then(|dof| scatter_interval(rms, dof)),
                relative,
                dof,
            }
        };
        let counted = replicates.filter(|r| r.dof >= FEWEST_REPLICATES);
        let agreement_p = counted.filter(|_| stated).and_then(|r| {
            let chi2 = ChiSquared::new(r.dof).ok()?;
            Some((2.0 * chi2.cdf(r.squares).min(chi2.sf(r.squares))).min(1.0))
        });
        let contradicted = agreement_p.is_some_and(|p| p < CONTRADICTION);
        // Replicates that agree to the last digit were copied or rounded.
        let by_replicates = counted.filter(|r| (!stated || contradicted) && r.squares > 0.0);
        let (source, found) = match by_replicates {
            Some(r) => (NoiseSource::Replicates, Some(level((r.squares / r.dof).sqrt(), Some(r.dof)))),
            None if stated => (NoiseSource::Stated, Some(level(1.0, None))),
            None => (NoiseSource::Unknown, None),
        };
        NoiseFloor { source, level: found, replicates, stated_per_axis: stated.then(|| level(1.0, None).per_axis), agreement_p }
    }

    /// True if replicates contradict the stated noise at a level of 1e-3.
    pub fn contradicts_statement(&self) -> bool {
        self.agreement_p.is_some_and(|p| p < CONTRADICTION)
    }

    /// Factor by which the noise is larger than stated according to replicates; `None` if they do not contradict the
    /// stated noise, or show less.
    pub fn larger_than_stated(&self) -> Option<f64> {
        let level = self.level.filter(|_| self.source == NoiseSource::Replicates && self.contradicts_statement())?;
        (level.relative > 1.0).then_some(level.relative)
    }

    /// True if residuals of this chance to be larger are smaller than the stated noise allows: it is stated too large, and hides
    /// what is smaller. Noise that repeats tell is not stated.
    pub fn is_overstated(&self, chance: Option<f64>) -> bool {
        self.source == NoiseSource::Stated && is_too_small(chance)
    }

    /// Probability that noise alone causes a whitened sum of squares of at least `squares` with `dof` degrees of
    /// freedom: chi-square if the noise is stated, Fisher's F if it is known from replicates, `None` if it is unknown.
    pub fn chance_of(&self, squares: f64, dof: f64) -> Option<f64> {
        let level = self.level.as_ref()?;
        if dof <= 0.0 {
            return Some(1.0);
        }
        let squares = squares / (level.relative * level.relative);
        match level.dof {
            None => chi2_chance(squares, dof),
            Some(known) => fisher_chance(squares / dof, dof, known),
        }
    }
}

/// Probability, if the noise is as stated, of residuals so small that it is not.
const NOISE_DOUBTED: f64 = 1e-3;

/// True if residuals with this chance of larger ones are too small for the noise.
pub(crate) fn is_too_small(chance: Option<f64>) -> bool {
    chance.is_some_and(|p| 1.0 - p < NOISE_DOUBTED)
}

/// Probability of a larger chi-square.
pub(crate) fn chi2_chance(squares: f64, dof: f64) -> Option<f64> {
    if !squares.is_finite() {
        return squares.is_nan().then_some(f64::NAN).or(Some(0.0));
    }
    ChiSquared::new(dof).ok().map(|d| d.sf(squares.max(0.0)))
}

/// Ratios from this on are given probability zero; beyond it the incomplete beta function loses the precision of its
/// argument.
const BEYOND_CHANCE: f64 = 1e12;

/// Probability of a larger ratio of two mean squares, with `above` and `below` degrees of freedom.
pub(crate) fn fisher_chance(ratio: f64, above: f64, below: f64) -> Option<f64> {
    let d = FisherSnedecor::new(above, below).ok()?;
    Some(if ratio < BEYOND_CHANCE { d.sf(ratio.max(0.0)).clamp(0.0, 1.0) } else { 0.0 })
}

/// Confidence interval of a standard deviation that was estimated as `found` with `dof` degrees of freedom.
fn scatter_interval(found: f64, dof: f64) -> Option<[f64; 2]> {
    let chi2 = ChiSquared::new(dof).ok()?;
    let tail = 0.5 * (1.0 - CONFIDENCE);
    Some([1.0 - tail, tail].map(|p| found * (dof / chi2.inverse_cdf(p)).sqrt()))
}

/// A group of replicates, relative to the first, so that a common offset does not cost precision.
struct Group {
    first: Vector3<f64>,
    height: usize,
    sum: Vector3<f64>,
    squares: f64,
    count: usize,
}

/// Scatter within groups of replicates; `None` when there are none.
fn pooled(samples: &[NoisySample]) -> Option<Replicates> {
    let mut place: HashMap<usize, usize> = HashMap::new();
    let mut groups: Vec<Group> = Vec::new();
    for sample in samples {
        let at = *place.entry(sample.group).or_insert(groups.len());
        if at == groups.len() {
            let (first, height) = (sample.whitened, sample.height);
            groups.push(Group { first, height, sum: Vector3::zeros(), squares: 0.0, count: 0 });
        }
        let group = &mut groups[at];
        // Samples of another kind of measurement than the first of the group are ignored.
        if group.height == sample.height {
            let off = sample.whitened - group.first;
            group.sum += off;
            group.squares += off.norm_squared();
            group.count += 1;
        }
    }
    let mut pooled = Replicates { groups: 0, samples: 0, squares: 0.0, dof: 0.0 };
    for group in groups.iter().filter(|g| g.count > 1) {
        pooled.groups += 1;
        pooled.samples += group.count;
        pooled.squares += group.squares - group.sum.norm_squared() / group.count as f64;
        pooled.dof += (group.height * (group.count - 1)) as f64;
    }
    (pooled.groups > 0).then_some(pooled)
}

/// The part of a noise that a fit leaves in its residual, m: `noise` is its 3-D rms in m, `dof` the degrees of freedom, `rows` the
/// number of scalar residuals. The parameters absorb the rest.
///
/// ```
/// assert_eq!(calibench::residuals::noise_left(2.0, 25.0, 100), 1.0);
/// ```
pub fn noise_left(noise: f64, dof: f64, rows: usize) -> f64 {
    noise * (dof / rows.max(1) as f64).clamp(0.0, 1.0).sqrt()
}

/// The residual that noise does not explain, m: `rms` without the `noise` that a fit leaves in it, in quadrature (both m, 3-D);
/// zero where noise alone would leave as much.
///
/// ```
/// assert_eq!(calibench::residuals::unexplained(5.0, 3.0), 4.0);
/// assert_eq!(calibench::residuals::unexplained(3.0, 5.0), 0.0);
/// ```
pub fn unexplained(rms: f64, noise: f64) -> f64 {
    mean_square_beyond(rms, noise).max(0.0).sqrt()
}

/// The difference of the mean squares, m²; negative by chance where there is noise only.
pub(crate) fn mean_square_beyond(rms: f64, noise: f64) -> f64 {
    rms * rms - noise * noise
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample(group: usize, x: f64, y: f64, z: f64) -> NoisySample {
        let whitened = Vector3::new(x, y, z);
        NoisySample { group, whitened, height: 3, variance: 3e-10 }
    }

    #[test]
    fn four_pairs_known_by_heart() {
        // Each pair is two apart along one axis: sum of squares 2 about the mean, with three degrees of freedom.
        let pair = |k: usize| [sample(k, 1.0, 5.0, 0.0), sample(k, 3.0, 5.0, 0.0)];
        let samples: Vec<NoisySample> = (0..4).flat_map(pair).collect();
        let floor = NoiseFloor::of(&samples, false);
        let replicates = floor.replicates.expect("there are four groups");
        assert_eq!((replicates.groups, replicates.samples, replicates.squares, replicates.dof), (4, 8, 8.0, 12.0));
        let level = floor.level.expect("known from replicates");
        assert!((level.per_axis - 1e-5 * (8.0f64 / 12.0).sqrt()).abs() < 1e-15);
        assert!((level.rms - level.per_axis * 3f64.sqrt()).abs() < 1e-15);
        // A chi-square of 8 with twelve degrees of freedom contradicts nothing.
        let stated = NoiseFloor::of(&samples, true);
        assert_eq!((stated.source, stated.level.map(|l| l.relative)), (NoiseSource::Stated, Some(1.0)));
        assert!(!stated.contradicts_statement());
        assert_eq!(NoiseFloor::of(&[sample(2, 1.0, 0.0, 0.0)], false).source, NoiseSource::Unknown);
        // One pair that agrees to a millionth is an accident, whether the noise is stated or not.
        let twice = [sample(0, 1.0, 5.0, 0.0), sample(0, 1.0 + 1e-6, 5.0, 0.0)];
        assert_eq!(NoiseFloor::of(&twice, true).source, NoiseSource::Stated);
        assert_eq!(NoiseFloor::of(&twice, false).source, NoiseSource::Unknown);
    }

    #[test]
    fn the_interval_is_the_one_of_the_tables() {
        // chi-square, 10 degrees of freedom: 3.247 and 20.483 (any table).
        let [low, high] = scatter_interval(1.0, 10.0).expect("ten degrees of freedom");
        assert!((low - (10.0f64 / 20.483).sqrt()).abs() < 1e-4 && (high - (10.0f64 / 3.247).sqrt()).abs() < 1e-4);
    }

    #[test]
    fn chances_stay_chances_however_large_the_numbers() {
        for (squares, dof) in [(0.0, 1.0), (1e9, 36_000.0), (36_000.0, 36_000.0), (1e300, 3.0), (f64::INFINITY, 3.0)] {
            let p = chi2_chance(squares, dof).expect("a chance");
            assert!((0.0..=1.0).contains(&p), "{squares}, {dof}: {p}");
            let p = fisher_chance(squares / dof, dof, 35_000.0).expect("a chance");
            assert!((0.0..=1.0).contains(&p), "{squares}, {dof}: {p}");
        }
        // F(3, 10) at 6.552 is the 1 % point (any table).
        assert!((fisher_chance(6.552, 3.0, 10.0).expect("a chance") - 0.01).abs() < 1e-5);
    }
}
