//! Basics for writing the document: elements, numbers, names, and the settings for how stiffly and how fast MuJoCo
//! comes to rest.

use std::io;

use nalgebra::Vector3;
use quick_xml::Writer;

/// Time step, s. It has no meaning except to bring the cell to rest.
pub const STEP_S: f64 = 8e-3;
/// Rate at which a gear and its rotor come to rest, rad/s: some 20 steps per time constant would be smooth, 3 are enough.
pub const RATE: f64 = 43.0;
/// Contact and limits as hard as MuJoCo allows: the time constant is twice the step, the impedance its largest.
pub const HARDEST: &str = "0.9999 0.9999 0.001 0.5 2";
/// Impedance of `HARDEST`.
pub const IMPEDANCE: f64 = 0.9999;

/// Mass and inertia of a massless body, kg and kg·m²: MuJoCo requires some of both for every moving body.
const NEXT_TO_NOTHING: f64 = 1e-12;

/// Writer of the document.
pub type Xml = Writer<Vec<u8>>;

/// Writes an element; floats in attributes are written with full precision.
macro_rules! element {
    ($xml:expr, $name:literal, { $($key:literal = $value:expr),* $(,)? }) => {
        $xml.create_element($name)$(.with_attribute(($key, $value.to_string().as_str())))*.write_empty()
    };
    ($xml:expr, $name:literal, { $($key:literal = $value:expr),* $(,)? }, $inside:expr) => {
        $xml.create_element($name)$(.with_attribute(($key, $value.to_string().as_str())))*.write_inner_content($inside)
    };
}

pub(super) use element;

/// Writes the mass (kg) and the centre of mass (m) of a body.
pub fn write_inertial(xml: &mut Xml, mass: f64, com: &Vector3<f64>) -> io::Result<()> {
    // At rest a moment of inertia has no effect; that of a small ball keeps the arm's motion to rest slow and smooth.
    let inertia = (mass * 1e-4).max(NEXT_TO_NOTHING);
    element!(xml, "inertial", {
        "mass" = mass.max(NEXT_TO_NOTHING), "pos" = numbers(com.as_slice()), "diaginertia" = numbers(&[inertia; 3])
    })?;
    Ok(())
}

/// The shortest time constant that a step allows, critically damped.
pub fn hardest_ref() -> String {
    numbers(&[2.0 * STEP_S, 1.0])
}

/// Name of the hinge of joint `i` (from 0).
pub fn joint_name(i: usize) -> String {
    format!("joint{}", i + 1)
}

/// Numbers with full precision, separated by spaces.
pub fn numbers(values: &[f64]) -> String {
    values.iter().map(f64::to_string).collect::<Vec<_>>().join(" ")
}
