//! Slips of an instrument that measures distances, too small for the nominal arm to show: the links are fitted as well, each
//! within what arms of the kind show.
//!
//! A scale of 1.0005, or one anchor of three that stands elsewhere, leaves less than the errors of many arms; yet no arm
//! imitates it, as the anchors say how long a metre is and where the arm stands.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::campaign::{Campaign, Seen};
use super::data_fit::SlipTried;
use super::expected::Designs;
use super::frames::{FrameFit, Frames, NU, flanges, scale};
use super::slip::Slip;
use super::starts::fit;
use crate::effects::EffectId;
use crate::math::positive_definite::{cholesky, inverse};
use crate::units::MM;

/// A slip explains the residual that the fitted arm leaves if it leaves at most this share of it.
const EXPLAINS: f64 = 1.0 / 3.0;
/// The fitted arm fits if it leaves less than this multiple of the stated noise.
const ABOVE_NOISE: f64 = 2.0;
/// Smallest residual of the fitted arm, m, that is told from the noise of instruments and the roughness of anchors.
const TOLD_FROM: f64 = 0.1 * MM;
/// Slips that leave up to this multiple of the least cannot be told apart.
const ALIKE: f64 = 1.25;
/// Smallest number of degrees of freedom with which a residual is known.
const LEAST_FREEDOM: f64 = 20.0;
/// Noise at which the weighing of links against data begins where none is stated, m.
const FIRST_NOISE: f64 = 1e-4;
/// Smallest noise, m: rounding in files.
const FINEST: f64 = 1e-7;
/// Ratio of the medians of chi-square with three degrees of freedom, in which [`scale`] counts, and with one.
const ONE_OF_THREE: f64 = 2.366 / 0.455;
/// Number of times that the noise is taken from the residuals.
const ROUNDS: usize = 4;

/// Residual with the arm fitted, m, and the slips that leave far less, the best first.
pub(super) struct Instrument {
    pub left: f64,
    pub slips: Vec<SlipTried>,
}

/// One number of the instrument that is fitted beside the arm.
#[derive(Clone, Copy)]
enum Number {
    Scale,
    Constant,
    ConstantOf(usize),
}

/// Tests the distances of a campaign that fits the nominal arm; `None` if the fitted arm leaves what is to be expected, if no
/// slip explains more, or if there are no distances.
pub(super) fn judge(campaign: &Campaign) -> Option<Instrument> {
    let measured: Vec<usize> = (0..campaign.anchors.len()).filter(|&a| campaign.sights(a)).collect();
    if measured.is_empty() {
        return None;
    }
    let plain = fit(campaign).frames;
    let left = left_by_arm(campaign, &plain, None)?.residual;
    if left < TOLD_FROM.max(ABOVE_NOISE * campaign.stated_noise) {
        return None;
    }
    let known = measured.len() > 1;
    let numbers: Vec<Number> = [Number::Scale, Number::Constant]
        .into_iter()
        .chain(measured.iter().filter(|_| known).map(|&a| Number::ConstantOf(a)))
        .collect();
    let of_number = |number: &Number| {
        let fitted = left_by_arm(campaign, &plain, Some(*number))?;
        let (slip, words) = number.told(campaign, fitted.size);
        Some((1, SlipTried { slip, residual: fitted.residual, words }))
    };
    let of_anchor = |&a: &usize| {
        let slip = Slip::Anchor(a);
        let changed = slip.undone(campaign);
        let fitted = left_by_arm(&changed, &fit(&changed).frames, None)?;
        Some((3, SlipTried { slip: slip.name(campaign), residual: fitted.residual, words: with_arm(&slip.words(campaign)) }))
    };
    let mut tried: Vec<(usize, SlipTried)> = numbers.par_iter().filter_map(of_number).collect();
    // Two anchors less one leave the arm free to turn about the line to the other.
    if measured.len() > 2 {
        tried.extend(measured.par_iter().filter_map(of_anchor).collect::<Vec<_>>());
    }
    tried.retain(|(_, t)| t.residual <= EXPLAINS * left);
    let least = tried.iter().map(|(_, t)| t.residual).fold(f64::INFINITY, f64::min);
    tried.retain(|(_, t)| t.residual <= ALIKE * least);
    tried.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.residual.total_cmp(&b.1.residual)));
    let slips: Vec<SlipTried> = tried.into_iter().map(|(_, t)| t).collect();
    (!slips.is_empty()).then_some(Instrument { left, slips })
}

/// Words of a correction beside which the arm is fitted.
fn with_arm(words: &str) -> String {
    format!("with the links fitted too, {words}")
}

impl Number {
    /// The derivative of a measured distance.
    fn column(self, anchor: usize, distance: f64) -> f64 {
        match self {
            Number::Scale => distance,
            Number::Constant => 1.0,
            Number::ConstantOf(a) => f64::from(u8::from(a == anchor)),
        }
    }

    /// Name and words of the correction of an error of this size.
    fn told(self, campaign: &Campaign, size: f64) -> (String, String) {
        let (slip, correction) = match self {
            Number::Scale => (Slip::DistanceScale(1.0 / (1.0 + size)), None),
            Number::Constant => (Slip::DistanceConstant(-size), None),
            Number::ConstantOf(a) => (Slip::DistanceConstant(-size), Some(&campaign.anchors[a].id)),
        };
        let (name, words) = (slip.name(campaign), slip.words(campaign));
        match correction {
            None => (name, with_arm(&words)),
            Some(id) => (
                EffectId::member(&name, id).to_string(),
                with_arm(&format!("{:+.2} mm added to every distance from anchor {id} (its constant)", -size / MM)),
            ),
        }
    }
}

/// What the fitted arm leaves.
struct ByArm {
    /// Residual per number, m, of the rows not excluded, with the degrees of freedom that the fit took.
    residual: f64,
    /// Size of the error of the instrument, SI.
    size: f64,
}

/// Fits frames, arm and one number of the instrument, linear about `frames`; `None` if there are too few rows.
fn left_by_arm(campaign: &Campaign, frames: &Frames, number: Option<Number>) -> Option<ByArm> {
    let Designs { frames: of_frames, arm } = Designs::of(campaign, frames);
    let (rows, unknowns) = (of_frames.nrows(), of_frames.ncols());
    let extra = usize::from(number.is_some());
    let mut columns = DMatrix::<f64>::zeros(rows, unknowns + arm.ncols() + extra);
    columns.columns_mut(0, unknowns).copy_from(&of_frames);
    columns.columns_mut(unknowns, arm.ncols()).copy_from(&arm);
    let own = flanges(&campaign.robot, campaign);
    let here = FrameFit::new(campaign, &own);
    let mut residuals = DVector::<f64>::zeros(rows);
    // A distance is one number, and the other rows of its shot are empty.
    let mut filled = vec![true; rows];
    let last = columns.ncols() - 1;
    for (k, shot) in campaign.shots.iter().enumerate() {
        residuals.fixed_rows_mut::<3>(3 * k).copy_from(&here.row(k, frames).residual);
        if let Seen::Distance { anchor, distance } = shot.seen {
            filled[3 * k + 1..3 * k + 3].fill(false);
            if let Some(number) = number {
                columns[(3 * k, last)] = number.column(anchor, distance);
            }
        }
    }
    let mut weights: Vec<f64> = filled.iter().map(|f| f64::from(u8::from(*f))).collect();
    let mut noise = campaign.stated_noise.max(if campaign.stated_noise > 0.0 { FINEST } else { FIRST_NOISE });
    let mut found = None;
    for _ in 0..ROUNDS {
        let weighted = DMatrix::from_fn(rows, columns.ncols(), |r, c| columns[(r, c)] * weights[r]);
        let normal = weighted.tr_mul(&columns) / (noise * noise);
        let right = weighted.tr_mul(&residuals) / (noise * noise);
        let mut held = normal.clone();
        let size = held.diagonal().max();
        for k in 0..held.nrows() {
            let is_of_arm = (unknowns..unknowns + arm.ncols()).contains(&k);
            held[(k, k)] += if is_of_arm { 1.0 } else { 1e-13 * size };
        }
        let sizes = cholesky(held.clone()).ok()?.solve(&right);
        let taken = (inverse(held).ok()? * normal).trace();
        let left = &residuals - &columns * &sizes;
        let squares: f64 = left.iter().zip(&weights).map(|(r, w)| w * r * r).sum();
        let freedom = weights.iter().sum::<f64>() - taken;
        if !squares.is_finite() || freedom < LEAST_FREEDOM {
            return None;
        }
        let residual = (squares / freedom).sqrt();
        found = Some(ByArm { residual, size: if extra > 0 { sizes[last] } else { 0.0 } });
        noise = residual.max(campaign.stated_noise).max(FINEST);
        let lengths: Vec<f64> = left.iter().zip(&filled).filter(|(_, f)| **f).map(|(r, _)| r.abs()).collect();
        let variance = ONE_OF_THREE * scale(&lengths);
        let weight = |r: f64| (NU + 1.0) / (NU + r * r / variance);
        weights = left.iter().zip(&filled).map(|(r, f)| if *f { weight(*r).min(1.0) } else { 0.0 }).collect();
    }
    found
}
