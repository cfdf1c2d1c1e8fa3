//! URScript: poses `p[x, y, z, rx, ry, rz]` (m, rotation vector) and joints `[...]` (rad) in motions and variables.

use std::collections::HashMap;

use super::form::Form;
use super::found::{Found, How, Offset, Scan, Selected, Setting, Use};
use super::scan::{Kind, Lexis, Number, Token, Tokens, numbers};
use crate::robot::{FramePose, Pose};

const LEXIS: Lexis = Lexis { comment: Some(b'#'), quotes: b"\"'" };

/// Functions that move to their first argument; `movec` to its first two.
const MOTIONS: [&str; 6] = ["movej", "movel", "movep", "movec", "servoj", "servoc"];

/// Positions whose values a name holds.
#[derive(Default)]
struct Known {
    joints: HashMap<String, [f64; 6]>,
    poses: HashMap<String, Pose>,
}

/// Finds positions and motions in a file.
pub(super) fn scan(bytes: &[u8]) -> Scan {
    let tokens = Tokens::of(bytes, LEXIS);
    let mut reader = Reader { tokens: &tokens, setting: base(), known: Known::default(), scan: Scan::default() };
    let mut i = 0;
    while i < tokens.len() {
        i = reader.step(i);
    }
    reader.scan
}

/// Poses are relative to the robot's base; features are multiplied in by the program.
fn base() -> Setting {
    Setting { tool: Selected::Unsaid, frame: Selected::Given { name: "base".into(), frame: FramePose::default() } }
}

struct Reader<'a> {
    tokens: &'a Tokens<'a>,
    setting: Setting,
    known: Known,
    scan: Scan,
}

impl Reader<'_> {
    /// Reads what begins at token `i`; returns where to go on.
    fn step(&mut self, i: usize) -> usize {
        let word = self.tokens.written(i);
        let is_call = self.tokens.is(i + 1, b'(');
        if is_call && MOTIONS.contains(&word.as_str()) {
            let arguments = self.arguments(i + 1);
            let most = if word == "movec" { 2 } else { 1 };
            for &(from, to) in arguments.iter().take(most) {
                self.target(from, to, &word, None);
            }
            return self.tokens.past_group(i + 1);
        }
        if is_call && word == "set_tcp" {
            let arguments = self.arguments(i + 1);
            self.setting.tool = arguments.first().map_or(Selected::Unsaid, |&(from, to)| self.tool(from, to));
            return self.tokens.past_group(i + 1);
        }
        let is_word = matches!(self.tokens.get(i), Some(Token { kind: Kind::Word, .. }));
        let begins = i == 0 || self.tokens.is_end(i - 1) || ["global", "local"].contains(&self.tokens.written(i - 1).as_str());
        if is_word && begins && !["global", "local", "def", "thread", "end"].contains(&word.as_str()) {
            return self.assignment(i).unwrap_or(i + 1);
        }
        i + 1
    }

    /// First token, and the one after the last, of every argument of the call whose bracket is token `open`.
    fn arguments(&self, open: usize) -> Vec<(usize, usize)> {
        let end = self.tokens.past_group(open).saturating_sub(1);
        let (mut arguments, mut from, mut i) = (Vec::new(), open + 1, open + 1);
        while i < end {
            if self.tokens.is(i, b',') {
                arguments.push((from, i));
                from = i + 1;
            }
            let opens = [b'(', b'['].iter().any(|&bracket| self.tokens.is(i, bracket));
            i = if opens { self.tokens.past_group(i) } else { i + 1 };
        }
        arguments.push((from, end));
        arguments
    }

    /// `p[...]` or `[...]` from token `from` to `to`, and nothing else.
    fn literal(&self, from: usize, to: usize) -> Option<(Form, [Number; 6])> {
        let is_pose = self.tokens.written(from) == "p" && self.tokens.is(from + 1, b'[');
        let (items, next) = self.tokens.list(from + usize::from(is_pose))?;
        let form = if is_pose { Form::UrScript } else { Form::Joints { degrees: false } };
        numbers::<6>(&items).filter(|_| next == to).map(|numbers| (form, numbers))
    }

    fn pose(&self, from: usize, to: usize) -> Option<Pose> {
        match self.literal(from, to) {
            Some((Form::UrScript, numbers)) => pose_of(&numbers),
            Some(_) => None,
            None => self.known.poses.get(&self.whole_name(from, to)?).copied(),
        }
    }

    fn whole_name(&self, from: usize, to: usize) -> Option<String> {
        self.tokens.name_at(from, b'[').filter(|(_, next)| *next == to).map(|(name, _)| name)
    }

    fn tool(&mut self, from: usize, to: usize) -> Selected {
        let line = self.tokens.line(from);
        let written = self.whole_name(from, to);
        if let Some(name) = &written {
            self.scan.uses.push(Use { name: name.clone(), line, how: How::NoTarget, setting: base() });
        }
        let name = written.unwrap_or_else(|| format!("set_tcp of line {line}"));
        match self.pose(from, to) {
            Some(pose) => Selected::Given { name, frame: FramePose::from_pose(&pose) },
            None => Selected::Named(name),
        }
    }

    /// The target of a motion, from token `from` to `to`; `near` are the joints near which the controller solves it.
    fn target(&mut self, from: usize, to: usize, word: &str, near: Option<[f64; 6]>) {
        let line = self.tokens.line(from);
        let setting = self.setting.clone();
        if let Some((form, numbers)) = self.literal(from, to) {
            let (name, numbers) = (word.to_owned(), numbers.to_vec());
            self.scan.found.push(Found { line, name, form, numbers, setting, inline: true, needs_motion: false, near });
            return;
        }
        if let Some(name) = self.whole_name(from, to) {
            self.scan.uses.push(Use { name: name.clone(), line, how: How::Target, setting });
            if near.is_some() {
                self.scan.found.iter_mut().filter(|f| f.name == name).for_each(|f| f.near = near);
            }
            return;
        }
        let called = self.tokens.written(from);
        let is_call = self.tokens.is(from + 1, b'(') && self.tokens.past_group(from + 1) == to;
        if is_call && called == "get_inverse_kin" {
            let arguments = self.arguments(from + 1);
            let near = arguments.get(1).and_then(|&(from, to)| self.joints(from, to));
            return self.target(arguments[0].0, arguments[0].1, word, near);
        }
        if is_call && ["pose_trans", "pose_add"].contains(&called.as_str()) {
            let arguments = self.arguments(from + 1);
            if let [(a, b), (c, d)] = arguments[..]
                && let Some(name) = self.whole_name(a, b)
            {
                let offset = self.pose(c, d).map(|pose| match called.as_str() {
                    "pose_trans" => Offset::Tool(pose),
                    _ => Offset::Work(pose.translation.vector.into()),
                });
                self.scan.uses.push(Use { name, line, how: How::Offset(offset), setting });
                return;
            }
        }
        self.computed(from, to, word);
    }

    /// A target that is calculated: from literal poses it ought to be compensated, from anything else it cannot.
    fn computed(&mut self, from: usize, to: usize, word: &str) {
        let line = self.tokens.line(from);
        let is_literal = (from..to).any(|i| self.tokens.is(i, b'['));
        if is_literal {
            let why = "its target is calculated from numbers in the program";
            self.scan.refuse(line, word, why, "write the result as a pose relative to the base");
        } else {
            self.scan.leave(line, word, "its target is computed at run time", "nothing, or write it as numbers");
        }
    }

    /// Joints of a literal list or of a name, `qnear = ` before them or not.
    fn joints(&self, from: usize, to: usize) -> Option<[f64; 6]> {
        let from = if self.tokens.is(from + 1, b'=') { from + 2 } else { from };
        match self.literal(from, to) {
            Some((Form::Joints { .. }, numbers)) => Some(numbers.map(|n| n.value)),
            Some(_) => None,
            None => self.known.joints.get(&self.whole_name(from, to)?).copied(),
        }
    }

    /// `NAME = p[...]`, `NAME = [...]`, `NAME = [p[...], ...]`; returns where to go on.
    fn assignment(&mut self, i: usize) -> Option<usize> {
        let (name, next) = self.tokens.name_at(i, b'[')?;
        let right = if self.tokens.is(next, b':') { next + 1 } else { next };
        if !self.tokens.is(right, b'=') || self.tokens.is(right + 1, b'=') {
            return None;
        }
        let right = right + 1;
        let end = (right..self.tokens.len()).find(|&k| self.tokens.is_end(k)).unwrap_or(self.tokens.len());
        if let Some((form, numbers)) = self.literal(right, end) {
            self.declare(name, form, numbers, i);
            return Some(end);
        }
        let elements = if self.tokens.is(right, b'[') { self.arguments(right) } else { Vec::new() };
        let literal: Vec<_> = elements.iter().map_while(|&(from, to)| self.literal(from, to)).collect();
        if !literal.is_empty() && literal.len() == elements.len() {
            for (k, (form, numbers)) in literal.into_iter().enumerate() {
                self.declare(format!("{name}[{k}]"), form, numbers, i);
            }
            return Some(self.tokens.past_group(right));
        }
        let how = How::Changed;
        self.scan.uses.push(Use { name, line: self.tokens.line(i), how, setting: base() });
        None
    }

    fn declare(&mut self, name: String, form: Form, numbers: [Number; 6], i: usize) {
        if form == Form::UrScript {
            self.known.poses.extend(pose_of(&numbers).map(|pose| (name.clone(), pose)));
        } else {
            self.known.joints.insert(name.clone(), numbers.map(|n| n.value));
        }
        self.scan.found.push(Found {
            line: self.tokens.line(i),
            name,
            form,
            numbers: numbers.to_vec(),
            setting: base(),
            inline: false,
            needs_motion: true,
            near: None,
        });
    }
}

fn pose_of(numbers: &[Number; 6]) -> Option<Pose> {
    match Form::UrScript.read(numbers) {
        Ok(super::form::Asked::Pose { pose, .. }) => Some(pose),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_moved_to_is_told_from_what_is_not() {
        let scan = scan(
            b"def go():\n set_tcp(p[0,0,0.1,0,0,0])\n w=p[.1,.2,.3,0,3.1,0]\n movej([0,-1.5,1,0,1,0],a=1)\n movel(w,v=0.1)\n \
              movel(pose_trans(w,p[0,0,-.1,0,0,0]))\n movel(pose_trans(p[1,0,0,0,0,0],w))\n movej(get_inverse_kin(w,[0,-1,1,0,1,0]))\nend\n",
        );
        let names: Vec<_> = scan.found.iter().map(|f| (f.name.as_str(), f.line, f.inline)).collect();
        assert_eq!(names, [("w", 3, false), ("movej", 4, true)]);
        assert_eq!(scan.found[0].near, Some([0.0, -1.0, 1.0, 0.0, 1.0, 0.0]));
        assert_eq!(scan.uses.iter().filter(|u| u.how == How::Target).count(), 2);
        assert!(matches!(&scan.uses[1].how, How::Offset(Some(Offset::Tool(_)))), "{:?}", scan.uses);
        assert_eq!(scan.refused.iter().map(|r| r.line).collect::<Vec<_>>(), [7]);
        let Selected::Given { frame, .. } = &scan.uses[0].setting.tool else { panic!("{:?}", scan.uses) };
        assert_eq!(frame.xyz, [0.0, 0.0, 0.1]);
    }
}
