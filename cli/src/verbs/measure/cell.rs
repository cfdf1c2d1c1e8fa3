//! `measure --cell CELL --plan PLAN -o DATASET`: probes the balls of a real cell.

use std::path::{Path, PathBuf};
use std::time::{SystemTime, UNIX_EPOCH};

use calibench::cell::gauge::CellGauge;
use calibench::cell::gauge::Traffic;
use calibench::cell::guards::Guarded;
use calibench::cell::replay::OffsetClock;
use calibench::cell::{Driver, Manipulator};
use calibench::measure::campaign::cell::{Cell, read_cell};
use calibench::measure::campaign::journal::{Journal, JournalSession, OpenedJournal};
use calibench::measure::campaign::mastering::CalledOff;
use calibench::measure::campaign::{
    Aim, Campaign, CampaignObserver, CampaignRecord, CampaignSettings, Conditions, parts_by_payload,
};
use calibench::measure::centring::CenteringController;
use calibench::measure::dataset::Dataset;
use calibench::measure::poses::ways::ArmAt;
use calibench::measure::poses::{ProbingPlan, read_plan};
use calibench::measure::session::{Devices, FirstMotion, GaugeState, guard_conditions, preflight, start_session};
use calibench::planning::aim::FirstContacts;
use calibench_rehearsal::{Sources, Watch};

use super::devices::{motion_log, open_gauges, prepare, watched};
use super::points::{self, PointsAsked};
use super::rehearsal::rehearse;
use crate::arguments::choosing::{Choice, Chosen, finished};
use crate::terminal::failure::{Failure, Interrupted, Outcome, PROBINGS, hardware, not_started};
use crate::terminal::operator::{OperatedArguments, Operator};
use crate::terminal::output::{note, print_answer, tell, warn};
use crate::terminal::progress::CampaignBar;
use crate::terminal::streams::{input, output};

#[derive(clap::Args)]
pub struct CellArguments {
    /// Cell file of a real cell to measure, instead of a scenario
    #[arg(long, requires = "plan")]
    pub cell: Option<PathBuf>,
    /// Print every motion of the plan without connecting to or moving anything
    #[arg(long, requires = "cell")]
    pub dry_run: bool,
    /// Output page: the motions as a film, the least clearance of each body, and what was not checked
    #[arg(long, value_name = "PAGE", requires = "dry_run", value_parser = output())]
    film: Option<PathBuf>,
    /// Station file with the instrument that measures the points of the plan, in place of a gauge on balls
    #[arg(long, value_name = "STATION", requires = "cell", value_parser = input())]
    pub instrument: Option<PathBuf>,
    /// Serve a page on the loopback address on which the measurement is watched and can be stopped; its address is printed.
    /// PORT 0, the default, takes a free one
    #[arg(long, value_name = "PORT", requires = "cell", num_args = 0..=1, default_missing_value = "0")]
    watch: Option<u16>,
    #[command(flatten)]
    pub operated: OperatedArguments,
    /// Start a new session: robot, artifact or gauge were moved since the campaign was interrupted
    #[arg(long, requires = "resume")]
    moved: bool,
    /// Continue although guards or speed of the cell were changed since the campaign was interrupted
    #[arg(long, requires = "resume")]
    accept_changes: bool,
}

pub fn run(
    path: &Path,
    arguments: &CellArguments,
    plan: &Path,
    output: Option<&Path>,
    resume: bool,
    choice: Choice<'_>,
) -> Result<Outcome, Failure> {
    let mut cell = read_cell(path)?;
    cell.speed_percent = arguments.operated.speed.unwrap_or(cell.speed_percent);
    let planned = read_plan(plan, &cell.dataset)?;
    if arguments.dry_run {
        let sources = Sources { cell: path.display().to_string(), plan: plan.display().to_string() };
        return rehearse(&cell, &planned, arguments.film.as_deref(), &sources);
    }
    preflight(&cell, &planned).map_err(|e| format!("{}: {e}", plan.display()))?;
    let output = output.ok_or("say where to write the dataset: -o DATASET")?;
    if planned.poses.iter().any(|pose| pose.ball.is_none()) {
        let station = arguments.instrument.as_deref();
        return points::run(
            &cell,
            &planned,
            &PointsAsked {
                station,
                yes: arguments.operated.yes,
                output,
                resume,
                moved: arguments.moved,
                watch: arguments.watch,
            },
        );
    }
    if arguments.instrument.is_some() {
        return Err(format!("{}: is a plan of probings; `plan CELL --points N` makes one of points", plan.display()).into());
    }
    let mut operator = Operator::new(arguments.operated.yes)?;
    let poses = &planned.poses;
    let under = Conditions::of(poses, &cell.dataset)
        .and_settings("centring", &cell.centring)
        .and_settings("trical", &cell.trical)
        .and_settings("campaign", &CampaignSettings::default())
        .and_settings("guards", &guard_conditions(&cell))
        .and("robot.speed_percent", cell.speed_percent);
    let under = choice.on(under);
    let silent = choice.silent;
    let Some(mut journal) = open_journal(output, &under, arguments, &operator, resume, silent)? else {
        return Ok(Outcome::Done);
    };
    let mut robot = cell.open_robot(operator.stop()).map_err(|e| hardware(&e))?;
    let mut gauges = open_gauges(&cell)?;
    let wall_clock_s = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0.0, |since| since.as_secs_f64());
    if let Some(jump) = journal.clock_jump(wall_clock_s) {
        warn(&format!("warning: {jump}"));
    }
    let from_s = journal.clock_s(wall_clock_s) - robot.clock_s();
    prepare(&cell, robot.as_mut())?;
    let joints = robot.joints().map_err(|e| hardware(&e))?;
    let first = FirstMotion::from(&cell, &planned, &joints).map_err(not_started)?;
    if let Some(words) = &first.words {
        tell(words);
    }
    let left = planned.wanted().saturating_sub(journal.done_before());
    let watch = Watch::new(&cell.dataset, &planned, PROBINGS, Some(cell.centring.tolerance), operator.stop());
    let watch = arguments.watch.map(|port| watched(watch, port)).transpose()?;
    let question = format!("The robot will move: {left} probings at {} %. Is the cell clear?", cell.speed_percent);
    operator.ask(&question).map_err(|_| "cancelled; nothing moved")?;
    let log = motion_log(output)?;
    let mut guarded =
        Guarded::new(OffsetClock::new(robot.as_mut(), from_s), cell.guards.clone(), operator.stop(), Box::new(log));
    let before = GaugeState { session: journal.last_session(), mastered: arguments.operated.mastered, moved: arguments.moved };
    let devices = Devices { robot: &mut guarded, gauges: &mut gauges };
    let (session, stands) = start_session(&cell, &planned, first, &before, &mut operator, devices).map_err(not_started)?;
    let free_reading = session.mastering.free_reading;
    journal.begin_session(JournalSession { wall_clock_s: Some(wall_clock_s), ..session })?;
    let mut bar = Chosen { bar: CampaignBar::new(planned.wanted()), choose: choice.choose, watch };
    let campaign = ReadyCampaign { cell: &cell, plan: &planned, operator: &operator, free_reading };
    let record = campaign.run(guarded, stands, &mut gauges, &mut journal, &mut bar);
    drop(bar);
    let interrupted = |why: String, journal: &Journal| Interrupted {
        why,
        what: PROBINGS,
        kept: journal.probings(),
        journal: journal.path().into(),
    };
    let record = record.map_err(|e| interrupted(e.to_string(), &journal))?;
    let dataset = Dataset { samples: record.samples.clone(), ..cell.dataset };
    if !silent {
        print_answer(summary(&record, planned.wanted(), &traffic_of(robot.as_ref(), &gauges)))?;
    }
    if let Some(abort) = &record.aborted {
        // A probing that was broken off is made again, and does not count.
        return Err(Interrupted { kept: record.samples.len(), ..interrupted(abort.to_string(), &journal) }.into());
    }
    journal.finish(&dataset, &record, poses).map_err(|e| interrupted(e.to_string(), &journal))?;
    if !silent {
        print_answer(format!("dataset in {}", output.display()))?;
    }
    Ok(Outcome::Done)
}

/// Opens the journal to continue with; `None` if the campaign is finished. Asks for confirmation if guards or speed have
/// changed since.
fn open_journal(
    output: &Path,
    under: &Conditions,
    arguments: &CellArguments,
    operator: &Operator,
    resume: bool,
    silent: bool,
) -> Result<Option<Journal>, Failure> {
    let case = match Journal::open(output, under, resume)? {
        OpenedJournal::Changed { what } => {
            let changed = format!("since the campaign was interrupted {}", what.join("; "));
            if arguments.accept_changes {
                note(&format!("{changed}: accepted"));
            } else if arguments.operated.yes {
                return Err(format!("{changed}; give --accept-changes to continue with the change, or undo it").into());
            } else {
                let question = format!("{changed}. Continue with the change?");
                operator.ask(&question).map_err(|_| "cancelled; nothing moved")?;
            }
            Journal::open_changed(output, under)?
        }
        case => case,
    };
    match case {
        OpenedJournal::Ready(journal) => Ok(Some(*journal)),
        OpenedJournal::Finished { probings } => {
            if !silent {
                print_answer(finished(probings, output))?;
            }
            Ok(None)
        }
        OpenedJournal::Changed { what } => Err(format!("changed again meanwhile: {}", what.join("; ")).into()),
        other => Err(format!("{}: the campaign cannot go on from {other:?}", output.display()).into()),
    }
}

/// Summary of a campaign: probings done, their time, and the bytes exchanged.
fn summary(record: &CampaignRecord, wanted: usize, traffic: &str) -> String {
    let centred = record.probings.iter().filter(|p| p.probing.outcome.is_ok());
    let times: Vec<f64> = centred.map(|p| p.probing.duration_s).collect();
    let each = if times.is_empty() {
        String::new()
    } else {
        format!(", {:.2} s each", times.iter().sum::<f64>() / times.len() as f64)
    };
    format!("{} of {wanted} planned probings measured{each}; {traffic}", record.samples.len())
}

/// The campaign's state before the first motion.
struct ReadyCampaign<'a> {
    cell: &'a Cell,
    plan: &'a ProbingPlan,
    operator: &'a Operator,
    free_reading: [f64; 3],
}

impl ReadyCampaign<'_> {
    /// Probes the balls with each payload in the order of the plan, and goes home.
    fn run<M: Manipulator>(
        &self,
        mut robot: M,
        mut stands: ArmAt,
        gauges: &mut [CellGauge; 3],
        journal: &mut Journal,
        observer: &mut dyn CampaignObserver,
    ) -> Result<CampaignRecord, CalledOff> {
        let ReadyCampaign { cell, plan, operator, free_reading } = *self;
        let mut record = CampaignRecord::default();
        let mut aim: Option<Box<dyn Aim>> = Some(Box::new(FirstContacts::new(&cell.dataset, &plan.poses)));
        let parts = parts_by_payload(&plan.poses);
        for (k, part) in parts.iter().enumerate() {
            if parts.len() > 1 {
                if k > 0 {
                    stands = self.go_home(&mut robot, stands);
                }
                let name = &cell.dataset.payloads[part.payload].name;
                operator.ask(&format!("Mount the payload '{name}' on the arm, if it is not there."))?;
            }
            let (gauges, centring) = (gauges.each_mut(), cell.centring.clone());
            let controller = CenteringController::new(&mut robot, gauges, cell.trical, free_reading, centring);
            let mut campaign = Campaign::new(controller, CampaignSettings::default()).aiming(aim);
            if let Some(ways) = &plan.ways {
                campaign = campaign.by(ways.clone(), stands);
            }
            let done = campaign.run_journalled(&part.poses, journal, observer);
            stands = campaign.stands().clone();
            aim = campaign.take_aim();
            if !record.add(part, done) {
                return Ok(record);
            }
        }
        self.go_home(&mut robot, stands);
        Ok(record)
    }

    /// Goes home and returns the posture in which the arm then is. A refusal does not lose the measurements.
    fn go_home(&self, robot: &mut impl Manipulator, stands: ArmAt) -> ArmAt {
        let (Some(ways), ArmAt::Approach(at)) = (&self.plan.ways, &stands) else { return stands };
        match robot.move_along(&ways.home_from(at)) {
            Ok(()) => ArmAt::Home,
            Err(error) => {
                warn(&format!("warning: the arm did not go home: {error}"));
                ArmAt::Unknown
            }
        }
    }
}

fn traffic_of(robot: &dyn Driver, gauges: &[CellGauge; 3]) -> String {
    let robot = robot.traffic();
    let gauges = gauges.iter().map(CellGauge::traffic).fold(Traffic::default(), |sum, traffic| Traffic {
        sent: sum.sent + traffic.sent,
        received: sum.received + traffic.received,
    });
    format!(
        "bytes sent and received: robot {} and {}, indicators {} and {}",
        robot.sent, robot.received, gauges.sent, gauges.received
    )
}
