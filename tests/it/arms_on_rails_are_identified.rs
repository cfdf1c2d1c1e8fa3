//! An arm with prismatic joints anywhere (on a rail, a gantry, a linear axis within) is identified as any other: of a prismatic axis
//! its direction, its zero and its gain, and never what the data cannot tell.
//!
//! The oracle is an arm with known errors: its measurements are made by the kinematics of a changed drawing.

use std::f64::consts::FRAC_PI_2;
use std::sync::Arc;

use calibench::compensate::conditions::Conditions;
use calibench::compensate::targets_file::{Expected, fake_csv, read_targets};
use calibench::compensate::urdf::urdf;
use calibench::compensate::{Compensator, Desired, Target, Task};
use calibench::effects::registry::{Registry, ids};
use calibench::effects::{Subject, build};
use calibench::identify::calibration::{Calibration, read_calibration, write_calibration};
use calibench::identify::problem::Use;
use calibench::identify::{Model, identify};
use calibench::measure::dataset::file::{read_dataset, write_dataset};
use calibench::measure::dataset::{Dataset, Measured, NamedDataset, Noise, Sample, SampleSet};
use calibench::measure::poses::{ProbingPlan, write_plan};
use calibench::robot::kinematics::world_from_tool;
use calibench::robot::robot_file::to_toml;
use calibench::robot::{FramePose, JointKind, Link, MdhLink, Robot, built_in};
use calibench::units::{DEG, MM, UM, Unit};
use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Exact data leave only rounding, grown by the condition of the fit from 1e-15 m.
const EXACT: f64 = 1e-9;

/// Noise of a coordinate of a point, m.
const NOISE: f64 = 20.0 * UM;

fn row(kind: JointKind, [alpha, a, theta, d]: [f64; 4], limits: [f64; 2]) -> Link {
    Link { mdh: MdhLink { kind, alpha, a, theta, d, ..MdhLink::default() }, limits, mass: 0.0, com: Vector3::zeros() }
}

fn slide(numbers: [f64; 4], limits: [f64; 2]) -> Link {
    row(JointKind::Prismatic, numbers, limits)
}

fn turn(numbers: [f64; 4]) -> Link {
    row(JointKind::Revolute, numbers, [-2.5, 2.5])
}

/// An arm on a horizontal rail.
fn on_a_rail() -> Robot {
    let arm = built_in("kr6_r700").unwrap();
    let mut links = arm.links;
    links.iter_mut().for_each(|l| (l.mass, l.com) = (0.0, Vector3::zeros()));
    links[0].mdh.alpha -= FRAC_PI_2;
    links.insert(0, slide([FRAC_PI_2, 0.0, 0.0, 0.0], [0.0, 3.0]));
    Robot { name: "on a rail".into(), links, ..Robot::default() }
}

/// A linear axis as third of six, as in the Stanford arm.
fn stanford() -> Robot {
    let links = vec![
        turn([0.0, 0.0, 0.0, 0.4]),
        turn([-FRAC_PI_2, 0.0, 0.0, 0.15]),
        slide([FRAC_PI_2, 0.0, 0.0, 0.1], [0.2, 0.9]),
        turn([0.0, 0.0, 0.0, 0.0]),
        turn([-FRAC_PI_2, 0.0, 0.0, 0.0]),
        turn([FRAC_PI_2, 0.0, 0.0, 0.1]),
    ];
    Robot { name: "stanford".into(), links, ..Robot::default() }
}

/// Three linear axes at right angles, and a wrist of two joints.
fn gantry() -> Robot {
    let links = vec![
        slide([FRAC_PI_2, 0.0, FRAC_PI_2, 0.0], [0.0, 4.0]),
        slide([FRAC_PI_2, 0.0, FRAC_PI_2, 0.0], [0.0, 2.0]),
        slide([FRAC_PI_2, 0.0, 0.0, 0.0], [-1.2, 0.0]),
        turn([0.0, 0.1, 0.0, 0.2]),
        turn([FRAC_PI_2, 0.05, 0.0, 0.15]),
    ];
    Robot { name: "gantry".into(), links, ..Robot::default() }
}

/// A turning joint, a slide parallel to it, and two more axes parallel to both.
fn scara() -> Robot {
    let links = vec![
        turn([0.0, 0.0, 0.0, 0.3]),
        turn([0.0, 0.4, 0.0, 0.0]),
        slide([0.0, 0.35, 0.0, 0.0], [-0.3, 0.0]),
        turn([0.0, 0.0, 0.0, 0.1]),
    ];
    Robot { name: "scara".into(), links, ..Robot::default() }
}

const BASE: FramePose = FramePose { xyz: [-0.5, 0.1, 0.2], rz_ry_rx: [0.2, 0.01, -0.02] };
const TOOL: FramePose = FramePose { xyz: [0.06, 0.02, 0.15], rz_ry_rx: [0.0; 3] };

/// Points seen on `arm`, of which the rows for fitting say where `drawn` was sent; a quarter of the rows are held out.
fn points(drawn: &Robot, arm: &Robot, gain: &[f64], noise: f64, random: &mut ChaCha8Rng) -> Dataset {
    let one = |k: usize| {
        let q: Vec<f64> = drawn.links.iter().map(|l| random.random_range(l.limits[0]..l.limits[1])).collect();
        let moved: Vec<f64> = q.iter().zip(gain).map(|(q, s)| q * (1.0 + s)).collect();
        // The sum of twelve uniform numbers is as good as normal.
        let mut off = || (0..12).map(|_| random.random_range(-0.5..0.5)).sum::<f64>() * noise;
        let seen = world_from_tool(arm, &BASE, &TOOL, &moved).translation.vector + Vector3::new(off(), off(), off());
        let set = if k % 4 == 3 { SampleSet::Validation } else { SampleSet::Fit };
        Sample { set, ..Sample::new(format!("p{k}"), q, Measured::Point(seen)) }
    };
    Dataset {
        robot: Arc::new(drawn.clone()),
        robot_reference: "arm.toml".into(),
        base: BASE,
        tool: TOOL,
        noise: Noise { ball: None, point: Some(noise.max(UM)), joint: Vec::new(), ..Noise::default() },
        samples: (0..160).map(one).collect(),
        ..Dataset::default()
    }
}

/// The arm with an error in every parameter of its links that the calibration holds, and these errors.
fn with_errors(drawn: &Robot, c: &Calibration, random: &mut ChaCha8Rng) -> (Robot, Vec<(String, f64)>) {
    let mut arm = drawn.clone();
    let mut errors = Vec::new();
    for e in c.estimates.iter().filter(|e| e.effect == "mdh") {
        let size = if e.unit == Unit::MM { 0.4 * MM } else { 0.03 * DEG };
        let error = random.random_range(0.3..1.0) * size;
        let digit = e.name.find(|c: char| c.is_ascii_digit()).unwrap();
        let (entry, index): (_, usize) = (&e.name[..digit], e.name[digit..].parse().unwrap());
        match entry {
            "a" => arm.links[index].mdh.a += error,
            "alpha" => arm.links[index].mdh.alpha += error,
            "beta" => arm.links[index].mdh.beta += error,
            "d" => arm.links[index - 1].mdh.d += error,
            _ => arm.links[index - 1].mdh.theta += error,
        }
        errors.push((e.name.clone(), error));
    }
    (arm, errors)
}

fn fit(dataset: &Dataset, effects: &[&str]) -> Calibration {
    identify(&[NamedDataset::new("data", dataset)], &Model::of(effects)).unwrap()
}

/// One coordinate of the residuals at the rows held out, root mean square, m.
fn held_out(c: &Calibration, dataset: &Dataset) -> f64 {
    let residuals = c.predict(&[NamedDataset::new("data", dataset)], Use::Validation).unwrap().residuals;
    (residuals.iter().map(|r| r.norm_squared()).sum::<f64>() / (3 * residuals.len()) as f64).sqrt()
}

const GEOMETRY: [&str; 2] = ["base_frame", "mdh"];

#[test]
fn errors_of_links_are_found_to_rounding_and_to_the_noise() {
    for (seed, robot) in [(1, on_a_rail()), (2, stanford()), (3, gantry()), (4, scara())] {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let gains = vec![0.0; robot.joints()];
        let nominal = fit(&points(&robot, &robot, &gains, 0.0, &mut random), &GEOMETRY);
        let (arm, errors) = with_errors(&robot, &nominal, &mut random);
        // Of each joint that turns four numbers, of each that slides two, and six of the base; the orientation of the tool beyond
        // its known TCP is not seen.
        let slides = robot.kinds().filter(|k| *k == JointKind::Prismatic).count();
        let most = 4 * (robot.joints() - slides) + 2 * slides + 6;
        assert!(nominal.rank <= most && nominal.rank + 6 > most, "{}: {} of {most}", robot.name, nominal.rank);

        let exact = points(&robot, &arm, &gains, 0.0, &mut random);
        let c = fit(&exact, &GEOMETRY);
        assert_eq!(c.rank, nominal.rank, "{}: {:?}", robot.name, c.unresolved);
        for (name, error) in &errors {
            let e = c.estimate(name).unwrap_or_else(|| panic!("{} {name}", robot.name));
            assert!(
                (e.value - e.nominal - error).abs() < 10.0 * EXACT,
                "{} {name}: {:e}",
                robot.name,
                e.value - e.nominal - error
            );
        }
        assert!(held_out(&c, &exact) < EXACT, "{}", robot.name);

        let noisy = points(&robot, &arm, &gains, NOISE, &mut random);
        let before = held_out(&fit(&noisy, &["base_frame"]), &noisy);
        let c = fit(&noisy, &GEOMETRY);
        for (name, error) in &errors {
            let e = c.estimate(name).unwrap_or_else(|| panic!("{} {name}", robot.name));
            assert!((e.value - e.nominal - error).abs() < 4.5 * e.sigma, "{} {name}", robot.name);
        }
        let after = held_out(&c, &noisy);
        assert!(before > 5.0 * NOISE && after < 1.25 * NOISE, "{}: {before:e} {after:e}", robot.name);
    }
}

#[test]
fn zero_and_gain_of_a_slide_are_in_its_own_units() {
    let mut random = ChaCha8Rng::seed_from_u64(5);
    let drawn = stanford();
    let mut arm = drawn.clone();
    arm.links[2].mdh.d += 0.7 * MM;
    let gain = [0.0, 0.0, 250e-6, 0.0, 0.0, 0.0];
    let data = points(&drawn, &arm, &gain, NOISE / 4.0, &mut random);
    let c = fit(&data, &["base_frame", "mdh", "joint_scale:3"]);
    let zero = c.estimate("d3").unwrap_or_else(|| panic!("{:?}", c.unresolved));
    assert_eq!(zero.unit, Unit::MM);
    assert!((zero.value - zero.nominal - 0.7 * MM).abs() < 4.5 * zero.sigma && zero.sigma < 20.0 * UM, "{zero:?}");
    let scale = c.estimate("joint_scale:3.s").unwrap();
    assert_eq!(scale.unit, Unit::UM_PER_M);
    assert!((scale.value - 250e-6).abs() < 4.5 * scale.sigma && scale.sigma < 20e-6, "{scale:?}");

    // The gain of a rail in front of the arm, whose zero is the base's.
    let drawn = on_a_rail();
    let gain = [400e-6, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    let data = points(&drawn, &drawn, &gain, NOISE, &mut random);
    let c = fit(&data, &["base_frame", "mdh", "joint_scale:1"]);
    let scale = c.estimate("joint_scale:1.s").unwrap();
    assert!((scale.value - 400e-6).abs() < 4.5 * scale.sigma && scale.sigma < 10e-6, "{scale:?}");
    assert!(c.estimate("d1").is_none() && c.unresolved.iter().any(|group| group[0] == "d1"), "{:?}", c.unresolved);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("calibration.toml");
    write_calibration(&c, &path).unwrap();
    let read = read_calibration(&path, Registry::catalogue()).unwrap();
    assert!(read.robot.is_same_arm(&c.robot) && read.estimate("joint_scale:1.s").is_some());
}

#[test]
fn what_only_turning_joints_have_is_offered_to_them_alone() {
    let robot = on_a_rail();
    let subject = Subject::new(&robot, &[]);
    for id in ids(&subject) {
        let effect = build(&id, &subject).unwrap_or_else(|e| panic!("{e}"));
        let of_joints = ["harmonic", "error_curve", "joint_compliance", "stiffening", "gravity_backlash", "lumped", "bearing"];
        assert!(!(of_joints.iter().any(|family| id.starts_with(family)) && id.contains(":1")), "{id}");
        assert!(!effect.parameters().iter().any(|p| p.name.is_empty()), "{id}");
    }
    for id in [
        "harmonic1:1",
        "harmonic2:1",
        "harmonic:1:7",
        "error_curve:1",
        "error_curve:1:2:5",
        "joint_compliance:1",
        "stiffening:1",
        "gravity_backlash:1",
        "lumped_gravity:1",
        "cross_compliance:1:2",
        "cross_compliance:2:1",
        "product:2:1:3",
        "bearing_tilt:1",
    ] {
        let said = build(id, &subject).map(|e| e.id().to_owned()).expect_err(id).to_string();
        assert!(said.contains("joint 1 is prismatic") && said.contains("of joints that turn"), "{said}");
    }
    for id in ["joint_scale:1", "joint_step:1:20", "thermal_joint:1", "hysteresis:1", "joint_source:1", "unsettled:1"] {
        let unit = build(id, &subject).unwrap_or_else(|e| panic!("{e}")).parameters()[0].unit;
        assert!([Unit::UM, Unit::UM_PER_M, Unit::RATIO].contains(&unit), "{id}: {}", unit.symbol);
    }
    let all = build("joint_compliance", &subject).unwrap_or_else(|e| panic!("{e}"));
    let names: Vec<&str> = all.parameters().iter().map(|p| p.name.as_str()).collect();
    assert_eq!(names, ["c2", "c3", "c4", "c5", "c6", "c7"]);
}

#[test]
fn columns_of_a_slide_are_in_millimetres_and_the_others_are_refused() {
    let mut random = ChaCha8Rng::seed_from_u64(6);
    let drawn = on_a_rail();
    let mut data = points(&drawn, &drawn, &[0.0; 7], 0.0, &mut random);
    data.samples.truncate(4);
    data.noise.joint = vec![5.0 * UM, 1e-5, 1e-5, 1e-5, 1e-5, 1e-5, 1e-5];
    for sample in &mut data.samples {
        sample.q_commanded = Some(sample.q.clone());
        sample.tau = Some(vec![12.0; 7]);
    }
    let folder = tempfile::tempdir().unwrap();
    write_dataset(&data, folder.path()).unwrap();
    std::fs::write(folder.path().join("arm.toml"), to_toml(&drawn)).unwrap();
    let csv = folder.path().join("samples.csv");
    let text = std::fs::read_to_string(&csv).unwrap();
    for title in ["q1_mm,q2_deg", "qcmd1_mm,qcmd2_deg", "tau1_n,tau2_nm"] {
        assert!(text.lines().next().unwrap().contains(title), "{text}");
    }
    let back = read_dataset(folder.path()).unwrap();
    for (a, b) in back.samples.iter().zip(&data.samples) {
        let near = |a: &[f64], b: &[f64]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-14);
        assert!(near(&a.q, &b.q) && near(a.q_commanded.as_deref().unwrap(), b.q_commanded.as_deref().unwrap()));
        assert_eq!(a.tau, b.tau);
    }
    let apart = back.noise.joint.iter().zip(&data.noise.joint).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(apart < 1e-18, "{apart}");
    for (good, bad, said) in [
        ("q1_mm", "q1_deg", ["joint 1 slides", "q1_mm"]),
        ("q2_deg", "q2_mm", ["joint 2 turns", "q2_deg"]),
        ("qcmd1_mm", "qcmd1_deg", ["joint 1 slides", "qcmd1_mm"]),
        ("tau1_n,", "tau1_nm,", ["joint 1 slides", "tau1_n"]),
    ] {
        std::fs::write(&csv, text.replacen(good, bad, 1)).unwrap();
        let error = read_dataset(folder.path()).expect_err(bad);
        let all = format!("{error}");
        assert!(said.iter().all(|said| all.contains(said)) && all.contains(bad.trim_end_matches(',')), "{all}");
    }
    // What is farther beyond the rail than it is long is another unit.
    let q1 = text
        .lines()
        .nth(1)
        .unwrap()
        .split(',')
        .nth(text.lines().next().unwrap().split(',').position(|t| t == "q1_mm").unwrap());
    std::fs::write(&csv, text.replacen(q1.unwrap(), "8000", 1)).unwrap();
    let error = read_dataset(folder.path()).expect_err("beyond the end of the rail").to_string();
    assert!(error.contains("8000 mm is outside the joint's limits 0 to 3000") && error.contains("q1_mm"), "{error}");
}

#[test]
fn targets_of_an_arm_on_a_rail_are_compensated() {
    let mut random = ChaCha8Rng::seed_from_u64(7);
    for drawn in [on_a_rail(), stanford()] {
        let gains = vec![0.0; drawn.joints()];
        let nominal = fit(&points(&drawn, &drawn, &gains, 0.0, &mut random), &GEOMETRY);
        let (arm, _) = with_errors(&drawn, &nominal, &mut random);
        let c = fit(&points(&drawn, &arm, &gains, 0.0, &mut random), &GEOMETRY);
        let mut compensator = Compensator::new(&c, &Task::default()).unwrap();
        // Away from the limits, and from the singularities of the wrists.
        let at = |link: &Link, random: &mut ChaCha8Rng| {
            let [low, high] = link.limits;
            random.random_range(low + 0.2 * (high - low)..high - 0.2 * (high - low))
        };
        let mut reached = 0;
        let (mut targets, mut results) = (Vec::new(), Vec::new());
        for k in 0..20 {
            let q: Vec<f64> = drawn.links.iter().map(|link| at(link, &mut random)).collect();
            let wanted = world_from_tool(&drawn, &FramePose::default(), &TOOL, &q);
            let desired = Desired::Joints(q);
            let target = Target { id: k.to_string(), desired, payload: None, conditions: Conditions::default() };
            let result = compensator.compensate(&target);
            if let Ok(fake) = &result.outcome {
                let there = world_from_tool(&arm, &FramePose::default(), &TOOL, &fake.q);
                assert!((there.to_homogeneous() - wanted.to_homogeneous()).amax() < 1e-7, "{} {k}", drawn.name);
                reached += 1;
            }
            targets.push(target);
            results.push(result);
        }
        assert!(reached >= 15, "{}: {reached} of 20", drawn.name);

        let file = fake_csv(&drawn, &targets, &results);
        let columns = drawn.joint_columns().join(",");
        assert!(file.lines().next().unwrap().contains(&columns), "{file}");
        let text = urdf(&compensator.rigid());
        let slides = drawn.kinds().filter(|kind| *kind == JointKind::Prismatic).count();
        assert_eq!(text.matches("type=\"prismatic\"").count(), slides);

        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("targets.csv");
        let expected = Expected { robot: &drawn, payloads: &[], by_temperature: None };
        let numbers = drawn.links.iter().map(|link| link.limits[0] / link.mdh.kind.unit().si + 1.0);
        let numbers: Vec<String> = numbers.map(|v| v.to_string()).collect();
        std::fs::write(&path, format!("id,{columns}\n1,{}\n", numbers.join(","))).unwrap();
        let read = read_targets(&path, &expected).unwrap();
        let Desired::Joints(q) = &read[0].desired else { panic!("joints are given") };
        for ((q, link), kind) in q.iter().zip(&drawn.links).zip(drawn.kinds()) {
            assert!((q - link.limits[0] - kind.unit().si).abs() < 1e-12);
        }
        let wrong = columns.replace("_mm", "_deg");
        std::fs::write(&path, format!("id,{wrong}\n1,{}\n", numbers.join(","))).unwrap();
        let error = read_targets(&path, &expected).unwrap_err().to_string();
        assert!(error.contains("slides") && error.contains("_mm"), "{error}");
    }
}

#[test]
fn plans_are_of_joints_that_turn() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("plan.toml");
    let cell = Dataset { robot: Arc::new(on_a_rail()), ..Dataset::default() };
    let error = write_plan(&path, &ProbingPlan { poses: Vec::new(), ways: None }, &cell).unwrap_err().to_string();
    assert!(error.contains("joint 1 of the robot is prismatic") && !path.exists(), "{error}");
}
