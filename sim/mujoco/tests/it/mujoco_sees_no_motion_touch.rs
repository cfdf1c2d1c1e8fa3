//! The arm moves from ball to ball without touching anything, checked by MuJoCo's own kinematics and contacts of the nominal
//! arm, which share no code with the planner or with the collision check of the simulated cell.

use std::fmt::Write;
use std::path::Path;

use calibench::measure::poses::PlannedPose;
use calibench::robot::Pose;
use calibench::robot::solids::{Shape, Solid};
use calibench_mujoco::mujoco;
use calibench_sim::scenario::{Scenario, load_scenario};
use nalgebra::{Rotation3, UnitQuaternion, Vector3};
use pyo3::prelude::*;
use pyo3::types::PyModule;

use crate::planned::{motions, planned};

/// Moves the arm along legs in steps of a quarter of a degree; returns the pairs of bodies that touch, each once. What the arm
/// carries may touch the ball of a leg that has one.
const JUDGE: &std::ffi::CStr = c"
import mujoco, numpy

def touched(document, legs, balls):
    model = mujoco.MjModel.from_xml_string(document)
    data = mujoco.MjData(model)
    names = [mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_GEOM, k) for k in range(model.ngeom)]
    hits = set()
    for leg, ((start, end), ball) in enumerate(zip(legs, balls)):
        start, end = numpy.array(start), numpy.array(end)
        steps = max(2, int(numpy.degrees(numpy.abs(end - start).max()) / 0.25))
        for share in numpy.linspace(0.0, 1.0, steps):
            data.qpos[:] = start + share * (end - start)
            mujoco.mj_kinematics(model, data)
            mujoco.mj_comPos(model, data)
            mujoco.mj_collision(model, data)
            for contact in data.contact[:data.ncon]:
                pair = [names[g] for g in contact.geom]
                carried = any(n.startswith('carried ') for n in pair)
                if not (carried and ball in pair):
                    hits.add((leg, *sorted(pair)))
    return sorted(hits)
";

fn stands(pose: &Pose) -> String {
    let (t, q) = (pose.translation.vector, UnitQuaternion::from_rotation_matrix(&pose.rotation));
    format!("pos=\"{} {} {}\" quat=\"{} {} {} {}\"", t.x, t.y, t.z, q.w, q.i, q.j, q.k)
}

fn geom(name: &str, shape: &Shape) -> String {
    match shape {
        Shape::Capsule { ends: [a, b], radius } if a == b => {
            format!("<geom name=\"{name}\" type=\"sphere\" pos=\"{} {} {}\" size=\"{radius}\"/>", a.x, a.y, a.z)
        }
        Shape::Capsule { ends: [a, b], radius } => format!(
            "<geom name=\"{name}\" type=\"capsule\" fromto=\"{} {} {} {} {} {}\" size=\"{radius}\"/>",
            a.x, a.y, a.z, b.x, b.y, b.z
        ),
        Shape::Box { centre: c, half_size: h } => {
            format!("<geom name=\"{name}\" type=\"box\" pos=\"{} {} {}\" size=\"{} {} {}\"/>", c.x, c.y, c.z, h.x, h.y, h.z)
        }
    }
}

fn scenario(name: &str) -> Scenario {
    load_scenario(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenarios").join(name)).unwrap()
}

/// The nominal cell, excluding contacts between neighbours of the arm, and between the base and the body it is bolted to.
fn document(scenario: &Scenario) -> String {
    let (cell, surroundings) = (scenario.dataset(), scenario.surroundings());
    let of = |solids: &[Solid], prefix: &str| -> String {
        solids.iter().map(|s| geom(&format!("{prefix}{}", s.name), &s.shape)).collect()
    };
    let links = &cell.robot.links;
    let mut text = format!(
        "<mujoco><compiler angle=\"radian\"/><worldbody>{}<body name=\"b0\" {}>",
        of(&surroundings.fixed, ""),
        stands(&cell.base.pose())
    );
    let on = |k: usize| cell.robot.solids.iter().filter(|s| s.frame == k).cloned().collect::<Vec<_>>();
    text += &of(&on(0), "");
    for (k, link) in links.iter().enumerate() {
        let m = link.mdh;
        assert!(m.beta == 0.0, "no arm with Hayati's angle is drawn here");
        let turned = Rotation3::from_axis_angle(&Vector3::x_axis(), m.alpha);
        let at = Pose::from_parts(
            (turned * Vector3::new(m.a, 0.0, m.d)).into(),
            turned * Rotation3::from_axis_angle(&Vector3::z_axis(), m.theta),
        );
        let inertial = "<inertial pos=\"0 0 0\" mass=\"1\" diaginertia=\"1 1 1\"/>";
        write!(text, "<body name=\"b{}\" {}>{inertial}<joint axis=\"0 0 1\"/>", k + 1, stands(&at)).unwrap();
        text += &of(&on(k + 1), "");
    }
    text += &of(&surroundings.carried, "carried ");
    text += &"</body>".repeat(links.len() + 1);
    text += "</worldbody><contact><exclude body1=\"b0\" body2=\"b1\"/></contact></mujoco>";
    text
}

type Hits = Vec<(usize, String, String)>;

fn hits(scenario: &Scenario, legs: &[[Vec<f64>; 2]], balls: &[String]) -> Hits {
    Python::attach(|py| {
        mujoco(py).unwrap();
        let judge = PyModule::from_code(py, JUDGE, c"judge.py", c"judge").unwrap();
        let legs: Vec<(Vec<f64>, Vec<f64>)> = legs.iter().map(|[a, b]| (a.clone(), b.clone())).collect();
        judge.getattr("touched").unwrap().call1((document(scenario), legs, balls)).unwrap().extract().unwrap()
    })
}

/// At least so many motions between the poses of the plan touch something, and none of those that are planned.
fn it_sees(name: &str, seed: u64, at_least: usize) {
    let scenario = scenario(name);
    let (plan, ways) = planned(&scenario, seed);
    let poses = plan.probing.poses;
    let legs = motions(&poses, &ways);
    let ids = scenario.ball_ids();
    let ball_of = |leg: &[Vec<f64>; 2]| {
        let on_it = poses.iter().find(|p| leg.contains(&p.contact));
        on_it.and_then(|p| p.ball).map_or(String::new(), |ball| Solid::ball_name(&ids[ball]))
    };
    let balls: Vec<String> = legs.iter().map(ball_of).collect();
    assert!(balls.iter().filter(|b| !b.is_empty()).count() >= 2 * poses.len());
    assert_eq!(hits(&scenario, &legs, &balls), Hits::new(), "{name}, seed {seed}");
    let main: Vec<&PlannedPose> = poses.iter().filter(|p| !p.reserve).collect();
    let direct: Vec<[Vec<f64>; 2]> = main.windows(2).map(|p| [p[0].approach.clone(), p[1].approach.clone()]).collect();
    let seen = hits(&scenario, &direct, &vec![String::new(); direct.len()]);
    let motions: std::collections::BTreeSet<usize> = seen.iter().map(|(leg, ..)| *leg).collect();
    println!("{name}: {} of {} direct motions touch", motions.len(), direct.len());
    assert!(motions.len() >= at_least, "{name}: MuJoCo is blind: {seen:?}");
}

#[test]
fn it_sees_what_the_ways_of_the_paper_avoid() {
    it_sees("paper.toml", 1, 10);
}

#[test]
fn it_sees_what_the_ways_of_table_8_avoid() {
    it_sees("table8.toml", 71, 1);
}

#[test]
#[ignore = "a study of 50 seeds: validation/run mujoco_sees_no_motion_touch"]
fn it_sees_nothing_touch_around_universal_robots() {
    for name in ["ur5e-trical.toml", "ur10e-trical.toml"] {
        for seed in 100..125 {
            it_sees(name, seed, 1);
        }
    }
}
