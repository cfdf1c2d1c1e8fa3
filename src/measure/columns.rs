//! The columns of `samples.csv`: one list, used for reading, writing and correcting the file.

/// A column known to this version.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) enum Column {
    Id,
    Kind,
    Joint(usize),
    Ball,
    Target,
    Reading(usize),
    World(usize),
    Rotation(usize),
    Anchor,
    Distance,
    Set,
    Payload,
    Time,
    Temperature,
    Approach(usize),
    Plunger(usize),
    Posture,
    Repeat,
    Session,
    Commanded(usize),
    Torque(usize),
    Sigma,
    SigmaOrientation,
}

/// Columns that form one quantity: all of them are present, or none.
pub(crate) struct Quantity {
    pub component: fn(usize) -> Column,
    pub count: usize,
}

impl Column {
    /// The quantities of several columns, for an arm of `joints` joints.
    pub fn quantities(joints: usize) -> [Quantity; 8] {
        [
            Quantity { component: Column::Joint, count: joints },
            Quantity { component: Column::Reading, count: 3 },
            Quantity { component: Column::World, count: 3 },
            Quantity { component: Column::Rotation, count: 3 },
            Quantity { component: Column::Approach, count: joints },
            Quantity { component: Column::Plunger, count: 3 },
            Quantity { component: Column::Commanded, count: joints },
            Quantity { component: Column::Torque, count: joints },
        ]
    }

    /// Every column for an arm of `joints` joints, in the order in which they are written.
    pub fn all(joints: usize) -> Vec<Column> {
        use Column::*;
        let each = |component: fn(usize) -> Column, count: usize| (0..count).map(component).collect::<Vec<_>>();
        [
            vec![Id, Kind, Set, Session],
            each(Joint, joints),
            vec![Ball, Target],
            each(Reading, 3),
            each(World, 3),
            each(Rotation, 3),
            vec![Anchor, Distance, Payload, Time, Temperature],
            each(Approach, joints),
            each(Plunger, 3),
            vec![Posture, Repeat],
            each(Commanded, joints),
            each(Torque, joints),
            vec![Sigma, SigmaOrientation],
        ]
        .concat()
    }

    /// Name in the header; components counted from 1.
    pub fn name(self) -> String {
        match self {
            Column::Id => "id".into(),
            Column::Kind => "kind".into(),
            Column::Joint(i) => format!("q{}_deg", i + 1),
            Column::Ball => "ball".into(),
            Column::Target => "target".into(),
            Column::Reading(i) => format!("r{}_um", i + 1),
            Column::World(i) => format!("{}_mm", ["x", "y", "z"][i]),
            Column::Rotation(i) => format!("{}_deg", ["rx", "ry", "rz"][i]),
            Column::Anchor => "anchor".into(),
            Column::Distance => "d_mm".into(),
            Column::Set => "set".into(),
            Column::Payload => "payload".into(),
            Column::Time => "time_s".into(),
            Column::Temperature => "temp_c".into(),
            Column::Approach(i) => format!("approach{}", i + 1),
            Column::Plunger(i) => format!("plunger{}", i + 1),
            Column::Posture => "posture".into(),
            Column::Repeat => "repeat".into(),
            Column::Session => "session".into(),
            Column::Commanded(i) => format!("qcmd{}_deg", i + 1),
            Column::Torque(i) => format!("tau{}_nm", i + 1),
            Column::Sigma => "sigma_um".into(),
            Column::SigmaOrientation => "sigma_deg".into(),
        }
    }

    /// Name without the unit, as used by import maps: `q1`, `x`, `temp`.
    pub fn quantity(self) -> String {
        if self == Column::SigmaOrientation {
            return "sigma_rotation".into(); // without its unit it would be the sigma of a position
        }
        self.name().split('_').next().unwrap_or_default().to_owned()
    }

    /// Unit at the end of the name: `deg`, `mm`, `um`, `nm`, `s`, `c`; `None` for text and signs.
    pub fn unit(self) -> Option<String> {
        self.name().split_once('_').map(|(_, unit)| unit.to_owned())
    }

    /// True if it contains a number.
    pub fn is_number(self) -> bool {
        self.unit().is_some() || matches!(self, Column::Approach(_) | Column::Plunger(_))
    }
}
