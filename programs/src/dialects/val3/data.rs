//! The data of VAL 3: `<Data name="pPlace" ... type="pointRx"> <Value key="0" x="1.5" ... fatherId="fTable[0]"/>`.

use std::ops::Range;

use crate::numbers::{Meaning, meaning};
use crate::scan::{Configuration, Layout, Number, Scan, Text};
use calibench::robot::Pose;

/// Kind of a value.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// A pose in its father, a frame.
    Point,
    /// Joints.
    Joints,
    /// A frame on its father, another one or the world.
    Frame,
    /// A tool on its father, another one or the flange.
    Tool,
}

impl Kind {
    fn of(word: &str) -> Option<Kind> {
        Some(match word {
            "pointRx" | "point" => Kind::Point,
            "jointRx" | "joint" => Kind::Joints,
            "frame" => Kind::Frame,
            "tool" => Kind::Tool,
            _ => return None,
        })
    }

    pub fn layout(self) -> Layout {
        if self == Kind::Joints { Layout::ValJoints } else { Layout::ValPose }
    }
}

/// A value of one of the kinds above.
pub struct Value {
    /// `pPlace`, or `pPlace[2]`.
    pub name: String,
    pub kind: Kind,
    pub line: usize,
    /// Its numbers in the order of its layout; one that is left out is zero and has an empty place. `None` if one is not a number.
    pub numbers: Option<Vec<Number>>,
    /// Its father, without index if that is zero; empty if none is written.
    pub father: String,
    pub configuration: Configuration,
}

impl Value {
    /// Its pose in its father.
    pub fn pose(&self) -> Option<Pose> {
        let values: Vec<f64> = self.numbers.as_ref()?.iter().map(|n| n.value).collect();
        match meaning(Layout::ValPose, &values) {
            Ok(Meaning::Pose(pose)) => Some(pose),
            _ => None,
        }
    }
}

/// A name without its index.
pub fn root_of(name: &str) -> &str {
    name.split('[').next().unwrap_or(name).trim()
}

/// A name as it is compared: the first element of a list has none.
pub fn key_of(words: &str) -> String {
    let tight: String = words.chars().filter(|c| !c.is_whitespace()).collect();
    tight.strip_suffix("[0]").map_or(tight.clone(), str::to_owned)
}

/// Places in a file between which nothing is read.
const COMMENT: [&[u8]; 2] = [b"<!--", b"-->"];

fn find(text: &Text, from: usize, what: &[u8]) -> Option<usize> {
    text.bytes().get(from..)?.windows(what.len()).position(|w| w == what).map(|k| from + k)
}

/// The tags of a file, without comments: each from `<` to `>`.
fn tags(text: &Text) -> Vec<Range<usize>> {
    let mut tags = Vec::new();
    let mut from = 0;
    while let Some(open) = find(text, from, b"<") {
        let is_comment = text.bytes()[open..].starts_with(COMMENT[0]);
        let end = if is_comment { COMMENT[1] } else { b">" };
        let Some(close) = find(text, open, end) else { break };
        // A name follows at once.
        if !is_comment && text.bytes().get(open + 1).is_some_and(|b| b.is_ascii_alphabetic() || *b == b'/') {
            tags.push(open..close);
        }
        from = close + 1;
    }
    tags
}

fn is_tag(head: &str, name: &str) -> bool {
    head.strip_prefix(name).is_some_and(|rest| rest.starts_with(char::is_whitespace))
}

/// The place of an attribute's value, between its quotes.
fn attribute(text: &Text, tag: &Range<usize>, key: &str) -> Option<Range<usize>> {
    let mut at = tag.start;
    while at < tag.end {
        let sign = find(text, at, b"=").filter(|sign| *sign < tag.end)?;
        let open = find(text, sign, b"\"").filter(|open| *open < tag.end)?;
        let close = find(text, open + 1, b"\"").filter(|close| *close <= tag.end)?;
        let name = text.words(at..sign);
        if name.split_whitespace().last() == Some(key) {
            return Some(open + 1..close);
        }
        at = close + 1;
    }
    None
}

/// The points, joints, frames and tools of a file. What is a position of another arm or of another format is told.
pub fn values(text: &Text, scan: &mut Scan) -> Vec<Value> {
    let mut found = Vec::new();
    let mut open: Option<(String, Kind)> = None;
    for tag in tags(text) {
        let line = text.line(tag.start);
        let words = |key: &str| attribute(text, &tag, key).map(|at| text.words(at)).unwrap_or_default();
        let head = text.words(tag.start + 1..tag.end);
        if is_tag(&head, "Data") {
            let kind = words("type");
            if ["pointRs", "jointRs", "configRs", "pointCartesian"].contains(&kind.as_str()) {
                let reason = format!("{kind} is a position of another kind of arm");
                scan.unreadable(line, words("name"), &reason, "compensate programs of six-axis arms");
            }
            open = Kind::of(&kind).map(|kind| (words("name"), kind));
        } else if head.starts_with("/Data") && !head.starts_with("/Datas") && !head.starts_with("/Database") {
            open = None;
        } else if let Some((name, kind)) = open.as_ref().filter(|_| is_tag(&head, "Value")) {
            let key = words("key");
            let name = if key == "0" || key.is_empty() { name.clone() } else { format!("{name}[{key}]") };
            let place = tag.start + "<Value".len();
            let number = |key: &str| match attribute(text, &tag, key) {
                Some(at) => text.number(at),
                None => Some(Number { at: place..place, value: 0.0 }),
            };
            let numbers = kind.layout().keys().iter().map(|key| number(key)).collect();
            let side = |key: &str, plus: &str, minus: &str| {
                let word = words(key);
                if word == plus { Some(true) } else { (word == minus).then_some(false) }
            };
            let configuration = Configuration::Val3 {
                righty: side("shoulder", "righty", "lefty"),
                elbow: side("elbow", "epositive", "enegative"),
                wrist: side("wrist", "wpositive", "wnegative"),
            };
            let configuration = if *kind == Kind::Point { configuration } else { Configuration::Any };
            found.push(Value { name, kind: *kind, line, numbers, father: key_of(&words("fatherId")), configuration });
        }
    }
    found
}
