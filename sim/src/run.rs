//! The whole procedure on the simulated cell: planning, mastering, probing, identification and validation, by the
//! gauge and by the tracker.

use calibench::compensate::{Compensator, Task, TaskError, WorkFrame};
use calibench::identify::calibration::{Calibration, IdentifyError};
use calibench::identify::problem::Use;
use calibench::identify::{Model, Prediction, identify, identify_without_indices};
use calibench::measure::campaign::mastering::Mastering;
use calibench::measure::campaign::{Abort, CampaignObserver, CampaignRecord};
use calibench::measure::dataset::{Dataset, NamedDataset, SampleSet};
use calibench::residuals::Validation;
use calibench::units::MM;
use nalgebra::Vector3;
use thiserror::Error;

use crate::compensation::{Compensation, Targets, compensation};
use crate::planning::{Plan, PlanError, TrackerPlan, shown};
use crate::plans::Plans;
use crate::random::Streams;
use crate::rival::Distances;
use crate::scenario::{Expectation, InstrumentKind, Quantity, Scenario};
use crate::score::Score;
use crate::session::{Session, SessionError};
use crate::tracker::{SimulatedTracker, TrackerError};
use crate::true_arm::TrueArm;

/// Reasons why the procedure was not completed.
#[derive(Debug, Error)]
pub enum RunError {
    /// No plan was found.
    #[error(transparent)]
    Plan(#[from] PlanError),
    /// The session could not begin.
    #[error(transparent)]
    Session(#[from] SessionError),
    /// The campaign ended early.
    #[error("the campaign ended early")]
    Campaign(#[from] Abort),
    /// The calibration failed.
    #[error(transparent)]
    Identify(#[from] IdentifyError),
    /// The tracker cannot be set up.
    #[error(transparent)]
    Tracker(#[from] TrackerError),
    /// The robot did not reach a pose for the tracker.
    #[error("a tracker pose was not reached")]
    Robot(#[from] calibench::cell::ManipulatorError),
    /// The calibration cannot be used for compensation.
    #[error("the calibration does not serve for compensating")]
    Task(#[from] TaskError),
}

/// Names of the methods.
const TRICAL: &str = "trical";
const TRACKER: &str = "tracker";

/// A calibration method and its results.
pub struct Method {
    /// `trical` or `tracker`.
    pub name: &'static str,
    /// Its measurements.
    pub dataset: Dataset,
    /// The calibration.
    pub calibration: Calibration,
    /// Errors on the validation poses.
    pub validation: Validation,
    /// Estimates compared with the truth.
    pub score: Score,
}

/// Results of a run.
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
    /// Postures of the true arm during the campaign.
    pub true_arm: TrueArm,
    /// The TriCal's dataset, calibration and validation.
    pub trical: Method,
    /// The tracker's dataset, calibration and validation.
    pub tracker: Method,
    /// Validation points.
    pub validation: Dataset,
    /// Errors of the nominal robot on the validation poses.
    pub before: Validation,
    /// Benefit of the TriCal's calibration: targets at the validation poses, uncompensated and compensated; `None` if none
    /// could be compensated.
    pub compensation: Option<Compensation>,
}

/// A check of a scenario's expectations.
#[derive(Debug, Clone, PartialEq)]
pub struct Check {
    /// Its name.
    pub name: &'static str,
    /// Value obtained.
    pub value: f64,
    /// Least and greatest expected value.
    pub band: [f64; 2],
}

impl Check {
    /// True if the value lies in its band.
    pub fn met(&self) -> bool {
        (self.band[0]..=self.band[1]).contains(&self.value)
    }
}

/// Measurements of a cell, for calibration and validation.
pub struct Measurements {
    /// The mastering.
    pub mastering: Mastering,
    /// The campaign, iteration by iteration.
    pub campaign: CampaignRecord,
    /// Data for the calibration: balls, and the points that the plan adds to them.
    pub fit: Dataset,
    /// Tracker points at the validation poses.
    pub validation: Dataset,
    /// True positions of the TCP at the validation poses, world, m: free of the tracker's noise.
    pub validation_truth: Vec<Vector3<f64>>,
}

/// Measures the cell of a scenario once, on the poses of `plans`, which serve every truth and every trial.
///
/// # Errors
/// When a stage cannot be completed.
pub fn measure_all(
    scenario: &Scenario,
    streams: Streams,
    plans: &Plans,
    observer: &mut dyn CampaignObserver,
) -> Result<Measurements, RunError> {
    let session = Session::begin(scenario, streams, plans.session_s(scenario))?;
    Ok(measured(&session, scenario, plans, observer)?.0)
}

/// Measures all balls and points for the TriCal and the validation; also returns the tracker, which is set up by then.
fn measured(
    session: &Session<'_>,
    scenario: &Scenario,
    plans: &Plans,
    observer: &mut dyn CampaignObserver,
) -> Result<(Measurements, SimulatedTracker), RunError> {
    let kind = scenario.instrument.kind;
    let (campaign, rival) = match kind {
        InstrumentKind::Trical | InstrumentKind::Offset => (session.probe(&plans.plan.probing, None, observer), Vec::new()),
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
    // Only plungers exert a force on the tool.
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

/// Methods by which a robot is calibrated in one trial.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Methods {
    /// TriCal and tracker, on the same robot.
    #[default]
    Both,
    /// The TriCal alone.
    Trical,
    /// The tracker alone.
    Tracker,
}

impl Methods {
    /// The name in tables and on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Methods::Both => "both",
            Methods::Trical => TRICAL,
            Methods::Tracker => TRACKER,
        }
    }

    /// The methods by this name.
    pub fn named(name: &str) -> Option<Self> {
        [Methods::Both, Methods::Trical, Methods::Tracker].into_iter().find(|m| m.name() == name)
    }

    /// The names of the methods, in the order in which they are carried out.
    pub fn each(self) -> &'static [&'static str] {
        match self {
            Methods::Both => &[TRICAL, TRACKER],
            Methods::Trical => &[TRICAL],
            Methods::Tracker => &[TRACKER],
        }
    }
}

/// A robot calibrated and judged: what a study keeps of a trial.
pub struct Trial {
    /// The campaign, iteration by iteration.
    pub campaign: CampaignRecord,
    /// Tracker points at the validation poses.
    pub validation: Dataset,
    /// The methods requested, each with the errors of the nominal robot on the validation poses, or the reason why it failed.
    pub methods: Vec<Result<(Method, Validation), RunError>>,
}

/// Calibrates and judges the robot of a scenario as [`run`] does, without the targets that `run` compensates. The cell is the
/// same whichever methods are requested, and so is the result of each.
///
/// # Errors
/// When the cell cannot be measured.
pub fn trial(scenario: &Scenario, plans: &Plans, streams: Streams, methods: Methods) -> Result<Trial, RunError> {
    let session = Session::begin(scenario, streams, plans.session_s(scenario))?;
    let (measured, set_up) = measured(&session, scenario, plans, &mut ())?;
    let Measurements { campaign, fit, validation, .. } = measured;
    let mut done = Vec::with_capacity(methods.each().len());
    if methods != Methods::Tracker {
        done.push(by_trical(scenario, fit, &validation, identify_without_indices));
    }
    if methods != Methods::Trical {
        let data = tracker_data(&session, scenario, plans, &set_up)?;
        done.push(by_tracker(scenario, data, &validation, identify_without_indices));
    }
    Ok(Trial { campaign, validation, methods: done })
}

/// Carries out the whole procedure.
///
/// # Errors
/// When a stage cannot be completed.
pub fn run(scenario: &Scenario, plans: Plans, streams: Streams, observer: &mut dyn CampaignObserver) -> Result<Run, RunError> {
    let session = Session::begin(scenario, streams, plans.session_s(scenario))?;
    session.note_true_arm();
    let (measured, set_up) = measured(&session, scenario, &plans, observer)?;
    let true_arm = session.true_arm();
    let Measurements { mastering, campaign, fit, validation, validation_truth } = measured;
    let tracker_data = tracker_data(&session, scenario, &plans, &set_up)?;
    let (trical, before) = by_trical(scenario, fit, &validation, identify)?;
    let (tracker, _) = by_tracker(scenario, tracker_data, &validation, identify)?;
    let Plans { plan, tracker: tracker_plan, .. } = plans;
    let mut compensator = Compensator::new(&trical.calibration, &Task { frame: WorkFrame::World, ..Task::default() })?;
    let targets = Targets { cell: &validation, plan: &tracker_plan, uncompensated: &validation_truth };
    let compensation = compensation(&session, &set_up, &mut compensator, &targets)?;
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

/// The points by which the tracker identifies, measured after those of the validation.
fn tracker_data(
    session: &Session<'_>,
    scenario: &Scenario,
    plans: &Plans,
    set_up: &SimulatedTracker,
) -> Result<Dataset, RunError> {
    let points = session.points(set_up, &plans.tracker.identification, "i", SampleSet::Fit)?;
    Ok(Dataset { samples: points.samples, ..scenario.dataset() })
}

/// From data and a model to a calibration.
type Identify = fn(&[NamedDataset<'_>], &Model) -> Result<Calibration, IdentifyError>;

fn by_trical(
    scenario: &Scenario,
    fit: Dataset,
    validation: &Dataset,
    identify: Identify,
) -> Result<(Method, Validation), RunError> {
    // Distances from an anchor carry no information on balls; a seat gives no readings.
    let by_gauge = matches!(scenario.instrument.kind, InstrumentKind::Trical | InstrumentKind::Offset);
    let model = if by_gauge { scenario.model.clone() } else { shown(&scenario.model, &fit) };
    let calibration = identify(&[NamedDataset::new(TRICAL, &fit)], &model)?;
    let score = Score::of(&calibration, scenario);
    judged(TRICAL, fit, calibration, score, validation)
}

fn by_tracker(
    scenario: &Scenario,
    data: Dataset,
    validation: &Dataset,
    identify: Identify,
) -> Result<(Method, Validation), RunError> {
    // The tracker's points carry no information on balls and indicators.
    let model = shown(&scenario.model, &data);
    let calibration = identify(&[NamedDataset::new(TRACKER, &data)], &model)?;
    let score = Score::of_tracker(&calibration, scenario);
    judged(TRACKER, data, calibration, score, validation)
}

/// A method with its errors on the validation poses, and those of its nominal robot.
fn judged(
    name: &'static str,
    dataset: Dataset,
    calibration: Calibration,
    score: Score,
    validation: &Dataset,
) -> Result<(Method, Validation), RunError> {
    let predictions = calibration.predict_beside_nominal(&[NamedDataset::new("validation", validation)], Use::Validation)?;
    // The plan has at least one validation pose.
    let errors = |p: &Prediction| Validation::of(p).unwrap_or_else(|| unreachable!("a prediction has samples"));
    let [validation, before] = predictions.each_ref().map(errors);
    Ok((Method { name, dataset, calibration, validation, score }, before))
}

impl Run {
    /// The value of a quantity that a scenario may put bounds on.
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
            Quantity::ReadingsMean => self.campaign.readings_mean(),
            Quantity::Chi2PerDof => self.trical.calibration.chi2_per_dof,
            Quantity::Within2Sigma => self.trical.score.within(2.0),
            Quantity::Within3Sigma => self.trical.score.within(3.0),
        }
    }

    /// Compares the scenario's expectations with the results.
    pub fn checks(&self, scenario: &Scenario) -> Vec<Check> {
        let check = |e: &Expectation| Check { name: e.quantity.name(), value: self.number(e.quantity), band: e.band };
        scenario.expect.iter().map(check).collect()
    }
}
