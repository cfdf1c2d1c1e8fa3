//! Tools of URScript: `set_tcp`, and `tcp` of `get_inverse_kin`.

use std::collections::HashMap;
use std::ops::Range;

use super::calls::{Call, Literal, argument, assigned, literals, target, value_of};
use crate::numbers::{Meaning, meaning};
use crate::scan::{Frame, Layout, Name, Setting, Stands, Text, is_name};

/// The place of the tool that a call states: the argument of `set_tcp`, or `tcp` of `get_inverse_kin`.
fn place(text: &Text, call: &Call) -> Option<Range<usize>> {
    let place = match call.name.as_str() {
        "set_tcp" => value_of(text, call.arguments.first()?),
        // Behind the pose, the joints near it and the two greatest errors.
        "get_inverse_kin" => argument(text, call, 4, "tcp")?,
        _ => return None,
    };
    // A string, as "active_tcp", is blank.
    Some(place).filter(|at| !at.is_empty())
}

/// The tool that a call states: numbers, or the name of a variable.
pub fn tool_of(text: &Text, call: &Call) -> Option<Name> {
    let words = text.words(place(text, call)?);
    let tight: String = words.chars().filter(|c| !c.is_whitespace()).collect();
    let short: String = tight.chars().take(60).collect();
    let shown = if call.name == "set_tcp" { format!("set_tcp({short})") } else { format!("tcp={short}") };
    Some(if is_name(&tight) { Name::new(tight.clone(), tight) } else { Name::new(tight, shown) })
}

/// The tools that a file writes out.
pub fn tools(text: &Text, calls: &[Call]) -> Vec<Setting> {
    let pose = |literal: &Literal| {
        let values: Vec<f64> = text.numbers(literal.inside.clone())?.iter().map(|n| n.value).collect();
        match meaning(Layout::UrPose, &values) {
            Ok(Meaning::Pose(pose)) => Some(pose),
            _ => None,
        }
    };
    let literals: Vec<Literal> = literals(text).into_iter().filter(|literal| literal.is_pose).collect();
    let by_start: HashMap<usize, &Literal> = literals.iter().map(|literal| (literal.at.start, literal)).collect();
    let set = calls.iter().filter_map(|call| {
        let name = tool_of(text, call).filter(|name| !is_name(&name.key))?;
        let value = place(text, call)?;
        let written = by_start.get(&value.start).filter(|literal| literal.at == value).and_then(|literal| pose(literal));
        let stands = written.map_or(Stands::Computed, Stands::At);
        Some(Setting { line: text.line(call.at), frame: Frame::Tool, name, stands })
    });
    let named = literals.iter().filter_map(|literal| {
        let name = assigned(text, literal.at.start)?;
        let stands = pose(literal).map_or(Stands::Computed, Stands::At);
        Some(Setting { line: text.line(literal.at.start), frame: Frame::Tool, name: Name::new(name.clone(), name), stands })
    });
    let set_later = text.lines().enumerate().filter_map(|(k, at)| {
        let target = target(&text.words(at))?;
        let is_new = !target.is_literal || !target.index.is_empty();
        let name = Name::new(target.name.clone(), target.name);
        is_new.then_some(Setting { line: k + 1, frame: Frame::Tool, name, stands: Stands::Computed })
    });
    set.chain(named).chain(set_later).collect()
}
