//! Positions of KRL that are written out.

use super::aggregate::Aggregate;
use super::frames::Forms;
use super::statement::{Destination, Statement};
use super::uses::Uses;
use crate::scan::{Brackets, Position, Scan, Source};

/// An aggregate within another one: told where it is a position, as of a structure; a load's frames are none.
pub fn within(source: &Source, statement: &Statement, pair: Brackets, uses: &Uses, scan: &mut Scan) {
    let content = Aggregate::parse(&source.text, pair);
    let Some(target) = statement.target(&source.text).filter(|_| content.is_place()) else { return };
    let is_moved = uses.moved.contains(&uses.key(source.module, &target.root, &target.root));
    if is_moved || content.has_status() || content.has_axes() {
        let reason = "it holds a position within a structure, which is left as it is";
        scan.unreadable(statement.line, target.indexed, reason, "declare the position as an E6POS of its own");
    }
}

/// A literal in braces: a position, or something else.
pub fn literal(source: &Source, statement: &Statement, pair: Brackets, uses: &Uses, forms: &Forms, scan: &mut Scan) {
    let (text, line) = (&source.text, statement.line);
    let content = Aggregate::parse(text, pair);
    if !content.is_place() || statement.is_relative() {
        return;
    }
    if statement.begins_block() {
        return; // A frame, for its segments.
    }
    if statement.motion().is_some() {
        let is_here = |d: &Destination| matches!(d, Destination::Literal(at) if at.start == pair.open);
        if statement.destinations(text).iter().any(is_here) {
            let key = (usize::MAX - source.file, format!("{}", pair.open));
            if let Some(mut position) = content.position(text, line, statement.verb(), scan) {
                position.frames = uses.frames_of(&key).cloned().unwrap_or_default();
                scan.positions.push(position);
            }
        }
        return; // Otherwise arithmetic, which is told with the motion.
    }
    let Some(target) = statement.target(text) else {
        return told(line, statement.verb(), scan);
    };
    if target.root.starts_with('$')
        || target.root.starts_with("TOOL_")
        || target.root.starts_with("BASE_")
        || target.root == "FDAT_ACT"
    {
        return;
    }
    if target.right != (pair.open..pair.close + 1) {
        return; // A part of an expression, which is told as such.
    }
    let key = uses.key(source.module, &target.root, &target.root);
    let one = (key.0, target.indexed.clone());
    let is_position = uses.moved.contains(&key)
        || ((content.has_status() || content.has_axes() || uses.typed.contains(&key)) && !uses.in_frames.contains(&key));
    if !is_position {
        if !uses.in_frames.contains(&key) {
            told(line, &target.indexed, scan);
        }
        return;
    }
    if uses.is_set_in_part(&key, &target.indexed) {
        scan.unread += 1; // Told where the number is set.
        return;
    }
    let frames = uses.frames_of(&one).or_else(|| uses.frames_of(&key)).cloned();
    let is_free = !uses.moved.contains(&key) && !uses.computed.contains(&key) && frames.is_none();
    if let Some(by) = uses.used.get(&key).filter(|_| is_free) {
        return scan.leave_used(line, target.indexed, by);
    }
    if uses.in_frames.contains(&key) {
        let reason = "it is part of a frame or of an expression too, which changes with it";
        scan.warn(line, target.indexed.as_str(), reason, "keep a copy of the position for the frame");
    }
    let Some(position) = content.position(text, line, &target.indexed, scan) else { return };
    let frames = frames.unwrap_or_else(|| {
        // The form of an inline motion has the number of its point: XP1 and FP1.
        let form = target.indexed.strip_prefix('X').and_then(|name| forms.find(source.module, &format!("F{name}")));
        form.map_or_else(Default::default, |form| form.clone().map(|name| name.into_iter().collect()))
    });
    let unused = uses.has_motions && !uses.moved.contains(&key);
    scan.positions.push(Position { frames, spare: unused || uses.computed.contains(&key), ..position });
}

fn told(line: usize, name: &str, scan: &mut Scan) {
    let reason = "it is not a POS, E6POS, AXIS or E6AXIS, and no motion of the files given goes there";
    scan.warn(line, name, reason, "give the file with its motions too, if it is a position");
}
