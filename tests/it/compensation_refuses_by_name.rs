//! A target that cannot be compensated, or that needs care, is never dropped: it keeps its row, with the reason by name.

use std::sync::Arc;

use crate::identified::{calibration, calibration_of, postures, target};
use calibench::compensate::targets_file::fake_csv;
use calibench::compensate::{Compensator, Desired, NEAR_SINGULAR, Refusal, Task, TaskError, WorkFrame};
use calibench::effects::own::OwnEffect;
use calibench::robot::statics::Payload;
use calibench::robot::{FramePose, Pose, built_in};
use calibench::units::{DEG, MM, Unit};
use nalgebra::Vector3;

const PLAIN: [f64; 6] = [0.2, -1.2, 1.6, 0.3, 0.8, 0.5];

fn pose_of(compensator: &Compensator<'_>, q: &[f64]) -> Desired {
    Desired::Pose { pose: compensator.nominal_pose(q), near: Some(q.to_vec()), status: None, turn: None }
}

#[test]
fn every_refusal_has_its_row() {
    let calibration = calibration(1);
    let mut compensator = Compensator::new(&calibration, &Task::default()).unwrap();
    let far = Desired::Pose { pose: Pose::translation(3.0, 0.0, 0.5), near: None, status: None, turn: None };
    let beyond: Vec<f64> = [175.0, -60.0, 80.0, 10.0, 40.0, 5.0].map(|a: f64| a * DEG).into();
    // In the limit as drawn, and the identified arm needs more.
    let mut at_limit = None;
    for joint in 0..3 {
        for side in 0..2 {
            let mut q = PLAIN.to_vec();
            q[joint] = calibration.robot.links[joint].limits[side];
            let result = compensator.compensate(&target("limit", Desired::Joints(q.clone())));
            if let Err(Refusal::JointLimit { joint: Some(at) }) = result.outcome {
                assert_eq!(at, joint);
                at_limit = at_limit.or(Some(q));
            }
        }
    }
    let cases = [
        ("far", far, "unreachable"),
        ("beyond", Desired::Joints(beyond), "joint_limit"),
        ("limit", Desired::Joints(at_limit.expect("each limit is needed by one side or the other")), "joint_limit"),
        ("plain", Desired::Joints(PLAIN.to_vec()), "ok"),
    ];
    let targets: Vec<_> = cases.iter().map(|(id, desired, _)| target(*id, desired.clone())).collect();
    let results: Vec<_> = targets.iter().map(|t| compensator.compensate(t)).collect();
    let file = fake_csv(&calibration.robot, &targets, &results);
    let rows: Vec<Vec<&str>> = file.lines().map(|line| line.split(',').collect()).collect();
    assert_eq!(rows.len(), 1 + cases.len(), "nothing is dropped");
    for (row, (id, _, status)) in rows[1..].iter().zip(&cases) {
        assert_eq!((row.len(), row[0], row[1]), (rows[0].len(), *id, *status));
        let empty = row[3..rows[0].len() - 7].iter().all(|field| field.is_empty());
        assert_eq!(empty, *status != "ok", "{id}: what was refused tells the controller nothing");
        assert!(row[rows[0].len() - 6..].iter().all(|field| !field.is_empty()), "{id}: the target is carried through");
    }
}

#[test]
fn a_configuration_that_is_not_there_is_named() {
    let calibration = calibration(1);
    let mut compensator = Compensator::new(&calibration, &Task::default()).unwrap();
    let pose = compensator.nominal_pose(&PLAIN);
    // No posture has all joints negative and reaches it.
    let desired = Desired::Pose { pose, near: None, status: None, turn: Some(63) };
    assert_eq!(compensator.compensate(&target("t", desired)).outcome, Err(Refusal::NoSuchConfiguration));
}

#[test]
fn near_the_wrist_singularity_it_is_said_and_a_flip_is_refused() {
    let calibration = calibration(1);
    let mut compensator = Compensator::new(&calibration, &Task::default()).unwrap();
    let at = |five: f64| vec![0.2, -1.2, 1.6, 0.3, five, 0.5];
    let mut statuses = Vec::new();
    for five in [0.5, 0.05, 2e-4, 1e-5, -1e-5, -2e-4, -0.05, -0.5] {
        let desired = pose_of(&compensator, &at(five));
        let result = compensator.compensate(&target("t", desired));
        if let Ok(fake) = &result.outcome {
            assert_eq!(result.warnings.near_singular, five.abs() < 0.1, "A5 {five}; the threshold is {NEAR_SINGULAR}");
            assert_eq!(fake.status_turn.unwrap().status >> 2, u8::from(five < 0.0), "the wrist did not flip");
        }
        statuses.push(result.outcome.map_or_else(|e| e.name(), |_| "ok"));
    }
    assert_eq!([statuses[0], statuses[1], statuses[6], statuses[7]], ["ok"; 4]);
    // The identified wrist is bent by some hundredths of a degree where the drawing's is straight.
    assert!(statuses.contains(&"configuration_flip"), "{statuses:?}");
}

#[test]
fn a_joint_that_was_never_measured_there_is_warned_of() {
    let mut calibration = calibration(1);
    calibration.joint_ranges[0] = [-0.1, 0.1];
    let mut compensator = Compensator::new(&calibration, &Task::default()).unwrap();
    let mut out_of_range = |first: f64| {
        let mut q = PLAIN.to_vec();
        q[0] = first;
        let result = compensator.compensate(&target("t", Desired::Joints(q)));
        assert!(result.outcome.is_ok());
        result.warnings.out_of_range
    };
    assert!(out_of_range(0.5) && !out_of_range(0.0));
}

#[test]
fn an_effect_without_a_value_is_named() {
    let mut calibration = calibration_of(built_in("kr6_r700").unwrap(), &["base_frame", "mdh"], 1);
    let term = calibench::effects::own::OwnTerm { site: "theta:3".into(), basis: "sqrt(q1)".into(), group: None };
    calibration.model.own.push(OwnEffect { name: "odd".into(), unit: Unit::DEG, plausible: 5e-3 * DEG, terms: vec![term] });
    calibration.model.effects.push("odd".into());
    let mut estimate = calibration.estimates[0].clone();
    (estimate.name, estimate.effect, estimate.value, estimate.nominal) = ("odd.1".into(), "odd".into(), 1e-4, 0.0);
    calibration.estimates.push(estimate);
    let m = calibration.estimates.len();
    calibration.correlation = nalgebra::DMatrix::identity(m, m);
    let mut compensator = Compensator::new(&calibration, &Task::default()).unwrap();
    let mut q = PLAIN.to_vec();
    assert!(compensator.compensate(&target("t", Desired::Joints(q.clone()))).outcome.is_ok());
    q[0] = -0.5;
    let refused = compensator.compensate(&target("t", Desired::Joints(q))).outcome;
    assert_eq!(refused, Err(Refusal::NoValue { effect: "odd".into() }));
}

#[test]
fn a_task_that_the_calibration_does_not_serve_is_refused() {
    let calibration = calibration(1);
    let refused = |change: &dyn Fn(&mut calibench::identify::calibration::Calibration), task: &Task| {
        let mut other = calibration.clone();
        change(&mut other);
        Compensator::new(&other, task).err()
    };
    let named = |name: &str| Task { setup: Some(name.into()), ..Task::default() };
    assert!(refused(&|_| (), &named("cell")).is_none());
    assert!(matches!(refused(&|_| (), &named("bench")), Some(TaskError::NoSuchSetup { known, .. }) if known == "cell"));
    assert_eq!(refused(&|c| c.setups.clear(), &Task::default()), Some(TaskError::NoSetup));
    let twice = |c: &mut calibench::identify::calibration::Calibration| {
        let mut second = c.setups[0].clone();
        (c.setups[0].label, second.label) = ("mon".into(), "tue".into());
        c.setups.push(second);
    };
    assert!(matches!(refused(&twice, &Task::default()), Some(TaskError::SeveralSetups { known }) if known == "mon, tue"));
    assert!(refused(&twice, &named("tue")).is_none());
    let weightless = |c: &mut calibench::identify::calibration::Calibration| {
        let mut robot = (*c.robot).clone();
        robot.links.iter_mut().for_each(|l| l.mass = 0.0);
        c.robot = Arc::new(robot);
    };
    assert!(matches!(refused(&weightless, &Task::default()), Some(TaskError::NoMasses { .. })));
}

/// The load that was entered is the load that bends the arm, and a tool of one's own is taken as it is.
#[test]
fn load_and_tool_of_the_task_are_taken() {
    let calibration = calibration(4);
    let q = &postures(1, 3)[0];
    let shift = |task: &Task| {
        let mut compensator = Compensator::new(&calibration, task).unwrap();
        compensator.compensate(&target("t", Desired::Joints(q.clone()))).outcome.unwrap().shift
    };
    let heavy = Payload { name: "heavy".into(), mass: 12.0, com: Vector3::new(0.0, 0.0, -100.0) * MM };
    assert!((shift(&Task { payload: Some(heavy), ..Task::default() }) - shift(&Task::default())).abs() > 1e-5);
    // The set-up's own tool, told as the controller has it, is the same tool; but what was found wrong with the certified one is not
    // carried over to it.
    let setup = &calibration.setups[0];
    let compensator = Compensator::new(&calibration, &Task::default()).unwrap();
    let tool = FramePose::from_pose(&compensator.flange_from_tool());
    let task = Task { tool: Some(tool), frame: WorkFrame::World, ..Task::default() };
    let own = Compensator::new(&calibration, &task).unwrap();
    assert!((own.arm().tool().pose().to_homogeneous() - setup.tool.pose().to_homogeneous()).amax() < 1e-15);
    assert!(own.arm().needs().all(|(id, _)| id != "tool_frame") && compensator.arm().needs().any(|(id, _)| id == "tool_frame"));
}
