//! The home posture: clear of everything, and close to all other postures.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::polyline::turn;
use super::request::WayRequest;
use crate::robot::Link;
use crate::robot::kinematics::Posture;
use crate::robot::sites::SiteIndex;
use crate::robot::solids::ClearanceCheck;
use crate::units::{DEG, MM};

/// Number of postures sampled.
const DRAWS: usize = 4_000;
/// Sufficient clearance, m: more does not justify a longer path.
const ROOM: f64 = 120.0 * MM;
/// Distance of home from the joint limits, rad.
const FROM_LIMITS: f64 = 15.0 * DEG;

/// Number of postures returned.
const OFFERED: usize = 4;

/// Returns postures (rad, N) with clearance around them: those with the most clearance first, among equals those with the
/// shortest mean motion to `postures` (rad). Empty if no posture is clear by the margin of the request.
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
            .map(Link::drawn_range)
            .map(|[low, high]| {
                let keep = FROM_LIMITS.min(0.25 * (high - low));
                low + keep + (high - low - 2.0 * keep) * random.random::<f64>()
            })
            .collect();
        posture.set(robot, base, tool, &q, &nominal);
        if !request.is_allowed(&q, &q) || !check.is_clear(&posture, margin, None) {
            continue;
        }
        let room = check.clearance(&posture).map_or(ROOM, |c| c.distance.min(ROOM));
        // Clearance first, then the path.
        found.push(((room, -far(&q)), q));
    }
    found.sort_by(|(a, _), (b, _)| b.0.total_cmp(&a.0).then(b.1.total_cmp(&a.1)));
    found.into_iter().take(OFFERED).map(|(_, q)| q).collect()
}
