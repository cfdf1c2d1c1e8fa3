//! A run, with a check of the recorded postures of the true arm.

use calibench::measure::centring::Phase;
use calibench::units::{MM, UM};
use calibench_sim::plans::Plans;
use calibench_sim::random::Streams;
use calibench_sim::run::run;
use calibench_sim::scenario::Scenario;
use nalgebra::Point3;

/// Largest error at a reading of zero, m: indicators read to 1 um, and balls are known and round to some um.
const AT_ZERO: f64 = 30.0 * UM;
/// Further error as a share of the reading: the angles of its gauge err by some 1e-3.
const OF_A_READING: f64 = 5e-3;

/// Flange to TCP is one rigid body.
const RIGID: f64 = 1e-9;

/// Links are manufactured to within millimetres of nominal.
const AS_DRAWN: f64 = 5.0 * MM;

/// Runs the scenario.
pub fn holds_the_ball(scenario: &Scenario) {
    let run = run(scenario, Plans::new(scenario, 1).unwrap(), Streams { seed: 1, trial: 0 }, &mut ()).unwrap();
    let (links, balls) = (&run.trical.dataset.robot.links, &run.trical.dataset.balls);
    let mut flange_from_tool = None;
    let mut checked = 0;
    for record in &run.campaign.probings {
        let ball = Point3::from(balls[run.plan.probing.poses[record.pose].ball.unwrap()].position);
        for stop in &record.probing.iterations {
            let stood = run.true_arm.at(stop.time_s).unwrap();
            assert_eq!(stood.frames.len(), links.len() + 1);
            let tool = stood.frames[links.len()].inverse() * stood.tool;
            let as_before: &mut calibench::robot::Pose = flange_from_tool.get_or_insert(tool);
            assert!((tool.translation.vector - as_before.translation.vector).norm() < RIGID);
            for (k, link) in links.iter().enumerate() {
                let length = (stood.frames[k + 1].translation.vector - stood.frames[k].translation.vector).norm();
                assert!((length - link.mdh.a.hypot(link.mdh.d)).abs() < AS_DRAWN, "link {}: {length}", k + 1);
            }
            if let (Phase::Centring, Some(reading)) = (stop.phase, stop.reading.filter(|r| r.min() > -3.0 * MM)) {
                let off = (stood.tool.inverse_transform_point(&ball).coords - reading).norm();
                assert!(off < AT_ZERO + OF_A_READING * reading.norm(), "{off} m off at {reading:?}");
                checked += 1;
            }
        }
    }
    // At least two readings per ball.
    assert!(checked >= 2 * run.campaign.samples.len(), "only {checked} stops were checked");
}
