//! The tables in which robots are published, and their conversion to links.

use nalgebra::Vector3;

use crate::robot::solids::Solid;
use crate::robot::{Link, MdhLink};
use crate::units::{DEG, MM};

/// A row of a robot's table, in the units of data sheets.
pub(super) struct Row {
    /// alpha_{i-1}, deg.
    pub alpha_deg: f64,
    /// a_{i-1}, mm.
    pub a_mm: f64,
    /// Joint offset, deg.
    pub theta_deg: f64,
    /// d_i, mm.
    pub d_mm: f64,
    /// Joint limits, deg.
    pub limits_deg: [f64; 2],
    /// Mass, kg.
    pub mass_kg: f64,
    /// Centre of mass in the link's MDH frame, mm.
    pub com_mm: [f64; 3],
}

/// The links of a table.
pub(super) fn links(rows: &[Row]) -> Vec<Link> {
    let link = |row: &Row| Link {
        mdh: MdhLink {
            alpha: row.alpha_deg * DEG,
            a: row.a_mm * MM,
            theta: row.theta_deg * DEG,
            d: row.d_mm * MM,
            ..MdhLink::default()
        },
        limits: row.limits_deg.map(|limit| limit * DEG),
        mass: row.mass_kg,
        com: Vector3::from(row.com_mm.map(|c| c * MM)),
    };
    rows.iter().map(link).collect()
}

/// A capsule of a frame, in mm.
pub(super) fn capsule(name: &str, frame: usize, from_mm: [f64; 3], to_mm: [f64; 3], radius_mm: f64) -> Solid {
    Solid::capsule(name, frame, [from_mm, to_mm].map(|end| Vector3::from(end.map(|c| c * MM))), radius_mm * MM)
}

/// A centre of mass in the distal DH frame of its link, mm, and that frame's twist alpha_i in quarter turns.
pub(super) type Distal = ([f64; 3], i32);

/// The links of a table whose centres of mass are published in distal DH frames: `com_mdh = Tx(a_i) Rx(alpha_i)
/// com_distal`, where a_i is that of the *next* MDH row. Twists are given in quarter turns, so that there is no rounding.
pub(super) fn links_of_distal(rows: &[Row], centres: &[Distal]) -> Vec<Link> {
    let mut links = links(rows);
    for (i, &([x, y, z], quarter_turns)) in centres.iter().enumerate() {
        let a_mm = rows.get(i + 1).map_or(0.0, |next| next.a_mm);
        let com_mm = match quarter_turns {
            1 => [a_mm + x, -z, y],
            -1 => [a_mm + x, z, -y],
            _ => [a_mm + x, y, z],
        };
        links[i].com = Vector3::from(com_mm.map(|c| c * MM));
    }
    links
}
