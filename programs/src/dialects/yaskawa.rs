//! Yaskawa's INFORM jobs: `.jbi`. The grammar is that of the job data format in the maker's manuals of data transmission (NX100,
//! DX100): a section of positions with headers that hold from their line on, and a section of instructions.

use std::collections::{BTreeSet, HashMap, HashSet};
use std::ops::Range;

use crate::scan::{Configuration, Frame, Layout, Marks, Name, Number, Position, Scan, Setting, Source, Stands, Text};

/// A comment is an instruction of its own and begins with a quote; texts stand in double quotes.
pub const MARKS: Marks = Marks { comment: b"'", quotes: b"\"" };

/// Motions to positions of the arm.
const MOTIONS: [&str; 5] = ["MOVJ", "MOVL", "MOVC", "MOVS", "REFP"];
/// Instructions that set a position variable.
const SETTING: [&str; 14] =
    ["SET", "SETE", "GETS", "GETPOS", "CNVRT", "ADD", "SUB", "INC", "DEC", "MULMAT", "INVMAT", "LOADV", "GETE", "CLEAR"];

/// Headers that hold for the positions that follow.
#[derive(Clone, Default)]
struct Headers {
    tool: Option<Name>,
    user: Option<Name>,
    kind: String,
    is_rectangular: bool,
    configuration: Option<Configuration>,
}

/// What the instructions say of the positions.
#[derive(Default)]
struct Uses {
    /// Positions of axes that carry robot or work, by the position of the arm with which they stand in a motion.
    axes: HashMap<String, Vec<String>>,
    /// Position variables that are set at run time.
    set: HashSet<String>,
    /// Moved to, with the line.
    moved: Vec<(usize, String)>,
}

pub fn scan(sources: &[Source]) -> Vec<Scan> {
    sources.iter().map(|source| scan_file(&source.text)).collect()
}

fn null_bases() -> Vec<Setting> {
    let of = |kind: &str| {
        let name = Name::new(format!("POSTYPE {kind}"), format!("POSTYPE {kind}"));
        Setting { line: 1, frame: Frame::Base, name, stands: Stands::Null }
    };
    ["ROBOT", "BASE"].map(of).into()
}

fn scan_file(text: &Text) -> Scan {
    let mut scan = Scan { settings: null_bases(), ..Scan::default() };
    let mut uses = Uses::default();
    let mut is_of_instructions = false;
    for (k, at) in text.lines().enumerate() {
        let capitals = text.capitals(at);
        match capitals.as_str() {
            "//INST" => is_of_instructions = true,
            "//POS" | "/JOB" => is_of_instructions = false,
            _ if is_of_instructions => instruction(k + 1, &capitals, &mut uses, &mut scan),
            _ => {}
        }
    }
    let axes = axes_away(text);
    let mut headers = Headers::default();
    let mut names = HashSet::new();
    let mut is_of_positions = false;
    for (k, at) in text.lines().enumerate() {
        let capitals = text.capitals(at.clone());
        if capitals.starts_with("//") && !capitals.starts_with("///") {
            is_of_positions = capitals == "//POS";
        } else if let Some(header) = capitals.strip_prefix("///").filter(|_| is_of_positions) {
            headers.take(header, text, &at);
        } else if let Some(name) = position_name(&capitals).filter(|_| is_of_positions) {
            if !names.insert(name.clone()) {
                scan.unreadable(k + 1, name, "it is in the file twice", "keep the one that holds");
                continue;
            }
            if let Some(mut position) = position(text, k + 1, at, &name, &headers, &mut scan) {
                let beside = uses.axes.get(&name).into_iter().flatten();
                position.external = beside.filter_map(|axis| axes.get(axis)).next().cloned();
                position.spare = uses.set.contains(&name);
                scan.positions.push(position);
            }
        }
    }
    for (line, name) in &uses.moved {
        if !names.contains(name) && !uses.set.contains(name) {
            let reason = "this position is not in the file";
            scan.warn(
                *line,
                name.as_str(),
                reason,
                "export the job with its position variables, or write the position into the job",
            );
        }
    }
    scan
}

/// The name of a position of the arm, `C00012` or `P00003`, with its number as short as it may be.
fn position_name(capitals: &str) -> Option<String> {
    let (name, _) = capitals.split_once('=')?;
    short_name(name.trim(), &["C", "P"])
}

/// `C00012` as `C12`; `None` for other names.
fn short_name(name: &str, kinds: &[&str]) -> Option<String> {
    let letters = name.find(|c: char| c.is_ascii_digit())?;
    let (kind, number) = name.split_at(letters);
    let number: u32 = number.parse().ok()?;
    kinds.contains(&kind).then(|| format!("{kind}{number}"))
}

/// Positions of base and station axes that are away from zero, in words.
fn axes_away(text: &Text) -> HashMap<String, String> {
    let of = |at: Range<usize>| {
        let capitals = text.capitals(at.clone());
        let (name, _) = capitals.split_once('=')?;
        let name = short_name(name.trim(), &["BC", "EC", "BP", "EX"])?;
        let sign = at.start + text.bytes()[at.clone()].iter().position(|b| *b == b'=')?;
        let stands = text.numbers(sign + 1..at.end).is_some_and(|values| values.iter().all(|n| n.value == 0.0));
        (!stands).then_some((name, capitals))
    };
    text.lines().filter_map(of).collect()
}

impl Headers {
    fn take(&mut self, header: &str, text: &Text, at: &Range<usize>) {
        let (key, value) = header.split_once(char::is_whitespace).unwrap_or((header, ""));
        let value = value.trim();
        let named = |key: &str| Name::new(format!("{key} {value}"), format!("{key} {value}"));
        match key {
            "TOOL" => self.tool = Some(named("TOOL")),
            "USER" => self.user = Some(named("USER")),
            "POSTYPE" => value.clone_into(&mut self.kind),
            "RECTAN" => self.is_rectangular = true,
            "PULSE" => self.is_rectangular = false,
            "RCONF" => {
                let values = text.numbers(at.end - value.len().min(at.len())..at.end);
                self.configuration = Some(values.and_then(|values| rconf(&values)).unwrap_or(Configuration::Unreadable));
            }
            _ => {}
        }
    }
}

/// No-flip, lower arm, rear, and R, T, S beyond half a turn; the flags behind these six are unused.
fn rconf(values: &[Number]) -> Option<Configuration> {
    let flags: Option<Vec<bool>> =
        values.iter().map(|n| if n.value == 0.0 { Some(false) } else { (n.value == 1.0).then_some(true) }).take(6).collect();
    let [no_flip, lower, back, r, t, s] = flags?.try_into().ok()?;
    Some(Configuration::Yaskawa { no_flip, lower, back, beyond: [r, t, s] })
}

fn position(text: &Text, line: usize, at: Range<usize>, name: &str, headers: &Headers, scan: &mut Scan) -> Option<Position> {
    if !headers.is_rectangular {
        let reason = "it is in pulses, whose scale is the controller's own";
        scan.unreadable(line, name, reason, "convert the job to a relative job (RECTAN, POSTYPE ROBOT or USER), and give that");
        return None;
    }
    let base = match (headers.kind.as_str(), &headers.user) {
        ("USER", Some(user)) => user.clone(),
        ("USER", None) => {
            scan.unreadable(
                line,
                name,
                "no header USER says which user frame it has",
                "add ///USER with the number of the frame",
            );
            return None;
        }
        (kind @ ("ROBOT" | "BASE"), _) => Name::new(format!("POSTYPE {kind}"), format!("POSTYPE {kind}")),
        (kind, _) => {
            let reason = format!("POSTYPE {kind} is not read: only ROBOT, BASE and USER are");
            scan.unreadable(line, name, &reason, "convert the job to POSTYPE ROBOT or USER");
            return None;
        }
    };
    let sign = at.start + text.bytes()[at.clone()].iter().position(|b| *b == b'=')?;
    let Some(numbers) = text.numbers(sign + 1..at.end).filter(|numbers| numbers.len() == 6) else {
        let reason = "it is not six numbers, X, Y, Z, RX, RY, RZ";
        scan.unreadable(line, name, reason, "export the job of an arm of six axes again, in mm and deg");
        return None;
    };
    let frames = [headers.tool.clone().into_iter().collect(), BTreeSet::from([base])];
    let configuration = headers.configuration.clone().unwrap_or(Configuration::Any);
    Some(Position { configuration, frames, ..Position::new(line, name, Layout::FanucPose, numbers) })
}

/// The names in an instruction that are numbers of positions.
fn names(body: &str, kinds: &[&str]) -> Vec<String> {
    body.split([' ', ',', '(', ')', '+', '\t']).filter_map(|word| short_name(word, kinds)).collect()
}

/// An instruction: what moves, by shifts, to variables, and what is set at run time.
fn instruction(line: usize, body: &str, uses: &mut Uses, scan: &mut Scan) {
    let mut words = body.split_whitespace();
    let mut verb = words.next().unwrap_or_default();
    if verb.starts_with('+') {
        // The other group of a motion: SMOVL ... +MOVL.
        let reason = "another group moves together with the arm, and may carry the work";
        return scan.refuse(line, verb, reason, "compensate these positions where the other group stands still");
    }
    if let Some(synchronous) = verb.strip_prefix('S').filter(|rest| MOTIONS.contains(rest)) {
        let reason = "the motion is coordinated with another group: the work moves, and its frame with it";
        scan.refuse(line, verb, reason, "compensate these positions where the other group stands still, as a job of their own");
        verb = synchronous;
    }
    let arm = names(body, &["C", "P"]);
    match verb {
        "IMOV" | "EIMOVL" | "EIMOVC" => {
            scan.warn(
                line,
                verb,
                "a relative motion is left as it is",
                "start it from a compensated position, and keep it short",
            );
        }
        "SFTON" | "MSHIFT" => {
            let reason = "positions are shifted at run time; they are compensated for where they stand without it";
            scan.warn(line, verb, reason, "write out the positions that are to be compensated");
        }
        "MFRAME" | "SETTOOL" => {
            let (frame, list, key) =
                if verb == "MFRAME" { (Frame::Base, "UF#(", "USER") } else { (Frame::Tool, "TL#(", "TOOL") };
            let number = body.split_once(list).and_then(|(_, rest)| rest.split(')').next()).unwrap_or_default();
            let name = Name::new(format!("{key} {number}"), format!("{key} {number}"));
            scan.settings.push(Setting { line, frame, name, stands: Stands::Computed });
        }
        _ if MOTIONS.contains(&verb) => {
            let beside = names(body, &["BC", "EC", "BP", "EX"]);
            for name in &arm {
                uses.axes.entry(name.clone()).or_default().extend(beside.iter().cloned());
                uses.moved.push((line, name.clone()));
            }
            if arm.is_empty() {
                let reason = "the motion goes to a position that is computed at run time";
                scan.warn(
                    line,
                    body.chars().take(40).collect::<String>(),
                    reason,
                    "write the position out, if it is to be compensated",
                );
            }
        }
        _ if SETTING.contains(&verb) => {
            if let Some(name) = arm.first().filter(|name| name.starts_with('P')) {
                scan.tell_computed(line, name.as_str());
                uses.set.insert(name.clone());
            }
        }
        _ => {}
    }
}
