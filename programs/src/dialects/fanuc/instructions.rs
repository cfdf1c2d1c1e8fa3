//! Instructions of FANUC's programs: motions, and what changes the frames and the positions.

use std::collections::{HashMap, HashSet};

use crate::flow::Step;
use crate::scan::{Frame, Name, Scan, Setting, Stands};

/// The keys of tool and frame in a position.
pub const KEYS: [&str; 2] = ["UT", "UF"];
/// What switches a tool and a frame on.
const SWITCHES: [[&str; 2]; 2] = [["UTOOL_NUM", "$MNUTOOLNUM"], ["UFRAME_NUM", "$MNUFRAMENUM"]];

/// Numbers of positions by file and name.
pub type Numbers = HashMap<(usize, String), usize>;

/// A position that is moved to.
pub struct Used {
    /// The line of the motion.
    pub line: usize,
    /// Its name.
    pub name: String,
}

/// What the instructions of a program say of its positions.
#[derive(Default)]
pub struct Uses {
    /// Distances (INC).
    pub relative: HashSet<String>,
    /// Positions that are moved to.
    pub used: Vec<Used>,
    /// Moved to together with another group.
    pub coordinated: HashSet<String>,
    /// The line of the first such motion.
    pub first_coordinated: Option<usize>,
    /// Set at run time.
    pub set: HashSet<String>,
}

/// The steps of a program through its frames.
pub struct Follower<'a> {
    /// Index of the file.
    pub file: usize,
    pub numbers: &'a mut Numbers,
    pub steps: &'a mut Vec<Step>,
}

impl Follower<'_> {
    fn see(&mut self, name: &str) {
        let next = self.numbers.len();
        let number = *self.numbers.entry((self.file, name.to_owned())).or_insert(next);
        self.steps.push(Step::Use(number, [None, None]));
    }

    /// What an instruction other than a motion does to the frames, and where execution goes.
    fn follow(&mut self, body: &str) {
        let tight: String = body.chars().filter(|c| !c.is_whitespace() && *c != ';').collect();
        let first = body.split([' ', '(', '[', ';', '=']).next().unwrap_or_default();
        match first {
            "FOR" => return self.steps.push(Step::Loop),
            "ENDFOR" => return self.steps.push(Step::Again),
            "ELSE" if tight == "ELSE" => return self.steps.push(Step::Other { is_last: true }),
            "ENDIF" => return self.steps.push(Step::Join),
            "END" | "ABORT" => return self.steps.push(Step::Leave),
            "IF" if tight.ends_with("THEN") => return self.steps.push(Step::Branch { is_side: true }),
            "LBL" => return self.steps.extend(number_behind(&tight, "LBL[").map(Step::Label)),
            _ => {}
        }
        let sets = |(frame, keys): (Frame, [&str; 2])| {
            let at = keys.iter().find_map(|key| Some(&tight[tight.find(key)?..]))?;
            let (_, number) = at.split_once('=')?;
            let number: String = number.trim_matches(['(', ')']).to_owned();
            Some(Step::Set(frame, named(frame, &number)))
        };
        let mut own: Vec<Step> = [Frame::Tool, Frame::Base].into_iter().zip(SWITCHES).filter_map(sets).collect();
        own.extend(words_behind(body, "CALL ").into_iter().chain(words_behind(body, "RUN ")).map(Step::Call));
        let is_conditional = !["CALL", "RUN", "JMP", "UTOOL_NUM", "UFRAME_NUM"].contains(&first) && !first.starts_with('$');
        if is_conditional && !own.is_empty() {
            self.steps.push(Step::Branch { is_side: true });
            self.steps.extend(own);
            self.steps.push(Step::Join);
        } else {
            self.steps.extend(own);
        }
        let mut rest = tight.as_str();
        while let Some(at) = rest.find("JMPLBL[") {
            rest = &rest[at..];
            let always = !is_conditional;
            self.steps.extend(number_behind(rest, "JMPLBL[").map(|label| Step::Jump { label, always }));
            rest = &rest[1..];
        }
    }
}

/// The tool or frame of a number.
pub fn named(frame: Frame, number: &str) -> Name {
    let name = format!("{} {number}", KEYS[frame as usize]);
    Name::new(name.clone(), name)
}

/// The number in brackets behind a word, without its comment: `LBL[3:home]`.
fn number_behind(text: &str, word: &str) -> Option<String> {
    let rest = text.split_once(word)?.1;
    Some(rest.split([']', ':']).next()?.to_owned())
}

/// The names that follow a word.
fn words_behind(text: &str, word: &str) -> Vec<String> {
    let is_whole = |at: usize| !text[..at].ends_with(|c: char| c.is_ascii_alphanumeric() || c == '_');
    let name =
        |at: usize| text[at + word.len()..].trim_start().split([' ', '(', ';', ',']).next().unwrap_or_default().to_owned();
    text.match_indices(word).filter(|(at, _)| is_whole(*at)).map(|(at, _)| name(at)).filter(|name| !name.is_empty()).collect()
}

/// An instruction: what moves relatively, by offsets, or to registers, and what the frames are.
pub fn instruction(line: usize, body: &str, uses: &mut Uses, follower: &mut Follower<'_>, scan: &mut Scan) {
    let body = body.trim_start();
    if body.starts_with('!') || body.starts_with("//") || body.starts_with("--") {
        return;
    }
    let is_motion = ["J ", "L ", "C ", "A ", "S ", "J P", "L P", "C P", "A P"].iter().any(|verb| body.starts_with(verb));
    if is_motion {
        motion(line, body, uses, follower, scan);
    } else {
        follower.follow(body);
        changes(line, body, uses, scan);
    }
}

/// Frames and positions that are set at run time.
fn changes(line: usize, body: &str, uses: &mut Uses, scan: &mut Scan) {
    let tight: String = body.chars().filter(|c| !c.is_whitespace()).collect();
    for (frame, list) in [(Frame::Tool, "UTOOL["), (Frame::Base, "UFRAME[")] {
        let set = tight.strip_prefix(list).and_then(|rest| rest.split_once("]="));
        if let Some((number, _)) = set {
            let shown = format!("{list}{number}]");
            // The group may stand before the number: UFRAME[GP1:6].
            let number = number.rsplit(':').next().unwrap_or(number);
            let name = Name::new(named(frame, number).key, shown);
            scan.settings.push(Setting { line, frame, name, stands: Stands::Computed });
        }
    }
    if body.starts_with("PR[") || body.starts_with("P[") {
        let named = places(body);
        if let Some(name) = named.first().filter(|name| name.starts_with("P[")) {
            uses.set.insert(name.split(',').next().map_or_else(String::new, |n| format!("{}]", n.trim_end_matches(']'))));
        }
        let remedy = "check what the program does with it";
        scan.warn(line, body.chars().take(40).collect::<String>(), "positions are computed at run time", remedy);
    }
}

fn motion(line: usize, body: &str, uses: &mut Uses, follower: &mut Follower<'_>, scan: &mut Scan) {
    let named = places(body);
    let words: Vec<&str> = body.split([' ', ',', ';']).collect();
    let has = |word: &str| words.iter().any(|w| w.starts_with(word));
    if words.contains(&"INC") {
        uses.relative.extend(named.iter().filter(|name| name.starts_with("P[")).cloned());
        scan.warn(line, "INC", "a relative motion is left as it is", "start it from a compensated position, and keep it short");
    }
    if words.iter().any(|w| *w == "COORD" || w.starts_with("COORD[")) {
        uses.coordinated.extend(named.iter().filter(|name| name.starts_with("P[")).cloned());
        uses.first_coordinated.get_or_insert(line);
    }
    if has("OFFSET") || has("TOOL_OFFSET") || has("VOFFSET") {
        let reason = "an offset is added at run time; the position is compensated for where it stands without it";
        scan.warn(line, "Offset", reason, "write out the positions that are to be compensated");
    }
    for name in named {
        if name.starts_with("PR[") {
            let reason = "the motion goes to a position register, which is not part of the file";
            scan.warn(line, name, reason, "use positions P[n], if they are to be compensated");
        } else if name.contains("R[") {
            scan.warn(line, name, "the number of the position is computed at run time", "check that it is one of this file");
        } else {
            follower.see(&name);
            uses.used.push(Used { line, name });
        }
    }
    // A search that finds nothing goes on at a label.
    let tight: String = body.chars().filter(|c| !c.is_whitespace()).collect();
    for word in ["SKIP,LBL[", "SKIPJUMP,LBL[", "TIMEOUT,LBL["] {
        follower.steps.extend(number_behind(&tight, word).map(|label| Step::Jump { label, always: false }));
    }
}

/// The positions and position registers named before the speed, as `P[3]`, `PR[1]`, `P[R[2]]`.
fn places(body: &str) -> Vec<String> {
    let mut found = Vec::new();
    let mut rest = body;
    while let Some(at) = rest.find("P[").or(rest.find("PR[")) {
        let at = rest.find("PR[").map_or(at, |register| register.min(at));
        let follows_word = rest[..at].ends_with(|c: char| c.is_ascii_alphanumeric() || c == '_');
        let from = &rest[at..];
        let Some(end) = from.find(']') else { break };
        // An offset's register, `Offset,PR[1]`, is not a destination.
        if !follows_word && !rest[..at].trim_end().ends_with(',') {
            let name = from[..end].split(':').next().unwrap_or("");
            found.push(format!("{name}]"));
        }
        rest = &from[end..];
    }
    found
}
