//! The inputs of the benchmark works W1 to W6, and the pool of W3, on the model of the reference numbers.
//!
//! They are in `tests/data/golden`, whose README says what each file is.

#![allow(dead_code, clippy::unwrap_used)] // Each bench uses its part, and a bad reference file should stop it at once.

#[path = "../../tests/it/golden.rs"]
pub mod golden;
#[path = "../../tests/it/oracles.rs"]
pub mod oracles;
pub mod trial;

use std::sync::Arc;
use std::time::{Duration, Instant};

use calibench::identify::problem::Problem;
use calibench::identify::{Model, TorquePosture};
use calibench::measure::dataset::{Ball, Dataset, Measured, Noise, Sample};
use calibench::robot::Vectors;
use calibench::robot::kinematics::{BatchInput, Posture, Postures};
use calibench::robot::sites::{Site, SiteIndex};
use calibench::robot::statics::{Loads, LoadsBatch, Weights};
use golden::GoldenModel;
use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// A pose of a ball: which, by place, and the joints, rad.
#[derive(Debug, Clone, PartialEq)]
pub struct BallPose {
    /// Ball.
    pub ball: usize,
    /// Joints, rad.
    pub q: Vec<f64>,
}

fn table(name: &str) -> Vec<Vec<f64>> {
    let mut reader = csv::Reader::from_path(golden::folder().join("inputs").join(name)).unwrap();
    reader.records().map(|r| r.unwrap().iter().map(|x| x.parse().unwrap()).collect()).collect()
}

/// The poses of `w2_measured.csv` (W2) or `w3_pool.csv` (W3).
pub fn ball_poses(name: &str) -> Vec<BallPose> {
    table(name).into_iter().map(|row| BallPose { ball: row[0] as usize, q: row[1..].to_vec() }).collect()
}

/// The 80 starts of W4: a selection of W3.
pub fn centring_starts() -> Vec<BallPose> {
    table("w2_selection.csv").into_iter().map(|row| BallPose { ball: row[1] as usize, q: row[2..].to_vec() }).collect()
}

/// The 64 true parameter vectors of W4 (31 each, SI, in the order of the model's parameters).
pub fn truths() -> Vec<Vec<f64>> {
    table("w4_truth.csv")
}

/// The 500 validation configurations of W4, rad.
pub fn validation() -> Vec<Vec<f64>> {
    table("w4_validation.csv")
}

/// Random configurations inside the joint limits (W1, W5), rad.
pub fn random_configurations(model: &GoldenModel, count: usize) -> Vec<[f64; 6]> {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    (0..count)
        .map(|_| std::array::from_fn(|i| rng.random_range(model.robot.links[i].limits[0]..model.robot.links[i].limits[1])))
        .collect()
}

/// One-sigma by which the works weigh centrings, m. All weigh the same, so it changes no estimate.
pub const BALL_SIGMA: f64 = 1e-6;

/// A dataset of these ball poses, left-over readings not recorded, as if the robot stood there centred.
pub fn dataset(model: &GoldenModel, poses: &[BallPose]) -> Dataset {
    let centred = |(k, pose): (usize, &BallPose)| {
        Sample::new(k.to_string(), pose.q.clone(), Measured::Ball { ball: pose.ball, reading: None })
    };
    let ball = |(k, p): (usize, &Vector3<f64>)| Ball { id: (k + 1).to_string(), position: *p, sigma: 0.0, free: false };
    Dataset {
        robot: Arc::new(model.robot.clone()),
        robot_reference: "kr6_r700".into(),
        gravity: model.gravity,
        base: model.base,
        tool: model.tool,
        payloads: vec![model.payload.clone()],
        balls: model.balls.iter().enumerate().map(ball).collect(),
        noise: Noise { ball: Some(BALL_SIGMA), ..Noise::default() },
        samples: poses.iter().enumerate().map(centred).collect(),
        ..Dataset::default()
    }
}

/// The 80 centrings of W2.
pub fn centred(model: &GoldenModel) -> Dataset {
    dataset(model, &ball_poses("w2_measured.csv"))
}

/// The paper's model with the torques of the drawing's posture, as the works define them.
pub fn frozen_torques() -> Model {
    Model { torque_posture: TorquePosture::Drawn, ..Model::paper() }
}

/// The parameter of a problem that the reference calls `name`: `x_0W`, `alpha_0W`, `theta_offs_2`, `c_6`, `a_1`.
pub fn place_in(problem: &Problem, name: &str) -> usize {
    let base = [("x", "x"), ("y", "y"), ("z", "z"), ("alpha", "rz"), ("beta", "ry"), ("gamma", "rx")];
    let ours = match name.strip_suffix("_0W") {
        Some(kind) => format!("base_{}", base.iter().find(|(theirs, _)| *theirs == kind).unwrap().1),
        None => name.replace("_offs", "").replace('_', ""),
    };
    problem.parameters().iter().position(|p| p.name == ours).unwrap()
}

/// Prints the least time that one of many runs of `work` took, and what that is for each of `units`: what the machine can do, whatever
/// else runs on it.
pub fn print_least(name: &str, units: usize, mut work: impl FnMut()) {
    let (began, mut least) = (Instant::now(), Duration::MAX);
    while began.elapsed() < Duration::from_secs(1) {
        let run = Instant::now();
        work();
        least = least.min(run.elapsed());
    }
    println!("{name}: least {:.4} us", least.as_secs_f64() * 1e6 / units as f64);
}

/// Checks that an adjustment of W2 ended at the parameters (SI, in metres of TCP displacement per column) of independent programs.
pub fn check_identification(problem: &Problem, values: &[f64]) {
    let wanted = golden::read("identify_w2.json");
    let names: Vec<&str> = wanted["names"].as_array().unwrap().iter().map(|n| n.as_str().unwrap()).collect();
    for (name, wanted) in names.iter().zip(golden::numbers(&wanted["rho"])) {
        let k = place_in(problem, name);
        let found = problem.parameters()[k].start + values[k];
        let found = if name.starts_with("c_") { -found } else { found };
        assert!((found - wanted).abs() < SAME_MINIMUM, "{name}: {found} against {wanted}");
    }
}

/// The reference was converged to rounding.
const SAME_MINIMUM: f64 = 1e-9;

/// The nominal arm of the works, with room for one configuration.
pub struct Arm<'a> {
    model: &'a GoldenModel,
    /// The posture last set.
    pub posture: Posture,
    /// Its loads.
    pub loads: Loads,
    nominal: Vec<f64>,
    /// Site of each parameter, and the joint whose torque multiplies it.
    columns: Vec<(Site, Option<usize>)>,
}

impl<'a> Arm<'a> {
    /// The arm of the reference model.
    pub fn new(model: &'a GoldenModel) -> Self {
        let joints = model.robot.joints();
        let torque = |site| if let Site::Mdh(joint, _) = site { Some(usize::from(joint)) } else { None };
        let (mut posture, nominal) = (Posture::new(&model.robot), vec![0.0; SiteIndex::new(joints).len()]);
        posture.set(&model.robot, &model.base, &model.tool, &vec![0.0; joints], &nominal);
        Arm {
            model,
            posture,
            loads: Loads::new(joints),
            nominal,
            columns: model.parameters.iter().map(|p| (p.site, if p.compliance { torque(p.site) } else { None })).collect(),
        }
    }

    /// Poses and weighs the arm (W5; with [`Arm::columns`], W1).
    pub fn set(&mut self, q: &[f64]) {
        let m = self.model;
        self.posture.turn_to(&m.robot, q, &self.nominal);
        self.loads.compute(&m.robot, &self.posture, &m.payload, &m.gravity, &Vector3::zeros());
    }

    /// The 31 columns of the position Jacobian at the configuration last set.
    pub fn columns(&self, out: &mut [Vector3<f64>]) {
        for (out, (site, torque)) in out.iter_mut().zip(&self.columns) {
            let column = self.posture.column(*site);
            // The reference counts torque as holding the arm, `Loads` as the load's own.
            *out = torque.map_or(column, |joint| column * -self.loads.tau[joint]);
        }
    }
}

/// Configurations that are worked out at once.
pub const LANES: usize = 8;

/// Configurations side by side, rad: a register holds one joint of all of them.
#[derive(Clone, Copy)]
#[repr(align(64))]
pub struct BatchOfPostures([[f64; LANES]; 6]);

impl BatchOfPostures {
    /// Eight configurations.
    pub fn of(configurations: &[[f64; 6]; LANES]) -> Self {
        BatchOfPostures(std::array::from_fn(|joint| configurations.map(|q| q[joint])))
    }
}

/// Eight nominal arms of the works side by side.
pub struct Arms<'a> {
    model: &'a GoldenModel,
    /// The postures last set.
    pub postures: Postures<LANES>,
    /// Their loads.
    pub loads: LoadsBatch<LANES>,
    weights: Weights<LANES>,
    nominal: Vec<[f64; LANES]>,
    of_sites: Vec<Vectors<LANES>>,
    /// Columns of the compliances, in order.
    yielding: Vec<Vectors<LANES>>,
    /// Site of each parameter, and the joint whose torque multiplies it.
    columns: Vec<(usize, Option<usize>)>,
}

impl<'a> Arms<'a> {
    /// Arms of the reference model.
    pub fn new(model: &'a GoldenModel) -> Self {
        let sites = SiteIndex::new(6);
        let of = Arm::new(model).columns.into_iter().map(|(site, torque)| (sites.of(site), torque)).collect();
        let nominal = vec![[0.0; LANES]; sites.len()];
        let (base, tool) = (model.base.to_array().map(|x| [x; LANES]), model.tool.xyz.map(|x| [x; LANES]));
        let mut postures = Postures::new(&model.robot);
        postures.set_all(&model.robot, &BatchInput { base: &base, tool: &tool, q: &[[0.0; LANES]; 6], deviations: &nominal });
        Arms {
            model,
            postures,
            loads: LoadsBatch::new(6),
            weights: Weights::of(&model.payload, &model.gravity),
            nominal,
            of_sites: vec![Vectors::ZERO; sites.len()],
            yielding: vec![Vectors::ZERO; 6],
            columns: of,
        }
    }

    /// Poses and weighs them (W5; with [`Arms::find_columns`], W1).
    pub fn set(&mut self, BatchOfPostures(q): &BatchOfPostures) {
        let m = self.model;
        self.postures.turn_all(&m.robot, q, &self.nominal);
        self.loads.compute(&m.robot, &self.postures, &self.weights);
    }

    /// Finds the columns of their position Jacobians.
    pub fn find_columns(&mut self) {
        self.postures.columns(&mut self.of_sites);
        let yielding = self.columns.iter().filter_map(|(place, torque)| Some((place, (*torque)?)));
        for (column, (place, joint)) in self.yielding.iter_mut().zip(yielding) {
            *column = self.of_sites[*place];
            // The reference counts torque as holding the arm, the library as the load's own.
            for list in [&mut column.x, &mut column.y, &mut column.z] {
                list.iter_mut().zip(self.loads.tau(joint)).for_each(|(x, tau)| *x *= -tau);
            }
        }
    }

    /// One of the 31 columns, once they are found.
    pub fn column(&self, k: usize) -> &Vectors<LANES> {
        let (place, torque) = self.columns[k];
        let before = || self.columns[..k].iter().filter(|(_, torque)| torque.is_some()).count();
        if torque.is_some() { &self.yielding[before()] } else { &self.of_sites[place] }
    }
}

/// The golden numbers are kept to 1e-12; TCP in m, torque in N m, columns in m per SI unit up to 50.
const KINEMATICS_TOLERANCE: f64 = 1e-11;

/// Checks that pose and torque are those of the independent programs at their 200 configurations, the columns at the first 64.
pub fn check_kinematics(arm: &mut Arm<'_>) {
    let (poses, jacobians) = (golden::read("fk_torque_200.json"), golden::read("jac31_64.json"));
    let jacobians = golden::rows(&jacobians["nominal"]["J"]);
    assert_eq!(jacobians.len(), 64);
    let mut columns = [Vector3::zeros(); 31];
    for (k, q) in golden::rows(&poses["q"]).iter().enumerate() {
        arm.set(q);
        arm.columns(&mut columns);
        let pose = golden::numbers(&poses["pose_nominal_pinocchio"][k]);
        let torque = golden::numbers(&poses["tau_pinocchio"][k]);
        for r in 0..3 {
            assert!((arm.posture.tcp()[r] - pose[4 * r + 3]).abs() < KINEMATICS_TOLERANCE);
            if let Some(jacobian) = jacobians.get(k) {
                (0..31)
                    .for_each(|c| assert!((columns[c][r] - jacobian[31 * r + c]).abs() < KINEMATICS_TOLERANCE, "column {c}"));
            }
        }
        (0..6).for_each(|j| assert!((arm.loads.tau[j] + torque[j]).abs() < KINEMATICS_TOLERANCE, "torque {j}"));
    }
}

/// Checks that arms side by side are, bit by bit, what each is alone.
pub fn check_batch(model: &GoldenModel) {
    let (mut arm, mut arms) = (Arm::new(model), Arms::new(model));
    let mut alone = [Vector3::zeros(); 31];
    for configurations in random_configurations(model, 10 * LANES).as_chunks().0 {
        arms.set(&BatchOfPostures::of(configurations));
        arms.find_columns();
        for (lane, q) in configurations.iter().enumerate() {
            arm.set(q);
            arm.columns(&mut alone);
            let bits = |v: Vector3<f64>| [v.x, v.y, v.z].map(f64::to_bits);
            assert_eq!(bits(arms.postures.tcps().at(lane)), bits(arm.posture.tcp()));
            for (k, column) in alone.iter().enumerate() {
                assert_eq!(bits(arms.column(k).at(lane)), bits(*column), "column {k}");
            }
        }
    }
}

/// The candidates of W3: 5,000 blocks of 3 x 31 rows, row-major, and the ball of each.
pub fn pool(model: &GoldenModel) -> (Vec<f64>, Vec<usize>) {
    let poses = ball_poses("w3_pool.csv");
    let m = model.parameters.len();
    let mut arm = Arm::new(model);
    let mut columns = vec![Vector3::zeros(); m];
    let mut rows = vec![0.0; poses.len() * 3 * m];
    for (pose, rows) in poses.iter().zip(rows.chunks_exact_mut(3 * m)) {
        arm.set(&pose.q);
        arm.columns(&mut columns);
        for (k, column) in columns.iter().enumerate() {
            (0..3).for_each(|r| rows[r * m + k] = column[r]);
        }
    }
    (rows, poses.into_iter().map(|p| p.ball).collect())
}
