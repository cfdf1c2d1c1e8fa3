//! One simulated plunger indicator: its flaws, their random draw, and its reading on a ball.

use std::f64::consts::TAU;

use calibench::cell::IndicatorError;
use calibench::units::{MM, MRAD, UM};
use nalgebra::{Unit, Vector3};
use rand::{Rng, RngExt};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

use crate::contact::{Channel, FREE_READING, FREE_TIP, OVERTRAVEL, TRAVEL, Touch};

/// A plunger that grazes the rim would lock in its channel; its side force is limited to this multiple of the spring's.
const MOST_LEVERAGE: f64 = 10.0;

/// A ball as presented to the gauge.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PresentedBall {
    /// Its centre in the tool frame, m.
    pub centre: Vector3<f64>,
    /// Its true radius, m: nominal, error of diameter, and form towards the disks.
    pub radius: f64,
}

/// Sizes of the flaws of the plungers: one-sigma, or the bounds of a uniform draw.
#[derive(Debug, Clone, PartialEq)]
pub struct PlungerSpec {
    /// Largest distance by which indicators are placed further out than ideal, m; never further in, where the master ball
    /// would push them past their range.
    pub placement: f64,
    /// One-sigma of the channel's direction, about each of two axes, rad.
    pub orthogonality: f64,
    /// One-sigma of the channel's distance from the TCP, along each of two axes, m.
    pub concurrency: f64,
    /// One-sigma of the disk's tilt, about each of two axes, rad.
    pub disk_tilt: f64,
    /// Bound of the amplitude of the scale's periodic error, m.
    pub scale_amplitude: f64,
    /// Bounds of its period, m.
    pub scale_period: [f64; 2],
    /// Step of the display, m; 0 for none.
    pub resolution: f64,
    /// Bounds of the hysteresis, m.
    pub hysteresis: [f64; 2],
    /// Bounds of the one-sigma noise of a reading, m.
    pub noise: [f64; 2],
    /// Spring force of the extended plunger, N.
    pub preload: f64,
    /// Spring force at the end of the range, N.
    pub full_force: f64,
    /// Probability that a request gets no answer.
    pub drop_out: f64,
}

impl PlungerSpec {
    /// A plunger without flaws, weight or spring.
    pub fn ideal() -> Self {
        PlungerSpec {
            placement: 0.0,
            orthogonality: 0.0,
            concurrency: 0.0,
            disk_tilt: 0.0,
            scale_amplitude: 0.0,
            scale_period: [1.0 * MM, 10.0 * MM],
            resolution: 0.0,
            hysteresis: [0.0; 2],
            noise: [0.0; 2],
            preload: 0.0,
            full_force: 0.0,
            drop_out: 0.0,
        }
    }
}

impl Default for PlungerSpec {
    /// The paper's indicators: accuracy 1.8 um over 12.5 mm (paper section 4), everything else assumed at sizes usual for a
    /// 0.1 um digital indicator, clamped by hand in a milled aluminium mount.
    fn default() -> Self {
        PlungerSpec {
            placement: 0.3 * MM,
            orthogonality: 0.5 * MRAD,
            concurrency: 20.0 * UM,
            disk_tilt: 1.0 * MRAD,
            scale_amplitude: 1.8 * UM,
            scale_period: [1.0 * MM, 10.0 * MM],
            resolution: 0.1 * UM,
            hysteresis: [0.2 * UM, 0.5 * UM],
            noise: [0.05 * UM, 0.1 * UM],
            preload: 0.65,
            full_force: 0.90,
            drop_out: 0.0,
        }
    }
}

/// Flaws of one plunger. Pairs run along the two axes that follow its own in the order x, y, z, x, y.
#[derive(Debug, Clone, PartialEq)]
pub struct PlungerTruth {
    /// Distance by which the indicator is clamped further out than ideal, m: the free reading, once mastered, is -6.150
    /// mm plus this.
    pub placement: f64,
    /// Slopes of the channel against its axis, rad.
    pub channel_slope: [f64; 2],
    /// Offset of the channel from the TCP, m.
    pub channel_offset: [f64; 2],
    /// Slopes of the disk's normal against the channel, rad.
    pub disk_tilt: [f64; 2],
    /// Amplitude of the scale's periodic error, m.
    pub scale_amplitude: f64,
    /// Its period, m.
    pub scale_period: f64,
    /// Its phase at full extension, rad.
    pub scale_phase: f64,
    /// Step of the display, m; 0 for none.
    pub resolution: f64,
    /// Width of the hysteresis, m: the same position reads this much less when pushing in than when coming out.
    pub hysteresis: f64,
    /// One-sigma noise of a reading, m.
    pub noise: f64,
    /// Spring force of the extended plunger, N.
    pub preload: f64,
    /// Spring force at the end of the range, N; linear between.
    pub full_force: f64,
    /// Probability that a request gets no answer.
    pub drop_out: f64,
}

impl PlungerTruth {
    /// Draws one plunger with the sizes in `spec`; every plunger takes the same number of draws.
    pub fn draw(rng: &mut impl Rng, spec: &PlungerSpec) -> Self {
        let mut normal = |sigma: f64| sigma * rng.sample::<f64, _>(StandardNormal);
        let channel_slope = [normal(spec.orthogonality), normal(spec.orthogonality)];
        let channel_offset = [normal(spec.concurrency), normal(spec.concurrency)];
        let disk_tilt = [normal(spec.disk_tilt), normal(spec.disk_tilt)];
        let mut between = |[low, high]: [f64; 2]| low + (high - low) * rng.random::<f64>();
        PlungerTruth {
            placement: between([0.0, spec.placement]),
            channel_slope,
            channel_offset,
            disk_tilt,
            scale_amplitude: between([0.0, spec.scale_amplitude]),
            scale_period: between(spec.scale_period),
            scale_phase: between([0.0, TAU]),
            resolution: spec.resolution,
            hysteresis: between(spec.hysteresis),
            noise: between(spec.noise),
            preload: spec.preload,
            full_force: spec.full_force,
            drop_out: spec.drop_out,
        }
    }

    /// Line on which its disk travels, for the indicator on axis `k` (0, 1, 2).
    pub fn channel(&self, k: usize) -> Channel {
        let ideal = Channel::ideal(k);
        let beside = |[u, v]: [f64; 2]| Vector3::ith((k + 1) % 3, u) + Vector3::ith((k + 2) % 3, v);
        let along = Unit::new_normalize(ideal.along.into_inner() + beside(self.channel_slope));
        let normal = Unit::new_normalize(along.into_inner() + beside(self.disk_tilt));
        let free_tip = FREE_TIP + self.placement;
        Channel { foot: beside(self.channel_offset), along, normal, free_tip, stop_tip: free_tip + TRAVEL + OVERTRAVEL }
    }

    /// Error of the scale at the travel `s` from full extension, m: `A sin(2 pi s / period + phase)`.
    fn scale_error(&self, s: f64) -> f64 {
        if self.scale_amplitude == 0.0 {
            0.0
        } else {
            self.scale_amplitude * (TAU * s / self.scale_period + self.scale_phase).sin()
        }
    }
}

/// Moving part of an indicator: a disk on a spring, in its channel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mechanism {
    /// The line on which the disk travels.
    pub channel: Channel,
    /// Spring force of the extended plunger, N.
    pub preload: f64,
    /// Stiffness of the spring, N/m.
    pub stiffness: f64,
}

impl Mechanism {
    /// The mechanism of the indicator on axis `k` (0, 1, 2).
    pub fn new(k: usize, truth: &PlungerTruth) -> Self {
        let stiffness = (truth.full_force - truth.preload) / TRAVEL;
        Mechanism { channel: truth.channel(k), preload: truth.preload, stiffness }
    }

    /// Contact at which the plunger comes to rest with `ball` presented.
    pub fn meet(&self, ball: Option<&PresentedBall>) -> Touch {
        ball.map_or(Touch::Free, |ball| self.channel.touch(&ball.centre, ball.radius))
    }

    /// Travel from full extension at this contact, m.
    pub fn travel_at(&self, touch: &Touch) -> f64 {
        match touch {
            Touch::Free => 0.0,
            Touch::At { tip, .. } => tip - self.channel.free_tip,
            Touch::Beyond => self.channel.stop_tip - self.channel.free_tip,
        }
    }

    /// Force of the plunger on the tool (N, tool frame) with `ball` presented.
    ///
    /// The contact is frictionless, so its force acts on the ball along a line through its centre: `F_spring m / (m·d)`, m
    /// being the contact's normal and d the channel. On the flat this is the spring force; on the rim there is a side force.
    /// A free plunger's spring acts against its own body; a ball beyond the stop would be a collision, for which the spring
    /// force alone is returned.
    pub fn force_from(&self, ball: Option<&PresentedBall>) -> Vector3<f64> {
        let touch = self.meet(ball);
        let spring = self.preload + self.stiffness * self.travel_at(&touch);
        match touch {
            Touch::Free => Vector3::zeros(),
            Touch::At { normal, .. } => normal * (spring / normal.dot(&self.channel.along).max(1.0 / MOST_LEVERAGE)),
            Touch::Beyond => self.channel.along.into_inner() * spring,
        }
    }
}

/// One indicator of the simulated gauge. It keeps its plunger's last direction and its preset.
#[derive(Debug, Clone)]
pub struct SimulatedPlunger {
    truth: PlungerTruth,
    mechanism: Mechanism,
    noise: ChaCha8Rng,
    touch: Touch,
    travel: f64,
    /// Travel as followed by the scale, lagging by half the hysteresis.
    followed: f64,
    last_motion: i8,
    /// Offset from scale to reading.
    zero: f64,
}

impl SimulatedPlunger {
    /// The indicator on axis `k` (0, 1, 2), free and not yet mastered: fully extended it reads -6.150 mm, regardless of
    /// its placement.
    pub fn new(k: usize, truth: PlungerTruth, noise: ChaCha8Rng) -> Self {
        let mechanism = Mechanism::new(k, &truth);
        let followed = 0.5 * truth.hysteresis;
        let zero = FREE_READING - followed - truth.scale_error(followed);
        SimulatedPlunger { truth, mechanism, noise, touch: Touch::Free, travel: 0.0, followed, last_motion: -1, zero }
    }

    /// Its flaws.
    pub fn truth(&self) -> &PlungerTruth {
        &self.truth
    }

    /// Its present contact.
    pub fn touch(&self) -> Touch {
        self.touch
    }

    /// Its travel from full extension, m.
    pub fn travel(&self) -> f64 {
        self.travel
    }

    /// Sign of its last motion: +1 pushed in, -1 coming out.
    pub fn last_motion(&self) -> i8 {
        self.last_motion
    }

    /// Its moving part.
    pub fn mechanism(&self) -> &Mechanism {
        &self.mechanism
    }

    /// Lets the plunger come to rest on `ball`, or extend freely.
    pub fn present(&mut self, ball: Option<&PresentedBall>) {
        self.rest(self.mechanism.meet(ball));
    }

    /// Lets the plunger come to rest at a contact, or extend freely.
    pub fn rest(&mut self, touch: Touch) {
        self.touch = touch;
        let travel = self.mechanism.travel_at(&self.touch);
        if travel != self.travel {
            self.last_motion = if travel > self.travel { 1 } else { -1 };
        }
        self.travel = travel;
        // Play operator: the scale moves only when carried along by one end of the play.
        let half_width = 0.5 * self.truth.hysteresis;
        self.followed = self.followed.max(travel - half_width).min(travel + half_width);
    }

    /// Draws its noise from here from now on.
    pub fn renew_noise(&mut self, noise: ChaCha8Rng) {
        self.noise = noise;
    }

    /// Returns the reading, m.
    ///
    /// # Errors
    /// [`IndicatorError::Silent`] on a drop-out, [`IndicatorError::OverRange`] when the plunger is at its stop.
    pub fn read(&mut self) -> Result<f64, IndicatorError> {
        let reading = self.scale()? + self.zero;
        let step = self.truth.resolution;
        Ok(if step > 0.0 { (reading / step).round() * step } else { reading })
    }

    /// Presets the present position to `value`, m; the noise of the scale at this moment becomes a constant offset.
    ///
    /// # Errors
    /// As for [`SimulatedPlunger::read`].
    pub fn preset(&mut self, value: f64) -> Result<(), IndicatorError> {
        self.zero = value - self.scale()?;
        Ok(())
    }

    /// The travel shown by the scale at one request.
    fn scale(&mut self) -> Result<f64, IndicatorError> {
        // Both are drawn at every request, so a lost answer does not shift later noise.
        let noise = self.truth.noise * self.noise.sample::<f64, _>(StandardNormal);
        let lost = self.noise.random::<f64>() < self.truth.drop_out;
        if lost {
            return Err(IndicatorError::Silent);
        }
        if self.touch == Touch::Beyond {
            return Err(IndicatorError::OverRange);
        }
        Ok(self.followed + self.truth.scale_error(self.followed) + noise)
    }
}
