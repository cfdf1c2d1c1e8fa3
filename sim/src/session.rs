//! One session at the simulated cell: mastering, probing with one payload after the other, points by tracker.

use calibench::cell::{Manipulator, ManipulatorError, TriCal};
use calibench::measure::{
    Campaign, CampaignRecord, CampaignSettings, CenteringController, CentringSettings, LastMotion, Mastering, MasteringError,
    MasteringSettings, Measured, PlannedPose, Sample, SampleSet, Witness, master,
};
use calibench::units::{MM, UM};
use nalgebra::Vector3;

use crate::random::Streams;
use crate::scenario::Scenario;
use crate::tracker::{SimulatedTracker, TrackerError};
use crate::world::{SharedWorld, World};

/// A session, from the mastering of the gauge on.
pub struct Session<'a> {
    scenario: &'a Scenario,
    streams: Streams,
    world: SharedWorld,
    mastering: Mastering,
}

/// Points that the tracker measured.
#[derive(Debug, Clone, PartialEq)]
pub struct Points {
    /// What it said.
    pub samples: Vec<Sample>,
    /// Where the TCP truly was, world, m.
    pub truth: Vec<Vector3<f64>>,
}

impl<'a> Session<'a> {
    /// Masters the gauge of a scenario's cell, its errors drawn from the streams of a trial.
    ///
    /// # Errors
    /// When the gauge cannot be mastered.
    pub fn begin(scenario: &'a Scenario, streams: Streams) -> Result<Self, MasteringError> {
        let world = SharedWorld::new(World::new(scenario, &streams));
        let clock = || world.robot().clock_s();
        let mastering =
            master(&mut world.indicators(), &mut world.attendant(), &TriCal::default(), &MasteringSettings::default(), clock)?;
        Ok(Session { scenario, streams, world, mastering })
    }

    /// How the mastering went.
    pub fn mastering(&self) -> &Mastering {
        &self.mastering
    }

    /// Probes the balls of the plan: with the payload that it names first, then with the next.
    pub fn probe(&self, poses: &[PlannedPose], witness: &mut dyn Witness) -> CampaignRecord {
        let tolerance = self.scenario.centring.tolerance_um * UM;
        let settings = CentringSettings { tolerance, ..CentringSettings::default() };
        let mut record = CampaignRecord { samples: Vec::new(), probings: Vec::new(), aborted: None };
        let mut payloads: Vec<usize> = Vec::new();
        for pose in poses {
            if !payloads.contains(&pose.payload) {
                payloads.push(pose.payload);
            }
        }
        for payload in payloads {
            self.world.attendant().mount(payload);
            let places: Vec<usize> = (0..poses.len()).filter(|&k| poses[k].payload == payload).collect();
            let with_it: Vec<PlannedPose> = places.iter().map(|&k| poses[k].clone()).collect();
            let (robot, indicators) = (self.world.robot(), self.world.indicators());
            let controller =
                CenteringController::new(robot, indicators, TriCal::default(), self.mastering.free_reading, settings.clone());
            let part = Campaign::new(controller, CampaignSettings::default()).run(&with_it, witness);
            record.samples.extend(part.samples);
            record.probings.extend(part.probings.into_iter().map(|mut probing| {
                probing.pose = places[probing.pose];
                probing
            }));
            record.aborted = part.aborted;
            if record.aborted.is_some() {
                break;
            }
        }
        record
    }

    /// Sets the tracker up on its nests, and takes the artifact away: it would stand in the tracker's workspace (paper, section 6).
    ///
    /// # Errors
    /// When the nests do not carry a frame.
    pub fn set_up_tracker(&self) -> Result<SimulatedTracker, TrackerError> {
        let nests = self.scenario.tracker.nests_mm.map(|n| Vector3::from(n) * MM);
        let spec = self.scenario.truth().keys().tracker.spec();
        let tracker = SimulatedTracker::set_up(&spec, &nests, &mut self.streams.stream("tracker"))?;
        self.world.attendant().mount(0);
        self.world.attendant().remove_artifact();
        Ok(tracker)
    }

    /// Points at the joints `poses` (rad), named `prefix001`, `prefix002` ..., for that use.
    ///
    /// # Errors
    /// When the robot does not get there.
    pub fn points(
        &self,
        tracker: &SimulatedTracker,
        poses: &[Vec<f64>],
        prefix: &str,
        set: SampleSet,
    ) -> Result<Points, ManipulatorError> {
        let mut rng = self.streams.stream(&format!("tracker {prefix}"));
        let mut robot = self.world.robot();
        let mut motion = LastMotion::new(CampaignSettings::default().joint_motion);
        motion.rest_at(&robot.joints()?);
        let mut points = Points { samples: Vec::with_capacity(poses.len()), truth: Vec::with_capacity(poses.len()) };
        for (k, target) in poses.iter().enumerate() {
            robot.move_joints(target)?;
            let q = robot.joints()?;
            motion.rest_at(&q);
            let point = tracker.measure(&self.world.point(), &mut rng);
            points.truth.push(self.world.tcp());
            points.samples.push(Sample {
                set,
                payload: self.world.payload(),
                time_s: Some(robot.clock_s()),
                temp_c: robot.temperature_c(),
                approach: Some(motion.signs().to_vec()),
                q_commanded: robot.commanded(),
                ..Sample::new(format!("{prefix}{:03}", k + 1), q, Measured::Point(point))
            });
        }
        Ok(points)
    }
}
