//! The lines of a journal: each shows by itself whether it is intact, and where it belongs.
//!
//! The first is `calibench-journal/1 CHECKSUM JSON`, every other `NUMBER CHECKSUM JSON`, counted from 2 as in an editor. A
//! checksum is the first 16 hexadecimal digits of the SHA-256 of the first line's checksum, the number and the JSON, joined by
//! spaces; for the first line, of the format and the JSON.

use serde::Serialize;
use serde::de::DeserializeOwned;
use sha2::{Digest, Sha256};

use super::Conditions;
use super::entry::Entry;
use crate::files::hexadecimal;

/// Format tag at the beginning of a journal.
pub(super) const JOURNAL_FORMAT: &str = "calibench-journal/1";

/// The intact part of a journal.
#[derive(Debug)]
pub(super) struct Lines {
    pub conditions: Conditions,
    /// Checksum of the first line, from which those of the others are computed.
    pub seal: String,
    pub entries: Vec<Entry>,
    /// Bytes up to the end of the last intact line.
    pub whole: usize,
}

impl Lines {
    /// The conditions in force after its last line.
    pub fn conditions_now(&self) -> &Conditions {
        let changed = self.entries.iter().rev().find_map(|entry| match entry {
            Entry::Conditions(conditions) => Some(conditions),
            _ => None,
        });
        changed.unwrap_or(&self.conditions)
    }
}

/// Reason why bytes are not a journal.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum Broken {
    /// The first line is incomplete: nothing was noted.
    Unbegun,
    /// They do not begin like a journal.
    Foreign,
    /// This line was altered or is missing, though later ones are intact.
    Damaged(usize),
    /// This line is intact, but its content is unknown.
    Unknown(usize),
}

/// Formats the first line; also returns the seal of the others.
pub(super) fn first_line(conditions: &Conditions) -> (String, String) {
    let json = json(conditions);
    let seal = checksum(&[JOURNAL_FORMAT, &json]);
    (format!("{JOURNAL_FORMAT} {seal} {json}\n"), seal)
}

/// Formats line `number`; `None` if the entry contains a non-finite number, and could not be read back.
pub(super) fn line(seal: &str, number: usize, entry: &Entry) -> Option<String> {
    let json = json(entry);
    let same = serde_json::from_str::<Entry>(&json).is_ok_and(|read| read == *entry);
    same.then(|| format!("{number} {} {json}\n", checksum(&[seal, &number.to_string(), &json])))
}

/// Reads a journal up to its last intact line. Anything after it was cut short while being written, and is not trusted.
pub(super) fn read_lines(bytes: &[u8]) -> Result<Lines, Broken> {
    let mut lines = bytes.split_inclusive(|&b| b == b'\n');
    let first = lines.next().unwrap_or_default();
    if !first.ends_with(b"\n") {
        let begins = &first[..first.len().min(JOURNAL_FORMAT.len())];
        return Err(if JOURNAL_FORMAT.as_bytes().starts_with(begins) { Broken::Unbegun } else { Broken::Foreign });
    }
    let Some((format, seal, text)) = parts(first).filter(|(format, ..)| *format == JOURNAL_FORMAT) else {
        return Err(if first.starts_with(JOURNAL_FORMAT.as_bytes()) { Broken::Damaged(1) } else { Broken::Foreign });
    };
    if checksum(&[format, text]) != seal {
        return Err(Broken::Damaged(1));
    }
    let conditions = known(text, 1)?;
    let mut read = Lines { conditions, seal: seal.into(), entries: Vec::new(), whole: first.len() };
    while let Some(next) = lines.next() {
        let number = read.entries.len() + 2;
        match sealed(next, seal) {
            Some((found, text)) if found == number => {
                read.entries.push(known(text, number)?);
                read.whole += next.len();
            }
            // An intact line in the wrong place, or after one that is not intact, was not cut short while being written.
            Some(_) => return Err(Broken::Damaged(number)),
            None if lines.any(|later| sealed(later, seal).is_some()) => return Err(Broken::Damaged(number)),
            None => break,
        }
    }
    Ok(read)
}

/// Number and JSON of an intact line.
fn sealed<'a>(line: &'a [u8], seal: &str) -> Option<(usize, &'a str)> {
    let (number, sum, text) = parts(line)?;
    let as_written = checksum(&[seal, number, text]) == sum;
    number.parse().ok().filter(|_| as_written).map(|number| (number, text))
}

fn parts(line: &[u8]) -> Option<(&str, &str, &str)> {
    let line = std::str::from_utf8(line.strip_suffix(b"\n")?).ok()?;
    let (first, rest) = line.split_once(' ')?;
    let (sum, text) = rest.split_once(' ')?;
    Some((first, sum, text))
}

fn known<T: DeserializeOwned>(text: &str, number: usize) -> Result<T, Broken> {
    serde_json::from_str(text).map_err(|_| Broken::Unknown(number))
}

fn json(of: &impl Serialize) -> String {
    // Names, numbers and lists of them, which JSON can always represent.
    serde_json::to_string(of).unwrap_or_default()
}

fn checksum(parts: &[&str]) -> String {
    hexadecimal(&Sha256::digest(parts.join(" "))[..8])
}
