//! From plain arrays to identified parameters: joint angles, and the points at which an instrument saw the tool.
//!
//! The arrays become a [`Dataset`] in memory; no file is read or written. Here they are made by an arm that differs from its nominal
//! model in four numbers, and noise is added. Run it with `cargo run --example identify_from_arrays`.

use std::error::Error;
use std::sync::Arc;

use calibench::identify::calibration::Calibration;
use calibench::identify::{Model, identify};
use calibench::measure::dataset::{Dataset, Measured, NamedDataset, Noise, Sample};
use calibench::nalgebra::Vector3;
use calibench::robot::kinematics::world_from_tool;
use calibench::robot::{FramePose, built_in};
use calibench::units::{DEG, MM, UM};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};

/// The robot: one that is built in; `robot::load_robot` reads any other.
const ROBOT: &str = "kr6_r700";

/// The base in the instrument's frame, as it was set up.
const BASE: FramePose = FramePose { xyz: [-0.5, 0.0, 0.0], rz_ry_rx: [0.0; 3] };

/// The reflector in the last link's frame.
const TOOL: FramePose = FramePose { xyz: [0.06, 0.01, -0.125], rz_ry_rx: [0.0; 3] };

/// One-sigma of each coordinate of a point, by the instrument's data sheet.
const NOISE: f64 = 20.0 * UM;

/// Prints the parameters and their uncertainties.
pub fn main() -> Result<(), Box<dyn Error>> {
    let calibration = identified()?;
    println!("{:>10} {:>11} {:>11} {:>9}", "parameter", "nominal", "identified", "1 sigma");
    for e in &calibration.estimates {
        let [nominal, value, sigma] = [e.nominal, e.value, e.sigma].map(|si| e.unit.from_si(si));
        println!("{:>10} {nominal:11.4} {value:11.4} {sigma:9.4} {}", e.name, e.unit.symbol);
    }
    println!("{} samples leave {:.1} um rms", calibration.samples, calibration.rms / UM);
    Ok(())
}

/// Identifies the arm from two arrays.
pub fn identified() -> Result<Calibration, Box<dyn Error>> {
    let (joints_deg, points_mm) = arrays()?;
    let sample = |(k, (q, point)): (usize, (&[f64; 6], &[f64; 3]))| {
        let measured = Measured::Point(Vector3::from(*point) * MM);
        Sample::new(format!("p{k}"), q.map(|angle| angle * DEG).to_vec(), measured)
    };
    let data = Dataset {
        robot: Arc::new(built_in(ROBOT).ok_or("no such robot")?),
        base: BASE,
        tool: TOOL,
        noise: Noise { point: Some(NOISE), ..Noise::default() },
        samples: joints_deg.iter().zip(&points_mm).enumerate().map(sample).collect(),
        ..Dataset::default()
    };
    Ok(identify(&[NamedDataset::new("campaign", &data)], &Model::of(&["base_frame", "mdh"]))?)
}

/// Joint angles in degrees and points in millimetres.
type Arrays = (Vec<[f64; 6]>, Vec<[f64; 3]>);

/// Simulated campaign: sixty postures, and the points measured there.
fn arrays() -> Result<Arrays, Box<dyn Error>> {
    let mut arm = built_in(ROBOT).ok_or("no such robot")?;
    let limits: Vec<[f64; 2]> = arm.links.iter().map(|link| link.limits).collect();
    arm.links[2].mdh.a += 0.2 * MM;
    arm.links[2].mdh.theta += 0.05 * DEG;
    let base = FramePose { xyz: [-0.4985, -0.0008, 0.0], ..BASE };
    let mut random = ChaCha8Rng::seed_from_u64(1);
    let noise = Normal::new(0.0, NOISE)?;
    let mut measure = |_| {
        let q: [f64; 6] = std::array::from_fn(|i| random.random_range(limits[i][0]..limits[i][1]));
        let point = world_from_tool(&arm, &base, &TOOL, &q).translation.vector;
        let seen = point.map(|x| (x + noise.sample(&mut random)) / MM);
        (q.map(|angle| angle / DEG), <[f64; 3]>::from(seen))
    };
    Ok((0..60).map(&mut measure).unzip())
}
