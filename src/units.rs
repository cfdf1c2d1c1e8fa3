//! Conversions between the SI units used internally and the workshop units used in files and tables.
//!
//! Multiply on input (`35.0 * MM` is 0.035 m), divide on output (`x / MM`).

use std::borrow::Cow;
use std::f64::consts::PI;

/// One millimetre in metres.
pub const MM: f64 = 1e-3;
/// One micrometre in metres.
pub const UM: f64 = 1e-6;
/// One degree in radians.
pub const DEG: f64 = PI / 180.0;
/// One arc second in radians.
pub const ARCSEC: f64 = PI / 648_000.0;
/// One milliradian in radians.
pub const MRAD: f64 = 1e-3;
/// One microradian in radians.
pub const URAD: f64 = 1e-6;

/// The number to write for a quantity of `si` in `unit`: the shortest that reads back bit for bit, if there is one.
///
/// ```
/// use calibench::units::{DEG, readable};
///
/// let q = 35.1 * DEG;
/// assert_eq!(readable(q, DEG), 35.1);
/// ```
pub fn readable(si: f64, unit: f64) -> f64 {
    let plain = si / unit;
    // 15 digits always survive in a double, 17 always identify it.
    (15..=17)
        .filter_map(|digits| format!("{plain:.*e}", digits - 1).parse::<f64>().ok())
        .chain([plain.next_down(), plain.next_up()])
        .find(|value| value * unit == si)
        .unwrap_or(plain)
}

/// The number with this many decimals, zero without a sign.
///
/// ```
/// use calibench::units::decimal;
///
/// assert_eq!(decimal(-35.04, 1), "-35.0");
/// assert_eq!(decimal(-0.04, 1), "0.0");
/// ```
#[must_use]
pub fn decimal(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    if text.trim_start_matches('-').trim_matches(['0', '.']).is_empty() { text.trim_start_matches('-').into() } else { text }
}

/// The display unit of a parameter: its spelling and its SI value.
///
/// ```
/// use calibench::units::Unit;
///
/// assert_eq!(Unit::MM.to_si(35.0), 0.035);
/// assert_eq!(Unit::from_symbol("um/m"), Some(Unit::UM_PER_M));
/// assert_eq!(Unit::UM_PER_M.printed(), "µm/m");
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Unit {
    /// As printed in tables and JSON, e.g. `mdeg/(N·m)`.
    pub symbol: &'static str,
    /// As the suffix of a key in a file, e.g. `mdeg_per_nm`.
    pub suffix: &'static str,
    /// The SI value of one such unit.
    pub si: f64,
}

impl Unit {
    /// Millimetre.
    pub const MM: Unit = Unit { symbol: "mm", suffix: "mm", si: MM };
    /// Micrometre.
    pub const UM: Unit = Unit { symbol: "um", suffix: "um", si: UM };
    /// Degree.
    pub const DEG: Unit = Unit { symbol: "deg", suffix: "deg", si: DEG };
    /// Milliradian.
    pub const MRAD: Unit = Unit { symbol: "mrad", suffix: "mrad", si: MRAD };
    /// Microradian.
    pub const URAD: Unit = Unit { symbol: "urad", suffix: "urad", si: URAD };
    /// Thousandth of a degree per newton metre, the paper's unit of joint compliance.
    pub const MDEG_PER_NM: Unit = Unit { symbol: "mdeg/(N·m)", suffix: "mdeg_per_nm", si: 1e-3 * DEG };
    /// Microradian per newton metre.
    pub const URAD_PER_NM: Unit = Unit { symbol: "urad/(N·m)", suffix: "urad_per_nm", si: URAD };
    /// Inverse bending or torsional stiffness of a beam, 1e-6 / (N·m²).
    pub const PER_MN_M2: Unit = Unit { symbol: "1/(MN·m²)", suffix: "per_mn_m2", si: 1e-6 };
    /// A ratio.
    pub const RATIO: Unit = Unit { symbol: "1", suffix: "ratio", si: 1.0 };

    /// Microradian per radian, a millionth of an angle.
    pub const URAD_PER_RAD: Unit = Unit { symbol: "urad/rad", suffix: "urad_per_rad", si: 1e-6 };
    /// Micrometre per metre, a millionth of a length.
    pub const UM_PER_M: Unit = Unit { symbol: "um/m", suffix: "um_per_m", si: 1e-6 };
    /// Micrometre per metre and kelvin, a millionth of a length per kelvin.
    pub const UM_PER_M_K: Unit = Unit { symbol: "um/(m·K)", suffix: "um_per_m_k", si: 1e-6 };
    /// Kilogram.
    pub const KG: Unit = Unit { symbol: "kg", suffix: "kg", si: 1.0 };
    /// First moment of a mass.
    pub const KG_M: Unit = Unit { symbol: "kg·m", suffix: "kg_m", si: 1.0 };

    /// All units.
    pub const ALL: [Unit; 14] = [
        Unit::MM,
        Unit::UM,
        Unit::DEG,
        Unit::MRAD,
        Unit::URAD,
        Unit::MDEG_PER_NM,
        Unit::URAD_PER_NM,
        Unit::PER_MN_M2,
        Unit::RATIO,
        Unit::URAD_PER_RAD,
        Unit::UM_PER_M,
        Unit::UM_PER_M_K,
        Unit::KG,
        Unit::KG_M,
    ];

    /// The symbol on screens and in sentences: that of files, with µ for micro.
    #[must_use]
    pub fn printed(self) -> Cow<'static, str> {
        match self.symbol.strip_prefix('u') {
            Some(rest) => Cow::Owned(format!("µ{rest}")),
            None => Cow::Borrowed(self.symbol),
        }
    }

    /// The unit with this symbol.
    pub fn from_symbol(symbol: &str) -> Option<Unit> {
        Unit::ALL.into_iter().find(|u| u.symbol == symbol)
    }

    /// The value in this unit of a quantity given in SI.
    pub fn from_si(&self, si: f64) -> f64 {
        si / self.si
    }

    /// The SI value of a quantity given in this unit.
    pub fn to_si(&self, value: f64) -> f64 {
        value * self.si
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_read_back_as_they_were_written() {
        for unit in [MM, UM, DEG, ARCSEC, 1.0] {
            for k in 1..20_000 {
                let written = (f64::from(k) - 3300.0) / 1000.0;
                let text = format!("{written}");
                let si = text.parse::<f64>().expect("a number") * unit;
                assert_eq!(readable(si, unit) * unit, si, "{text} in units of {unit}");
                assert!(format!("{}", readable(si, unit)).len() <= text.len(), "{text} in units of {unit}");
            }
        }
    }
}
