//! At the joints of a compensated target the identified model has the tool where it is desired, to a micrometre and a microradian, in
//! position and orientation, whatever effects the calibration holds; and the controller, told the fake target, goes to those joints.

use crate::identified::{EFFECTS, calibration, calibration_of, largest_error, postures, target};
use calibench::compensate::{Compensator, Desired, Task, WorkFrame};
use calibench::robot::kinematics::world_from_tool;
use calibench::robot::{FramePose, Pose, built_in};
use calibench::units::UM;

/// Position of the TCP, m; at a metre from it this is a microradian.
const MET: f64 = 1.0 * UM;

#[test]
fn poses_in_the_world_are_met_with_either_load() {
    let calibration = calibration(1);
    let setup = &calibration.setups[0];
    let task = Task { frame: WorkFrame::World, ..Task::default() };
    let mut compensator = Compensator::new(&calibration, &task).unwrap();
    for (payload, load) in setup.payloads.iter().enumerate() {
        let mut reached = Vec::new();
        let mut largest_shift = 0.0f64;
        for q in postures(200, 2) {
            let pose = world_from_tool(&calibration.robot, &setup.base, &setup.tool, &q);
            let desired = Desired::Pose { pose, near: Some(q), status: None, turn: None };
            let found =
                compensator.compensate(&calibench::compensate::Target { payload: Some(load.clone()), ..target("t", desired) });
            let Ok(fake) = found.outcome else { continue };
            assert!((compensator.nominal_pose(&fake.q).to_homogeneous() - fake.pose.to_homogeneous()).amax() < 1e-12);
            let told = compensator.controller_joints(&fake.pose, fake.status_turn, &fake.q).unwrap();
            assert!(told.iter().zip(&fake.q).all(|(a, b)| (a - b).abs() < 1e-9), "{told:?} against {:?}", fake.q);
            largest_shift = largest_shift.max(fake.shift);
            reached.push((fake.q, pose));
        }
        assert!(reached.len() > 180, "{} of 200", reached.len());
        // Without compensation it would be millimetres: the test could fail.
        assert!(largest_shift > 1e-3, "{largest_shift}");
        let error = largest_error(&calibration, &reached, payload);
        assert!(error < MET, "payload {payload}: {error:e} m");
    }
}

#[test]
fn joint_targets_are_met_where_the_drawing_has_them() {
    let calibration = calibration(3);
    let setup = &calibration.setups[0];
    let mut compensator = Compensator::new(&calibration, &Task::default()).unwrap();
    let world_from_root = compensator.arm().world_from_root();
    let mut reached = Vec::new();
    for q in postures(100, 4) {
        let found = compensator.compensate(&target("t", Desired::Joints(q.clone())));
        let drawn = world_from_tool(&calibration.robot, &FramePose::default(), &setup.tool, &q);
        assert!((found.desired.to_homogeneous() - drawn.to_homogeneous()).amax() < 1e-12);
        if let Ok(fake) = found.outcome {
            reached.push((fake.q, world_from_root * drawn));
        }
    }
    assert!(reached.len() > 85, "{} of 100", reached.len());
    let error = largest_error(&calibration, &reached, 0);
    assert!(error < MET, "{error:e} m");
}

/// Arms without a closed form, one of them with seven joints.
#[test]
fn other_arms_are_compensated_too() {
    for name in ["ur10", "panda"] {
        let effects: Vec<&str> = EFFECTS.into_iter().filter(|e| !e.starts_with("link_bending")).collect();
        let calibration = calibration_of(built_in(name).unwrap(), &effects, 5);
        let setup = &calibration.setups[0];
        let mut compensator = Compensator::new(&calibration, &Task { frame: WorkFrame::World, ..Task::default() }).unwrap();
        let mut reached = Vec::new();
        for k in 0..40 {
            let share = |i: usize| 0.3 + 0.4 * ((k * 7 + i * 3) as f64 * 0.618_034).fract();
            let q: Vec<f64> = calibration
                .robot
                .links
                .iter()
                .enumerate()
                .map(|(i, l)| l.limits[0] + share(i) * (l.limits[1] - l.limits[0]))
                .collect();
            let pose = world_from_tool(&calibration.robot, &setup.base, &setup.tool, &q);
            let desired = Desired::Pose { pose, near: Some(q), status: None, turn: None };
            if let Ok(fake) = compensator.compensate(&target("t", desired)).outcome {
                assert_eq!(fake.status_turn, None, "KUKA's bits are of spherical wrists");
                reached.push((fake.q, pose));
            }
        }
        assert!(reached.len() > 30, "{name}: {} of 40", reached.len());
        let error = largest_error(&calibration, &reached, 0);
        assert!(error < MET, "{name}: {error:e} m");
    }
}

/// A pose without joints beside it finds them, and one after the other stays in one configuration.
#[test]
fn a_path_of_poses_stays_in_its_configuration() {
    let calibration = calibration(6);
    let mut compensator = Compensator::new(&calibration, &Task::default()).unwrap();
    let start = [0.2, -1.2, 1.6, 0.3, 0.8, 0.5];
    let from = compensator.nominal_pose(&start);
    let mut before: Option<Vec<f64>> = None;
    for k in 0..50 {
        let pose = Pose::translation(0.0, 0.004 * f64::from(k), 0.002 * f64::from(k)) * from;
        let near = (k == 0).then(|| start.to_vec());
        let fake =
            compensator.compensate(&target("t", Desired::Pose { pose, near, status: None, turn: None })).outcome.unwrap();
        if let Some(before) = before {
            assert!(before.iter().zip(&fake.q).all(|(a, b)| (a - b).abs() < 0.1), "a jump at {k}");
        }
        before = Some(fake.q);
    }
}
