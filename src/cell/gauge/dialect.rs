//! Differences between the makers' dialects of the request protocol.

/// Parity bit of a serial line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Parity {
    /// None.
    None,
    /// Even.
    Even,
    /// Odd.
    Odd,
}

/// Settings of a serial line; a virtual one ignores them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LineSettings {
    /// Bits per second.
    pub baud: u32,
    /// Data bits, 7 or 8.
    pub data_bits: u8,
    /// The parity bit.
    pub parity: Parity,
    /// Stop bits, 1 or 2.
    pub stop_bits: u8,
}

impl LineSettings {
    /// Sylvac's and Mahr's cables: 4800 baud, 7 data bits, even parity, 2 stop bits (Käfer OPTO-RS manual).
    pub const OPTO_RS: LineSettings = LineSettings { baud: 4800, data_bits: 7, parity: Parity::Even, stop_bits: 2 };
    /// Virtual ports, and Mitutoyo's converters: 9600 baud, 8 data bits, no parity, 1 stop bit.
    pub const VIRTUAL: LineSettings = LineSettings { baud: 9600, data_bits: 8, parity: Parity::None, stop_bits: 1 };

    /// Parses e.g. `4800 7E2`; `None` for any other format.
    ///
    /// ```
    /// use calibench::cell::gauge::LineSettings;
    ///
    /// assert_eq!(LineSettings::parse("4800 7E2"), Some(LineSettings::OPTO_RS));
    /// assert_eq!(LineSettings::parse("4800 9E2"), None);
    /// ```
    pub fn parse(text: &str) -> Option<Self> {
        let (baud, frame) = text.trim().split_once(' ')?;
        let baud = baud.parse().ok().filter(|baud| (300..=4_000_000).contains(baud))?;
        let &[data, parity, stop] = frame.trim().as_bytes() else { return None };
        let parity = match parity.to_ascii_uppercase() {
            b'N' => Parity::None,
            b'E' => Parity::Even,
            b'O' => Parity::Odd,
            _ => return None,
        };
        let fits = matches!(data, b'7' | b'8') && matches!(stop, b'1' | b'2');
        fits.then_some(LineSettings { baud, data_bits: data - b'0', parity, stop_bits: stop - b'0' })
    }
}

/// Method of making an indicator show a given value at the present plunger position.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PresetManner {
    /// The instrument keeps a preset: `PRE +6.350` stores it, `PRE?` queries it, and the first of `recall` that works sets the
    /// display.
    Instrument {
        /// Command before the value.
        store: &'static str,
        /// Query for the stored preset.
        query: &'static str,
        /// Commands that recall it; older and newer instruments differ.
        recall: &'static [&'static str],
    },
    /// The instrument keeps no preset; its driver stores the offset.
    Driver,
}

/// A dialect: commands without their terminator; `None` for commands that a dialect lacks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Dialect {
    /// Name used in files.
    pub name: &'static str,
    /// Line settings of a cable.
    pub line: LineSettings,
    /// Ends a command.
    pub end: &'static str,
    /// Queries the value.
    pub read: &'static str,
    /// Queries the identity.
    pub identity: Option<&'static str>,
    /// Queries the firmware version.
    pub version: Option<&'static str>,
    /// Queries the unit.
    pub unit: Option<&'static str>,
    /// Sets the unit to millimetres.
    pub millimetres: Option<&'static str>,
    /// Queries the battery: `BAT1` is good, `BAT0` low.
    pub battery: Option<&'static str>,
    /// Queries the resolution: `RES1`, `RES2`, `RES3`.
    pub resolution: Option<&'static str>,
    /// Method of mastering the indicator.
    pub preset: PresetManner,
}

impl Dialect {
    /// Sylvac and instruments built by Sylvac (Teclock, Käfer, Bowers, Hexagon TESA).
    pub const SYLVAC: Dialect = Dialect {
        name: "sylvac",
        line: LineSettings::OPTO_RS,
        end: "\r",
        read: "?",
        identity: Some("ID?"),
        version: Some("VER?"),
        unit: Some("UNI?"),
        millimetres: Some("MM"),
        battery: Some("BAT?"),
        resolution: Some("RES?"),
        // Older instruments recall by `PRE`, newer ones by `PRE ON` (S_Mike PRO manual, Teclock SSH manual).
        preset: PresetManner::Instrument { store: "PRE", query: "PRE?", recall: &["PRE", "PRE ON"] },
    };

    /// Mahr Millimar C1208, C1216, C1240 by OPTO-RS: the unit follows the value, lines end with CR LF.
    pub const MAHR: Dialect = Dialect {
        name: "mahr",
        millimetres: Some("mm"),
        battery: None,
        resolution: None,
        preset: PresetManner::Driver,
        ..Dialect::SYLVAC
    };

    /// Mahr Millimar C1202: as the others, but at 9600 baud and with the channel before the value.
    pub const MAHR_C1202: Dialect =
        Dialect { name: "mahr-c1202", line: LineSettings { baud: 9600, ..LineSettings::OPTO_RS }, ..Dialect::MAHR };

    /// Mitutoyo's Digimatic converters: `1` queries channel 1, the answer is `01A+0000.123`. Other converters use other
    /// requests.
    pub const MITUTOYO: Dialect = Dialect {
        name: "mitutoyo",
        line: LineSettings::VIRTUAL,
        end: "\r",
        read: "1",
        identity: None,
        version: None,
        unit: None,
        millimetres: None,
        battery: None,
        resolution: None,
        preset: PresetManner::Driver,
    };

    /// Chicago Dial Indicator's digital indicators by USB-232 or RS-232: `R` gives `+003.1000 ,MM` CR LF (their page on the
    /// protocol).
    pub const CHICAGO: Dialect = Dialect { name: "chicago", read: "R", ..Dialect::MITUTOYO };

    /// Heidenhain's display units ND 28x for length gauges: the character STX alone gives sign, ten characters, unit, class and
    /// state, CR LF (ND 287 manual, II-6).
    pub const HEIDENHAIN: Dialect = Dialect {
        name: "heidenhain",
        line: LineSettings { baud: 9600, ..LineSettings::OPTO_RS },
        end: "",
        read: "\u{2}",
        ..Dialect::MITUTOYO
    };

    /// All dialects.
    pub const ALL: [Dialect; 6] =
        [Dialect::SYLVAC, Dialect::MAHR, Dialect::MAHR_C1202, Dialect::MITUTOYO, Dialect::CHICAGO, Dialect::HEIDENHAIN];

    /// Returns the dialect of this name.
    pub fn named(name: &str) -> Option<Dialect> {
        Dialect::ALL.into_iter().find(|dialect| dialect.name == name)
    }
}
