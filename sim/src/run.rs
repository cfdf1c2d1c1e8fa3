//! The whole procedure on the simulated cell: plan, master, probe, identify, validate, and the same with the tracker.

use std::collections::BTreeMap;

use calibench::assess::Validation;
use calibench::cell::{Manipulator, TriCal};
use calibench::identify::{Calibration, IdentifyError, Use, identify};
use calibench::measure::{
    Abort, Campaign, CampaignRecord, CampaignSettings, CenteringController, CentringSettings, Dataset, Mastering,
    MasteringError, MasteringSettings, Measured, PlannedPose, Sample, SampleSet, Witness, master,
};
use calibench::units::{MM, UM};
use nalgebra::Vector3;
use thiserror::Error;

use crate::planning::{Plan, PlanError, TrackerPlan, plan, plan_tracker};
use crate::random::Streams;
use crate::scenario::Scenario;
use crate::score::Score;
use crate::tracker::{SimulatedTracker, TrackerError};
use crate::world::{SharedWorld, World};

/// Names of what a scenario may expect.
pub const CHECKS: &[&str] = &[
    "trical_mean_mm",
    "trical_max_mm",
    "trical_std_mm",
    "tracker_mean_mm",
    "tracker_max_mm",
    "tracker_std_mm",
    "before_mean_mm",
    "probings",
    "rank",
    "readings_mean",
    "chi2_per_dof",
    "within_2_sigma",
    "within_3_sigma",
];

/// Why the procedure did not come to its end.
#[derive(Debug, Error)]
pub enum RunError {
    /// No plan.
    #[error(transparent)]
    Plan(#[from] PlanError),
    /// The gauge was not mastered.
    #[error("mastering failed")]
    Mastering(#[from] MasteringError),
    /// The campaign ended early.
    #[error("the campaign ended early")]
    Campaign(#[from] Abort),
    /// No calibration.
    #[error(transparent)]
    Identify(#[from] IdentifyError),
    /// The tracker cannot be set up.
    #[error(transparent)]
    Tracker(#[from] TrackerError),
    /// The robot did not go where the tracker waits.
    #[error("a tracker pose was not reached")]
    Robot(#[from] calibench::cell::ManipulatorError),
}

/// One way of calibrating, judged.
pub struct Method {
    /// `trical` or `tracker`.
    pub name: &'static str,
    /// What it measured.
    pub dataset: Dataset,
    /// What came out.
    pub calibration: Calibration,
    /// Errors on the validation poses.
    pub validation: Validation,
    /// Estimates against the truth.
    pub score: Score,
}

/// Everything that a run produced.
pub struct Run {
    /// The seed used.
    pub seed: u64,
    /// The probings planned.
    pub plan: Plan,
    /// The tracker's poses.
    pub tracker_plan: TrackerPlan,
    /// The mastering.
    pub mastering: Mastering,
    /// The campaign, iteration by iteration.
    pub campaign: CampaignRecord,
    /// The TriCal's dataset, calibration and validation.
    pub trical: Method,
    /// The same by the tracker.
    pub tracker: Method,
    /// Validation points.
    pub validation: Dataset,
    /// Errors of the robot as drawn, on the same poses.
    pub before: Validation,
}

/// A check of a scenario's expectations.
#[derive(Debug, Clone, PartialEq)]
pub struct Check {
    /// Its name.
    pub name: String,
    /// What came out.
    pub value: f64,
    /// Least and most expected.
    pub band: [f64; 2],
}

impl Check {
    /// Whether the value lies in its band.
    pub fn met(&self) -> bool {
        (self.band[0]..=self.band[1]).contains(&self.value)
    }
}

/// Plans of a scenario: the same for every trial of a seed.
pub struct Plans {
    /// The probings.
    pub plan: Plan,
    /// The tracker's poses.
    pub tracker: TrackerPlan,
}

impl Plans {
    /// Plans a scenario.
    ///
    /// # Errors
    /// When a ball cannot be probed, or the poses cannot determine the model.
    pub fn new(scenario: &Scenario, seed: u64) -> Result<Self, PlanError> {
        Ok(Plans {
            plan: plan(scenario, seed)?,
            tracker: plan_tracker(scenario, seed).map_err(|e| PlanError::Tracker(Box::new(e)))?,
        })
    }
}

/// Carries out the whole procedure.
///
/// # Errors
/// When a stage cannot be completed.
pub fn run(scenario: &Scenario, plans: Plans, streams: Streams, witness: &mut dyn Witness) -> Result<Run, RunError> {
    let world = SharedWorld::new(World::new(scenario, &streams));
    let clock = || world.robot().clock_s();
    let mastering =
        master(&mut world.indicators(), &mut world.attendant(), &TriCal::default(), &MasteringSettings::default(), clock)?;
    let campaign = probe(scenario, &world, &plans.plan.probings, &mastering, witness);
    if let Some(abort) = &campaign.aborted {
        return Err(abort.clone().into());
    }
    let cell = scenario.dataset();
    let trical_data =
        Dataset { contact_force: World::nominal_contact_force(scenario), samples: campaign.samples.clone(), ..cell.clone() };

    let mut rng = streams.stream("tracker");
    let nests = scenario.tracker.nests_mm.map(|n| Vector3::from(n) * MM);
    let tracker = SimulatedTracker::set_up(&scenario.tracker_spec(), &nests, &mut rng)?;
    let mut points = |poses: &[Vec<f64>], prefix: &str, set: SampleSet| -> Result<Vec<Sample>, RunError> {
        let mut robot = world.robot();
        poses
            .iter()
            .enumerate()
            .map(|(k, q)| {
                robot.move_joints(q)?;
                let point = tracker.measure(&world.tcp(), &mut rng);
                let mut sample = Sample::new(format!("{prefix}{:03}", k + 1), robot.joints()?, Measured::Point(point));
                sample.set = set;
                sample.time_s = Some(robot.clock_s());
                Ok(sample)
            })
            .collect()
    };
    let tracker_data = Dataset { samples: points(&plans.tracker.identification, "t", SampleSet::Fit)?, ..cell.clone() };
    let validation = Dataset { samples: points(&plans.tracker.validation, "v", SampleSet::Validation)?, ..cell.clone() };

    let model = scenario.model();
    let method = |name: &'static str, dataset: Dataset| -> Result<Method, RunError> {
        let calibration = identify(&[(name, &dataset)], &model)?;
        let judged = judge(&calibration, &validation)?;
        let score = Score::of(&calibration, scenario);
        Ok(Method { name, dataset, calibration, validation: judged, score })
    };
    let trical = method("trical", trical_data)?;
    let tracker = method("tracker", tracker_data)?;
    let before = judge(&trical.calibration.as_drawn(), &validation)?;
    let (plan, tracker_plan) = (plans.plan, plans.tracker);
    Ok(Run { seed: streams.seed, plan, tracker_plan, mastering, campaign, trical, tracker, validation, before })
}

/// Probes the balls of the plan.
pub fn probe(
    scenario: &Scenario,
    world: &SharedWorld,
    poses: &[PlannedPose],
    mastering: &Mastering,
    witness: &mut dyn Witness,
) -> CampaignRecord {
    let settings = CentringSettings { tolerance: scenario.centring.tolerance_um * UM, ..CentringSettings::default() };
    let controller =
        CenteringController::new(world.robot(), world.indicators(), TriCal::default(), mastering.free_reading, settings);
    Campaign::new(controller, CampaignSettings::default()).run(poses, witness)
}

fn judge(calibration: &Calibration, dataset: &Dataset) -> Result<Validation, RunError> {
    let prediction = calibration.predict(&[("validation", dataset)], Use::Validation)?;
    // The plan has at least one validation pose.
    Ok(Validation::of(&prediction).unwrap_or_else(|| unreachable!("a prediction has samples")))
}

impl Run {
    /// Mean number of readings of three a centring took.
    pub fn readings_mean(&self) -> f64 {
        let centred = self.campaign.probings.iter().filter_map(|p| p.probing.outcome.as_ref().ok());
        let readings: Vec<f64> = centred.map(|c| (c.steps + 1) as f64).collect();
        readings.iter().sum::<f64>() / readings.len().max(1) as f64
    }

    /// Every number that can be expected, by name.
    pub fn numbers(&self) -> BTreeMap<&'static str, f64> {
        let (t, l) = (&self.trical.validation, &self.tracker.validation);
        let values = [
            t.mean / MM,
            t.max / MM,
            t.std / MM,
            l.mean / MM,
            l.max / MM,
            l.std / MM,
            self.before.mean / MM,
            self.campaign.samples.len() as f64,
            self.trical.calibration.rank as f64,
            self.readings_mean(),
            self.trical.calibration.chi2_per_dof,
            self.trical.score.within(2.0),
            self.trical.score.within(3.0),
        ];
        CHECKS.iter().copied().zip(values).collect()
    }

    /// The scenario's expectations against what came out.
    pub fn checks(&self, scenario: &Scenario) -> Vec<Check> {
        let numbers = self.numbers();
        scenario
            .expect
            .iter()
            .filter_map(|(name, band)| Some(Check { name: name.clone(), value: *numbers.get(name.as_str())?, band: *band }))
            .collect()
    }
}
