//! The keys of `[[indicator]]` in a cell file.

use serde::Deserialize;

use super::{CellIndicator, Dialect, IndicatorSettings, LineSettings, Place};
use crate::cell::CellReading;
use crate::files::{FileError, name_remedy};

/// An indicator, and where it is found.
#[derive(Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub(crate) struct IndicatorKeys {
    /// The axis of the tool that it measures.
    axis: Axis,
    /// A serial port, `/dev/ttyUSB0` or `COM3`; either this or `address`.
    port: Option<String>,
    /// `HOST:PORT`; either this or `port`.
    address: Option<String>,
    /// The language of the instrument: `sylvac`, `mahr`, `mahr-c1202`, `mitutoyo`, `chicago`, `heidenhain`.
    #[serde(default = "sylvac")]
    dialect: String,
    /// Settings of the serial line, such as `4800 7E2`; those of the dialect's cable if not given. `9600 8N1` for virtual
    /// ports and pseudo-terminals.
    line: Option<String>,
    /// True if the reading decreases when the plunger is pushed in.
    #[serde(default)]
    counts_down: bool,
    /// Longest wait for an answer, s; 2.5 if not given.
    #[cfg_attr(feature = "schema", schemars(extend("exclusiveMinimum" = 0)))]
    timeout_s: Option<f64>,
    /// Longest wait for an echo, s; 0.3 if not given.
    echo_s: Option<f64>,
}

fn sylvac() -> String {
    Dialect::SYLVAC.name.into()
}

#[derive(Deserialize, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
enum Axis {
    X,
    Y,
    Z,
}

/// Reads the three indicators of `[[indicator]]`, in the order of the tool's axes.
///
/// # Errors
/// When an axis has no indicator or two, or a value is invalid.
pub(crate) fn indicators(reading: &CellReading<'_>, tables: &[IndicatorKeys]) -> Result<Option<[CellIndicator; 3]>, FileError> {
    let mut found: [Option<CellIndicator>; 3] = [None, None, None];
    for (k, table) in tables.iter().enumerate() {
        let place = &mut found[table.axis as usize];
        if place.is_some() {
            let key = format!("indicator[{k}].axis");
            return Err(reading.wrong(&key, "another indicator is on this axis", "give each of x, y, z one indicator"));
        }
        *place = Some(indicator(reading, k, table)?);
    }
    match found {
        [Some(x), Some(y), Some(z)] => Ok(Some([x, y, z])),
        [None, None, None] => Ok(None),
        _ => Err(reading.wrong("indicator", format!("there are {}", tables.len()), "give three, of the axes x, y and z")),
    }
}

fn indicator(reading: &CellReading<'_>, k: usize, table: &IndicatorKeys) -> Result<CellIndicator, FileError> {
    let key = |field: &str| format!("indicator[{k}].{field}");
    let Some(dialect) = Dialect::named(&table.dialect) else {
        let remedy = name_remedy(&table.dialect, &Dialect::ALL.map(|dialect| dialect.name));
        return Err(reading.wrong(&key("dialect"), format!("`{}` is not known", table.dialect), &remedy));
    };
    let line = match &table.line {
        None => dialect.line,
        Some(text) => LineSettings::parse(text).ok_or_else(|| {
            reading.wrong(&key("line"), format!("'{text}' is not understood"), "give it as `4800 7E2` or `9600 8N1`")
        })?,
    };
    let place = match (&table.port, &table.address) {
        (Some(port), None) => Place::Serial(port.clone(), line),
        (None, Some(address)) => {
            reading.address(&key("address"), address)?;
            Place::Socket(address.clone())
        }
        _ => {
            let remedy = "give either `port`, a serial port, or `address`, as HOST:PORT";
            return Err(reading.wrong(&format!("indicator[{k}]"), "its port or address is not stated exactly once", remedy));
        }
    };
    let mut settings = IndicatorSettings { counts_down: table.counts_down, ..IndicatorSettings::new(dialect) };
    if let Some(value) = table.timeout_s {
        settings.timeout = reading.time(&key("timeout_s"), reading.positive(&key("timeout_s"), value)?, 1.0)?;
    }
    if let Some(value) = table.echo_s {
        settings.echo = reading.time(&key("echo_s"), value, 1.0)?;
    }
    Ok(CellIndicator { place, settings })
}
