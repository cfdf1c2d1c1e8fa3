//! A joint that counts the other way says so with a sign in the robot file, and is the same arm at the negated joint value: its
//! poses, what gravity does to it, and its solids.

use std::fmt::Write;

use calibench::robot::kinematics::{Posture, world_from_tool};
use calibench::robot::robot_file::load_robot;
use calibench::robot::sites::SiteIndex;
use calibench::robot::solids::Shape;
use calibench::robot::statics::{DEFAULT_GRAVITY, Loads, Payload};
use calibench::robot::{FramePose, JointKind, Robot};
use nalgebra::{Point3, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Some rounding of a chain of seven joints and metres, and of torques of some hundred N·m.
const SAME: f64 = 1e-12;

/// A robot file without signs, and the same with one for every joint.
fn files(random: &mut ChaCha8Rng, signs: &[i8]) -> [String; 2] {
    let mut texts = ["", ""].map(|_| String::from("format = 'calibench-robot/1'\nname = 'arm'\n"));
    let mut number = |size: f64| random.random_range(-size..size);
    let mut both = |line: &str| texts.iter_mut().for_each(|text| text.push_str(line));
    for table in ["root", "flange"] {
        let [x, y, z, a, b, c] = [200.0, 200.0, 200.0, 170.0, 80.0, 170.0].map(&mut number);
        both(&format!("[{table}]\nx_mm = {x}\ny_mm = {y}\nz_mm = {z}\na_deg = {a}\nb_deg = {b}\nc_deg = {c}\n"));
    }
    for k in 0..signs.len() {
        let [alpha, a, beta, theta, d] = [180.0, 500.0, 20.0, 180.0, 500.0].map(&mut number);
        both(&format!("[[link]]\nalpha_deg = {alpha}\na_mm = {a}\nbeta_deg = {beta}\ntheta_deg = {theta}\nd_mm = {d}\n"));
        both(if k % 3 == 1 { "kind = 'prismatic'\nmin_mm = -300\nmax_mm = 900\n" } else { "min_deg = -10\nmax_deg = 170\n" });
        let com = [100.0; 3].map(&mut number);
        both(&format!("mass_kg = {}\ncom_mm = {com:?}\n# sign {k}\n", 6.0 + number(5.0)));
    }
    for frame in 0..=signs.len() {
        let [from, to, centre] = [[100.0; 3], [100.0; 3], [100.0; 3]].map(|of| of.map(&mut number));
        both(&format!("[[solid]]\nname = 'c'\nframe = {frame}\nfrom_mm = {from:?}\nto_mm = {to:?}\nradius_mm = 40\n"));
        both(&format!("[[solid]]\nname = 'b'\nframe = {frame}\ncentre_mm = {centre:?}\nhalf_size_mm = [10, 20, 30]\n"));
    }
    for (k, sign) in signs.iter().enumerate() {
        let mut line = String::new();
        _ = write!(line, "sign = {sign}");
        texts[1] = texts[1].replace(&format!("# sign {k}"), &line);
    }
    texts
}

fn read(text: &str) -> Robot {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("arm.toml");
    std::fs::write(&path, text).unwrap();
    load_robot(&path).unwrap()
}

/// Poses and gravity's torques of an arm, and the places of its solids: of each axis of a box a point on it, whichever way it points.
struct Stand {
    tool: nalgebra::Matrix4<f64>,
    tau: Vec<f64>,
    places: Vec<Vector3<f64>>,
    half_sizes: Vec<Vector3<f64>>,
}

fn stand(robot: &Robot, q: &[f64]) -> Stand {
    let base = robot.root;
    let mut posture = Posture::new(robot);
    posture.set(robot, &base, &FramePose::default(), q, &vec![0.0; SiteIndex::new(robot.joints()).len()]);
    let mut loads = Loads::new(robot.joints());
    loads.compute(robot, &posture, &Payload::none(), &DEFAULT_GRAVITY, &Vector3::zeros());
    let (mut places, mut half_sizes) = (Vec::new(), Vec::new());
    for solid in &robot.solids {
        let frame = posture.frame(solid.frame);
        match &solid.shape {
            Shape::Capsule { ends, .. } => places.extend(ends.iter().map(|end| frame.point(end))),
            Shape::Box { centre, half_size } => {
                places.push(frame.point(centre));
                half_sizes.push(*half_size);
                // The box is the same if every side is, up to its direction.
                places.extend([frame.x, frame.y, frame.z].map(|axis| axis * axis[axis.iamax()].signum()));
            }
        }
    }
    let tool = world_from_tool(robot, &base, &robot.flange, q);
    Stand { tool: tool.to_homogeneous(), tau: loads.tau, places, half_sizes }
}

#[test]
fn an_arm_with_signs_is_that_without_at_negated_joints() {
    let mut random = ChaCha8Rng::seed_from_u64(11);
    for round in 0..60 {
        let joints = 1 + round % 7;
        let signs: Vec<i8> = (0..joints).map(|_| if random.random_bool(0.5) { 1 } else { -1 }).collect();
        let [plain, signed] = files(&mut random, &signs).map(|text| read(&text));
        for _ in 0..5 {
            let q: Vec<f64> = (0..joints).map(|_| random.random_range(-2.5..2.5)).collect();
            let negated: Vec<f64> = q.iter().zip(&signs).map(|(q, sign)| q * f64::from(*sign)).collect();
            let (there, here) = (stand(&plain, &negated), stand(&signed, &q));
            assert!((there.tool - here.tool).amax() < SAME, "{signs:?}");
            for ((a, b), sign) in there.tau.iter().zip(&here.tau).zip(&signs) {
                assert!((a * f64::from(*sign) - b).abs() < 100.0 * SAME, "{signs:?}: {a} {b}");
            }
            let apart = there.places.iter().zip(&here.places).map(|(a, b)| (a - b).amax()).fold(0.0, f64::max);
            assert!(apart < SAME && there.half_sizes == here.half_sizes, "{signs:?}: {apart}");
        }
        for (a, b) in plain.links.iter().zip(&signed.links) {
            assert_eq!((a.mdh.kind, a.limits, a.mass), (b.mdh.kind, b.limits, b.mass), "limits are of the joint as it counts");
        }
    }
}

#[test]
fn gravity_pulls_a_slide_with_the_weight_of_what_it_carries() {
    let text = "format = 'calibench-robot/1'\nname = 'lift'\n[[link]]\nkind = 'prismatic'\nsign = -1\nalpha_deg = 0\na_mm = 0\n\
                d_mm = 100\nmin_mm = 0\nmax_mm = 500\nmass_kg = 2\ncom_mm = [0, 0, 0]\n[[link]]\nalpha_deg = 0\na_mm = 300\nd_mm = 0\n\
                min_deg = -90\nmax_deg = 90\nmass_kg = 3\ncom_mm = [100, 0, 0]\n";
    let lift = read(text);
    assert_eq!(lift.kind(0), JointKind::Prismatic);
    let down = stand(&lift, &[0.4, 0.0]);
    // Weight of 5 kg along +z of a joint whose z axis points down.
    assert!((down.tau[0] - 5.0 * 9.81).abs() < SAME && down.tau[1].abs() < SAME, "{:?}", down.tau);
    let tool = world_from_tool(&lift, &lift.root, &lift.flange, &[0.4, 0.0]) * Point3::origin();
    assert!((tool.coords - Vector3::new(0.3, 0.0, -0.3)).amax() < SAME, "{tool}");
}
