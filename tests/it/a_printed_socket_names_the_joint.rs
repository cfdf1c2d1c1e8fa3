//! Without a tracker: a ball in a printed socket, at a few places on a table, identifies a robot, and names the joint whose zero has moved.
//!
//! Run with `--nocapture` to see the table.

use std::fs;
use std::path::{Path, PathBuf};

use calibench::diagnosis::library::Library;
use calibench::identify::problem::Use;
use calibench::identify::{Model, identify};
use calibench::import::{ImportOptions, import};
use calibench::measure::dataset::{Dataset, Measured, NamedDataset, SampleSet};
use calibench::residuals::comparison::{Comparison, Subject};
use calibench::units::{DEG, MM};
use nalgebra::Vector3;
use rand::seq::SliceRandom;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::oracles::data;

type Joint = ([f64; 2], [f64; 3], f64, [f64; 3]);

/// Joint origins (z, y of the parent's frame, m; roll, pitch, yaw in quarter turns), mass and centre of mass of each link of an iiwa 14, by
/// the URDF file in the model library of Drake (BSD-3-Clause).
const IIWA: [Joint; 7] = [
    ([0.1575, 0.0], [0.0, 0.0, 0.0], 5.76, [0.0, -0.03, 0.12]),
    ([0.2025, 0.0], [1.0, 0.0, 2.0], 6.35, [0.0003, 0.059, 0.042]),
    ([0.0, 0.2045], [1.0, 0.0, 2.0], 3.5, [0.0, 0.03, 0.13]),
    ([0.2155, 0.0], [1.0, 0.0, 0.0], 3.5, [0.0, 0.067, 0.034]),
    ([0.0, 0.1845], [-1.0, 2.0, 0.0], 3.5, [0.0001, 0.021, 0.076]),
    ([0.2155, 0.0], [1.0, 0.0, 0.0], 1.8, [0.0, 0.0006, 0.0004]),
    ([0.0, 0.081], [-1.0, 2.0, 0.0], 1.2, [0.0, 0.0, 0.02]),
];

fn iiwa(folder: &Path) -> PathBuf {
    let mut text = String::from("<robot name=\"iiwa14\">\n<link name=\"link_0\"/>\n");
    for (k, ([z, y], turns, mass, [cx, cy, cz])) in IIWA.into_iter().enumerate() {
        let [roll, pitch, yaw] = turns.map(|t| t * std::f64::consts::FRAC_PI_2);
        text += &format!(
            "<joint name=\"joint_{j}\" type=\"continuous\"><parent link=\"link_{k}\"/><child link=\"link_{j}\"/>\
             <origin xyz=\"0 {y} {z}\" rpy=\"{roll} {pitch} {yaw}\"/><axis xyz=\"0 0 1\"/></joint>\n\
             <link name=\"link_{j}\"><inertial><origin xyz=\"{cx} {cy} {cz}\"/><mass value=\"{mass}\"/></inertial></link>\n",
            j = k + 1
        );
    }
    let path = folder.join("iiwa14.urdf");
    fs::write(&path, text + "</robot>\n").unwrap();
    path
}

fn socket(name: &str) -> Dataset {
    let folder = tempfile::tempdir().unwrap();
    let robot = (name == "kuka_14").then(|| iiwa(folder.path()));
    let options = ImportOptions { robot, ..ImportOptions::default() };
    import("mukca", &[data("mukca").join(name)], &options).unwrap_or_else(|e| panic!("{name}: {e}")).0
}

const SOCKETS: [&str; 4] = ["panda_1", "panda_3", "panda_6", "kuka_14"];

/// Trials a robot.
const TRIALS: usize = 50;

/// A random half of the seatings, and the other.
fn halves(whole: &Dataset, random: &mut ChaCha8Rng) -> [Dataset; 2] {
    let mut first = vec![true; whole.samples.len() / 2];
    first.resize(whole.samples.len(), false);
    first.shuffle(random);
    [true, false].map(|wanted| {
        let taken = whole.samples.iter().zip(&first).filter(|(_, first)| **first == wanted);
        Dataset { samples: taken.map(|(s, _)| s.clone()).collect(), ..whole.clone() }
    })
}

/// The joint that the first sentence of a comparison names for its zero, and its offset in one-sigmas from `truth`, rad.
fn named(comparison: &Comparison, truth: f64) -> Option<(usize, f64)> {
    let first = comparison.findings.first()?;
    match first.subject {
        Subject::Offset(k) => Some((comparison.offsets[k].joint, (first.sizes[0] - truth) / first.sigmas[0])),
        _ => None,
    }
}

/// Joint 7 turns about the ball, so no seating tells its angle, and joint 1 turns the world if the sockets are set up again.
const VISIBLE: [usize; 5] = [2, 3, 4, 5, 6];

fn a_tenth_of_a_degree_is_named(set_up: &str, anew: bool) {
    let (mut right, mut alarms, mut squares) = (0, 0, 0.0);
    for (seed, name) in SOCKETS.into_iter().enumerate() {
        let whole = socket(name);
        let mut random = ChaCha8Rng::seed_from_u64(100 + seed as u64);
        for trial in 0..TRIALS {
            let [before, mut after] = halves(&whole, &mut random);
            let calibration = identify(&[NamedDataset::new("d", &before)], &Model::default_for(&before)).unwrap();
            let calibration = if anew { calibration.set_up_anew() } else { calibration };
            let compare = |data: &Dataset| Comparison::of(&calibration, &[NamedDataset::new("d", data)], Use::All).unwrap();
            alarms += usize::from(named(&compare(&after), 0.0).is_some());
            let (joint, by) = (VISIBLE[trial % VISIBLE.len()], if random.random() { 0.1 } else { -0.1 } * DEG);
            after.samples.iter_mut().for_each(|s| s.q[joint - 1] += by);
            // The joint stands where it stood: less than reported.
            if let Some((found, sigmas)) = named(&compare(&after), -by)
                && found == joint
            {
                right += 1;
                squares += sigmas * sigmas;
            }
        }
    }
    let all = SOCKETS.len() * TRIALS;
    let spread = (squares / f64::from(right)).sqrt();
    println!("{set_up}: joint named in {right} of {all}, {alarms} false alarms, offset off by {spread:.2} sigma rms");
    assert!(f64::from(right) >= 0.95 * all as f64, "{set_up}: {right} of {all}");
    // At 1 % for all views together; 8 of 200 would come in one run of 1,000.
    assert!(alarms < 8, "{set_up}: {alarms} false alarms");
    // The robot of one half is known from the other only as well as its own sigma says.
    assert!((0.5..1.6).contains(&spread), "{set_up}: {spread}");
}

#[test]
fn a_tenth_of_a_degree_is_named_where_the_sockets_stayed() {
    a_tenth_of_a_degree_is_named("sockets where they were", false);
}

#[test]
fn a_tenth_of_a_degree_is_named_where_the_sockets_are_set_up_anew() {
    a_tenth_of_a_degree_is_named("sockets set up anew", true);
}

#[test]
fn a_place_left_out_is_predicted() {
    // 0.178 and 0.188 mm are what an independent analysis of the same data found possible.
    for (name, bar) in [("panda_1", 0.70), ("panda_3", 0.18), ("panda_6", 0.27), ("kuka_14", 0.19)] {
        let dataset = socket(name);
        let models = [Model::of(&["base_frame"]), Model::of(&["base_frame", "mdh"]), Model::default_for(&dataset)];
        let [nominal, geometry, default] = models.map(|model| spread_at_places_left_out(&dataset, &model) / MM);
        let count = places(&dataset).len();
        println!(
            "{name}, one of {count} places left out: nominal {nominal:.3}, geometry {geometry:.3}, default {default:.3} mm"
        );
        assert!(default <= bar, "{name}: {default} mm, above the bar of {bar} mm");
    }
}

#[test]
fn a_ball_is_offered_as_moved_where_it_was_probed_at_a_known_place() {
    let mut dataset = socket("panda_1");
    let hole = dataset.balls.iter().position(|b| b.id == "front/hole_0").expect("the data have it");
    for sample in &mut dataset.samples {
        if matches!(sample.measured, Measured::Ball { ball, .. } if ball == hole) {
            sample.set = SampleSet::Validation;
        }
    }
    let offered = |dataset: &Dataset| -> Vec<String> {
        let library = Library::new(&[NamedDataset::new("d", dataset)], &Model::default_for(dataset));
        library.candidates.iter().filter_map(|c| c.id.ball_name().map(str::to_owned)).collect()
    };
    assert!(offered(&dataset).is_empty(), "all are free: {:?}", offered(&dataset));
    dataset.balls.iter_mut().for_each(|ball| ball.free = false);
    let probed: Vec<String> = dataset.ball_ids().into_iter().filter(|id| id != "front/hole_0").collect();
    assert_eq!(offered(&dataset), probed);
}

/// The place of a ball: what stands before the hole in its name.
fn place(dataset: &Dataset, ball: usize) -> &str {
    dataset.balls[ball].id.split('/').next().unwrap_or_default()
}

/// The places of the sockets.
pub fn places(dataset: &Dataset) -> Vec<&str> {
    let mut places: Vec<&str> = (0..dataset.balls.len()).map(|ball| place(dataset, ball)).collect();
    places.dedup();
    places
}

/// Rms distance of the seatings of a hole from their own mean, each place left out of the fit in turn, m.
pub fn spread_at_places_left_out(dataset: &Dataset, model: &Model) -> f64 {
    let mut squares = Vec::new();
    for left_out in places(dataset) {
        let mut split = dataset.clone();
        for sample in &mut split.samples {
            if matches!(sample.measured, Measured::Ball { ball, .. } if place(dataset, ball) == left_out) {
                sample.set = SampleSet::Validation;
            }
        }
        let calibration = identify(&[NamedDataset::new("d", &split)], model).unwrap_or_else(|e| panic!("{left_out}: {e}"));
        let prediction = calibration
            .predict(&[NamedDataset::new("d", &split)], Use::Validation)
            .unwrap_or_else(|e| panic!("{left_out}: {e}"));
        assert!(prediction.refitted.iter().all(|name| name.starts_with("ball:")), "{:?}", prediction.refitted);
        // Deviations of the seatings of a hole from their own mean: where the hole is judges nobody.
        let held: Vec<_> = split.samples.iter().filter(|s| s.set == SampleSet::Validation).collect();
        for hole in 0..split.balls.len() {
            let on = |m: &Measured| matches!(m, Measured::Ball { ball, .. } if *ball == hole);
            let of_hole: Vec<Vector3<f64>> =
                held.iter().zip(&prediction.residuals).filter(|(s, _)| on(&s.measured)).map(|(_, r)| *r).collect();
            let mean = of_hole.iter().sum::<Vector3<f64>>() / of_hole.len().max(1) as f64;
            squares.extend(of_hole.iter().map(|r| (r - mean).norm_squared()));
        }
    }
    assert_eq!(squares.len(), dataset.samples.len());
    (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
}
