//! The golden numbers of independent programs (Pinocchio, MuJoCo, JAX), of `tests/data/golden`, and the model behind them.
#![allow(dead_code)] // each test uses its own part

use std::path::PathBuf;

use calibench::robot::sites::{Axis6, MdhEntry, Site, SiteIndex};
use calibench::robot::statics::Payload;
use calibench::robot::{FramePose, Link, MdhLink, Robot};
use calibench::units::{DEG, MM};
use nalgebra::Vector3;
use serde_json::Value;

use super::oracles;

/// One of the 31 parameters of the paper's Table 8.
pub struct GoldenParameter {
    /// As in the golden file: `alpha_1`, `c_6`.
    pub name: String,
    /// The site that moves; a compliance moves the joint's theta by `value * tau`.
    pub site: Site,
    /// True for a compliance, which is multiplied by the holding torque dU/dq.
    pub compliance: bool,
    /// Value on the drawing, SI.
    pub nominal: f64,
    /// Value of Table 8, SI.
    pub table8: f64,
}

/// The robot, its set-up and its parameters.
pub struct GoldenModel {
    pub robot: Robot,
    pub base: FramePose,
    pub tool: FramePose,
    pub payload: Payload,
    pub gravity: Vector3<f64>,
    /// Balls of the artifact, m.
    pub balls: Vec<Vector3<f64>>,
    pub parameters: Vec<GoldenParameter>,
}

impl GoldenModel {
    /// Deviations of the arm with these parameters (SI, absolute values) at this holding torque.
    pub fn deviations(&self, values: &[f64], holding: &[f64]) -> Vec<f64> {
        let sites = SiteIndex::new(self.robot.joints());
        let mut deviations = vec![0.0; sites.len()];
        for (p, value) in self.parameters.iter().zip(values) {
            let weight = match p.site {
                Site::Mdh(j, MdhEntry::Theta) if p.compliance => holding[usize::from(j)],
                _ => 1.0,
            };
            deviations[sites.of(p.site)] += weight * (value - p.nominal);
        }
        deviations
    }

    /// Parameters on the drawing.
    pub fn nominal(&self) -> Vec<f64> {
        self.parameters.iter().map(|p| p.nominal).collect()
    }

    /// Table 8's compliances by joint (from 0), rad/(N·m), of holding torques.
    pub fn compliances(&self) -> Vec<(usize, f64)> {
        let of = |p: &GoldenParameter| match p.site {
            Site::Mdh(joint, _) if p.compliance => Some((joint.into(), p.table8 - p.nominal)),
            _ => None,
        };
        self.parameters.iter().filter_map(of).collect()
    }

    /// Parameters of Table 8.
    pub fn table8(&self) -> Vec<f64> {
        self.parameters.iter().map(|p| p.table8).collect()
    }
}

/// The folder of the goldens.
pub fn folder() -> PathBuf {
    oracles::folder().join("golden")
}

/// One golden file.
pub fn read(name: &str) -> Value {
    let path = folder().join(name);
    let text = std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    serde_json::from_str(&text).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

/// A list of numbers.
pub fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect()
}

/// A list of lists of numbers.
pub fn rows(value: &Value) -> Vec<Vec<f64>> {
    value.as_array().unwrap().iter().map(numbers).collect()
}

fn vector(value: &Value) -> Vector3<f64> {
    Vector3::from_column_slice(&numbers(value))
}

fn frame(value: &Value) -> FramePose {
    let xyz = vector(&value["xyz_mm"]) * MM;
    let angles = vector(&value["alpha_beta_gamma_deg"]) * DEG;
    FramePose { xyz: xyz.into(), rz_ry_rx: angles.into() }
}

/// The golden model.
pub fn golden_model() -> GoldenModel {
    let model = read("model.json");
    let number = |v: &Value| v.as_f64().unwrap();
    let mut links: Vec<Link> = model["mdh_nominal"]
        .as_array()
        .unwrap()
        .iter()
        .zip(rows(&model["joint_limits_deg"]))
        .map(|(line, limits)| Link {
            mdh: MdhLink {
                alpha: number(&line["alpha_prev_deg"]) * DEG,
                a: number(&line["a_prev_mm"]) * MM,
                beta: number(&line["beta_prev_deg"]) * DEG,
                theta: number(&line["theta_offs_deg"]) * DEG,
                d: number(&line["d_mm"]) * MM,
                ..MdhLink::default()
            },
            limits: [limits[0] * DEG, limits[1] * DEG],
            mass: 0.0,
            com: Vector3::zeros(),
        })
        .collect();
    let mut payload = Payload::none();
    for body in model["inertial"]["links"].as_array().unwrap() {
        let (mass, com) = (number(&body["mass_kg"]), vector(&body["com_m"]));
        if body.get("name").is_some() {
            payload = Payload { name: "TriCal".into(), mass, com };
        } else {
            let link = &mut links[body["frame"].as_u64().unwrap() as usize - 1];
            (link.mass, link.com) = (mass, com);
        }
    }
    let site = |kind: &str, joint: usize| match kind {
        "alpha" => Site::mdh(joint - 1, MdhEntry::Alpha),
        "a" => Site::mdh(joint - 1, MdhEntry::A),
        "beta" => Site::mdh(joint - 1, MdhEntry::Beta),
        "theta" | "c" => Site::mdh(joint - 1, MdhEntry::Theta),
        "d" => Site::mdh(joint - 1, MdhEntry::D),
        base => Site::Base(Axis6::ALL.into_iter().find(|axis| base == format!("base_{}", axis.name())).unwrap()),
    };
    let parameters = model["params"]
        .as_array()
        .unwrap()
        .iter()
        .map(|p| {
            let kind = p["kind"].as_str().unwrap();
            GoldenParameter {
                name: p["name"].as_str().unwrap().into(),
                site: site(kind, p["joint"].as_u64().unwrap() as usize),
                compliance: kind == "c",
                nominal: number(&p["nominal_si"]),
                table8: number(&p["identified_table8_si"]),
            }
        })
        .collect();
    GoldenModel {
        robot: Robot { name: "golden".into(), source: "model.json of the golden numbers".into(), links, ..Robot::default() },
        base: frame(&model["base_nominal"]),
        tool: frame(&model["tool"]),
        payload,
        gravity: vector(&model["gravity_world_m_s2"]),
        balls: rows(&model["balls_world_mm"]).iter().map(|b| Vector3::from_column_slice(b) * MM).collect(),
        parameters,
    }
}
