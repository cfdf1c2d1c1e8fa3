//! The house of the source: no circles between files or folders of a package, packages in one direction, no file too long to be read.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use syn::visit::{self, Visit};
use syn::{Item, ItemMod, ItemUse, UseTree, VisRestricted, Visibility};

use crate::{is_test, sources};

/// A package, and those of the workspace that it may depend on.
const PACKAGES: [(&str, &[&str]); 18] = [
    ("src", &["calibench_wire"]),
    ("wire/src", &[]),
    ("programs/src", &["calibench"]),
    ("logs/src", &["calibench"]),
    ("discover/src", &["calibench"]),
    ("recovery/src", &["calibench"]),
    ("report/src", &["calibench", "calibench_discover", "calibench_recovery"]),
    ("loopback/src", &[]),
    ("rehearsal/src", &["calibench", "calibench_report", "calibench_loopback"]),
    ("readout/src", &["calibench", "calibench_wire"]),
    ("workbench/src", &["calibench", "calibench_report"]),
    ("sim/src", &["calibench"]),
    ("sim/lab/src", &["calibench", "calibench_report", "calibench_sim"]),
    ("sim/serve/src", &["calibench", "calibench_wire", "calibench_sim"]),
    ("sim/mujoco/src", &["calibench", "calibench_sim"]),
    ("sim/view/src", &["calibench", "calibench_report"]),
    ("web/src", &["calibench", "calibench_report", "calibench_workbench", "calibench_sim"]),
    (
        "cli/src",
        &[
            "calibench",
            "calibench_wire",
            "calibench_programs",
            "calibench_logs",
            "calibench_discover",
            "calibench_recovery",
            "calibench_report",
            "calibench_loopback",
            "calibench_rehearsal",
            "calibench_readout",
            "calibench_workbench",
            "calibench_sim",
            "calibench_lab",
            "calibench_serve",
            "calibench_mujoco",
        ],
    ),
];

/// Lines of a file of sources, its unit tests aside.
const LONGEST_FILE: usize = 400;

/// A module by the names from the crate's root.
type Module = Vec<String>;

fn module_of(file: &str, folder: &str) -> Module {
    let mut names: Module =
        Path::new(file).strip_prefix(folder).unwrap().with_extension("").iter().map(|n| n.to_str().unwrap().into()).collect();
    if names.last().is_some_and(|n| n == "mod" || (names.len() == 1 && (n == "lib" || n == "main"))) {
        names.pop();
    }
    names
}

/// Names that a file uses from others.
#[derive(Default)]
struct Named {
    /// Imported paths, each with the name it gets here, and whether it is handed on.
    imports: Vec<(Vec<String>, bool)>,
    /// Paths in code.
    paths: Vec<Vec<String>>,
}

fn flatten(tree: &UseTree, before: &[String], found: &mut Vec<Vec<String>>) {
    let with = |name: &syn::Ident| before.iter().cloned().chain([name.to_string()]).collect::<Vec<_>>();
    match tree {
        UseTree::Path(path) => flatten(&path.tree, &with(&path.ident), found),
        UseTree::Name(name) if name.ident == "self" => found.push(before.to_vec()),
        UseTree::Name(name) => found.push(with(&name.ident)),
        UseTree::Rename(name) => found.push(with(&name.ident)),
        UseTree::Glob(_) => found.push(before.to_vec()),
        UseTree::Group(group) => group.items.iter().for_each(|tree| flatten(tree, before, found)),
    }
}

impl<'ast> Visit<'ast> for Named {
    fn visit_item(&mut self, item: &'ast Item) {
        let attributes = match item {
            Item::Mod(m) => &m.attrs,
            Item::Fn(f) => &f.attrs,
            Item::Impl(i) => &i.attrs,
            _ => return visit::visit_item(self, item),
        };
        if !is_test(attributes) {
            visit::visit_item(self, item);
        }
    }

    fn visit_item_mod(&mut self, module: &'ast ItemMod) {
        if !is_test(&module.attrs) {
            visit::visit_item_mod(self, module);
        }
    }

    fn visit_item_use(&mut self, item: &'ast ItemUse) {
        let mut found = Vec::new();
        flatten(&item.tree, &[], &mut found);
        let handed_on = !matches!(item.vis, Visibility::Inherited);
        self.imports.extend(found.into_iter().map(|path| (path, handed_on)));
    }

    // Where something is visible is not a use of it.
    fn visit_vis_restricted(&mut self, _: &'ast VisRestricted) {}

    fn visit_path(&mut self, path: &'ast syn::Path) {
        if path.segments.len() > 1 {
            self.paths.push(path.segments.iter().map(|s| s.ident.to_string()).collect());
        }
        visit::visit_path(self, path);
    }
}

/// The modules of a package and who names whom.
struct Package {
    named: BTreeMap<Module, Named>,
    handed_on: BTreeMap<(Module, String), (Module, Option<String>)>,
}

impl Package {
    fn read(folder: &str) -> Self {
        let mut named = BTreeMap::new();
        for (file, text) in sources(folder) {
            let mut of_file = Named::default();
            of_file.visit_file(&syn::parse_file(&text).unwrap());
            named.insert(module_of(&file, folder), of_file);
        }
        let mut package = Package { named, handed_on: BTreeMap::new() };
        let mut handed_on = BTreeMap::new();
        for (module, of_file) in &package.named {
            for (path, _) in of_file.imports.iter().filter(|(_, handed_on)| *handed_on) {
                if let (Some(target), Some(name)) = (package.resolve(path, module), path.last()) {
                    handed_on.insert((module.clone(), name.clone()), target);
                }
            }
        }
        package.handed_on = handed_on;
        package
    }

    /// The module that a path leads to, and the item of it that it names.
    fn resolve(&self, path: &[String], from: &Module) -> Option<(Module, Option<String>)> {
        let mut rest = path;
        let mut module = match rest.first()?.as_str() {
            "crate" => Module::new(),
            "self" | "super" => from.clone(),
            child if self.named.contains_key(&[from.as_slice(), &[child.to_owned()]].concat()) => {
                rest = path;
                return Some(self.descend(from.clone(), rest));
            }
            _ => return None,
        };
        if rest[0] == "super" {
            while rest.first().is_some_and(|s| s == "super") {
                module.pop();
                rest = &rest[1..];
            }
        } else {
            rest = &rest[1..];
        }
        Some(self.descend(module, rest))
    }

    fn descend(&self, mut module: Module, mut rest: &[String]) -> (Module, Option<String>) {
        while let Some(name) = rest.first() {
            let deeper = [module.as_slice(), std::slice::from_ref(name)].concat();
            if !self.named.contains_key(&deeper) {
                break;
            }
            (module, rest) = (deeper, &rest[1..]);
        }
        (module, rest.first().cloned())
    }

    /// The module in which something is defined, through whoever hands it on.
    fn home(&self, mut at: (Module, Option<String>)) -> Module {
        let mut seen = BTreeSet::new();
        while let (module, Some(name)) = &at {
            let key = (module.clone(), name.clone());
            let Some(next) = self.handed_on.get(&key).filter(|_| seen.insert(key.clone())) else { break };
            at = next.clone();
        }
        at.0
    }

    fn uses(&self) -> BTreeMap<Module, BTreeSet<Module>> {
        let of = |(module, named): (&Module, &Named)| {
            let imported = named.imports.iter().filter(|(_, handed_on)| !handed_on).map(|(path, _)| path);
            let targets = imported.chain(&named.paths).filter_map(|path| self.resolve(path, module)).map(|at| self.home(at));
            // A parent module is made of its children, and may use them.
            (module.clone(), targets.filter(|target| !target.starts_with(module)).collect())
        };
        self.named.iter().map(of).collect()
    }
}

/// A circle, if there is one.
fn circle<N: Ord + Clone>(uses: &BTreeMap<N, BTreeSet<N>>) -> Option<Vec<N>> {
    fn walk<N: Ord + Clone>(
        at: &N,
        uses: &BTreeMap<N, BTreeSet<N>>,
        way: &mut Vec<N>,
        done: &mut BTreeSet<N>,
    ) -> Option<Vec<N>> {
        if let Some(begin) = way.iter().position(|n| n == at) {
            return Some(way[begin..].to_vec());
        }
        if !done.insert(at.clone()) {
            return None;
        }
        way.push(at.clone());
        let found = uses.get(at).into_iter().flatten().find_map(|next| walk(next, uses, way, done));
        way.pop();
        found
    }
    let mut done = BTreeSet::new();
    uses.keys().find_map(|start| walk(start, uses, &mut Vec::new(), &mut done))
}

#[test]
fn no_files_and_no_folders_use_each_other_in_a_circle() {
    for (folder, _) in PACKAGES {
        let package = Package::read(folder);
        let uses = package.uses();
        assert!(uses.values().map(BTreeSet::len).sum::<usize>() > 1, "{folder}: nothing was seen");
        assert_eq!(circle(&uses), None, "{folder}");
        let mut folders: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
        for (module, targets) in &uses {
            let Some(top) = module.first() else { continue };
            let others = targets.iter().filter_map(|t| t.first()).filter(|t| *t != top);
            folders.entry(top.clone()).or_default().extend(others.cloned());
        }
        assert_eq!(circle(&folders), None, "{folder}");
    }
}

#[test]
fn a_circle_would_be_seen() {
    let uses = |edges: &[(&str, &str)]| {
        let mut uses: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
        for (a, b) in edges {
            uses.entry((*a).into()).or_default().insert((*b).into());
        }
        uses
    };
    assert_eq!(circle(&uses(&[("a", "b"), ("b", "c"), ("a", "c")])), None);
    assert_eq!(circle(&uses(&[("a", "b"), ("b", "c"), ("c", "b")])).map(|c| c.len()), Some(2));
}

#[test]
fn packages_depend_on_each_other_in_one_direction() {
    for (folder, allowed) in PACKAGES {
        for (file, text) in sources(folder) {
            let code: Vec<&str> = text.lines().filter(|line| !line.trim_start().starts_with("//")).collect();
            let code = code.join("\n");
            for name in PACKAGES.iter().flat_map(|(_, names)| *names).filter(|name| !allowed.contains(name)) {
                assert!(!code.contains(&format!("{name}::")), "{file} uses {name}");
            }
        }
    }
}

/// Packages that stand in for a real cell.
const STAND_INS: [&str; 3] = ["calibench_sim", "calibench_serve", "calibench_mujoco"];

/// The files of the program that measure a real cell, each with what it imports from packages that stand in for one.
fn stand_ins_of_a_real_cell(package: &Package) -> BTreeMap<Module, Vec<String>> {
    let uses = package.uses();
    let mut waiting = vec![["verbs", "measure", "cell"].map(str::to_owned).to_vec()];
    let mut found = BTreeMap::new();
    while let Some(module) = waiting.pop() {
        let Some(named) = package.named.get(&module).filter(|_| !found.contains_key(&module)) else { continue };
        let paths = named.imports.iter().map(|(path, _)| path).chain(&named.paths);
        let foreign = paths.filter(|path| STAND_INS.contains(&path[0].as_str())).map(|path| path.join("::"));
        found.insert(module.clone(), foreign.collect());
        waiting.extend(uses[&module].iter().cloned());
    }
    found
}

#[test]
fn a_real_cell_is_measured_without_the_simulator() {
    let files = stand_ins_of_a_real_cell(&Package::read("cli/src"));
    assert!(files.len() > 5, "the files that measure a real cell have moved: name their new place here");
    for (file, foreign) in files {
        assert!(foreign.is_empty(), "{}: {foreign:?}", file.join("::"));
    }
}

#[test]
fn every_file_can_be_read_at_one_sitting() {
    for (folder, _) in PACKAGES {
        for (file, text) in sources(folder) {
            let lines = text
                .lines()
                .take_while(|line| !line.starts_with("#[cfg(test)]") && !line.starts_with("#[cfg(all(test"))
                .count();
            assert!(lines <= LONGEST_FILE, "{file} has {lines} lines");
        }
    }
}
