//! The program on the served controller: a loop that executes the action in `COM_ACTION`, and sets it to zero when done.

use std::rc::Rc;

use calibench::cell::kuka::{Actions, Value, Verdict, frame_of, joints_of, krl_frame};
use calibench::cell::{Manipulator, ManipulatorError};
use calibench::robot::inverse::{Chain, InverseKinematics, Outcome};
use calibench::robot::{FramePose, Pose};
use tokio::time::{Instant, sleep_until};

use super::controller::{Controller, LAST_FRAME_FROM_FLANGE, Underway};
use super::fault::Fault;
use super::service::Loop;
use super::variables::Access;

/// Action "set speed", by RoboDK's number; known to the plain program only.
const SET_SPEED: i64 = 6;
/// Action "wait", by RoboDK's number; known to the plain program only.
const WAIT: i64 = 9;
/// Action "set a digital output", by RoboDK's number; known to the plain program only.
const SET_OUTPUT: i64 = 10;

/// Factor on the duration of a slow motion.
const SLOW: f64 = 10.0;

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
            controller.set_underway(None);
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
                target.truncate(controller.robot.joints());
                self.travel(target, None).await?;
            }
            _ if action == numbers.line => self.straight(&controller.frame("COM_E6POS")).await?,
            _ if action == numbers.tool => self.copy_frame("$TOOL"),
            _ if action == numbers.base => self.copy_frame("$BASE"),
            _ if kind == Loop::Calibench => return Err(Failed::Order(Verdict::UnknownAction)),
            SET_SPEED => controller.set("$VEL.CP", &Value::Real(controller.number("COM_VALUE1"))).unwrap_or_default(),
            WAIT => controller.floor.wait(controller.number("COM_VALUE1").clamp(0.0, 3600.0)).await,
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
        let start = controller.joints();
        let from = controller.base_from_tool(&start);
        let distance = (base_from_tool.translation.vector - from.translation.vector).norm();
        // Solved as the controller does: with the nominal arm, and the tool attached to its flange.
        let tool = FramePose::from_pose(&(LAST_FRAME_FROM_FLANGE.pose() * controller.frame("$TOOL")));
        let root_from_tool = controller.frame("$BASE") * base_from_tool;
        let mut arm = Chain::nominal(&controller.robot, &FramePose { xyz: [0.0; 3], rz_ry_rx: [0.0; 3] }, &tool);
        let limits = |joint: usize| controller.robot.links[joint].limits;
        let solution = InverseKinematics::new(start.len()).solve(&mut arm, &root_from_tool, &start, limits);
        if solution.outcome != Outcome::Converged {
            return Err(Failed::Stopped);
        }
        self.travel(solution.q, Some(distance)).await
    }

    /// Moves to these joints, in a straight line of this length of the TCP or joint by joint.
    async fn travel(&self, target: Vec<f64>, straight: Option<f64>) -> Result<(), Failed> {
        let controller = self.0;
        let floor = &controller.floor;
        floor.traffic.note_motion();
        let strikes = |fault| floor.faults.borrow_mut().strikes(fault, 0);
        let nearest_limit = (straight.is_none() && strikes(Fault::JointLimit)).then(|| self.nearest_limit(&target));
        if let Some(joint) = nearest_limit.or_else(|| controller.robot.outside_limits(&target, 0.0)) {
            return Err(if straight.is_some() { Failed::Stopped } else { Failed::Order(Verdict::JointLimit(joint + 1)) });
        }
        floor.take_master();
        let from = controller.joints();
        let emergency = strikes(Fault::Estop);
        let target = if emergency { from.iter().zip(&target).map(|(from, to)| 0.5 * (from + to)).collect() } else { target };
        let speed = (controller.number("$OV_PRO") / 100.0).clamp(0.01, 1.0);
        let duration_s = floor.world.motion_s(&target) / speed * if strikes(Fault::Slow) { SLOW } else { 1.0 };
        let (began, takes) = (Instant::now(), floor.wall(duration_s));
        controller.set_underway(Some(Underway { from, to: target.clone(), began, takes }));
        if strikes(Fault::DropLink) {
            controller.broken_links.send_modify(|times| *times += 1);
        }
        let is_whole = loop {
            tokio::select! {
                biased;
                () = controller.written.notified() => if controller.is_cancelled() { break false },
                () = sleep_until(began + takes) => break true,
            }
        };
        let target = if is_whole { target } else { controller.joints() };
        floor.tell_time();
        let moved = match straight {
            Some(distance) => floor.world.move_straight(&target, distance),
            None => floor.world.robot().move_joints(&target),
        };
        match moved {
            Err(ManipulatorError::Collision { between: [one, other] }) => {
                eprintln!("COLLISION: {one} touched {other}; the arm stands still");
                Err(Failed::Emergency)
            }
            Err(_) => Err(Failed::Order(Verdict::Unreachable)),
            Ok(()) if !is_whole => Err(Failed::Order(Verdict::Cancelled)),
            Ok(()) if emergency => Err(Failed::Emergency),
            Ok(()) => Ok(()),
        }
    }

    /// The joint, counted from 0, that is nearest to one of its limits.
    fn nearest_limit(&self, q: &[f64]) -> usize {
        let links = &self.0.robot.links;
        let margin = |joint: &usize| (q[*joint] - links[*joint].limits[0]).min(links[*joint].limits[1] - q[*joint]);
        (0..q.len()).min_by(|a, b| margin(a).total_cmp(&margin(b))).unwrap_or_default()
    }
}
