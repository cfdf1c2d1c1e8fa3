//! Tools and bases of KRL: `$TOOL`, `$BASE`, TOOL_DATA, BASE_DATA, and the frame data of inline forms.

use std::collections::HashMap;
use std::ops::Range;

use super::aggregate::Aggregate;
use super::statement::{Statement, Target, statements};
use crate::flow::Step;
use crate::scan::{Brackets, Frame, Name, Setting, Source, Stands, Text, is_name};
use calibench::robot::Pose;

/// Variables that hold the frame of motions, with the lists and the fields that number them.
const FRAMES: [(Frame, &str, &str, &str); 2] =
    [(Frame::Tool, "$TOOL", "TOOL_DATA", "TOOL_NO"), (Frame::Base, "$BASE", "BASE_DATA", "BASE_NO")];
/// Frames that are none.
const NULL: [&str; 4] = ["$NULLFRAME", "NULLFRAME", "$WORLD", "$ROBROOT"];

/// Frames of an inline form, `{TOOL_NO 1,BASE_NO 2,...}`.
pub type Form = [Option<Name>; 2];

/// Frame data of inline forms by module and name.
#[derive(Default)]
pub struct Forms {
    forms: HashMap<(usize, String), Form>,
}

/// What switches a base on that external axes carry, whatever its number.
const EXTERNAL_BASE: &str = "#EX_BASE,";

/// The reason why a base that moves cannot be compensated for.
const MOVES: &str = "the base is carried by external axes";
/// The reason why work in the hand cannot be compensated for.
const IN_HAND: &str = "the robot holds the work and the tool stands (#TCP)";

/// A frame by its number; none below zero, where no number is set.
fn numbered(frame: Frame, number: i64) -> Option<Name> {
    let (_, _, list, field) = FRAMES[frame as usize];
    (number >= 0).then(|| Name::new(format!("{list}[{number}]"), format!("{field} {number}")))
}

fn number_behind(words: &str, key: &str) -> Option<i64> {
    let (_, after) = words.split_once(key)?;
    let after = after.trim_start();
    let length = after.bytes().take_while(|b| b.is_ascii_digit() || *b == b'-').count();
    after[..length].parse().ok()
}

/// The frames of `{TOOL_NO 1,BASE_NO 2,IPO_FRAME #BASE}`.
fn form(words: &str) -> Form {
    let of = |(frame, _, _, field): (Frame, &str, &str, &str)| numbered(frame, number_behind(words, field)?);
    let [tool, mut base] = FRAMES.map(of);
    if words.contains("#TCP") {
        base = Some(Name::new("#TCP", "IPO_FRAME #TCP"));
    }
    [tool, base]
}

impl Forms {
    pub fn of(sources: &[Source]) -> Self {
        let mut forms = HashMap::new();
        for source in sources {
            for statement in statements(&source.text) {
                if let Some(target) = statement.target(&source.text)
                    && target.field.is_empty()
                {
                    let words = source.text.capitals(target.right);
                    if words.starts_with('{') && (words.contains("TOOL_NO") || words.contains("BASE_NO")) {
                        forms.insert((source.module, target.indexed), form(&words));
                    }
                }
            }
        }
        Forms { forms }
    }

    /// The frames of a name in its own module, or in the only other one that has it.
    pub fn find(&self, module: usize, name: &str) -> Option<&Form> {
        let own = self.forms.get(&(module, name.to_owned()));
        let mut others = self.forms.iter().filter(|((_, other), _)| other == name).map(|(_, form)| form);
        own.or_else(|| others.next().filter(|_| others.next().is_none()))
    }

    /// The name that an expression means as a tool or as a base: a list's element, a form's number, a variable.
    fn name(&self, frame: Frame, module: usize, words: &str) -> Option<Name> {
        let (_, own, list, field) = FRAMES[frame as usize];
        let tight: String = words.chars().filter(|c| !c.is_whitespace()).collect();
        // STOOL2(FP1), SBASE(FP1.BASE_NO), STOOL(3)
        let of_function = ["STOOL2(", "STOOL(", "SBASE(", "SBASE2("].iter().find_map(|f| tight.strip_prefix(*f));
        if let Some(argument) = of_function.and_then(|rest| rest.strip_suffix(')')) {
            let argument = argument.strip_suffix(field).and_then(|a| a.strip_suffix('.')).unwrap_or(argument);
            if let Ok(number) = argument.parse() {
                return numbered(frame, number);
            }
            return match self.find(module, argument) {
                Some(form) => form[frame as usize].clone(),
                None => Some(Name::new(argument, format!("{field} of {argument}"))),
            };
        }
        if tight == own {
            return None;
        }
        if NULL.contains(&tight.as_str()) {
            return Some(Name::new("$NULLFRAME", tight));
        }
        if let Some(index) = tight.strip_prefix(list).and_then(|rest| rest.strip_prefix('[')).and_then(|r| r.strip_suffix(']'))
        {
            if let Some(form) = index.strip_suffix(field).and_then(|i| i.strip_suffix('.')).and_then(|i| self.find(module, i)) {
                return form[frame as usize].clone();
            }
            return Some(index.parse::<i64>().map_or_else(
                |_| Name::new(tight.clone(), tight.clone()),
                |number| Name::new(format!("{list}[{number}]"), tight.clone()),
            ));
        }
        if tight.starts_with('{') {
            return Some(Name::new(tight.replace("FRAME:", ""), format!("{own}={}", short(words))));
        }
        let plain = is_name(&tight).then(|| format!("VAR {tight}"));
        Some(Name::new(plain.unwrap_or_else(|| tight.clone()), short(words)))
    }

    /// The frames that a motion states for itself alone, behind WITH.
    pub fn own(&self, module: usize, text: &Text, statement: &Statement) -> Form {
        let mut own = Form::default();
        for (left, right) in statement.with(text) {
            if let Some((frame, ..)) = FRAMES.iter().find(|(_, variable, ..)| *variable == left) {
                let words = text.capitals(right);
                own[*frame as usize] = self.name(*frame, module, &words);
            } else if left == "$IPO_MODE" && text.capitals(right).contains("#TCP") {
                own[1] = Some(Name::new("#TCP", "$IPO_MODE #TCP"));
            }
        }
        own
    }

    /// What a statement sets for all that follow.
    pub fn set(&self, module: usize, text: &Text, statement: &Statement) -> Vec<Step> {
        let set = |form: Form| {
            let frames = [Frame::Tool, Frame::Base].into_iter().zip(form);
            frames.filter_map(|(frame, name)| Some(Step::Set(frame, name?))).collect::<Vec<Step>>()
        };
        if statement.verb() == "BAS" {
            let tight: String = statement.capitals.chars().filter(|c| !c.is_whitespace()).collect();
            if tight.contains(EXTERNAL_BASE) {
                return vec![Step::Set(Frame::Base, Name::new(EXTERNAL_BASE, short(&statement.capitals)))];
            }
            let of = |(frame, _, list, _): (Frame, &str, &str, &str)| {
                let (_, argument) = tight.split_once(["#TOOL,", "#BASE,"][frame as usize])?;
                let argument = argument.strip_suffix(')').unwrap_or(argument);
                match argument.parse() {
                    Ok(number) => numbered(frame, number),
                    Err(_) => self.name(frame, module, &format!("{list}[{argument}]")),
                }
            };
            return set(FRAMES.map(of));
        }
        let Some(target) = statement.target(text).filter(|target| target.field.is_empty()) else { return Vec::new() };
        let words = text.capitals(target.right.clone());
        if target.root == "FDAT_ACT" {
            return set(if words.starts_with('{') {
                form(&words)
            } else {
                self.find(module, &words).cloned().unwrap_or_default()
            });
        }
        if target.root == "$IPO_MODE" && words == "#TCP" {
            return vec![Step::Set(Frame::Base, Name::new("#TCP", "$IPO_MODE #TCP"))];
        }
        let of = |(frame, variable, ..): &(Frame, &str, &str, &str)| {
            (*variable == target.root).then(|| self.name(*frame, module, &words).map(|name| Step::Set(*frame, name)))?
        };
        FRAMES.iter().filter_map(of).collect()
    }
}

/// An expression as it is shown, not longer than a line allows.
fn short(words: &str) -> String {
    words.chars().take(60).collect()
}

/// A frame that is set to what a variable holds.
pub struct Assigned {
    /// The frame.
    pub frame: Frame,
    /// The variable.
    pub name: Name,
}

/// The frames that the statements of a file write out or make at run time; `assigned` are the names in use.
pub fn settings(source: &Source, forms: &Forms, assigned: &[Assigned]) -> Vec<Setting> {
    let null = |frame: Frame, key: &str| {
        let name = Name::new(key, key);
        Setting { line: 1, frame, name, stands: Stands::Null }
    };
    let never = |key: &str, reason: &str| {
        let name = Name::new(key, key);
        Setting { line: 1, frame: Frame::Base, name, stands: Stands::Not(reason.into()) }
    };
    let mut found = vec![
        null(Frame::Tool, "$NULLFRAME"),
        null(Frame::Base, "$NULLFRAME"),
        null(Frame::Tool, "TOOL_DATA[0]"),
        null(Frame::Base, "BASE_DATA[0]"),
        never("#TCP", IN_HAND),
        never(EXTERNAL_BASE, MOVES),
    ];
    let text = &source.text;
    for statement in statements(text) {
        for (left, right) in statement.with(text) {
            let frame = FRAMES.iter().find(|(_, variable, ..)| *variable == left).map(|(frame, ..)| *frame);
            if let (Some(frame), Some(pose)) = (frame, literal(text, &right))
                && let Some(name) = forms.name(frame, source.module, &text.capitals(right))
            {
                found.push(Setting { line: statement.line, frame, name, stands: Stands::At(pose) });
            }
        }
        let Some(target) = statement.target(text).filter(|target| target.field.is_empty()) else { continue };
        let literal = literal(text, &target.right);
        for (frame, variable, list, _) in FRAMES {
            let words = text.capitals(target.right.clone());
            let name = if target.root == variable {
                forms.name(frame, source.module, &words)
            } else if target.root == list && target.indexed != list {
                Some(Name::new(target.indexed.clone(), target.indexed.clone()))
            } else {
                let key = format!("VAR {}", target.indexed);
                assigned.iter().find(|a| a.frame == frame && a.name.key == key).map(|a| a.name.clone())
            };
            let Some(name) = name else { continue };
            let stands = match literal {
                Some(pose) => Stands::At(pose),
                None if moves(&words) => Stands::Not(MOVES.into()),
                // A variable is told where it is assigned.
                None if target.root == variable
                    && (name.key.starts_with("VAR ") || name.key.ends_with(']') || name.key == "$NULLFRAME") =>
                {
                    continue;
                }
                None => Stands::Computed,
            };
            found.push(Setting { line: statement.line, frame, name, stands });
        }
    }
    found
}

/// True for a base that external axes carry: `EK(...)`, `EB(...)`.
fn moves(words: &str) -> bool {
    let tight: String = words.chars().filter(|c| !c.is_whitespace()).collect();
    ["EK(", "EB(", "EO("].iter().any(|f| tight.starts_with(f)) || tight.contains("MACHINE_DEF")
}

fn literal(text: &Text, at: &Range<usize>) -> Option<Pose> {
    let bytes = text.bytes().get(at.clone())?;
    let whole = bytes.starts_with(b"{") && bytes.iter().position(|b| *b == b'}') == bytes.len().checked_sub(1);
    let pair = Brackets { open: at.start, close: at.end.checked_sub(1)? };
    whole.then(|| Aggregate::parse(text, pair)).filter(Aggregate::is_place)?.frame(text)
}

/// Writes to parts of a frame, which move the base or the tool while the program runs: what is written, and in words which.
pub fn written(target: &Target) -> Option<&'static str> {
    let of = |(frame, variable, list, _): &(Frame, &str, &str, &str)| {
        let is_part = (target.root == *variable || target.root == *list) && !target.field.is_empty();
        is_part.then_some(["the tool", "the base"][*frame as usize])
    };
    FRAMES.iter().find_map(of)
}
