//! The keys of `[robot]` with `kind = "ur"`.

use serde::Deserialize;

use super::{UrMotion, UrPayload, UrSettings, UrTorques};
use crate::cell::patience::PatienceKeys;
use crate::cell::robot_settings::{FlangeKeys, RobotKeys, slow};
use crate::cell::{CellReading, RobotKind, RobotSettings};
use crate::files::FileError;
use crate::units::{DEG, MM};

/// A Universal Robot behind RTDE.
#[derive(Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(crate) struct UrKeys {
    /// The kind of controller; the other keys are those of this kind.
    #[serde(rename = "kind")]
    #[cfg_attr(feature = "schema", schemars(extend("const" = "ur")))]
    _kind: RobotKind,
    /// `HOST:PORT` of RTDE, usually port 30004.
    address: String,
    /// Speed override during the measurement, %.
    #[serde(default = "slow")]
    #[cfg_attr(feature = "schema", schemars(range(min = 1, max = 100)))]
    speed_percent: u8,
    /// The controller's flange in the last frame of the robot's model; of `ur5` and `ur10` they are the same.
    #[serde(default)]
    flange: FlangeKeys,
    /// Payload that the controller is told before the first motion; without it, the one set there remains.
    payload: Option<PayloadKeys>,
    /// If given, every sample has the moments of the joints, from the currents that hold them.
    torques: Option<TorqueKeys>,
    /// Speeds at a speed override of 100 %.
    #[serde(default)]
    motion: MotionKeys,
    /// Timeouts and intervals.
    #[serde(default)]
    patience: PatienceKeys,
}

/// A payload on the flange.
#[derive(Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
struct PayloadKeys {
    /// Mass of tool and load, kg.
    #[cfg_attr(feature = "schema", schemars(range(min = 0)))]
    mass_kg: f64,
    /// Their centre of mass in the flange, mm.
    com_mm: [f64; 3],
}

/// The moments of the joints.
#[derive(Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
struct TorqueKeys {
    /// Torque of each joint's drive per ampere, N·m/A; without it, the controller's own conversion is read, which its software has from
    /// 5.23 or 10.11 on.
    nm_per_a: Option<[f64; 6]>,
}

/// Speeds and accelerations.
#[derive(Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, default)]
struct MotionKeys {
    /// Speed of the fastest joint, deg/s.
    #[cfg_attr(feature = "schema", schemars(extend("exclusiveMinimum" = 0)))]
    joint_speed_deg_s: f64,
    /// Its acceleration, deg/s².
    #[cfg_attr(feature = "schema", schemars(extend("exclusiveMinimum" = 0)))]
    joint_acceleration_deg_s2: f64,
    /// Speed of the tool in a straight line, mm/s.
    #[cfg_attr(feature = "schema", schemars(extend("exclusiveMinimum" = 0)))]
    line_speed_mm_s: f64,
    /// Its acceleration, mm/s².
    #[cfg_attr(feature = "schema", schemars(extend("exclusiveMinimum" = 0)))]
    line_acceleration_mm_s2: f64,
}

impl Default for MotionKeys {
    fn default() -> Self {
        let UrMotion { joint_speed, joint_acceleration, line_speed, line_acceleration } = UrMotion::default();
        MotionKeys {
            joint_speed_deg_s: (joint_speed / DEG).round(),
            joint_acceleration_deg_s2: (joint_acceleration / DEG).round(),
            line_speed_mm_s: line_speed / MM,
            line_acceleration_mm_s2: line_acceleration / MM,
        }
    }
}

/// Number of joints of every Universal Robot.
const JOINTS: usize = 6;

/// Heaviest payload of the series, kg, with some reserve: more is a mistake of units.
const HEAVIEST: f64 = 50.0;

/// Range of the torque per ampere after the gear, N·m/A: 7 of the smallest joints, 25 of the largest, with some reserve.
const PER_AMPERE: [f64; 2] = [2.0, 60.0];

impl RobotKeys for UrKeys {
    fn speed_percent(&self) -> u8 {
        self.speed_percent
    }

    fn flange(&self) -> &FlangeKeys {
        &self.flange
    }

    fn settings(&self, reading: &CellReading<'_>, joints: usize) -> Result<RobotSettings, FileError> {
        if joints != JOINTS {
            let problem = format!("its robot has {joints} joints");
            let remedy = "a Universal Robot has six; give the model of such an arm";
            return Err(reading.wrong("dataset", problem, remedy));
        }
        reading.address("robot.address", &self.address)?;
        let payload = self.payload.as_ref().map(|keys| keys.payload(reading)).transpose()?;
        let torques = self.torques.as_ref().map(|keys| keys.torques(reading)).transpose()?;
        let within = |key: &str, value: f64, [least, most]: [f64; 2]| {
            let key = format!("robot.motion.{key}");
            if (least..=most).contains(&value) {
                return Ok(value);
            }
            Err(reading.wrong(
                &key,
                format!("{value} is not what a Universal Robot moves at"),
                &format!("give {least} to {most}"),
            ))
        };
        let keys = &self.motion;
        Ok(RobotSettings::Ur(Box::new(UrSettings {
            address: self.address.clone(),
            payload,
            torques,
            motion: UrMotion {
                joint_speed: within("joint_speed_deg_s", keys.joint_speed_deg_s, [0.1, 360.0])? * DEG,
                joint_acceleration: within("joint_acceleration_deg_s2", keys.joint_acceleration_deg_s2, [1.0, 2300.0])? * DEG,
                line_speed: within("line_speed_mm_s", keys.line_speed_mm_s, [0.1, 5000.0])? * MM,
                line_acceleration: within("line_acceleration_mm_s2", keys.line_acceleration_mm_s2, [1.0, 150_000.0])? * MM,
            },
            patience: self.patience.patience(reading)?,
        })))
    }
}

impl TorqueKeys {
    fn torques(&self, reading: &CellReading<'_>) -> Result<UrTorques, FileError> {
        let Some(factors) = self.nm_per_a else { return Ok(UrTorques::Converted) };
        match factors.iter().find(|factor| !(PER_AMPERE[0]..=PER_AMPERE[1]).contains(*factor)) {
            Some(factor) => {
                let problem = format!("{factor} N·m/A is not what a joint of a Universal Robot exerts");
                let remedy = format!("give N·m per ampere after the gear, {} to {}", PER_AMPERE[0], PER_AMPERE[1]);
                Err(reading.wrong("robot.torques.nm_per_a", problem, &remedy))
            }
            None => Ok(UrTorques::PerAmpere(factors)),
        }
    }
}

impl PayloadKeys {
    fn payload(&self, reading: &CellReading<'_>) -> Result<UrPayload, FileError> {
        if !(0.0..=HEAVIEST).contains(&self.mass_kg) {
            let problem = format!("{} kg is not a payload of a Universal Robot", self.mass_kg);
            return Err(reading.wrong("robot.payload.mass_kg", problem, "give kilograms"));
        }
        if !self.com_mm.iter().all(|x| x.abs() <= 1000.0) {
            return Err(reading.wrong("robot.payload.com_mm", "it is more than a metre from the flange", "give millimetres"));
        }
        Ok(UrPayload { mass: self.mass_kg, com: self.com_mm.map(|x| x * MM) })
    }
}
