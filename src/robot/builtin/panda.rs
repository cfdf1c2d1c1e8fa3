//! Franka Emika Panda: seven joints.

use super::rows::{Row, capsule, links};
use crate::robot::Robot;
use crate::units::DEG;

/// Geometry and limits: Franka Control Interface documentation (limits in rad); frame 7 is moved along z7 to the flange,
/// d_7 = 107 mm. Masses and centres: Gaz, Cognetti, Oliva, Robuffo Giordano, De Luca, "Dynamic identification of the Franka
/// Emika Panda robot", IEEE RA-L 4 (2019) 4147; the last centre is shifted by -107 mm with its frame. The z of link 1's
/// centre has no effect on any joint: it lies along joint 1.
#[allow(clippy::approx_constant)] // a centre of mass happens to stand at -3.141 mm
const ROWS: [Row; 7] = [
    Row {
        alpha_deg: 0.0,
        a_mm: 0.0,
        theta_deg: 0.0,
        d_mm: 333.0,
        limits_deg: [-2.8973 / DEG, 2.8973 / DEG],
        mass_kg: 4.970684,
        com_mm: [3.875, 2.081, -175.0],
    },
    Row {
        alpha_deg: -90.0,
        a_mm: 0.0,
        theta_deg: 0.0,
        d_mm: 0.0,
        limits_deg: [-1.7628 / DEG, 1.7628 / DEG],
        mass_kg: 0.646926,
        com_mm: [-3.141, -28.72, 3.495],
    },
    Row {
        alpha_deg: 90.0,
        a_mm: 0.0,
        theta_deg: 0.0,
        d_mm: 316.0,
        limits_deg: [-2.8973 / DEG, 2.8973 / DEG],
        mass_kg: 3.228604,
        com_mm: [27.518, 39.252, -66.502],
    },
    Row {
        alpha_deg: 90.0,
        a_mm: 82.5,
        theta_deg: 0.0,
        d_mm: 0.0,
        limits_deg: [-3.0718 / DEG, -0.0698 / DEG],
        mass_kg: 3.587895,
        com_mm: [-53.17, 104.419, 27.454],
    },
    Row {
        alpha_deg: -90.0,
        a_mm: -82.5,
        theta_deg: 0.0,
        d_mm: 384.0,
        limits_deg: [-2.8973 / DEG, 2.8973 / DEG],
        mass_kg: 1.225946,
        com_mm: [-11.953, 41.065, -38.437],
    },
    Row {
        alpha_deg: 90.0,
        a_mm: 0.0,
        theta_deg: 0.0,
        d_mm: 0.0,
        limits_deg: [-0.0175 / DEG, 3.7525 / DEG],
        mass_kg: 1.666555,
        com_mm: [60.149, -14.117, -10.517],
    },
    Row {
        alpha_deg: 90.0,
        a_mm: 88.0,
        theta_deg: 0.0,
        d_mm: 107.0,
        limits_deg: [-2.8973 / DEG, 2.8973 / DEG],
        mass_kg: 0.735522,
        com_mm: [10.517, -4.252, -45.403],
    },
];

pub(super) fn robot() -> Robot {
    Robot {
        name: "panda".into(),
        source: "geometry and limits: Franka Control Interface documentation; masses: Gaz et al., IEEE RA-L 4 (2019) 4147; \
                 solids: estimated from the link lengths"
            .into(),
        links: links(&ROWS),
        solids: vec![
            capsule("base", 0, [-60.0, 0.0, 60.0], [0.0, 0.0, 60.0], 95.0),
            capsule("link 1", 1, [0.0, 0.0, -190.0], [0.0, 0.0, -60.0], 60.0),
            capsule("link 2", 2, [0.0, 0.0, -60.0], [0.0, 0.0, 60.0], 60.0),
            capsule("link 3", 3, [0.0, 0.0, -220.0], [0.0, 0.0, -70.0], 60.0),
            capsule("link 4", 4, [0.0, 0.0, -60.0], [0.0, 0.0, 60.0], 60.0),
            capsule("forearm", 5, [0.0, 0.0, -310.0], [0.0, 0.0, -210.0], 60.0),
            capsule("forearm to wrist", 5, [0.0, 80.0, -200.0], [0.0, 80.0, -60.0], 25.0),
            capsule("wrist", 6, [0.0, 0.0, -70.0], [0.0, 0.0, 10.0], 50.0),
            capsule("flange", 7, [0.0, 0.0, -110.0], [0.0, 0.0, -40.0], 40.0),
        ],
        ..Robot::default()
    }
}
