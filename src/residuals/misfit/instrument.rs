//! Slips of what is measured that are too small for the nominal arm to show: the links are fitted as well, each within what arms of
//! the kind show.
//!
//! A scale of 1.0005, or one anchor of three that stands elsewhere, leaves less than the errors of many arms; yet no arm
//! imitates it, as the anchors say how long a metre is and where the arm stands. Nor does an arm imitate a rail that counts in
//! another step. A tracker whose metre is too long is imitated by an arm with all lengths too long by one share: chance makes such
//! an arm so rarely that the tracker is named.

use nalgebra::{DMatrix, DVector, Vector3};
use rayon::prelude::*;

use super::campaign::{Campaign, Seen};
use super::data_fit::SlipTried;
use super::expected::{Designs, column_of_slide, columns_of_lengths};
use super::frames::{FrameFit, Frames, NU, flanges, scale};
use super::slip::Slip;
use super::slip_words::words_of_place;
use super::starts::fit;
use crate::effects::EffectId;
use crate::math::positive_definite::{cholesky, inverse};
use crate::robot::JointKind;
use crate::units::MM;

/// A slip explains the residual that the fitted arm leaves if it leaves at most this share of it.
const EXPLAINS: f64 = 1.0 / 3.0;
/// The fitted arm fits if it leaves less than this multiple of the stated noise.
const ABOVE_NOISE: f64 = 2.0;
/// Smallest residual of the fitted arm, m, that is told from the noise of instruments and the roughness of anchors.
const TOLD_FROM: f64 = 0.1 * MM;
/// Slips that leave up to this multiple of the least cannot be told apart.
const ALIKE: f64 = 1.25;
/// Nor those whose deviance is larger than the least by up to this: they are less probable by a factor of four hundred at most.
const DEVIANCE: f64 = 12.0;
/// Smallest scale that is named of points or of a joint that slides. Warmth, pitch and a poor alignment of rails stay below, and
/// are fitted.
const LEAST_SCALE: f64 = 3e-3;
/// One-sigma of the scale of points that is wrong at all: that of a focal length.
const SCALES: f64 = 1e-2;
/// How well the lengths of an arm may be assembled, one as likely as the other: one-sigma in those of a poorly assembled arm, from
/// the plausible size of the catalogue to twice the poorest.
const ASSEMBLED: [f64; 5] = [1.0 / 6.0, 1.0 / 3.0, 2.0 / 3.0, 1.0, 2.0];
/// Ratio of probabilities from which a scale of the points is believed: of right data, by its definition, at most one set in so
/// many reaches it.
const BELIEVED: f64 = 1000.0;
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

/// One number of the measurement that is fitted beside the arm.
#[derive(Clone, Copy)]
enum Number {
    Scale,
    Constant,
    ConstantOf(usize),
    /// Scale of a joint that slides.
    Slide(usize),
}

/// Tests a campaign beside a fitted arm; `None` if that leaves what is to be expected, or if no slip explains more.
pub(super) fn judge(campaign: &Campaign) -> Option<Instrument> {
    let measured: Vec<usize> = (0..campaign.anchors.len()).filter(|&a| campaign.sights(a)).collect();
    let slides = (0..campaign.robot.joints()).filter(|&j| campaign.robot.kind(j) == JointKind::Prismatic);
    let mut numbers: Vec<Number> = slides.map(Number::Slide).collect();
    if !measured.is_empty() {
        numbers.extend([Number::Scale, Number::Constant]);
        numbers.extend(measured.iter().filter(|_| measured.len() > 1).map(|&a| Number::ConstantOf(a)));
    }
    if numbers.is_empty() {
        return scale_of_points(campaign);
    }
    let plain = fit(campaign).frames;
    let left = left_by_arm(campaign, &plain, None)?.residual;
    if left < TOLD_FROM.max(ABOVE_NOISE * campaign.stated_noise) {
        return None;
    }
    let of_number = |number: &Number| {
        let fitted = left_by_arm(campaign, &plain, Some(*number))?;
        let is_of_slide = matches!(number, Number::Slide(_));
        if is_of_slide && fitted.size.abs() < LEAST_SCALE {
            return None;
        }
        let (slip, words) = number.told(campaign, fitted.size);
        Some((1, fitted.deviance, SlipTried { slip, residual: fitted.residual, words }))
    };
    let of_anchor = |&a: &usize| {
        let slip = Slip::Anchor(a);
        let changed = slip.undone(campaign);
        let fitted = left_by_arm(&changed, &fit(&changed).frames, None)?;
        let words = with_arm(&words_of_place(campaign, a, fitted.anchor.as_ref()?));
        Some((3, fitted.deviance, SlipTried { slip: slip.name(campaign), residual: fitted.residual, words }))
    };
    let mut tried: Vec<(usize, f64, SlipTried)> = numbers.par_iter().filter_map(of_number).collect();
    // Two anchors less one leave the arm free to turn about the line to the other.
    if measured.len() > 2 {
        tried.extend(measured.par_iter().filter_map(of_anchor).collect::<Vec<_>>());
    }
    tried.retain(|(_, _, t)| t.residual <= EXPLAINS * left);
    let least = tried.iter().map(|(_, _, t)| t.residual).fold(f64::INFINITY, f64::min);
    tried.retain(|(_, _, t)| t.residual <= ALIKE * least);
    let best = tried.iter().map(|(_, deviance, _)| *deviance).fold(f64::INFINITY, f64::min);
    tried.retain(|(_, deviance, _)| *deviance <= best + DEVIANCE);
    tried.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
    let slips: Vec<SlipTried> = tried.into_iter().map(|(_, _, t)| t).collect();
    (!slips.is_empty()).then_some(Instrument { left, slips })
}

/// Names a scale of all measured points where an arm with lengths all off by one share is less believable by far: by the ratio of
/// probabilities of the residuals, averaged over how well the arm may be assembled.
fn scale_of_points(campaign: &Campaign) -> Option<Instrument> {
    if !campaign.shots.iter().all(|shot| matches!(shot.seen, Seen::Point(_))) {
        return None;
    }
    let nominal = fit(campaign);
    let fitted = left_by_arm(campaign, &nominal.frames, Some(Number::Scale))?;
    if fitted.size.abs() < LEAST_SCALE {
        return None;
    }
    let arm = fitted.first_of_arm..fitted.normal.ncols() - 1;
    let lengths: Vec<usize> = columns_of_lengths(&campaign.robot).into_iter().map(|c| fitted.first_of_arm + c).collect();
    let evidence = |scale: bool, size: f64| {
        let columns = if scale { fitted.normal.ncols() } else { fitted.normal.ncols() - 1 };
        let mut held = fitted.normal.view((0, 0), (columns, columns)).into_owned();
        let right = fitted.right.rows(0, columns).into_owned();
        let most = held.diagonal().max();
        let mut priors = 0.0;
        for k in 0..columns {
            let width = match k {
                k if lengths.contains(&k) => size,
                k if arm.contains(&k) => 1.0,
                k if k >= arm.end => SCALES,
                _ => {
                    held[(k, k)] += 1e-13 * most;
                    continue;
                }
            };
            held[(k, k)] += 1.0 / (width * width);
            priors -= 2.0 * width.ln();
        }
        let factor = cholesky(held).ok()?;
        let determinant = 2.0 * factor.l().diagonal().iter().map(|d| d.ln()).sum::<f64>();
        Some(0.5 * (right.dot(&factor.solve(&right)) - determinant + priors))
    };
    let averaged = |scale: bool| {
        let all: Vec<f64> = ASSEMBLED.iter().filter_map(|size| evidence(scale, *size)).collect();
        let most = all.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        most + (all.iter().map(|e| (e - most).exp()).sum::<f64>() / ASSEMBLED.len() as f64).ln()
    };
    let ratio = averaged(true) - averaged(false);
    if !ratio.is_finite() || ratio < BELIEVED.ln() {
        return None;
    }
    let slip = Slip::PointScale(1.0 / (1.0 + fitted.size));
    let undone = fit(&slip.undone(campaign)).robust;
    if undone >= nominal.robust {
        return None;
    }
    let words = format!("{}, as an arm whose lengths are all off by one share is hardly built,", slip.words(campaign));
    Some(Instrument { left: nominal.robust, slips: vec![SlipTried { slip: slip.name(campaign), residual: undone, words }] })
}

/// Words of a correction beside which the arm is fitted.
fn with_arm(words: &str) -> String {
    format!("with the links fitted too, {words}")
}

impl Number {
    /// The derivative of the residual of each row of the design.
    fn column(self, campaign: &Campaign, arm: &DMatrix<f64>) -> Option<DVector<f64>> {
        let mut column = DVector::<f64>::zeros(arm.nrows());
        if let Number::Slide(joint) = self {
            // A scale is a length that grows with what the joint counts.
            let (of_length, size) = column_of_slide(&campaign.robot, joint)?;
            let moved = |r: usize| arm[(r, of_length)] / size * campaign.shots[r / 3].q[joint];
            return Some(DVector::from_fn(arm.nrows(), |r, _| moved(r)));
        }
        for (k, shot) in campaign.shots.iter().enumerate() {
            match (self, shot.seen) {
                (Number::Scale, Seen::Point(point)) => column.fixed_rows_mut::<3>(3 * k).copy_from(&point),
                (Number::Scale, Seen::Distance { distance, .. }) => column[3 * k] = distance,
                (Number::Constant, Seen::Distance { .. }) => column[3 * k] = 1.0,
                (Number::ConstantOf(a), Seen::Distance { anchor, .. }) if a == anchor => column[3 * k] = 1.0,
                _ => {}
            }
        }
        Some(column)
    }

    /// Name and words of the correction of an error of this size.
    fn told(self, campaign: &Campaign, size: f64) -> (String, String) {
        let (slip, correction) = match self {
            Number::Scale => (Slip::DistanceScale(1.0 / (1.0 + size)), None),
            Number::Constant => (Slip::DistanceConstant(-size), None),
            Number::ConstantOf(a) => (Slip::DistanceConstant(-size), Some(&campaign.anchors[a].id)),
            Number::Slide(j) => (Slip::JointScale(j, [1.0 + size, 0.0]), None),
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
    /// Size of the error of the measurement, SI.
    size: f64,
    /// Twice the negative logarithm of the probability of residual and arm, but for a constant: what tells slips apart that leave
    /// nearly the same.
    deviance: f64,
    /// Where the last of the anchors that are fitted stands, m.
    anchor: Option<Vector3<f64>>,
    /// Normal matrix and right side of frames, arm and number, in units of the noise, without any prior.
    normal: DMatrix<f64>,
    right: DVector<f64>,
    /// Column at which the arm begins.
    first_of_arm: usize,
}

/// Fits frames, arm and one number of the measurement, linear about `frames`; `None` if there are too few rows.
fn left_by_arm(campaign: &Campaign, frames: &Frames, number: Option<Number>) -> Option<ByArm> {
    let Designs { frames: of_frames, arm } = Designs::of(campaign, frames);
    let (rows, unknowns) = (of_frames.nrows(), of_frames.ncols());
    let extra = usize::from(number.is_some());
    let mut columns = DMatrix::<f64>::zeros(rows, unknowns + arm.ncols() + extra);
    columns.columns_mut(0, unknowns).copy_from(&of_frames);
    columns.columns_mut(unknowns, arm.ncols()).copy_from(&arm);
    let last = columns.ncols() - 1;
    if let Some(number) = number {
        columns.set_column(last, &number.column(campaign, &arm)?);
    }
    let own = flanges(&campaign.robot, campaign);
    let here = FrameFit::new(campaign, &own);
    let mut residuals = DVector::<f64>::zeros(rows);
    // A distance is one number, and the other rows of its shot are empty.
    let mut filled = vec![true; rows];
    for (k, shot) in campaign.shots.iter().enumerate() {
        residuals.fixed_rows_mut::<3>(3 * k).copy_from(&here.row(k, frames).residual);
        if matches!(shot.seen, Seen::Distance { .. }) {
            filled[3 * k + 1..3 * k + 3].fill(false);
        }
    }
    let count = filled.iter().filter(|f| **f).count() as f64;
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
        let taken = (inverse(held).ok()? * &normal).trace();
        let left = &residuals - &columns * &sizes;
        let squares: f64 = left.iter().zip(&weights).map(|(r, w)| w * r * r).sum();
        let freedom = weights.iter().sum::<f64>() - taken;
        if !squares.is_finite() || freedom < LEAST_FREEDOM {
            return None;
        }
        let residual = (squares / freedom).sqrt();
        let of_arm = sizes.rows(unknowns, arm.ncols()).norm_squared();
        let anchor = campaign.anchors.iter().position(|a| a.free).map(|a| {
            // The unknowns of the anchors are the last ones of the frames.
            frames.anchors[a] + Vector3::new(sizes[unknowns - 3], sizes[unknowns - 2], sizes[unknowns - 1])
        });
        found = Some(ByArm {
            residual,
            size: if extra > 0 { sizes[last] } else { 0.0 },
            deviance: count * (residual * residual).ln() + of_arm,
            anchor,
            normal,
            right,
            first_of_arm: unknowns,
        });
        noise = residual.max(campaign.stated_noise).max(FINEST);
        let lengths: Vec<f64> = left.iter().zip(&filled).filter(|(_, f)| **f).map(|(r, _)| r.abs()).collect();
        let variance = ONE_OF_THREE * scale(&lengths);
        let weight = |r: f64| (NU + 1.0) / (NU + r * r / variance);
        weights = left.iter().zip(&filled).map(|(r, f)| if *f { weight(*r).min(1.0) } else { 0.0 }).collect();
    }
    found
}
