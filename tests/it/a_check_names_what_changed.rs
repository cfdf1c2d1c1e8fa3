//! A few poses measured again tell whether a calibrated robot is as it was, and what has changed if not.
//!
//! The plant is the exact kinematics of an arm that differs from its model in ways the model does not hold (eccentric gears):
//! what is left by the model must cancel between the two measurements, and only changes and noise remain.

use std::sync::Arc;

use calibench::identify::calibration::Calibration;
use calibench::identify::{Model, identify};
use calibench::measure::dataset::{Dataset, Measured, NamedDataset, Noise, Sample};
use calibench::monitoring::check::charts::{Charts, RUN_LENGTH};
use calibench::monitoring::check::conditions::{Condition, Elementary};
use calibench::monitoring::check::power::{SizeComponent, Smallest, SmallestDetectable, power_of_check};
use calibench::monitoring::check::{CheckError, CheckReference, FALSE_ALARM, RobotCheck, choose_sentinels, rows_again};
use calibench::robot::kinematics::{Posture, world_from_tool};
use calibench::robot::sites::SiteIndex;
use calibench::robot::statics::{DEFAULT_GRAVITY, Loads, Payload};
use calibench::robot::{FramePose, Robot, built_in};
use calibench::units::{DEG, MM, UM};
use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// One-sigma of a measured point per axis, m.
const NOISE: f64 = 15.0 * UM;
/// Poses measured again.
const SENTINELS: usize = 5;

/// The cell as it stands at one time.
#[derive(Clone)]
struct Cell {
    arm: Robot,
    base: FramePose,
    tool: FramePose,
    /// Half of the play of joint 3, rad, and what the gear of joint 2 gives way, rad/(N m).
    play: f64,
    soft: f64,
}

impl Cell {
    fn new() -> Self {
        let mut arm = built_in("kr6_r700").unwrap();
        arm.links[1].mdh.a += 0.3 * MM;
        arm.links[3].mdh.d -= 0.2 * MM;
        arm.links[2].mdh.theta += 0.05 * DEG;
        Cell {
            arm,
            base: FramePose { xyz: [-0.5, 0.1, -0.1], rz_ry_rx: [0.2, 0.0, 0.01] },
            tool: FramePose { xyz: [0.06, 0.01, -0.125], ..FramePose::default() },
            play: 0.0,
            soft: 0.0,
        }
    }

    /// The load's moment about joint 2.
    fn torque(&self, q: &[f64]) -> f64 {
        let robot = built_in("kr6_r700").unwrap();
        let (mut posture, mut loads) = (Posture::new(&robot), Loads::new(6));
        posture.set(&robot, &self.base, &self.tool, q, &vec![0.0; SiteIndex::new(6).len()]);
        loads.compute(&robot, &posture, &Payload::none(), &DEFAULT_GRAVITY, &Vector3::zeros());
        loads.tau[1]
    }

    /// Points measured at the joints that the controller reports.
    fn measured(&self, postures: &[(String, Vec<f64>)], seed: u64) -> Dataset {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut normal = || NOISE * Distribution::<f64>::sample(&StandardNormal, &mut random);
        let sample = |(id, q): &(String, Vec<f64>)| {
            // 0.3 mrad of eccentricity, which no model here holds.
            let mut turned: Vec<f64> = q.iter().enumerate().map(|(j, q)| q + 3e-4 * (q + j as f64).sin()).collect();
            // From one side or the other, the same side whenever the arm comes back.
            let sides: Vec<i8> = q.iter().map(|q| if (40.0 * q).sin() < 0.0 { -1 } else { 1 }).collect();
            turned[2] += self.play * f64::from(sides[2]);
            turned[1] += self.soft * self.torque(q);
            let point = world_from_tool(&self.arm, &self.base, &self.tool, &turned).translation.vector;
            let measured = Measured::Point(point + Vector3::from_fn(|_, _| normal()));
            Sample { approach: Some(sides), ..Sample::new(id.clone(), q.clone(), measured) }
        };
        let nominal = Cell::new();
        Dataset {
            robot: Arc::new(built_in("kr6_r700").unwrap()),
            base: nominal.base,
            tool: nominal.tool,
            noise: Noise { point: Some(NOISE), ..Noise::default() },
            samples: postures.iter().map(sample).collect(),
            ..Dataset::default()
        }
    }
}

struct Known {
    calibration: Calibration,
    campaign: Dataset,
    sentinels: Vec<(String, Vec<f64>)>,
}

fn known() -> Known {
    let mut random = ChaCha8Rng::seed_from_u64(11);
    let drawn = built_in("kr6_r700").unwrap();
    let posture = |k: usize, random: &mut ChaCha8Rng| {
        let q = drawn.links.iter().map(|l| random.random_range(0.6 * l.limits[0]..0.6 * l.limits[1])).collect();
        (format!("p{k}"), q)
    };
    let postures: Vec<(String, Vec<f64>)> = (0..60).map(|k| posture(k, &mut random)).collect();
    let campaign = Cell::new().measured(&postures, 1);
    let calibration = identify(&[NamedDataset::new("then", &campaign)], &Model::of(&["base_frame", "mdh"])).unwrap();
    let chosen = choose_sentinels(&calibration, NamedDataset::new("then", &campaign), SENTINELS).unwrap();
    assert_eq!(chosen.len(), SENTINELS);
    Known { calibration, campaign, sentinels: chosen.iter().map(|&k| postures[k].clone()).collect() }
}

impl Known {
    fn checked(&self, cell: &Cell, seed: u64) -> RobotCheck {
        let now = cell.measured(&self.sentinels, seed);
        RobotCheck::of(&self.calibration, NamedDataset::new("then", &self.campaign), NamedDataset::new("now", &now)).unwrap()
    }
}

/// True if a check names a condition, or one that its poses cannot distinguish from it.
fn names(check: &RobotCheck, condition: &Condition) -> bool {
    let first = check.conditions.iter().find(|j| j.condition != Condition::Valid).unwrap();
    check.changed && (first.condition == *condition || check.aliased.contains(condition))
}

#[test]
fn an_unchanged_robot_alarms_in_one_check_of_a_hundred_at_most() {
    let known = known();
    let checks = 600;
    let alarms = (0..checks).filter(|&k| known.checked(&Cell::new(), 1000 + k).changed).count();
    // The campaign's noise is the same in all: of a rate of 0.01, 6 are expected, and more than 14 once in a thousand.
    assert!(alarms <= 14, "{alarms} false alarms in {checks} checks at a rate of {FALSE_ALARM}");
    let check = known.checked(&Cell::new(), 7);
    assert_eq!((check.conditions[0].condition.clone(), check.looks.len()), (Condition::Valid, SENTINELS));
    let total: f64 = check.conditions.iter().map(|j| j.probability).sum();
    assert!((total - 1.0).abs() < 1e-12);
}

#[test]
fn the_size_of_a_change_is_within_its_interval() {
    let known = known();
    type Change = fn(&mut Cell);
    let cases: [(Condition, Change, f64); 4] = [
        (Condition::JointSlipped(4), |c| c.arm.links[3].mdh.theta += 0.08 * DEG, 0.08 * DEG),
        (Condition::JointSlipped(2), |c| c.arm.links[1].mdh.theta -= 0.3 * DEG, -0.3 * DEG),
        (Condition::LostMotion(3), |c| c.play = 0.02 * DEG, 0.02 * DEG),
        (Condition::ToolMoved, |c| c.tool.xyz[0] += 0.15 * MM, 0.15 * MM),
    ];
    let each = 40;
    for (condition, change, truth) in cases {
        let mut cell = Cell::new();
        change(&mut cell);
        let checks = (0..each).map(|k| known.checked(&cell, 300 + k)).filter(|check| {
            let first = check.conditions.iter().find(|j| j.condition != Condition::Valid);
            first.is_some_and(|first| first.condition == condition)
        });
        let found: Vec<SizeComponent> = checks.map(|check| check.size.unwrap().components[0]).collect();
        let within = found.iter().filter(|c| (c.value - truth).abs() <= 1.96 * c.sigma).count();
        // Of forty intervals of 95 % fewer than 33 hold the truth once in a thousand.
        assert!(found.len() >= 36 && within + 7 >= found.len(), "{}: {within} of {}", condition.name(), found.len());
        let mean = found.iter().map(|c| c.sigma).sum::<f64>() / found.len() as f64;
        assert!(mean < 0.2 * truth.abs(), "{}: {mean} tells little of {truth}", condition.name());
    }
}

#[test]
fn what_changed_is_named_within_five_poses() {
    let known = known();
    type Change = fn(&mut Cell);
    let cases: [(Condition, Change); 8] = [
        (Condition::GearGivesWay(2), |c| c.soft = 10e-6),
        (Condition::LostMotion(3), |c| c.play = 0.02 * DEG),
        (Condition::ToolMoved, |c| c.tool.xyz[0] += 0.15 * MM),
        (Condition::BaseMoved, |c| c.base.xyz[2] -= 0.15 * MM),
        (Condition::JointSlipped(2), |c| c.arm.links[1].mdh.theta += 0.02 * DEG),
        (Condition::JointSlipped(4), |c| c.arm.links[3].mdh.theta -= 0.08 * DEG),
        (Condition::JointSlipped(5), |c| c.arm.links[4].mdh.theta += 0.08 * DEG),
        (Condition::Warm, |c| c.arm.links.iter_mut().for_each(|l| (l.mdh.a, l.mdh.d) = (l.mdh.a * 1.0003, l.mdh.d * 1.0003))),
    ];
    let each = 20;
    let mut missed = Vec::new();
    for (condition, change) in cases {
        let mut cell = Cell::new();
        change(&mut cell);
        let named = (0..each).filter(|&k| names(&known.checked(&cell, 50 + k), &condition)).count();
        if named < each as usize * 9 / 10 {
            missed.push(format!("{} in {named} of {each}", condition.name()));
        }
    }
    assert!(missed.is_empty(), "named too seldom: {missed:?}");
}

#[test]
fn a_collision_is_named_as_well() {
    let known = known();
    type Change = fn(&mut Cell);
    let cases: [(Condition, Change); 3] = [
        (Condition::ToolMoved, |c| c.tool.xyz[1] += 5.0 * MM),
        (Condition::BaseMoved, |c| c.base.xyz[0] -= 5.0 * MM),
        (Condition::JointSlipped(4), |c| c.arm.links[3].mdh.theta += 0.5 * DEG),
    ];
    for (condition, change) in cases {
        let mut cell = Cell::new();
        change(&mut cell);
        let check = known.checked(&cell, 70);
        assert!(names(&check, &condition), "{condition:?}: {:?}", check.conditions);
        assert!(check.conditions[0].probability > 0.9, "{condition:?}: {:?}", check.conditions);
    }
}

#[test]
fn a_single_bad_sample_is_no_fault_of_the_robot() {
    let known = known();
    for (k, (id, _)) in known.sentinels.iter().enumerate() {
        let mut now = Cell::new().measured(&known.sentinels, 90 + k as u64);
        let Measured::Point(point) = &mut now.samples[k].measured else { panic!("points") };
        point.y += 0.4 * MM;
        let check =
            RobotCheck::of(&known.calibration, NamedDataset::new("then", &known.campaign), NamedDataset::new("now", &now))
                .unwrap();
        // The first sample alone may be anything: it is measured again, or more are.
        if k > 0 {
            assert!(names(&check, &Condition::SingleSample(id.clone())) || k < SENTINELS - 2, "{id}: {:?}", check.conditions);
        }
        assert!(check.changed, "{id}");
    }
}

#[test]
fn the_power_that_is_promised_is_that_of_the_checks() {
    let known = known();
    let chosen: Vec<usize> =
        known.sentinels.iter().map(|(id, _)| known.campaign.samples.iter().position(|s| s.id == *id).unwrap()).collect();
    let power = power_of_check(&known.calibration, NamedDataset::new("then", &known.campaign), &chosen, &[3.0]).unwrap();
    assert_eq!(power[0].condition, Condition::Valid);
    assert!(power[0].at[0].found <= 2.5 * FALSE_ALARM, "{power:?}");
    for p in &power[1..] {
        assert!(p.at[0].found >= 0.95, "three times the noise is found in 95 of 100: {p:?}");
    }
    let slipped = power.iter().find(|p| p.condition == Condition::JointSlipped(3)).unwrap();
    assert!(slipped.at[0].named >= 0.8, "{slipped:?}");
}

#[test]
fn what_cannot_be_compared_is_refused() {
    let known = known();
    let elsewhere: Vec<f64> = known.sentinels[0].1.iter().map(|q| q + 2.0 * DEG).collect();
    let now = Cell::new().measured(&[("new".into(), elsewhere)], 3);
    let refused =
        RobotCheck::of(&known.calibration, NamedDataset::new("then", &known.campaign), NamedDataset::new("now", &now));
    assert!(matches!(refused, Err(CheckError::NoCounterpart { ref sample }) if sample == "new"), "{refused:?}");
    let mut silent = Cell::new().measured(&known.sentinels, 3);
    silent.noise = Noise::default();
    let refused =
        RobotCheck::of(&known.calibration, NamedDataset::new("then", &known.campaign), NamedDataset::new("now", &silent));
    assert!(matches!(refused, Err(CheckError::NoNoise)), "{refused:?}");
    let nothing = Cell::new().measured(&[], 3);
    let refused =
        RobotCheck::of(&known.calibration, NamedDataset::new("then", &known.campaign), NamedDataset::new("now", &nothing));
    assert!(matches!(refused, Err(CheckError::Nothing)), "{refused:?}");
}

#[test]
fn a_single_change_however_large_is_named_alone() {
    let known = known();
    type Change = fn(&mut Cell);
    let cases: [(Condition, Change); 6] = [
        (Condition::ToolMoved, |c| c.tool.xyz[2] += 1.0 * MM),
        (Condition::BaseMoved, |c| c.base.xyz[1] += 1.0 * MM),
        (Condition::JointSlipped(2), |c| c.arm.links[1].mdh.theta -= 1.0 * DEG),
        (Condition::JointSlipped(3), |c| c.arm.links[2].mdh.theta += 1.0 * DEG),
        (Condition::JointSlipped(4), |c| c.arm.links[3].mdh.theta += 1.0 * DEG),
        (Condition::JointSlipped(5), |c| c.arm.links[4].mdh.theta -= 1.0 * DEG),
    ];
    for (condition, change) in cases {
        let mut cell = Cell::new();
        change(&mut cell);
        let check = known.checked(&cell, 80);
        assert!(names(&check, &condition), "{condition:?}: {:?}", check.conditions);
        assert!(check.closest.as_ref().is_some_and(|closest| closest.explains), "{condition:?}: {:?}", check.closest);
    }
}

#[test]
fn of_two_changes_at_once_neither_is_named_as_all() {
    let known = known();
    type Change = fn(&mut Cell);
    let cases: [Change; 2] = [
        |c| {
            c.arm.links[2].mdh.theta += 0.06 * DEG;
            c.arm.links[4].mdh.theta -= 0.09 * DEG;
        },
        |c| {
            c.arm.links[1].mdh.theta -= 0.06 * DEG;
            c.arm.links[3].mdh.theta += 0.09 * DEG;
        },
    ];
    for (k, change) in cases.iter().enumerate() {
        let mut cell = Cell::new();
        change(&mut cell);
        for seed in 0..10 {
            let check = known.checked(&cell, 500 + seed);
            let named = check.named().map(|j| j.condition.clone());
            assert_eq!(named, Some(Condition::Recalibrate), "case {k}: {:?}", check.conditions);
            let closest = check.closest.unwrap();
            assert!(!closest.explains && closest.left > 1.3 * closest.noise, "case {k}: {closest:?}");
        }
    }
}

/// The smallest change of a condition that is shown.
fn smallest(shown: &[SmallestDetectable], condition: &Condition) -> Option<Smallest> {
    shown.iter().find(|s| s.condition == *condition).unwrap().smallest.clone()
}

#[test]
fn a_check_says_what_it_would_have_shown() {
    let known = known();
    let reference = CheckReference::new(&known.calibration, NamedDataset::new("then", &known.campaign)).unwrap();
    let now = Cell::new().measured(&known.sentinels, 7);
    let (check, shown) = reference.check_with_power(NamedDataset::new("now", &now)).unwrap();
    assert!(!check.changed && check.closest.is_none() && (check.noise_ratio - 1.0).abs() < 0.01, "{check:?}");
    let joint = Condition::JointSlipped(2);
    let slip = smallest(&shown, &joint).unwrap();
    assert!(slip.at.found >= 0.95 && slip.at.size < 5.0, "{slip:?}");
    // The campaign's noise is the same in all checks: it shifts them all alike.
    let found = |share: f64| {
        let mut cell = Cell::new();
        cell.arm.links[1].mdh.theta += share * slip.change;
        (0..40).filter(|&k| known.checked(&cell, 400 + k).changed).count()
    };
    let [large, small] = [1.5, 0.3].map(found);
    assert!(large >= 38 && small <= 20, "{large} and {small} of 40 at {} deg", slip.change / DEG);
    // The same numbers of an instrument a thousand times as coarse say next to nothing, and the check says that.
    let coarse = Dataset { noise: Noise { point: Some(1000.0 * NOISE), ..Noise::default() }, ..now };
    let (check, shown) = reference.check_with_power(NamedDataset::new("now", &coarse)).unwrap();
    assert!(!check.changed && (check.noise_ratio / 1000.0 - 1.0).abs() < 0.01, "{}", check.noise_ratio);
    assert!(smallest(&shown, &joint).is_none_or(|s| s.change > 300.0 * slip.change), "{shown:?}");
}

#[test]
fn what_says_too_little_or_the_same_twice_is_refused() {
    let known = known();
    let reference = CheckReference::new(&known.calibration, NamedDataset::new("then", &known.campaign)).unwrap();
    let now = Cell::new().measured(&known.sentinels[..2], 3);
    let refused = reference.check(NamedDataset::new("now", &now));
    assert!(matches!(refused, Err(CheckError::TooFewPoses { poses: 2 })), "{refused:?}");
    // That something has changed is said of two poses as well.
    let mut cell = Cell::new();
    cell.tool.xyz[0] += 1.0 * MM;
    assert!(reference.check(NamedDataset::new("now", &cell.measured(&known.sentinels[..2], 3))).unwrap().changed);

    let now = Cell::new().measured(&known.sentinels, 3);
    let mut twice = now.clone();
    twice.samples.extend(now.samples.iter().map(|s| Sample { id: format!("{} again", s.id), ..s.clone() }));
    let refused = reference.check(NamedDataset::new("now", &twice));
    let Err(CheckError::SameRows { first, second }) = refused else { panic!("{refused:?}") };
    assert_eq!((first, second), (known.sentinels[0].0.clone(), format!("{} again", known.sentinels[0].0)));
    assert_eq!(rows_again(&twice, &now), Some(SENTINELS));
    assert_eq!(rows_again(&Cell::new().measured(&known.sentinels, 4), &now), None);
}

#[test]
fn other_loads_are_another_set_up() {
    let known = known();
    let reference = CheckReference::new(&known.calibration, NamedDataset::new("then", &known.campaign)).unwrap();
    let now = Cell::new().measured(&known.sentinels, 3);
    let upside_down = Dataset { gravity: -now.gravity, ..now.clone() };
    let refused = reference.check(NamedDataset::new("now", &upside_down));
    assert!(matches!(refused, Err(CheckError::OtherLoads { field: "gravity_m_s2", .. })), "{refused:?}");
    // Standard gravity with more digits is the same.
    let rounded = Dataset { gravity: now.gravity + Vector3::new(0.0, 0.0, 0.004), ..now };
    assert!(reference.check(NamedDataset::new("now", &rounded)).is_ok());
}

#[test]
fn another_calibration_has_another_digest() {
    let known = known();
    let digests = |calibration: &Calibration, campaign: &Dataset| {
        CheckReference::new(calibration, NamedDataset::new("then", campaign)).unwrap().digests()
    };
    let [calibration, campaign] = digests(&known.calibration, &known.campaign);
    assert_eq!((calibration.len(), campaign.len()), (16, 16));
    let mut other = known.calibration.clone();
    other.estimates[0].value += 1e-9;
    let [another, same] = digests(&other, &known.campaign);
    assert!(another != calibration && same == campaign);
}

/// Checks of a cell one after the other, the cell of each given by its number.
fn courses(known: &Known, checks: u64, seed: u64, cell: impl Fn(u64) -> Cell) -> Charts {
    let measured: Vec<Dataset> = (0..checks).map(|k| cell(k).measured(&known.sentinels, seed * 1000 + k)).collect();
    let named: Vec<NamedDataset<'_>> = measured.iter().map(|d| NamedDataset::new("now", d)).collect();
    let reference = CheckReference::new(&known.calibration, NamedDataset::new("then", &known.campaign)).unwrap();
    Charts::of(&reference, &named).unwrap()
}

#[test]
fn an_unchanged_robot_drifts_in_one_course_of_two_hundred_checks() {
    let known = known();
    let (robots, checks) = (40, 25);
    let signals = (0..robots).filter(|&r| !courses(&known, checks, 100 + r, |_| Cell::new()).signals().is_empty()).count();
    // Of 1000 checks 5 signals are expected at most, and more than 13 once in a thousand.
    assert!(signals <= 13, "{signals} of {robots} courses signalled at one in {RUN_LENGTH} checks");
}

#[test]
fn a_drift_that_no_single_check_shows_is_signalled() {
    let known = known();
    let drifting = |k: u64| {
        let mut cell = Cell::new();
        cell.arm.links[2].mdh.theta += 0.0007 * DEG * k as f64;
        cell
    };
    let mut sooner = 0;
    for robot in 0..8 {
        let charts = courses(&known, 20, 300 + robot, drifting);
        let signals = charts.signals();
        let joint = signals.iter().find(|(chart, _)| chart.of == Elementary::Joint(3));
        let Some((_, at)) = joint else { panic!("robot {robot}: {signals:?}") };
        let alone = (0..20).position(|k| known.checked(&drifting(k), (300 + robot) * 1000 + k).changed).unwrap_or(20);
        sooner += usize::from(*at < alone);
    }
    assert!(sooner >= 6, "the charts signalled before any single check in {sooner} of 8 courses");
}
