//! The tool and the base of every position: as given by the user, as written out in a program, or in nobody's hand.

use std::collections::{BTreeMap, BTreeSet, HashMap};

use super::scan::{Frame, Name, Position, Remark, Scan, Setting, Stands};
use calibench::robot::{FramePose, Pose, rotation_vector};
use calibench::units::{DEG, MM};

/// Frames of a program nearer to each other than this (m, rad) are the same: programs have three decimals.
const SAME_FRAME: [f64; 2] = [0.05 * MM, 0.02 * DEG];

/// Words for tool and base, and the option that gives each.
const WORDS: [(&str, &str); 2] = [("tool", "--tool"), ("base", "--base")];

/// Where a frame is.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Place {
    /// As the user gave it, or by default.
    Own,
    /// Here.
    At(Pose),
}

/// Frames that the user gave for a call.
pub(super) struct Given<'a> {
    /// Whether tool and base were given for all positions.
    pub is: [bool; 2],
    /// Tool on the flange, and base on the robot's base link.
    pub own: [Pose; 2],
    /// From files of frames, which come before the program's own numbers.
    pub listed: &'a [Setting],
}

/// What is known of the frames of all files.
pub(super) struct Frames<'a> {
    given: Given<'a>,
    known: HashMap<(Frame, String), Vec<Known>>,
    /// Names in use.
    used: [BTreeSet<Name>; 2],
    /// The name that the frame given by the user has, if one name has it.
    of_given: [Option<Name>; 2],
    /// Frames of which has been told already.
    told: BTreeSet<(Frame, Name)>,
    /// What is told of frames, by the index of the file.
    pub remarks: BTreeMap<usize, Vec<Remark>>,
}

/// A frame as a file has it; none of a file of frames.
#[derive(Clone)]
struct Known {
    file: Option<usize>,
    setting: Setting,
}

impl Known {
    fn pose(&self) -> Option<Pose> {
        match self.setting.stands {
            Stands::At(pose) => Some(pose),
            _ => None,
        }
    }
}

/// A line of a file.
#[derive(Clone, Copy)]
pub(super) struct Line {
    pub file: usize,
    pub line: usize,
}

/// The reason why a position stays; already told where it is of a frame.
pub(super) enum Lacks {
    Told,
    Because(String, &'static str),
}

impl<'a> Frames<'a> {
    pub fn of(scans: &[Scan], given: Given<'a>) -> Self {
        let mut known: HashMap<(Frame, String), Vec<Known>> = HashMap::new();
        let of = |setting: &Setting| (setting.frame, setting.name.key.clone());
        for (file, scan) in scans.iter().enumerate() {
            for setting in &scan.settings {
                known.entry(of(setting)).or_default().push(Known { file: Some(file), setting: setting.clone() });
            }
        }
        for setting in given.listed {
            // What the program changes at run time or cannot have is not made good by a number.
            let others = known.entry(of(setting)).or_default();
            others.retain(|known| matches!(known.setting.stands, Stands::Not(_) | Stands::Computed));
            others.push(Known { file: None, setting: setting.clone() });
        }
        let mut used: [BTreeSet<Name>; 2] = Default::default();
        for position in scans.iter().flat_map(|scan| scan.positions.iter().chain(&scan.left)) {
            used[0].extend(position.frames[0].iter().cloned());
            if !position.is_joints() {
                used[1].extend(position.frames[1].iter().cloned());
            }
        }
        let (told, remarks) = (BTreeSet::new(), BTreeMap::new());
        let mut frames = Frames { given, known, used, of_given: [None, None], told, remarks };
        for frame in [Frame::Tool, Frame::Base] {
            let k = frame as usize;
            let named: Vec<&Name> = frames.used[k].iter().filter(|name| !frames.is_null(frame, name)).collect();
            frames.of_given[k] = match (&named[..], frames.given.is[k]) {
                ([only], true) => Some((*only).clone()),
                ([], true) => frames.used[k].iter().next().cloned().filter(|_| frames.used[k].len() == 1),
                _ => None,
            };
        }
        frames
    }

    fn settings(&self, frame: Frame, name: &Name) -> &[Known] {
        self.known.get(&(frame, name.key.clone())).map_or(&[], Vec::as_slice)
    }

    fn is_null(&self, frame: Frame, name: &Name) -> bool {
        self.settings(frame, name).iter().any(|s| s.setting.stands == Stands::Null)
    }

    /// True if a position has the robot's base link by this name, and nobody gave other numbers for it.
    pub fn is_base_link(&self, name: &Name) -> bool {
        let k = Frame::Base as usize;
        self.is_null(Frame::Base, name) && self.used[k].contains(name) && self.of_given[k].as_ref() != Some(name)
    }

    /// The tool and the base of a position.
    ///
    /// # Errors
    /// When one of them is unknown, or stands where nothing can be compensated.
    pub fn places(&mut self, position: &Position, file: usize) -> Result<[Place; 2], Lacks> {
        let [tool, base] = [Frame::Tool, Frame::Base].map(|frame| self.place(frame, position, file));
        Ok([tool?, base?])
    }

    fn place(&mut self, frame: Frame, position: &Position, file: usize) -> Result<Place, Lacks> {
        let k = frame as usize;
        if frame == Frame::Base && position.is_joints() {
            return Ok(Place::Own);
        }
        let (word, _) = WORDS[k];
        let mut names: Vec<Name> = position.frames[k].iter().cloned().collect();
        if names.is_empty() {
            // Before a program sets any, and in files without motions.
            names = match self.used[k].len() {
                0 => return Ok(Place::Own),
                1 => self.used[k].iter().cloned().collect(),
                _ if position.is_joints() => return Ok(Place::Own),
                _ => {
                    let reason = format!("no motion of the files given says which {word} it has, and they use several");
                    return Err(Lacks::Because(reason, "give the files with its motions too"));
                }
            };
        }
        let mut places: Vec<(Name, Place)> = Vec::new();
        for name in names {
            let place = self.named(frame, &name, Line { file, line: position.line })?;
            places.push((name, place));
        }
        let (first, rest) = places.split_first().ok_or(Lacks::Told)?;
        if let Some((other, _)) = rest.iter().find(|(_, place)| !self.are_same(frame, place, &first.1)) {
            let reason = format!("it is used with several {word}s: {} and {}", first.0.shown, other.shown);
            return Err(Lacks::Because(reason, "use a position of its own for each"));
        }
        Ok(first.1.clone())
    }

    fn are_same(&self, frame: Frame, a: &Place, b: &Place) -> bool {
        let pose = |place: &Place| match place {
            Place::Own => self.given.own[frame as usize],
            Place::At(pose) => *pose,
        };
        are_same(&pose(a), &pose(b))
    }

    /// The place of a frame by its name; told once where it has none, at the first position that has it.
    fn named(&mut self, frame: Frame, name: &Name, here: Line) -> Result<Place, Lacks> {
        let k = frame as usize;
        let (word, option) = WORDS[k];
        let settings = self.settings(frame, name).to_vec();
        let line_of = |known: &Known| known.file.map_or(here, |file| Line { file, line: known.setting.line });
        let find = |stands: fn(&Stands) -> bool| settings.iter().find(|s| stands(&s.setting.stands));
        let poses: Vec<(Line, Pose)> = settings.iter().filter_map(|s| Some((line_of(s), s.pose()?))).collect();
        let computed = find(|s| *s == Stands::Computed).map(line_of);
        if let Some(Stands::Not(reason)) = find(|s| matches!(s, Stands::Not(_))).map(|s| &s.setting.stands) {
            return self.refuse(frame, name, here, reason, "compensate the other positions, in a program of their own");
        }
        if self.of_given[k].as_ref() == Some(name) {
            let own = self.given.own[k];
            let other = poses.iter().find(|(_, pose)| !are_same(pose, &own)).filter(|_| computed.is_none());
            if let Some((line, pose)) = other {
                let reason = format!("the program sets another {word} than the one given");
                let remedy = format!("give {option}={}, or leave {option} out", in_words(pose));
                let what = if name.shown.starts_with('$') { word.to_owned() } else { format!("{word} {}", name.shown) };
                return self.refuse(frame, &Name { shown: what, ..name.clone() }, *line, &reason, &remedy);
            }
            if let Some(line) = computed {
                self.tell_taken(frame, name, line, &name.shown);
            }
            return Ok(Place::Own);
        }
        let listed = settings.iter().find(|known| known.file.is_none()).and_then(Known::pose);
        if let (Some(pose), Some(line)) = (listed, computed) {
            let shown = find(|s| *s == Stands::Computed).map_or(&name.shown, |known| &known.setting.name.shown);
            self.tell_taken(frame, name, line, shown);
            return Ok(Place::At(pose));
        }
        match (&poses[..], computed) {
            (_, Some(line)) => {
                let reason = format!("this {word} is computed at run time, and nobody gave its numbers");
                self.refuse(frame, name, line, &reason, &self.remedy(frame))
            }
            ([], None) if self.is_null(frame, name) => Ok(Place::At(Pose::identity())),
            ([], None) => {
                let reason = format!("the numbers of this {word} are not in the files given");
                self.refuse(frame, name, here, &reason, &self.remedy(frame))
            }
            ([(_, first), rest @ ..], None) => match rest.iter().find(|(_, pose)| !are_same(pose, first)) {
                Some((line, _)) => {
                    let reason = format!("the files give this {word} twice, with other numbers");
                    self.refuse(frame, name, *line, &reason, "give the numbers that hold by --frames FILE")
                }
                None => Ok(Place::At(*first)),
            },
        }
    }

    /// Tells once of a frame that is set at run time, and of which the user gave numbers.
    fn tell_taken(&mut self, frame: Frame, name: &Name, line: Line, shown: &str) {
        let (word, _) = WORDS[frame as usize];
        let reason = format!("the {word} is computed at run time, and is taken to be the one given");
        let (what, remedy) = (shown.to_owned(), "check that it is".into());
        self.tell(frame, name, line.file, Remark { line: line.line, what, reason, remedy, blocks: false });
    }

    fn tell(&mut self, frame: Frame, name: &Name, file: usize, remark: Remark) {
        if self.told.insert((frame, name.clone())) {
            self.remarks.entry(file).or_default().push(remark);
        }
    }

    fn refuse<T>(&mut self, frame: Frame, name: &Name, line: Line, reason: &str, remedy: &str) -> Result<T, Lacks> {
        let (what, reason, remedy) = (name.shown.clone(), reason.into(), remedy.into());
        self.tell(frame, name, line.file, Remark { line: line.line, what, reason, remedy, blocks: true });
        Err(Lacks::Told)
    }

    fn remedy(&self, frame: Frame) -> String {
        let k = frame as usize;
        let (_, option) = WORDS[k];
        let named = self.used[k].iter().filter(|name| !self.is_null(frame, name)).count();
        if named > 1 {
            "give the file that has them, or --frames FILE, since one call has several".into()
        } else {
            format!("give {option}=X,Y,Z,A,B,C, the file that has them, or --frames FILE")
        }
    }

    /// Options that were given and hold for no position, since the program names several frames.
    pub fn idle(&self) -> Vec<(&'static str, String)> {
        let of = |frame: Frame| {
            let k = frame as usize;
            let is_idle = self.given.is[k] && self.used[k].len() > 1 && self.of_given[k].is_none();
            let (word, option) = WORDS[k];
            let names: Vec<&str> = self.used[k].iter().take(6).map(|name| name.shown.as_str()).collect();
            is_idle
                .then(|| (option, format!("the program uses several {word}s ({}), and {option} gives one", names.join(", "))))
        };
        [Frame::Tool, Frame::Base].into_iter().filter_map(of).collect()
    }

    /// Sentences on the frames that programs name: which is where.
    pub fn sentences(&self) -> Vec<String> {
        let mut sentences = Vec::new();
        for frame in [Frame::Tool, Frame::Base] {
            let k = frame as usize;
            let (word, option) = WORDS[k];
            if self.used[k].is_empty() {
                sentences.push(["every position is of the tool above", "every pose is in the base frame above"][k].to_owned());
            }
            for name in self.used[k].iter() {
                let settings = self.settings(frame, name);
                let at = settings.iter().find_map(Known::pose);
                if self.of_given[k].as_ref() == Some(name) {
                    sentences.push(format!("{} is the {word} given ({option})", name.shown));
                } else if let Some(pose) = at {
                    sentences.push(format!("{} is {word} {}", name.shown, in_words(&pose)));
                } else if self.is_null(frame, name) {
                    let of = ["the flange", "the robot's base link"][k];
                    sentences.push(format!("{} is {of}", name.shown));
                }
            }
        }
        sentences
    }
}

pub(super) fn are_same(a: &Pose, b: &Pose) -> bool {
    let apart = a.inverse() * b;
    let [position, angle] = SAME_FRAME;
    apart.translation.vector.norm() <= position && rotation_vector(&apart.rotation).norm() <= angle
}

/// X,Y,Z,A,B,C in mm and deg, as the options take them.
fn in_words(pose: &Pose) -> String {
    let FramePose { xyz, rz_ry_rx } = FramePose::from_pose(pose);
    let numbers = xyz.map(|v| v / MM).into_iter().chain(rz_ry_rx.map(|v| v / DEG));
    // Adding zero removes the sign of a negative zero.
    let numbers: Vec<String> = numbers.map(|v| format!("{}", (v * 1e6).round() / 1e6 + 0.0)).collect();
    numbers.join(",")
}
