//! A calibration of any model that data allow is read back from its file as it was written: also where balls are certified to
//! nothing and one of them was knocked.

use std::sync::Arc;

use calibench::effects::Subject;
use calibench::effects::registry::{self, Registry};
use calibench::identify::calibration::{read_calibration, write_calibration};
use calibench::identify::{Model, identify};
use calibench::measure::dataset::{Ball, Dataset, Measured, NamedDataset, Noise, Sample};
use calibench::robot::kinematics::world_from_tool;
use calibench::robot::{FramePose, built_in};
use calibench::units::UM;
use nalgebra::Vector3;

/// Two balls touched forty times in the course of an hour, at joints and readings that agree.
fn touches() -> Dataset {
    let robot = Arc::new(built_in("kr6_r700").unwrap());
    let (base, tool) = (FramePose::default(), FramePose { xyz: [0.05, 0.02, 0.15], ..FramePose::default() });
    let balls = [("socket:1", 0.3), ("socket:2", -0.3)];
    let ball = |&(id, y): &(&str, f64)| Ball { id: id.into(), position: Vector3::new(0.4, y, 0.3), free: false, sigma: 0.0 };
    let sample = |k: usize| {
        let q: Vec<f64> = (1..=6).map(|i| 2.4 * ((k * i) as f64 * 0.618).fract() - 1.2).collect();
        let seen = world_from_tool(&robot, &base, &tool, &q);
        // The ball as the gauge reads it, in the frame of the tool, with a few micrometres of noise.
        let noise = Vector3::new(1.0, -2.0, 1.5) * (UM * ((k * 7) as f64 * 0.377).sin());
        let reading =
            seen.inverse_transform_vector(&(Vector3::new(0.4, balls[k % 2].1, 0.3) - seen.translation.vector)) + noise;
        let plain = Sample::new(format!("p{k}"), q, Measured::Ball { ball: k % 2, reading: Some(reading) });
        Sample { time_s: Some(90.0 * k as f64), ..plain }
    };
    let samples = (0..40).map(sample).collect();
    let noise = Noise { ball: Some(3.0 * UM), ..Noise::default() };
    Dataset { robot, base, tool, noise, samples, balls: balls.iter().map(ball).collect(), ..Dataset::default() }
}

#[test]
fn every_effect_is_read_back_from_a_calibration() {
    let data = touches();
    let named = [NamedDataset::new("campaign", &data)];
    let balls = data.ball_ids();
    let mut ids = registry::ids(&Subject::new(&data.robot, &balls));
    // Those that are looked for over times.
    ids.extend(["ball_step:socket:2:1078.5", "base_step:1078.5", "tool_step:1078.5", "joint_step:2:1078.5"].map(String::from));
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("calibration.toml");
    let mut read = Vec::new();
    for id in ids.iter().filter(|id| !["base_frame", "mdh"].contains(&id.as_str())) {
        // What these samples do not show cannot be identified.
        let Ok(calibration) = identify(&named, &Model::geometry().with(id)) else { continue };
        write_calibration(&calibration, &path).unwrap();
        match read_calibration(&path, Registry::catalogue()) {
            Ok(back) => assert_eq!(back.model.ids(), calibration.model.ids(), "{id}"),
            Err(e) => panic!("{id}: {e}"),
        }
        read.push(id.as_str());
    }
    assert!(read.contains(&"ball_step:socket:2:1078.5") && read.len() > 30, "{read:?}");
}
