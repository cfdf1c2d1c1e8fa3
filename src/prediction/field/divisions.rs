//! Divisions of a campaign by which the error at other postures is measured: nearer and farther ones.

use super::campaign::Campaign;
use super::conditional::Conditional;
use super::left_out::{Missed, left_out};
use crate::diagnosis::Examination;
use crate::diagnosis::folds::{Division, Folds, places, postures};
use crate::measure::dataset::NamedDataset;
use crate::prediction::level::clipped_mean;

/// Numbers of blocks of joint space; the fewer, the farther each is from the others.
const BLOCKS: [usize; 6] = [20, 12, 8, 5, 4, 3];

/// Fewest postures of a block on average.
const LEAST_OF_BLOCK: usize = 6;

/// Number of parts in time.
const TIMES: usize = 10;

/// Fewest predicted samples of a division.
const LEAST_PREDICTED: usize = 8;

/// Fixed seed: the same data give the same blocks.
const SEED: u64 = 0x0ca1_1bf1;

/// Which parts of a campaign are predicted from the others.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Parting {
    /// Kind of division.
    pub division: Division,
    /// Number of parts.
    pub count: usize,
}

/// A division, with the part of each sample.
pub(super) struct Divided {
    pub parting: Parting,
    pub folds: Vec<usize>,
}

/// Postures as points of a space in which k-means finds blocks: angles over their standard deviations, times the root of the
/// joint's share of the levers.
fn points(campaign: &Campaign) -> Vec<Vec<f64>> {
    let all = &campaign.contexts;
    let n = all.len() as f64;
    let joints = all.first().map_or(0, |c| c.q.len());
    let scale = |j: usize| {
        let mean = all.iter().map(|c| c.q[j]).sum::<f64>() / n;
        let sd = (all.iter().map(|c| (c.q[j] - mean).powi(2)).sum::<f64>() / n).sqrt();
        let lever = (all.iter().map(|c| c.joints[j].norm_squared()).sum::<f64>() / n).sqrt();
        if sd > 0.0 { lever.sqrt() / sd } else { 0.0 }
    };
    let scales: Vec<f64> = (0..joints).map(scale).collect();
    all.iter().map(|c| c.q.iter().zip(&scales).map(|(q, s)| q * s).collect()).collect()
}

/// All divisions that a campaign allows.
pub(super) fn divisions(datasets: &[NamedDataset<'_>], examination: &Examination, campaign: &Campaign) -> Vec<Divided> {
    let postures = postures(&campaign.contexts);
    let n = postures.count();
    let of_samples = |of: &[usize]| -> Vec<usize> { postures.of_samples().iter().map(|&p| of[p]).collect() };
    let random = Folds::random(n);
    let times = TIMES.min(n);
    let mut all = vec![
        Divided { parting: Parting { division: Division::Random, count: random.count }, folds: of_samples(&random.of) },
        Divided {
            parting: Parting { division: Division::Time, count: times },
            folds: of_samples(&(0..n).map(|p| p * times / n).collect::<Vec<_>>()),
        },
    ];
    let points = points(campaign);
    let points: Vec<&[f64]> = points.iter().map(Vec::as_slice).collect();
    for count in BLOCKS.into_iter().filter(|count| n >= LEAST_OF_BLOCK * count) {
        let folds = of_samples(&postures.blocks(&points, count, SEED));
        all.push(Divided { parting: Parting { division: Division::Blocks, count }, folds });
    }
    if let Some(of_all) = places(examination, datasets) {
        let folds: Vec<usize> = campaign.chosen.iter().map(|&s| of_all[s]).collect();
        let count = folds.iter().max().map_or(0, |p| p + 1);
        all.push(Divided { parting: Parting { division: Division::Places, count }, folds });
    }
    all
}

/// What a division measures of the model alone and of the model with its field.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Measured {
    pub parting: Parting,
    /// How far its parts are from each other, as the model alone sees it: root of the mean variance of the prediction over that
    /// of the noise.
    pub leverage: f64,
    /// Mean length of the error without the field and with it, clipped against outliers, noise included, m.
    pub errors: [f64; 2],
    /// Share of the mean square that the field removes, pair by pair, squares clipped at three medians of those without it.
    pub gain: f64,
    /// Standard error of that gain.
    pub sigma: f64,
}

/// Squares beyond this many medians count as this many.
const CLIP: f64 = 3.0;

impl Measured {
    fn of(parting: Parting, pairs: &[[Missed; 2]], noise2: f64) -> Option<Self> {
        if pairs.len() < LEAST_PREDICTED {
            return None;
        }
        let n = pairs.len() as f64;
        let mut sorted: Vec<f64> = pairs.iter().map(|[before, _]| before.squared).collect();
        sorted.sort_by(f64::total_cmp);
        let most = CLIP * 0.5 * (sorted[(pairs.len() - 1) / 2] + sorted[pairs.len() / 2]);
        let gains: Vec<f64> = pairs.iter().map(|[a, b]| a.squared.min(most) - b.squared.min(most)).collect();
        let whole = pairs.iter().map(|[a, _]| a.squared.min(most)).sum::<f64>() / n;
        let mean = gains.iter().sum::<f64>() / n;
        let spread = (gains.iter().map(|g| (g - mean).powi(2)).sum::<f64>() / n / (n - 1.0)).sqrt();
        let variance = pairs.iter().map(|[a, _]| a.variance).sum::<f64>() / n;
        let error = |k: usize| clipped_mean(pairs.iter().map(|pair| pair[k].squared.sqrt()).collect());
        Some(Measured {
            parting,
            leverage: (variance / (3.0 * noise2)).sqrt(),
            errors: [error(0), error(1)],
            gain: mean / whole.max(f64::MIN_POSITIVE),
            sigma: spread / whole.max(f64::MIN_POSITIVE),
        })
    }
}

/// Measures the model alone and with its field in every division; `noise2` is the variance of the noise of the first, m².
pub(super) fn measure(divided: &[Divided], campaign: &Campaign, [alone, with_field]: [&Conditional; 2]) -> Vec<Measured> {
    let noise2 = alone.sizes.noise * campaign.noise_m.powi(2);
    let of = |Divided { parting, folds }: &Divided| {
        let both = [alone, with_field].map(|model| left_out(model, campaign, folds));
        let pairs: Vec<[Missed; 2]> = both[0].iter().zip(&both[1]).filter_map(|(a, b)| Some([(*a)?, (*b)?])).collect();
        Measured::of(*parting, &pairs, noise2)
    };
    divided.iter().filter_map(of).collect()
}
