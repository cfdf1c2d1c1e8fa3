//! Lengths and times with their units, as they are typed.

use calibench::units::{MM, UM};

/// A length with its unit, m.
pub fn length(text: &str) -> Result<f64, String> {
    let units = [("um", UM), ("µm", UM), ("mm", MM), ("m", 1.0)];
    quantity(text, &units).ok_or_else(|| "give a length with its unit, such as 20um or 0.2mm".into())
}

/// A time with its unit, s.
pub fn duration(text: &str) -> Result<f64, String> {
    quantity(text, &[("min", 60.0), ("s", 1.0)]).ok_or_else(|| "give a time with its unit, such as 30s or 2min".into())
}

/// A time with its unit that may be negative, s.
pub fn signed_duration(text: &str) -> Result<f64, String> {
    let (size, sign) = text.strip_prefix('-').map_or((text, 1.0), |size| (size, -1.0));
    let units = [("min", 60.0), ("ms", 1e-3), ("s", 1.0)];
    let time =
        if size.trim_end_matches(char::is_alphabetic).parse::<f64>() == Ok(0.0) { Some(0.0) } else { quantity(size, &units) };
    time.map(|time| sign * time).ok_or_else(|| "give a time with its unit, such as -0.12s or 3min".into())
}

/// A positive number with one of these units, of which the first that fits is its own, in SI.
fn quantity(text: &str, units: &[(&str, f64)]) -> Option<f64> {
    let (unit, si) = units.iter().find(|(unit, _)| text.ends_with(unit))?;
    let number: f64 = text[..text.len() - unit.len()].trim().parse().ok()?;
    (number > 0.0 && number.is_finite()).then_some(number * si)
}
