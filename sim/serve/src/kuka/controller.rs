//! The robot's controller as seen through its variables: the arm's position, its commands, whether it is stopped.

use std::cell::RefCell;
use std::f64::consts::PI;
use std::rc::Rc;

use calibench::cell::kuka::{e6axis, frame_of, krl_frame};
use calibench::robot::statics::{Loads, Payload};
use calibench::robot::{FramePose, Pose, Robot};
use calibench_wire::kuka::{Structure, Value};
use nalgebra::Vector3;
use tokio::sync::Notify;

use super::variables::{Access, NotWritten, Variables};
use crate::arm::Arm;
use crate::fault::Fault;
use crate::floor::Floor;

/// KUKA's flange in the last frame of the nominal KR 6 (paper, Table 4), whose z axis points back into the wrist.
pub const LAST_FRAME_FROM_FLANGE: FramePose = FramePose { xyz: [0.0; 3], rz_ry_rx: [0.0, PI, 0.0] };

/// Variables of the controller's own, besides those that follow from the arm.
const SYSTEM: &str = "\
    $ABS_ACCUR FALSE
    $KR_SERIALNO 700700";

/// State variables: read only, and changing with events.
const STATE: &str = "\
    $PRO_STATE1 #P_ACTIVE
    $STOPMESS FALSE
    $ALARM_STOP TRUE
    $USER_SAF TRUE
    $PERI_RDY TRUE";

/// Variables written by programs and clients.
const SETTINGS: &str = "\
    $VEL {CP: CP 2.0, ORI1 200.0, ORI2 200.0}
    $LOAD {LOAD: M 0.0, CM {FRAME: X 0.0, Y 0.0, Z 0.0, A 0.0, B 0.0, C 0.0}, J {INERTIA: X 0.0, Y 0.0, Z 0.0}}
    COM_ACTION 0
    COM_ORDER 0
    COM_DONE 0
    COM_RESULT 0
    COM_CANCEL FALSE
    COM_ACTCNT 0
    COM_ROUNDM 0.0
    COM_VALUE1 0.0
    COM_VALUE2 0.0
    COM_VALUE3 0.0
    COM_VALUE4 0.0
    COM_FRAME {FRAME: X 0.0, Y 0.0, Z 0.0, A 0.0, B 0.0, C 0.0}
    COM_POS {POS: X 0.0, Y 0.0, Z 0.0, A 0.0, B 0.0, C 0.0, S 2, T 2}
    COM_E6POS {E6POS: X 0.0, Y 0.0, Z 0.0, A 0.0, B 0.0, C 0.0, S 2, T 2, E1 0.0, E2 0.0, E3 0.0, E4 0.0, E5 0.0, E6 0.0}
    COM_E6AXIS {E6AXIS: A1 0.0, A2 0.0, A3 0.0, A4 0.0, A5 0.0, A6 0.0, E1 0.0, E2 0.0, E3 0.0, E4 0.0, E5 0.0, E6 0.0}";

/// The controller of the served robot.
pub struct Controller {
    /// The arm.
    pub arm: Arm,
    /// Notified when a variable was written.
    pub written: Notify,
    /// Notified when somebody resets the controller after a stop and starts its program again.
    pub reset: Notify,
    variables: RefCell<Variables>,
    gravity: Vector3<f64>,
}

impl Controller {
    /// Releases the emergency stop, acknowledges the message and starts the program again, as an operator does; false if nothing
    /// is stopped.
    pub fn restart(&self) -> bool {
        let is_stopped = self.get("$STOPMESS") == Some(Value::Bool(true));
        if is_stopped {
            self.variables.borrow_mut().put_all(STATE, Access::ReadOnly);
            self.put("COM_ACTION", Value::Integer(0), Access::Writable);
            self.reset.notify_waiters();
        }
        is_stopped
    }

    /// The controller of `robot` in this cell, with its program running in operating mode `mode` (`T1`, `AUT` ...) and `tool`
    /// in the robot's last frame.
    pub fn new(floor: Rc<Floor>, robot: Robot, tool: &FramePose, gravity: Vector3<f64>, mode: &str) -> Self {
        let mut variables = Variables::default();
        variables.put_all(SYSTEM, Access::ReadOnly);
        variables.put_all(STATE, Access::ReadOnly);
        variables.put_all(SETTINGS, Access::Writable);
        variables.put("$OV_PRO", Value::Integer(100), Access::Percent);
        variables.put("$MODE_OP", Value::Enumerator(mode.into()), Access::ReadOnly);
        for (name, text) in [("$ROBNAME[]", "calibench"), ("$MODEL_NAME[]", robot.name.as_str())] {
            variables.put(name, Value::Text(text.into()), Access::ReadOnly);
        }
        let flange_from_tool = FramePose::from_pose(&(LAST_FRAME_FROM_FLANGE.pose().inverse() * tool.pose()));
        variables.put("$TOOL", Value::Structure(krl_frame(&flange_from_tool)), Access::Writable);
        variables.put("$BASE", Value::Structure(krl_frame(&FramePose { xyz: [0.0; 3], rz_ry_rx: [0.0; 3] })), Access::Writable);
        for axis in 1..=robot.joints() {
            variables.put(&format!("$VEL_AXIS[{axis}]"), Value::Integer(100), Access::Writable);
        }
        Controller {
            arm: Arm::new(floor, robot),
            written: Notify::new(),
            reset: Notify::new(),
            variables: RefCell::new(variables),
            gravity,
        }
    }

    /// Returns the value of a variable.
    pub fn get(&self, name: &str) -> Option<Value> {
        let root = name.trim().split(['.', '[']).next().unwrap_or_default().to_ascii_uppercase();
        let shown = match root.as_str() {
            "$AXIS_ACT" => Some(e6axis(&self.arm.joints())),
            "$AXIS_ACT_MEAS" => Some(e6axis(&self.arm.measured())),
            "$POS_ACT" => Some(self.position(&self.arm.joints())),
            "$POS_ACT_MES" => Some(self.position(&self.arm.measured())),
            _ => None,
        };
        let mut variables = self.variables.borrow_mut();
        if let Some(structure) = shown {
            variables.put(&root, Value::Structure(structure), Access::ReadOnly);
        } else if root == "$TORQUE_AXIS_ACT" {
            for (k, torque) in self.torques().into_iter().enumerate() {
                variables.put(&format!("$TORQUE_AXIS_ACT[{}]", k + 1), Value::Real(torque), Access::ReadOnly);
            }
        }
        variables.get(name)
    }

    /// Writes a variable.
    ///
    /// # Errors
    /// If there is no such variable, it may not be written, or the value has another type or is out of range.
    pub fn set(&self, name: &str, value: &Value) -> Result<(), NotWritten> {
        let begins = name.trim().eq_ignore_ascii_case("COM_ACTION") && value.number().is_some_and(|action| action != 0.0);
        if begins && self.arm.floor.faults.borrow_mut().strikes(Fault::Refuse, 0) {
            return Err(NotWritten::Refused);
        }
        self.variables.borrow_mut().set(name, value)?;
        self.written.notify_one();
        Ok(())
    }

    /// Sets a variable, as the controller itself does.
    pub fn put(&self, name: &str, value: Value, access: Access) {
        self.variables.borrow_mut().put(name, value, access);
    }

    /// Value of a numeric variable; 0 if it is not a number.
    pub fn number(&self, name: &str) -> f64 {
        self.get(name).and_then(|value| value.number()).unwrap_or_default()
    }

    /// Value of a structure variable; empty if it is not a structure.
    pub fn structure(&self, name: &str) -> Structure {
        self.get(name).and_then(|value| value.structure().cloned()).unwrap_or_default()
    }

    /// Value of a frame variable.
    pub fn frame(&self, name: &str) -> Pose {
        frame_of(&self.structure(name)).map_or_else(Pose::identity, |frame| frame.pose())
    }

    /// True if the order in progress is to be cancelled.
    pub fn is_cancelled(&self) -> bool {
        self.get("COM_CANCEL") == Some(Value::Bool(true))
    }

    /// Pose of the TCP in the controller's base.
    pub fn base_from_tool(&self, q: &[f64]) -> Pose {
        let root_from_flange = self.arm.posture(q).flange().pose() * LAST_FRAME_FROM_FLANGE.pose();
        self.frame("$BASE").inverse() * root_from_flange * self.frame("$TOOL")
    }

    /// Pose of the TCP in the controller's base as an E6POS.
    fn position(&self, q: &[f64]) -> Structure {
        let mut position = krl_frame(&FramePose::from_pose(&self.base_from_tool(q)));
        position.kind = Some("E6POS".into());
        position.members.push(("S".into(), Value::Integer(self.status(q))));
        position.members.push(("T".into(), Value::Integer(turn(q))));
        position.members.extend((1..=6).map(|k| (format!("E{k}"), Value::Real(0.0))));
        position
    }

    /// Status: bit 0 is set if the wrist is behind the first axis, bit 1 if the forearm is bent beyond its own offset, bit 2
    /// if the wrist is bent to the negative side.
    fn status(&self, q: &[f64]) -> i64 {
        let [.., _, _, fourth, _, _] = self.arm.robot.links.as_slice() else { return 0 };
        let posture = self.arm.posture(q);
        let first = posture.frame(1);
        let behind = (posture.frame(4).o - first.o).dot(&first.x) < 0.0;
        let straight = fourth.mdh.a.atan2(fourth.mdh.d.abs());
        i64::from(behind) | i64::from(q[2] >= straight) << 1 | i64::from(q[4] < 0.0) << 2
    }

    /// Gravity torque at each joint, N·m, without payload.
    fn torques(&self) -> Vec<f64> {
        let q = self.arm.joints();
        let mut loads = Loads::new(q.len());
        loads.compute(&self.arm.robot, &self.arm.posture(&q), &Payload::none(), &self.gravity, &Vector3::zeros());
        loads.tau.iter().map(|moment| -moment).collect()
    }
}

/// Turn: bit k is set if joint k + 1 is negative.
fn turn(q: &[f64]) -> i64 {
    q.iter().enumerate().map(|(k, angle)| i64::from(*angle < 0.0) << k).sum()
}
