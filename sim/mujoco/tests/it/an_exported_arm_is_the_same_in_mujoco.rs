//! The model that `compensate --mjcf` writes is the identified arm: MuJoCo loads it, and its tool is where the library has it, to the
//! rounding of double precision. Built-in arms with errors, and arms that were drawn, rails among their joints.

use calibench::compensate::mjcf::mjcf;
use calibench::compensate::rigid::{LeftOut, RigidRobot};
use calibench::robot::kinematics::world_from_tool;
use calibench::robot::{BUILT_IN, FramePose, JointKind, Link, MdhLink, Robot, built_in};
use calibench_mujoco::mujoco;
use nalgebra::{Rotation3, Vector3};
use numpy::{PyArray1, PyArray2, PyArrayMethods};
use pyo3::prelude::*;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Arms that are drawn.
const DRAWN: usize = 26;
/// Postures of each.
const POSTURES: usize = 20;
/// Largest difference, m and of an entry of the rotation: chains of nine joints, in another order of operations.
const ROUNDING: f64 = 1e-12;

fn frame(random: &mut ChaCha8Rng) -> FramePose {
    FramePose {
        xyz: std::array::from_fn(|_| random.random_range(-1.0..1.0)),
        rz_ry_rx: std::array::from_fn(|_| random.random_range(-1.5..1.5)),
    }
}

fn drawn(random: &mut ChaCha8Rng) -> Robot {
    let joints = random.random_range(1..=9);
    let link = |random: &mut ChaCha8Rng| {
        let kind = if random.random_bool(0.2) { JointKind::Prismatic } else { JointKind::Revolute };
        let [alpha, beta, theta] = std::array::from_fn(|_| random.random_range(-3.0..3.0));
        let [a, d] = std::array::from_fn(|_| random.random_range(-0.8..0.8));
        let mass = if random.random_bool(0.5) { 2.0 } else { 0.0 };
        let mdh = MdhLink { kind, alpha, a, beta: 0.01 * beta, theta, d };
        Link { mdh, limits: [-2.0, 2.5], mass, com: Vector3::new(0.1, -0.2, 0.05) }
    };
    Robot { name: "drawn, of a \"test\" -- ".into(), links: (0..joints).map(|_| link(random)).collect(), ..Robot::default() }
}

/// Place and rotation of the tool in MuJoCo, and the ranges of its joints.
fn in_mujoco(py: Python<'_>, text: &str, q: &[f64]) -> PyResult<(Vector3<f64>, Rotation3<f64>, Vec<f64>)> {
    let mujoco = mujoco(py).unwrap_or_else(|error| panic!("{error}"));
    let model = mujoco.getattr("MjModel")?.call_method1("from_xml_string", (text,))?;
    let data = mujoco.getattr("MjData")?.call1((&model,))?;
    data.getattr("qpos")?.cast_into::<PyArray1<f64>>()?.readwrite().as_slice_mut()?.copy_from_slice(q);
    mujoco.getattr("mj_kinematics")?.call1((&model, &data))?;
    let site = data.call_method1("site", ("tcp",))?;
    let at = site.getattr("xpos")?.cast_into::<PyArray1<f64>>()?.to_vec()?;
    let turn = site.getattr("xmat")?.cast_into::<PyArray1<f64>>()?.to_vec()?;
    let range = model.getattr("jnt_range")?.cast_into::<PyArray2<f64>>()?.to_vec()?;
    let matrix = nalgebra::Matrix3::from_row_slice(&turn);
    Ok((Vector3::from_row_slice(&at), Rotation3::from_matrix_unchecked(matrix), range))
}

#[test]
fn an_exported_arm_is_the_same_in_mujoco() {
    let mut random = ChaCha8Rng::seed_from_u64(41);
    let mut arms: Vec<Robot> = BUILT_IN.iter().filter_map(|name| built_in(name)).collect();
    for arm in &mut arms {
        for link in &mut arm.links {
            link.mdh.alpha += random.random_range(-0.01..0.01);
            link.mdh.beta += random.random_range(-0.01..0.01);
            link.mdh.d += random.random_range(-0.001..0.001);
        }
    }
    arms.extend((0..DRAWN).map(|_| drawn(&mut random)));
    let mut worst = 0.0f64;
    Python::attach(|py| {
        for robot in &arms {
            let (base, tool) = (frame(&mut random), frame(&mut random));
            let left_out = LeftOut { mean: 0.0, max: 0.0, postures: 0 };
            let rigid = RigidRobot { robot: robot.clone(), base, tool, effects: vec!["joint_compliance".into()], left_out };
            let text = mjcf(&rigid);
            for _ in 0..POSTURES {
                let q: Vec<f64> = robot.links.iter().map(|link| random.random_range(link.limits[0]..link.limits[1])).collect();
                let (at, turn, range) = in_mujoco(py, &text, &q).unwrap_or_else(|error| panic!("{error}\n{text}"));
                let ours = world_from_tool(robot, &base, &tool, &q);
                let off = (at - ours.translation.vector).amax().max((turn.matrix() - ours.rotation.matrix()).amax());
                assert!(off < ROUNDING, "{}: {off:e}\n{text}", robot.name);
                worst = worst.max(off);
                let limits: Vec<f64> = robot.links.iter().flat_map(|link| link.limits).collect();
                assert_eq!(range, limits);
            }
        }
    });
    println!("{} arms, {POSTURES} postures each: at most {worst:.1e}", arms.len());
}
