//! A KUKA robot as a manipulator of the procedure.

use std::time::{Duration, Instant};

use calibench_wire::kuka::{Structure, Value, Verdict};
use calibench_wire::next_order;
use nalgebra::{Translation3, Vector3};

use super::link::{Link, LinkError};
use super::order::{Order, apart};
use super::{KukaSettings, RobotProgram, frame_of, joints_of};
use crate::cell::{Manipulator, ManipulatorError, StopRequest};
use crate::robot::FramePose;
use crate::units::{DEG, MM};

/// A KUKA robot behind a variable server.
///
/// The emergency stop, the operating mode and the program are checked before and during every motion. A lost connection is
/// re-established a limited number of times; whether a motion was done in between is known from its number, or inferred from
/// the position of the arm. If it remains unknown, the motion is not repeated.
pub struct KukaRobot {
    link: Link,
    settings: KukaSettings,
    stop: StopRequest,
    order: i64,
    /// Last commanded position of the tool in the base. Steps start from it, not from the reported position, so that residual
    /// servo errors do not accumulate and the orientation does not drift.
    sent_to: Option<FramePose>,
    began: Instant,
}

/// The tool was moved by somebody else if it is further than this from its commanded position, m and rad.
const MOVED_BY_OTHERS: (f64, f64) = (0.5 * MM, 0.1 * DEG);

/// Longest time for a cancelled motion to end.
const BRAKING: Duration = Duration::from_secs(2);

/// State of the robot at one moment.
#[derive(Debug, Clone, PartialEq)]
pub struct KukaState {
    /// Operating mode, without `#`.
    pub mode: String,
    /// State of the robot program, without `#`.
    pub program: String,
    /// True if the emergency stop is pressed; `None` if no variable reports it.
    pub emergency_stop: Option<bool>,
    /// Speed override, %.
    pub speed: f64,
    /// The action under way, 0 for none.
    pub action: i64,
}

impl KukaRobot {
    /// Connects and checks that the variables exist; nothing is written and nothing moves.
    ///
    /// # Errors
    /// When there is no answer, or a variable is missing.
    pub fn connect(settings: KukaSettings, stop: StopRequest) -> Result<Self, LinkError> {
        let link = Link::open(&settings.address, settings.patience.clone())?;
        let mut robot = KukaRobot { link, settings, stop, order: 0, sent_to: None, began: Instant::now() };
        robot.kuka_state()?;
        robot.read_joints()?;
        robot.position()?;
        if robot.settings.program == RobotProgram::Calibench {
            let done = robot.settings.variables.done.clone();
            robot.order = robot.integer(&done)?;
        }
        Ok(robot)
    }

    /// Reads the state.
    ///
    /// # Errors
    /// When the controller does not answer, or a variable is missing.
    pub fn kuka_state(&mut self) -> Result<KukaState, LinkError> {
        let names = self.settings.variables.clone();
        let (mode, program) = (self.enumerator(&names.mode)?, self.enumerator(&names.program)?);
        let (speed, action) = (self.number(&names.speed)?, self.integer(&names.action)?);
        // Read last, because it is the cause of the others: if it is pressed between two queries, it is still the one reported.
        let emergency_stop = match self.link_value(&names.emergency_stop)? {
            None => None,
            Some(Value::Bool(value)) => Some(value == self.settings.fitness.pressed),
            Some(value) => return Err(unexpected(&names.emergency_stop, &value, "TRUE or FALSE")),
        };
        Ok(KukaState { mode, program, emergency_stop, speed, action })
    }

    /// Reason why the robot may not move now, if any.
    pub fn unfit(&self, state: &KukaState) -> Option<String> {
        let fitness = &self.settings.fitness;
        if state.emergency_stop == Some(true) {
            return Some("the emergency stop is pressed".into());
        }
        if !fitness.modes.contains(&state.mode) {
            return Some(format!("its operating mode is {}, not {}", state.mode, fitness.modes.join(" or ")));
        }
        if !fitness.running.contains(&state.program) {
            return Some(format!("its program does not run (it is {})", state.program));
        }
        None
    }

    /// Sets the speed override, %, and verifies it.
    ///
    /// # Errors
    /// When it is not accepted, or an action is under way that it would release.
    pub fn set_speed(&mut self, percent: u8) -> Result<(), ManipulatorError> {
        let state = self.kuka_state()?;
        if state.action != 0 {
            let reason =
                format!("action {} of an earlier session is not done; reset the program on the controller", state.action);
            return Err(ManipulatorError::Refused { reason });
        }
        self.take_cancel_back()?;
        let name = self.settings.variables.speed.clone();
        self.link.write(&name, &percent.to_string())?;
        let is = self.number(&name)?;
        if is == f64::from(percent) {
            return Ok(());
        }
        Err(ManipulatorError::Refused { reason: format!("its speed override stays at {is} % where {percent} % was requested") })
    }

    /// Sets the tool's frame in the flange and verifies it.
    ///
    /// # Errors
    /// When the program refuses it.
    pub fn set_tool(&mut self, flange_from_tool: &FramePose) -> Result<(), ManipulatorError> {
        self.carry_out(&Order::Tool(*flange_from_tool))?;
        let name = self.settings.variables.tool.clone();
        self.verify_frame(&name, flange_from_tool)
    }

    /// Sets the base's frame and verifies it.
    ///
    /// # Errors
    /// When the program refuses it.
    pub fn set_base(&mut self, robot_from_base: &FramePose) -> Result<(), ManipulatorError> {
        self.carry_out(&Order::Base(*robot_from_base))?;
        let name = self.settings.variables.base.clone();
        self.verify_frame(&name, robot_from_base)
    }

    /// Frame of the tool in the flange, and of the base in the robot's root, as stored in the controller.
    ///
    /// # Errors
    /// When the controller does not answer.
    pub fn tool_and_base(&mut self) -> Result<(FramePose, FramePose), LinkError> {
        let (tool, base) = (self.settings.variables.tool.clone(), self.settings.variables.base.clone());
        Ok((self.frame(&tool)?, self.frame(&base)?))
    }

    /// Frame of the tool in the base.
    ///
    /// # Errors
    /// When the controller does not answer.
    pub fn position(&mut self) -> Result<FramePose, LinkError> {
        let name = self.settings.variables.position.clone();
        self.frame(&name)
    }

    pub(super) fn link(&self) -> &Link {
        &self.link
    }

    fn verify_frame(&mut self, name: &str, expected: &FramePose) -> Result<(), ManipulatorError> {
        self.sent_to = None;
        let is = self.frame(name)?;
        let (distance, angle) = apart(&is, expected);
        // The controller stores float32: 0.1 um and 1e-5 deg at the sizes of tools and bases.
        if distance < 1e-3 * MM && angle < 1e-3 * DEG {
            return Ok(());
        }
        Err(ManipulatorError::Refused { reason: format!("{name} is not what it was set to, by {:.3} mm", distance / MM) })
    }

    fn link_value(&mut self, name: &str) -> Result<Option<Value>, LinkError> {
        if name.is_empty() { Ok(None) } else { self.link.read(name).map(Some) }
    }

    fn enumerator(&mut self, name: &str) -> Result<String, LinkError> {
        match self.link.read(name)? {
            Value::Enumerator(word) => Ok(word),
            value => Err(unexpected(name, &value, "an enumerator")),
        }
    }

    fn number(&mut self, name: &str) -> Result<f64, LinkError> {
        let value = self.link.read(name)?;
        value.number().ok_or_else(|| unexpected(name, &value, "a number"))
    }

    fn integer(&mut self, name: &str) -> Result<i64, LinkError> {
        match self.link.read(name)? {
            Value::Integer(whole) => Ok(whole),
            value => Err(unexpected(name, &value, "a whole number")),
        }
    }

    fn structure(&mut self, name: &str) -> Result<Structure, LinkError> {
        match self.link.read(name)? {
            Value::Structure(structure) => Ok(structure),
            value => Err(unexpected(name, &value, "a structure")),
        }
    }

    fn frame(&mut self, name: &str) -> Result<FramePose, LinkError> {
        let structure = self.structure(name)?;
        frame_of(&structure).ok_or_else(|| unexpected(name, &Value::Structure(structure), "a frame"))
    }

    fn joints_in(&mut self, name: &str) -> Result<Vec<f64>, LinkError> {
        let structure = self.structure(name)?;
        match joints_of(&structure) {
            Some(joints) => Ok(joints.into_iter().take(self.settings.joints).collect()),
            None => Err(unexpected(name, &Value::Structure(structure), "six axes")),
        }
    }

    fn read_joints(&mut self) -> Result<Vec<f64>, LinkError> {
        let name = self.settings.variables.joints.clone();
        self.joints_in(&name)
    }

    /// Has an order carried out and waits until it is done.
    fn carry_out(&mut self, order: &Order) -> Result<(), ManipulatorError> {
        if self.stop.is_made() {
            return Err(stopped("a stop was requested"));
        }
        let state = self.kuka_state()?;
        if let Some(reason) = self.unfit(&state) {
            return Err(ManipulatorError::Stopped { reason });
        }
        if state.action != 0 {
            return Err(ManipulatorError::Refused { reason: format!("its program is busy with action {}", state.action) });
        }
        if order.is_motion() && state.speed <= 0.0 {
            return Err(ManipulatorError::Refused { reason: "its speed override is 0 %".into() });
        }
        let settings = self.settings.clone();
        let (action, variable, target) = order.words(&settings);
        self.link.write(variable, &target)?;
        let is_numbered = settings.program == RobotProgram::Calibench;
        if is_numbered {
            self.order = next_order(self.order);
            self.link.write(&settings.variables.order, &self.order.to_string())?;
        }
        match self.link.write_once(&settings.variables.action, &action.to_string()) {
            Ok(()) => {}
            // The program recognises a repeated order by its number.
            Err(error) if error.is_of_connection() && is_numbered => {
                self.link.write(&settings.variables.action, &action.to_string())?;
            }
            Err(error) if error.is_of_connection() => self.see_what_became_of(order, &error)?,
            Err(error) => return Err(error.into()),
        }
        self.wait_until_done(action)?;
        if is_numbered { self.verdict() } else { Ok(()) }
    }

    /// Decides on an order that may or may not have arrived: it is under way, it is complete, or its state remains
    /// unknown.
    fn see_what_became_of(&mut self, order: &Order, lost: &LinkError) -> Result<(), ManipulatorError> {
        let name = self.settings.variables.action.clone();
        if self.integer(&name)? != 0 {
            return Ok(());
        }
        let (joints, position) = (self.read_joints()?, self.position()?);
        if order.is_done_at(&joints, &position) {
            return Ok(());
        }
        Err(ManipulatorError::Lost { detail: format!("{lost}, and whether it took the order is not known") })
    }

    fn wait_until_done(&mut self, action: i64) -> Result<(), ManipulatorError> {
        let began = Instant::now();
        let name = self.settings.variables.action.clone();
        loop {
            let under_way = self.integer(&name)?;
            if under_way == 0 {
                return Ok(());
            }
            if under_way != action {
                let reason =
                    format!("its program is at action {under_way} where {action} was requested: somebody else commands it too");
                return Err(ManipulatorError::Stopped { reason });
            }
            let state = self.kuka_state()?;
            if let Some(reason) = self.unfit(&state).filter(|_| state.action != 0) {
                return Err(ManipulatorError::Stopped { reason });
            }
            if let Some(error) = self.settings.patience.break_off(&self.stop, began) {
                self.cancel()?;
                return Err(error);
            }
            std::thread::sleep(self.settings.patience.poll);
        }
    }

    /// Interrupts the action under way. If the program cannot, the speed override is set to zero and the rest of the motion
    /// stays in the program, which must be reset before the override is raised again; [`KukaRobot::set_speed`] ensures that.
    fn cancel(&mut self) -> Result<(), ManipulatorError> {
        let names = self.settings.variables.clone();
        if self.settings.program == RobotProgram::Calibench {
            self.link.write(&names.cancel, "TRUE")?;
            let asked = Instant::now();
            while asked.elapsed() < BRAKING {
                if self.integer(&names.action)? == 0 {
                    return Ok(self.take_cancel_back()?);
                }
                std::thread::sleep(self.settings.patience.poll);
            }
        }
        Ok(self.link.write(&names.speed, "0")?)
    }

    /// Withdraws a cancellation when nothing is under way: an order that had just ended ignores it, but the next one would not.
    fn take_cancel_back(&mut self) -> Result<(), LinkError> {
        if self.settings.program == RobotProgram::Plain {
            return Ok(());
        }
        let name = self.settings.variables.cancel.clone();
        self.link.write(&name, "FALSE")
    }

    /// Reads the program's verdict on the last order.
    fn verdict(&mut self) -> Result<(), ManipulatorError> {
        let names = self.settings.variables.clone();
        let (done, result) = (self.integer(&names.done)?, self.integer(&names.result)?);
        if done != self.order {
            let reason = format!("its program acknowledges order {done}, not {}; does calibench.src run there?", self.order);
            return Err(ManipulatorError::Refused { reason });
        }
        let refused = |reason: &str| Err(ManipulatorError::Refused { reason: reason.into() });
        match Verdict::of(result) {
            Verdict::Done => Ok(()),
            Verdict::Unreachable => Err(ManipulatorError::Unreachable),
            Verdict::JointLimit(joint) => Err(ManipulatorError::JointLimit { joint }),
            Verdict::Cancelled => Err(stopped("the motion was broken off")),
            Verdict::UnknownAction => refused("its program does not know the action"),
            Verdict::Other(number) => refused(&format!("its program gives the result {number}")),
        }
    }

    fn come_to_rest(&self) {
        std::thread::sleep(self.settings.patience.settle);
    }
}

impl Manipulator for KukaRobot {
    fn joints(&mut self) -> Result<Vec<f64>, ManipulatorError> {
        Ok(self.read_joints()?)
    }

    fn move_joints(&mut self, target: &[f64]) -> Result<(), ManipulatorError> {
        self.sent_to = None;
        self.carry_out(&Order::Joints(target.to_vec()))?;
        self.come_to_rest();
        Ok(())
    }

    fn move_in_tool(&mut self, offset: &Vector3<f64>) -> Result<(), ManipulatorError> {
        let is = self.position()?;
        let from = self.sent_to.filter(|sent| {
            let (distance, angle) = apart(sent, &is);
            distance < MOVED_BY_OTHERS.0 && angle < MOVED_BY_OTHERS.1
        });
        let target = FramePose::from_pose(&(from.unwrap_or(is).pose() * Translation3::from(*offset)));
        self.sent_to = None;
        self.carry_out(&Order::Line(target))?;
        self.sent_to = Some(target);
        self.come_to_rest();
        Ok(())
    }

    fn clock_s(&mut self) -> f64 {
        self.began.elapsed().as_secs_f64()
    }

    fn commanded(&mut self) -> Option<Vec<f64>> {
        let name = self.settings.variables.commanded.clone();
        if name.is_empty() { None } else { self.joints_in(&name).ok() }
    }
}

fn stopped(reason: &str) -> ManipulatorError {
    ManipulatorError::Stopped { reason: reason.into() }
}

fn unexpected(name: &str, value: &Value, expected: &'static str) -> LinkError {
    LinkError::Unexpected { name: name.into(), value: value.to_string(), expected }
}
