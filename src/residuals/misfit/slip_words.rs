//! What slips are called: their names in files, and their corrections in words.

use nalgebra::Vector3;

use super::campaign::Campaign;
use super::slip::{Along, LENGTHS, Slip};
use crate::effects::EffectId;
use crate::robot::JointKind;
use crate::units::{DEG, MM};

const AXES: [&str; 3] = ["x", "y", "z"];

impl Slip {
    /// Name in files.
    pub fn name(&self, campaign: &Campaign) -> String {
        let ball = |b: usize| &campaign.balls[b].id;
        let anchor = |a: usize| &campaign.anchors[a].id;
        match *self {
            Slip::JointUnit(_) => "unit:joints".into(),
            Slip::PointUnit(_) => "unit:points".into(),
            Slip::ReadingUnit(_) => "unit:readings".into(),
            Slip::SlideUnit(_) => "unit:slides".into(),
            Slip::ToolUnit(_) => "tool_unit".into(),
            Slip::Tool => "tool".into(),
            Slip::JointSign(j) => format!("joint_sign:{}", j + 1),
            Slip::JointZero(j, _) => format!("joint_zero:{}", j + 1),
            Slip::JointsSwapped(j, k) => format!("joints_swapped:{}:{}", j + 1, k + 1),
            Slip::AxesSwapped(a, b) => format!("axes_swapped:{}{}", AXES[a], AXES[b]),
            Slip::AxisSign(a) => format!("axis_sign:{}", AXES[a]),
            Slip::BallsSwapped(a, b) => format!("balls_swapped:{}:{}", ball(a), ball(b)),
            Slip::Ball(b) => EffectId::member(EffectId::BALL, ball(b)).to_string(),
            Slip::RowsShifted(_) => "rows_shifted".into(),
            Slip::Robot(name) => format!("robot:{name}"),
            Slip::Commanded => "joints_commanded".into(),
            Slip::JointScale(j, [by, zero]) => match by {
                1.0 => format!("joint_zero:{}", j + 1),
                -1.0 if zero == 0.0 => format!("joint_sign:{}", j + 1),
                -1.0 => format!("joint_sign:{0}+joint_zero:{0}", j + 1),
                _ => EffectId::member(EffectId::JOINT_SCALE, j + 1).to_string(),
            },
            Slip::JointScales(ref all) if all.iter().all(|[by, _]| *by == 1.0) => "joint_zeros".into(),
            Slip::JointScales(ref all) if all.iter().all(|[by, _]| by.abs() == 1.0) => "joint_signs_and_zeros".into(),
            Slip::JointScales(_) => "joint_scales".into(),
            Slip::Coupled(j, k, _) => format!("joint_coupled:{}:{}", j + 1, k + 1),
            Slip::Length(i, Along::X, _) => format!("length:a{i}"),
            Slip::Length(i, Along::Z, _) => format!("length:d{}", i + 1),
            Slip::Convention(_) => "dh_convention".into(),
            Slip::LeftHanded => "left_handed".into(),
            Slip::PointScale(_) => "scale:points".into(),
            Slip::DistanceScale(by) if LENGTHS.contains(&by) => "unit:distances".into(),
            Slip::DistanceScale(by) if by == 2.0 || by == 0.5 => "distances_doubled".into(),
            Slip::DistanceScale(_) => "scale:distances".into(),
            Slip::DistanceConstant(_) => "distance_constant".into(),
            Slip::DistanceSquared(_) => "distances_squared".into(),
            Slip::AnchorsSwapped(a, b) => format!("anchors_swapped:{}:{}", anchor(a), anchor(b)),
            Slip::Anchor(a) => format!("anchor:{}", anchor(a)),
            Slip::Only(setup, ref slip) => format!("{}@{}", slip.name(campaign), campaign.places[setup].name),
        }
    }

    /// Describes the correction, as the beginning of a sentence that continues with "leaves 0.9 instead of 923 mm".
    pub fn words(&self, campaign: &Campaign) -> String {
        let ball = |b: usize| &campaign.balls[b].id;
        let anchor = |a: usize| &campaign.anchors[a].id;
        match *self {
            Slip::JointUnit(by) if by > 1.0 => "joint angles taken as radians where degrees are stated".into(),
            Slip::JointUnit(_) => "joint angles taken as degrees where radians are stated".into(),
            Slip::PointUnit(by) => format!("measured places and distances {}", scaled(by)),
            Slip::ReadingUnit(by) => format!("the residual readings {}", scaled(by)),
            Slip::SlideUnit(by) => format!("the positions of prismatic joints {}", scaled(by)),
            Slip::ToolUnit(by) => format!("the tool {}", scaled(by)),
            Slip::Tool => "a tool other than the stated one, found from the data,".into(),
            Slip::JointSign(j) => format!("joint {} counted the other way", j + 1),
            Slip::JointZero(j, zero) => {
                format!("joint {} with {:+} deg added to it", j + 1, (zero / DEG * 10.0).round() / 10.0)
            }
            Slip::JointsSwapped(j, k) => format!("joints {} and {} exchanged", j + 1, k + 1),
            Slip::AxesSwapped(a, b) => format!("{} and {} of the measured places exchanged", AXES[a], AXES[b]),
            Slip::AxisSign(a) => format!("{} of the measured places counted the other way", AXES[a]),
            Slip::BallsSwapped(a, b) => format!("balls {} and {} exchanged", ball(a), ball(b)),
            Slip::Ball(b) => format!("ball {} at another place than stated", ball(b)),
            Slip::RowsShifted(to) => {
                format!("the joints of each row with the measurement of the row {} it", ["before", "after"][to])
            }
            Slip::Robot(name) => format!("the robot taken to be a {name}"),
            Slip::Commanded => "the commanded joints in place of those read back".into(),
            Slip::JointScale(j, [by, zero]) => {
                let (turns, no_zero) = (campaign.robot.kind(j) == JointKind::Revolute, zero == 0.0);
                let zero = if turns { format!("{:+.2} deg", zero / DEG) } else { format!("{:+.2} mm", zero / MM) };
                match by {
                    1.0 => format!("joint {} with {zero} added to it", j + 1),
                    -1.0 => format!("joint {} counted the other way, with {zero} added to it", j + 1),
                    _ if no_zero => format!("the scale of joint {}, times {by:.6},", j + 1),
                    _ => format!("joint {} multiplied by {by:.4}, with {zero} added to it", j + 1),
                }
            }
            Slip::JointScales(ref all) => {
                let one = |(j, [by, zero]): (usize, &[f64; 2])| {
                    let (unit, name) = if campaign.robot.kind(j) == JointKind::Revolute { (DEG, "deg") } else { (MM, "mm") };
                    let times = if *by == 1.0 { String::new() } else { format!(" multiplied by {by:.4}") };
                    (*by != 1.0 || zero.abs() > unit).then(|| format!("{}{times} {:+.1} {name}", j + 1, zero / unit))
                };
                let each: Vec<String> = all.iter().enumerate().filter_map(one).collect();
                let scaled = all.iter().any(|[by, _]| by.abs() != 1.0);
                format!(
                    "{} (joint {})",
                    if scaled { "a scale and a zero of each joint" } else { "other zeros of the joints" },
                    each.join(", joint ")
                )
            }
            Slip::Coupled(j, k, by) => format!(
                "joint {} {} joint {} (the controller counts it from the horizontal, not from joint {2})",
                j + 1,
                if by > 0.0 { "plus" } else { "minus" },
                k + 1
            ),
            Slip::Length(i, along, more) => {
                let name = if along == Along::X { format!("a{i}") } else { format!("d{}", i + 1) };
                format!("a length {name} of the arm {:+.1} mm (another variant of the robot)", more / MM)
            }
            Slip::Convention(to) => {
                let [is, not] = if to > 0 { ["standard", "modified"] } else { ["modified", "standard"] };
                format!("the robot's table read in the {is} Denavit-Hartenberg convention, not in the {not} one,")
            }
            Slip::LeftHanded => "the measured places taken as those of a left-handed frame (mirrored)".into(),
            Slip::PointScale(by) => format!("the measured places multiplied by {by:.5} (the scale of the instrument)"),
            Slip::DistanceScale(by) if LENGTHS.contains(&by) => format!("the measured distances {}", scaled(by)),
            Slip::DistanceScale(2.0) => "the measured distances doubled (radii written for diameters)".into(),
            Slip::DistanceScale(0.5) => {
                "the measured distances halved (diameters, or there and back, written for distances)".into()
            }
            Slip::DistanceScale(by) => format!("the measured distances multiplied by {by:.6} (the scale of the instrument)"),
            Slip::DistanceConstant(more) => {
                format!("{:+.2} mm added to every measured distance (the constant of the instrument)", more / MM)
            }
            Slip::DistanceSquared(_) => "the square roots of the measured distances".into(),
            Slip::AnchorsSwapped(a, b) => format!("anchors {} and {} exchanged", anchor(a), anchor(b)),
            Slip::Anchor(a) => format!("anchor {} at another place than stated", anchor(a)),
            Slip::Only(setup, ref slip) => format!("of {}, {}", campaign.places[setup].name, slip.words(campaign)),
        }
    }
}

/// The correction of an anchor that was found here, as [`Slip::words`]. Of three anchors the other two let arm and anchor turn
/// about the line between them, and nothing is known of its place along that turn.
pub(super) fn words_of_place(campaign: &Campaign, anchor: usize, found: &Vector3<f64>) -> String {
    let stated = &campaign.anchors[anchor];
    let mut off = found - stated.position;
    let others: Vec<Vector3<f64>> = (0..campaign.anchors.len())
        .filter(|&a| a != anchor && campaign.sights(a))
        .map(|a| campaign.anchors[a].position)
        .collect();
    let mut least = "";
    if let [a, b] = others[..] {
        least = "at least ";
        let turn = (b - a).cross(&(stated.position - a));
        off -= turn * (turn.dot(&off) / turn.norm_squared().max(f64::MIN_POSITIVE));
    }
    let [x, y, z] = [off.x, off.y, off.z].map(|x| x / MM);
    format!(
        "anchor {} at another place than stated, {least}{:.1} mm away ({x:+.1}, {y:+.1}, {z:+.1} mm),",
        stated.id,
        off.norm() / MM
    )
}

pub(super) fn scaled(by: f64) -> &'static str {
    match by {
        b if b > 100.0 => "1000 times as large (metres written where millimetres are stated)",
        b if b > 1.0 => "25.4 times as large (inches written where millimetres are stated)",
        b if b < 0.01 => "1000 times smaller (micrometres or millimetres written where a larger unit is stated)",
        _ => "25.4 times smaller (millimetres written where inches are stated)",
    }
}
