//! KRL: `.src` and `.dat`.

mod aggregate;
mod frames;
mod literals;
mod statement;
mod uses;

use crate::flow::{Step, follow};
use crate::scan::{Frame, Marks, Scan, Source, WRITE_OUT};
use frames::{Assigned, Forms, settings, written};
use literals::{literal, within};
use statement::{Destination, Statement, Target, statements};
use uses::{Key, Uses};

pub const MARKS: Marks = Marks { comment: b";", quotes: b"\"" };

/// Positions of the controller at which the robot stands already.
const HERE: [&str; 5] = ["$AXIS_ACT", "$POS_ACT", "$AXIS_FOR", "$POS_FOR", "$AXIS_RET"];

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
            Step::Set(frame, name) => uses.assigned.push(Assigned { frame: *frame, name: name.clone() }),
            Step::Use(_, own) => {
                let named = [Frame::Tool, Frame::Base].into_iter().zip(own);
                uses.assigned.extend(named.filter_map(|(frame, name)| Some(Assigned { frame, name: name.clone()? })));
            }
            _ => {}
        }
    }
    sources.iter().map(|source| scan_file(source, &uses, &forms)).collect()
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
