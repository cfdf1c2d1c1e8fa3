//! The columns of `samples.csv`: one list, used for reading, writing and correcting the file.

/// A column known to this version.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) enum Column {
    Id,
    Kind,
    Joint(usize),
    Ball,
    Reflector,
    Reading(usize),
    World(usize),
    Anchor,
    Distance,
    Set,
    Payload,
    Time,
    Temperature,
    Approach(usize),
    Plunger(usize),
    Repeat,
    Session,
    Commanded(usize),
    Torque(usize),
    Sigma,
}

/// Columns that form one quantity: all of them are present, or none.
pub(crate) struct Quantity {
    pub component: fn(usize) -> Column,
    pub count: usize,
}

/// A kind of row, by the columns of its measurement. In a row of another kind these are empty.
pub(crate) struct RowKind {
    /// Value of the column `kind`.
    pub name: &'static str,
    /// Columns that it must fill.
    pub required: &'static [Column],
    /// Columns that it may fill.
    pub optional: &'static [Column],
}

impl RowKind {
    /// The columns of its measurement.
    pub fn columns(&self) -> impl Iterator<Item = Column> {
        self.required.iter().chain(self.optional).copied()
    }
}

/// The kinds of rows.
pub(crate) const KINDS: [RowKind; 3] = {
    use Column::*;
    let gauge = &[Reading(0), Reading(1), Reading(2), Plunger(0), Plunger(1), Plunger(2)];
    [
        RowKind { name: "ball", required: &[Ball], optional: gauge },
        RowKind { name: "point", required: &[World(0), World(1), World(2)], optional: &[] },
        RowKind { name: "distance", required: &[Anchor, Distance], optional: &[] },
    ]
};

/// The values of the column `set`.
pub(crate) const SETS: [&str; 2] = ["fit", "validation"];

impl Column {
    /// The quantities of several columns, for an arm of `joints` joints.
    pub fn quantities(joints: usize) -> [Quantity; 7] {
        [
            Quantity { component: Column::Joint, count: joints },
            Quantity { component: Column::Reading, count: 3 },
            Quantity { component: Column::World, count: 3 },
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
            vec![Ball, Reflector],
            each(Reading, 3),
            each(World, 3),
            vec![Anchor, Distance, Payload, Time, Temperature],
            each(Approach, joints),
            each(Plunger, 3),
            vec![Repeat],
            each(Commanded, joints),
            each(Torque, joints),
            vec![Sigma],
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
            Column::Reflector => "reflector".into(),
            Column::Reading(i) => format!("r{}_um", i + 1),
            Column::World(i) => format!("{}_mm", ["x", "y", "z"][i]),
            Column::Anchor => "anchor".into(),
            Column::Distance => "d_mm".into(),
            Column::Set => "set".into(),
            Column::Payload => "payload".into(),
            Column::Time => "time_s".into(),
            Column::Temperature => "temp_c".into(),
            Column::Approach(i) => format!("approach{}", i + 1),
            Column::Plunger(i) => format!("plunger{}", i + 1),
            Column::Repeat => "repeat".into(),
            Column::Session => "session".into(),
            Column::Commanded(i) => format!("qcmd{}_deg", i + 1),
            Column::Torque(i) => format!("tau{}_nm", i + 1),
            Column::Sigma => "sigma_um".into(),
        }
    }

    /// What it holds.
    #[cfg(feature = "schema")]
    pub fn meaning(self) -> &'static str {
        match self {
            Column::Id => "Unique name of the sample.",
            Column::Kind => {
                "What was measured: the TCP centred on a `ball`, a `point` of the tool, or a `distance` of it from an anchor."
            }
            Column::Joint(_) => "Joint angle as the controller reports it, actual and not commanded, deg.",
            Column::Ball => "Id of a ball of dataset.toml.",
            Column::Reflector => "Id of a reflector of dataset.toml, if it is not the TCP that was measured.",
            Column::Reading(_) => "Reading of a plunger when the centring stopped, um.",
            Column::World(_) => "Measured position of the point, world frame, mm.",
            Column::Anchor => "Id of an anchor of dataset.toml.",
            Column::Distance => "Measured distance from the anchor, mm.",
            Column::Set => "`fit`, unless another is given; a row of `validation` is never fitted, nor used to select.",
            Column::Payload => "Name of a payload of dataset.toml; the first one if none is given.",
            Column::Time => "Time since the session began, s.",
            Column::Temperature => "Temperature of the robot, °C.",
            Column::Approach(_) => "Sign of the joint's last motion before the sample.",
            Column::Plunger(_) => "Sign of the plunger's last motion.",
            Column::Repeat => "Rows with the same value are replicates of one target.",
            Column::Session => "Rows of one session share one base and one tool; another session has its own.",
            Column::Commanded(_) => "Commanded joint angle, where `q1_deg` ... are those read back, deg.",
            Column::Torque(_) => "Measured joint torque, N·m; used instead of the masses if the model says so.",
            Column::Sigma => "One-sigma of this row in place of that of dataset.toml, um.",
        }
    }

    /// Name without the unit, as used by import maps: `q1`, `x`, `temp`.
    pub fn quantity(self) -> String {
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
