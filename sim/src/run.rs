//! The whole procedure on the simulated cell: plan, master, probe, identify, validate, and the same with the tracker.

use calibench::assess::Validation;
use calibench::compensate::{Compensator, Task, TaskError, WorkFrame};
use calibench::identify::{Calibration, IdentifyError, Model, Use, identify};
use calibench::measure::{Abort, CampaignRecord, Dataset, Mastering, SampleSet, Witness};
use calibench::units::MM;
use nalgebra::Vector3;
use thiserror::Error;

use crate::compensation::{Compensation, compensation};
use crate::planning::{Plan, PlanError, TrackerPlan, plan, plan_tracker, shown};
use crate::random::Streams;
use crate::rival::Distances;
use crate::rival_poses::rival_poses;
use crate::scenario::{Expectation, InstrumentKind, Quantity, Scenario};
use crate::score::Score;
use crate::session::{Session, SessionError, session_s};
use crate::tracker::{SimulatedTracker, TrackerError};
use crate::true_arm::TrueArm;

/// Why the procedure did not come to its end.
#[derive(Debug, Error)]
pub enum RunError {
    /// No plan.
    #[error(transparent)]
    Plan(#[from] PlanError),
    /// The session did not begin.
    #[error(transparent)]
    Session(#[from] SessionError),
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
    /// The calibration does not serve for compensating.
    #[error("the calibration does not serve for compensating")]
    Task(#[from] TaskError),
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
    /// Where the true arm stood meanwhile.
    pub true_arm: TrueArm,
    /// The TriCal's dataset, calibration and validation.
    pub trical: Method,
    /// The same by the tracker.
    pub tracker: Method,
    /// Validation points.
    pub validation: Dataset,
    /// Errors of the robot as drawn, on the same poses.
    pub before: Validation,
    /// What the TriCal's calibration is worth: targets at the validation poses, told as they are and compensated; `None` when not one
    /// could be.
    pub compensation: Option<Compensation>,
}

/// A check of a scenario's expectations.
#[derive(Debug, Clone, PartialEq)]
pub struct Check {
    /// Its name.
    pub name: &'static str,
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
#[derive(Clone)]
pub struct Plans {
    /// The probings.
    pub plan: Plan,
    /// The tracker's poses.
    pub tracker: TrackerPlan,
    /// Joints (rad) at which distances are measured, and from which anchor (by its place); none by an instrument that meets balls.
    pub rival: Vec<(usize, Vec<f64>)>,
}

impl Plans {
    /// Plans a scenario.
    ///
    /// # Errors
    /// When a ball cannot be probed, or the poses cannot determine the model.
    pub fn new(scenario: &Scenario, seed: u64) -> Result<Self, PlanError> {
        let plan = plan(scenario, seed)?;
        let home = plan.probing.ways.as_ref().map(|ways| ways.home.as_slice());
        let tracker = plan_tracker(scenario, seed, home).map_err(|e| PlanError::Tracker(Box::new(e)))?;
        Ok(Plans { plan, tracker, rival: rival_poses(scenario, seed)? })
    }

    /// About how long the fitted part takes, s.
    pub fn session_s(&self, scenario: &Scenario) -> f64 {
        session_s(scenario, &self.plan.probing.poses, self.tracker.points.poses.len())
    }
}

/// A cell measured: what calibration and judgement are made from.
pub struct Measurements {
    /// The mastering.
    pub mastering: Mastering,
    /// The campaign, iteration by iteration.
    pub campaign: CampaignRecord,
    /// What the calibration may use: balls, and the points that the plan adds to them.
    pub fit: Dataset,
    /// Points by tracker at poses that are judged on.
    pub validation: Dataset,
    /// Where the TCP truly was at those, world, m: free of the tracker's noise.
    pub validation_truth: Vec<Vector3<f64>>,
}

/// Measures the cell of a scenario once, on the poses of `plans`; they serve every truth and every trial.
///
/// # Errors
/// When a stage cannot be completed.
pub fn measure_all(
    scenario: &Scenario,
    streams: Streams,
    plans: &Plans,
    witness: &mut dyn Witness,
) -> Result<Measurements, RunError> {
    let session = Session::begin(scenario, streams, plans.session_s(scenario))?;
    Ok(measured(&session, scenario, plans, witness)?.0)
}

/// All balls and points that serve the TriCal and the judgement; and the tracker, which stands there now.
fn measured(
    session: &Session<'_>,
    scenario: &Scenario,
    plans: &Plans,
    witness: &mut dyn Witness,
) -> Result<(Measurements, SimulatedTracker), RunError> {
    let kind = scenario.instrument.kind;
    let (campaign, rival) = match kind {
        InstrumentKind::Trical | InstrumentKind::Offset => (session.probe(&plans.plan.probing, None, witness), Vec::new()),
        _ => (CampaignRecord::default(), session.rival_samples(plans)?),
    };
    if let Some(abort) = &campaign.aborted {
        return Err(abort.clone().into());
    }
    let tracker = session.set_up_tracker()?;
    let points = session.points(&tracker, &plans.tracker.points, "t", SampleSet::Fit)?;
    let validation = session.points(&tracker, &plans.tracker.validation, "v", SampleSet::Validation)?;
    let cell = scenario.dataset();
    let samples = campaign.samples.iter().cloned().chain(rival).chain(points.samples).collect();
    // Only plungers push the tool.
    let contact_force = match kind {
        InstrumentKind::Trical | InstrumentKind::Offset => scenario.indicators.contact_force(),
        _ => Vector3::zeros(),
    };
    let anchors = if kind.measures_distances() { Distances::known_anchors(&scenario.instrument) } else { Vec::new() };
    let measurements = Measurements {
        mastering: session.mastering().clone(),
        campaign,
        fit: Dataset { contact_force, anchors, samples, ..cell.clone() },
        validation: Dataset { samples: validation.samples, ..cell },
        validation_truth: validation.truth,
    };
    Ok((measurements, tracker))
}

/// Carries out the whole procedure.
///
/// # Errors
/// When a stage cannot be completed.
pub fn run(scenario: &Scenario, plans: Plans, streams: Streams, witness: &mut dyn Witness) -> Result<Run, RunError> {
    let session = Session::begin(scenario, streams, plans.session_s(scenario))?;
    session.note_true_arm();
    let (measured, set_up) = measured(&session, scenario, &plans, witness)?;
    let true_arm = session.true_arm();
    let Measurements { mastering, campaign, fit, validation, validation_truth } = measured;
    let points = session.points(&set_up, &plans.tracker.identification, "i", SampleSet::Fit)?;
    let tracker_data = Dataset { samples: points.samples, ..scenario.dataset() };
    let method = |name: &'static str, dataset: Dataset, model: &Model, score: fn(&Calibration, &Scenario) -> Score| {
        let calibration = identify(&[(name, &dataset)], model)?;
        let judged = judge(&calibration, &validation)?;
        let score = score(&calibration, scenario);
        Ok::<_, RunError>(Method { name, dataset, calibration, validation: judged, score })
    };
    // Of balls a distance from an anchor shows nothing; a seat leaves no readings.
    let by_gauge = matches!(scenario.instrument.kind, InstrumentKind::Trical | InstrumentKind::Offset);
    let model = if by_gauge { scenario.model.clone() } else { shown(&scenario.model, &fit) };
    let trical = method("trical", fit, &model, Score::of)?;
    // Of balls and indicators the tracker's points show nothing.
    let model = shown(&scenario.model, &tracker_data);
    let tracker = method("tracker", tracker_data, &model, Score::of_tracker)?;
    let before = judge(&trical.calibration.as_drawn(), &validation)?;
    let Plans { plan, tracker: tracker_plan, .. } = plans;
    let mut compensator = Compensator::new(&trical.calibration, &Task { frame: WorkFrame::World, ..Task::default() })?;
    let compensation = compensation(&session, &set_up, &mut compensator, &validation, &tracker_plan, &validation_truth)?;
    Ok(Run {
        seed: streams.seed,
        plan,
        tracker_plan,
        mastering,
        campaign,
        true_arm,
        trical,
        tracker,
        validation,
        before,
        compensation,
    })
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

    /// A number that can be expected.
    pub fn number(&self, quantity: Quantity) -> f64 {
        let (t, l) = (&self.trical.validation, &self.tracker.validation);
        match quantity {
            Quantity::TricalMean => t.mean / MM,
            Quantity::TricalMax => t.max / MM,
            Quantity::TricalStd => t.std / MM,
            Quantity::TrackerMean => l.mean / MM,
            Quantity::TrackerMax => l.max / MM,
            Quantity::TrackerStd => l.std / MM,
            Quantity::BeforeMean => self.before.mean / MM,
            Quantity::Probings => self.campaign.samples.len() as f64,
            Quantity::Points => (self.trical.dataset.samples.len() - self.campaign.samples.len()) as f64,
            Quantity::Rank => self.trical.calibration.rank as f64,
            Quantity::ReadingsMean => self.readings_mean(),
            Quantity::Chi2PerDof => self.trical.calibration.chi2_per_dof,
            Quantity::Within2Sigma => self.trical.score.within(2.0),
            Quantity::Within3Sigma => self.trical.score.within(3.0),
        }
    }

    /// The scenario's expectations against what came out.
    pub fn checks(&self, scenario: &Scenario) -> Vec<Check> {
        let check = |e: &Expectation| Check { name: e.quantity.name(), value: self.number(e.quantity), band: e.band };
        scenario.expect.iter().map(check).collect()
    }
}
