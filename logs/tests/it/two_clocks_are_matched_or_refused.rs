//! A recording of joints and one of an instrument with a clock of its own: the shift between them is found to hundredths of a second,
//! or it is asked for; it is never another. Readings that are wrong, encoders with coarse steps, and motions of one length included.

use std::f64::consts::PI;

use calibench::nalgebra::Vector3;
use calibench::robot::kinematics::world_from_tool;
use calibench::robot::{FramePose, Robot, built_in};
use calibench_logs::{JointTrack, Log, LogOptions, Track, still_poses};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};

/// What is recorded.
struct Campaign {
    poses: usize,
    /// Readings a second of the joints, and of the instrument.
    rates: [f64; 2],
    /// Step of the encoders, rad.
    step: f64,
    /// One-sigma of the instrument, m.
    noise: f64,
    /// Share of its readings that are wrong by decimetres.
    wrong: f64,
    /// True if all motions and rests are of one length.
    equal: bool,
}

/// The recording, and the time to be added to those of the instrument.
fn recorded(robot: &Robot, campaign: &Campaign, seed: u64) -> (Log, f64) {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let normal = Normal::new(0.0, 1.0).unwrap();
    let Campaign { poses, rates, step, noise, wrong, equal } = *campaign;
    let postures: Vec<Vec<f64>> = (0..poses).map(|_| (0..6).map(|_| random.random_range(-1.5..1.5)).collect()).collect();
    let mut begins = vec![0.0];
    let mut lengths = Vec::new();
    for _ in 0..poses {
        let (move_s, rest_s) = if equal { (1.2, 1.4) } else { (random.random_range(0.6..2.0), random.random_range(1.0..3.0)) };
        lengths.push(move_s);
        begins.push(begins[begins.len() - 1] + move_s + rest_s);
    }
    let at = |t: f64| -> Vec<f64> {
        let k = begins.partition_point(|begin| *begin <= t).clamp(1, poses) - 1;
        let share = ((t - begins[k]) / lengths[k]).clamp(0.0, 1.0);
        let share = share * share * (3.0 - 2.0 * share);
        let before = &postures[k.saturating_sub(1)];
        before.iter().zip(&postures[k]).map(|(a, b)| a + (b - a) * share).collect()
    };
    let end = begins[poses];
    let mut joints = JointTrack {
        name: "joints".into(),
        joints: (1..=6).map(|j| format!("joint_{j}")).collect(),
        is_si: true,
        ..JointTrack::default()
    };
    for k in 0..(end * rates[0]) as usize {
        let t = k as f64 / rates[0];
        let read = |q: f64| if step > 0.0 { (q / step).round() * step } else { q };
        joints.times.stated.push(t);
        joints.times.recorded.push(t);
        joints.positions.extend(at(t).into_iter().map(read));
    }
    let shift = random.random_range(-5000.0..5000.0);
    let tool = FramePose { xyz: [0.03, -0.02, 0.11], ..FramePose::default() };
    let base = FramePose { xyz: [1.5, -0.7, 0.4], rz_ry_rx: [0.6, 0.0, PI] };
    let mut track =
        Track { name: "tracker".into(), titles: ["x_m", "y_m", "z_m"].map(str::to_owned).into(), ..Track::default() };
    for k in 0..((end - 1.0) * rates[1]) as usize {
        let t = 0.5 + k as f64 / rates[1];
        let seen = world_from_tool(robot, &base, &tool, &at(t)).translation.vector;
        let off = if random.random_bool(wrong) { 0.2 } else { noise };
        let seen = seen + Vector3::from_fn(|_, _| off * normal.sample(&mut random));
        track.times.stated.push(t - shift);
        track.times.recorded.push(t - shift);
        track.values.extend(seen.iter());
    }
    (Log { joints: vec![joints], tracks: vec![track], ..Log::default() }, shift)
}

#[test]
fn a_shift_is_right_or_is_asked_for() {
    let robot = built_in("ur5").unwrap();
    let usual = Campaign { poses: 40, rates: [50.0, 15.0], step: 0.0, noise: 20e-6, wrong: 0.0, equal: false };
    let coarse = Campaign { step: 0.0015, noise: 3e-4, ..usual };
    let wrong = Campaign { wrong: 0.05, ..usual };
    let equal = Campaign { equal: true, ..usual };
    let slow = Campaign { rates: [10.0, 5.0], ..usual };
    let few = Campaign { poses: 12, ..usual };
    let few_equal = Campaign { poses: 12, equal: true, ..usual };
    for (name, campaign, at_least) in [
        ("usual", usual, 6),
        ("coarse", coarse, 6),
        ("wrong", wrong, 6),
        ("equal", equal, 6),
        ("slow", slow, 6),
        ("few", few, 0),
        ("few equal", few_equal, 0),
    ] {
        let mut found = 0;
        for seed in 0..6 {
            let (log, shift) = recorded(&robot, &campaign, 7000 + seed);
            let Ok(poses) = still_poses(&log, &robot, &LogOptions::default()) else { continue };
            assert!((poses.shift_s - shift).abs() < 0.05, "{name}, {seed}: {} for {shift}", poses.shift_s);
            assert!(poses.rows * 10 >= campaign.poses * 9, "{name}, {seed}: {} rows", poses.rows);
            found += 1;
        }
        assert!(found >= at_least, "{name}: {found}");
    }
}
