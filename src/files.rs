//! Files are written whole or not at all; errors name the file, the line, the field and the remedy.

mod csv_table;
mod error;
mod folder;
#[cfg(target_family = "wasm")]
pub mod memory;
mod names;
mod output;
mod place;
mod rows;
mod streams;
mod target;
mod text;
mod toml_document;
mod whole;

pub use csv_table::{CsvRow, CsvTable};
pub use error::{FileError, FileErrorKind, cannot_be_read, cannot_be_written, one_line, with_reasons};
pub use folder::replace_folder;
pub use names::{name_remedy, nearest_name};
pub use place::{OpenFile, is_file, is_folder, is_there, read_bytes};
pub use output::{check_output_file, check_output_folder};
pub(crate) use rows::{Record, Rows};
pub use streams::{STANDARD_INPUT, STANDARD_OUTPUT, is_standard_input, is_standard_output};
pub use text::{open_file, read_text};
pub use toml_document::{field_error, parse_toml};
pub(crate) use whole::sync_folder_of;
pub use whole::{write_streamed, write_whole};

/// Bytes as hexadecimal digits, two each.
pub(crate) fn hexadecimal(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}
