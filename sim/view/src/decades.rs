//! Logarithmic lengths, from millimetres down to a third of a micrometre in one picture: every unit is a factor of ten.

use calibench::units::UM;

/// Length shown at the origin, m: a tenth of the tolerance; shorter ones are shown there too.
pub const ORIGIN: f64 = 0.3 * UM;

/// Height of the tolerance of 3 um.
pub const TOLERANCE: f64 = 1.0;

/// Height of the outermost line, 3 mm.
pub const OUTERMOST: f64 = 4.0;

/// Lines and their labels.
pub const LINES: [(f64, &str); 4] = [(1.0, "3 µm"), (2.0, "30 µm"), (3.0, "0.3 mm"), (4.0, "3 mm")];

/// Height of a length (m) above the origin, in decades; never negative.
pub fn decades(length: f64) -> f64 {
    (length.abs() / ORIGIN).log10().max(0.0)
}

/// Height of a reading (m) in decades, with the sign of the reading.
pub fn signed(reading: f64) -> f64 {
    decades(reading).copysign(reading)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_tolerance_is_one_decade_up_and_three_millimetres_four() {
        // Rounding error of a logarithm.
        assert!((decades(3.0 * UM) - TOLERANCE).abs() < 1e-12);
        assert!((signed(-3000.0 * UM) + OUTERMOST).abs() < 1e-12);
        assert_eq!(decades(0.1 * UM), 0.0);
        assert_eq!(signed(0.0), 0.0);
    }
}
