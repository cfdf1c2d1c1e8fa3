//! W4: one whole calibration, from the first reading to the validation, of a robot that differs from its drawing by known amounts.

use calibench::identify::Adjustment;
use calibench::identify::problem::{Problem, Use};
use calibench::measure::dataset::{Dataset, Measured, NamedDataset};
use calibench::robot::kinematics::{BatchInput, Posture, Postures};
use calibench::robot::rel_tool::RelTool;
use calibench::robot::sites::{MdhEntry, Site, SiteIndex};
use calibench::robot::statics::Loads;
use calibench::robot::{FramePose, Robot, Vectors};
use nalgebra::{Rotation3, Vector3};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::golden::GoldenModel;
use super::{LANES, centring_starts, dataset, frozen_torques, place_in, validation};

/// One-sigma of each joint after each motion, rad.
const JOINT_NOISE: f64 = 1e-6;
/// One-sigma of each reading, m.
const READING_NOISE: f64 = 0.6e-6;
/// A ball is centred when every reading is smaller, m.
const CENTRED: f64 = 3e-6;
/// Readings of a centring, at most.
const MOST_READINGS: usize = 12;
/// Newton steps of the controller's RelTool.
const NEWTON_STEPS: usize = 2;

/// Where an arm of given parameters stands: deviations that are the same in all postures, and compliances, rad/(N m) of the load.
struct TrueArm {
    fixed: Vec<f64>,
    compliance: Vec<f64>,
    deviations: Vec<f64>,
    posture: Posture,
    side_by_side: Vec<[f64; LANES]>,
    postures: Postures<LANES>,
}

/// Configurations side by side, and the load's torques at them.
struct Configurations {
    count: usize,
    q: [[f64; LANES]; 6],
    tau: [[f64; LANES]; 6],
}

impl TrueArm {
    fn new(model: &GoldenModel) -> Self {
        let sites = SiteIndex::new(model.robot.joints()).len();
        TrueArm {
            fixed: vec![0.0; sites],
            compliance: vec![0.0; model.robot.joints()],
            deviations: vec![0.0; sites],
            posture: Posture::new(&model.robot),
            side_by_side: vec![[0.0; LANES]; sites],
            postures: Postures::new(&model.robot),
        }
    }

    /// Gives it the parameters `values`: SI, absolute, in the order of the model.
    fn become_like(&mut self, model: &GoldenModel, values: impl Iterator<Item = f64>) {
        let sites = SiteIndex::new(model.robot.joints());
        for (p, value) in model.parameters.iter().zip(values) {
            match p.site {
                // The works count torque as holding the arm, the library as the load's own.
                Site::Mdh(joint, MdhEntry::Theta) if p.compliance => self.compliance[usize::from(joint)] = p.nominal - value,
                site => self.fixed[sites.of(site)] = value - p.nominal,
            }
        }
        self.deviations.copy_from_slice(&self.fixed);
        self.posture.set(&model.robot, &model.base, &model.tool, &[0.0; 6], &self.fixed);
        self.side_by_side.iter_mut().zip(&self.fixed).for_each(|(all, fixed)| *all = [*fixed; LANES]);
        let (base, tool) = (model.base.to_array().map(|x| [x; LANES]), model.tool.xyz.map(|x| [x; LANES]));
        let stances = BatchInput { base: &base, tool: &tool, q: &[[0.0; LANES]; 6], deviations: &self.side_by_side };
        self.postures.set_all(&model.robot, &stances);
    }

    /// Moves it to joints `q` (rad) under the load's torques `tau` (N m).
    fn stand(&mut self, model: &GoldenModel, q: &[f64], tau: &[f64]) {
        let sites = SiteIndex::new(q.len());
        for (joint, (c, tau)) in self.compliance.iter().zip(tau).enumerate() {
            let angle = sites.of(Site::mdh(joint, MdhEntry::Theta));
            self.deviations[angle] = self.fixed[angle] + c * tau;
        }
        self.posture.turn_to(&model.robot, q, &self.deviations);
    }

    /// World positions of its TCP at configurations side by side, m.
    fn tcps(&mut self, model: &GoldenModel, at: &Configurations) -> &Vectors<LANES> {
        let sites = SiteIndex::new(at.q.len());
        for (joint, (c, tau)) in self.compliance.iter().zip(&at.tau).enumerate() {
            let angle = sites.of(Site::mdh(joint, MdhEntry::Theta));
            let fixed = self.fixed[angle];
            self.side_by_side[angle].iter_mut().zip(tau).for_each(|(deviation, tau)| *deviation = fixed + c * tau);
        }
        self.postures.turn_all(&model.robot, &at.q, &self.side_by_side);
        self.postures.tcps()
    }
}

/// Errors by which a trial is judged.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Outcome {
    /// Mean distance between true and identified arm on the validation configurations, m.
    pub mean: f64,
    /// Largest of them, m.
    pub max: f64,
    /// Root mean square of the residual coordinates, m.
    pub residual: f64,
    /// Readings of three that a centring took, on average.
    pub readings: f64,
}

/// The procedure, with room for it; nothing is allocated in a trial.
pub struct Trial<'a> {
    model: &'a GoldenModel,
    starts: Vec<Vec<f64>>,
    /// Validation configurations and the load's torques at them, which no parameter changes.
    validation: Vec<Configurations>,
    validated: usize,
    dataset: Dataset,
    problem: Problem,
    adjustment: Adjustment,
    start: Vec<f64>,
    /// Place of each parameter of the model among the problem's.
    places: Vec<usize>,
    truth: TrueArm,
    found: TrueArm,
    drawn: Vec<f64>,
    posture: Posture,
    loads: Loads,
    rel_tool: RelTool,
    /// The drawing as the works' controller knows it, without limits: some starts are a tenth of a degree from one.
    unlimited: Robot,
    tool_turn: Rotation3<f64>,
    actual: Vec<f64>,
}

impl<'a> Trial<'a> {
    /// Lays the procedure out.
    pub fn new(model: &'a GoldenModel) -> Self {
        let starts = centring_starts();
        let dataset = dataset(model, &starts);
        let problem = Problem::new(&[NamedDataset::new("w4", &dataset)], &frozen_torques(), Use::Fit).unwrap();
        let start = problem.start();
        let all: Vec<usize> = (0..start.len()).collect();
        let joints = model.robot.joints();
        let mut unlimited = model.robot.clone();
        unlimited.links.iter_mut().for_each(|link| link.limits = [f64::NEG_INFINITY, f64::INFINITY]);
        let mut trial = Trial {
            model,
            starts: starts.into_iter().map(|s| s.q).collect(),
            validation: Vec::new(),
            validated: 0,
            adjustment: Adjustment::new(&problem, &start, &all).unwrap(),
            dataset,
            start,
            places: model.parameters.iter().map(|p| place_in(&problem, &p.name)).collect(),
            problem,
            truth: TrueArm::new(model),
            found: TrueArm::new(model),
            drawn: vec![0.0; SiteIndex::new(joints).len()],
            posture: Posture::new(&model.robot),
            loads: Loads::new(joints),
            rel_tool: RelTool::stopping_after(&model.robot, NEWTON_STEPS),
            unlimited,
            tool_turn: FramePose { xyz: [0.0; 3], ..model.tool }.pose().rotation,
            actual: vec![0.0; joints],
        };
        trial.posture.set(&model.robot, &model.base, &model.tool, &[0.0; 6], &trial.drawn);
        let validation = validation();
        trial.validated = validation.len();
        for few in validation.chunks(LANES) {
            let mut at = Configurations { count: few.len(), q: [[0.0; LANES]; 6], tau: [[0.0; LANES]; 6] };
            for (lane, q) in few.iter().enumerate() {
                trial.compute(q);
                for joint in 0..6 {
                    (at.q[joint][lane], at.tau[joint][lane]) = (q[joint], trial.loads.tau[joint]);
                }
            }
            trial.validation.push(at);
        }
        trial
    }

    /// Torques of the load on the nominal arm at commanded joints.
    fn compute(&mut self, q: &[f64]) {
        let m = self.model;
        self.posture.turn_to(&m.robot, q, &self.drawn);
        self.loads.compute(&m.robot, &self.posture, &m.payload, &m.gravity, &Vector3::zeros());
    }

    /// Centres the true arm on ball `ball` from joints `q`; returns the readings it took.
    fn centre(&mut self, ball: usize, q: &mut [f64], noise: &mut ChaCha8Rng) -> usize {
        let m = self.model;
        let mut normal = |sigma: f64| sigma * Distribution::<f64>::sample(&StandardNormal, noise);
        for readings in 1..=MOST_READINGS {
            self.compute(q);
            self.actual.iter_mut().zip(q.iter()).for_each(|(actual, q)| *actual = q + normal(JOINT_NOISE));
            self.truth.stand(m, &self.actual, &self.loads.tau);
            let off = self.truth.posture.flange().components(&(m.balls[ball] - self.truth.posture.tcp()));
            let reading = self.tool_turn.inverse() * off + Vector3::from_fn(|_, _| normal(READING_NOISE));
            if reading.amax() < CENTRED {
                return readings;
            }
            self.rel_tool.shift(&self.unlimited, &m.base, &m.tool, q, &reading).unwrap();
        }
        MOST_READINGS
    }

    /// Calibrates a robot of the parameters `truth` (SI, absolute, in the order of the model), with the noise of `seed`.
    pub fn run(&mut self, truth: &[f64], seed: u64) -> Outcome {
        let m = self.model;
        let mut noise = ChaCha8Rng::seed_from_u64(seed);
        self.truth.become_like(m, truth.iter().copied());
        let mut readings = 0;
        for k in 0..self.starts.len() {
            let mut q = std::mem::take(&mut self.dataset.samples[k].q);
            q.copy_from_slice(&self.starts[k]);
            let Measured::Ball { ball, .. } = self.dataset.samples[k].measured else { unreachable!("W4 probes balls") };
            readings += self.centre(ball, &mut q, &mut noise);
            self.dataset.samples[k].q = q;
        }
        self.problem.renew(&[&self.dataset.samples]).unwrap();
        self.adjustment.adjust(&self.problem, &self.start).unwrap();
        let (values, parameters) = (self.adjustment.values(), self.problem.parameters());
        let found = m.parameters.iter().zip(&self.places).map(|(p, &k)| {
            let value = parameters[k].start + values[k];
            if p.compliance { -value } else { value }
        });
        self.found.become_like(m, found);
        let mut outcome = Outcome {
            residual: (self.adjustment.chi2() / self.problem.row_count() as f64).sqrt() * super::BALL_SIGMA,
            readings: readings as f64 / self.starts.len() as f64,
            ..Outcome::default()
        };
        for at in &self.validation {
            let (truth, found) = (self.truth.tcps(m, at), self.found.tcps(m, at));
            for lane in 0..at.count {
                let error = (truth.at(lane) - found.at(lane)).norm();
                outcome.mean += error / self.validated as f64;
                outcome.max = outcome.max.max(error);
            }
        }
        outcome
    }
}

/// Averages over trials of different robots, and the standard errors of the averages.
pub fn averages(outcomes: &[Outcome]) -> [(f64, f64); 4] {
    let of: [fn(&Outcome) -> f64; 4] = [|o| o.mean, |o| o.max, |o| o.residual, |o| o.readings];
    of.map(|of| {
        let n = outcomes.len() as f64;
        let mean = outcomes.iter().map(of).sum::<f64>() / n;
        let variance = outcomes.iter().map(|o| (of(o) - mean).powi(2)).sum::<f64>() / (n - 1.0);
        (mean, (variance / n).sqrt())
    })
}

/// Averages over 1,000 robots, the first 64 of which are here, by an independent program with its own noise: mean and largest error,
/// residual (m), readings.
const REFERENCE: [f64; 4] = [1.090e-6, 2.547e-6, 0.807e-6, 2.984];

/// Half of the last figure that the reference gives.
const REFERENCE_ROUNDING: [f64; 4] = [0.5e-9, 0.5e-9, 0.5e-9, 0.5e-3];

/// Trials of the reference.
const REFERENCE_TRIALS: f64 = 1000.0;

/// Standard errors allowed: four averages leave it by chance once in 35,000 runs of fresh noise.
const ALLOWED: f64 = 4.5;

/// Checks that the averages of trials are those of the reference, which has sampling errors of its own.
pub fn check(outcomes: &[Outcome]) {
    for (((average, error), wanted), rounding) in averages(outcomes).into_iter().zip(REFERENCE).zip(REFERENCE_ROUNDING) {
        let both = error * (1.0 + outcomes.len() as f64 / REFERENCE_TRIALS).sqrt();
        assert!((average - wanted).abs() < ALLOWED * both + rounding, "{average} against {wanted}, standard error {both}");
    }
}
