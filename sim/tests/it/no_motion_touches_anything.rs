//! The arm moves from ball to ball without touching anything. The collision check uses the true arm and shares no code with
//! the planner; it is known to work, because without the planned paths it sees the arm collide with the artifact.

use std::ops::Range;
use std::path::Path;

use calibench::measure::campaign::Abort;
use calibench::measure::centring::CentringFailure;
use calibench::measure::poses::{PlannedPose, ProbingPlan};
use calibench_sim::plans::Plans;
use calibench_sim::plans::session_s;
use calibench_sim::random::Streams;
use calibench_sim::scenario::{Scenario, load_scenario};
use calibench_sim::session::Session;
use calibench_sim::world::{SharedWorld, World};

use crate::planned::{motions, planned};

fn scenario(name: &str) -> Scenario {
    load_scenario(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenarios").join(name)).unwrap()
}

fn world(scenario: &Scenario, seed: u64) -> SharedWorld {
    SharedWorld::new(World::new(scenario, &Streams { seed, trial: 0 }, 3600.0).unwrap())
}

fn touched(world: &SharedWorld, motions: &[[Vec<f64>; 2]]) -> Vec<[String; 2]> {
    motions.iter().filter_map(|[from, to]| world.would_touch(from, to)).collect()
}

#[test]
fn without_the_ways_the_flagship_drives_through_its_artifact() {
    let scenario = scenario("paper.toml");
    let world = world(&scenario, 1);
    let (plan, ways) = planned(&scenario, 1);
    let main: Vec<&PlannedPose> = plan.probing.poses.iter().filter(|p| !p.reserve).collect();
    let direct: Vec<[Vec<f64>; 2]> = main.windows(2).map(|p| [p[0].approach.clone(), p[1].approach.clone()]).collect();
    let hits = touched(&world, &direct);
    assert!(hits.len() >= 10, "the judge is blind: {hits:?}");
    assert_eq!(touched(&world, &motions(&plan.probing.poses, &ways)), Vec::<[String; 2]>::new());
    // The first collision stops the session.
    let streams = Streams { seed: 1, trial: 0 };
    let session = Session::begin(&scenario, streams, session_s(&scenario, &plan.probing.poses, 0)).unwrap();
    let record = session.probe(&ProbingPlan { ways: None, poses: plan.probing.poses.clone() }, None, &mut ());
    assert!(matches!(record.aborted, Some(Abort::Robot(CentringFailure::Collision { .. }))), "{:?}", record.aborted);
    assert!(record.samples.len() < main.len());
}

fn no_plan_touches_anything(name: &str, seeds: Range<u64>) {
    let scenario = scenario(name);
    for seed in seeds {
        let world = world(&scenario, seed);
        let (plan, ways) = planned(&scenario, seed);
        assert_eq!(touched(&world, &motions(&plan.probing.poses, &ways)), Vec::<[String; 2]>::new(), "{name}, seed {seed}");
        assert!(ways.mastering.is_some(), "{name}, seed {seed}: nowhere to master the gauge");
    }
}

/// The joints of a UR10 turn twice.
#[test]
fn no_plan_for_a_ur10_touches_anything() {
    no_plan_touches_anything("blind-suite-ur10.toml", 1..2);
}

#[test]
fn no_plan_for_a_ur5e_touches_anything() {
    no_plan_touches_anything("ur5e-trical.toml", 1..2);
}

#[test]
#[ignore = "a study of 50 seeds: validation/run no_motion_touches_anything"]
fn no_plan_for_universal_robots_touches_anything() {
    for name in ["ur5e-trical.toml", "ur10e-trical.toml"] {
        no_plan_touches_anything(name, 100..125);
    }
}

#[test]
fn no_plan_for_the_paper_touches_anything() {
    no_plan_touches_anything("paper.toml", 41..45);
}

#[test]
fn no_plan_for_other_scenarios_touches_anything() {
    no_plan_touches_anything("table8.toml", 51..53);
    no_plan_touches_anything("tilted-pedestal.toml", 61..63);
}

#[test]
fn the_tracker_s_poses_are_reached_clear() {
    let scenario = scenario("paper.toml");
    let plans = Plans::new(&scenario, 3).unwrap();
    let world = world(&scenario, 3);
    world.attendant().remove_artifact();
    let home = plans.plan.probing.ways.unwrap().home;
    let mut path = vec![home];
    let mut direct = Vec::new();
    for tour in [&plans.tracker.points, &plans.tracker.validation, &plans.tracker.identification] {
        for (pose, via) in tour.poses.iter().zip(&tour.via) {
            path.extend(via.iter().cloned());
            path.push(pose.clone());
            direct.push(pose.clone());
        }
    }
    let legs = |path: &[Vec<f64>]| path.windows(2).map(|l| [l[0].clone(), l[1].clone()]).collect::<Vec<_>>();
    assert!(!touched(&world, &legs(&direct)).is_empty(), "the judge is blind");
    assert_eq!(touched(&world, &legs(&path)), Vec::<[String; 2]>::new());
}
