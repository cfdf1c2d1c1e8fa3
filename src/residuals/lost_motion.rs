//! Lost motion of a joint: the difference between its positions after moving up and after moving down.
//!
//! The sign is that of the reversal value of ISO 230-2 (2014), `B = mean up - mean down`: negative if the joint stops
//! short on both sides. The value is twice the `h` of the effect `hysteresis:J`.

use statrs::distribution::{ContinuousCDF, StudentsT};

use super::noise_floor::fisher_chance;

/// Probability in each tail of the confidence interval (intervals of 95 %, docs/repeatability.md).
const TAIL: f64 = 0.025;

/// Reversals of one joint at one station.
#[derive(Debug, Clone, PartialEq)]
pub struct Arrivals {
    /// Displacement of the TCP there per radian of the joint, m.
    pub lever: f64,
    /// Angle after moving up minus angle after moving down, rad, one value per reversal.
    pub reversals: Vec<f64>,
}

/// Lost motion of one joint.
///
/// ```
/// use calibench::residuals::{Arrivals, LostMotion};
/// use calibench::units::{UM, URAD};
///
/// // A joint that stops 100 µrad short from either side, 0.5 m from the TCP.
/// let station = Arrivals { lever: 0.5, reversals: vec![-100.0 * URAD; 10] };
/// let lost = LostMotion::of(2, &[station]).ok_or("two reversals or more")?;
/// assert!((lost.reversal + 100.0 * URAD).abs() < 1e-15 && (lost.at_tcp() - 50.0 * UM).abs() < 1e-15);
/// # Ok::<(), &str>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LostMotion {
    /// The joint, counted from 0.
    pub joint: usize,
    /// Angle after moving up minus angle after moving down, rad.
    pub reversal: f64,
    /// Its 95 % confidence interval, rad.
    pub interval: [f64; 2],
    /// Largest lever among the stations, m; multiplied by the reversal, it gives the distance by which a target is
    /// missed.
    pub lever: f64,
    /// Total number of reversals.
    pub count: usize,
    /// Probability that stations differ this much if the joint's lost motion is the same everywhere; `None` with one
    /// station, or if a station shows no scatter.
    pub alike_p: Option<f64>,
}

/// Mean of a station, the variance of that mean, its degrees of freedom and its weight.
struct Mean {
    value: f64,
    variance: f64,
    freedoms: f64,
    weight: f64,
}

impl LostMotion {
    /// Computes the lost motion of a joint (counted from 0) from its arrivals at the stations; `None` if no station has
    /// two reversals and a lever.
    ///
    /// The weight of a station is the number of its reversals times its squared lever, which is optimal if the TCP
    /// scatters equally everywhere. The interval is valid without that assumption: it uses each station's own scatter
    /// (Student's t with the degrees of freedom of Welch and Satterthwaite).
    pub fn of(joint: usize, stations: &[Arrivals]) -> Option<Self> {
        let usable = stations.iter().filter(|s| s.reversals.len() >= 2 && s.lever > 0.0);
        let means: Vec<Mean> = usable.clone().map(mean).collect();
        let whole: f64 = means.iter().map(|m| m.weight).sum();
        if means.is_empty() {
            return None;
        }
        let reversal = means.iter().map(|m| m.weight * m.value).sum::<f64>() / whole;
        let parts: Vec<(f64, f64)> = means.iter().map(|m| ((m.weight / whole).powi(2) * m.variance, m.freedoms)).collect();
        let variance: f64 = parts.iter().map(|p| p.0).sum();
        let freedoms = variance.powi(2) / parts.iter().map(|(v, f)| v * v / f).sum::<f64>();
        let half = if variance > 0.0 {
            variance.sqrt() * StudentsT::new(0.0, 1.0, freedoms).map_or(f64::INFINITY, |t| t.inverse_cdf(1.0 - TAIL))
        } else {
            0.0
        };
        Some(LostMotion {
            joint,
            reversal,
            interval: [reversal - half, reversal + half],
            lever: usable.clone().map(|s| s.lever).fold(0.0, f64::max),
            count: usable.map(|s| s.reversals.len()).sum(),
            alike_p: alike(&means),
        })
    }

    /// Distance by which a target is missed at the largest lever when it is approached from the other side, m.
    pub fn at_tcp(&self) -> f64 {
        self.reversal.abs() * self.lever
    }
}

fn mean(station: &Arrivals) -> Mean {
    let count = station.reversals.len() as f64;
    let value = station.reversals.iter().sum::<f64>() / count;
    let squares: f64 = station.reversals.iter().map(|r| (r - value).powi(2)).sum();
    let variance = squares / (count - 1.0) / count;
    Mean { value, variance, freedoms: count - 1.0, weight: count * station.lever.powi(2) }
}

/// Probability that means differ this much by chance (B. L. Welch, Biometrika 38 (1951) 330).
fn alike(means: &[Mean]) -> Option<f64> {
    let k = means.len() as f64;
    if means.len() < 2 || means.iter().any(|m| m.variance <= 0.0) {
        return None;
    }
    let whole: f64 = means.iter().map(|m| 1.0 / m.variance).sum();
    let middle = means.iter().map(|m| m.value / m.variance).sum::<f64>() / whole;
    let between: f64 = means.iter().map(|m| (m.value - middle).powi(2) / m.variance).sum();
    let uneven: f64 = means.iter().map(|m| (1.0 - 1.0 / m.variance / whole).powi(2) / m.freedoms).sum();
    let ratio = between / (k - 1.0) / (1.0 + 2.0 * (k - 2.0) / (k * k - 1.0) * uneven);
    fisher_chance(ratio, k - 1.0, (k * k - 1.0) / (3.0 * uneven))
}
