//! `keep recover EARLIER TOUCHES [-o FOLDER]`: after a crash, which zeros were lost, and what to enter.

use std::path::{Path, PathBuf};

use calibench::files::disk::{check_output_folder, is_file, write_whole};
use calibench::files::{read_text, with_reasons};
use calibench::identify::calibration::{Calibration, write_calibration};
use calibench::identify::fleet::{Fleet, read_fleet};
use calibench::measure::dataset::file::DATASET_TOML;
use calibench::measure::dataset::{Dataset, NamedDataset};
use calibench::measure::poses::{PlannedPose, ProbingPlan, write_plan};
use calibench::robot::robot_file::robot;
use calibench::robot::{JointKind, Robot};
use calibench_recovery::mastering::{Controller, Drive, MasteringEntry};
use calibench_recovery::touches::{PlannedTouch, choose_touches, plan_touches};
use calibench_recovery::{Earlier, Recovery, RecoveryError, Verdict, recover};
use calibench_report::{documents, recovery_text};

use super::check::{expect_unmeasured, measure_on, write_poses_of};
use super::measure::Simulated;
use super::measure::cell::CellArguments;
use crate::arguments::choices::seed;
use crate::arguments::choosing::Choice;
use crate::arguments::data::{dataset, read_calibration_to_use, read_datasets};
use crate::terminal::failure::{Failure, LocatedError, Outcome};
use crate::terminal::output::{check_outputs, note, print_answer, print_json};
use crate::terminal::streams::input;

/// Files in the output folder.
const NOW: &str = "now.toml";
const MASTERED: &str = "mastered.toml";
const RESULT: &str = "recovery.json";

#[derive(clap::Args)]
pub struct Arguments {
    /// What was known before: a calibration, a fleet, a robot file, or the name of a built-in robot
    earlier: String,
    /// Dataset folder of the touches; with --plan, of the cell in which they are to be made; with --cell, for what is measured
    #[arg(value_parser = dataset())]
    touches: PathBuf,
    /// Output folder for the robot as it is, for `compensate`, and as it will be when the values are entered; with --plan the
    /// file of the postures
    #[arg(short, long, visible_alias = "out")]
    output: Option<PathBuf>,
    /// The controller, in whose terms the values are given: kuka, abb, fanuc, ur or xarm
    #[arg(long, value_parser = controller)]
    controller: Option<Controller>,
    /// The present value of a joint in the controller
    #[arg(long, value_name = "J=VALUE", value_parser = of_joint, requires = "controller", allow_negative_numbers = true)]
    present: Vec<OfJoint>,
    /// Gear ratio of a joint: turns of the motor for one of the joint, with its sign
    #[arg(long, value_name = "J=RATIO", value_parser = of_joint, requires = "controller")]
    gear: Vec<OfJoint>,
    /// Counts of the encoder for a degree of a joint, with their sign
    #[arg(long, value_name = "J=COUNTS", value_parser = of_joint, requires = "controller")]
    counts_per_degree: Vec<OfJoint>,
    /// The instrument, or the robot's place, may be another than before: the base is found from the touches
    #[arg(long)]
    instrument_moved: bool,
    /// Plan this many touches in place of judging any
    #[arg(long = "plan", id = "count", value_name = "N", requires = "output", value_parser = clap::value_parser!(u16).range(3..=20))]
    count: Option<u16>,
    /// The plan by which the campaign TOUCHES was measured: the touches are chosen among its poses, with their ways
    #[arg(long, value_name = "PLAN", requires = "count")]
    of: Option<PathBuf>,
    /// The plan of the touches, with --cell: they are made first, and TOUCHES is the folder for what is measured
    #[arg(long = "by", id = "plan", value_name = "PLAN", requires = "cell", conflicts_with = "count", value_parser = input())]
    plan: Option<PathBuf>,
    #[command(flatten)]
    real: CellArguments,
    /// Visit to a simulated cell: 1 is the first after the campaign
    #[arg(long, value_name = "N", default_value_t = 1, requires = "cell")]
    visit: u64,
    /// Resume interrupted touches from their journal
    #[arg(long, requires = "cell")]
    resume: bool,
    /// Seed of the planned postures, 1 by default, or of a simulated cell, if not the scenario's
    #[arg(long, value_parser = seed, allow_negative_numbers = true)]
    seed: Option<u64>,
    /// Print one JSON document instead of a table
    #[arg(long, conflicts_with = "count")]
    json: bool,
}

/// A number of a joint.
#[derive(Debug, Clone, Copy, PartialEq)]
struct OfJoint {
    /// Counted from 1.
    joint: usize,
    value: f64,
}

/// What was known before, as read.
enum Known {
    Campaign(Box<Calibration>),
    Fleet(Fleet),
    Nominal(Box<Robot>),
}

pub fn run(arguments: &Arguments) -> Result<Outcome, Failure> {
    let known = read_known(&arguments.earlier)?;
    let folder = &arguments.touches;
    // What cannot be written is refused before anything moves.
    if let (None, Some(folder)) = (arguments.count, &arguments.output) {
        check_output_folder(folder, "recovery", RESULT)?;
    }
    if let (Some(cell), Some(plan)) = (&arguments.real.cell, &arguments.plan) {
        match touch(arguments, cell, plan)? {
            Outcome::Done if folder.join(DATASET_TOML).is_file() => {}
            outcome => return Ok(outcome),
        }
    }
    let (_, touches) = read_datasets(std::slice::from_ref(folder))?.remove(0);
    let located = |e: RecoveryError| located(folder, &e);
    // The touches are of the set-up of the campaign, whatever their folder is called.
    let (earlier, name) = match &known {
        Known::Campaign(c) => (Earlier::Campaign(c), c.setups.first().map_or("touches", |s| s.dataset.as_str())),
        Known::Fleet(fleet) => (Earlier::Fleet(fleet), "touches"),
        Known::Nominal(robot) if !robot.is_same_arm(&touches.robot) => {
            let (touched, known) = (touches.robot.name.clone(), robot.name.clone());
            return Err(located(RecoveryError::OtherRobot { touched, known }));
        }
        Known::Nominal(_) => (Earlier::Nominal, "touches"),
    };
    let named = NamedDataset::new(name, &touches);
    if let (Some(count), Some(file)) = (arguments.count, &arguments.output) {
        check_outputs([file])?;
        if let Some(of) = &arguments.of {
            let chosen = choose_touches(earlier, named, usize::from(count), arguments.instrument_moved).map_err(located)?;
            let ids: Vec<String> = chosen.into_iter().map(|k| touches.samples[k].id.clone()).collect();
            write_poses_of(of, &ids, &touches, file)?;
            print_answer(format!("{} touches of the campaign, with their ways, are in {}.", ids.len(), file.display()))?;
            return Ok(Outcome::Done);
        }
        let chosen = plan_touches(earlier, named, usize::from(count), arguments.instrument_moved, arguments.seed.unwrap_or(1));
        return write_touches(&chosen.map_err(located)?, &touches, file);
    }
    let joints = touches.robot.joints();
    let given = [&arguments.present, &arguments.gear, &arguments.counts_per_degree];
    if let Some(OfJoint { joint, .. }) = given.into_iter().flatten().find(|of| of.joint > joints) {
        return Err(format!("joint {joint}: '{}' has {joints} joints", touches.robot.name).into());
    }
    let found = recover(earlier, named, arguments.instrument_moved).map_err(located)?;
    let entries = entries(arguments, &found);
    let document = documents::Recovery::of(&found, &entries);
    if let Some(folder) = &arguments.output {
        write_calibration(&found.now, &folder.join(NOW))?;
        write_calibration(&found.mastered, &folder.join(MASTERED))?;
        write_whole(&folder.join(RESULT), serde_json::to_string_pretty(&document)?.as_bytes())?;
    }
    if arguments.json {
        print_json(&document)?;
    } else {
        print_answer(recovery_text(&found, &document))?;
        say_next(arguments, &found)?;
    }
    Ok(if found.verdict == Verdict::NothingMoved { Outcome::Done } else { Outcome::ExpectationFailed })
}

/// Makes the touches on a cell.
fn touch(arguments: &Arguments, cell: &Path, plan: &Path) -> Result<Outcome, Failure> {
    let folder = &arguments.touches;
    expect_unmeasured(folder)?;
    note("The ways are planned for the robot as it was: watch the first touches at low speed.");
    let under = vec![("recover.earlier", arguments.earlier.clone())];
    let choice = Choice { choose: None, silent: arguments.json, under };
    let Arguments { seed, visit, resume, .. } = *arguments;
    let simulated = Simulated { scenario: cell, plan: Some(plan), output: folder, seed, plant: None, visit, resume };
    measure_on(&simulated, plan, &arguments.real, choice)
}

/// What is still to be given, and the files.
fn say_next(arguments: &Arguments, found: &Recovery) -> Result<(), Failure> {
    if found.verdict != Verdict::Moved {
        return Ok(());
    }
    if arguments.controller == Some(Controller::Abb) && !found.zeros.is_empty() && arguments.gear.is_empty() {
        print_answer("The motor's offset needs its gear ratio: --gear J=RATIO --present J=CAL_OFFSET.")?;
    }
    if let Some(folder) = &arguments.output {
        let at = |name: &str| folder.join(name).display().to_string();
        print_answer(format!("Until then: calibench compensate {} TARGETS.csv -o FAKE.csv", at(NOW)))?;
        print_answer(format!("Afterwards, three touches: calibench keep recover {} CHECK", at(MASTERED)))?;
    }
    Ok(())
}

/// What to enter for each zero, in their order.
fn entries(arguments: &Arguments, found: &Recovery) -> Vec<Option<MasteringEntry>> {
    let of = |list: &[OfJoint], joint: usize| list.iter().find(|of| of.joint == joint).map(|of| of.value);
    let entry = |zero: &calibench_recovery::ZeroChange| {
        let is_turn = found.now.robot.kind(zero.joint - 1) == JointKind::Revolute;
        let drive = Drive {
            gear: of(&arguments.gear, zero.joint),
            counts_per_degree: of(&arguments.counts_per_degree, zero.joint),
            present: of(&arguments.present, zero.joint),
        };
        arguments.controller.filter(|_| is_turn).map(|controller| controller.entry(zero, &drive))
    };
    found.zeros.iter().map(entry).collect()
}

/// Writes planned touches: of balls as a plan, of a tracker's points as rows of `samples.csv`.
fn write_touches(chosen: &[PlannedTouch], cell: &Dataset, file: &Path) -> Result<Outcome, Failure> {
    let id = |k: usize| format!("t{:02}", k + 1);
    if cell.balls.is_empty() {
        let mut text = format!("id,kind,{}\n", cell.robot.joint_columns().join(","));
        for (k, touch) in chosen.iter().enumerate() {
            let q: Vec<String> = cell.robot.in_columns(&touch.q).iter().map(|v| format!("{v:.6}")).collect();
            text.push_str(&format!("{},point,{}\n", id(k), q.join(",")));
        }
        write_whole(file, text.as_bytes())?;
    } else {
        let pose = |(k, touch): (usize, &PlannedTouch)| PlannedPose {
            id: id(k),
            ball: touch.ball,
            payload: cell.samples.first().map_or(0, |s| s.payload),
            contact: touch.q.clone(),
            approach: touch.approach.clone(),
            reserve: false,
            reverses: None,
            via: Vec::new(),
            clearance: None,
        };
        write_plan(file, &ProbingPlan { poses: chosen.iter().enumerate().map(pose).collect(), ways: None }, cell)?;
    }
    print_answer(format!("{} touches planned in {}.", chosen.len(), file.display()))?;
    print_answer("Nothing but the robot is known to be in the cell: inspect every posture before it is driven.")?;
    Ok(Outcome::Done)
}

/// A calibration, a fleet or a robot, by the format that the file states.
fn read_known(text: &str) -> Result<Known, Failure> {
    let path = Path::new(text);
    if is_file(path) {
        let format = read_text(path)?.lines().find_map(|line| {
            let value = line.trim().strip_prefix("format")?.trim_start().strip_prefix('=')?;
            Some(value.trim().trim_matches('"').to_owned())
        });
        match format.as_deref() {
            Some(format) if format.starts_with("calibench-calibration/") => {
                return Ok(Known::Campaign(Box::new(read_calibration_to_use(path)?)));
            }
            Some(format) if format.starts_with("calibench-fleet/") => return Ok(Known::Fleet(read_fleet(path)?)),
            _ => {}
        }
    }
    Ok(Known::Nominal(Box::new(robot(text, Path::new(""))?)))
}

fn controller(text: &str) -> Result<Controller, String> {
    let names = Controller::ALL.map(Controller::name);
    let found = Controller::ALL.into_iter().find(|c| c.name().eq_ignore_ascii_case(text));
    found.ok_or_else(|| format!("'{text}' is not one of {}", names.join(", ")))
}

fn of_joint(text: &str) -> Result<OfJoint, String> {
    let parsed = text.split_once('=').and_then(|(joint, value)| {
        let of = OfJoint { joint: joint.trim().parse().ok()?, value: value.trim().parse().ok()? };
        (of.joint > 0 && of.value.is_finite()).then_some(of)
    });
    parsed.ok_or_else(|| format!("'{text}' is not a joint and its number, such as 4=101.5"))
}

fn located(folder: &Path, error: &RecoveryError) -> Failure {
    let (file, field, remedy) = match error {
        RecoveryError::NoNoise => ("dataset.toml", "noise", "; state it in [noise], or as sigma_um of the rows"),
        RecoveryError::OtherRobot { .. } => ("dataset.toml", "robot", "; name what was known of this robot"),
        RecoveryError::Sessions => ("samples.csv", "session", "; judge one session at a time"),
        RecoveryError::TooFew { .. } => ("samples.csv", "rows", "; `keep recover --plan 12` chooses them"),
        _ => ("samples.csv", "rows", ""),
    };
    Box::new(LocatedError { path: folder.join(file), field, problem: format!("{}{remedy}", with_reasons(error)) })
}
