//! FANUC's teach pendant programs as text: `.ls`.

mod listing;

use std::collections::{BTreeSet, HashSet};
use std::ops::Range;

use crate::scan::{Configuration, Frame, Layout, Marks, Name, Number, Position, Scan, Setting, Source, Stands, Text};

pub use listing::listed;

/// Remarks are instructions here, and are skipped as such.
pub const MARKS: Marks = Marks { comment: b"", quotes: b"\"" };

const POSE: [&str; 6] = ["X", "Y", "Z", "W", "P", "R"];
const JOINTS: [&str; 6] = ["J1", "J2", "J3", "J4", "J5", "J6"];

/// Part of a file.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Section {
    Head,
    Instructions,
    Positions,
}

/// A position of the section `/POS`.
struct Entry {
    line: usize,
    name: String,
    at: Range<usize>,
}

pub fn scan(sources: &[Source], joints_as_in_robot_file: bool) -> Vec<Scan> {
    sources.iter().map(|source| scan_file(&source.text, joints_as_in_robot_file)).collect()
}

/// What the instructions of a program say of its positions.
#[derive(Default)]
struct Uses {
    relative: HashSet<String>,
    used: Vec<(usize, String)>,
    /// Moved to together with another group, with the line of the first such motion.
    coordinated: HashSet<String>,
    first_coordinated: Option<usize>,
    /// Set at run time.
    set: HashSet<String>,
    /// Numbers of the frames that are switched on, tool and base; empty for one that is computed.
    active: [BTreeSet<String>; 2],
}

fn scan_file(text: &Text, joints_as_in_robot_file: bool) -> Scan {
    let mut scan = Scan { settings: null_frames(), ..Scan::default() };
    let mut section = Section::Head;
    let mut uses = Uses::default();
    let mut entries: Vec<Entry> = Vec::new();
    let mut open: Option<(usize, String)> = None;
    for (k, at) in text.lines().enumerate() {
        let capitals = text.capitals(at.clone());
        section = match capitals.split_whitespace().next() {
            Some("/MN") => Section::Instructions,
            Some("/POS") => Section::Positions,
            Some(mark) if mark.starts_with('/') && mark[1..].starts_with(|c: char| c.is_ascii_alphabetic()) => Section::Head,
            _ => section,
        };
        match section {
            Section::Instructions => {
                // A line without a number goes on with the instruction before.
                let (number, body) = capitals.split_once(':').unwrap_or(("?", ""));
                match (&mut open, number.trim()) {
                    (Some((_, before)), "") => before.extend([" ", body]),
                    (_, number) if number.bytes().all(|b| b.is_ascii_digit()) => {
                        if let Some((line, body)) = open.replace((k + 1, body.to_owned())) {
                            instruction(line, &body, &mut uses, &mut scan);
                        }
                    }
                    _ => {}
                }
            }
            Section::Positions if capitals.starts_with("P[") => {
                let name = capitals.split([']', ':']).next().map_or_else(String::new, |name| format!("{name}]"));
                entries.push(Entry { line: k + 1, name, at });
            }
            Section::Positions => {
                if let Some(entry) = entries.last_mut()
                    && !text.bytes()[entry.at.clone()].contains(&b'}')
                {
                    entry.at.end = at.end;
                }
            }
            Section::Head => {}
        }
    }
    if let Some((line, body)) = open {
        instruction(line, &body, &mut uses, &mut scan);
    }
    all_positions(text, &entries, &uses, joints_as_in_robot_file, &mut scan);
    let there: HashSet<&str> = entries.iter().map(|entry| entry.name.as_str()).collect();
    for (line, name) in uses.used {
        if !there.contains(name.as_str()) {
            scan.warn(line, name, "this position is not in the file", "export the program with its positions");
        }
    }
    scan
}

/// The positions of `/POS`, with what the instructions say of them.
fn all_positions(text: &Text, entries: &[Entry], uses: &Uses, joints_as_in_robot_file: bool, scan: &mut Scan) {
    let moving = moving_group(text, entries);
    if let Some(line) = uses.first_coordinated {
        let group = moving.clone().unwrap_or_else(|| "another group".into());
        let reason = format!("the motion is coordinated with {group}: the work moves, and its frame with it");
        let remedy = "compensate these positions where the other group stands still, as a program of their own";
        scan.refuse(line, "COORD", &reason, remedy);
    }
    let mut seen = HashSet::new();
    for entry in entries {
        let (line, name) = (entry.line, entry.name.as_str());
        if !seen.insert(name) {
            scan.unreadable(line, name, "it is in the file twice", "keep the one that holds");
        } else if uses.relative.contains(name) {
            let reason = "it is a distance (INC), not a position, and is left as it is";
            scan.warn(line, name, reason, "write it as a position, if it is to be compensated");
        } else if uses.set.contains(name) {
            scan.unread += 1; // Told where it is set.
        } else if let Some(mut position) = position(text, entry, &uses.active, joints_as_in_robot_file, scan) {
            if uses.coordinated.contains(name) {
                scan.left.push(position); // Told with the motion.
                continue;
            }
            if let Some(group) = &moving {
                position.external = Some(format!("{group} moves"));
            }
            scan.positions.push(position);
        }
    }
}

/// The first motion group beside group 1 whose axes differ from position to position.
fn moving_group(text: &Text, entries: &[Entry]) -> Option<String> {
    (2..=8).find_map(|number| {
        let mark = format!("GP{number}:");
        let axes = |entry: &Entry| {
            let from = find(text, entry.at.clone(), mark.as_bytes())? + mark.len();
            let close = find(text, from..entry.at.end, b"}")?;
            let end = find(text, from..close, b"GP").unwrap_or(close);
            let parts = text.parts(from..end);
            let keys = ["J1", "J2", "J3", "J4", "J5", "J6", "X", "Y", "Z", "W", "P", "R"];
            Some(keys.map(|key| field(text, &parts, key).map(|at| text.words(at))))
        };
        let mut found = entries.iter().filter_map(axes);
        let first = found.next()?;
        found.any(|other| other != first).then(|| format!("group {number}"))
    })
}

fn null_frames() -> Vec<Setting> {
    let of = |frame, key: &str| Setting { line: 1, frame, name: Name::new(key, key), stands: Stands::Null };
    vec![of(Frame::Tool, "UT 0"), of(Frame::Base, "UF 0")]
}

/// An instruction: what moves relatively, by offsets, or to registers.
fn instruction(line: usize, body: &str, uses: &mut Uses, scan: &mut Scan) {
    let body = body.trim_start();
    if body.starts_with('!') || body.starts_with("//") || body.starts_with("--") {
        return;
    }
    let named: Vec<String> = places(body);
    let is_motion = ["J ", "L ", "C ", "A ", "S ", "J P", "L P", "C P", "A P"].iter().any(|verb| body.starts_with(verb));
    if !is_motion {
        for (k, key) in ["UTOOL_NUM", "UFRAME_NUM"].into_iter().enumerate() {
            if let Some((_, number)) = body.split_once(key) {
                let number: String = number.chars().filter(|c| !"= ;[]".contains(*c)).collect();
                uses.active[k].insert(number);
            }
        }
        let tight: String = body.chars().filter(|c| !c.is_whitespace()).collect();
        for (frame, list, key) in [(Frame::Tool, "UTOOL[", "UT"), (Frame::Base, "UFRAME[", "UF")] {
            let set = tight.strip_prefix(list).and_then(|rest| rest.split_once("]="));
            if let Some((number, _)) = set {
                let shown = format!("{list}{number}]");
                // The group may stand before the number: UFRAME[GP1:6].
                let number = number.rsplit(':').next().unwrap_or(number);
                let name = Name::new(format!("{key} {number}"), shown);
                scan.settings.push(Setting { line, frame, name, stands: Stands::Computed });
            }
        }
        if body.starts_with("PR[") || body.starts_with("P[") {
            if let Some(name) = named.first().filter(|name| name.starts_with("P[")) {
                uses.set.insert(name.split(',').next().map_or_else(String::new, |n| format!("{}]", n.trim_end_matches(']'))));
            }
            let remedy = "check what the program does with it";
            scan.warn(line, body.chars().take(40).collect::<String>(), "positions are computed at run time", remedy);
        }
        return;
    }
    let words: Vec<&str> = body.split([' ', ',', ';']).collect();
    let has = |word: &str| words.iter().any(|w| w.starts_with(word));
    if words.contains(&"INC") {
        uses.relative.extend(named.iter().filter(|name| name.starts_with("P[")).cloned());
        scan.warn(line, "INC", "a relative motion is left as it is", "start it from a compensated position, and keep it short");
    }
    if words.iter().any(|w| *w == "COORD" || w.starts_with("COORD[")) {
        uses.coordinated.extend(named.iter().filter(|name| name.starts_with("P[")).cloned());
        uses.first_coordinated.get_or_insert(line);
    }
    if has("OFFSET") || has("TOOL_OFFSET") || has("VOFFSET") {
        let reason = "an offset is added at run time; the position is compensated for where it stands without it";
        scan.warn(line, "Offset", reason, "write out the positions that are to be compensated");
    }
    for name in named {
        if name.starts_with("PR[") {
            let reason = "the motion goes to a position register, which is not part of the file";
            scan.warn(line, name, reason, "use positions P[n], if they are to be compensated");
        } else if name.contains("R[") {
            scan.warn(line, name, "the number of the position is computed at run time", "check that it is one of this file");
        } else {
            uses.used.push((line, name));
        }
    }
}

/// The positions and position registers named before the speed, as `P[3]`, `PR[1]`, `P[R[2]]`.
fn places(body: &str) -> Vec<String> {
    let mut found = Vec::new();
    let mut rest = body;
    while let Some(at) = rest.find("P[").or(rest.find("PR[")) {
        let at = rest.find("PR[").map_or(at, |register| register.min(at));
        let follows_word = rest[..at].ends_with(|c: char| c.is_ascii_alphanumeric() || c == '_');
        let from = &rest[at..];
        let Some(end) = from.find(']') else { break };
        // An offset's register, `Offset,PR[1]`, is not a destination.
        if !follows_word && !rest[..at].trim_end().ends_with(',') {
            let name = from[..end].split(':').next().unwrap_or("");
            found.push(format!("{name}]"));
        }
        rest = &from[end..];
    }
    found
}

/// `KEY = value` or `KEY : value` between commas: the place of the value.
fn field(text: &Text, parts: &[Range<usize>], key: &str) -> Option<Range<usize>> {
    fields(text, parts, key).next()
}

fn fields(text: &Text, parts: &[Range<usize>], key: &str) -> impl Iterator<Item = Range<usize>> {
    parts.iter().filter_map(move |part| {
        let part = text.trimmed(part.clone());
        let sign = part.start + text.bytes()[part.clone()].iter().position(|b| *b == b'=' || *b == b':')?;
        (text.capitals(part.start..sign) == key).then_some(sign + 1..part.end)
    })
}

/// A number with its unit.
fn measured(text: &Text, at: Range<usize>, unit: &str) -> Option<Number> {
    let at = text.trimmed(at);
    let length = text.bytes()[at.clone()].iter().take_while(|b| !b.is_ascii_whitespace() && !b.is_ascii_alphabetic()).count();
    let number = text.number(at.start..at.start + length)?;
    (text.capitals(at.start + length..at.end) == unit).then_some(number)
}

fn find(text: &Text, at: Range<usize>, what: &[u8]) -> Option<usize> {
    text.bytes()[at.clone()].windows(what.len()).position(|w| w.eq_ignore_ascii_case(what)).map(|k| at.start + k)
}

/// The part of an entry that is of motion group 1: from its mark to the next group or the end.
fn group_1(text: &Text, entry: &Entry) -> Option<Range<usize>> {
    let from = find(text, entry.at.clone(), b"GP1:")? + 4;
    let close = find(text, from..entry.at.end, b"}")?;
    let end = find(text, from..close, b"GP2:").unwrap_or(close);
    Some(from..end)
}

/// The name of a frame as a position has it: a number, or F for the one that is switched on.
fn frame_name(key: &str, written: &str, active: &BTreeSet<String>) -> Option<Name> {
    let named = |number: &str| Name::new(format!("{key} {number}"), format!("{key} {number}"));
    match written {
        "" => None,
        "F" => match active.iter().collect::<Vec<_>>()[..] {
            [] => None,
            [only] => Some(named(only)),
            _ => Some(named("F")),
        },
        number => Some(named(number)),
    }
}

fn position(
    text: &Text,
    entry: &Entry,
    active: &[BTreeSet<String>; 2],
    joints_as_in_robot_file: bool,
    scan: &mut Scan,
) -> Option<Position> {
    let (line, name) = (entry.line, entry.name.as_str());
    let Some(group) = group_1(text, entry) else {
        scan.unreadable(line, name, "it has no complete group GP1", "export the program again");
        return None;
    };
    let quoted = find(text, group.clone(), b"'").and_then(|open| Some(open..find(text, open + 1..group.end, b"'")?));
    let mut parts = text.parts(group.start..quoted.as_ref().map_or(group.end, |q| q.start));
    parts.extend(quoted.iter().flat_map(|q| text.parts(q.end + 1..group.end)));
    if let Some(twice) = JOINTS.iter().chain(&POSE).find(|key| fields(text, &parts, key).count() > 1) {
        scan.unreadable(line, name, &format!("it has {twice} twice"), "write every number once");
        return None;
    }
    let of = |key: &str| field(text, &parts, key).map_or_else(String::new, |at| text.capitals(at));
    let frames = [("UT", 0), ("UF", 1)].map(|(key, k)| frame_name(key, &of(key), &active[k]).into_iter().collect());
    let joints = field(text, &parts, "J1").is_some();
    if joints && !joints_as_in_robot_file {
        let reason = "it is a joint position: the pendant's J3 turns with J2, the robot file's may not";
        let remedy = "teach it as a pose, or give --joints-as-in-robot-file if the file counts as the pendant does";
        scan.unreadable(line, name, reason, remedy);
        return None;
    }
    let numbers: Option<Vec<Number>> = if joints {
        JOINTS.iter().map(|key| measured(text, field(text, &parts, key)?, "DEG")).collect()
    } else {
        let unit = |key: &str| if ["X", "Y", "Z"].contains(&key) { "MM" } else { "DEG" };
        POSE.iter().map(|key| measured(text, field(text, &parts, key)?, unit(key))).collect()
    };
    let Some(numbers) = numbers else {
        let reason = "it is not taught, or not written in mm and deg";
        scan.unreadable(line, name, reason, "teach it, and export the program again");
        return None;
    };
    let layout = if joints { Layout::Degrees } else { Layout::FanucPose };
    let configuration = match quoted {
        Some(at) if !joints => config(text, at.start + 1..at.end).unwrap_or(Configuration::Unreadable),
        _ => Configuration::Any,
    };
    let external = ["E1", "E2", "E3"].iter().find_map(|key| {
        let words = text.words(field(text, &parts, key)?);
        let stands = words.split_whitespace().next().and_then(|n| n.parse::<f64>().ok()) == Some(0.0);
        (!stands).then(|| format!("{key} {words}"))
    });
    Some(Position { configuration, frames, external, ..Position::new(line, name, layout, numbers) })
}

/// `N U T, 0, 0, 0`.
fn config(text: &Text, at: Range<usize>) -> Option<Configuration> {
    let parts = text.parts(at);
    let (letters, turns) = parts.split_first()?;
    let turns: Vec<Number> = turns.iter().map(|part| text.number(part.clone())).collect::<Option<_>>()?;
    let letters: Vec<char> = text.capitals(letters.clone()).chars().filter(|c| !c.is_whitespace()).collect();
    let [wrist @ ('N' | 'F'), elbow @ ('U' | 'D'), arm @ ('T' | 'B')] = letters[..] else { return None };
    let turns = turns.try_into().ok()?;
    Some(Configuration::Fanuc { flip: wrist == 'F', down: elbow == 'D', back: arm == 'B', turns })
}
