//! Forty hidden laws, from a generator that shares no code with the search or with the catalogue of effects.

use std::f64::consts::TAU;
use std::sync::Arc;

use calibench::measure::dataset::{Dataset, Measured, Noise, Sample, SampleSet};
use calibench::nalgebra::{UnitQuaternion, Vector3};
use calibench::robot::kinematics::{Posture, world_from_tool};
use calibench::robot::sites::SiteIndex;
use calibench::robot::{FramePose, Robot, built_in};
use calibench::units::{MM, UM, URAD};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// One-sigma of the instrument per axis, m.
pub const NOISE: f64 = 10.0 * UM;

/// Postures that are fitted, and those that judge.
const FITTED: usize = 80;
const JUDGING: usize = 100;

/// Where an error arises.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Place {
    Joint(usize),
    Tool,
    Base,
}

/// What is known at a posture.
pub struct At<'a> {
    pub q: &'a [f64],
    /// Loads on the joints by gravity, as a share of the largest on each.
    pub load: &'a [f64],
    /// Direction of gravity in the axes of the flange.
    pub down: Vector3<f64>,
    /// Direction from which each joint came.
    pub came: &'a [f64],
    /// Where hoses lie that follow their joints with play.
    pub hose: &'a [f64],
    /// Hours since the session began.
    pub hours: f64,
    /// Temperature above 20 degC.
    pub warm: f64,
}

type Size = Box<dyn Fn(&At<'_>) -> f64>;

/// A hidden law: a place, the variables that it follows (as in expressions), and its size, about one.
pub struct Law {
    pub name: &'static str,
    pub place: Place,
    pub follows: Vec<String>,
    /// The effect of the catalogue that it is, if it is one.
    pub listed: Option<String>,
    /// Size of the error, of rms one or so.
    size: Size,
    /// Axis of the tool or of the world along which it shifts.
    axis: Vector3<f64>,
}

fn normal(rng: &mut ChaCha8Rng) -> f64 {
    StandardNormal.sample(rng)
}

/// The laws, by number.
pub const LAWS: usize = 40;

/// Half the play of a hose, rad.
const PLAY: f64 = 0.5;

impl Law {
    /// The law of this number, with joints and constants drawn from `rng`.
    #[allow(clippy::too_many_lines)] // a list
    pub fn number(number: usize, rng: &mut ChaCha8Rng) -> Law {
        // The first joint hides in the base, the last hardly moves the tool.
        let j = rng.random_range(1..5);
        let mut others: Vec<usize> = (0..5).filter(|&k| k != j).collect();
        let v = others.remove(rng.random_range(0..others.len()));
        let w = others.remove(rng.random_range(0..others.len()));
        let l = rng.random_range(1..3);
        let (p, r) = (rng.random_range(0.0..TAU), rng.random_range(0.0..TAU));
        let order = f64::from(rng.random_range(5u8..20));
        let sharp = rng.random_range(2.0..6.0);
        let axis = if rng.random::<bool>() { Vector3::x() } else { Vector3::y() };
        let along = if axis.x > 0.0 { "down_x" } else { "down_y" };
        let q = |k: usize| format!("q{}", k + 1);
        let tau = |k: usize| format!("tau{}", k + 1);
        let came = |k: usize| format!("approach{}", k + 1);
        let down = along.to_owned();
        let of_joint =
            |name, follows: Vec<String>, size: Size| Law { name, place: Place::Joint(j), follows, listed: None, size, axis };
        let of_load =
            |name, follows: Vec<String>, size: Size| Law { name, place: Place::Joint(l), follows, listed: None, size, axis };
        let of_tool =
            |name, follows: Vec<String>, size: Size| Law { name, place: Place::Tool, follows, listed: None, size, axis };
        let of_base =
            |name, follows: Vec<String>, size: Size| Law { name, place: Place::Base, follows, listed: None, size, axis };
        let g = move |at: &At<'_>| at.down.dot(&axis);
        match number {
            0 => of_joint("sine of another angle", vec![q(v)], Box::new(move |a| 1.4 * (a.q[v] + p).sin())),
            1 => of_joint("twice the sine of another angle", vec![q(v)], Box::new(move |a| 1.4 * (2.0 * a.q[v] + p).sin())),
            2 => of_joint("proportional to another angle", vec![q(v)], Box::new(move |a| 0.8 * a.q[v])),
            3 => of_joint("square of another angle", vec![q(v)], Box::new(move |a| 0.5 * a.q[v] * a.q[v])),
            4 => of_joint("kink of another angle", vec![q(v)], Box::new(move |a| a.q[v].abs())),
            5 => of_joint("step of another angle", vec![q(v)], Box::new(move |a| (4.0 * a.q[v]).tanh())),
            6 => of_joint(
                "waves of another angle",
                vec![q(v)],
                Box::new(move |a| (a.q[v] + p).sin() + 0.7 * (2.0 * a.q[v] + r).sin()),
            ),
            7 => of_joint("sine of a sum", vec![q(v), q(w)], Box::new(move |a| 1.4 * (a.q[v] + a.q[w] + p).sin())),
            8 => of_joint("sine of a difference", vec![q(v), q(w)], Box::new(move |a| 1.4 * (a.q[v] - a.q[w] + p).sin())),
            9 => of_joint("product of sines", vec![q(v), q(w)], Box::new(move |a| 2.0 * a.q[v].sin() * a.q[w].sin())),
            10 => {
                of_joint("product of sine and cosine", vec![q(v), q(w)], Box::new(move |a| 2.0 * a.q[v].sin() * a.q[w].cos()))
            }
            11 => {
                of_joint("product of waves", vec![q(v), q(w)], Box::new(move |a| 2.0 * (a.q[v] + p).sin() * (a.q[w] + r).sin()))
            }
            12 => of_joint("product of angles", vec![q(v), q(w)], Box::new(move |a| 0.6 * a.q[v] * a.q[w])),
            13 => of_joint("wave times angle", vec![q(v), q(w)], Box::new(move |a| (a.q[v] + p).sin() * a.q[w])),
            14 => of_joint("own angle times another", vec![q(j), q(v)], Box::new(move |a| 2.0 * a.q[j].sin() * a.q[v].sin())),
            15 => of_load("saturating spring", vec![tau(l)], Box::new(move |a| (sharp * a.load[l]).tanh())),
            16 => of_load("hardening spring", vec![tau(l)], Box::new(move |a| 2.0 * a.load[l] * a.load[l].abs())),
            17 => of_load("one-sided spring", vec![tau(l)], Box::new(move |a| 3.0 * a.load[l].max(0.0))),
            18 => of_load("backlash that the load closes", vec![tau(l)], Box::new(move |a| a.load[l].signum())),
            19 => of_load(
                "dead zone",
                vec![tau(l)],
                Box::new(move |a| 3.0 * (a.load[l].abs() - 0.3).max(0.0) * a.load[l].signum()),
            ),
            20 => Law {
                listed: Some(if j == 2 { "joint_compliance".into() } else { format!("cross_compliance:{}:3", j + 1) }),
                ..of_joint("load of another joint", vec![tau(2)], Box::new(move |a| 3.0 * a.load[2]))
            },
            21 => of_load(
                "spring that the angle weakens",
                vec![tau(l), q(l)],
                Box::new(move |a| 3.0 * a.load[l] * (a.q[l] + p).sin()),
            ),
            22 => Law {
                listed: Some(format!("hose_drag:{}:{}", j + 1, v + 1)),
                ..of_joint(
                    "hose with play",
                    vec![format!("hose{}", v + 1)],
                    Box::new(move |a| 1.4 * (a.q[v] - a.hose[v]) / PLAY),
                )
            },
            23 => of_joint(
                "square of a hose with play",
                vec![format!("hose{}", v + 1)],
                Box::new(move |a| 2.0 * ((a.q[v] - a.hose[v]) / PLAY).powi(2)),
            ),
            24 => of_joint(
                "hose that pulls where another joint lets it",
                vec![format!("hose{}", v + 1), q(w)],
                Box::new(move |a| 2.0 * (a.q[v] - a.hose[v]) / PLAY * a.q[w].cos()),
            ),
            25 => of_tool("rocking tool", vec![down], Box::new(move |a| (sharp * g(a)).tanh())),
            26 => Law {
                listed: Some("tool_bending".into()),
                ..of_tool("bending tool", vec![down], Box::new(move |a| 1.7 * g(a)))
            },
            27 => of_tool("tool that falls to either side", vec![down], Box::new(move |a| g(a).signum())),
            28 => of_tool("tool that gives way one way", vec![down], Box::new(move |a| 2.0 * g(a).abs())),
            29 => of_tool("tool that a hose pulls", vec![q(4)], Box::new(move |a| 1.4 * (a.q[4] + p).sin())),
            30 => of_load(
                "ripple under load",
                vec![q(l), tau(l)],
                Box::new(move |a| 3.0 * a.load[l] * (order * a.q[l] + p).sin()),
            ),
            31 => of_load(
                "ripple that any load makes",
                vec![q(l), tau(l)],
                Box::new(move |a| 3.0 * a.load[l].abs() * (order * a.q[l] + p).sin()),
            ),
            32 => of_joint(
                "ripple that another angle opens",
                vec![q(j), q(v)],
                Box::new(move |a| 2.0 * (order * a.q[j] + p).sin() * a.q[v].cos()),
            ),
            33 => of_joint("warming joint", vec!["temp_c".into(), "time_s".into()], Box::new(move |a| a.warm / 6.0)),
            34 => of_joint(
                "warming joint by its angle",
                vec!["temp_c".into(), "time_s".into(), q(v)],
                Box::new(move |a| a.warm / 4.0 * (a.q[v] + p).sin()),
            ),
            35 => of_base(
                "settling base",
                vec!["time_s".into(), "temp_c".into()],
                Box::new(move |a| 3.0 * (-6.0 * a.hours).exp()),
            ),
            36 => of_joint("lost motion by another joint", vec![came(v)], Box::new(move |a| a.came[v])),
            37 => {
                of_load("lost motion under load", vec![came(l), tau(l)], Box::new(move |a| 3.0 * a.came[l] * a.load[l].abs()))
            }
            38 => of_joint(
                "lost motion that an angle opens",
                vec![came(j), q(v)],
                Box::new(move |a| 1.4 * a.came[j] * (a.q[v] + p).sin()),
            ),
            _ => of_joint(
                "three angles",
                vec![q(v), q(w), q(j)],
                Box::new(move |a| 2.8 * a.q[v].sin() * a.q[w].sin() * a.q[j].cos()),
            ),
        }
    }
}

/// A robot, measured.
pub struct Hidden {
    pub law: Option<Law>,
    /// As it is measured.
    pub dataset: Dataset,
    /// The same data with the hidden error taken from them: who knows it fits no more than the geometry.
    pub known: Dataset,
}

/// The noise of a robot without a law.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Without {
    /// White, as stated.
    White,
    /// Correlated from one sample to the next.
    Correlated,
    /// White, of an arm with effects of the catalogue: elastic joints, ripple of a gear.
    Ordinary,
    /// White, of an arm with many effects of the catalogue: eccentric gears of all joints, lost motion of one, elastic joints, a
    /// ripple.
    Many,
}

impl Hidden {
    /// A robot with the law of this number; `rms` is the size of the error of a joint, rad.
    pub fn law(number: usize, seed: u64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(1000 * seed + number as u64);
        let law = Law::number(number, &mut rng);
        Hidden::new(Some(law), Without::White, seed, rng)
    }

    /// A robot without a law.
    pub fn without(kind: Without, seed: u64) -> Self {
        Hidden::new(None, kind, seed, ChaCha8Rng::seed_from_u64(77_000_000 + seed))
    }

    fn new(law: Option<Law>, kind: Without, seed: u64, mut rng: ChaCha8Rng) -> Self {
        let robot = built_in(["kr6_r700", "ur5", "ur10"][(seed % 3) as usize]).expect("built in");
        let truly = off_nominal(&robot, &mut rng);
        let (base, tool) = (FramePose::default(), FramePose { xyz: [0.05, 0.02, 0.15], rz_ry_rx: [0.0; 3] });
        let size = rng.random_range(100.0..250.0) * URAD;
        let shift = rng.random_range(0.05..0.15) * MM;
        let springs: Vec<f64> = (0..6).map(|_| rng.random_range(50.0..400.0) * URAD).collect();
        let (ripple, ripple_of) = (rng.random_range(50.0..200.0) * URAD, rng.random_range(1..5));
        let order = f64::from(rng.random_range(1u8..30));
        let wave = |rng: &mut ChaCha8Rng| {
            [80.0 * URAD * normal(rng), rng.random_range(0.0..TAU), 40.0 * URAD * normal(rng), rng.random_range(0.0..TAU)]
        };
        let (lost, lost_of) = (rng.random_range(20.0..80.0) * URAD, rng.random_range(1..5));
        let eccentric: Vec<[f64; 4]> = (0..6).map(|_| wave(&mut rng)).collect();
        let (mut samples, mut known) = (Vec::new(), Vec::new());
        let mut before = vec![0.0; 6];
        let mut hose: Option<Vec<f64>> = None;
        let mut walk = Vector3::zeros();
        let postures: Vec<Vec<f64>> = (0..FITTED + JUDGING)
            .map(|_| robot.links.iter().map(|l| rng.random_range(l.limits[0].max(-2.6)..l.limits[1].min(2.6))).collect())
            .collect();
        let most = |j: usize| postures.iter().map(|q| loads(&robot, q)[j].abs()).fold(1e-9, f64::max);
        let largest: Vec<f64> = (0..6).map(most).collect();
        for (k, q) in postures.iter().enumerate() {
            let lies = hose.get_or_insert_with(|| q.clone());
            lies.iter_mut().zip(q).for_each(|(lies, q)| *lies = lies.clamp(q - PLAY, q + PLAY));
            let load: Vec<f64> = loads(&robot, q).iter().zip(&largest).map(|(t, l)| t / l).collect();
            let came: Vec<f64> = q.iter().zip(&before).map(|(q, b)| if q > b { 1.0 } else { -1.0 }).collect();
            let frame = FramePose::default();
            let down: Vector3<f64> =
                UnitQuaternion::from(world_from_tool(&robot, &frame, &frame, q).rotation).inverse() * -Vector3::z();
            let time_s = 30.0 * k as f64;
            let hours = time_s / 3600.0;
            let warm = 12.0 * (1.0 - (-3.0 * hours).exp()) + 0.3 * normal(&mut rng);
            let at = At { q, load: &load, down, came: &came, hose: lies, hours, warm };
            let e = law.as_ref().map_or(0.0, |law| (law.size)(&at));
            let (mut bent, mut of_tool, mut of_room) = (q.clone(), Vector3::zeros(), Vector3::zeros());
            match law.as_ref().map(|law| (law.place, law.axis)) {
                Some((Place::Joint(j), _)) => bent[j] += size * e,
                Some((Place::Tool, axis)) => of_tool = axis * (shift * e),
                Some((Place::Base, axis)) => of_room = axis * (shift * e),
                None => {}
            }
            if kind == Without::Many {
                let waves = bent.iter_mut().zip(q).zip(&eccentric);
                waves.for_each(|((b, q), [a, p, e, r])| *b += a * (q + p).sin() + e * (2.0 * q + r).sin());
                bent[lost_of] += lost * came[lost_of];
            }
            if matches!(kind, Without::Ordinary | Without::Many) {
                bent.iter_mut().zip(&springs).zip(&load).for_each(|((q, c), t)| *q += c * t);
                bent[ripple_of] += ripple * (order * q[ripple_of] + 1.0).sin();
            }
            let white = Vector3::from_fn(|_, _| NOISE * normal(&mut rng));
            walk = walk * 0.9 + white * 0.436;
            let jitter = if kind == Without::Correlated { walk } else { white };
            let place = |q: &[f64], displaced: Vector3<f64>| {
                let pose = world_from_tool(&truly, &base, &tool, q);
                pose.translation.vector + pose.rotation * displaced + jitter
            };
            let set = if k % 9 < 4 && samples.iter().filter(|s: &&Sample| s.set == SampleSet::Fit).count() < FITTED {
                SampleSet::Fit
            } else {
                SampleSet::Validation
            };
            let sample = |point| Sample {
                set,
                time_s: Some(time_s),
                temp_c: Some(20.0 + warm),
                approach: Some(came.iter().map(|c| *c as i8).collect()),
                ..Sample::new(format!("p{k}"), q.clone(), Measured::Point(point))
            };
            samples.push(sample(place(&bent, of_tool) + of_room));
            known.push(sample(place(q, Vector3::zeros())));
            before.clone_from(q);
        }
        let noise = Noise { point: Some(NOISE), ..Noise::default() };
        let dataset = Dataset { robot: Arc::new(robot), base, tool, noise, samples, ..Dataset::default() };
        Hidden { law, known: Dataset { samples: known, ..dataset.clone() }, dataset }
    }
}

/// The moments of gravity about the joints: how the height of the masses changes with each angle.
fn loads(robot: &Robot, q: &[f64]) -> Vec<f64> {
    let energy = |q: &[f64]| -> f64 {
        let (frame, zero) = (FramePose::default(), vec![0.0; SiteIndex::new(robot.joints()).len()]);
        let mut posture = Posture::new(robot);
        posture.set(robot, &frame, &frame, q, &zero);
        robot.links.iter().enumerate().map(|(k, link)| 9.80665 * link.mass * posture.frame(k + 1).point(&link.com).z).sum()
    };
    let step = 1e-5;
    (0..q.len())
        .map(|j| {
            let (mut up, mut down) = (q.to_vec(), q.to_vec());
            up[j] += step;
            down[j] -= step;
            -(energy(&up) - energy(&down)) / (2.0 * step)
        })
        .collect()
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
