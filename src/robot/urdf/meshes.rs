//! Mesh files that a URDF names and that are not there.

use std::path::Path;

use roxmltree::Document;

use crate::files::disk::is_file;
use crate::files::{FileError, read_text};

/// A mesh that is not there.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct MissingMesh {
    /// Line of the URDF file.
    pub line: usize,
    /// Its file, as written there.
    pub file: String,
}

/// The meshes of a URDF file that do not exist, by line. Nothing here needs them. Those of ROS packages cannot be looked up and
/// are left out.
///
/// # Errors
/// If the file cannot be read, or is not XML.
pub fn missing_meshes(path: &Path) -> Result<Vec<MissingMesh>, FileError> {
    let text = read_text(path)?;
    let text = &super::document::without_unbound_prefixes(&text);
    let xml = Document::parse(text).map_err(|e| FileError {
        line: Some(e.pos().row as usize),
        ..FileError::whole(path, format!("is not XML: {e}"), "give the file as the robot's package has it")
    })?;
    let folder = path.parent().unwrap_or(Path::new(""));
    let named = xml.descendants().filter(|node| node.has_tag_name("mesh"));
    let missing = named.filter_map(|node| {
        let file = node.attribute("filename")?;
        let place = match file.split_once("://") {
            Some(("file", place)) => place,
            Some(_) => return None,
            None => file,
        };
        let line = xml.text_pos_at(node.range().start).row as usize;
        (!is_file(&folder.join(place))).then(|| MissingMesh { line, file: file.to_owned() })
    });
    Ok(missing.collect())
}
