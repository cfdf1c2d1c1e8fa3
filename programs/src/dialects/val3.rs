//! Stäubli's VAL 3: points, frames and tools in `.dtx`, motions in `.pgx`.

mod data;

use std::collections::{BTreeSet, HashMap, HashSet};

use crate::scan::{
    Brackets, Configuration, Frame, Marks, Name, Position, Scan, Setting, Source, Stands, Text, WRITE_OUT, is_name, names,
};
use data::{Kind, Value, key_of, root_of, values};

/// Marks of data, whose values stand in quotes.
pub const MARKS_OF_DATA: Marks = Marks { comment: b"", quotes: b"" };
/// Marks of programs.
pub const MARKS: Marks = Marks { comment: b"//", quotes: b"\"" };

/// Motions, and how many of their first arguments are positions.
const MOTIONS: [(&str, usize); 3] = [("movej", 1), ("movel", 1), ("movec", 2)];
/// Functions of a position whose result is another one.
const OFFSETS: [&str; 2] = ["appro", "compose"];

/// What all programs say of the data.
#[derive(Default)]
struct Uses {
    /// The tools with which a position is moved to, by its name or by that of its list.
    tools: HashMap<String, BTreeSet<Name>>,
    /// Of which single numbers are set at run time.
    parts: HashSet<String>,
    /// Set as a whole at run time.
    set: HashSet<String>,
    /// Named by a line that does not set them, without index: its text.
    used: HashMap<String, String>,
}

impl Uses {
    fn is_in(names: &HashSet<String>, name: &str) -> bool {
        names.contains(name) || names.contains(&format!("{}[*]", root_of(name)))
    }

    fn tools_of(&self, name: &str) -> Option<BTreeSet<Name>> {
        let all = [self.tools.get(name), self.tools.get(&format!("{}[*]", root_of(name)))];
        let names: BTreeSet<Name> = all.into_iter().flatten().flatten().cloned().collect();
        (all.iter().any(Option::is_some)).then_some(names)
    }
}

/// A statement that sets something: the name that it sets, and the component.
struct Target {
    name: String,
    component: String,
}

pub fn scan(sources: &[Source]) -> Vec<Scan> {
    let is_data = |source: &Source| source.text.bytes().windows(6).any(|w| w == b"<Datas");
    let mut scans: Vec<Scan> = sources.iter().map(|_| Scan::default()).collect();
    let mut all: Vec<(usize, Value)> = Vec::new();
    for (source, scan) in sources.iter().zip(&mut scans).filter(|(source, _)| is_data(source)) {
        all.extend(values(&source.text, scan).into_iter().map(|value| (source.file, value)));
    }
    let kinds: HashMap<&str, Kind> = all.iter().map(|(_, value)| (root_of(&value.name), value.kind)).collect();
    let mut uses = Uses::default();
    for (source, scan) in sources.iter().zip(&mut scans).filter(|(source, _)| !is_data(source)) {
        program(&source.text, &kinds, &mut uses, scan);
    }
    for (k, (file, value)) in all.iter().enumerate() {
        let Some(scan) = sources.iter().position(|s| s.file == *file).and_then(|at| scans.get_mut(at)) else { continue };
        if k == 0 {
            scan.settings.extend(null_frames());
        }
        scan.settings.extend(setting(value));
        if matches!(value.kind, Kind::Point | Kind::Joints) {
            position(value, &uses, scan);
        }
    }
    scans
}

fn null_frames() -> [Setting; 2] {
    let of = |frame, key: &str| Setting { line: 1, frame, name: Name::new(key, key), stands: Stands::Null };
    [of(Frame::Tool, "flange"), of(Frame::Base, "world")]
}

/// Where a frame or a tool stands: on its father, if only the world or the flange. `None` for other values.
fn setting(value: &Value) -> Option<Setting> {
    let (frame, last) = match value.kind {
        Kind::Frame => (Frame::Base, "world"),
        Kind::Tool => (Frame::Tool, "flange"),
        Kind::Point | Kind::Joints => return None,
    };
    let father = if value.father.is_empty() { last } else { &value.father };
    let stands = value.pose().map_or(Stands::Computed, |pose| Stands::On(pose, father.to_owned()));
    Some(Setting { line: value.line, frame, name: Name::new(value.name.clone(), value.name.clone()), stands })
}

fn position(value: &Value, uses: &Uses, scan: &mut Scan) {
    let name = value.name.as_str();
    if Uses::is_in(&uses.parts, name) {
        scan.unread += 1; // Told where the number is set.
        return;
    }
    let Some(numbers) = value.numbers.clone() else {
        scan.unreadable(value.line, name, "its numbers are not plain", "write plain numbers, in mm and deg");
        return;
    };
    if matches!(value.configuration, Configuration::Val3 { righty: Some(false), .. }) {
        let reason = "its shoulder is lefty: which side of axis 1 that is depends on the arm";
        scan.unreadable(value.line, name, reason, "teach it as righty, the arm that reaches forward");
        return;
    }
    let mut position = Position::new(value.line, name, value.kind.layout(), numbers);
    let tools = uses.tools_of(name);
    let is_free = tools.is_none() && !Uses::is_in(&uses.set, name);
    if let Some(by) = uses.used.get(root_of(name)).filter(|_| is_free) {
        return scan.leave_used(value.line, name, by);
    }
    // Data hold places that are set at run time, and points that programs are given.
    position.spare = tools.is_none() || Uses::is_in(&uses.set, name);
    let father = if value.father.is_empty() { "world" } else { &value.father };
    position.frames = [tools.unwrap_or_default(), BTreeSet::from([Name::new(father, father)])];
    position.configuration = value.configuration.clone();
    scan.positions.push(position);
}

/// A call: its name, and its arguments.
struct Call {
    name: String,
    at: usize,
    arguments: Vec<String>,
}

fn calls(text: &Text) -> Vec<Call> {
    let of = |pair: Brackets| {
        let name = text.name_before(pair.open);
        let arguments = text.parts(pair.inside()).into_iter().map(|at| text.words(at)).collect();
        Call { name: text.words(name.clone()), at: name.start, arguments }
    };
    text.brackets(*b"()", None).into_iter().map(of).filter(|call| is_name(&call.name)).collect()
}

/// The motions of a program, and what it sets at run time.
fn program(text: &Text, kinds: &HashMap<&str, Kind>, uses: &mut Uses, scan: &mut Scan) {
    for call in calls(text) {
        let line = text.line(call.at);
        if let Some((verb, count)) = MOTIONS.iter().find(|(verb, _)| *verb == call.name) {
            let tool = call.arguments.get(*count).map(|words| Name::new(key_of(words), words.clone()));
            for words in call.arguments.iter().take(*count) {
                moved(&Motion { line, verb, words, tool: tool.as_ref() }, kinds, uses, scan);
            }
        } else if let ("setFrame", Some(frame)) = (call.name.as_str(), call.arguments.get(3)) {
            scan.settings.push(computed(line, Frame::Base, frame));
        } else if let ("link", [point, _]) = (call.name.as_str(), &call.arguments[..]) {
            scan.tell_computed(line, point.as_str());
            uses.set.insert(indexed(point));
        }
    }
    for (k, at) in text.lines().enumerate() {
        let words = text.words(at);
        let target = target(&words);
        let right = words.split_once('=').filter(|_| target.is_some()).map_or(words.as_str(), |(_, right)| right);
        for name in names(right).filter(|name| matches!(kinds.get(name), Some(Kind::Point | Kind::Joints))) {
            uses.used.entry(name.to_owned()).or_insert_with(|| words.clone());
        }
        let Some(Target { name, component }) = target else { continue };
        let Some(kind) = kinds.get(root_of(&name)) else { continue };
        let shown = if component.is_empty() { name.clone() } else { format!("{name}.{component}") };
        let is_whole = component.is_empty() || component == "trsf";
        match kind {
            Kind::Point | Kind::Joints if is_whole => {
                scan.tell_computed(k + 1, shown);
                uses.set.insert(indexed(&name));
            }
            Kind::Point | Kind::Joints => {
                scan.tell_set_in_part(k + 1, shown);
                uses.parts.insert(indexed(&name));
            }
            Kind::Frame | Kind::Tool if is_whole => {
                let frame = if *kind == Kind::Tool { Frame::Tool } else { Frame::Base };
                scan.settings.push(computed(k + 1, frame, &name));
            }
            Kind::Tool if component.starts_with("trsf") => scan.tell_frame_changed(k + 1, shown, "the tool"),
            Kind::Frame if component.starts_with("trsf") => scan.tell_frame_changed(k + 1, shown, "the frame"),
            Kind::Frame | Kind::Tool => {}
        }
    }
}

fn computed(line: usize, frame: Frame, words: &str) -> Setting {
    Setting { line, frame, name: Name::new(key_of(words), words), stands: Stands::Computed }
}

/// A motion to one position.
struct Motion<'a> {
    line: usize,
    verb: &'a str,
    words: &'a str,
    tool: Option<&'a Name>,
}

/// A motion to a position, by its name, or to what is not written out.
fn moved(motion: &Motion<'_>, kinds: &HashMap<&str, Kind>, uses: &mut Uses, scan: &mut Scan) {
    let Motion { line, verb, words, tool } = *motion;
    let what: String = format!("{verb} {words}").chars().take(60).collect();
    let is_known = |name: &str| matches!(kinds.get(root_of(name)), Some(Kind::Point | Kind::Joints));
    let offset = OFFSETS.iter().find_map(|function| words.strip_prefix(*function)?.trim_start().strip_prefix('('));
    if let Some(from) = offset.and_then(|rest| rest.split(',').next()).map(str::trim).filter(|from| is_known(from)) {
        uses.tools.entry(indexed(from)).or_default().extend(tool.cloned());
        let reason = "an offset from a position that is compensated: the offset itself is as it was";
        return scan.warn(line, what, reason, "keep it short, or write the position out");
    }
    let is_plain = words.bytes().all(|b| b.is_ascii_alphanumeric() || b"_[]".contains(&b));
    if is_plain && is_known(words) {
        uses.tools.entry(indexed(words)).or_default().extend(tool.cloned());
    } else {
        let reason = "the motion goes to a position that is not written out in the files given";
        scan.warn(line, what, reason, WRITE_OUT);
    }
}

/// The key of an element, or `name[*]` where its number is computed.
fn indexed(words: &str) -> String {
    let index = words.split_once('[').map(|(_, rest)| rest.trim_end_matches(']'));
    match index {
        Some(index) if index.parse::<u32>().is_err() => format!("{}[*]", root_of(words)),
        _ => key_of(words),
    }
}

/// The left side of an assignment, `pPlace[1].trsf.z=...`.
fn target(line: &str) -> Option<Target> {
    let (left, right) = line.split_once('=')?;
    let left = left.trim();
    if right.starts_with('=') || left.ends_with(['<', '>', '!']) || left.contains(['(', ' ', ')']) {
        return None;
    }
    let end = left.find('.').unwrap_or(left.len());
    let (name, component) = left.split_at(end);
    is_name(root_of(name)).then(|| Target { name: name.into(), component: component.trim_start_matches('.').into() })
}
