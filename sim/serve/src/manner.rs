//! Response formats of the makers' indicators, and the quirks by which they differ.

use calibench::cell::gauge::{DisplayUnit, ReadingFormat};

/// Maker whose response format is used.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Maker {
    /// `+006.3500` CR, and the full command set.
    #[default]
    Sylvac,
    /// The unit after the value, CR LF.
    Mahr,
    /// Mitutoyo's converter: `01A+0006.350` CR in response to each `1`; no other request or setting exists.
    Digimatic,
}

/// Response format of the instruments.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Manner {
    /// The maker.
    pub maker: Maker,
    /// Commands that set something are not echoed.
    pub no_echo: bool,
    /// Numbers have a decimal comma.
    pub comma: bool,
    /// Lines end with CR LF.
    pub crlf: bool,
    /// The tolerance mode is on initially, and a verdict follows each value.
    pub tolerance: bool,
    /// Digits after the point in millimetres, if different from those of 0.1 um.
    pub decimals: Option<u8>,
    /// A preset is recalled by `PRE ON` only, as on newer instruments, and `PRE` alone is unknown.
    pub preset_on: bool,
}

impl Manner {
    /// Initial number of digits after the point in millimetres: those of 0.1 um; a converter's six digits resolve 1 um.
    pub fn decimals(&self) -> u8 {
        self.decimals.unwrap_or(if self.maker == Maker::Digimatic { 3 } else { 4 })
    }

    /// Format of a value: an inch has two decimals more than a millimetre, and needs none of the three digits before the point.
    pub fn format(&self, unit: DisplayUnit, decimals: u8, verdict: &'static str) -> ReadingFormat {
        let inch = unit == DisplayUnit::Inch;
        let decimals = usize::from(decimals) + if inch { 2 } else { 0 };
        let whole = match self.maker {
            Maker::Digimatic => 4,
            _ if inch => 1,
            _ => 3,
        };
        let (before, after) = match self.maker {
            Maker::Sylvac => ("", verdict),
            Maker::Mahr => ("", if inch { "in" } else { "mm" }),
            Maker::Digimatic => ("01A", ""),
        };
        ReadingFormat { whole, decimals, comma: self.comma, before, after, end: self.end() }
    }

    /// Line ending.
    pub fn end(&self) -> &'static str {
        if self.crlf || self.maker == Maker::Mahr { "\r\n" } else { "\r" }
    }
}
