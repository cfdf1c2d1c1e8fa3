//! The true arm: injected errors of any size, in equilibrium with gravity and the force on its tool.

use calibench::effects::situation::{ArtifactShape, Kind, Situation};
use calibench::measure::dataset::Dataset;
use calibench::robot::kinematics::Posture;
use calibench::robot::sites::{MdhEntry, Site, SiteIndex};
use calibench::robot::statics::{Loads, Payload};
use calibench::robot::{FramePose, Pose, Robot};
use nalgebra::Vector3;

use crate::flaw::Flaws;
use crate::mechanics::{Parts, Stand};

/// The true arm on its true base with its true tool.
pub struct Arm {
    /// The robot with its true masses; geometry is nominal, deviations come from the flaws.
    robot: Robot,
    /// The cell as known to its owner.
    nominal: Dataset,
    artifact: ArtifactShape,
    /// True TCP in the last frame.
    tool: FramePose,
    /// Axes of the true tool in the last frame.
    tool_turned: Pose,
    /// True payload.
    pub payload: Payload,
    /// Its further flaws.
    flaws: Flaws,
    session_s: f64,
    posture: Posture,
    loads: Loads,
    deviations: Vec<f64>,
    /// Contributions of the flaws that are the same in every situation.
    fixed: Vec<f64>,
    /// Indices of the sites that the other flaws have moved since.
    moved: Vec<usize>,
    /// True if base, tool and links of the posture include those constant flaws alone.
    as_fixed: bool,
}

/// Interaction with the arm's tool at one moment.
#[derive(Debug, Clone, Copy, Default)]
pub struct Moment {
    /// Kind of measurement.
    pub kind: Option<Kind>,
    /// Reading remaining for the indicators: the ball's centre in the tool, m.
    pub reading: Option<Vector3<f64>>,
    /// Force on the tool at the TCP, world axes, N.
    pub force: Vector3<f64>,
}

impl Arm {
    /// The arm of a cell with these flaws, in a session of about `session_s` seconds.
    pub fn new(parts: &Parts, mut flaws: Flaws, session_s: f64) -> Self {
        let Parts { nominal, robot, tool, payload, .. } = parts.clone();
        let (posture, loads) = (Posture::new(&robot), Loads::new(robot.joints()));
        let balls: Vec<Vector3<f64>> = nominal.balls.iter().map(|b| b.position).collect();
        let artifact = ArtifactShape::of(&balls);
        let sites = SiteIndex::new(robot.joints());
        let mut fixed = vec![0.0; sites.len()];
        flaws.all.retain(|flaw| match flaw.constant() {
            Some(constant) => {
                constant.into_iter().for_each(|(site, by)| fixed[sites.of(site)] += by);
                false
            }
            None => true,
        });
        let tool_turned = FramePose { xyz: [0.0; 3], ..tool }.pose();
        Arm {
            robot,
            nominal,
            artifact,
            tool,
            tool_turned,
            payload,
            flaws,
            session_s,
            posture,
            loads,
            deviations: fixed.clone(),
            fixed,
            moved: Vec::new(),
            as_fixed: false,
        }
    }

    /// Moves the motors (rad, N); the arm takes its geometric posture, without deflection.
    pub fn move_motors(&mut self, motors: &[f64]) {
        self.undo_moves();
        self.stand(motors, true);
    }

    /// Resets the deviations to those of the constant flaws.
    fn undo_moves(&mut self) {
        for place in self.moved.drain(..) {
            self.deviations[place] = self.fixed[place];
        }
    }

    /// Moves the arm to `motors` (rad) with its deviations; `joints_only` states that, besides the constant flaws, only
    /// joints deviate.
    fn stand(&mut self, motors: &[f64], joints_only: bool) {
        if joints_only && self.as_fixed {
            self.posture.turn_to(&self.robot, motors, &self.deviations);
        } else {
            self.posture.set(&self.robot, &self.nominal.base, &self.tool, motors, &self.deviations);
            self.as_fixed = joints_only;
        }
    }

    /// Deflects the arm under the loads of its present posture; returns the motion of its TCP, m. Each call reduces that by
    /// the ratio of deflection to arm length, about 1e-3, until the static equilibrium is reached: loads are then those of
    /// the deflected arm.
    pub fn give_way(&mut self, stand: &Stand<'_>, moment: &Moment) -> f64 {
        let tcp = self.posture.tcp();
        self.loads.compute(&self.robot, &self.posture, &self.payload, &self.nominal.gravity, &moment.force);
        let joints_only = self.deviate(stand, moment);
        self.stand(stand.motors, joints_only);
        (self.posture.tcp() - tcp).norm()
    }

    /// World position of the TCP in the present posture, m.
    pub fn tcp(&self) -> Vector3<f64> {
        self.posture.tcp()
    }

    /// `world_from_tool` in the present posture.
    pub fn world_from_tool(&self) -> Pose {
        self.posture.world_from_turned(&self.tool_turned)
    }

    /// `world_from_frame` of the base and of every link, the base first (N + 1), in the present posture.
    pub fn frames(&self) -> Vec<Pose> {
        (0..=self.robot.joints()).map(|k| self.posture.frame(k).pose()).collect()
    }

    /// Displacement of the ball, or of the measured point, from its place, world, m, at the last deflection.
    pub fn target_moved(&self) -> Vector3<f64> {
        let sites = SiteIndex::new(self.robot.joints());
        Vector3::from_fn(|k, _| self.deviations[sites.of(Site::target(k))])
    }

    /// Computes the deviations of all sites in the present posture; returns true if, besides the constant flaws, only joints
    /// and the target deviate.
    fn deviate(&mut self, stand: &Stand<'_>, moment: &Moment) -> bool {
        self.undo_moves();
        let situation = Situation {
            gravity: self.nominal.gravity,
            tool: self.nominal.tool,
            compliance: &self.flaws.compliance,
            sample: stand.sample,
            kind: moment.kind,
            target: match moment.kind {
                Some(Kind::Ball(ball)) => self.nominal.balls.get(ball).map(|b| b.position),
                Some(Kind::Point) => Some(self.posture.tcp()),
                _ => None,
            },
            artifact: Some(self.artifact),
            reading: moment.reading,
            plungers: stand.plungers,
            q_commanded: Some(stand.commanded),
            approach: Some(stand.approach),
            time_s: Some(stand.time_s),
            duration_s: Some(self.session_s),
            temp_c: Some(stand.temp_c),
            ..Situation::at_rest(&self.robot, stand.motors, &self.posture, &self.loads, &self.payload)
        };
        let sites = SiteIndex::new(self.robot.joints());
        let Arm { deviations, moved, .. } = self;
        let mut joints_only = true;
        for flaw in &self.flaws.all {
            flaw.moves(&situation, &mut |site, by| {
                joints_only &= matches!(site, Site::Mdh(_, MdhEntry::Theta) | Site::Target(_));
                let place = sites.of(site);
                deviations[place] += by;
                moved.push(place);
            });
        }
        joints_only
    }
}
