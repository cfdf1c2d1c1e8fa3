//! A robot and a gauge of one's own: anything that moves a tool, and anything that tells three coordinates of a ball's centre.
//!
//! What has to be written is [`Manipulator`] for the robot, and [`Indicator`] for each axis of the gauge: `read` in metres, positive when
//! the ball moves along the tool's axis, and `preset`. Here the robot is a stage of three axes whose steps are 2 % too long, and the gauge
//! measures all three coordinates at once, e.g. with a camera. Faults are told as [`ManipulatorError`] and [`IndicatorError`]; the
//! controller asks again after a lost or mangled answer, and backs off after any other. Run it with `cargo run --example centre_a_ball`.

use std::cell::RefCell;
use std::error::Error;
use std::rc::Rc;

use calibench::cell::{Indicator, IndicatorError, Manipulator, ManipulatorError, TriCal};
use calibench::measure::centring::{CenteringController, CentringSettings};
use calibench::nalgebra::Vector3;
use calibench::units::{MM, UM};

/// The stage: its joints are its coordinates, m, and its tool's axes are the world's.
struct Stage {
    tcp: Vector3<f64>,
    clock_s: f64,
}

/// The stage as the controller sees it; the camera rides on it.
struct StageRobot(Rc<RefCell<Stage>>);

impl Manipulator for StageRobot {
    fn joints(&mut self) -> Result<Vec<f64>, ManipulatorError> {
        Ok(self.0.borrow().tcp.as_slice().to_vec())
    }

    fn move_joints(&mut self, target: &[f64]) -> Result<(), ManipulatorError> {
        let &[x, y, z] = target else { return Err(ManipulatorError::Unreachable) };
        self.0.borrow_mut().tcp = Vector3::new(x, y, z);
        Ok(())
    }

    fn move_in_tool(&mut self, offset: &Vector3<f64>) -> Result<(), ManipulatorError> {
        let mut stage = self.0.borrow_mut();
        stage.tcp += 1.02 * offset;
        stage.clock_s += 1.0;
        Ok(())
    }

    fn clock_s(&mut self) -> f64 {
        self.0.borrow().clock_s
    }
}

/// The maker's library: it gives all three coordinates in micrometres, or nothing when it does not see the ball.
struct Camera {
    stage: Rc<RefCell<Stage>>,
    ball: Vector3<f64>,
}

impl Camera {
    fn see_um(&self) -> Option<[f64; 3]> {
        let seen = (self.ball - self.stage.borrow().tcp) / UM;
        (seen.norm() < 6000.0).then(|| seen.into())
    }
}

/// One axis of the camera, as the controller sees it. The three share one camera.
struct CameraAxis {
    camera: Rc<Camera>,
    axis: usize,
    zero: f64,
}

impl Indicator for CameraAxis {
    fn read(&mut self) -> Result<f64, IndicatorError> {
        let seen = self.camera.see_um().ok_or(IndicatorError::OverRange)?;
        Ok(seen[self.axis] * UM - self.zero)
    }

    fn preset(&mut self, value: f64) -> Result<(), IndicatorError> {
        self.zero += self.read()? - value;
        Ok(())
    }
}

/// Prints what was left.
pub fn main() -> Result<(), Box<dyn Error>> {
    println!("centred: {:.2} um left", centred()? / UM);
    Ok(())
}

/// Centres the ball; the largest coordinate left, m.
pub fn centred() -> Result<f64, Box<dyn Error>> {
    let stage = Rc::new(RefCell::new(Stage { tcp: Vector3::zeros(), clock_s: 0.0 }));
    let camera = Rc::new(Camera { stage: Rc::clone(&stage), ball: Vector3::new(-1.3, 0.9, -1.7) * MM });
    let gauge = [0, 1, 2].map(|axis| CameraAxis { camera: Rc::clone(&camera), axis, zero: 0.0 });
    // A gauge without plungers is never free and never at a stop: its free readings are out of the way.
    let free_reading = [-6.15 * MM; 3];
    let settings = CentringSettings { tolerance: 1.0 * UM, ..CentringSettings::default() };
    let mut controller = CenteringController::new(StageRobot(stage), gauge, TriCal::default(), free_reading, settings);
    let centred = controller.centre(&mut |stop| {
        if let Some(reading) = stop.reading {
            println!("reads ({:9.2}, {:9.2}, {:9.2}) um", reading.x / UM, reading.y / UM, reading.z / UM);
        }
    })?;
    Ok(centred.reading.amax())
}
