//! RAPID: robtargets, jointtargets, tools and work objects, in declarations and in motions.

use std::collections::HashMap;

use nalgebra::{Quaternion, Rotation3, Translation3, UnitQuaternion, Vector3};

use super::form::Form;
use super::found::{Declared, Found, How, Offset, Scan, Selected, Setting, Use};
use super::scan::{Item, Kind, Lexis, Number, Token, Tokens, numbers};
use crate::robot::{FramePose, Pose};
use crate::units::{DEG, MM};

const LEXIS: Lexis = Lexis { comment: Some(b'!'), quotes: b"\"" };

/// Beginnings of the instructions that move the robot.
const MOTIONS: [&str; 5] = ["MOVE", "TRIGG", "SEARCH", "ARC", "SPOT"];
/// Instructions after which every target is displaced by the controller.
const DISPLACES: [&str; 4] = ["PDISPON", "PDISPSET", "EOFFSON", "EOFFSSET"];

pub(super) fn tokens(bytes: &[u8]) -> Tokens<'_> {
    Tokens::of(bytes, LEXIS).without_ends()
}

/// First token of every statement, and the one after its last.
fn statements(tokens: &Tokens<'_>) -> Vec<(usize, usize)> {
    let (mut statements, mut from) = (Vec::new(), 0);
    for i in 0..tokens.len() {
        if tokens.is(i, b';') {
            statements.push((from, i));
            from = i + 1;
        }
    }
    statements
}

/// Tools and work objects that a file declares, by name in capitals.
pub(super) fn learn(tokens: &Tokens<'_>, facts: &mut HashMap<String, Selected>) {
    for (from, to) in statements(tokens) {
        let Some((i, of_type)) = declared_type(tokens, from, to) else { continue };
        let Some((name, next)) = tokens.name_at(i, b'{') else { continue };
        let value = value_after(tokens, next, to);
        let selected = match of_type.as_str() {
            "TOOLDATA" => tool_of(&name, tokens, value),
            "WOBJDATA" => work_of(&name, tokens, value),
            _ => continue,
        };
        facts.insert(name.to_ascii_uppercase(), selected);
    }
}

/// The type declared in a statement, and the index of the name after it. What precedes it on the way, such as the end of a
/// procedure's head, belongs to no statement of its own.
fn declared_type(tokens: &Tokens<'_>, from: usize, to: usize) -> Option<(usize, String)> {
    const TYPES: [&str; 4] = ["ROBTARGET", "JOINTTARGET", "TOOLDATA", "WOBJDATA"];
    let i = (from..to).take_while(|&i| !tokens.is(i, b'=')).find(|&i| TYPES.contains(&tokens.word(i).as_str()))?;
    ["CONST", "PERS", "VAR"].contains(&tokens.word(i.wrapping_sub(1)).as_str()).then(|| (i + 1, tokens.word(i)))
}

/// The list after `:=`, if that is all there is.
fn value_after(tokens: &Tokens<'_>, i: usize, to: usize) -> Option<Vec<Item>> {
    let is_assigned = tokens.is(i, b':') && tokens.is(i + 1, b'=');
    tokens.list(i + 2).filter(|(_, next)| is_assigned && *next == to).map(|(items, _)| items)
}

fn pose_of(items: &[Item]) -> Option<Pose> {
    let [Item::List(position), Item::List(rotation)] = items else { return None };
    let [x, y, z] = numbers::<3>(position)?.map(|n| n.value * MM);
    let [w, i, j, k] = numbers::<4>(rotation)?.map(|n| n.value);
    let q = Quaternion::new(w, i, j, k);
    let turn = UnitQuaternion::try_new(q, 0.5)?;
    Some(Pose::from_parts(Translation3::new(x, y, z), turn.to_rotation_matrix()))
}

fn given(name: &str, pose: Option<Pose>, held: Option<bool>, why: &'static str) -> Selected {
    match (pose, held) {
        (_, Some(false)) => Selected::Unusable { name: name.into(), why },
        (Some(pose), Some(true)) => Selected::Given { name: name.into(), frame: FramePose::from_pose(&pose) },
        _ => Selected::Named(name.into()),
    }
}

fn truth(tokens: &Tokens<'_>, item: Option<&Item>) -> Option<bool> {
    match item {
        Some(Item::Other(i)) if tokens.word(*i) == "TRUE" => Some(true),
        Some(Item::Other(i)) if tokens.word(*i) == "FALSE" => Some(false),
        _ => None,
    }
}

/// `[robhold, [trans, rot], load]`.
fn tool_of(name: &str, tokens: &Tokens<'_>, value: Option<Vec<Item>>) -> Selected {
    let value = value.unwrap_or_default();
    let pose = value.get(1).and_then(|item| if let Item::List(frame) = item { pose_of(frame) } else { None });
    given(name, pose, truth(tokens, value.first()), "the tool stands in the room and the robot carries the work")
}

/// `[robhold, ufprog, ufmec, uframe, oframe]`.
fn work_of(name: &str, tokens: &Tokens<'_>, value: Option<Vec<Item>>) -> Selected {
    let value = value.unwrap_or_default();
    let frame = |k: usize| value.get(k).and_then(|item| if let Item::List(frame) = item { pose_of(frame) } else { None });
    let pose = frame(3).zip(frame(4)).map(|(user, object)| user * object);
    if truth(tokens, value.get(1)) == Some(false) {
        return Selected::Unusable { name: name.into(), why: "the work object is moved by another mechanical unit" };
    }
    given(name, pose, truth(tokens, value.first()).map(|held| !held), "the robot carries the work object")
}

/// Finds positions and motions in a file.
pub(super) fn scan(tokens: &Tokens<'_>, facts: &HashMap<String, Selected>) -> Scan {
    let mut reader = Reader { tokens, facts, scan: Scan::default() };
    for (from, to) in statements(tokens) {
        match declared_type(tokens, from, to) {
            Some((i, of_type)) if ["ROBTARGET", "JOINTTARGET"].contains(&of_type.as_str()) => reader.declaration(i, to),
            Some(_) => {}
            None => reader.statement(from, to),
        }
    }
    let named: Vec<Declared> = facts.iter().map(|(name, selected)| {
        let is_tool = !matches!(selected, Selected::Unsaid);
        Declared { name: name.clone(), is_tool, selected: selected.clone() }
    }).collect();
    reader.scan.declared = named;
    reader.scan
}

struct Reader<'a> {
    tokens: &'a Tokens<'a>,
    facts: &'a HashMap<String, Selected>,
    scan: Scan,
}

impl Reader<'_> {
    /// `NAME{n} := [...]`, with every element of an array a position of its own.
    fn declaration(&mut self, i: usize, to: usize) {
        let line = self.tokens.line(i);
        let Some((written, next)) = self.tokens.name_at(i, b'{') else { return };
        let name = written.split('[').next().unwrap_or(&written).to_ascii_uppercase();
        let assigned = self.tokens.is(next, b':');
        let Some(items) = value_after(self.tokens, next, to) else {
            if assigned {
                self.scan.leave(line, &name, "its value is computed", "nothing, or write it as numbers");
            }
            return;
        };
        if written.contains('[') {
            for (k, item) in items.iter().enumerate() {
                if let Item::List(element) = item {
                    self.position(&format!("{name}[{}]", k + 1), element, line, false, Setting::default());
                }
            }
        } else {
            self.position(&name, &items, line, false, Setting::default());
        }
    }

    fn position(&mut self, name: &str, items: &[Item], line: usize, inline: bool, setting: Setting) {
        match target_of(items) {
            Some((form, numbers)) => self.scan.found.push(Found {
                line,
                name: name.to_owned(),
                form,
                numbers,
                setting,
                inline,
                needs_motion: false,
                near: None,
            }),
            None => {
                let why = "it is not written as numbers throughout";
                self.scan.refuse(line, name, why, "write every component of the target as a number");
            }
        }
    }

    fn statement(&mut self, from: usize, to: usize) {
        let is_motion = |word: &str| MOTIONS.iter().any(|motion| word.starts_with(motion));
        // The statement may begin after a label, or after the head of a procedure, which has no semicolon.
        for i in from..to {
            let word = self.tokens.word(i);
            let follows_instruction = i + 1 < to && !self.tokens.is(i + 1, b'(') && !self.tokens.is(i + 1, b':');
            if is_motion(&word) && follows_instruction && word != "MOVE" {
                return self.motion(i, to);
            }
            if DISPLACES.contains(&word.as_str()) {
                let (why, remedy) = ("it displaces every target by an amount computed at run time", "nothing, if it is small");
                return self.scan.leave(self.tokens.line(i), self.tokens.written(i), why, remedy);
            }
        }
        self.assignment(from, to);
    }

    /// `p10 := ...` or `p10.trans.x := ...`, anywhere in a statement.
    fn assignment(&mut self, from: usize, to: usize) {
        let Some(at) = (from..to).find(|&i| self.tokens.is(i, b':') && self.tokens.is(i + 1, b'=')) else { return };
        // Back over `.trans.x` and `{n}` to the name.
        let mut i = at;
        while i > from && (self.tokens.is(i - 1, b'}') || self.tokens.is(i - 1, b'.') || self.tokens.is(i.saturating_sub(2), b'.')) {
            if self.tokens.is(i - 1, b'}') {
                let Some(open) = (from..i).rev().find(|&k| self.tokens.is(k, b'{')) else { return };
                i = open;
            } else {
                i -= 1;
            }
        }
        let mut begin = i.saturating_sub(1).max(from);
        while begin > from && (self.tokens.is(begin, b'.') || self.tokens.is(begin - 1, b'.')) {
            begin -= 1;
        }
        if let Some((name, _)) = self.tokens.name_at(begin, b'{') {
            let (name, line) = (name.to_ascii_uppercase(), self.tokens.line(begin));
            self.scan.uses.push(Use { name, line, how: How::Changed, setting: Setting::default() });
        }
    }

    /// `MoveL p10, v100\T:=5, fine, tool1\WObj:=work1`.
    fn motion(&mut self, at: usize, to: usize) {
        let arguments = self.arguments(at + 1, to);
        let setting = self.setting(&arguments, to);
        let word = self.tokens.written(at);
        let mut any = false;
        for &(from, end) in &arguments[..arguments.len().saturating_sub(1)] {
            any |= self.target(from, end, &word, &setting);
        }
        let _ = any;
    }

    /// First token of every argument, and the one after its last, switches and optional arguments after it left out.
    fn arguments(&self, from: usize, to: usize) -> Vec<(usize, usize)> {
        let (mut arguments, mut begin, mut i) = (Vec::new(), from, from);
        // `SearchL \Stop, di1, ...`: switches may come first.
        while i <= to {
            if i == to || self.tokens.is(i, b',') {
                let plain = (begin..i).find(|&k| self.tokens.is(k, b'\\')).unwrap_or(i);
                if begin < plain {
                    arguments.push((begin, plain));
                }
                begin = i + 1;
            }
            let opens = [b'(', b'[', b'{'].iter().any(|&bracket| self.tokens.is(i, bracket));
            i = if opens && i < to { self.tokens.past_group(i).min(to) } else { i + 1 };
        }
        arguments
    }

    /// The tool is the last argument, the work object follows it.
    fn setting(&self, arguments: &[(usize, usize)], to: usize) -> Setting {
        let Some(&(from, end)) = arguments.last() else { return Setting::default() };
        let of = |name: &str, nothing: &str| match self.facts.get(&name.to_ascii_uppercase()) {
            Some(selected) => selected.clone(),
            None if name.eq_ignore_ascii_case(nothing) => {
                Selected::Given { name: name.into(), frame: FramePose::default() }
            }
            None => Selected::Named(name.into()),
        };
        let tool = match self.tokens.get(from) {
            Some(Token { kind: Kind::Word, .. }) if end == from + 1 => of(&self.tokens.written(from), "tool0"),
            _ => Selected::Unsaid,
        };
        let work = (end..to).find(|&i| self.tokens.word(i) == "WOBJ" && self.tokens.is(i + 1, b':'));
        let frame = work.map_or_else(
            || Selected::Given { name: "wobj0".into(), frame: FramePose::default() },
            |i| of(&self.tokens.written(i + 3), "wobj0"),
        );
        Setting { tool, frame }
    }

    /// A target among the arguments; false if the argument is something else.
    fn target(&mut self, from: usize, end: usize, word: &str, setting: &Setting) -> bool {
        let line = self.tokens.line(from);
        let (setting, mention) = (setting.clone(), |name: &str, how: How, setting: Setting| Use {
            name: name.to_ascii_uppercase(),
            line,
            how,
            setting,
        });
        if let Some((items, next)) = self.tokens.list(from) {
            let is_target = next == end && matches!(items.first(), Some(Item::List(_)));
            if is_target {
                self.position(word, &items, line, true, setting);
            }
            return is_target;
        }
        let Some((name, next)) = self.tokens.name_at(from, b'{') else { return false };
        if next == end {
            self.scan.uses.push(mention(&name, How::Target, setting));
            return true;
        }
        let function = name.to_ascii_uppercase();
        if !self.tokens.is(next, b'(') || !["OFFS", "RELTOOL"].contains(&function.as_str()) {
            return false;
        }
        let inside = self.arguments(next + 1, self.tokens.past_group(next).saturating_sub(1));
        if let Some((name, _)) = inside.first().and_then(|&(at, _)| self.tokens.name_at(at, b'{')) {
            let offset = self.offset(&function, &inside, end);
            self.scan.uses.push(mention(&name, How::Offset(offset), setting));
        }
        true
    }

    /// `Offs(p, x, y, z)` and `RelTool(p, x, y, z \Rx:=.. \Ry:=.. \Rz:=..)`, mm and deg.
    fn offset(&self, function: &str, inside: &[(usize, usize)], end: usize) -> Option<Offset> {
        let mut xyz = [0.0; 3];
        for (v, &(from, to)) in xyz.iter_mut().zip(inside.get(1..4)?) {
            let (number, next) = self.tokens.signed(from)?;
            (next == to).then_some(())?;
            *v = number.value * MM;
        }
        if function == "OFFS" {
            return Some(Offset::Work(xyz));
        }
        let from = inside.get(3)?.1;
        let about = |name: &str| {
            let at = (from..end).find(|&i| self.tokens.word(i) == name);
            at.map_or(Some(0.0), |i| self.tokens.signed(i + 3).map(|(number, _)| number.value * DEG))
        };
        // RelTool turns about x, then about the new y, then about the new z.
        let turns = [(Vector3::x_axis(), "RX"), (Vector3::y_axis(), "RY"), (Vector3::z_axis(), "RZ")];
        let mut rotation = Rotation3::identity();
        for (axis, name) in turns {
            rotation *= Rotation3::from_axis_angle(&axis, about(name)?);
        }
        Some(Offset::Tool(Pose::from_parts(Translation3::from(Vector3::from(xyz)), rotation)))
    }
}

/// A robtarget or a jointtarget, written as numbers throughout.
fn target_of(items: &[Item]) -> Option<(Form, Vec<Number>)> {
    match items {
        [Item::List(position), Item::List(rotation), Item::List(configuration), Item::List(external)] => {
            numbers::<6>(external)?;
            let mut all = numbers::<3>(position)?.to_vec();
            all.extend(numbers::<4>(rotation)?);
            all.extend(numbers::<4>(configuration)?);
            Some((Form::Rapid, all))
        }
        [Item::List(joints), Item::List(external)] => {
            numbers::<6>(external)?;
            Some((Form::Joints { degrees: true }, numbers::<6>(joints)?.to_vec()))
        }
        _ => None,
    }
}
