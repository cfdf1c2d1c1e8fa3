//! The arm gets from ball to ball without touching anything: the judge looks at the true arm, shares no code with the planner, and is known
//! to see, because without the planned ways it sees the arm drive through the artifact.
#![allow(clippy::unwrap_used)]

use std::path::Path;

use calibench::measure::{Abort, CentringFailure, HomeWays, PlannedPose, ProbingPlan};
use calibench_sim::planning::{Plan, plan};
use calibench_sim::random::Streams;
use calibench_sim::run::Plans;
use calibench_sim::scenario::{Scenario, load_scenario};
use calibench_sim::session::{Session, session_s};
use calibench_sim::world::{SharedWorld, World};

fn scenario(name: &str) -> Scenario {
    load_scenario(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenarios").join(name)).unwrap()
}

fn world(scenario: &Scenario, seed: u64) -> SharedWorld {
    SharedWorld::new(World::new(scenario, &Streams { seed, trial: 0 }, 3600.0).unwrap())
}

/// Every motion of a plan as its campaign makes them, to the last ball and home; of reserves from home and back.
fn motions(poses: &[PlannedPose], ways: &HomeWays) -> Vec<[Vec<f64>; 2]> {
    let mut path = vec![ways.home.clone()];
    let mut last: Option<&PlannedPose> = None;
    for pose in poses {
        match last {
            None => path.extend(ways.from_home(&pose.id).iter().cloned()),
            Some(before) if !pose.reserve && before.payload == pose.payload => path.extend(pose.via.iter().cloned()),
            Some(before) => path.extend(ways.between(&before.id, &pose.id)),
        }
        path.extend([pose.approach.clone(), pose.contact.clone(), pose.approach.clone()]);
        last = Some(pose);
    }
    path.extend(last.map(|pose| ways.home_from(&pose.id)).unwrap_or_default());
    if let Some((mastering, way)) = &ways.mastering {
        path.extend(way.via.iter().cloned());
        path.push(mastering.clone());
    }
    path.windows(2).map(|leg| [leg[0].clone(), leg[1].clone()]).collect()
}

fn touched(world: &SharedWorld, motions: &[[Vec<f64>; 2]]) -> Vec<[String; 2]> {
    motions.iter().filter_map(|[from, to]| world.would_touch(from, to)).collect()
}

fn planned(scenario: &Scenario, seed: u64) -> (Plan, HomeWays) {
    let plan = plan(scenario, seed).unwrap();
    let ways = plan.probing.ways.clone().unwrap();
    (plan, ways)
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
    // The session is stopped by the first of them.
    let streams = Streams { seed: 1, trial: 0 };
    let session = Session::begin(&scenario, streams, session_s(&scenario, &plan.probing.poses, 0)).unwrap();
    let record = session.probe(&ProbingPlan { ways: None, poses: plan.probing.poses.clone() }, None, &mut ());
    assert!(matches!(record.aborted, Some(Abort::Robot(CentringFailure::Collision { .. }))), "{:?}", record.aborted);
    assert!(record.samples.len() < main.len());
}

#[test]
fn no_plan_of_a_dozen_seeds_touches_anything() {
    for (name, seeds) in [("paper.toml", 41..47), ("table8.toml", 51..53), ("tilted-pedestal.toml", 61..63)] {
        let scenario = scenario(name);
        for seed in seeds {
            let world = world(&scenario, seed);
            let (plan, ways) = planned(&scenario, seed);
            assert_eq!(touched(&world, &motions(&plan.probing.poses, &ways)), Vec::<[String; 2]>::new(), "{name}, seed {seed}");
            assert!(ways.mastering.is_some(), "{name}, seed {seed}: nowhere to master the gauge");
        }
    }
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
