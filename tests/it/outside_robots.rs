//! Robots with a hidden error that the catalogue does not hold, from a generator that shares no code with it.

use std::sync::Arc;

use calibench::diagnosis::{Verdict, diagnose};
use calibench::effects::EffectId;
use calibench::identify::problem::Use;
use calibench::identify::{Model, identify};
use calibench::measure::dataset::{Dataset, Measured, NamedDataset, Noise, Sample, SampleSet};
use calibench::nalgebra::{UnitQuaternion, Vector3};
use calibench::prediction::WorkspacePoses;
use calibench::robot::kinematics::world_from_tool;
use calibench::robot::{FramePose, Robot, built_in};
use calibench::selection::hold_out::HoldOut;
use calibench::selection::ladder::{LadderStep, ladder};
use calibench::selection::recommend::ChoiceKind;
use calibench::selection::{Advice, ToDo};
use calibench::units::{MM, UM, URAD};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// One-sigma of the instrument per axis, m.
const NOISE: f64 = 10.0 * UM;

/// What is hidden.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Class {
    /// Nothing.
    Clean,
    /// A joint errs with the angle of another joint.
    OtherAngle,
    /// A joint errs with two angles at once.
    TwoAngles,
    /// A joint errs with the product of sines of two angles.
    Product,
    /// A joint errs with the inclination of the forearm, as under a load.
    Load,
    /// The tool rocks in its changer to the side that gravity pulls.
    RockingTool,
    /// Base and instrument wander apart, as a random walk.
    Wandering,
    /// A hose follows a joint with play, and pulls at it by where it lies.
    Memory,
    /// A joint errs with the sum of two angles, as where a parallelogram drives it.
    Parallelogram,
    /// Nothing, but the noise is twice as stated.
    Noisy,
}

impl Class {
    pub const ALL: [Class; 10] = [
        Class::Clean,
        Class::OtherAngle,
        Class::TwoAngles,
        Class::Product,
        Class::Load,
        Class::RockingTool,
        Class::Wandering,
        Class::Memory,
        Class::Parallelogram,
        Class::Noisy,
    ];
}

/// What is hidden at a posture.
struct Error {
    /// Angles that the joints turn too far, rad.
    turned: Vec<f64>,
    /// Displacement of the tool in its axes, m.
    of_tool: Vector3<f64>,
    /// Displacement of everything in the room, m.
    of_room: Vector3<f64>,
}

/// The hidden error at one posture after the other, with the direction of gravity in the tool's axes.
type Hidden = Box<dyn FnMut(&[f64], Vector3<f64>) -> Error>;

fn normal(rng: &mut ChaCha8Rng) -> f64 {
    StandardNormal.sample(rng)
}

/// A smooth function of an angle with random waves.
fn waves(rng: &mut ChaCha8Rng) -> impl Fn(f64) -> f64 + use<> {
    let terms: Vec<(f64, f64)> =
        (1..=3).map(|k| (normal(rng) / f64::from(k), rng.random_range(0.0..std::f64::consts::TAU))).collect();
    let size = terms.iter().map(|(a, _)| a * a / 2.0).sum::<f64>().sqrt();
    move |x| terms.iter().enumerate().map(|(k, (a, phase))| a * ((k + 1) as f64 * x + phase).sin()).sum::<f64>() / size
}

fn hidden(class: Class, rng: &mut ChaCha8Rng) -> Hidden {
    // The first joint hides in the base, the last hardly moves the tool.
    let joint = rng.random_range(1..5);
    let mut others: Vec<usize> = (0..5).filter(|&j| j != joint).collect();
    let v = others.remove(rng.random_range(0..others.len()));
    let w = others.remove(rng.random_range(0..others.len()));
    let size = rng.random_range(80.0..250.0) * URAD;
    let none = || Error { turned: vec![0.0; 6], of_tool: Vector3::zeros(), of_room: Vector3::zeros() };
    let turned = move |f: f64| {
        let mut error = none();
        error.turned[joint] = size * f;
        error
    };
    match class {
        Class::Clean | Class::Noisy => Box::new(move |_, _| none()),
        Class::OtherAngle => {
            let f = waves(rng);
            Box::new(move |q, _| turned(f(q[v])))
        }
        Class::TwoAngles => {
            let (centre, width) = ([rng.random_range(-1.0..1.0), rng.random_range(-1.0..1.0)], rng.random_range(0.6..1.1));
            let (f, g) = (waves(rng), waves(rng));
            match rng.random_range(0..3) {
                0 => Box::new(move |q, _| {
                    let r = [(q[v] - centre[0]) / width, (q[w] - centre[1]) / width];
                    turned(3.0 * (-0.5 * (r[0] * r[0] + r[1] * r[1])).exp())
                }),
                1 => Box::new(move |q, _| turned(1.4 * (q[v] + q[w] + centre[0]).sin())),
                _ => Box::new(move |q, _| turned(f(0.7 * q[v]) * g(0.7 * q[w]))),
            }
        }
        Class::Product => {
            let phases = [rng.random_range(0.0..6.0), rng.random_range(0.0..6.0)];
            Box::new(move |q, _| turned(2.0 * (q[v] + phases[0]).sin() * (q[w] + phases[1]).sin()))
        }
        Class::Load => {
            let bend = rng.random_range(1.0..3.0);
            Box::new(move |q, _| turned(1.5 * (bend * (q[1] + q[2]).cos()).tanh() * (1.0 + 0.5 * q[1].cos())))
        }
        Class::RockingTool => {
            let reach = rng.random_range(0.05..0.15) * MM;
            let sharp = rng.random_range(1.0..5.0);
            Box::new(move |_, down| Error {
                of_tool: Vector3::new((sharp * down.x).tanh(), (sharp * down.y).tanh(), 0.0) * reach,
                ..none()
            })
        }
        Class::Wandering => {
            let step = rng.random_range(0.005..0.02) * MM;
            let mut walk = ChaCha8Rng::seed_from_u64(rng.random());
            let mut at = Vector3::zeros();
            Box::new(move |_, _| {
                at += Vector3::from_fn(|_, _| step * normal(&mut walk));
                Error { of_room: at, ..none() }
            })
        }
        Class::Memory => {
            let play = rng.random_range(0.3..0.8);
            let mut hose = 0.0f64;
            Box::new(move |q, _| {
                hose = hose.clamp(q[v] - play, q[v] + play);
                turned(1.5 * (q[v] - hose) / play)
            })
        }
        Class::Parallelogram => {
            let phase = rng.random_range(0.0..6.0);
            Box::new(move |q, _| {
                let mut error = none();
                error.turned[2] = 1.4 * size * (q[1] + q[2] + phase).sin();
                error
            })
        }
    }
}

/// A robot, measured.
pub struct Outside {
    /// As it is measured.
    pub dataset: Dataset,
    /// The same data with the hidden error taken from them: who knows it fits no more than the geometry.
    pub known: Dataset,
}

impl Outside {
    pub fn new(class: Class, seed: u64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let robot = built_in(["kr6_r700", "ur5", "ur10"][(seed % 3) as usize]).expect("built in");
        let truly = off_nominal(&robot, &mut rng);
        let mut hidden = hidden(class, &mut rng);
        let (base, tool) = (FramePose::default(), FramePose { xyz: [0.05, 0.02, 0.15], rz_ry_rx: [0.0; 3] });
        let noise = if class == Class::Noisy { 2.0 * NOISE } else { NOISE };
        let mut samples = Vec::new();
        let mut known = Vec::new();
        for k in 0..180 {
            let q: Vec<f64> =
                robot.links.iter().map(|l| rng.random_range(l.limits[0].max(-2.6)..l.limits[1].min(2.6))).collect();
            let frame = FramePose::default();
            let down: Vector3<f64> =
                UnitQuaternion::from(world_from_tool(&robot, &frame, &frame, &q).rotation).inverse() * Vector3::z();
            let error = hidden(&q, down);
            let jitter = Vector3::from_fn(|_, _| noise * normal(&mut rng));
            let at = |q: &[f64], displaced: Vector3<f64>| {
                let pose = world_from_tool(&truly, &base, &tool, q);
                pose.translation.vector + pose.rotation * displaced + jitter
            };
            let bent: Vec<f64> = q.iter().zip(&error.turned).map(|(q, t)| q + t).collect();
            // What changes with time is judged at the same time as it is fitted.
            let of_session = class == Class::Wandering;
            let is_fitted = if of_session { k < 160 && k % 2 == 0 } else { k < 80 };
            let set = if is_fitted { SampleSet::Fit } else { SampleSet::Validation };
            let time_s = of_session.then_some(30.0 * f64::from(k));
            let sample = |point| Sample { set, time_s, ..Sample::new(format!("p{k}"), q.clone(), Measured::Point(point)) };
            samples.push(sample(at(&bent, error.of_tool) + error.of_room));
            known.push(sample(at(&q, Vector3::zeros())));
        }
        let noise = Noise { point: Some(NOISE), ..Noise::default() };
        let dataset = Dataset { robot: Arc::new(robot), base, tool, noise, samples, ..Dataset::default() };
        Outside { known: Dataset { samples: known, ..dataset.clone() }, dataset }
    }
}

/// The robot as it was built: lengths and angles a little off.
fn off_nominal(robot: &Robot, rng: &mut ChaCha8Rng) -> Robot {
    let mut truly = robot.clone();
    for link in &mut truly.links {
        link.mdh.a += 0.3 * MM * normal(rng);
        link.mdh.d += 0.3 * MM * normal(rng);
        link.mdh.alpha += 300.0 * URAD * normal(rng);
        link.mdh.theta += 500.0 * URAD * normal(rng);
    }
    truly
}

/// The verdict on the first model.
pub fn verdict_on(class: Class, seed: u64) -> Verdict {
    let outside = Outside::new(class, seed);
    let named = [NamedDataset::new("robot", &outside.dataset)];
    diagnose(&named, &Model::default_for(&outside.dataset)).expect("a diagnosis").verdict
}

/// The end of a ladder.
#[derive(Debug)]
pub struct Climbed {
    /// Rms error at rows that were not fitted, m: of the first model, of what is recommended, and of who knows.
    pub before: f64,
    pub measured: f64,
    pub oracle: f64,
    pub verdict: Verdict,
    pub first_step: Vec<EffectId>,
    pub advised: Vec<EffectId>,
    pub steps: Vec<Vec<EffectId>>,
    /// The first model's residual is said to be noise, though its error at other rows is larger by a tenth than that of who knows.
    pub physics_called_noise: bool,
    /// The advice on the recommended model, as whoever diagnoses it gets it, and as the ladder that recommends it ends.
    pub after: [ToDo; 2],
    /// The last step's residual is noise, and a larger model is recommended.
    pub overruled: bool,
}

impl Climbed {
    /// True if the advice on the recommended model is to add nothing, from wherever it comes.
    pub fn is_an_end(&self) -> bool {
        let [diagnosed, climbed] = self.after;
        diagnosed == climbed && matches!(diagnosed, ToDo::Nothing | ToDo::Stop | ToDo::Distinguish)
    }
}

pub fn climbed(class: Class, seed: u64) -> Climbed {
    let outside = Outside::new(class, seed);
    let named = [NamedDataset::new("robot", &outside.dataset)];
    let model = Model::default_for(&outside.dataset);
    let poses = WorkspacePoses::of(&named);
    let ground = HoldOut { poses: &poses, checks: &[], worker: None };
    let ladder = ladder(&named, &model, ground).expect("a ladder");
    let rms = |step: &LadderStep| step.validation.as_ref().expect("rows of set validation").rms / MM;
    let advice = Advice::on(&named, ladder.first(), ground).expect("an advice");
    let known = [NamedDataset::new("robot", &outside.known)];
    let known_fit = identify(&known, &model).expect("a fit").predict(&known, Use::Validation).expect("a prediction");
    let squares: f64 = known_fit.residuals.iter().map(|r| r.norm_squared()).sum::<f64>() / known_fit.residuals.len() as f64;
    let oracle = squares.sqrt() / MM;
    let before = rms(ladder.first());
    Climbed {
        before,
        measured: rms(ladder.recommended()),
        oracle,
        verdict: ladder.first().diagnosis.verdict,
        first_step: ladder.steps.get(1).or(ladder.other.as_ref()).map(|s| s.added.clone()).unwrap_or_default(),
        advised: advice.effects().to_vec(),
        steps: ladder.steps[1..].iter().map(|s| s.added.clone()).collect(),
        after: [Advice::on(&named, ladder.recommended(), ground).expect("an advice"), Advice::after(&ladder)].map(|a| a.to_do),
        physics_called_noise: ladder.first().diagnosis.verdict.is_noise() && before > 1.1 * oracle,
        overruled: ladder.last().diagnosis.verdict.is_noise()
            && !matches!(ladder.kind(), ChoiceKind::Steps | ChoiceKind::Begin),
    }
}
