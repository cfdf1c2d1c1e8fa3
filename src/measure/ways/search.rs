//! Ways that no straight motion gives: bidirectional rapidly-exploring random trees (RRT-Connect, Kuffner & LaValle 2000), shortened.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::cell::RefCell;

use super::WayRequest;
use crate::robot::{ClearanceCheck, Posture, SiteIndex, SweptCheck};
use crate::units::MM;

/// Length of a branch, rad (norm over the joints).
const BRANCH: f64 = 0.15;
/// Branches tried before a search is given up, and searches.
const TRIES: usize = 3_000;
const SEARCHES: u64 = 5;
/// Between two nodes the gap may be this much narrower than at both, m: the search asks for more than the way must have.
const BETWEEN_NODES: f64 = 3.0 * MM;
/// Attempts to go straight between two points of the way.
const SHORTCUTS: usize = 120;

/// A polyline from `from` to `to` (rad) of which every motion keeps `margin` (m); `None` where none was found. The same seed gives the same.
pub(super) fn path(
    swept: &mut SweptCheck<'_>,
    request: &WayRequest<'_>,
    from: &[f64],
    to: &[f64],
    margin: f64,
) -> Option<Vec<Vec<f64>>> {
    let WayRequest { robot, base, tool, surroundings, seed, .. } = *request;
    let mut check = ClearanceCheck::new(robot, surroundings);
    let mut posture = Posture::new(robot);
    let nominal = vec![0.0; SiteIndex::new(robot.joints()).len()];
    for search in 0..SEARCHES {
        let random = RefCell::new(ChaCha8Rng::seed_from_u64(seed));
        random.borrow_mut().set_stream((0xB1 << 56) | search);
        // The first searches stay well clear, the last take what is allowed; near the ends nobody can ask for more than they have.
        let wanted = margin + BETWEEN_NODES * (SEARCHES - 1 - search) as f64 / (SEARCHES - 1) as f64;
        let mut is_free = |q: &[f64]| {
            let near_an_end = [from, to].iter().any(|end| super::turn(q, end) < BRANCH);
            posture.set(robot, base, tool, q, &nominal);
            request.is_allowed(q, q) && check.is_clear(&posture, if near_an_end { margin } else { wanted }, None)
        };
        let sample = || {
            let mut random = random.borrow_mut();
            robot.links.iter().map(|l| l.limits[0] + (l.limits[1] - l.limits[0]) * random.random::<f64>()).collect()
        };
        let Ok(mut found) = rrt::dual_rrt_connect(from, to, &mut is_free, sample, BRANCH, TRIES) else { continue };
        // The library joins its two trees without a look at the last branch.
        if found.first().is_none_or(|q| q != from) {
            found.insert(0, from.to_vec());
        }
        if found.last().is_none_or(|q| q != to) {
            found.push(to.to_vec());
        }
        let mut clear = |a: &[f64], b: &[f64]| {
            request.is_allowed(a, b)
                && swept
                    .narrowest(a, b, margin, None)
                    .is_none_or(|n| n.clearance.distance >= margin && n.clearance.distance > 0.0)
        };
        if !found.windows(2).all(|leg| clear(&leg[0], &leg[1])) {
            continue;
        }
        shorten(&mut found, &mut clear, &mut random.borrow_mut());
        return Some(found);
    }
    None
}

/// Goes straight between points of a polyline where that is clear and shorter.
fn shorten(path: &mut Vec<Vec<f64>>, clear: &mut dyn FnMut(&[f64], &[f64]) -> bool, random: &mut ChaCha8Rng) {
    for _ in 0..SHORTCUTS {
        if path.len() < 3 {
            return;
        }
        // Points anywhere on two legs.
        let [first, last] = {
            let (a, b) = (random.random_range(0..path.len() - 1), random.random_range(0..path.len() - 1));
            [a.min(b), a.max(b)]
        };
        if first == last {
            continue;
        }
        let mut on = |leg: usize| -> Vec<f64> {
            // Corners too, so that legs vanish.
            let share = (random.random::<f64>() * 1.5 - 0.25).clamp(0.0, 1.0);
            path[leg].iter().zip(&path[leg + 1]).map(|(a, b)| a + share * (b - a)).collect()
        };
        let (start, end) = (on(first), on(last));
        if !clear(&start, &end) {
            continue;
        }
        let mut shorter: Vec<Vec<f64>> = path[..=first].to_vec();
        shorter.extend([start, end]);
        shorter.extend_from_slice(&path[last + 1..]);
        shorter.dedup();
        if super::length(&shorter) < super::length(path) {
            *path = shorter;
        }
    }
}
