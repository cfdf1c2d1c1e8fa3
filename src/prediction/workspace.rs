//! Expected error of the present calibration over the workspace, from the data and the plausible size of physical
//! effects.
//!
//! A small residual on four balls does not prove a good model: a missing effect is absorbed by wrong parameters at the
//! measured poses and appears elsewhere. Every candidate is sampled at sizes that the data allow, together with the part
//! that the fit would have absorbed, and both are evaluated at poses of the workspace.

use nalgebra::{DMatrix, DVector};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::at_new_poses::AtNewPoses;
use super::expected_error::{Banded, WorkspaceError, expected_errors};
use super::field::{HeldField, expected_of_model};
use super::level::Level;
use super::poses::{SEED, WorkspacePoses, at_poses, seen, undetermined};
use super::posterior::Posterior;
use super::worker::Worker;
use crate::diagnosis::Examination;
use crate::identify::calibration::IdentifyError;
use crate::measure::dataset::{Dataset, NamedDataset};

impl WorkspaceError {
    /// Predicts the error of the examined fit at these poses in the first set-up, with its first
    /// payload, at the end of the session; `None` without poses, or if the data do not determine the set-up itself
    /// ([`undetermined`]).
    ///
    /// # Errors
    /// When a matrix cannot be factored.
    pub fn predict(
        datasets: &[NamedDataset<'_>],
        examination: &Examination,
        poses: &WorkspacePoses,
    ) -> Result<Option<Self>, IdentifyError> {
        WorkspaceError::predict_with(datasets, examination, poses, None)
    }

    /// As [`WorkspaceError::predict`], with the help of the worker if there is one.
    pub(crate) fn predict_with(
        datasets: &[NamedDataset<'_>],
        examination: &Examination,
        poses: &WorkspacePoses,
        worker: Option<&dyn Worker>,
    ) -> Result<Option<Self>, IdentifyError> {
        let Some(NamedDataset { dataset: first, .. }) =
            datasets.first().filter(|_| !poses.q.is_empty() && undetermined(examination).is_empty())
        else {
            return Ok(None);
        };
        if let Some(held) = HeldField::of_model(datasets, &examination.model) {
            return held.workspace(datasets, poses);
        }
        let at = poses;
        let poses = at.q.as_slice();
        let mut random = ChaCha8Rng::seed_from_u64(SEED);
        let there = at_poses(first, examination, poses, &mut random);
        let posterior = Posterior::of(datasets, examination, worker)?;
        let mut errors = posterior.errors(&there, examination, &mut random)?;
        rein_in(&mut errors);
        let level = Level::of(datasets, examination)?;
        let seen = seen(examination, &there, poses);
        hold_to_level(&mut errors, &seen, &level, examination);
        let widened: Vec<f64> = (0..errors.ncols())
            .map(|_| (level.spread * <StandardNormal as Distribution<f64>>::sample(&StandardNormal, &mut random)).exp())
            .collect();
        errors.column_iter_mut().zip(&widened).for_each(|(mut draw, w)| draw *= *w);

        let count = poses.len();
        let mut sum = DVector::<f64>::zeros(count);
        let (mut means, mut maxima) = (Vec::new(), Vec::new());
        let mut parts = [Vec::new(), Vec::new()];
        for draw in errors.column_iter() {
            let lengths = DVector::from_fn(count, |p, _| draw.rows(3 * p, 3).norm());
            means.push(lengths.mean());
            maxima.push(lengths.max());
            for (part, inside) in parts.iter_mut().zip([true, false]) {
                let own: Vec<f64> = lengths.iter().zip(&seen).filter(|(_, s)| **s == inside).map(|(l, _)| *l).collect();
                if !own.is_empty() {
                    part.push(own.iter().sum::<f64>() / own.len() as f64);
                }
            }
            sum += lengths;
        }
        let [ranges_seen, elsewhere] = parts.map(|draws| (!draws.is_empty()).then(|| Banded::of(draws)));
        let each = expected_errors(&there, poses, |p| sum[p] / errors.ncols() as f64);
        let drawn = WorkspaceError {
            at: at.source,
            mean: Banded::of(means),
            max: Banded::of(maxima),
            ranges_seen,
            elsewhere,
            poses: each,
            noise: level.noise,
            at_least: false,
        };
        Ok(Some(match expected_of_model(datasets, examination, at)? {
            Some(measured) => drawn.or_as_measured(&measured),
            None => drawn,
        }))
    }
}

/// Limit for the mean error of a draw, as a multiple of the median over all draws: the tail of some hundred draws is
/// uncertain, and the mean must not depend on a single one.
const FURTHEST_DRAW: f64 = 3.0;

/// Scales down draws beyond that limit.
fn rein_in(errors: &mut DMatrix<f64>) {
    let poses = errors.nrows() / 3;
    let mean = |draw: usize| (0..poses).map(|p| errors.fixed_view::<3, 1>(3 * p, draw).norm()).sum::<f64>();
    let means: Vec<f64> = (0..errors.ncols()).map(mean).collect();
    let mut sorted = means.clone();
    sorted.sort_by(f64::total_cmp);
    let most = FURTHEST_DRAW * sorted.get(sorted.len() / 2).copied().unwrap_or(0.0);
    for (mut draw, mean) in errors.column_iter_mut().zip(means).filter(|(_, mean)| *mean > most) {
        draw *= most / mean;
    }
}

/// Scales the draws to the measured level. At poses within the range of the campaign, the target is a geometric mean of
/// the draws' level and the error at left-out postures, weighted by the share of the latter that is not instrument
/// noise. If no position in the world is known, the absolute error has no meaning and only the measurement counts:
/// within the range the error at left-out postures, beyond it the geometric mean of that and the error at left-out
/// places.
fn hold_to_level(errors: &mut DMatrix<f64>, seen: &[bool], level: &Level, examination: &Examination) {
    let nowhere = examination.problem.parameters().iter().any(|p| p.defines_world);
    let mut hold = |inside: bool, target: f64, weight: f64| {
        let held: Vec<usize> = (0..seen.len()).filter(|&p| seen[p] == inside).collect();
        let length = |draw: usize, p: usize| errors.fixed_view::<3, 1>(3 * p, draw).norm();
        let sum: f64 = (0..errors.ncols()).map(|d| held.iter().map(|&p| length(d, p)).sum::<f64>()).sum();
        let drawn = sum / (held.len() * errors.ncols()).max(1) as f64;
        let factor = (target / drawn.max(f64::MIN_POSITIVE)).powf(weight);
        held.iter().for_each(|&p| errors.rows_mut(3 * p, 3).scale_mut(factor));
    };
    if nowhere {
        hold(true, level.left_out, 1.0);
        // A prediction from one place fewer gives too large an error; one from other postures at the same places, too
        // small.
        hold(false, level.places_left_out.map_or(level.left_out, |places| (places * level.left_out).sqrt()), 1.0);
    } else {
        // If most of the error at left-out postures is instrument noise, it says little about the robot.
        hold(true, level.left_out, 0.5 * level.share);
    }
}

/// Jacobian of the TCP at each pose with respect to the fitted parameters (per SI unit) and the candidates (per
/// plausible size): 3 rows per pose, m. The part of ball errors that the fit absorbed is contained in the parameters.
pub(crate) fn fields(there: &Dataset, examination: &Examination) -> Result<DMatrix<f64>, IdentifyError> {
    Ok(AtNewPoses::of_the_arm(there, examination)?.fields())
}
