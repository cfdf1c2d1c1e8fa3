//! The home posture: where the arm is out of the way of everything, near to all that it does.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::{WayRequest, turn};
use crate::robot::{ClearanceCheck, Posture, SiteIndex};
use crate::units::{DEG, MM};

/// Postures drawn.
const DRAWS: usize = 4_000;
/// Room that is enough, m: more is worth no longer way.
const ROOM: f64 = 120.0 * MM;
/// How far home stays from the joint limits, rad.
const FROM_LIMITS: f64 = 15.0 * DEG;

/// Postures offered.
const OFFERED: usize = 4;

/// Postures (rad, N) with room around them, the first the one from which the arm gets soonest to `postures` (rad), on average. None where no
/// posture stands free by the margin of the request.
pub(super) fn home_postures(request: &WayRequest<'_>, postures: &[&[f64]]) -> Vec<Vec<f64>> {
    let WayRequest { robot, base, tool, surroundings, margin, seed, .. } = *request;
    let mut check = ClearanceCheck::new(robot, surroundings);
    let mut posture = Posture::new(robot);
    let nominal = vec![0.0; SiteIndex::new(robot.joints()).len()];
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    random.set_stream(0xB2 << 56);
    let far = |q: &[f64]| postures.iter().map(|p| turn(p, q)).sum::<f64>() / postures.len().max(1) as f64;
    let mut found: Vec<((f64, f64), Vec<f64>)> = Vec::new();
    for _ in 0..DRAWS {
        let q: Vec<f64> = robot
            .links
            .iter()
            .map(|l| {
                let keep = FROM_LIMITS.min(0.25 * (l.limits[1] - l.limits[0]));
                l.limits[0] + keep + (l.limits[1] - l.limits[0] - 2.0 * keep) * random.random::<f64>()
            })
            .collect();
        posture.set(robot, base, tool, &q, &nominal);
        if !request.is_allowed(&q, &q) || !check.is_clear(&posture, margin, None) {
            continue;
        }
        let room = check.clearance(&posture).map_or(ROOM, |c| c.distance.min(ROOM));
        // Room first, then the way.
        found.push(((room, -far(&q)), q));
    }
    found.sort_by(|(a, _), (b, _)| b.0.total_cmp(&a.0).then(b.1.total_cmp(&a.1)));
    found.into_iter().take(OFFERED).map(|(_, q)| q).collect()
}
