//! Axes of the gallery's plots.

use calibench::units::{DEG, MM, UM, URAD};
use nalgebra::Vector3;

use super::scene::{Row, Scene};

/// The abscissa of a picture. Joints and indicators are counted from 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Abscissa {
    Angle(usize),
    /// The angle of a joint within one of so many periods per turn.
    Phase(usize, u32),
    Torque(usize),
    Approach(usize),
    Lag(usize),
    Move(usize),
    Payload,
    Time,
    Temperature,
    /// The number of the sample, as measured.
    Order,
    Ball,
    Reading(usize),
    /// The sum of the readings of the other two indicators.
    OtherReadings(usize),
    Plunger(usize),
}

/// The ordinate of a picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ordinate {
    /// The turn of a joint that would take up most of a residual.
    Joint(usize),
    /// Along an axis of the room.
    Room(usize),
    /// Along an axis of the tool.
    Tool(usize),
    /// Of the measured orientation, about an axis of the tool.
    Turn(usize),
}

const AXES: [&str; 3] = ["x", "y", "z"];

impl Abscissa {
    /// Its value in a sample, in the unit of its label; `k` is the number of the sample.
    pub fn of(self, scene: &Scene<'_>, k: usize) -> Option<f64> {
        let row = &scene.rows[k];
        let q = |j: usize| row.sample.q.get(j).copied();
        let reading = || match row.sample.measured {
            calibench::measure::dataset::Measured::Ball { reading, .. } => reading,
            _ => None,
        };
        match self {
            Abscissa::Angle(j) => q(j).map(|q| q / DEG),
            Abscissa::Phase(j, order) => q(j).map(|q| (f64::from(order) * q).rem_euclid(std::f64::consts::TAU) / DEG),
            Abscissa::Torque(j) => row.tau.get(j).copied(),
            Abscissa::Approach(j) => row.sample.approach.as_ref()?.get(j).map(|side| f64::from(*side)),
            Abscissa::Lag(j) => Some((row.sample.q_commanded.as_ref()?.get(j)? - q(j)?) / DEG),
            Abscissa::Move(j) => Some((q(j)? - row.before?.get(j)?) / DEG),
            Abscissa::Payload => scene.payloads.iter().position(|m| *m == row.payload).map(|k| k as f64),
            Abscissa::Time => row.sample.time_s.map(|t| t / 60.0),
            Abscissa::Temperature => row.sample.temp_c,
            Abscissa::Order => Some(k as f64 + 1.0),
            Abscissa::Ball => scene.balls.iter().position(|b| Some(b.as_str()) == row.ball).map(|b| b as f64),
            Abscissa::Reading(i) => reading().map(|r| r[i] / UM),
            Abscissa::OtherReadings(i) => reading().map(|r| (r.sum() - r[i]) / UM),
            Abscissa::Plunger(i) => row.sample.plungers.map(|sides| f64::from(sides[i])),
        }
    }

    /// Its label, with the unit.
    pub fn label(self) -> String {
        match self {
            Abscissa::Angle(j) => format!("angle of joint {}, deg", j + 1),
            Abscissa::Phase(j, 1) => format!("angle of joint {} within a turn, deg", j + 1),
            Abscissa::Phase(j, order) => format!("{order} × angle of joint {}, folded to a period, deg", j + 1),
            Abscissa::Torque(j) => format!("gravity torque on joint {}, N·m", j + 1),
            Abscissa::Approach(j) => format!("side from which joint {} came", j + 1),
            Abscissa::Lag(j) => format!("commanded minus reported angle of joint {}, deg", j + 1),
            Abscissa::Move(j) => format!("last move of joint {}, deg", j + 1),
            Abscissa::Payload => "payload".into(),
            Abscissa::Time => "time since the session began, min".into(),
            Abscissa::Temperature => "temperature of the robot, °C".into(),
            Abscissa::Order => "sample, in the order of measurement".into(),
            Abscissa::Ball => "ball".into(),
            Abscissa::Reading(i) => format!("reading of indicator {}, µm", i + 1),
            Abscissa::OtherReadings(i) => format!("sum of the readings beside indicator {}, µm", i + 1),
            Abscissa::Plunger(i) => format!("side from which plunger {} came", i + 1),
        }
    }

    /// True if it is an angle, in degrees.
    pub fn is_angle(self) -> bool {
        matches!(self, Abscissa::Angle(_) | Abscissa::Phase(..) | Abscissa::Lag(_) | Abscissa::Move(_))
    }

    /// The words after "against" in a heading.
    pub fn against(self) -> String {
        match self {
            Abscissa::Angle(j) => format!("the angle of joint {}", j + 1),
            Abscissa::Phase(j, 1) => format!("the angle of joint {}", j + 1),
            Abscissa::Phase(j, order) => format!("the angle of joint {}, {order} periods per turn", j + 1),
            Abscissa::Torque(j) => format!("the torque on joint {}", j + 1),
            Abscissa::Approach(_) | Abscissa::Plunger(_) => "the side of approach".into(),
            Abscissa::Lag(_) => "commanded minus reported angle".into(),
            Abscissa::Move(_) => "the last move".into(),
            Abscissa::Payload => "the payload".into(),
            Abscissa::Time => "time".into(),
            Abscissa::Temperature => "temperature".into(),
            Abscissa::Order => "the order of measurement".into(),
            Abscissa::Ball => "the ball".into(),
            Abscissa::Reading(i) => format!("the reading of indicator {}", i + 1),
            Abscissa::OtherReadings(_) => "the readings of the other two".into(),
        }
    }

    /// Names of its values, if they are few: the value of the first, and the names of it and the next ones.
    pub fn names(self, scene: &Scene<'_>) -> Option<(f64, Vec<String>)> {
        match self {
            Abscissa::Approach(_) | Abscissa::Plunger(_) => {
                Some((-1.0, ["negative side", "", "positive side"].map(String::from).to_vec()))
            }
            Abscissa::Ball => Some((0.0, scene.balls.clone())),
            Abscissa::Payload => Some((0.0, scene.payloads.iter().map(|m| format!("{m:.1} kg")).collect())),
            _ => None,
        }
    }
}

impl Ordinate {
    /// Its value for a displacement of a sample, in the unit of its label.
    pub fn of(self, row: &Row<'_>, moved: &Vector3<f64>) -> Option<f64> {
        match self {
            Ordinate::Joint(j) => {
                let lever = row.levers.get(j)?;
                let square = lever.norm_squared();
                (square > 0.0).then(|| lever.dot(moved) / square / URAD)
            }
            Ordinate::Room(axis) => Some(moved[axis] / UM),
            Ordinate::Tool(axis) => Some((row.world_from_tool.inverse() * moved)[axis] / UM),
            Ordinate::Turn(_) => None,
        }
    }

    /// The residual of a sample, and the part of it that the effect explains.
    pub fn pair(self, row: &Row<'_>) -> Option<[f64; 2]> {
        match self {
            Ordinate::Turn(axis) => row.turn.map(|turn| turn.map(|t| t[axis] / URAD)),
            _ => Some([self.of(row, &row.residual)?, self.of(row, &row.taken)?]),
        }
    }

    /// The length in space, squared, of a value in this sample, in the square of its unit.
    pub fn weight(self, row: &Row<'_>) -> f64 {
        match self {
            // Micrometres per microradian.
            Ordinate::Joint(j) => row.levers.get(j).map_or(0.0, |lever| lever.norm_squared()),
            _ => 1.0,
        }
    }

    /// Its label, with the unit.
    pub fn label(self) -> String {
        match self {
            Ordinate::Joint(j) => format!("apparent error of joint {}, µrad", j + 1),
            Ordinate::Room(axis) => format!("residual in {} of the room, µm", AXES[axis]),
            Ordinate::Tool(axis) => format!("residual in {} of the tool, µm", AXES[axis]),
            Ordinate::Turn(axis) => format!("residual turn about {} of the tool, µrad", AXES[axis]),
        }
    }

    /// Its name in a heading.
    pub fn name(self) -> String {
        match self {
            Ordinate::Joint(j) => format!("Joint {}", j + 1),
            Ordinate::Room(axis) => format!("Room axis {}", AXES[axis]),
            Ordinate::Tool(axis) => format!("Tool axis {}", AXES[axis]),
            Ordinate::Turn(axis) => format!("Turn about tool axis {}", AXES[axis]),
        }
    }
}

/// Millimetres, for headings.
pub fn millimetres(x: f64) -> String {
    format!("{:.3} mm", x / MM)
}
