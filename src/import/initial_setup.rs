//! Where the robot stood, to begin with: a base and a tool in closed form, good enough for the identification to start from.

use nalgebra::Vector3;

use crate::measure::{Dataset, Measured, SampleSet};
use crate::robot::{FramePose, Pose, rigid_fit, world_from_tool};

/// Rounds of fitting the base to the tool and the tool to the base.
const ROUNDS: usize = 200;
/// When the tool has come to rest, m.
const AT_REST: f64 = 1e-7;

/// Flange poses in the robot's own frame.
pub(super) fn flanges<'a>(dataset: &'a Dataset) -> impl Iterator<Item = Pose> + 'a {
    let origin = FramePose::default();
    dataset.samples.iter().map(move |s| world_from_tool(&dataset.robot, &origin, &origin, &s.q))
}

/// Fits the base, and the tool where it is free, to the rows to be fitted of the first session that lie at known places.
///
/// Leaves the dataset as it is when there are too few of them, or they lie on a line.
pub(super) fn fit_base_and_tool(dataset: &mut Dataset) {
    let session = dataset.samples.first().and_then(|s| s.session.clone());
    let mut pairs: Vec<(Pose, Vector3<f64>)> = Vec::new();
    for (sample, flange) in dataset.samples.iter().zip(flanges(dataset)) {
        let place = match &sample.measured {
            Measured::Point(point) => Some(*point),
            Measured::Ball { ball, .. } => Some(&dataset.balls[*ball]).filter(|b| !b.free).map(|b| b.position),
            Measured::Distance { .. } => None,
        };
        if let Some(place) = place
            && sample.session == session
            && sample.set == SampleSet::Fit
        {
            pairs.push((flange, place));
        }
    }
    let mut tool = Vector3::from(dataset.tool.xyz);
    for _ in 0..ROUNDS {
        let points: Vec<_> = pairs
            .iter()
            .map(|(flange, place)| (flange * nalgebra::Point3::from(tool), place))
            .map(|(p, m)| (p.coords, *m))
            .collect();
        let Some(base) = rigid_fit(&points) else { return };
        dataset.base = FramePose::from_pose(&base);
        if !dataset.tool_free {
            return;
        }
        let seen = |(flange, place): &(Pose, Vector3<f64>)| {
            (base * flange).inverse_transform_point(&nalgebra::Point3::from(*place)).coords
        };
        let next = pairs.iter().map(seen).sum::<Vector3<f64>>() / pairs.len() as f64;
        let step = (next - tool).norm();
        tool = next;
        dataset.tool.xyz = tool.into();
        if step < AT_REST {
            return;
        }
    }
}
