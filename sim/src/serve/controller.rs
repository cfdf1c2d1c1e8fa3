//! The robot's controller as its variables show it: where the arm is, what it was told, whether it is stopped.

use std::cell::RefCell;
use std::f64::consts::PI;
use std::rc::Rc;
use std::time::Duration;

use calibench::cell::Manipulator;
use calibench::cell::kuka::{Structure, Value, e6axis, frame_of, krl_frame};
use calibench::robot::{FramePose, Loads, Payload, Pose, Posture, Robot, SiteIndex};
use nalgebra::Vector3;
use tokio::sync::{Notify, watch};
use tokio::time::Instant;

use super::fault::Fault;
use super::floor::Floor;
use super::variables::{Access, NotWritten, Variables};

/// KUKA's flange in the last frame of the KR 6's drawing (paper, Table 4), whose z axis points back into the wrist.
pub const LAST_FRAME_FROM_FLANGE: FramePose = FramePose { xyz: [0.0; 3], rz_ry_rx: [0.0, PI, 0.0] };

/// What the controller has of its own, beside what follows from the arm.
const SYSTEM: &str = "\
    $ABS_ACCUR FALSE
    $KR_SERIALNO 700700";

/// What is also read only, and changes with what happens.
const STATE: &str = "\
    $PRO_STATE1 #P_ACTIVE
    $STOPMESS FALSE
    $ALARM_STOP TRUE
    $USER_SAF TRUE
    $PERI_RDY TRUE";

/// What programs and clients write.
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

/// A motion that is going on.
#[derive(Debug, Clone)]
pub struct Underway {
    /// Joints where it began, rad.
    pub from: Vec<f64>,
    /// Joints where it will end, rad.
    pub to: Vec<f64>,
    /// When it began.
    pub began: Instant,
    /// How long it takes on our clock.
    pub takes: Duration,
}

/// The controller of the served robot.
pub struct Controller {
    /// The cell.
    pub floor: Rc<Floor>,
    /// The arm as its controller knows it.
    pub robot: Robot,
    /// Rung when a variable was written.
    pub written: Notify,
    /// Counts how often all links were broken.
    pub broken_links: watch::Sender<u64>,
    variables: RefCell<Variables>,
    underway: RefCell<Option<Underway>>,
    gravity: Vector3<f64>,
}

impl Controller {
    /// The controller of `robot` on that floor, its program running in operating mode `mode` (`T1`, `AUT` ...); it knows that tool in
    /// the robot's last frame.
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
        let (broken_links, _) = watch::channel(0);
        Controller {
            floor,
            robot,
            written: Notify::new(),
            broken_links,
            variables: RefCell::new(variables),
            underway: RefCell::default(),
            gravity,
        }
    }

    /// The value of a variable.
    pub fn get(&self, name: &str) -> Option<Value> {
        let root = name.trim().split(['.', '[']).next().unwrap_or_default().to_ascii_uppercase();
        let shown = match root.as_str() {
            "$AXIS_ACT" => Some(e6axis(&self.joints())),
            "$AXIS_ACT_MEAS" => Some(e6axis(&self.measured())),
            "$POS_ACT" => Some(self.position(&self.joints())),
            "$POS_ACT_MES" => Some(self.position(&self.measured())),
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
    /// When there is none, it may not be written, or the value is of another type or out of its range.
    pub fn set(&self, name: &str, value: &Value) -> Result<(), NotWritten> {
        let begins = name.trim().eq_ignore_ascii_case("COM_ACTION") && value.number().is_some_and(|action| action != 0.0);
        if begins && self.floor.faults.borrow_mut().strikes(Fault::Refuse, 0) {
            return Err(NotWritten::Refused);
        }
        self.variables.borrow_mut().set(name, value)?;
        self.written.notify_one();
        Ok(())
    }

    /// Gives a variable its value, as the controller itself does.
    pub fn put(&self, name: &str, value: Value, access: Access) {
        self.variables.borrow_mut().put(name, value, access);
    }

    /// A variable that is a number; 0 where it is none.
    pub fn number(&self, name: &str) -> f64 {
        self.get(name).and_then(|value| value.number()).unwrap_or_default()
    }

    /// A variable that is a structure; empty where it is none.
    pub fn structure(&self, name: &str) -> Structure {
        self.get(name).and_then(|value| value.structure().cloned()).unwrap_or_default()
    }

    /// A variable that is a frame.
    pub fn frame(&self, name: &str) -> Pose {
        frame_of(&self.structure(name)).map_or_else(Pose::identity, |frame| frame.pose())
    }

    /// Whether the order under way is to be broken off.
    pub fn is_cancelled(&self) -> bool {
        self.get("COM_CANCEL") == Some(Value::Bool(true))
    }

    /// A motion begins, or none is going on.
    pub fn set_underway(&self, underway: Option<Underway>) {
        *self.underway.borrow_mut() = underway;
    }

    /// Joint angles commanded at this moment, rad.
    pub fn joints(&self) -> Vec<f64> {
        self.on_the_way().unwrap_or_else(|| self.floor.world.commanded())
    }

    /// Joint angles that the encoders show at this moment, rad.
    fn measured(&self) -> Vec<f64> {
        // An arm whose simulation failed shows no more than what it was told.
        self.on_the_way().or_else(|| self.floor.world.robot().joints().ok()).unwrap_or_else(|| self.floor.world.commanded())
    }

    fn on_the_way(&self) -> Option<Vec<f64>> {
        let underway = self.underway.borrow();
        let Underway { from, to, began, takes } = underway.as_ref()?;
        let share = (began.elapsed().as_secs_f64() / takes.as_secs_f64().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
        Some(from.iter().zip(to).map(|(from, to)| from + share * (to - from)).collect())
    }

    fn posture(&self, q: &[f64]) -> Posture {
        let mut posture = Posture::new(&self.robot);
        let none = FramePose { xyz: [0.0; 3], rz_ry_rx: [0.0; 3] };
        posture.set(&self.robot, &none, &none, q, &vec![0.0; SiteIndex::new(q.len()).len()]);
        posture
    }

    /// The TCP in the controller's base.
    pub fn base_from_tool(&self, q: &[f64]) -> Pose {
        let root_from_flange = self.posture(q).flange().pose() * LAST_FRAME_FROM_FLANGE.pose();
        self.frame("$BASE").inverse() * root_from_flange * self.frame("$TOOL")
    }

    /// As an E6POS.
    fn position(&self, q: &[f64]) -> Structure {
        let mut position = krl_frame(&FramePose::from_pose(&self.base_from_tool(q)));
        position.kind = Some("E6POS".into());
        position.members.push(("S".into(), Value::Integer(self.status(q))));
        position.members.push(("T".into(), Value::Integer(turn(q))));
        position.members.extend((1..=6).map(|k| (format!("E{k}"), Value::Real(0.0))));
        position
    }

    /// Status: bit 0 where the wrist is behind the first axis, bit 1 where the forearm is bent beyond its own offset, bit 2 where the
    /// wrist is bent to the negative side.
    fn status(&self, q: &[f64]) -> i64 {
        let [.., _, _, fourth, _, _] = self.robot.links.as_slice() else { return 0 };
        let posture = self.posture(q);
        let first = posture.frame(1);
        let behind = (posture.frame(4).o - first.o).dot(&first.x) < 0.0;
        let straight = fourth.mdh.a.atan2(fourth.mdh.d.abs());
        i64::from(behind) | i64::from(q[2] >= straight) << 1 | i64::from(q[4] < 0.0) << 2
    }

    /// What gravity asks of each joint, N·m, nothing on the flange.
    fn torques(&self) -> Vec<f64> {
        let q = self.joints();
        let mut loads = Loads::new(q.len());
        loads.weigh(&self.robot, &self.posture(&q), &Payload::none(), &self.gravity, &Vector3::zeros());
        loads.tau.iter().map(|moment| -moment).collect()
    }
}

/// Turn: bit k where joint k + 1 is negative.
fn turn(q: &[f64]) -> i64 {
    q.iter().enumerate().map(|(k, angle)| i64::from(*angle < 0.0) << k).sum()
}
