//! KRL: `.src` and `.dat`.

mod aggregate;
mod frames;
mod literals;
mod statement;

use std::collections::{HashMap, HashSet};

use crate::flow::{Names, Step, follow};
use crate::scan::{Frame, Marks, Name, Scan, Source, WRITE_OUT, home_of, is_name, names};
use aggregate::{AXES, POSE};
use frames::{Form, Forms, settings, written};
use literals::{literal, within};
use statement::{Destination, Statement, Target, statements};

pub const MARKS: Marks = Marks { comment: b";", quotes: b"\"" };

/// Types of positions.
const TYPES: [&str; 4] = ["POS", "E6POS", "AXIS", "E6AXIS"];
/// Words before the name in a declaration.
const DECLARING: [&str; 10] = ["DECL", "GLOBAL", "CONST", "FRAME", "POS", "E6POS", "AXIS", "E6AXIS", "SIGNAL", "PUBLIC"];
/// Words with which a line begins that names what it has: routines with their parameters, and structures.
const HEADS: [&str; 7] = ["DEF", "DEFFCT", "DEFDAT", "EXT", "EXTFCT", "STRUC", "ENUM"];
/// Positions of the controller at which the robot stands already.
const HERE: [&str; 5] = ["$AXIS_ACT", "$POS_ACT", "$AXIS_FOR", "$POS_FOR", "$AXIS_RET"];

/// A name in its module.
type Key = (usize, String);

/// Uses of names in the statements of all files.
#[derive(Default)]
struct Uses {
    /// Number of modules, at most.
    modules: usize,
    /// Moved to.
    moved: HashSet<Key>,
    /// Part of an expression, or of a frame.
    in_frames: HashSet<Key>,
    /// Written out or declared in a module.
    declared: HashSet<Key>,
    written: HashSet<Key>,
    /// Declared as a position.
    typed: HashSet<Key>,
    /// Of which single numbers are set at run time.
    parts: HashSet<Key>,
    /// Set as a whole at run time.
    computed: HashSet<Key>,
    /// Used by a statement: its text.
    used: HashMap<Key, String>,
    /// Copies: what is set, and from what.
    copies: Vec<[Key; 2]>,
    has_motions: bool,
    numbers: HashMap<Key, usize>,
    /// Frames in which positions are used, by number.
    frames: HashMap<usize, [Names; 2]>,
    /// Frames that the head of the open block of splines states.
    block: Form,
    /// Frames assigned by the name of a variable.
    assigned: Vec<(Frame, Name)>,
}

pub fn scan(sources: &[Source]) -> Vec<Scan> {
    let forms = Forms::of(sources);
    let mut uses = Uses { modules: sources.len(), ..Uses::default() };
    for source in sources {
        statements(&source.text).iter().for_each(|s| uses.declare(source, s));
    }
    for source in sources {
        statements(&source.text).iter().for_each(|s| uses.see(source, s));
    }
    let mut steps = Vec::new();
    for source in sources {
        statements(&source.text).iter().for_each(|s| uses.step(source, s, &forms, &mut steps));
    }
    uses.frames = follow(&steps);
    for [to, from] in uses.copies.clone() {
        let of = |key: &Key| uses.numbers.get(key).and_then(|n| uses.frames.get(n)).cloned();
        if let (Some(frames), None) = (of(&to), of(&from)) {
            let number = uses.number(from);
            uses.frames.insert(number, frames);
        }
    }
    for step in &steps {
        match step {
            Step::Set(frame, name) => uses.assigned.push((*frame, name.clone())),
            Step::Use(_, own) => {
                let named = [Frame::Tool, Frame::Base].into_iter().zip(own);
                uses.assigned.extend(named.filter_map(|(frame, name)| Some((frame, name.clone()?))));
            }
            _ => {}
        }
    }
    sources.iter().map(|source| scan_file(source, &uses, &forms)).collect()
}

impl Uses {
    fn key(&self, module: usize, root: &str, name: &str) -> Key {
        (home_of(&self.declared, self.modules, module, root), name.to_owned())
    }

    /// True if single numbers of a position are set at run time: of it alone, or of some element of its array.
    fn is_set_in_part(&self, key: &Key, indexed: &str) -> bool {
        self.parts.contains(key) || self.parts.contains(&(key.0, indexed.to_owned()))
    }

    fn number(&mut self, key: Key) -> usize {
        let next = self.numbers.len();
        *self.numbers.entry(key).or_insert(next)
    }

    fn declare(&mut self, source: &Source, statement: &Statement) {
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

    fn see(&mut self, source: &Source, statement: &Statement) {
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
    fn mention(&mut self, source: &Source, statement: &Statement) {
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
    fn step(&mut self, source: &Source, statement: &Statement, forms: &Forms, steps: &mut Vec<Step>) {
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

    fn frames_of(&self, key: &Key) -> Option<&[Names; 2]> {
        self.frames.get(self.numbers.get(key)?)
    }
}

fn scan_file(source: &Source, uses: &Uses, forms: &Forms) -> Scan {
    let text = &source.text;
    let mut scan = Scan { settings: settings(source, forms, &uses.assigned), ..Scan::default() };
    let mut pairs = text.brackets(*b"{}", Some(b'\n')).into_iter().peekable();
    for statement in statements(text) {
        let mut end_of_last = 0;
        while let Some(pair) = pairs.next_if(|pair| pair.open < statement.at.end) {
            // Aggregates within aggregates are not positions: loads have frames of their own.
            if pair.open >= end_of_last {
                end_of_last = pair.close;
                literal(source, &statement, pair, uses, forms, &mut scan);
            } else {
                within(source, &statement, pair, uses, &mut scan);
            }
        }
        motion(source, &statement, uses, &mut scan);
    }
    scan
}

/// Everything about motions but the positions written out.
fn motion(source: &Source, statement: &Statement, uses: &Uses, scan: &mut Scan) {
    let (text, line, verb) = (&source.text, statement.line, statement.verb());
    if statement.is_relative() {
        scan.warn(line, verb, "a relative motion is left as it is", "start it from a compensated position, and keep it short");
        return;
    }
    if let Some(target) = statement.target(text) {
        assigned(source, line, &target, uses, scan);
    }
    if statement.motion().is_none() {
        return;
    }
    for destination in statement.destinations(text) {
        match destination {
            Destination::Variable { root, .. } => {
                if !uses.written.contains(&uses.key(source.module, &root, &root)) {
                    let remedy = "give the file that declares it too (.src and .dat together)";
                    scan.warn(line, root, "this position is not written out in the files given", remedy);
                }
            }
            Destination::Function(name) => {
                scan.warn(line, format!("{verb} {name}(...)"), "the motion goes to the result of a function", WRITE_OUT);
            }
            Destination::Computed => scan.warn(line, verb, "the motion goes to a position computed at run time", WRITE_OUT),
            Destination::System(name) if !HERE.iter().any(|here| name.starts_with(here)) => {
                scan.warn(line, name, "the motion goes to a position of the controller's own", WRITE_OUT);
            }
            Destination::System(_) | Destination::Literal(_) => {}
        }
    }
}

/// What an assignment does to positions and frames.
fn assigned(source: &Source, line: usize, target: &Target, uses: &Uses, scan: &mut Scan) {
    let key = uses.key(source.module, &target.root, &target.root);
    let what = match &target.field[..] {
        "" => target.indexed.clone(),
        field => format!("{}.{field}", target.indexed),
    };
    if let Some(which) = written(target) {
        return scan.tell_frame_changed(line, what, which);
    }
    let is_position = uses.moved.contains(&key) || uses.typed.contains(&key);
    let is_literal = source.text.bytes().get(target.right.start) == Some(&b'{');
    if uses.is_set_in_part(&key, &target.indexed) && is_position && !target.field.is_empty() && !target.field.starts_with('E') {
        scan.tell_set_in_part(line, what);
    } else if target.field.is_empty() && uses.moved.contains(&key) && !is_literal {
        scan.tell_computed(line, what);
    } else if target.field.starts_with('E') && target.field.len() == 2 && is_position {
        scan.tell_axis_set(line, what);
    }
}
