//! Ways where no straight motion is clear: bidirectional rapidly-exploring random trees (RRT-Connect, Kuffner & LaValle 2000),
//! shortened.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::cell::RefCell;

use super::polyline::{length, turn};
use super::request::WayRequest;
use crate::robot::kinematics::Posture;
use crate::robot::sites::SiteIndex;
use crate::robot::solids::{ClearanceCheck, SweptCheck};
use crate::units::{DEG, MM};

/// Length of a branch, rad (norm over the joints).
const BRANCH: f64 = 0.15;
/// Branches tried before a search is given up.
const TRIES: usize = 3_000;
/// Range searched beyond the ends of a way, rad, of joints that can turn twice: room for a quarter of a turn aside.
const BEYOND: f64 = 90.0 * DEG;
/// Number of searches, the first with the widest clearance.
const SEARCHES: u64 = 5;
/// Largest reduction of the gap between two nodes, m: the search requires more than the way must have.
const BETWEEN_NODES: f64 = 3.0 * MM;
/// Attempts at a straight connection between two points of the way.
const SHORTCUTS: usize = 120;

/// Finds a polyline from `from` to `to` (rad) of which every motion keeps `margin` (m); `None` if none was found. The same seed
/// gives the same result.
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
    // Of a joint that can turn twice only the turn between the ends is searched, and a little beyond.
    let ranges: Vec<[f64; 2]> = robot
        .links
        .iter()
        .zip(from.iter().zip(to))
        .map(|(link, (a, b))| match (link.drawn_range() == link.limits, link.limits) {
            (true, limits) => limits,
            (false, [low, high]) => [low.max(a.min(*b) - BEYOND), high.min(a.max(*b) + BEYOND)],
        })
        .collect();
    for search in 0..SEARCHES {
        let random = RefCell::new(ChaCha8Rng::seed_from_u64(seed));
        random.borrow_mut().set_stream((0xB1 << 56) | search);
        // The first searches require more clearance than the last, which require the margin; near the ends only the margin can
        // be required.
        let required = margin + BETWEEN_NODES * (SEARCHES - 1 - search) as f64 / (SEARCHES - 1) as f64;
        let mut is_free = |q: &[f64]| {
            let near_an_end = [from, to].iter().any(|end| turn(q, end) < BRANCH);
            posture.set(robot, base, tool, q, &nominal);
            request.is_allowed(q, q) && check.is_clear(&posture, if near_an_end { margin } else { required }, None)
        };
        let sample = || {
            let mut random = random.borrow_mut();
            ranges.iter().map(|[low, high]| low + (high - low) * random.random::<f64>()).collect()
        };
        let Ok(mut found) = rrt::dual_rrt_connect(from, to, &mut is_free, sample, BRANCH, TRIES) else { continue };
        // The library joins its two trees without checking the last branch.
        if found.first().is_none_or(|q| q != from) {
            found.insert(0, from.to_vec());
        }
        if found.last().is_none_or(|q| q != to) {
            found.push(to.to_vec());
        }
        let mut clear = |a: &[f64], b: &[f64]| request.leg(swept, [a, b], margin).is_ok();
        if !found.windows(2).all(|leg| clear(&leg[0], &leg[1])) {
            continue;
        }
        shorten(&mut found, &mut clear, &mut random.borrow_mut());
        return Some(found);
    }
    None
}

/// Replaces parts of a polyline by straight motions if these are clear and shorter.
fn shorten(path: &mut Vec<Vec<f64>>, clear: &mut dyn FnMut(&[f64], &[f64]) -> bool, random: &mut ChaCha8Rng) {
    for _ in 0..SHORTCUTS {
        if path.len() < 3 {
            return;
        }
        // Any points on two legs.
        let [first, last] = {
            let (a, b) = (random.random_range(0..path.len() - 1), random.random_range(0..path.len() - 1));
            [a.min(b), a.max(b)]
        };
        if first == last {
            continue;
        }
        let mut on = |leg: usize| -> Vec<f64> {
            // Corners too, so that legs disappear.
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
        if length(&shorter) < length(path) {
            *path = shorter;
        }
    }
}
