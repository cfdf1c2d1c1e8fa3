//! The table of the measuring machine with what stands on it (paper Fig. 7): the TriCal, and a small arm that carries a datum ball.
//!
//! The machine's axes are those of the gauge; its origin is the centre of the gauge when the test begins.

use calibench::cell::IndicatorError;
use calibench::units::MM;
use nalgebra::{Rotation3, Vector3};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::Setup;
use crate::contact::{DATUM_RADIUS, MASTER_RADIUS};
use crate::gauge::Gauge;
use crate::plunger::PresentedBall;
use crate::random::{Streams, noisy_point, normal};
use crate::world::READING_S;

/// Where the small arm waits, along each axis, m: out of reach of the plungers, on the side without indicators.
const AWAY: f64 = -40.0 * MM;
/// A step of the small arm, with the time to come to rest, s (assumed).
const STEP_S: f64 = 1.0;
/// A motion of the small arm from or to where it waits, s (assumed).
const TRAVEL_S: f64 = 5.0;

/// What stands on the table.
pub(super) struct Bench {
    setup: Setup,
    gauge: Gauge,
    time_s: f64,
    /// How fast the room gets warmer, K/s.
    warming: f64,
    master: PresentedBall,
    master_is_there: bool,
    /// The datum ball, its centre as the disks feel it against where it truly is.
    datum: PresentedBall,
    start: ChaCha8Rng,
    cmm: ChaCha8Rng,
    motion: ChaCha8Rng,
    // The small arm.
    gauge_from_arm: Rotation3<f64>,
    commanded: Vector3<f64>,
    /// What the last large motion missed, and what all the small ones since then did, m.
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
    /// The table of one trial. Every source of error has a stream of its own.
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

    /// Where the gauge's centre stands, m.
    fn gauge_centre(&self) -> Vector3<f64> {
        Vector3::repeat(self.setup.growth * self.warming * self.time_s)
    }

    /// Where the small arm's own steps put it, m, arm's axes.
    fn stepped(&self) -> Vector3<f64> {
        let step = self.setup.arm.step;
        if step > 0.0 { self.commanded.map(|v| (v / step).round() * step) } else { self.commanded }
    }

    /// Where the centre of the datum ball stands, m.
    fn datum_centre(&self) -> Vector3<f64> {
        let crept = self.creep * (self.time_s - self.at_rest_since_s);
        self.gauge_from_arm * self.stepped() + self.large_motion + self.small_motion + crept
    }

    /// Lets the plungers come to rest on what is before them.
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

    /// Time goes by.
    pub fn wait(&mut self, seconds: f64) {
        self.time_s += seconds;
        self.settle();
    }

    /// Puts the master ball into the socket, or takes it out.
    pub fn seat_master(&mut self, is_there: bool) {
        self.master_is_there = is_there;
        self.settle();
    }

    /// What the machine finds for the centre of the ball in the gauge, m; it takes its time, and what it finds holds for the middle of it.
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
    /// As the gauge's own.
    pub fn read(&mut self, k: usize) -> Result<f64, IndicatorError> {
        self.wait(READING_S);
        self.gauge.read(k)
    }

    /// Makes indicator `k` read `value`, m.
    ///
    /// # Errors
    /// As the gauge's own.
    pub fn preset(&mut self, k: usize, value: f64) -> Result<(), IndicatorError> {
        self.gauge.preset(k, value)
    }

    /// A place near the gauge's centre to which the datum ball is brought, m, arm's axes.
    pub fn draw_start(&mut self) -> Vector3<f64> {
        let start = self.setup.start;
        Vector3::from_fn(|_, _| start * (2.0 * self.start.random::<f64>() - 1.0))
    }

    /// Where the small arm waits, m, arm's axes.
    pub fn away() -> Vector3<f64> {
        Vector3::repeat(AWAY)
    }

    /// What the small arm says of where it is, m, its own axes.
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
