//! A serial chain of a URDF file is the same arm here as to whoever else reads the file, whatever its axes; nearly parallel axes give
//! no metres; and a calibrated file holds the identified arm and every other byte.

use std::collections::HashMap;
use std::f64::consts::{FRAC_PI_2, PI};
use std::fmt::Write;
use std::path::{Path, PathBuf};

use calibench::files::FileError;
use calibench::robot::kinematics::world_from_tool;
use calibench::robot::robot_file::robot;
use calibench::robot::urdf::{ChainEnds, UrdfRobot, calibrated_urdf, joint_origins, missing_meshes, robot_from_urdf};
use calibench::robot::{JointKind, Pose, Robot};
use nalgebra::{Isometry3, Rotation3, Translation3, Unit, UnitQuaternion, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde_json::Value;

use crate::works::golden;

/// Some rounding of a chain of eight joints and metres.
const SAME: f64 = 1e-12;

/// `base_from_link` by another program's reading of the file; joints by name.
fn by_urdf_rs(text: &str, base: &str, link: &str, q: &HashMap<String, f64>) -> Pose {
    let robot = urdf_rs::read_from_string(text).unwrap();
    let mut pose = Isometry3::identity();
    let mut at = link.to_owned();
    while at != base {
        let joint = robot.joints.iter().find(|j| j.child.link == at).unwrap();
        let [roll, pitch, yaw] = joint.origin.rpy.0;
        let turned = UnitQuaternion::from_rotation_matrix(&Rotation3::from_euler_angles(roll, pitch, yaw));
        let origin = Isometry3::from_parts(Translation3::from(Vector3::from(joint.origin.xyz.0)), turned);
        let axis = Unit::new_normalize(Vector3::from(joint.axis.xyz.0));
        let moved = match joint.joint_type {
            urdf_rs::JointType::Revolute | urdf_rs::JointType::Continuous => {
                let turned = UnitQuaternion::from_axis_angle(&axis, q[&joint.name]);
                Isometry3::from_parts(Translation3::identity(), turned)
            }
            urdf_rs::JointType::Prismatic => Translation3::from(axis.into_inner() * q[&joint.name]).into(),
            _ => Isometry3::identity(),
        };
        pose = origin * moved * pose;
        at = joint.parent.link.clone();
    }
    Pose::from_parts(pose.translation, pose.rotation.to_rotation_matrix())
}

fn forward(robot: &Robot, q: &[f64]) -> Pose {
    world_from_tool(robot, &robot.root, &robot.flange, q)
}

fn apart(a: &Pose, b: &Pose) -> f64 {
    (a.to_homogeneous() - b.to_homogeneous()).amax()
}

/// Checks an arm at random postures; returns the largest difference.
fn check(text: &str, read: &UrdfRobot, random: &mut ChaCha8Rng) -> f64 {
    let mut worst = 0.0f64;
    for _ in 0..20 {
        let q: Vec<f64> = read.joint_names.iter().map(|_| random.random_range(-PI..PI)).collect();
        let named = read.joint_names.iter().cloned().zip(q.iter().copied()).collect();
        worst = worst.max(apart(&forward(&read.robot, &q), &by_urdf_rs(text, &read.base_link, &read.tool_link, &named)));
    }
    worst
}

struct Written {
    _folder: tempfile::TempDir,
    path: PathBuf,
}

fn written(text: &str) -> Written {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("arm.urdf");
    std::fs::write(&path, text).unwrap();
    Written { _folder: folder, path }
}

fn read(text: &str) -> Result<UrdfRobot, FileError> {
    robot_from_urdf(&written(text).path, &ChainEnds::default())
}

/// A URDF of joints given by origin (xyz, rpy) and axis, fixed links between them, and a branch that is not part of the arm.
fn urdf(joints: &[([f64; 3], [f64; 3], [f64; 3])], tip: ([f64; 3], [f64; 3]), with_mounts: bool) -> String {
    urdf_of(joints, tip, with_mounts, &[])
}

/// The same, the joints counted from 0 in `slides` being prismatic.
fn urdf_of(
    joints: &[([f64; 3], [f64; 3], [f64; 3])],
    tip: ([f64; 3], [f64; 3]),
    with_mounts: bool,
    slides: &[usize],
) -> String {
    let mut text =
        String::from("<?xml version=\"1.0\"?>\n<!-- made by hand -->\n<robot name=\"arm\">\n  <link name=\"world\"/>\n");
    let numbers = |v: &[f64; 3]| format!("{:?} {:?} {:?}", v[0], v[1], v[2]);
    let mut joint = |name: &str, kind: &str, parent: &str, child: &str, (xyz, rpy): (&[f64; 3], &[f64; 3]), axis: &str| {
        _ = writeln!(
            text,
            "  <link name=\"{child}\">\n    <visual><geometry><mesh filename=\"package://x/{child}.stl\"/></geometry></visual>\n  </link>"
        );
        _ = writeln!(
            text,
            "  <joint name=\"{name}\" type=\"{kind}\">\n    <parent link=\"{parent}\"/><child link=\"{child}\"/>"
        );
        _ = writeln!(text, "    <origin rpy='{}' xyz=\"{}\"/>{axis}\n  </joint>", numbers(rpy), numbers(xyz));
    };
    joint("stand", "fixed", "world", "base_link", (&[0.1, -0.2, 0.3], &[0.0, 0.0, 0.4]), "");
    joint("camera", "fixed", "base_link", "camera_link", (&[0.0, 0.0, 1.0], &[0.0; 3]), "");
    let mut parent = "base_link".to_owned();
    for (k, (xyz, rpy, axis)) in joints.iter().enumerate() {
        let child = format!("link_{}", k + 1);
        let limit = format!(
            "\n    <axis xyz=\"{}\"/>\n    <limit lower=\"-3.1\" upper=\"3.2\" effort=\"1\" velocity=\"1\"/>",
            numbers(axis)
        );
        let kind = match k {
            _ if slides.contains(&k) => "prismatic",
            2 => "continuous",
            _ => "revolute",
        };
        joint(&format!("joint {}", k + 1), kind, &parent, &child, (xyz, rpy), &limit);
        parent = child;
        if with_mounts && k % 2 == 1 {
            let mount = format!("mount_{}", k + 1);
            joint(&mount, "fixed", &parent, &mount, (&[0.01, 0.02, -0.03], &[0.3, 0.0, -0.2]), "");
            parent = mount;
        }
    }
    joint("tip", "fixed", &parent, "tool0", (&tip.0, &tip.1), "");
    text + "</robot>\n"
}

#[test]
fn any_chain_is_the_same_arm_and_never_metres() {
    let mut random = ChaCha8Rng::seed_from_u64(18);
    let (mut worst, mut longest, mut longest_with_slides) = (0.0f64, 0.0f64, 0.0f64);
    for round in 0..600 {
        let joints = random.random_range(2..=8);
        let mut three = |size: f64| std::array::from_fn::<f64, 3, _>(|_| random.random_range(-size..size));
        let mut made: Vec<_> = (0..joints).map(|_| (three(0.6), three(PI), three(1.0))).collect();
        let tip = (three(0.2), three(1.0));
        for k in 1..joints {
            // Parallel, opposite, nearly parallel, intersecting, coaxial.
            match random.random_range(0..8) {
                0 => (made[k].1, made[k].2) = ([0.0; 3], made[k - 1].2),
                1 => (made[k].1, made[k].2) = ([0.0; 3], made[k - 1].2.map(|v| -v)),
                2 => (made[k].1, made[k].2) = ([1e-5, -2e-4, 3e-6], made[k - 1].2),
                3 => made[k].0 = [0.0; 3],
                4 => made[k] = ([0.0; 3], [0.0; 3], made[k - 1].2),
                _ => {}
            }
        }
        // Rails, gantries and linear axes in the arm; the tool is named, because the last may look like a gripper's finger.
        let slides: Vec<usize> = (0..joints).filter(|_| round >= 300 && random.random_bool(0.4)).collect();
        let text = urdf_of(&made, tip, true, &slides);
        let to_tool = ChainEnds { base: None, tool: Some("tool0".into()) };
        let read = robot_from_urdf(&written(&text).path, &to_tool).unwrap();
        assert_eq!(read.robot.joints(), joints);
        let found: Vec<usize> = (0..joints).filter(|&k| read.robot.kind(k) == JointKind::Prismatic).collect();
        assert_eq!(found, slides);
        worst = worst.max(check(&text, &read, &mut random));
        let longest = if slides.is_empty() { &mut longest } else { &mut longest_with_slides };
        for link in &read.robot.links {
            *longest = longest.max(link.mdh.a.abs());
        }
        assert_eq!((read.base_link.as_str(), read.tool_link.as_str()), ("world", "tool0"));
        assert_eq!(read.robot.links[0].limits, [-3.1, 3.2]);
    }
    assert!(worst < SAME, "{worst:e}");
    assert!(longest < 2.0, "{longest} m");
    // Where several slide in parallel, the next row spans the offsets of them all.
    assert!(longest_with_slides < 5.0, "{longest_with_slides} m");
}

/// A chain of recorded joints as a URDF file.
fn recorded(joints: &Value) -> String {
    let mut text = String::from("<robot name=\"recorded\">\n<link name=\"0\"/>\n");
    for (k, joint) in joints.as_array().unwrap().iter().enumerate() {
        let numbers = |key: &str| golden::numbers(&joint[key]).iter().map(|v| format!("{v:?}")).collect::<Vec<_>>().join(" ");
        let (name, kind) = (joint["name"].as_str().unwrap(), joint["type"].as_str().unwrap());
        _ = writeln!(
            text,
            "<link name=\"{0}\"/>\n<joint name=\"{name}\" type=\"{kind}\"><parent link=\"{k}\"/><child link=\"{0}\"/>\
             <origin xyz=\"{1}\" rpy=\"{2}\"/><axis xyz=\"{3}\"/></joint>",
            k + 1,
            numbers("xyz"),
            numbers("rpy"),
            numbers("axis")
        );
    }
    text + "</robot>\n"
}

#[test]
fn real_arms_are_those_of_pinocchio() {
    let file = golden::read("urdf_poses.json");
    let arms = file["arms"].as_array().unwrap();
    assert!(arms.len() >= 10);
    for arm in arms {
        let read = read(&recorded(&arm["joints"])).unwrap();
        for posture in arm["postures"].as_array().unwrap() {
            let pose = forward(&read.robot, &golden::numbers(&posture["q"]));
            let rotation = golden::rows(&posture["rotation"]);
            let rotation = nalgebra::Matrix3::from_fn(|r, c| rotation[r][c]);
            let translation = Vector3::from_column_slice(&golden::numbers(&posture["translation"]));
            let worst = (pose.rotation.matrix() - rotation).amax().max((pose.translation.vector - translation).amax());
            assert!(worst < SAME, "{}: {worst:e}", arm["arm"]);
        }
        let longest = read.robot.links.iter().map(|l| l.mdh.a.abs().max(l.mdh.d.abs())).fold(0.0, f64::max);
        assert!(longest < 1.0, "{}: a row of {longest} m", arm["arm"]);
    }
}

/// Kinematics of a UR in the manner of its ROS package, one of its calibrations included: axes 2, 3 and 4 within millidegrees of
/// parallel. Their common normals would be hundreds of metres away (Universal_Robots_ROS2_Driver issue 1481).
#[test]
fn parallel_axes_of_a_calibrated_arm_stay_in_the_arm() {
    let z = [0.0, 0.0, 1.0];
    let joints = [
        ([0.0, 0.0, 0.1273], [0.0, 0.0, 1.2e-5], z),
        ([3.1e-5, 0.0, 0.0], [FRAC_PI_2 + 2.1e-4, 0.0, -1.7e-5], z),
        ([-0.6121, 0.0, 0.0], [3.4e-4, -2.2e-5, 6.1e-6], z),
        ([-0.5722, 3.4e-4, 0.1639], [2.8e-4, 1.9e-5, 2.2e-6], z),
        ([4.4e-5, -0.1157, 2.3e-5], [FRAC_PI_2 - 1.1e-4, 0.0, 3.3e-6], z),
        ([-2.0e-5, 0.0922, 1.0e-5], [FRAC_PI_2 + PI - 9.0e-5, PI, PI], z),
    ];
    let text = urdf(&joints, ([0.0; 3], [0.0; 3]), false);
    let read = read(&text).unwrap();
    let mut random = ChaCha8Rng::seed_from_u64(1);
    assert!(check(&text, &read, &mut random) < SAME);
    for link in &read.robot.links {
        assert!(link.mdh.a.abs() < 0.7 && link.mdh.d.abs() < 0.5, "{:?}", link.mdh);
    }
    for l in &read.robot.links {
        println!("{:?}", l.mdh);
    }
    let skewed = read.robot.links.iter().filter(|l| l.mdh.beta != 0.0).count();
    assert_eq!(skewed, 2, "joints 3 and 4 follow a nearly parallel one");
}

#[test]
fn a_calibrated_file_is_the_identified_arm_and_every_other_byte() {
    let mut random = ChaCha8Rng::seed_from_u64(7);
    for slides in [vec![], vec![0], vec![0, 3], vec![1, 2, 5]] {
        check_calibrated(&slides, &mut random);
    }
}

fn check_calibrated(slides: &[usize], random: &mut ChaCha8Rng) {
    let joints: Vec<_> = (0..6)
        .map(|_| {
            let mut three = |size: f64| std::array::from_fn::<f64, 3, _>(|_| random.random_range(-size..size));
            (three(0.6), three(PI), three(1.0))
        })
        .collect();
    let mut text = urdf_of(&joints, ([0.1, 0.0, 0.05], [0.0, 1.0, 0.0]), true, slides);
    // An origin without rpy, one without xyz, and none at all.
    let drop = |text: &mut String, nth: usize, attribute: &str, quote: char| {
        let at = text.match_indices("<joint name=\"joint ").nth(nth).unwrap().0;
        let from = at + text[at..].find(attribute).unwrap();
        let to = from + attribute.len() + 2 + text[from + attribute.len() + 2..].find(quote).unwrap() + 1;
        text.replace_range(from..to, "");
    };
    drop(&mut text, 1, "rpy", '\'');
    drop(&mut text, 2, "xyz", '"');
    let at = text.match_indices("<joint name=\"joint 4").next().unwrap().0;
    let from = at + text[at..].find("<origin").unwrap();
    let to = from + text[from..].find("/>").unwrap() + 2;
    text.replace_range(from..to, "");

    let file = written(&text);
    let ends = ChainEnds { base: None, tool: Some("tool0".into()) };
    let nominal = robot_from_urdf(&file.path, &ends).unwrap();
    let mut identified = nominal.robot.clone();
    for link in &mut identified.links {
        let mdh = &mut link.mdh;
        for entry in [&mut mdh.alpha, &mut mdh.a, &mut mdh.beta, &mut mdh.theta, &mut mdh.d] {
            *entry += random.random_range(-2e-3..2e-3);
        }
    }
    let calibrated = calibrated_urdf(&file.path, &ends, &nominal.robot, &identified).unwrap();
    for _ in 0..50 {
        let q: Vec<f64> = (0..6).map(|_| random.random_range(-PI..PI)).collect();
        let named = nominal.joint_names.iter().cloned().zip(q.iter().copied()).collect();
        assert!(apart(&forward(&identified, &q), &by_urdf_rs(&calibrated, "world", "tool0", &named)) < SAME);
    }
    let again = robot_from_urdf(&written(&calibrated).path, &ends).unwrap();
    assert_eq!(again.joint_names, nominal.joint_names);
    // All but the origins of the joints that turn.
    let rest = |text: &str| -> String {
        let (head, joints) = text.split_once("<joint name=\"joint ").unwrap();
        joints.split("<joint name=\"joint ").fold(head.to_owned(), |rest, joint| {
            let origin = joint.find("<origin").filter(|at| *at < joint.find("</joint>").unwrap());
            let kept = origin.map_or(joint.to_owned(), |at| joint[..at].to_owned() + joint[at..].split_once("/>").unwrap().1);
            rest + &kept
        })
    };
    assert_eq!(rest(&calibrated), rest(&text));
    assert_eq!(calibrated.matches("<origin").count(), text.matches("<origin").count() + 1);

    // Calibrated by nothing, it is the same arm; and the origins are those of the file.
    let origins = joint_origins(&file.path, &ends, &nominal.robot, &nominal.robot).unwrap();
    let first = origins[0].origin;
    assert!((Vector3::from(first.xyz) - Vector3::from(joints[0].0)).amax() < SAME);
    let other = robot("ur5", Path::new("")).unwrap();
    let error = calibrated_urdf(&file.path, &ends, &other, &other).unwrap_err().to_string();
    assert!(error.contains("joint 1 is placed otherwise"), "{error}");
}

#[test]
fn what_is_no_arm_is_named_with_its_line() {
    let link = |names: &[&str]| names.iter().map(|n| format!("<link name=\"{n}\"/>\n")).collect::<String>();
    let joint = |name: &str, kind: &str, parent: &str, child: &str, more: &str| {
        format!("<joint name=\"{name}\" type=\"{kind}\"><parent link=\"{parent}\"/><child link=\"{child}\"/>{more}</joint>\n")
    };
    let limits = "<limit lower=\"-1\" upper=\"1\"/>";
    let robot = |body: String| format!("<robot name=\"r\">\n{body}</robot>\n");
    let arm = link(&["a", "b", "c"]) + &joint("1", "revolute", "a", "b", limits);
    for (text, line, said) in [
        ("<robot".to_owned(), Some(1), "is not XML"),
        ("<sdf/>".into(), Some(1), "not a <robot>"),
        ("<robot name='r'>\n</robot>".into(), Some(1), "has no links"),
        (
            "<robot name='r' xmlns:xacro='http://ros.org/wiki/xacro'>\n<xacro:include filename='x'/></robot>".into(),
            Some(2),
            "xacro",
        ),
        (robot(link(&["a", "a"])), Some(3), "'a' is there twice"),
        (robot(arm.clone() + &joint("2", "revolute", "b", "d", limits)), Some(6), "there is no link 'd'"),
        (robot(arm.clone() + &joint("2", "revolute", "c", "b", limits)), Some(6), "is the child of joint '1' already"),
        (
            robot(link(&["a", "b"]) + &joint("1", "revolute", "a", "b", limits) + &joint("2", "fixed", "b", "a", "")),
            Some(5),
            "closes a loop: 'b' is carried by 'a' already",
        ),
        (robot(arm.clone() + &joint("2", "turning", "b", "c", "")), Some(6), "'turning' of joint '2' is not a joint type"),
        (robot(arm.clone() + &joint("2", "revolute", "b", "c", "<axis xyz='0 0'/>")), Some(6), "'0 0' is not 3 finite numbers"),
        (robot(arm.clone() + &joint("2", "revolute", "b", "c", "<axis xyz='0 0 0'/>")), Some(6), "has no length"),
        (robot(arm.clone() + &joint("2", "fixed", "b", "c", "<origin xyz='0 nan 0'/>")), Some(6), "'0 nan 0'"),
        (
            robot(arm.clone() + &joint("2", "revolute", "b", "c", "<limit lower='1' upper='-1'/>")),
            Some(6),
            "is above the upper one",
        ),
        (robot(arm.clone() + &joint("2", "fixed", "b", "c", "<origin xyz='0 612 0'/>")), Some(6), "is 612 m away"),
        (robot(arm.clone() + "<link name='d'><inertial><mass value='-1'/></inertial></link>"), Some(6), "is -1 kg"),
        (robot(link(&["a", "b"]) + &joint("1", "fixed", "a", "b", "")), None, "no joint moves"),
        (
            robot(arm.clone() + &link(&["d"]) + &joint("2", "fixed", "b", "c", "")),
            None,
            "several links are the child of no joint: a, d",
        ),
        (
            robot(arm.clone() + &joint("2", "fixed", "b", "c", "") + &link(&["d"]) + &joint("3", "fixed", "b", "d", "")),
            None,
            "may end at each of the links c, d",
        ),
    ] {
        let error = read(&text).expect_err(&text);
        assert_eq!(error.line, line, "{text}: {error}");
        assert!(error.to_string().contains(said), "{text}: {error}");
    }
    // Links named by the user.
    let file = written(&robot(
        link(&["a", "b", "c", "d"])
            + &joint("1", "revolute", "a", "b", limits)
            + &joint("2", "floating", "b", "c", limits)
            + &joint("3", "revolute", "b", "d", &format!("<mimic joint=\"1\"/>{limits}")),
    ));
    let named = |base: &str, tool: &str| {
        let name = |text: &str| (!text.is_empty()).then(|| text.to_owned());
        robot_from_urdf(&file.path, &ChainEnds { base: name(base), tool: name(tool) })
    };
    assert_eq!(named("", "").unwrap().tool_link, "b", "what is no joint of an arm ends it");
    for (base, tool, said) in [
        ("", "x", "there is no link 'x'"),
        ("b", "a", "link 'a' is not carried by link 'b'"),
        ("", "c", "'2' is a floating joint"),
        ("", "d", "'3' follows joint '1'"),
    ] {
        let error = named(base, tool).unwrap_err().to_string();
        assert!(error.contains(said), "{error}");
    }
    // A joint of another kind on the chain.
    for (kind, more, said) in [
        ("planar", "<axis xyz='0 0 1'/>", "'2' is a planar joint"),
        ("floating", "", "'2' is a floating joint"),
        ("prismatic", "<axis xyz='0 0 1'/><mimic joint='1'/>", "'2' follows joint '1'"),
        ("continuous", "<axis xyz='0 0 1'/><mimic joint='1'/>", "'2' follows joint '1'"),
    ] {
        let file = written(&robot(arm.clone() + &joint("2", kind, "b", "c", more)));
        let to_c = ChainEnds { base: None, tool: Some("c".into()) };
        let error = robot_from_urdf(&file.path, &to_c).expect_err(kind);
        assert!(error.line == Some(6) && error.to_string().contains(said), "{error}");
    }
    // A loop beside the arm.
    let ring = link(&["d", "e"]) + &joint("2", "revolute", "d", "e", limits) + &joint("3", "revolute", "e", "d", limits);
    let file = written(&robot(link(&["a", "b"]) + &joint("1", "revolute", "a", "b", limits) + &ring));
    let ends = ChainEnds { base: Some("a".into()), tool: Some("b".into()) };
    let error = robot_from_urdf(&file.path, &ends).unwrap_err();
    assert!(error.line == Some(8) && error.to_string().contains("closes a loop: 'e' is carried by 'd' already"), "{error}");
}

#[test]
fn meshes_that_are_not_there_are_named_and_not_needed() {
    let mesh = |file: &str| format!("<visual><geometry><mesh filename='{file}'/></geometry></visual>");
    let text = format!(
        "<robot name='r'>\n<link name='a'>{}{}</link>\n<link name='b'>\n{}\n{}\n</link>\n\
         <joint name='1' type='continuous'><parent link='a'/><child link='b'/></joint>\n</robot>",
        mesh("package://x/a.stl"),
        mesh("there.stl"),
        mesh("meshes/b.stl"),
        mesh("file:///nowhere/c.dae"),
    );
    let file = written(&text);
    std::fs::write(file.path.with_file_name("there.stl"), "").unwrap();
    assert_eq!(robot_from_urdf(&file.path, &ChainEnds::default()).unwrap().robot.joints(), 1);
    let missing = missing_meshes(&file.path).unwrap();
    let missing: Vec<(usize, &str)> = missing.iter().map(|m| (m.line, m.file.as_str())).collect();
    assert_eq!(missing, [(4, "meshes/b.stl"), (5, "file:///nowhere/c.dae")]);
}

#[test]
fn a_rail_belongs_to_the_arm_and_a_finger_does_not() {
    let arm = |joints: &[&str]| {
        let mut text = String::from("<robot name='r'>\n<link name='0'/>\n");
        for (k, kind) in joints.iter().enumerate() {
            let (next, axis) = (k + 1, ["1 0 0", "0 1 0", "0 0 1"][k % 3]);
            _ = writeln!(
                text,
                "<link name='{next}'/><joint name='j{next}' type='{kind}'><parent link='{k}'/><child link='{next}'/>\
                 <origin xyz='0.1 0.2 0.3'/><axis xyz='{axis}'/><limit lower='-0.5' upper='2.5' effort='1' velocity='1'/></joint>"
            );
        }
        text + "</robot>"
    };
    let (turn, slide) = ("revolute", "prismatic");
    for (joints, moving) in [
        (vec![slide, turn, turn], 3),
        (vec![turn, slide, turn], 3),
        (vec![slide, slide, slide], 3),
        (vec![slide, slide, slide, turn], 4),
        (vec![turn, turn, slide], 2),
        (vec![slide, turn, slide, slide], 2),
    ] {
        let text = arm(&joints);
        let read = read(&text).unwrap();
        assert_eq!(read.robot.joints(), moving, "{joints:?}");
        assert!(read.robot.links.iter().all(|link| link.limits == [-0.5, 2.5]), "{joints:?}");
        let mut random = ChaCha8Rng::seed_from_u64(2);
        assert!(check(&text, &read, &mut random) < SAME);
    }
    let unlimited = arm(&[slide, turn]).replace("<limit lower='-0.5' upper='2.5' effort='1' velocity='1'/>", "");
    let limits: Vec<[f64; 2]> = read(&unlimited).unwrap().robot.links.iter().map(|l| l.limits).collect();
    assert_eq!(limits, [[-10.0, 10.0], [-2.0 * PI, 2.0 * PI]]);
}

#[test]
fn masses_are_those_of_all_that_moves_together() {
    let text = "<robot name='r'>
<link name='base'><inertial><mass value='9'/></inertial></link>
<link name='one'><inertial><origin xyz='0.1 0 0'/><mass value='2'/></inertial></link>
<link name='box'><inertial><origin xyz='0 0 0.1'/><mass value='1'/></inertial></link>
<link name='two'><inertial><mass value='4'/></inertial></link>
<link name='finger'><inertial><mass value='1'/></inertial></link>
<joint name='a' type='continuous'><parent link='base'/><child link='one'/><origin xyz='0 0 0.5'/><axis xyz='0 0 1'/></joint>
<joint name='f' type='fixed'><parent link='one'/><child link='box'/><origin xyz='0.3 0 0'/></joint>
<joint name='b' type='continuous'><parent link='box'/><child link='two'/><origin xyz='0 0 0'/><axis xyz='0 1 0'/></joint>
<joint name='g' type='prismatic'><parent link='two'/><child link='finger'/><origin xyz='0 0 1'/><axis xyz='0 1 0'/></joint>
</robot>";
    let read = read(text).unwrap();
    assert_eq!(read.tool_link, "two");
    let links = &read.robot.links;
    assert_eq!((links[0].mass, links[1].mass), (3.0, 5.0));
    // In the world at joint position zero, by the frames of the rows.
    let world = |n: usize| {
        let frame = read.robot.links[..=n].iter().fold(read.robot.root.pose(), |at, link| at * link.mdh.transform(0.0));
        (frame * nalgebra::Point3::from(links[n].com)).coords
    };
    assert!((world(0) - Vector3::new((2.0 * 0.1 + 0.3) / 3.0, 0.0, 0.5 + 0.1 / 3.0)).amax() < SAME);
    assert!((world(1) - Vector3::new(0.3, 0.0, 0.5 + 0.2)).amax() < SAME);
}
