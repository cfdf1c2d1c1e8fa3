//! One session at the simulated cell: mastering, probing with one payload after the other, points by tracker.

use std::cell::RefCell;
use std::collections::BTreeSet;

use calibench::cell::{Manipulator, ManipulatorError, TriCal};
use calibench::measure::{
    ArmAt, Campaign, CampaignRecord, CampaignSettings, CenteringController, CentringSettings, Iteration, Journal, LastMotion,
    Mastering, MasteringError, MasteringSettings, Measured, PlannedPose, Probing, ProbingFailure, ProbingPlan, Progress,
    RepeatabilitySettings, Sample, SampleSet, Station, StationRecord, WayFinder, Witness, master, parts_by_payload,
};
use calibench::units::{DEG, MM, UM};
use nalgebra::Vector3;
use thiserror::Error;

use crate::gauge::Gauge;
use crate::planning::{Tour, tour_without_artifact, way_request};
use crate::plant::{Parts, PlantError};
use crate::random::Streams;
use crate::rival::{Distances, Seat};
use crate::run::Plans;
use crate::scenario::{InstrumentKind, Scenario};
use crate::tracker::{SimulatedTracker, TrackerError};
use crate::true_arm::TrueArm;
use crate::world::{HANDLING_S, READING_S, REBUILDING_S, SharedWorld, World};

/// Why a session does not begin.
#[derive(Debug, Error)]
pub enum SessionError {
    /// The plant cannot play the cell.
    #[error(transparent)]
    Plant(#[from] PlantError),
    /// The gauge was not mastered.
    #[error("mastering failed")]
    Mastering(#[from] MasteringError),
}

/// A session, from the mastering of the gauge on.
pub struct Session<'a> {
    scenario: &'a Scenario,
    streams: Streams,
    world: SharedWorld,
    mastering: Mastering,
    /// The way home from where the arm stands, rad; none where it is there or none is known.
    way_home: RefCell<Vec<Vec<f64>>>,
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
    /// Masters the gauge of a scenario's cell, its errors drawn from the streams of a trial; all that is fitted will be measured in
    /// about so many seconds.
    ///
    /// # Errors
    /// When the plant cannot play the cell, or the gauge cannot be mastered.
    pub fn begin(scenario: &'a Scenario, streams: Streams, session_s: f64) -> Result<Self, SessionError> {
        let world = SharedWorld::new(World::new(scenario, &streams, session_s)?);
        let clock = || world.robot().clock_s();
        let mastering =
            master(&mut world.indicators(), &mut world.attendant(), &TriCal::default(), &MasteringSettings::default(), clock)?;
        Ok(Session { scenario, streams, world, mastering, way_home: RefCell::default() })
    }

    /// How the mastering went.
    pub fn mastering(&self) -> &Mastering {
        &self.mastering
    }

    /// The cell.
    pub fn world(&self) -> &SharedWorld {
        &self.world
    }

    /// From now on notes where the true arm stands.
    pub fn note_true_arm(&self) {
        self.world.note_true_arm();
    }

    /// Where the true arm stood since it is noted; it is noted no more.
    pub fn true_arm(&self) -> TrueArm {
        self.world.true_arm()
    }

    /// Temperature of the robot now, °C, where it is logged.
    pub fn temperature_c(&self) -> Option<f64> {
        self.world.robot().temperature_c()
    }

    /// Probes the balls of the plan: with the payload that it names first, then with the next. Every probing is written to the
    /// journal, where there is one, as soon as it ends.
    ///
    /// By the ways of the plan, from home; where it has none, at once from pose to pose.
    pub fn probe(&self, plan: &ProbingPlan, mut journal: Option<&mut Journal>, witness: &mut dyn Witness) -> CampaignRecord {
        let settings = centring(self.scenario);
        let mut record = CampaignRecord::default();
        let mut stands = ArmAt::Home;
        if let Some(ways) = &plan.ways {
            self.world.begin_at(&ways.home);
        }
        for part in parts_by_payload(&plan.poses) {
            self.world.attendant().mount(part.payload);
            let (robot, indicators) = (self.world.robot(), self.world.indicators());
            let controller =
                CenteringController::new(robot, indicators, TriCal::default(), self.mastering.free_reading, settings.clone());
            let mut naming = Naming { world: &self.world, witness: &mut *witness };
            let mut campaign = Campaign::new(controller, CampaignSettings::default());
            if let Some(ways) = &plan.ways {
                campaign = campaign.by(ways.clone(), stands);
            }
            let done = match &mut journal {
                Some(journal) => campaign.run_journalled(&part.poses, journal, &mut naming),
                None => campaign.run(&part.poses, &mut naming),
            };
            stands = campaign.stands().clone();
            if !record.add(&part, done) {
                break;
            }
        }
        if let (Some(ways), ArmAt::Approach(at)) = (&plan.ways, &stands) {
            self.way_home.replace(ways.home_from(at));
        }
        record
    }

    /// Goes back to a station again and again.
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

    /// The ways from where the arm stands through these postures, the artifact away; and which of them cannot be reached, by their place.
    pub fn tour_without_artifact(&self, poses: Vec<Vec<f64>>) -> (Tour, Vec<usize>) {
        tour_without_artifact(self.scenario, self.streams.seed, &self.world.commanded(), poses)
    }

    /// What a rival of the gauge measures at the poses chosen for it; the artifact is away where it measures distances.
    ///
    /// # Errors
    /// When the robot does not get there.
    pub fn rival_samples(&self, plans: &Plans) -> Result<Vec<Sample>, ManipulatorError> {
        let spec = &self.scenario.instrument;
        self.world.attendant().remove_artifact();
        let home = plans.plan.probing.ways.as_ref().map(|ways| ways.home.clone()).unwrap_or_else(|| self.world.commanded());
        self.world.begin_at(&home);
        if spec.kind.measures_distances() {
            let (cell, surroundings) = (self.scenario.dataset(), self.scenario.surroundings_without_artifact());
            let mut finder = WayFinder::new(way_request(&cell, &surroundings, self.streams.seed), home);
            return Distances::set_up(spec, &self.streams).measure(&self.world, &mut finder, &plans.rival);
        }
        let gauge = Gauge::draw(&self.scenario.truth().keys().indicators.plungers(), &self.streams);
        let balls = Parts::of(self.scenario, &self.streams, &gauge).balls.iter().map(|b| b.centre).collect();
        Seat::new(self.scenario, balls, &self.streams).measure(&self.world, &plans.plan.probing.poses)
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

    /// Points at the postures of a tour, named `prefix001`, `prefix002` ..., for that use.
    ///
    /// # Errors
    /// When the robot does not get there.
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
        let mut rng = self.streams.stream(&format!("tracker {prefix}"));
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
            points.samples.push(Sample {
                set,
                payload: self.world.payload(),
                time_s: Some(robot.clock_s()),
                temp_c: robot.temperature_c(),
                approach: Some(motion.signs().to_vec()),
                q_commanded: robot.commanded(),
                ..Sample::new(id, q, Measured::Point(point))
            });
        }
        Ok(points)
    }
}

/// How the balls of a scenario are centred. A device that is read off centre calls every ball centred that it reaches.
pub fn centring(scenario: &Scenario) -> CentringSettings {
    let tolerance = match scenario.instrument.kind {
        InstrumentKind::Offset => scenario.instrument.range_mm * MM,
        _ => scenario.centring.tolerance_um * UM,
    };
    CentringSettings { tolerance, ..CentringSettings::default() }
}

/// Tells the cell which sample is being taken: a truth may be about one of them.
struct Naming<'a> {
    world: &'a SharedWorld,
    witness: &'a mut dyn Witness,
}

impl Witness for Naming<'_> {
    fn probing_started(&mut self, pose: &PlannedPose, attempt: usize, progress: &Progress) {
        self.world.name_sample(&pose.id);
        self.witness.probing_started(pose, attempt, progress);
    }

    fn iteration(&mut self, pose: &PlannedPose, iteration: &Iteration) {
        self.witness.iteration(pose, iteration);
    }

    fn probing_finished(&mut self, pose: &PlannedPose, probing: &Probing, sample: Option<&Sample>) {
        self.witness.probing_finished(pose, probing, sample);
    }
}

/// Stops of a probing: before it, on the ball, three steps, and back (readings of a centring are 3.5 on average).
const STOPS: f64 = 5.5;

/// About how long it takes, s, to probe these poses and to measure so many points: what "by the end of the session" means in a truth.
pub fn session_s(scenario: &Scenario, poses: &[PlannedPose], points: usize) -> f64 {
    let controller = &scenario.truth().keys().controller;
    let speed = controller.speed_deg_per_s * DEG;
    let travel = |from: &[f64], to: &[f64]| from.iter().zip(to).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max) / speed;
    let poses: Vec<&PlannedPose> = poses.iter().filter(|p| !p.reserve).collect();
    let ways: f64 = poses.windows(2).map(|pair| travel(&pair[0].approach, &pair[1].approach)).sum();
    let onto: f64 = poses.iter().map(|p| 2.0 * travel(&p.approach, &p.contact)).sum();
    let probings = STOPS * (controller.settle_s + 3.0 * READING_S) * poses.len() as f64;
    // A random way of one of six joints is a third of its range on average, the longest of them about the half.
    let range = scenario.robot().links.iter().map(|l| l.limits[1] - l.limits[0]).fold(0.0, f64::max);
    let payloads: BTreeSet<usize> = poses.iter().map(|p| p.payload).collect();
    // The first payload comes back for the tracker, which wants the artifact away.
    let changes = if payloads.len() > 1 { payloads.len() - usize::from(points == 0) } else { 0 };
    let rebuilding = REBUILDING_S * (changes + usize::from(points > 0)) as f64;
    let tracked = points as f64 * (0.3 * range / speed + controller.settle_s);
    2.0 * HANDLING_S + ways + onto + probings + rebuilding + tracked
}
