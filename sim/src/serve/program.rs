//! The program on the served controller: a loop that does what `COM_ACTION` asks for, and sets it to zero when it is done.

use std::rc::Rc;

use calibench::cell::Manipulator;
use calibench::cell::kuka::{Value, frame_of, joints_of, krl_frame};
use calibench::robot::{Chain, FramePose, InverseKinematics, Outcome, Pose};
use tokio::time::Instant;

use super::controller::{Controller, LAST_FRAME_FROM_FLANGE, Underway};
use super::fault::Fault;
use super::variables::Access;

/// What `COM_ACTION` may ask for. The numbers up to 13 are those of RoboDK's program; the last is our own.
const PTP: i64 = 2;
const LIN: i64 = 3;
const SET_TOOL: i64 = 5;
const SET_SPEED: i64 = 6;
const WAIT: i64 = 9;
const SET_OUTPUT: i64 = 10;
const SET_BASE: i64 = 14;
const LIN_IN_TOOL: i64 = 15;

/// A motion that is slow takes so many times as long.
const SLOW: f64 = 10.0;

/// Why the program stopped.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Stop {
    /// A motion leads out of a joint's limits, or nowhere.
    NoWay,
    /// The emergency stop.
    Emergency,
}

/// Runs the program until it is stopped; then it does nothing more.
pub async fn run(controller: Rc<Controller>) {
    loop {
        let action = controller.number("COM_ACTION") as i64;
        if action == 0 {
            controller.written.notified().await;
            continue;
        }
        let done = Program(&controller).execute(action).await;
        controller.set_underway(None);
        if let Err(stop) = done {
            controller.put("$PRO_STATE1", Value::Enumerator("P_STOP".into()), Access::ReadOnly);
            controller.put("$STOPMESS", Value::Bool(true), Access::ReadOnly);
            if stop == Stop::Emergency {
                controller.put("$ALARM_STOP", Value::Bool(false), Access::ReadOnly);
                controller.put("$PERI_RDY", Value::Bool(false), Access::ReadOnly);
            }
            return;
        }
        controller.put("COM_ACTION", Value::Integer(0), Access::Writable);
    }
}

struct Program<'a>(&'a Controller);

impl Program<'_> {
    async fn execute(&self, action: i64) -> Result<(), Stop> {
        let controller = self.0;
        match action {
            PTP => {
                let mut target = joints_of(&controller.structure("COM_E6AXIS")).unwrap_or_default().to_vec();
                target.truncate(controller.robot.joints());
                self.travel(target, None).await?;
            }
            LIN => self.straight(&controller.frame("COM_E6POS")).await?,
            LIN_IN_TOOL => {
                let here = controller.base_from_tool(&controller.joints());
                self.straight(&(here * controller.frame("COM_FRAME"))).await?;
            }
            SET_TOOL => self.copy_frame("$TOOL"),
            SET_BASE => self.copy_frame("$BASE"),
            SET_SPEED => controller.set("$VEL.CP", &Value::Real(controller.number("COM_VALUE1"))).unwrap_or_default(),
            WAIT => controller.floor.wait(controller.number("COM_VALUE1").clamp(0.0, 3600.0)).await,
            SET_OUTPUT => {
                let output = format!("$OUT[{}]", controller.number("COM_VALUE1") as i64);
                // A number without an output switches nothing.
                controller.set(&output, &Value::Bool(controller.number("COM_VALUE2") > 0.5)).unwrap_or_default();
            }
            // Numbers without an action are done at once.
            _ => {}
        }
        Ok(())
    }

    fn copy_frame(&self, name: &str) {
        if let Some(frame) = frame_of(&self.0.structure("COM_FRAME")) {
            self.0.put(name, Value::Structure(krl_frame(&frame)), Access::Writable);
        }
    }

    /// Straight to a pose of the TCP in the base.
    async fn straight(&self, base_from_tool: &Pose) -> Result<(), Stop> {
        let controller = self.0;
        let start = controller.joints();
        let from = controller.base_from_tool(&start);
        let distance = (base_from_tool.translation.vector - from.translation.vector).norm();
        // As the controller solves it: the nominal arm, its tool after its flange.
        let tool = FramePose::from_pose(&(LAST_FRAME_FROM_FLANGE.pose() * controller.frame("$TOOL")));
        let root_from_tool = controller.frame("$BASE") * base_from_tool;
        let mut arm = Chain::nominal(&controller.robot, &FramePose { xyz: [0.0; 3], rz_ry_rx: [0.0; 3] }, &tool);
        let limits = |joint: usize| controller.robot.links[joint].limits;
        let solution = InverseKinematics::new(start.len()).solve(&mut arm, &root_from_tool, &start, limits);
        if solution.outcome != Outcome::Converged {
            return Err(Stop::NoWay);
        }
        self.travel(solution.q, Some(distance)).await
    }

    /// To these joints, straight for a distance of the TCP or joint by joint.
    async fn travel(&self, target: Vec<f64>, straight: Option<f64>) -> Result<(), Stop> {
        let controller = self.0;
        let floor = &controller.floor;
        floor.traffic.note_motion();
        let strikes = |fault| floor.faults.borrow_mut().strikes(fault, 0);
        if strikes(Fault::JointLimit) || controller.robot.outside_limits(&target, 0.0).is_some() {
            return Err(Stop::NoWay);
        }
        floor.take_master();
        let from = controller.joints();
        let emergency = strikes(Fault::Estop);
        let target = if emergency { from.iter().zip(&target).map(|(from, to)| 0.5 * (from + to)).collect() } else { target };
        let override_ = (controller.number("$OV_PRO") / 100.0).clamp(0.01, 1.0);
        let duration_s = floor.world.motion_s(&target) / override_ * if strikes(Fault::Slow) { SLOW } else { 1.0 };
        let takes = floor.wall(duration_s);
        controller.set_underway(Some(Underway { from, to: target.clone(), began: Instant::now(), takes }));
        if strikes(Fault::DropLink) {
            controller.broken_links.send_modify(|times| *times += 1);
        }
        floor.wait(duration_s).await;
        let moved = match straight {
            Some(distance) => floor.world.move_straight(&target, distance),
            None => floor.world.robot().move_joints(&target),
        };
        match moved {
            Err(_) => Err(Stop::NoWay),
            Ok(()) if emergency => Err(Stop::Emergency),
            Ok(()) => Ok(()),
        }
    }
}
