//! A recorded campaign played back through the cell's traits: the same readings and joints for the same commands.
//!
//! It allows a session at a real cell to be reviewed, and the controller that took the data to be checked. Only commands
//! advance the recording; reading does not, so that averaging or repeated queries change nothing.

pub use super::offset_clock::OffsetClock;

use std::cell::RefCell;
use std::path::Path;
use std::rc::Rc;

use nalgebra::Vector3;
use thiserror::Error;

use super::recorded_stops::{Fault, Stop, read_stops};
use super::{Indicator, IndicatorError, Manipulator, ManipulatorError};
use crate::files::FileError;
use crate::units::UM;

/// Point at which a command differs from the recorded one. Steps are counted from 1, the first row after the header of
/// `iterations.csv`.
#[derive(Debug, Error, Clone, PartialEq)]
#[non_exhaustive]
pub enum ReplayMismatch {
    /// The recording has a different step along the tool, or none, here.
    #[error("the replay departs at step {at}: commanded ({:.4}, {:.4}, {:.4}) µm, recorded {}", commanded.x / UM, commanded.y / UM, commanded.z / UM, in_um(recorded))]
    Step {
        /// Step.
        at: usize,
        /// Step commanded now, m.
        commanded: Vector3<f64>,
        /// Step recorded, m, if there was one.
        recorded: Option<Vector3<f64>>,
    },
    /// The recording has a motion to other joints, or none, here.
    #[error("the replay departs at step {at}: joints were commanded that the recording did not move to")]
    Joints {
        /// Step.
        at: usize,
        /// Joints commanded now, rad.
        commanded: Vec<f64>,
    },
    /// Nothing was recorded after this.
    #[error("the replay departs at step {at}: the recording ends here")]
    End {
        /// Step.
        at: usize,
    },
}

/// Tolerance on a recorded step, m: a nanometre is far below any reading's last digit, far above the rounding of text.
const SAME_STEP: f64 = 1e-9;
/// Tolerance of the commanded joints on the recorded read-back, rad: 0.06 degrees is more than the residual servo error, less
/// than the difference between poses.
const SAME_JOINTS: f64 = 1e-3;

struct State {
    stops: Vec<Stop>,
    /// The present stop of the arm; `None` before the first motion.
    at: Option<usize>,
    departure: Option<ReplayMismatch>,
}

/// A recorded campaign; provides its devices.
#[derive(Clone)]
pub struct Recording(Rc<RefCell<State>>);

/// The robot of a [`Recording`].
pub struct ReplayedRobot(Rc<RefCell<State>>);

/// An indicator of a [`Recording`].
pub struct ReplayedIndicator(Rc<RefCell<State>>, usize);

impl Recording {
    /// Reads the `iterations.csv` of a campaign (columns: [`crate::measure::campaign::CampaignRecord::write`]).
    ///
    /// # Errors
    /// When the file cannot be read, a column is missing, or a value is not a number.
    pub fn read(path: &Path) -> Result<Recording, FileError> {
        let stops = read_stops(path)?;
        Ok(Recording(Rc::new(RefCell::new(State { stops, at: None, departure: None }))))
    }

    /// The recorded robot.
    pub fn robot(&self) -> ReplayedRobot {
        ReplayedRobot(Rc::clone(&self.0))
    }

    /// The recorded indicators.
    pub fn indicators(&self) -> [ReplayedIndicator; 3] {
        std::array::from_fn(|axis| ReplayedIndicator(Rc::clone(&self.0), axis))
    }

    /// Departure of the commands from the recording, if any. After it the robot answers that it is lost.
    pub fn departure(&self) -> Option<ReplayMismatch> {
        self.0.borrow().departure.clone()
    }

    /// True if every recorded stop was visited.
    pub fn is_finished(&self) -> bool {
        let state = self.0.borrow();
        state.at.map_or(0, |at| at + 1) == state.stops.len()
    }
}

impl State {
    fn here(&self) -> Option<&Stop> {
        self.stops.get(self.at.unwrap_or(0))
    }

    fn next(&self) -> usize {
        self.at.map_or(0, |at| at + 1)
    }

    fn depart<T>(&mut self, departure: ReplayMismatch) -> Result<T, ManipulatorError> {
        let departure = self.departure.get_or_insert(departure);
        Err(ManipulatorError::Lost { detail: departure.to_string() })
    }

    /// Checks that the commands have followed the recording so far.
    fn on_track(&self) -> Result<(), ManipulatorError> {
        match &self.departure {
            Some(departure) => Err(ManipulatorError::Lost { detail: departure.to_string() }),
            None => Ok(()),
        }
    }

    /// Advances to the next stop, where the recorded robot may have failed.
    fn arrive(&mut self) -> Result<(), ManipulatorError> {
        self.at = Some(self.next());
        match self.here() {
            Some(Stop { fault: Some(Fault::Robot(error)), reading: None, .. }) => Err(error.clone()),
            _ => Ok(()),
        }
    }
}

impl Manipulator for ReplayedRobot {
    fn joints(&mut self) -> Result<Vec<f64>, ManipulatorError> {
        let state = self.0.borrow();
        state.on_track()?;
        Ok(state.here().map(|stop| stop.joints.clone()).unwrap_or_default())
    }

    fn move_joints(&mut self, target: &[f64]) -> Result<(), ManipulatorError> {
        let mut state = self.0.borrow_mut();
        state.on_track()?;
        let at = state.next() + 1;
        let Some(next) = state.stops.get(state.next()) else {
            return state.depart(ReplayMismatch::End { at: at - 1 });
        };
        let stood_still = next.fault == Some(Fault::StoodStill);
        let same =
            next.joints.len() == target.len() && next.joints.iter().zip(target).all(|(a, b)| (a - b).abs() < SAME_JOINTS);
        // A joint motion does not match a recorded step along the tool.
        let stepped =
            state.at.and_then(|at| state.stops.get(at)).is_some_and(|stop| stop.step.is_some() && stop.fault.is_none());
        if stepped || !(same || stood_still) {
            return state.depart(ReplayMismatch::Joints { at, commanded: target.to_vec() });
        }
        state.arrive()
    }

    fn move_in_tool(&mut self, offset: &Vector3<f64>) -> Result<(), ManipulatorError> {
        let mut state = self.0.borrow_mut();
        state.on_track()?;
        let at = state.at.map_or(1, |at| at + 1);
        let recorded = state.at.and_then(|at| state.stops.get(at)).and_then(|stop| stop.step);
        if !recorded.is_some_and(|step| (step - offset).amax() < SAME_STEP) {
            return state.depart(ReplayMismatch::Step { at, commanded: *offset, recorded });
        }
        if let Some(Stop { fault: Some(Fault::Robot(error)), .. }) = state.here() {
            return Err(error.clone());
        }
        if state.next() == state.stops.len() {
            return state.depart(ReplayMismatch::End { at });
        }
        state.arrive()
    }

    fn clock_s(&mut self) -> f64 {
        self.0.borrow().here().map_or(0.0, |stop| stop.time_s)
    }
}

impl Indicator for ReplayedIndicator {
    fn read(&mut self) -> Result<f64, IndicatorError> {
        match self.0.borrow().here() {
            Some(Stop { fault: Some(Fault::Indicator(axis, error)), reading: None, .. }) if *axis == self.1 => {
                Err(error.clone())
            }
            Some(Stop { reading: Some(reading), .. }) => Ok(reading[self.1]),
            // The other two answered when one failed; their readings were of no use and are not recorded.
            Some(Stop { fault: Some(Fault::Indicator(..)), .. }) => Ok(0.0),
            _ => Err(IndicatorError::Silent),
        }
    }

    fn preset(&mut self, _value: f64) -> Result<(), IndicatorError> {
        Err(IndicatorError::Fault { detail: "a recording cannot be mastered again".into() })
    }
}

fn in_um(step: &Option<Vector3<f64>>) -> String {
    step.map_or_else(|| "no step".into(), |s| format!("({:.4}, {:.4}, {:.4}) µm", s.x / UM, s.y / UM, s.z / UM))
}
