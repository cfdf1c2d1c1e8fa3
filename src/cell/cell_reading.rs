//! Checked values of a cell file; an error names the key, the line and the remedy.

use std::path::Path;
use std::time::Duration;

use crate::files::{FileError, field_error};

/// The text of a cell file while it is read. Its errors name the key.
pub struct CellReading<'a> {
    /// The file.
    pub path: &'a Path,
    /// Its text.
    pub text: &'a str,
}

impl CellReading<'_> {
    /// The error of a key.
    pub fn wrong(&self, key: &str, problem: impl Into<String>, remedy: &str) -> FileError {
        field_error(self.path, self.text, key, problem, remedy)
    }

    /// A positive number.
    ///
    /// # Errors
    /// When it is not.
    pub fn positive(&self, key: &str, value: f64) -> Result<f64, FileError> {
        if value > 0.0 { Ok(value) } else { Err(self.wrong(key, format!("{value} is not positive"), "give a positive number")) }
    }

    pub(crate) fn percent(&self, key: &str, value: u8) -> Result<u8, FileError> {
        match value {
            1..=100 => Ok(value),
            _ => Err(self.wrong(key, format!("{value} is not a speed override"), "give 1 to 100")),
        }
    }

    /// Converts a time in units of `unit` seconds.
    ///
    /// # Errors
    /// When it is negative, or a day or more, which is not a reasonable wait.
    pub fn time(&self, key: &str, value: f64, unit: f64) -> Result<Duration, FileError> {
        let seconds = value * unit;
        if !(0.0..86_400.0).contains(&seconds) {
            return Err(self.wrong(key, format!("{value} is not a waiting time"), "give zero or more, less than a day"));
        }
        Ok(Duration::from_secs_f64(seconds))
    }

    /// Checks a `HOST:PORT`.
    ///
    /// # Errors
    /// When it is not one.
    pub fn address(&self, key: &str, address: &str) -> Result<(), FileError> {
        let is_host = |host: &str| !host.is_empty() && !host.contains(|c: char| c == '/' || c == '@' || c.is_whitespace());
        let is_one = address.rsplit_once(':').is_some_and(|(host, port)| is_host(host) && port.parse::<u16>().is_ok());
        if is_one { Ok(()) } else { Err(self.wrong(key, format!("'{address}' is not an address"), "give it as HOST:PORT")) }
    }
}
