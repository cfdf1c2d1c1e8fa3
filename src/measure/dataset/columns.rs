//! The columns of `samples.csv`: one list, used for reading, writing and correcting the file.

use crate::robot::{JointKind, Robot};

/// A column known to this version.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(crate) enum Column {
    Id,
    Kind,
    Joint(usize),
    /// A prismatic joint.
    Slide(usize),
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
    CommandedSlide(usize),
    /// A coordinate of the commanded position.
    CommandedPoint(usize),
    Torque(usize),
    /// Force on a prismatic joint.
    Force(usize),
    Sigma,
    SigmaOrientation,
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
pub(crate) const KINDS: [RowKind; 4] = {
    use Column::*;
    let commanded = &[CommandedPoint(0), CommandedPoint(1), CommandedPoint(2)];
    let gauge = &[Reading(0), Reading(1), Reading(2), Plunger(0), Plunger(1), Plunger(2)];
    [
        RowKind { name: "ball", required: &[Ball], optional: gauge },
        RowKind { name: "point", required: &[World(0), World(1), World(2)], optional: commanded },
        RowKind {
            name: "pose",
            required: &[World(0), World(1), World(2), Rotation(0), Rotation(1), Rotation(2)],
            optional: &[SigmaOrientation, CommandedPoint(0), CommandedPoint(1), CommandedPoint(2)],
        },
        RowKind { name: "distance", required: &[Anchor, Distance], optional: &[] },
    ]
};

/// The values of the column `set`.
pub(crate) const SETS: [&str; 2] = ["fit", "validation"];

impl Column {
    /// The position of joint `i`.
    pub fn joint(robot: &Robot, i: usize) -> Column {
        if slides(robot, i) { Column::Slide(i) } else { Column::Joint(i) }
    }

    /// The commanded position of joint `i`.
    pub fn commanded(robot: &Robot, i: usize) -> Column {
        if slides(robot, i) { Column::CommandedSlide(i) } else { Column::Commanded(i) }
    }

    /// The torque of joint `i`, or its force.
    pub fn load(robot: &Robot, i: usize) -> Column {
        if slides(robot, i) { Column::Force(i) } else { Column::Torque(i) }
    }

    /// The quantities of several columns, the joints first: all columns of one are present, or none.
    pub fn quantities(robot: &Robot) -> [Vec<Column>; 9] {
        let n = robot.joints();
        let of_joints = |component: fn(&Robot, usize) -> Column| (0..n).map(|i| component(robot, i)).collect();
        let each = |component: fn(usize) -> Column, count: usize| (0..count).map(component).collect();
        [
            of_joints(Column::joint),
            each(Column::Reading, 3),
            each(Column::World, 3),
            each(Column::Rotation, 3),
            each(Column::Approach, n),
            each(Column::Plunger, 3),
            of_joints(Column::commanded),
            each(Column::CommandedPoint, 3),
            of_joints(Column::load),
        ]
    }

    /// Every column for an arm, in the order in which they are written.
    pub fn all(robot: &Robot) -> Vec<Column> {
        use Column::*;
        let joints = robot.joints();
        let of_joints = |component: fn(&Robot, usize) -> Column| (0..joints).map(|i| component(robot, i)).collect::<Vec<_>>();
        let each = |component: fn(usize) -> Column, count: usize| (0..count).map(component).collect::<Vec<_>>();
        [
            vec![Id, Kind, Set, Session],
            of_joints(Column::joint),
            vec![Ball, Target],
            each(Reading, 3),
            each(World, 3),
            each(Rotation, 3),
            vec![Anchor, Distance, Payload, Time, Temperature],
            each(Approach, joints),
            each(Plunger, 3),
            vec![Posture, Repeat],
            of_joints(Column::commanded),
            each(CommandedPoint, 3),
            of_joints(Column::load),
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
            Column::Slide(i) => format!("q{}_mm", i + 1),
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
            Column::CommandedSlide(i) => format!("qcmd{}_mm", i + 1),
            Column::CommandedPoint(i) => format!("{}cmd_mm", ["x", "y", "z"][i]),
            Column::Force(i) => format!("tau{}_n", i + 1),
            Column::Torque(i) => format!("tau{}_nm", i + 1),
            Column::Sigma => "sigma_um".into(),
            Column::SigmaOrientation => "sigma_deg".into(),
        }
    }

    /// Meaning of its values.
    #[cfg(feature = "schema")]
    pub fn meaning(self) -> &'static str {
        match self {
            Column::Id => "Unique name of the sample.",
            Column::Kind => {
                "What was measured: the TCP centred on a `ball`, a `point` of the tool, its `pose`, or a `distance` from an anchor."
            }
            Column::Joint(_) => "Joint angle as the controller reports it, actual and not commanded, deg.",
            Column::Slide(_) => "Position of a prismatic joint as the controller reports it, mm.",
            Column::Ball => "Id of a ball of dataset.toml.",
            Column::Target => "Id of a target of dataset.toml, if it is not the TCP that was measured.",
            Column::Reading(_) => "Reading of a plunger when the centring stopped, um.",
            Column::World(_) => "Measured position of the point, world frame, mm.",
            Column::Rotation(_) => "Measured orientation of the tool, a rotation vector in the world frame, deg.",
            Column::Anchor => "Id of an anchor of dataset.toml.",
            Column::Distance => "Measured distance from the anchor, mm.",
            Column::Set => "`fit`, unless another is given; a row of `validation` is never fitted, nor used to select.",
            Column::Payload => "Name of a payload of dataset.toml; the first one if none is given.",
            Column::Time => "Time since the session began, s.",
            Column::Temperature => "Temperature of the robot, °C.",
            Column::Approach(_) => "Sign of the joint's last motion before the sample.",
            Column::Plunger(_) => "Sign of the plunger's last motion.",
            Column::Posture => "Rows of a session with the same value were taken in one posture.",
            Column::Repeat => "Rows with the same value are replicates of one target.",
            Column::Session => "Rows of one session share one base and one tool; another session has its own.",
            Column::Commanded(_) => "Commanded joint angle, where `q1_deg` ... are those read back, deg.",
            Column::CommandedSlide(_) => "Commanded position of a prismatic joint, mm.",
            Column::CommandedPoint(_) => {
                "Commanded position of the point, world frame, mm: with it the errors of the robot as delivered are known."
            }
            Column::Force(_) => "Measured force on a prismatic joint, N.",
            Column::Torque(_) => "Measured joint torque, N·m; used instead of the masses if the model says so.",
            Column::Sigma => "One-sigma of this row in place of that of dataset.toml, um.",
            Column::SigmaOrientation => "One-sigma of its orientation about each axis, in place of that of dataset.toml, deg.",
        }
    }

    /// Name without the unit, as used by import maps: `q1`, `x`, `temp`.
    pub fn quantity(self) -> String {
        if self == Column::SigmaOrientation {
            return "sigma_rotation".into(); // without its unit it would be the sigma of a position
        }
        self.name().split('_').next().unwrap_or_default().to_owned()
    }

    /// Unit at the end of the name: `deg`, `mm`, `um`, `nm`, `n`, `s`, `c`; `None` for text and signs.
    pub fn unit(self) -> Option<String> {
        self.name().split_once('_').map(|(_, unit)| unit.to_owned())
    }

    /// True if it contains a number.
    pub fn is_number(self) -> bool {
        self.unit().is_some() || matches!(self, Column::Approach(_) | Column::Plunger(_))
    }
}

fn slides(robot: &Robot, i: usize) -> bool {
    robot.kind(i) == JointKind::Prismatic
}

/// The problem with a title that is the column of a joint of the other kind, and the right title.
pub(crate) fn of_other_kind(title: &str, robot: &Robot) -> Option<(String, String)> {
    let (quantity, _) = title.split_once('_')?;
    let is_it = |column: &Column| column.quantity() == quantity;
    let (i, right) = (0..robot.joints()).find_map(|i| {
        let columns = [Column::joint, Column::commanded, Column::load].map(|component| component(robot, i));
        columns.into_iter().find(is_it).map(|column| (i, column.name()))
    })?;
    let other = ["deg", "mm", "nm", "n"].into_iter().any(|unit| title == format!("{quantity}_{unit}"));
    let does = if slides(robot, i) { "slides" } else { "turns" };
    (other && title != right).then(|| (format!("joint {} {does}, so it has no such column", i + 1), format!("name it {right}")))
}
