//! Files are written whole or not at all; errors name the file, the line, the field and the remedy.
//!
//! They are on the disk or, in a browser, which has none for a program, in memory.

pub mod csv_table;
pub mod disk;
mod encoding;
mod error;
#[cfg(target_family = "wasm")]
pub mod memory;
mod names;
mod rows;
pub mod streams;
mod text;
mod toml_document;

pub(crate) use encoding::Transcoded;
pub use error::{FileError, FileErrorKind, cannot_be_read, cannot_be_written, one_line, with_reasons};
pub use names::{name_remedy, nearest_name};
pub(crate) use rows::{Record, Rows};
pub(crate) use text::read_foreign_text;
pub use text::{read_bytes, read_text};
pub use toml_document::{field_error, parse_toml};

/// Bytes as hexadecimal digits, two each.
pub(crate) fn hexadecimal(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}
