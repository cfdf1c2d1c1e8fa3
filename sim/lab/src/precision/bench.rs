//! The table of the measuring machine and the objects on it (paper Fig. 7): the TriCal, and a small arm that carries a datum
//! ball.
//!
//! The machine's axes are those of the gauge; its origin is the initial centre of the gauge.

use calibench::cell::IndicatorError;
use calibench::units::MM;
use nalgebra::{Rotation3, Vector3};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::Setup;
use calibench_sim::contact::{DATUM_RADIUS, MASTER_RADIUS};
use calibench_sim::gauge::Gauge;
use calibench_sim::plunger::PresentedBall;
use calibench_sim::random::{Streams, noisy_point, normal};
use calibench_sim::world::READING_S;

/// Waiting position of the small arm along each axis, m: out of reach of the plungers, on the side without indicators.
const AWAY: f64 = -40.0 * MM;
/// Duration of a step of the small arm including settling, s (assumed).
const STEP_S: f64 = 1.0;
/// Duration of a motion of the small arm from or to its waiting position, s (assumed).
const TRAVEL_S: f64 = 5.0;

/// The objects on the table.
pub(super) struct Bench {
    setup: Setup,
    gauge: Gauge,
    time_s: f64,
    /// Warming rate of the room, K/s.
    warming: f64,
    master: PresentedBall,
    master_is_there: bool,
    /// The datum ball; its centre is the offset of the centre felt by the disks from the true one.
    datum: PresentedBall,
    start: ChaCha8Rng,
    cmm: ChaCha8Rng,
    motion: ChaCha8Rng,
    // The small arm.
    gauge_from_arm: Rotation3<f64>,
    commanded: Vector3<f64>,
    /// Error of the last large motion, and the accumulated error of the small ones since, m.
    large_motion: Vector3<f64>,
    small_motion: Vector3<f64>,
    creep: Vector3<f64>,
    at_rest_since_s: f64,
    creeping: ChaCha8Rng,
}

fn drawn(sigma: f64, random: &mut ChaCha8Rng) -> Vector3<f64> {
    noisy_point(&Vector3::zeros(), sigma, random)
}

impl Bench {
    /// The table of one trial. Every source of error has its own random stream.
    pub fn new(setup: &Setup, streams: &Streams) -> Self {
        let mut balls = streams.stream("precision balls");
        let mut ball = |radius: f64| PresentedBall {
            radius: radius + normal(setup.radius_sigma, &mut balls),
            centre: drawn(setup.form_sigma, &mut balls),
        };
        let (master, datum) = (ball(MASTER_RADIUS), ball(DATUM_RADIUS));
        let mut bench = Bench {
            gauge: Gauge::draw(&setup.plungers, streams),
            time_s: 0.0,
            warming: normal(setup.room_drift, &mut streams.stream("precision room")),
            master,
            master_is_there: false,
            datum,
            start: streams.stream("precision start"),
            cmm: streams.stream("precision cmm"),
            motion: streams.stream("small arm motion"),
            gauge_from_arm: Rotation3::new(drawn(setup.arm.misalignment, &mut streams.stream("small arm axes"))),
            commanded: Vector3::repeat(AWAY),
            large_motion: Vector3::zeros(),
            small_motion: Vector3::zeros(),
            creep: Vector3::zeros(),
            at_rest_since_s: 0.0,
            creeping: streams.stream("small arm creep"),
            setup: setup.clone(),
        };
        bench.settle();
        bench
    }

    /// Position of the gauge's centre, m.
    fn gauge_centre(&self) -> Vector3<f64> {
        Vector3::repeat(self.setup.growth * self.warming * self.time_s)
    }

    /// Commanded position of the small arm, rounded to its step, m, arm's axes.
    fn stepped(&self) -> Vector3<f64> {
        let step = self.setup.arm.step;
        if step > 0.0 { self.commanded.map(|v| (v / step).round() * step) } else { self.commanded }
    }

    /// Position of the centre of the datum ball, m.
    fn datum_centre(&self) -> Vector3<f64> {
        let crept = self.creep * (self.time_s - self.at_rest_since_s);
        self.gauge_from_arm * self.stepped() + self.large_motion + self.small_motion + crept
    }

    /// Lets the plungers settle on the ball in front of them.
    fn settle(&mut self) {
        let ball = if self.master_is_there {
            self.master
        } else {
            PresentedBall { centre: self.datum_centre() - self.gauge_centre() + self.datum.centre, ..self.datum }
        };
        self.gauge.present(Some(ball));
    }

    /// Seconds since the test began.
    pub fn time_s(&self) -> f64 {
        self.time_s
    }

    /// Advances the time.
    pub fn wait(&mut self, seconds: f64) {
        self.time_s += seconds;
        self.settle();
    }

    /// Puts the master ball into the socket, or takes it out.
    pub fn seat_master(&mut self, is_there: bool) {
        self.master_is_there = is_there;
        self.settle();
    }

    /// Centre of the ball in the gauge as measured by the machine, m; takes time, and the result holds for the middle of it.
    pub fn measure(&mut self) -> Vector3<f64> {
        self.wait(0.5 * self.setup.cmm_s);
        let centre = if self.master_is_there { self.gauge_centre() } else { self.datum_centre() };
        let found = self.setup.cmm.measure_ball(&centre, &mut self.cmm);
        self.wait(0.5 * self.setup.cmm_s);
        found
    }

    /// Reading of indicator `k`, m.
    ///
    /// # Errors
    /// Those of the gauge.
    pub fn read(&mut self, k: usize) -> Result<f64, IndicatorError> {
        self.wait(READING_S);
        self.gauge.read(k)
    }

    /// Presets indicator `k` to `value`, m.
    ///
    /// # Errors
    /// Those of the gauge.
    pub fn preset(&mut self, k: usize, value: f64) -> Result<(), IndicatorError> {
        self.gauge.preset(k, value)
    }

    /// A random start position of the datum ball near the gauge's centre, m, arm's axes.
    pub fn draw_start(&mut self) -> Vector3<f64> {
        let start = self.setup.start;
        Vector3::from_fn(|_, _| start * (2.0 * self.start.random::<f64>() - 1.0))
    }

    /// Waiting position of the small arm, m, arm's axes.
    pub fn away() -> Vector3<f64> {
        Vector3::repeat(AWAY)
    }

    /// Position reported by the small arm, m, its own axes.
    pub fn arm_position(&self) -> Vector3<f64> {
        self.stepped()
    }

    /// A large motion of the small arm.
    pub fn move_to(&mut self, target: Vector3<f64>) {
        self.commanded = target;
        self.large_motion = drawn(self.setup.arm.repeatability, &mut self.motion);
        self.small_motion = Vector3::zeros();
        self.rest_after(TRAVEL_S);
    }

    /// A small motion of the small arm.
    pub fn move_by(&mut self, offset: &Vector3<f64>) {
        self.commanded = self.stepped() + offset;
        self.small_motion += drawn(self.setup.arm.small_move, &mut self.motion);
        self.rest_after(STEP_S);
    }

    fn rest_after(&mut self, seconds: f64) {
        self.creep = drawn(self.setup.arm.drift, &mut self.creeping);
        self.at_rest_since_s = self.time_s + seconds;
        self.wait(seconds);
    }
}
