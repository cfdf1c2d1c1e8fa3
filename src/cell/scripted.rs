//! A cell computed arithmetically, with scripted faults: for testing code that drives real cells.
//!
//! The robot is a three-axis stage whose joints are its coordinates (m instead of rad), the gauge rides on it with the tool
//! axes along the stage's, and flat tips meet balls exactly. All handles share one state, as the devices of a real cell do.

use std::cell::RefCell;
use std::rc::Rc;

use nalgebra::{Matrix3, Vector3};

use super::{Indicator, IndicatorError, Manipulator, ManipulatorError, TriCal};
use crate::units::MM;

/// A single fault. Axes are counted from 0; readings of an indicator and motions of the robot are counted from 0 too.
#[derive(Debug, Clone, PartialEq)]
pub enum ScriptedFault {
    /// An indicator fails a number of times, starting at a given reading.
    Answer {
        /// Axis.
        axis: usize,
        /// First reading that fails.
        from: usize,
        /// Number of readings that fail.
        times: usize,
        /// The error.
        error: IndicatorError,
    },
    /// A plunger does not move from a given reading on.
    Stuck {
        /// Axis.
        axis: usize,
        /// First reading.
        from: usize,
    },
    /// Two indicators are exchanged.
    Exchanged {
        /// Axis of the first indicator, counted from 0.
        a: usize,
        /// Axis of the second indicator, counted from 0.
        b: usize,
    },
    /// An indicator's reading drifts.
    Drifts {
        /// Axis.
        axis: usize,
        /// Drift from one reading to the next, m.
        per_reading: f64,
    },
    /// An indicator counts backwards.
    CountsBackwards {
        /// Axis.
        axis: usize,
    },
    /// An indicator accepts a preset but does not apply it.
    PresetIgnored {
        /// Axis.
        axis: usize,
    },
    /// The robot answers a motion with an error and does not move; if lost, stopped or in collision, it does so for all later
    /// motions too.
    Motion {
        /// Number of the motion.
        number: usize,
        /// The answer.
        error: ManipulatorError,
    },
    /// From a given motion on, the robot reports motions that it did not make.
    StandsStill {
        /// First motion.
        from: usize,
    },
}

/// Properties of the cell and its faults.
#[derive(Debug, Clone, PartialEq)]
pub struct Script {
    /// The gauge.
    pub trical: TriCal,
    /// Offset of each indicator from its ideal place, m.
    pub placement: [f64; 3],
    /// Centre of the datum ball on the stage, m; `None` when it is missing.
    pub ball: Option<Vector3<f64>>,
    /// Position of the TCP at zero joints, m: the stage's constant error.
    pub error: Vector3<f64>,
    /// Motion of the TCP per motion commanded along the tool axes; the identity for a perfect tool frame.
    pub tool_response: Matrix3<f64>,
    /// Duration of a motion, s.
    pub motion_s: f64,
    /// Duration of a reading, s.
    pub reading_s: f64,
    /// Faults.
    pub faults: Vec<ScriptedFault>,
}

impl Default for Script {
    /// A cell without faults: the ball at the origin, the stage off by 1 to 2 mm and by 2 % in its steps, the indicators placed
    /// by hand.
    fn default() -> Self {
        Script {
            trical: TriCal::default(),
            placement: [0.15 * MM, 0.4 * MM, 0.25 * MM],
            ball: Some(Vector3::zeros()),
            error: Vector3::new(1.3, -0.9, 1.7) * MM,
            tool_response: Matrix3::new(1.02, 0.01, 0.0, -0.01, 0.98, 0.02, 0.0, -0.02, 1.01),
            motion_s: 1.0,
            reading_s: 0.1,
            faults: Vec::new(),
        }
    }
}

/// A commanded motion.
#[derive(Debug, Clone, PartialEq)]
pub enum Motion {
    /// To these joints.
    Joints(Vec<f64>),
    /// Along the tool axes, m.
    Tool(Vector3<f64>),
}

struct State {
    script: Script,
    joints: Vector3<f64>,
    seated: Option<f64>,
    zero: [f64; 3],
    readings: [usize; 3],
    held: [Option<f64>; 3],
    motions: Vec<Motion>,
    gone: Option<ManipulatorError>,
    time_s: f64,
}

/// A scripted cell; provides its devices.
#[derive(Clone)]
pub struct ScriptedCell(Rc<RefCell<State>>);

/// The robot of a [`ScriptedCell`].
pub struct ScriptedRobot(Rc<RefCell<State>>);

/// An indicator of a [`ScriptedCell`].
pub struct ScriptedIndicator(Rc<RefCell<State>>, usize);

impl ScriptedCell {
    /// Creates a mastered cell that follows this script, with the stage at zero.
    pub fn new(script: Script) -> Self {
        let ideal = script.trical.free_reading();
        let zero = script.placement.map(|off| ideal + off);
        let (joints, motions) = (Vector3::zeros(), Vec::new());
        let state =
            State { script, joints, seated: None, zero, readings: [0; 3], held: [None; 3], motions, gone: None, time_s: 0.0 };
        ScriptedCell(Rc::new(RefCell::new(state)))
    }

    /// Its robot.
    pub fn robot(&self) -> ScriptedRobot {
        ScriptedRobot(Rc::clone(&self.0))
    }

    /// Its indicators.
    pub fn indicators(&self) -> [ScriptedIndicator; 3] {
        std::array::from_fn(|axis| ScriptedIndicator(Rc::clone(&self.0), axis))
    }

    /// Free readings as found by a mastering, m.
    pub fn free_reading(&self) -> [f64; 3] {
        let state = self.0.borrow();
        std::array::from_fn(|axis| state.script.trical.free_reading() + state.script.placement[state.plunger_of(axis)])
    }

    /// Every motion commanded so far, including those that failed.
    pub fn motions(&self) -> Vec<Motion> {
        self.0.borrow().motions.clone()
    }

    /// Position of the TCP, m.
    pub fn tcp(&self) -> Vector3<f64> {
        let state = self.0.borrow();
        state.joints + state.script.error
    }

    /// Puts a ball of this radius (m) into the socket, or removes the present one.
    pub fn seat(&self, radius: Option<f64>) {
        self.0.borrow_mut().seated = radius;
    }

    /// Moves the datum ball, or removes it.
    pub fn move_ball(&self, ball: Option<Vector3<f64>>) {
        self.0.borrow_mut().script.ball = ball;
    }

    /// Shifts the readings of an indicator, as if it had not been mastered, m.
    pub fn shift_zero(&self, axis: usize, by: f64) {
        self.0.borrow_mut().zero[axis] += by;
    }

    /// Adds a fault.
    pub fn add_fault(&self, fault: ScriptedFault) {
        self.0.borrow_mut().script.faults.push(fault);
    }
}

impl State {
    /// The plunger behind an indicator: its own, unless two are exchanged.
    fn plunger_of(&self, indicator: usize) -> usize {
        self.script.faults.iter().fold(indicator, |axis, fault| match fault {
            ScriptedFault::Exchanged { a, b } if *a == axis => *b,
            ScriptedFault::Exchanged { a, b } if *b == axis => *a,
            _ => axis,
        })
    }

    /// Distance by which the plunger of `axis` is pushed in, m.
    fn pushed_in(&self, axis: usize) -> f64 {
        let trical = &self.script.trical;
        // Tip of a free plunger, from the TCP along the axis: the master ball would push it in by the travel less the
        // misplacement.
        let tip = trical.master_radius - trical.travel + self.script.placement[axis];
        let (centre, radius) = match (self.seated, self.script.ball) {
            (Some(radius), _) => (Vector3::zeros(), radius),
            (None, Some(ball)) => (ball - self.joints - self.script.error, trical.datum_radius),
            (None, None) => return 0.0,
        };
        let mut lateral = centre;
        lateral[axis] = 0.0;
        let beyond = (lateral.norm() - trical.tip_radius).max(0.0);
        // Beyond the flat, the rim touches the ball lower down; beyond its radius there is no contact.
        if beyond >= radius {
            return 0.0;
        }
        (centre[axis] + (radius.powi(2) - beyond.powi(2)).sqrt() - tip).clamp(0.0, trical.travel)
    }

    /// Records a motion. True if the robot makes it, false if it stands still; the error if the motion fails.
    fn begin_motion(&mut self, motion: Motion) -> Result<bool, ManipulatorError> {
        let number = self.motions.len();
        self.motions.push(motion);
        if let Some(error) = &self.gone {
            return Err(error.clone());
        }
        self.time_s += self.script.motion_s;
        for fault in &self.script.faults {
            match fault {
                ScriptedFault::Motion { number: at, error } if *at == number => {
                    if matches!(
                        error,
                        ManipulatorError::Lost { .. } | ManipulatorError::Stopped { .. } | ManipulatorError::Collision { .. }
                    ) {
                        self.gone = Some(error.clone());
                    }
                    return Err(error.clone());
                }
                ScriptedFault::StandsStill { from } if *from <= number => return Ok(false),
                _ => {}
            }
        }
        Ok(true)
    }
}

impl Manipulator for ScriptedRobot {
    fn joints(&mut self) -> Result<Vec<f64>, ManipulatorError> {
        let state = self.0.borrow();
        state.gone.clone().map_or_else(|| Ok(state.joints.as_slice().to_vec()), Err)
    }

    fn move_joints(&mut self, target: &[f64]) -> Result<(), ManipulatorError> {
        let mut state = self.0.borrow_mut();
        let moves = state.begin_motion(Motion::Joints(target.to_vec()))?;
        match target {
            &[x, y, z] if moves => state.joints = Vector3::new(x, y, z),
            [_, _, _] => {}
            _ => return Err(ManipulatorError::Unreachable),
        }
        Ok(())
    }

    fn move_in_tool(&mut self, offset: &Vector3<f64>) -> Result<(), ManipulatorError> {
        let mut state = self.0.borrow_mut();
        if state.begin_motion(Motion::Tool(*offset))? {
            let moved = state.script.tool_response * offset;
            state.joints += moved;
        }
        Ok(())
    }

    fn clock_s(&mut self) -> f64 {
        self.0.borrow().time_s
    }
}

impl Indicator for ScriptedIndicator {
    fn read(&mut self) -> Result<f64, IndicatorError> {
        let mut state = self.0.borrow_mut();
        let plunger = state.plunger_of(self.1);
        let number = state.readings[self.1];
        state.readings[self.1] += 1;
        state.time_s += state.script.reading_s;
        let mut travelled = state.pushed_in(plunger);
        let mut stuck = false;
        for fault in &state.script.faults {
            match fault {
                ScriptedFault::Answer { axis, from, times, error }
                    if *axis == self.1 && (*from..from.saturating_add(*times)).contains(&number) =>
                {
                    return Err(error.clone());
                }
                ScriptedFault::Stuck { axis, from } if *axis == plunger && *from <= number => stuck = true,
                ScriptedFault::Drifts { axis, per_reading } if *axis == plunger => travelled += number as f64 * per_reading,
                ScriptedFault::CountsBackwards { axis } if *axis == plunger => travelled = -travelled,
                _ => {}
            }
        }
        if stuck {
            travelled = *state.held[plunger].get_or_insert(travelled);
        }
        Ok(travelled + state.zero[plunger])
    }

    fn preset(&mut self, value: f64) -> Result<(), IndicatorError> {
        let mut state = self.0.borrow_mut();
        let plunger = state.plunger_of(self.1);
        let faults = &state.script.faults;
        let backwards = faults.iter().any(|f| matches!(f, ScriptedFault::CountsBackwards { axis } if *axis == plunger));
        if !faults.iter().any(|f| matches!(f, ScriptedFault::PresetIgnored { axis } if *axis == plunger)) {
            let pushed_in = state.pushed_in(plunger);
            state.zero[plunger] = value - if backwards { -pushed_in } else { pushed_in };
        }
        Ok(())
    }
}
