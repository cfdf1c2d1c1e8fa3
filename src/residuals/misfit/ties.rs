//! Test whether the stated distances between balls are those that the arm finds.

use super::campaign::Campaign;
use super::starts::fit;
use crate::units::MM;

/// Distance that is always expected, in parts of the reach.
const OF_REACH: f64 = 2e-3;
/// Multiple of the residual of the arm that is expected.
const OF_RESIDUAL: f64 = 4.0;
/// A common factor explains the distances if it leaves at most this share.
const EXPLAINS: f64 = 1.0 / 3.0;

/// Stated distances that do not fit: rms difference and the largest expected, m, and name, rms difference left, m, and words of
/// each slip.
pub(super) type Mismatch = (f64, f64, Vec<(String, f64, String)>);

/// Tests the distances; `None` if they fit, or there are none.
pub(super) fn judge(campaign: &Campaign, reach: f64) -> Option<Mismatch> {
    if campaign.ties.is_empty() {
        return None;
    }
    let without = Campaign { ties: Vec::new(), ..campaign.clone() };
    let fitted = fit(&without);
    let found: Vec<f64> = campaign
        .ties
        .iter()
        .map(|tie| {
            let [a, b] = tie.between.map(|b| fitted.frames.balls[b]);
            (a - b).norm()
        })
        .collect();
    let stated: Vec<f64> = campaign.ties.iter().map(|tie| tie.distance).collect();
    let off = |by: f64| {
        let squares: f64 = found.iter().zip(&stated).map(|(f, s)| (f - by * s).powi(2)).sum();
        (squares / found.len() as f64).sqrt()
    };
    let (left, most) = (off(1.0), OF_RESIDUAL * fitted.robust + OF_REACH * reach);
    if left <= most || !left.is_finite() {
        return None;
    }
    let product = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let by = product(&found, &stated) / product(&stated, &stated);
    let told = |k: usize| format!("{:.1} mm where {:.1} mm is stated", found[k] / MM, stated[k] / MM);
    let mut slips = Vec::new();
    if off(by) <= EXPLAINS * left {
        let words = format!("the stated distances between balls multiplied by {by:.3} (the arm finds {})", told(0));
        slips.push(("ball_distances".to_owned(), off(by), words));
    } else {
        let wrong = (0..found.len()).filter(|&k| (found[k] - stated[k]).abs() > most);
        for k in wrong {
            let [a, b] = campaign.ties[k].between.map(|b| campaign.balls[b].id.as_str());
            let others: f64 = (0..found.len()).filter(|i| *i != k).map(|i| (found[i] - stated[i]).powi(2)).sum();
            let rest = (others / (found.len() - 1).max(1) as f64).sqrt();
            slips.push((
                format!("ball_distance:{a}:{b}"),
                rest,
                format!("without the distance of {a} and {b} ({}) the arm", told(k)),
            ));
        }
    }
    Some((left, most, slips))
}
