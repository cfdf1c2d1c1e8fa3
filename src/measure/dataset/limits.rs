//! Limits on plausible values: for datasets and, checked with the same messages, for scenarios.

use toml::Value;

/// Limits on numbers of `dataset.toml`, by the end of their keys: least, most, and a hint.
///
/// The limits are generous: they reject a wrong unit or a typing error, never a large cell.
const KEYS: &[(&str, [f64; 2], &str)] = &[
    ("tool.x_mm", [-1e4, 1e4], MM),
    ("tool.y_mm", [-1e4, 1e4], MM),
    ("tool.z_mm", [-1e4, 1e4], MM),
    ("x_mm", [-5e4, 5e4], MM),
    ("y_mm", [-5e4, 5e4], MM),
    ("z_mm", [-5e4, 5e4], MM),
    ("d_mm", [0.0, 1e5], MM),
    ("a_deg", [-360.0, 360.0], TURN),
    ("b_deg", [-360.0, 360.0], TURN),
    ("c_deg", [-360.0, 360.0], TURN),
    ("mass_kg", [0.0, 5e3], "give the mass in kilograms"),
    ("com_mm", [-1e4, 1e4], MM),
    ("contact_force_n", [-1e3, 1e3], "give the force in newtons"),
    ("gravity_m_s2", [-30.0, 30.0], "give gravity in m/s2"),
    ("sigma_um", [0.0, 1e6], UM),
    ("sigma_deg", [0.0, 360.0], TURN),
    ("orientation_deg", [0.0, 360.0], TURN),
    ("ball_um", [0.0, 1e6], UM),
    ("point_um", [0.0, 1e6], UM),
    ("joint_arcsec", [0.0, 1e5], "give the angle in seconds of arc"),
    ("joint_um", [0.0, 1e6], UM),
];
const MM: &str = "give the length in millimetres";
const UM: &str = "give the length in micrometres";
const TURN: &str = "give the angle in degrees, within a turn";

/// Temperatures of a robot, deg C.
pub(crate) const TEMPERATURE_C: [f64; 2] = [-90.0, 200.0];
/// Torques of a joint, N·m.
pub(super) const TORQUE_NM: [f64; 2] = [-1e6, 1e6];

/// Seconds since a session began; seconds since 1970 are allowed too.
pub(crate) const TIME_S: [f64; 2] = [0.0, 1e10];
/// Coordinates of a measured point, and distances, mm: trackers reach 100 m.
pub(super) const POINT_MM: [f64; 2] = [-1e5, 1e5];
/// Components of a rotation vector, and one-sigmas of an orientation, deg: within a turn.
pub(super) const ROTATION_DEG: [f64; 2] = [-360.0, 360.0];
/// Readings of an indicator, and one-sigmas, um.
pub(super) const READING_UM: [f64; 2] = [-1e6, 1e6];

/// A number outside the plausible limits.
pub(super) struct Impossible {
    pub key: String,
    pub problem: String,
    pub remedy: &'static str,
}

/// Returns the first implausible number of a description; the free keys of `provenance` are not checked.
pub(super) fn impossible(description: &toml::Table) -> Option<Impossible> {
    let parts = description.iter().filter(|(key, _)| *key != "provenance");
    parts.into_iter().find_map(|(key, value)| walk(key, value))
}

fn walk(key: &str, value: &Value) -> Option<Impossible> {
    match value {
        Value::Float(v) => judge(key, *v),
        Value::Integer(v) => judge(key, *v as f64),
        Value::Array(list) => list.iter().enumerate().find_map(|(k, v)| walk(&format!("{key}[{k}]"), v)),
        Value::Table(table) => table.iter().find_map(|(k, v)| walk(&format!("{key}.{k}"), v)),
        _ => None,
    }
}

fn judge(key: &str, value: f64) -> Option<Impossible> {
    let plain =
        key.rsplit_once('[').filter(|(_, end)| end.ends_with(']') && !end.contains('.')).map_or(key, |(start, _)| start);
    let ends = |end: &str| plain.strip_suffix(end).is_some_and(|start| start.is_empty() || start.ends_with('.'));
    let (_, [least, most], remedy) = KEYS.iter().find(|(end, ..)| ends(end))?;
    let problem = out_of_range(value, [*least, *most])?;
    Some(Impossible { key: key.into(), problem, remedy })
}

/// The problem with a number that is not between `least` and `most`, if any.
pub(crate) fn out_of_range(value: f64, [least, most]: [f64; 2]) -> Option<String> {
    // `contains`, not its negated comparisons: NaN lies within no range.
    let is_within = (least..=most).contains(&value);
    (!is_within).then(|| format!("{value} is impossible in a cell: at least {least}, at most {most}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_no_cell_has_is_named_by_its_key() {
        for (text, key) in [
            ("[[ball]]\nx_mm = 1.0\n[[ball]]\nx_mm = 1e5", Some("ball[1].x_mm")),
            ("[tool]\nz_mm = 12000.0", Some("tool.z_mm")),
            ("[base]\na_deg = 785.0", Some("base.a_deg")),
            ("[[payload]]\nmass_kg = 6000", Some("payload[0].mass_kg")),
            ("[[payload]]\ncom_mm = [0.0, nan, 0.0]", Some("payload[0].com_mm[1]")),
            ("[noise]\njoint_arcsec = [1.0, -1.0]", Some("noise.joint_arcsec[1]")),
            ("gravity_m_s2 = [0.0, 0.0, -9810.0]", Some("gravity_m_s2[2]")),
            ("[base]\nx_mm = 12000.0\n[provenance]\nx_mm = 1e9", None),
        ] {
            let found = impossible(&text.parse().expect("TOML"));
            assert_eq!(found.map(|i| i.key).as_deref(), key, "{text}");
        }
    }
}
