//! After a crash a few touches tell which zeros were lost, and by how much; a bent link is said, and a healthy robot is left alone.
//!
//! The arms are not those of the model: their links, masses and gears scatter, their joints have ripples that no model of theirs
//! knows, their encoders lose some seconds of arc, and they have grown since the campaign.

use std::f64::consts::TAU;
use std::sync::{Arc, OnceLock};

use calibench::effects::registry::Registry;
use calibench::identify::calibration::{Calibration, read_calibration, write_calibration};
use calibench::identify::{Model, identify_without_indices};
use calibench::math::Observability;
use calibench::measure::dataset::{Ball, Dataset, Measured, NamedDataset, Noise, Sample};
use calibench::robot::kinematics::{Posture, world_from_tool};
use calibench::robot::sites::SiteIndex;
use calibench::robot::statics::{DEFAULT_GRAVITY, Loads, Payload};
use calibench::robot::{FramePose, Robot, built_in};
use calibench::units::{DEG, MM, UM, Unit};
use calibench_recovery::touches::{PlannedTouch, plan_touches};
use calibench_recovery::{Earlier, Recovery, RecoveryError, Verdict, recover};
use nalgebra::{Matrix3, Matrix3xX, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

/// How the touches are made.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Way {
    /// A gauge of three indicators on the balls of the campaign.
    Gauge,
    /// The tip of the tool on a pin that was touched before.
    Pin,
}

/// Touches after a crash.
const TOUCHES: usize = 20;

/// The robots, in turn.
const ROBOTS: [&str; 2] = ["kr6_r700", "ur10"];

/// The arm as it is.
#[derive(Clone)]
struct Plant {
    truth: Robot,
    compliance: Vec<f64>,
    /// Sine and cosine of one and two a turn, for each joint, rad.
    ripple: Vec<[f64; 4]>,
    tool: FramePose,
    /// What the encoders lose, rad.
    lost: f64,
}

/// What a crash did.
struct Crash {
    zeros: Vec<(usize, f64)>,
    tool: Option<Vector3<f64>>,
    bent: Option<usize>,
}

fn normal(random: &mut ChaCha8Rng) -> f64 {
    let [u, v]: [f64; 2] = [random.random_range(1e-12..1.0), random.random_range(0.0..1.0)];
    (-2.0 * u.ln()).sqrt() * (TAU * v).cos()
}

fn tool() -> FramePose {
    FramePose { xyz: [0.060, 0.010, 0.125], ..FramePose::default() }
}

impl Plant {
    fn new(robot: &Robot, random: &mut ChaCha8Rng) -> Plant {
        let mut truth = robot.clone();
        for link in &mut truth.links {
            link.mdh.alpha += 0.03 * DEG * normal(random);
            link.mdh.a += 0.2 * MM * normal(random);
            link.mdh.d += 0.2 * MM * normal(random);
            link.mdh.theta += 0.05 * DEG * normal(random);
            link.mass *= 1.0 + 0.1 * normal(random);
        }
        let soft = Unit::MDEG_PER_NM.to_si(if robot.name.contains("ur") { 0.2 } else { 0.5 });
        let joints = truth.joints();
        let compliance = (0..joints).map(|_| soft * random.random_range(0.3..1.0)).collect();
        let ripple = (0..joints).map(|_| [(); 4].map(|()| 0.001 * DEG * normal(random))).collect();
        Plant { truth, compliance, ripple, tool: tool(), lost: 2.0 / 3600.0 * DEG }
    }

    /// The TCP where the controller shows `q`.
    fn at(&self, q: &[f64]) -> Vector3<f64> {
        let base = FramePose::default();
        let mut posture = Posture::new(&self.truth);
        posture.set(&self.truth, &base, &self.tool, q, &vec![0.0; SiteIndex::new(q.len()).len()]);
        let mut loads = Loads::new(q.len());
        let payload = Payload { name: "gauge".into(), mass: 2.0, com: Vector3::new(0.02, 0.0, 0.06) };
        loads.compute(&self.truth, &posture, &payload, &DEFAULT_GRAVITY, &Vector3::zeros());
        let stands = |(j, q): (usize, &f64)| {
            let [s, c, s2, c2] = self.ripple[j];
            q + self.compliance[j] * loads.tau[j] + s * q.sin() + c * q.cos() + s2 * (2.0 * q).sin() + c2 * (2.0 * q).cos()
        };
        let stands: Vec<f64> = q.iter().enumerate().map(stands).collect();
        world_from_tool(&self.truth, &base, &self.tool, &stands).translation.vector
    }

    fn crash(&mut self, crash: &Crash) {
        for &(joint, slip) in &crash.zeros {
            self.truth.links[joint - 1].mdh.theta += slip;
        }
        if let Some(hit) = crash.tool {
            (0..3).for_each(|k| self.tool.xyz[k] += hit[k]);
        }
    }
}

/// Joints at which the TCP is at `target`, near `q`; `None` if they are not within the limits.
fn reaching(plant: &Plant, target: &Vector3<f64>, mut q: Vec<f64>) -> Option<Vec<f64>> {
    for _ in 0..60 {
        let off = target - plant.at(&q);
        if off.norm() < 1e-8 {
            let within = q.iter().zip(&plant.truth.links).all(|(q, link)| (link.limits[0]..link.limits[1]).contains(q));
            return within.then_some(q);
        }
        let columns: Vec<Vector3<f64>> = (0..q.len())
            .map(|j| {
                let mut moved = q.clone();
                moved[j] += 1e-6;
                (plant.at(&moved) - plant.at(&q)) / 1e-6
            })
            .collect();
        let jacobian = Matrix3xX::from_columns(&columns);
        let inverse = (&jacobian * jacobian.transpose() + Matrix3::identity() * 1e-6).try_inverse()?;
        let step = jacobian.transpose() * inverse * off;
        let shorter = (0.3 / step.norm()).min(1.0);
        q.iter_mut().zip(step.iter()).for_each(|(q, step)| *q += shorter * step);
    }
    None
}

fn balls(way: Way) -> Vec<Ball> {
    let at = |id: &str, x: f64, y: f64, z: f64, sigma: f64| Ball {
        id: id.into(),
        position: Vector3::new(x, y, z),
        free: false,
        sigma,
    };
    match way {
        Way::Gauge => {
            vec![at("1", 0.42, 0.10, 0.25, 3.0 * UM), at("2", 0.30, -0.32, 0.35, 3.0 * UM), at("3", 0.05, 0.45, 0.20, 3.0 * UM)]
        }
        Way::Pin => vec![at("pin", 0.40, 0.15, 0.28, 30.0 * UM)],
    }
}

fn noise(way: Way) -> f64 {
    match way {
        Way::Gauge => 3.0 * UM,
        Way::Pin => 60.0 * UM,
    }
}

/// The cell of touches, without any.
fn cell(robot: &Arc<Robot>, name: &str, way: Way) -> Dataset {
    let payloads = vec![Payload { name: "gauge".into(), mass: 2.0, com: Vector3::new(0.02, 0.0, 0.06) }];
    let noise = Noise { ball: Some(noise(way)), ..Noise::default() };
    Dataset {
        robot: robot.clone(),
        robot_reference: name.into(),
        tool: tool(),
        noise,
        payloads,
        balls: balls(way),
        ..Dataset::default()
    }
}

/// The ball and the posture near which a touch is made, by its number.
type Near<'a> = dyn FnMut(usize, &mut ChaCha8Rng) -> (usize, Vec<f64>) + 'a;

/// Touches of a plant, each near a posture.
fn touched(plant: &Plant, cell: &Dataset, way: Way, near: &mut Near<'_>, count: usize, random: &mut ChaCha8Rng) -> Dataset {
    let mut samples = Vec::new();
    let truth: Vec<Vector3<f64>> =
        cell.balls.iter().map(|b| b.position + Vector3::from_fn(|_, _| 0.3 * b.sigma * normal(random))).collect();
    for number in 0..20 * count {
        if samples.len() == count {
            break;
        }
        let (ball, q) = near(number, random);
        let beside = Vector3::from_fn(|_, _| noise(way) * normal(random));
        let Some(mut q) = reaching(plant, &(truth[ball] + beside), q) else { continue };
        q.iter_mut().for_each(|q| *q += plant.lost * normal(random));
        samples.push(Sample::new(format!("s{}", samples.len()), q, Measured::Ball { ball, reading: None }));
    }
    Dataset { samples, ..cell.clone() }
}

/// An arm with its campaign: sixty centrings by the gauge.
struct Arm {
    robot: Arc<Robot>,
    name: &'static str,
    plant: Plant,
    calibration: Calibration,
}

fn arm(seed: u64, random: &mut ChaCha8Rng) -> Arm {
    let name = ROBOTS[seed as usize % ROBOTS.len()];
    let robot = Arc::new(built_in(name).unwrap());
    let plant = Plant::new(&robot, random);
    let cell = cell(&robot, name, Way::Gauge);
    let mut near = |k: usize, random: &mut ChaCha8Rng| {
        let q = robot.links.iter().map(|l| random.random_range(l.limits[0].max(-2.2)..l.limits[1].min(2.2))).collect();
        (k % 3, q)
    };
    let campaign = touched(&plant, &cell, Way::Gauge, &mut near, 60, random);
    let model = Model::of(&["base_frame", "mdh", "joint_compliance"]);
    let calibration = identify_without_indices(&[NamedDataset::new("campaign", &campaign)], &model).unwrap();
    Arm { robot, name, plant, calibration }
}

/// The planned touches of a robot's type: by the calibration of an arm like it.
fn plan(way: Way, of: usize) -> &'static [PlannedTouch] {
    static PLANS: [OnceLock<Vec<PlannedTouch>>; 4] = [const { OnceLock::new() }; 4];
    PLANS[2 * usize::from(way == Way::Pin) + of].get_or_init(|| {
        let arm = arm(of as u64, &mut ChaCha8Rng::seed_from_u64(999));
        let cell = cell(&arm.robot, arm.name, way);
        plan_touches(Earlier::Campaign(&arm.calibration), NamedDataset::new("campaign", &cell), TOUCHES, false, 1).unwrap()
    })
}

fn touches(arm: &Arm, plant: &Plant, way: Way, of: usize, random: &mut ChaCha8Rng) -> Dataset {
    let plan = plan(way, of);
    // By now the arm is a few kelvin warmer.
    let mut today = plant.clone();
    for link in &mut today.truth.links {
        link.mdh.a *= 1.0 + 20e-6;
        link.mdh.d *= 1.0 + 20e-6;
    }
    let mut near = |k: usize, random: &mut ChaCha8Rng| {
        let touch = &plan[k % plan.len()];
        (touch.ball.unwrap(), touch.q.iter().map(|q| q + 0.01 * normal(random)).collect())
    };
    let cell = cell(&arm.robot, arm.name, way);
    touched(&today, &cell, way, &mut near, TOUCHES, random)
}

fn found(arm: &Arm, touches: &Dataset) -> Recovery {
    recover(Earlier::Campaign(&arm.calibration), NamedDataset::new("campaign", touches), false).unwrap()
}

/// One to three zeros by 0.05 to 5 deg, the tool in half of the crashes, a link in a tenth.
fn crash(joints: usize, random: &mut ChaCha8Rng) -> Crash {
    let lost = random.random_range(1..=3);
    let mut zeros: Vec<(usize, f64)> = Vec::new();
    while zeros.len() < lost {
        let joint = random.random_range(1..=joints);
        if !zeros.iter().any(|z| z.0 == joint) {
            let size = 0.05 * 100f64.powf(random.random_range(0.0..1.0));
            zeros.push((joint, if random.random_bool(0.5) { size * DEG } else { -size * DEG }));
        }
    }
    let tool = random.random_bool(0.5).then(|| {
        let way = Vector3::from_fn(|_, _| normal(random)).normalize();
        way * (0.3 * MM * 20f64.powf(random.random_range(0.0..1.0)))
    });
    let bent = random.random_bool(0.1).then(|| random.random_range(1..joints));
    Crash { zeros, tool, bent }
}

/// Bends the link behind a joint: by 0.1 to 1 deg about a line across it, and by what that shifts half-way along it.
fn bend(truth: &mut Robot, joint: usize, random: &mut ChaCha8Rng) {
    let sign = |random: &mut ChaCha8Rng| if random.random_bool(0.5) { 1.0 } else { -1.0 };
    let turn = sign(random) * 0.1 * 10f64.powf(random.random_range(0.0..1.0)) * DEG;
    let length = truth.links[joint].mdh.a.hypot(truth.links[joint].mdh.d).max(0.1);
    let next = &mut truth.links[joint].mdh;
    next.alpha += turn;
    next.a += sign(random) * 0.5 * length * turn.abs();
    next.beta += 0.3 * turn;
}

/// What a crash came to.
#[derive(Clone, Copy, Default, Debug)]
struct Outcome {
    bent: bool,
    said_bent: bool,
    unexplained: bool,
    /// Joint 6 lost its zero and the tool was hit: one position does not tell them apart.
    twin: bool,
    tool_moved: bool,
    lost: usize,
    /// Largest error of a zero, rad; without joint 6 where it is a twin.
    zero: f64,
    /// Largest error of an old program, m.
    program: f64,
    /// Largest error of a zero in its uncertainties.
    sigmas: f64,
}

fn outcome(way: Way, seed: u64) -> Outcome {
    let random = &mut ChaCha8Rng::seed_from_u64(seed);
    let arm = arm(seed, random);
    let joints = arm.robot.joints();
    let crash = crash(joints, random);
    let mut plant = arm.plant.clone();
    plant.crash(&crash);
    if let Some(joint) = crash.bent {
        bend(&mut plant.truth, joint, random);
    }
    let data = touches(&arm, &plant, way, seed as usize % ROBOTS.len(), random);
    let recovery = found(&arm, &data);
    let twin = crash.tool.is_some() && crash.zeros.iter().any(|z| z.0 == joints);
    let mut outcome = Outcome {
        bent: crash.bent.is_some(),
        said_bent: recovery.verdict == Verdict::BentLink,
        unexplained: recovery.verdict == Verdict::Unexplained,
        twin,
        tool_moved: crash.tool.is_some(),
        lost: crash.zeros.len(),
        ..Outcome::default()
    };
    // The values are entered: the zeros, and the TCP.
    let mut after = plant.clone();
    for joint in 1..=joints {
        let true_change = crash.zeros.iter().find(|z| z.0 == joint).map_or(0.0, |z| z.1);
        let said = recovery.zeros.iter().find(|z| z.joint == joint);
        let error = true_change - said.map_or(0.0, |z| z.change);
        after.truth.links[joint - 1].mdh.theta = arm.plant.truth.links[joint - 1].mdh.theta + error;
        if !(twin && joint == joints) && error.abs() > outcome.zero {
            outcome.zero = error.abs();
        }
        if let Some(said) = said {
            outcome.sigmas = outcome.sigmas.max((error / said.sigma).abs());
        }
    }
    let entered = recovery.tool.map_or(Vector3::zeros(), |t| Vector3::from(t.map(|c| c.change)));
    // A program goes where the controller's TCP should be: what the entered TCP misses is left.
    (0..3).for_each(|k| after.tool.xyz[k] = plant.tool.xyz[k] - entered[k]);
    for _ in 0..30 {
        let plan = plan(Way::Gauge, seed as usize % ROBOTS.len());
        let touch = &plan[random.random_range(0..plan.len())];
        let q: Vec<f64> = touch.q.iter().map(|q| q + 0.3 * normal(random)).collect();
        outcome.program = outcome.program.max((after.at(&q) - arm.plant.at(&q)).norm());
    }
    outcome
}

/// True if a healthy robot is left alone.
fn left_alone(way: Way, seed: u64) -> bool {
    let random = &mut ChaCha8Rng::seed_from_u64(seed);
    let arm = arm(seed, random);
    let data = touches(&arm, &arm.plant, way, seed as usize % ROBOTS.len(), random);
    found(&arm, &data).verdict == Verdict::NothingMoved
}

/// The tables of a study, printed, and its shares.
#[derive(Debug)]
struct Shares {
    zeros: f64,
    programs: f64,
    bent: f64,
    alarms: f64,
}

fn share(of: &[Outcome], holds: impl Fn(&Outcome) -> bool) -> f64 {
    of.iter().filter(|o| holds(o)).count() as f64 / of.len().max(1) as f64
}

fn study(way: Way, crashes: u64, healthy: u64, from: u64) -> Shares {
    let all: Vec<Outcome> = (from..from + crashes).into_par_iter().map(|seed| outcome(way, seed)).collect();
    let alarms = (from..from + healthy).into_par_iter().filter(|&seed| !left_alone(way, seed)).count();
    let within = if way == Way::Gauge { 0.003 * DEG } else { 0.02 * DEG };
    let straight: Vec<Outcome> = all.iter().filter(|o| !o.bent).copied().collect();
    let bent: Vec<Outcome> = all.iter().filter(|o| o.bent).copied().collect();
    let class = |name: &str, holds: &dyn Fn(&Outcome) -> bool| {
        let of: Vec<Outcome> = straight.iter().filter(|o| holds(o)).copied().collect();
        println!(
            "{way:?} {name:40} {:5} crashes: zeros {:5.1} %, programs {:5.1} %, said bent {:4.1} %, unexplained {:4.1} %",
            of.len(),
            100.0 * share(&of, |o| o.zero <= within && !o.said_bent),
            100.0 * share(&of, |o| o.program <= 0.1 * MM && !o.said_bent),
            100.0 * share(&of, |o| o.said_bent),
            100.0 * share(&of, |o| o.unexplained),
        );
    };
    class("joint 6 and the tool", &|o| o.twin);
    for lost in [3, 2, 1] {
        class(&format!("{lost} zeros and the tool"), &|o| o.lost == lost && o.tool_moved && !o.twin);
        class(&format!("{lost} zeros"), &|o| o.lost == lost && !o.tool_moved);
    }
    println!("{way:?} bent links {}: said {:.1} %", bent.len(), 100.0 * share(&bent, |o| o.said_bent));
    println!("{way:?} healthy {healthy}: {alarms} re-mastered");
    Shares {
        zeros: share(&straight, |o| o.zero <= within && !o.said_bent),
        programs: share(&straight, |o| o.program <= 0.1 * MM && !o.said_bent),
        bent: share(&bent, |o| o.said_bent),
        alarms: alarms as f64 / healthy as f64,
    }
}

#[test]
fn by_the_gauge() {
    let shares = study(Way::Gauge, 24, 24, 100);
    assert!(shares.zeros >= 0.9 && shares.programs >= 0.9 && shares.alarms <= 0.05, "{shares:?}");
}

#[test]
fn by_a_pin() {
    let shares = study(Way::Pin, 24, 24, 100);
    assert!(shares.zeros >= 0.5 && shares.alarms <= 0.05, "{shares:?}");
}

/// The study behind both: five hundred crashes and five hundred healthy robots of each.
#[test]
#[ignore = "a study: validation/run a_crash_is_recovered"]
fn in_a_thousand_crashes() {
    let count = std::env::var("CALIBENCH_CRASHES").ok().and_then(|text| text.parse().ok()).unwrap_or(500);
    for way in [Way::Gauge, Way::Pin] {
        let shares = study(way, count, count, 7000);
        println!("{way:?}: {shares:?}");
        // What the page promises; the shares of zeros and programs are printed.
        assert!(shares.bent >= 0.95 && shares.alarms <= 0.01, "{way:?}: {shares:?}");
    }
}

/// Touches of a robot of which only the nominal model is known, and one zero that is lost.
fn unknown_robot(name: &str, joint: usize, slip: f64, way: Option<Way>) -> Recovery {
    let random = &mut ChaCha8Rng::seed_from_u64(5);
    let robot = Arc::new(built_in(name).unwrap());
    let mut plant = Plant::new(&robot, random);
    plant.crash(&Crash { zeros: vec![(joint, slip)], tool: None, bent: None });
    let mut near = |_: usize, random: &mut ChaCha8Rng| {
        let q = robot.links.iter().map(|l| random.random_range(l.limits[0].max(-2.2)..l.limits[1].min(2.2))).collect();
        (0, q)
    };
    let cell = Dataset { tool_free: true, ..cell(&robot, name, Way::Pin) };
    let data = match way {
        Some(way) => {
            let mut data = touched(&plant, &cell, way, &mut near, 24, random);
            data.balls[0].free = true;
            data
        }
        None => {
            let sample = |k: usize| {
                let (_, q) = near(k, random);
                let seen = plant.at(&q) + Vector3::from_fn(|_, _| 30.0 * UM * normal(random));
                Sample::new(format!("s{k}"), q, Measured::Point(seen))
            };
            let noise = Noise { point: Some(30.0 * UM), ..Noise::default() };
            Dataset { samples: (0..40).map(sample).collect(), balls: Vec::new(), noise, ..cell }
        }
    };
    recover(Earlier::Nominal, NamedDataset::new("touches", &data), false).unwrap()
}

#[test]
fn of_a_robot_that_nobody_calibrated_a_zero_of_a_degree_is_named() {
    for (name, joint, slip, way) in [("kr6_r700", 4, 1.4, Some(Way::Pin)), ("ur10", 3, 1.5, None), ("kr6_r700", 3, -1.5, None)]
    {
        let found = unknown_robot(name, joint, slip * DEG, way);
        assert_eq!((found.verdict, found.moved.zeros.as_slice()), (Verdict::Moved, [joint].as_slice()), "{name}");
        // The zero as it left the factory, 0.05 deg from the drawing, is part of the change.
        let zero = found.zeros[0];
        let sigma = zero.sigma.hypot(0.05 * DEG);
        assert!((zero.change - slip * DEG).abs() < 3.0 * sigma && zero.sigma < 0.1 * DEG, "{name}: {zero:?}");
        // Neither base nor tool is known: the ends of the arm are not seen.
        assert!(found.unseen().contains(&1), "{name}: {:?}", found.unseen());
    }
}

#[test]
fn calibrations_survive_the_disk_and_the_mastered_robot_is_well() {
    let random = &mut ChaCha8Rng::seed_from_u64(2);
    let arm = arm(0, random);
    let mut plant = arm.plant.clone();
    plant.crash(&Crash { zeros: vec![(2, 0.4 * DEG)], tool: None, bent: None });
    let crashed = touches(&arm, &plant, Way::Gauge, 0, random);
    let recovery = found(&arm, &crashed);
    assert_eq!((recovery.verdict, recovery.moved.zeros.as_slice()), (Verdict::Moved, [2].as_slice()));
    let folder = tempfile::tempdir().unwrap();
    let read = |calibration: &Calibration| {
        let path = folder.path().join("c.toml");
        // The campaigns of these tests are identified without their indices and condition.
        let observability = Observability { o1: 0.0, o2: 0.0, o3: 0.0, o4: 0.0, o5: 0.0 };
        write_calibration(&Calibration { observability, condition: 1.0, ..calibration.clone() }, &path).unwrap();
        read_calibration(&path, Registry::catalogue()).unwrap()
    };
    let theta = |c: &Calibration| c.estimate("theta2").unwrap().value;
    let (now, mastered) = (read(&recovery.now), read(&recovery.mastered));
    assert!((theta(&now) - theta(&mastered) - recovery.zeros[0].change).abs() < 1e-9);
    let healthy = touches(&arm, &arm.plant, Way::Gauge, 0, random);
    let three = Dataset { samples: healthy.samples[..3].to_vec(), ..healthy };
    let judge = |c: &Calibration| recover(Earlier::Campaign(c), NamedDataset::new("campaign", &three), false).unwrap();
    assert_eq!(judge(&mastered).verdict, Verdict::NothingMoved);
    assert_ne!(judge(&now).verdict, Verdict::NothingMoved);
}

#[test]
fn too_few_touches_and_those_of_another_robot_are_refused() {
    let random = &mut ChaCha8Rng::seed_from_u64(3);
    let arm = arm(0, random);
    let data = touches(&arm, &arm.plant, Way::Gauge, 0, random);
    let judged = |data: &Dataset| recover(Earlier::Campaign(&arm.calibration), NamedDataset::new("campaign", data), false);
    let two = Dataset { samples: data.samples[..2].to_vec(), ..data.clone() };
    assert!(matches!(judged(&two), Err(RecoveryError::TooFew { touches: 2 })));
    let other = Dataset { robot: Arc::new(built_in("ur5").unwrap()), ..data.clone() };
    assert!(matches!(judged(&other), Err(RecoveryError::OtherRobot { .. })));
    let silent = Dataset { noise: Noise::default(), ..data };
    assert!(matches!(judged(&silent), Err(RecoveryError::NoNoise)));
}
