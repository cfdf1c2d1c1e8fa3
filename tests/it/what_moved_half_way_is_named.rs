//! A base that moved half-way through a campaign is found in the order of the rows, where nobody wrote down the time, before a lost
//! zero or a gear's ripple; of robots that stood still nothing of the kind is said, in whatever order they were measured. Good rows at
//! one end of the order are not blamed for a warm-up.
//!
//! Arms scatter by 0.1 deg and 0.3 mm and have eccentric encoders, which the model lacks; the instrument scatters by 50 um.

use calibench::diagnosis::diagnose;
use calibench::identify::Model;
use calibench::measure::dataset::{Dataset, Measured, NamedDataset};
use calibench::residuals::misfit::Abnormal;
use calibench::robot::built_in;
use calibench::units::{MM, MRAD, URAD};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::a_slip_beside_the_arm_is_told_from_it::{ROBOTS, measured, vector};

/// Fifty points of a real arm, of every other one sorted by the first joint; of every other pair the noise is not stated.
fn campaign(seed: u64) -> Dataset {
    let random = &mut ChaCha8Rng::seed_from_u64(seed);
    let mut data = measured(built_in(ROBOTS[seed as usize % 4]).unwrap(), 0, 1.0, random);
    let joints = data.robot.joints();
    let encoders: Vec<[f64; 2]> =
        (0..joints).map(|_| [300.0 * URAD * random.random_range(0.0..1.0), random.random_range(-3.0..3.0)]).collect();
    for sample in &mut data.samples {
        sample.q.iter_mut().zip(&encoders).for_each(|(q, [size, phase])| *q -= size * (*q + phase).sin());
    }
    if seed.is_multiple_of(2) {
        data.samples.sort_by(|a, b| a.q[0].total_cmp(&b.q[0]));
    }
    if seed / 4 % 2 == 1 {
        data.noise.point = None;
    }
    data
}

/// The same, moved by 0.5 to 5 mm between two rows in the middle.
fn moved(seed: u64) -> Dataset {
    let mut data = campaign(seed);
    let random = &mut ChaCha8Rng::seed_from_u64(seed + 1_000_000);
    let from = random.random_range(15..35);
    let by = vector(random).normalize() * (MM * 10f64.powf(random.random_range(-0.3..0.7)));
    for sample in data.samples.iter_mut().skip(from) {
        if let Measured::Point(point) = &mut sample.measured {
            *point += by;
        }
    }
    data
}

/// What is said to have happened, and what is abnormal.
fn said(data: &Dataset) -> (Option<String>, Vec<Abnormal>) {
    let diagnosis = diagnose(&[NamedDataset::new("rows", data)], &Model::default_for(data)).expect("fifty points");
    (diagnosis.by_row_order.map(|event| event.hypothesis.in_model.to_string()), diagnosis.abnormal)
}

/// How many of so many campaigns say that something moved: where it did, and where nothing did.
fn found(seeds: std::ops::Range<u64>) -> [usize; 2] {
    let (mut of_moved, mut of_right) = (0, 0);
    for seed in seeds {
        let (event, abnormal) = said(&moved(seed));
        let is_named = event.as_deref().is_some_and(|e| e.starts_with("base_") || e.starts_with("tool_step"));
        assert!(!is_named || abnormal.is_empty(), "{seed}: beside {event:?}: {abnormal:?}");
        of_moved += usize::from(is_named);
        let (event, _) = said(&campaign(seed));
        of_right += usize::from(event.is_some());
    }
    [of_moved, of_right]
}

/// The same, the zero of one joint drifting by a milliradian or two while the arm warms up in the first rows.
fn warmed_up(seed: u64) -> Dataset {
    let mut data = campaign(seed & !1 | 1);
    let random = &mut ChaCha8Rng::seed_from_u64(seed + 2_000_000);
    let joint = random.random_range(0..3);
    let (size, rows) = (random.random_range(1.0..2.0) * MRAD, random.random_range(15.0..40.0));
    for (k, sample) in data.samples.iter_mut().enumerate() {
        sample.q[joint] += size * (-(k as f64) / rows).exp();
    }
    data
}

/// The same, some rows that follow each other being wrong by millimetres, each in its own way.
fn mistyped(seed: u64) -> Dataset {
    let mut data = campaign(seed);
    let random = &mut ChaCha8Rng::seed_from_u64(seed + 3_000_000);
    let from = random.random_range(5..40);
    for sample in data.samples.iter_mut().skip(from).take(4) {
        if let Measured::Point(point) = &mut sample.measured {
            *point += vector(random).normalize() * (MM * random.random_range(5.0..20.0));
        }
    }
    data
}

/// Of so many campaigns: how many that warmed up blame rows, and how many say that something happened; how many with wrong rows say so.
fn crowds(seeds: std::ops::Range<u64>) -> [usize; 3] {
    let mut all = [0; 3];
    for seed in seeds {
        let [warm, wrong] = [warmed_up(seed), mistyped(seed)].map(|data| {
            let model = Model::default_for(&data);
            diagnose(&[NamedDataset::new("rows", &data)], &model).expect("fifty points")
        });
        all[0] += usize::from(warm.scatter.suspects.len() > 2);
        all[1] += usize::from(warm.by_row_order.is_some());
        all[2] += usize::from(wrong.by_row_order.is_some());
    }
    all
}

#[test]
fn rows_that_crowd_at_one_end_are_a_warm_up() {
    // Rows that are wrong and follow each other stay wrong rows.
    assert_eq!(crowds(0..8), [0, 1, 0]);
}

#[test]
fn a_base_that_moved_is_named_and_one_that_stood_is_not() {
    assert_eq!(found(0..6), [6, 0]);
}

#[test]
#[ignore = "two minutes: validation/run what_moved_half_way_is_named"]
fn sixty_moved_bases_and_sixty_that_stood() {
    let [of_moved, of_right] = found(1000..1060);
    println!("named: {of_moved} of 60 that moved, {of_right} of 60 that stood");
    assert!(of_moved >= 54 && of_right <= 1, "{of_moved} {of_right}");
    let [blaming, happened, wrong] = crowds(1000..1060);
    println!(
        "{blaming} of 60 that warmed up blame three rows or more, {happened} say that something happened; of 60 with four wrong rows in a row {wrong}"
    );
    assert!(blaming <= 6 && wrong <= 1, "{blaming} {wrong}");
}
