//! Loads under which the arm bends: a check under others than the campaign compares nothing.

use nalgebra::Vector3;

use super::CheckError;
use crate::measure::dataset::{Dataset, Measured};
use crate::robot::statics::Payload;
use crate::units::MM;

/// Gravity, m/s², forces, N, masses, kg, and their moments, kg m, that differ by less are equal: standard gravity is written in
/// several ways.
const EQUAL_LOAD: f64 = 0.01;

/// The first load that two datasets state otherwise: gravity, the force of the plungers, a payload that both have.
pub(super) fn other_loads(then: &Dataset, now: &Dataset) -> Option<CheckError> {
    let vector = |v: &Vector3<f64>, unit: &str| format!("[{:.3}, {:.3}, {:.3}] {unit}", v.x, v.y, v.z);
    let differ = |field: &'static str, unit: &str, then: &Vector3<f64>, now: &Vector3<f64>| {
        let error = || CheckError::OtherLoads { field, now: vector(now, unit), then: vector(then, unit) };
        ((then - now).norm() > EQUAL_LOAD).then(error)
    };
    let gravity = differ("gravity_m_s2", "m/s²", &then.gravity, &now.gravity);
    // Nothing else is pushed.
    let is_pushed = now.samples.iter().any(|s| matches!(s.measured, Measured::Ball { .. }));
    let force = || differ("contact_force_n", "N", &then.contact_force, &now.contact_force).filter(|_| is_pushed);
    let payload = || {
        let words = |p: &Payload| format!("'{}' of {:.3} kg at {}", p.name, p.mass, vector(&(p.com / MM), "mm"));
        let alike =
            |a: &Payload, b: &Payload| (a.mass - b.mass).abs() <= EQUAL_LOAD && (a.com - b.com).norm() * a.mass <= EQUAL_LOAD;
        let mut pairs = now.payloads.iter().filter_map(|p| Some((then.payloads.iter().find(|other| other.name == p.name)?, p)));
        let (before, after) = pairs.find(|pair| !alike(pair.0, pair.1))?;
        Some(CheckError::OtherLoads { field: "payload", now: words(after), then: words(before) })
    };
    gravity.or_else(force).or_else(payload)
}
