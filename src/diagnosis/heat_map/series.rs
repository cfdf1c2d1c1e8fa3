//! A smooth function of one variable as a series of sines, whose coefficients have one sigma each (Solin & Särkkä 2020, Eq. 56-58).

use std::f64::consts::PI;

/// Half the length of the interval of the series; the data lie in [-1, 1].
const HALF_LENGTH: f64 = 1.5;

/// Values of a variable in the data, scaled to [-1, 1].
pub(crate) struct Scaled {
    pub centre: f64,
    pub half_range: f64,
    pub u: Vec<f64>,
}

impl Scaled {
    /// Scales these values; `None` if they do not vary.
    pub fn new(values: &[f64]) -> Option<Self> {
        let (low, high) = values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(*v), h.max(*v)));
        let (centre, half_range) = ((low + high) / 2.0, (high - low) / 2.0);
        // A variable that varies only by rounding has no shape.
        (half_range > 1e-6 * centre.abs().max(1e-3)).then(|| Scaled {
            centre,
            half_range,
            u: values.iter().map(|v| (v - centre) / half_range).collect(),
        })
    }

    /// Term `m` as an expression of the variable that `expression` denotes, without its weight.
    pub fn basis(&self, m: usize, expression: &str) -> String {
        let slope = frequency(m) / self.half_range;
        let phase = frequency(m) * (HALF_LENGTH - self.centre / self.half_range);
        format!("sin({slope:?} * {expression} + ({phase:?}))")
    }
}

fn frequency(m: usize) -> f64 {
    (m + 1) as f64 * PI / (2.0 * HALF_LENGTH)
}

/// Root of the spectral density at term `m`.
fn weight(m: usize, length: f64) -> f64 {
    ((2.0 * PI).sqrt() * length * (-(length * frequency(m)).powi(2) / 2.0).exp()).sqrt()
}

/// Plausible size of the coefficient of term `m` of a function of unit amplitude.
pub(crate) fn size(m: usize, length: f64) -> f64 {
    weight(m, length) / HALF_LENGTH.sqrt()
}

/// Term `m` at `u`, times its plausible size.
pub(crate) fn term(m: usize, length: f64, u: f64) -> f64 {
    weight(m, length) * (frequency(m) * (u + HALF_LENGTH)).sin() / HALF_LENGTH.sqrt()
}
