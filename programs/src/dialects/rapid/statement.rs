//! Statements of RAPID: motions with their positions and frames, and the targets of assignments.

use std::ops::Range;

use crate::scan::{Name, Text, is_of_name};

/// A line of the table of motions.
type Instruction = (&'static str, usize, usize, Option<usize>);

/// Motions: the name, how many arguments stand before the positions, the number of positions, and how many arguments stand
/// between the positions and the tool, if it is not the last one.
const MOTIONS: [Instruction; 44] = [
    ("MOVEJ", 0, 1, Some(2)),
    ("MOVEL", 0, 1, Some(2)),
    ("MOVEC", 0, 2, Some(2)),
    ("MOVEABSJ", 0, 1, Some(2)),
    ("MOVEJDO", 0, 1, Some(2)),
    ("MOVELDO", 0, 1, Some(2)),
    ("MOVECDO", 0, 2, Some(2)),
    ("MOVEJSYNC", 0, 1, Some(2)),
    ("MOVELSYNC", 0, 1, Some(2)),
    ("MOVECSYNC", 0, 2, Some(2)),
    ("MOVEJAO", 0, 1, Some(2)),
    ("MOVELAO", 0, 1, Some(2)),
    ("MOVECAO", 0, 2, Some(2)),
    ("MOVEJGO", 0, 1, Some(2)),
    ("MOVELGO", 0, 1, Some(2)),
    ("MOVECGO", 0, 2, Some(2)),
    ("TRIGGJ", 0, 1, None),
    ("TRIGGL", 0, 1, None),
    ("TRIGGC", 0, 2, None),
    ("TRIGGABSJ", 0, 1, None),
    ("TRIGGJIOS", 0, 1, None),
    ("TRIGGLIOS", 0, 1, None),
    ("SEARCHL", 2, 1, Some(1)),
    ("SEARCHC", 2, 2, Some(1)),
    ("ARCL", 0, 1, None),
    ("ARCC", 0, 2, None),
    ("ARCLSTART", 0, 1, None),
    ("ARCCSTART", 0, 2, None),
    ("ARCLEND", 0, 1, None),
    ("ARCCEND", 0, 2, None),
    ("ARCL1", 0, 1, None),
    ("ARCC1", 0, 2, None),
    ("SPOTL", 0, 1, None),
    ("SPOTJ", 0, 1, None),
    ("SPOTML", 0, 1, None),
    ("SPOTMJ", 0, 1, None),
    ("DISPL", 0, 1, None),
    ("DISPC", 0, 2, None),
    ("PAINTL", 0, 1, None),
    ("PAINTC", 0, 2, None),
    ("CAPL", 0, 1, None),
    ("CAPC", 0, 2, None),
    ("NUTL", 0, 1, None),
    ("NUTJ", 0, 1, None),
];
/// A statement up to its semicolon.
pub struct Statement {
    pub at: Range<usize>,
    pub capitals: String,
}

/// A motion: its instruction, its positions, and the names of its tool and work object.
pub struct Motion {
    pub verb: &'static str,
    pub positions: Vec<Range<usize>>,
    pub frames: [Option<Name>; 2],
}

/// Words with which the head of a routine begins.
const ROUTINES: [&str; 5] = ["PROC ", "FUNC ", "TRAP ", "LOCAL PROC ", "LOCAL FUNC "];

pub fn statements(text: &Text) -> Vec<Statement> {
    let mut from = 0;
    let ends = text.bytes().iter().enumerate().filter(|(_, b)| **b == b';').map(|(k, _)| k);
    let mut statements = Vec::new();
    for end in ends.chain([text.bytes().len()]) {
        // A block's head (PROC, IF ... THEN) stands before the statement on a line of its own.
        let mut at = text.trimmed(from..end);
        while let Some(k) = text.bytes()[at.clone()].iter().position(|b| *b == b'\n') {
            let first = text.capitals(at.start..at.start + k);
            if ROUTINES.iter().any(|word| first.starts_with(word)) {
                // Its parameters may go on over several lines.
                let close = text.bytes()[at.clone()].iter().position(|b| *b == b')').unwrap_or(k);
                at = text.trimmed(at.start + close.max(k.min(close)) + 1..at.end);
                continue;
            }
            if first.contains('[') || first.contains(":=") || motion_word(&first).is_some() || first.ends_with(',') {
                break;
            }
            at = text.trimmed(at.start + k..at.end);
        }
        statements.push(Statement { capitals: text.capitals(at.clone()), at });
        from = (end + 1).min(text.bytes().len());
    }
    statements
}

/// The motion of a statement: its place, and its line in the table. It may stand behind a condition (IF ready MoveL ...).
fn motion_word(capitals: &str) -> Option<(usize, &'static Instruction)> {
    let mut depth = 0_usize;
    let bytes = capitals.as_bytes();
    for (at, byte) in bytes.iter().enumerate() {
        match byte {
            b'(' | b'[' | b'{' => depth += 1,
            b')' | b']' | b'}' => depth = depth.saturating_sub(1),
            b':' | b',' if depth == 0 => return None,
            _ => {}
        }
        let begins = depth == 0
            && byte.is_ascii_alphabetic()
            && (at == 0 || bytes[at - 1].is_ascii_whitespace() || bytes[at - 1] == b')');
        if begins {
            let length = bytes[at..].iter().take_while(|b| is_of_name(**b)).count();
            let word = &capitals[at..at + length];
            let ends = bytes.get(at + length).is_none_or(|b| b.is_ascii_whitespace() || *b == b'\\' || *b == b'[');
            if ends && let Some(found) = MOTIONS.iter().find(|(name, ..)| *name == word) {
                return Some((at, found));
            }
        }
    }
    None
}

impl Statement {
    pub fn motion(&self, text: &Text) -> Option<Motion> {
        let (at, (verb, skipped, count, to_tool)) = motion_word(&self.capitals)?;
        let places = text.parts(self.at.start + at + verb.len()..self.at.end);
        let mut work = None;
        for place in &places {
            let tight: String = text.words(place.clone()).chars().filter(|c| !c.is_whitespace()).collect();
            let capitals = tight.to_ascii_uppercase();
            if let Some(k) = capitals.find("\\WOBJ:=") {
                work = tight.get(k + 7..).map(|name| name.split('\\').next().unwrap_or(name).to_owned());
            }
        }
        // Without optional arguments, of which some stand alone (\Stop, \Conc,).
        let plain = |place: Range<usize>| {
            let end = text.bytes()[place.clone()].iter().position(|b| *b == b'\\').map_or(place.end, |k| place.start + k);
            Some(text.trimmed(place.start..end)).filter(|at| !at.is_empty())
        };
        let arguments: Vec<Range<usize>> = places.into_iter().filter_map(plain).skip(*skipped).collect();
        let tool = match to_tool {
            Some(between) => arguments.get(count + between),
            None => arguments.last().filter(|_| arguments.len() > *count),
        };
        let name = |shown: String| Name::new(shown.to_ascii_uppercase(), shown);
        let work = work.or_else(|| (!verb.contains("ABSJ")).then(|| "wobj0".to_owned()));
        let frames = [tool.map(|at| name(text.words(at.clone()))), work.map(name)];
        Some(Motion { verb, positions: arguments.into_iter().take(*count).collect(), frames })
    }

    /// The target of an assignment in capitals: its name with its index, if it has one, and the component that is set.
    pub fn target(&self) -> Option<(String, String)> {
        let (left, _) = self.capitals.split_once(":=").filter(|_| motion_word(&self.capitals).is_none())?;
        let left: String = left.replace(" .", ".").replace(". ", ".").replace(" {", "{").replace("{ ", "{");
        let left: String = left.replace(" }", "}").replace(" ,", ",").replace(", ", ",");
        let word = left.trim_end().rsplit(|c: char| c.is_whitespace()).next()?;
        let (name, rest) = word.split_once('.').unwrap_or((word, ""));
        Some((name.to_owned(), rest.to_owned()))
    }
}

/// A name without index or component.
pub fn root_of(name: &str) -> &str {
    name.split(['{', '.']).next().unwrap_or(name).trim()
}
