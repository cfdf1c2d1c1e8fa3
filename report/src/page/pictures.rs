//! Pictures of the cell, drawn by a plant that can draw it.

use std::io::Read;
use std::path::Path;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use serde_json::{Value, json};

use calibench::files::FileError;
use calibench::files::disk::open_file;

/// Pictures that a run may hold: file and alternative text.
const DRAWN: [(&str, &str); 2] = [
    ("cell.png", "The simulated cell: the robot with the gauge on its flange at the first ball that was centred."),
    ("gauge.png", "The gauge seen close: its three plungers on the ball of the artifact."),
];

/// First bytes of every PNG file (ISO/IEC 15948, 5.2).
const SIGNATURE: &[u8] = b"\x89PNG\r\n\x1a\n";

/// Largest accepted picture, bytes; pictures drawn by a plant are about a tenth of it.
const LONGEST: u64 = 8 << 20;

/// A picture of the cell.
pub struct CellPicture {
    shows: &'static str,
    png: Vec<u8>,
}

impl CellPicture {
    /// Reads the pictures in the folder of a run; all are optional.
    ///
    /// # Errors
    /// If a picture is not a PNG file, is too large, or cannot be read.
    pub fn read(run: &Path) -> Result<Vec<Self>, FileError> {
        let there = DRAWN.iter().map(|(name, shows)| (run.join(name), *shows)).filter(|(path, _)| path.is_file());
        there.map(|(path, shows)| Ok(CellPicture { shows, png: read_png(&path)? })).collect()
    }

    /// The picture as a data URL.
    pub(super) fn json(&self) -> Value {
        json!({"shows": self.shows, "data": format!("data:image/png;base64,{}", STANDARD.encode(&self.png))})
    }
}

fn read_png(path: &Path) -> Result<Vec<u8>, FileError> {
    let wrong = |problem: String| FileError::whole(path, problem, "draw it again with `calibench run --render`, or remove it");
    let mut png = Vec::new();
    let file = open_file(path).map_err(|e| wrong(format!("cannot be read: {e}")))?;
    file.take(LONGEST + 1).read_to_end(&mut png).map_err(|e| wrong(format!("cannot be read: {e}")))?;
    if png.len() as u64 > LONGEST {
        return Err(wrong(format!("is longer than {} MiB", LONGEST >> 20)));
    }
    if !png.starts_with(SIGNATURE) {
        return Err(wrong("is not a PNG picture".into()));
    }
    Ok(png)
}
