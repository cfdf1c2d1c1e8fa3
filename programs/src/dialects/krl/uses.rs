//! What the statements of all files of KRL do with names.

use std::collections::{HashMap, HashSet};

use super::aggregate::{AXES, POSE};
use super::frames::{Assigned, Form, Forms};
use super::statement::{Destination, Statement};
use crate::flow::{Names, Step};
use crate::scan::{Source, home_of, is_name, names};

/// Types of positions.
const TYPES: [&str; 4] = ["POS", "E6POS", "AXIS", "E6AXIS"];
/// Words before the name in a declaration.
const DECLARING: [&str; 10] = ["DECL", "GLOBAL", "CONST", "FRAME", "POS", "E6POS", "AXIS", "E6AXIS", "SIGNAL", "PUBLIC"];
/// Words with which a line begins that names what it has: routines with their parameters, and structures.
const HEADS: [&str; 7] = ["DEF", "DEFFCT", "DEFDAT", "EXT", "EXTFCT", "STRUC", "ENUM"];

/// A name in its module.
pub type Key = (usize, String);

/// Uses of names in the statements of all files.
#[derive(Default)]
pub struct Uses {
    /// Number of modules, at most.
    pub modules: usize,
    /// Moved to.
    pub moved: HashSet<Key>,
    /// Part of an expression, or of a frame.
    pub in_frames: HashSet<Key>,
    /// Written out or declared in a module.
    pub declared: HashSet<Key>,
    pub written: HashSet<Key>,
    /// Declared as a position.
    pub typed: HashSet<Key>,
    /// Of which single numbers are set at run time.
    pub parts: HashSet<Key>,
    /// Set as a whole at run time.
    pub computed: HashSet<Key>,
    /// Used by a statement: its text.
    pub used: HashMap<Key, String>,
    /// Copies: what is set, and from what.
    pub copies: Vec<[Key; 2]>,
    pub has_motions: bool,
    pub numbers: HashMap<Key, usize>,
    /// Frames in which positions are used, by number.
    pub frames: HashMap<usize, [Names; 2]>,
    /// Frames that the head of the open block of splines states.
    pub block: Form,
    /// Frames assigned by the name of a variable.
    pub assigned: Vec<Assigned>,
}

impl Uses {
    pub fn key(&self, module: usize, root: &str, name: &str) -> Key {
        (home_of(&self.declared, self.modules, module, root), name.to_owned())
    }

    /// True if single numbers of a position are set at run time: of it alone, or of some element of its array.
    pub fn is_set_in_part(&self, key: &Key, indexed: &str) -> bool {
        self.parts.contains(key) || self.parts.contains(&(key.0, indexed.to_owned()))
    }

    pub fn number(&mut self, key: Key) -> usize {
        let next = self.numbers.len();
        *self.numbers.entry(key).or_insert(next)
    }

    pub fn declare(&mut self, source: &Source, statement: &Statement) {
        let target = statement.target(&source.text);
        let kinds = || statement.words.iter().take_while(|w| DECLARING.contains(&w.as_str()));
        let is_typed = kinds().any(|w| TYPES.contains(&w.as_str()));
        match target {
            Some(target) if source.text.bytes().get(target.right.start) == Some(&b'{') => {
                self.declared.insert((source.module, target.root.clone()));
                self.written.insert((source.module, target.root.clone()));
                if is_typed {
                    self.typed.insert((source.module, target.root));
                }
            }
            None if kinds().count() > 0 => {
                for name in statement.words.iter().filter(|w| is_name(w) && !DECLARING.contains(&w.as_str())) {
                    self.declared.insert((source.module, name.clone()));
                    if is_typed {
                        self.typed.insert((source.module, name.clone()));
                    }
                }
            }
            _ => {}
        }
    }

    pub fn see(&mut self, source: &Source, statement: &Statement) {
        let (text, module) = (&source.text, source.module);
        self.mention(source, statement);
        if statement.motion().is_some() {
            self.has_motions = true;
            for destination in statement.destinations(text) {
                if let Destination::Variable { root, indexed } = destination {
                    let keys = [self.key(module, &root, &root), self.key(module, &root, &indexed)];
                    self.moved.extend(keys);
                }
            }
        }
        let in_expression = |uses: &mut Self, from: usize| {
            let words = statement.words.iter().skip(from).filter(|w| is_name(w));
            let keys: Vec<Key> = words.map(|w| uses.key(module, w, w)).collect();
            uses.in_frames.extend(keys);
        };
        let Some(target) = statement.target(text) else {
            if statement.capitals.contains(':') && statement.motion().is_some() {
                in_expression(self, 1);
            }
            return;
        };
        let right = text.capitals(target.right.clone());
        let of_frame = |known: &str| target.root == known || target.root.starts_with(&known[1..]);
        if of_frame("$TOOL") || of_frame("$BASE") || right.contains(':') && !right.starts_with('{') {
            in_expression(self, 1);
        }
        let key = self.key(module, &target.root, &target.root);
        if POSE.contains(&target.field.as_str())
            || AXES.contains(&target.field.as_str())
            || matches!(&target.field[..], "S" | "T")
        {
            // Of an array the one element, if its number is written.
            let of_one = target.has_plain_index().then(|| (key.0, target.indexed.clone()));
            self.parts.insert(of_one.unwrap_or(key));
        } else if target.field.is_empty() && !right.starts_with('{') {
            if is_name(&right) {
                let from = self.key(module, &right, &right);
                self.copies.push([key.clone(), from]);
            }
            self.computed.insert(key);
        }
    }

    /// The positions that a statement names, but for the one that it sets or declares.
    pub fn mention(&mut self, source: &Source, statement: &Statement) {
        let right = match statement.target(&source.text) {
            Some(target) => source.text.capitals(target.right),
            None if DECLARING.contains(&statement.verb()) || HEADS.contains(&statement.verb()) => return,
            None => statement.capitals.clone(),
        };
        if right.starts_with('{') {
            return;
        }
        for word in names(&right) {
            let key = self.key(source.module, word, word);
            if self.written.contains(&key) {
                self.used.entry(key).or_insert_with(|| source.text.words(statement.at.clone()));
            }
        }
    }

    /// What a statement does to the frames, and which positions it uses.
    pub fn step(&mut self, source: &Source, statement: &Statement, forms: &Forms, steps: &mut Vec<Step>) {
        let (text, module) = (&source.text, source.module);
        let name = || statement.words.get(1).cloned().unwrap_or_default();
        if statement.begins_block() {
            self.block = forms.own(module, text, statement);
        } else if ["ENDSPLINE", "END", "ENDFCT"].contains(&statement.verb()) {
            self.block = Form::default();
        }
        match statement.verb() {
            "DEF" => return steps.push(Step::Begin(name())),
            "GLOBAL" if statement.words.get(1).is_some_and(|w| w.starts_with("DEF")) => {
                let at = if statement.words[1] == "DEF" { 2 } else { 3 };
                return steps.push(Step::Begin(statement.words.get(at).cloned().unwrap_or_default()));
            }
            "DEFFCT" => return steps.push(Step::Begin(statement.words.get(2).cloned().unwrap_or_default())),
            "END" | "ENDFCT" => return steps.push(Step::End),
            "IF" => return steps.push(Step::Branch { is_side: true }),
            "SWITCH" => return steps.push(Step::Branch { is_side: false }),
            "ELSE" | "DEFAULT" => return steps.push(Step::Other { is_last: true }),
            "CASE" => return steps.push(Step::Other { is_last: false }),
            "ENDIF" | "ENDSWITCH" => return steps.push(Step::Join),
            "LOOP" | "WHILE" | "FOR" | "REPEAT" => return steps.push(Step::Loop),
            "ENDLOOP" | "ENDWHILE" | "ENDFOR" | "UNTIL" => return steps.push(Step::Again),
            "GOTO" => return steps.push(Step::Jump { label: name(), always: true }),
            "RETURN" | "HALT" => return steps.push(Step::Leave),
            verb if statement.capitals.strip_prefix(verb).is_some_and(|rest| rest.trim() == ":") => {
                return steps.push(Step::Label(verb.to_owned()));
            }
            _ => {}
        }
        steps.extend(forms.set(module, text, statement));
        if statement.motion().is_some() {
            let [tool, base] = forms.own(module, text, statement);
            let own = [tool.or(self.block[0].clone()), base.or(self.block[1].clone())];
            for destination in statement.destinations(text) {
                let keys = match destination {
                    Destination::Literal(at) => vec![(usize::MAX - source.file, format!("{}", at.start))],
                    Destination::Variable { root, indexed } => {
                        let whole = self.key(module, &root, &root);
                        let one = self.key(module, &root, &indexed);
                        if one == whole { vec![one] } else { vec![one, whole] }
                    }
                    _ => Vec::new(),
                };
                for key in keys {
                    let number = self.number(key);
                    steps.push(Step::Use(number, own.clone()));
                }
            }
            return;
        }
        // SUB(...) calls a routine, as far as it is in the files.
        let called = statement.capitals.split_once('(').map(|(name, _)| name.trim()).filter(|name| is_name(name));
        if let Some(called) = called {
            steps.push(Step::Call(called.to_owned()));
        }
    }

    pub fn frames_of(&self, key: &Key) -> Option<&[Names; 2]> {
        self.frames.get(self.numbers.get(key)?)
    }
}
