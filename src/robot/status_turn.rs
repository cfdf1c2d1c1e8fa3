//! KUKA's status and turn: two small numbers that select one of the postures that reach a pose.
//!
//! Status: bit 0 is set if the wrist's centre is behind axis 1 (overhead), bit 1 if the elbow is bent towards positive A3
//! (on the KR 6 R700 beyond atan(35 / 365) = 5.48 deg, where the arm is stretched), bit 2 if A5 is negative. Turn: bit i -
//! 1 is set if joint i is negative (KUKA System Software, operating and programming instructions for system integrators).

use super::Pose;
use super::inverse::SphericalWrist;

/// Status and turn of a posture.
///
/// ```
/// use calibench::robot::built_in;
/// use calibench::robot::inverse::{SphericalWrist, StatusTurn};
/// use calibench::units::DEG;
///
/// // The wrist's centre in front of axis 1, the elbow bent beyond 5.48 deg, A5 positive: only bit 1. A2 alone is negative: bit 1.
/// let wrist = SphericalWrist::new(&built_in("kr6_r700").ok_or("built in")?)?;
/// let q = [0.0, -90.0, 90.0, 0.0, 45.0, 0.0].map(|q| q * DEG);
/// assert_eq!(StatusTurn::of(&wrist, &q), StatusTurn { status: 0b010, turn: 0b000010 });
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct StatusTurn {
    /// Status, 0 to 7.
    pub status: u8,
    /// Turn, 0 to 63.
    pub turn: u8,
}

/// Values less than this below zero (rad, m) count as zero, and zero is not negative: files have no more digits.
const ZERO: f64 = 1e-9;

/// Tolerance (rad, m) of a posture against its status and turn: the sign of a joint at zero is undefined.
const NO_SIDE: f64 = 1e-6;

impl StatusTurn {
    /// Status and turn of joints `q` (rad).
    pub fn of(wrist: &SphericalWrist, q: &[f64; 6]) -> Self {
        let bits = |sides: &[f64]| (0..).zip(sides).fold(0, |bits, (k, &side)| bits | u8::from(side < -ZERO) << k);
        let [reach, elbow, five] = wrist.bends(q);
        let stretched = u8::from(elbow.abs() <= ZERO) << ELBOW;
        StatusTurn { status: bits(&[reach, -elbow, five]) | stretched, turn: bits(q) }
    }
}

/// Index of the elbow's bit in the status.
const ELBOW: usize = 1;

impl SphericalWrist {
    /// The joints inside the limits (rad) that put frame 6 at `base_from_flange` in the posture given by `status` and
    /// `turn`, if any; among several those nearest to `near`.
    pub fn joints_of(
        &self,
        base_from_flange: &Pose,
        status: Option<u8>,
        turn: Option<u8>,
        near: &[f64; 6],
    ) -> Option<[f64; 6]> {
        let mut best: Option<(f64, [f64; 6])> = None;
        self.solutions(base_from_flange, 0.0, |q| {
            let [reach, elbow, five] = self.bends(q);
            let wrong = |asked: Option<u8>, sides: &[f64]| match asked {
                // Distance of each on the side opposite to its bit.
                Some(bits) => {
                    let over = |(k, &side): (usize, &f64)| if bits >> k & 1 == 1 { side } else { -side };
                    sides.iter().enumerate().map(over).fold(0.0, f64::max)
                }
                None => 0.0,
            };
            if wrong(status, &[reach, -elbow, five]).max(wrong(turn, q)) > NO_SIDE {
                return;
            }
            let away: f64 = q.iter().zip(near).map(|(q, near)| (q - near).powi(2)).sum();
            if best.is_none_or(|(least, _)| away < least) {
                best = Some((away, *q));
            }
        });
        best.map(|(_, q)| q)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robot::built_in;
    use crate::units::DEG;

    fn of(degrees: [f64; 6]) -> (u8, u8) {
        let wrist = SphericalWrist::new(&built_in("kr6_r700").unwrap()).unwrap();
        let StatusTurn { status, turn } = StatusTurn::of(&wrist, &degrees.map(|angle| angle * DEG));
        (status, turn)
    }

    #[test]
    fn known_postures_have_their_known_numbers() {
        assert_eq!(of([0.0, -90.0, 90.0, 0.0, 0.0, 0.0]), (0b010, 0b000010), "KUKA's home");
        assert_eq!(of([0.0, 0.0, 0.0, 0.0, 0.0, 0.0]), (0b000, 0), "stretched out, elbow short of its line");
        assert_eq!(of([10.0, -60.0, 70.0, -176.0, -50.0, 100.0]), (0b110, 0b011010));
        // 25 + 315 cos(-160 deg) + the forearm pointing up: the wrist is behind axis 1.
        assert_eq!(of([0.0, -160.0, 60.0, 0.0, 30.0, -1.0]), (0b011, 0b100010));
    }

    #[test]
    fn a_joint_at_zero_is_not_negative() {
        assert_eq!(of([-1e-9, -90.0, 90.0, -0.0, -1e-9, 1e-9]), (0b010, 0b000010));
        // A3 with the arm stretched, to rounding.
        assert_eq!(of([0.0, -90.0, (35f64).atan2(365.0) / DEG, 0.0, 10.0, 0.0]).0, 0b010);
    }
}
