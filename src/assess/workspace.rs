//! How wrong the present calibration is over the workspace, as far as the data and ordinary physics tell.
//!
//! A small residual on four balls is no evidence of a good model: what is missing hides in wrong parameters where it was measured and
//! comes out elsewhere. Every size of every candidate that the data allow is drawn, what the fit would have absorbed of it is taken
//! along, and both are carried to poses of the workspace.

use nalgebra::{DMatrix, DVector, Vector3};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::elsewhere::Elsewhere;
use super::examination::Examination;
use super::relevance::Relevance;
use crate::effects::Owner;
use crate::identify::IdentifyError;
use crate::measure::{Dataset, FreePosesRequest, Margins, Measured, Sample, SampleSet, free_poses};
use crate::robot::{Robot, Surroundings, world_from_tool};

/// Draws of what the robot may be.
const DRAWS: usize = 200;

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
    /// Expected length of the error, m.
    pub error: f64,
}

/// A number with the band that holds it in eight cases of ten.
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
    /// Pose by pose.
    pub poses: Vec<ExpectedError>,
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

impl WorkspaceError {
    /// Predicts the error of the examined fit at joint angles `poses` (rad, N) of the first set-up, with its first payload, at the
    /// end of the session; `None` without poses.
    ///
    /// # Errors
    /// When a matrix cannot be factored.
    pub fn predict(
        datasets: &[(&str, &Dataset)],
        examination: &Examination,
        relevance: &Relevance,
        poses: &[Vec<f64>],
    ) -> Result<Option<Self>, IdentifyError> {
        let Some((_, first)) = datasets.first().filter(|_| !poses.is_empty()) else { return Ok(None) };
        let mut random = ChaCha8Rng::seed_from_u64(SEED);
        let there = at_poses(first, examination, poses, &mut random);
        let fields = fields(&there, examination)?;
        let (m, n) = (examination.fitted.len(), examination.columns.len());
        let (fitted, candidates) = (fields.columns(0, m), fields.columns(m, n));
        let projection = &examination.projection;
        let absorbed = projection.absorbed(projection.of_columns.clone());
        let errors_of_fit = projection.root_of_covariance() * relevance.noise.sqrt();
        let mut normal = |count: usize| DMatrix::<f64>::from_fn(count, DRAWS, |_, _| StandardNormal.sample(&mut random));
        let (of_candidates, of_fit) = (normal(n), normal(m));
        let mut sizes = &relevance.root * of_candidates;
        sizes.column_iter_mut().for_each(|mut c| c += &relevance.mean);
        let parameters = errors_of_fit * of_fit - absorbed * &sizes;
        let errors = fitted * parameters + candidates * sizes;

        let count = poses.len();
        let mut sum = DVector::<f64>::zeros(count);
        let (mut means, mut maxima) = (Vec::with_capacity(DRAWS), Vec::with_capacity(DRAWS));
        for draw in errors.column_iter() {
            let lengths = DVector::from_fn(count, |p, _| draw.rows(3 * p, 3).norm());
            means.push(lengths.mean());
            maxima.push(lengths.max());
            sum += lengths;
        }
        let expected = |(p, q): (usize, &Vec<f64>)| ExpectedError {
            q: q.clone(),
            tcp: world_from_tool(&there.robot, &there.base, &there.tool, q).translation.vector,
            error: sum[p] / DRAWS as f64,
        };
        let poses = poses.iter().enumerate().map(expected).collect();
        Ok(Some(WorkspaceError { mean: Banded::of(means), max: Banded::of(maxima), poses }))
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
    let time_s =
        taken().filter_map(|s| s.time_s).fold(None, |a: Option<f64>, t| Some(a.map_or(t, |a| a.max(t))));
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

/// How fitted parameters (SI) and candidates (in plausible sizes) move the TCP at each pose: 3 rows a pose, m. Balls stand nowhere but
/// where they were measured; all that the fit absorbed of them is in the parameters.
pub(super) fn fields(there: &Dataset, examination: &Examination) -> Result<DMatrix<f64>, IdentifyError> {
    Ok(Elsewhere::new(there, examination, |effect| effect.owner() != Owner::Artifact)?.fields())
}
