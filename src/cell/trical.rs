//! The TriCal: three plunger indicators in orthogonal channels that meet at the TCP.

use serde::Serialize;

use crate::units::MM;

/// Dimensions of a TriCal and of the balls it is used with, m.
///
/// The TCP is the centre of the master ball in the trihedral socket; the tool axes are the channels, pointing into the
/// indicators, so a ball that moves along +x pushes the first plunger in.
///
/// ```
/// use calibench::cell::TriCal;
/// use calibench::units::MM;
///
/// // Section 2.1 of the paper: 6.350 mm on the master ball, -6.150 mm without contact.
/// let trical = TriCal::PAPER;
/// assert!((trical.master_reading() - 6.350 * MM).abs() < 1e-9);
/// assert!((trical.free_reading() + 6.150 * MM).abs() < 1e-9);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct TriCal {
    /// Radius of the datum balls of the artifact.
    pub datum_radius: f64,
    /// Radius of the master ball.
    pub master_radius: f64,
    /// Travel of each plunger.
    pub travel: f64,
    /// Radius of the flat tips: at a greater distance from a plunger's axis the ball meets the rim, not the flat.
    pub tip_radius: f64,
    /// Largest distance between a ball and the TCP at first contact.
    pub safe_range: f64,
}

impl Default for TriCal {
    /// The device of the paper.
    fn default() -> Self {
        TriCal::PAPER
    }
}

impl TriCal {
    /// The device of the paper, section 2.1: 1-inch datum balls, a 1.5-inch master ball, 12.5 mm of travel, 11.5 mm tips.
    pub const PAPER: TriCal = TriCal {
        datum_radius: 12.7 * MM,
        master_radius: 19.05 * MM,
        travel: 12.5 * MM,
        tip_radius: 5.75 * MM,
        safe_range: 5.0 * MM,
    };

    /// Reading set on the master ball, so that a centred datum ball reads zero: 6.350 mm.
    pub fn master_reading(&self) -> f64 {
        self.master_radius - self.datum_radius
    }

    /// Reading of an ideally placed indicator without contact: -6.150 mm. Real ones differ and are measured at mastering.
    pub fn free_reading(&self) -> f64 {
        self.master_reading() - self.travel
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_paper_s_two_numbers_follow_from_the_radii_and_the_travel() {
        let trical = TriCal::default();
        // One nanometre: the decimal fractions of the radii are not exact in binary.
        assert!((trical.master_reading() - 6.350 * MM).abs() < 1e-9);
        assert!((trical.free_reading() + 6.150 * MM).abs() < 1e-9);
    }
}
