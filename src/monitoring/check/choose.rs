//! Choice of the few poses of a campaign whose repetition distinguishes the conditions.

use nalgebra::DMatrix;
use rayon::iter::{IntoParallelRefIterator, ParallelIterator};

use super::CheckError;
use super::conditions::{of_several, orthonormal};
use super::noise::Whitening;
use super::scene::Scene;
use super::scene::counterparts;
use super::seen::Seen;
use crate::identify::calibration::Calibration;
use crate::measure::dataset::NamedDataset;

/// Added to every separation, so that the first samples, which separate nothing, are compared at all.
const GROUND: f64 = 0.02;

/// Chooses `count` samples of a campaign, by index, to be measured again in this order: greedily, each the one that most
/// increases the sum of the logarithms of the significance of every condition above the noise, and against every other
/// condition.
///
/// # Errors
/// When the campaign does not belong to the calibration, or its noise is not stated.
pub fn choose_sentinels(calibration: &Calibration, campaign: NamedDataset<'_>, count: usize) -> Result<Vec<usize>, CheckError> {
    let all = Scene::of_campaign(calibration, campaign)?;
    let seen: Vec<&Seen> = all.iter().collect();
    if seen.is_empty() {
        return Err(CheckError::Nothing);
    }
    let columns: Vec<DMatrix<f64>> = of_several(&seen, &Whitening::of(&seen)?)
        .into_iter()
        .map(|columns| orthonormal(&columns.block))
        .map(|basis| &basis * (basis.nrows() as f64 / basis.ncols().max(1) as f64).sqrt())
        .collect();
    let mut chosen: Vec<usize> = Vec::new();
    // Of a pose that was repeated, one measurement is enough.
    let repeats = |k: usize| counterparts(&campaign.dataset.samples[k], campaign.dataset, campaign.dataset);
    // What disagreed with all others is no reference.
    let mut taken: Vec<bool> = (0..seen.len()).map(|k| calibration.model.excludes(&campaign.dataset.samples[k].id)).collect();
    while chosen.len() < count.min(seen.len()) {
        let with = |k: usize| chosen.iter().copied().chain([k]).collect::<Vec<_>>();
        let left: Vec<usize> = (0..seen.len()).filter(|&k| !taken[k]).collect();
        let separated: Vec<f64> = left.par_iter().map(|&k| separation(&columns, &seen, &with(k))).collect();
        let best = left.into_iter().zip(separated).reduce(|best, next| if next.1 > best.1 { next } else { best });
        let Some((k, _)) = best else { break };
        repeats(k).into_iter().for_each(|other| taken[other] = true);
        chosen.push(k);
    }
    Ok(chosen)
}

/// Sum over all pairs of conditions of the logarithm of the share of the first that the second cannot explain.
fn separation(columns: &[DMatrix<f64>], seen: &[&Seen], samples: &[usize]) -> f64 {
    let rows: Vec<usize> = samples.iter().flat_map(|&k| seen[k].rows.clone()).collect();
    let here: Vec<DMatrix<f64>> = columns.iter().map(|matrix| matrix.select_rows(&rows)).collect();
    let bases: Vec<DMatrix<f64>> = here.iter().map(orthonormal).collect();
    let mut sum = 0.0;
    for (i, one) in here.iter().enumerate() {
        let energy = |left: f64| (GROUND + left / one.ncols().max(1) as f64).ln();
        sum += energy(one.norm_squared());
        for (_, other) in bases.iter().enumerate().filter(|(j, _)| *j != i) {
            sum += energy((one - other * other.tr_mul(one)).norm_squared());
        }
    }
    sum
}
