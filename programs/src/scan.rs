//! The text of a program as bytes: comments and strings blanked out, lines, brackets and numbers with their places.

use std::cmp::Ordering;
use std::collections::{BTreeSet, HashSet};
use std::ops::Range;

pub(super) use super::layout::{Configuration, Layout, Number};
use calibench::robot::Pose;

/// Marks of a dialect for comments and strings.
pub(super) struct Marks {
    /// Beginning of a comment that ends with the line.
    pub comment: &'static [u8],
    /// Delimiters of strings, which end with the line at the latest.
    pub quotes: &'static [u8],
}

/// A file with its module: files of one name, such as `.src` and `.dat`, are one.
pub(super) struct Source {
    pub text: Text,
    pub file: usize,
    pub module: usize,
}

/// A program in which comments and strings are spaces; every byte has the place that it has in the file.
pub(super) struct Text {
    bytes: Vec<u8>,
    line_starts: Vec<usize>,
}

/// A pair of brackets: the offsets of the two.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Brackets {
    pub open: usize,
    pub close: usize,
}

impl Brackets {
    pub fn inside(&self) -> Range<usize> {
        self.open + 1..self.close
    }
}

/// A position of a program.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Position {
    pub line: usize,
    pub name: String,
    pub layout: Layout,
    pub numbers: Vec<Number>,
    pub configuration: Configuration,
    /// Names of the tools and of the bases in which the program uses it.
    pub frames: [BTreeSet<Name>; 2],
    /// The first external axis that does not stand at zero, as written.
    pub external: Option<String>,
    /// True if the program may go elsewhere than its numbers say, so that they need not be reached.
    pub spare: bool,
}

impl Position {
    /// A position of which nothing more is known.
    pub fn new(line: usize, name: impl Into<String>, layout: Layout, numbers: Vec<Number>) -> Self {
        let (configuration, frames) = (Configuration::Any, <[BTreeSet<Name>; 2]>::default());
        Position { line, name: name.into(), layout, numbers, configuration, frames, external: None, spare: false }
    }

    /// True if its numbers are joints.
    pub fn is_joints(&self) -> bool {
        matches!(self.layout, Layout::Degrees | Layout::Radians | Layout::ValJoints)
    }
}

/// A frame that a program names.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(super) enum Frame {
    Tool = 0,
    Base = 1,
}

/// The name of a frame: what makes it the same as another, and how the program writes it.
#[derive(Debug, Clone)]
pub(super) struct Name {
    pub key: String,
    pub shown: String,
}

impl Name {
    pub fn new(key: impl Into<String>, shown: impl Into<String>) -> Self {
        Name { key: key.into(), shown: shown.into() }
    }
}

impl PartialEq for Name {
    fn eq(&self, other: &Self) -> bool {
        self.key == other.key
    }
}

impl Eq for Name {}

impl PartialOrd for Name {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Name {
    fn cmp(&self, other: &Self) -> Ordering {
        self.key.cmp(&other.key)
    }
}

/// What a program says of a frame that it names.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Stands {
    /// Written out: the tool on the flange, or the base on the robot's base link.
    At(Pose),
    /// Written out on another frame, which has this name.
    On(Pose, String),
    /// The flange or the base link itself, as every controller has it under this name.
    Null,
    /// It is made at run time, so that its numbers are not in the program.
    Computed,
    /// It is where no position can be compensated, for this reason.
    Not(String),
}

/// A frame written out in a program, or in a file of frames.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Setting {
    pub line: usize,
    pub frame: Frame,
    pub name: Name,
    pub stands: Stands,
}

/// Something that was not rewritten, or that is right only under a condition.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Remark {
    /// Line, counted from 1.
    pub line: usize,
    /// The position or the instruction.
    pub what: String,
    /// The reason.
    pub reason: String,
    /// The remedy.
    pub remedy: String,
    /// True if a position of the program stays uncompensated, or may be wrong; false for a warning.
    pub blocks: bool,
}

/// What is to be done about positions that are not in the text.
pub(super) const WRITE_OUT: &str = "write the position out, if it is to be compensated";

/// The content of one file.
#[derive(Debug, Default)]
pub(super) struct Scan {
    pub positions: Vec<Position>,
    /// Positions that stay as they are, each with its remark; their frames must be known all the same.
    pub left: Vec<Position>,
    pub settings: Vec<Setting>,
    /// Number of positions that cannot be read or stay as they are, each with its remark.
    pub unread: usize,
    pub remarks: Vec<Remark>,
}

impl Scan {
    /// A position whose numbers cannot be read.
    pub fn unreadable(&mut self, line: usize, what: impl Into<String>, reason: &str, remedy: &str) {
        self.unread += 1;
        self.refuse(line, what, reason, remedy);
    }

    pub fn refuse(&mut self, line: usize, what: impl Into<String>, reason: &str, remedy: &str) {
        let (reason, remedy) = (reason.into(), remedy.into());
        self.remarks.push(Remark { line, what: what.into(), reason, remedy, blocks: true });
    }

    pub fn warn(&mut self, line: usize, what: impl Into<String>, reason: &str, remedy: &str) {
        let (reason, remedy) = (reason.into(), remedy.into());
        self.remarks.push(Remark { line, what: what.into(), reason, remedy, blocks: false });
    }

    /// Tells of a position of which one number is set at run time.
    pub fn tell_set_in_part(&mut self, line: usize, what: impl Into<String>) {
        let reason =
            "one of its numbers is set at run time, so it is left as it is, and a motion there is as inaccurate as before";
        self.warn(line, what, reason, "write the whole position out");
    }

    /// Tells of a position that is set as a whole at run time.
    pub fn tell_computed(&mut self, line: usize, what: impl Into<String>) {
        self.warn(line, what, "it is computed at run time, and a motion goes there", WRITE_OUT);
    }

    /// Tells of a frame, `which` in words, of which a part is set at run time.
    pub fn tell_frame_changed(&mut self, line: usize, what: impl Into<String>, which: &str) {
        let reason = format!("{which} is changed at run time; positions are compensated for where it stands without that");
        self.warn(line, what, &reason, "write out the positions or the frame that are to be compensated");
    }

    /// Leaves a position that no motion goes to and a statement uses: what is done with it there is not known.
    pub fn leave_used(&mut self, line: usize, what: impl Into<String>, by: &str) {
        let short: String = by.split_whitespace().collect::<Vec<_>>().join(" ").chars().take(60).collect();
        let reason = format!("used by `{short}`, of which tool and base are not known");
        let remedy = "move to it by an instruction that calibench reads, or compensate it by hand";
        self.unreadable(line, what, &reason, remedy);
    }

    /// Tells of an external axis that is set at run time.
    pub fn tell_axis_set(&mut self, line: usize, what: impl Into<String>) {
        let remedy = "check that it carries neither the robot nor the work";
        self.warn(line, what, "an external axis is set at run time", remedy);
    }
}

/// The module that has a name, seen from `module` among so many: itself, else the first of the others.
pub(super) fn home_of(names: &HashSet<(usize, String)>, modules: usize, module: usize, name: &str) -> usize {
    let has = |home: usize| names.contains(&(home, name.to_owned()));
    if has(module) { module } else { (0..modules).find(|home| has(*home)).unwrap_or(module) }
}

impl Text {
    pub fn new(bytes: &[u8], marks: &Marks) -> Self {
        let mut blank = bytes.to_vec();
        let mut quote = None;
        let mut k = 0;
        while k < blank.len() {
            let byte = bytes[k];
            match quote {
                _ if byte == b'\n' => quote = None,
                Some(end) => {
                    quote = quote.filter(|_| byte != end);
                    blank[k] = b' ';
                }
                None if marks.quotes.contains(&byte) => {
                    quote = Some(byte);
                    blank[k] = b' ';
                }
                None if !marks.comment.is_empty() && bytes[k..].starts_with(marks.comment) => {
                    while k < blank.len() && bytes[k] != b'\n' {
                        // The end of the line keeps its carriage return.
                        blank[k] = if bytes[k] == b'\r' { b'\r' } else { b' ' };
                        k += 1;
                    }
                    continue;
                }
                None => {}
            }
            k += 1;
        }
        for k in foreign_bytes(&blank) {
            blank[k] = b'?';
        }
        let after_breaks = bytes.iter().enumerate().filter(|(_, b)| **b == b'\n').map(|(k, _)| k + 1);
        Text { line_starts: std::iter::once(0).chain(after_breaks).collect(), bytes: blank }
    }

    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    /// Line of a place, counted from 1.
    pub fn line(&self, at: usize) -> usize {
        self.line_starts.partition_point(|start| *start <= at)
    }

    /// The places of all lines, without their ends.
    pub fn lines(&self) -> impl Iterator<Item = Range<usize>> + '_ {
        self.line_starts.iter().enumerate().map(|(k, start)| {
            let end = self.line_starts.get(k + 1).map_or(self.bytes.len(), |next| next - 1);
            self.trimmed(*start..end)
        })
    }

    /// The same place without white space around it.
    pub fn trimmed(&self, at: Range<usize>) -> Range<usize> {
        let text = &self.bytes[at.clone()];
        let before = text.iter().take_while(|b| b.is_ascii_whitespace()).count();
        let after = text[before..].iter().rev().take_while(|b| b.is_ascii_whitespace()).count();
        at.start + before..at.end - after
    }

    /// Text of this range, trimmed.
    pub fn words(&self, at: Range<usize>) -> String {
        String::from_utf8_lossy(&self.bytes[self.trimmed(at)]).into_owned()
    }

    /// Text of this range, trimmed and in capitals.
    pub fn capitals(&self, at: Range<usize>) -> String {
        self.words(at).to_ascii_uppercase()
    }

    /// The finite decimal number that this range holds alone.
    pub fn number(&self, at: Range<usize>) -> Option<Number> {
        let at = self.trimmed(at);
        let text = str::from_utf8(&self.bytes[at.clone()]).ok()?;
        let plain = text.bytes().all(|b| b.is_ascii_digit() || b"+-.eE".contains(&b));
        let value = text.parse::<f64>().ok().filter(|value| plain && value.is_finite())?;
        Some(Number { at, value })
    }

    /// The numbers in this range, separated by commas, and nothing else.
    pub fn numbers(&self, at: Range<usize>) -> Option<Vec<Number>> {
        self.parts(at).into_iter().map(|part| self.number(part)).collect()
    }

    /// The parts between commas that are in no further brackets.
    pub fn parts(&self, at: Range<usize>) -> Vec<Range<usize>> {
        let mut parts = Vec::new();
        let (mut from, mut depth) = (at.start, 0_usize);
        for k in at.clone() {
            match self.bytes[k] {
                b'(' | b'[' | b'{' => depth += 1,
                b')' | b']' | b'}' => depth = depth.saturating_sub(1),
                b',' if depth == 0 => {
                    parts.push(from..k);
                    from = k + 1;
                }
                _ => {}
            }
        }
        parts.push(from..at.end);
        parts
    }

    /// All pairs of these brackets in the order of their openings; `end` closes whatever is open.
    pub fn brackets(&self, [open, close]: [u8; 2], end: Option<u8>) -> Vec<Brackets> {
        let mut pairs = Vec::new();
        let mut opened = Vec::new();
        for (k, byte) in self.bytes.iter().copied().enumerate() {
            if Some(byte) == end {
                opened.clear();
            } else if byte == open {
                opened.push(k);
            } else if byte == close
                && let Some(open) = opened.pop()
            {
                pairs.push(Brackets { open, close: k });
            }
        }
        pairs.sort_by_key(|pair| pair.open);
        pairs
    }

    /// The identifier that ends before `end`, white space between them skipped.
    pub fn name_before(&self, end: usize) -> Range<usize> {
        let end = self.trimmed(0..end).end;
        let length = self.bytes[..end].iter().rev().take_while(|b| is_of_name(**b)).count();
        end - length..end
    }
}

/// The places of bytes that are not UTF-8, as in a name in Latin-1: they belong to no word, so that words are as long as in the file.
fn foreign_bytes(bytes: &[u8]) -> Vec<usize> {
    let mut at = 0;
    let mut foreign = Vec::new();
    for chunk in bytes.utf8_chunks() {
        at += chunk.valid().len();
        foreign.extend(at..at + chunk.invalid().len());
        at += chunk.invalid().len();
    }
    foreign
}

/// The identifiers of a text.
pub(super) fn names(text: &str) -> impl Iterator<Item = &str> {
    text.split(|c: char| !c.is_ascii() || !is_of_name(c as u8)).filter(|word| is_name(word))
}

/// True for a character of an identifier.
pub(super) fn is_of_name(byte: u8) -> bool {
    byte.is_ascii_alphanumeric() || byte == b'_' || byte == b'$'
}

/// True for an identifier.
pub(super) fn is_name(text: &str) -> bool {
    text.bytes().all(is_of_name) && text.bytes().next().is_some_and(|b| !b.is_ascii_digit())
}
