//! Checks of simulated cells: how often a check finds what happened to a robot since its calibration, and names it.
//!
//! Each cell is sampled, measured and calibrated; then something happens to it, or nothing, and the sentinel poses are probed
//! again by the controller that probed them first, one after the other, until the check is settled.

use calibench::identify::calibration::IdentifyError;
use calibench::identify::identify;
use calibench::measure::campaign::CampaignObserver;
use calibench::measure::dataset::{Dataset, Measured, NamedDataset, Sample};
use calibench::measure::poses::{PlannedPose, ProbingPlan};
use calibench::monitoring::check::conditions::Condition;
use calibench::monitoring::check::{CheckError, CheckReference, choose_sentinels};
use calibench::robot::kinematics::world_from_tool;
use calibench::units::{DEG, MM};
use nalgebra::Vector3;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, UnitSphere};
use rayon::prelude::*;
use thiserror::Error;

use calibench_sim::mechanics::Parts;
use calibench_sim::plans::Plans;
use calibench_sim::random::Streams;
use calibench_sim::run::RunError;
use calibench_sim::scenario::Scenario;
use calibench_sim::session::Session;

/// Something that happens to a cell between its calibration and the check.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Fault {
    /// Nothing.
    None,
    /// The tool slips on the flange.
    Tool,
    /// The artifact is pushed, or the base settles.
    Artifact,
    /// One ball is knocked.
    Ball,
    /// One joint loses its zero.
    Joint,
    /// The arm is warmer.
    Warm,
    /// The flange carries another mass.
    Payload,
    /// One reading is bad.
    Sample,
}

impl Fault {
    /// All of them, and nothing.
    pub const ALL: [Fault; 8] =
        [Fault::None, Fault::Tool, Fault::Artifact, Fault::Ball, Fault::Joint, Fault::Warm, Fault::Payload, Fault::Sample];

    /// In words.
    pub fn words(self) -> &'static str {
        match self {
            Fault::None => "nothing",
            Fault::Tool => "tool slipped",
            Fault::Artifact => "artifact or base moved",
            Fault::Ball => "ball knocked",
            Fault::Joint => "joint lost its zero",
            Fault::Warm => "arm warmer",
            Fault::Payload => "another payload",
            Fault::Sample => "one bad reading",
        }
    }

    /// True if a condition is this fault.
    fn is(self, condition: &Condition) -> bool {
        matches!(
            (self, condition),
            (Fault::Tool, Condition::ToolMoved)
                | (Fault::Artifact, Condition::BaseMoved)
                | (Fault::Ball, Condition::BallMoved(_))
                | (Fault::Joint, Condition::JointSlipped(_))
                | (Fault::Warm, Condition::Warm)
                | (Fault::Payload, Condition::OtherPayload)
                | (Fault::Sample, Condition::SingleSample(_))
        )
    }
}

/// Reasons why a cell could not be checked.
#[derive(Debug, Error)]
pub enum ChecksError {
    /// The cell was not measured.
    #[error(transparent)]
    Run(#[from] RunError),
    /// The robot was not identified.
    #[error(transparent)]
    Identify(#[from] IdentifyError),
    /// The check failed.
    #[error(transparent)]
    Check(#[from] CheckError),
    /// A sentinel is not in the plan.
    #[error("the plan has no pose '{0}'")]
    NoPose(String),
}

/// The outcome of one check.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome {
    /// The injected fault.
    pub fault: Fault,
    /// True if the check reported a change.
    pub found: bool,
    /// True if it named what happened, or something that its poses cannot distinguish from it.
    pub named: bool,
    /// The condition that the check named, if it named another.
    pub mistaken_for: Option<String>,
    /// Number of poses probed.
    pub used: usize,
}

/// Settings of a study.
#[derive(Debug, Clone, Copy)]
pub struct Checks {
    /// Number of sentinel poses.
    pub sentinels: usize,
    /// Root mean square displacement of the sentinels by a fault, in units of the noise of one comparison. That of another
    /// payload is what one kilogram makes of it.
    pub size: f64,
    /// Seed.
    pub seed: u64,
}

impl Checks {
    /// Checks that many cells: one in ten with each fault, the others unchanged.
    ///
    /// # Errors
    /// When a cell cannot be measured, calibrated or checked.
    pub fn run(&self, scenario: &Scenario, cells: usize) -> Result<Vec<Outcome>, ChecksError> {
        let plans = Plans::new(scenario, self.seed).map_err(RunError::from)?;
        let fault = |k: usize| Fault::ALL[if k % 10 < Fault::ALL.len() { k % 10 } else { 0 }];
        (0..cells).into_par_iter().map(|k| self.cell(scenario, &plans, 1 + k as u64, fault(k))).collect()
    }

    fn cell(&self, scenario: &Scenario, plans: &Plans, trial: u64, fault: Fault) -> Result<Outcome, ChecksError> {
        let streams = Streams { seed: self.seed, trial };
        let session_s = plans.session_s(scenario);
        let session = Session::begin(scenario, streams, session_s).map_err(RunError::from)?;
        let cell = Dataset { contact_force: scenario.indicators.contact_force(), ..scenario.dataset() };
        let dataset = |samples: Vec<Sample>| Dataset { samples, ..cell.clone() };
        let campaign = session.probe(&plans.plan.probing, None, &mut ());
        if let Some(abort) = campaign.aborted {
            return Err(RunError::from(abort).into());
        }
        let campaign = dataset(campaign.samples);
        let calibration = identify(&[NamedDataset::new("cell", &campaign)], &scenario.model)?;
        let chosen = choose_sentinels(&calibration, NamedDataset::new("cell", &campaign), self.sentinels)?;
        let ids: Vec<String> = chosen.iter().map(|&k| campaign.samples[k].id.clone()).collect();
        let sentinels = plans.plan.probing.of_poses(&ids).map_err(|id| ChecksError::NoPose(id.to_owned()))?;

        let mut random = streams.stream("faults");
        // The noise of a comparison, as the check itself takes it: here of the campaign with itself.
        let same = dataset(chosen.iter().map(|&k| campaign.samples[k].clone()).collect());
        let reference = CheckReference::new(&calibration, NamedDataset::new("cell", &campaign))?;
        let noises = reference.noise(NamedDataset::new("cell", &same))?;
        let noise = noises.iter().sum::<f64>() / noises.len().max(1) as f64;
        let wanted = self.size * noise * 3f64.sqrt();
        let drawn = Drawn::of(fault, &cell, &sentinels, &mut random);
        let bad = (fault == Fault::Sample).then(|| {
            let direction: [f64; 3] = UnitSphere.sample(&mut random);
            let whole = wanted * (ids.len() as f64).sqrt();
            (ids[random.random_range(0..ids.len())].clone(), Vector3::from(direction) * whole)
        });
        let alter = |parts: &mut Parts| drawn.happen(parts, &sentinels, wanted);
        let session = Session::visit(scenario, streams, session_s, 1, alter).map_err(RunError::from)?;
        let mut observer = UntilSettled { reference: &reference, campaign: &campaign, bad };
        let record = session.probe(&sentinels, None, &mut observer);
        let samples = spoilt(&record.samples, observer.bad.as_ref());
        let used = samples.len();
        let check = reference.check(NamedDataset::new("cell", &dataset(samples)))?;
        let named = check.named().is_some_and(|first| fault.is(&first.condition) || check.aliased.iter().any(|c| fault.is(c)));
        let mistaken_for = check.named().filter(|_| !named).map(|first| first.condition.name());
        Ok(Outcome { fault, found: check.changed, named, mistaken_for, used })
    }
}

/// Ends a check when it is settled.
struct UntilSettled<'a> {
    reference: &'a CheckReference<'a>,
    campaign: &'a Dataset,
    bad: Option<(String, Vector3<f64>)>,
}

impl CampaignObserver for UntilSettled<'_> {
    fn choose(&mut self, _: &[&PlannedPose], samples: &[Sample]) -> Option<usize> {
        let now = Dataset { samples: spoilt(samples, self.bad.as_ref()), ..self.campaign.clone() };
        let check = self.reference.check(NamedDataset::new("cell", &now));
        if check.is_ok_and(|check| check.settled) { None } else { Some(0) }
    }
}

/// The samples, one of them with a bad reading.
fn spoilt(samples: &[Sample], bad: Option<&(String, Vector3<f64>)>) -> Vec<Sample> {
    let mut samples = samples.to_vec();
    if let Some((id, by)) = bad
        && let Some(sample) = samples.iter_mut().find(|s| s.id == *id)
        && let Measured::Ball { reading, .. } = &mut sample.measured
    {
        *reading = Some(reading.unwrap_or_default() + by);
    }
    samples
}

/// A fault of unit size.
struct Drawn {
    fault: Fault,
    /// Its direction.
    along: Vector3<f64>,
    turn: Vector3<f64>,
    /// The ball or joint concerned.
    which: usize,
}

impl Drawn {
    fn of(fault: Fault, cell: &Dataset, sentinels: &ProbingPlan, random: &mut ChaCha8Rng) -> Self {
        let along: [f64; 3] = UnitSphere.sample(random);
        let turn: [f64; 3] = UnitSphere.sample(random);
        // A ball that no sentinel probes is not checked.
        let which = match fault {
            Fault::Ball => sentinels.poses[random.random_range(0..sentinels.poses.len())].ball.unwrap_or(0),
            _ => random.random_range(0..cell.robot.joints()),
        };
        Drawn { fault, along: Vector3::from(along), turn: Vector3::from(turn), which }
    }

    /// Alters the parts so that the sentinels are displaced by `wanted`, rms, m.
    fn happen(&self, parts: &mut Parts, sentinels: &ProbingPlan, wanted: f64) {
        if self.fault == Fault::Payload {
            parts.payload.mass += 1.0;
            return;
        }
        let seen = |parts: &Parts| -> Vec<Vector3<f64>> {
            let place = |pose: &PlannedPose| {
                let ball = &parts.balls[pose.ball?];
                let tool = world_from_tool(&parts.robot, &parts.nominal.base, &parts.tool, &pose.contact).translation.vector;
                Some(tool - ball.centre)
            };
            sentinels.poses.iter().filter_map(place).collect()
        };
        let before = seen(parts);
        let mut probe = parts.clone();
        self.by(&mut probe, 1.0);
        let after = seen(&probe);
        let squares: f64 = before.iter().zip(&after).map(|(b, a)| (a - b).norm_squared()).sum();
        let rms = (squares / before.len().max(1) as f64).sqrt();
        if rms > 0.0 {
            self.by(parts, wanted / rms);
        }
    }

    /// Applies `size` units: tenths of a millimetre, of a milliradian or of a degree, or 10 ppm.
    fn by(&self, parts: &mut Parts, size: f64) {
        let shift = self.along * (0.1 * MM * size);
        match self.fault {
            Fault::Tool => parts.tool.xyz = (Vector3::from(parts.tool.xyz) + shift).into(),
            Fault::Artifact => {
                let count = parts.balls.len().max(1) as f64;
                let middle = parts.balls.iter().map(|b| b.centre).sum::<Vector3<f64>>() / count;
                for ball in &mut parts.balls {
                    let turned = (self.turn * (1e-4 * size)).cross(&(ball.centre - middle));
                    ball.centre += shift + turned;
                }
            }
            Fault::Ball => parts.balls[self.which].centre += shift,
            Fault::Joint => parts.robot.links[self.which].mdh.theta += 0.01 * DEG * size,
            Fault::Warm => parts.robot.links.iter_mut().for_each(|link| {
                link.mdh.a *= 1.0 + 1e-5 * size;
                link.mdh.d *= 1.0 + 1e-5 * size;
            }),
            Fault::None | Fault::Payload | Fault::Sample => {}
        }
    }
}

/// A row of the table of a study.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Row {
    /// The injected fault.
    pub fault: Fault,
    /// Number of checks.
    pub checks: usize,
    /// Number that reported a change.
    pub found: usize,
    /// Number that named it.
    pub named: usize,
    /// Mean number of poses probed.
    pub used: f64,
}

/// The outcomes by fault.
pub fn table(outcomes: &[Outcome]) -> Vec<Row> {
    let row = |&fault: &Fault| {
        let own: Vec<&Outcome> = outcomes.iter().filter(|o| o.fault == fault).collect();
        let count = |of: fn(&Outcome) -> bool| own.iter().filter(|o| of(o)).count();
        let used = own.iter().map(|o| o.used as f64).sum::<f64>() / own.len().max(1) as f64;
        Row { fault, checks: own.len(), found: count(|o| o.found), named: count(|o| o.named), used }
    };
    Fault::ALL.iter().map(row).collect()
}
