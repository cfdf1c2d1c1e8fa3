//! How wrong the present calibration is over the workspace, as far as the data and ordinary physics tell.
//!
//! A small residual on four balls is no evidence of a good model: what is missing hides in wrong parameters where it was measured and
//! comes out elsewhere. Every size of every candidate that the data allow is drawn, what the fit would have absorbed of it is taken
//! along, and both are carried to poses of the workspace.

use nalgebra::{DMatrix, DVector, Point3, Vector3};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::at_new_poses::AtNewPoses;
use super::examination::Examination;
use super::level::{Level, MEAN_LENGTH};
use super::posterior::Posterior;
use crate::effects::EffectId;
use crate::identify::{IdentifyError, Parameter};
use crate::measure::{Dataset, FreePosesRequest, Margins, Measured, Sample, SampleSet, free_poses};
use crate::robot::{Axis6, Robot, Surroundings, world_from_tool};

/// Poses when none are named.
pub const WORKSPACE_POSES: usize = 300;

/// Nothing else is random here; the same data give the same numbers.
pub(super) const SEED: u64 = 0x0ca1_1be0;

/// Position error expected at one pose.
#[derive(Debug, Clone, PartialEq)]
pub struct ExpectedError {
    /// Joint angles, rad (N).
    pub q: Vec<f64>,
    /// TCP in the world, m.
    pub tcp: Vector3<f64>,
    /// Distance of the TCP from axis 1, m.
    pub radius: f64,
    /// Height of the TCP over the base, along axis 1, m.
    pub height: f64,
    /// Expected length of the error, m.
    pub error: f64,
}

/// A number with the spread of its draws.
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

/// Predicted position error of a calibration over the workspace.
#[derive(Debug, Clone, PartialEq)]
pub struct WorkspaceError {
    /// Mean over the poses, m.
    pub mean: Banded,
    /// Largest of the poses, m.
    pub max: Banded,
    /// Mean over the poses inside the joint ranges of the fit, and a tenth of them beyond, m; `None` where no pose is.
    pub ranges_seen: Option<Banded>,
    /// Mean over the others, where nothing was measured, m.
    pub elsewhere: Option<Banded>,
    /// Pose by pose.
    pub poses: Vec<ExpectedError>,
    /// One-sigma of the instrument's noise per axis, m: who measures the error sees it as well. Zero where it is not known.
    pub noise: f64,
}

impl WorkspaceError {
    /// The mean that an instrument would measure, its own noise in it, m.
    pub fn mean_as_measured(&self) -> f64 {
        self.mean.expected.hypot(MEAN_LENGTH * self.noise)
    }
}

/// Poses spread over the workspace of a robot: uniform in its joints, clear of itself (rad, N).
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

/// Where the poses of a prediction come from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PoseSource {
    /// The rows of set `validation`: what the robot is to be judged on.
    Validation,
    /// Drawn: uniform in the joint limits, clear of itself.
    Drawn,
}

/// Poses at which an error is predicted.
#[derive(Debug, Clone, PartialEq)]
pub struct WorkspacePoses {
    /// Joint angles, rad (N).
    pub q: Vec<Vec<f64>>,
    /// Where they come from.
    pub source: PoseSource,
}

impl WorkspacePoses {
    /// The poses of the datasets' validation rows; where there are none, [`workspace_poses`] of the first dataset.
    pub fn of(datasets: &[(&str, &Dataset)]) -> Self {
        let rows = datasets.iter().flat_map(|(_, d)| d.samples.iter().filter(|s| s.set == SampleSet::Validation));
        let judged: Vec<Vec<f64>> = rows.map(|s| s.q.clone()).collect();
        if !judged.is_empty() {
            return WorkspacePoses { q: judged, source: PoseSource::Validation };
        }
        let drawn = datasets.first().map(|(_, d)| workspace_poses(d, WORKSPACE_POSES));
        WorkspacePoses { q: drawn.unwrap_or_default(), source: PoseSource::Drawn }
    }
}

impl WorkspaceError {
    /// Predicts the error of the examined fit at joint angles `poses` (rad, N) of the first set-up, with its first payload, at the
    /// end of the session; `None` without poses, and where the data leave the set-up itself open ([`undetermined`]).
    ///
    /// # Errors
    /// When a matrix cannot be factored.
    pub fn predict(
        datasets: &[(&str, &Dataset)],
        examination: &Examination,
        poses: &[Vec<f64>],
    ) -> Result<Option<Self>, IdentifyError> {
        let Some((_, first)) = datasets.first().filter(|_| !poses.is_empty() && undetermined(examination).is_empty()) else {
            return Ok(None);
        };
        let mut random = ChaCha8Rng::seed_from_u64(SEED);
        let there = at_poses(first, examination, poses, &mut random);
        let posterior = Posterior::of(datasets, examination)?;
        let mut errors = posterior.errors(&there, examination, &mut random)?;
        rein_in(&mut errors);
        let level = Level::of(datasets, examination);
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
        let base_from_world = there.base.pose().inverse();
        let expected = |(p, q): (usize, &Vec<f64>)| {
            let tcp = world_from_tool(&there.robot, &there.base, &there.tool, q).translation.vector;
            let in_base = base_from_world * Point3::from(tcp);
            let (radius, height) = (in_base.x.hypot(in_base.y), in_base.z);
            ExpectedError { q: q.clone(), tcp, radius, height, error: sum[p] / errors.ncols() as f64 }
        };
        let poses = poses.iter().enumerate().map(expected).collect();
        Ok(Some(WorkspaceError {
            mean: Banded::of(means),
            max: Banded::of(maxima),
            ranges_seen,
            elsewhere,
            poses,
            noise: level.noise,
        }))
    }
}

/// Numbers of the first set-up's base and tool that these data do not tell, by name, though they know a place in the world: the position
/// error there cannot be predicted. Where no place is known, the base itself defines the world, and nothing is open.
pub fn undetermined(examination: &Examination) -> Vec<String> {
    let problem = examination.problem();
    let by_definition = problem.setups()[0].datum_freedoms.len() == Axis6::ALL.len();
    let frame = |p: &Parameter| matches!(EffectId::new(&p.effect).family(), "base_frame" | "tool_frame") && p.setup == Some(0);
    let left_out = examination.fit().unresolved.iter().map(|u| &problem.parameters()[u.parameter]);
    left_out.filter(|p| frame(p) && !(p.defines_world && by_definition)).map(|p| p.name.clone()).collect()
}

/// Share of a range by which a pose may lie beyond it and still be where the fit has seen the arm.
const MARGIN: f64 = 0.1;

/// Whether numbers lie in these ranges, or hardly outside.
fn inside(values: &[f64], ranges: &[[f64; 2]]) -> bool {
    let within = |(v, r): (&f64, &[f64; 2])| {
        let margin = MARGIN * (r[1] - r[0]);
        (r[0] - margin..=r[1] + margin).contains(v)
    };
    values.iter().zip(ranges).all(within)
}

/// Which poses are where the fit has seen the arm: inside the ranges of its joints, and of its TCP.
fn seen(examination: &Examination, there: &Dataset, poses: &[Vec<f64>]) -> Vec<bool> {
    let tcp = |q: &[f64]| world_from_tool(&there.robot, &there.base, &there.tool, q).translation.vector;
    let mut box_of_tcp = [[f64::INFINITY, f64::NEG_INFINITY]; 3];
    for at in &examination.circumstances {
        let place = tcp(&at.q);
        box_of_tcp.iter_mut().zip(place.iter()).for_each(|(r, &x)| *r = [r[0].min(x), r[1].max(x)]);
    }
    let ranges = examination.problem.joint_ranges();
    poses.iter().map(|q| inside(q, &ranges) && inside(tcp(q).as_slice(), &box_of_tcp)).collect()
}

/// A draw is held to so many times the median of all: the tail of some hundred draws is not known, and a mean must not hang on one of them.
const FURTHEST_DRAW: f64 = 3.0;

/// Holds draws that run away.
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

/// Holds the draws to what was measured where that says most: at poses like those of the campaign, the geometric mean of the draws and of
/// the error at postures left out. Where no place in the world is known the absolute error has no meaning, and what was measured alone
/// decides: at poses like those seen by postures left out, at others by whole places.
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
        // Predicted from one place less, a place errs by too much; by postures of the same places, by too little.
        hold(false, level.places_left_out.map_or(level.left_out, |places| (places * level.left_out).sqrt()), 1.0);
    } else {
        // Where most of what is left out is the instrument's noise, it says little of the robot.
        hold(true, level.left_out, 0.5 * level.share);
    }
}

/// Points measured at these poses by whoever measured the first set-up, at the end of the session, coming from any side.
pub(super) fn at_poses(dataset: &Dataset, examination: &Examination, poses: &[Vec<f64>], random: &mut ChaCha8Rng) -> Dataset {
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

/// How fitted parameters (SI) and candidates (in plausible sizes) move the TCP at each pose: 3 rows a pose, m. All that the fit absorbed of
/// the balls is in the parameters.
pub(super) fn fields(there: &Dataset, examination: &Examination) -> Result<DMatrix<f64>, IdentifyError> {
    Ok(AtNewPoses::of_the_arm(there, examination)?.fields())
}
