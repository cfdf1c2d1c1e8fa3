//! URScript: `.script`.

use std::collections::{HashMap, HashSet};
use std::ops::Range;

use super::numbers::{Meaning, meaning};
use super::scan::{Brackets, Configuration, Frame, Layout, Marks, Position, Scan, Setting, Text, is_name, is_of_name};

pub(super) const MARKS: Marks = Marks { comment: b"#", quotes: b"\"" };

/// Motions, and how many of their first arguments are positions.
const MOTIONS: [(&str, usize); 6] = [("movej", 1), ("movel", 1), ("movep", 1), ("movec", 2), ("servoj", 1), ("servoc", 1)];
/// Functions of positions whose value depends on a literal in them.
const ARITHMETIC: [&str; 8] = [
    "pose_trans",
    "pose_add",
    "pose_sub",
    "pose_inv",
    "interpolate_pose",
    "get_actual_tcp_pose",
    "get_target_tcp_pose",
    "get_forward_kin",
];

/// A bracketed list: six values, or a pose.
struct Literal {
    at: Range<usize>,
    inside: Range<usize>,
    is_pose: bool,
}

/// A call: its name and its arguments.
struct Call {
    name: String,
    at: usize,
    close: usize,
    arguments: Vec<Range<usize>>,
}

/// Names of all files that are moved to, or computed with.
#[derive(Default)]
struct Uses {
    moved: HashSet<String>,
    computed: HashSet<String>,
    /// Lists of joints by name.
    joints: HashMap<String, Vec<f64>>,
    /// Names with a literal.
    written: HashSet<String>,
    /// Poses with the list near which the controller looks for their joints.
    near: HashMap<String, String>,
}

pub(super) fn scan(texts: &[Text]) -> Vec<Scan> {
    let mut uses = Uses::default();
    for text in texts {
        uses.see(text);
    }
    texts.iter().map(|text| scan_file(text, &uses)).collect()
}

fn calls(text: &Text) -> Vec<Call> {
    let of = |pair: Brackets| {
        let name = text.name_before(pair.open);
        let arguments = text.parts(pair.inside());
        Call { name: text.words(name.clone()), at: name.start, close: pair.close, arguments }
    };
    text.brackets(*b"()", None).into_iter().map(of).filter(|call| is_name(&call.name)).collect()
}

fn literals(text: &Text) -> Vec<Literal> {
    let of = |pair: Brackets| {
        let bytes = text.bytes();
        let p = pair.open.checked_sub(1).filter(|k| bytes[*k] == b'p');
        let is_pose = p.is_some_and(|k| k == 0 || !is_of_name(bytes[k - 1]));
        // An index: name[2].
        let is_index = !is_pose && p.or(pair.open.checked_sub(1)).is_some_and(|k| is_of_name(bytes[k]) || bytes[k] == b']');
        let at = if is_pose { pair.open - 1 } else { pair.open }..pair.close + 1;
        (!is_index && text.parts(pair.inside()).len() == 6).then(|| Literal { at, inside: pair.inside(), is_pose })
    };
    text.brackets(*b"[]", None).into_iter().filter_map(of).collect()
}

/// The value of an argument: all of it, or what follows `name =`.
fn value_of(text: &Text, argument: &Range<usize>) -> Range<usize> {
    let at = text.trimmed(argument.clone());
    let name = text.bytes()[at.clone()].iter().take_while(|b| is_of_name(**b)).count();
    let rest = text.trimmed(at.start + name..at.end);
    let is_keyword = name > 0 && text.bytes()[rest.clone()].starts_with(b"=") && !text.bytes()[rest.clone()].starts_with(b"==");
    if is_keyword { text.trimmed(rest.start + 1..rest.end) } else { at }
}

/// The name on the left of `=` before a place, on its line.
fn assigned(text: &Text, at: usize) -> Option<String> {
    let before = text.trimmed(0..at).end;
    let equals = before.checked_sub(1).filter(|k| text.bytes()[*k] == b'=')?;
    if equals > 0 && b"=!<>".contains(&text.bytes()[equals - 1]) {
        return None;
    }
    let name = text.words(text.name_before(equals));
    is_name(&name).then_some(name)
}

fn motion(name: &str) -> Option<usize> {
    MOTIONS.iter().find(|(motion, _)| *motion == name).map(|(_, count)| *count)
}

/// Number of leading arguments of a call that are positions the arm moves to.
fn positions_of(name: &str) -> usize {
    motion(name).or((name == "get_inverse_kin").then_some(1)).unwrap_or(0)
}

impl Uses {
    fn see(&mut self, text: &Text) {
        for call in calls(text) {
            for argument in call.arguments.iter().take(positions_of(&call.name)) {
                let name = text.words(value_of(text, argument));
                if is_name(&name) {
                    self.moved.insert(name);
                }
            }
            if let ("get_inverse_kin", [pose, near, ..]) = (&call.name[..], &call.arguments[..]) {
                let near = value_of(text, near);
                if text.bytes()[near.clone()].starts_with(b"[")
                    && let Some(numbers) = text.numbers(near.start + 1..near.end.saturating_sub(1).max(near.start + 1))
                {
                    self.joints.insert(text.words(near.clone()), numbers.iter().map(|n| n.value).collect());
                }
                self.near.insert(text.words(value_of(text, pose)), text.words(near));
            }
            if ARITHMETIC.contains(&call.name.as_str()) {
                let arguments = call.arguments.iter().map(|argument| text.words(argument.clone()));
                self.computed.extend(arguments.filter(|name| is_name(name)));
            }
        }
        for literal in literals(text) {
            let Some(name) = assigned(text, literal.at.start) else { continue };
            if let (false, Some(numbers)) = (literal.is_pose, text.numbers(literal.inside)) {
                self.joints.insert(name.clone(), numbers.iter().map(|n| n.value).collect());
            }
            self.written.insert(name);
        }
    }

    /// Joints near which the controller looks for those of a pose of this name.
    fn near_of(&self, name: &str) -> Option<&Vec<f64>> {
        self.joints.get(self.near.get(name)?)
    }
}

fn scan_file(text: &Text, uses: &Uses) -> Scan {
    let mut scan = Scan::default();
    let calls = calls(text);
    for literal in literals(text) {
        // The innermost call around it.
        let around = calls.iter().filter(|c| c.at <= literal.at.start && literal.at.end <= c.close).max_by_key(|c| c.at);
        let line = text.line(literal.at.start);
        let Some(call) = around else {
            if let Some(name) = assigned(text, literal.at.start).filter(|name| uses.moved.contains(name)) {
                if uses.computed.contains(&name) {
                    let reason = "poses are computed from it too, which change with it";
                    scan.warn(line, name.as_str(), reason, "write out the poses that are to be compensated");
                }
                position(text, &literal, name, uses, &mut scan);
            }
            continue;
        };
        let argument = call.arguments.iter().position(|a| value_of(text, a) == literal.at);
        if argument.is_some_and(|k| k < positions_of(&call.name)) {
            position(text, &literal, call.name.clone(), uses, &mut scan);
        } else if call.name == "set_tcp" {
            let values: Vec<f64> = text.numbers(literal.inside.clone()).iter().flatten().map(|n| n.value).collect();
            match meaning(Layout::UrPose, &values) {
                Ok(Meaning::Pose(pose)) => scan.settings.push(Setting { line, frame: Frame::Tool, pose }),
                _ => scan.warn(line, "set_tcp", "its numbers are computed", "check that it is the tool given here"),
            }
        }
    }
    calls.iter().for_each(|call| depends(text, call, uses, &mut scan));
    computed(text, uses, &mut scan);
    scan
}

/// Motions to something that is not written out.
fn depends(text: &Text, call: &Call, uses: &Uses, scan: &mut Scan) {
    let line = text.line(call.at);
    for argument in call.arguments.iter().take(motion(&call.name).unwrap_or(0)) {
        let words = text.words(value_of(text, argument));
        let literal = words.starts_with("p[") || words.starts_with('[');
        if literal || words.is_empty() || uses.written.contains(&words) || words.starts_with("get_inverse_kin") {
            continue;
        }
        let remedy = "write the position out, if it is to be compensated";
        let what: String = format!("{} {words}", call.name).chars().take(60).collect();
        scan.warn(line, what, "the motion goes to a position computed at run time", remedy);
    }
}

/// Names that are moved to and computed.
fn computed(text: &Text, uses: &Uses, scan: &mut Scan) {
    for (k, at) in text.lines().enumerate() {
        let words = text.words(at);
        let Some((left, right)) = words.split_once('=') else { continue };
        let name = left.split_whitespace().last().unwrap_or("");
        let right = right.trim_start();
        if uses.moved.contains(name) && !right.starts_with("p[") && !right.starts_with('[') && !right.starts_with('=') {
            let remedy = "write the position out, if it is to be compensated";
            scan.warn(k + 1, name, "it is computed at run time, and a motion goes there", remedy);
        }
    }
}

fn position(text: &Text, literal: &Literal, name: String, uses: &Uses, scan: &mut Scan) {
    let line = text.line(literal.at.start);
    let Some(numbers) = text.numbers(literal.inside.clone()) else {
        let reason = "its six numbers are not all written out";
        return scan.unreadable(line, name, reason, "write plain numbers, in metres and radians");
    };
    let layout = if literal.is_pose { Layout::UrPose } else { Layout::Radians };
    let near = uses.near_of(&name).or_else(|| uses.near_of(&text.words(literal.at.clone()))).filter(|_| literal.is_pose);
    let configuration = near.map_or(Configuration::Any, |q| Configuration::Near(q.clone()));
    scan.positions.push(Position { line, name, layout, numbers, configuration });
}
