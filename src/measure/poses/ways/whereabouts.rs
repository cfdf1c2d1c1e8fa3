//! Locating the arm among the motions of a plan, so that it can leave a ball and return home after any interruption.

use super::plan::{ArmAt, HomeWays, MasteringPlace};
use super::polyline::turn;
use crate::measure::poses::PlannedPose;
use crate::units::{DEG, MM};

use crate::robot::kinematics::world_from_tool;
use crate::robot::{FramePose, Robot};

/// Largest distance of an arm on a planned motion, rad: a tenth of the deviation allowed for in its clearance, at the reach of
/// a small robot.
const ON_THE_WAY: f64 = 0.1 * DEG;

/// Largest distance of the joints from the motion onto a ball while it is centred, rad: joints near a singular posture turn by
/// more than others.
pub(crate) const CENTRING_TURN: f64 = 8.0 * DEG;
/// The same of the TCP, m: centring moves the arm by up to the gauge's safe range along each axis.
const CENTRING_REACH: f64 = 15.0 * MM;

/// Location of an arm among the motions of a plan.
#[derive(Debug, Clone, PartialEq)]
pub enum Whereabouts {
    /// At a ball, or on the path to or from it: the index of the pose, whose approach is the way out.
    AtBall(usize),
    /// On a way, which continues through these joints (rad) to the station.
    OnWay(Vec<Vec<f64>>, ArmAt),
    /// At the posture in which the gauge is mastered.
    AtMastering,
    /// On no known motion of the plan.
    Unknown,
}

/// Locates the arm with its joints at `q` (rad, N); the nominal arm's base and TCP frame are `base` and `tool`.
pub fn whereabouts(
    poses: &[PlannedPose],
    ways: Option<&HomeWays>,
    robot: &Robot,
    base: &FramePose,
    tool: &FramePose,
    q: &[f64],
) -> Whereabouts {
    let tcp = |q: &[f64]| world_from_tool(robot, base, tool, q).translation.vector;
    let here = tcp(q);
    // Ends first: the approach of a pose is on its way out as well.
    if let Some(pose) = poses.iter().find(|pose| turn(q, &pose.approach) < ON_THE_WAY) {
        return Whereabouts::OnWay(Vec::new(), ArmAt::Approach(pose.id.clone()));
    }
    let on_balls = poses.iter().enumerate().filter(|(_, pose)| pose.ball.is_some());
    let out = on_balls.filter_map(|(k, pose)| {
        let nearest = nearest(&pose.contact, &pose.approach, q);
        let apart = turn(&nearest, q);
        (apart < CENTRING_TURN && (tcp(&nearest) - here).norm() < CENTRING_REACH).then_some((k, apart))
    });
    if let Some((k, _)) = out.min_by(|a, b| a.1.total_cmp(&b.1)) {
        return Whereabouts::AtBall(k);
    }
    let Some(ways) = ways else { return Whereabouts::Unknown };
    if turn(q, &ways.home) < ON_THE_WAY {
        return Whereabouts::OnWay(Vec::new(), ArmAt::Home);
    }
    if let Some(MasteringPlace { q: mastering, way }) = &ways.mastering {
        if turn(q, mastering) < ON_THE_WAY {
            return Whereabouts::AtMastering;
        }
        let back = [std::slice::from_ref(mastering), &reversed(&way.via), std::slice::from_ref(&ways.home)].concat();
        if let Some(rest) = rest_of(&back, q) {
            return Whereabouts::OnWay(rest, ArmAt::Home);
        }
    }
    let mut before: Option<&PlannedPose> = None;
    for pose in poses {
        let station = || ArmAt::Approach(pose.id.clone());
        let from_home =
            [std::slice::from_ref(&ways.home), ways.from_home(&pose.id), std::slice::from_ref(&pose.approach)].concat();
        if let Some(rest) = rest_of(&from_home, q) {
            return Whereabouts::OnWay(rest, station());
        }
        if let Some(before) = before.filter(|before| !pose.reserve && before.payload == pose.payload) {
            let way = [std::slice::from_ref(&before.approach), &pose.via, std::slice::from_ref(&pose.approach)].concat();
            if let Some(rest) = rest_of(&way, q) {
                return Whereabouts::OnWay(rest, station());
            }
        }
        if !pose.reserve {
            before = Some(pose);
        }
    }
    Whereabouts::Unknown
}

fn reversed(via: &[Vec<f64>]) -> Vec<Vec<f64>> {
    via.iter().rev().cloned().collect()
}

/// The posture nearest to `q` on the motion from `from` to `to`, by the sum of squares over the joints.
fn nearest(from: &[f64], to: &[f64], q: &[f64]) -> Vec<f64> {
    let (mut along, mut length) = (0.0, 0.0);
    for ((a, b), q) in from.iter().zip(to).zip(q) {
        along += (q - a) * (b - a);
        length += (b - a) * (b - a);
    }
    let share = if length > 0.0 { (along / length).clamp(0.0, 1.0) } else { 0.0 };
    from.iter().zip(to).map(|(a, b)| a + share * (b - a)).collect()
}

/// The remaining part of a way from the position of the arm on it, if it is on it.
fn rest_of(way: &[Vec<f64>], q: &[f64]) -> Option<Vec<Vec<f64>>> {
    let leg = way.windows(2).rposition(|leg| turn(&nearest(&leg[0], &leg[1], q), q) < ON_THE_WAY)?;
    Some(way[leg + 1..].to_vec())
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::*;
    use crate::measure::poses::ways::Way;
    use crate::robot::built_in;

    fn pose(id: &str, approach: f64, via: Vec<Vec<f64>>) -> PlannedPose {
        let at = |q1: f64| vec![q1, -1.5, 1.5, 0.0, 0.5, 0.0];
        PlannedPose {
            id: id.into(),
            ball: Some(0),
            payload: 0,
            contact: at(approach + 0.08),
            approach: at(approach),
            reserve: false,
            reverses: None,
            via,
            clearance: None,
        }
    }

    #[test]
    fn an_arm_is_found_wherever_it_was_stopped() {
        let robot = built_in("kr6_r700").unwrap();
        let (base, tool) = (FramePose::default(), FramePose { xyz: [0.0, 0.0, 0.2], ..FramePose::default() });
        let via = vec![0.5, -2.0, 1.5, 0.0, 0.5, 0.0];
        let poses = [pose("a", 0.0, Vec::new()), pose("b", 1.0, vec![via.clone()])];
        let home = vec![0.5, -2.5, 1.0, 0.0, 0.5, 0.0];
        let to = ["a", "b"].map(|id| (id.to_owned(), Way::default()));
        let ways = HomeWays { home: home.clone(), mastering: None, to: BTreeMap::from(to) };
        let find = |q: &[f64]| whereabouts(&poses, Some(&ways), &robot, &base, &tool, q);
        let between =
            |a: &[f64], b: &[f64], share: f64| -> Vec<f64> { a.iter().zip(b).map(|(a, b)| a + share * (b - a)).collect() };
        let b = ArmAt::Approach("b".into());
        assert_eq!(find(&home), Whereabouts::OnWay(Vec::new(), ArmAt::Home));
        assert_eq!(find(&poses[1].approach), Whereabouts::OnWay(Vec::new(), b.clone()));
        // On the ball, beside it as after a centring, and half way out.
        let mut centring = poses[0].contact.clone();
        centring[4] += 0.03;
        assert_eq!(find(&centring), Whereabouts::AtBall(0));
        assert_eq!(find(&between(&poses[1].approach, &poses[1].contact, 0.4)), Whereabouts::AtBall(1));
        // On a leg of a way: continues through its other points.
        let first_leg = between(&poses[0].approach, &via, 0.6);
        assert_eq!(find(&first_leg), Whereabouts::OnWay(vec![via.clone(), poses[1].approach.clone()], b.clone()));
        let last_leg = between(&via, &poses[1].approach, 0.3);
        assert_eq!(find(&last_leg), Whereabouts::OnWay(vec![poses[1].approach.clone()], b.clone()));
        assert_eq!(find(&between(&home, &poses[1].approach, 0.5)), Whereabouts::OnWay(vec![poses[1].approach.clone()], b));
        // A degree beside it, the location is unknown.
        let mut beside = first_leg;
        beside[2] += 1.0 * DEG;
        assert_eq!(find(&beside), Whereabouts::Unknown);
        assert_eq!(whereabouts(&poses, None, &robot, &base, &tool, &home), Whereabouts::Unknown);
    }
}
