//! Answers of an indicator as text.
//!
//! ```text
//! reading : [channel] [sign] 1..4 digits ('.' | ',') 1..6 digits [","] [inch] [tolerance] [state] [unit]
//! fault   : "ERR" digit            0 sensor   1 incorrect command   2 parity error   3 measuring range exceeded
//! ```
//!
//! Sylvac answers `+006.3500`, with `<`, `=` or `>` after it when its tolerance mode is on; Mahr puts the unit after the
//! number; Mitutoyo's converters put `01A` before it; Chicago a comma before the unit; Heidenhain the state of a series of
//! measurements after the verdict, `S`, `A`, `G` or `D`, or the axis. Sources: Käfer OPTO-RS manual, Sylvac MEM-PM 292-1806-01, Bowers UniCal
//! manual, Mahr Millimar C1208 manual, Mitutoyo 99MAF600B.

use crate::units::{MM, UM};

/// The unit of a display.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DisplayUnit {
    /// mm.
    Millimetre,
    /// in.
    Inch,
    /// um.
    Micrometre,
}

/// Verdict of the tolerance mode on a value.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Tolerance {
    /// `<`
    Below,
    /// `=`
    Within,
    /// `>`
    Above,
}

/// A displayed value.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GaugeReading {
    /// Value in the unit of the display.
    pub value: f64,
    /// Number of decimals.
    pub decimals: usize,
    /// The unit, if the answer contains it.
    pub unit: Option<DisplayUnit>,
    /// The verdict, when the tolerance mode is on.
    pub tolerance: Option<Tolerance>,
}

/// A line from an indicator.
#[derive(Debug, Clone, PartialEq)]
pub enum GaugeReply {
    /// A value.
    Reading(GaugeReading),
    /// `ERR0` to `ERR9`.
    Fault(u8),
    /// Printable words: an identity, a setting, an echo.
    Words(String),
    /// Bytes that no indicator sends.
    Noise,
}

impl DisplayUnit {
    /// The length of one unit, m.
    pub fn metres(self) -> f64 {
        match self {
            DisplayUnit::Millimetre => MM,
            // The international inch.
            DisplayUnit::Inch => 25.4 * MM,
            DisplayUnit::Micrometre => UM,
        }
    }

    /// Parses a name such as `mm`, `MM`, `IN`, `"`.
    pub fn parse(name: &str) -> Option<Self> {
        match name.trim().to_ascii_lowercase().as_str() {
            "mm" => Some(DisplayUnit::Millimetre),
            "in" | "inch" | "\"" => Some(DisplayUnit::Inch),
            "um" | "µm" => Some(DisplayUnit::Micrometre),
            _ => None,
        }
    }
}

impl GaugeReply {
    /// Parses a line (without its end).
    pub fn parse(line: &[u8]) -> Self {
        let printable = line.iter().all(|byte| (0x20..0x7f).contains(byte));
        let Some(text) = printable.then(|| std::str::from_utf8(line).ok()).flatten().map(str::trim) else {
            return GaugeReply::Noise;
        };
        let upper = text.to_ascii_uppercase();
        if let Some(&[digit]) = upper.strip_prefix("ERR").map(|rest| rest.trim().as_bytes())
            && digit.is_ascii_digit()
        {
            return GaugeReply::Fault(digit - b'0');
        }
        reading(text).map_or_else(|| GaugeReply::Words(text.into()), GaugeReply::Reading)
    }
}

/// States of a series of measurements, and axes, after a value of Heidenhain's display units: smallest, actual, largest,
/// difference; first, second, computed.
const HEIDENHAIN_STATES: [&str; 7] = ["S", "A", "G", "D", "1", "2", "F"];

/// Removes the channel: `01A` of Mitutoyo's converters, `1_` of Mahr's multi-channel instruments.
fn without_channel(text: &str) -> &str {
    let digits = text.bytes().take_while(u8::is_ascii_digit).count();
    match (digits, &text[digits..]) {
        (2, rest) if rest.starts_with('A') => &rest[1..],
        (1 | 2, rest) if rest.starts_with('_') => &rest[1..],
        _ => text,
    }
}

fn reading(text: &str) -> Option<GaugeReading> {
    let text = without_channel(text.strip_suffix(';').unwrap_or(text));
    let negative = text.starts_with('-');
    let text = text.strip_prefix(['+', '-']).unwrap_or(text).trim_start();
    let whole = text.bytes().take_while(u8::is_ascii_digit).count();
    let rest = text[whole..].strip_prefix(['.', ','])?;
    let decimals = rest.bytes().take_while(u8::is_ascii_digit).count();
    if !(1..=4).contains(&whole) || !(1..=6).contains(&decimals) {
        return None;
    }
    let (mut tolerance, mut unit) = (None, None);
    let mut after = rest[decimals..].trim_start_matches([' ', '_', ',']);
    if let Some(more) = after.strip_prefix('"') {
        unit = Some(DisplayUnit::Inch);
        after = more.trim_start();
    }
    if let Some(verdict) = after.chars().next().and_then(verdict) {
        tolerance = Some(verdict);
        after = after[1..].trim_start();
    }
    if !after.is_empty() && !HEIDENHAIN_STATES.contains(&after) {
        unit = Some(DisplayUnit::parse(after)?);
    }
    let value: f64 = format!("{}.{}", &text[..whole], &rest[..decimals]).parse().ok()?;
    Some(GaugeReading { value: if negative { -value } else { value }, decimals, unit, tolerance })
}

fn verdict(sign: char) -> Option<Tolerance> {
    match sign {
        '<' => Some(Tolerance::Below),
        '=' => Some(Tolerance::Within),
        '>' => Some(Tolerance::Above),
        _ => None,
    }
}

/// Format in which an indicator writes its values.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ReadingFormat {
    /// Digits before the point, padded with zeros.
    pub whole: usize,
    /// Digits after the point.
    pub decimals: usize,
    /// True for a comma instead of the point.
    pub comma: bool,
    /// Text before the sign.
    pub before: &'static str,
    /// Text after the digits.
    pub after: &'static str,
    /// End of the line.
    pub end: &'static str,
}

impl ReadingFormat {
    /// Sylvac at 0.1 um: `+006.3500` CR.
    pub const SYLVAC: ReadingFormat = ReadingFormat { whole: 3, decimals: 4, comma: false, before: "", after: "", end: "\r" };

    /// Formats the line that shows `value`, in the unit of the display.
    ///
    /// ```
    /// use calibench::cell::gauge::ReadingFormat;
    ///
    /// assert_eq!(ReadingFormat::SYLVAC.encode(6.35), b"+006.3500\r");
    /// ```
    pub fn encode(&self, value: f64) -> Vec<u8> {
        let ReadingFormat { whole, decimals, comma, before, after, end } = *self;
        let digits = format!("{:0width$.decimals$}", value.abs(), width = whole + 1 + decimals);
        // A display has no negative zero.
        let sign = if value < 0.0 && digits.bytes().any(|b| (b'1'..=b'9').contains(&b)) { '-' } else { '+' };
        let digits = if comma { digits.replace('.', ",") } else { digits };
        format!("{before}{sign}{digits}{after}{end}").into_bytes()
    }
}
