//! Lost motion of a joint: by how much it stands elsewhere after moving up than after moving down.
//!
//! The sign is that of the reversal value of ISO 230-2 (2014), `B = mean up - mean down`: negative where the joint stops short on both
//! sides. It is twice the `h` of the effect `hysteresis:J`.

use statrs::distribution::{ContinuousCDF, StudentsT};

use super::noise_floor::fisher_chance;

/// Share of chances left out at each end.
const TAIL: f64 = 0.025;

/// Reversals of one joint at one station.
#[derive(Debug, Clone, PartialEq)]
pub struct Arrivals {
    /// What one radian of the joint moves the TCP by there, m.
    pub lever: f64,
    /// Angle after moving up minus angle after moving down, rad, each time.
    pub reversals: Vec<f64>,
}

/// Lost motion of one joint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LostMotion {
    /// Counted from 0.
    pub joint: usize,
    /// Angle after moving up minus angle after moving down, rad.
    pub reversal: f64,
    /// Its 95 % confidence interval, rad.
    pub interval: [f64; 2],
    /// Largest lever among the stations, m: that times the reversal is what a target misses by.
    pub lever: f64,
    /// Reversals in all.
    pub count: usize,
    /// Chance that stations differ so much of a joint that loses the same everywhere; `None` at one station.
    pub alike_p: Option<f64>,
}

/// A station's mean, the variance of that mean, its freedoms and its weight.
struct Mean {
    value: f64,
    variance: f64,
    freedoms: f64,
    weight: f64,
}

impl LostMotion {
    /// Of a joint (counted from 0), from its arrivals at the stations; `None` without a station of two reversals and a lever.
    ///
    /// Stations count by the squares of their levers, as an equal scatter of the TCP asks; the interval takes each station's own
    /// scatter and holds whether that is so or not (Student's t with the freedoms of Welch and Satterthwaite).
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

    /// What a target misses by at the largest lever when it is approached from the other side, m.
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

/// Chance of means so unlike by chance alone (B. L. Welch, Biometrika 38 (1951) 330).
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
