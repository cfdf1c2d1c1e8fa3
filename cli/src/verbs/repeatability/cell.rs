//! `cell repeatability --cell CELL --plan PLAN`: the same at a real cell, at the postures of a plan for it.

use std::path::{Path, PathBuf};

use calibench::cell::Manipulator;
use calibench::cell::guards::{Guarded, MotionRecord};
use calibench::measure::campaign::cell::{Cell, read_cell};
use calibench::measure::campaign::repeatability::{RepeatabilitySettings, Station, StationRecord};
use calibench::measure::centring::{CenteringController, ProbingFailure};
use calibench::measure::poses::ways::{ArmAt, HomeWays};
use calibench::measure::poses::{PlannedPose, read_plan};
use calibench::measure::session::{Devices, FirstMotion, GaugeState, preflight, start_session};

use crate::terminal::failure::Failure;
use crate::terminal::failure::{hardware, not_started};
use crate::terminal::operator::{OperatedArguments, Operator};
use crate::terminal::output::tell;
use crate::terminal::streams::input;
use crate::verbs::measure::devices::{open_gauges, prepare};
use calibench_sim::repeatability::{RepeatabilityError, Visited, most_telling};

#[derive(clap::Args)]
pub struct CellArguments {
    /// Cell file of a real cell to measure, instead of a scenario
    #[arg(long, requires = "plan")]
    pub cell: Option<PathBuf>,
    /// Plan of the cell that supplies postures and ways
    #[arg(long, requires = "cell", value_parser = input())]
    pub plan: Option<PathBuf>,
    #[command(flatten)]
    operated: OperatedArguments,
}

/// The requested measurement.
pub struct Asked<'a> {
    /// Numbers of returns and reversals.
    pub settings: &'a RepeatabilitySettings,
    /// Balls by name; all if none is named.
    pub named: &'a [String],
    /// Number of postures on each ball.
    pub postures: usize,
}

/// Visits postures of the plan and goes home.
pub fn at_cell(path: &Path, plan: &Path, arguments: &CellArguments, asked: &Asked<'_>) -> Result<(Cell, Visited), Failure> {
    let mut cell = read_cell(path)?;
    cell.speed_percent = arguments.operated.speed.unwrap_or(cell.speed_percent);
    let planned = read_plan(plan, &cell.dataset)?;
    let Some(ways) = planned.ways.clone() else {
        let remedy = "plan again with `calibench plan CELL`";
        return Err(format!(
            "{}: contains no ways home, by which the arm gets from posture to posture; {remedy}",
            plan.display()
        )
        .into());
    };
    let stations = stations(&cell, &planned.poses, asked)?;
    preflight(&cell, &planned).map_err(|e| format!("{}: {e}", plan.display()))?;
    let mut operator = Operator::new(arguments.operated.yes)?;
    let mut robot = cell.open_robot(operator.stop()).map_err(|e| hardware(&e))?;
    let mut gauges = open_gauges(&cell)?;
    prepare(&cell, robot.as_mut())?;
    let joints = robot.joints().map_err(|e| hardware(&e))?;
    let first = FirstMotion::from(&cell, &planned, &joints).map_err(not_started)?;
    if let Some(words) = &first.words {
        tell(words);
    }
    let count = stations.len();
    let question = format!(
        "The robot will go back to each of {count} postures again and again at {} %. Is the cell clear?",
        cell.speed_percent
    );
    operator.ask(&question).map_err(|_| "cancelled; nothing moved")?;
    let mut guarded = Guarded::new(robot.as_mut(), cell.guards.clone(), operator.stop(), Box::new(|_: &MotionRecord| ()));
    let before = GaugeState { session: None, mastered: arguments.operated.mastered, moved: false };
    let devices = Devices { robot: &mut guarded, gauges: &mut gauges };
    let (session, stands) = start_session(&cell, &planned, first, &before, &mut operator, devices).map_err(not_started)?;
    let mut tour = Tour { ways: &ways, stands };
    let mut records = Vec::with_capacity(count);
    for station in &stations {
        records.push(tour.visit(
            &cell,
            station,
            Devices { robot: &mut guarded, gauges: &mut gauges },
            session.mastering.free_reading,
            asked.settings,
        )?);
    }
    tour.home(&mut guarded)?;
    Ok((cell, Visited::of(records)))
}

/// The most informative postures of the plan.
fn stations(cell: &Cell, poses: &[PlannedPose], asked: &Asked<'_>) -> Result<Vec<Station>, Failure> {
    let model = &cell.dataset;
    let balls = places(&model.ball_ids(), asked.named)?;
    let first = poses.first().map_or(0, |pose| pose.payload);
    let usable = poses
        .iter()
        .filter(|pose| pose.payload == first && pose.reverses.is_none() && pose.ball.is_some_and(|b| balls.contains(&b)));
    let all = usable.map(|pose| Station::new(&model.robot, &model.base, &model.tool, pose.clone())).collect();
    let mut chosen = most_telling(model, all, &balls, asked.postures)
        .map_err(|e| format!("{e}; request fewer with --postures, or plan more"))?;
    chosen.sort_by_key(|station| poses.iter().position(|pose| pose.id == station.pose.id));
    Ok(chosen)
}

/// State of the arm on its way from posture to posture via home.
struct Tour<'a> {
    ways: &'a HomeWays,
    stands: ArmAt,
}

impl Tour<'_> {
    fn visit(
        &mut self,
        cell: &Cell,
        station: &Station,
        devices: Devices<'_, impl Manipulator>,
        free_reading: [f64; 3],
        settings: &RepeatabilitySettings,
    ) -> Result<StationRecord, Failure> {
        let Devices { robot, gauges } = devices;
        self.home(robot)?;
        robot.move_along(self.ways.from_home(&station.pose.id)).map_err(|e| hardware(&e))?;
        self.stands = ArmAt::Approach(station.pose.id.clone());
        let mut controller =
            CenteringController::new(robot, gauges.each_mut(), cell.trical, free_reading, cell.centring.clone());
        let failed = |f: ProbingFailure| hardware(&RepeatabilityError::Visit { station: station.pose.id.clone(), failure: f });
        Ok(controller.revisit(station, settings, &mut |_| ()).map_err(failed)?)
    }

    fn home(&mut self, robot: &mut impl Manipulator) -> Result<(), Failure> {
        if let ArmAt::Approach(id) = &self.stands {
            robot.move_along(&self.ways.home_from(id)).map_err(|e| hardware(&e))?;
            self.stands = ArmAt::Home;
        }
        Ok(())
    }
}

/// Indices of the named balls, each once, in the artifact's order; all if none is named.
pub fn places(ids: &[String], named: &[String]) -> Result<Vec<usize>, Failure> {
    if let Some(unknown) = named.iter().find(|name| !ids.contains(name)) {
        return Err(format!("--ball: the artifact has no ball `{unknown}`; give one of {}", ids.join(", ")).into());
    }
    Ok((0..ids.len()).filter(|&k| named.is_empty() || named.contains(&ids[k])).collect())
}
