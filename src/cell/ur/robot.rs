//! A Universal Robot as a manipulator of the procedure.

use std::time::{Duration, Instant};

use calibench_wire::next_order;
use calibench_wire::ur::modes::{self, robot_mode, runtime_state, safety_status};
use calibench_wire::ur::{Action, Datum, Outcome, PROGRAM_TOKEN, Seen, registers};
use nalgebra::{Rotation3, Translation3, Vector3};

use super::link::{Group, Link};
use super::{UrError, UrSettings};
use crate::cell::{Manipulator, ManipulatorError, StopRequest};
use crate::robot::{Pose, rotation_vector};

/// A Universal Robot behind RTDE.
///
/// Power, safety state and program are checked before and during every motion. A lost connection is re-established a limited
/// number of times; whether an order was taken and has ended is known from its number. What became of an order whose program
/// was stopped is not known, and it is not repeated.
pub struct UrRobot {
    pub(super) link: Link,
    pub(super) settings: UrSettings,
    stop: StopRequest,
    order: i64,
    is_started: bool,
    began: Instant,
}

/// Values of `safety_status` in which the arm may move.
const SAFE: [i64; 2] = [modes::NORMAL, modes::REDUCED];
/// Values of `safety_status` with an emergency stop.
pub(super) const EMERGENCY: [i64; 2] = [modes::SYSTEM_EMERGENCY_STOP, modes::ROBOT_EMERGENCY_STOP];
/// Bit of `robot_status_bits`: the freedrive button is pressed.
const FREEDRIVE: i64 = 1 << 2;

/// Longest time for a cancelled motion to end.
const BRAKING: Duration = Duration::from_secs(2);

/// Readings of which a moment is the mean: a tenth of a second on an e-Series.
const TORQUE_READINGS: usize = 25;

/// Attempts to have an order confirmed in time.
const TRIES: usize = 3;

/// Longest time in which a program that runs shows it: longer than it waits for an order to be confirmed, which is a second at
/// the controllers before the e-Series.
const SHOWING: Duration = Duration::from_secs(2);

/// Longest time for a program to start.
const STARTING: Duration = Duration::from_secs(5);

impl UrRobot {
    /// Connects and reads the state; nothing is written and nothing moves.
    ///
    /// # Errors
    /// When there is no answer, or the controller lacks a variable.
    pub fn connect(settings: UrSettings, stop: StopRequest) -> Result<Self, UrError> {
        let link = Link::open(&settings)?;
        let mut robot = UrRobot { link, settings, stop, order: 0, is_started: false, began: Instant::now() };
        robot.link.state()?;
        Ok(robot)
    }

    /// Reason why the robot may not move now, if any; the program aside.
    pub(super) fn unfit(seen: &Seen) -> Option<String> {
        let (mode, safety) = (seen.integer("robot_mode"), seen.integer("safety_status"));
        if EMERGENCY.contains(&safety) {
            return Some("the emergency stop is pressed".into());
        }
        if !SAFE.contains(&safety) {
            let named = safety_status(safety);
            let is_known = !named.starts_with("mode ");
            let remedy = if is_known { "remove its cause, and release it on the pendant" } else { "see the pendant" };
            return Some(format!("its safety state is '{named}': {remedy}"));
        }
        if seen.integer("robot_status_bits") & FREEDRIVE != 0 {
            return Some("it is in freedrive: release the button".into());
        }
        if mode != modes::RUNNING {
            return Some(format!("its mode is '{}': power it on and release the brakes", robot_mode(mode)));
        }
        None
    }

    /// The state, and whether the program of this library runs. One that begins, ends or waits gets the time to show itself: registers
    /// of one that was stopped keep their values, that of a running one counts on.
    pub(super) fn with_program(&mut self) -> Result<(Seen, bool), UrError> {
        let began = Instant::now();
        let first = self.link.state()?.integer(registers::ALIVE);
        loop {
            let seen = self.link.state()?;
            let counts = seen.integer(registers::ALIVE) != first;
            let runs =
                is_playing(&seen) && seen.integer(registers::PROGRAM) == PROGRAM_TOKEN && (counts || is_under_way(&seen));
            let is_settled = matches!(seen.integer("runtime_state"), modes::STOPPED | modes::PAUSED);
            if runs || is_settled || began.elapsed() > SHOWING {
                return Ok((seen, runs));
            }
        }
    }

    /// Sets the speed override, %, and verifies it.
    pub(super) fn set_speed(&mut self, percent: u8) -> Result<(), ManipulatorError> {
        let fraction = f64::from(percent) / 100.0;
        self.link.write(Group::Speed, &[Datum::Integers(vec![1]), Datum::Reals(vec![fraction])])?;
        let began = Instant::now();
        loop {
            let is = self.link.state()?.real("target_speed_fraction");
            if (is - fraction).abs() < 1e-3 {
                return Ok(());
            }
            if began.elapsed() > self.settings.patience.answer {
                let reason = format!("its speed slider stays at {:.0} % where {percent} % was requested", 100.0 * is);
                return Err(ManipulatorError::Refused { reason });
            }
        }
    }

    /// Reason why the program cannot be started, if it does not run already.
    pub(super) fn unfit_to_start(&self, seen: &Seen) -> Option<String> {
        match seen.integer("runtime_state") {
            modes::PLAYING => return Some("another program runs on its controller: stop it on the pendant".into()),
            modes::STOPPED => {}
            other => return Some(format!("its program is {}: stop it on the pendant", runtime_state(other))),
        }
        let local = "its controller is in local control and takes no program: switch it to remote control";
        self.link.is_in_local_control().then(|| local.into())
    }

    /// Starts the program unless it runs.
    pub(super) fn start_program(&mut self) -> Result<(), ManipulatorError> {
        let (seen, runs) = self.with_program()?;
        if let Some(reason) = Self::unfit(&seen) {
            return Err(ManipulatorError::Stopped { reason });
        }
        if runs {
            if let Some(reason) = pending(&seen) {
                return Err(ManipulatorError::Refused { reason });
            }
        } else {
            if let Some(reason) = self.unfit_to_start(&seen) {
                return Err(ManipulatorError::Refused { reason });
            }
            self.link.send_program()?;
            let began = Instant::now();
            while !self.with_program()?.1 {
                if began.elapsed() > STARTING {
                    let message = self.link.message().map(|words| format!(" (\"{words}\")")).unwrap_or_default();
                    let reason = format!("its controller does not start the program{message}; see the log on the pendant");
                    return Err(ManipulatorError::Refused { reason });
                }
            }
        }
        // A cancellation of an earlier session must not meet an order of the same number.
        self.link.write(Group::Cancel, &[Datum::Integers(vec![0])])?;
        self.order = self.link.state()?.integer(registers::DONE);
        self.is_started = true;
        Ok(())
    }

    /// Has the program carry out an order, and waits until it has ended.
    pub(super) fn carry_out(&mut self, action: Action, target: [f64; 6]) -> Result<(), ManipulatorError> {
        if self.stop.is_made() {
            return Err(stopped("stopped by the operator"));
        }
        let seen = self.link.state()?;
        self.may_move(&seen)?;
        let motion = self.settings.motion;
        let (acceleration, speed) = match action {
            Action::Line => (motion.line_acceleration, motion.line_speed),
            _ => (motion.joint_acceleration, motion.joint_speed),
        };
        let [a, b, c, d, e, f] = target;
        let target = [a, b, c, d, e, f, acceleration, speed];
        for _ in 0..TRIES {
            self.order = next_order(self.order);
            self.write_target(action, &target)?;
            self.give_order()?;
            if let Some(verdict) = self.wait_until_done()? {
                return verdict;
            }
        }
        let detail = "its controller gets the driver's numbers too late: the network stalls; no motion was begun".into();
        Err(ManipulatorError::Lost { detail })
    }

    /// Writes the target until the controller shows it. No order is given with another one.
    fn write_target(&mut self, action: Action, numbers: &[f64; 8]) -> Result<(), ManipulatorError> {
        let mut values = vec![Datum::Integers(vec![action.number()])];
        values.extend(numbers.iter().map(|value| Datum::Reals(vec![*value])));
        let mut deadline = Deadline::new(&self.link);
        loop {
            self.link.write(Group::Target, &values)?;
            let seen = self.link.state()?;
            let shown = registers::TARGET.iter().map(|name| seen.real(name));
            if seen.integer(registers::ACTION) == action.number() && shown.eq(numbers.iter().copied()) {
                return Ok(());
            }
            if deadline.is_over(&self.link, self.settings.patience.answer) {
                let detail = "its controller does not show the target that it was sent: the network stalls, or another client writes it; no motion was ordered".into();
                return Err(ManipulatorError::Lost { detail });
            }
        }
    }

    /// Writes the number of the order until the program has seen it, which then waits a quarter of a second to a second for it to be
    /// confirmed. What is not confirmed does not move the arm, however late it arrives.
    fn give_order(&mut self) -> Result<(), ManipulatorError> {
        let mut deadline = Deadline::new(&self.link);
        loop {
            self.link.write(Group::Order, &[Datum::Integers(vec![self.order])])?;
            let seen = self.link.state()?;
            if seen.integer(registers::SEEN) == self.order {
                return Ok(());
            }
            self.may_move(&seen)?;
            if deadline.is_over(&self.link, self.settings.patience.answer) {
                let detail =
                    "its program does not see an order that it was sent: the network stalls; no motion was begun".into();
                return Err(ManipulatorError::Lost { detail });
            }
        }
    }

    /// Confirms the order and waits until it has ended; `None` if it was confirmed too late to begin.
    fn wait_until_done(&mut self) -> Result<Option<Result<(), ManipulatorError>>, ManipulatorError> {
        let began = Instant::now();
        loop {
            let seen = self.link.state()?;
            let outcome = Outcome::of(seen.integer(registers::RESULT));
            if seen.integer(registers::DONE) == self.order {
                return Ok((outcome != Outcome::Void).then(|| self.verdict(outcome)));
            }
            self.may_move(&seen)?;
            if outcome == Outcome::Seen {
                self.link.write(Group::Begin, &[Datum::Integers(vec![self.order])])?;
            }
            if let Some(error) = self.settings.patience.break_off(&self.stop, began) {
                self.cancel()?;
                return Err(error);
            }
            std::thread::sleep(self.settings.patience.poll);
        }
    }

    /// Checks power, safety and program.
    fn may_move(&self, seen: &Seen) -> Result<(), ManipulatorError> {
        if let Some(reason) = Self::unfit(seen) {
            return Err(ManipulatorError::Stopped { reason });
        }
        if !is_playing(seen) || seen.integer(registers::PROGRAM) != PROGRAM_TOKEN {
            let state = runtime_state(seen.integer("runtime_state"));
            let message = self.link.message().map(|words| format!("; it says: {words}")).unwrap_or_default();
            return Err(stopped(&format!("its program does not run (it is {state}){message}")));
        }
        Ok(())
    }

    fn verdict(&self, outcome: Outcome) -> Result<(), ManipulatorError> {
        match outcome {
            Outcome::Done => Ok(()),
            Outcome::BeyondLimits => Err(ManipulatorError::Unreachable),
            Outcome::Cancelled => Err(stopped("the motion was broken off")),
            Outcome::Forgotten | Outcome::UnderWay | Outcome::Seen | Outcome::Void => {
                let detail = "its program was started again, and what became of the order is not known".into();
                Err(ManipulatorError::Lost { detail })
            }
            Outcome::UnknownAction => Err(ManipulatorError::Refused { reason: "its program does not know the action".into() }),
            Outcome::Other(number) => {
                Err(ManipulatorError::Refused { reason: format!("its program gives the outcome {number}") })
            }
        }
    }

    /// Breaks off the order under way; a program that does not obey is slowed down to nothing.
    fn cancel(&mut self) -> Result<(), ManipulatorError> {
        self.link.write(Group::Cancel, &[Datum::Integers(vec![self.order])])?;
        let asked = Instant::now();
        while asked.elapsed() < BRAKING {
            let seen = self.link.state()?;
            if seen.integer(registers::DONE) == self.order || !is_playing(&seen) {
                return Ok(());
            }
        }
        Ok(self.link.write(Group::Speed, &[Datum::Integers(vec![1]), Datum::Reals(vec![0.0])])?)
    }
}

/// The time in which something must have been heard, counted again on each connection.
struct Deadline {
    since: Instant,
    connections: usize,
}

impl Deadline {
    fn new(link: &Link) -> Self {
        Deadline { since: Instant::now(), connections: link.connections() }
    }

    fn is_over(&mut self, link: &Link, allowed: Duration) -> bool {
        if self.connections != link.connections() {
            *self = Deadline::new(link);
        }
        self.since.elapsed() > allowed
    }
}

impl Drop for UrRobot {
    /// Ends the program that this driver started, unless an order is under way: the pendant then shows what became of it.
    fn drop(&mut self) {
        if !self.is_started {
            return;
        }
        self.link.wait_no_longer();
        let is_idle = |seen: &Seen| is_playing(seen) && seen.integer(registers::DONE) == self.order;
        if self.link.state().is_ok_and(|seen| is_idle(&seen) && !is_under_way(&seen)) {
            self.order = next_order(self.order);
            // Nothing can be done about a controller that is gone by now, and the ended program does not run any more.
            let ended = self.write_target(Action::End, &[0.0; 8]).and_then(|()| self.give_order());
            drop(ended.and_then(|()| self.wait_until_done()));
        }
        self.link.close();
    }
}

impl Manipulator for UrRobot {
    fn joints(&mut self) -> Result<Vec<f64>, ManipulatorError> {
        Ok(self.link.state()?.six("actual_q").to_vec())
    }

    fn move_joints(&mut self, target: &[f64]) -> Result<(), ManipulatorError> {
        let target = <[f64; 6]>::try_from(target);
        let target = target.map_err(|_| ManipulatorError::Refused { reason: "it has six joints".into() })?;
        self.carry_out(Action::Joints, target)?;
        std::thread::sleep(self.settings.patience.settle);
        Ok(())
    }

    fn move_in_tool(&mut self, offset: &Vector3<f64>) -> Result<(), ManipulatorError> {
        // From where the tool was commanded to, so that residual servo errors do not accumulate.
        let from = pose_of(self.link.state()?.six("target_TCP_pose"));
        self.carry_out(Action::Line, numbers_of(&(from * Translation3::from(*offset))))?;
        std::thread::sleep(self.settings.patience.settle);
        Ok(())
    }

    fn clock_s(&mut self) -> f64 {
        self.began.elapsed().as_secs_f64()
    }

    fn commanded(&mut self) -> Option<Vec<f64>> {
        self.link.state().ok().map(|seen| seen.six("target_q").to_vec())
    }

    fn temperature_c(&mut self) -> Option<f64> {
        let joints = self.link.state().ok()?.six("joint_temperatures");
        // A controller that knows none reports zeros.
        joints.iter().all(|t| *t != 0.0).then(|| joints.iter().sum::<f64>() / joints.len() as f64)
    }

    fn torques(&mut self) -> Option<Vec<f64>> {
        let torques = self.settings.torques?;
        let mut mean = [0.0; 6];
        for _ in 0..TORQUE_READINGS {
            let values = self.link.state().ok()?.six(torques.variable());
            mean.iter_mut().zip(values).for_each(|(mean, value)| *mean += value / TORQUE_READINGS as f64);
        }
        Some(torques.load(mean))
    }
}

fn is_playing(seen: &Seen) -> bool {
    seen.integer("runtime_state") == modes::PLAYING
}

/// The order under way in the program, and the remedy, if there is one.
pub(super) fn pending(seen: &Seen) -> Option<String> {
    let order = seen.integer(registers::ORDER);
    is_under_way(seen).then(|| format!("order {order} is not done; stop the program on the pendant"))
}

fn is_under_way(seen: &Seen) -> bool {
    Outcome::of(seen.integer(registers::RESULT)) == Outcome::UnderWay
}

/// The pose of six numbers as the controller has them: place, m, and rotation vector, rad.
pub fn pose_of([x, y, z, rx, ry, rz]: [f64; 6]) -> Pose {
    Pose::from_parts(Translation3::new(x, y, z), Rotation3::new(Vector3::new(rx, ry, rz)))
}

/// The six numbers of a pose: place, m, and rotation vector, rad.
pub fn numbers_of(pose: &Pose) -> [f64; 6] {
    let (place, turn) = (pose.translation.vector, rotation_vector(&pose.rotation));
    [place.x, place.y, place.z, turn.x, turn.y, turn.z]
}

fn stopped(reason: &str) -> ManipulatorError {
    ManipulatorError::Stopped { reason: reason.into() }
}
