//! Tools and work objects of RAPID.

use std::ops::Range;

use super::statement::Statement;
use crate::numbers::{Meaning, meaning};
use crate::scan::{Frame, Layout, Name, Scan, Setting, Stands, Text};

/// The reason why work in the hand cannot be compensated for.
const IN_HAND: &str = "the robot holds the work and the tool stands";
/// The reason why a work object that moves cannot be compensated for.
const MOVES: &str = "a mechanical unit carries the work (ufprog is FALSE), and its frame moves";

/// `PERS tooldata gun:=[TRUE,[[x,y,z],[q]],...]` and work objects, and what sets one at run time.
pub fn frames(text: &Text, statement: &Statement, line: usize, scan: &mut Scan) {
    let Some((name, _)) = statement.target().filter(|(_, component)| component.is_empty()) else { return };
    let Some(sign) = text.bytes()[statement.at.clone()].windows(2).position(|w| w == b":=") else { return };
    let right = text.trimmed(statement.at.start + sign + 2..statement.at.end);
    let shown = text.words(statement.at.start..statement.at.start + sign);
    let shown = shown.split_whitespace().last().unwrap_or("").to_owned();
    let bytes = &text.bytes()[right.clone()];
    if !bytes.starts_with(b"[") {
        // Which kind it has is known to the motions that use it.
        for frame in [Frame::Tool, Frame::Base] {
            scan.settings.push(Setting { line, frame, name: Name::new(name.clone(), shown.clone()), stands: Stands::Computed });
        }
        return;
    }
    let parts = text.parts(inside(&right));
    let is = |k: usize, word: &str| parts.get(k).is_some_and(|at| text.capitals(at.clone()) == word);
    let frame = |k: usize| {
        let part = text.trimmed(parts.get(k)?.clone());
        let inner = text.parts(inside(&part));
        let list = |at: &Range<usize>| {
            let at = text.trimmed(at.clone());
            text.numbers(inside(&at))
        };
        let values: Vec<f64> = [list(inner.first()?)?, list(inner.get(1)?)?].concat().iter().map(|n| n.value).collect();
        match meaning(Layout::AbbTarget, &values) {
            Ok(Meaning::Pose(pose)) => Some(pose),
            _ => None,
        }
    };
    // [robhold, tframe, tload] and [robhold, ufprog, ufmec, uframe, oframe]
    let (of, stands) = match parts.len() {
        3 if is(0, "TRUE") => (Frame::Tool, frame(1).map_or(Stands::Computed, Stands::At)),
        3 if is(0, "FALSE") => (Frame::Tool, Stands::Not(IN_HAND.into())),
        5 if is(0, "TRUE") => (Frame::Base, Stands::Not(IN_HAND.into())),
        5 if is(0, "FALSE") && is(1, "FALSE") => (Frame::Base, Stands::Not(MOVES.into())),
        5 if is(0, "FALSE") => (Frame::Base, frame(3).zip(frame(4)).map_or(Stands::Computed, |(u, o)| Stands::At(u * o))),
        _ => return,
    };
    scan.settings.push(Setting { line, frame: of, name: Name::new(name, shown), stands });
}

/// What stands between the brackets of a place, which is empty at the end of a program that breaks off.
fn inside(at: &Range<usize>) -> Range<usize> {
    let end = at.end.saturating_sub(1).max(at.start);
    (at.start + 1).min(end)..end
}
