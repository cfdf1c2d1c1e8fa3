//! `measure --cell CELL --plan PLAN -o DATASET`: probes the balls of a real cell.

use std::fs::OpenOptions;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::{SystemTime, UNIX_EPOCH};

use calibench::cell::gauge::{PresetManner, Traffic};
use calibench::cell::kuka::KukaRobot;
use calibench::cell::{Guarded, LaterClock, Manipulator, Motion, MotionRecord};
use calibench::files::cannot_be_written;
use calibench::measure::{
    CalledOff, Campaign, CampaignRecord, CampaignSettings, Cell, CellGauge, CenteringController, Conditions, Dataset, Journal,
    JournalSession, Opened, PlannedPose, Witness, master, parts_by_payload, read_cell, read_plan, still_mastered,
};
use calibench::units::{DEG, MM};

use super::cell::disagreement_verdict;
use super::operator::Operator;
use super::progress::CampaignBar;
use super::rehearsal::rehearse;
use super::{Failure, Hardware, Interrupted, Outcome, print};
use crate::blame::with_reasons;
use crate::planning::wanted;

#[derive(clap::Args)]
pub struct CellArguments {
    /// Measure a real cell: its cell file, in place of a scenario
    #[arg(long, requires = "plan")]
    pub cell: Option<PathBuf>,
    /// Print every motion of the plan; connect to nothing and move nothing
    #[arg(long, requires = "cell")]
    pub dry_run: bool,
    /// Ask nobody: the robot may move, the master ball lies in the socket, and is taken away within 5 s of being used
    #[arg(long, requires = "cell")]
    yes: bool,
    /// The gauge is mastered and nothing touches it: take its readings as they are
    #[arg(long, requires = "cell")]
    mastered: bool,
    /// Robot, artifact or gauge were moved since the campaign was interrupted: what follows is a session of its own
    #[arg(long, requires = "resume")]
    moved: bool,
    /// Speed override in place of the cell's, %
    #[arg(long, requires = "cell", value_parser = clap::value_parser!(u8).range(1..=100))]
    speed: Option<u8>,
}

pub fn run(
    path: &Path,
    arguments: &CellArguments,
    plan: &Path,
    output: Option<&Path>,
    resume: bool,
) -> Result<Outcome, Failure> {
    let mut cell = read_cell(path)?;
    cell.speed_percent = arguments.speed.unwrap_or(cell.speed_percent);
    let planned = read_plan(plan, &cell.dataset)?;
    let poses = planned.poses;
    if arguments.dry_run {
        return rehearse(&cell, &poses);
    }
    let output = output.ok_or("say where to write the dataset: -o DATASET")?;
    let mut operator = Operator::new(arguments.yes)?;
    let under = Conditions::of(&poses, &cell.dataset)
        .and_settings("centring", &cell.centring)
        .and_settings("trical", &cell.trical)
        .and_settings("campaign", &CampaignSettings::default());
    let mut journal = match Journal::open(output, &under, resume)? {
        Opened::Ready(journal) => *journal,
        Opened::Finished { probings } => {
            print(&format!("nothing to do: the campaign is finished, its {probings} probings are in {}", output.display()))?;
            return Ok(Outcome::Done);
        }
    };
    let mut robot = cell.open_robot(operator.stop()).map_err(|e| hardware(&e))?;
    let mut gauges = open_gauges(&cell)?;
    let wall_clock_s = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0.0, |since| since.as_secs_f64());
    let from_s = journal.clock_s(wall_clock_s) - robot.clock_s();
    let session = ready(&cell, arguments, &mut operator, &mut gauges, &journal, || from_s + robot.clock_s())?;
    let free_reading = session.mastering.free_reading;
    prepare(&cell, &mut robot)?;
    let left = wanted(&poses).saturating_sub(journal.done_before());
    let question = format!("The robot will move: {left} probings at {} %. Is the cell clear?", cell.speed_percent);
    operator.ask(&question).map_err(|_| "called off; nothing moved")?;
    journal.begin_session(JournalSession { wall_clock_s: Some(wall_clock_s), ..session })?;
    let log = motion_log(output)?;
    let guarded = Guarded::new(LaterClock::new(&mut robot, from_s), cell.guards.clone(), operator.stop(), Box::new(log));
    let mut bar = CampaignBar::new(wanted(&poses));
    let campaign = ReadyCampaign { cell: &cell, poses: &poses, operator: &operator, free_reading };
    let record = campaign.run(guarded, &mut gauges, &mut journal, &mut bar);
    drop(bar);
    let interrupted =
        |why: String, journal: &Journal| Interrupted { why, kept: journal.probings(), journal: journal.path().into() };
    let record = record.map_err(|e| interrupted(e.to_string(), &journal))?;
    let dataset = Dataset { samples: record.samples.clone(), ..cell.dataset };
    print(&told(&record, wanted(&poses), &traffic_of(&robot, &gauges)))?;
    if let Some(abort) = &record.aborted {
        return Err(interrupted(abort.to_string(), &journal).into());
    }
    journal.finish(&dataset, &record, &poses).map_err(|e| interrupted(e.to_string(), &journal))?;
    print(&format!("dataset in {}", output.display()))?;
    Ok(Outcome::Done)
}

/// What was done in which time with how much talk.
fn told(record: &CampaignRecord, wanted: usize, traffic: &str) -> String {
    let time: f64 = record.probings.iter().map(|p| p.probing.duration_s).sum();
    format!(
        "{} of {wanted} planned probings measured, {:.2} s each; {traffic}",
        record.samples.len(),
        time / record.probings.len().max(1) as f64
    )
}

/// The indicators, asked who they are.
fn open_gauges(cell: &Cell) -> Result<[CellGauge; 3], Failure> {
    let mut gauges = cell.open_indicators().map_err(|e| hardware(&e))?;
    for (axis, gauge) in gauges.iter_mut().enumerate() {
        let named = |why: String| Hardware(format!("indicator {}: {why}", axis + 1));
        let identity = gauge.identify().map_err(|e| named(e.to_string()))?;
        // A campaign takes an hour, in which a battery that is low runs out.
        if identity.battery_low == Some(true) {
            return Err(named("its battery is low".into()).into());
        }
    }
    Ok(gauges)
}

/// The session that begins now: the gauge mastered, or found to be as it was mastered.
fn ready(
    cell: &Cell,
    arguments: &CellArguments,
    operator: &mut Operator,
    gauges: &mut [CellGauge; 3],
    journal: &Journal,
    mut clock_s: impl FnMut() -> f64,
) -> Result<JournalSession, Failure> {
    let before = journal.last_session();
    let known = before.map(|session| &session.mastering);
    let forgetful = (0..3).find(|&k| cell.indicators[k].settings.dialect.preset == PresetManner::Driver);
    let mut kept = |gauges: &mut [CellGauge; 3]| still_mastered(gauges, known, &cell.trical, &cell.mastering, &mut clock_s);
    let (mastering, mastering_kept) = match forgetful {
        Some(k) if arguments.mastered => {
            let why = "keeps no preset, so that each run must master it; leave --mastered out";
            return Err(format!("indicator {} {why}", k + 1).into());
        }
        None if arguments.mastered => (kept(gauges).map_err(|e| hardware(&e))?, before.is_some()),
        None if before.is_some()
            && let Ok(mastering) = kept(gauges) =>
        {
            (mastering, true)
        }
        _ => (master(gauges, operator, &cell.trical, &cell.mastering, clock_s).map_err(|e| hardware(&e))?, false),
    };
    let number = before.map_or(1, |session| session.number + usize::from(arguments.moved));
    Ok(JournalSession { number, mastering_kept, ..JournalSession::first(mastering) })
}

/// Controller and model are of one arm; speed and tool are set. Nothing has moved yet.
fn prepare(cell: &Cell, robot: &mut KukaRobot) -> Result<(), Failure> {
    let joints = robot.joints().map_err(|e| hardware(&e))?;
    let (distance, angle) = cell.disagreement(robot, &joints).map_err(|e| hardware(&e))?;
    if let Some(why) = disagreement_verdict(distance, angle) {
        let by = format!("by {:.1} mm and {:.2} deg", distance / MM, angle / DEG);
        return Err(Hardware(format!("the controller's arm is not the model's, {by}: {why}")).into());
    }
    robot.set_speed(cell.speed_percent).map_err(|e| hardware(&e))?;
    robot.set_tool(&cell.flange_from_tool()).map_err(|e| hardware(&e))?;
    Ok(())
}

/// All that is known before the first motion.
struct ReadyCampaign<'a> {
    cell: &'a Cell,
    poses: &'a [PlannedPose],
    operator: &'a Operator,
    free_reading: [f64; 3],
}

impl ReadyCampaign<'_> {
    /// Probes the balls, with the payload that the plan names first, then with the next.
    fn run<M: Manipulator>(
        &self,
        mut robot: M,
        gauges: &mut [CellGauge; 3],
        journal: &mut Journal,
        witness: &mut dyn Witness,
    ) -> Result<CampaignRecord, CalledOff> {
        let ReadyCampaign { cell, poses, operator, free_reading } = *self;
        let mut record = CampaignRecord::default();
        let parts = parts_by_payload(poses);
        for part in &parts {
            if parts.len() > 1 {
                let name = &cell.dataset.payloads[part.payload].name;
                operator.ask(&format!("Mount the payload '{name}' on the arm, if it is not there."))?;
            }
            let (gauges, centring) = (gauges.each_mut(), cell.centring.clone());
            let controller = CenteringController::new(&mut robot, gauges, cell.trical, free_reading, centring);
            let done = Campaign::new(controller, CampaignSettings::default()).run_journalled(&part.poses, journal, witness);
            if !record.add(part, done) {
                break;
            }
        }
        Ok(record)
    }
}

fn traffic_of(robot: &KukaRobot, gauges: &[CellGauge; 3]) -> String {
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

/// Writes every motion to `DATASET.motions.csv` beside the dataset, after those of earlier sessions.
fn motion_log(output: &Path) -> Result<impl FnMut(&MotionRecord) + use<>, Failure> {
    let mut path = output.as_os_str().to_owned();
    path.push(".motions.csv");
    let path = PathBuf::from(path);
    let mut file = OpenOptions::new().create(true).append(true).open(&path).map_err(|e| cannot_be_written(&path, &e))?;
    if file.metadata().map_err(|e| cannot_be_written(&path, &e))?.len() == 0 {
        writeln!(file, "time_s,duration_s,motion,target,error").map_err(|e| cannot_be_written(&path, &e))?;
    }
    Ok(move |record: &MotionRecord| {
        let (motion, target) = match &record.motion {
            Motion::Joints(q) => ("joints_deg", q.iter().map(|q| format!("{:.5}", q / DEG)).collect::<Vec<_>>()),
            Motion::Tool(offset) => ("tool_mm", offset.iter().map(|v| format!("{:.5}", v / MM)).collect()),
        };
        let error = record.error.as_ref().map(|e| e.to_string().replace('"', "'")).unwrap_or_default();
        let target = target.join(" ");
        // The journal holds what counts; a motion that cannot be logged stops nothing.
        drop(writeln!(file, "{:.3},{:.3},{motion},{target},\"{error}\"", record.time_s, record.duration_s));
    })
}

fn hardware(error: &(dyn std::error::Error + 'static)) -> Hardware {
    Hardware(with_reasons(error))
}
