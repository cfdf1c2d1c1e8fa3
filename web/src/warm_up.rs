//! A judgement computed in advance, to warm the browser's compiler up.
//!
//! A browser compiles what runs for the first time hastily, and what runs often again, faster; whichever worker of a page runs it,
//! all have it. A worker that waits to help thus halves the time of the first verdict.

use std::path::PathBuf;
use std::sync::Arc;

use calibench::measure::dataset::{Dataset, Measured, Noise, Sample};
use calibench::prediction::worker::Worker;
use calibench::robot::kinematics::world_from_tool;
use calibench::robot::{FramePose, built_in};
use calibench_workbench::Place;
use nalgebra::Vector3;
use serde_json::json;

use crate::host::Host;
use crate::opening::{Opening, open_datasets};

/// Number of made-up samples.
const SAMPLES: usize = 60;

/// Calibrates a robot whose base is not where it should be, and forgets it.
pub fn warm_up(worker: Option<&'static dyn Worker>) {
    let Some(robot) = built_in("kr6_r700") else { return };
    let place = FramePose { xyz: [0.001, -0.002, 0.003], ..FramePose::default() };
    // Additive recurrences fill their range evenly.
    let even = |k: usize, of: usize| (k as f64 * [0.618, 0.755, 0.819, 0.857, 0.881, 0.898][of % 6]).fract() - 0.5;
    let sample = |k: usize| {
        let q: Vec<f64> = (0..robot.joints()).map(|j| even(k + 1, j)).collect();
        let point = world_from_tool(&robot, &place, &FramePose::default(), &q).translation.vector;
        let scatter = Vector3::from_fn(|r, _| 4e-4 * even(7 * k + 3, r));
        Sample::new(format!("p{k}"), q, Measured::Point(point + scatter))
    };
    let dataset = Dataset {
        robot: Arc::new(robot.clone()),
        robot_reference: "kr6_r700".into(),
        noise: Noise { point: Some(1e-4), ..Noise::default() },
        samples: (0..SAMPLES).map(sample).collect(),
        ..Dataset::default()
    };
    let folder = PathBuf::from("warm_up");
    let opening = Opening { force: false, host: Host { tell: |_| (), worker } };
    let datasets = vec![("warm_up".to_owned(), dataset)];
    if let Ok(opened) = open_datasets(&[folder], datasets, None, Place::new("".into(), None), opening, &mut json!({})) {
        // Without an answer, nothing is lost.
        let _ = opened.bench.views();
    }
}
