//! The served laser tracker: it answers a line of text with the point where the reflector is, in its own frame, as the bridges of
//! makers and of others do.

use std::cell::{Cell, RefCell};
use std::rc::Rc;

use calibench::cell::gauge::LineReader;
use calibench::robot::Pose;
use calibench::units::{DEG, MM};
use calibench_sim::random::noisy_point;
use calibench_sim::scenario::Scenario;
use nalgebra::{Point3, Vector3};
use rand_chacha::ChaCha8Rng;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::{TcpListener, TcpStream};
use tokio::task::spawn_local;

use super::fault::Fault;
use super::floor::Floor;

/// Time of one measurement, s.
const MEASURING_S: f64 = 0.5;
/// Heading of the tracker about the vertical, rad: nobody aligns it with the robot.
const HEADING: f64 = 37.0 * DEG;

/// A tracker.
pub struct Tracker {
    floor: Rc<Floor>,
    world_from_tracker: Pose,
    /// One-sigma of one shot, per axis, m.
    shot: f64,
    random: RefCell<ChaCha8Rng>,
    measured: Cell<u64>,
}

impl Tracker {
    /// The tracker of a scenario, level, where the scenario places it.
    pub fn new(floor: Rc<Floor>, scenario: &Scenario, random: ChaCha8Rng) -> Self {
        let position = Vector3::from(scenario.tracker.position_mm) * MM;
        Tracker {
            floor,
            world_from_tracker: Pose::new(position, Vector3::new(0.0, 0.0, HEADING)),
            shot: scenario.truth().keys().tracker.spec().shot,
            random: RefCell::new(random),
            measured: Cell::new(0),
        }
    }

    /// Answers connections, one after the other, until the program ends.
    pub async fn listen(self: Rc<Self>, listener: TcpListener) {
        while let Ok((stream, _)) = listener.accept().await {
            let tracker = Rc::clone(&self);
            // An error ends this connection only.
            spawn_local(async move { drop(tracker.converse(stream).await) });
        }
    }

    async fn converse(&self, mut stream: TcpStream) -> std::io::Result<()> {
        let mut lines = LineReader::default();
        let mut buffer = [0; 256];
        loop {
            match stream.read(&mut buffer).await? {
                0 => return Ok(()),
                length => lines.push(&buffer[..length]),
            }
            while lines.line().is_some() {
                self.floor.wait(MEASURING_S).await;
                // A reflector that is not seen has no point, and most bridges say nothing then.
                if !self.floor.faults.borrow_mut().strikes(Fault::Beam, 0) {
                    stream.write_all(self.point().as_bytes()).await?;
                }
            }
        }
    }

    /// The line of a point: its name, x, y, z in mm.
    fn point(&self) -> String {
        let seen = noisy_point(&self.floor.world.point(), self.shot, &mut *self.random.borrow_mut());
        let at = self.world_from_tracker.inverse() * Point3::from(seen) / MM;
        self.measured.set(self.measured.get() + 1);
        format!("P{},{:.4},{:.4},{:.4}\r\n", self.measured.get(), at.x, at.y, at.z)
    }
}
