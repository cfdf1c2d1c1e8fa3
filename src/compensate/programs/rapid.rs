//! RAPID: `.mod`, `.modx`, `.prg`.

use std::collections::{BTreeSet, HashSet};
use std::ops::Range;

use super::numbers::{Meaning, meaning};
use super::scan::{Brackets, Configuration, Frame, Layout, Marks, Number, Position, Scan, Setting, Text, is_name};

pub(super) const MARKS: Marks = Marks { comment: b"!", quotes: b"\"" };

/// Motions, with the number of their positions.
const MOTIONS: [(&str, usize); 15] = [
    ("MOVEJ", 1),
    ("MOVEL", 1),
    ("MOVEC", 2),
    ("MOVEABSJ", 1),
    ("MOVEJDO", 1),
    ("MOVELDO", 1),
    ("MOVECDO", 2),
    ("MOVEJSYNC", 1),
    ("MOVELSYNC", 1),
    ("MOVECSYNC", 2),
    ("MOVEJAO", 1),
    ("MOVELAO", 1),
    ("TRIGGJ", 1),
    ("TRIGGL", 1),
    ("TRIGGC", 2),
];
/// Program displacements.
const DISPLACED: [&str; 4] = ["PDISPON", "PDISPSET", "EOFFSON", "EOFFSSET"];

/// A group in brackets with the groups directly in it.
struct Group {
    at: Brackets,
    inner: Vec<Brackets>,
}

/// A statement up to its semicolon.
struct Statement {
    at: Range<usize>,
    capitals: String,
}

/// Names used by the motions of all files.
#[derive(Default)]
struct Uses {
    moved: HashSet<String>,
    written: HashSet<String>,
    tools: BTreeSet<String>,
    bases: BTreeSet<String>,
}

pub(super) fn scan(texts: &[Text]) -> Vec<Scan> {
    let mut uses = Uses::default();
    for text in texts {
        statements(text).iter().for_each(|s| uses.see(text, s));
        let named = positions(text).into_iter().filter_map(|(group, _)| assigned(text, group.at.open));
        uses.written.extend(named);
    }
    texts.iter().map(|text| scan_file(text, &mut uses)).collect()
}

fn statements(text: &Text) -> Vec<Statement> {
    let mut from = 0;
    let ends = text.bytes().iter().enumerate().filter(|(_, b)| **b == b';').map(|(k, _)| k);
    let mut statements = Vec::new();
    for end in ends.chain([text.bytes().len()]) {
        // A block's head (PROC, IF ... THEN) stands before the statement on a line of its own.
        let mut at = text.trimmed(from..end);
        while let Some(k) = text.bytes()[at.clone()].iter().position(|b| *b == b'\n') {
            let first = text.capitals(at.start..at.start + k);
            if first.contains('[') || first.contains(":=") || motion(&first).is_some() || first.ends_with(',') {
                break;
            }
            at = text.trimmed(at.start + k..at.end);
        }
        statements.push(Statement { capitals: text.capitals(at.clone()), at });
        from = (end + 1).min(text.bytes().len());
    }
    statements
}

/// Number of positions of the motion that a statement begins with.
fn motion(capitals: &str) -> Option<(&'static str, usize)> {
    let verb: String = capitals.chars().take_while(char::is_ascii_alphanumeric).collect();
    MOTIONS.iter().find(|(name, _)| *name == verb).copied()
}

impl Statement {
    /// The arguments of a motion without optional ones, and its work object.
    fn arguments(&self, text: &Text, verb: &str) -> (Vec<String>, Option<String>) {
        let mut places = text.parts(self.at.start + verb.len()..self.at.end);
        let mut work = None;
        for place in &mut places {
            let words = text.capitals(place.clone());
            if let Some((_, name)) = words.split_once("\\WOBJ") {
                work = name.split_once(":=").map(|(_, name)| name.split('\\').next().unwrap_or(name).trim().to_owned());
            }
        }
        let plain = |place: &Range<usize>| {
            let words = text.capitals(place.clone());
            let words = words.trim_start_matches("\\CONC").trim().to_owned();
            words.split('\\').next().unwrap_or("").trim().to_owned()
        };
        (places.iter().map(plain).filter(|words| !words.is_empty()).collect(), work)
    }
}

impl Uses {
    fn see(&mut self, text: &Text, statement: &Statement) {
        let Some((verb, count)) = motion(&statement.capitals) else { return };
        let (arguments, work) = statement.arguments(text, verb);
        self.moved.extend(arguments.iter().take(count).map(|name| root_of(name).to_owned()));
        if let Some(tool) = arguments.last().filter(|name| arguments.len() > count && is_name(name)) {
            self.tools.insert(tool.clone());
        }
        if verb != "MOVEABSJ" {
            self.bases.insert(work.unwrap_or_else(|| "WOBJ0".into()));
        }
    }
}

/// A name without index or component.
fn root_of(name: &str) -> &str {
    name.split(['{', '.']).next().unwrap_or(name).trim()
}

/// The name on the left of `:=` before a place, in capitals.
fn assigned(text: &Text, at: usize) -> Option<String> {
    let before = text.trimmed(0..at).end;
    // Elements of an array have their opening bracket or their comma before them.
    let before = text.bytes()[..before].iter().rev().position(|b| !b"[,".contains(b) && !b.is_ascii_whitespace());
    let end = text.trimmed(0..at).end - before.unwrap_or(0);
    let end = text.bytes()[..end].ends_with(b":=").then(|| text.trimmed(0..end - 2).end)?;
    let end = match text.bytes()[..end].last() {
        Some(b'}') => text.bytes()[..end].iter().rposition(|b| *b == b'{')?,
        _ => end,
    };
    let name = text.capitals(text.name_before(end));
    is_name(&name).then_some(name)
}

/// All groups that have the build of a robtarget (3, 4, 4, 6) or of a jointtarget (6, 6).
fn positions(text: &Text) -> Vec<(Group, bool)> {
    let pairs = text.brackets(*b"[]", Some(b';'));
    let mut groups: Vec<Group> = Vec::with_capacity(pairs.len());
    let mut open: Vec<usize> = Vec::new();
    for pair in pairs {
        while open.pop_if(|k| groups[*k].at.close < pair.open).is_some() {}
        if let Some(outer) = open.last() {
            groups[*outer].inner.push(pair);
        }
        open.push(groups.len());
        groups.push(Group { at: pair, inner: Vec::new() });
    }
    let build = |group: &Group| {
        if !matches!(group.inner.len(), 2 | 4) || text.parts(group.at.inside()).len() != group.inner.len() {
            return None;
        }
        let lengths: Vec<usize> = group.inner.iter().map(|pair| text.parts(pair.inside()).len()).collect();
        match lengths[..] {
            [3, 4, 4, 6] => Some(true),
            [6, 6] => Some(false),
            _ => None,
        }
    };
    groups.into_iter().filter_map(|group| build(&group).map(|is_pose| (group, is_pose))).collect()
}

fn scan_file(text: &Text, uses: &mut Uses) -> Scan {
    let mut scan = Scan::default();
    for (group, is_pose) in positions(text) {
        let name = assigned(text, group.at.open).unwrap_or_else(|| if is_pose { "robtarget" } else { "jointtarget" }.into());
        position(text, &group, is_pose, name, &mut scan);
    }
    for statement in statements(text) {
        let line = text.line(statement.at.start);
        told(text, &statement, line, uses, &mut scan);
        frames(text, &statement, line, uses, &mut scan);
    }
    scan.only_one("tools", &mut uses.tools);
    scan.only_one("work objects", &mut uses.bases);
    scan
}

fn position(text: &Text, group: &Group, is_pose: bool, name: String, scan: &mut Scan) {
    let line = text.line(group.at.open);
    let of = |k: usize| text.numbers(group.inner[k].inside());
    let numbers = if is_pose { of(0).zip(of(1)).map(|(xyz, q)| [xyz, q].concat()) } else { of(0) };
    let Some(numbers) = numbers else {
        let reason = "its numbers are not all written out";
        return scan.unreadable(line, name, reason, "write plain numbers, in mm and deg");
    };
    let configuration = match is_pose.then(|| of(2)) {
        None => Configuration::Any,
        Some(conf) => {
            let conf: Option<[Number; 4]> = conf.and_then(|conf| conf.try_into().ok());
            let known = |conf: &[Number; 4]| conf.iter().all(|n| n.value.fract() == 0.0) && (0.0..8.0).contains(&conf[3].value);
            conf.filter(known).map_or(Configuration::Unreadable, Configuration::Abb)
        }
    };
    let layout = if is_pose { Layout::AbbTarget } else { Layout::Degrees };
    scan.positions.push(Position { line, name, layout, numbers, configuration });
}

/// Motions to what is not written out, and displacements.
fn told(text: &Text, statement: &Statement, line: usize, uses: &Uses, scan: &mut Scan) {
    const WRITE: &str = "write the position out, if it is to be compensated";
    if let Some(displaced) = DISPLACED.iter().find(|word| statement.capitals.starts_with(*word)) {
        let reason = "positions are displaced at run time; they are compensated for where they stand without it";
        scan.warn(line, *displaced, reason, "write out the positions that are to be compensated");
    }
    let Some((verb, count)) = motion(&statement.capitals) else {
        if let Some((left, _)) = statement.capitals.split_once(":=") {
            let name = left.split_whitespace().last().map_or("", root_of);
            let literal = positions_within(text, statement);
            if uses.moved.contains(name) && !literal {
                scan.warn(line, name, "it is computed at run time, and a motion goes there", WRITE);
            }
        }
        return;
    };
    for argument in statement.arguments(text, verb).0.iter().take(count) {
        let name = root_of(argument);
        if argument.starts_with('[') || uses.written.contains(name) && is_name(name) {
            continue;
        }
        let what: String = format!("{verb} {argument}").chars().take(60).collect();
        scan.warn(line, what, "the motion goes to a position that is not written out in the files given", WRITE);
    }
}

fn positions_within(text: &Text, statement: &Statement) -> bool {
    text.bytes()[statement.at.clone()].contains(&b'[')
}

/// `PERS tooldata gun:=[TRUE,[[x,y,z],[q]],...]` and the work objects, as far as motions name them.
fn frames(text: &Text, statement: &Statement, line: usize, uses: &Uses, scan: &mut Scan) {
    let Some((left, _)) = statement.capitals.split_once(":=") else { return };
    let name = left.split_whitespace().last().unwrap_or("");
    let tool = statement.capitals.contains("TOOLDATA ") && uses.tools.contains(name);
    let base = statement.capitals.contains("WOBJDATA ") && uses.bases.contains(name);
    if !tool && !base {
        return;
    }
    let Some(open) = text.bytes()[statement.at.clone()].iter().position(|b| *b == b'[') else { return };
    let parts = text.parts(statement.at.start + open + 1..statement.at.end.saturating_sub(1));
    let frame = |k: usize| {
        let part = text.trimmed(parts.get(k)?.clone());
        let inner = text.parts(part.start + 1..part.end.saturating_sub(1).max(part.start + 1));
        let list = |at: &Range<usize>| {
            let at = text.trimmed(at.clone());
            text.numbers(at.start + 1..at.end.saturating_sub(1).max(at.start + 1))
        };
        let values: Vec<f64> = [list(inner.first()?)?, list(inner.get(1)?)?].concat().iter().map(|n| n.value).collect();
        match meaning(Layout::AbbTarget, &values) {
            Ok(Meaning::Pose(pose)) => Some(pose),
            _ => None,
        }
    };
    let (kind, pose) = if tool { (Frame::Tool, frame(1)) } else { (Frame::Base, frame(3).zip(frame(4)).map(|(u, o)| u * o)) };
    match pose {
        Some(pose) => scan.settings.push(Setting { line, frame: kind, pose }),
        None => scan.warn(line, name, "its frame cannot be read", "check that it is the one given here"),
    }
}
