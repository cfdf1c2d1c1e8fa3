//! Listings of FANUC's system frames.

use std::collections::HashMap;

use crate::numbers::{Meaning, meaning};
use crate::scan::{Frame, Layout, Name, Setting, Stands};

/// A number of a listing that cannot be read.
pub struct Garbled {
    /// Line, counted from 1.
    pub line: usize,
    /// The frame and the letter of the number.
    pub field: String,
}

/// The frames of a listing of system variables: of `$MNUTOOL` and `$MNUFRAME` those of group 1; one that was never set, with
/// asterisks or the word Uninit in place of numbers, is left out.
///
/// # Errors
/// When a number of a frame is not one.
pub fn listed(text: &str) -> Result<Vec<Setting>, Garbled> {
    let mut found = Vec::new();
    let mut list: Option<(Frame, &str)> = None;
    let mut element: Option<(usize, String)> = None;
    let mut values: HashMap<char, f64> = HashMap::new();
    for (k, line) in text.lines().enumerate() {
        let capitals = line.to_ascii_uppercase();
        if capitals.contains('$') {
            let of = |name: &str| {
                capitals.split_once(name).filter(|(_, rest)| !rest.starts_with(|c: char| c.is_ascii_alphanumeric()))
            };
            let is = |name: &str| of(name).is_some();
            list = if is("$MNUFRAME") {
                Some((Frame::Base, "UF"))
            } else if is("$MNUTOOL") {
                Some((Frame::Tool, "UT"))
            } else {
                None
            };
            element = None;
        }
        let Some((frame, key)) = list else { continue };
        // `[1,6] =` and `$MNUFRAME[1,6] =`: group and number; the size of the list stands without a sign.
        if let Some((before, _)) = capitals.split_once('=')
            && let Some((_, index)) = before.trim_end().strip_suffix(']').and_then(|b| b.rsplit_once('['))
        {
            let numbers: Vec<&str> = index.split(',').map(str::trim).collect();
            element = match numbers[..] {
                ["1", number] | [number] => Some((k + 1, number.to_owned())),
                _ => None,
            };
            values.clear();
        }
        let Some((line, number)) = &element else { continue };
        let mut rest = capitals.as_str();
        while let Some((before, after)) = rest.split_once(':') {
            let after = after.trim_start();
            let length = after.bytes().take_while(|b| b.is_ascii_digit() || b"+-.E".contains(b)).count();
            let name = before.trim_end().chars().next_back();
            let is_alone = before.trim_end().chars().rev().nth(1).is_none_or(char::is_whitespace);
            if let (Some(name @ ('X' | 'Y' | 'Z' | 'W' | 'P' | 'R')), true) = (name, is_alone) {
                match after[..length].parse::<f64>().ok().filter(|value| value.is_finite()) {
                    Some(value) => _ = values.insert(name, value),
                    None if after.starts_with(['*', 'U']) => {}
                    None => return Err(Garbled { line: k + 1, field: format!("{key} {number}: {name}") }),
                }
            }
            rest = &after[length..];
        }
        let all: Option<Vec<f64>> = ['X', 'Y', 'Z', 'W', 'P', 'R'].iter().map(|name| values.get(name).copied()).collect();
        if let Some(Ok(Meaning::Pose(pose))) = all.map(|all| meaning(Layout::FanucPose, &all)) {
            let name = format!("{key} {number}");
            found.push(Setting { line: *line, frame, name: Name::new(name.clone(), name), stands: Stands::At(pose) });
            element = None;
        }
    }
    Ok(found)
}
