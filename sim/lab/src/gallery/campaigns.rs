//! The campaigns of a gallery: those of a user, or those of a simulated cell, which logs every column that a cell can log.

use std::sync::Arc;

use calibench::effects::EffectId;
use calibench::identify::Model;
use calibench::identify::calibration::Calibration;
use calibench::measure::campaign::CampaignObserver;
use calibench::measure::dataset::{Dataset, Measured, NamedDataset, Orientation, Sample, SampleSet, ToolTarget};
use calibench::robot::kinematics::world_from_tool;
use calibench::robot::statics::Payload;
use calibench::robot::{Robot, rotation_vector};
use calibench::units::{DEG, MM, UM, URAD};
use calibench_sim::plans::Plans;
use calibench_sim::random::{Streams, fnv1a};
use calibench_sim::run::{RunError, run};
use calibench_sim::scenario::Scenario;
use nalgebra::Vector3;

use crate::injection::measured_by;

/// Datasets of one robot that are fitted together.
pub struct Campaign {
    /// Description of the measurements, in a clause.
    pub words: String,
    /// The datasets, by name.
    pub datasets: Vec<(String, Dataset)>,
    /// The model fitted to them.
    pub model: Model,
}

/// Time from one point to the next, s.
const POINT_S: f64 = 30.0;
/// Temperatures at the beginning and at the end of a session, °C.
const WARMING_C: [f64; 2] = [20.0, 35.0];

/// Largest difference between a commanded and a reported joint, rad.
const LAG: f64 = 0.02 * DEG;
/// Largest reading at which a probing is stopped on purpose, m.
const STOPPED: f64 = 300.0 * UM;

/// Position of the second target on the tool, m.
const SECOND_TARGET: [f64; 3] = [40.0 * MM, 25.0 * MM, -10.0 * MM];
/// One-sigma of a measured orientation, rad per axis.
const ORIENTATION_NOISE: f64 = 100.0 * URAD;

/// Measures the cell of a scenario by every means: balls, balls with the probings stopped on purpose, points, poses, both
/// together; and what a robot of unknown masses or payload would have given.
///
/// # Errors
/// When a stage cannot be completed.
pub fn of_scenario(scenario: &Scenario, seed: u64, observer: &mut dyn CampaignObserver) -> Result<Vec<Campaign>, RunError> {
    let plans = Plans::new(scenario, seed)?;
    let run = run(scenario, plans, Streams { seed, trial: 0 }, observer)?;
    let [by_gauge, by_tracker] = [&run.trical.calibration, &run.tracker.calibration];
    let balls = logged(run.trical.dataset.clone());
    let points = logged(timed(run.tracker.dataset.clone()));
    let count = |d: &Dataset| d.samples.iter().filter(|s| s.set == SampleSet::Fit).count();
    let loads = if balls.payloads.len() > 1 { " with two payloads" } else { "" };
    let of_balls = format!("{} probings of {} balls{loads}", count(&balls), balls.balls.len());
    let tracker = format!("{} points of a tracker", count(&points));
    let of_points = format!("{tracker} on two targets of the tool{loads}");
    let model = &scenario.model;
    let rigid = Calibration { model: model.without(EffectId::JOINT_COMPLIANCE), ..without_compliance(by_tracker) };
    let of: [(String, Dataset, &Calibration); 7] = [
        (of_balls.clone(), balls.clone(), by_gauge),
        (format!("{of_balls}, stopped on purpose up to 0.3 mm from zero"), stopped(balls.clone()), by_gauge),
        (of_points.clone(), points.clone(), by_tracker),
        (format!("{of_points}, with orientations"), oriented(points.clone()), by_tracker),
        (format!("{of_balls} and {of_points}"), both(balls, &points), by_gauge),
        (format!("{of_points}, the masses of the links unknown"), without_masses(points.clone()), &rigid),
        (format!("{tracker}, no payload entered"), without_payload(points), by_tracker),
    ];
    of.into_iter()
        .map(|(words, dataset, truth)| {
            let mut random = Streams { seed, trial: 0 }.stream(&words);
            // With other columns the same samples are measured again.
            let datasets = measured_by(&[NamedDataset::new(NAME, &dataset)], truth, 1.0, &mut random)?;
            Ok(Campaign {
                words: format!("{}, {words}", scenario.robot().name),
                datasets: datasets.into_iter().map(|d| (NAME.to_owned(), d)).collect(),
                model: truth.model.clone(),
            })
        })
        .collect()
}

/// Name of the dataset of a simulated campaign.
const NAME: &str = "simulated";

/// A calibration of a robot whose joints are stiff and whose links weigh nothing.
fn without_compliance(calibration: &Calibration) -> Calibration {
    let mut stiff = calibration.clone();
    weightless(&mut stiff.robot);
    stiff.estimates.retain(|e| e.effect != EffectId::JOINT_COMPLIANCE);
    stiff
}

/// A number in −1..1 that depends on nothing but a name.
fn spread(name: &str) -> f64 {
    // The last letters of a name reach the high bits of its hash only by a further mixing (Stafford's Mix13).
    let mixed = |h: u64| {
        let h = (h ^ (h >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let h = (h ^ (h >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        h ^ (h >> 31)
    };
    (mixed(fnv1a(name.as_bytes())) >> 11) as f64 / (1u64 << 52) as f64 - 1.0
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
        sample.orientation = Some(Orientation { rotation: rotation_vector(&nominal.rotation), sigma: None });
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
    weightless(&mut dataset.robot);
    dataset
}

fn weightless(robot: &mut Arc<Robot>) {
    Arc::make_mut(robot).links.iter_mut().for_each(|link| link.mass = 0.0);
}

fn without_payload(mut dataset: Dataset) -> Dataset {
    dataset.payloads = vec![Payload::none()];
    dataset.samples.iter_mut().for_each(|s| s.payload = 0);
    dataset
}
