//! Frames that programs name, from other files: `$config.dat` of a KUKA, modules of an ABB, the listing of FANUC's system
//! frames, or a list of one's own.

use std::collections::BTreeMap;
use std::path::Path;

use serde::Deserialize;

use super::dialects::fanuc;
use super::program::{Dialect, Program};
use super::scan::{Frame, Name, Setting, Stands};
use calibench::files::{FileError, field_error, parse_toml, read_bytes, read_text};
use calibench::robot::FramePose;
use calibench::units::{DEG, MM};

/// Tools and bases by the names that programs have for them.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct NamedFrames {
    settings: Vec<Setting>,
}

/// Format tag of a list of one's own.
pub const FRAMES_FORMAT: &str = "calibench-frames/1";

/// Longest accepted tool, mm.
pub const LONGEST_TOOL_MM: f64 = 1e4;

/// Greatest accepted distance of a base from the robot, mm.
pub const FARTHEST_BASE_MM: f64 = 5e4;

/// Tools and bases of programs by name or number.
#[derive(Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
struct FramesToml {
    /// Name and version of this format.
    #[cfg_attr(feature = "schema", schemars(extend("const" = FRAMES_FORMAT)))]
    format: String,
    /// Tools: the name or number that programs have for one, and X, Y, Z (mm), A, B, C (deg) of the TCP in the flange frame.
    #[serde(default)]
    tools: BTreeMap<String, [f64; 6]>,
    /// Bases: the name or number that programs have for one, and X, Y, Z (mm), A, B, C (deg) on the robot's base link.
    #[serde(default)]
    bases: BTreeMap<String, [f64; 6]>,
}

/// The JSON Schema of a list of one's own; only with the feature `schema`.
#[cfg(feature = "schema")]
#[must_use]
pub fn frames_schema() -> schemars::Schema {
    calibench::schema::of_file::<FramesToml>("Frames", &[])
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
/// One error that names file, line, key and remedy: a file that cannot be read or has no frame, a frame whose numbers are
/// incomplete, one that the file gives twice with other numbers.
pub fn read_frames(path: &Path) -> Result<NamedFrames, FileError> {
    let extension = path.extension().and_then(|e| e.to_str()).unwrap_or("").to_ascii_lowercase();
    let dialect = match extension.as_str() {
        "sys" => Some(Dialect::Rapid),
        _ => Dialect::of(path).filter(|d| matches!(d, Dialect::Krl | Dialect::Rapid)),
    };
    let settings = match dialect {
        _ if extension == "toml" => of_list(path)?,
        Some(dialect) => of_program(path, dialect)?,
        None => fanuc::listed(&String::from_utf8_lossy(&read_bytes(path)?)).map_err(|wrong| {
            let problem = "is not a number".to_owned();
            at_line(path, wrong.line, wrong.field, problem, "write the frame in the controller again, and list it again")
        })?,
    };
    let settings: Vec<Setting> = settings.into_iter().filter(|s| matches!(s.stands, Stands::At(_) | Stands::Not(_))).collect();
    if !settings.iter().any(|s| matches!(s.stands, Stands::At(_))) {
        let remedy = "give [tools] and [bases] in a .toml file, $config.dat (KRL), a module with tooldata or wobjdata (RAPID), or the listing of $MNUTOOL and $MNUFRAME (FANUC)";
        return Err(FileError::whole(path, "contains no tool and no base", remedy));
    }
    let mut seen: BTreeMap<(Frame, &str), &Setting> = BTreeMap::new();
    for setting in &settings {
        let first = *seen.entry((setting.frame, setting.name.key.as_str())).or_insert(setting);
        if first.stands != setting.stands {
            let problem = format!("has other numbers than in line {}", first.line);
            return Err(at_line(path, setting.line, setting.name.shown.clone(), problem, "keep the one that holds"));
        }
    }
    Ok(NamedFrames { settings })
}

fn at_line(path: &Path, line: usize, field: String, problem: String, remedy: &str) -> FileError {
    FileError { line: Some(line), field, ..FileError::whole(path, problem, remedy) }
}

/// The frames of a list of one's own.
fn of_list(path: &Path) -> Result<Vec<Setting>, FileError> {
    let text = read_text(path)?;
    let FramesToml { format, tools, bases } = parse_toml(path, &text)?;
    if format != FRAMES_FORMAT {
        let problem = format!("is '{format}', not '{FRAMES_FORMAT}'");
        return Err(field_error(path, &text, "format", problem, format!("write format = \"{FRAMES_FORMAT}\"")));
    }
    let mut settings: Vec<Setting> = Vec::new();
    for (frame, table, list) in [(Frame::Tool, "tools", tools), (Frame::Base, "bases", bases)] {
        for (given, [x, y, z, a, b, c]) in list {
            let wrong = |problem: String, remedy: &str| field_error(path, &text, &format!("{table}.{given}"), problem, remedy);
            let farthest = [LONGEST_TOOL_MM, FARTHEST_BASE_MM][frame as usize];
            if given.trim().is_empty() {
                return Err(wrong("has no name".into(), "give the name or the number that programs have for it"));
            }
            if [x, y, z].iter().any(|v| v.abs() > farthest) {
                return Err(wrong(format!("is more than {farthest} mm away, as in no cell"), "give X, Y, Z in mm"));
            }
            let pose = FramePose { xyz: [x, y, z].map(|v| v * MM), rz_ry_rx: [a, b, c].map(|v| v * DEG) }.pose();
            let line = field_error(path, &text, &format!("{table}.{given}"), "", "").line.unwrap_or(1);
            for name in names(frame, &given) {
                let is_twice = |s: &Setting| s.frame == frame && s.name == name && s.stands != Stands::At(pose);
                if let Some(other) = settings.iter().find(|s| is_twice(s)) {
                    let problem = format!("is the same name as `{}` in RAPID and KRL, or the same number", other.name.shown);
                    return Err(wrong(problem, "keep one, or give them in files and calls of their own"));
                }
                settings.push(Setting { line, frame, name, stands: Stands::At(pose) });
            }
        }
    }
    Ok(settings)
}

/// The frames that a program or a data list writes out.
fn of_program(path: &Path, dialect: Dialect) -> Result<Vec<Setting>, FileError> {
    // The code page of a controller is not always UTF-8, and names and numbers are ASCII.
    let bytes = read_bytes(path)?;
    let lines: Vec<bool> = bytes.split(|b| *b == b'\n').map(|line| line.contains(&b'{')).collect();
    let program = Program { path: path.into(), dialect, bytes };
    let settings: Vec<Setting> = dialect.scan(&[program], false).into_iter().flat_map(|scan| scan.settings).collect();
    let is_garbled = |setting: &Setting| match dialect {
        // Written out, as far as braces say so; an expression is a statement of the program, which holds at run time.
        Dialect::Krl => lines.get(setting.line - 1).copied().unwrap_or(false),
        // An expression may be either kind of frame, a list only one.
        _ => settings.iter().filter(|s| s.line == setting.line && s.name == setting.name).count() == 1,
    };
    let garbled = settings.iter().find(|s| s.stands == Stands::Computed && is_garbled(s));
    if let Some(Setting { line, name, .. }) = garbled {
        let problem = "its six or seven numbers are not all written out".to_owned();
        return Err(at_line(path, *line, name.shown.clone(), problem, "write plain numbers, in mm and deg"));
    }
    Ok(settings)
}
