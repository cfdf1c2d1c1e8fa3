//! Poses for distance measurements: postures spread over the free workspace, chosen by observability.

use calibench::measure::dataset::{Dataset, Measured, Sample};
use calibench::measure::poses::free_poses::{FreePosesRequest, free_poses};
use calibench::measure::poses::selection::{Quota, Request, select};
use calibench::planning::pool::CellLayout;
use calibench::robot::kinematics::{Posture, world_from_tool};
use calibench::robot::rel_tool::{RelTool, RelToolError};
use calibench::robot::sites::SiteIndex;
use calibench::robot::solids::ClearanceCheck;
use calibench::units::MM;
use nalgebra::Vector3;

use crate::planning::{PlanError, PoolDesign, layout};
use crate::rival::Distances;
use crate::scenario::{InstrumentKind, Scenario};

/// Number of free postures considered for wires.
const POOL: usize = 2000;
/// Number of free postures considered for a bar: one in ten is near its sphere.
const POOL_OF_A_BAR: usize = 10_000;
/// A tool within this distance of the sphere of a bar is brought onto it, m.
const NEAR: f64 = 80.0 * MM;
/// The motion is divided into pieces no longer than this, m: each takes a few Newton steps.
const PIECE: f64 = 10.0 * MM;

/// Joints (rad) at which the distances of a scenario are measured, ordered by the anchor (its index) that each is chosen for;
/// empty if its instrument meets balls.
///
/// # Errors
/// When there are too few free postures, or they do not determine the model.
pub fn rival_poses(scenario: &Scenario, seed: u64) -> Result<Vec<(usize, Vec<f64>)>, PlanError> {
    let spec = &scenario.instrument;
    if !spec.kind.measures_distances() {
        return Ok(Vec::new());
    }
    let cell = Dataset { anchors: Distances::known_anchors(spec), ..scenario.dataset() };
    let layout = layout(scenario);
    let free = free_poses(&FreePosesRequest {
        robot: &cell.robot,
        base: &cell.base,
        tool: &cell.tool,
        surroundings: &layout.without_artifact,
        margins: layout.margins,
        facing: None,
        count: if spec.kind == InstrumentKind::Ballbar { POOL_OF_A_BAR } else { POOL },
        // Different postures from those used for validation.
        seed: seed ^ 0x5249_5641_4c53,
    })?;
    let pool = match spec.kind {
        InstrumentKind::Ballbar => on_spheres(&cell, &layout, &free, spec.length_mm * MM),
        // Wires are all read at once: treated as a point, although each sees only its line of sight.
        _ => free.into_iter().map(|q| (0, q)).collect(),
    };
    let at = |q: &[f64]| world_from_tool(&cell.robot, &cell.base, &cell.tool, q).translation.vector;
    let measured = |anchor: usize, q: &[f64]| match spec.kind {
        InstrumentKind::Ballbar => Measured::Distance { anchor, distance: (at(q) - cell.anchors[anchor].position).norm() },
        _ => Measured::Point(at(q)),
    };
    let samples: Vec<Sample> =
        pool.iter().enumerate().map(|(k, (anchor, q))| Sample::new(k.to_string(), q.clone(), measured(*anchor, q))).collect();
    if samples.is_empty() {
        return Err(PlanError::TooFewFree { found: 0, wanted: spec.poses });
    }
    let design = PoolDesign::new(&cell, samples, vec![0; pool.len()], &scenario.model)?;
    let request = Request { starts: scenario.plan.starts, seed, ..Request::new(Quota::Free(spec.poses)) };
    let mut chosen: Vec<(usize, Vec<f64>)> =
        select(design.candidates(), &request)?.poses.into_iter().map(|p| pool[p].clone()).collect();
    // Stable sort: a bar is moved from anchor to anchor once.
    chosen.sort_by_key(|(anchor, _)| *anchor);
    Ok(chosen)
}

/// The postures near the sphere of a bar of this length (m) about each anchor, brought onto it.
fn on_spheres(cell: &Dataset, layout: &CellLayout, free: &[Vec<f64>], length: f64) -> Vec<(usize, Vec<f64>)> {
    let mut solver = RelTool::new(&cell.robot);
    let mut posture = Posture::new(&cell.robot);
    let mut clearance = ClearanceCheck::new(&cell.robot, &layout.without_artifact);
    let nominal = vec![0.0; SiteIndex::new(cell.robot.joints()).len()];
    let mut is_clear = |q: &[f64]| {
        posture.set(&cell.robot, &cell.base, &cell.tool, q, &nominal);
        clearance.is_clear(&posture, layout.margins.free, None)
    };
    let mut found = Vec::new();
    for (anchor, place) in cell.anchors.iter().enumerate() {
        for q in free {
            let pose = world_from_tool(&cell.robot, &cell.base, &cell.tool, q);
            let along = pose.translation.vector - place.position;
            let off = length - along.norm();
            if off.abs() > NEAR {
                continue;
            }
            let step = pose.rotation.inverse() * along.normalize() * off;
            let mut moved = q.clone();
            if slide(&mut solver, cell, &mut moved, &step).is_ok() && is_clear(&moved) {
                found.push((anchor, moved));
            }
        }
    }
    found
}

fn slide(solver: &mut RelTool, cell: &Dataset, q: &mut [f64], by: &Vector3<f64>) -> Result<(), RelToolError> {
    let pieces = (by.norm() / PIECE).ceil().max(1.0);
    (0..pieces as usize).try_for_each(|_| solver.shift(&cell.robot, &cell.base, &cell.tool, q, &(by / pieces)))
}
