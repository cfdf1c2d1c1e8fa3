//! One session in the simulated cell: mastering, probing with each payload in turn, points by tracker.

use std::cell::RefCell;

use calibench::cell::{Manipulator, ManipulatorError, TriCal};
use calibench::measure::campaign::journal::Journal;
use calibench::measure::campaign::mastering::{Mastering, MasteringError, MasteringSettings, master};
use calibench::measure::campaign::repeatability::{RepeatabilitySettings, Station, StationRecord};
use calibench::measure::campaign::{
    Aim, Campaign, CampaignObserver, CampaignRecord, CampaignSettings, LastMotion, Progress, parts_by_payload,
};
use calibench::measure::centring::{CenteringController, CentringSettings, Iteration, Probing, ProbingFailure};
use calibench::measure::dataset::{Dataset, Measured, Sample, SampleSet};
use calibench::measure::poses::ways::{ArmAt, WayFinder, WayRequest};
use calibench::measure::poses::{PlannedPose, ProbingPlan};
use calibench::planning::aim::FirstContacts;
use calibench::units::{MM, UM};
use nalgebra::Vector3;
use thiserror::Error;

use crate::gauge::Gauge;
use crate::mechanics::{Parts, PlantError};
use crate::planning::{Tour, tour_without_artifact};
use crate::plans::Plans;
use crate::random::Streams;
use crate::rival::{Distances, Seat};
use crate::scenario::{InstrumentKind, Scenario};
use crate::tracker::{SimulatedTracker, TrackerError};
use crate::true_arm::TrueArm;
use crate::world::{SharedWorld, World};

/// Reasons why a session cannot begin.
#[derive(Debug, Error)]
pub enum SessionError {
    /// The plant cannot simulate the cell.
    #[error(transparent)]
    Plant(#[from] PlantError),
    /// The gauge was not mastered.
    #[error("mastering failed")]
    Mastering(#[from] MasteringError),
}

/// A session, starting with the mastering of the gauge.
pub struct Session<'a> {
    scenario: &'a Scenario,
    streams: Streams,
    /// Those of the noise.
    noise: Streams,
    world: SharedWorld,
    mastering: Mastering,
    /// Path home from the arm's present posture, rad; empty if it is at home or no path is known.
    way_home: RefCell<Vec<Vec<f64>>>,
}

/// Points that the tracker measured.
#[derive(Debug, Clone, PartialEq)]
pub struct Points {
    /// The measurements.
    pub samples: Vec<Sample>,
    /// True positions of the TCP, world, m.
    pub truth: Vec<Vector3<f64>>,
}

impl<'a> Session<'a> {
    /// Masters the gauge of a scenario's cell, its errors sampled from the streams of a trial; `session_s` is the approximate
    /// time in which all fitted data will be measured.
    ///
    /// # Errors
    /// When the plant cannot simulate the cell, or the gauge cannot be mastered.
    pub fn begin(scenario: &'a Scenario, streams: Streams, session_s: f64) -> Result<Self, SessionError> {
        Session::visit(scenario, streams, session_s, 0, |_| ())
    }

    /// The same on a later visit: robot, artifact and gauge are those of the first, but for what `alter` does to them, and all
    /// noise is new.
    ///
    /// # Errors
    /// As [`Session::begin`].
    pub fn visit(
        scenario: &'a Scenario,
        streams: Streams,
        session_s: f64,
        visit: u64,
        alter: impl FnOnce(&mut Parts),
    ) -> Result<Self, SessionError> {
        let noise = streams.of_visit(visit);
        let mut world = World::altered(scenario, &streams, session_s, alter)?;
        if visit > 0 {
            world.renew_noise(&noise);
        }
        let world = SharedWorld::new(world);
        let clock = || world.robot().clock_s();
        let mastering =
            master(&mut world.indicators(), &mut world.attendant(), &TriCal::default(), &MasteringSettings::default(), clock)?;
        Ok(Session { scenario, streams, noise, world, mastering, way_home: RefCell::default() })
    }

    /// Result of the mastering.
    pub fn mastering(&self) -> &Mastering {
        &self.mastering
    }

    /// The cell.
    pub fn world(&self) -> &SharedWorld {
        &self.world
    }

    /// Starts recording the postures of the true arm.
    pub fn note_true_arm(&self) {
        self.world.note_true_arm();
    }

    /// Returns the recorded postures of the true arm, and stops recording.
    pub fn true_arm(&self) -> TrueArm {
        self.world.true_arm()
    }

    /// Present temperature of the robot, °C, if it is logged.
    pub fn temperature_c(&self) -> Option<f64> {
        self.world.robot().temperature_c()
    }

    /// Probes the balls of the plan, payload by payload in the order of their first use. Every probing is written to the
    /// journal, if there is one, as soon as it ends.
    ///
    /// The arm takes the paths of the plan, from home; without paths, it moves directly from pose to pose.
    pub fn probe(
        &self,
        plan: &ProbingPlan,
        mut journal: Option<&mut Journal>,
        observer: &mut dyn CampaignObserver,
    ) -> CampaignRecord {
        let settings = centring(self.scenario);
        let mut record = CampaignRecord::default();
        let mut stands = ArmAt::Home;
        let mut aim = self.aim(plan);
        if let Some(ways) = &plan.ways {
            self.world.begin_at(&ways.home);
        }
        for part in parts_by_payload(&plan.poses) {
            self.world.attendant().mount(part.payload);
            let (robot, indicators) = (self.world.robot(), self.world.indicators());
            let controller =
                CenteringController::new(robot, indicators, TriCal::default(), self.mastering.free_reading, settings.clone());
            let mut naming = Naming { world: &self.world, observer: &mut *observer };
            let mut campaign = Campaign::new(controller, CampaignSettings::default()).aiming(aim);
            if let Some(ways) = &plan.ways {
                campaign = campaign.by(ways.clone(), stands);
            }
            let done = match &mut journal {
                Some(journal) => campaign.run_journalled(&part.poses, journal, &mut naming),
                None => campaign.run(&part.poses, &mut naming),
            };
            stands = campaign.stands().clone();
            aim = campaign.take_aim();
            if !record.add(&part, done) {
                break;
            }
        }
        if let (Some(ways), ArmAt::Approach(at)) = (&plan.ways, &stands) {
            self.way_home.replace(ways.home_from(at));
        }
        record
    }

    /// What the arm aims by; `None` if it meets the balls as planned.
    fn aim(&self, plan: &ProbingPlan) -> Option<Box<dyn Aim>> {
        if !self.scenario.plan.aimed {
            return None;
        }
        let cell = Dataset { contact_force: self.scenario.indicators.contact_force(), ..self.scenario.dataset() };
        Some(Box::new(FirstContacts::new(&cell, &plan.poses)))
    }

    /// Visits a station repeatedly.
    ///
    /// # Errors
    /// When a probing there would fail.
    pub fn revisit(&self, station: &Station, settings: &RepeatabilitySettings) -> Result<StationRecord, ProbingFailure> {
        let (robot, indicators) = (self.world.robot(), self.world.indicators());
        let free_reading = self.mastering.free_reading;
        self.world.name_sample(&station.pose.id);
        CenteringController::new(robot, indicators, TriCal::default(), free_reading, centring(self.scenario)).revisit(
            station,
            settings,
            &mut |_| (),
        )
    }

    /// Plans the paths from the arm's present posture through these postures, with the artifact removed; also returns the
    /// indices of those that cannot be reached.
    pub fn tour_without_artifact(&self, poses: Vec<Vec<f64>>) -> (Tour, Vec<usize>) {
        tour_without_artifact(self.scenario, self.streams.seed, &self.world.commanded(), poses)
    }

    /// Measurements of an alternative instrument at the poses chosen for it, with the artifact removed.
    ///
    /// # Errors
    /// When the robot does not reach a pose.
    pub fn rival_samples(&self, plans: &Plans) -> Result<Vec<Sample>, ManipulatorError> {
        let spec = &self.scenario.instrument;
        self.world.attendant().remove_artifact();
        let home = plans.plan.probing.ways.as_ref().map(|ways| ways.home.clone()).unwrap_or_else(|| self.world.commanded());
        self.world.begin_at(&home);
        if spec.kind.measures_distances() {
            let (cell, surroundings) = (self.scenario.dataset(), self.scenario.surroundings_without_artifact());
            let mut finder = WayFinder::new(WayRequest::of(&cell, &surroundings, self.streams.seed), home);
            return Distances::set_up(spec, &self.streams).measure(&self.world, &mut finder, &plans.rival);
        }
        let gauge = Gauge::draw(&self.scenario.truth().keys().indicators.plungers(), &self.streams);
        let balls = Parts::of(self.scenario, &self.streams, &gauge).balls.iter().map(|b| b.centre).collect();
        Seat::new(self.scenario, balls, &self.streams).measure(&self.world, &plans.plan.probing.poses)
    }

    /// Sets up the tracker on its nests, and removes the artifact, which would be in the tracker's workspace (paper,
    /// section 6).
    ///
    /// # Errors
    /// When the nests do not define a frame.
    pub fn set_up_tracker(&self) -> Result<SimulatedTracker, TrackerError> {
        let nests = self.scenario.tracker.nests_mm.map(|n| Vector3::from(n) * MM);
        let spec = self.scenario.truth().keys().tracker.spec();
        let tracker = SimulatedTracker::set_up(&spec, &nests, &mut self.noise.stream("tracker"))?;
        self.world.attendant().mount(0);
        self.world.attendant().remove_artifact();
        Ok(tracker)
    }

    /// Measures points at the postures of a tour, named `prefix001`, `prefix002` ..., for this use.
    ///
    /// # Errors
    /// When the robot does not reach a posture.
    pub fn points(
        &self,
        tracker: &SimulatedTracker,
        tour: &Tour,
        prefix: &str,
        set: SampleSet,
    ) -> Result<Points, ManipulatorError> {
        if tour.has_no_ways {
            self.world.put_without_ways();
        }
        let mut rng = self.noise.stream(&format!("tracker {prefix}"));
        let mut robot = self.world.robot();
        let mut motion = LastMotion::new(CampaignSettings::default().joint_motion);
        motion.rest_at(&robot.joints()?);
        let count = tour.poses.len();
        let mut points = Points { samples: Vec::with_capacity(count), truth: Vec::with_capacity(count) };
        for (k, (target, via)) in tour.poses.iter().zip(&tour.via).enumerate() {
            let id = format!("{prefix}{:03}", k + 1);
            self.world.name_sample(&id);
            let way = [self.way_home.take().as_slice(), via, std::slice::from_ref(target)].concat();
            robot.move_along(&way)?;
            let q = robot.joints()?;
            motion.rest_at(&q);
            let point = tracker.measure(&self.world.point(), &mut rng);
            points.truth.push(self.world.tcp());
            points.samples.push(robot.stamped(&motion, Sample { set, ..Sample::new(id, q, Measured::Point(point)) }));
        }
        Ok(points)
    }
}

/// Centring settings of a scenario. For an instrument read off centre every ball within its range counts as centred.
pub fn centring(scenario: &Scenario) -> CentringSettings {
    let tolerance = match scenario.instrument.kind {
        InstrumentKind::Offset => scenario.instrument.range_mm * MM,
        _ => scenario.centring.tolerance_um * UM,
    };
    CentringSettings { tolerance, ..CentringSettings::default() }
}

/// Tells the cell which sample is being taken, because a truth may concern a single sample.
struct Naming<'a> {
    world: &'a SharedWorld,
    observer: &'a mut dyn CampaignObserver,
}

impl CampaignObserver for Naming<'_> {
    fn probing_started(&mut self, pose: &PlannedPose, attempt: usize, progress: &Progress) {
        self.world.name_sample(&pose.id);
        self.observer.probing_started(pose, attempt, progress);
    }

    fn iteration(&mut self, pose: &PlannedPose, iteration: &Iteration) {
        self.observer.iteration(pose, iteration);
    }

    fn probing_finished(&mut self, pose: &PlannedPose, probing: &Probing, sample: Option<&Sample>) {
        self.observer.probing_finished(pose, probing, sample);
    }

    fn recalled(&mut self, pose: &PlannedPose, probing: &Probing, sample: Option<&Sample>) {
        self.observer.recalled(pose, probing, sample);
    }

    fn choose(&mut self, waiting: &[&PlannedPose], samples: &[Sample]) -> Option<usize> {
        self.observer.choose(waiting, samples)
    }
}
