//! The arm of a served cell under its controller: where it is, and its motions, which take their time.

use std::cell::RefCell;
use std::rc::Rc;
use std::time::Duration;

use calibench::cell::{Manipulator, ManipulatorError};
use calibench::robot::inverse::{Chain, InverseKinematics, Outcome};
use calibench::robot::kinematics::Posture;
use calibench::robot::sites::SiteIndex;
use calibench::robot::{FramePose, Pose, Robot};
use tokio::sync::watch;
use tokio::time::{Instant, sleep_until};

use super::fault::Fault;
use super::floor::Floor;

/// Shortest motion, s at full speed: what a controller needs to begin and end one.
const SHORTEST_S: f64 = 0.05;

/// Factor on the duration of a slow motion.
const SLOW: f64 = 10.0;

/// A motion in progress.
#[derive(Debug, Clone)]
struct Underway {
    from: Vec<f64>,
    to: Vec<f64>,
    straight: Option<f64>,
    began: Instant,
    takes: Duration,
}

/// A motion to be made.
#[derive(Debug, Clone)]
pub struct Way {
    /// Joints at its end, rad.
    pub target: Vec<f64>,
    /// Length of the straight line of the tool, m; `None` if the motion is straight in joint space.
    pub straight: Option<f64>,
    /// Share of full speed.
    pub speed: f64,
}

/// Reasons why a motion did not end where it should.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NotThere {
    /// This joint, counted from 0, would leave its limits; nothing moved.
    JointLimit(usize),
    /// It was broken off.
    Cancelled,
    /// The emergency stop was pressed, or the arm touched something.
    Emergency,
    /// The controller stopped it for the safety of people: a collision that was none.
    ProtectiveStop,
    /// Somebody switched the arm's power off.
    PowerOff,
    /// Somebody took the arm in freedrive.
    Freedrive,
    /// The arm cannot make it.
    Impossible,
}

/// The arm as its controller knows it.
pub struct Arm {
    /// The cell.
    pub floor: Rc<Floor>,
    /// The nominal arm.
    pub robot: Robot,
    /// Counts how many times all links were broken.
    pub broken_links: watch::Sender<u64>,
    underway: RefCell<Option<Underway>>,
}

impl Arm {
    /// The arm of this cell.
    pub fn new(floor: Rc<Floor>, robot: Robot) -> Self {
        Arm { floor, robot, broken_links: watch::channel(0).0, underway: RefCell::default() }
    }

    /// Joint angles commanded at this moment, rad.
    pub fn joints(&self) -> Vec<f64> {
        self.on_the_way().unwrap_or_else(|| self.floor.world.commanded())
    }

    /// Joint angles shown by the encoders at this moment, rad.
    pub fn measured(&self) -> Vec<f64> {
        // An arm whose simulation failed shows only its commanded joints.
        self.on_the_way().or_else(|| self.floor.world.robot().joints().ok()).unwrap_or_else(|| self.floor.world.commanded())
    }

    /// Speeds of the joints at this moment, rad/s of the wall clock.
    pub fn speeds(&self) -> Vec<f64> {
        let underway = self.underway.borrow();
        let Some(Underway { from, to, takes, .. }) = underway.as_ref() else { return vec![0.0; self.robot.joints()] };
        let takes_s = takes.as_secs_f64().max(f64::MIN_POSITIVE);
        from.iter().zip(to).map(|(from, to)| (to - from) / takes_s).collect()
    }

    /// True while a motion is in progress.
    pub fn is_moving(&self) -> bool {
        self.underway.borrow().is_some()
    }

    fn on_the_way(&self) -> Option<Vec<f64>> {
        let underway = self.underway.borrow();
        let Underway { from, to, began, takes, .. } = underway.as_ref()?;
        let share = (began.elapsed().as_secs_f64() / takes.as_secs_f64().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
        Some(from.iter().zip(to).map(|(from, to)| from + share * (to - from)).collect())
    }

    /// The nominal arm at these joints, rad.
    pub fn posture(&self, q: &[f64]) -> Posture {
        let mut posture = Posture::new(&self.robot);
        let none = FramePose::default();
        posture.set(&self.robot, &none, &none, q, &vec![0.0; SiteIndex::new(q.len()).len()]);
        posture
    }

    /// Joints (rad) with which the nominal arm brings a tool, given in its last frame, to a pose in its root; those nearest
    /// to the present ones. `None` if there are none.
    pub fn joints_for(&self, root_from_tool: &Pose, last_frame_from_tool: &FramePose) -> Option<Vec<f64>> {
        let start = self.joints();
        let mut arm = Chain::nominal(&self.robot, &FramePose::default(), last_frame_from_tool);
        let limits = |joint: usize| self.robot.links[joint].limits;
        let solution = InverseKinematics::new(start.len()).solve(&mut arm, root_from_tool, &start, limits);
        (solution.outcome == Outcome::Converged).then_some(solution.q)
    }

    /// The joint, counted from 0, that is nearest to one of its limits.
    pub fn nearest_limit(&self, q: &[f64]) -> usize {
        let links = &self.robot.links;
        let margin = |joint: &usize| (q[*joint] - links[*joint].limits[0]).min(links[*joint].limits[1] - q[*joint]);
        (0..q.len()).min_by(|a, b| margin(a).total_cmp(&margin(b))).unwrap_or_default()
    }

    /// Makes a motion; breaks it off when `cancelled` ends. A motion whose future is dropped ends where the arm is by then.
    ///
    /// # Errors
    /// The reason why the arm is not at its end.
    pub async fn travel(&self, way: Way, cancelled: impl Future<Output = ()>) -> Result<(), NotThere> {
        let floor = &self.floor;
        floor.traffic.note_motion();
        let strikes = |fault| floor.faults.borrow_mut().strikes(fault, 0);
        let Way { target, straight, speed } = way;
        let nearest_limit = (straight.is_none() && strikes(Fault::JointLimit)).then(|| self.nearest_limit(&target));
        if let Some(joint) = nearest_limit.or_else(|| self.robot.outside_limits(&target, 0.0)) {
            return Err(NotThere::JointLimit(joint));
        }
        floor.take_master();
        let from = self.joints();
        let half_way = [
            (Fault::Estop, NotThere::Emergency),
            (Fault::ProtectiveStop, NotThere::ProtectiveStop),
            (Fault::PowerOff, NotThere::PowerOff),
            (Fault::Freedrive, NotThere::Freedrive),
        ];
        let event = half_way.map(|(fault, event)| strikes(fault).then_some(event)).into_iter().flatten().next();
        let to = if event.is_some() { from.iter().zip(&target).map(|(from, to)| 0.5 * (from + to)).collect() } else { target };
        // Without the time in which the plant settles: clients wait for that themselves.
        let settling_s = floor.world.motion_s(&from);
        let moving_s = (floor.world.motion_s(&to) - settling_s).max(SHORTEST_S);
        let duration_s = moving_s / speed.clamp(0.01, 1.0) * if strikes(Fault::Slow) { SLOW } else { 1.0 };
        let (began, takes) = (Instant::now(), floor.wall(duration_s));
        let motion = Motion(self);
        *self.underway.borrow_mut() = Some(Underway { from, to: to.clone(), straight, began, takes });
        if strikes(Fault::DropLink) {
            self.broken_links.send_modify(|times| *times += 1);
        }
        let is_whole = tokio::select! {
            biased;
            () = cancelled => false,
            () = sleep_until(began + takes) => true,
        };
        let moved = self.arrive(if is_whole { to } else { self.joints() });
        drop(motion);
        match (moved, event) {
            (Ok(()), _) if !is_whole => Err(NotThere::Cancelled),
            (Err(error), _) => Err(error),
            (Ok(()), event) => event.map_or(Ok(()), Err),
        }
    }

    /// Ends the motion in progress at these joints, rad.
    fn arrive(&self, at: Vec<f64>) -> Result<(), NotThere> {
        let Some(underway) = self.underway.borrow_mut().take() else { return Ok(()) };
        let floor = &self.floor;
        floor.tell_time();
        let moved = match underway.straight {
            Some(distance) => floor.world.move_straight(&at, distance),
            None => floor.world.robot().move_joints(&at),
        };
        match moved {
            Ok(()) => Ok(()),
            Err(ManipulatorError::Collision { between: [one, other] }) => {
                eprintln!("COLLISION: {one} touched {other}; the arm stands still");
                Err(NotThere::Emergency)
            }
            Err(_) => Err(NotThere::Impossible),
        }
    }
}

/// A motion in progress; dropped before its end, it ends where the arm is.
struct Motion<'a>(&'a Arm);

impl Drop for Motion<'_> {
    fn drop(&mut self) {
        if self.0.is_moving() {
            let here = self.0.joints();
            // An arm that cannot be there stays where it was.
            let (Ok(()) | Err(_)) = self.0.arrive(here);
        }
    }
}
