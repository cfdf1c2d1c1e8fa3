//! Calibration with other instruments than a centred gauge: measurements of a ballbar, draw wires or a seat in the
//! simulated cell.
//!
//! Each is simulated with its own errors and returns plain samples: distances from anchors, or balls without readings.
//! True positions are known here; the identification sees only the samples and the noise stated by the scenario.

use std::f64::consts::TAU;

use calibench::cell::{Manipulator, ManipulatorError};
use calibench::measure::campaign::{CampaignSettings, LastMotion};
use calibench::measure::dataset::{Anchor, Measured, Sample};
use calibench::measure::poses::PlannedPose;
use calibench::measure::poses::ways::WayFinder;
use calibench::robot::kinematics::Posture;
use calibench::robot::sites::{MdhEntry, Site, SiteIndex};
use calibench::units::{MM, UM};
use nalgebra::Vector3;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use crate::random::{Streams, noisy_point, normal};
use crate::scenario::{InstrumentKind, InstrumentToml, Scenario, StatedEffect};
use crate::world::{SharedWorld, SimulatedRobot};

/// A ball is seated when the socket is closer than this, m: the resolution of the encoders at the end of a small arm.
const SEATED: f64 = 0.3 * UM;
/// Limit on the steps to bring it there.
const MOST_STEPS: usize = 12;

/// Distances measured by a ballbar or by wires, between anchors and the tool.
pub struct Distances<'a> {
    spec: &'a InstrumentToml,
    /// True positions of the anchors, m.
    anchors: Vec<Vector3<f64>>,
    /// Phase of each anchor's periodic error, rad.
    phases: Vec<f64>,
    noise: ChaCha8Rng,
}

impl<'a> Distances<'a> {
    /// The instrument of a scenario with errors sampled from the streams of a trial.
    pub fn set_up(spec: &'a InstrumentToml, streams: &Streams) -> Self {
        let mut random = streams.stream("anchors");
        let place = |nominal: &[f64; 3]| noisy_point(&(Vector3::from(*nominal) * MM), spec.anchor_sigma_um * UM, &mut random);
        let anchors: Vec<Vector3<f64>> = spec.anchors_mm.iter().map(place).collect();
        let mut random = streams.stream("distance phases");
        let phases = anchors.iter().map(|_| random.random_range(0.0..TAU)).collect();
        Distances { spec, anchors, phases, noise: streams.stream("distances") }
    }

    /// Positions of the anchors as known to their owner.
    pub fn known_anchors(spec: &InstrumentToml) -> Vec<Anchor> {
        let known = spec.anchors_mm.iter().enumerate();
        known.map(|(k, p)| Anchor { id: (k + 1).to_string(), position: Vector3::from(*p) * MM }).collect()
    }

    /// One-sigma of a distance as its owner would state it, m: noise, the periodic error taken as random, and the
    /// anchor's position.
    pub fn stated_sigma(spec: &InstrumentToml) -> f64 {
        let [noise, periodic, anchor] = [spec.noise_um, spec.linearity_um, spec.anchor_sigma_um].map(|v| v * UM);
        (noise * noise + 0.5 * periodic * periodic + anchor * anchor).sqrt()
    }

    /// The distance read between anchor `k` and a tool whose true position is `tcp`, m.
    fn read(&mut self, k: usize, tcp: &Vector3<f64>) -> f64 {
        let distance = (tcp - self.anchors[k]).norm();
        let periodic = self.spec.linearity_um * UM * (TAU * distance / (self.spec.period_mm * MM) + self.phases[k]).sin();
        distance + periodic + normal(self.spec.noise_um * UM, &mut self.noise)
    }

    /// Measures at these joints (rad): a ballbar from the anchor given (by its index), wires from all anchors at once.
    ///
    /// # Errors
    /// When the robot does not reach a pose.
    pub fn measure(
        &mut self,
        world: &SharedWorld,
        finder: &mut WayFinder<'_>,
        poses: &[(usize, Vec<f64>)],
    ) -> Result<Vec<Sample>, ManipulatorError> {
        let mut robot = world.robot();
        let mut motion = LastMotion::new(CampaignSettings::default().joint_motion);
        motion.rest_at(&robot.joints()?);
        let mut samples = Vec::new();
        let mut at = None;
        for (number, (anchor, joints)) in poses.iter().enumerate() {
            if at != Some(*anchor) {
                world.wait(self.spec.set_up_s);
                at = Some(*anchor);
            }
            // Poses that cannot be reached without collision are omitted, as in a campaign.
            let Ok(way) = finder.from_to(&world.commanded(), joints) else { continue };
            robot.move_along(&[way.via.as_slice(), std::slice::from_ref(joints)].concat())?;
            let anchors = match self.spec.kind {
                InstrumentKind::Ballbar => {
                    if skipped(self.bring_into_range(world, &mut robot, *anchor))? {
                        continue;
                    }
                    *anchor..*anchor + 1
                }
                _ => 0..self.anchors.len(),
            };
            world.wait(self.spec.pose_s);
            let q = robot.joints()?;
            motion.rest_at(&q);
            for anchor in anchors {
                let distance = self.read(anchor, &world.tcp());
                let id = format!("d{:03}.{}", number + 1, anchor + 1);
                let sample = Sample::new(id, q.clone(), Measured::Distance { anchor, distance });
                let sigma = Some(Distances::stated_sigma(self.spec));
                samples.push(robot.stamped(&motion, Sample { sigma, ..sample }));
            }
        }
        Ok(samples)
    }

    /// Jogs the tool along the bar until the bar is within its range, as the person attaching it does.
    fn bring_into_range(&self, world: &SharedWorld, robot: &mut SimulatedRobot, anchor: usize) -> Result<(), ManipulatorError> {
        for _ in 0..MOST_STEPS {
            let along = world.tcp() - self.anchors[anchor];
            let off = along.norm() - self.spec.length_mm * MM;
            if off.abs() < self.spec.range_mm * MM {
                return Ok(());
            }
            let step = world.in_tool(&(along.normalize() * -off));
            robot.move_in_tool(&step)?;
        }
        Err(ManipulatorError::Unreachable)
    }
}

/// A socket on the tool, closed over the balls of the artifact.
pub struct Seat<'a> {
    scenario: &'a Scenario,
    balls: Vec<Vector3<f64>>,
    random: ChaCha8Rng,
    compliance: Vec<f64>,
}

impl<'a> Seat<'a> {
    /// The seat of a scenario; `balls` are the true positions of the balls (world, m).
    pub fn new(scenario: &'a Scenario, balls: Vec<Vector3<f64>>, streams: &Streams) -> Self {
        let stated: Vec<(&str, Option<f64>)> = scenario.truth().effects().iter().flat_map(StatedEffect::parameters).collect();
        let of_joint = |j: usize| {
            let name = format!("c{}", j + 1);
            stated.iter().find(|(n, _)| *n == name).and_then(|(_, size)| *size).unwrap_or(0.0)
        };
        let compliance = (0..scenario.robot().joints()).map(of_joint).collect();
        Seat { scenario, balls, random: streams.stream("seat"), compliance }
    }

    /// Closes the seat over the ball of each pose and reads the joints.
    ///
    /// The arm is held by the ball: its TCP is at the ball up to the repeatability of the seat. A residual force at the time
    /// of reading bends the arm behind the encoders, so the joints read do not show it.
    ///
    /// # Errors
    /// When the robot does not reach a pose.
    pub fn measure(&mut self, world: &SharedWorld, poses: &[PlannedPose]) -> Result<Vec<Sample>, ManipulatorError> {
        let spec = &self.scenario.instrument;
        let mut robot = world.robot();
        let mut motion = LastMotion::new(CampaignSettings::default().joint_motion);
        motion.rest_at(&robot.joints()?);
        world.wait(spec.set_up_s);
        let mut samples = Vec::new();
        for (pose, ball) in poses.iter().filter(|p| !p.reserve).filter_map(|p| Some((p, p.ball?))) {
            robot.move_along(&[pose.via.as_slice(), std::slice::from_ref(&pose.approach)].concat())?;
            robot.move_joints(&pose.contact)?;
            let force = noisy_direction(&mut self.random) * spec.force_n;
            let bent = self.bent(&pose.contact, &force);
            let target = noisy_point(&self.balls[ball], spec.noise_um * UM, &mut self.random) - bent;
            if skipped(close(world, &mut robot, &target))? {
                robot.move_joints(&pose.approach)?;
                continue;
            }
            world.wait(spec.pose_s);
            let q = robot.joints()?;
            motion.rest_at(&q);
            let sample = Sample::new(&*pose.id, q, Measured::Ball { ball, reading: None });
            samples.push(robot.stamped(&motion, sample));
            robot.move_joints(&pose.approach)?;
        }
        Ok(samples)
    }

    /// Deflection of the arm at the TCP under a force (N, world): `sum J_j c_j (J_j . F)`, m.
    fn bent(&self, q: &[f64], force: &Vector3<f64>) -> Vector3<f64> {
        let cell = self.scenario.dataset();
        let mut posture = Posture::new(&cell.robot);
        posture.set(&cell.robot, &cell.base, &cell.tool, q, &vec![0.0; SiteIndex::new(q.len()).len()]);
        let column = |j: usize| posture.column(Site::mdh(j, MdhEntry::Theta));
        (0..q.len()).map(|j| column(j) * (self.compliance[j] * column(j).dot(force))).sum()
    }
}

/// Returns true if a pose is to be omitted, as in a campaign, because the arm cannot reach the point where its
/// instrument closes; other errors are passed on.
fn skipped(led: Result<(), ManipulatorError>) -> Result<bool, ManipulatorError> {
    match led {
        Ok(()) => Ok(false),
        Err(ManipulatorError::JointLimit { .. } | ManipulatorError::Unreachable) => Ok(true),
        Err(lost) => Err(lost),
    }
}

/// Moves the true TCP to `target` (world, m).
fn close(world: &SharedWorld, robot: &mut SimulatedRobot, target: &Vector3<f64>) -> Result<(), ManipulatorError> {
    for _ in 0..MOST_STEPS {
        let off = target - world.tcp();
        if off.norm() < SEATED {
            break;
        }
        let step = world.in_tool(&off);
        robot.move_in_tool(&step)?;
    }
    Ok(())
}

/// A uniformly distributed random direction.
fn noisy_direction(random: &mut ChaCha8Rng) -> Vector3<f64> {
    let v = noisy_point(&Vector3::zeros(), 1.0, random);
    v.try_normalize(0.0).unwrap_or_else(Vector3::z)
}
