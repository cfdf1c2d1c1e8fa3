//! Mastering: the three indicators are set with the master ball in the trihedral socket (paper sections 2.1 and 3, Fig. 2).

use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::cell::{Indicator, IndicatorError, TriCal};
use crate::measure::centring::reading::read_patiently;
use crate::units::{MM, UM};

/// An attendant who handles the master ball: a person at the cell, or the simulated world.
pub trait Attendant {
    /// Puts the master ball into the socket of the TriCal, which points upwards; returns when done.
    ///
    /// # Errors
    /// When the mastering is cancelled.
    fn place_master_ball(&mut self) -> Result<(), CalledOff>;

    /// Takes the master ball away; returns when done.
    ///
    /// # Errors
    /// When the mastering is cancelled.
    fn remove_master_ball(&mut self) -> Result<(), CalledOff>;

    /// True if all questions were answered in advance: the master ball lies in the socket from the start.
    fn asks_nobody(&self) -> bool {
        false
    }
}

/// The attendant cancelled the mastering.
#[derive(Debug, Error, Clone, Copy, PartialEq, Eq)]
#[error("the mastering was cancelled")]
pub struct CalledOff;

/// Settings and limits of the mastering, lengths in m.
#[derive(Debug, Clone, PartialEq)]
pub struct MasteringSettings {
    /// Successive readings that must agree before a plunger counts as at rest. 5.
    pub stable_readings: usize,
    /// Largest difference among them, m. 1.5 um: the last digit of the coarser display may flicker by one, not by two.
    pub stable_within: f64,
    /// Readings taken before giving up. 100: some ten seconds at eight values a second.
    pub patience: usize,
    /// Largest deviation of the reading from the value preset. 2 um: the last digit and the noise.
    pub preset_within: f64,
    /// Largest distance of an indicator from its ideal place along its channel. 1.5 mm: placed by hand, "approximately" (paper,
    /// section 2.1); at a greater distance the gauge loses its safe range.
    pub placed_within: f64,
    /// Largest change of a free reading since mastering for the mastering to be still valid, m. 3 um: the tolerance of a
    /// centring.
    pub free_again_within: f64,
    /// Repeated queries of an indicator after a lost or garbled answer.
    pub retries: usize,
}

impl Default for MasteringSettings {
    fn default() -> Self {
        MasteringSettings {
            stable_readings: 5,
            stable_within: 1.5 * UM,
            patience: 100,
            preset_within: 2.0 * UM,
            placed_within: 1.5 * MM,
            free_again_within: 3.0 * UM,
            retries: 2,
        }
    }
}

/// A mastered TriCal.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Mastering {
    /// Reading of each indicator without contact, m.
    pub free_reading: [f64; 3],
    /// Reading of each indicator on the master ball after the preset, less the preset, m.
    pub preset_residual: [f64; 3],
    /// Time on the cell's clock, s.
    pub time_s: f64,
}

/// Reason why a TriCal could not be mastered. Axes are counted from 0 (messages count from 1), lengths in m.
#[derive(Debug, Error, Clone, PartialEq)]
#[non_exhaustive]
pub enum MasteringError {
    /// The attendant cancelled it.
    #[error(transparent)]
    CalledOff(#[from] CalledOff),
    /// An indicator does not answer, or answers with an error.
    #[error("indicator {}", axis + 1)]
    Indicator {
        /// Axis.
        axis: usize,
        /// Its error.
        #[source]
        error: IndicatorError,
    },
    /// A reading does not settle.
    #[error("indicator {} does not settle: its readings spread over {:.1} µm", axis + 1, spread / UM)]
    Unstable {
        /// Axis.
        axis: usize,
        /// Spread of the last readings.
        spread: f64,
    },
    /// The reading of an indicator is not the value preset.
    #[error("indicator {} was set to the master reading and reads {:.4} mm", axis + 1, reading / MM)]
    PresetNotTaken {
        /// Axis.
        axis: usize,
        /// Reading.
        reading: f64,
    },
    /// No plunger moved when the master ball was taken away.
    #[error("no plunger came out when the master ball was taken away; was it in the socket, and is it gone?")]
    BallNotRemoved,
    /// All plungers came out by less than the master ball had pushed them in.
    #[error(
        "the plungers came out by {:.2}, {:.2}, {:.2} mm when the ball was taken away, too little for the master ball; was it the right one, and seated?",
        travelled[0] / MM, travelled[1] / MM, travelled[2] / MM
    )]
    NotTheMasterBall {
        /// Travel of each plunger.
        travelled: [f64; 3],
    },
    /// One plunger did not come out.
    #[error("plunger {} did not come out when the master ball was taken away", axis + 1)]
    PlungerStuck {
        /// Axis.
        axis: usize,
    },
    /// The reading increased when the plunger came out.
    #[error("indicator {} counts backwards; turn its counting direction", axis + 1)]
    CountsBackwards {
        /// Axis.
        axis: usize,
    },
    /// An indicator is too far from its place in the channel.
    #[error("indicator {} reads {:.3} mm when free; move it along its channel towards {:.3} mm", axis + 1, free_reading / MM, ideal / MM)]
    Misplaced {
        /// Axis.
        axis: usize,
        /// Its free reading.
        free_reading: f64,
        /// Free reading of an ideally placed indicator.
        ideal: f64,
    },
    /// A free plunger has another reading than when the gauge was mastered.
    #[error(
        "indicator {} reads {:.4} mm, not {:.4} mm as when nothing touched the mastered gauge; bring the arm clear, or master it again",
        axis + 1, free_reading / MM, expected / MM
    )]
    NotAsMastered {
        /// Axis.
        axis: usize,
        /// Reading.
        free_reading: f64,
        /// Expected reading.
        expected: f64,
    },
}

/// Smallest distance that counts as a motion of a plunger, m: far above drift and vibration, far below the nominal 12.5 mm.
const MOVED: f64 = 1.0 * MM;

/// Masters three indicators: insert the master ball, wait for rest, preset each, verify; remove the ball, wait, take the free
/// readings, check them.
///
/// # Errors
/// The [`MasteringError`] that makes the gauge unfit for use.
pub fn master<I: Indicator>(
    indicators: &mut [I; 3],
    attendant: &mut (impl Attendant + ?Sized),
    trical: &TriCal,
    settings: &MasteringSettings,
    clock_s: impl FnOnce() -> f64,
) -> Result<Mastering, MasteringError> {
    let preset = trical.master_reading();
    attendant.place_master_ball()?;
    at_rest(indicators, settings)?;
    for (axis, indicator) in indicators.iter_mut().enumerate() {
        indicator.preset(preset).map_err(|error| MasteringError::Indicator { axis, error })?;
    }
    let on_ball = at_rest(indicators, settings)?;
    if let Some(axis) = (0..3).find(|&k| (on_ball[k] - preset).abs() > settings.preset_within) {
        return Err(MasteringError::PresetNotTaken { axis, reading: on_ball[axis] });
    }
    attendant.remove_master_ball()?;
    let free_reading = at_rest(indicators, settings)?;
    judge(&on_ball, &free_reading, trical, settings)?;
    Ok(Mastering { free_reading, preset_residual: on_ball.map(|reading| reading - preset), time_s: clock_s() })
}

/// Checks whether a gauge is still mastered and returns that mastering: its plungers, which must be free now, are at rest where
/// they were when last free, or at their ideal place if `before` is unknown. An indicator that was preset again, lost its
/// supply, or was moved in its channel has another reading.
///
/// Mastering again is not an improvement while the old one is valid: the master ball never seats twice in the same place.
///
/// # Errors
/// When an indicator fails, does not come to rest, or has another reading.
pub fn still_mastered<I: Indicator>(
    indicators: &mut [I; 3],
    before: Option<&Mastering>,
    trical: &TriCal,
    settings: &MasteringSettings,
    clock_s: impl FnOnce() -> f64,
) -> Result<Mastering, MasteringError> {
    let free_reading = at_rest(indicators, settings)?;
    let (expected, within) = match before {
        Some(mastering) => (mastering.free_reading, settings.free_again_within),
        None => ([trical.free_reading(); 3], settings.placed_within),
    };
    match (0..3).find(|&k| (free_reading[k] - expected[k]).abs() > within) {
        Some(axis) => Err(MasteringError::NotAsMastered { axis, free_reading: free_reading[axis], expected: expected[axis] }),
        None => Ok(before.cloned().unwrap_or(Mastering { free_reading, preset_residual: [0.0; 3], time_s: clock_s() })),
    }
}

/// Checks the readings of free plungers, after the readings `on_ball`.
fn judge(on_ball: &[f64; 3], free: &[f64; 3], trical: &TriCal, settings: &MasteringSettings) -> Result<(), MasteringError> {
    let ideal = trical.free_reading();
    let travelled: [f64; 3] = std::array::from_fn(|k| on_ball[k] - free[k]);
    if travelled.iter().all(|t| t.abs() < MOVED) {
        return Err(MasteringError::BallNotRemoved);
    }
    if let Some(axis) = (0..3).find(|&k| travelled[k].abs() < MOVED) {
        return Err(MasteringError::PlungerStuck { axis });
    }
    if let Some(axis) = (0..3).find(|&k| travelled[k] < 0.0) {
        return Err(MasteringError::CountsBackwards { axis });
    }
    // A single wrong indicator is misplaced; if all three are short by a similar amount, the ball is the cause.
    let short = |k: usize| free[k] - ideal > settings.placed_within;
    if (0..3).all(short) {
        return Err(MasteringError::NotTheMasterBall { travelled });
    }
    match (0..3).find(|&k| (free[k] - ideal).abs() > settings.placed_within) {
        Some(axis) => Err(MasteringError::Misplaced { axis, free_reading: free[axis], ideal }),
        None => Ok(()),
    }
}

/// The mean readings, m, once the last few of each indicator agree.
fn at_rest<I: Indicator>(indicators: &mut [I; 3], settings: &MasteringSettings) -> Result<[f64; 3], MasteringError> {
    let count = settings.stable_readings.max(1);
    let mut last: [Vec<f64>; 3] = Default::default();
    for _ in 0..settings.patience.max(count) {
        for (axis, indicator) in indicators.iter_mut().enumerate() {
            let reading = read_patiently(indicator, settings.retries, &mut 0)
                .map_err(|error| MasteringError::Indicator { axis, error })?;
            if last[axis].len() == count {
                last[axis].remove(0);
            }
            last[axis].push(reading);
        }
        if last[0].len() == count && last.iter().all(|readings| spread(readings) <= settings.stable_within) {
            return Ok(last.map(|readings| readings.iter().sum::<f64>() / count as f64));
        }
    }
    let spreads = last.map(|readings| spread(&readings));
    let axis = if spreads[0] >= spreads[1] && spreads[0] >= spreads[2] { 0 } else { 1 + usize::from(spreads[2] > spreads[1]) };
    Err(MasteringError::Unstable { axis, spread: spreads[axis] })
}

fn spread(readings: &[f64]) -> f64 {
    let (low, high) = readings.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), &r| (l.min(r), h.max(r)));
    high - low
}
