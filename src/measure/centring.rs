//! Automated centring (paper Fig. 6): read the indicators and move the tool by the readings, until these are within tolerance.
//!
//! The gauge needs to be precise, not accurate: only the last readings, within the tolerance of zero, enter the measurement.

mod failure;
mod final_approach;
mod probing;
pub(crate) mod reading;
mod response;
mod settings;

pub use failure::{CentringFailure, Suspicion};
pub use probing::{Probing, ProbingFailure};
pub use settings::CentringSettings;

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use self::reading::read_patiently;
use self::response::{Response, StepResponse};
use crate::cell::{Indicator, IndicatorError, Manipulator, TriCal};

/// Phase of a probing in which the indicators were read.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Phase {
    /// At the approach pose, before contact.
    Approach,
    /// On the ball.
    Centring,
    /// Back at the approach pose.
    Retreat,
}

impl Phase {
    /// Name used in files.
    pub fn name(self) -> &'static str {
        match self {
            Phase::Approach => "approach",
            Phase::Centring => "centring",
            Phase::Retreat => "retreat",
        }
    }
}

/// One stop of the arm: its position, the readings there, and the next command.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Iteration {
    /// Phase of the probing.
    pub phase: Phase,
    /// Time of the reading on the cell's clock, s.
    pub time_s: f64,
    /// Joints read back, rad (N); the commanded ones if the robot did not arrive or did not report them.
    pub joints: Vec<f64>,
    /// The three readings, m; `None` if the arm did not arrive or an indicator failed. A plunger beyond its range counts as
    /// being at the end of its travel if that end showed the cause.
    pub reading: Option<Vector3<f64>>,
    /// The step commanded along the tool axes, m.
    pub step: Option<Vector3<f64>>,
    /// Repeated queries of indicators.
    pub retries: usize,
    /// Failure that ended the probing here.
    pub fault: Option<CentringFailure>,
    /// Intermediate joints of the path to this stop, rad; empty if the arm moved directly.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub via: Vec<Vec<f64>>,
}

/// A centred ball.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Centred {
    /// Joints read back, rad (N).
    pub joints: Vec<f64>,
    /// Residual readings, m: the ball's centre in the tool frame.
    pub reading: Vector3<f64>,
    /// Time on the cell's clock, s.
    pub time_s: f64,
    /// Number of steps taken.
    pub steps: usize,
    /// Joints commanded, rad (N), if the controller distinguishes them from those read back.
    pub commanded: Option<Vec<f64>>,
    /// Temperature of the robot, °C, if it reports one.
    pub temp_c: Option<f64>,
    /// Moment of the load about each joint, N·m (N), if the controller measures it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub torques: Option<Vec<f64>>,
}

/// Centres balls with a robot and a mastered TriCal, which it owns.
///
/// ```
/// use calibench::cell::TriCal;
/// use calibench::cell::scripted::{Script, ScriptedCell};
/// use calibench::measure::centring::{CenteringController, CentringSettings};
/// use calibench::units::UM;
///
/// let cell = ScriptedCell::new(Script::default());
/// let free = cell.free_reading();
/// let settings = CentringSettings::default();
/// let mut controller = CenteringController::new(cell.robot(), cell.indicators(), TriCal::default(), free, settings);
/// let centred = controller.centre(&mut |stop| println!("{:?}", stop.reading))?;
/// assert!(centred.reading.amax() < 3.0 * UM && cell.tcp().amax() < 3.0 * UM);
/// # Ok::<(), calibench::measure::centring::CentringFailure>(())
/// ```
pub struct CenteringController<M, I> {
    pub(super) robot: M,
    pub(super) indicators: [I; 3],
    trical: TriCal,
    free_reading: [f64; 3],
    settings: CentringSettings,
}

/// State of the loop between steps.
#[derive(Default)]
struct CentringState {
    steps: usize,
    last: Option<LastStep>,
    overshoots: usize,
    ignored: [usize; 3],
}

/// Starting point of the last step.
struct LastStep {
    joints: Vec<f64>,
    reading: Vector3<f64>,
    step: Vector3<f64>,
}

/// Joint motion below which the arm did not move, rad: 1/8 of a step of 3 um at 0.4 m, 8 digits of a KUKA's read-back (float32).
const STANDSTILL: f64 = 1e-6;
/// Joint error at which the arm has not arrived, rad: 0.06 deg, more than any servo error, less than any planned motion.
const NOT_THERE: f64 = 1e-3;

fn arrived(target: &[f64], joints: &[f64]) -> bool {
    joints.len() == target.len() && joints.iter().zip(target).all(|(q, target)| (q - target).abs() < NOT_THERE)
}

impl<M: Manipulator, I: Indicator> CenteringController<M, I> {
    /// Creates a controller for this cell; `free_reading` (m) is the result of mastering.
    pub fn new(robot: M, indicators: [I; 3], trical: TriCal, free_reading: [f64; 3], settings: CentringSettings) -> Self {
        CenteringController { robot, indicators, trical, free_reading, settings }
    }

    /// The robot, e.g. for its clock.
    pub fn robot(&mut self) -> &mut M {
        &mut self.robot
    }

    /// Returns the devices.
    pub fn into_devices(self) -> (M, [I; 3]) {
        (self.robot, self.indicators)
    }

    /// Centres the ball that the gauge already touches; `note` is called at every stop. The arm stays where it is.
    ///
    /// # Errors
    /// The [`CentringFailure`] that ended it.
    pub fn centre(&mut self, note: &mut dyn FnMut(&Iteration)) -> Result<Centred, CentringFailure> {
        self.centre_at(&[], note)
    }

    /// Moves through the joints `onto` to the ball, if given, then centres.
    pub(super) fn centre_at(
        &mut self,
        mut onto: &[Vec<f64>],
        note: &mut dyn FnMut(&Iteration),
    ) -> Result<Centred, CentringFailure> {
        let mut state = CentringState::default();
        loop {
            let centred = self.stop(Phase::Centring, std::mem::take(&mut onto), note, |cell, at, reading| {
                cell.step_or_finish(&mut state, at, reading)
            })?;
            if let Some(centred) = centred {
                return Ok(centred);
            }
        }
    }

    /// Moves through the joints of `way` to the last of them, if any, reads joints and indicators, then calls `act` with the
    /// readings or the failure. In every case `note` is called once.
    pub(super) fn stop<T>(
        &mut self,
        phase: Phase,
        way: &[Vec<f64>],
        note: &mut dyn FnMut(&Iteration),
        act: impl FnOnce(&mut Self, &mut Iteration, Result<Vector3<f64>, CentringFailure>) -> Result<T, CentringFailure>,
    ) -> Result<T, CentringFailure> {
        let joints = way.last().cloned().unwrap_or_default();
        let via = way.split_last().map_or_else(Vec::new, |(_, via)| via.to_vec());
        let mut at = Iteration { phase, time_s: 0.0, joints, reading: None, step: None, retries: 0, fault: None, via };
        let reading = self.arrive(way, &mut at);
        let result = act(self, &mut at, reading);
        at.fault = result.as_ref().err().cloned();
        note(&at);
        result
    }

    fn arrive(&mut self, way: &[Vec<f64>], at: &mut Iteration) -> Result<Vector3<f64>, CentringFailure> {
        let moved = if way.is_empty() { Ok(()) } else { self.robot.move_along(way) };
        at.time_s = self.robot.clock_s();
        moved?;
        at.joints = self.robot.joints()?;
        if way.last().is_some_and(|target| !arrived(target, &at.joints)) {
            return Err(CentringFailure::RobotDidNotMove);
        }
        let reading = self.read(&mut at.retries)?;
        at.reading = Some(reading);
        at.time_s = self.robot.clock_s();
        Ok(reading)
    }

    /// The three readings, m, averaged over the number set.
    fn read(&mut self, retries: &mut usize) -> Result<Vector3<f64>, CentringFailure> {
        let readings = self.settings.readings.max(1);
        let mut sum = Vector3::zeros();
        for _ in 0..readings {
            for (axis, indicator) in self.indicators.iter_mut().enumerate() {
                sum[axis] += read_patiently(indicator, self.settings.retries, retries)
                    .map_err(|error| CentringFailure::of_indicator(axis, error))?;
            }
        }
        Ok(sum / readings as f64)
    }

    /// Ends at a stop with readings within the tolerance, or makes another step.
    fn step_or_finish(
        &mut self,
        state: &mut CentringState,
        at: &mut Iteration,
        reading: Result<Vector3<f64>, CentringFailure>,
    ) -> Result<Option<Centred>, CentringFailure> {
        let reading = match reading {
            Err(CentringFailure::PlungerAtStop { axis }) => return Err(self.why_at_stop(state, at, axis)),
            reading => reading?,
        };
        let doubt = self.doubt(state, &at.joints, &reading);
        // A wrong sign soon drives a plunger to its end: then the sign is reported, not the end. A merely suspected tool frame
        // is not.
        match (doubt, self.contact(&reading)) {
            (Some(CentringFailure::NotShrinking { suspicion: Suspicion::WrongToolFrame, .. }) | None, Err(state)) => Err(state),
            (Some(doubt), _) => Err(doubt),
            (None, Ok(())) => Ok(()),
        }?;
        if reading.amax() < self.settings.tolerance {
            return Ok(Some(self.centred(at, reading, state.steps)));
        }
        if state.steps == self.settings.max_steps {
            return Err(CentringFailure::DidNotConverge { steps: state.steps, remaining: reading.amax() });
        }
        if reading.amax() > self.trical.tip_radius {
            return Err(CentringFailure::StepTooLarge { axis: reading.iamax(), step: reading.norm() });
        }
        let step = reading * (self.settings.max_step / reading.amax()).min(1.0);
        at.step = Some(step);
        self.robot.move_in_tool(&step)?;
        state.steps += 1;
        state.last = Some(LastStep { joints: at.joints.clone(), reading, step });
        Ok(None)
    }

    /// The ball, centred at this stop after this number of steps.
    pub(super) fn centred(&mut self, at: &Iteration, reading: Vector3<f64>, steps: usize) -> Centred {
        let (commanded, temp_c, torques) = (self.robot.commanded(), self.robot.temperature_c(), self.robot.torques());
        Centred { joints: at.joints.clone(), reading, time_s: at.time_s, steps, commanded, temp_c, torques }
    }

    /// Finds the reason why an indicator reports its plunger beyond its range: exchanged indicators, or only the stop. A single
    /// plunger at its stop looks the same whether the indicator counts backwards or the plunger jammed there, so no sign is
    /// suspected.
    fn why_at_stop(&mut self, state: &CentringState, at: &mut Iteration, axis: usize) -> CentringFailure {
        let at_stop = CentringFailure::PlungerAtStop { axis };
        let Some(last) = &state.last else { return at_stop };
        let mut reading = Vector3::zeros();
        for (k, indicator) in self.indicators.iter_mut().enumerate() {
            reading[k] = match read_patiently(indicator, self.settings.retries, &mut at.retries) {
                Ok(value) => value,
                Err(IndicatorError::OverRange) => self.free_reading[k] + self.trical.travel,
                Err(_) => return at_stop,
            };
        }
        match self.answer(last, &reading).response() {
            Response::Suspect(suspicion) if suspicion.is_exchange() => {
                at.reading = Some(reading);
                CentringFailure::NotShrinking { before: last.reading.norm(), after: reading.norm(), suspicion }
            }
            _ => at_stop,
        }
    }

    fn answer<'a>(&'a self, last: &'a LastStep, reading: &'a Vector3<f64>) -> StepResponse<'a> {
        StepResponse {
            trical: &self.trical,
            free_reading: &self.free_reading,
            before: &last.reading,
            step: &last.step,
            after: reading,
        }
    }

    /// Checks that all three plungers are pushed in and none is at its stop.
    pub(super) fn contact(&self, reading: &Vector3<f64>) -> Result<(), CentringFailure> {
        let stop = self.trical.travel - self.settings.end_band;
        if let Some(axis) = (0..3).find(|&k| reading[k] - self.free_reading[k] >= stop) {
            return Err(CentringFailure::PlungerAtStop { axis });
        }
        let free: [bool; 3] = std::array::from_fn(|k| reading[k] - self.free_reading[k] <= self.settings.end_band);
        match free {
            [false, false, false] => Ok(()),
            [true, true, true] => Err(CentringFailure::NoContact),
            free => Err(CentringFailure::BeyondRange { free }),
        }
    }

    /// Checks that all three plungers are at their free readings, without contact.
    pub(super) fn all_free(&self, reading: &Vector3<f64>) -> Result<(), CentringFailure> {
        match (0..3).find(|&k| (reading[k] - self.free_reading[k]).abs() > self.settings.end_band) {
            Some(axis) => Err(CentringFailure::StuckIndicator { axis }),
            None => Ok(()),
        }
    }

    /// Finds what is wrong with the response of the readings to the last step, if anything.
    ///
    /// Since a judged step at least halves the distance and the others are short, a centring ends within twice `max_step` plus
    /// `max_steps * judged_above` of its beginning, whatever the indicators report.
    fn doubt(&self, state: &mut CentringState, joints: &[f64], reading: &Vector3<f64>) -> Option<CentringFailure> {
        let last = state.last.as_ref()?;
        let (step, change) = (last.step, reading - last.reading);
        let moved = last.joints.iter().zip(joints).any(|(a, b)| (a - b).abs() > STANDSTILL);
        for axis in 0..3 {
            let asked = step[axis].abs();
            let ignores = moved && asked > self.settings.tolerance && change[axis].abs() < 0.1 * asked;
            state.ignored[axis] = if ignores { state.ignored[axis] + 1 } else { 0 };
        }
        if let Some(axis) = (0..3).find(|&k| state.ignored[k] >= self.settings.stuck_after) {
            return Some(CentringFailure::StuckIndicator { axis });
        }
        let (before, after) = (last.reading.norm(), reading.norm());
        if before < self.settings.judged_above || after <= self.settings.shrink * before {
            state.overshoots = 0;
            return None;
        }
        if !moved {
            return Some(CentringFailure::RobotDidNotMove);
        }
        match self.answer(last, reading).response() {
            Response::Stuck { axis } => Some(CentringFailure::StuckIndicator { axis }),
            Response::Suspect(suspicion) => Some(CentringFailure::NotShrinking { before, after, suspicion }),
            Response::Overshoots => {
                state.overshoots += 1;
                (state.overshoots >= self.settings.overshoots).then_some(CentringFailure::Oscillating { remaining: after })
            }
        }
    }
}
