//! Ways: collision-free paths of the arm from one posture to the next.
//!
//! A controller's point-to-point motion moves all axes together, a straight line in joint space, so a way is a polyline of
//! joint angles. Every posture has a way home; most are one motion. Between two postures the arm moves directly if that is
//! clear, else through points of their two ways home, by the shortest combination that is clear: near home there is room.

mod home;
mod plan;
mod polyline;
mod request;
mod search;
mod turns;
mod whereabouts;

pub use plan::{ArmAt, BlockedPose, HomeWays, MasteringPlace, WaysError, plan_ways};
pub use polyline::turn;
pub use request::{WAY_MARGIN, WayRequest};
pub(crate) use whereabouts::CENTRING_TURN;
pub use whereabouts::{Whereabouts, whereabouts};

use polyline::{length, part};
pub(crate) use request::NOMINAL_WITHIN;
use thiserror::Error;

use crate::robot::solids::{Clearance, Narrowest, SweptCheck};
use crate::units::MM;

/// A way between two postures.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Way {
    /// Intermediate joints, rad; empty if the arm moves directly.
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

/// Fractions of the ways home at which two of them are joined.
const JOINTS_AT: [f64; 7] = [0.0, 0.15, 0.3, 0.45, 0.6, 0.8, 1.0];

impl<'a> WayFinder<'a> {
    /// Creates a finder with a home posture, rad.
    pub fn new(request: WayRequest<'a>, home: Vec<f64>) -> Self {
        let WayRequest { robot, base, tool, surroundings, .. } = request;
        WayFinder { request, swept: SweptCheck::new(robot, base, tool, surroundings), home }
    }

    /// The home posture, rad.
    pub fn home(&self) -> &[f64] {
        &self.home
    }

    /// Finds the way home.
    ///
    /// # Errors
    /// When none is found.
    pub fn home_from(&mut self, from: &[f64]) -> Result<Way, Blocked> {
        let home = self.home.clone();
        self.from_to(from, &home)
    }

    /// Checks that the arm, within its deviation from the nominal position, touches nothing in a posture.
    ///
    /// # Errors
    /// The bodies that are too close.
    pub fn stands(&mut self, at: &[f64]) -> Result<(), Blocked> {
        match self.narrowest(at, at, None) {
            Some(narrowest) if narrowest.clearance.distance < NOMINAL_WITHIN => {
                Err(Blocked { narrowest: Some(narrowest.clearance) })
            }
            _ => Ok(()),
        }
    }

    /// Finds the way between any two postures: direct, by moving some joints before the others, or by a search.
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

    /// Finds a way to any of the joint angles (rad, N) that show a posture: as given, else turned by whole turns. The joints of
    /// some arms turn twice, and what is in the way of one turn is not in the way of the other. Returns the joints reached.
    ///
    /// # Errors
    /// When none is found: what is in the way of the joints as given.
    pub fn to_any_turn(&mut self, from: &[f64], to: &[f64]) -> Result<(Vec<f64>, Way), Blocked> {
        let blocked = match self.from_to(from, to) {
            Ok(way) => return Ok((to.to_vec(), way)),
            Err(blocked) => blocked,
        };
        let turned = turns::turned(self.request.robot, from, to);
        turned.into_iter().find_map(|to| Some((to.clone(), self.from_to(from, &to).ok()?))).ok_or(blocked)
    }

    /// Finds the way between two postures whose ways home are known: `out` from the first one, `back` from the second.
    ///
    /// # Errors
    /// When none is found, which happens when a way home is not clear.
    pub fn between(&mut self, from: &[f64], out: &Way, to: &[f64], back: &Way) -> Result<Way, Blocked> {
        let margin = self.margin_between(from, to);
        let blocked = match self.leg(from, to, margin) {
            Ok(narrowest) => return Ok(Way { via: Vec::new(), narrowest }),
            Err(blocked) => blocked,
        };
        let (out, back) = (self.polyline(from, out), self.polyline(to, back));
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

    /// The narrowest gap of one motion. The arm's load may touch the fixed body `except` (see [`SweptCheck::fixed_named`]).
    pub fn narrowest(&mut self, from: &[f64], to: &[f64], except: Option<usize>) -> Option<Narrowest> {
        self.swept.narrowest(from, to, f64::NEG_INFINITY, except)
    }

    /// The index of a fixed body by its name.
    pub fn fixed_named(&self, name: &str) -> Option<usize> {
        self.swept.fixed_named(name)
    }

    /// The margin required between two postures: never more than either end has.
    fn margin_between(&mut self, from: &[f64], to: &[f64]) -> f64 {
        let ends = [from, to]
            .map(|q| self.swept.narrowest(q, q, f64::NEG_INFINITY, None).map_or(f64::INFINITY, |n| n.clearance.distance));
        ends.into_iter().fold(self.request.margin, f64::min)
    }

    fn leg(&mut self, from: &[f64], to: &[f64], margin: f64) -> Result<Option<Clearance>, Blocked> {
        self.request.leg(&mut self.swept, [from, to], margin).map_err(|narrowest| Blocked { narrowest })
    }

    /// Converts a polyline to a way, if it is clear.
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
