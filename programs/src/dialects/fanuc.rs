//! FANUC's teach pendant programs as text: `.ls`.

mod instructions;
mod listing;

use std::collections::{BTreeSet, HashMap, HashSet};
use std::ops::Range;

use crate::flow::{Names, Step, follow};
use crate::scan::{Configuration, Frame, Layout, Marks, Name, Number, Position, Scan, Setting, Source, Stands, Text};

use instructions::{Follower, KEYS, Numbers, Used, Uses, instruction, named};
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

/// A file as far as it is read before its frames are followed.
struct Parsed {
    scan: Scan,
    uses: Uses,
    entries: Vec<Entry>,
}

pub fn scan(sources: &[Source], joints_as_in_robot_file: bool) -> Vec<Scan> {
    let mut steps = Vec::new();
    let mut numbers = HashMap::new();
    let parsed: Vec<Parsed> = sources.iter().map(|source| parse(source, &mut numbers, &mut steps)).collect();
    let frames = follow(&steps);
    let of = |(source, parsed): (&Source, Parsed)| {
        let frames_of = |name: &str| numbers.get(&(source.file, name.to_owned())).and_then(|number| frames.get(number));
        let active = Active { of: &frames_of, only: [Frame::Tool, Frame::Base].map(|frame| only_one(&steps, frame)) };
        let Parsed { mut scan, uses, entries } = parsed;
        all_positions(&source.text, &entries, &uses, &active, joints_as_in_robot_file, &mut scan);
        let there: HashSet<&str> = entries.iter().map(|entry| entry.name.as_str()).collect();
        for Used { line, name } in &uses.used {
            if !there.contains(name.as_str()) {
                scan.warn(*line, name, "this position is not in the file", "export the program with its positions");
            }
        }
        scan
    };
    sources.iter().zip(parsed).map(of).collect()
}

/// The frame that all programs switch on, if it is one.
fn only_one(steps: &[Step], frame: Frame) -> Option<Name> {
    let set = |step: &Step| matches!(step, Step::Set(of, _) if *of == frame).then(|| step.clone());
    let names: BTreeSet<Name> =
        steps.iter().filter_map(set).filter_map(|step| if let Step::Set(_, name) = step { Some(name) } else { None }).collect();
    names.first().cloned().filter(|_| names.len() == 1)
}

/// The frames that are switched on where a position is used.
struct Active<'a> {
    of: &'a dyn Fn(&str) -> Option<&'a [Names; 2]>,
    /// The frames of positions that no motion names, where all programs switch on one.
    only: [Option<Name>; 2],
}

fn parse(source: &Source, numbers: &mut Numbers, steps: &mut Vec<Step>) -> Parsed {
    let text = &source.text;
    let mut scan = Scan { settings: null_frames(), ..Scan::default() };
    let mut follower = Follower { file: source.file, numbers, steps };
    let mut section = Section::Head;
    let mut uses = Uses::default();
    let mut entries: Vec<Entry> = Vec::new();
    let mut open: Option<(usize, String)> = None;
    for (k, at) in text.lines().enumerate() {
        let capitals = text.capitals(at.clone());
        section = match capitals.split_whitespace().next() {
            Some("/PROG") => {
                let name = capitals.split_whitespace().nth(1).unwrap_or_default();
                follower.steps.push(Step::Begin(name.to_owned()));
                Section::Head
            }
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
                            instruction(line, &body, &mut uses, &mut follower, &mut scan);
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
        instruction(line, &body, &mut uses, &mut follower, &mut scan);
    }
    follower.steps.push(Step::End);
    Parsed { scan, uses, entries }
}

/// The positions of `/POS`, with what the instructions say of them.
fn all_positions(
    text: &Text,
    entries: &[Entry],
    uses: &Uses,
    active: &Active<'_>,
    joints_as_in_robot_file: bool,
    scan: &mut Scan,
) {
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
        } else if let Some(mut position) = position(text, entry, active, joints_as_in_robot_file, scan) {
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

/// The names of a frame as a position has it: a number, or F for the one that is switched on where it is used.
fn frame_names(frame: Frame, written: &str, entry: &Entry, active: &Active<'_>, scan: &mut Scan) -> Names {
    let (k, key) = (frame as usize, KEYS[frame as usize]);
    let here = (active.of)(&entry.name).map(|names| &names[k]).filter(|names| !names.is_empty());
    match written {
        "" => Names::new(),
        "F" => match (here, &active.only[k]) {
            (Some(names), _) => names.clone(),
            (None, Some(only)) => Names::from([only.clone()]),
            (None, None) => Names::from([Name::new(format!("{key} F"), format!("{key} F, the one that is switched on,"))]),
        },
        number => {
            let own = named(frame, number);
            if let Some(other) = here.and_then(|names| names.iter().find(|name| **name != own)) {
                let reason = format!(
                    "it is of {}, and a motion goes there with {} switched on; it is compensated in its own",
                    own.shown, other.shown
                );
                scan.warn(entry.line, entry.name.as_str(), &reason, "check what the controller does there");
            }
            Names::from([own])
        }
    }
}

fn position(
    text: &Text,
    entry: &Entry,
    active: &Active<'_>,
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
    let written = KEYS.map(of);
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
    let frames = [Frame::Tool, Frame::Base].map(|frame| frame_names(frame, &written[frame as usize], entry, active, scan));
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
