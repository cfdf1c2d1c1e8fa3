//! The procedure of the paper's Table 3.

use calibench::cell::{Manipulator, TriCal};
use calibench::measure::campaign::mastering::{Mastering, MasteringSettings, master};
use calibench::measure::centring::{CenteringController, Centred};
use nalgebra::Vector3;

use super::bench::Bench;
use super::views::SharedBench;
use super::{PrecisionError, Setup};
use calibench_sim::random::Streams;

/// One centring and measurement of the datum ball.
#[derive(Debug, Clone, PartialEq)]
pub struct Repetition {
    /// Measured position of the datum ball minus that of the master ball, m.
    pub deviation: Vector3<f64>,
    /// Remaining readings when the centring stopped, m.
    pub left: Vector3<f64>,
    /// Number of steps taken.
    pub steps: usize,
}

/// One precision test.
#[derive(Debug, Clone, PartialEq)]
pub struct PrecisionTest {
    /// Result of the mastering.
    pub mastering: Mastering,
    /// Measured position of the master ball, m.
    pub master: Vector3<f64>,
    /// The repetitions.
    pub repetitions: Vec<Repetition>,
    /// Duration, s.
    pub duration_s: f64,
}

impl PrecisionTest {
    /// Largest distance between datum ball and master ball, m.
    pub fn largest(&self) -> f64 {
        self.repetitions.iter().map(|r| r.deviation.norm()).fold(0.0, f64::max)
    }

    /// Largest deviation along one axis, m.
    pub fn largest_along(&self, axis: usize) -> f64 {
        self.repetitions.iter().map(|r| r.deviation[axis].abs()).fold(0.0, f64::max)
    }

    /// Mean of the squared distances, m².
    pub fn mean_square(&self) -> f64 {
        self.repetitions.iter().map(|r| r.deviation.norm_squared()).sum::<f64>() / self.repetitions.len().max(1) as f64
    }
}

/// Carries out the procedure: mastering and centring as on any robot, with the small arm in its place.
///
/// # Errors
/// If the gauge cannot be mastered, or the datum ball cannot be centred.
pub fn carry_out(setup: &Setup, streams: &Streams) -> Result<PrecisionTest, PrecisionError> {
    let bench = SharedBench::new(Bench::new(setup, streams));
    let mut indicators = bench.indicators();
    let mut operator = bench.attendant();
    let trical = TriCal::PAPER;
    let mastering = master(&mut indicators, &mut operator, &trical, &MasteringSettings::default(), || bench.time_s())?;
    let mut controller =
        CenteringController::new(bench.small_arm(), indicators, trical, mastering.free_reading, setup.centring());
    let mut repetitions = Vec::with_capacity(setup.repetitions);
    for repetition in 0..setup.repetitions {
        controller.robot().move_joints(&bench.draw_start())?;
        let locate = |failure| PrecisionError::Centring { repetition, failure };
        let Centred { mut reading, mut steps, .. } = controller.centre(&mut |_| {}).map_err(locate)?;
        for _ in 0..setup.further_steps {
            controller.robot().move_in_tool(&reading)?;
            let again = controller.centre(&mut |_| {}).map_err(locate)?;
            (reading, steps) = (again.reading, steps + again.steps + 1);
        }
        let deviation = bench.measure() - operator.master;
        repetitions.push(Repetition { deviation, left: reading, steps });
        controller.robot().move_away()?;
    }
    Ok(PrecisionTest { mastering, master: operator.master, repetitions, duration_s: bench.time_s() })
}
