//! Every link of every page leads to a file of the repository, and to a heading where it names one; and the page of the repository
//! tells of every folder. The web pages (`docs/book/make`) are held to the same by Sphinx, which takes longer.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Component, Path, PathBuf};

use crate::{read, root};

/// The page that tells what is where.
const REPOSITORY: &str = "docs/repository.md";

/// Folders that are not part of the repository, in addition to Python environments.
const NOT_OURS: [&str; 3] = [".git", "target", "runs"];

/// Pages outside docs.
const OTHERS: [&str; 6] =
    ["README.md", "CONTRIBUTING.md", "CHANGELOG.md", "benches/README.md", "python/README.md", "tests/data/README.md"];

fn pages() -> Vec<PathBuf> {
    let mut pages: Vec<PathBuf> = OTHERS.iter().map(PathBuf::from).collect();
    let mut folders = vec![PathBuf::from("docs")];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(root().join(&folder)).unwrap() {
            let path = folder.join(entry.unwrap().file_name());
            if root().join(&path).is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|e| e == "md") {
                pages.push(path);
            }
        }
    }
    pages.sort();
    pages
}

/// The lines of a page that are prose: fenced blocks are not.
fn prose(text: &str) -> impl Iterator<Item = (usize, &str)> {
    let mut fence: Option<&str> = None;
    text.lines().enumerate().filter(move |(_, line)| {
        let opening = line.trim_start();
        let marks = &opening[..opening.len() - opening.trim_start_matches('`').len()];
        match fence {
            Some(open) if line.trim() == open => fence = None,
            Some(_) => {}
            None if marks.len() >= 3 => fence = Some(marks),
            None => return true,
        }
        false
    })
}

/// A line without what stands between backticks.
fn without_code(line: &str) -> String {
    line.split('`').step_by(2).collect::<Vec<_>>().join("")
}

/// Targets of the links on a line.
fn links(line: &str) -> Vec<String> {
    let line = without_code(line);
    line.split("](").skip(1).filter_map(|rest| rest.split([')', ' ']).next()).map(str::to_owned).collect()
}

/// A heading as a forge names it in addresses.
fn name_of(heading: &str) -> String {
    let shown =
        heading.split("](").enumerate().map(|(i, part)| if i == 0 { part } else { part.split_once(')').map_or("", |p| p.1) });
    let shown: String = shown.collect();
    let kept = shown.trim().chars().filter(|c| c.is_alphanumeric() || matches!(c, ' ' | '-' | '_'));
    kept.flat_map(char::to_lowercase).map(|c| if c == ' ' { '-' } else { c }).collect()
}

fn headings(text: &str) -> BTreeSet<String> {
    let mut names = BTreeSet::new();
    for (_, line) in prose(text) {
        let heading = line.trim_start_matches('#');
        if heading.len() < line.len() && heading.starts_with(' ') {
            let name = name_of(heading);
            // Of equal headings, the second is named with -1, and so on.
            let again = (1..).map(|n| format!("{name}-{n}"));
            let unused = std::iter::once(name.clone()).chain(again).find(|n| !names.contains(n)).unwrap();
            names.insert(unused);
        }
    }
    names
}

/// A path without `..`.
fn plain(path: &Path) -> PathBuf {
    let mut plain = PathBuf::new();
    for part in path.components() {
        if part == Component::ParentDir {
            plain.pop();
        } else {
            plain.push(part);
        }
    }
    plain
}

#[test]
fn every_link_leads_to_a_file_and_to_its_heading() {
    let pages = pages();
    let texts: BTreeMap<&PathBuf, String> = pages.iter().map(|page| (page, read(&page.to_string_lossy()))).collect();
    let headings: BTreeMap<&PathBuf, BTreeSet<String>> = texts.iter().map(|(page, text)| (*page, headings(text))).collect();
    let (mut wrong, mut followed) = (Vec::new(), 0);
    for (page, text) in &texts {
        for (number, line) in prose(text) {
            for link in links(line).into_iter().filter(|link| !link.contains("://")) {
                followed += 1;
                let (file, heading) = link.split_once('#').unwrap_or((&link, ""));
                let folder = page.parent().unwrap();
                let target = if file.is_empty() { page.to_path_buf() } else { plain(&folder.join(file)) };
                let known = headings.get(&target).is_some_and(|names| names.contains(heading));
                if !root().join(&target).exists() || !(heading.is_empty() || known) {
                    wrong.push(format!("{}:{}: {link} leads nowhere", page.display(), number + 1));
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert!(followed > 300, "only {followed} links were found in {} pages", pages.len());
}

/// The contents of the book.
const CONTENTS: &str = "docs/README.md";

/// Pages of the side bar at most: more are not looked through.
const SIDE_BAR: usize = 24;

/// Pages that a page links to.
fn linked(page: &Path) -> Vec<PathBuf> {
    let text = read(&page.to_string_lossy());
    let folder = page.parent().unwrap();
    prose(&text)
        .flat_map(|(_, line)| links(line))
        .filter(|link| !link.contains("://"))
        .map(|link| plain(&folder.join(link.split('#').next().unwrap())))
        .filter(|target| target.extension().is_some_and(|e| e == "md"))
        .collect()
}

#[test]
fn every_page_is_reached_from_the_contents() {
    let mut reached = BTreeSet::new();
    let mut open = vec![PathBuf::from(CONTENTS)];
    while let Some(page) = open.pop() {
        if root().join(&page).is_file() && reached.insert(page.clone()) {
            open.extend(linked(&page));
        }
    }
    // The page of the Python package is read on its index.
    reached.insert("python/README.md".into());
    let lost: Vec<PathBuf> = pages().into_iter().filter(|page| !reached.contains(page)).collect();
    assert!(lost.is_empty(), "no link leads to {lost:?}");
}

#[test]
fn the_side_bar_is_short() {
    let pages = read(CONTENTS).lines().filter(|line| line.starts_with("* [") && line.ends_with(".md)")).count();
    assert!((15..=SIDE_BAR).contains(&pages), "{pages} pages are in the lists of {CONTENTS}");
}

#[test]
fn a_link_that_leads_nowhere_is_seen() {
    assert_eq!(links("see [a](b.md#c), `[no](link)` and [d](e.png \"f\")"), ["b.md#c", "e.png"]);
    assert_eq!(name_of(" Rows of `--json`, and [their](x.md) units"), "rows-of---json-and-their-units");
    let page = "# A\n```sh\n# no heading\n```\n## B\n## B\n";
    assert_eq!(headings(page), ["a", "b", "b-1"].map(str::to_owned).into());
}

/// Folders in the page's tree, relative to the root.
fn tree() -> BTreeSet<String> {
    let mut above: Vec<String> = Vec::new();
    let mut folders = BTreeSet::new();
    for line in read(REPOSITORY).lines() {
        let name = line.split_whitespace().next().unwrap_or_default();
        let Some(name) = name.strip_suffix('/').filter(|n| !n.contains('`')) else { continue };
        let depth = (line.len() - line.trim_start().len()) / 2;
        above.truncate(depth);
        above.push(name.to_owned());
        folders.insert(above.join("/"));
    }
    folders
}

fn folders_in(folder: &str) -> BTreeSet<String> {
    std::fs::read_dir(root().join(folder))
        .expect("the folder is there")
        .filter_map(Result::ok)
        .filter(|entry| entry.file_type().is_ok_and(|kind| kind.is_dir()))
        .map(|entry| entry.file_name().to_string_lossy().into_owned())
        .filter(|name| !NOT_OURS.contains(&name.as_str()) && !name.starts_with(".venv"))
        .map(|name| if folder.is_empty() { name } else { format!("{folder}/{name}") })
        .collect()
}

#[test]
fn the_tree_is_the_repository() {
    let tree = tree();
    for folder in &tree {
        assert!(root().join(folder).is_dir(), "{REPOSITORY}: there is no folder {folder}");
    }
    for listed in ["", "src", "report", "workbench", "cli", "sim", "sim/src", "docs", "tests"] {
        let missing: Vec<String> = folders_in(listed).difference(&tree).cloned().collect();
        assert!(missing.is_empty(), "{REPOSITORY}: the tree does not tell of {missing:?}");
    }
}

#[test]
fn the_picture_moves_where_motion_is_wanted_and_takes_nothing_from_elsewhere() {
    let picture = read("docs/pictures/fall.svg");
    assert!(read("README.md").contains("](docs/pictures/fall.svg)"), "the README shows another picture");
    let (still, moving) = picture.split_once("@media (prefers-reduced-motion: no-preference)").expect("it asks for motion");
    assert!(!still.contains("animation") && moving.contains("animation"), "it moves where motion is not wanted");
    assert!(picture.contains("prefers-color-scheme: dark"), "it has no dark dress");
    assert!(picture.contains("<title id="), "it does not say what it shows");
    assert_eq!(picture.matches("http").count(), 1, "it links to more than the name of its format");
    assert!(picture.len() < 20_000, "it is too large: {} bytes", picture.len());
}
