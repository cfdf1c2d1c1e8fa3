//! `measure --cell CELL --plan PLAN --instrument STATION -o DATASET`: points of an instrument, in the poses of a plan.

use std::path::Path;

use calibench::cell::guards::Guarded;
use calibench::files::FileError;
use calibench::files::disk::check_output_folder;
use calibench::measure::campaign::cell::Cell;
use calibench::measure::campaign::{Conditions, parts_by_payload};
use calibench::measure::dataset::file::{DATASET_TOML, write_dataset};
use calibench::measure::dataset::{Measured, Sample};
use calibench::measure::poses::{PlannedPose, ProbingPlan};
use calibench::measure::session::FirstMotion;
use calibench::units::MM;
use calibench_readout::{
    CampaignStop, CampaignWatcher, Instrument, JointUnit, Journal, PointCampaign, Row, dataset_of, read_station,
};
use calibench_rehearsal::Watch;

use super::devices::{motion_log, prepare, watched};
use crate::terminal::failure::{Failure, Interrupted, Outcome, hardware, not_started};
use crate::terminal::operator::Operator;
use crate::terminal::output::{print_answer, tell};
use crate::terminal::progress::Waiting;

/// What is measured.
const POINTS: &str = "points";

/// A campaign of points that is asked for.
pub struct PointsAsked<'a> {
    /// The station file of the instrument.
    pub station: Option<&'a Path>,
    /// True if nothing is asked.
    pub yes: bool,
    /// The dataset.
    pub output: &'a Path,
    /// True if an interrupted campaign goes on.
    pub resume: bool,
    /// True if something was moved since it was interrupted.
    pub moved: bool,
    /// Port of the page on which it is watched, if it is.
    pub watch: Option<u16>,
}

pub fn run(cell: &Cell, plan: &ProbingPlan, asked: &PointsAsked<'_>) -> Result<Outcome, Failure> {
    let PointsAsked { output, resume, .. } = *asked;
    let Some(station) = asked.station else {
        return Err("the plan is of points; give --instrument STATION, with the instrument that measures them".into());
    };
    let settings = read_station(station)?.instrument;
    let settings = settings.ok_or_else(|| {
        let remedy = "add [instrument] with `address` or `listen`";
        FileError::whole(station, "has no instrument that is connected", remedy)
    })?;
    if parts_by_payload(&plan.poses).len() > 1 || plan.poses.iter().any(|pose| pose.ball.is_some()) {
        return Err("the plan mixes points with probings, or payloads; make one plan of each".into());
    }
    check_output_folder(output, "dataset", DATASET_TOML)?;
    if output.join(DATASET_TOML).exists() {
        let remedy = "give another output, or move it away";
        return Err(FileError::whole(output, "holds a dataset already, which is complete", remedy).into());
    }
    if asked.moved {
        let remedy = "measure what follows the move into another dataset, and give both to `calibrate`";
        return Err(format!("--moved is for a gauge, which is mastered again; {remedy}").into());
    }
    let operator = Operator::new(asked.yes)?;
    let under = Conditions::of(&plan.poses, &cell.dataset);
    let under = settings.added_to(under);
    let units = vec![JointUnit::Rad; cell.dataset.robot.joints()];
    let mut robot = cell.open_robot(operator.stop()).map_err(|e| hardware(&e))?;
    let mut instrument = Instrument::open(settings).map_err(|e| hardware(&e))?;
    prepare(cell, robot.as_mut())?;
    let joints = robot.joints().map_err(|e| hardware(&e))?;
    let first = FirstMotion::from(cell, plan, &joints).map_err(not_started)?;
    if let Some(words) = &first.words {
        tell(words);
    }
    let mut journal = Journal::open(output, &units, Some(&under), resume)?;
    let waiting = plan.wanted().saturating_sub(journal.rows().len());
    let watch = Watch::new(&cell.dataset, plan, POINTS, None, operator.stop());
    let watch = asked.watch.map(|port| watched(watch, port)).transpose()?;
    let question = format!("The robot will move: {waiting} points at {} %. Is the cell clear?", cell.speed_percent);
    if operator.ask(&question).is_err() {
        journal.discard_empty()?;
        return Err("cancelled; nothing moved".into());
    }
    let log = motion_log(output)?;
    let mut robot = Guarded::new(robot.as_mut(), cell.guards.clone(), operator.stop(), Box::new(log));
    let stands = first.make(&mut robot).map_err(not_started)?;
    let mut campaign = PointCampaign { plan, cell: &cell.dataset, stop: operator.stop(), stands };
    let mut shown = Shown { waiting: Waiting::new(""), done: journal.rows().len(), wanted: plan.wanted(), watch };
    let ended = campaign.run(&mut robot, &mut instrument, &mut journal, &mut shown);
    drop(shown);
    let (kept, path) = (journal.rows().len(), journal.path().to_owned());
    let interrupted = |why: String| Interrupted { why, what: POINTS, kept, journal: path.clone() };
    let missed = match ended {
        Ok(missed) => missed,
        // Nothing of it can be used.
        Err(why @ CampaignStop::Nonsense { .. }) => {
            journal.discard()?;
            return Err(why.to_string().into());
        }
        Err(why) => return Err(interrupted(why.to_string()).into()),
    };
    if kept == 0 {
        journal.discard()?;
        return Err("nothing was measured".into());
    }
    let dataset = dataset_of(&cell.dataset, plan, journal.rows());
    write_dataset(&dataset, output).map_err(|e| interrupted(e.to_string()))?;
    journal.discard()?;
    let without = if missed.is_empty() { String::new() } else { format!("; without a point: {}", missed.join(", ")) };
    print_answer(format!("{kept} of {} points measured{without}; dataset in {}", plan.wanted(), output.display()))?;
    print_answer(format!("Next: `calibench calibrate {} -o FOLDER`.", output.display()))?;
    Ok(Outcome::Done)
}

/// What is shown while points are measured.
struct Shown {
    waiting: Waiting,
    done: usize,
    wanted: usize,
    watch: Option<Watch>,
}

impl CampaignWatcher for Shown {
    fn goes_to(&mut self, pose: &PlannedPose) {
        self.watch.iter().for_each(|watch| watch.goes_to(pose, 1, None));
        self.waiting.now(format!("{} of {}: {}", self.done + 1, self.wanted, pose.id));
    }

    fn measured(&mut self, pose: &PlannedPose, row: &Row) {
        self.done += 1;
        let sample = Sample::new(&*pose.id, row.q.clone(), Measured::Point(row.point_m.into()));
        self.watch.iter().for_each(|watch| watch.measured(pose, Some(&sample), None));
        let [x, y, z] = row.point_m.map(|x| x / MM);
        self.waiting.now(format!("{} of {}: point {x:.3}, {y:.3}, {z:.3} mm", self.done, self.wanted));
    }

    fn missed(&mut self, pose: &PlannedPose, why: &str) {
        self.watch.iter().for_each(|watch| watch.measured(pose, None, Some(why.to_owned())));
        self.waiting.warn(&format!("warning: no point in pose '{}': {why}", pose.id));
    }
}
