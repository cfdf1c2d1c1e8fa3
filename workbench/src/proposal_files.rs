//! Files of proposed measurements, in the formats that a cell accepts.

use std::path::{Path, PathBuf};

use calibench::files::FileError;
use calibench::files::disk::write_whole;
use calibench::measure::dataset::Dataset;
use calibench::measure::poses::ways::{WayRequest, WaysError, plan_ways};
use calibench::measure::poses::{PlannedPose, ProbingPlan, interleave, write_plan};
use calibench::planning::pool::CellLayout;
use calibench::planning::{Kind, Offer, Proposal};
use nalgebra::{Unit, Vector3};

/// Files of a proposal.
#[derive(Debug, Clone, Default)]
pub struct WrittenProposal {
    /// The files, in the order in which they were written.
    pub files: Vec<PathBuf>,
    /// Sentences: each file with its content, and what to beware of.
    pub words: Vec<String>,
}

/// Writes the plan of the best probing action with the artifact in its present place and, if tracker points are best of all, a
/// list of them. `reference` is the plan's reference to the robot; with the `layout`
/// of a known cell, and the direction in which the gauge leaves a ball, in the tool's axes, the plan holds its ways and omits
/// unreachable poses.
///
/// # Errors
/// When a file cannot be written.
pub fn write_proposal(
    path: &Path,
    proposal: &Proposal,
    reference: &str,
    layout: Option<(&CellLayout, Unit<Vector3<f64>>)>,
) -> Result<WrittenProposal, FileError> {
    let mut written = WrittenProposal::default();
    let on_balls = |o: &Offer| o.action.kind.is_probing() && !matches!(o.action.kind, Kind::MovedArtifact { .. });
    if let Some((offer, step)) = proposal.best(on_balls) {
        let poses = offer.action.poses(&offer.chosen[..step.count]);
        let cell = Dataset { robot_reference: reference.into(), ..offer.action.pool.dataset.clone() };
        // A pose and its repetition from the other side stay adjacent.
        let ordered = match offer.action.kind {
            Kind::OtherSide => poses,
            _ => interleave(&poses).into_iter().map(|k| poses[k].clone()).collect(),
        };
        let plan = with_ways(ordered, &cell, layout.filter(|(layout, _)| layout.is_known));
        write_plan(path, &plan, &cell)?;
        written.words.push(format!("{} {} planned in {}", plan.poses.len(), offer.action.words(), path.display()));
        written.files.push(path.to_owned());
        if plan.ways.is_none() {
            written.words.push(
                "the bodies in the cell are not known: the plan contains no ways, and its motions may touch something".into(),
            );
        }
    }
    if let Some((offer, step)) = proposal.best(|_| true)
        && offer.action.kind == Kind::Points
    {
        let beside = path.with_extension("points.csv");
        write_whole(&beside, points(offer, step.count).as_bytes())?;
        written.words.push(format!("{} {} listed in {}", step.count, offer.action.words(), beside.display()));
        written.files.push(beside);
    }
    Ok(written)
}

/// A plan of the poses reachable without collision, with their ways; of all poses, without ways, if the cell is unknown or no
/// pose is reachable.
fn with_ways(mut poses: Vec<PlannedPose>, cell: &Dataset, layout: Option<(&CellLayout, Unit<Vector3<f64>>)>) -> ProbingPlan {
    while let Some((layout, retreat)) = layout {
        let request = WayRequest::of(cell, &layout.surroundings, 1);
        match plan_ways(request, &layout.bodies, &-retreat, &mut poses) {
            Ok(ways) => return ProbingPlan { poses, ways: Some(ways) },
            Err(WaysError::Blocked(blocked)) if blocked.len() < poses.len() => {
                let is_blocked = |id: &String| blocked.iter().any(|b| b.pose == *id);
                poses.retain(|pose| !is_blocked(&pose.id) && !pose.reverses.as_ref().is_some_and(is_blocked));
            }
            Err(_) => break,
        }
    }
    ProbingPlan { poses, ways: None }
}

/// Points as rows of `samples.csv`, without the columns to be measured.
fn points(offer: &Offer, count: usize) -> String {
    let dataset = &offer.action.pool.dataset;
    let joints = dataset.robot.joint_columns();
    let mut text = format!("id,kind,payload,{}\n", joints.join(","));
    for (n, &k) in offer.chosen[..count].iter().enumerate() {
        let Some(sample) = offer.action.candidate(k) else { continue };
        let payload = dataset.payloads.get(sample.payload).map_or("", |p| p.name.as_str());
        let q: Vec<String> = dataset.robot.in_columns(&sample.q).iter().map(|v| format!("{v:.6}")).collect();
        text.push_str(&format!("n{:02},point,{payload},{}\n", n + 1, q.join(",")));
    }
    text
}
