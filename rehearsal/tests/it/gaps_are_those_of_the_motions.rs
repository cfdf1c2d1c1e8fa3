//! The least gap of every body is that of the motions, by the closed form at many places of each; a motion has the gap that the
//! plan states for its pose; a body that is put in the way afterwards is found.

use std::collections::BTreeSet;

use calibench::measure::campaign::cell::{Cell, read_cell};
use calibench::measure::dataset::file::write_dataset;
use calibench::measure::dataset::{Measured, Sample};
use calibench::measure::poses::ProbingPlan;
use calibench::measure::session::{StartError, motions, preflight};
use calibench::robot::kinematics::Posture;
use calibench::robot::sites::SiteIndex;
use calibench::robot::solids::{ClearanceCheck, Solid};
use calibench::units::MM;
use calibench_rehearsal::{MotionTime, Phase, Rehearsal, Rehearsed, Sources, rehearsal_page};
use calibench_sim::planning::{find_ways, plan};
use calibench_sim::scenario::load_scenario;
use nalgebra::Vector3;

/// A cell with the bodies of a scenario, and a plan for it of a few poses on each ball.
fn planned(name: &str) -> (Cell, ProbingPlan) {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let scenarios = concat!(env!("CARGO_MANIFEST_DIR"), "/../scenarios");
    let text = format!(
        "format = \"calibench-scenario/1\"\nextends = \"{scenarios}/{name}.toml\"\n[plan]\npool_per_ball = 60\nstarts = 1\nposes_per_ball = 6\nreserves_per_ball = 2\n"
    );
    std::fs::write(at("scenario.toml"), text).unwrap();
    let scenario = load_scenario(&at("scenario.toml")).unwrap();
    let mut dataset = scenario.dataset();
    dataset.samples = vec![Sample::new("a", vec![0.0; 6], Measured::Ball { ball: 0, reading: None })];
    write_dataset(&dataset, &at("cell")).unwrap();
    scenario.scene().write(&at("scene.toml")).unwrap();
    let kind = if name.starts_with("ur") { "kind = \"ur\"\n" } else { "" };
    let mut text = format!(
        "format = \"calibench-cell/1\"\ndataset = \"cell/dataset.toml\"\nsurroundings.scene = \"scene.toml\"\n[robot]\n{kind}address = \"127.0.0.1:1\"\n"
    );
    for axis in ["x", "y", "z"] {
        text += &format!("[[indicator]]\naxis = \"{axis}\"\naddress = \"127.0.0.1:2\"\n");
    }
    std::fs::write(at("cell.toml"), text).unwrap();
    let mut probing = plan(&scenario, 3).unwrap().probing;
    probing.ways = Some(find_ways(&scenario, 3, None, &mut probing.poses).unwrap());
    (read_cell(&at("cell.toml")).unwrap(), probing)
}

/// The clearance of a posture, the gauge's own ball left out where it may be touched, m.
fn clearance_at(cell: &Cell, q: &[f64], ball: Option<usize>) -> f64 {
    let mut bodies = cell.surroundings.clone().unwrap();
    // Nothing but the gauge comes within reach of the ball that it touches.
    if let Some(ball) = ball {
        let name = Solid::ball_name(&cell.dataset.balls[ball].id);
        bodies.fixed.retain(|body| body.name != name);
    }
    let robot = &cell.dataset.robot;
    let mut posture = Posture::new(robot);
    posture.set(robot, &cell.dataset.base, &cell.dataset.tool, q, &vec![0.0; SiteIndex::new(robot.joints()).len()]);
    ClearanceCheck::new(robot, &bodies).clearance(&posture).unwrap().distance
}

#[test]
fn every_gap_is_the_narrowest_of_its_motion() {
    for name in ["paper", "ur5e-trical"] {
        let (cell, plan) = planned(name);
        let rehearsal = Rehearsal::of(&cell, &plan);
        assert!(rehearsal.is_clear(), "{name}: {}", rehearsal.verdict());
        for motion in &rehearsal.motions {
            let (from, to) = (&motion.from, &motion.to);
            let said = motion.clearance.as_ref().unwrap().distance;
            let touched = motion.ball.filter(|_| matches!(motion.phase, Phase::Contact | Phase::Retreat));
            let looked = (0..=40).map(|k| {
                let share = f64::from(k) / 40.0;
                let q: Vec<f64> = from.iter().zip(to).map(|(a, b)| a + share * (b - a)).collect();
                clearance_at(&cell, &q, touched)
            });
            let narrowest = looked.fold(f64::INFINITY, f64::min);
            assert!(said < narrowest + 0.5 * MM, "{name}, {motion:?}: {said}, at 41 places {narrowest}");
        }
        let of_motions = rehearsal.motions.iter().map(|motion| motion.clearance.as_ref().unwrap().distance);
        let least = &rehearsal.gaps[0];
        assert_eq!(least.gap, of_motions.fold(f64::INFINITY, f64::min), "one figure, in both tables");
        assert_eq!(rehearsal.motions[least.motion].clearance.as_ref().unwrap().distance, least.gap);
        let planned = rehearsal.planned.as_ref().unwrap().gap;
        assert!((least.gap - planned).abs() < 0.6 * MM, "{name}: {} here, {planned} in the plan", least.gap);
        assert_eq!(rehearsal.changed, [], "{name}");
        // Every motion begins where the one before ended.
        let made: Vec<_> = rehearsal.motions.iter().filter(|motion| !motion.spare).collect();
        assert!(made.windows(2).all(|pair| pair[1].from == pair[0].to), "{name}");
        // What a session is checked for before it starts is what was gone through, except the mastering, which is gone back too.
        let postures = |ways: Vec<Vec<f64>>| ways.into_iter().map(|q| format!("{q:?}")).collect::<BTreeSet<_>>();
        let rehearsed = rehearsal.motions.iter().flat_map(|motion| [motion.from.clone(), motion.to.clone()]).collect();
        let checked = motions(&plan).into_iter().flat_map(|motion| motion.way).collect();
        assert_eq!(postures(rehearsed), postures(checked), "{name}");
    }
}

#[test]
fn a_body_put_in_the_way_after_the_plan_is_found_before_anything_moves() {
    let (mut cell, plan) = planned("paper");
    assert!(preflight(&cell, &plan).is_ok());
    // A post where the TCP passes.
    let rehearsal = Rehearsal::of(&cell, &plan);
    let way =
        rehearsal.motions.iter().filter(|motion| motion.phase == Phase::Approach).max_by(|a, b| a.turn().total_cmp(&b.turn()));
    let (from, to) = (&way.unwrap().from, &way.unwrap().to);
    let middle: Vec<f64> = from.iter().zip(to).map(|(a, b)| (a + b) / 2.0).collect();
    let at = cell.guards.tcp(&middle);
    let post = Solid::capsule("forgotten post", 0, [at, at - Vector3::new(0.0, 0.0, 0.05)], 20.0 * MM);
    cell.surroundings.as_mut().unwrap().fixed.push(post);
    let now = Rehearsal::of(&cell, &plan);
    assert!(now.touching() > 0 && !now.is_clear(), "{}", now.verdict());
    assert_eq!(now.gaps[0].other, "forgotten post");
    assert!(now.verdict().contains("with bodies that touch") && now.verdict().contains("forgotten post"), "{}", now.verdict());
    assert!(now.warnings()[0].contains("is not that of the plan"), "{:?}", now.warnings());
    let refused = preflight(&cell, &plan).unwrap_err();
    assert!(matches!(&refused, StartError::Touching { .. }) && refused.to_string().contains("forgotten post"), "{refused}");
    let page = rehearsal_page(&cell, &now, &Sources { cell: "cell".into(), plan: "plan".into() });
    assert!(page.contains("and forgotten post touch"), "the page says so");
}

#[test]
fn without_a_scene_the_plan_is_believed_and_it_is_said() {
    let (mut cell, plan) = planned("paper");
    cell.surroundings = None;
    let rehearsal = Rehearsal::of(&cell, &plan);
    let said = rehearsal.verdict();
    assert!(said.contains("as the plan says") && said.contains("names no bodies"), "{said}");
    let page = rehearsal_page(&cell, &rehearsal, &Sources { cell: "cell".into(), plan: "plan".into() });
    assert!(page.contains("No gap is checked"), "what was not checked stands on the page");
    assert!(preflight(&cell, &plan).is_ok());
}

#[test]
fn the_time_is_that_of_the_largest_turns() {
    let (mut cell, plan) = planned("ur5e-trical");
    let time = |cell: &Cell| Rehearsal::of(cell, &plan).times;
    let [MotionTime { speed, time: slow }] = time(&cell)[..] else { panic!("the driver orders one speed") };
    let turns: f64 =
        Rehearsal::of(&cell, &plan).motions.iter().filter(|motion| !motion.spare).map(|motion| motion.turn()).sum();
    assert!(slow > turns / speed && slow < 3.0 * turns / speed, "{slow} s for {turns} rad at {speed} rad/s");
    cell.speed_percent *= 2;
    let [MotionTime { time: fast, .. }] = time(&cell)[..] else { panic!("the driver orders one speed") };
    assert!((slow / fast - 2.0).abs() < 1e-9, "twice the speed takes half the time");
}

#[test]
fn a_contact_that_is_none_of_its_ball_is_refused() {
    let (cell, mut plan) = planned("paper");
    let other = plan.poses.iter().position(|pose| pose.ball != plan.poses[0].ball && !pose.reserve).unwrap();
    plan.poses[0].ball = plan.poses[other].ball;
    let rehearsal = Rehearsal::of(&cell, &plan);
    assert!(!rehearsal.is_clear() && rehearsal.off_their_balls() == 1, "{}", rehearsal.verdict());
    let wrong = rehearsal.motions.iter().find_map(Rehearsed::wrong).unwrap();
    assert!(wrong.contains("mm from the centre of ball"), "{wrong}");
    assert!(preflight(&cell, &plan).unwrap_err().to_string().contains(&wrong), "measure refuses it in the same words");
}
