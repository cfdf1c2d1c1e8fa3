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
use crate::measure::poses::ways::{CENTRING_TURN, WAY_MARGIN, turn};
use crate::robot::kinematics::world_from_tool;
use crate::units::UM;

/// Probings after each of which the robot is identified; later it is whenever their number has doubled. 8, a power of two: two on
/// each ball of the paper's artifact, after which little is left to be aimed.
const EACH: usize = 8;

/// One sigma of the pose of the base, in plausible sizes: with it, and with those of the arm's own errors, a single probing is
/// enough for a fit. 3: millimetres, as installers measure.
const BASE_WIDTH: f64 = 3.0;

/// Noise of a centring that is not stated, m, 1 sigma per axis. 10 um: from a few samples none can be estimated, and the fit
/// is held by other sizes.
const NOISE: f64 = 10.0 * UM;

/// Largest distance from the planned contact, m: what a way allows for. The motion onto the ball remains one of those that a
/// centring itself makes.
pub const FURTHEST: f64 = WAY_MARGIN;

/// Aims the contacts of a plan by what its first probings say of the robot.
#[derive(Debug, Clone)]
pub struct FirstContacts {
    /// The cell, with the samples so far.
    so_far: Dataset,
    model: Model,
    poses: Vec<PlannedPose>,
    /// Joints of each aimed contact, rad (N), by the pose's name.
    contacts: BTreeMap<String, Vec<f64>>,
}

impl FirstContacts {
    /// For the `poses` of a cell, whose samples are ignored.
    pub fn new(cell: &Dataset, poses: &[PlannedPose]) -> Self {
        let mut model = Model { fleet: Some(Arc::new(FleetPrior::catalogue())), ..Model::default_for(cell) };
        model.width.insert(EffectId::BASE_FRAME.into(), BASE_WIDTH);
        let mut so_far = Dataset { samples: Vec::new(), ..cell.clone() };
        so_far.noise.ball.get_or_insert(NOISE);
        FirstContacts { so_far, model, poses: poses.to_vec(), contacts: BTreeMap::new() }
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
            let is_near = shift.norm() < FURTHEST && turn(&found.q, &pose.contact) < CENTRING_TURN;
            is_near.then(|| (pose.id.clone(), found.q))
        };
        self.poses.iter().filter(|pose| pose.ball.is_some() && !measured(pose)).filter_map(&mut aim).collect()
    }
}

impl Aim for FirstContacts {
    fn learn(&mut self, sample: &Sample) {
        self.so_far.samples.push(sample.clone());
        let count = self.so_far.samples.len();
        if count <= EACH || count.is_power_of_two() {
            self.identify();
        }
    }

    fn contact(&self, pose: &PlannedPose) -> Option<Vec<f64>> {
        self.contacts.get(&pose.id).cloned()
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;
    use crate::measure::dataset::{Ball, Measured};
    use crate::robot::rel_tool::rel_tool;
    use crate::robot::{FramePose, built_in};

    /// A KR 6 with a ball at each of these postures.
    fn cell(postures: &[[f64; 6]]) -> (Dataset, Vec<PlannedPose>) {
        let robot = Arc::new(built_in("kr6_r700").unwrap());
        let (base, tool) = (FramePose::default(), FramePose { xyz: [0.06, 0.01, -0.125], rz_ry_rx: [0.0; 3] });
        let ball = |(k, q): (usize, &[f64; 6])| Ball {
            id: (k + 1).to_string(),
            position: world_from_tool(&robot, &base, &tool, q).translation.vector,
            sigma: 0.0,
            free: false,
        };
        let pose = |(k, q): (usize, &[f64; 6])| PlannedPose {
            id: format!("p{k}"),
            ball: Some(k),
            payload: 0,
            contact: q.to_vec(),
            approach: q.to_vec(),
            reserve: false,
            reverses: None,
            via: Vec::new(),
            clearance: None,
        };
        let (balls, poses) = (postures.iter().enumerate().map(ball).collect(), postures.iter().enumerate().map(pose).collect());
        (Dataset { robot, base, tool, balls, ..Dataset::default() }, poses)
    }

    /// The ball of a pose as centred by a robot whose encoders then say that the TCP is `off` it, along the axes of the tool.
    fn centred(cell: &Dataset, pose: &PlannedPose, off: Vector3<f64>) -> Sample {
        let q = rel_tool(&cell.robot, &cell.base, &cell.tool, &pose.contact, &off).unwrap();
        let ball = pose.ball.unwrap();
        Sample::new(&pose.id, q, Measured::Ball { ball, reading: Some(Vector3::zeros()) })
    }

    #[test]
    fn the_next_ball_is_met_where_the_last_was_and_a_far_one_as_planned() {
        let (cell, poses) = cell(&[[0.1, -1.3, 1.5, 0.2, 0.7, 0.1], [0.15, -1.2, 1.4, 0.2, 0.8, 0.1]]);
        let tcp = |q: &[f64]| world_from_tool(&cell.robot, &cell.base, &cell.tool, q).translation.vector;
        for (off, is_aimed) in [(3.0, true), (30.0, false)] {
            let mut aim = FirstContacts::new(&cell, &poses);
            assert_eq!(aim.contact(&poses[1]), None);
            let sample = centred(&cell, &poses[0], Vector3::new(0.0, off * 1e-3, 0.0));
            aim.learn(&sample);
            let contact = aim.contact(&poses[1]);
            assert_eq!(contact.is_some(), is_aimed, "{off} mm");
            let Some(contact) = contact else { continue };
            let [was, is] = [(&sample.q, &poses[0]), (&contact, &poses[1])].map(|(q, pose)| tcp(q) - tcp(&pose.contact));
            assert!((was - is).norm() < 0.7e-3, "{was} {is}");
        }
    }
}
