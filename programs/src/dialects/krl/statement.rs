//! Statements of KRL: motions with their destinations, assignments with their targets.

use std::ops::Range;

use crate::scan::{Text, is_name, is_of_name};

/// Motions to positions, and how many they have.
const MOTIONS: [(&str, usize); 7] = [("PTP", 1), ("LIN", 1), ("CIRC", 2), ("SPTP", 1), ("SLIN", 1), ("SCIRC", 2), ("SPL", 1)];
/// Motions by a distance.
const RELATIVE: [&str; 7] = ["PTP_REL", "LIN_REL", "CIRC_REL", "SPTP_REL", "SLIN_REL", "SCIRC_REL", "SPL_REL"];
/// Blocks of splines, whose head has settings for all segments.
const BLOCKS: [&str; 2] = ["SPLINE", "PTP_SPLINE"];
/// Words with which a statement begins that compares and does not assign.
const CONDITIONAL: [&str; 10] = ["IF", "WHILE", "UNTIL", "WAIT", "SWITCH", "CASE", "FOR", "TRIGGER", "INTERRUPT", "RETURN"];

/// A statement: a line and its words.
pub struct Statement {
    pub line: usize,
    pub at: Range<usize>,
    pub words: Vec<String>,
    pub capitals: String,
}

/// Left side of an assignment, in capitals.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Target {
    /// Name without index and field.
    pub root: String,
    /// Name with its index, if it has one: `P[3]`.
    pub indexed: String,
    /// The field that is set, as `Z`; empty for the whole.
    pub field: String,
    /// Place of the right side.
    pub right: Range<usize>,
}

impl Target {
    /// True for an element whose numbers are written out, as `P[3]`.
    pub fn has_plain_index(&self) -> bool {
        let index = self.indexed.split_once('[').and_then(|(_, rest)| rest.strip_suffix(']'));
        index.is_some_and(|index| index.split(',').all(|number| number.parse::<u32>().is_ok()))
    }
}

/// Where a motion goes.
pub enum Destination {
    /// To numbers in braces at this place.
    Literal(Range<usize>),
    /// To a variable: its name without index and field, and with the index.
    Variable { root: String, indexed: String },
    /// To something of the controller's own, as `$AXIS_ACT`.
    System(String),
    /// To the result of a function.
    Function(String),
    /// To an expression, or something not understood.
    Computed,
}

pub fn statements(text: &Text) -> Vec<Statement> {
    let numbered = text.lines().enumerate().filter(|(_, at)| !at.is_empty());
    numbered
        .map(|(k, at)| {
            let capitals = text.capitals(at.clone());
            let words = capitals.split(|c: char| !c.is_ascii() || !is_of_name(c as u8)).filter(|w| !w.is_empty());
            Statement { line: k + 1, words: words.map(str::to_owned).collect(), at, capitals }
        })
        .collect()
}

/// A name with its index in one spelling, without what follows: `P [ 3 ].Z` is `P[3]`.
fn indexed(text: &str) -> String {
    let tight: String = text.chars().filter(|c| !c.is_whitespace()).collect();
    match (tight.find('['), tight.find('.')) {
        (Some(open), dot) if dot.is_none_or(|dot| dot > open) => {
            tight.find(']').map_or(tight.clone(), |close| tight[..=close].to_owned())
        }
        (_, Some(dot)) => tight[..dot].to_owned(),
        _ => tight,
    }
}

fn root(text: &str) -> String {
    text.split(['[', '.']).next().unwrap_or(text).trim().to_owned()
}

impl Statement {
    pub fn verb(&self) -> &str {
        self.words.first().map_or("", String::as_str)
    }

    /// Number of positions of a motion.
    pub fn motion(&self) -> Option<usize> {
        MOTIONS.iter().find(|(verb, _)| *verb == self.verb()).map(|(_, count)| *count).filter(|_| self.target_sign().is_none())
    }

    pub fn is_relative(&self) -> bool {
        RELATIVE.contains(&self.verb())
    }

    /// True for the head of a block of splines.
    pub fn begins_block(&self) -> bool {
        BLOCKS.contains(&self.verb()) && self.target_sign().is_none()
    }

    /// Place of the sign of an assignment that the verb itself would be the target of.
    fn target_sign(&self) -> Option<()> {
        let rest = self.capitals.strip_prefix(self.verb())?.trim_start();
        rest.starts_with('=').then_some(())
    }

    /// The target of an assignment.
    pub fn target(&self, text: &Text) -> Option<Target> {
        if self.motion().is_some() || self.begins_block() || self.is_relative() || CONDITIONAL.contains(&self.verb()) {
            return None;
        }
        let bytes = &text.bytes()[self.at.clone()];
        let mut depth = 0_usize;
        let sign = bytes.iter().enumerate().position(|(k, byte)| {
            match byte {
                b'(' | b'[' | b'{' => depth += 1,
                b')' | b']' | b'}' => depth = depth.saturating_sub(1),
                _ => {}
            }
            let beside = [k.checked_sub(1).map(|k| bytes[k]), bytes.get(k + 1).copied()];
            *byte == b'=' && depth == 0 && !beside.into_iter().flatten().any(|b| b"=<>".contains(&b))
        })?;
        let left = text.capitals(self.at.start..self.at.start + sign);
        // What stands before the name declares it; blanks within an index do not separate.
        let mut open = 0_usize;
        let from = left.char_indices().rev().find(|(_, c)| {
            match c {
                ']' => open += 1,
                '[' => open = open.saturating_sub(1),
                _ => {}
            }
            c.is_whitespace() && open == 0
        });
        let name = &left[from.map_or(0, |(k, c)| k + c.len_utf8())..];
        let name = name.trim();
        let indexed = indexed(name);
        let tight: String = name.chars().filter(|c| !c.is_whitespace()).collect();
        let field = tight.get(indexed.len()..).unwrap_or("").trim_start_matches('.').to_owned();
        let right = text.trimmed(self.at.start + sign + 1..self.at.end);
        is_name(&root(name)).then(|| Target { root: root(name), indexed, field, right })
    }

    /// Places of the destinations of a motion, and of what follows WITH.
    fn parts(&self, text: &Text) -> (Vec<Range<usize>>, Range<usize>) {
        let start = self.at.start + self.verb().len();
        let rest = text.capitals(start..self.at.end);
        let start = text.trimmed(start..self.at.end).start;
        let with = rest.match_indices("WITH").map(|(k, _)| k).find(|k| {
            let bytes = rest.as_bytes();
            let is_apart = |b: Option<&u8>| b.is_none_or(|b| !is_of_name(*b));
            is_apart(k.checked_sub(1).and_then(|k| bytes.get(k))) && is_apart(bytes.get(k + 4))
        });
        let end = with.map_or(self.at.end, |k| start + k);
        let count = self.motion().unwrap_or(1);
        let places = text.parts(start..end).into_iter().take(count).map(|at| without_blending(text, at));
        (places.collect(), with.map_or(self.at.end..self.at.end, |k| start + k + 4..self.at.end))
    }

    pub fn destinations(&self, text: &Text) -> Vec<Destination> {
        self.parts(text).0.into_iter().map(|at| destination(text, at)).collect()
    }

    /// The settings of one motion or of a block, `$TOOL = ...` and `$BASE = ...`: the right sides.
    pub fn with(&self, text: &Text) -> Vec<(String, Range<usize>)> {
        if self.motion().is_none() && !self.begins_block() {
            return Vec::new();
        }
        let parts = text.parts(self.parts(text).1).into_iter().filter_map(|part| {
            let sign = text.bytes()[part.clone()].iter().position(|b| *b == b'=')?;
            Some((text.capitals(part.start..part.start + sign), text.trimmed(part.start + sign + 1..part.end)))
        });
        parts.collect()
    }
}

/// A destination without the words C_DIS, C_PTP and the like behind it.
fn without_blending(text: &Text, at: Range<usize>) -> Range<usize> {
    let mut at = text.trimmed(at);
    loop {
        let name = text.name_before(at.end);
        if name.start <= at.start || !text.capitals(name.clone()).starts_with("C_") || name.end != at.end {
            return at;
        }
        at = text.trimmed(at.start..name.start);
    }
}

fn destination(text: &Text, at: Range<usize>) -> Destination {
    let words = text.capitals(at.clone());
    let bytes = words.as_bytes();
    let mut depth = 0_usize;
    let outside: String = words
        .chars()
        .filter(|c| {
            match c {
                '{' | '[' => depth += 1,
                '}' | ']' => depth = depth.saturating_sub(1),
                _ => return depth == 0,
            }
            false
        })
        .collect();
    let name: String = words.chars().take_while(|c| c.is_ascii() && is_of_name(*c as u8)).collect();
    if outside.contains(':') {
        Destination::Computed
    } else if bytes.first() == Some(&b'{') && outside.trim().is_empty() {
        Destination::Literal(at)
    } else if outside.contains('(') && is_name(&name) {
        Destination::Function(name)
    } else if name.starts_with('$') {
        Destination::System(words)
    } else if is_name(&name) && outside.split_whitespace().count() <= 1 {
        Destination::Variable { root: name, indexed: indexed(&words) }
    } else {
        Destination::Computed
    }
}
