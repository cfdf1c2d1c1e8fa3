//! The side from which something came, which it changes gradually.
//!
//! A catalogue effect takes the sign of the last motion, however short that was. A gear or a plunger that truly did so could never be
//! brought to a given micrometre: every correction backwards would throw it over to its other side. Friction gives way by degrees.

/// A side from -1 (came down) to +1 (came up).
///
/// After a motion by `d` it is nearer to the sign of `d` by `1 - exp(-|d| / width)`: P. Dahl's model of solid friction (The Aerospace
/// Corporation, TOR-0158(3107-18)-1, 1968), of exponent one.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Side(f64);

/// Width of the change over the size of what changes. A reversal then begins with two thirds of the motion where the flaw lags, as lost
/// motion does, and with four thirds where it leads: a centring converges either way, and some twenty sizes later the side has changed.
const WIDTH_OVER_SIZE: f64 = 6.0;

impl Side {
    /// Moves by `by` (rad or m) what is `size` large at full side.
    pub fn moved(&mut self, by: f64, size: f64) {
        let width = WIDTH_OVER_SIZE * size.abs();
        if by != 0.0 && width > 0.0 {
            self.0 = by.signum() - (by.signum() - self.0) * (-by.abs() / width).exp();
        }
    }

    /// From -1 to +1.
    pub fn value(self) -> f64 {
        self.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_way_changes_the_side_and_a_short_one_does_not() {
        let mut side = Side::default();
        side.moved(60.0, 1.0);
        // exp(-10)
        assert!((side.value() - 1.0).abs() < 5e-5);
        side.moved(-0.1, 1.0);
        assert!(side.value() > 0.9);
        side.moved(-60.0, 1.0);
        assert!((side.value() + 1.0).abs() < 1e-4);
    }

    /// The way back in pieces is the way back in one.
    #[test]
    fn a_way_may_be_cut_into_pieces() {
        let (mut whole, mut pieces) = (Side(0.8), Side(0.8));
        whole.moved(-2.0, 1.5);
        (0..20).for_each(|_| pieces.moved(-0.1, 1.5));
        assert!((whole.value() - pieces.value()).abs() < 1e-14);
    }
}
