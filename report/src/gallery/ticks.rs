//! Round numbers along an axis.

/// Largest number of steps between ticks.
const MOST: f64 = 6.0;

/// The values of the ticks between two limits: multiples of 1, 2 or 5 times a power of ten, or of parts of a turn where
/// `degrees` is set.
pub fn ticks([low, high]: [f64; 2], degrees: bool) -> Vec<f64> {
    let span = (high - low).max(f64::MIN_POSITIVE);
    let power = 10f64.powf((span / MOST).log10().floor());
    let decimal = [1.0, 2.0, 5.0, 10.0].map(|m| m * power);
    let parts: &[f64] = if degrees && span > 60.0 { &[15.0, 30.0, 45.0, 90.0, 180.0] } else { &decimal };
    let step = parts.iter().copied().find(|s| span / s <= MOST).unwrap_or(parts[parts.len() - 1]);
    let [first, last] = [(low / step - 1e-9).ceil(), (high / step + 1e-9).floor()];
    (0..=(last - first).max(0.0) as usize).map(|k| (first + k as f64) * step).collect()
}

/// A tick as text: no more decimals than its step needs.
pub fn label(value: f64, all: &[f64]) -> String {
    let step = all.windows(2).map(|w| w[1] - w[0]).fold(f64::INFINITY, f64::min);
    let decimals = if step.is_finite() { (-(step.log10() + 1e-9).floor()).max(0.0) as usize } else { 0 };
    let text = format!("{value:.decimals$}");
    if text.trim_start_matches('-').chars().all(|c| c == '0' || c == '.') { "0".into() } else { text.replace('-', "−") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round() {
        assert_eq!(ticks([-100.0, 100.0], false), [-100.0, -50.0, 0.0, 50.0, 100.0]);
        assert_eq!(ticks([0.0, 360.0], true), [0.0, 90.0, 180.0, 270.0, 360.0]);
        let fine = ticks([0.0, 0.013], false);
        assert_eq!(fine.iter().map(|t| label(*t, &fine)).collect::<Vec<_>>(), ["0", "0.005", "0.010"]);
        assert_eq!(label(-50.0, &[-50.0, 0.0]), "−50");
    }
}
