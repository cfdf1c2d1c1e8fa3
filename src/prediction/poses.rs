//! The poses at which an error is predicted, and what a campaign has seen of them.

use std::sync::Arc;

use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use crate::diagnosis::Examination;
use crate::effects::EffectId;
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
    /// Drawn uniformly in the ranges of the joints in the rows that are fitted, without self-collision.
    Ranges,
    /// Drawn uniformly in the joint limits, without self-collision.
    Limits,
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
    /// No poses: nothing is predicted.
    pub const NONE: WorkspacePoses = WorkspacePoses { q: Vec::new(), source: PoseSource::Limits };

    /// Returns the poses of the datasets' validation rows; if there are none, [`workspace_poses`] of the first dataset.
    pub fn of(datasets: &[NamedDataset<'_>]) -> Self {
        let rows = datasets.iter().flat_map(|d| d.dataset.samples.iter().filter(|s| s.set == SampleSet::Validation));
        let judged: Vec<Vec<f64>> = rows.map(|s| s.q.clone()).collect();
        if !judged.is_empty() {
            return WorkspacePoses { q: judged, source: PoseSource::Validation };
        }
        WorkspacePoses::over_limits(datasets)
    }

    /// Returns poses over the joint limits of the first dataset's robot.
    pub fn over_limits(datasets: &[NamedDataset<'_>]) -> Self {
        let drawn = datasets.first().map(|d| workspace_poses(d.dataset, WORKSPACE_POSES));
        WorkspacePoses { q: drawn.unwrap_or_default(), source: PoseSource::Limits }
    }

    /// Returns poses inside joint ranges (rad or m, one for each joint), in the cell of the first dataset.
    pub fn inside(datasets: &[NamedDataset<'_>], ranges: &[[f64; 2]]) -> Self {
        let drawn = datasets.first().map(|d| {
            let mut robot = Robot::clone(&d.dataset.robot);
            robot.links.iter_mut().zip(ranges).for_each(|(link, range)| link.limits = *range);
            workspace_poses(&Dataset { robot: Arc::new(robot), samples: Vec::new(), ..d.dataset.clone() }, WORKSPACE_POSES)
        });
        WorkspacePoses { q: drawn.unwrap_or_default(), source: PoseSource::Ranges }
    }
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
