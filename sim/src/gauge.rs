//! The simulated TriCal: three plungers around one TCP.

use std::array;

use calibench::cell::IndicatorError;
use nalgebra::Vector3;

use crate::contact::{MASTER_RADIUS, Touch};
use crate::plunger::{Mechanism, PlungerSpec, PlungerTruth, PresentedBall, SimulatedPlunger};
use crate::random::Streams;

/// Three plunger indicators on the axes of the tool frame. An index k must be 0, 1 or 2; others panic like an array index.
#[derive(Debug, Clone)]
pub struct Gauge {
    plungers: [SimulatedPlunger; 3],
}

impl Gauge {
    /// A gauge with these flaws; readings draw their noise from the streams `plunger1`, `plunger2`, `plunger3`.
    pub fn new(truths: [PlungerTruth; 3], streams: &Streams) -> Self {
        let [x, y, z] = truths;
        let plungers = [
            SimulatedPlunger::new(0, x, streams.stream("plunger1")),
            SimulatedPlunger::new(1, y, streams.stream("plunger2")),
            SimulatedPlunger::new(2, z, streams.stream("plunger3")),
        ];
        Gauge { plungers }
    }

    /// A gauge with flaws sampled from `spec`, from the stream `gauge`.
    pub fn draw(spec: &PlungerSpec, streams: &Streams) -> Self {
        let mut rng = streams.stream("gauge");
        Gauge::new(array::from_fn(|_| PlungerTruth::draw(&mut rng, spec)), streams)
    }

    /// Lets the plungers draw their noise from these streams from now on.
    pub fn renew_noise(&mut self, streams: &Streams) {
        for (k, plunger) in self.plungers.iter_mut().enumerate() {
            plunger.renew_noise(streams.stream(&format!("plunger{}", k + 1)));
        }
    }

    /// Plunger `k`.
    pub fn plunger(&self, k: usize) -> &SimulatedPlunger {
        &self.plungers[k]
    }

    /// Lets all plungers come to rest on `ball`, or extend freely. They remember the direction they came from.
    pub fn present(&mut self, ball: Option<PresentedBall>) {
        for plunger in &mut self.plungers {
            plunger.present(ball.as_ref());
        }
    }

    /// Lets each plunger come to rest on its contact, or extend freely. They remember the direction they came from.
    pub fn rest(&mut self, touches: [Touch; 3]) {
        for (plunger, touch) in self.plungers.iter_mut().zip(touches) {
            plunger.rest(touch);
        }
    }

    /// The moving parts of its plungers.
    pub fn mechanisms(&self) -> [Mechanism; 3] {
        array::from_fn(|k| *self.plungers[k].mechanism())
    }

    /// Puts a 1.5-inch ball in the socket, its centre `seat_error` (m, tool frame) from the TCP, `radius_error` (m) too large.
    pub fn seat_master(&mut self, seat_error: Vector3<f64>, radius_error: f64) {
        self.present(Some(PresentedBall { centre: seat_error, radius: MASTER_RADIUS + radius_error }));
    }

    /// Reading of plunger `k`, m.
    ///
    /// # Errors
    /// On a drop-out, or when it is at its stop.
    pub fn read(&mut self, k: usize) -> Result<f64, IndicatorError> {
        self.plungers[k].read()
    }

    /// Makes the present position of plunger `k` read `value`, m.
    ///
    /// # Errors
    /// On a drop-out, or when it is at its stop.
    pub fn preset(&mut self, k: usize, value: f64) -> Result<(), IndicatorError> {
        self.plungers[k].preset(value)
    }

    /// The force on the tool (N, tool frame, through the ball's centre) exerted by `ball`. No plunger moves, so an
    /// equilibrium can be sought without changing the plungers' friction states.
    pub fn force_from(&self, ball: Option<&PresentedBall>) -> Vector3<f64> {
        self.plungers.iter().map(|plunger| plunger.mechanism().force_from(ball)).sum()
    }
}

#[cfg(test)]
mod tests {
    use calibench::units::{MM, MRAD, UM};

    use super::*;
    use crate::contact::{DATUM_RADIUS, FREE_READING, MASTER_READING, OVERTRAVEL, TRAVEL, readings_closed_form};

    const STREAMS: Streams = Streams { seed: 3, trial: 0 };
    /// A reading is a sum of a few numbers near 20 mm, each rounded at 3.5e-18 m.
    const ROUNDING: f64 = 2e-17;

    fn datum(x: f64, y: f64, z: f64) -> Option<PresentedBall> {
        Some(PresentedBall { centre: Vector3::new(x, y, z), radius: DATUM_RADIUS })
    }

    fn readings(gauge: &mut Gauge) -> [f64; 3] {
        array::from_fn(|k| gauge.read(k).expect("in range, and no drop-outs"))
    }

    fn master(gauge: &mut Gauge) {
        gauge.seat_master(Vector3::zeros(), 0.0);
        for k in 0..3 {
            gauge.preset(k, MASTER_READING).expect("in range, and no drop-outs");
        }
    }

    #[test]
    fn an_ideal_gauge_reads_the_closed_form_before_and_after_mastering() {
        let mut gauge = Gauge::draw(&PlungerSpec::ideal(), &STREAMS);
        for _ in 0..2 {
            for c in [[0.0; 3], [MM, -2.0 * MM, 0.5 * MM], [5.9 * MM, -MM, 5.0 * MM]] {
                gauge.present(datum(c[0], c[1], c[2]));
                for (read, exact) in readings(&mut gauge).iter().zip(readings_closed_form(c, DATUM_RADIUS)) {
                    assert!((read - exact).abs() < ROUNDING, "{read} {exact}");
                }
            }
            gauge.present(None);
            assert!(readings(&mut gauge).iter().all(|r| (r - FREE_READING).abs() < ROUNDING));
            master(&mut gauge);
        }
    }

    /// Paper section 2.1: after mastering, the free reading shows how accurately the indicator was placed.
    #[test]
    fn a_misplaced_indicator_shows_when_it_stands_free() {
        let mut gauge = Gauge::draw(&PlungerSpec { placement: 0.3 * MM, ..PlungerSpec::ideal() }, &STREAMS);
        master(&mut gauge);
        gauge.present(None);
        for (k, free) in readings(&mut gauge).into_iter().enumerate() {
            let placement = gauge.plunger(k).truth().placement;
            assert!(placement > 0.0);
            assert!((free - (FREE_READING + placement)).abs() < ROUNDING);
        }
    }

    #[test]
    fn hysteresis_is_the_difference_between_the_two_ways_to_one_place() {
        let width = 0.4 * UM;
        let mut gauge = Gauge::draw(&PlungerSpec { hysteresis: [width; 2], ..PlungerSpec::ideal() }, &STREAMS);
        let mut from = |start: f64| {
            gauge.present(datum(start, start, start));
            gauge.present(datum(0.0, 0.0, 0.0));
            (readings(&mut gauge), gauge.plunger(0).last_motion())
        };
        let (outside, pushed_in) = from(-MM);
        let (inside, coming_out) = from(MM);
        assert_eq!((pushed_in, coming_out), (1, -1));
        for k in 0..3 {
            assert!((inside[k] - outside[k] - width).abs() < ROUNDING);
        }
        // Within the play the scale does not follow.
        let (before, _) = from(-MM);
        gauge.present(datum(-0.9 * width, 0.0, 0.0));
        assert_eq!(readings(&mut gauge)[0], before[0]);
    }

    #[test]
    fn a_plunger_at_its_stop_is_over_range_and_a_deaf_one_silent() {
        let mut gauge = Gauge::draw(&PlungerSpec::ideal(), &STREAMS);
        gauge.present(datum(MASTER_READING + 2.0 * OVERTRAVEL, 0.0, 0.0));
        assert_eq!(gauge.read(0), Err(IndicatorError::OverRange));
        assert!(gauge.read(1).is_ok());
        let mut deaf = Gauge::draw(&PlungerSpec { drop_out: 1.0, ..PlungerSpec::ideal() }, &STREAMS);
        assert_eq!(deaf.read(0), Err(IndicatorError::Silent));
        assert_eq!(deaf.preset(0, 0.0), Err(IndicatorError::Silent));
    }

    /// Virtual work: without friction, the force on the tool is minus the gradient of the energy in the springs.
    #[test]
    fn the_force_is_the_gradient_of_the_springs_energy() {
        let spec = PlungerSpec { disk_tilt: 3.0 * MRAD, orthogonality: 3.0 * MRAD, ..PlungerSpec::default() };
        let gauge = Gauge::draw(&spec, &STREAMS);
        let energy = |c: &Vector3<f64>| -> f64 {
            let ball = PresentedBall { centre: *c, radius: DATUM_RADIUS };
            (0..3)
                .map(|k| {
                    let mut plunger = gauge.plunger(k).clone();
                    plunger.present(Some(&ball));
                    let (truth, s) = (plunger.truth(), plunger.travel());
                    truth.preload * s + 0.5 * (truth.full_force - truth.preload) * s * s / TRAVEL
                })
                .sum()
        };
        for c in [Vector3::zeros(), Vector3::new(1.0, -2.0, 3.0) * MM, Vector3::new(6.5, 2.0, -1.0) * MM] {
            let force = gauge.force_from(Some(&PresentedBall { centre: c, radius: DATUM_RADIUS }));
            // The ball moves in the tool frame opposite to the tool: force on the tool = + dE/dc.
            for k in 0..3 {
                let h = Vector3::ith(k, UM);
                let slope = (energy(&(c + h)) - energy(&(c - h))) / (2.0 * UM);
                // Central differences of 1 um: (h/R)^2 of 1 N, and 1e-17 J over 2 um.
                assert!((slope - force[k]).abs() < 1e-7, "{slope} {force:?}");
            }
        }
    }

    #[test]
    fn a_centred_ball_pushes_the_tool_by_half_the_springs() {
        let gauge = Gauge::draw(&PlungerSpec { preload: 0.65, full_force: 0.90, ..PlungerSpec::ideal() }, &STREAMS);
        let halfway = 0.65 + 0.25 * 6.15 / 12.5;
        assert!((gauge.force_from(datum(0.0, 0.0, 0.0).as_ref()) - Vector3::repeat(halfway)).norm() < 1e-12);
        assert_eq!(gauge.force_from(None), Vector3::zeros());
    }
}
