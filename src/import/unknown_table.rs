//! A table of which nothing is known: how it is written, and what its columns may be by their names and numbers.

use std::path::Path;

use super::joint_names;
use super::source::{Layout, finite_number as number, is_workbook, open_source};
use crate::files::{FileError, Rows, read_foreign_text};
use crate::robot::{JointKind, Robot};

/// Number of rows that are examined.
const ROWS: usize = 2_000;

/// Words for positions that were commanded.
pub(super) const TARGETS: [&str; 7] = ["target", "goal", "cmd", "command", "nominal", "desired", "plan"];

/// Names of positions whose coordinates are numbered.
const VECTORS: [&str; 5] = ["tvec", "t", "trans", "translation", "position"];

/// Number of triples of columns that are tried as positions.
const MOST_TRIPLES: usize = 8;

/// A column of the table.
pub(super) struct TableColumn {
    /// Place, counted from 1.
    pub place: usize,
    /// Title, and without its unit; empty in a table without a header.
    pub title: String,
    pub stem: String,
    /// Unit in the title.
    pub unit: Option<&'static str>,
    /// True if every entry is `fit` or `validation`, and both occur.
    pub is_set: bool,
    /// The different entries of a column of few, in their order.
    pub labels: Vec<String>,
    /// Largest number; `None` if more entries than may have failed are not numbers.
    pub largest: Option<f64>,
    /// Place of the last digit of its numbers, in its unit: 0.001 of numbers with three digits after the point.
    pub last_digit: f64,
}

/// Number of lines that are looked at for the delimiter.
const LOOKED_AT: usize = 60;

/// Most lines before a table.
const MOST_SKIPPED: usize = 40;

/// Fewest lines of a table that has lines before it.
const LEAST_LINES: usize = 5;

/// Smallest share of the lines of a table that have as many fields as its first: rows in which something failed may be cut.
const ALIKE: f64 = 0.9;

/// Most different entries of a column that names things.
const MOST_LABELS: usize = 200;

/// Largest share of the entries of a column of numbers that are not numbers, as where a measurement failed.
const FAILED: f64 = 0.1;

/// A table as far as it is known.
pub(super) struct Table {
    pub delimiter: u8,
    pub decimal: char,
    pub header: bool,
    /// Number of lines before the table.
    pub skip_lines: usize,
    /// Number of rows that were looked at.
    pub rows: usize,
    pub columns: Vec<TableColumn>,
}

impl Table {
    pub fn read(path: &Path) -> Result<Self, FileError> {
        let (delimiter, mut skip_lines) = if is_workbook(path) { (b',', 0) } else { delimiter(path)? };
        let layout = Layout { delimiter, header: true, sheet: None, skip_lines };
        let mut rows = Rows::new(open_source(path, layout)?, path, delimiter).starting_at(skip_lines + 1);
        let mut records: Vec<Vec<String>> = Vec::new();
        let mut lines: Vec<usize> = Vec::new();
        while let Some(row) = rows.next()? {
            lines.push(row.line);
            records.push(row.fields.iter().map(|f| f.trim().to_owned()).collect());
            if records.len() == ROWS {
                break;
            }
        }
        // A title above a table fills a cell or two of a line that is as long as the others.
        let filled = |r: &Vec<String>| r.iter().filter(|t| !t.is_empty()).count();
        let most = records.iter().take(LOOKED_AT).map(filled).max().unwrap_or(0);
        let titles = records.iter().take(MOST_SKIPPED).take_while(|r| 2 * filled(r) < most).count();
        if titles > 0 && titles < records.len() {
            skip_lines = lines[titles] - 1;
            records.drain(..titles);
        }
        let Some(first) = records.first() else {
            return Err(FileError::whole(path, "is empty", "give a table"));
        };
        let comma = |text: &String| text.contains(',') && number(text, ',').is_some();
        let decimal = if delimiter != b',' && records.iter().flatten().any(comma) { ',' } else { '.' };
        let header = first.iter().filter(|t| !t.is_empty()).all(|t| number(t, decimal).is_none());
        let titles = if header { records.remove(0) } else { vec![String::new(); first.len()] };
        let column = |(k, title): (usize, String)| {
            let entries = records.iter().filter_map(|r| r.get(k)).filter(|t| !t.is_empty());
            let entries: Vec<&String> = entries.collect();
            let numbers: Vec<f64> = entries.iter().filter_map(|t| number(t, decimal)).filter(|n| n.is_finite()).collect();
            // A measurement that failed now and then makes no other column of it.
            let are_numbers = !numbers.is_empty() && (entries.len() - numbers.len()) as f64 <= FAILED * entries.len() as f64;
            let largest = are_numbers.then(|| numbers.iter().fold(0.0f64, |m, v| m.max(v.abs())));
            let has = |word: &str| entries.iter().any(|t| t.as_str() == word);
            let is_set = has("fit") && has("validation") && entries.iter().all(|t| ["fit", "validation"].contains(&t.as_str()));
            let last_digit = entries.iter().map(|t| last_digit(t, decimal)).fold(1.0, f64::min);
            let (stem, unit) = without_unit(&title);
            let mut labels: Vec<String> = Vec::new();
            for &entry in &entries {
                if !labels.contains(entry) {
                    labels.push(entry.clone());
                }
                if labels.len() > MOST_LABELS {
                    labels.clear();
                    break;
                }
            }
            TableColumn { place: k + 1, title, stem, unit, is_set, labels, largest, last_digit }
        };
        Ok(Table {
            delimiter,
            decimal,
            header,
            skip_lines,
            rows: records.len(),
            columns: titles.into_iter().enumerate().map(column).collect(),
        })
    }

    pub fn words(&self) -> String {
        let fields = match self.delimiter {
            b'\t' => "tabs".to_owned(),
            b' ' => "white space".into(),
            other => format!("`{}`", char::from(other)),
        };
        let header = if self.header { "with a header" } else { "without a header: columns are named by their place" };
        format!("fields separated by {fields}, decimal sign `{}`, {header}", self.decimal)
    }

    /// The first lines of a map for the table.
    pub fn layout(&self) -> String {
        let Table { delimiter, decimal, header, skip_lines, .. } = self;
        let delimiter = if *delimiter == b'\t' { "\\t".to_owned() } else { char::from(*delimiter).to_string() };
        let skip = if *skip_lines > 0 { format!("skip_lines = {skip_lines}\n") } else { String::new() };
        format!(
            "format = \"calibench-import/1\"\ndelimiter = \"{delimiter}\"\ndecimal = \"{decimal}\"\nheader = {header}\n{skip}"
        )
    }

    /// Columns of the joints, and the reason; `names` are those of the robot from its base on, if it has any.
    pub fn joints(&self, robot: &Robot, names: &[String]) -> Option<(Vec<usize>, String)> {
        let n = robot.joints();
        let filled = self.columns.iter().enumerate().filter(|(_, c)| self.header && c.largest.is_some());
        let titled: Vec<(usize, String)> = filled.map(|(k, c)| (k, c.title.clone())).collect();
        if let Some(columns) = joint_names::columns(&titled, robot, names) {
            let [first, last] = [columns[0], columns[n - 1]].map(|k| self.columns[k].title.clone());
            let why = format!("joints: the {n} columns `{first}` to `{last}`, by the names of the robot's joints");
            return Some((columns, why));
        }
        let mut groups: Vec<(String, Vec<(usize, usize)>)> = Vec::new();
        for (k, column) in self.columns.iter().enumerate().filter(|(_, c)| c.largest.is_some()) {
            let Some((name, digit)) = numbered(&column.stem) else { continue };
            match groups.iter_mut().find(|(known, _)| *known == name) {
                Some((_, members)) => members.push((digit, k)),
                None => groups.push((name, vec![(digit, k)])),
            }
        }
        // A rail may have a name of its own beside the numbered axes of its arm.
        let slides: Vec<usize> = (0..n).filter(|&j| robot.kind(j) == JointKind::Prismatic).collect();
        let rails: Vec<usize> =
            (0..self.columns.len()).filter(|&k| self.columns[k].largest.is_some() && is_slide(&self.columns[k].stem)).collect();
        let rail = if let ([slide], [column]) = (slides.as_slice(), rails.as_slice()) { Some((*slide, *column)) } else { None };
        let of_joints = groups.into_iter().filter_map(|(name, mut members)| {
            members.sort_unstable();
            let consecutive = members.windows(2).all(|pair| pair[1].0 == pair[0].0 + 1);
            let worth = joint_name(&name)?;
            let is_all = members.len() == n || rail.is_some() && members.len() == n - 1;
            (consecutive && is_all).then_some((worth, members.len(), name, members))
        });
        if let Some((.., name, members)) = of_joints.max_by_key(|(worth, count, ..)| (*count, *worth)) {
            let mut columns: Vec<usize> = members.into_iter().map(|(_, k)| k).collect();
            let [first, last] = [columns[0], columns[columns.len() - 1]].map(|k| self.columns[k].title.clone());
            let mut why = format!("joints: {} columns `{first}` to `{last}`, numbered `{name}#`", columns.len());
            if let Some((slide, column)) = rail.filter(|_| columns.len() < n) {
                columns.insert(slide, column);
                why += &format!(", and `{}` as joint {}", self.columns[column].title, slide + 1);
            }
            return Some((columns, why));
        }
        // Joints with names of their own, side by side: `elbow_joint`.
        let of_joint = |c: &TableColumn| {
            c.largest.is_some() && ["joint", "axis"].iter().any(|word| c.stem.contains(word)) && joint_name(&c.stem).is_some()
        };
        let runs = self.columns.chunk_by(|a, b| of_joint(a) == of_joint(b)).filter(|run| of_joint(&run[0]));
        if let Some(run) = runs.into_iter().find(|run| run.len() == n) {
            let columns = run.iter().map(|c| c.place - 1).collect();
            return Some((columns, format!("joints: the {n} columns `{}` to `{}`", run[0].title, run[n - 1].title)));
        }
        // Without names, the first columns in a row whose numbers are angles, none of them a running number.
        if self.header {
            return None;
        }
        let is_angle = |c: &TableColumn| c.largest.is_some_and(|v| v <= 360.0 * 2.0);
        let first = (0..self.columns.len().checked_sub(n)?).find(|&k| self.columns[k..k + n].iter().all(is_angle))?;
        let why = format!("joints: the first {n} columns whose numbers can be angles, from column {}", first + 1);
        Some(((first..first + n).collect(), why))
    }

    /// Triples of columns that may be positions, the likeliest first.
    pub fn triples(&self, joints: &[usize]) -> Vec<[usize; 3]> {
        let free = |k: usize| !joints.contains(&k) && self.columns[k].largest.is_some();
        let mut found: Vec<(i32, [usize; 3])> = Vec::new();
        for (k, column) in self.columns.iter().enumerate().filter(|(k, _)| free(*k)) {
            if !self.header {
                let next = [k, k + 1, k + 2];
                if next.iter().all(|&c| c < self.columns.len() && free(c)) {
                    found.push((0, next));
                }
                continue;
            }
            for at in column.stem.match_indices('x').map(|(at, _)| at) {
                let axis = |letter: &str| column.stem[..at].to_owned() + letter + &column.stem[at + 1..];
                let of = |name: String| (0..self.columns.len()).find(|&c| free(c) && self.columns[c].stem == name);
                if let (Some(y), Some(z)) = (of(axis("y")), of(axis("z"))) {
                    found.push((position_name(&column.stem), [k, y, z]));
                }
            }
        }
        // The translations of vision libraries: `tvec0` to `tvec2`.
        for (prefix, first) in VECTORS.iter().flat_map(|prefix| [(prefix, 0), (prefix, 1)]) {
            let of = |k: usize| {
                let name = format!("{prefix}{}", first + k);
                (0..self.columns.len()).find(|&c| free(c) && self.columns[c].stem.replace(['_', ' ', '[', ']'], "") == name)
            };
            if let (Some(x), Some(y), Some(z)) = (of(0), of(1), of(2)) {
                found.push((1, [x, y, z]));
            }
        }
        found.sort_by_key(|(worth, _)| -worth);
        found.into_iter().filter(|(worth, _)| *worth >= 0).map(|(_, triple)| triple).take(MOST_TRIPLES).collect()
    }

    /// Columns that may hold the differences of positions from their targets.
    pub fn differences(&self, points: &[usize; 3]) -> Vec<[usize; 3]> {
        let is_difference = |stem: &str| ["dif", "dev", "err", "miss", "delta"].iter().any(|word| stem.contains(word));
        let mut found = Vec::new();
        for (k, column) in self.columns.iter().enumerate().filter(|(k, c)| !points.contains(k) && is_difference(&c.stem)) {
            for at in column.stem.match_indices('x').map(|(at, _)| at) {
                let axis = |letter: &str| column.stem[..at].to_owned() + letter + &column.stem[at + 1..];
                let of = |name: String| self.columns.iter().position(|c| c.stem == name && c.largest.is_some());
                if let (Some(y), Some(z)) = (of(axis("y")), of(axis("z"))) {
                    found.push([k, y, z]);
                }
            }
        }
        found
    }

    /// A column in words.
    pub fn title(&self, k: usize) -> String {
        let c = &self.columns[k];
        if c.title.is_empty() { format!("column {}", c.place) } else { format!("`{}`", c.title) }
    }

    pub fn titles(&self, columns: &[usize]) -> String {
        columns.iter().map(|&k| self.title(k)).collect::<Vec<_>>().join(", ")
    }

    /// True if a column is called a target: it was not measured.
    pub fn is_target(&self, k: usize) -> bool {
        TARGETS.iter().any(|word| self.columns[k].stem.contains(word))
    }

    /// A column in a map.
    pub fn named(&self, k: usize) -> String {
        if self.header {
            format!("\"{}\"", self.columns[k].title.replace('\\', "\\\\").replace('"', "\\\""))
        } else {
            self.columns[k].place.to_string()
        }
    }
}

/// The delimiter that splits the first lines into the same number of fields, at least six, and the number of lines before them:
/// titles, dates and remarks.
fn delimiter(path: &Path) -> Result<(u8, usize), FileError> {
    let text = read_foreign_text(path)?;
    let all: Vec<&str> = text.lines().take(LOOKED_AT).collect();
    let fields = |line: &str, mark: u8| match mark {
        b' ' => line.split_whitespace().count(),
        _ => line.split(char::from(mark)).count(),
    };
    let regular = |skipped: usize, mark: &u8| {
        let lines: Vec<&&str> = all[skipped..].iter().filter(|l| !l.trim().is_empty()).collect();
        let count = lines.first().map_or(0, |line| fields(line, *mark));
        // Lines before a table are few, and the table is longer.
        let enough = skipped == 0 || lines.len() >= LEAST_LINES;
        // A row in which something failed may be longer or shorter; it does not begin the table anew.
        let alike = lines.iter().filter(|line| fields(line, *mark) == count).count();
        let begins = lines.get(1).is_none_or(|line| fields(line, *mark) == count);
        enough && count >= 6 && begins && alike as f64 >= ALIKE * lines.len() as f64
    };
    let found =
        (0..all.len().min(MOST_SKIPPED + 1)).filter(|&skipped| skipped == 0 || !all[skipped].trim().is_empty()).find_map(
            |skipped| [b';', b'\t', b',', b' '].into_iter().find(|mark| regular(skipped, mark)).map(|mark| (mark, skipped)),
        );
    found.ok_or_else(|| {
        FileError::whole(
            path,
            "is not a regular table: its lines have different numbers of fields",
            "write a map by hand (docs/importing.md)",
        )
    })
}

/// Place of the last digit of a number as it is written; 1 of what is none.
fn last_digit(text: &str, decimal: char) -> f64 {
    if number(text, decimal).is_none() {
        return 1.0;
    }
    let (digits, power) = text.split_once(['e', 'E']).unwrap_or((text, "0"));
    let after = digits.split_once(decimal).map_or(0, |(_, after)| after.chars().filter(char::is_ascii_digit).count());
    10f64.powf(power.trim().parse().unwrap_or(0.0) - after as f64)
}

/// A title in lower case without its unit, and the unit.
fn without_unit(title: &str) -> (String, Option<&'static str>) {
    const UNITS: [(&str, &str); 13] = [
        ("degrees", "deg"),
        ("deg", "deg"),
        ("°", "deg"),
        ("radians", "rad"),
        ("rad", "rad"),
        ("mm", "mm"),
        ("um", "um"),
        ("µm", "um"),
        ("m", "m"),
        // An `in` without brackets is a word.
        ("[in", "in"),
        ("(in", "in"),
        ("[inch", "in"),
        ("(inch", "in"),
    ];
    let lower = title.trim().to_lowercase();
    let bare = lower.trim_end_matches([')', ']']);
    let stripped = UNITS.iter().find_map(|(written, unit)| {
        let stem = bare.strip_suffix(written)?;
        let rest = stem.trim_end_matches(['_', ' ', '(', '[', '/', '.', '-']);
        ((rest.len() < stem.len() || *unit == "in") && !rest.is_empty()).then(|| (rest.to_owned(), Some(*unit)))
    });
    stripped.unwrap_or((lower, None))
}

/// A title split into its name and its only number.
fn numbered(stem: &str) -> Option<(String, usize)> {
    let first = stem.find(|c: char| c.is_ascii_digit())?;
    let last = stem.rfind(|c: char| c.is_ascii_digit())?;
    let digits = &stem[first..=last];
    let name = format!("{}#{}", &stem[..first], &stem[last + 1..]);
    digits.parse().ok().map(|digit| (name, digit))
}

/// True of the name of a joint that slides, a rail or a lift: KUKA's first external axis among them.
fn is_slide(stem: &str) -> bool {
    let plain = stem.replace(['_', ' ', '-', '.'], "");
    ["e1", "ext1", "eax1", "exta1"].contains(&plain.as_str())
        || ["rail", "slide", "lift", "torso", "linear", "gantry"].iter().any(|word| plain.starts_with(word))
}

/// Rank of a name as that of joint angles: measured before commanded; `None` if it is something else.
fn joint_name(name: &str) -> Option<i32> {
    let plain = name.replace(['#', '_', ' ', '-', '.', '[', ']', '(', ')'], "");
    let other = ["tau", "torque", "current", "vel", "qd", "qdd", "acc", "temp", "effort", "moment"];
    if other.iter().any(|word| plain.contains(word)) {
        return None;
    }
    let commanded = TARGETS.iter().any(|word| plain.contains(word));
    let is_joint = ["q", "j", "a", "joint", "axis", "theta", "th", "ax", "achse", "gelenk", "axe", "asse", "eje"]
        .contains(&plain.as_str())
        || ["joint", "axis", "theta", "actualq", "targetq"].iter().any(|word| plain.contains(word));
    is_joint.then_some(if commanded { 1 } else { 2 })
}

/// Rank of the name of an x column as that of a measured position; negative if it is not one.
fn position_name(stem: &str) -> i32 {
    let has = |words: &[&str]| words.iter().any(|word| stem.contains(word));
    if has(&["std", "sigma", "err", "dif", "force", "rot", "vel", "acc", "axis", "max", "index"]) {
        return -1;
    }
    let bare = i32::from(stem == "x");
    // If another column is called measured, a plain `x` is the commanded position.
    let measured = i32::from(has(&["meas", "actual", "track", "laser"]));
    let position = i32::from(has(&["meas", "actual", "track", "laser", "point", "pos", "is"]));
    let target = i32::from(has(&TARGETS));
    2 * bare + measured + 2 * position - target + 1
}
