//! URScript: `.script`.

mod calls;
mod tools;

use std::collections::{BTreeSet, HashMap, HashSet};

use crate::flow::{Step, follow};
use crate::scan::{Configuration, Frame, Layout, Marks, Name, Position, Scan, Source, Text, WRITE_OUT, is_name};
use calls::{Call, Literal, argument, assigned, calls, literals, target, value_of};
use tools::{tool_of, tools};

pub const MARKS: Marks = Marks { comment: b"#", quotes: b"\"" };

/// Motions, and how many of their first arguments are positions.
const MOTIONS: [(&str, usize); 8] =
    [("movej", 1), ("movel", 1), ("movep", 1), ("movec", 2), ("servoj", 1), ("servoc", 1), ("optimovej", 1), ("optimovel", 1)];
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
    /// Of which single numbers are set at run time.
    parts: HashSet<String>,
    /// Set as a whole at run time.
    set: HashSet<String>,
    /// Numbers of positions: by name, or by file and place.
    numbers: HashMap<String, usize>,
    /// Tools in which positions are used, by number.
    frames: HashMap<usize, [BTreeSet<Name>; 2]>,
}

pub fn scan(sources: &[Source]) -> Vec<Scan> {
    let mut uses = Uses::default();
    for source in sources {
        uses.see(&source.text);
    }
    let mut steps = Vec::new();
    for source in sources {
        uses.steps(source, &mut steps);
    }
    uses.frames = follow(&steps);
    sources.iter().map(|source| scan_file(source, &uses)).collect()
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
            if call.name == "get_inverse_kin"
                && let (Some(pose), Some(near)) = (argument(text, &call, 0, "x"), argument(text, &call, 1, "qnear"))
            {
                if text.bytes()[near.clone()].starts_with(b"[")
                    && let Some(numbers) = text.numbers(near.start + 1..near.end.saturating_sub(1).max(near.start + 1))
                {
                    self.joints.insert(text.words(near.clone()), numbers.iter().map(|n| n.value).collect());
                }
                self.near.insert(text.words(pose), text.words(near));
            }
            if ARITHMETIC.contains(&call.name.as_str()) {
                let arguments = call.arguments.iter().map(|argument| text.words(argument.clone()));
                self.computed.extend(arguments.filter(|name| is_name(name)));
            }
        }
        for at in text.lines() {
            match target(&text.words(at)) {
                Some(target) if !target.index.is_empty() => self.parts.insert(target.name),
                Some(target) if !target.is_literal => self.set.insert(target.name),
                _ => continue,
            };
        }
        for literal in literals(text) {
            let Some(name) = assigned(text, literal.at.start) else { continue };
            if let (false, Some(numbers)) = (literal.is_pose, text.numbers(literal.inside)) {
                self.joints.insert(name.clone(), numbers.iter().map(|n| n.value).collect());
            }
            self.written.insert(name);
        }
    }

    /// What the statements of a file do to the tool, and which positions they use.
    fn steps(&mut self, source: &Source, steps: &mut Vec<Step>) {
        let text = &source.text;
        let mut calls = calls(text).into_iter().peekable();
        // What every `end` ends.
        let mut open: Vec<Step> = Vec::new();
        for at in text.lines() {
            let words = text.words(at.clone());
            let first: String = words.chars().take_while(char::is_ascii_alphanumeric).collect();
            let name = || words.split_whitespace().nth(1).and_then(|w| w.split('(').next()).unwrap_or("").to_owned();
            match first.as_str() {
                "def" | "thread" => {
                    steps.push(Step::Begin(name()));
                    open.push(Step::End);
                }
                "sec" if words.split_whitespace().count() > 1 => {
                    steps.push(Step::Begin(name()));
                    open.push(Step::End);
                }
                "if" => {
                    steps.push(Step::Branch { is_side: true });
                    open.push(Step::Join);
                }
                "elif" => steps.push(Step::Other { is_last: false }),
                "else" => steps.push(Step::Other { is_last: true }),
                "while" => {
                    steps.push(Step::Loop);
                    open.push(Step::Again);
                }
                "end" => steps.extend(open.pop()),
                "return" | "halt" => steps.push(Step::Leave),
                _ => {}
            }
            let is_head = matches!(first.as_str(), "def" | "thread" | "sec");
            while let Some(call) = calls.next_if(|call| call.at < at.end.max(at.start + 1)) {
                if call.name == "set_tcp" {
                    steps.extend(tool_of(text, &call).map(|name| Step::Set(Frame::Tool, name)));
                } else if !is_head && positions_of(&call.name) == 0 {
                    steps.push(Step::Call(call.name.clone()));
                }
                for argument in call.arguments.iter().take(positions_of(&call.name)) {
                    let value = value_of(text, argument);
                    let words = text.words(value.clone());
                    let key = if is_name(&words) { words } else { format!("{}:{}", source.file, value.start) };
                    let next = self.numbers.len();
                    let number = *self.numbers.entry(key).or_insert(next);
                    let own = tool_of(text, &call).filter(|_| call.name == "get_inverse_kin");
                    steps.push(Step::Use(number, [own, None]));
                }
            }
        }
    }

    fn frames_of(&self, key: &str) -> [BTreeSet<Name>; 2] {
        self.numbers.get(key).and_then(|number| self.frames.get(number)).cloned().unwrap_or_default()
    }

    /// Joints near which the controller looks for those of a pose of this name.
    fn near_of(&self, name: &str) -> Option<&Vec<f64>> {
        self.joints.get(self.near.get(name)?)
    }
}

fn scan_file(source: &Source, uses: &Uses) -> Scan {
    let text = &source.text;
    let calls = calls(text);
    let mut scan = Scan { settings: tools(text, &calls), ..Scan::default() };
    let mut next = calls.iter().peekable();
    // Calls that are open at a literal; both come in the order of their beginnings, so that dense paths take no longer a point.
    let mut open: Vec<&Call> = Vec::new();
    for literal in literals(text) {
        while let Some(call) = next.next_if(|call| call.at <= literal.at.start) {
            open.push(call);
        }
        while open.pop_if(|call| call.close < literal.at.end).is_some() {}
        let around = open.last().copied();
        let line = text.line(literal.at.start);
        let Some(call) = around else {
            if let Some(name) = assigned(text, literal.at.start).filter(|name| uses.moved.contains(name)) {
                if uses.computed.contains(&name) {
                    let reason = "poses are computed from it too, which change with it";
                    scan.warn(line, name.as_str(), reason, "write out the poses that are to be compensated");
                }
                if uses.parts.contains(&name) {
                    scan.unread += 1; // Told where the number is set.
                } else if let Some(position) = position(text, &literal, name.clone(), uses, &mut scan) {
                    let (frames, spare) = (uses.frames_of(&name), uses.set.contains(&name));
                    scan.positions.push(Position { frames, spare, ..position });
                }
            }
            continue;
        };
        let argument = call.arguments.iter().position(|a| value_of(text, a) == literal.at);
        if argument.is_some_and(|k| k < positions_of(&call.name)) {
            let key = format!("{}:{}", source.file, literal.at.start);
            if let Some(position) = position(text, &literal, call.name.clone(), uses, &mut scan) {
                scan.positions.push(Position { frames: uses.frames_of(&key), ..position });
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
    for argument in call.arguments.iter().take(positions_of(&call.name)) {
        let words = text.words(value_of(text, argument));
        let literal = words.starts_with("p[") || words.starts_with('[');
        if literal || words.is_empty() || uses.written.contains(&words) || words.starts_with("get_inverse_kin") {
            continue;
        }
        let what: String = format!("{} {words}", call.name).chars().take(60).collect();
        scan.warn(line, what, "the motion goes to a position computed at run time", WRITE_OUT);
    }
}

/// Names that are moved to and computed.
fn computed(text: &Text, uses: &Uses, scan: &mut Scan) {
    for (k, at) in text.lines().enumerate() {
        let words = text.words(at);
        let Some(target) = target(&words).filter(|target| uses.moved.contains(&target.name)) else { continue };
        if !target.index.is_empty() {
            scan.tell_set_in_part(k + 1, format!("{}{}", target.name, target.index));
        } else if !target.is_literal {
            scan.tell_computed(k + 1, target.name);
        }
    }
}

fn position(text: &Text, literal: &Literal, name: String, uses: &Uses, scan: &mut Scan) -> Option<Position> {
    let line = text.line(literal.at.start);
    let Some(numbers) = text.numbers(literal.inside.clone()) else {
        scan.unreadable(line, name, "its six numbers are not all written out", "write plain numbers, in metres and radians");
        return None;
    };
    let layout = if literal.is_pose { Layout::UrPose } else { Layout::Radians };
    let near = uses.near_of(&name).or_else(|| uses.near_of(&text.words(literal.at.clone()))).filter(|_| literal.is_pose);
    let configuration = near.map_or(Configuration::Any, |q| Configuration::Near(q.clone()));
    Some(Position { configuration, ..Position::new(line, name, layout, numbers) })
}
