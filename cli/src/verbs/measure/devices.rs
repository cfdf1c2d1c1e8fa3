//! The devices of a real cell, ready to measure, and the log of their motions.

use std::fs::OpenOptions;
use std::io::Write;
use std::path::{Path, PathBuf};

use calibench::cell::Driver;
use calibench::cell::gauge::CellGauge;
use calibench::cell::guards::{Motion, MotionRecord};
use calibench::files::{FileError, cannot_be_written};
use calibench::measure::campaign::cell::Cell;
use calibench::units::{DEG, MM};

use crate::terminal::failure::{Failure, Hardware, hardware};
use crate::terminal::output::tell;
use crate::verbs::cell::check::disagreement_verdict;
use calibench_loopback::{HEADER_PATIENCE, Server};
use calibench_rehearsal::Watch;

/// Opens and identifies the indicators.
pub fn open_gauges(cell: &Cell) -> Result<[CellGauge; 3], Failure> {
    let gauges = cell.open_indicators().map_err(|e| hardware(&e))?;
    let mut gauges = gauges.ok_or_else(|| {
        let remedy = "add three [[indicator]], or give --instrument and a plan of points";
        FileError::whole(&cell.file, "has no indicators", remedy)
    })?;
    for (axis, gauge) in gauges.iter_mut().enumerate() {
        let named = |why: String| Hardware(format!("indicator {}: {why}", axis + 1));
        let identity = gauge.identify().map_err(|e| named(e.to_string()))?;
        // A low battery would not last a campaign, which takes about an hour.
        if identity.battery_low == Some(true) {
            return Err(named("its battery is low".into()).into());
        }
    }
    Ok(gauges)
}

/// Checks that controller and model describe the same arm, and sets speed and tool. Nothing moves.
pub fn prepare(cell: &Cell, robot: &mut dyn Driver) -> Result<(), Failure> {
    let joints = robot.joints().map_err(|e| hardware(&e))?;
    let (distance, angle) = cell.disagreement(robot, &joints).map_err(|e| hardware(&e))?;
    if let Some(why) = disagreement_verdict(distance, angle) {
        let by = format!("by {:.1} mm and {:.2} deg", distance / MM, angle / DEG);
        return Err(Hardware(format!("the controller's arm is not the model's, {by}: {why}")).into());
    }
    robot.prepare(cell.speed_percent, &cell.flange_from_tool()).map_err(|e| hardware(&e).into())
}

/// Appends every motion to `DATASET.motions.csv` beside the dataset.
pub fn motion_log(output: &Path) -> Result<impl FnMut(&MotionRecord) + use<>, Failure> {
    let mut path = output.as_os_str().to_owned();
    path.push(".motions.csv");
    let path = PathBuf::from(path);
    let mut file = OpenOptions::new().create(true).append(true).open(&path).map_err(|e| cannot_be_written(&path, e))?;
    if file.metadata().map_err(|e| cannot_be_written(&path, e))?.len() == 0 {
        writeln!(file, "time_s,duration_s,motion,target,error").map_err(|e| cannot_be_written(&path, e))?;
    }
    Ok(move |record: &MotionRecord| {
        let (motion, target) = match &record.motion {
            Motion::Joints(q) => ("joints_deg", q.iter().map(|q| format!("{:.5}", q / DEG)).collect::<Vec<_>>()),
            Motion::Tool(offset) => ("tool_mm", offset.iter().map(|v| format!("{:.5}", v / MM)).collect()),
        };
        let error = record.error.as_ref().map(|e| e.to_string().replace('"', "'")).unwrap_or_default();
        let target = target.join(" ");
        // The journal holds the essential data; failing to log a motion stops nothing.
        drop(writeln!(file, "{:.3},{:.3},{motion},{target},\"{error}\"", record.time_s, record.duration_s));
    })
}

/// Serves the page of a measurement, and tells its address.
pub fn watched(watch: Watch, port: u16) -> Result<Watch, Failure> {
    let server = Server::new(watch.clone(), port, HEADER_PATIENCE)
        .map_err(|e| format!("port {port} of the loopback address: {e}; name another with --watch"))?;
    tell(format!("Watch it at {}", server.answer_beside()?));
    Ok(watch)
}
