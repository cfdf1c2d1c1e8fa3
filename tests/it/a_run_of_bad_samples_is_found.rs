//! Samples that were spoilt one after the other are found together although each is predicted by its neighbours, and a good campaign
//! has no such run.

use std::sync::Arc;

use calibench::identify::Model;
use calibench::measure::dataset::{Dataset, Measured, NamedDataset, Noise, Sample};
use calibench::residuals::noise::suspects;
use calibench::robot::kinematics::world_from_tool;
use calibench::robot::{FramePose, built_in};
use calibench::units::UM;
use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

const NOISE: f64 = 10.0 * UM;

/// Forty points, of which `bad` in a row are off by ten to twenty times the noise.
fn campaign(seed: u64, bad: usize) -> (Dataset, Vec<String>) {
    let random = &mut ChaCha8Rng::seed_from_u64(seed);
    let normal = |random: &mut ChaCha8Rng, size: f64| size * (0..12).map(|_| random.random_range(-0.5..0.5)).sum::<f64>();
    let robot = Arc::new(built_in("kr6_r700").unwrap());
    let (base, tool) = (FramePose::default(), FramePose { xyz: [0.06, 0.01, 0.125], ..FramePose::default() });
    let first = random.random_range(0..=40 - bad);
    // All alike or each by itself: a slipped clamp, a drop of coolant.
    let together = Vector3::from_fn(|_, _| normal(random, 15.0 * NOISE));
    let samples = (0..40).map(|k| {
        let q: Vec<f64> =
            robot.links.iter().map(|l| random.random_range(l.limits[0].max(-2.4)..l.limits[1].min(2.4))).collect();
        let mut seen = world_from_tool(&robot, &base, &tool, &q).translation.vector;
        seen += Vector3::from_fn(|_, _| normal(random, NOISE));
        if (first..first + bad).contains(&k) {
            seen += if seed.is_multiple_of(2) { together } else { Vector3::from_fn(|_, _| normal(random, 15.0 * NOISE)) };
        }
        Sample { time_s: Some(45.0 * k as f64), ..Sample::new(format!("p{k}"), q, Measured::Point(seen)) }
    });
    let samples = samples.collect();
    let noise = Noise { point: Some(NOISE), ..Noise::default() };
    let spoilt = (first..first + bad).map(|k| format!("p{k}")).collect();
    (Dataset { robot, base, tool, tool_free: true, noise, samples, ..Dataset::default() }, spoilt)
}

fn found(data: &Dataset) -> Vec<String> {
    let all = suspects(&[NamedDataset::new("campaign", data)], &Model::geometry()).unwrap();
    all.into_iter().map(|s| s.sample).collect()
}

#[test]
fn four_neighbours_in_time_do_not_hide_each_other() {
    let hits = (0..24).into_par_iter().filter(|&seed| {
        let (data, spoilt) = campaign(3700 + seed, 4);
        let found = found(&data);
        // One that happens to be right is none.
        found.len() >= 3 && found.iter().all(|id| spoilt.contains(id))
    });
    let hits = hits.count();
    assert!(hits >= 22, "{hits} of 24");
}

#[test]
fn a_good_campaign_has_none() {
    let alarms = (0..60).into_par_iter().filter(|&seed| !found(&campaign(3800 + seed, 0).0).is_empty()).count();
    assert_eq!(alarms, 0);
}
