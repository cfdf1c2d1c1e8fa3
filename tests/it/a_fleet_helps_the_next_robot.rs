//! The prior of a fleet improves the calibration of the next robot, and does no harm to a robot of another kind.
//!
//! A type is simulated by the deviations that all its robots share, and by how much each of them differs from that.

use std::sync::Arc;

use calibench::identify::calibration::Calibration;
use calibench::identify::fleet::{Fleet, FleetError, PriorUsed, SeemOne, identify_with_fleet, read_fleet, write_fleet};
use calibench::identify::problem::Use;
use calibench::identify::{Model, identify};
use calibench::measure::dataset::{Dataset, Measured, NamedDataset, Noise, Sample, SampleSet};
use calibench::robot::kinematics::world_from_tool;
use calibench::robot::{FramePose, Robot, built_in};
use calibench::units::{DEG, MM, UM, URAD};
use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

const NOISE: f64 = 20.0 * UM;

/// Rows that are judged.
const JUDGED: usize = 100;

fn normal(rng: &mut ChaCha8Rng) -> f64 {
    StandardNormal.sample(rng)
}

/// An arm that deviates from another by so many plausible sizes.
fn deviating(from: &Robot, sizes: f64, rng: &mut ChaCha8Rng) -> Robot {
    let mut robot = from.clone();
    for link in &mut robot.links {
        link.mdh.a += sizes * 0.3 * MM * normal(rng);
        link.mdh.d += sizes * 0.3 * MM * normal(rng);
        link.mdh.alpha += sizes * 0.05 * DEG * normal(rng);
        link.mdh.theta += sizes * 0.05 * DEG * normal(rng);
    }
    robot
}

fn ur10() -> Robot {
    built_in("ur10").expect("built in")
}

/// A small arm, by the drawing of the Meca500.
fn small_arm() -> Robot {
    let mut robot = built_in("ur10").expect("built in");
    robot.name = "small".into();
    let numbers = [
        [0.0, 0.0, 0.0, 135.0],
        [-90.0, 0.0, -90.0, 0.0],
        [0.0, 135.0, 0.0, 0.0],
        [-90.0, 38.0, 0.0, 120.0],
        [90.0, 0.0, 0.0, 0.0],
        [-90.0, 0.0, 180.0, 70.0],
    ];
    for (link, [alpha, a, theta, d]) in robot.links.iter_mut().zip(numbers) {
        (link.mdh.alpha, link.mdh.a, link.mdh.theta, link.mdh.d) = (alpha * DEG, a * MM, theta * DEG, d * MM);
    }
    robot
}

/// So many measured points of a UR10 on a base of its own, and others to judge by.
fn measured(arm: &Robot, points: usize, rng: &mut ChaCha8Rng) -> Dataset {
    measured_as(&ur10(), arm, points, rng)
}

/// The same of an arm of any type.
fn measured_as(nominal: &Robot, arm: &Robot, points: usize, rng: &mut ChaCha8Rng) -> Dataset {
    let place = |rng: &mut ChaCha8Rng, by: f64| Vector3::from_fn(|_, _| by * normal(rng));
    let base =
        FramePose { xyz: place(rng, MM).into(), rz_ry_rx: [0.001 * normal(rng), 0.001 * normal(rng), 0.001 * normal(rng)] };
    let tool = FramePose { xyz: [40.0 * MM, 20.0 * MM, 120.0 * MM], rz_ry_rx: [0.0; 3] };
    let samples = (0..points + JUDGED).map(|k| {
        let q: Vec<f64> = (0..6).map(|_| rng.random_range(-1.5..1.5)).collect();
        let at = world_from_tool(arm, &base, &tool, &q).translation.vector;
        let seen = if k < points { at + place(rng, NOISE) } else { at };
        let set = if k < points { SampleSet::Fit } else { SampleSet::Validation };
        Sample { set, ..Sample::new(format!("p{k}"), q, Measured::Point(seen)) }
    });
    let samples = samples.collect();
    Dataset {
        robot: Arc::new(nominal.clone()),
        robot_reference: "ur10".into(),
        tool,
        noise: Noise { point: Some(NOISE), ..Noise::default() },
        samples,
        hash: format!("{:x}", rng.random::<u64>()),
        ..Dataset::default()
    }
}

fn model() -> Model {
    Model::of(&["base_frame", "mdh"])
}

/// Mean error at the rows that are judged, m.
fn error(calibration: &Calibration, data: &Dataset) -> f64 {
    let predicted = calibration.predict(&[NamedDataset::new("d", data)], Use::Validation).expect("predicted");
    predicted.residuals.iter().map(|r| r.norm()).sum::<f64>() / predicted.residuals.len() as f64
}

/// A type of robot: its mean arm.
fn kind(rng: &mut ChaCha8Rng) -> Robot {
    deviating(&ur10(), 1.0, rng)
}

/// Robots of a type differ by this many plausible sizes.
const APART: f64 = 0.3;

fn fleet(of: &Robot, robots: usize, rng: &mut ChaCha8Rng) -> Fleet {
    fleet_of(of, robots, 0.0, rng)
}

fn fleet_of(of: &Robot, robots: usize, gear: f64, rng: &mut ChaCha8Rng) -> Fleet {
    fleet_from(robots, || {
        let arm = deviating(of, APART, rng);
        measured_with_gears(&arm, 80, gear, rng)
    })
}

/// The fleet of so many robots, each with a campaign of its own.
fn fleet_from(robots: usize, mut campaign: impl FnMut() -> Dataset) -> Fleet {
    let calibrations: Vec<Calibration> =
        (0..robots).map(|_| identify(&[NamedDataset::new("d", &campaign())], &model()).expect("a calibration")).collect();
    let names: Vec<String> = (0..robots).map(|k| format!("robot {k}")).collect();
    Fleet::of(&names.iter().map(String::as_str).zip(&calibrations).collect::<Vec<_>>()).expect("a fleet")
}

/// As [`measured`], the gears erring by curves that no model here holds.
fn measured_with_gears(arm: &Robot, points: usize, gear: f64, rng: &mut ChaCha8Rng) -> Dataset {
    let mut data = measured(arm, points, rng);
    if gear > 0.0 {
        let curves: Vec<[f64; 4]> = (0..6)
            .map(|_| [gear * normal(rng), rng.random_range(0.0..6.3), gear * normal(rng), rng.random_range(0.0..6.3)])
            .collect();
        for sample in &mut data.samples {
            // The arm is elsewhere than its joints say.
            let said = sample.q.clone();
            for (j, [once, a, twice, b]) in curves.iter().enumerate() {
                sample.q[j] -= once * (said[j] + a).sin() + twice * (2.0 * said[j] + b).sin();
            }
        }
    }
    data
}

/// A number of the environment, as `TRIALS` and `SEED` of a study.
fn asked(name: &str, without: u64) -> u64 {
    std::env::var(name).ok().and_then(|text| text.parse().ok()).unwrap_or(without)
}

/// The errors of robots alone and with the fleet, in a line; `draw` makes the fleet of a trial, and the data of its next robot.
fn beside_none(trials: u64, seed: u64, draw: impl Fn(&mut ChaCha8Rng) -> (Fleet, Dataset)) -> String {
    let (mut sums, mut refused, mut worse) = ([0.0; 2], 0, 0);
    for trial in 0..trials {
        let (fleet, data) = draw(&mut ChaCha8Rng::seed_from_u64(seed + trial));
        let (with, judged) = identify_with_fleet(&[NamedDataset::new("d", &data)], &model(), &fleet).expect("with the fleet");
        refused += usize::from(judged.used != PriorUsed::Fleet);
        let (with, without) =
            (error(&with, &data), error(&identify(&[NamedDataset::new("d", &data)], &model()).expect("alone"), &data));
        sums = [sums[0] + without / MM, sums[1] + with / MM];
        worse += usize::from(with > 1.05 * without);
    }
    let [without, with] = sums.map(|sum| sum / trials as f64);
    format!("{without:.4} mm alone, {with:.4} mm with the fleet, not used in {refused}, worse by 5 % in {worse} of {trials}")
}

/// The study of docs/validation-studies.md.
#[test]
#[ignore = "a study: validation/run a_fleet_helps_the_next_robot"]
fn fleets_in_numbers() {
    let (trials, seed) = (asked("TRIALS", 40), asked("SEED", 40_000));
    for (gear, robots) in [(0.0, 20), (0.0, 5), (50.0 * URAD, 20)] {
        for apart in [0.0, 0.3, 1.0] {
            for points in [10, 20, 40, 80] {
                let said = beside_none(trials, seed, |rng| {
                    let typical = kind(rng);
                    let fleet = fleet_of(&typical, robots, gear, rng);
                    let arm = deviating(&deviating(&typical, apart, rng), APART, rng);
                    (fleet, measured_with_gears(&arm, points, gear, rng))
                });
                println!(
                    "gears {:.0} urad, fleet of {robots}, {apart} sizes from its type, {points} points: {said}",
                    gear / URAD
                );
            }
        }
    }
}

/// The small arms of the page: better made than the catalogue expects, which their fleet learns.
#[test]
#[ignore = "a study: validation/run a_fleet_helps_the_next_robot"]
fn fleets_of_small_arms_in_numbers() {
    for points in [10, 20, 40, 80] {
        let said = beside_none(asked("TRIALS", 40), asked("SEED", 90_000), |rng| {
            let nominal = small_arm();
            let typical = deviating(&nominal, 0.3, rng);
            let campaign = |points: usize, rng: &mut ChaCha8Rng| {
                let arm = deviating(&typical, 0.1, rng);
                measured_as(&nominal, &arm, points, rng)
            };
            let fleet = fleet_from(20, || campaign(80, rng));
            (fleet, campaign(points, rng))
        });
        println!("small arms, {points} points: {said}");
    }
}

#[test]
fn a_fleet_helps_where_points_are_few() {
    let mut rng = ChaCha8Rng::seed_from_u64(31);
    let typical = kind(&mut rng);
    let fleet = fleet(&typical, 12, &mut rng);
    let (mut fleets, mut alone) = (0.0, 0.0);
    for _ in 0..4 {
        let arm = deviating(&typical, APART, &mut rng);
        let data = measured(&arm, 10, &mut rng);
        let (with, judged) = identify_with_fleet(&[NamedDataset::new("d", &data)], &model(), &fleet).expect("with the fleet");
        assert_eq!(judged.used, PriorUsed::Fleet, "{judged:?}");
        fleets += error(&with, &data);
        alone += error(&identify(&[NamedDataset::new("d", &data)], &model()).expect("alone"), &data);
    }
    assert!(fleets < 0.8 * alone, "{fleets} {alone}");
}

#[test]
fn a_robot_of_another_kind_is_told_and_not_harmed() {
    let mut rng = ChaCha8Rng::seed_from_u64(32);
    let typical = kind(&mut rng);
    let fleet = fleet(&typical, 12, &mut rng);
    for points in [20, 40] {
        let other = kind(&mut rng);
        let data = measured(&deviating(&other, APART, &mut rng), points, &mut rng);
        let (with, judged) =
            identify_with_fleet(&[NamedDataset::new("d", &data)], &model(), &fleet).expect("without the fleet");
        assert!(judged.used != PriorUsed::Fleet && judged.chance < 0.01, "{judged:?}");
        if judged.used == PriorUsed::None {
            let alone = identify(&[NamedDataset::new("d", &data)], &model()).expect("alone");
            assert_eq!(error(&with, &data), error(&alone, &data));
        }
    }
}

#[test]
fn what_makes_no_fleet_is_refused_by_name() {
    let mut rng = ChaCha8Rng::seed_from_u64(33);
    let typical = kind(&mut rng);
    let once = identify(&[NamedDataset::new("d", &measured(&typical, 40, &mut rng))], &model()).expect("a calibration");
    assert_eq!(Fleet::of(&[("a", &once)]), Err(FleetError::OneRobot));
    let twice = Fleet::of(&[("a", &once), ("b", &once)]);
    assert_eq!(twice, Err(FleetError::SameRobot { name: "b".into(), other: "a".into() }));
    let mut data = measured(&typical, 40, &mut rng);
    let mut robot = (*data.robot).clone();
    robot.links[1].mdh.a += 0.1;
    robot.name = "longer".into();
    data.robot = Arc::new(robot);
    let other = identify(&[NamedDataset::new("d", &data)], &model()).expect("a calibration");
    assert!(matches!(Fleet::of(&[("a", &once), ("b", &other)]), Err(FleetError::OtherType { .. })));
    assert!(Fleet::of(&[]).is_err());
}

/// A robot measured on two days would be believed twice, and robots of its type to be as alike as its two calibrations.
#[test]
fn one_robot_measured_twice_seems_to_be_one() {
    for trial in 0..10 {
        let mut rng = ChaCha8Rng::seed_from_u64(600 + trial);
        let arm = kind(&mut rng);
        // Much more alike than robots of a type are.
        let alike = deviating(&arm, 0.1, &mut rng);
        let calibrated = |arm: &Robot, rng: &mut ChaCha8Rng| {
            identify(&[NamedDataset::new("d", &measured(arm, 200, rng))], &model()).expect("a calibration")
        };
        let [monday, tuesday, other] = [&arm, &arm, &alike].map(|arm| calibrated(arm, &mut rng));
        assert_eq!(SeemOne::of(&[("monday", &monday), ("other", &other)]), [], "trial {trial}");
        let found = SeemOne::of(&[("monday", &monday), ("other", &other), ("tuesday", &tuesday)]);
        assert!(
            matches!(&found[..], [one] if one.name == "tuesday" && one.other == "monday" && one.differ < one.alike),
            "{found:?}"
        );
    }
}

#[test]
fn a_fleet_survives_the_disk_and_says_nothing_of_a_single_robot() {
    let mut rng = ChaCha8Rng::seed_from_u64(34);
    let typical = kind(&mut rng);
    let fleet = fleet(&typical, 4, &mut rng);
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("ur10.fleet.toml");
    write_fleet(&fleet, &path).expect("written");
    let text = std::fs::read_to_string(&path).expect("text");
    let again = read_fleet(&path).expect("read");
    for (read, written) in again.parameters.iter().zip(&fleet.parameters) {
        assert!((read.mean - written.mean).abs() < 1e-15 && (read.sigma / written.sigma - 1.0).abs() < 1e-12, "{read:?}");
    }
    assert_eq!((again.robots, again.parameters.len(), &again.geometry), (4, fleet.parameters.len(), &fleet.geometry));
    assert!(!text.contains("robot 0") && !text.contains("dataset"), "{text}");
    for (from, to, says) in [
        ("calibench-fleet/1", "calibench-fleet/2", "format"),
        ("unit = \"deg\"", "unit = \"furlong\"", "furlong"),
        ("sigma = ", "sigma = -", "not a positive number"),
    ] {
        std::fs::write(&path, text.replacen(from, to, 1)).expect("written");
        let error = read_fleet(&path).expect_err(says).to_string();
        assert!(error.contains(says) && error.contains("fleet.toml"), "{error}");
    }
}
