//! The program on the served controller: a loop that executes the action in `COM_ACTION`, and sets it to zero when done.

use std::rc::Rc;

use calibench::cell::kuka::{Actions, frame_of, joints_of, krl_frame};
use calibench::robot::{FramePose, Pose};
use calibench_wire::kuka::{Value, Verdict};

use super::controller::{Controller, LAST_FRAME_FROM_FLANGE};
use super::variables::Access;
use crate::arm::{NotThere, Way};
use crate::service::Loop;

/// Action "set speed", by RoboDK's number; known to the plain program only.
const SET_SPEED: i64 = 6;
/// Action "wait", by RoboDK's number; known to the plain program only.
const WAIT: i64 = 9;
/// Action "set a digital output", by RoboDK's number; known to the plain program only.
const SET_OUTPUT: i64 = 10;

/// Reasons why an order was not carried out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Failed {
    /// The order failed; the program continues.
    Order(Verdict),
    /// The arm cannot follow a straight line: the controller stops the program with a message.
    Stopped,
    /// Emergency stop: the program halts.
    Emergency,
}

/// Runs the program, again after each stop that is reset.
pub async fn run(controller: Rc<Controller>, kind: Loop) {
    loop {
        let action = controller.number("COM_ACTION") as i64;
        if action == 0 {
            controller.written.notified().await;
            continue;
        }
        let order = controller.number("COM_ORDER");
        if kind == Loop::Plain || order != controller.number("COM_DONE") {
            let done = Program(&controller).execute(action, kind).await;
            let result = match done {
                Ok(()) => Verdict::Done,
                Err(Failed::Order(verdict)) => verdict,
                Err(stop @ (Failed::Stopped | Failed::Emergency)) => {
                    controller.put("$PRO_STATE1", Value::Enumerator("P_STOP".into()), Access::ReadOnly);
                    controller.put("$STOPMESS", Value::Bool(true), Access::ReadOnly);
                    for name in ["$ALARM_STOP", "$PERI_RDY"].into_iter().filter(|_| stop == Failed::Emergency) {
                        controller.put(name, Value::Bool(false), Access::ReadOnly);
                    }
                    controller.reset.notified().await;
                    continue;
                }
            };
            controller.put("COM_RESULT", Value::Integer(result.number()), Access::Writable);
            controller.put("COM_CANCEL", Value::Bool(false), Access::Writable);
            controller.put("COM_DONE", Value::Integer(order as i64), Access::Writable);
        }
        controller.put("COM_ACTION", Value::Integer(0), Access::Writable);
    }
}

struct Program<'a>(&'a Controller);

impl Program<'_> {
    async fn execute(&self, action: i64, kind: Loop) -> Result<(), Failed> {
        let controller = self.0;
        let numbers = Actions::default();
        match action {
            _ if controller.is_cancelled() => return Err(Failed::Order(Verdict::Cancelled)),
            _ if action == numbers.joints => {
                let mut target = joints_of(&controller.structure("COM_E6AXIS")).unwrap_or_default().to_vec();
                target.truncate(controller.arm.robot.joints());
                self.travel(target, None).await?;
            }
            _ if action == numbers.line => self.straight(&controller.frame("COM_E6POS")).await?,
            _ if action == numbers.tool => self.copy_frame("$TOOL"),
            _ if action == numbers.base => self.copy_frame("$BASE"),
            _ if kind == Loop::Calibench => return Err(Failed::Order(Verdict::UnknownAction)),
            SET_SPEED => controller.set("$VEL.CP", &Value::Real(controller.number("COM_VALUE1"))).unwrap_or_default(),
            WAIT => controller.arm.floor.wait(controller.number("COM_VALUE1").clamp(0.0, 3600.0)).await,
            SET_OUTPUT => {
                let output = format!("$OUT[{}]", controller.number("COM_VALUE1") as i64);
                // Without an output of that number nothing is switched.
                controller.set(&output, &Value::Bool(controller.number("COM_VALUE2") > 0.5)).unwrap_or_default();
            }
            // Unknown actions have no effect.
            _ => {}
        }
        Ok(())
    }

    fn copy_frame(&self, name: &str) {
        if let Some(frame) = frame_of(&self.0.structure("COM_FRAME")) {
            self.0.put(name, Value::Structure(krl_frame(&frame)), Access::Writable);
        }
    }

    /// Moves in a straight line to a pose of the TCP in the base.
    async fn straight(&self, base_from_tool: &Pose) -> Result<(), Failed> {
        let controller = self.0;
        let from = controller.base_from_tool(&controller.arm.joints());
        let distance = (base_from_tool.translation.vector - from.translation.vector).norm();
        // Solved as the controller does: with the nominal arm, and the tool attached to its flange.
        let tool = FramePose::from_pose(&(LAST_FRAME_FROM_FLANGE.pose() * controller.frame("$TOOL")));
        let root_from_tool = controller.frame("$BASE") * base_from_tool;
        let target = controller.arm.joints_for(&root_from_tool, &tool).ok_or(Failed::Stopped)?;
        self.travel(target, Some(distance)).await
    }

    /// Moves to these joints, in a straight line of this length of the TCP or joint by joint.
    async fn travel(&self, target: Vec<f64>, straight: Option<f64>) -> Result<(), Failed> {
        let controller = self.0;
        let speed = controller.number("$OV_PRO") / 100.0;
        let cancelled = async {
            while !controller.is_cancelled() {
                controller.written.notified().await;
            }
        };
        controller.arm.travel(Way { target, straight, speed }, cancelled).await.map_err(|reason| match reason {
            NotThere::JointLimit(_) if straight.is_some() => Failed::Stopped,
            NotThere::JointLimit(joint) => Failed::Order(Verdict::JointLimit(joint + 1)),
            NotThere::Cancelled => Failed::Order(Verdict::Cancelled),
            NotThere::Impossible => Failed::Order(Verdict::Unreachable),
            NotThere::Emergency | NotThere::ProtectiveStop | NotThere::PowerOff | NotThere::Freedrive => Failed::Emergency,
        })
    }
}
