//! From wanted targets to the joints that reach them, and to what the controller must be told.

use nalgebra::Vector3;

use super::own_bodies::OwnBodies;
use super::task::Setup;
use super::uncertainty::Spread;
use super::{CalibratedArm, Conditions, NominalInverse, RigidRobot, Task, TaskError, Uncertainty, WorkFrame};
use crate::assess::Extrapolation;
use crate::effects::Needs;
use crate::identify::Calibration;
use crate::robot::{FramePose, InverseKinematics, Outcome, Payload, Pose, StatusTurn, dexterity, world_from_tool};
use crate::units::DEG;

/// Targets are met by the identified arm to this, m and rad: a thousandth of what an encoder's step is worth.
const MET: [f64; 2] = [1e-9; 2];

/// Below this smallest singular value (m/rad, see [`dexterity`]) a target is near a singularity: on a KR 6 R700 |A5| of some 6 deg.
pub const NEAR_SINGULAR: f64 = 0.02;

/// No identified deviation turns a joint farther than this from the drawing's solution, rad: what does has changed its configuration, or
/// lies in a singularity.
const LARGEST_TURN: f64 = 30.0 * DEG;

/// So near to the root of the robot no TCP comes, as a share of the sum of its lengths.
const FOOT: f64 = 0.02;

/// Where the TCP is wanted.
#[derive(Debug, Clone, PartialEq)]
pub enum Wanted {
    /// Pose of the TCP in the frame of the targets.
    Pose {
        /// `work_from_tcp`.
        pose: Pose,
        /// Joints to be near to, rad (N); without them, near to those of the target before.
        near: Option<Vec<f64>>,
        /// KUKA's status, where it is prescribed.
        status: Option<u8>,
        /// KUKA's turn, where it is prescribed.
        turn: Option<u8>,
    },
    /// Where a robot made to the drawing would put the TCP at these joints, rad (N).
    Joints(Vec<f64>),
}

/// One target.
#[derive(Debug, Clone, PartialEq)]
pub struct Target {
    /// Unique name.
    pub id: String,
    /// Where the TCP is wanted.
    pub wanted: Wanted,
    /// What the flange carries; `None` for what the task says.
    pub payload: Option<Payload>,
    /// How it is reached.
    pub conditions: Conditions,
}

/// Why a target was not compensated.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum Refusal {
    /// No posture of the arm reaches it.
    #[error("no posture of the arm reaches it")]
    Unreachable,
    /// Postures that reach it do so beyond a joint's limit.
    #[error("it is reached only beyond the limit of {}", .joint.map_or("a joint".into(), |j| format!("joint {}", j + 1)))]
    JointLimit {
        /// The joint, counted from 0, where it is one.
        joint: Option<usize>,
    },
    /// It is reached, but not with the status and turn asked for.
    #[error("no posture inside the limits has the status and turn asked for")]
    NoSuchConfiguration,
    /// Compensated, the arm would be bent the other way, or a joint turned far round.
    #[error("compensated, the arm would stand in another configuration")]
    ConfigurationFlip,
    /// The search did not end.
    #[error("the search did not end")]
    NotConverged,
    /// It lies in the arm that would reach it.
    #[error("it lies in the robot's own body: {body}")]
    OwnBody {
        /// Which body.
        body: String,
    },
    /// An effect has no value there.
    #[error("effect '{effect}' has no value there")]
    NoValue {
        /// The effect.
        effect: String,
    },
}

impl Refusal {
    /// As in files.
    pub fn name(&self) -> &'static str {
        match self {
            Refusal::Unreachable => "unreachable",
            Refusal::JointLimit { .. } => "joint_limit",
            Refusal::NoSuchConfiguration => "no_such_configuration",
            Refusal::ConfigurationFlip => "configuration_flip",
            Refusal::NotConverged => "not_converged",
            Refusal::OwnBody { .. } => "own_body",
            Refusal::NoValue { .. } => "no_value",
        }
    }
}

/// What is to be minded at a target that was compensated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Warnings {
    /// A joint stands where the calibration has not seen it.
    pub out_of_range: bool,
    /// Small motions of the tool are large ones of the joints; the threshold is [`NEAR_SINGULAR`].
    pub near_singular: bool,
}

impl Warnings {
    /// As in files.
    pub fn names(self) -> impl Iterator<Item = &'static str> {
        let named = [(self.out_of_range, "out_of_range"), (self.near_singular, "near_singular")];
        named.into_iter().filter_map(|(is, name)| is.then_some(name))
    }
}

/// What the controller is told.
#[derive(Debug, Clone, PartialEq)]
pub struct Fake {
    /// `work_from_tcp` of the drawing at the joints below.
    pub pose: Pose,
    /// Joints at which the identified arm stands where it is wanted, rad (N).
    pub q: Vec<f64>,
    /// Status and turn of those, for arms that have them.
    pub status_turn: Option<StatusTurn>,
    /// How well the target is known to be met.
    pub uncertainty: Uncertainty,
    /// From the wanted TCP to the fake one, m.
    pub shift: f64,
}

/// A target and what became of it.
#[derive(Debug, Clone, PartialEq)]
pub struct Compensated {
    /// `work_from_tcp` as wanted.
    pub wanted: Pose,
    /// What to tell the controller, or why there is nothing to tell.
    pub outcome: Result<Fake, Refusal>,
    /// What is to be minded.
    pub warnings: Warnings,
}

/// Compensates targets, one after the other.
pub struct Compensator<'a> {
    calibration: &'a Calibration,
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
    /// Joints of the target before.
    near: Vec<f64>,
}

impl<'a> Compensator<'a> {
    /// For a task.
    ///
    /// # Errors
    /// When the calibration does not serve it.
    pub fn new(calibration: &'a Calibration, task: &Task) -> Result<Self, TaskError> {
        let setup = Setup::of(calibration, task)?;
        let arm = CalibratedArm::new(calibration, &setup)?;
        let world_from_root = arm.world_from_root();
        let root_from_work = match task.frame {
            WorkFrame::World => world_from_root.inverse(),
            WorkFrame::Base(base) => base.pose(),
        };
        let bodies = OwnBodies::of(&calibration.robot, arm.tool());
        let mut solver = InverseKinematics::new(calibration.robot.joints());
        solver.tolerance = MET;
        Ok(Compensator {
            calibration,
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

    /// The calibration.
    pub fn calibration(&self) -> &'a Calibration {
        self.calibration
    }

    /// The identified arm.
    pub fn arm(&self) -> &CalibratedArm<'a> {
        &self.arm
    }

    /// What the flange carries where a target does not say otherwise.
    pub fn payload(&self) -> &Payload {
        &self.payload
    }

    /// Payloads of the set-up, which a target may name.
    pub fn payloads(&self) -> &'a [Payload] {
        self.payloads
    }

    /// KUKA's `$BASE`: the frame of the targets on the robot's root, as the controller must have it.
    pub fn root_from_work(&self) -> &Pose {
        &self.root_from_work
    }

    /// KUKA's `$TOOL`: the TCP on the maker's flange, as the controller must have it.
    pub fn flange_from_tool(&self) -> Pose {
        super::flange_frame(&self.calibration.robot).pose().inverse() * self.arm.tool().pose()
    }

    /// Where the drawing puts the TCP at joints `q` (rad, N), in the frame of the targets: what the controller believes.
    pub fn drawn(&self, q: &[f64]) -> Pose {
        self.root_from_work.inverse() * world_from_tool(&self.calibration.robot, &FramePose::default(), self.arm.tool(), q)
    }

    /// The joints that the controller takes for a pose in the frame of the targets.
    ///
    /// # Errors
    /// When it has none.
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

    /// The part of the identified arm that is a plain chain of links, and the size of the rest under the task's payload.
    pub fn rigid(&mut self) -> RigidRobot {
        self.arm.payload.clone_from(&self.payload);
        self.arm.conditions = Conditions::default();
        RigidRobot::of(&mut self.arm)
    }

    /// What is taken for granted where these targets do not say it, a sentence each.
    pub fn assumptions(&self, targets: &[Target]) -> Vec<String> {
        let mut sentences = Vec::new();
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
            sentences.push(format!("every joint stands midway between what it does coming from either side ({ids})"));
        }
        if let Some(ids) = needing(Needs::Commanded) {
            sentences.push(format!("the joints go where they are told ({ids})"));
        }
        if let Some(ids) = needing(Needs::Torques).filter(|_| self.calibration.model.measured_torques) {
            sentences.push(format!("torques are those of the link masses, not measured ones ({ids})"));
        }
        sentences
    }

    /// Whether every target is a pose within the robot's foot, where no arm works: what lies there has another unit.
    pub fn all_in_the_foot(&self, targets: &[Target]) -> bool {
        let links = self.calibration.robot.links.iter();
        let foot = FOOT * links.map(|l| l.mdh.a.abs() + l.mdh.d.abs()).sum::<f64>();
        let is_in = |t: &Target| match &t.wanted {
            Wanted::Pose { pose, .. } => (self.root_from_work * pose).translation.vector.norm() < foot,
            Wanted::Joints(_) => false,
        };
        !targets.is_empty() && targets.iter().all(is_in)
    }

    /// Compensates a target.
    pub fn compensate(&mut self, target: &Target) -> Compensated {
        let robot = self.arm.robot();
        let (wanted, drawn) = match &target.wanted {
            Wanted::Joints(q) => {
                let outside = robot.outside_limits(q, 0.0).map(|joint| Refusal::JointLimit { joint: Some(joint) });
                (self.drawn(q), outside.map_or_else(|| Ok(q.clone()), Err))
            }
            Wanted::Pose { pose, near, status, turn } => {
                let root_from_last = self.root_from_work * pose * self.arm.tool().pose().inverse();
                (*pose, self.inverse.joints(&root_from_last, *status, *turn, near.as_ref().unwrap_or(&self.near)))
            }
        };
        self.arm.payload.clone_from(target.payload.as_ref().unwrap_or(&self.payload));
        self.arm.conditions.clone_from(&target.conditions);
        let mut warnings = Warnings::default();
        let outcome = drawn.and_then(|drawn| self.reach(&wanted, &drawn)).map(|q| {
            let n = robot.joints();
            let ranges = Extrapolation::of(&self.calibration.joint_ranges, &self.calibration.model, std::iter::once(&q[..]));
            warnings =
                Warnings { out_of_range: ranges.outside > 0, near_singular: dexterity(self.arm.posture(), n) < NEAR_SINGULAR };
            let pose = self.drawn(&q);
            let shift: Vector3<f64> = pose.translation.vector - wanted.translation.vector;
            self.near.clone_from(&q);
            Fake { pose, status_turn: self.status_turn(&q), uncertainty: self.spread.at(&self.arm), shift: shift.norm(), q }
        });
        Compensated { wanted, outcome, warnings }
    }

    /// The joints at which the identified arm meets `wanted` (in the frame of the targets), sought from those of the drawing; the arm is
    /// left standing there.
    fn reach(&mut self, wanted: &Pose, drawn: &[f64]) -> Result<Vec<f64>, Refusal> {
        let robot = self.arm.robot();
        let world_from_wanted = self.world_from_root * self.root_from_work * wanted;
        let found = self.solver.solve(&mut self.arm, &world_from_wanted, drawn, |i| robot.links[i].limits);
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
        let turned = found.q.iter().zip(drawn).any(|(a, b)| (a - b).abs() > LARGEST_TURN);
        if turned || status(&found.q) != status(drawn) {
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
