//! Calls, lists and assignments of URScript.

use std::ops::Range;

use crate::scan::{Brackets, Text, is_name, is_of_name};

/// A bracketed list: six values, or a pose.
pub struct Literal {
    pub at: Range<usize>,
    pub inside: Range<usize>,
    pub is_pose: bool,
}

/// A call: its name and its arguments.
pub struct Call {
    pub name: String,
    pub at: usize,
    pub close: usize,
    pub arguments: Vec<Range<usize>>,
}

pub fn calls(text: &Text) -> Vec<Call> {
    let of = |pair: Brackets| {
        let name = text.name_before(pair.open);
        let arguments = text.parts(pair.inside());
        Call { name: text.words(name.clone()), at: name.start, close: pair.close, arguments }
    };
    text.brackets(*b"()", None).into_iter().map(of).filter(|call| is_name(&call.name)).collect()
}

pub fn literals(text: &Text) -> Vec<Literal> {
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
pub fn value_of(text: &Text, argument: &Range<usize>) -> Range<usize> {
    keyword(text, argument).1
}

/// The keyword of an argument, empty if it has none, and its value.
pub fn keyword(text: &Text, argument: &Range<usize>) -> (String, Range<usize>) {
    let at = text.trimmed(argument.clone());
    let name = text.bytes()[at.clone()].iter().take_while(|b| is_of_name(**b)).count();
    let rest = text.trimmed(at.start + name..at.end);
    let is_keyword = name > 0 && text.bytes()[rest.clone()].starts_with(b"=") && !text.bytes()[rest.clone()].starts_with(b"==");
    if is_keyword {
        (text.words(at.start..at.start + name), text.trimmed(rest.start + 1..rest.end))
    } else {
        (String::new(), at)
    }
}

/// The value of the argument with this keyword, or of the one in this place, counted from 0, that has none.
pub fn argument(text: &Text, call: &Call, place: usize, name: &str) -> Option<Range<usize>> {
    let mut all = call.arguments.iter().map(|argument| keyword(text, argument));
    let named = all.clone().find(|(key, _)| key == name);
    named.or_else(|| all.nth(place).filter(|(key, _)| key.is_empty())).map(|(_, value)| value)
}

/// The name on the left of `=` before a place, on its line.
pub fn assigned(text: &Text, at: usize) -> Option<String> {
    let before = text.trimmed(0..at).end;
    let equals = before.checked_sub(1).filter(|k| text.bytes()[*k] == b'=')?;
    if equals > 0 && b"=!<>".contains(&text.bytes()[equals - 1]) {
        return None;
    }
    let name = text.words(text.name_before(equals));
    is_name(&name).then_some(name)
}

/// The left side of an assignment.
pub struct Target {
    pub name: String,
    /// `[2]`, where an element is set.
    pub index: String,
    /// True if a list or a pose stands on the right.
    pub is_literal: bool,
}

pub fn target(line: &str) -> Option<Target> {
    let sign = line.char_indices().position(|(k, c)| {
        let beside = |k: Option<usize>| k.and_then(|k| line.as_bytes().get(k)).is_some_and(|b| b"=!<>".contains(b));
        c == '=' && !beside(k.checked_sub(1)) && !beside(Some(k + 1))
    })?;
    let sign = line.char_indices().nth(sign)?.0;
    let left = line[..sign].trim();
    let (left, index) = left.find('[').map_or((left, ""), |k| (left[..k].trim(), &left[k..]));
    let name = left.split_whitespace().last()?;
    let right = line[sign + 1..].trim_start();
    let before = left.strip_suffix(name)?.trim();
    // Keywords of a call (a=1.2) stand behind a bracket; a declaration has one word before the name.
    (is_name(name) && matches!(before, "" | "global" | "local")).then(|| Target {
        name: name.into(),
        index: index.into(),
        is_literal: right.starts_with("p[") || right.starts_with('['),
    })
}
