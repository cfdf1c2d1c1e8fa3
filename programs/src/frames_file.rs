//! Frames that programs name, from other files: `$config.dat` of a KUKA, modules of an ABB, the listing of FANUC's system
//! frames, or a list of one's own.

use std::collections::BTreeMap;
use std::path::Path;

use serde::Deserialize;

use super::dialects::fanuc;
use super::program::{Dialect, Program};
use super::scan::{Frame, Name, Setting, Stands};
use calibench::files::{FileError, parse_toml, read_bytes, read_text};
use calibench::robot::FramePose;
use calibench::units::{DEG, MM};

/// Tools and bases by the names that programs have for them.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct NamedFrames {
    settings: Vec<Setting>,
}

/// A list of one's own: X, Y, Z (mm), A, B, C (deg) by name or number.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct List {
    #[serde(default)]
    tools: BTreeMap<String, [f64; 6]>,
    #[serde(default)]
    bases: BTreeMap<String, [f64; 6]>,
}

impl NamedFrames {
    pub(super) fn settings(&self) -> &[Setting] {
        &self.settings
    }

    /// Number of tools and of bases.
    pub fn counts(&self) -> [usize; 2] {
        [Frame::Tool, Frame::Base].map(|frame| self.settings.iter().filter(|s| s.frame == frame).count())
    }

    /// Adds those of another file, which come before the ones that are there.
    pub fn extend(&mut self, other: NamedFrames) {
        self.settings.extend(other.settings);
    }
}

/// The names that a tool or base of a list can have in programs: a number counts in every dialect that numbers them.
fn names(frame: Frame, given: &str) -> Vec<Name> {
    let lists = [["TOOL_DATA", "UT", "TOOL"], ["BASE_DATA", "UF", "USER"]][frame as usize];
    match given.parse::<u32>() {
        Ok(number) => vec![
            Name::new(format!("{}[{number}]", lists[0]), given),
            Name::new(format!("{} {number}", lists[1]), given),
            Name::new(format!("{} {number}", lists[2]), given),
        ],
        Err(_) => {
            let capitals = given.to_ascii_uppercase();
            let mut keys = vec![given.to_owned(), capitals.clone(), format!("VAR {capitals}")];
            keys.dedup();
            keys.into_iter().map(|key| Name::new(key, given)).collect()
        }
    }
}

/// Reads tools and bases: `.toml` with `[tools]` and `[bases]`, each `NAME = [X, Y, Z, A, B, C]` (mm, deg); `.dat` and `.src`
/// (KRL) with TOOL_DATA and BASE_DATA; `.mod`, `.modx`, `.prg`, `.sys` (RAPID) with tooldata and wobjdata; otherwise FANUC's
/// listing with `$MNUTOOL` and `$MNUFRAME`.
///
/// # Errors
/// When the file cannot be read, or has no frame.
pub fn read_frames(path: &Path) -> Result<NamedFrames, FileError> {
    let extension = path.extension().and_then(|e| e.to_str()).unwrap_or("").to_ascii_lowercase();
    let settings = if extension == "toml" {
        let List { tools, bases } = parse_toml(path, &read_text(path)?)?;
        let of = |frame: Frame, list: BTreeMap<String, [f64; 6]>| -> Vec<Setting> {
            let one = |(given, [x, y, z, a, b, c]): (String, [f64; 6])| {
                let pose = FramePose { xyz: [x, y, z].map(|v| v * MM), rz_ry_rx: [a, b, c].map(|v| v * DEG) }.pose();
                let setting = |name| Setting { line: 1, frame, name, stands: Stands::At(pose) };
                names(frame, &given).into_iter().map(setting).collect::<Vec<Setting>>()
            };
            list.into_iter().flat_map(one).collect()
        };
        [of(Frame::Tool, tools), of(Frame::Base, bases)].concat()
    } else {
        let dialect = match extension.as_str() {
            "sys" => Some(Dialect::Rapid),
            _ => Dialect::of(path).filter(|d| matches!(d, Dialect::Krl | Dialect::Rapid)),
        };
        match dialect {
            Some(dialect) => {
                // The code page of a controller is not always UTF-8, and names and numbers are ASCII.
                let bytes = read_bytes(path)?;
                let program = Program { path: path.into(), dialect, bytes };
                dialect.scan(&[program], false).remove(0).settings
            }
            None => fanuc::listed(&String::from_utf8_lossy(&read_bytes(path)?)),
        }
    };
    let settings: Vec<Setting> = settings.into_iter().filter(|s| matches!(s.stands, Stands::At(_) | Stands::Not(_))).collect();
    if !settings.iter().any(|s| matches!(s.stands, Stands::At(_))) {
        let remedy = "give [tools] and [bases] in a .toml file, $config.dat (KRL), a module with tooldata or wobjdata (RAPID), or the listing of $MNUTOOL and $MNUFRAME (FANUC)";
        return Err(FileError::whole(path, "contains no tool and no base", remedy));
    }
    Ok(NamedFrames { settings })
}
