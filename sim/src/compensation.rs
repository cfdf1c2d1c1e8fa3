//! Benefit of a calibration for the robot's user: the tool is sent to targets, first uncompensated, then compensated, by a
//! controller that knows only the nominal model; the true position of the tool is compared with the target.

use calibench::cell::ManipulatorError;
use calibench::compensate::conditions::Conditions;
use calibench::compensate::{Compensator, Desired, Target};
use calibench::identify::Prediction;
use calibench::measure::dataset::{Dataset, SampleSet};
use calibench::residuals::Validation;
use calibench::robot::kinematics::world_from_tool;
use nalgebra::Vector3;

use crate::planning::{Tour, TrackerPlan};
use crate::session::Session;
use crate::tracker::SimulatedTracker;

/// True position errors of targets, uncompensated and compensated: the same targets in both.
#[derive(Debug, Clone, PartialEq)]
pub struct Compensation {
    /// Targets that were refused, or for whose joints no collision-free path is known.
    pub refused: usize,
    /// Uncompensated, by the nominal model of robot and cell.
    pub before: Validation,
    /// Compensated.
    pub after: Validation,
}

/// The targets: the poses of the nominal robot and cell at the validation joints of a plan.
pub(crate) struct Targets<'a> {
    /// Robot and cell.
    pub cell: &'a Dataset,
    /// The plan.
    pub plan: &'a TrackerPlan,
    /// True positions reached at the validation joints (world, m), to which the uncompensated targets lead.
    pub uncompensated: &'a [Vector3<f64>],
}

/// Sends the tool to the targets. The compensator works in the world. Returns `None` when no target can be compensated.
///
/// # Errors
/// When the robot does not reach a target.
pub(crate) fn compensation(
    session: &Session<'_>,
    tracker: &SimulatedTracker,
    compensator: &mut Compensator<'_>,
    targets: &Targets<'_>,
) -> Result<Option<Compensation>, ManipulatorError> {
    let &Targets { cell, plan, uncompensated } = targets;
    let conditions = Conditions { temp_c: session.temperature_c(), ..Conditions::default() };
    let (mut desired, mut before, mut joints) = (Vec::new(), Vec::new(), Vec::new());
    let poses = &plan.validation.poses;
    for (q, went) in poses.iter().zip(uncompensated) {
        let pose = world_from_tool(&cell.robot, &cell.base, &cell.tool, q);
        let target = Target {
            id: String::new(),
            desired: Desired::Pose { pose, near: Some(q.clone()), status: None, turn: None },
            payload: None,
            conditions: conditions.clone(),
        };
        let Ok(fake) = compensator.compensate(&target).outcome else { continue };
        // The controller is commanded the pose, with status and turn, and finds the joints itself.
        let Ok(found) = compensator.controller_joints(&fake.pose, fake.status_turn, &fake.q) else { continue };
        joints.push(found);
        before.push(pose.translation.vector - went);
        desired.push(pose.translation.vector);
    }
    let tour = if plan.validation.has_no_ways {
        Tour::direct(joints)
    } else {
        // Near a singularity the joints of a compensated target differ from those of the target, and so does the path to them.
        let (tour, unreached) = session.tour_without_artifact(joints);
        for k in unreached.into_iter().rev() {
            desired.remove(k);
            before.remove(k);
        }
        tour
    };
    let refused = poses.len() - desired.len();
    let went = session.points(tracker, &tour, "c", SampleSet::Validation)?.truth;
    let after = desired.iter().zip(&went).map(|(desired, went)| desired - went).collect();
    let of = |residuals| {
        let prediction = Prediction {
            sample_ids: Vec::new(),
            residuals,
            orientations: Vec::new(),
            refitted: Vec::new(),
            from_fit_rows: Vec::new(),
        };
        Validation::of(&prediction)
    };
    Ok(of(before).zip(of(after)).map(|(before, after)| Compensation { refused, before, after }))
}
