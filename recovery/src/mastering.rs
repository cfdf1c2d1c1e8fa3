//! New mastering values in the terms of controllers.
//!
//! The controller shows `shown = (motor - offset) / gear` and the arm stands at `shown + change`. Whatever its maker calls the
//! offset, the new one makes the controller show where the arm stands. Gear ratios and encoder scales are of the machine, not
//! of its type, and are never assumed: without them the value is that of the arm's side.

use std::f64::consts::TAU;

use super::ZeroChange;
use calibench::units::DEG;

/// A maker of controllers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Controller {
    /// KUKA: the mastering position of an axis, `$MAMES`, deg.
    Kuka,
    /// ABB: the calibration offset of a motor, `cal_offset`, rad of the motor.
    Abb,
    /// FANUC: master counts, `$DMR_GRP.$MASTER_COUN`, or the angle entered as `MSTR POS`, deg.
    Fanuc,
    /// Universal Robots: the correction of a joint, `delta_theta`, rad.
    Ur,
    /// UFACTORY xArm: the offset of a joint, deg.
    Xarm,
}

/// The quantity that is entered.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum MasteringQuantity {
    /// `$MAMES[J]`, deg.
    MasteringPosition,
    /// `cal_offset`, rad of the motor.
    MotorOffset,
    /// `$MASTER_COUN[J]`, counts.
    MasterCount,
    /// `MSTR POS`, deg, relative to the angle shown.
    MasterPosition,
    /// `delta_theta[J]`, rad.
    JointCorrection,
    /// Offset of the joint, deg of the arm's side.
    JointOffset,
}

/// What the user knows of the drive of a joint.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Drive {
    /// Revolutions of the motor for one of the joint, with its sign.
    pub gear: Option<f64>,
    /// Counts of the encoder for a degree of the joint, with their sign.
    pub counts_per_degree: Option<f64>,
    /// The value at present, in its own unit.
    pub present: Option<f64>,
}

/// What to enter for one joint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MasteringEntry {
    /// The joint, counted from 1.
    pub joint: usize,
    /// The quantity.
    pub quantity: MasteringQuantity,
    /// Its new value, if the present one is known; otherwise what is to be added to it. In its own unit.
    pub value: f64,
    /// Its standard uncertainty.
    pub sigma: f64,
    /// True if it is the new value.
    pub is_new_value: bool,
    /// What the controller shows where the joint truly stands at zero, deg: the joint may be moved there and zeroed.
    pub shown_at_zero: f64,
}

impl Controller {
    /// All of them.
    pub const ALL: [Controller; 5] = [Controller::Kuka, Controller::Abb, Controller::Fanuc, Controller::Ur, Controller::Xarm];

    /// The name on the command line and in files.
    pub fn name(self) -> &'static str {
        match self {
            Controller::Kuka => "kuka",
            Controller::Abb => "abb",
            Controller::Fanuc => "fanuc",
            Controller::Ur => "ur",
            Controller::Xarm => "xarm",
        }
    }

    /// What to enter for a revolute joint whose zero changed.
    ///
    /// ```
    /// use calibench_recovery::ZeroChange;
    /// use calibench_recovery::mastering::{Controller, Drive};
    /// use calibench::units::DEG;
    ///
    /// // The arm stands 0.5 deg further than the controller shows: the motor's offset is to be less.
    /// let zero = ZeroChange { joint: 2, change: 0.5 * DEG, sigma: 0.001 * DEG };
    /// let drive = Drive { gear: Some(-120.0), present: Some(2.0), ..Drive::default() };
    /// let entry = Controller::Abb.entry(&zero, &drive);
    /// assert!((entry.value - (2.0 + 120.0 * 0.5 * DEG)).abs() < 1e-12 && entry.is_new_value);
    /// ```
    pub fn entry(self, zero: &ZeroChange, drive: &Drive) -> MasteringEntry {
        let (quantity, per_rad) = match (self, drive) {
            (Controller::Kuka, _) => (MasteringQuantity::MasteringPosition, 1.0 / DEG),
            (Controller::Abb, Drive { gear: Some(gear), .. }) => (MasteringQuantity::MotorOffset, -gear),
            (Controller::Fanuc, Drive { counts_per_degree: Some(counts), .. }) => {
                (MasteringQuantity::MasterCount, -counts / DEG)
            }
            (Controller::Fanuc, _) => (MasteringQuantity::MasterPosition, 1.0 / DEG),
            (Controller::Ur, _) => (MasteringQuantity::JointCorrection, 1.0),
            (Controller::Abb | Controller::Xarm, _) => (MasteringQuantity::JointOffset, 1.0 / DEG),
        };
        // Present values are of the quantity that is entered; the arm's side of a motor has none.
        let is_own = !matches!((self, quantity), (Controller::Abb, MasteringQuantity::JointOffset));
        let present = drive.present.filter(|_| is_own);
        let mut value = present.unwrap_or(0.0) + per_rad * zero.change;
        match quantity {
            // One turn of the motor: the revolution counters know the others.
            MasteringQuantity::MotorOffset if present.is_some() => value = value.rem_euclid(TAU),
            MasteringQuantity::MasterCount => value = value.round(),
            _ => {}
        }
        MasteringEntry {
            joint: zero.joint,
            quantity,
            value,
            sigma: (per_rad * zero.sigma).abs(),
            is_new_value: present.is_some(),
            shown_at_zero: -zero.change / DEG,
        }
    }
}

impl MasteringQuantity {
    /// The name of its value for a joint, in the words of the controller.
    pub fn name(self, joint: usize) -> String {
        match self {
            MasteringQuantity::MasteringPosition => format!("$MAMES[{joint}]"),
            MasteringQuantity::MotorOffset => format!("cal_offset of motor {joint}"),
            MasteringQuantity::MasterCount => format!("$MASTER_COUN[{joint}]"),
            MasteringQuantity::MasterPosition => format!("MSTR POS of J{joint} over the angle shown"),
            MasteringQuantity::JointCorrection => format!("delta_theta[{joint}]"),
            MasteringQuantity::JointOffset => format!("zero of joint {joint}, arm side"),
        }
    }

    /// Its unit.
    pub fn unit(self) -> &'static str {
        match self {
            MasteringQuantity::MotorOffset | MasteringQuantity::JointCorrection => "rad",
            MasteringQuantity::MasterCount => "counts",
            _ => "deg",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A controller that shows the angle of a joint from its motor by the value of its maker, in rad.
    fn shown(quantity: MasteringQuantity, motor: f64, gear: f64, counts_per_degree: f64, value: f64) -> f64 {
        match quantity {
            // The value is the angle at which the axis stands where it was mastered, with the motor at zero.
            MasteringQuantity::MasteringPosition | MasteringQuantity::MasterPosition | MasteringQuantity::JointOffset => {
                motor / gear + value * DEG
            }
            MasteringQuantity::JointCorrection => motor / gear + value,
            MasteringQuantity::MotorOffset => (motor - value) / gear,
            MasteringQuantity::MasterCount => {
                let counts = motor / gear / DEG * counts_per_degree;
                (counts - value) / counts_per_degree * DEG
            }
        }
    }

    #[test]
    fn the_entered_value_makes_the_controller_show_where_the_arm_stands() {
        for controller in Controller::ALL {
            for (gear, counts, slipped) in [(121.0, 3000.0, 0.7), (-80.5, -2500.0, 0.7), (121.0, -3000.0, -2.2)] {
                let drive = Drive { gear: Some(gear), counts_per_degree: Some(counts), present: Some(1.25) };
                let true_angle = 0.4;
                let quantity = controller.entry(&ZeroChange { joint: 1, change: 0.0, sigma: 0.0 }, &drive).quantity;
                // The motor at which the controller showed the true angle before the crash, and after it.
                let nought = shown(quantity, 0.0, gear, counts, 1.25);
                let motor = (true_angle - nought - slipped * DEG) * gear;
                let before = shown(quantity, motor, gear, counts, 1.25);
                let zero = ZeroChange { joint: 1, change: true_angle - before, sigma: 1e-5 };
                let entry = controller.entry(&zero, &drive);
                assert!(entry.is_new_value && entry.sigma > 0.0);
                let mut after = shown(quantity, motor, gear, counts, entry.value);
                if quantity == MasteringQuantity::MotorOffset {
                    let turn = TAU / gear.abs();
                    after = true_angle + (after - true_angle + 0.5 * turn).rem_euclid(turn) - 0.5 * turn;
                }
                let rounding = 0.51 / 2500.0 * DEG;
                assert!((after - true_angle).abs() < rounding, "{controller:?} {}", (after - true_angle) / DEG);
                assert!((zero.change - slipped * DEG).abs() < 1e-12);
                assert!((entry.shown_at_zero + slipped).abs() < 1e-9);
            }
        }
    }

    #[test]
    fn nothing_is_assumed_of_a_gear() {
        let zero = ZeroChange { joint: 3, change: -1.5 * DEG, sigma: 0.002 * DEG };
        let entry = Controller::Abb.entry(&zero, &Drive { present: Some(2.0), ..Drive::default() });
        assert_eq!(entry.quantity, MasteringQuantity::JointOffset);
        assert!((entry.value + 1.5).abs() < 1e-12 && !entry.is_new_value);
        let entry = Controller::Fanuc.entry(&zero, &Drive::default());
        assert_eq!(entry.quantity, MasteringQuantity::MasterPosition);
        assert!((entry.value + 1.5).abs() < 1e-12 && !entry.is_new_value);
    }
}
