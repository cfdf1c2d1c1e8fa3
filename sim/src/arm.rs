//! The arm as it really is: injected errors of any size, at rest under gravity and whatever pushes at its tool.

use calibench::effects::{ArtifactShape, Kind, Situation};
use calibench::measure::Dataset;
use calibench::robot::{FramePose, Loads, MdhEntry, Payload, Pose, Posture, Robot, Site, SiteIndex};
use nalgebra::Vector3;

use crate::flaw::Flaws;
use crate::plant::{Parts, Stand};

/// The true arm on its true base with its true tool.
pub struct Arm {
    /// The robot with its true masses; geometry as drawn, deviations come from the flaws.
    robot: Robot,
    /// What its owner knows of the cell.
    nominal: Dataset,
    artifact: ArtifactShape,
    /// True TCP in the last frame.
    tool: FramePose,
    /// Its axes in the last frame.
    tool_turned: Pose,
    /// True payload.
    pub payload: Payload,
    /// What is wrong with it beyond that.
    flaws: Flaws,
    session_s: f64,
    posture: Posture,
    loads: Loads,
    deviations: Vec<f64>,
    /// What the flaws that are the same in every situation move.
    fixed: Vec<f64>,
    /// Places of the sites that other flaws moved since.
    moved: Vec<usize>,
    /// Whether the posture has the base, tool and links of those flaws alone.
    as_fixed: bool,
}

/// What meets the arm's tool at one moment.
#[derive(Debug, Clone, Copy, Default)]
pub struct Moment {
    /// What is measured.
    pub kind: Option<Kind>,
    /// What the indicators have left to read: the ball's centre in the tool, m.
    pub reading: Option<Vector3<f64>>,
    /// Force on the tool at the TCP, world axes, N.
    pub force: Vector3<f64>,
}

impl Arm {
    /// The arm of a cell with these flaws, in a session of about so many seconds.
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

    /// Moves the motors (rad, N); nothing has given way yet, and the arm stands where its geometry puts it.
    pub fn move_motors(&mut self, motors: &[f64]) {
        self.undo_moves();
        self.stand(motors, true);
    }

    /// Leaves of the deviations only those of the constant flaws.
    fn undo_moves(&mut self) {
        for place in self.moved.drain(..) {
            self.deviations[place] = self.fixed[place];
        }
    }

    /// Moves the arm to `motors` (rad) with its deviations; whether only joints deviate by other than the constant flaws.
    fn stand(&mut self, motors: &[f64], joints_only: bool) {
        if joints_only && self.as_fixed {
            self.posture.turn_to(&self.robot, motors, &self.deviations);
        } else {
            self.posture.set(&self.robot, &self.nominal.base, &self.tool, motors, &self.deviations);
            self.as_fixed = joints_only;
        }
    }

    /// Lets the arm give way to what weighs on it in its present posture; how far its TCP went, m. Each time shrinks that by the ratio of
    /// deflection to arm length, about 1e-3, down to the static equilibrium: loads are then those of the deflected arm.
    pub fn give_way(&mut self, stand: &Stand<'_>, moment: &Moment) -> f64 {
        let tcp = self.posture.tcp();
        self.loads.weigh(&self.robot, &self.posture, &self.payload, &self.nominal.gravity, &moment.force);
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

    /// How far the ball, or the point as measured, stands from its place, world, m; at the moment to which the arm gave way last.
    pub fn target_moved(&self) -> Vector3<f64> {
        let sites = SiteIndex::new(self.robot.joints());
        Vector3::from_fn(|k, _| self.deviations[sites.of(Site::target(k))])
    }

    /// Finds the deviations of all sites in the present posture; whether only joints, and the target, deviate by other than the constant
    /// flaws.
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
