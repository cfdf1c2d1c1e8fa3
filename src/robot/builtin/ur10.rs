//! Universal Robots UR10 (CB3).

use super::rows::{Distal, Row, capsule, links_of_distal};
use crate::robot::Robot;

/// MDH form of the manufacturer's DH table; masses from the same page; limits of the data sheet.
const ROWS: [Row; 6] = [
    Row { alpha_deg: 0.0, a_mm: 0.0, theta_deg: 0.0, d_mm: 127.3, limits_deg: [-360.0, 360.0], mass_kg: 7.1, com_mm: [0.0; 3] },
    Row { alpha_deg: 90.0, a_mm: 0.0, theta_deg: 0.0, d_mm: 0.0, limits_deg: [-360.0, 360.0], mass_kg: 12.7, com_mm: [0.0; 3] },
    Row {
        alpha_deg: 0.0,
        a_mm: -612.0,
        theta_deg: 0.0,
        d_mm: 0.0,
        limits_deg: [-360.0, 360.0],
        mass_kg: 4.27,
        com_mm: [0.0; 3],
    },
    Row {
        alpha_deg: 0.0,
        a_mm: -572.3,
        theta_deg: 0.0,
        d_mm: 163.941,
        limits_deg: [-360.0, 360.0],
        mass_kg: 2.0,
        com_mm: [0.0; 3],
    },
    Row {
        alpha_deg: 90.0,
        a_mm: 0.0,
        theta_deg: 0.0,
        d_mm: 115.7,
        limits_deg: [-360.0, 360.0],
        mass_kg: 2.0,
        com_mm: [0.0; 3],
    },
    Row {
        alpha_deg: -90.0,
        a_mm: 0.0,
        theta_deg: 0.0,
        d_mm: 92.2,
        limits_deg: [-360.0, 360.0],
        mass_kg: 0.365,
        com_mm: [0.0; 3],
    },
];

/// Centres of mass in the manufacturer's distal DH frames, mm, and the twist of each, in quarter turns.
const CENTRES: [Distal; 6] = [
    ([21.0, 0.0, 27.0], 1),
    ([380.0, 0.0, 158.0], 0),
    ([240.0, 0.0, 68.0], 0),
    ([0.0, 7.0, 18.0], 1),
    ([0.0, 7.0, 18.0], -1),
    ([0.0, 0.0, -26.0], 0),
];

pub(super) fn robot() -> Robot {
    Robot {
        name: "ur10".into(),
        source: "Universal Robots, article 'DH parameters for calculations of kinematics and dynamics', UR10; limits: \
                 data sheet; solids: estimated from the link lengths"
            .into(),
        links: links_of_distal(&ROWS, &CENTRES),
        solids: vec![
            capsule("base", 0, [0.0, 0.0, 0.0], [0.0, 0.0, 40.0], 90.0),
            capsule("shoulder", 1, [0.0, 0.0, 0.0], [0.0, -100.0, 0.0], 85.0),
            capsule("upper arm", 2, [0.0, 0.0, 176.0], [-612.0, 0.0, 176.0], 70.0),
            capsule("forearm", 3, [0.0, 0.0, 49.0], [-572.3, 0.0, 49.0], 58.0),
            capsule("wrist 1", 4, [0.0, 0.0, -40.0], [0.0, 0.0, 0.0], 50.0),
            capsule("wrist 2", 5, [0.0, 0.0, -40.0], [0.0, 0.0, 0.0], 50.0),
            capsule("flange", 6, [0.0, 0.0, -45.0], [0.0, 0.0, -45.0], 45.0),
        ],
        ..Robot::default()
    }
}
