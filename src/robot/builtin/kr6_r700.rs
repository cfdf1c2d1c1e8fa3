//! KUKA KR 6 R700 sixx (AGILUS): the robot of the paper.

use super::rows::{Row, capsule, links};
use crate::robot::Robot;

/// Total mass of the sixx (KUKA data sheet: about 50 kg) divided by that of the R700-2 whose links are used instead.
const SURROGATE: f64 = 50.0 / 53.16;

/// Geometry: paper Table 4. Limits: KUKA data sheet. Masses: those of the KR 6 R700-2 (kroshu/kuka_robot_descriptions,
/// Apache-2.0), re-expressed in the MDH frames and scaled to the sixx's 50 kg; none are published for the sixx itself.
const ROWS: [Row; 6] = [
    Row {
        alpha_deg: 180.0,
        a_mm: 0.0,
        theta_deg: 0.0,
        d_mm: -400.0,
        limits_deg: [-170.0, 170.0],
        mass_kg: SURROGATE * 8.416,
        com_mm: [6.4104, -16.2681, 85.4111],
    },
    Row {
        alpha_deg: 90.0,
        a_mm: 25.0,
        theta_deg: 0.0,
        d_mm: 0.0,
        limits_deg: [-190.0, 45.0],
        mass_kg: SURROGATE * 15.5659,
        com_mm: [96.8897, -4.0854, 19.1241],
    },
    Row {
        alpha_deg: 0.0,
        a_mm: 315.0,
        theta_deg: -90.0,
        d_mm: 0.0,
        limits_deg: [-120.0, 156.0],
        mass_kg: SURROGATE * 5.303,
        com_mm: [11.1361, 22.2287, 17.2238],
    },
    Row {
        alpha_deg: 90.0,
        a_mm: 35.0,
        theta_deg: 0.0,
        d_mm: -365.0,
        limits_deg: [-185.0, 185.0],
        mass_kg: SURROGATE * 4.613,
        com_mm: [0.1097, 10.2676, 132.3614],
    },
    Row {
        alpha_deg: -90.0,
        a_mm: 0.0,
        theta_deg: 0.0,
        d_mm: 0.0,
        limits_deg: [-120.0, 120.0],
        mass_kg: SURROGATE * 1.6128,
        com_mm: [-0.7835, 9.3207, 24.0375],
    },
    Row {
        alpha_deg: 90.0,
        a_mm: 0.0,
        theta_deg: 0.0,
        d_mm: -80.0,
        limits_deg: [-350.0, 350.0],
        mass_kg: SURROGATE * 0.734,
        com_mm: [0.0, 0.0, 16.7354],
    },
];

/// Speed-reducer ratios, assumed: usual strain-wave ratios of this size; KUKA does not publish them.
const GEAR_RATIOS_ASSUMED: [f64; 6] = [121.0, 121.0, 101.0, 101.0, 101.0, 81.0];

pub(super) fn robot() -> Robot {
    Robot {
        name: "kr6_r700".into(),
        source: "geometry: Icli, Stepanenko, Bonev, Sensors 20 (2020) 5919, Table 4; limits: KUKA data sheet; masses: surrogate, \
                 KR 6 R700-2 of kroshu/kuka_robot_descriptions at 7766e92 (Apache-2.0) scaled by 50/53.16; gear ratios: assumed; \
                 solids: estimated from the link lengths"
            .into(),
        links: links(&ROWS),
        gear_ratios: GEAR_RATIOS_ASSUMED.into(),
        // Estimated from the link lengths, without a drawing; upper arm and forearm end short of the elbow and the wrist,
        // slim enough that the joint limits alone keep them apart.
        solids: vec![
            capsule("base", 0, [0.0, 0.0, 90.0], [0.0, 0.0, 170.0], 100.0),
            capsule("shoulder", 1, [0.0, 0.0, 100.0], [25.0, 0.0, 0.0], 95.0),
            capsule("upper arm", 2, [0.0, 0.0, 0.0], [255.0, 0.0, 0.0], 60.0),
            capsule("elbow", 3, [0.0, 0.0, 0.0], [35.0, 130.0, 0.0], 70.0),
            capsule("forearm", 4, [0.0, 0.0, 170.0], [0.0, 0.0, 95.0], 50.0),
            capsule("wrist", 5, [0.0, 0.0, 0.0], [0.0, 0.0, 0.0], 45.0),
            capsule("flange", 6, [0.0, 0.0, 40.0], [0.0, 0.0, 25.0], 25.0),
        ],
        ..Robot::default()
    }
}
