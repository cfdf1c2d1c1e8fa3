//! The functions of URScript that reach for the robot.

use std::rc::Rc;
use std::time::Duration;

use calibench::cell::ur::{numbers_of, pose_of};
use calibench::robot::FramePose;
use calibench_wire::ur::Datum;
use tokio::time::sleep;

use super::controller::Controller;
use crate::arm::{NotThere, Way};
use crate::fault::Fault;
use crate::script::{Arguments, Host, Trouble, Value};

/// Cycle of the controller.
const CYCLE: Duration = Duration::from_millis(2);

/// Functions that have no effect on the twin: messages for the operator, and settings of what it does not simulate.
const WITHOUT_EFFECT: [&str; 20] = [
    "textmsg",
    "popup",
    "rtde_set_watchdog",
    "stopj",
    "stopl",
    "set_gravity",
    "set_payload_mass",
    "set_payload_cog",
    "force_mode_set_damping",
    "force_mode_set_gain_scaling",
    "end_force_mode",
    "end_teach_mode",
    "end_freedrive_mode",
    "set_target_payload_inertia",
    "set_digital_out",
    "set_standard_digital_out",
    "set_configurable_digital_out",
    "set_tool_digital_out",
    "set_analog_out",
    "set_standard_analog_out",
];

/// The functions of this controller.
pub struct Functions {
    /// The controller.
    pub controller: Rc<Controller>,
    /// True if the program may move the arm.
    pub moves: bool,
}

impl Host for Functions {
    async fn call(&self, name: &str, arguments: &Arguments) -> Result<Value, Trouble> {
        let controller = &self.controller;
        let arm = &controller.arm;
        match name {
            "sync" => sleep(CYCLE).await,
            "sleep" => sleep(Duration::try_from_secs_f64(number(arguments, 0, "t")?).unwrap_or(CYCLE)).await,
            "movej" | "movel" => return self.travel(name == "movel", arguments).await,
            "is_steady" => return Ok(Value::Bool(!arm.is_moving())),
            "is_within_safety_limits" => return Ok(Value::Bool(self.joints_to(arguments)?.is_some())),
            "get_inverse_kin_has_solution" => return Ok(Value::Bool(self.joints_to(arguments)?.is_some())),
            "get_inverse_kin" => {
                let joints = self.joints_to(arguments)?.ok_or_else(|| Trouble::new("the pose cannot be reached"))?;
                return Ok(list(&joints));
            }
            "get_forward_kin" => {
                let q = arguments.numbers(0, "q").unwrap_or_else(|| arm.joints());
                return Ok(Value::Pose(numbers_of(&controller.tool_at(&six(&q)?))));
            }
            "get_actual_joint_positions" => return Ok(list(&arm.measured())),
            "get_target_joint_positions" => return Ok(list(&arm.joints())),
            "get_actual_tcp_pose" => return Ok(Value::Pose(numbers_of(&controller.tool_at(&arm.measured())))),
            "get_target_tcp_pose" => return Ok(Value::Pose(numbers_of(&controller.tool_at(&arm.joints())))),
            "get_tcp_offset" => return Ok(Value::Pose(controller.tool())),
            "get_steptime" => return Ok(Value::Float(CYCLE.as_secs_f64())),
            "set_tcp" => controller.set_tool(pose_argument(arguments, 0, "pose")?),
            "set_payload" | "set_target_payload" => {
                let com = arguments.numbers(1, "cog").unwrap_or_default();
                let at = |k: usize| com.get(k).copied().unwrap_or_default();
                controller.set_payload([number(arguments, 0, "m")?, at(0), at(1), at(2)]);
            }
            "get_target_payload" => return Ok(Value::Float(controller.output("payload").real())),
            "pose_trans" => {
                return Ok(Value::Pose(numbers_of(
                    &(pose_of(pose_argument(arguments, 0, "p_from")?) * pose_of(pose_argument(arguments, 1, "p_from_to")?)),
                )));
            }
            "pose_inv" => return Ok(Value::Pose(numbers_of(&pose_of(pose_argument(arguments, 0, "p_from")?).inverse()))),
            "set_speed" => controller.take_inputs(slider(number(arguments, 0, "fraction")?)),
            _ if WITHOUT_EFFECT.contains(&name) => {}
            _ => return self.register(name, arguments),
        }
        Ok(Value::None)
    }
}

impl Functions {
    /// Reads or writes a general-purpose register.
    fn register(&self, name: &str, arguments: &Arguments) -> Result<Value, Trouble> {
        let unknown = || Trouble::new(format!("the twin does not know the function {name}"));
        let (action, rest) = name.split_once('_').ok_or_else(unknown)?;
        let rest = rest.strip_suffix("_register").ok_or_else(unknown)?;
        let (side, kind) = rest.split_once('_').ok_or_else(unknown)?;
        let kind = match kind {
            "integer" => "int",
            "float" => "double",
            "boolean" => "bit",
            _ => return Err(unknown()),
        };
        let number = arguments.integer(0, "address").ok_or_else(|| Trouble::new("a register has a number"))?;
        let name = format!("{side}_{kind}_register_{number}");
        let value = match action {
            "read" if side == "input" => self.controller.input_register(&name),
            "read" => self.controller.output_register(&name),
            "write" if side == "output" => {
                let value = match (kind, arguments.get(1, "value")) {
                    ("int", Some(value)) => value.integer().map(|value| Datum::Integers(vec![value])),
                    ("double", Some(value)) => value.number().map(|value| Datum::Reals(vec![value])),
                    ("bit", Some(value)) => value.boolean().map(|value| Datum::Integers(vec![i64::from(value)])),
                    _ => None,
                };
                self.controller.put(name, value.ok_or_else(|| Trouble::new("the value does not fit the register"))?);
                return Ok(Value::None);
            }
            _ => return Err(unknown()),
        };
        Ok(match kind {
            "int" => Value::Integer(value.integer()),
            "bit" => Value::Bool(value.integer() != 0),
            _ => Value::Float(value.real()),
        })
    }

    /// The joints of the first argument, joints or a pose of the tool; `None` if they are beyond the limits or out of reach.
    fn joints_to(&self, arguments: &Arguments) -> Result<Option<Vec<f64>>, Trouble> {
        let controller = &self.controller;
        let joints = match arguments.pose(0, "pose") {
            Some(target) => {
                let tool = FramePose::from_pose(&pose_of(controller.tool()));
                controller.arm.joints_for(&pose_of(target), &tool)
            }
            None => Some(six(&arguments.numbers(0, "q").unwrap_or_default())?.to_vec()),
        };
        Ok(joints.filter(|q| controller.arm.robot.outside_limits(q, 0.0).is_none()))
    }

    async fn travel(&self, is_straight: bool, arguments: &Arguments) -> Result<Value, Trouble> {
        let controller = &self.controller;
        let arm = &controller.arm;
        if !self.moves {
            return Err(Trouble::new("a secondary program cannot move the arm"));
        }
        if arm.floor.faults.borrow_mut().strikes(Fault::Refuse, 0) {
            return Err(Trouble::new("the motion is refused"));
        }
        let target =
            self.joints_to(arguments)?.ok_or_else(|| Trouble::new("the target is beyond the limits or out of reach"))?;
        let way = |at: &[f64]| controller.tool_at(at).translation.vector;
        let straight = is_straight.then(|| (way(&target) - way(&arm.joints())).norm());
        match arm.travel(Way { target, straight, speed: controller.speed() }, std::future::pending()).await {
            Ok(()) => Ok(Value::None),
            Err(reason) => {
                if controller.note_stop(reason) {
                    // The program is paused here until somebody stops it.
                    std::future::pending::<()>().await;
                }
                Err(Trouble::new(match reason {
                    NotThere::JointLimit(joint) => format!("joint {} would leave its limits", joint + 1),
                    NotThere::Emergency => "the emergency stop is pressed".into(),
                    NotThere::PowerOff => "the arm has no power".into(),
                    NotThere::Freedrive => "the arm is in freedrive".into(),
                    NotThere::ProtectiveStop | NotThere::Cancelled | NotThere::Impossible => "the motion cannot be made".into(),
                }))
            }
        }
    }
}

fn slider(fraction: f64) -> impl Iterator<Item = (String, Datum)> {
    [("speed_slider_mask", 1.0), ("speed_slider_fraction", fraction)]
        .into_iter()
        .map(|(name, value)| (name.to_owned(), Datum::Reals(vec![value])))
}

fn number(arguments: &Arguments, position: usize, name: &str) -> Result<f64, Trouble> {
    arguments.number(position, name).ok_or_else(|| Trouble::new(format!("the argument {name} is not a number")))
}

fn pose_argument(arguments: &Arguments, position: usize, name: &str) -> Result<[f64; 6], Trouble> {
    arguments.pose(position, name).ok_or_else(|| Trouble::new(format!("the argument {name} is not a pose")))
}

fn six(numbers: &[f64]) -> Result<[f64; 6], Trouble> {
    numbers.try_into().map_err(|_| Trouble::new("six joints are expected"))
}

fn list(numbers: &[f64]) -> Value {
    Value::List(numbers.iter().map(|number| Value::Float(*number)).collect())
}
