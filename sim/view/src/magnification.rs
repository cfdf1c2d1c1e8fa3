//! Magnification of small quantities for display.

/// Largest magnification: noise is not magnified further.
const MOST: f64 = 1e4;

/// The factor that magnifies `largest` to about `wanted`, rounded down to a leading 1, 2 or 5.
pub fn magnification(largest: f64, wanted: f64) -> f64 {
    let scale = (wanted / largest.abs()).clamp(1.0 / MOST, MOST);
    let ten = 10f64.powi(scale.log10().floor() as i32);
    [5.0, 2.0, 1.0].into_iter().map(|lead| lead * ten).find(|&x| x <= scale).unwrap_or(ten)
}

#[cfg(test)]
mod tests {
    use super::magnification;

    #[test]
    fn magnifications_are_round_and_of_anything() {
        let of = |largest| magnification(largest, 1.0);
        assert_eq!([of(1.0 / 23.4), of(1.0 / 1999.0), of(1.0 / 0.7)], [20.0, 1000.0, 0.5]);
        assert_eq!([of(0.0), of(1e-9), of(1e9)], [1e4, 1e4, 1e-4]);
    }
}
