//! Ways: how the arm gets from one posture to the next without touching anything.
//!
//! A controller's point-to-point motion turns all axes together, a straight line in joint space, so a way is a polyline of joint angles.
//! Every posture has a way home; most are one motion. Between two postures the arm moves at once where that is clear, else by points of their
//! two ways home, the earliest that serve: near home there is room.

mod home;
mod plan;
mod search;
mod whereabouts;

pub use plan::{ArmAt, BlockedPose, HomeWays, WaysError, plan_ways};
pub use whereabouts::{Whereabouts, whereabouts};

use crate::cell::Guards;
use crate::robot::{Clearance, FramePose, Narrowest, Robot, Surroundings, SweptCheck};
use crate::units::MM;
use thiserror::Error;

/// What a way is sought in, and how far it keeps from everything.
#[derive(Debug, Clone, Copy)]
pub struct WayRequest<'a> {
    /// The robot as drawn.
    pub robot: &'a Robot,
    /// Its nominal base in the world.
    pub base: &'a FramePose,
    /// The TCP frame in the last frame.
    pub tool: &'a FramePose,
    /// What must not be touched.
    pub surroundings: &'a Surroundings,
    /// Gap to keep, m. Where an end of a way has less, the way has no less than that end.
    pub margin: f64,
    /// What the robot may be told at all, where that is known: limits with a margin, a box for the TCP.
    pub guards: Option<&'a Guards>,
    /// Seed of the search, where one is needed.
    pub seed: u64,
}

impl WayRequest<'_> {
    /// Whether the guards let the arm move so.
    fn is_allowed(&self, from: &[f64], to: &[f64]) -> bool {
        self.guards.is_none_or(|guards| guards.joint_motion(from, to).is_ok())
    }
}

/// Gap that ways keep, m: 3 mm of air, and 5 mm by which an arm that is not calibrated yet may stand elsewhere than drawn.
pub const WAY_MARGIN: f64 = 3.0 * MM + DRAWN_WITHIN;

/// How far an arm that is not calibrated may stand from where it is drawn, m.
const DRAWN_WITHIN: f64 = 5.0 * MM;

/// A way between two postures.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Way {
    /// Joints that it leads by, rad; none where the arm moves at once.
    pub via: Vec<Vec<f64>>,
    /// The narrowest gap on it; `None` where there are no two bodies to compare.
    pub narrowest: Option<Clearance>,
}

/// No way was found.
#[derive(Debug, Error, Clone, PartialEq)]
#[error("no clear way is found: {}", match narrowest {
    Some(gap) if gap.distance > 0.0 => format!("on the direct one {} comes within {:.1} mm of {}", gap.between[0], gap.distance / MM, gap.between[1]),
    Some(gap) => format!("on the direct one {} hits {}", gap.between[0], gap.between[1]),
    None => "the guards forbid the direct one".to_owned(),
})]
pub struct Blocked {
    /// The narrowest gap of the straight motion.
    pub narrowest: Option<Clearance>,
}

/// Finds ways, all of them from and to one home posture or between postures that have a way there.
#[derive(Debug, Clone)]
pub struct WayFinder<'a> {
    request: WayRequest<'a>,
    swept: SweptCheck<'a>,
    home: Vec<f64>,
}

/// Parts of the way home at which two ways home are joined.
const JOINTS_AT: [f64; 7] = [0.0, 0.15, 0.3, 0.45, 0.6, 0.8, 1.0];

impl<'a> WayFinder<'a> {
    /// With a home posture, rad.
    pub fn new(request: WayRequest<'a>, home: Vec<f64>) -> Self {
        let WayRequest { robot, base, tool, surroundings, .. } = request;
        WayFinder { request, swept: SweptCheck::new(robot, base, tool, surroundings), home }
    }

    /// The home posture, rad.
    pub fn home(&self) -> &[f64] {
        &self.home
    }

    /// The way home.
    ///
    /// # Errors
    /// When none is found.
    pub fn home_from(&mut self, from: &[f64]) -> Result<Way, Blocked> {
        let home = self.home.clone();
        self.from_to(from, &home)
    }

    /// That the arm, which may stand so far elsewhere than drawn, touches nothing in a posture.
    ///
    /// # Errors
    /// What is too near.
    pub fn stands(&mut self, at: &[f64]) -> Result<(), Blocked> {
        match self.narrowest(at, at, None) {
            Some(narrowest) if narrowest.clearance.distance < DRAWN_WITHIN => {
                Err(Blocked { narrowest: Some(narrowest.clearance) })
            }
            _ => Ok(()),
        }
    }

    /// The way between any two postures: direct, by a turn of some joints before the others, or searched for.
    ///
    /// # Errors
    /// When none is found.
    pub fn from_to(&mut self, from: &[f64], to: &[f64]) -> Result<Way, Blocked> {
        let margin = self.margin_between(from, to);
        let blocked = match self.leg(from, to, margin) {
            Ok(narrowest) => return Ok(Way { via: Vec::new(), narrowest }),
            Err(blocked) => blocked,
        };
        let mut by_one: Vec<Vec<Vec<f64>>> = (1..from.len())
            .flat_map(|k| {
                let joined = |first: &[f64], last: &[f64]| [&first[..k], &last[k..]].concat();
                [joined(from, to), joined(to, from)]
            })
            .map(|via| vec![from.to_vec(), via, to.to_vec()])
            .collect();
        by_one.sort_by(|a, b| length(a).total_cmp(&length(b)));
        if let Some(way) = by_one.iter().find_map(|path| self.checked(path, margin).ok()) {
            return Ok(way);
        }
        let path = search::path(&mut self.swept, &self.request, from, to, margin).ok_or(blocked)?;
        self.checked(&path, margin)
    }

    /// The way between two postures of which the ways home are known.
    ///
    /// # Errors
    /// When none is found, which is when a way home is not clear.
    pub fn between(&mut self, from: (&[f64], &Way), to: (&[f64], &Way)) -> Result<Way, Blocked> {
        let margin = self.margin_between(from.0, to.0);
        let blocked = match self.leg(from.0, to.0, margin) {
            Ok(narrowest) => return Ok(Way { via: Vec::new(), narrowest }),
            Err(blocked) => blocked,
        };
        let (out, back) = (self.polyline(from.0, from.1), self.polyline(to.0, to.1));
        let mut joined: Vec<Vec<Vec<f64>>> = Vec::new();
        for left_at in JOINTS_AT {
            for met_at in JOINTS_AT.into_iter().filter(|at| left_at + at > 0.0) {
                let mut path = part(&out, left_at);
                path.extend(part(&back, met_at).into_iter().rev());
                path.dedup();
                joined.push(path);
            }
        }
        joined.sort_by(|a, b| length(a).total_cmp(&length(b)));
        joined.iter().find_map(|path| self.checked(path, margin).ok()).ok_or(blocked)
    }

    /// The narrowest gap of one motion. What the arm carries may touch the standing body `except` (see [`SweptCheck::fixed_named`]).
    pub fn narrowest(&mut self, from: &[f64], to: &[f64], except: Option<usize>) -> Option<Narrowest> {
        self.swept.narrowest(from, to, f64::NEG_INFINITY, except)
    }

    /// The place of a standing body by its name.
    pub fn fixed_named(&self, name: &str) -> Option<usize> {
        self.swept.fixed_named(name)
    }

    /// What a way between two postures has to keep: no end of it is asked to have more than it has.
    fn margin_between(&mut self, from: &[f64], to: &[f64]) -> f64 {
        let ends = [from, to]
            .map(|q| self.swept.narrowest(q, q, f64::NEG_INFINITY, None).map_or(f64::INFINITY, |n| n.clearance.distance));
        ends.into_iter().fold(self.request.margin, f64::min)
    }

    fn leg(&mut self, from: &[f64], to: &[f64], margin: f64) -> Result<Option<Clearance>, Blocked> {
        if !self.request.is_allowed(from, to) {
            return Err(Blocked { narrowest: None });
        }
        let narrowest = self.swept.narrowest(from, to, margin, None).map(|n| n.clearance);
        // An overlap is none, however little is asked.
        match &narrowest {
            Some(gap) if gap.distance < margin || gap.distance <= 0.0 => Err(Blocked { narrowest }),
            _ => Ok(narrowest),
        }
    }

    /// A polyline as a way, where it is clear.
    fn checked(&mut self, path: &[Vec<f64>], margin: f64) -> Result<Way, Blocked> {
        let mut narrowest: Option<Clearance> = None;
        for leg in path.windows(2) {
            let gap = self.leg(&leg[0], &leg[1], margin)?;
            if let Some(gap) = gap
                && narrowest.as_ref().is_none_or(|least| gap.distance < least.distance)
            {
                narrowest = Some(gap);
            }
        }
        let inner = 1..path.len().saturating_sub(1).max(1);
        Ok(Way { via: path.get(inner).unwrap_or_default().to_vec(), narrowest })
    }

    fn polyline(&self, from: &[f64], home: &Way) -> Vec<Vec<f64>> {
        [&[from.to_vec()], home.via.as_slice(), std::slice::from_ref(&self.home)].concat()
    }
}

/// How far the joints turn along a polyline, the slowest of each leg, rad.
pub fn length(path: &[Vec<f64>]) -> f64 {
    path.windows(2).map(|leg| turn(&leg[0], &leg[1])).sum()
}

/// The largest joint motion between two postures, rad: all joints move together, so it tells the time.
pub fn turn(from: &[f64], to: &[f64]) -> f64 {
    from.iter().zip(to).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

/// The first part of a polyline, by a share of its length; its start alone for 0.
fn part(path: &[Vec<f64>], share: f64) -> Vec<Vec<f64>> {
    let mut left = share * length(path);
    let mut taken = vec![path[0].clone()];
    for leg in path.windows(2) {
        let whole = turn(&leg[0], &leg[1]);
        if left <= 0.0 {
            break;
        }
        let share = if whole > 0.0 { (left / whole).min(1.0) } else { 1.0 };
        taken.push(leg[0].iter().zip(&leg[1]).map(|(a, b)| a + share * (b - a)).collect());
        left -= whole;
    }
    taken
}
