//! An indicator of a cell: its address and how it is opened.

use thiserror::Error;

use super::{AsciiIndicator, IndicatorSettings, LineSettings, Port, open_serial, open_socket};

/// Address and protocol of an indicator.
#[derive(Debug, Clone, PartialEq)]
pub struct CellIndicator {
    /// Address.
    pub place: Place,
    /// Protocol settings.
    pub settings: IndicatorSettings,
}

/// Address of an indicator.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Place {
    /// A serial port with these settings.
    Serial(String, LineSettings),
    /// A socket, `HOST:PORT`.
    Socket(String),
}

impl std::fmt::Display for Place {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Place::Serial(place, _) | Place::Socket(place) => f.write_str(place),
        }
    }
}

/// An indicator of a cell, whatever its port.
pub type CellGauge = AsciiIndicator<Box<dyn Port + Send>>;

/// An indicator's port does not open.
#[derive(Debug, Error)]
#[error("indicator {} at {place} cannot be opened: {error}", axis + 1)]
pub struct PortError {
    /// Axis, counted from 0.
    pub axis: usize,
    /// Its address.
    pub place: Place,
    /// Error of the operating system.
    pub error: std::io::Error,
}

impl CellIndicator {
    /// Opens the indicator that measures along this axis (counted from 0).
    ///
    /// # Errors
    /// When its port does not open.
    pub fn open(&self, axis: usize) -> Result<CellGauge, PortError> {
        let port: std::io::Result<Box<dyn Port + Send>> = match &self.place {
            Place::Serial(path, line) => open_serial(path, *line).map(|port| Box::new(port) as _),
            Place::Socket(address) => open_socket(address, self.settings.timeout).map(|port| Box::new(port) as _),
        };
        let port = port.map_err(|error| PortError { axis, place: self.place.clone(), error })?;
        Ok(AsciiIndicator::new(port, self.settings.clone()))
    }
}
