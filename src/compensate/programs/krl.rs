//! KRL: `.src` and `.dat`.

use std::collections::{BTreeSet, HashSet};
use std::ops::Range;

use super::numbers::{Meaning, meaning};
use super::scan::{Brackets, Configuration, Frame, Layout, Marks, Number, Position, Scan, Setting, Text, is_name, is_of_name};

pub(super) const MARKS: Marks = Marks { comment: b";", quotes: b"\"" };

const MOTIONS: [&str; 6] = ["PTP", "LIN", "CIRC", "SPTP", "SLIN", "SCIRC"];
const RELATIVE: [&str; 6] = ["PTP_REL", "LIN_REL", "CIRC_REL", "SPTP_REL", "SLIN_REL", "SCIRC_REL"];
const POSE: [&str; 6] = ["X", "Y", "Z", "A", "B", "C"];
const AXES: [&str; 6] = ["A1", "A2", "A3", "A4", "A5", "A6"];
/// Words before the name in a declaration.
const DECLARING: [&str; 10] = ["DECL", "GLOBAL", "CONST", "FRAME", "POS", "E6POS", "AXIS", "E6AXIS", "SIGNAL", "PUBLIC"];

/// Uses of names in the statements of all files.
#[derive(Default)]
struct Uses {
    /// Moved to.
    moved: HashSet<String>,
    /// Assigned to `$TOOL` or `$BASE`, or part of an expression.
    in_frames: HashSet<String>,
    /// Written out in one of the files.
    declared: HashSet<String>,
    tools: BTreeSet<String>,
    bases: BTreeSet<String>,
}

/// A statement: a line and its words.
struct Statement {
    line: usize,
    at: Range<usize>,
    words: Vec<String>,
    capitals: String,
}

/// Fields of an aggregate `{...}`, with the place of each value.
struct Aggregate {
    fields: Vec<(String, Range<usize>)>,
}

pub(super) fn scan(texts: &[Text]) -> Vec<Scan> {
    let mut uses = Uses::default();
    for text in texts {
        statements(text).iter().for_each(|s| uses.see(text, s));
    }
    texts.iter().map(|text| scan_file(text, &mut uses)).collect()
}

fn statements(text: &Text) -> Vec<Statement> {
    let numbered = text.lines().enumerate().filter(|(_, at)| !at.is_empty());
    numbered
        .map(|(k, at)| {
            let capitals = text.capitals(at.clone());
            let words = capitals.split(|c: char| !c.is_ascii() || !is_of_name(c as u8)).filter(|w| !w.is_empty());
            Statement { line: k + 1, words: words.map(str::to_owned).collect(), at, capitals }
        })
        .collect()
}

impl Statement {
    fn verb(&self) -> &str {
        self.words.first().map_or("", String::as_str)
    }

    /// Left side of an assignment, without index and declaration.
    fn target(&self) -> Option<&str> {
        let (left, _) = self.capitals.split_once('=')?;
        let left = left.split(['[', '.']).next().unwrap_or(left);
        left.split_whitespace().last()
    }

    /// The names that a motion moves to.
    fn destinations(&self) -> Vec<&str> {
        let Some(rest) = self.capitals.strip_prefix(self.verb()) else { return Vec::new() };
        let outside = rest.split('{').map(|piece| piece.rsplit('}').next().unwrap_or(piece));
        let names = outside.flat_map(|piece| piece.split(','));
        // What follows the destination (C_DIS, WITH $VEL...) is separated by white space.
        let first = |piece: &str| piece.split_whitespace().next().map(str::to_owned);
        let of_line = |name: &str| self.words.iter().map(String::as_str).find(|w| *w == name);
        names
            .filter_map(|piece| first(piece).and_then(|name| of_line(name.split(['[', ':']).next().unwrap_or(&name))))
            .filter(|name| {
                is_name(name) && !name.starts_with('$') && !["C_DIS", "C_PTP", "C_ORI", "C_VEL", "CA", "WITH"].contains(name)
            })
            .collect()
    }
}

impl Uses {
    fn see(&mut self, text: &Text, statement: &Statement) {
        if MOTIONS.contains(&statement.verb()) {
            self.moved.extend(statement.destinations().into_iter().map(str::to_owned));
        }
        let Some(target) = statement.target() else { return };
        let right = statement.capitals.split_once('=').map_or("", |(_, right)| right.trim());
        let names = || statement.words.iter().filter(|w| *w != target).cloned();
        let of_frame = |known: &str| target == known || target.starts_with(&known[1..]);
        for (frame, several) in [("$TOOL", &mut self.tools), ("$BASE", &mut self.bases)] {
            if target == frame && !right.starts_with('{') {
                several.insert(right.to_owned());
            }
        }
        if of_frame("$TOOL") || of_frame("$BASE") || right.contains(':') {
            self.in_frames.extend(names());
        }
        for (key, several) in [("TOOL_NO", &mut self.tools), ("BASE_NO", &mut self.bases)] {
            if let Some((_, after)) = right.split_once(key) {
                let number: String = after.trim_start().chars().take_while(char::is_ascii_digit).collect();
                several.insert(format!("{key} {number}"));
            }
        }
        if text.bytes()[statement.at.clone()].contains(&b'{') {
            self.declared.insert(target.to_owned());
        }
    }
}

fn scan_file(text: &Text, uses: &mut Uses) -> Scan {
    let mut scan = Scan::default();
    let pairs = text.brackets(*b"{}", Some(b'\n'));
    let mut pairs = pairs.into_iter().peekable();
    for statement in statements(text) {
        let mut end_of_last = 0;
        while let Some(pair) = pairs.next_if(|pair| pair.open < statement.at.end) {
            // Aggregates within aggregates are not positions: loads have frames of their own.
            if pair.open >= end_of_last {
                end_of_last = pair.close;
                aggregate(text, &statement, pair, uses, &mut scan);
            }
        }
        motion(&statement, uses, &mut scan);
    }
    scan.only_one("tools", &mut uses.tools);
    scan.only_one("bases", &mut uses.bases);
    scan
}

/// Everything about motions but the positions written out.
fn motion(statement: &Statement, uses: &Uses, scan: &mut Scan) {
    let (line, verb) = (statement.line, statement.verb());
    if RELATIVE.contains(&verb) {
        scan.warn(line, verb, "a relative motion is left as it is", "start it from a compensated position, and keep it short");
        return;
    }
    if let Some(target) = statement.target()
        && uses.moved.contains(target)
        && !statement.capitals.contains('{')
    {
        let reason = "it is computed at run time, and a motion goes there";
        scan.warn(line, target, reason, "write the position out, if it is to be compensated");
    }
    if !MOTIONS.contains(&verb) {
        return;
    }
    if statement.capitals.contains(':') {
        let reason = "the motion goes to a position computed at run time";
        scan.warn(line, verb, reason, "write the position out, if it is to be compensated");
        return;
    }
    for name in statement.destinations() {
        if !uses.declared.contains(name) {
            let remedy = "give the file that declares it too (.src and .dat together)";
            scan.warn(line, name, "this position is not written out in the files given", remedy);
        }
    }
}

fn parse(text: &Text, pair: Brackets) -> Aggregate {
    let mut inside = pair.inside();
    let prefix = text.capitals(inside.clone());
    if let Some(kind) = ["FRAME:", "POS:", "E6POS:", "AXIS:", "E6AXIS:"].into_iter().find(|kind| prefix.starts_with(kind)) {
        inside.start = text.trimmed(inside.clone()).start + kind.len();
    }
    let field = |part: Range<usize>| {
        let part = text.trimmed(part);
        let name = text.bytes()[part.clone()].iter().take_while(|b| is_of_name(**b)).count();
        (text.capitals(part.start..part.start + name), part.start + name..part.end)
    };
    Aggregate { fields: text.parts(inside).into_iter().map(field).collect() }
}

impl Aggregate {
    fn of(&self, name: &str) -> Option<Range<usize>> {
        self.fields.iter().find(|(field, _)| field == name).map(|(_, at)| at.clone())
    }

    fn has_any(&self, names: &[&str]) -> bool {
        names.iter().any(|name| self.of(name).is_some())
    }

    fn numbers(&self, text: &Text, names: &[&str]) -> Option<Vec<Number>> {
        names.iter().map(|name| text.number(self.of(name)?)).collect()
    }

    /// Adds a position of this name.
    fn position(&self, text: &Text, line: usize, name: String, scan: &mut Scan) {
        let axes = self.has_any(&AXES);
        let Some(numbers) = self.numbers(text, if axes { &AXES } else { &POSE }) else {
            let reason = "it does not give all six numbers, or not as plain numbers";
            return scan.unreadable(line, name, reason, "write all of X, Y, Z, A, B, C, or all of A1 ... A6");
        };
        let bit = |field: &str| self.of(field).map(|at| bits(text, at).ok_or(()));
        let configuration = match (bit("S").transpose(), bit("T").transpose()) {
            _ if axes => Configuration::Any,
            (Ok(status), Ok(turn)) => Configuration::Kuka { status, turn },
            _ => Configuration::Unreadable,
        };
        if let Configuration::Kuka { status: Some(status), .. } = &configuration
            && status.value as i64 & 16 != 0
        {
            let reason = "it was taught with the controller's own absolute accuracy on (bit 4 of S)";
            scan.warn(line, name.as_str(), reason, "switch absolute accuracy off for programs that calibench rewrites");
        }
        let layout = if axes { Layout::Degrees } else { Layout::KukaFrame };
        scan.positions.push(Position { line, name, layout, numbers, configuration });
    }
}

/// A decimal whole number, or KRL's `'B010'`, `'H1F'`.
fn bits(text: &Text, at: Range<usize>) -> Option<Number> {
    let at = text.trimmed(at);
    let words = text.capitals(at.clone());
    let value = match words.strip_prefix('\'').and_then(|w| w.strip_suffix('\'')) {
        Some(quoted) => {
            let (radix, digits) = quoted.strip_prefix('B').map(|d| (2, d)).or(quoted.strip_prefix('H').map(|d| (16, d)))?;
            u16::from_str_radix(digits, radix).ok()?
        }
        None => words.parse().ok()?,
    };
    Some(Number { at, value: f64::from(value) })
}

fn aggregate(text: &Text, statement: &Statement, pair: Brackets, uses: &Uses, scan: &mut Scan) {
    let content = parse(text, pair);
    let (pose, axes) = (content.has_any(&POSE), content.has_any(&AXES));
    let has_others = content.fields.iter().any(|(name, _)| {
        let outer = name.strip_prefix('E').is_some_and(|k| k.len() == 1);
        !outer && !POSE.contains(&name.as_str()) && !AXES.contains(&name.as_str()) && name != "S" && name != "T"
    });
    if pose == axes || has_others {
        return;
    }
    let line = statement.line;
    let verb = statement.verb();
    let moves = MOTIONS.contains(&verb);
    let target = statement.target().filter(|_| !moves);
    let numbers_of_frame = |frame| {
        let values: Vec<f64> = content.numbers(text, &POSE).iter().flatten().map(|n| n.value).collect();
        match meaning(Layout::KukaFrame, &values) {
            Ok(Meaning::Pose(pose)) => Some(Setting { line, frame, pose }),
            _ => None,
        }
    };
    match target {
        Some("$TOOL") => return scan.settings.extend(numbers_of_frame(Frame::Tool)),
        Some("$BASE") => return scan.settings.extend(numbers_of_frame(Frame::Base)),
        Some(name) if name.starts_with('$') || name.starts_with("TOOL_") || name.starts_with("BASE_") => return,
        None if RELATIVE.contains(&verb) => return,
        _ => {}
    }
    let declared_as = |kind: &str| statement.words.iter().take_while(|w| DECLARING.contains(&w.as_str())).any(|w| w == kind);
    let has_status = content.has_any(&["S", "T"]) || declared_as("POS") || declared_as("E6POS");
    let (name, is_position) = match target {
        Some(name) => {
            let moved = uses.moved.contains(name);
            (name.to_owned(), moved || ((has_status || axes) && !uses.in_frames.contains(name)))
        }
        None => (verb.to_owned(), moves),
    };
    let beside = |at: Option<&u8>| at == Some(&b':');
    let before = text.trimmed(0..pair.open).end;
    let after = text.trimmed(pair.close + 1..statement.at.end.max(pair.close + 1)).start;
    if beside(text.bytes()[..before].last()) || beside(text.bytes().get(after)) {
        return; // Arithmetic, which is told with the motion.
    }
    if !is_position {
        if target.is_some_and(|name| uses.in_frames.contains(name)) {
            return;
        }
        let reason = "it is not a POS, E6POS, AXIS or E6AXIS, and no motion of the files given goes there";
        return scan.warn(line, name, reason, "give the file with its motions too, if it is a position");
    }
    if target.is_some() && uses.in_frames.contains(&name) {
        let reason = "it is part of a frame or of an expression too, which changes with it";
        scan.warn(line, name.as_str(), reason, "keep a copy of the position for the frame");
    }
    content.position(text, line, name, scan);
}
