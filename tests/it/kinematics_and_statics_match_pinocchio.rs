//! Poses and gravity torques equal those of Pinocchio and MuJoCo, nominal and with the parameters of the paper's Table 8.

use crate::works::golden;
use calibench::robot::kinematics::{Posture, world_from_tool};
use calibench::robot::sites::SiteIndex;
use calibench::robot::statics::Loads;
use nalgebra::Vector3;

/// The two programs agree with each other to 1e-15 m; a metre-sized chain of six rotations rounds to about that.
const POSE_TOLERANCE: f64 = 1e-12;
/// The two programs agree to 1.6e-13 N·m.
const TORQUE_TOLERANCE: f64 = 1e-9;

fn largest_difference(pose: &calibench::robot::Pose, golden: &[f64]) -> f64 {
    let ours = pose.to_homogeneous();
    (0..12).map(|k| (ours[(k / 4, k % 4)] - golden[k]).abs()).fold(0.0, f64::max)
}

#[test]
fn poses_match() {
    let (model, file) = (golden::golden_model(), golden::read("fk_torque_200.json"));
    let mut posture = Posture::new(&model.robot);
    let rows = |key: &str| golden::rows(&file[key]);
    let holding = rows("tau_pinocchio");
    for (k, q) in rows("q").iter().enumerate() {
        for (values, key) in [(model.nominal(), "pose_nominal_pinocchio"), (model.table8(), "pose_table8_pinocchio")] {
            posture.set(&model.robot, &model.base, &model.tool, q, &model.deviations(&values, &holding[k]));
            let difference = largest_difference(&posture.world_from_tool(&model.tool), &rows(key)[k]);
            assert!(difference < POSE_TOLERANCE, "{key} {k}: {difference:e}");
        }
        let plain = world_from_tool(&model.robot, &model.base, &model.tool, q);
        assert!(largest_difference(&plain, &rows("pose_nominal_pinocchio")[k]) < POSE_TOLERANCE);
    }
}

#[test]
fn the_load_is_the_reverse_of_the_holding_torque() {
    let (model, file) = (golden::golden_model(), golden::read("fk_torque_200.json"));
    let mut posture = Posture::new(&model.robot);
    let mut loads = Loads::new(model.robot.joints());
    let none = vec![0.0; SiteIndex::new(model.robot.joints()).len()];
    for key in ["tau_pinocchio", "tau_mujoco"] {
        for (q, holding) in golden::rows(&file["q"]).iter().zip(golden::rows(&file[key])) {
            posture.set(&model.robot, &model.base, &model.tool, q, &none);
            loads.compute(&model.robot, &posture, &model.payload, &model.gravity, &Vector3::zeros());
            for (load, holding) in loads.tau.iter().zip(holding) {
                assert!((load + holding).abs() < TORQUE_TOLERANCE, "{key}: load {load}, holding torque {holding}");
            }
        }
    }
}
