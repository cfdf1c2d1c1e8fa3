//! Opening, checking and writing whole files and folders: on the disk or, in a browser, in memory.

#[cfg(not(target_family = "wasm"))]
mod folder;
#[cfg(not(target_family = "wasm"))]
mod output;
#[cfg(not(target_family = "wasm"))]
mod place;
#[cfg(not(target_family = "wasm"))]
mod target;
#[cfg(not(target_family = "wasm"))]
mod whole;

#[cfg(target_family = "wasm")]
pub(crate) use super::memory::sync_folder_of;
#[cfg(target_family = "wasm")]
pub use super::memory::{
    OpenFile, check_output_file, check_output_folder, is_file, is_folder, is_there, open_file, read_bytes, replace_folder,
    write_streamed, write_whole,
};

#[cfg(not(target_family = "wasm"))]
pub use folder::replace_folder;
#[cfg(not(target_family = "wasm"))]
pub use output::{check_output_file, check_output_folder};
#[cfg(not(target_family = "wasm"))]
pub use place::{OpenFile, is_file, is_folder, is_there, open_file, read_bytes};
#[cfg(not(target_family = "wasm"))]
pub use target::full_path;
#[cfg(not(target_family = "wasm"))]
pub(crate) use whole::sync_folder_of;
#[cfg(not(target_family = "wasm"))]
pub use whole::{write_streamed, write_whole};
