//! `cell check CELL`: the state of every device of a real cell.

use std::path::Path;

use calibench::cell::gauge::{CellIndicator, Traffic};
use calibench::cell::{ControllerFrames, Indicator, IndicatorError, StopRequest};
use calibench::measure::campaign::cell::{Cell, read_cell};
use calibench::robot::statics::Payload;
use calibench::robot::{FramePose, rotation_vector};
use calibench::units::{DEG, MM, UM};
use calibench_report::plain_table;

use crate::terminal::failure::{Failure, Hardware, Outcome};
use crate::terminal::output::print_answer;

/// Number of readings used to assess the repeatability of an indicator.
const READINGS: usize = 10;

/// Queries every device and prints its state.
pub fn run(path: &Path) -> Result<Outcome, Failure> {
    let cell = read_cell(path)?;
    let mut failures = 0;
    let mut rows = Vec::new();
    for (axis, its) in cell.indicators.iter().flatten().enumerate() {
        let row = indicator(its, axis).unwrap_or_else(|why| {
            failures += 1;
            let [name, place] = [axis_name(axis), its.place.to_string()];
            [name, place, String::new(), String::new(), String::new(), String::new(), format!("FAILS: {why}")]
        });
        rows.push(row);
    }
    if cell.indicators.is_some() {
        print_answer(plain_table(["indicator", "at", "identity", "battery", "reading mm", "spread µm", ""], rows))?;
    }
    match robot(&cell) {
        Ok((rows, fit)) => {
            failures += usize::from(!fit);
            print_answer(plain_table(["robot", cell.robot.address(), ""], rows))?;
        }
        Err(why) => {
            failures += 1;
            print_answer(format!("robot at {}: FAILS: {why}", cell.robot.address()))?;
        }
    }
    match failures {
        0 => {
            print_answer("the cell is ready")?;
            Ok(Outcome::Done)
        }
        1 => Err(Hardware("1 device of the cell is not ready".into()).into()),
        many => Err(Hardware(format!("{many} devices of the cell are not ready")).into()),
    }
}

fn axis_name(axis: usize) -> String {
    format!("{} ({})", axis + 1, ["x", "y", "z"][axis])
}

fn indicator(its: &CellIndicator, axis: usize) -> Result<[String; 7], String> {
    let mut gauge = its.open(axis).map_err(|e| e.error.to_string())?;
    let identity = gauge.identify().map_err(|e| e.to_string())?;
    let readings: Result<Vec<f64>, IndicatorError> = (0..READINGS).map(|_| gauge.read()).collect();
    let readings = readings.map_err(|e| e.to_string())?;
    let mean = readings.iter().sum::<f64>() / READINGS as f64;
    let spread = readings.iter().fold(0.0, |s: f64, r| s.max((r - mean).abs())) * 2.0;
    let battery = identity.battery_low.map_or("", |low| if low { "LOW" } else { "good" });
    let who = [identity.name, identity.version, identity.resolution].into_iter().flatten().collect::<Vec<_>>().join(", ");
    let decimals = gauge.decimals().unwrap_or(4);
    Ok([
        axis_name(axis),
        its.place.to_string(),
        who,
        battery.into(),
        format!("{:+.decimals$}", mean / MM),
        format!("{:.1}", spread / UM),
        String::new(),
    ])
}

/// The rows reported for the robot, and whether it is ready for measurements.
fn robot(cell: &Cell) -> Result<(Vec<[String; 3]>, bool), String> {
    let mut robot = cell.open_robot(StopRequest::default()).map_err(|e| e.to_string())?;
    let state = robot.state().map_err(|e| e.to_string())?;
    let joints = robot.joints().map_err(|e| e.to_string())?;
    let outside = cell.guards.joint_motion(&joints, &joints).err();
    let (distance, angle) = cell.disagreement(robot.as_mut(), &joints).map_err(|e| e.to_string())?;
    let model = disagreement_verdict(distance, angle);
    let ControllerFrames { root_from_base, flange_from_tool: tool, .. } = robot.frames().map_err(|e| e.to_string())?;
    let step = tool.pose().inv_mul(&cell.flange_from_tool().pose());
    let (moved, turned) = (step.translation.vector.norm(), rotation_vector(&step.rotation).norm());
    let list = |values: &[f64], unit: f64| values.iter().map(|v| format!("{:.3}", v / unit)).collect::<Vec<_>>().join(", ");
    let fails = |why: Option<String>| why.map(|why| format!("FAILS: {why}")).unwrap_or_default();
    let Traffic { sent, received } = robot.traffic();
    let fit = state.unfit.is_none() && state.pending.is_none() && model.is_none();
    let row = |what: &str, is: String, verdict: String| [what.to_owned(), is, verdict];
    let stop = match state.emergency_stop {
        None => "not known",
        Some(true) => "PRESSED",
        Some(false) => "not pressed",
    };
    let own_model = "not the nominal arm: the controller has been calibrated, or the model is of another arm";
    let own_model = if distance > NOMINAL { own_model } else { "" };
    let sets_speed = state.speed_percent.round() as i64 != i64::from(cell.speed_percent);
    let sets_tool = moved > SAME_TOOL.0 || turned > SAME_TOOL.1;
    let will_set = |differs: bool, to: String| if differs { format!("measure sets {to}") } else { String::new() };
    let payload = payload_verdict(&cell.dataset.payloads, state.payload_kg, state.told_payload_kg);
    let millimetres = |pose: &FramePose| list(&pose.xyz, MM);
    let rows = vec![
        row("operating mode", state.mode, fails(state.unfit)),
        row("program", state.program, fails(state.pending)),
        row("emergency stop", stop.into(), String::new()),
        row("speed override", format!("{} %", state.speed_percent), will_set(sets_speed, format!("{} %", cell.speed_percent))),
        row(
            "tool mm, in its flange",
            millimetres(&tool),
            will_set(
                sets_tool,
                format!("{}, turned by {:.2} deg from it", millimetres(&cell.flange_from_tool()), turned / DEG),
            ),
        ),
        row("base mm, in its root", millimetres(&root_from_base), String::new()),
        row("payload kg", state.payload_kg.map_or("not known".into(), |is| format!("{is:.3}")), payload),
        row("joints deg", list(&joints, DEG), outside.map(|why| why.to_string()).unwrap_or_default()),
        row("TCP mm, world", list(cell.guards.tcp(&joints).as_slice(), MM), String::new()),
        row(
            "controller against model",
            format!("{:.3} mm, {:.3} deg", distance / MM, angle / DEG),
            model.map_or(own_model.to_owned(), |why| format!("FAILS: {why}")),
        ),
        row("bytes", format!("{sent} sent, {received} received"), String::new()),
    ];
    Ok((rows, fit))
}

/// Largest difference of two payloads that are the same, kg: a pendant's digits, and a cable.
const SAME_PAYLOAD: f64 = 0.05;

/// What becomes of the payload that the controller computes with: a wrong one ends in protective stops.
fn payload_verdict(payloads: &[Payload], is: Option<f64>, told: Option<f64>) -> String {
    let Some(is) = is else { return String::new() };
    let differs = |mass: f64| (mass - is).abs() > SAME_PAYLOAD;
    match told {
        Some(told) if differs(told) => format!("measure sets {told:.3}"),
        None if payloads.iter().all(|payload| differs(payload.mass)) => {
            let masses: Vec<String> = payloads.iter().map(|payload| format!("{:.3}", payload.mass)).collect();
            format!("not that of the dataset ({}): set it, or give robot.payload", masses.join(", "))
        }
        _ => String::new(),
    }
}

/// Discrepancy between the flanges of controller and model that indicates another arm or another flange, m and rad: a nominal
/// arm is accurate to some millimetres, and an absolutely calibrated controller differs by as much.
const SAME_ARM: (f64, f64) = (5.0 * MM, 1.0 * DEG);

/// Largest discrepancy of a controller that computes with the nominal arm, m: the rounding of its numbers.
const NOMINAL: f64 = 0.1 * MM;

/// Largest difference of two tools that are the same, m and rad: the rounding of the numbers of a pendant.
const SAME_TOOL: (f64, f64) = (0.01 * MM, 0.01 * DEG);

/// Explains a discrepancy between controller and model if it is too large.
pub fn disagreement_verdict(distance: f64, angle: f64) -> Option<String> {
    if distance < SAME_ARM.0 && angle < SAME_ARM.1 {
        return None;
    }
    if !distance.is_finite() || !angle.is_finite() {
        return Some("it reports joints or a tool that are no numbers".into());
    }
    Some("its flange is not that of the model; correct [robot.flange] (b_deg = 180 for a KR 6), or name the right robot".into())
}
