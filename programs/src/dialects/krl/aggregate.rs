//! KRL's aggregates `{X 1,Y 2,...}`.

use std::ops::Range;

use crate::numbers::{Meaning, meaning};
use crate::scan::{Brackets, Configuration, Layout, Number, Position, Scan, Text, is_of_name};
use calibench::robot::Pose;

pub const POSE: [&str; 6] = ["X", "Y", "Z", "A", "B", "C"];
pub const AXES: [&str; 6] = ["A1", "A2", "A3", "A4", "A5", "A6"];
/// External axes.
const EXTERNAL: [&str; 6] = ["E1", "E2", "E3", "E4", "E5", "E6"];

/// Fields of an aggregate, with the place of each value.
pub struct Aggregate {
    fields: Vec<(String, Range<usize>)>,
}

impl Aggregate {
    pub fn parse(text: &Text, pair: Brackets) -> Self {
        let mut inside = pair.inside();
        let prefix = text.capitals(inside.clone());
        // `{E6POS: X 1, ...}`: the type stands before a colon.
        if let Some((kind, _)) = prefix.split_once(':').filter(|(kind, _)| kind.trim().bytes().all(is_of_name)) {
            inside.start = text.trimmed(inside.clone()).start + kind.len() + 1;
        }
        let field = |part: Range<usize>| {
            let part = text.trimmed(part);
            let name = text.bytes()[part.clone()].iter().take_while(|b| is_of_name(**b)).count();
            (text.capitals(part.start..part.start + name), part.start + name..part.end)
        };
        Aggregate { fields: text.parts(inside).into_iter().map(field).collect() }
    }

    pub fn of(&self, name: &str) -> Option<Range<usize>> {
        self.fields.iter().find(|(field, _)| field == name).map(|(_, at)| at.clone())
    }

    fn has_any(&self, names: &[&str]) -> bool {
        names.iter().any(|name| self.of(name).is_some())
    }

    /// True if it can be a frame or a position: it has fields of one of them alone, and no other field.
    pub fn is_place(&self) -> bool {
        let known = |name: &str| [&POSE[..], &AXES, &EXTERNAL, &["S", "T"]].concat().contains(&name);
        self.has_any(&POSE) != self.has_any(&AXES) && self.fields.iter().all(|(name, _)| known(name))
    }

    pub fn has_axes(&self) -> bool {
        self.has_any(&AXES)
    }

    pub fn has_status(&self) -> bool {
        self.has_any(&["S", "T"])
    }

    fn numbers(&self, text: &Text, names: &[&str]) -> Option<Vec<Number>> {
        names.iter().map(|name| text.number(self.of(name)?)).collect()
    }

    /// The frame that it writes out.
    pub fn frame(&self, text: &Text) -> Option<Pose> {
        let values: Vec<f64> = self.numbers(text, &POSE)?.iter().map(|n| n.value).collect();
        match meaning(Layout::KukaFrame, &values) {
            Ok(Meaning::Pose(pose)) => Some(pose),
            _ => None,
        }
    }

    /// The position that it writes out; told where it cannot be read.
    pub fn position(&self, text: &Text, line: usize, name: &str, scan: &mut Scan) -> Option<Position> {
        let mut names: Vec<&str> = self.fields.iter().map(|(name, _)| name.as_str()).collect();
        names.sort_unstable();
        if let Some([twice, _]) = names.windows(2).find(|pair| pair[0] == pair[1]) {
            scan.unreadable(line, name, &format!("it has {twice} twice"), "write every field once");
            return None;
        }
        let axes = self.has_axes();
        let Some(numbers) = self.numbers(text, if axes { &AXES } else { &POSE }) else {
            let reason = "it does not give all six numbers, or not as plain numbers";
            scan.unreadable(line, name, reason, "write all of X, Y, Z, A, B, C, or all of A1 ... A6");
            return None;
        };
        let bit = |field: &str| self.of(field).map(|at| bits(text, at).ok_or(()));
        let configuration = match (bit("S").transpose(), bit("T").transpose()) {
            _ if axes => Configuration::Any,
            (Ok(status), Ok(turn)) => Configuration::Kuka { status, turn },
            _ => Configuration::Unreadable,
        };
        if let Configuration::Kuka { status: Some(status), .. } = &configuration
            && status.value as i64 & 16 != 0
        {
            let reason = "it was taught with the controller's own absolute accuracy on (bit 4 of S)";
            scan.warn(line, name, reason, "switch absolute accuracy off for programs that calibench rewrites");
        }
        let layout = if axes { Layout::Degrees } else { Layout::KukaFrame };
        let away = EXTERNAL.iter().find_map(|name| {
            let at = self.of(name)?;
            let stands = text.number(at.clone()).is_some_and(|n| n.value == 0.0);
            (!stands).then(|| format!("{name} {}", text.words(at)))
        });
        Some(Position { configuration, external: away, ..Position::new(line, name, layout, numbers) })
    }
}

/// A decimal whole number, or KRL's `'B010'`, `'H1F'`.
fn bits(text: &Text, at: Range<usize>) -> Option<Number> {
    let at = text.trimmed(at);
    let words = text.capitals(at.clone());
    let value = match words.strip_prefix('\'').and_then(|w| w.strip_suffix('\'')) {
        Some(quoted) => {
            let (radix, digits) = quoted.strip_prefix('B').map(|d| (2, d)).or(quoted.strip_prefix('H').map(|d| (16, d)))?;
            u16::from_str_radix(digits, radix).ok()?
        }
        None => words.parse().ok()?,
    };
    Some(Number { at, value: f64::from(value) })
}
