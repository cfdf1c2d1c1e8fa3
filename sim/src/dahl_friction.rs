//! The Dahl friction state: the direction from which something came, which changes gradually.
//!
//! A catalogue effect takes the sign of the last motion, however short. A gear or a plunger that really behaved like that
//! could never be brought to a given micrometre: every correction backwards would reverse its friction at once. Real friction
//! yields gradually.

/// A friction state from -1 (came down) to +1 (came up).
///
/// A motion by `d` brings it nearer to the sign of `d` by the fraction `1 - exp(-|d| / width)`: P. Dahl's model of solid
/// friction (The Aerospace Corporation, TOR-0158(3107-18)-1, 1968), with exponent one.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct DahlFriction(f64);

/// Width of the transition in units of the flaw's size. A reversal then begins with two thirds of the motion if the flaw
/// lags, as lost motion does, and with four thirds if it leads: a centring converges either way, and after some twenty sizes
/// the state has reversed.
const WIDTH_OVER_SIZE: f64 = 6.0;

impl DahlFriction {
    /// Moves by `by` (rad or m); `size` is the size of the flaw at full friction state.
    pub fn moved(&mut self, by: f64, size: f64) {
        let width = WIDTH_OVER_SIZE * size.abs();
        if by != 0.0 && width > 0.0 {
            self.0 = by.signum() - (by.signum() - self.0) * (-by.abs() / width).exp();
        }
    }

    /// The state, from -1 to +1.
    pub fn value(self) -> f64 {
        self.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_way_changes_the_side_and_a_short_one_does_not() {
        let mut side = DahlFriction::default();
        side.moved(60.0, 1.0);
        // exp(-10)
        assert!((side.value() - 1.0).abs() < 5e-5);
        side.moved(-0.1, 1.0);
        assert!(side.value() > 0.9);
        side.moved(-60.0, 1.0);
        assert!((side.value() + 1.0).abs() < 1e-4);
    }

    /// A reversal in pieces gives the same state as one in a single motion.
    #[test]
    fn a_way_may_be_cut_into_pieces() {
        let (mut whole, mut pieces) = (DahlFriction(0.8), DahlFriction(0.8));
        whole.moved(-2.0, 1.5);
        (0..20).for_each(|_| pieces.moved(-0.1, 1.5));
        assert!((whole.value() - pieces.value()).abs() < 1e-14);
    }
}
