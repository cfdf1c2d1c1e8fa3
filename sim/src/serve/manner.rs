//! How makers' indicators write what they answer, and the quirks in which one differs from the next.

use calibench::cell::gauge::{DisplayUnit, ReadingFormat};

/// Whose manner of answering.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, clap::ValueEnum)]
pub enum Maker {
    /// `+006.3500` CR, and the whole set of commands.
    #[default]
    Sylvac,
    /// The unit after the value, CR LF.
    Mahr,
    /// Mitutoyo's converter: `01A+0006.350` CR at each `1`; nothing else can be asked or set.
    Digimatic,
}

/// How the instruments answer, beyond what they measure.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Manner {
    /// Whose.
    pub maker: Maker,
    /// Commands that set something are answered with nothing, not with an echo.
    pub no_echo: bool,
    /// Numbers have a comma.
    pub comma: bool,
    /// Lines end with CR LF.
    pub crlf: bool,
    /// The tolerance mode is on from the beginning, and a verdict follows each value.
    pub tolerance: bool,
    /// Digits after the point in millimetres, where they are not those of 0.1 um.
    pub decimals: Option<u8>,
    /// A preset is recalled by `PRE ON` only, as on newer instruments, and `PRE` alone is not known.
    pub preset_on: bool,
}

impl Manner {
    /// Digits after the point in millimetres at first: 0.1 um; six digits of a converter hold 1 um.
    pub fn decimals(&self) -> u8 {
        self.decimals.unwrap_or(if self.maker == Maker::Digimatic { 3 } else { 4 })
    }

    /// How a value is written: an inch has two decimals more than a millimetre, and needs none of the three digits before the point.
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

    /// What ends a line.
    pub fn end(&self) -> &'static str {
        if self.crlf || self.maker == Maker::Mahr { "\r\n" } else { "\r" }
    }
}
