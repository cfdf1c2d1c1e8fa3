//! The model, the inputs and the reference averages of the benchmark works W1 to W6.
//!
//! They live beside the repository, in `../shared/golden` of the root package; without them there is nothing to measure.

#![allow(dead_code, clippy::unwrap_used)] // Each bench uses its part, and a bad reference file should stop it at once.

use std::path::PathBuf;

use calibench::robot::{Axis6, FramePose, Link, Loads, MdhEntry, MdhLink, Payload, Posture, Robot, Site, SiteIndex};
use calibench::units::{DEG, MM};
use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde_json::Value;

/// Place of the reference files.
pub fn folder() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../shared/golden")
}

/// Whether the reference files are there; says so when they are not.
pub fn present() -> bool {
    let found = folder().join("model.json").is_file();
    if !found {
        eprintln!("skipped: the reference files are not in {}", folder().display());
    }
    found
}

/// A JSON reference file.
pub fn json(name: &str) -> Value {
    serde_json::from_str(&std::fs::read_to_string(folder().join(name)).unwrap()).unwrap()
}

/// The numbers of a JSON array.
pub fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect()
}

/// A CSV input: one row of numbers a line, header left out.
pub fn table(name: &str) -> Vec<Vec<f64>> {
    let mut reader = csv::Reader::from_path(folder().join("inputs").join(name)).unwrap();
    reader.records().map(|r| r.unwrap().iter().map(|x| x.parse().unwrap()).collect()).collect()
}

/// A measured or selected pose: the ball, by place, and the joints, rad.
#[derive(Debug, Clone, PartialEq)]
pub struct BallPose {
    /// Ball.
    pub ball: usize,
    /// Joints, rad.
    pub q: Vec<f64>,
}

/// The poses of `w2_measured.csv` or `w3_pool.csv`.
pub fn ball_poses(name: &str) -> Vec<BallPose> {
    table(name).into_iter().map(|row| BallPose { ball: row[0] as usize, q: row[1..].to_vec() }).collect()
}

/// The 80 starts of W4: the selection of W3 (its first column is the place in the pool).
pub fn selection() -> Vec<BallPose> {
    table("w2_selection.csv").into_iter().map(|row| BallPose { ball: row[1] as usize, q: row[2..].to_vec() }).collect()
}

/// The 1,000 true parameter vectors of W4 (31 each, SI, in the order of the model's parameters).
pub fn truths() -> Vec<Vec<f64>> {
    table("w4_truth.csv")
}

/// The 500 validation configurations of W4, rad.
pub fn validation() -> Vec<Vec<f64>> {
    table("w4_validation.csv")
}

/// One of the 31 parameters.
#[derive(Debug, Clone, PartialEq)]
pub struct Parameter {
    /// Name in the reference files.
    pub name: String,
    /// Where it acts.
    pub site: Site,
    /// The joint (counted from 0) whose holding torque multiplies it, for a compliance.
    pub torque: Option<usize>,
    /// Value on the drawing, SI.
    pub nominal: f64,
    /// Value of the paper's Table 8, SI.
    pub table8: f64,
}

/// The robot, the cell and the 31 parameters of the reference model.
pub struct Model {
    /// The arm with the assumed masses.
    pub robot: Robot,
    /// Nominal base.
    pub base: FramePose,
    /// TCP.
    pub tool: FramePose,
    /// What the flange carries.
    pub payload: Payload,
    /// World, m/s².
    pub gravity: Vector3<f64>,
    /// Balls in the world, m.
    pub balls: Vec<Vector3<f64>>,
    /// The 31 parameters.
    pub parameters: Vec<Parameter>,
}

fn vector(value: &Value) -> Vector3<f64> {
    Vector3::from_column_slice(&numbers(value))
}

fn parameter(value: &Value) -> Parameter {
    let joint = value["joint"].as_u64().unwrap() as usize;
    let link = joint.saturating_sub(1);
    let kind = value["kind"].as_str().unwrap();
    let site = match kind {
        "alpha" => Site::Mdh(link, MdhEntry::Alpha),
        "a" => Site::Mdh(link, MdhEntry::A),
        "beta" => Site::Mdh(link, MdhEntry::Beta),
        "theta" | "c" => Site::Mdh(link, MdhEntry::Theta),
        "d" => Site::Mdh(link, MdhEntry::D),
        base => Site::Base(*Axis6::ALL.iter().find(|axis| base == format!("base_{}", axis.name())).unwrap()),
    };
    Parameter {
        name: value["name"].as_str().unwrap().to_owned(),
        site,
        torque: (kind == "c").then_some(link),
        nominal: value["nominal_si"].as_f64().unwrap(),
        table8: value["identified_table8_si"].as_f64().unwrap(),
    }
}

/// The reference model.
pub fn model() -> Model {
    let m = json("model.json");
    let limits = m["joint_limits_deg"].as_array().unwrap();
    let mut links: Vec<Link> = m["mdh_nominal"]
        .as_array()
        .unwrap()
        .iter()
        .zip(limits)
        .map(|(row, limits)| {
            let entry = |key: &str| row[key].as_f64().unwrap();
            let limits = numbers(limits);
            Link {
                mdh: MdhLink {
                    alpha: entry("alpha_prev_deg") * DEG,
                    a: entry("a_prev_mm") * MM,
                    beta: entry("beta_prev_deg") * DEG,
                    theta: entry("theta_offs_deg") * DEG,
                    d: entry("d_mm") * MM,
                },
                limits: [limits[0] * DEG, limits[1] * DEG],
                mass: 0.0,
                com: Vector3::zeros(),
            }
        })
        .collect();
    let mut payload = Payload::none();
    for body in m["inertial"]["links"].as_array().unwrap() {
        let (mass, com) = (body["mass_kg"].as_f64().unwrap(), vector(&body["com_m"]));
        match body["name"].as_str() {
            Some(name) => payload = Payload { name: name.to_owned(), mass, com },
            None => {
                let link = &mut links[body["frame"].as_u64().unwrap() as usize - 1];
                (link.mass, link.com) = (mass, com);
            }
        }
    }
    let frame = |value: &Value| {
        let (xyz, abc) = (vector(&value["xyz_mm"]) * MM, vector(&value["alpha_beta_gamma_deg"]) * DEG);
        FramePose { xyz: xyz.into(), rz_ry_rx: abc.into() }
    };
    Model {
        robot: Robot {
            name: "reference".into(),
            source: "../shared/golden/model.json".into(),
            links,
            gear_ratios: Vec::new(),
            solids: Vec::new(),
        },
        base: frame(&m["base_nominal"]),
        tool: frame(&m["tool"]),
        payload,
        gravity: vector(&m["gravity_world_m_s2"]),
        balls: m["balls_world_mm"].as_array().unwrap().iter().map(|b| vector(b) * MM).collect(),
        parameters: m["params"].as_array().unwrap().iter().map(parameter).collect(),
    }
}

impl Model {
    /// `count` random configurations inside the joint limits, rad, one after the other.
    pub fn random_configurations(&self, count: usize, seed: u64) -> Vec<[f64; 6]> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        (0..count)
            .map(|_| std::array::from_fn(|i| rng.random_range(self.robot.links[i].limits[0]..self.robot.links[i].limits[1])))
            .collect()
    }

    /// The three rows of the position Jacobian in the nominal model at `q` (row-major, 3 x 31).
    pub fn jacobian_rows(&self, posture: &mut Posture, loads: &mut Loads, q: &[f64], rows: &mut [f64]) {
        let nominal = vec![0.0; SiteIndex::new(self.robot.joints()).len()];
        posture.set(&self.robot, &self.base, &self.tool, q, &nominal);
        loads.weigh(&self.robot, posture, &self.payload, &self.gravity, &Vector3::zeros());
        let m = self.parameters.len();
        for (k, parameter) in self.parameters.iter().enumerate() {
            // The reference counts torque as holding the arm, `Loads` as the load's own.
            let weight = parameter.torque.map_or(1.0, |joint| -loads.tau[joint]);
            let column = posture.column(parameter.site) * weight;
            for r in 0..3 {
                rows[r * m + k] = column[r];
            }
        }
    }

    /// The candidates of W3: 5,000 blocks of 3 x 31 rows, row-major, and the ball of each.
    pub fn pool(&self) -> (Vec<f64>, Vec<usize>) {
        let poses = ball_poses("w3_pool.csv");
        let m = self.parameters.len();
        let (mut posture, mut loads) = (Posture::new(&self.robot), Loads::new(self.robot.joints()));
        let mut rows = vec![0.0; poses.len() * 3 * m];
        for (pose, rows) in poses.iter().zip(rows.chunks_exact_mut(3 * m)) {
            self.jacobian_rows(&mut posture, &mut loads, &pose.q, rows);
        }
        (rows, poses.iter().map(|p| p.ball).collect())
    }
}
