//! The rigid part of an identified arm, written as URDF and as robot file, is the same arm to whoever reads it back; and what neither
//! can hold is stated with its size.

use std::collections::HashMap;

use crate::identified::{calibration, calibration_of, postures};
use calibench::compensate::urdf::urdf;
use calibench::compensate::{Compensator, Task};
use calibench::robot::kinematics::world_from_tool;
use calibench::robot::robot_file::{load_robot, to_toml};
use calibench::robot::{FramePose, Pose};
use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};

/// Poses of an arm of a metre, written with all digits.
const SAME: f64 = 1e-9;

/// `world_from_link` by what another program reads from the file.
fn urdf_pose(text: &str, link: &str, q: &[f64]) -> Pose {
    let robot = urdf_rs::read_from_string(text).unwrap();
    let by_child: HashMap<&str, &urdf_rs::Joint> = robot.joints.iter().map(|j| (j.child.link.as_str(), j)).collect();
    let mut pose = Isometry3::identity();
    let mut at = link;
    while let Some(joint) = by_child.get(at) {
        let [roll, pitch, yaw] = joint.origin.rpy.0;
        let origin = Isometry3::from_parts(
            Translation3::from(Vector3::from(joint.origin.xyz.0)),
            UnitQuaternion::from_euler_angles(roll, pitch, yaw),
        );
        let motion = match joint.joint_type {
            urdf_rs::JointType::Revolute => {
                let place: usize = joint.name.strip_prefix("joint_").unwrap().parse().unwrap();
                let axis = nalgebra::Unit::new_normalize(Vector3::from(joint.axis.xyz.0));
                UnitQuaternion::from_axis_angle(&axis, q[place - 1])
            }
            _ => UnitQuaternion::identity(),
        };
        pose = origin * motion * pose;
        at = &joint.parent.link;
    }
    Pose::from_parts(pose.translation, pose.rotation.to_rotation_matrix())
}

fn apart(a: &Pose, b: &Pose) -> f64 {
    (a.to_homogeneous() - b.to_homogeneous()).amax()
}

#[test]
fn both_files_carry_the_identified_links_exactly() {
    let calibration = calibration(1);
    let rigid = Compensator::new(&calibration, &Task::default()).unwrap().rigid();
    let text = urdf(&rigid);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("calibrated.toml");
    std::fs::write(&path, to_toml(&rigid.robot)).unwrap();
    let read = load_robot(&path).unwrap();
    let drawn = &calibration.robot;
    for q in postures(200, 2) {
        let here = world_from_tool(&rigid.robot, &rigid.base, &rigid.tool, &q);
        assert!(apart(&urdf_pose(&text, "tcp", &q), &here) < SAME);
        assert!(apart(&world_from_tool(&read, &rigid.base, &rigid.tool, &q), &here) < SAME);
        let kuka = FramePose { rz_ry_rx: [0.0, std::f64::consts::PI, 0.0], ..FramePose::default() };
        assert!(apart(&urdf_pose(&text, "flange", &q), &world_from_tool(&rigid.robot, &rigid.base, &kuka, &q)) < SAME);
        let setup = &calibration.setups[0];
        assert!(apart(&here, &world_from_tool(drawn, &setup.base, &setup.tool, &q)) > 1e-4, "it is not the drawing");
    }
    for (link, read) in rigid.robot.links.iter().zip(&urdf_rs::read_from_string(&text).unwrap().joints[1..]) {
        assert_eq!([read.limit.lower, read.limit.upper], link.limits);
    }
}

/// If every identified effect is rigid, nothing is left out: then the files are the whole calibration.
#[test]
fn what_is_left_out_is_stated_with_its_size() {
    let robot = || calibench::robot::built_in("kr6_r700").unwrap();
    let links = calibration_of(robot(), &["base_frame", "mdh", "tool_frame"], 3);
    let rigid = Compensator::new(&links, &Task::default()).unwrap().rigid();
    assert!(rigid.effects.is_empty() && rigid.left_out.max < 1e-12, "{:?}", rigid.left_out);
    assert!(urdf(&rigid).contains("nothing that a chain of links does not"));

    let bent = calibration_of(robot(), &["base_frame", "mdh", "joint_compliance"], 3);
    let rigid = Compensator::new(&bent, &Task::default()).unwrap().rigid();
    assert_eq!(rigid.effects, ["joint_compliance"]);
    assert!(rigid.left_out.mean > 1e-4 && rigid.left_out.max > rigid.left_out.mean, "{:?}", rigid.left_out);
    let text = urdf(&rigid);
    let said = text.lines().find(|line| line.contains("mm at most")).unwrap();
    assert!(said.contains(&format!("{:.3} mm in the mean", rigid.left_out.mean * 1e3)), "{said}");
    assert!(text.contains("NOT IN THIS FILE") && text.contains("joint_compliance"));
}
