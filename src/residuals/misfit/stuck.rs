//! Rows that contradict each other by themselves: the same joint angles at places far apart, and targets that hold each
//! other's numbers.

use std::collections::BTreeMap;

use nalgebra::Vector3;

use super::campaign::{Campaign, Seen, Shot};
use super::data_fit::SlipTried;
use crate::measure::dataset::Dataset;

/// Joint angles that differ by less are the same, rad or m.
const SAME_JOINTS: f64 = 1e-7;
/// Places are far apart from this share of the reach on: no arm, load or repeat moves the tool so far in one posture.
const FAR_APART: f64 = 0.01;
/// The same in multiples of the noise.
const FAR_IN_NOISE: f64 = 10.0;
/// Fewer such rows are named as bad rows.
const LEAST_ROWS: usize = 3;
/// Share of such rows that stand at the end, where joint angles are frozen.
const MOST_OF_THEM: f64 = 0.8;
/// Number of rows named individually, at most.
const NAMED: usize = 6;
/// Share of the rows of two targets that may agree by chance.
const BY_CHANCE: f64 = 0.2;

/// Rows whose joint angles stayed those of an earlier row while the measured places moved on; the residual of the slips is
/// not known.
pub(super) fn stuck(dataset: &Dataset, campaign: &Campaign, reach: f64) -> Option<SlipTried> {
    let limit = (FAR_APART * reach).max(FAR_IN_NOISE * campaign.noise);
    let mut stuck: Vec<usize> = Vec::new();
    let mut apart: f64 = 0.0;
    for s in 0..campaign.places.len() {
        let of_setup: Vec<usize> = (0..campaign.shots.len()).filter(|&k| campaign.shots[k].setup == s).collect();
        for run in of_setup.chunk_by(|a, b| same_joints(campaign, dataset, *a, *b)) {
            let mut first: BTreeMap<usize, Vector3<f64>> = BTreeMap::new();
            for &k in run {
                let Some((target, place)) = place(campaign, &campaign.shots[k]) else { continue };
                let far = (place - *first.entry(target).or_insert(place)).norm();
                if far > limit {
                    stuck.push(k);
                    apart = apart.max(far);
                }
            }
        }
    }
    if stuck.len() < LEAST_ROWS {
        return None;
    }
    stuck.sort_unstable();
    let id = |k: usize| dataset.samples[campaign.shots[k].source[1]].id.as_str();
    let all = campaign.shots.len();
    let tell = |slip: String, words: String| Some(SlipTried { slip, residual: apart, words });
    let one_posture = campaign.shots.windows(2).all(|w| alike(&w[0].q, &w[1].q));
    if one_posture {
        return tell("joints_constant".into(), format!("all {all} rows have the same joint angles"));
    }
    // From where on all rows have the joint angles of the last one.
    let last = &campaign.shots[all - 1].q;
    let from = campaign.shots.iter().rposition(|shot| !alike(&shot.q, last)).map_or(0, |k| k + 1);
    let frozen = stuck.iter().filter(|k| **k >= from).count();
    if frozen >= LEAST_ROWS && frozen as f64 >= MOST_OF_THEM * stuck.len() as f64 {
        let words = format!("the joint angles stay the same from row {} on, in {} rows of {all}", id(from), all - from);
        return tell(format!("joints_frozen:{}", id(from)), words);
    }
    let named: Vec<&str> = stuck.iter().take(NAMED).map(|&k| id(k)).collect();
    let others = stuck.len().saturating_sub(NAMED);
    let others = if others == 0 { String::new() } else { format!(" and {others} more") };
    let words =
        format!("{} rows of {all} repeat the joint angles of the row before: {}{others}", stuck.len(), named.join(", "));
    tell("joints_stale".into(), words)
}

/// A joint or two that have the same number in every row: of data that do not fit, they moved and were not recorded.
pub(super) fn never_moved(campaign: &Campaign) -> Option<SlipTried> {
    let first = &campaign.shots.first()?.q;
    let is_still = |j: &usize| campaign.shots.iter().all(|shot| (shot.q[*j] - first[*j]).abs() < SAME_JOINTS);
    let still: Vec<String> = (0..first.len()).filter(is_still).map(|j| (j + 1).to_string()).collect();
    let words = match still.as_slice() {
        [one] => format!("joint {one} has the same number in every row"),
        [one, other] => format!("joints {one} and {other} have the same numbers in every row"),
        _ => return None,
    };
    Some(SlipTried { slip: format!("joint_constant:{}", still.join(":")), residual: 0.0, words })
}

/// The targets of a tool whose rows hold the numbers of another one, with the number of such rows.
pub(super) fn copied(campaign: &Campaign) -> Option<(usize, usize, usize)> {
    let of = |s: usize| campaign.shots.iter().filter(move |shot| shot.setup == s);
    let numbers = |shot: &Shot| match shot.seen {
        Seen::Point(p) => Some([p.x.to_bits(), p.y.to_bits(), p.z.to_bits()]),
        _ => None,
    };
    let sets: Vec<std::collections::HashSet<_>> =
        (0..campaign.places.len()).map(|s| of(s).filter_map(numbers).collect()).collect();
    for b in 0..sets.len() {
        for a in 0..b {
            let differ = campaign.places[a].tool_target != campaign.places[b].tool_target;
            let same = sets[a].intersection(&sets[b]).count();
            if differ && same as f64 > BY_CHANCE * sets[a].len().min(sets[b].len()) as f64 {
                return Some((a, b, same));
            }
        }
    }
    None
}

/// What is compared at one posture: the target by number, and where it was; `None` if only the arm knows where.
fn place(campaign: &Campaign, shot: &Shot) -> Option<(usize, Vector3<f64>)> {
    match shot.seen {
        Seen::Point(point) => Some((0, point)),
        Seen::Distance { anchor, distance } => Some((anchor, Vector3::new(distance, 0.0, 0.0))),
        Seen::Ball { ball, .. } if !campaign.balls[ball].free => Some((0, campaign.balls[ball].position)),
        Seen::Ball { .. } => None,
    }
}

fn same_joints(campaign: &Campaign, dataset: &Dataset, a: usize, b: usize) -> bool {
    let payload = |k: usize| dataset.samples[campaign.shots[k].source[1]].payload;
    payload(a) == payload(b) && alike(&campaign.shots[a].q, &campaign.shots[b].q)
}

fn alike(a: &[f64], b: &[f64]) -> bool {
    a.iter().zip(b).all(|(a, b)| (a - b).abs() <= SAME_JOINTS)
}
