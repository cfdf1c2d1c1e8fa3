//! The campaigns of a gallery: those of a user, or those of a simulated cell, which logs every column that a cell can log.

use std::sync::Arc;

use calibench::identify::Model;
use calibench::measure::{CampaignObserver, Dataset, Measured, Orientation, Sample, SampleSet, ToolTarget};
use calibench::robot::{Payload, world_from_tool};
use calibench::units::{DEG, MM, UM, URAD};
use calibench_sim::plans::Plans;
use calibench_sim::random::{Streams, fnv1a};
use calibench_sim::run::{RunError, run};
use calibench_sim::scenario::Scenario;
use nalgebra::Vector3;

/// Datasets of one robot that are fitted together.
pub struct Campaign {
    /// What was measured, in a clause.
    pub words: String,
    /// The datasets, by name.
    pub datasets: Vec<(String, Dataset)>,
    /// The model fitted to them.
    pub model: Model,
}

/// Seconds from one point to the next, and the temperatures at the beginning and at the end of a session.
const POINT_S: f64 = 30.0;
const WARMING_C: [f64; 2] = [20.0, 35.0];

/// Largest difference between a commanded and a reported joint, and largest reading at which a probing is stopped on purpose.
const LAG: f64 = 0.02 * DEG;
const STOPPED: f64 = 300.0 * UM;

/// Where the second target is on the tool, m, and the noise of an orientation, rad.
const SECOND_TARGET: [f64; 3] = [40.0 * MM, 25.0 * MM, -10.0 * MM];
const ORIENTATION_NOISE: f64 = 100.0 * URAD;

/// Measures the cell of a scenario by every means: balls, balls with the probings stopped on purpose, points, poses, both
/// together; and what a robot of unknown masses or payload would have given.
///
/// # Errors
/// When a stage cannot be completed.
pub fn of_scenario(scenario: &Scenario, seed: u64, observer: &mut dyn CampaignObserver) -> Result<Vec<Campaign>, RunError> {
    let plans = Plans::new(scenario, seed)?;
    let run = run(scenario, plans, Streams { seed, trial: 0 }, observer)?;
    let balls = logged(run.trical.dataset);
    let points = logged(timed(run.tracker.dataset));
    let count = |d: &Dataset| d.samples.iter().filter(|s| s.set == SampleSet::Fit).count();
    let (probings, points_count) = (count(&balls), count(&points));
    let loads = if balls.payloads.len() > 1 { " with two payloads" } else { "" };
    let of_balls = format!("{probings} probings of {} balls{loads}", balls.balls.len());
    let of_points = format!("{points_count} points of a tracker on two targets of the tool{loads}");
    let model = &scenario.model;
    let campaign = |words: String, dataset: Dataset, model: &Model| Campaign {
        words: format!("{}, {words}", scenario.robot().name),
        datasets: vec![("simulated".to_owned(), dataset)],
        model: model.clone(),
    };
    let rigid = model.without("joint_compliance");
    Ok(vec![
        campaign(of_balls.clone(), balls.clone(), model),
        campaign(format!("{of_balls}, stopped on purpose up to 0.3 mm from zero"), stopped(balls.clone()), model),
        campaign(of_points.clone(), points.clone(), model),
        campaign(format!("{of_points}, with orientations"), oriented(points.clone()), model),
        campaign(format!("{of_balls} and {of_points}"), both(balls, &points), model),
        campaign(format!("{of_points}, the masses of the links unknown"), without_masses(points.clone()), &rigid),
        campaign(format!("{points_count} points of a tracker, no payload entered"), without_payload(points), model),
    ])
}

/// A number in −1..1 that depends on nothing but a name.
fn spread(name: &str) -> f64 {
    (fnv1a(name.as_bytes()) >> 11) as f64 / (1u64 << 52) as f64 - 1.0
}

/// Points measured one after the other, every third on the second target and every second with the second payload.
fn timed(mut dataset: Dataset) -> Dataset {
    let second = if dataset.payloads.len() > 1 { 1 } else { 0 };
    dataset.tool_targets = vec![ToolTarget { id: "second".into(), position: SECOND_TARGET.into(), sigma: 0.0, free: false }];
    for (k, sample) in dataset.samples.iter_mut().enumerate() {
        sample.time_s = Some(POINT_S * (k + 1) as f64);
        sample.tool_target = (k % 3 == 0).then_some(0);
        sample.payload = if k % 2 == 0 { 0 } else { second };
    }
    dataset
}

/// With the columns that a simulated cell does not write: commanded joints, and a robot that warms up.
fn logged(mut dataset: Dataset) -> Dataset {
    let last = dataset.samples.iter().filter_map(|s| s.time_s).fold(1.0, f64::max);
    for sample in &mut dataset.samples {
        let lag = |j: usize| LAG * spread(&format!("{} {j}", sample.id));
        sample.q_commanded = Some(sample.q.iter().enumerate().map(|(j, q)| q + lag(j)).collect());
        sample.temp_c = sample.time_s.map(|t| WARMING_C[0] + (WARMING_C[1] - WARMING_C[0]) * t / last);
    }
    dataset
}

fn stopped(mut dataset: Dataset) -> Dataset {
    for sample in &mut dataset.samples {
        if let Measured::Ball { reading, .. } = &mut sample.measured {
            *reading = Some(Vector3::from_fn(|i, _| STOPPED * spread(&format!("{} reading {i}", sample.id))));
        }
    }
    dataset
}

fn oriented(mut dataset: Dataset) -> Dataset {
    dataset.noise.orientation = Some(ORIENTATION_NOISE);
    for sample in &mut dataset.samples {
        let nominal = world_from_tool(&dataset.robot, &dataset.base, &dataset.tool, &sample.q);
        sample.orientation = Some(Orientation { rotation: nominal.rotation.scaled_axis(), sigma: None });
    }
    dataset
}

/// Balls and points of one session, in turn.
fn both(balls: Dataset, points: &Dataset) -> Dataset {
    let last = balls.samples.iter().filter_map(|s| s.time_s).fold(0.0, f64::max);
    let step = last / points.samples.len().max(1) as f64;
    let again = |(k, s): (usize, &Sample)| Sample { time_s: Some(step * (k as f64 + 0.5)), ..s.clone() };
    let all = balls.samples.iter().cloned().chain(points.samples.iter().enumerate().map(again)).collect();
    Dataset { samples: all, tool_targets: points.tool_targets.clone(), ..balls }
}

fn without_masses(mut dataset: Dataset) -> Dataset {
    Arc::make_mut(&mut dataset.robot).links.iter_mut().for_each(|link| link.mass = 0.0);
    dataset
}

fn without_payload(mut dataset: Dataset) -> Dataset {
    dataset.payloads = vec![Payload::none()];
    dataset.samples.iter_mut().for_each(|s| s.payload = 0);
    dataset
}
