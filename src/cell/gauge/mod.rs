//! Indicators that answer requests in ASCII, over a serial line or a socket.

mod dialect;
mod digimatic;
mod line;
mod reply;

pub use dialect::{Dialect, LineSettings, Parity, PresetManner};
pub use digimatic::{DigimaticError, DigimaticWord};
pub use line::{LONGEST_LINE, LineReader};
pub use reply::{DisplayUnit, GaugeReading, GaugeReply, ReadingFormat, Tolerance};
