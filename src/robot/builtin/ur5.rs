//! Universal Robots UR5 (CB3).

use super::rows::{Distal, Row, capsule, links_of_distal};
use crate::robot::Robot;

/// MDH form of the manufacturer's DH table; masses from the same page; limits of the data sheet.
const ROWS: [Row; 6] = [
    Row {
        alpha_deg: 0.0,
        a_mm: 0.0,
        theta_deg: 0.0,
        d_mm: 89.159,
        limits_deg: [-360.0, 360.0],
        mass_kg: 3.7,
        com_mm: [0.0; 3],
    },
    Row {
        alpha_deg: 90.0,
        a_mm: 0.0,
        theta_deg: 0.0,
        d_mm: 0.0,
        limits_deg: [-360.0, 360.0],
        mass_kg: 8.393,
        com_mm: [0.0; 3],
    },
    Row {
        alpha_deg: 0.0,
        a_mm: -425.0,
        theta_deg: 0.0,
        d_mm: 0.0,
        limits_deg: [-360.0, 360.0],
        mass_kg: 2.33,
        com_mm: [0.0; 3],
    },
    Row {
        alpha_deg: 0.0,
        a_mm: -392.25,
        theta_deg: 0.0,
        d_mm: 109.15,
        limits_deg: [-360.0, 360.0],
        mass_kg: 1.219,
        com_mm: [0.0; 3],
    },
    Row {
        alpha_deg: 90.0,
        a_mm: 0.0,
        theta_deg: 0.0,
        d_mm: 94.65,
        limits_deg: [-360.0, 360.0],
        mass_kg: 1.219,
        com_mm: [0.0; 3],
    },
    Row {
        alpha_deg: -90.0,
        a_mm: 0.0,
        theta_deg: 0.0,
        d_mm: 82.3,
        limits_deg: [-360.0, 360.0],
        mass_kg: 0.1879,
        com_mm: [0.0; 3],
    },
];

/// Centres of mass in the manufacturer's distal DH frames, mm, and the twist of each, in quarter turns.
const CENTRES: [Distal; 6] = [
    ([0.0, -25.61, 1.93], 1),
    ([212.5, 0.0, 113.36], 0),
    ([150.0, 0.0, 26.5], 0),
    ([0.0, -1.8, 16.34], 1),
    ([0.0, 1.8, 16.34], -1),
    ([0.0, 0.0, -1.159], 0),
];

pub(super) fn robot() -> Robot {
    Robot {
        name: "ur5".into(),
        source: "Universal Robots, article 'DH parameters for calculations of kinematics and dynamics', UR5; limits: \
                 data sheet; solids: estimated from the link lengths"
            .into(),
        links: links_of_distal(&ROWS, &CENTRES),
        solids: vec![
            capsule("base", 0, [0.0, 0.0, 0.0], [0.0, 0.0, 30.0], 75.0),
            capsule("shoulder", 1, [0.0, 0.0, 0.0], [0.0, -70.0, 0.0], 70.0),
            capsule("upper arm", 2, [0.0, 0.0, 136.0], [-425.0, 0.0, 136.0], 58.0),
            capsule("forearm", 3, [0.0, 0.0, 16.0], [-392.25, 0.0, 16.0], 48.0),
            capsule("wrist 1", 4, [0.0, 0.0, -30.0], [0.0, 0.0, 0.0], 40.0),
            capsule("wrist 2", 5, [0.0, 0.0, -30.0], [0.0, 0.0, 0.0], 40.0),
            capsule("flange", 6, [0.0, 0.0, -40.0], [0.0, 0.0, -40.0], 38.0),
        ],
        ..Robot::default()
    }
}
