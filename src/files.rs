//! Files are written whole or not at all; errors name the file, the line, the field and the remedy.
//!
//! They are on the disk or, in a browser, which has none for a program, in memory.

mod csv_table;
mod error;
#[cfg(not(target_family = "wasm"))]
mod folder;
#[cfg(target_family = "wasm")]
pub mod memory;
mod names;
#[cfg(not(target_family = "wasm"))]
mod output;
#[cfg(not(target_family = "wasm"))]
mod place;
mod rows;
mod streams;
#[cfg(not(target_family = "wasm"))]
mod target;
mod text;
mod toml_document;
#[cfg(not(target_family = "wasm"))]
mod whole;

pub use csv_table::{CsvRow, CsvTable};
pub use error::{FileError, FileErrorKind, cannot_be_read, cannot_be_written, one_line, with_reasons};
#[cfg(not(target_family = "wasm"))]
pub use folder::replace_folder;
#[cfg(target_family = "wasm")]
pub(crate) use memory::sync_folder_of;
#[cfg(target_family = "wasm")]
pub use memory::{
    OpenFile, check_output_file, check_output_folder, is_file, is_folder, is_there, open_file, read_bytes, replace_folder,
    write_streamed, write_whole,
};
pub use names::{name_remedy, nearest_name};
#[cfg(not(target_family = "wasm"))]
pub use output::{check_output_file, check_output_folder};
#[cfg(not(target_family = "wasm"))]
pub use place::{OpenFile, is_file, is_folder, is_there, open_file, read_bytes};
pub(crate) use rows::{Record, Rows};
pub use streams::{STANDARD_INPUT, STANDARD_OUTPUT, is_standard_input, is_standard_output};
#[cfg(not(target_family = "wasm"))]
pub use target::full_path;
pub use text::read_text;
pub use toml_document::{field_error, parse_toml};
#[cfg(not(target_family = "wasm"))]
pub(crate) use whole::sync_folder_of;
#[cfg(not(target_family = "wasm"))]
pub use whole::{write_streamed, write_whole};

/// Bytes as hexadecimal digits, two each.
pub(crate) fn hexadecimal(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}
