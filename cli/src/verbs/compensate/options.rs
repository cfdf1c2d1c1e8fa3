//! Frames and loads as given on the command line.

use calibench::compensate::WorkFrame;
use calibench::robot::FramePose;
use calibench::units::{DEG, MM};
use calibench_programs::{FARTHEST_BASE_MM, LONGEST_TOOL_MM};

/// Parses `N` finite numbers separated by commas.
fn numbers<const N: usize>(text: &str, what: &str) -> Result<[f64; N], String> {
    let wrong = || format!("give {N} numbers between commas, {what}");
    let values: Option<Vec<f64>> =
        text.split(',').map(|part| part.trim().parse::<f64>().ok().filter(|v| v.is_finite())).collect();
    values.and_then(|values| values.try_into().ok()).ok_or_else(wrong)
}

/// Parses a frame at most `farthest` mm away along each axis.
fn frame_within(text: &str, farthest: f64) -> Result<FramePose, String> {
    let [x, y, z, a, b, c] = numbers(text, "X,Y,Z in mm and A,B,C in deg")?;
    if [x, y, z].iter().any(|v| v.abs() > farthest) {
        return Err(format!("that is more than {farthest} mm away, as in no cell; give X,Y,Z in mm"));
    }
    Ok(FramePose { xyz: [x, y, z].map(|v| v * MM), rz_ry_rx: [a, b, c].map(|v| v * DEG) })
}

/// Heaviest accepted load, kg.
const HEAVIEST: f64 = 5e3;

pub fn tool(text: &str) -> Result<FramePose, String> {
    frame_within(text, LONGEST_TOOL_MM)
}

pub fn work_frame(text: &str) -> Result<WorkFrame, String> {
    if text == "world" {
        Ok(WorkFrame::World)
    } else {
        frame_within(text, FARTHEST_BASE_MM).map(WorkFrame::Base).map_err(|e| format!("{e}; or `world`"))
    }
}

pub fn load(text: &str) -> Result<[f64; 4], String> {
    let load = numbers(text, "KG in kg and X,Y,Z in mm")?;
    if load[0] < 0.0 {
        return Err("a mass is not negative; give it in kg".into());
    }
    if load[0] > HEAVIEST || load[1..].iter().any(|v| v.abs() > LONGEST_TOOL_MM) {
        return Err(format!(
            "no arm carries more than {HEAVIEST} kg, or farther out than {LONGEST_TOOL_MM} mm; give kg and mm"
        ));
    }
    Ok(load)
}
