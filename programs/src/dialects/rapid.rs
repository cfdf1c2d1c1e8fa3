//! RAPID: `.mod`, `.modx`, `.prg`.

mod frames;
mod statement;

use std::collections::{BTreeSet, HashMap, HashSet};

use crate::scan::{
    Brackets, Configuration, Frame, Layout, Marks, Name, Number, Position, Scan, Setting, Source, Stands, Text, WRITE_OUT,
    home_of, is_name, names,
};

use frames::frames;
use statement::{Statement, root_of, statements};

pub const MARKS: Marks = Marks { comment: b"!", quotes: b"\"" };

/// Fields of a position that are numbers of its pose.
const PARTS: [&str; 4] = ["TRANS", "ROT", "ROBCONF", "ROBAX"];
/// The motion of external axes alone, where the arm stays.
const EXTERNAL: &str = "MOVEEXTJ";
/// Words with which a declaration begins.
const DECLARING: [&str; 5] = ["CONST ", "PERS ", "VAR ", "LOCAL ", "TASK "];
/// Program displacements.
const DISPLACED: [&str; 4] = ["PDISPON", "PDISPSET", "EOFFSON", "EOFFSSET"];

/// A group in brackets with the groups directly in it.
struct Group {
    at: Brackets,
    inner: Vec<Brackets>,
    /// Where the outermost group around it begins.
    outermost: usize,
    /// Its place in every group around it, from the outermost inwards, counted from 1.
    path: Vec<usize>,
}

/// A name in its module, with its index if it is an element of an array: `P{2}`.
type Key = (usize, String);

/// Names, of which those with an index are elements: of an array without one, all.
#[derive(Default)]
struct Names {
    /// As they stand.
    exact: HashSet<Key>,
    /// Without index.
    roots: HashSet<Key>,
}

impl Names {
    fn insert(&mut self, key: Key) {
        self.roots.insert(root(&key));
        self.exact.insert(key);
    }

    /// True if a name, one of its elements, or the array of which it is one is among them.
    fn contains(&self, key: &Key) -> bool {
        match root(key) {
            root if root == *key => self.roots.contains(key),
            root => self.exact.contains(key) || self.exact.contains(&root),
        }
    }
}

/// The array of an element; otherwise the same.
fn root((module, name): &Key) -> Key {
    (*module, root_of(name).to_owned())
}

/// Names used by the motions of all files.
#[derive(Default)]
struct Uses {
    /// Number of modules, at most.
    modules: usize,
    moved: Names,
    /// Positions written out, and arrays of them, by module and without index.
    written: HashSet<Key>,
    /// Of which single numbers are set at run time.
    parts: Names,
    /// Set as a whole at run time.
    computed: Names,
    /// Of which a motion uses the external axes alone.
    external: Names,
    /// Used by a statement: its text.
    used: HashMap<Key, String>,
    frames: HashMap<Key, [BTreeSet<Name>; 2]>,
    has_motions: bool,
}

pub fn scan(sources: &[Source]) -> Vec<Scan> {
    let mut uses = Uses { modules: sources.len(), ..Uses::default() };
    for source in sources {
        let named = positions(&source.text).into_iter().filter_map(|(group, _)| assigned(&source.text, group.outermost));
        uses.written.extend(named.map(|name| (source.module, name)));
    }
    for source in sources {
        statements(&source.text).iter().for_each(|s| uses.see(source, s));
    }
    sources.iter().map(|source| scan_file(source, &uses)).collect()
}

impl Uses {
    /// The key of a name, which may have an index (kept if it is written in digits) and components.
    fn key(&self, module: usize, name: &str) -> Key {
        let home = home_of(&self.written, self.modules, module, root_of(name));
        (home, root_of(name).to_owned() + &index_of(name).unwrap_or_default())
    }

    /// The text of a statement that uses a position.
    fn user(&self, key: &Key) -> Option<&String> {
        self.used.get(key).or_else(|| self.used.get(&root(key)))
    }

    /// The frames in which the motions use a position.
    fn frames_of(&self, key: &Key) -> [BTreeSet<Name>; 2] {
        let mut all = self.frames.get(key).cloned().unwrap_or_default();
        if let Some(of_array) = self.frames.get(&root(key)).filter(|_| root(key) != *key) {
            all.iter_mut().zip(of_array).for_each(|(all, more)| all.extend(more.iter().cloned()));
        }
        all
    }

    /// The positions that a statement names, but for the one that it sets.
    fn mention(&mut self, source: &Source, statement: &Statement) {
        let is_declared = DECLARING.iter().any(|word| statement.capitals.starts_with(word));
        let is_set = is_declared || statement.target().is_some_and(|(name, _)| is_name(root_of(&name)));
        let right = statement.capitals.split_once(":=").filter(|_| is_set).map(|(_, right)| right);
        let text = right.unwrap_or(&statement.capitals);
        for word in names(text) {
            let after = &text[word.as_ptr() as usize - text.as_ptr() as usize..];
            let index = after[word.len()..].starts_with('{').then(|| after.find('}')).flatten();
            let key = self.key(source.module, index.map_or(word, |end| &after[..=end]));
            if self.written.contains(&root(&key)) {
                self.used.entry(key).or_insert_with(|| source.text.words(statement.at.clone()));
            }
        }
    }

    fn see(&mut self, source: &Source, statement: &Statement) {
        let text = &source.text;
        if let Some(axes) = statement.capitals.strip_prefix(EXTERNAL) {
            let name = axes.split(',').next().unwrap_or("").trim();
            self.external.insert(self.key(source.module, name));
            return;
        }
        self.mention(source, statement);
        if let Some(motion) = statement.motion(text) {
            self.has_motions = true;
            for place in &motion.positions {
                let words = text.capitals(place.clone());
                // Offs(p10, ...) and RelTool(p10, ...) start from a position, in the same frames.
                let (from, is_offset) = offset_from(&words).map_or((words.as_str(), false), |from| (from, true));
                let key = self.key(source.module, from);
                self.frames
                    .entry(key.clone())
                    .or_default()
                    .iter_mut()
                    .zip(&motion.frames)
                    .for_each(|(all, one)| all.extend(one.clone()));
                if !is_offset || self.written.contains(&root(&key)) {
                    self.moved.insert(key);
                }
            }
            return;
        }
        let Some((name, component)) = statement.target() else { return };
        let key = self.key(source.module, &name);
        if component.split('.').any(|word| PARTS.contains(&word)) {
            self.parts.insert(key);
        } else if component.is_empty() && !positions_within(text, statement) {
            self.computed.insert(key);
        }
    }
}

/// The index of an element, `{2}` or `{1,2}`, without blanks; `None` if there is none in digits.
fn index_of(name: &str) -> Option<String> {
    let (_, rest) = name.split_once('{')?;
    let index: String = rest.split('}').next()?.chars().filter(|c| !c.is_whitespace()).collect();
    let is_digits = |part: &str| !part.is_empty() && part.bytes().all(|b| b.is_ascii_digit());
    index.split(',').all(is_digits).then(|| format!("{{{index}}}"))
}

/// The position from which `Offs(...)` or `RelTool(...)` starts.
fn offset_from(words: &str) -> Option<&str> {
    let (function, rest) = words.split_once('(')?;
    let first = rest.split(',').next()?.trim();
    (["OFFS", "RELTOOL"].contains(&function.trim()) && is_name(root_of(first))).then_some(first)
}

/// The name on the left of `:=` before a place, in capitals.
fn assigned(text: &Text, at: usize) -> Option<String> {
    let end = text.trimmed(0..at).end;
    let end = text.bytes()[..end].ends_with(b":=").then(|| text.trimmed(0..end - 2).end)?;
    let end = match text.bytes()[..end].last() {
        Some(b'}') => text.bytes()[..end].iter().rposition(|b| *b == b'{')?,
        _ => end,
    };
    let name = text.capitals(text.name_before(end));
    is_name(&name).then_some(name)
}

/// All groups that have the build of a robtarget (3, 4, 4, 6) or of a jointtarget (6, 6).
fn positions(text: &Text) -> Vec<(Group, bool)> {
    let pairs = text.brackets(*b"[]", Some(b';'));
    let mut groups: Vec<Group> = Vec::with_capacity(pairs.len());
    let mut open: Vec<usize> = Vec::new();
    for pair in pairs {
        while open.pop_if(|k| groups[*k].at.close < pair.open).is_some() {}
        let (mut outermost, mut path) = (pair.open, Vec::new());
        if let Some(outer) = open.last() {
            let outer = &mut groups[*outer];
            outer.inner.push(pair);
            outermost = outer.outermost;
            path = [outer.path.as_slice(), &[outer.inner.len()]].concat();
        }
        open.push(groups.len());
        groups.push(Group { at: pair, inner: Vec::new(), outermost, path });
    }
    let build = |group: &Group| {
        if !matches!(group.inner.len(), 2 | 4) || text.parts(group.at.inside()).len() != group.inner.len() {
            return None;
        }
        let lengths: Vec<usize> = group.inner.iter().map(|pair| text.parts(pair.inside()).len()).collect();
        match lengths[..] {
            [3, 4, 4, 6] => Some(true),
            [6, 6] => Some(false),
            _ => None,
        }
    };
    groups.into_iter().filter_map(|group| build(&group).map(|is_pose| (group, is_pose))).collect()
}

fn scan_file(source: &Source, uses: &Uses) -> Scan {
    let text = &source.text;
    let of = |frame, key: &str| Setting { line: 1, frame, name: Name::new(key, key), stands: Stands::Null };
    let mut scan = Scan { settings: vec![of(Frame::Tool, "TOOL0"), of(Frame::Base, "WOBJ0")], ..Scan::default() };
    let statements = statements(text);
    let mut read = HashSet::new();
    for (group, is_pose) in positions(text) {
        read.insert(group.at.open);
        let around = statements.partition_point(|s| s.at.start <= group.at.open).checked_sub(1).map(|k| &statements[k]);
        let assigned = assigned(text, group.outermost).map(|name| element(name, &group.path));
        let name = assigned.clone().unwrap_or_else(|| if is_pose { "robtarget" } else { "jointtarget" }.into());
        let key = assigned.map(|name| uses.key(source.module, &name));
        if key.as_ref().is_some_and(|key| uses.parts.contains(key)) {
            scan.unread += 1; // Told where the number is set.
            continue;
        }
        let stays = key.as_ref().filter(|key| !uses.moved.contains(key) && !uses.computed.contains(key));
        let is_external = key.is_none() && around.is_some_and(|s| s.capitals.starts_with(EXTERNAL));
        if is_external || stays.is_some_and(|key| uses.external.contains(key) && uses.user(key).is_none()) {
            scan.unread += 1; // The arm does not go there.
            continue;
        }
        if let Some(by) = stays.and_then(|key| uses.user(key)) {
            scan.leave_used(text.line(group.at.open), name, by);
            continue;
        }
        let Some(mut position) = position(text, &group, is_pose, name, &mut scan) else { continue };
        match &key {
            Some(key) => {
                position.frames = uses.frames_of(key);
                position.spare = uses.computed.contains(key) || uses.has_motions && !uses.moved.contains(key);
            }
            None => {
                let motion = around.and_then(|statement| statement.motion(text));
                position.frames = motion.map_or_else(Default::default, |m| m.frames.map(|name| name.into_iter().collect()));
            }
        }
        scan.positions.push(position);
    }
    for statement in &statements {
        let line = text.line(statement.at.start);
        told(source, statement, line, uses, &mut scan);
        not_read(text, statement, &read, &mut scan);
        frames(text, statement, line, &mut scan);
    }
    scan
}

/// The name of a position: that of an array with its index in it.
fn element(name: String, path: &[usize]) -> String {
    let index: Vec<String> = path.iter().map(ToString::to_string).collect();
    if index.is_empty() { name } else { format!("{name}{{{}}}", index.join(",")) }
}

fn position(text: &Text, group: &Group, is_pose: bool, name: String, scan: &mut Scan) -> Option<Position> {
    let line = text.line(group.at.open);
    let of = |k: usize| text.numbers(group.inner[k].inside());
    let numbers = if is_pose { of(0).zip(of(1)).map(|(xyz, q)| [xyz, q].concat()) } else { of(0) };
    let Some(numbers) = numbers else {
        scan.unreadable(line, name, "its numbers are not all written out", "write plain numbers, in mm and deg");
        return None;
    };
    let configuration = match is_pose.then(|| of(2)) {
        None => Configuration::Any,
        Some(conf) => {
            let conf: Option<[Number; 4]> = conf.and_then(|conf| conf.try_into().ok());
            let known = |conf: &[Number; 4]| conf.iter().all(|n| n.value.fract() == 0.0) && (0.0..8.0).contains(&conf[3].value);
            conf.filter(known).map_or(Configuration::Unreadable, Configuration::Abb)
        }
    };
    let axes = group.inner.last().map_or_else(Vec::new, |pair| text.parts(pair.inside()));
    let external = axes.into_iter().zip(["eax_a", "eax_b", "eax_c", "eax_d", "eax_e", "eax_f"]).find_map(|(at, axis)| {
        let stands = text.number(at.clone()).is_some_and(|n| n.value == 0.0 || n.value >= NO_AXIS);
        (!stands).then(|| format!("{axis} {}", text.words(at)))
    });
    let layout = if is_pose { Layout::AbbTarget } else { Layout::Degrees };
    Some(Position { configuration, external, ..Position::new(line, name, layout, numbers) })
}

/// Positions of external axes from here on mean that there is none; RAPID writes 9E9 (mm or deg).
const NO_AXIS: f64 = 8.9e9;

/// Positions in a motion that name a part of what they are made of; those with all parts in brackets begin at these places.
fn not_read(text: &Text, statement: &Statement, read: &HashSet<usize>, scan: &mut Scan) {
    let Some(motion) = statement.motion(text) else { return };
    for place in motion.positions {
        if text.bytes().get(place.start) == Some(&b'[') && !read.contains(&place.start) {
            let what: String = format!("{} {}", motion.verb, text.words(place.clone())).chars().take(60).collect();
            let reason = "a part of the position is a name, or is left out";
            scan.unreadable(text.line(place.start), what, reason, "write all its numbers out, in mm and deg");
        }
    }
}

/// Motions to what is not written out, displacements, and what is set at run time.
fn told(source: &Source, statement: &Statement, line: usize, uses: &Uses, scan: &mut Scan) {
    let text = &source.text;
    if let Some(displaced) = DISPLACED.iter().find(|word| statement.capitals.starts_with(*word)) {
        let reason = "positions are displaced at run time; they are compensated for where they stand without it";
        scan.warn(line, *displaced, reason, "write out the positions that are to be compensated");
    }
    let Some(motion) = statement.motion(text) else {
        let Some((name, component)) = statement.target() else { return };
        let key = uses.key(source.module, &name);
        let shown = text
            .words(statement.at.clone())
            .split(":=")
            .next()
            .unwrap_or("")
            .split_whitespace()
            .last()
            .unwrap_or("")
            .to_owned();
        let first = component.split('.').next().unwrap_or("");
        let is_position = || uses.moved.contains(&key) || uses.written.contains(&root(&key));
        if component.split('.').any(|word| PARTS.contains(&word)) && is_position() {
            scan.tell_set_in_part(line, shown);
        } else if component.split('.').any(|word| word == "EXTAX") && is_position() {
            scan.tell_axis_set(line, shown);
        } else if ["TFRAME", "UFRAME", "OFRAME"].contains(&first) {
            let which = if first == "TFRAME" { "the tool" } else { "the work object" };
            scan.tell_frame_changed(line, shown, which);
        } else if component.is_empty() && uses.moved.contains(&key) && !positions_within(text, statement) {
            scan.tell_computed(line, shown);
        }
        return;
    };
    for place in motion.positions {
        let (words, capitals) = (text.words(place.clone()), text.capitals(place));
        let is_written = |name: &str| is_name(name) && uses.written.contains(&uses.key(source.module, name));
        let key = uses.key(source.module, &capitals);
        // What is computed is told where it is.
        let is_told = uses.computed.contains(&key) || uses.parts.contains(&key);
        if capitals.starts_with('[') || is_told || is_written(root_of(&capitals)) {
            continue;
        }
        let what: String = format!("{} {words}", motion.verb).chars().take(60).collect();
        if offset_from(&capitals).is_some_and(|from| is_written(root_of(from))) {
            let reason = "an offset from a position that is compensated: the offset itself is as it was";
            scan.warn(line, what, reason, "keep it short, or write the position out");
        } else {
            scan.warn(line, what, "the motion goes to a position that is not written out in the files given", WRITE_OUT);
        }
    }
}

fn positions_within(text: &Text, statement: &Statement) -> bool {
    text.bytes()[statement.at.clone()].contains(&b'[')
}
