//! Slips: common mistakes in tables of measurements, as changes of a campaign.

use std::f64::consts::{FRAC_PI_2, PI};
use std::sync::Arc;

use nalgebra::Vector3;

use super::campaign::{Campaign, Seen, Shot};
use crate::robot::{BUILT_IN, JointKind, built_in};
use crate::units::DEG;

/// One slip. Joints, axes and balls are counted from 0; numbers are those of the correction.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Slip {
    /// Wrong unit of the joint angles; factor.
    JointUnit(f64),
    /// Wrong unit of positions (balls, points, anchors) and distances; factor.
    PointUnit(f64),
    /// Wrong unit of the residual readings; factor.
    ReadingUnit(f64),
    /// Wrong unit of the positions of prismatic joints; factor.
    SlideUnit(f64),
    /// Wrong unit of the stated tool; factor.
    ToolUnit(f64),
    /// A tool other than the stated one.
    Tool,
    /// Wrong sign of a joint.
    JointSign(usize),
    /// Wrong zero of a joint; offset, rad.
    JointZero(usize, f64),
    /// Two joints interchanged.
    JointsSwapped(usize, usize),
    /// Two axes of the world interchanged.
    AxesSwapped(usize, usize),
    /// Wrong sign of an axis of the world.
    AxisSign(usize),
    /// Two balls interchanged.
    BallsSwapped(usize, usize),
    /// A ball at a position other than the stated one.
    Ball(usize),
    /// Joint angles written one row after (0) or before (1) their measurement.
    RowsShifted(usize),
    /// Another robot.
    Robot(&'static str),
    /// Wrong reported joint angles; the commanded ones are correct.
    Commanded,
}

const AXES: [&str; 3] = ["x", "y", "z"];
/// Factors between units of length that are confused, in both directions: metres and millimetres, inches and
/// millimetres.
pub(super) const LENGTHS: [f64; 4] = [1000.0, 1e-3, 25.4, 1.0 / 25.4];

impl Slip {
    /// Every slip that may have occurred in these data.
    pub fn all(campaign: &Campaign) -> Vec<Slip> {
        let robot = &campaign.robot;
        let n = robot.joints();
        let turns = |j: &usize| robot.kind(*j) == JointKind::Revolute;
        let mut all = vec![Slip::JointUnit(1.0 / DEG), Slip::JointUnit(DEG)];
        if robot.first_prismatic().is_some() {
            all.extend(LENGTHS.map(Slip::SlideUnit));
        }
        if campaign.has_known_places() || !campaign.ties.is_empty() {
            all.extend(LENGTHS.map(Slip::PointUnit));
        }
        let read = |s: &Shot| matches!(s.seen, Seen::Ball { reading, .. } if reading != Vector3::zeros());
        if campaign.shots.iter().any(read) {
            all.extend([1000.0, 1e-3].map(Slip::ReadingUnit));
        }
        all.extend((0..n).map(Slip::JointSign));
        all.extend((0..n).filter(turns).flat_map(|j| [FRAC_PI_2, -FRAC_PI_2, PI].map(|zero| Slip::JointZero(j, zero))));
        let pairs = (0..n).flat_map(|j| (j + 1..n).map(move |k| (j, k)));
        all.extend(pairs.filter(|(j, k)| robot.kind(*j) == robot.kind(*k)).map(|(j, k)| Slip::JointsSwapped(j, k)));
        if campaign.has_known_places() {
            all.extend([(0, 1), (0, 2), (1, 2)].map(|(a, b)| Slip::AxesSwapped(a, b)));
            all.extend([2, 1, 0].map(Slip::AxisSign));
        }
        let known: Vec<usize> = (0..campaign.balls.len()).filter(|&b| !campaign.balls[b].free && campaign.probes(b)).collect();
        for (i, &b) in known.iter().enumerate() {
            all.extend(known[i + 1..].iter().map(|&c| Slip::BallsSwapped(b, c)));
        }
        all.extend([0, 1].map(Slip::RowsShifted));
        let robots = BUILT_IN.iter().filter_map(|name| built_in(name).map(|robot| (*name, robot)));
        all.extend(
            robots.filter(|(_, r)| r.joints() == n && !r.is_same_arm(&campaign.robot)).map(|(name, _)| Slip::Robot(name)),
        );
        if campaign.places.iter().any(|p| !p.tool_free && p.tool.xyz != [0.0; 3]) {
            all.extend(LENGTHS.map(Slip::ToolUnit));
        }
        if campaign.shots.iter().all(|s| s.commanded.is_some()) {
            all.push(Slip::Commanded);
        }
        if known.len() > 2 {
            all.extend(known.iter().map(|&b| Slip::Ball(b)));
        }
        if campaign.places.iter().any(|p| !p.tool_free) {
            all.push(Slip::Tool);
        }
        all
    }

    /// Slips that may merely turn the base: the zero of joint 1, and, if all positions lie in a plane, the axes of the
    /// world.
    pub fn turning_the_base(campaign: &Campaign) -> Vec<Slip> {
        let turns = |s: &Slip| matches!(s, Slip::JointZero(0, _)) || matches!(s, Slip::AxesSwapped(..) | Slip::AxisSign(_));
        Slip::all(campaign).into_iter().filter(turns).collect()
    }

    /// True if two slips plausibly occur together; not symmetric.
    pub fn goes_with(&self, other: &Slip) -> bool {
        use Slip::{AxesSwapped, AxisSign, JointSign, JointUnit, JointZero, JointsSwapped, PointUnit, Robot};
        let frees = |s: &Slip| matches!(s, Slip::Ball(_) | Slip::Tool);
        if std::mem::discriminant(self) == std::mem::discriminant(other) {
            return match (self, other) {
                (JointSign(_), JointSign(_)) => true,
                (JointZero(j, _), JointZero(k, _)) => j != k,
                _ => false,
            };
        }
        let unit = |s: &Slip| matches!(s, JointUnit(_) | PointUnit(_) | Slip::SlideUnit(_));
        let joint = |s: &Slip| matches!(s, JointSign(_) | JointZero(..) | JointsSwapped(..) | Robot(_));
        let mirror = |s: &Slip| matches!(s, AxesSwapped(0, 1) | AxisSign(2));
        (unit(self) && !frees(other))
            || (joint(self) && joint(other))
            || (joint(self) && mirror(other))
            || (joint(self) && matches!(other, Slip::ToolUnit(_) | Slip::BallsSwapped(..)))
    }

    /// True if the slip adds unknowns to the fit, which can only reduce the residual.
    pub fn adds_freedom(&self) -> bool {
        matches!(self, Slip::Ball(_) | Slip::Tool)
    }

    /// True if the slip changes how far the arm moves, so that residuals must be compared relative to the motion.
    pub fn rescales_motion(&self) -> bool {
        matches!(self, Slip::JointUnit(_) | Slip::SlideUnit(_))
    }

    /// The campaign with the slip corrected.
    pub fn undone(&self, campaign: &Campaign) -> Campaign {
        let mut c = campaign.clone();
        let each_q = |c: &mut Campaign, change: &dyn Fn(&mut Vec<f64>)| c.shots.iter_mut().for_each(|s| change(&mut s.q));
        match *self {
            Slip::JointUnit(by) => scale(&mut c, JointKind::Revolute, by),
            Slip::SlideUnit(by) => scale(&mut c, JointKind::Prismatic, by),
            Slip::JointSign(j) => each_q(&mut c, &|q| q[j] = -q[j]),
            Slip::JointZero(j, zero) => each_q(&mut c, &|q| q[j] += zero),
            Slip::JointsSwapped(j, k) => each_q(&mut c, &|q| q.swap(j, k)),
            Slip::Commanded => c.shots.iter_mut().for_each(|s| s.q = s.commanded.clone().unwrap_or_else(|| s.q.clone())),
            Slip::PointUnit(by) => {
                places(&mut c, |p| *p *= by);
                c.ties.iter_mut().for_each(|t| t.distance *= by);
                for shot in &mut c.shots {
                    if let Seen::Distance { distance, .. } = &mut shot.seen {
                        *distance *= by;
                    }
                }
            }
            Slip::ReadingUnit(by) => {
                for shot in &mut c.shots {
                    if let Seen::Ball { reading, .. } = &mut shot.seen {
                        *reading *= by;
                    }
                }
            }
            Slip::ToolUnit(by) => c.places.iter_mut().for_each(|p| p.tool.xyz = p.tool.xyz.map(|x| x * by)),
            Slip::Tool => c.places.iter_mut().for_each(|p| p.tool_free = true),
            Slip::AxesSwapped(a, b) => places(&mut c, |p| p.swap_rows(a, b)),
            Slip::AxisSign(a) => places(&mut c, |p| p[a] = -p[a]),
            Slip::BallsSwapped(a, b) => {
                let [at_a, at_b] = [a, b].map(|b| c.balls[b].position);
                (c.balls[a].position, c.balls[b].position) = (at_b, at_a);
            }
            Slip::Ball(b) => c.balls[b].free = true,
            Slip::RowsShifted(to) => {
                c.shots.retain(|s| s.neighbours[to].is_some());
                c.shots.iter_mut().for_each(|s| s.seen = s.neighbours[to].unwrap_or(s.seen));
            }
            Slip::Robot(name) => {
                if let Some(robot) = built_in(name) {
                    c.robot = Arc::new(robot);
                }
            }
        }
        c
    }

    /// Name in files.
    pub fn name(&self, campaign: &Campaign) -> String {
        let ball = |b: usize| &campaign.balls[b].id;
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
            Slip::Ball(b) => format!("ball:{}", ball(b)),
            Slip::RowsShifted(_) => "rows_shifted".into(),
            Slip::Robot(name) => format!("robot:{name}"),
            Slip::Commanded => "joints_commanded".into(),
        }
    }

    /// Describes the correction, as the beginning of a sentence that continues with "leaves 0.9 instead of 923 mm".
    pub fn words(&self, campaign: &Campaign) -> String {
        let ball = |b: usize| &campaign.balls[b].id;
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
        }
    }
}

pub(super) fn scaled(by: f64) -> &'static str {
    match by {
        b if b > 100.0 => "1000 times as large (metres written where millimetres are stated)",
        b if b > 1.0 => "25.4 times as large (inches written where millimetres are stated)",
        b if b < 0.01 => "1000 times smaller (micrometres or millimetres written where a larger unit is stated)",
        _ => "25.4 times smaller (millimetres written where inches are stated)",
    }
}

/// Changes the unit of all joints of one kind.
fn scale(c: &mut Campaign, kind: JointKind, by: f64) {
    let robot = Arc::clone(&c.robot);
    for shot in &mut c.shots {
        shot.q.iter_mut().zip(robot.kinds()).filter(|(_, of)| *of == kind).for_each(|(q, _)| *q *= by);
    }
}

/// Changes every position in the world: balls, points, anchors.
fn places(c: &mut Campaign, change: impl Fn(&mut Vector3<f64>)) {
    c.balls.iter_mut().for_each(|b| change(&mut b.position));
    for shot in &mut c.shots {
        match &mut shot.seen {
            Seen::Point(point) => change(point),
            Seen::Distance { anchor, .. } => change(anchor),
            Seen::Ball { .. } => {}
        }
    }
}
