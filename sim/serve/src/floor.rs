//! The floor of a served cell: one world, its clock, its attendant, and the faults that occur on it.

use std::cell::RefCell;
use std::time::Duration;

use calibench::cell::{Indicator, IndicatorError};
use calibench::measure::campaign::mastering::{Attendant, CalledOff};
use calibench::units::MM;
use tokio::time::{Instant, sleep};

use super::fault::{Fault, Faults, Injection};
use super::service::Service;
use super::traffic::Traffic;
use calibench_sim::mechanics::{Parts, PlantError};
use calibench_sim::random::Streams;
use calibench_sim::scenario::Scenario;
use calibench_sim::world::{SharedWorld, World};

/// Displacement of a ball that is off its place, m.
const BALL_OFF: f64 = 6.0 * MM;

/// Displacement of a missing ball, m: out of reach.
const ELSEWHERE: f64 = 1e3;

/// The attendant takes the master ball away once all three indicators are set and none was addressed for this long, by
/// the wall clock.
const PATIENCE: Duration = Duration::from_secs(3);

/// State shared by all devices of a served cell. Everything runs on one thread, so no device sees a partial update.
pub struct Floor {
    /// The cell.
    pub world: SharedWorld,
    /// Injected faults.
    pub faults: RefCell<Faults>,
    /// Record of the traffic on the wires.
    pub traffic: Traffic,
    pace: Pace,
    master: RefCell<MasterBall>,
    stuck: RefCell<[Option<f64>; 3]>,
}

/// Pace of the cell's time.
#[derive(Debug, Clone, Copy)]
struct Pace {
    /// Seconds of the cell per second of wall-clock time; if 0, time only advances by the actions, instantly.
    scale: f64,
    began: Instant,
}

/// The master ball, and the state that its attendant watches.
struct MasterBall {
    is_seated: bool,
    was_set: [bool; 3],
    asked: Instant,
}

impl Floor {
    /// The cell of a scenario, its time scaled as the service says (0: nothing takes wall-clock time), with the master
    /// ball in the socket.
    ///
    /// # Errors
    /// When the plant cannot simulate the scenario.
    pub fn new(scenario: &Scenario, streams: Streams, session_s: f64, service: &Service) -> Result<Self, PlantError> {
        let (faults, scale) = (&service.faults[..], service.time_scale);
        let world = World::altered(scenario, &streams, session_s, |parts| displace(parts, faults))?;
        let began = Instant::now();
        let floor = Floor {
            world: SharedWorld::new(world),
            faults: RefCell::new(Faults::new(faults, streams.stream("faults"))),
            traffic: Traffic::default(),
            pace: Pace { scale, began },
            master: RefCell::new(MasterBall { is_seated: false, was_set: [false; 3], asked: began }),
            stuck: RefCell::default(),
        };
        // The arm moves there before the ball is put in.
        if let Some(stands) = &service.stands {
            floor.world.begin_at(stands);
        }
        floor.seat_master();
        Ok(floor)
    }

    /// Waits for this many seconds of the cell's time, and updates the cell's clock.
    pub async fn wait(&self, duration_s: f64) {
        if self.pace.scale > 0.0 {
            sleep(self.wall(duration_s)).await;
            self.tell_time();
        }
    }

    /// Converts seconds of the cell to wall-clock time; zero if the time scale is 0.
    pub fn wall(&self, duration_s: f64) -> Duration {
        if self.pace.scale > 0.0 {
            Duration::try_from_secs_f64(duration_s / self.pace.scale).unwrap_or(Duration::MAX)
        } else {
            Duration::ZERO
        }
    }

    /// Sets the cell's clock from the wall clock, if they are coupled.
    pub fn tell_time(&self) {
        if self.pace.scale > 0.0 {
            self.world.tell_time(self.pace.began.elapsed().as_secs_f64() * self.pace.scale);
        }
    }

    /// The plunger behind indicator `axis` (from 0).
    pub fn plunger(&self, axis: usize) -> Plunger<'_> {
        Plunger { floor: self, axis }
    }

    /// Puts the master ball into the socket; does nothing if it is there already.
    pub fn seat_master(&self) {
        let mut master = self.master.borrow_mut();
        if !master.is_seated {
            master.is_seated = true;
            master.was_set = [false; 3];
            let (Ok(()) | Err(CalledOff)) = self.world.attendant().place_master_ball();
        }
    }

    /// Takes the master ball out of the socket; does nothing if it is not there.
    pub fn take_master(&self) {
        let mut master = self.master.borrow_mut();
        if master.is_seated {
            master.is_seated = false;
            let (Ok(()) | Err(CalledOff)) = self.world.attendant().remove_master_ball();
        }
    }

    /// Watches the mastering: takes the ball away once all indicators are set and no longer addressed. Never returns.
    pub async fn attend(&self) {
        loop {
            sleep(PATIENCE / 10).await;
            let (is_set, idle) = {
                let master = self.master.borrow();
                (master.is_seated && master.was_set == [true; 3], master.asked.elapsed())
            };
            if is_set && idle >= PATIENCE {
                self.take_master();
            }
        }
    }

    /// Carries out a command to the attendant; returns his answer.
    pub fn tell_attendant(&self, command: &str) -> &'static str {
        match command.split_ascii_whitespace().collect::<Vec<_>>().as_slice() {
            [] => {}
            ["ball", "in"] => self.seat_master(),
            ["ball", "out"] => self.take_master(),
            ["ball"] if self.master.borrow().is_seated => return "in",
            ["ball"] => return "out",
            _ => return "say `ball in` or `ball out`, `ball` to ask where it is, or `reset` after a stop",
        }
        "ok"
    }

    /// Notes that an indicator received a request.
    pub fn asked(&self) {
        self.master.borrow_mut().asked = Instant::now();
    }
}

/// Displaces balls that are missing or off their places.
fn displace(parts: &mut Parts, faults: &[Injection]) {
    for injection in faults {
        let by = match injection.fault {
            Fault::BallMissing => ELSEWHERE,
            Fault::BallOff => BALL_OFF,
            _ => continue,
        };
        for (k, ball) in parts.balls.iter_mut().enumerate() {
            if injection.part.is_none_or(|part| part == k + 1) {
                ball.centre.x += by;
            }
        }
    }
}

/// A plunger of the floor, including its faults.
pub struct Plunger<'a> {
    floor: &'a Floor,
    axis: usize,
}

impl Plunger<'_> {
    /// Index of the plunger actually addressed.
    fn behind(&self) -> usize {
        match self.axis {
            0 | 1 if self.floor.faults.borrow_mut().has_struck(Fault::Swapped, self.axis) => 1 - self.axis,
            axis => axis,
        }
    }

    fn is_reversed(&self) -> bool {
        self.floor.faults.borrow_mut().has_struck(Fault::Reversed, self.axis)
    }
}

impl Indicator for Plunger<'_> {
    fn read(&mut self) -> Result<f64, IndicatorError> {
        let Plunger { floor, axis } = *self;
        let reading = floor.world.indicators()[self.behind()].read()?;
        let reading = if self.is_reversed() { -reading } else { reading };
        if floor.faults.borrow_mut().has_struck(Fault::AtStop, axis) {
            return Err(IndicatorError::OverRange);
        }
        if floor.faults.borrow_mut().has_struck(Fault::Stuck, axis) {
            return Ok(*floor.stuck.borrow_mut()[axis].get_or_insert(reading));
        }
        Ok(reading)
    }

    fn preset(&mut self, value: f64) -> Result<(), IndicatorError> {
        let value = if self.is_reversed() { -value } else { value };
        let behind = self.behind();
        self.floor.world.indicators()[behind].preset(value)?;
        self.floor.master.borrow_mut().was_set[self.axis] = true;
        Ok(())
    }
}
