//! A mistake that errors of the arm nearly hide is told from them, and of the right thing: one anchor of several that stands
//! elsewhere, the step in which a rail counts, the scale of a tracker. Where two mistakes leave the same, both are named.
//!
//! Arms scatter by 0.1 deg and 0.3 mm, the instrument by 50 um.

use std::f64::consts::PI;
use std::sync::Arc;

use calibench::identify::problem::Use;
use calibench::measure::dataset::{Anchor, Dataset, Measured, NamedDataset, Noise, Sample};
use calibench::residuals::misfit::{Misfit, data_fit};
use calibench::robot::kinematics::world_from_tool;
use calibench::robot::{FramePose, JointKind, Link, MdhLink, Robot, built_in};
use calibench::units::{DEG, MM, UM};
use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

const NOISE: f64 = 50.0 * UM;
pub const ROBOTS: [&str; 4] = ["ur5", "ur10", "kr6_r700", "panda"];

fn normal(random: &mut ChaCha8Rng) -> f64 {
    let [u, v]: [f64; 2] = [random.random_range(1e-12..1.0), random.random_range(0.0..1.0)];
    (-2.0 * u.ln()).sqrt() * (2.0 * PI * v).cos()
}

pub fn vector(random: &mut ChaCha8Rng) -> Vector3<f64> {
    Vector3::from_fn(|_, _| normal(random))
}

/// Measures fifty postures of a real arm from so many anchors, or as points where there are none. Its quality is in tenths of a
/// degree and 0.3 mm.
pub fn measured(robot: Robot, anchors: usize, quality: f64, random: &mut ChaCha8Rng) -> Dataset {
    let mut arm = robot.clone();
    for link in &mut arm.links {
        link.mdh.alpha += 0.1 * DEG * quality * normal(random);
        link.mdh.theta += 0.1 * DEG * quality * normal(random);
        link.mdh.a += 0.3 * MM * quality * normal(random);
        link.mdh.d += 0.3 * MM * quality * normal(random);
    }
    let base = FramePose { xyz: [0.2, -0.1, 0.4], rz_ry_rx: [0.3, 0.0, 0.01] };
    let tool = FramePose { xyz: [0.06, -0.05, 0.15], ..FramePose::default() };
    let noise = Noise { point: Some(NOISE), ..Noise::default() };
    let mut data = Dataset { robot: Arc::new(robot), base, tool, tool_free: true, noise, ..Dataset::default() };
    for k in 0..anchors {
        let angle = 2.0 * PI * (k as f64 + random.random_range(-0.3..0.3)) / anchors as f64;
        let away = random.random_range(1.2..2.5);
        let position = Vector3::new(away * angle.cos(), away * angle.sin(), random.random_range(0.0..2.0));
        data.anchors.push(Anchor { id: format!("a{}", k + 1), position });
    }
    for k in 0..50 {
        let within = |l: &Link, random: &mut ChaCha8Rng| {
            let [low, high] = [l.limits[0].max(-PI), l.limits[1].min(PI)];
            0.5 * (low + high) + 0.3 * (high - low) * random.random_range(-1.0..1.0)
        };
        let q: Vec<f64> = arm.links.iter().map(|l| within(l, random)).collect();
        let at = world_from_tool(&arm, &base, &tool, &q).translation.vector;
        for a in 0..anchors {
            let distance = (at - data.anchors[a].position).norm() + NOISE * normal(random);
            data.samples.push(Sample::new(format!("p{k}a{a}"), q.clone(), Measured::Distance { anchor: a, distance }));
        }
        if anchors == 0 {
            data.samples.push(Sample::new(format!("p{k}"), q, Measured::Point(at + NOISE * vector(random))));
        }
    }
    data
}

/// The arm on two metres of rail.
fn on_a_rail(mut robot: Robot) -> Robot {
    let mut rail = robot.links[0].clone();
    rail.mdh = MdhLink { kind: JointKind::Prismatic, alpha: 0.5 * PI, ..MdhLink::default() };
    rail.limits = [0.0, 2.0];
    robot.links[0].mdh.alpha -= 0.5 * PI;
    robot.links.insert(0, rail);
    robot.name = "on a rail".into();
    robot
}

fn misfit(data: &Dataset) -> Option<Misfit> {
    data_fit(&[NamedDataset::new("data", data)], Use::All).remove(0).misfit
}

fn names(misfit: &Misfit) -> Vec<&str> {
    misfit.slips.iter().map(|s| s.slip.as_str()).collect()
}

#[test]
fn one_anchor_that_stands_elsewhere_is_the_one_that_is_named() {
    for seed in 0..8 {
        let random = &mut ChaCha8Rng::seed_from_u64(seed);
        let mut data = measured(built_in(ROBOTS[seed as usize % 4]).unwrap(), 4, 1.0, random);
        let (anchor, off) = (seed as usize / 2, random.random_range(5.0..20.0) * MM);
        data.anchors[anchor].position += vector(random).normalize() * off;
        let found = misfit(&data).expect("no arm is so");
        let name = format!("anchor:a{}", anchor + 1);
        let is_of_it = found.slips.iter().all(|s| s.slip == name || s.slip == format!("distance_constant:a{}", anchor + 1));
        assert!(is_of_it && names(&found).contains(&name.as_str()), "{name}: {found:?}");
        // Within a tenth of it and half a millimetre, as links are fitted too.
        let words = &found.slips.iter().find(|s| s.slip == name).unwrap().words;
        let said: f64 = words.split("stated, ").nth(1).and_then(|w| w.split(' ').next()).unwrap().parse().unwrap();
        assert!((said * MM - off).abs() < 0.1 * off + 0.5 * MM, "{} mm: {words}", off / MM);
    }
}

#[test]
fn a_rail_that_counts_in_another_step_is_named() {
    for (k, by) in [1.02, 0.98, 0.5, 0.1, 123.4, 8192.0].into_iter().enumerate() {
        let random = &mut ChaCha8Rng::seed_from_u64(100 + k as u64);
        let mut data = measured(on_a_rail(built_in("ur5").unwrap()), 4 * (k % 2), 1.0, random);
        assert!(misfit(&data).is_none(), "right data");
        data.samples.iter_mut().for_each(|s| s.q[0] *= by);
        let found = misfit(&data).expect("the rail");
        assert_eq!(names(&found), ["joint_scale:1"], "{by}: {found:?}");
        let said = found.slips[0].words.split("times ").nth(1).and_then(|w| w.split(',').next());
        let said: f64 = said.unwrap().parse().unwrap();
        // Six decimals of 1/8192, and what the errors of the arm turn it by.
        assert!((said * by - 1.0).abs() < 0.01, "{by}: {found:?}");
    }
}

#[test]
fn the_scale_of_a_tracker_is_told_from_longer_links() {
    for seed in 0..8 {
        let random = &mut ChaCha8Rng::seed_from_u64(200 + seed);
        let mut data = measured(built_in(ROBOTS[seed as usize % 4]).unwrap(), 0, 1.0, random);
        assert!(misfit(&data).is_none(), "right data");
        let by = [1.01, 0.98][seed as usize / 4];
        for sample in &mut data.samples {
            if let Measured::Point(point) = &mut sample.measured {
                *point *= by;
            }
        }
        let found = misfit(&data).expect("a metre of another length");
        assert_eq!(names(&found), ["scale:points"], "{by}: {found:?}");
    }
}

#[test]
fn two_mistakes_that_leave_the_same_are_both_named() {
    let random = &mut ChaCha8Rng::seed_from_u64(300);
    // On a wrist with one centre, joint 5 the other way is joint 4 half a turn farther.
    let mut data = measured(built_in("kr6_r700").unwrap(), 0, 1.0, random);
    data.samples.iter_mut().for_each(|s| s.q[4] = -s.q[4]);
    let found = misfit(&data).expect("a sign");
    let mut both = names(&found);
    both.sort_unstable();
    assert_eq!(both, ["joint_sign:5", "joint_zero:4"], "{found:?}");
    // On one without, both at once are a length of the wrist that points the other way.
    let mut data = measured(built_in("ur5").unwrap(), 0, 1.0, random);
    data.samples.iter_mut().for_each(|s| (s.q[3], s.q[4]) = (s.q[3] + PI, -s.q[4]));
    let found = misfit(&data).expect("a sign and a zero");
    let both = names(&found);
    let simplest: Vec<&str> = both[0].split('+').collect();
    assert!(simplest.contains(&"joint_sign:5") && simplest.contains(&"joint_zero:4"), "{found:?}");
    assert!(both.len() == 2 && both[1] == "length:d5", "{found:?}");
}

/// The study behind the scale of a tracker: two hundred right arms, good and poor, and as many with a scale of 0.5 to 3 %.
#[test]
#[ignore = "a study: validation/run a_slip_beside_the_arm_is_told_from_it"]
fn two_hundred_trackers_with_and_without_a_scale() {
    let (mut alarms, mut named) = (0, 0);
    for seed in 0..200 {
        let random = &mut ChaCha8Rng::seed_from_u64(1000 + seed);
        let robot = built_in(ROBOTS[seed as usize % 4]).unwrap();
        let right = measured(robot.clone(), 0, [1.0, 2.0, 4.0][seed as usize % 3], random);
        alarms += usize::from(misfit(&right).is_some());
        let mut wrong = measured(robot, 0, 1.0, random);
        let by = 1.0 + random.random_range(0.005..0.03) * if seed % 2 == 0 { 1.0 } else { -1.0 };
        for sample in &mut wrong.samples {
            if let Measured::Point(point) = &mut sample.measured {
                *point *= by;
            }
        }
        named += usize::from(misfit(&wrong).is_some_and(|m| m.slips[0].slip == "scale:points"));
    }
    println!("{named} of 200 scales named, {alarms} alarms of 200 right arms");
    assert!(named >= 180 && alarms <= 1, "{named}, {alarms}");
}
