//! A number in the source has a name, its unit and its reason; where the reason is elsewhere, it says where: a decision, a page,
//! a paper, a data sheet, or how it is computed.

use crate::{production_sources, sources};

/// Constants of the library that name a source; the number only rises.
const CITED: usize = 78;

/// Marks of a source in a line of documentation.
const MARKS: [&str; 14] = [
    "decision 0",
    "docs/",
    "data sheet",
    "manual",
    "ISO ",
    "IEC ",
    "RFC ",
    "Table ",
    "quantile of",
    "`sqrt(",
    "chi-square of",
    "Median of chi-square",
    "(paper",
    "KUKA System Software",
];

/// A constant that holds numbers, with its documentation as one line.
struct Constant {
    name: String,
    documentation: String,
}

impl Constant {
    /// True if its documentation names a source: one of [`MARKS`], or the year of a publication.
    fn is_cited(&self) -> bool {
        let words = self.documentation.split(|c: char| !c.is_ascii_digit());
        let mut years = words.filter(|w| w.len() == 4).filter_map(|w| w.parse::<u32>().ok());
        years.any(|year| (1975..2100).contains(&year)) || MARKS.iter().any(|mark| self.documentation.contains(mark))
    }
}

/// The constants of a source that hold numbers, without those of its unit tests, which end every file.
fn constants(source: &str) -> Vec<Constant> {
    let mut documentation = String::new();
    let mut found = Vec::new();
    for line in source.lines().take_while(|line| !line.starts_with("#[cfg(test)]")).map(str::trim) {
        if let Some(text) = line.strip_prefix("///") {
            documentation.push_str(text);
        } else if let Some((name, of)) = declared(line)
            && ["f64", "usize", "u8", "u16", "u32", "u64", "i32", "Duration"].iter().any(|number| of.contains(number))
        {
            let beside = line.split_once("; //").map_or("", |(_, text)| text);
            let documentation = format!("{}{beside}", std::mem::take(&mut documentation));
            found.push(Constant { name: name.to_owned(), documentation });
        } else if !line.starts_with("#[") {
            documentation.clear();
        }
    }
    found
}

/// Name and type of the constant that a line declares.
fn declared(line: &str) -> Option<(&str, &str)> {
    let (before, rest) = line.split_once("const ")?;
    let (name, rest) = rest.split_once(": ")?;
    let is_name = name.chars().all(|c| c.is_ascii_uppercase() || c.is_ascii_digit() || c == '_');
    (is_name && (before.is_empty() || before.starts_with("pub"))).then(|| (name, rest.split(" = ").next().unwrap_or(rest)))
}

#[test]
fn every_number_that_has_a_name_says_what_it_is() {
    for (path, source) in production_sources() {
        for constant in constants(&source) {
            assert!(!constant.documentation.trim().is_empty(), "{path}: say what {} is, its unit, and why", constant.name);
        }
    }
}

#[test]
fn constants_that_name_a_source_become_more() {
    let all: Vec<Constant> = sources("src").iter().flat_map(|(_, source)| constants(source)).collect();
    let cited = all.iter().filter(|constant| constant.is_cited()).count();
    assert!(cited >= CITED, "{cited} of {} constants name a source, and {CITED} did", all.len());
    assert!(cited < CITED + 10, "{cited} of {} constants name a source: raise the number here", all.len());
}

#[test]
fn a_source_is_found_where_there_is_one() {
    let source = "/// Level of the limit\n/// (docs/runs.md).\nconst A: f64 = 0.95;\n\nconst B: usize = 1;\n/// As in Lucas & Saccucci (1990).\n\
        pub(crate) const C: [f64; 2] = [0.0; 2];\nconst D: &str = \"x\";\nlet const_e: f64 = 1.0;\n#[cfg(test)]\nconst F: f64 = 1.0;";
    let found = constants(source);
    assert_eq!(
        found.iter().map(|c| (c.name.as_str(), c.is_cited())).collect::<Vec<_>>(),
        [("A", true), ("B", false), ("C", true)]
    );
    assert!(found[1].documentation.is_empty());
}
