//! Indicators that answer requests in ASCII, over a serial line or a socket.

mod ascii_indicator;
mod cell_indicator;
mod dialect;
mod digimatic;
mod frame_seen;
mod keys;
mod line;
mod port;
mod reply;

pub use ascii_indicator::{AsciiIndicator, Identity, IndicatorSettings, Traffic};
pub use cell_indicator::{CellGauge, CellIndicator, Place, PortError};
pub use dialect::{Dialect, LineSettings, Parity, PresetManner};
pub use digimatic::{DigimaticError, DigimaticWord};
pub(crate) use keys::{IndicatorKeys, indicators};
pub use line::{LONGEST_LINE, LineReader};
pub use port::{Port, open_serial, open_socket};
pub use reply::{DisplayUnit, GaugeReading, GaugeReply, ReadingFormat, Tolerance};
