//! Slips: common mistakes in tables of measurements, as changes of a campaign.

use std::f64::consts::{FRAC_PI_2, PI};
use std::sync::Arc;

use nalgebra::{Rotation3, Vector3};

use super::campaign::{Campaign, Reading, Seen, Shot};
use crate::robot::{BUILT_IN, JointKind, Robot, built_in, rotation_vector};
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
    /// A joint that counts with another step and zero: factor, and offset, rad or m.
    JointScale(usize, [f64; 2]),
    /// Factor and offset of every joint.
    JointScales(Vec<[f64; 2]>),
    /// A joint that the controller counts together with another: this multiple of the second is added to the first.
    Coupled(usize, usize, f64),
    /// Another length of a link, along the x axis before it or along its own z axis; addition, m.
    Length(usize, Along, f64),
    /// The rows of the robot's table are those of the other Denavit-Hartenberg convention: standard (1) or modified (-1).
    Convention(i8),
    /// Positions in a left-handed frame; z is counted the other way.
    LeftHanded,
    /// Scale of all measured positions.
    PointScale(f64),
    /// Scale of all measured distances.
    DistanceScale(f64),
    /// Constant of all measured distances, m.
    DistanceConstant(f64),
    /// Distances written squared, in units of this length, m.
    DistanceSquared(f64),
    /// Two anchors interchanged.
    AnchorsSwapped(usize, usize),
    /// An anchor at a position other than the stated one.
    Anchor(usize),
    /// A slip in the measured positions of one set-up only.
    Only(usize, Box<Slip>),
}

/// Direction of a length of a link.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Along {
    /// Along the x axis of the frame before.
    X,
    /// Along its own z axis.
    Z,
}

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
        if campaign.has_known_places() && campaign.shows_handedness() {
            all.extend([(0, 1), (0, 2), (1, 2)].map(|(a, b)| Slip::AxesSwapped(a, b)));
            all.extend([2, 1, 0].map(Slip::AxisSign));
            all.push(Slip::LeftHanded);
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
        all.extend(
            (0..n)
                .flat_map(|j| (0..n).map(move |k| (j, k)))
                .filter(|&(j, k)| j != k && turns(&j) && turns(&k))
                .flat_map(|(j, k)| [1.0, -1.0].map(|by| Slip::Coupled(j, k, by))),
        );
        all.extend([1, -1].map(Slip::Convention));
        let measured: Vec<usize> = (0..campaign.anchors.len()).filter(|&a| campaign.sights(a)).collect();
        if !measured.is_empty() {
            all.extend(LENGTHS.into_iter().chain([2.0, 0.5]).map(Slip::DistanceScale));
            all.extend([1.0, 1e-3].map(Slip::DistanceSquared));
        }
        for (i, &a) in measured.iter().enumerate() {
            all.extend(measured[i + 1..].iter().map(|&b| Slip::AnchorsSwapped(a, b)));
        }
        if measured.len() > 3 {
            all.extend(measured.iter().map(|&a| Slip::Anchor(a)));
        }
        if campaign.places.len() > 1 && campaign.has_points() {
            let one = |s| {
                let each = [Slip::LeftHanded, Slip::AxesSwapped(0, 1), Slip::AxesSwapped(0, 2), Slip::AxesSwapped(1, 2)];
                each.into_iter()
                    .chain(LENGTHS.map(Slip::PointUnit))
                    .chain([0, 1].map(Slip::RowsShifted))
                    .map(move |slip| Slip::Only(s, Box::new(slip)))
            };
            all.extend((0..campaign.places.len()).flat_map(one));
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
        let frees = |s: &Slip| s.adds_freedom();
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
        // A coupled joint was zeroed and counted as such.
        if let Slip::Coupled(j, ..) = *self {
            return matches!(other, JointSign(k) | JointZero(k, _) if *k == j);
        }
        if [self, other].into_iter().any(|s| matches!(s, Slip::Coupled(..) | Slip::Only(..) | Slip::Convention(_))) {
            return false;
        }
        (unit(self) && !frees(other))
            || (joint(self) && joint(other))
            || (joint(self) && mirror(other))
            || (joint(self) && matches!(other, Slip::ToolUnit(_) | Slip::BallsSwapped(..)))
    }

    /// True if the slip adds unknowns to the fit, which can only reduce the residual.
    pub fn adds_freedom(&self) -> bool {
        matches!(self, Slip::Ball(_) | Slip::Tool | Slip::Anchor(_))
    }

    /// True if the slip changes how far the arm moves, so that residuals must be compared relative to the motion.
    pub fn rescales_motion(&self) -> bool {
        use Slip::{JointScale, JointScales, JointUnit, SlideUnit};
        matches!(self, JointUnit(_) | SlideUnit(_) | JointScale(..) | JointScales(_))
    }

    /// True if the slip changes how far apart the measured places are, so that residuals must be compared relative to that.
    pub fn rescales_places(&self) -> bool {
        use Slip::{DistanceScale, DistanceSquared, Only, PointScale, PointUnit};
        matches!(self, PointUnit(_) | PointScale(_) | DistanceScale(_) | DistanceSquared(_))
            || matches!(self, Only(_, slip) if slip.rescales_places())
    }

    /// Number of values that were fitted to the data.
    pub fn fitted(&self) -> usize {
        use Slip::{DistanceConstant, DistanceScale, JointScale, JointScales, Length, PointScale};
        match self {
            JointScales(all) => {
                all.iter().map(|[by, zero]| usize::from((by.abs() - 1.0).abs() > 0.0) + usize::from(*zero != 0.0)).sum()
            }
            JointScale(_, [by, zero]) => usize::from(*zero != 0.0) + usize::from((by.abs() - 1.0).abs() > 0.0),
            Length(..) | PointScale(_) | DistanceConstant(_) => 1,
            DistanceScale(by) => usize::from(!LENGTHS.contains(by) && *by != 2.0 && *by != 0.5),
            _ => 0,
        }
    }

    /// True if no arm, tool or artifact has it by nature, in some size: the only slips that are looked for in data that fit.
    pub fn is_never_physical(&self) -> bool {
        use Slip::{Ball, JointScale, JointScales, Length, Tool};
        !matches!(self, Ball(_) | Tool | JointScale(..) | JointScales(_) | Length(..))
    }

    /// The campaign with the slip corrected.
    pub fn undone(&self, campaign: &Campaign) -> Campaign {
        let mut c = campaign.clone();
        let each_distance = |c: &mut Campaign, change: &dyn Fn(&mut f64)| {
            for shot in &mut c.shots {
                if let Seen::Distance { distance, .. } = &mut shot.seen {
                    change(distance);
                }
            }
        };
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
                each_distance(&mut c, &|d| *d *= by);
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
                for shot in &mut c.shots {
                    if let Some(Reading { seen, turned }) = shot.neighbours[to].clone() {
                        (shot.seen, shot.turned) = (seen, turned);
                    }
                }
            }
            Slip::JointScale(j, [by, zero]) => each_q(&mut c, &|q| q[j] = by * q[j] + zero),
            Slip::JointScales(ref all) => {
                each_q(&mut c, &|q| q.iter_mut().zip(all).for_each(|(q, [by, zero])| *q = by * *q + zero));
            }
            Slip::Coupled(j, k, by) => each_q(&mut c, &|q| q[j] += by * q[k]),
            Slip::Length(i, along, more) => {
                let mut robot = Robot::clone(&c.robot);
                let mdh = &mut robot.links[i].mdh;
                *(match along {
                    Along::X => &mut mdh.a,
                    Along::Z => &mut mdh.d,
                }) += more;
                c.robot = Arc::new(robot);
            }
            Slip::Convention(to) => c.robot = Arc::new(of_other_convention(&c.robot, to)),
            Slip::LeftHanded => {
                places(&mut c, |p| p.z = -p.z);
                // Seen in a mirror, a rotation turns the other way about the axes that lie in it.
                let mirrored = |r: Rotation3<f64>| {
                    let v = rotation_vector(&r);
                    Rotation3::new(Vector3::new(-v.x, -v.y, v.z))
                };
                c.shots.iter_mut().for_each(|s| s.turned = s.turned.as_deref().copied().map(mirrored).map(Arc::new));
            }
            Slip::PointScale(by) => {
                for shot in &mut c.shots {
                    if let Seen::Point(point) = &mut shot.seen {
                        *point *= by;
                    }
                }
            }
            Slip::DistanceScale(by) => each_distance(&mut c, &|d| *d *= by),
            Slip::DistanceConstant(more) => each_distance(&mut c, &|d| *d += more),
            Slip::DistanceSquared(unit) => each_distance(&mut c, &|d| *d = (*d * unit).max(0.0).sqrt()),
            Slip::AnchorsSwapped(a, b) => {
                let [at_a, at_b] = [a, b].map(|a| c.anchors[a].position);
                (c.anchors[a].position, c.anchors[b].position) = (at_b, at_a);
            }
            Slip::Anchor(a) => c.anchors[a].free = true,
            Slip::Only(setup, ref slip) => {
                let (of, others): (Vec<Shot>, Vec<Shot>) = c.shots.into_iter().partition(|s| s.setup == setup);
                c.shots = of;
                c = slip.undone(&c);
                c.shots.extend(others);
            }
            Slip::Robot(name) => {
                if let Some(robot) = built_in(name) {
                    c.robot = Arc::new(robot);
                }
            }
        }
        c
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
    c.balls.iter_mut().chain(&mut c.anchors).for_each(|b| change(&mut b.position));
    for shot in &mut c.shots {
        if let Seen::Point(point) = &mut shot.seen {
            change(point);
        }
    }
}

/// The robot whose table was written in the standard convention and read as modified (1), or the other way round (-1): twist
/// and length stand one row further on. What falls off the end is part of the tool.
fn of_other_convention(robot: &Robot, to: i8) -> Robot {
    let mut other = robot.clone();
    let n = robot.links.len();
    for (i, link) in other.links.iter_mut().enumerate() {
        let from = if to > 0 { i.checked_sub(1) } else { Some(i + 1).filter(|k| *k < n) };
        (link.mdh.alpha, link.mdh.a) = from.map_or((0.0, 0.0), |k| (robot.links[k].mdh.alpha, robot.links[k].mdh.a));
    }
    other
}
