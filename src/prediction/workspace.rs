//! Expected error of the present calibration over the workspace, from the data and the plausible size of physical
//! effects.
//!
//! A small residual on four balls does not prove a good model: a missing effect is absorbed by wrong parameters at the
//! measured poses and appears elsewhere. Every candidate is sampled at sizes that the data allow, together with the part
//! that the fit would have absorbed, and both are evaluated at poses of the workspace.

use nalgebra::{DMatrix, DVector, Point3, Vector3};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::at_new_poses::AtNewPoses;
use super::field::{HeldField, expected_of_model};
use super::level::{Level, MEAN_LENGTH};
use super::posterior::Posterior;
use super::worker::Worker;
use crate::diagnosis::Examination;
use crate::effects::EffectId;
use crate::identify::calibration::IdentifyError;
use crate::identify::problem::Parameter;
use crate::measure::dataset::{Dataset, Measured, NamedDataset, Sample, SampleSet};
use crate::measure::poses::free_poses::{FreePosesRequest, free_poses};
use crate::measure::poses::pool::Margins;
use crate::robot::Robot;
use crate::robot::kinematics::world_from_tool;
use crate::robot::sites::Axis6;
use crate::robot::solids::Surroundings;

/// Number of poses if none are given.
pub const WORKSPACE_POSES: usize = 300;

/// Fixed seed: the same data give the same figures.
pub(crate) const SEED: u64 = 0x0ca1_1be0;

/// Position error expected at one pose.
#[derive(Debug, Clone, PartialEq)]
pub struct ExpectedError {
    /// Joint angles, rad (N).
    pub q: Vec<f64>,
    /// TCP in the world, m.
    pub tcp: Vector3<f64>,
    /// Distance of the TCP from axis 1, m.
    pub radius: f64,
    /// Height of the TCP above the base, along axis 1, m.
    pub height: f64,
    /// Expected length of the error, m.
    pub error: f64,
}

/// A figure with the band of its draws.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Banded {
    /// Expected value.
    pub expected: f64,
    /// 10 % quantile.
    pub low: f64,
    /// 90 % quantile.
    pub high: f64,
}

impl Banded {
    fn of(mut draws: Vec<f64>) -> Self {
        draws.sort_by(f64::total_cmp);
        let at = |share: f64| draws[((draws.len() - 1) as f64 * share).round() as usize];
        Banded { expected: draws.iter().sum::<f64>() / draws.len() as f64, low: at(0.1), high: at(0.9) }
    }
}

/// Expected position error of a calibration over the workspace.
#[derive(Debug, Clone, PartialEq)]
pub struct WorkspaceError {
    /// Mean over the poses, m.
    pub mean: Banded,
    /// Largest error among the poses, m.
    pub max: Banded,
    /// Mean over the poses inside the joint ranges and the TCP box of the fit, each extended by a tenth, m; `None` if
    /// there are none.
    pub ranges_seen: Option<Banded>,
    /// Mean over the other poses, m; `None` if there are none.
    pub elsewhere: Option<Banded>,
    /// One entry per pose.
    pub poses: Vec<ExpectedError>,
    /// One-sigma of the instrument noise per axis, m, which a measured error would contain as well; zero if unknown.
    pub noise: f64,
    /// True if nothing that was left out is as far from the rest as these poses are from the campaign: the figures are then
    /// least ones.
    pub at_least: bool,
}

impl WorkspaceError {
    /// The mean error that an instrument would measure, including its own noise, m.
    ///
    /// ```
    /// use std::f64::consts::PI;
    ///
    /// use calibench::prediction::{Banded, WorkspaceError};
    /// use calibench::units::UM;
    ///
    /// // Of a perfect robot an instrument of 10 µm per axis measures its own noise: 2 sqrt(2 / pi) times that, by Maxwell.
    /// let none = Banded { expected: 0.0, low: 0.0, high: 0.0 };
    /// # let (ranges_seen, elsewhere, poses) = (None, None, Vec::new());
    /// let (noise, at_least) = (10.0 * UM, false);
    /// let perfect = WorkspaceError { mean: none, max: none, ranges_seen, elsewhere, poses, noise, at_least };
    /// assert!((perfect.mean_as_measured() - 2.0 * (2.0 / PI).sqrt() * 10.0 * UM).abs() < 1e-15);
    /// ```
    pub fn mean_as_measured(&self) -> f64 {
        self.as_measured(self.mean.expected)
    }

    /// The 10 and 90 % quantiles of that mean, m.
    pub fn band_as_measured(&self) -> [f64; 2] {
        [self.mean.low, self.mean.high].map(|x| self.as_measured(x))
    }

    fn as_measured(&self, error: f64) -> f64 {
        error.hypot(MEAN_LENGTH * self.noise)
    }
}

/// Draws poses over the workspace of a robot: uniform in its joint limits, without self-collision (rad, N).
pub fn workspace_poses(dataset: &Dataset, count: usize) -> Vec<Vec<f64>> {
    let request = FreePosesRequest {
        robot: &dataset.robot,
        base: &dataset.base,
        tool: &dataset.tool,
        surroundings: &Surroundings::default(),
        margins: Margins::default(),
        facing: None,
        count,
        seed: SEED,
    };
    free_poses(&request).unwrap_or_default()
}

/// Source of the poses of a prediction.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PoseSource {
    /// The rows of set `validation`, on which the robot is to be judged.
    Validation,
    /// Drawn uniformly in the joint limits, without self-collision.
    Drawn,
}

/// Poses at which an error is predicted.
#[derive(Debug, Clone, PartialEq)]
pub struct WorkspacePoses {
    /// Joint angles, rad (N).
    pub q: Vec<Vec<f64>>,
    /// Source of the poses.
    pub source: PoseSource,
}

impl WorkspacePoses {
    /// Returns the poses of the datasets' validation rows; if there are none, [`workspace_poses`] of the first dataset.
    pub fn of(datasets: &[NamedDataset<'_>]) -> Self {
        let rows = datasets.iter().flat_map(|d| d.dataset.samples.iter().filter(|s| s.set == SampleSet::Validation));
        let judged: Vec<Vec<f64>> = rows.map(|s| s.q.clone()).collect();
        if !judged.is_empty() {
            return WorkspacePoses { q: judged, source: PoseSource::Validation };
        }
        let drawn = datasets.first().map(|d| workspace_poses(d.dataset, WORKSPACE_POSES));
        WorkspacePoses { q: drawn.unwrap_or_default(), source: PoseSource::Drawn }
    }
}

impl WorkspaceError {
    /// Predicts the error of the examined fit at joint angles `poses` (rad, N) in the first set-up, with its first
    /// payload, at the end of the session; `None` without poses, or if the data do not determine the set-up itself
    /// ([`undetermined`]).
    ///
    /// # Errors
    /// When a matrix cannot be factored.
    pub fn predict(
        datasets: &[NamedDataset<'_>],
        examination: &Examination,
        poses: &[Vec<f64>],
    ) -> Result<Option<Self>, IdentifyError> {
        WorkspaceError::predict_with(datasets, examination, poses, None)
    }

    /// As [`WorkspaceError::predict`], with the help of the worker if there is one.
    pub(crate) fn predict_with(
        datasets: &[NamedDataset<'_>],
        examination: &Examination,
        poses: &[Vec<f64>],
        worker: Option<&dyn Worker>,
    ) -> Result<Option<Self>, IdentifyError> {
        let Some(NamedDataset { dataset: first, .. }) =
            datasets.first().filter(|_| !poses.is_empty() && undetermined(examination).is_empty())
        else {
            return Ok(None);
        };
        if let Some(held) = HeldField::of_model(datasets, &examination.model) {
            return held.workspace(datasets, poses);
        }
        if let Some(measured) = expected_of_model(datasets, examination, poses)? {
            return Ok(Some(measured));
        }
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
        let poses = expected_errors(&there, poses, |p| sum[p] / errors.ncols() as f64);
        Ok(Some(WorkspaceError {
            mean: Banded::of(means),
            max: Banded::of(maxima),
            ranges_seen,
            elsewhere,
            poses,
            noise: level.noise,
            at_least: false,
        }))
    }
}

/// The poses with the error of each, m, in the cell of `there`.
pub(super) fn expected_errors(there: &Dataset, poses: &[Vec<f64>], error: impl Fn(usize) -> f64) -> Vec<ExpectedError> {
    let base_from_world = there.base.pose().inverse();
    let expected = |(p, q): (usize, &Vec<f64>)| {
        let tcp = world_from_tool(&there.robot, &there.base, &there.tool, q).translation.vector;
        let in_base = base_from_world * Point3::from(tcp);
        let (radius, height) = (in_base.x.hypot(in_base.y), in_base.z);
        ExpectedError { q: q.clone(), tcp, radius, height, error: error(p) }
    };
    poses.iter().enumerate().map(expected).collect()
}

/// Names the parameters of the first set-up's base and tool that these data do not determine although they contain a
/// known position in the world; the position error there cannot be predicted then. If no position is known, the base
/// itself defines the world, and nothing is undetermined.
pub fn undetermined(examination: &Examination) -> Vec<String> {
    let problem = examination.problem();
    let by_definition = problem.setups()[0].datum_freedoms.len() == Axis6::ALL.len();
    let frame = |p: &Parameter| matches!(p.effect.family(), EffectId::BASE_FRAME | EffectId::TOOL_FRAME) && p.setup == Some(0);
    let left_out = examination.fit().unresolved.iter().map(|u| &problem.parameters()[u.parameter]);
    left_out.filter(|p| frame(p) && !(p.defines_world && by_definition)).map(|p| p.name.clone()).collect()
}

/// Share of a range by which a pose may lie outside and still count as inside the range of the fit.
const MARGIN: f64 = 0.1;

/// True if all values lie in their ranges, extended by the margin.
fn inside(values: &[f64], ranges: &[[f64; 2]]) -> bool {
    let within = |(v, r): (&f64, &[f64; 2])| {
        let margin = MARGIN * (r[1] - r[0]);
        (r[0] - margin..=r[1] + margin).contains(v)
    };
    values.iter().zip(ranges).all(within)
}

/// For each pose, true if it lies inside the ranges of the fit: those of its joints and of its TCP position.
pub(super) fn seen(examination: &Examination, there: &Dataset, poses: &[Vec<f64>]) -> Vec<bool> {
    let tcp = |q: &[f64]| world_from_tool(&there.robot, &there.base, &there.tool, q).translation.vector;
    let mut box_of_tcp = [[f64::INFINITY, f64::NEG_INFINITY]; 3];
    for at in &examination.contexts {
        let place = tcp(&at.q);
        box_of_tcp.iter_mut().zip(place.iter()).for_each(|(r, &x)| *r = [r[0].min(x), r[1].max(x)]);
    }
    let ranges = examination.problem.joint_ranges();
    poses.iter().map(|q| inside(q, &ranges) && inside(tcp(q).as_slice(), &box_of_tcp)).collect()
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

/// Samples of point measurements at these poses in the first set-up, at the end of the session, with random directions
/// of approach.
pub(crate) fn at_poses(dataset: &Dataset, examination: &Examination, poses: &[Vec<f64>], random: &mut ChaCha8Rng) -> Dataset {
    let setup = &examination.problem.setups()[0];
    let taken = || dataset.samples.iter().filter(|s| s.set == SampleSet::Fit);
    let robot: &Robot = &dataset.robot;
    let middle = |of: &dyn Fn(&Sample) -> Option<f64>| {
        let (sum, count) = taken().filter_map(of).fold((0.0, 0), |(s, n), v| (s + v, n + 1));
        (count > 0).then(|| sum / f64::from(count))
    };
    let time_s = taken().filter_map(|s| s.time_s).fold(None, |a: Option<f64>, t| Some(a.map_or(t, |a| a.max(t))));
    let temp_c = middle(&|s| s.temp_c);
    let sample = |(k, q): (usize, &Vec<f64>)| {
        let at = world_from_tool(robot, &setup.start, &dataset.tool, q).translation.vector;
        let mut sample = Sample::new(format!("w{k}"), q.clone(), Measured::Point(at));
        let side = |_| if <StandardNormal as Distribution<f64>>::sample(&StandardNormal, random) > 0.0 { 1 } else { -1 };
        sample.approach = Some((0..q.len()).map(side).collect());
        sample.q_commanded = Some(q.clone());
        sample.time_s = time_s;
        sample.temp_c = temp_c;
        sample.session = (!setup.session.is_empty()).then(|| setup.session.clone());
        sample
    };
    let samples = poses.iter().enumerate().map(sample).collect();
    Dataset { base: setup.start, samples, ball_distances: Vec::new(), ..dataset.clone() }
}

/// Jacobian of the TCP at each pose with respect to the fitted parameters (per SI unit) and the candidates (per
/// plausible size): 3 rows per pose, m. The part of ball errors that the fit absorbed is contained in the parameters.
pub(crate) fn fields(there: &Dataset, examination: &Examination) -> Result<DMatrix<f64>, IdentifyError> {
    Ok(AtNewPoses::of_the_arm(there, examination)?.fields())
}
