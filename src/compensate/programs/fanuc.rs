//! FANUC's teach pendant programs as text: `.ls`.

use std::collections::HashSet;
use std::ops::Range;

use super::scan::{Configuration, Layout, Marks, Number, Position, Scan, Text};

/// Remarks are instructions here, and are skipped as such.
pub(super) const MARKS: Marks = Marks { comment: b"", quotes: b"\"" };

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

pub(super) fn scan(texts: &[Text], joints_as_in_robot_file: bool) -> Vec<Scan> {
    texts.iter().map(|text| scan_file(text, joints_as_in_robot_file)).collect()
}

fn scan_file(text: &Text, joints_as_in_robot_file: bool) -> Scan {
    let mut scan = Scan::default();
    let (mut section, mut relative, mut used) = (Section::Head, HashSet::new(), Vec::new());
    let mut entries: Vec<Entry> = Vec::new();
    for (k, at) in text.lines().enumerate() {
        let capitals = text.capitals(at.clone());
        section = match capitals.split_whitespace().next() {
            Some("/MN") => Section::Instructions,
            Some("/POS") => Section::Positions,
            Some(mark) if mark.starts_with('/') && mark[1..].starts_with(|c: char| c.is_ascii_alphabetic()) => Section::Head,
            _ => section,
        };
        match section {
            Section::Instructions => instruction(k + 1, &capitals, &mut relative, &mut used, &mut scan),
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
    let mut frames = None;
    for entry in &entries {
        if relative.contains(&entry.name) {
            let reason = "it is a distance (INC), not a position, and is left as it is";
            scan.warn(entry.line, entry.name.as_str(), reason, "write it as a position, if it is to be compensated");
        } else {
            position(text, entry, &mut frames, joints_as_in_robot_file, &mut scan);
        }
    }
    let there: HashSet<&str> = entries.iter().map(|entry| entry.name.as_str()).collect();
    for (line, name) in used {
        if !there.contains(name.as_str()) {
            scan.warn(line, name, "this position is not in the file", "export the program with its positions");
        }
    }
    scan
}

/// An instruction: what moves relatively, by offsets, or to registers.
fn instruction(line: usize, capitals: &str, relative: &mut HashSet<String>, used: &mut Vec<(usize, String)>, scan: &mut Scan) {
    let Some((number, body)) = capitals.split_once(':') else { return };
    if !number.trim().bytes().all(|b| b.is_ascii_digit()) {
        return;
    }
    let body = body.trim_start();
    if body.starts_with('!') || body.starts_with("//") {
        return;
    }
    let named: Vec<String> = places(body);
    let motion = number.trim().is_empty() || ["J ", "L ", "C ", "A ", "S "].iter().any(|verb| body.starts_with(verb));
    if !motion {
        if body.starts_with("PR[") || body.starts_with("P[") {
            let remedy = "check what the program does with it";
            scan.warn(line, body.chars().take(40).collect::<String>(), "positions are computed at run time", remedy);
        }
        return;
    }
    let words: Vec<&str> = body.split([' ', ',', ';']).collect();
    let has = |word: &str| words.iter().any(|w| w.starts_with(word));
    if words.contains(&"INC") {
        relative.extend(named.iter().filter(|name| name.starts_with("P[")).cloned());
        scan.warn(line, "INC", "a relative motion is left as it is", "start it from a compensated position, and keep it short");
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
            used.push((line, name));
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
    parts.iter().find_map(|part| {
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

/// UF and UT of the first position, as written.
type Frames = Option<(String, String)>;

fn position(text: &Text, entry: &Entry, frames: &mut Frames, joints_as_in_robot_file: bool, scan: &mut Scan) {
    let (line, name) = (entry.line, entry.name.as_str());
    let Some(group) = group_1(text, entry) else {
        return scan.unreadable(line, name, "it has no complete group GP1", "export the program again");
    };
    let quoted = find(text, group.clone(), b"'").and_then(|open| Some(open..find(text, open + 1..group.end, b"'")?));
    let mut parts = text.parts(group.start..quoted.as_ref().map_or(group.end, |q| q.start));
    parts.extend(quoted.iter().flat_map(|q| text.parts(q.end + 1..group.end)));
    let of = |key: &str| field(text, &parts, key).map_or_else(String::new, |at| text.words(at));
    let own = (of("UF"), of("UT"));
    if frames.get_or_insert_with(|| own.clone()) != &own {
        let reason = format!("it is in UF {} and of UT {}, and the first position is not", own.0, own.1);
        return scan.unreadable(line, name, &reason, "split the program into one for each frame and tool");
    }
    let joints = field(text, &parts, "J1").is_some();
    if joints && !joints_as_in_robot_file {
        let reason = "it is a joint position: the pendant's J3 turns with J2, the robot file's may not";
        return scan.unreadable(
            line,
            name,
            reason,
            "teach it as a pose, or give --joints-as-in-robot-file if the file counts as the pendant does",
        );
    }
    let numbers: Option<Vec<Number>> = if joints {
        JOINTS.iter().map(|key| measured(text, field(text, &parts, key)?, "DEG")).collect()
    } else {
        let unit = |key: &str| if ["X", "Y", "Z"].contains(&key) { "MM" } else { "DEG" };
        POSE.iter().map(|key| measured(text, field(text, &parts, key)?, unit(key))).collect()
    };
    let Some(numbers) = numbers else {
        let reason = "it is not taught, or not written in mm and deg";
        return scan.unreadable(line, name, reason, "teach it, and export the program again");
    };
    let layout = if joints { Layout::Degrees } else { Layout::FanucPose };
    let configuration = match quoted {
        Some(at) if !joints => config(text, at.start + 1..at.end).unwrap_or(Configuration::Unreadable),
        _ => Configuration::Any,
    };
    scan.positions.push(Position { line, name: name.into(), layout, numbers, configuration });
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
