//! The cell in MuJoCo is the same cell: poses, torques, deflections, readings and centrings agree with closed forms and with
//! results of recorded programs.
//!
//! With `--nocapture` it prints the table.

use std::path::Path;

use calibench::measure::campaign::CampaignRecord;
use calibench::robot::sites::{MdhEntry, Site};
use calibench::robot::statics::Payload;
use calibench::units::{MM, UM};
use calibench_mujoco::{Machine, MujocoFlaws, MujocoPlant, Scenery, Thing};
use calibench_sim::contact::{DATUM_RADIUS, FREE_READING, MASTER_READING};
use calibench_sim::gauge::Gauge;
use calibench_sim::mechanics::{BallForm, Parts, Stand};
use calibench_sim::plans::Plans;
use calibench_sim::plant::plant;
use calibench_sim::plunger::{PlungerSpec, PresentedBall};
use calibench_sim::random::Streams;
use calibench_sim::run::{Measurements, measure_all};
use calibench_sim::scenario::PlantKind;
use calibench_sim::scenario::{MujocoToml, Scenario, TruthToml, load_scenario};
use nalgebra::{Matrix4, Vector3};

use crate::golden::{GoldenModel, golden_model, read, rows};

const STREAMS: Streams = Streams { seed: 1, trial: 0 };

/// The robot of the goldens with absolute parameter values, one ball, an ideal gauge with the usual springs.
fn machine(model: &GoldenModel, values: &[f64], ball: Vector3<f64>) -> Machine {
    let mut robot = model.robot.clone();
    let mut base = model.base.to_array();
    for (parameter, value) in model.parameters.iter().zip(values).filter(|(p, _)| !p.compliance) {
        match parameter.site {
            Site::Base(axis) => base[axis as usize] = *value,
            Site::Mdh(i, entry) => {
                let mdh = &mut robot.links[usize::from(i)].mdh;
                let by = value - parameter.nominal;
                match entry {
                    MdhEntry::Alpha => mdh.alpha += by,
                    MdhEntry::A => mdh.a += by,
                    MdhEntry::Beta => mdh.beta += by,
                    MdhEntry::Theta => mdh.theta += by,
                    MdhEntry::D => mdh.d += by,
                }
            }
            _ => unreachable!("the goldens have no other parameters"),
        }
    }
    let gauge = Gauge::draw(&PlungerSpec { preload: 0.65, full_force: 0.90, ..PlungerSpec::ideal() }, &STREAMS);
    let joints = robot.joints();
    Machine {
        name: "golden".into(),
        gravity: model.gravity,
        base: calibench::robot::FramePose::from_array(base),
        robot,
        compliance: vec![0.0; joints],
        tool: model.tool,
        payload: Payload::clone(&model.payload),
        balls: vec![PresentedBall { centre: ball, radius: DATUM_RADIUS }],
        gauge: gauge.mechanisms(),
        flaws: MujocoFlaws::new(&MujocoToml::default(), vec![1.0; joints]),
        scenery: Scenery::default(),
    }
}

fn pose_error(plant: &MujocoPlant, q: &[f64], golden: &[f64]) -> f64 {
    plant.engine().qpos(|at| at[..q.len()].copy_from_slice(q));
    plant.engine().kinematics().unwrap();
    (plant.engine().site().to_homogeneous() - Matrix4::from_row_slice(golden)).abs().max()
}

/// Poses and torques of recorded programs (Pinocchio), computed neither by this program nor by this MuJoCo.
#[test]
fn poses_and_gravity_torques() {
    let (model, golden) = (golden_model(), read("fk_torque_200.json"));
    let drawn = MujocoPlant::of(&machine(&model, &model.nominal(), Vector3::zeros())).unwrap();
    let table8 = MujocoPlant::of(&machine(&model, &model.table8(), Vector3::zeros())).unwrap();
    let (mut pose, mut torque, mut turned) = (0.0f64, 0.0f64, 0.0f64);
    let (poses, taus) = (rows(&golden["pose_nominal_pinocchio"]), rows(&golden["tau_pinocchio"]));
    for ((q, golden), tau) in rows(&golden["q"]).iter().zip(&poses).zip(&taus) {
        pose = pose.max(pose_error(&drawn, q, golden));
        drawn.engine().forward().unwrap();
        let holding = drawn.engine().holding();
        torque = tau.iter().zip(&holding).fold(torque, |most, (a, b)| most.max((a - b).abs()));
    }
    // The goldens' Table-8 poses have the gears twisted by the nominal arm's torques, so the joints are turned by hand.
    let compliance: Vec<(usize, f64)> = model.compliances();
    for ((q, golden), tau) in rows(&golden["q"]).iter().zip(rows(&golden["pose_table8_pinocchio"])).zip(&taus) {
        let mut q = q.clone();
        compliance.iter().for_each(|&(joint, c)| q[joint] += c * tau[joint]);
        turned = turned.max(pose_error(&table8, &q, &golden));
    }
    line("pose as drawn, 200 configurations", pose, 1e-12, "m");
    line("pose with Table 8, 200 configurations", turned, 1e-12, "m");
    line("gravity torque, 200 configurations", torque, 1e-9, "N·m");
}

/// Recorded readings of flat disks on a ball, by closed form and by an independent distance query between shapes.
#[test]
fn plunger_readings() {
    let (model, golden) = (golden_model(), read("contact_500.json"));
    let plant = MujocoPlant::of(&machine(&model, &model.nominal(), Vector3::zeros())).unwrap();
    let engine = plant.engine();
    let slides = [0, 1, 2].map(|k| engine.place(Thing::Joint, &format!("slide{k}")).unwrap());
    let q = [0.1, -1.3, 1.5, 0.2, 0.7, -0.3];
    engine.qpos(|at| at[..6].copy_from_slice(&q));
    engine.ctrl(|ctrl| ctrl[..6].copy_from_slice(&q));
    // The arm's own weight twists even a rigid gear by 1e-7 rad.
    engine.step(400).unwrap();
    engine.kinematics().unwrap();
    let world_from_tool = engine.site();
    let (mut flat, mut rim, mut on_rim) = (0.0f64, 0.0f64, 0);
    for (centre, readings) in rows(&golden["centres_m"]).iter().zip(rows(&golden["reading_analytic_m"])) {
        // The recorded disks move along +k, ours are on the other side: mirrored, they are the same.
        let centre = -Vector3::from_column_slice(centre);
        engine.move_mocap(&(world_from_tool * nalgebra::Point3::from(centre)).coords);
        engine.halt();
        engine.qpos(|at| slides.iter().for_each(|&k| at[k] = 0.0125));
        engine.step(400).unwrap();
        let travel = engine.qpos(|at| slides.map(|k| at[k]));
        for k in 0..3 {
            let lateral = (centre - Vector3::ith(k, centre[k])).norm();
            // Beyond its range a real plunger is at one of its ends.
            let expected = (-readings[k]).clamp(FREE_READING, MASTER_READING);
            let error = (FREE_READING + travel[k] - expected).abs();
            if lateral <= 5.75 * MM {
                flat = flat.max(error);
            } else {
                rim = rim.max(error);
                on_rim += 1;
            }
        }
    }
    assert!(on_rim > 50, "the goldens show the rim often enough: {on_rim}");
    line("reading on the flat, 500 balls", flat, 0.05 * UM, "m");
    line("reading on the rim, 500 balls", rim, 0.2 * UM, "m");
}

fn table8() -> Scenario {
    let mut scenario = load_scenario(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenarios/table8.toml")).unwrap();
    scenario.mujoco = Some(calibench_mujoco::make_plant);
    scenario
}

fn measured(scenario: &Scenario, kind: PlantKind, plans: &Plans) -> Measurements {
    let scenario = scenario.with_plant(kind);
    measure_all(&scenario, STREAMS, plans, &mut ()).unwrap()
}

/// The arm of Table 8 with its compliance, in equilibrium with gravity and the springs of the gauge on a ball.
#[test]
fn statics_of_centred_poses() {
    let scenario = table8();
    let plans = Plans::new(&scenario, 1).unwrap();
    let centred = measured(&scenario, PlantKind::Analytic, &plans).fit.samples;
    assert_eq!(centred.len(), 80);
    let gauge = Gauge::draw(&scenario.truth().keys().indicators.plungers(), &STREAMS);
    let parts = Parts::of(&scenario, &STREAMS, &gauge);
    let mut plants = [PlantKind::Analytic, PlantKind::Mujoco]
        .map(|kind| plant(&scenario.with_plant(kind), &STREAMS, &parts, 1000.0).unwrap());
    let mut form = BallForm { sigma: 0.0, random: STREAMS.stream("ball form") };
    let mut most = 0.0f64;
    for sample in &centred {
        let stand = Stand {
            motors: &sample.q,
            came_far: true,
            commanded: &sample.q,
            approach: &[1; 6],
            plungers: None,
            sample: None,
            time_s: 0.0,
            temp_c: 20.0,
        };
        let [closed, mujoco] = plants.each_mut().map(|plant| plant.settle(&stand, &mut form).unwrap());
        assert!(closed.ball.is_some() && mujoco.ball.is_some(), "a ball is before the gauge");
        let apart = closed.world_from_tool.translation.vector - mujoco.world_from_tool.translation.vector;
        most = most.max(apart.norm());
    }
    line("statics at the TCP, 80 centred poses", most, 0.2 * UM, "m");
}

/// The truth with all noise removed.
fn noiseless(truth: &TruthToml) -> TruthToml {
    let mut truth = truth.clone();
    let controller = &mut truth.controller;
    for sizes in
        [&mut controller.servo_error_arcsec, &mut controller.lost_motion_arcsec, &mut controller.small_move_play_arcsec]
    {
        sizes.fill(0.0);
    }
    let indicators = &mut truth.indicators;
    (indicators.noise_um, indicators.hysteresis_um, indicators.ball_form_um) = (0.0, 0.0, 0.0);
    truth
}

/// The controller is the same in both cells: it gets the same readings and takes the same number of steps.
#[test]
fn centrings_take_as_many_steps() {
    let scenario = table8();
    let scenario = scenario.with_truth(noiseless(scenario.truth().keys())).unwrap();
    let plans = Plans::new(&scenario, 1).unwrap();
    let [closed, mujoco] = [PlantKind::Analytic, PlantKind::Mujoco].map(|kind| measured(&scenario, kind, &plans).campaign);
    // Some poses end at a joint limit; reserves replace them.
    let steps = |record: &CampaignRecord| -> Vec<Option<usize>> {
        record.probings.iter().map(|p| p.probing.outcome.as_ref().ok().map(|centred| centred.steps)).collect()
    };
    let (a, b) = (steps(&closed), steps(&mujoco));
    assert_eq!((closed.samples.len(), mujoco.samples.len(), a.len()), (80, 80, b.len()));
    let equal = a.iter().zip(&b).filter(|(a, b)| a == b && a.is_some()).count();
    let first = |record: &CampaignRecord, k: usize| record.probings[k].probing.first_reading();
    let apart = (0..a.len()).map(|k| (first(&closed, k).unwrap() - first(&mujoco, k).unwrap()).norm()).fold(0.0, f64::max);
    // Up to 6 mm off centre a ball pushes at its own position; the closed forms let the springs push at the TCP. The
    // difference twists the wrist by some 1e-6 rad, and vanishes when the ball is centred.
    line("first reading of a probing, 80 probings", apart, 2.0 * UM, "m");
    println!("{:42} {equal} of 80 (at least 76)", "centrings with as many steps");
    assert!(equal >= 76, "{equal} of 80");
}

/// Prints a line of the table; fails if the value exceeds its limit.
fn line(what: &str, found: f64, limit: f64, unit: &str) {
    println!("{what:42} {found:9.1e} {unit:4} (limit {limit:.1e})");
    assert!(found < limit, "{what}: {found:e} {unit}, limit {limit:e}");
}
