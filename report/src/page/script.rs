//! Scripts of pages: modules, linked into one classic script, since a page that is opened as a file may not load any.
//!
//! A module is an ECMAScript module in a file of its own. The linker understands what the linter leaves of the language: imports
//! by name at the beginning of a line, and `export` before a declaration. It makes a function of each module, called once,
//! after those that it imports. Comments of types stay behind: they are for the type checker.

use std::collections::BTreeSet;
use std::fmt::{self, Write};

/// A module of a script.
#[derive(Clone, Copy)]
pub struct Module {
    /// By what other packages import it: `package/file.js`. Modules of its own package import it as `./file.js`.
    pub name: &'static str,
    /// Its text.
    pub text: &'static str,
}

/// The files of a folder as modules of a package: `modules!("package", "folder": "one.js", "other.js")`.
#[macro_export]
macro_rules! modules {
    ($package:literal, $folder:literal: $($file:literal),+ $(,)?) => {
        &[$($crate::Module { name: concat!($package, "/", $file), text: include_str!(concat!($folder, "/", $file)) }),+]
    };
}

/// Reasons why modules cannot be linked.
#[derive(Debug)]
#[non_exhaustive]
pub enum LinkError {
    /// A module imports one that is not there.
    Unknown {
        /// Module that imports it.
        importer: &'static str,
        /// Its name.
        imported: String,
    },
    /// A module imports itself, through others.
    Circle(&'static str),
    /// An import that is not by name, or does not end.
    Import {
        /// Module that exports it.
        importer: &'static str,
        /// Its first line.
        line: String,
    },
}

impl fmt::Display for LinkError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            LinkError::Unknown { importer, imported } => write!(f, "{importer} imports {imported}, which is not there"),
            LinkError::Circle(module) => write!(f, "{module} imports itself, through others"),
            LinkError::Import { importer, line } => write!(f, "{importer}: not an import by name: {line}"),
        }
    }
}

impl std::error::Error for LinkError {}

/// The script of a module with everything that it imports; `modules` are those from which it may.
///
/// # Errors
/// If the modules do not fit together.
pub fn linked(entry: Module, modules: &[&[Module]]) -> Result<String, LinkError> {
    let mut linker =
        Linker { modules, done: BTreeSet::new(), script: String::from("\"use strict\";\n(() => {\nconst modules = {};\n") };
    linker.add(entry, &mut Vec::new())?;
    linker.script.push_str("})();\n");
    Ok(linker.script)
}

/// The same; if modules do not fit together, the script throws an error that says why.
pub fn linked_or_told(entry: Module, modules: &[&[Module]]) -> String {
    linked(entry, modules).unwrap_or_else(|error| format!("throw new Error({:?});\n", error.to_string()))
}

struct Linker<'a> {
    modules: &'a [&'a [Module]],
    done: BTreeSet<&'static str>,
    script: String,
}

impl Linker<'_> {
    /// Adds a module after those that it imports; `importers` are on the way to it.
    fn add(&mut self, module: Module, importers: &mut Vec<&'static str>) -> Result<(), LinkError> {
        if self.done.contains(module.name) {
            return Ok(());
        }
        if importers.contains(&module.name) {
            return Err(LinkError::Circle(module.name));
        }
        importers.push(module.name);
        let (body, exports) = self.body(module, importers)?;
        importers.pop();
        self.done.insert(module.name);
        _ = write!(
            self.script,
            "modules[\"{}\"] = (() => {{\n{body}return {{ {} }};\n}})();\n",
            module.name,
            exports.join(", ")
        );
        Ok(())
    }

    /// The text of a module as the body of a function, and what it returns. What it imports is added before.
    fn body(&mut self, module: Module, importers: &mut Vec<&'static str>) -> Result<(String, Vec<&'static str>), LinkError> {
        let (mut body, mut exports) = (String::with_capacity(module.text.len()), Vec::new());
        let mut rest = module.text;
        while !rest.is_empty() {
            let end = rest.find('\n').map_or(rest.len(), |at| at + 1);
            let line = &rest[..end];
            if let Some(after) = after_comment(rest) {
                rest = after;
            } else if line.starts_with("import ") {
                let import =
                    Import::read(rest).ok_or_else(|| LinkError::Import { importer: module.name, line: line.trim().into() })?;
                let name = self.import(module, &import, importers)?;
                _ = writeln!(body, "const {{ {} }} = modules[\"{name}\"];", import.names.replace(" as ", ": "));
                rest = import.rest;
            } else {
                let declaration = line.strip_prefix("export ");
                exports.extend(declaration.and_then(declared));
                body.push_str(declaration.unwrap_or(line));
                rest = &rest[end..];
            }
        }
        Ok((body, exports))
    }

    /// Adds what is imported; its name.
    fn import(
        &mut self,
        module: Module,
        import: &Import<'_>,
        importers: &mut Vec<&'static str>,
    ) -> Result<&'static str, LinkError> {
        let package = module.name.split('/').next().unwrap_or_default();
        let name = import.from.strip_prefix("./").map_or_else(|| import.from.to_owned(), |file| format!("{package}/{file}"));
        let found = self.modules.iter().flat_map(|of| of.iter()).find(|m| m.name == name);
        let Some(found) = found else { return Err(LinkError::Unknown { importer: module.name, imported: name }) };
        self.add(*found, importers)?;
        Ok(found.name)
    }
}

/// The text after a comment of types on lines of its own, which begins with `/**` and ends with `*/`.
fn after_comment(text: &str) -> Option<&str> {
    let comment = text.trim_start_matches(' ').strip_prefix("/**")?;
    let (_, after) = comment.split_once("*/")?;
    after.strip_prefix('\n')
}

/// `import { names } from "from";`, and what follows.
struct Import<'a> {
    names: String,
    from: &'a str,
    rest: &'a str,
}

impl<'a> Import<'a> {
    fn read(text: &'a str) -> Option<Self> {
        let (names, rest) = text.strip_prefix("import {")?.split_once('}')?;
        let (from, rest) = rest.strip_prefix(" from \"")?.split_once("\";\n")?;
        let names: Vec<&str> = names.split(',').map(str::trim).filter(|name| !name.is_empty()).collect();
        Some(Import { names: names.join(", "), from, rest })
    }
}

/// The name that a declaration declares.
fn declared(declaration: &'static str) -> Option<&'static str> {
    let declaration = declaration.strip_prefix("async ").unwrap_or(declaration);
    let name = ["const ", "function ", "class "].iter().find_map(|kind| declaration.strip_prefix(kind))?;
    name.split(|c: char| !c.is_alphanumeric() && c != '_' && c != '$').next()
}

#[cfg(test)]
mod tests {
    use super::*;

    const A: Module = Module {
        name: "p/a.js",
        text: "// A.\n/** @type {number} */\nexport const one = /** @type {any} */ (1);\n/**\n * @param {A} a\n */\nexport async function two() {}\n",
    };
    const B: Module = Module {
        name: "p/b.js",
        text: "import {\n  one,\n  two as second,\n} from \"./a.js\";\nexport function three() {\n  return one + second;\n}\n",
    };

    #[test]
    fn every_module_is_a_function_after_those_that_it_imports() {
        let entry = Module {
            name: "q/c.js",
            text: "import { three } from \"p/b.js\";\nimport { one } from \"p/a.js\";\nthree(one);\n",
        };
        let script = linked(entry, &[&[B], &[A]]).unwrap();
        let expected = "\"use strict\";\n(() => {\nconst modules = {};\n\
            modules[\"p/a.js\"] = (() => {\n// A.\nconst one = /** @type {any} */ (1);\nasync function two() {}\nreturn { one, two };\n})();\n\
            modules[\"p/b.js\"] = (() => {\nconst { one, two: second } = modules[\"p/a.js\"];\n\
            function three() {\n  return one + second;\n}\nreturn { three };\n})();\n\
            modules[\"q/c.js\"] = (() => {\nconst { three } = modules[\"p/b.js\"];\nconst { one } = modules[\"p/a.js\"];\n\
            three(one);\nreturn {  };\n})();\n})();\n";
        assert_eq!(script, expected);
    }

    #[test]
    fn what_does_not_fit_together_is_said() {
        let of = |text| Module { name: "p/d.js", text };
        let error = |text, modules: &[Module]| linked(of(text), &[modules]).unwrap_err().to_string();
        assert_eq!(error("import { x } from \"./x.js\";\n", &[A]), "p/d.js imports p/x.js, which is not there");
        assert_eq!(error("import x from \"./a.js\";\n", &[A]), "p/d.js: not an import by name: import x from \"./a.js\";");
        let circle = "import { x } from \"./d.js\";\n";
        assert_eq!(error(circle, &[of(circle)]), "p/d.js imports itself, through others");
    }
}
