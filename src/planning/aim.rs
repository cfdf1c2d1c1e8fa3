//! Where a ball will be met: the first probings of a campaign identify the robot roughly, and the next ones begin where that
//! robot stands on the ball (docs/decisions/0057).
//!
//! A robot that is not calibrated yet meets a ball several millimetres off its centre, and beyond the flat of a plunger's tip
//! it does not meet it at all.

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::compensate::conditions::Conditions;
use crate::compensate::{Compensator, Desired, Target, Task, WorkFrame};
use crate::effects::EffectId;
use crate::identify::calibration::Calibration;
use crate::identify::fleet::FleetPrior;
use crate::identify::{Model, identify_without_indices};
use crate::measure::campaign::Aim;
use crate::measure::dataset::{Dataset, NamedDataset, Sample};
use crate::measure::poses::PlannedPose;
use crate::measure::poses::ways::{CENTRING_TURN, WAY_MARGIN};
use crate::robot::kinematics::world_from_tool;

/// Probings after each of which the robot is identified; later it is whenever their number has doubled. 8: two on each ball of
/// the paper's artifact, after which little is left to be aimed.
const EACH: usize = 8;

/// One sigma of the pose of the base, in plausible sizes: with it, and with those of the arm's own errors, a single probing is
/// enough for a fit. 3: millimetres, as installers measure.
const BASE_WIDTH: f64 = 3.0;

/// Largest distance from the planned contact, m: what a way allows for. The motion onto the ball remains one of those that a
/// centring itself makes.
const FURTHEST: f64 = WAY_MARGIN;

/// Aims the contacts of a plan by what its first probings say of the robot.
#[derive(Debug, Clone)]
pub struct FirstContacts {
    /// The cell, with the samples so far.
    so_far: Dataset,
    model: Model,
    poses: Vec<PlannedPose>,
    /// Number of samples at which the robot is identified next.
    next: usize,
    /// Joints of each aimed contact, rad (N), by the pose's name.
    contacts: BTreeMap<String, Vec<f64>>,
}

impl FirstContacts {
    /// For the `poses` of a cell, whose samples are ignored.
    pub fn new(cell: &Dataset, poses: &[PlannedPose]) -> Self {
        let mut model = Model { fleet: Some(Arc::new(FleetPrior::catalogue())), ..Model::default_for(cell) };
        model.width.insert(EffectId::BASE_FRAME.into(), BASE_WIDTH);
        let so_far = Dataset { samples: Vec::new(), ..cell.clone() };
        FirstContacts { so_far, model, poses: poses.to_vec(), next: 1, contacts: BTreeMap::new() }
    }

    /// Aims at every ball with the robot as the samples so far identify it; what cannot be aimed remains as planned.
    fn identify(&mut self) {
        let calibration = identify_without_indices(&[NamedDataset::new("campaign", &self.so_far)], &self.model);
        self.contacts = calibration.map_or_else(|_| BTreeMap::new(), |calibration| self.aimed(&calibration));
    }

    fn aimed(&self, calibration: &Calibration) -> BTreeMap<String, Vec<f64>> {
        let Dataset { robot, base, tool, payloads, samples, .. } = &self.so_far;
        let task = Task { frame: WorkFrame::World, ..Task::default() };
        let Ok(mut compensator) = Compensator::new(calibration, &task) else { return BTreeMap::new() };
        let measured = |pose: &PlannedPose| samples.iter().any(|s| s.id == pose.id);
        let mut aim = |pose: &PlannedPose| {
            let payload = payloads.get(pose.payload).cloned();
            let there = world_from_tool(robot, base, tool, &pose.contact);
            let desired = Desired::Pose { pose: there, near: Some(pose.contact.clone()), status: None, turn: None };
            let target = Target { id: pose.id.clone(), desired, payload, conditions: Conditions::default() };
            let found = compensator.compensate(&target).outcome.ok()?;
            let shift = world_from_tool(robot, base, tool, &found.q).translation.vector - there.translation.vector;
            let turn = found.q.iter().zip(&pose.contact).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            let is_near = shift.norm() < FURTHEST && turn < CENTRING_TURN;
            is_near.then(|| (pose.id.clone(), found.q))
        };
        self.poses.iter().filter(|pose| pose.ball.is_some() && !measured(pose)).filter_map(&mut aim).collect()
    }
}

impl Aim for FirstContacts {
    fn learn(&mut self, sample: &Sample) {
        self.so_far.samples.push(sample.clone());
        if self.so_far.samples.len() == self.next {
            self.next = if self.next < EACH { self.next + 1 } else { 2 * self.next };
            self.identify();
        }
    }

    fn contact(&self, pose: &PlannedPose) -> Option<Vec<f64>> {
        self.contacts.get(&pose.id).cloned()
    }
}
