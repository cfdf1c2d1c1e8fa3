//! Test whether the stated places of several targets on one tool fit where the arm finds them.

use crate::effects::EffectId;
use nalgebra::Vector3;

use super::campaign::{Campaign, Seen};
use super::data_fit::SlipTried;
use super::frames::{Frames, flanges};
use super::slip::LENGTHS;
use super::slip_words::scaled;
use crate::measure::dataset::Dataset;

/// Distance that is always expected, in parts of the reach.
const OF_REACH: f64 = 2e-3;
/// Multiple of the residual of the arm that is expected: its errors are nearly the same for all targets.
const OF_RESIDUAL: f64 = 4.0;
/// Rotation, rad, by which an arm may err: at common postures that is all by which it errs otherwise at one target than at another.
const OF_SPREAD: f64 = 1e-2;
/// A slip explains the distances if it leaves at most this share.
const EXPLAINS: f64 = 1.0 / 3.0;
/// Slips up to this multiple of the best cannot be told apart.
const ALIKE: f64 = 1.25;

/// Places of targets that do not fit.
#[derive(Debug, Clone)]
pub(super) struct Misplaced {
    /// Rms distance between where targets are stated and where the arm finds them, m.
    pub left: f64,
    /// Largest distance expected, m.
    pub most: f64,
    /// The slips, each with the rms distance left, m.
    pub slips: Vec<SlipTried>,
}

/// Tests the places; `None` if they fit, or cannot be compared.
pub(super) fn judge(dataset: &Dataset, campaign: &Campaign, frames: &Frames, robust: f64, reach: f64) -> Option<Misplaced> {
    let session = dataset.samples.first()?.session.clone();
    if !dataset.tool_free || dataset.samples.iter().any(|s| s.session != session) {
        return None;
    }
    // Where the arm finds each target in the tool's axes, and where it is stated.
    let to_tool = dataset.tool.pose().rotation.inverse();
    let measured = |s: usize| campaign.shots.iter().any(|shot| shot.setup == s && matches!(shot.seen, Seen::Point(_)));
    let compared = |s: &usize| campaign.places[*s].tool_target.is_none_or(|t| !dataset.tool_targets[t].free) && measured(*s);
    let of: Vec<usize> = (0..campaign.places.len()).filter(compared).collect();
    // One base for all: what it lacks is common to all targets.
    let flanges = flanges(&campaign.robot, campaign);
    let base = frames.bases[*of.first()?];
    let seen = |s: usize| {
        let at = campaign.shots.iter().zip(&flanges).filter(move |(shot, _)| shot.setup == s);
        let tips: Vec<Vector3<f64>> = at
            .filter_map(|(shot, flange)| match shot.seen {
                Seen::Point(point) => Some((base * flange).inverse().transform_point(&point.into()).coords),
                _ => None,
            })
            .collect();
        tips.iter().sum::<Vector3<f64>>() / tips.len().max(1) as f64
    };
    let found: Vec<Vector3<f64>> = of.iter().map(|&s| to_tool * seen(s)).collect();
    let stated: Vec<Vector3<f64>> = of
        .iter()
        .map(|&s| campaign.places[s].tool_target.map_or_else(Vector3::zeros, |t| dataset.tool_targets[t].position))
        .collect();
    let apart = |stated: &[Vector3<f64>], without: Option<usize>| {
        let off: Vec<_> = (0..of.len()).filter(|k| Some(*k) != without).map(|k| found[k] - stated[k]).collect();
        let mean = off.iter().sum::<Vector3<f64>>() / off.len().max(1) as f64;
        (off.iter().map(|o| (o - mean).norm_squared()).sum::<f64>() / off.len().max(1) as f64).sqrt()
    };
    let postures = |s: usize| campaign.shots.iter().filter(move |shot| shot.setup == s).map(|shot| &shot.q);
    let in_common = of[1..].iter().all(|&s| postures(of[0]).eq(postures(s)));
    let spread = stated.iter().flat_map(|a| stated.iter().map(move |b| (a - b).norm())).fold(0.0, f64::max);
    let any_posture = OF_RESIDUAL * robust + OF_REACH * reach;
    let most = if in_common { any_posture.min(OF_SPREAD * spread + campaign.noise) } else { any_posture };
    let left = apart(&stated, None);
    if of.len() < 2 || left <= most {
        return None;
    }
    let name = |k: usize| campaign.places[of[k]].tool_target.map_or("TCP", |t| dataset.tool_targets[t].id.as_str());
    let changed = |change: &dyn Fn(usize, Vector3<f64>) -> Vector3<f64>| {
        let all: Vec<_> = stated.iter().enumerate().map(|(k, p)| change(k, *p)).collect();
        apart(&all, None)
    };
    let mut tried: Vec<(usize, f64, String, String)> = Vec::new();
    for by in LENGTHS {
        tried.push((0, changed(&|_, p| p * by), "unit:targets".into(), format!("the places of all targets {}", scaled(by))));
        for k in 0..of.len() {
            let left = changed(&|i, p| if i == k { p * by } else { p });
            tried.push((
                1,
                left,
                format!("unit:target:{}", name(k)),
                format!("the place of target {} {}", name(k), scaled(by)),
            ));
        }
    }
    for (a, b, axes) in [(0, 1, "x and y"), (0, 2, "x and z"), (1, 2, "y and z")] {
        let swapped = |mut p: Vector3<f64>| {
            p.swap_rows(a, b);
            p
        };
        tried.push((
            1,
            changed(&|_, p| swapped(p)),
            "target_axes".into(),
            format!("{axes} of the places of targets exchanged"),
        ));
    }
    for (a, axis) in ["x", "y", "z"].into_iter().enumerate() {
        let turned = |mut p: Vector3<f64>| {
            p[a] = -p[a];
            p
        };
        tried.push((
            1,
            changed(&|_, p| turned(p)),
            "target_axes".into(),
            format!("{axis} of the places of targets counted the other way"),
        ));
    }
    for a in 0..of.len() {
        for b in a + 1..of.len() {
            let left = changed(&|k, p| {
                if k == a {
                    stated[b]
                } else if k == b {
                    stated[a]
                } else {
                    p
                }
            });
            let words = format!("targets {} and {} exchanged", name(a), name(b));
            tried.push((1, left, format!("targets_swapped:{}:{}", name(a), name(b)), words));
        }
        if of.len() > 2 {
            let words = format!("target {} at another place than stated", name(a));
            tried.push((2, apart(&stated, Some(a)), EffectId::member(EffectId::TARGET, name(a)).to_string(), words));
        }
    }
    tried.retain(|t| t.1 <= most && t.1 <= EXPLAINS * left);
    let least = tried.iter().map(|t| t.1).fold(f64::INFINITY, f64::min);
    tried.retain(|t| t.1 <= ALIKE * least.max(0.1 * most));
    tried.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
    let simplest = tried.first().map_or(0, |t| t.0);
    tried.retain(|t| t.0 == simplest);
    Some(Misplaced {
        left,
        most,
        slips: tried.into_iter().map(|(_, residual, slip, words)| SlipTried { slip, residual, words }).collect(),
    })
}
