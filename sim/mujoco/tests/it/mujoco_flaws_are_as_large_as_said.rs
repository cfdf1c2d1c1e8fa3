//! A flaw of the mechanism in MuJoCo is as large as the scenario says: each is checked against the equation of its spring.

use std::path::Path;

use calibench::units::{DEG, URAD};
use calibench_mujoco::{Engine, MujocoPlant, Thing, machine};
use calibench_sim::gauge::Gauge;
use calibench_sim::mechanics::{BallForm, Parts, Plant, Stand};
use calibench_sim::random::Streams;
use calibench_sim::scenario::{Backlash, Bearing, Friction, MujocoToml, Pedestal, Stiffening, load_scenario};

const STREAMS: Streams = Streams { seed: 1, trial: 0 };
/// Away from every ball; gravity loads all joints but the first.
const POSTURE: [f64; 6] = [20.0, -60.0, 80.0, 30.0, 40.0, 10.0];
/// Table 8's compliance of joint 3, rad/(N·m).
const C3: f64 = 3.238e-3 * DEG;
/// Everything settles to within 1e-10 rad.
const AT_REST: f64 = 1e-9;

fn plant(flaws: MujocoToml) -> MujocoPlant {
    let scenario = load_scenario(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenarios/mujoco-pedestal.toml")).unwrap();
    let mut truth = scenario.truth().keys().clone();
    truth.mujoco = flaws;
    let scenario = scenario.with_truth(truth).unwrap();
    let gauge = Gauge::draw(&scenario.truth().keys().indicators.plungers(), &STREAMS);
    let parts = Parts::of(&scenario, &STREAMS, &gauge);
    MujocoPlant::of(&machine(&scenario, &STREAMS, &parts).unwrap()).unwrap()
}

fn settle(plant: &mut MujocoPlant, motors: &[f64]) {
    let stand = Stand {
        motors,
        came_far: true,
        commanded: motors,
        approach: &[0; 6],
        plungers: None,
        sample: None,
        time_s: 0.0,
        temp_c: 20.0,
    };
    plant.settle(&stand, &mut BallForm { sigma: 0.0, random: STREAMS.stream("ball form") }).unwrap();
}

fn motors() -> Vec<f64> {
    POSTURE.map(|deg| deg * DEG).to_vec()
}

/// Angle of a hinge, rad, and the moment of gravity about it, N·m.
fn hinge(engine: &Engine, name: &str) -> (f64, f64) {
    let place = engine.place(Thing::Joint, name).unwrap();
    engine.forward().unwrap();
    (engine.qpos(|q| q[place]), -engine.holding()[place])
}

#[test]
fn hinges_give_way_in_proportion_to_their_moment() {
    let pedestal = Some(Pedestal { x_urad_per_nm: 2.0, y_urad_per_nm: 3.0 });
    let bearing = vec![Bearing { joint: 2, urad_per_nm: 12.0 }];
    let mut plant = plant(MujocoToml { pedestal, bearing, ..MujocoToml::default() });
    settle(&mut plant, &motors());
    for (name, urad_per_nm) in [("pedestal_x", 2.0), ("pedestal_y", 3.0), ("bearing2_x", 12.0), ("bearing2_y", 12.0)] {
        let (angle, moment) = hinge(plant.engine(), name);
        assert!(moment.abs() > 0.1, "{name} carries nothing: {moment} N·m");
        let expected = urad_per_nm * URAD * moment;
        assert!((angle - expected).abs() < AT_REST, "{name}: {angle} rad, expected {expected}");
    }
}

#[test]
fn a_stiffening_gear_follows_its_cubic() {
    let (share, at_nm) = (0.2, 40.0);
    let mut plant = plant(MujocoToml { stiffening: vec![Stiffening { joint: 3, share, at_nm }], ..MujocoToml::default() });
    settle(&mut plant, &motors());
    let (angle, torque) = hinge(plant.engine(), "joint3");
    let x = angle - motors()[2];
    let cubic = share / (C3.powi(3) * at_nm * at_nm);
    assert!((x / C3 + cubic * x.powi(3) - torque).abs() < 1e-5, "{x} rad under {torque} N·m");
    // To first order a fifth of the linear twist is missing at 40 N·m.
    let missing = 1.0 - x / (C3 * torque);
    assert!(missing > 0.0 && missing < share * (torque / at_nm).powi(2), "{missing} under {torque} N·m");
}

#[test]
fn a_gear_with_play_lies_at_the_end_to_which_gravity_pulls() {
    let width = 200.0;
    let mut plant = plant(MujocoToml { backlash: vec![Backlash { joint: 3, width_urad: width }], ..MujocoToml::default() });
    settle(&mut plant, &motors());
    let (angle, torque) = hinge(plant.engine(), "joint3");
    let expected = motors()[2] + C3 * torque + 0.5 * width * URAD * torque.signum();
    assert!((angle - expected).abs() < AT_REST, "{angle} rad, expected {expected}");
}

/// Dry friction holds the joint back by `c T` in either direction; a short reversal takes less than all of it.
#[test]
fn a_joint_that_rubs_stops_short_on_the_side_from_which_it_came() {
    let (torque_nm, presliding_urad) = (0.6, 80.0);
    let friction = vec![Friction { joint: 3, torque_nm, presliding_urad }];
    let mut plant = plant(MujocoToml { friction, ..MujocoToml::default() });
    let mut arrive = |from: f64| {
        let mut motors = motors();
        motors[2] += from;
        settle(&mut plant, &motors);
        motors[2] -= from;
        settle(&mut plant, &motors);
        hinge(plant.engine(), "joint3").0
    };
    let lost = arrive(0.1) - arrive(-0.1);
    let expected = 2.0 * C3 * torque_nm;
    // Friction creeps by about a percent of the presliding during settling.
    assert!((lost - expected).abs() < 0.02 * presliding_urad * URAD, "{lost} rad, expected {expected}");
}
