//! An arm that moves while an instrument sees its tool: what the joints' driver and the instrument record, and what is true of it.
//!
//! The arm has errors of its lengths and zeros, joints that yield to weight and to inertia, gears that are out of round, and lost motion;
//! the driver's stamps jitter and some are lost; the instrument has a clock of its own, a filter, jitter and noise.

use std::f64::consts::{PI, TAU};

use calibench::measure::dataset::{Dataset, Measured, Sample, SampleSet};
use calibench::nalgebra::Vector3;
use calibench::robot::kinematics::world_from_tool;
use calibench::robot::{FramePose, Robot};
use calibench_logs::{JointTrack, Log, Track};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};

/// What is recorded, and how.
#[derive(Debug, Clone)]
pub struct Campaign {
    pub seconds: f64,
    /// Readings a second of the joints, and of the instrument.
    pub rates: [f64; 2],
    /// One-sigma of each stamp, s.
    pub jitter: f64,
    /// Share of the readings that are lost.
    pub lost: f64,
    /// Time constant of the instrument's filter of first order, s.
    pub filter: f64,
    /// One-sigma of a reading of the instrument, m.
    pub noise: f64,
    /// Delay of each joint behind what the driver states, s.
    pub late: [f64; 6],
    /// How fast the arm swings; the first joint once in half a minute at one.
    pub speed: f64,
    /// Mass at the flange that loads the joints, kg.
    pub mass: f64,
    /// Lost motion of each joint, rad.
    pub play: f64,
    /// True if it goes from pose to pose, and does not sway.
    pub by_poses: bool,
}

impl Default for Campaign {
    fn default() -> Self {
        Campaign {
            seconds: 60.0,
            rates: [125.0, 100.0],
            jitter: 2e-4,
            lost: 0.02,
            filter: 6e-3,
            noise: 20e-6,
            late: [0.0; 6],
            speed: 2.0,
            mass: 4.0,
            play: 30e-6,
            by_poses: false,
        }
    }
}

/// A robot unlike its drawing, in its cell.
pub struct Truth {
    drawn: Robot,
    arm: Robot,
    base: FramePose,
    tool: FramePose,
    compliance: [f64; 6],
    eccentric: [[f64; 2]; 6],
    /// Amplitude, frequency and phase of each joint's two swings about its middle.
    swings: Vec<[[f64; 3]; 3]>,
    middle: Vec<f64>,
    postures: Vec<Vec<f64>>,
    random: ChaCha8Rng,
}

impl Truth {
    pub fn of(drawn: &Robot, seed: u64) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let normal = Normal::new(0.0, 1.0).unwrap();
        let mut arm = drawn.clone();
        for link in &mut arm.links {
            link.mdh.a += 0.3e-3 * normal.sample(&mut random);
            link.mdh.d += 0.3e-3 * normal.sample(&mut random);
            link.mdh.theta += 1e-3 * normal.sample(&mut random);
            link.mdh.alpha += 0.5e-3 * normal.sample(&mut random);
        }
        let middle = vec![0.0, -1.2, 1.2, 0.3, 0.8, 0.0];
        let swing = |random: &mut ChaCha8Rng, slow: f64, amplitude: f64| {
            [amplitude * random.random_range(0.7..1.0), slow * random.random_range(0.8..1.25), random.random_range(0.0..TAU)]
        };
        let reach = [1.2, 0.35, 0.45, 1.2, 0.9, 1.5];
        let swings = (0..6)
            .map(|j| {
                let slow = [0.031, 0.043, 0.053, 0.061, 0.071, 0.083][j];
                [
                    swing(&mut random, slow, 0.65 * reach[j]),
                    swing(&mut random, 2.3 * slow, 0.25 * reach[j]),
                    swing(&mut random, 4.1 * slow, 0.1 * reach[j]),
                ]
            })
            .collect();
        let postures =
            (0..400).map(|_| (0..6).map(|j| middle[j] + reach[j] * random.random_range(-1.0..1.0)).collect()).collect();
        Truth {
            drawn: drawn.clone(),
            arm,
            base: FramePose { xyz: [1.5, -0.7, 0.4], rz_ry_rx: [0.6, 0.0, PI / 6.0] },
            tool: FramePose { xyz: [0.03, -0.02, 0.11], ..FramePose::default() },
            compliance: [3e-6, 4e-6, 5e-6, 8e-6, 10e-6, 12e-6],
            eccentric: std::array::from_fn(|_| [20e-6, random.random_range(0.0..TAU)]),
            swings,
            middle,
            postures,
            random,
        }
    }

    /// What the driver commands at a time.
    fn commanded(&self, campaign: &Campaign, t: f64) -> Vec<f64> {
        if campaign.by_poses {
            // By a third of the way speed grows, by a third it falls.
            let step = 6.0 / campaign.speed;
            let k = (t / step).max(0.0) as usize % (self.postures.len() - 1);
            let u = (t / step).max(0.0).fract();
            let share = if u < 1.0 / 3.0 {
                2.25 * u * u
            } else if u < 2.0 / 3.0 {
                0.25 + 1.5 * (u - 1.0 / 3.0)
            } else {
                1.0 - 2.25 * (1.0 - u).powi(2)
            };
            return self.postures[k].iter().zip(&self.postures[k + 1]).map(|(a, b)| a + (b - a) * share).collect();
        }
        let sway =
            |j: usize| -> f64 { self.swings[j].iter().map(|[a, f, p]| a * (TAU * f * campaign.speed * t + p).sin()).sum() };
        (0..6).map(|j| self.middle[j] + sway(j)).collect()
    }

    /// Where the tool is in truth, at joints that the driver states, which move and accelerate so.
    fn place(&self, campaign: &Campaign, q: &[f64], speeds: &[f64], acceleration: Vector3<f64>) -> Vector3<f64> {
        let none = FramePose::default();
        let flange = |q: &[f64]| world_from_tool(&self.drawn, &self.base, &none, q).translation.vector;
        let force = campaign.mass * (Vector3::new(0.0, 0.0, -9.81) - acceleration);
        let at = flange(q);
        let mut deflected = q.to_vec();
        for j in 0..6 {
            let mut moved = q.to_vec();
            moved[j] += 1e-6;
            let arm = (flange(&moved) - at) / 1e-6;
            let [amplitude, phase] = self.eccentric[j];
            deflected[j] += self.compliance[j] * arm.dot(&force) + amplitude * (q[j] + phase).sin();
            deflected[j] += campaign.play * if speeds[j] > 0.0 { 1.0 } else { -1.0 };
        }
        world_from_tool(&self.arm, &self.base, &self.tool, &deflected).translation.vector
    }

    /// Where the tool is at a time.
    fn at(&self, campaign: &Campaign, t: f64) -> Vector3<f64> {
        let stated = |t: f64| -> Vec<f64> { (0..6).map(|j| self.commanded(campaign, t - campaign.late[j])[j]).collect() };
        const H: f64 = 1e-3;
        let [before, now, after] = [stated(t - H), stated(t), stated(t + H)];
        let none = FramePose::default();
        let flange = |q: &[f64]| world_from_tool(&self.drawn, &self.base, &none, q).translation.vector;
        let acceleration = (flange(&before) + flange(&after) - 2.0 * flange(&now)) / (H * H);
        let speeds: Vec<f64> = before.iter().zip(&after).map(|(a, b)| (b - a) / (2.0 * H)).collect();
        self.place(campaign, &now, &speeds, acceleration)
    }

    /// The recording, and the time to be added to those of the instrument, by which joints and tool belong together.
    pub fn recorded(&mut self, campaign: &Campaign, clock: f64) -> (Log, f64) {
        let normal = Normal::new(0.0, 1.0).unwrap();
        let mut joints = JointTrack {
            name: "joints".into(),
            joints: (1..=6).map(|j| format!("joint_{j}")).collect(),
            is_si: true,
            ..JointTrack::default()
        };
        let mut track =
            Track { name: "tracker".into(), titles: ["x_m", "y_m", "z_m"].map(str::to_owned).into(), ..Track::default() };
        for k in 0..(campaign.seconds * campaign.rates[0]) as usize {
            let t = k as f64 / campaign.rates[0];
            if self.random.random::<f64>() > campaign.lost {
                let stamp = t + campaign.jitter * normal.sample(&mut self.random);
                joints.times.stated.push(stamp);
                joints.times.recorded.push(stamp);
                joints.positions.extend(self.commanded(campaign, t));
            }
        }
        // The filter by small steps of its own.
        let step = 5e-4;
        let mut filtered = self.at(campaign, 0.0);
        let mut next = 0.0;
        for k in 0..(campaign.seconds / step) as usize {
            let t = k as f64 * step;
            if campaign.filter > 0.0 {
                filtered += (self.at(campaign, t) - filtered) * (1.0 - (-step / campaign.filter).exp());
            } else if t >= next {
                filtered = self.at(campaign, t);
            }
            if t >= next {
                next += 1.0 / campaign.rates[1];
                if self.random.random::<f64>() > campaign.lost {
                    let stamp = t + clock + campaign.jitter * normal.sample(&mut self.random);
                    track.times.stated.push(stamp);
                    track.times.recorded.push(stamp);
                    track.values.extend((0..3).map(|c| filtered[c] + campaign.noise * normal.sample(&mut self.random)));
                }
            }
        }
        // Of a filter by steps, half of one less.
        let behind = if campaign.filter > 0.0 { campaign.filter - step / 2.0 } else { 0.0 };
        let late = campaign.late.iter().sum::<f64>() / 6.0;
        (Log { joints: vec![joints], tracks: vec![track], ..Log::default() }, -clock - behind - late)
    }

    /// The tool at poses at which it stands, each approached from below by all joints.
    pub fn still(&mut self, campaign: &Campaign, like: &Dataset, count: usize, set: SampleSet, noise: f64) -> Dataset {
        let normal = Normal::new(0.0, 1.0).unwrap();
        let samples = (0..count)
            .map(|k| {
                let t = self.random.random_range(0.0..1000.0);
                let q = self.commanded(campaign, t);
                let speeds: Vec<f64> = (0..6).map(|_| self.random.random_range(-1.0..1.0)).collect();
                let at = self.place(campaign, &q, &speeds, Vector3::zeros());
                let seen = at.map(|v| v + noise * normal.sample(&mut self.random));
                Sample {
                    id: format!("s{k}"),
                    q,
                    measured: Measured::Point(seen),
                    set,
                    time_s: None,
                    approach: Some(speeds.iter().map(|v| v.signum() as i8).collect()),
                    sigma: None,
                    extra: vec![String::new(); like.extra_columns.len()],
                    ..like.samples[0].clone()
                }
            })
            .collect();
        Dataset { samples, ..like.clone() }
    }
}
