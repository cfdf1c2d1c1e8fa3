//! What every screen says of a robot whose description lists no masses.

use calibench::robot::Robot;

/// Says that the masses of a robot's links are guessed; `None` where they are listed, or there are none.
#[must_use]
pub fn masses_sentence(robot: &Robot) -> Option<&'static str> {
    const GUESSED: &str = "The masses of the links are guessed from the reach of the arm; compliance is fitted to them.";
    robot.masses_guessed.then_some(GUESSED)
}
