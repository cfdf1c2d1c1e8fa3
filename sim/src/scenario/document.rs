//! The keys of a scenario before they are read as one: what a study changes from point to point.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use calibench::files::{FileError, parse_toml};
use calibench::robot::robot;
use nalgebra::{Unit, Vector3};
use toml::{Table, Value};

use super::key::Key;
use super::sources::Sources;
use super::{Bodies, FORMAT, Scenario, ScenarioToml, Truth, cell, check};

/// A scenario file merged over what it extends, not yet checked.
#[derive(Debug, Clone)]
pub struct Document {
    path: PathBuf,
    sources: Arc<Sources>,
    keys: Table,
}

impl Document {
    /// Reads a scenario file and what it extends.
    ///
    /// # Errors
    /// When a file cannot be read, is no TOML, or extends what it cannot.
    pub fn read(path: &Path) -> Result<Self, FileError> {
        let (sources, keys) = Sources::read(path)?;
        Ok(Document { path: path.to_owned(), sources: Arc::new(sources), keys })
    }

    /// The scenario of these keys; every value is checked.
    ///
    /// # Errors
    /// One error that names file, line, key and remedy.
    pub fn scenario(&self) -> Result<Scenario, FileError> {
        let Document { path, sources, keys } = self;
        let toml: ScenarioToml =
            parse_toml(path, &keys.to_string()).map_err(|e| sources.wrong(&e.field, e.problem, e.remedy))?;
        if toml.format != FORMAT {
            return Err(sources.wrong("format", format!("is '{}'", toml.format), format!("write format = \"{FORMAT}\"")));
        }
        let robot = robot(&toml.robot, &sources.folder())
            .map_err(|e| if e.path.is_file() { e } else { sources.wrong("robot", e.problem, e.remedy) })?;
        check::numbers(keys, sources)?;
        check::keys(&toml, robot.joints(), sources)?;
        if let Some(design) = &toml.design {
            design.check(&toml, sources)?;
        }
        let cell = cell(&toml, robot);
        let model = check::cell(&cell, &toml, sources)?;
        Ok(Scenario {
            outward: toml.balls.iter().map(|b| Unit::new_normalize(Vector3::from(b.outward))).collect(),
            bodies: Bodies::of(&toml, cell.robot.joints(), sources)?,
            truth: Truth::of(toml.truth, &cell, &model.own, sources)?,
            expect: check::expectations(&toml.expect, sources)?,
            precision: toml.precision,
            indicators: toml.indicators,
            instrument: toml.instrument,
            suite: toml.suite,
            sweep: toml.sweep,
            design: toml.design,
            name: toml.name,
            question: toml.question,
            seed: toml.seed,
            plant: toml.plant,
            plan: toml.plan,
            centring: toml.centring,
            tracker: toml.tracker,
            model,
            cell,
            sources: sources.clone(),
        })
    }

    /// An error at a key, in the file that has it.
    pub fn wrong(&self, key: &str, problem: impl Into<String>, remedy: impl Into<String>) -> FileError {
        self.sources.wrong(key, problem, remedy)
    }

    /// The keys without those of these tables and names, as text: the same for documents that say the same.
    pub fn text_without(&self, names: &[&str]) -> String {
        let rest = self.keys.iter().filter(|(name, _)| !names.contains(&name.as_str()));
        rest.map(|(name, value)| (name.clone(), value.clone())).collect::<Table>().to_string()
    }

    /// What stands at a key.
    pub fn get(&self, key: &Key) -> Option<&Value> {
        key.find(&self.keys)
    }

    /// Puts a value at a key; tables on the way are made where there are none.
    ///
    /// # Errors
    /// What is in the way, in words.
    pub fn set(&mut self, key: &Key, value: Value) -> Result<(), String> {
        key.put(&mut self.keys, value)
    }

    /// Takes a key out, or an element of a list.
    ///
    /// # Errors
    /// When there is no such key, in words.
    pub fn remove(&mut self, key: &Key) -> Result<(), String> {
        key.take(&mut self.keys)
    }
}
