//! From desired targets to the joints that reach them, and to the targets to be commanded.

use nalgebra::Vector3;

use super::calibrated_arm::CalibratedArm;
use super::conditions::Conditions;
use super::nominal_inverse::NominalInverse;
use super::own_bodies::OwnBodies;
use super::rigid::RigidRobot;
use super::task::Setup;
use super::uncertainty::Spread;
use super::{Refusal, Task, TaskError, Uncertainty, Warnings, WorkFrame};
use crate::effects::Needs;
use crate::identify::calibration::Calibration;
use crate::prediction::Extrapolation;
use crate::robot::inverse::{InverseKinematics, Outcome, StatusTurn, dexterity};
use crate::robot::kinematics::world_from_tool;
use crate::robot::statics::Payload;
use crate::robot::{FramePose, Pose};
use crate::units::DEG;

/// Tolerance for meeting a target with the identified arm, m and rad: a thousandth of an encoder step (docs/compensation.md).
const MET: [f64; 2] = [1e-9; 2];

/// Below this smallest singular value (m/rad, see [`dexterity`]) a target is near a singularity: for a KR 6 R700 |A5| of
/// some 6 deg (docs/compensation.md).
pub const NEAR_SINGULAR: f64 = 0.02;

/// Largest rotation of a joint from the nominal solution, rad, that identified deviations can cause; a larger one means a
/// change of configuration or a singularity (docs/compensation.md).
const LARGEST_TURN: f64 = 30.0 * DEG;

/// Smallest distance of a reachable TCP from the robot's root, as a share of the sum of its lengths.
const FOOT: f64 = 0.02;

/// The desired position of the TCP.
#[derive(Debug, Clone, PartialEq)]
pub enum Desired {
    /// Pose of the TCP in the frame of the targets.
    Pose {
        /// `work_from_tcp`.
        pose: Pose,
        /// Joints near which the solution is sought, rad (N); by default those of the previous target.
        near: Option<Vec<f64>>,
        /// KUKA's status, if prescribed.
        status: Option<u8>,
        /// KUKA's turn, if prescribed.
        turn: Option<u8>,
    },
    /// The TCP of the nominal robot at these joints, rad (N).
    Joints(Vec<f64>),
}

/// One target.
#[derive(Debug, Clone, PartialEq)]
pub struct Target {
    /// Unique name.
    pub id: String,
    /// The desired position of the TCP.
    pub desired: Desired,
    /// The payload on the flange; `None` for the one of the task.
    pub payload: Option<Payload>,
    /// The conditions at the target.
    pub conditions: Conditions,
}

/// The target to be commanded.
#[derive(Debug, Clone, PartialEq)]
pub struct Fake {
    /// `work_from_tcp` of the nominal model at the joints below.
    pub pose: Pose,
    /// Joints that bring the identified arm to the desired pose, rad (N).
    pub q: Vec<f64>,
    /// Status and turn of these joints, for arms that have them.
    pub status_turn: Option<StatusTurn>,
    /// Uncertainty of the compensated target.
    pub uncertainty: Uncertainty,
    /// Distance from the desired TCP to the fake one, m.
    pub shift: f64,
}

/// A target and the result of its compensation.
#[derive(Debug, Clone, PartialEq)]
pub struct Compensated {
    /// Desired `work_from_tcp`.
    pub desired: Pose,
    /// The target to be commanded, or the reason for refusal.
    pub outcome: Result<Fake, Refusal>,
    /// Warnings.
    pub warnings: Warnings,
}

impl Compensated {
    /// The predicted uncertainty; `None` for a refused target, and beyond the ranges in which joints were measured, where nothing
    /// is known of the error.
    pub fn uncertainty(&self) -> Option<&Uncertainty> {
        self.outcome.as_ref().ok().map(|fake| &fake.uncertainty).filter(|_| !self.warnings.out_of_range)
    }
}

/// Compensates targets one by one.
///
/// ```
/// use std::sync::Arc;
///
/// use calibench::compensate::conditions::Conditions;
/// use calibench::compensate::{Compensator, Desired, Target, Task};
/// use calibench::identify::{Model, identify};
/// use calibench::measure::dataset::{Dataset, Measured, NamedDataset, Noise, Sample};
/// use calibench::robot::kinematics::world_from_tool;
/// use calibench::robot::{FramePose, built_in};
/// use calibench::units::{MM, UM};
///
/// // An arm whose link 2 is half a millimetre too long, and its calibration.
/// let nominal = built_in("kr6_r700").ok_or("built in")?;
/// let mut arm = nominal.clone();
/// arm.links[2].mdh.a += 0.5 * MM;
/// let (base, tool) = (FramePose::default(), FramePose { xyz: [0.06, 0.01, -0.125], rz_ry_rx: [0.0; 3] });
/// let sample = |k: usize| {
///     let q: Vec<f64> = (1..=6).map(|i| 3.0 * ((k * i) as f64 * 0.618).fract() - 1.5).collect();
///     let seen = world_from_tool(&arm, &base, &tool, &q).translation.vector;
///     Sample::new(format!("p{k}"), q, Measured::Point(seen))
/// };
/// let noise = Noise { point: Some(20.0 * UM), ..Noise::default() };
/// let (robot, samples) = (Arc::new(nominal), (0..80).map(sample).collect());
/// let data = Dataset { robot, base, tool, noise, samples, ..Dataset::default() };
/// let calibration = identify(&[NamedDataset::new("campaign", &data)], &Model::of(&["base_frame", "mdh"]))?;
///
/// // At the compensated joints the arm reaches the nominal pose of the target.
/// let mut compensator = Compensator::new(&calibration, &Task::default())?;
/// let joints = vec![0.3, -1.2, 1.6, 0.3, 0.8, 0.5];
/// let desired = Desired::Joints(joints);
/// let target = Target { id: "t1".into(), desired, payload: None, conditions: Conditions::default() };
/// let compensated = compensator.compensate(&target);
/// let fake = compensated.outcome?;
/// let stands = world_from_tool(&arm, &base, &tool, &fake.q).translation.vector;
/// assert!((stands - compensated.desired.translation.vector).norm() < fake.uncertainty.three_d);
/// assert!(fake.shift > 0.3 * MM);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct Compensator<'a> {
    calibration: &'a Calibration,
    task: Task,
    arm: CalibratedArm<'a>,
    payload: Payload,
    payloads: &'a [Payload],
    inverse: NominalInverse<'a>,
    solver: InverseKinematics,
    spread: Spread,
    bodies: OwnBodies,
    /// KUKA's `$BASE`.
    root_from_work: Pose,
    world_from_root: Pose,
    /// Joints of the previous target.
    near: Vec<f64>,
}

impl<'a> Compensator<'a> {
    /// Creates a compensator for a task.
    ///
    /// # Errors
    /// When the calibration is not suitable for it.
    pub fn new(calibration: &'a Calibration, task: &Task) -> Result<Self, TaskError> {
        let setup = Setup::of(calibration, task)?;
        let arm = CalibratedArm::new(calibration, &setup)?;
        let world_from_root = arm.world_from_root();
        let root_from_work = match task.frame {
            WorkFrame::World => world_from_root.inverse(),
            WorkFrame::Base(base) => calibration.robot.root.inverse().then(&base).pose(),
        };
        let bodies = OwnBodies::of(&calibration.robot, arm.tool());
        let mut solver = InverseKinematics::new(calibration.robot.joints());
        solver.tolerance = MET;
        Ok(Compensator {
            calibration,
            task: task.clone(),
            payload: setup.payload,
            payloads: &setup.measured.payloads,
            arm,
            inverse: NominalInverse::new(&calibration.robot),
            solver,
            spread: Spread::of(calibration),
            bodies,
            root_from_work,
            world_from_root,
            near: calibration.joint_ranges.iter().map(|[low, high]| 0.5 * (low + high)).collect(),
        })
    }

    /// The same task with another tool on the flange or another base on the base link, where these are given.
    ///
    /// # Errors
    /// Those of [`Compensator::new`].
    pub fn in_frames(&self, tool: Option<FramePose>, base: Option<FramePose>) -> Result<Self, TaskError> {
        let frame = base.map_or(self.task.frame, WorkFrame::Base);
        let task = Task { tool: tool.or(self.task.tool), frame, ..self.task.clone() };
        let mut other = Compensator::new(self.calibration, &task)?;
        other.near.clone_from(&self.near);
        Ok(other)
    }

    /// The calibration.
    pub fn calibration(&self) -> &'a Calibration {
        self.calibration
    }

    /// The identified arm.
    pub fn arm(&self) -> &CalibratedArm<'a> {
        &self.arm
    }

    /// The payload on the flange unless a target states another.
    pub fn payload(&self) -> &Payload {
        &self.payload
    }

    /// Payloads of the set-up, which a target may name.
    pub fn payloads(&self) -> &'a [Payload] {
        self.payloads
    }

    /// KUKA's `$BASE`: the frame of the targets relative to the robot's base link, as to be set in the controller.
    pub fn base_link_from_work(&self) -> Pose {
        self.calibration.robot.root.pose() * self.root_from_work
    }

    /// KUKA's `$TOOL`: the TCP on the manufacturer's flange, as to be set in the controller.
    pub fn flange_from_tool(&self) -> Pose {
        super::flange::flange_frame(&self.calibration.robot).pose().inverse() * self.arm.tool().pose()
    }

    /// Nominal TCP at joints `q` (rad, N), in the frame of the targets: the pose the controller assumes.
    pub fn nominal_pose(&self, q: &[f64]) -> Pose {
        self.root_from_work.inverse() * world_from_tool(&self.calibration.robot, &FramePose::default(), self.arm.tool(), q)
    }

    /// The joints that the controller computes for a pose in the frame of the targets.
    ///
    /// # Errors
    /// When there are none.
    pub fn controller_joints(
        &mut self,
        pose: &Pose,
        status_turn: Option<StatusTurn>,
        near: &[f64],
    ) -> Result<Vec<f64>, Refusal> {
        let (status, turn) = (status_turn.map(|s| s.status), status_turn.map(|s| s.turn));
        let root_from_last = self.root_from_work * pose * self.arm.tool().pose().inverse();
        self.inverse.joints(&root_from_last, status, turn, near)
    }

    /// Every set of nominal joints (rad) inside the limits that reaches a pose in the frame of the targets; `None` for arms
    /// without a spherical wrist.
    pub fn nominal_postures(&self, pose: &Pose) -> Option<Vec<[f64; 6]>> {
        let root_from_last = self.root_from_work * pose * self.arm.tool().pose().inverse();
        let mut postures = Vec::new();
        self.inverse.wrist()?.solutions(&root_from_last, 0.0, |q| postures.push(*q));
        Some(postures)
    }

    /// The sides of a posture that KUKA's status distinguishes, each negative where its bit is set (m, rad, rad).
    pub fn status_sides(&self, q: &[f64; 6]) -> Option<[f64; 3]> {
        let [reach, elbow, five] = self.inverse.wrist()?.bends(q);
        Some([reach, -elbow, five])
    }

    /// Joints (rad, N) near which the next pose is sought.
    pub fn near(&self) -> &[f64] {
        &self.near
    }

    /// Has the next pose sought near these joints (rad, N).
    pub fn seek_near(&mut self, q: &[f64]) {
        q.clone_into(&mut self.near);
    }

    /// The part of the identified arm that is a rigid chain of links, and the size of the rest under the task's payload.
    pub fn rigid(&mut self) -> RigidRobot {
        self.arm.payload.clone_from(&self.payload);
        self.arm.conditions = Conditions::default();
        RigidRobot::of(&mut self.arm)
    }

    /// Assumptions made if these targets do not state the conditions, one sentence each.
    pub fn assumptions(&self, targets: &[Target]) -> Vec<String> {
        let mut sentences = Vec::new();
        let joints = self.calibration.robot.joints();
        if joints < 6 {
            sentences.push(format!("with {joints} joints the arm meets positions, and orientations as nearly as it can"));
        }
        let carried = |p: &Payload| format!("'{}' ({:.2} kg)", p.name, p.mass);
        if targets.iter().any(|t| t.payload.is_none()) {
            sentences.push(format!("the flange carries {}", carried(&self.payload)));
        }
        let needing = |need: Needs| {
            let ids: Vec<&str> = self.arm.needs().filter(|(_, needs)| needs.contains(&need)).map(|(id, _)| id).collect();
            (!ids.is_empty()).then(|| ids.join(", "))
        };
        let unsaid = |said: fn(&Conditions) -> bool| targets.iter().any(|t| !said(&t.conditions));
        if let Some(ids) = needing(Needs::Time).filter(|_| unsaid(|c| c.time_s.is_some())) {
            sentences.push(format!("the robot is as it was at the end of the measured session ({ids})"));
        }
        if let Some(ids) = needing(Needs::Approach).filter(|_| unsaid(|c| c.approach.is_some())) {
            sentences.push(format!("every joint is midway between its positions approached from either side ({ids})"));
        }
        if let Some(ids) = needing(Needs::Commanded) {
            sentences.push(format!("the joints are at the commanded angles ({ids})"));
        }
        if let Some(ids) = needing(Needs::Torques).filter(|_| self.calibration.model.measured_torques) {
            sentences.push(format!("torques are those of the link masses, not measured ones ({ids})"));
        }
        sentences
    }

    /// True if every target is a pose within the robot's foot, where no arm can work: probably a wrong unit.
    pub fn all_in_the_foot(&self, targets: &[Target]) -> bool {
        let links = self.calibration.robot.links.iter();
        let foot = FOOT * links.map(|l| l.mdh.a.abs() + l.mdh.d.abs()).sum::<f64>();
        let is_in = |t: &Target| match &t.desired {
            Desired::Pose { pose, .. } => (self.root_from_work * pose).translation.vector.norm() < foot,
            Desired::Joints(_) => false,
        };
        !targets.is_empty() && targets.iter().all(is_in)
    }

    /// Compensates a target.
    pub fn compensate(&mut self, target: &Target) -> Compensated {
        let robot = self.arm.robot();
        let (desired, nominal) = match &target.desired {
            Desired::Joints(q) => {
                let outside = robot.outside_limits(q, 0.0).map(|joint| Refusal::JointLimit { joint: Some(joint) });
                (self.nominal_pose(q), outside.map_or_else(|| Ok(q.clone()), Err))
            }
            Desired::Pose { pose, near, status, turn } => {
                let root_from_last = self.root_from_work * pose * self.arm.tool().pose().inverse();
                (*pose, self.inverse.joints(&root_from_last, *status, *turn, near.as_ref().unwrap_or(&self.near)))
            }
        };
        self.arm.payload.clone_from(target.payload.as_ref().unwrap_or(&self.payload));
        self.arm.conditions.clone_from(&target.conditions);
        let mut warnings = Warnings::default();
        let outcome = nominal.and_then(|nominal| self.reach(&desired, &nominal)).map(|q| {
            let n = robot.joints();
            let ranges = Extrapolation::of(
                &self.calibration.robot,
                &self.calibration.joint_ranges,
                &self.calibration.model,
                std::iter::once(&q[..]),
            );
            warnings =
                Warnings { out_of_range: ranges.outside > 0, near_singular: dexterity(self.arm.posture(), n) < NEAR_SINGULAR };
            let pose = self.nominal_pose(&q);
            let shift: Vector3<f64> = pose.translation.vector - desired.translation.vector;
            self.near.clone_from(&q);
            Fake { pose, status_turn: self.status_turn(&q), uncertainty: self.spread.at(&self.arm), shift: shift.norm(), q }
        });
        Compensated { desired, outcome, warnings }
    }

    /// The joints at which the identified arm meets `desired` (in the frame of the targets), sought from the nominal ones;
    /// the arm is left posed there.
    fn reach(&mut self, desired: &Pose, nominal: &[f64]) -> Result<Vec<f64>, Refusal> {
        let robot = self.arm.robot();
        let world_from_desired = self.world_from_root * self.root_from_work * desired;
        let found = self.solver.solve(&mut self.arm, &world_from_desired, nominal, |i| robot.links[i].limits);
        self.arm.settle(&found.q);
        if let Some(effect) = self.arm.undefined() {
            return Err(Refusal::NoValue { effect: effect.into() });
        }
        match found.outcome {
            Outcome::Converged => {}
            Outcome::JointLimit(joint) => return Err(Refusal::JointLimit { joint: Some(joint) }),
            Outcome::Unreachable => return Err(Refusal::Unreachable),
            Outcome::NotConverged => return Err(Refusal::NotConverged),
        }
        let status = |q: &[f64]| self.status_turn(q).map(|s| s.status);
        let turned = found.q.iter().zip(nominal).any(|(a, b)| (a - b).abs() > LARGEST_TURN);
        if turned || status(&found.q) != status(nominal) {
            return Err(Refusal::ConfigurationFlip);
        }
        match self.bodies.holds_tcp(self.arm.posture()) {
            Some(body) => Err(Refusal::OwnBody { body }),
            None => Ok(found.q),
        }
    }

    /// Status and turn of joints, for arms that have them.
    pub fn status_turn(&self, q: &[f64]) -> Option<StatusTurn> {
        Some(StatusTurn::of(self.inverse.wrist()?, q.try_into().ok()?))
    }
}
