//! A gauge of one's own: anything that tells three coordinates of a ball's centre can be nulled on it.
//!
//! Here a gauge that measures all three at once, e.g. with a camera, and answers through whatever its maker's library is. What has to be
//! written is [`Indicator`] for each axis: `read` in metres, positive when the ball moves along the tool's axis, and `preset`. Faults are
//! told as [`IndicatorError`]; the controller asks again after a lost or mangled answer, and backs off after any other.
//!
//! The robot of this example is the library's scripted stage, 1 to 2 mm off; any [`calibench::cell::Manipulator`] takes its place.
//! Run it with `cargo run --example own_gauge`.

use std::cell::RefCell;
use std::error::Error;
use std::rc::Rc;

use calibench::cell::scripted::{Script, ScriptedCell};
use calibench::cell::{Indicator, IndicatorError, TriCal};
use calibench::measure::{CenteringController, CentringSettings};
use calibench::units::{MM, UM};

/// The maker's library: it gives all three coordinates in micrometres, or nothing when it does not see the ball.
struct Camera {
    cell: ScriptedCell,
}

impl Camera {
    fn see_um(&self) -> Option<[f64; 3]> {
        // The stage's ball is at the origin, and the tool's axes are the stage's.
        let seen = -self.cell.tcp() / UM;
        (seen.norm() < 6000.0).then(|| seen.into())
    }
}

/// One axis of the camera, as the controller sees it. The three share one camera.
struct CameraAxis {
    camera: Rc<RefCell<Camera>>,
    axis: usize,
    zero: f64,
}

impl Indicator for CameraAxis {
    fn read(&mut self) -> Result<f64, IndicatorError> {
        let seen = self.camera.borrow().see_um().ok_or(IndicatorError::OverRange)?;
        Ok(seen[self.axis] * UM - self.zero)
    }

    fn preset(&mut self, value: f64) -> Result<(), IndicatorError> {
        self.zero += self.read()? - value;
        Ok(())
    }
}

/// Prints what was left.
pub fn main() -> Result<(), Box<dyn Error>> {
    let left = centre_with_own_gauge()?;
    println!("centred: {:.2} um left", left / UM);
    Ok(())
}

/// Centres the ball; the largest coordinate left, m.
pub fn centre_with_own_gauge() -> Result<f64, Box<dyn Error>> {
    let cell = ScriptedCell::new(Script::default());
    let camera = Rc::new(RefCell::new(Camera { cell: cell.clone() }));
    let gauge = [0, 1, 2].map(|axis| CameraAxis { camera: Rc::clone(&camera), axis, zero: 0.0 });
    // A gauge without plungers is never free and never at a stop: its free readings are out of the way.
    let free_reading = [-6.15 * MM; 3];
    let settings = CentringSettings { tolerance: 1.0 * UM, ..CentringSettings::default() };
    let mut controller = CenteringController::new(cell.robot(), gauge, TriCal::default(), free_reading, settings);
    let centred = controller.centre(&mut |stop| {
        if let Some(reading) = stop.reading {
            println!("reads ({:9.2}, {:9.2}, {:9.2}) um", reading.x / UM, reading.y / UM, reading.z / UM);
        }
    })?;
    Ok(centred.reading.amax())
}
