//! Robot programs as they are on disk.

use std::path::{Path, PathBuf};

use super::dialects::{fanuc, krl, rapid, urscript, val3, yaskawa};
use super::scan;
use calibench::files::{FileError, read_bytes};

/// The language of a program.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Dialect {
    /// KUKA's KRL: `.src`, `.dat`.
    Krl,
    /// Universal Robots' URScript: `.script`.
    UrScript,
    /// ABB's RAPID: `.mod`, `.modx`, `.prg`.
    Rapid,
    /// FANUC's teach pendant programs as text: `.ls`.
    Fanuc,
    /// Yaskawa's INFORM jobs: `.jbi`.
    Yaskawa,
    /// Stäubli's VAL 3: `.pgx`, `.dtx`.
    Val3,
}

impl Dialect {
    /// The dialect of a file by its extension, if it is that of a robot program.
    ///
    /// ```
    /// use std::path::Path;
    ///
    /// use calibench_programs::Dialect;
    ///
    /// assert_eq!(Dialect::of(Path::new("weld.SRC")), Some(Dialect::Krl));
    /// assert_eq!(Dialect::of(Path::new("weld.txt")), None);
    /// ```
    pub fn of(path: &Path) -> Option<Dialect> {
        let extension = path.extension()?.to_str()?.to_ascii_lowercase();
        Some(match extension.as_str() {
            "src" | "dat" => Dialect::Krl,
            "script" => Dialect::UrScript,
            "mod" | "modx" | "prg" => Dialect::Rapid,
            "ls" => Dialect::Fanuc,
            "jbi" => Dialect::Yaskawa,
            "pgx" | "dtx" => Dialect::Val3,
            _ => return None,
        })
    }

    /// True if its positions have external axes.
    pub(super) fn has_external_axes(self) -> bool {
        !matches!(self, Dialect::UrScript | Dialect::Val3)
    }

    /// What is taken as given in every program of this language.
    pub(super) fn assumed(self) -> Option<&'static str> {
        match self {
            Dialect::Yaskawa => Some("the flags of RCONF count joints R, T and S as the robot file does, in zero"),
            Dialect::Val3 => Some(
                "righty is the arm that reaches forward; elbow and wrist are positive where joints 3 and 5 of the robot file are",
            ),
            Dialect::Krl | Dialect::UrScript | Dialect::Rapid | Dialect::Fanuc => None,
        }
    }

    pub(super) fn scan(self, programs: &[Program], joints_as_in_robot_file: bool) -> Vec<scan::Scan> {
        let is_data = |p: &Program| p.bytes.windows(6).any(|w| w == b"<Datas");
        let marks = |p: &Program| match self {
            Dialect::Krl => krl::MARKS,
            Dialect::UrScript => urscript::MARKS,
            Dialect::Rapid => rapid::MARKS,
            Dialect::Fanuc => fanuc::MARKS,
            Dialect::Yaskawa => yaskawa::MARKS,
            Dialect::Val3 if is_data(p) => val3::MARKS_OF_DATA,
            Dialect::Val3 => val3::MARKS,
        };
        let stem = |p: &Program| p.path.file_stem().map(|name| name.to_ascii_lowercase());
        let module = |p: &Program| programs.iter().position(|other| stem(other) == stem(p)).unwrap_or(0);
        let of =
            |(file, p): (usize, &Program)| scan::Source { text: scan::Text::new(&p.bytes, &marks(p)), file, module: module(p) };
        let sources: Vec<scan::Source> = programs.iter().enumerate().map(of).collect();
        match self {
            Dialect::Krl => krl::scan(&sources),
            Dialect::UrScript => urscript::scan(&sources),
            Dialect::Rapid => rapid::scan(&sources),
            Dialect::Fanuc => fanuc::scan(&sources, joints_as_in_robot_file),
            Dialect::Yaskawa => yaskawa::scan(&sources),
            Dialect::Val3 => val3::scan(&sources),
        }
    }
}

/// A robot program as it is on disk.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Program {
    /// Its file.
    pub path: PathBuf,
    /// Its language.
    pub dialect: Dialect,
    /// Its bytes, in any encoding in which brackets, digits and letters are those of ASCII.
    pub bytes: Vec<u8>,
}

/// Reads a robot program.
///
/// # Errors
/// When it cannot be read, is longer than 64 MiB, or is in UTF-16.
pub fn read_program(path: &Path) -> Result<Program, FileError> {
    const KNOWN: &str = "give .src and .dat (KRL), .script (URScript), .mod, .modx or .prg (RAPID), .ls (FANUC), .jbi (Yaskawa), or .pgx and .dtx (VAL 3)";
    let dialect = Dialect::of(path).ok_or_else(|| FileError::whole(path, "is not a robot program, by its name", KNOWN))?;
    let bytes = read_bytes(path)?;
    if bytes.starts_with(&[0xff, 0xfe]) || bytes.starts_with(&[0xfe, 0xff]) || bytes.contains(&0) {
        return Err(FileError::whole(path, "is not text of single bytes", "save it as UTF-8 or in the controller's code page"));
    }
    Ok(Program { path: path.into(), dialect, bytes })
}
