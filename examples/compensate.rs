//! Using a calibration: the target to command so that the tool reaches the desired pose.
//!
//! The controller computes with the nominal model, from which the arm differs. The compensated target is the nominal pose of those joints
//! that bring the identified arm to the desired one. Run it with `cargo run --example compensate`.

use std::error::Error;
use std::sync::Arc;

use calibench::compensate::conditions::Conditions;
use calibench::compensate::{Compensator, Desired, Fake, Target, Task};
use calibench::identify::calibration::Calibration;
use calibench::identify::{Model, identify};
use calibench::measure::dataset::{Dataset, Measured, NamedDataset, Noise, Sample};
use calibench::robot::kinematics::world_from_tool;
use calibench::robot::{FramePose, Robot, built_in};
use calibench::units::{DEG, MM, UM};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};

/// The tool in the last link's frame.
const TOOL: FramePose = FramePose { xyz: [0.06, 0.01, -0.125], rz_ry_rx: [0.0; 3] };

/// The target: the nominal pose at these joints.
const NEAR_DEG: [f64; 6] = [20.0, -70.0, 95.0, 15.0, 40.0, 30.0];

/// A compensated target, and how far from it the arm really stands.
pub struct Compensation {
    /// The target to command.
    pub fake: Fake,
    /// Error of the position when the target itself is commanded, m.
    pub off_plain: f64,
    /// Error when the compensated one is commanded, m.
    pub off_compensated: f64,
}

/// Prints the compensated target and its uncertainty.
pub fn main() -> Result<(), Box<dyn Error>> {
    let Compensation { fake, off_plain, off_compensated } = compensated()?;
    let FramePose { xyz: [x, y, z], rz_ry_rx: [a, b, c] } = FramePose::from_pose(&fake.pose);
    let ([x, y, z], [a, b, c]) = ([x, y, z].map(|v| v / MM), [a, b, c].map(|v| v / DEG));
    println!("command X {x:.3} Y {y:.3} Z {z:.3} A {a:.4} B {b:.4} C {c:.4}");
    println!(
        "that is {:.3} mm from the target; the tool will be within {:.3} mm of it (1 sigma)",
        fake.shift / MM,
        fake.uncertainty.three_d / MM
    );
    println!(
        "commanded as it is, the target is missed by {:.3} mm; compensated, by {:.3} mm",
        off_plain / MM,
        off_compensated / MM
    );
    Ok(())
}

/// Calibrates an arm and compensates one target.
pub fn compensated() -> Result<Compensation, Box<dyn Error>> {
    let (nominal, arm) = (built_in("kr6_r700").ok_or("no such robot")?, true_arm()?);
    let calibration = calibrated(&nominal, &arm)?;
    let mut compensator = Compensator::new(&calibration, &Task::default())?;
    let near = NEAR_DEG.map(|angle| angle * DEG).to_vec();
    let pose = compensator.nominal_pose(&near);
    let desired = Desired::Pose { pose, near: Some(near.clone()), status: None, turn: None };
    let target = Target { id: "t1".into(), desired, payload: None, conditions: Conditions::default() };
    let fake = compensator.compensate(&target).outcome?;
    let off = |q: &[f64]| {
        let stands = world_from_tool(&arm, &FramePose::default(), &TOOL, q);
        (stands.translation.vector - pose.translation.vector).norm()
    };
    Ok(Compensation { off_plain: off(&near), off_compensated: off(&fake.q), fake })
}

/// The real arm.
fn true_arm() -> Result<Robot, Box<dyn Error>> {
    let mut arm = built_in("kr6_r700").ok_or("no such robot")?;
    for (link, off) in arm.links.iter_mut().zip([0.0, 0.3, -0.4, 0.5, -0.2, 0.0]) {
        link.mdh.a += off * MM;
        link.mdh.theta += 0.1 * off * DEG;
    }
    Ok(arm)
}

/// The calibration of `arm` by a hundred points, with noise.
fn calibrated(nominal: &Robot, arm: &Robot) -> Result<Calibration, Box<dyn Error>> {
    let base = FramePose::default();
    let mut random = ChaCha8Rng::seed_from_u64(4);
    let noise = Normal::new(0.0, 20.0 * UM)?;
    let mut measure = |k: usize| {
        let q: Vec<f64> = nominal.links.iter().map(|link| random.random_range(link.limits[0]..link.limits[1])).collect();
        let point = world_from_tool(arm, &base, &TOOL, &q).translation.vector;
        Sample::new(format!("p{k}"), q, Measured::Point(point.map(|x| x + noise.sample(&mut random))))
    };
    let samples = (0..100).map(&mut measure).collect();
    let noise = Noise { point: Some(20.0 * UM), ..Noise::default() };
    let data = Dataset { samples, robot: Arc::new(nominal.clone()), base, tool: TOOL, noise, ..Dataset::default() };
    Ok(identify(&[NamedDataset::new("campaign", &data)], &Model::of(&["base_frame", "mdh"]))?)
}
