//! A motion that would take a joint near its limit, the TCP out of its box, or the gauge further than it may step, never reaches the
//! robot; nor does any after a stop was requested. Every one is logged.

use std::cell::RefCell;
use std::rc::Rc;
use std::sync::Arc;

use calibench::cell::guards::{Guarded, Guards, Motion, MotionRecord};
use calibench::cell::{Manipulator, ManipulatorError, StopRequest};
use calibench::robot::{FramePose, built_in};
use calibench::units::{DEG, MM};
use nalgebra::Vector3;

/// An arm that goes where it is told, and remembers.
struct Obedient {
    joints: Vec<f64>,
    sent: Rc<RefCell<Vec<Motion>>>,
}

impl Manipulator for Obedient {
    fn joints(&mut self) -> Result<Vec<f64>, ManipulatorError> {
        Ok(self.joints.clone())
    }

    fn move_joints(&mut self, target: &[f64]) -> Result<(), ManipulatorError> {
        self.joints = target.to_vec();
        self.sent.borrow_mut().push(Motion::Joints(target.to_vec()));
        Ok(())
    }

    fn move_in_tool(&mut self, offset: &Vector3<f64>) -> Result<(), ManipulatorError> {
        self.sent.borrow_mut().push(Motion::Tool(*offset));
        Ok(())
    }

    fn clock_s(&mut self) -> f64 {
        0.0
    }
}

struct Bench {
    robot: Guarded<Obedient>,
    sent: Rc<RefCell<Vec<Motion>>>,
    log: Rc<RefCell<Vec<MotionRecord>>>,
    stop: StopRequest,
}

/// A KR 6 at its home, where its flange is at (470, 0, 750) mm.
const HOME: [f64; 6] = [0.0, -90.0 * DEG, 90.0 * DEG, 0.0, 10.0 * DEG, 0.0];

fn bench(workspace: Option<[Vector3<f64>; 2]>) -> Bench {
    let (sent, log) = (Rc::new(RefCell::new(Vec::new())), Rc::new(RefCell::new(Vec::new())));
    let guards = Guards {
        robot: Arc::new(built_in("kr6_r700").unwrap()),
        base: FramePose::default(),
        tool: FramePose::default(),
        joint_margin: 2.0 * DEG,
        max_step: 5.0 * MM,
        workspace,
    };
    let stop = StopRequest::default();
    let robot = Obedient { joints: HOME.to_vec(), sent: Rc::clone(&sent) };
    let kept = Rc::clone(&log);
    let note = Box::new(move |record: &MotionRecord| kept.borrow_mut().push(record.clone()));
    Bench { robot: Guarded::new(robot, guards, stop.clone(), note), sent, log, stop }
}

fn turned(joint: usize, degrees: f64) -> Vec<f64> {
    let mut q = HOME.to_vec();
    q[joint] = degrees * DEG;
    q
}

#[test]
fn joints_keep_their_margin() {
    let mut b = bench(None);
    // A1 may turn 170 degrees each way: 167 is inside the margin of 2, 169 is not, nor is a value that is not a number.
    b.robot.move_joints(&turned(0, 167.0)).unwrap();
    for degrees in [169.0, -168.5, f64::NAN] {
        assert_eq!(b.robot.move_joints(&turned(0, degrees)), Err(ManipulatorError::JointLimit { joint: 1 }), "{degrees}");
    }
    assert!(matches!(b.robot.move_joints(&HOME[..5]), Err(ManipulatorError::Refused { .. })));
    assert_eq!(b.sent.borrow().len(), 1);
    assert_eq!(b.log.borrow().len(), 5);
    assert_eq!(b.log.borrow().iter().filter(|record| record.error.is_some()).count(), 4);
}

#[test]
fn steps_are_clamped_to_the_safe_range() {
    let mut b = bench(None);
    for step in [Vector3::new(5.0, 0.0, -5.0) * MM, Vector3::zeros()] {
        b.robot.move_in_tool(&step).unwrap();
    }
    for step in [Vector3::new(0.0, -5.001, 0.0) * MM, Vector3::new(0.0, 0.0, f64::NAN), Vector3::new(f64::INFINITY, 0.0, 0.0)] {
        assert!(matches!(b.robot.move_in_tool(&step), Err(ManipulatorError::Refused { .. })), "{step:?}");
    }
    assert_eq!(b.sent.borrow().len(), 2);
}

#[test]
fn the_tcp_stays_in_its_box_also_on_the_way() {
    // From one side to the other the arm swings out to y = 0, where x is 0.47 m and more.
    let box_ = [Vector3::new(-1.0, -1.0, 0.0), Vector3::new(0.45, 1.0, 1.5)];
    let mut b = bench(Some(box_));
    // It begins outside the box: it may come in.
    b.robot.move_joints(&turned(0, 60.0)).unwrap();
    assert!(
        matches!(b.robot.move_joints(&turned(0, -60.0)), Err(ManipulatorError::Refused { reason }) if reason.contains("workspace"))
    );
    assert!(matches!(b.robot.move_joints(&turned(0, 0.0)), Err(ManipulatorError::Refused { .. })));
    assert_eq!(b.sent.borrow().len(), 1);
    // At 20 degrees the TCP is 8 mm inside: the arm's z axis points back along it, so a step in -z leads out, and stops at the box.
    let edge = Vector3::new(0.0, 0.0, -4.0 * MM);
    let mut at_edge = bench(Some([Vector3::new(-1.0, -1.0, 0.0), Vector3::new(0.4705, 1.0, 1.5)]));
    let tcp = |q: &[f64]| {
        calibench::robot::kinematics::world_from_tool(
            &built_in("kr6_r700").unwrap(),
            &FramePose::default(),
            &FramePose::default(),
            q,
        )
    };
    assert!((tcp(&HOME) * nalgebra::Point3::from(edge)).x > 0.4705, "{}", tcp(&HOME));
    assert!(matches!(at_edge.robot.move_in_tool(&edge), Err(ManipulatorError::Refused { .. })));
    at_edge.robot.move_in_tool(&-edge).unwrap();
}

#[test]
fn after_a_stop_nothing_is_sent() {
    let mut b = bench(None);
    b.stop.make();
    assert!(matches!(b.robot.move_joints(&HOME), Err(ManipulatorError::Stopped { .. })));
    assert!(matches!(b.robot.move_in_tool(&Vector3::zeros()), Err(ManipulatorError::Stopped { .. })));
    assert!(b.sent.borrow().is_empty());
}
