//! The keys of a scenario before they are parsed: a study changes them from point to point.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use calibench::files::{FileError, parse_toml};
use calibench::robot::robot_file::robot;
use nalgebra::{Unit, Vector3};
use toml::{Table, Value};

use super::design_check;
use super::key::{Key, KeyError};
use super::sources::Sources;
use super::{Bodies, FORMAT, Scenario, ScenarioToml, Truth, cell, check};
use crate::mechanics::MakePlant;

/// A scenario file merged over the files it extends, not yet checked.
#[derive(Debug, Clone)]
pub struct Document {
    path: PathBuf,
    sources: Arc<Sources>,
    keys: Table,
    mujoco: Option<MakePlant<Scenario>>,
}

impl Document {
    /// Reads a scenario file and the files it extends.
    ///
    /// # Errors
    /// When a file cannot be read, is not valid TOML, or has an invalid `extends`.
    pub fn read(path: &Path) -> Result<Self, FileError> {
        let (sources, keys) = Sources::read(path)?;
        Ok(Document { path: path.to_owned(), sources: Arc::new(sources), keys, mujoco: None })
    }

    /// The same scenario in a program that includes the plant `mujoco`: `make` builds it.
    #[must_use]
    pub fn with_mujoco(self, make: MakePlant<Scenario>) -> Self {
        Document { mujoco: Some(make), ..self }
    }

    /// Builds the scenario from these keys; every value is checked.
    ///
    /// # Errors
    /// One error that names file, line, key and remedy.
    pub fn scenario(&self) -> Result<Scenario, FileError> {
        let Document { path, sources, keys, mujoco } = self;
        let toml: ScenarioToml =
            parse_toml(path, &keys.to_string()).map_err(|e| sources.wrong(&e.field, e.problem, e.remedy))?;
        if toml.format != FORMAT {
            return Err(sources.wrong("format", format!("is '{}'", toml.format), format!("write format = \"{FORMAT}\"")));
        }
        let robot = robot(&toml.robot, &sources.folder_of("robot"))
            .map_err(|e| if e.path.is_file() { e } else { sources.wrong("robot", e.problem, e.remedy) })?;
        if let Some(joint) = robot.first_prismatic() {
            let problem = format!("joint {} is prismatic, and simulated arms are those whose joints turn", joint + 1);
            return Err(sources.wrong("robot", problem, "name another robot"));
        }
        check::numbers(keys, sources)?;
        check::keys(&toml, robot.joints(), sources)?;
        if let Some(design) = &toml.design {
            design_check::check(design, &toml, sources)?;
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
            mujoco: *mujoco,
            plan: toml.plan,
            centring: toml.centring,
            tracker: toml.tracker,
            model,
            cell,
            sources: sources.clone(),
        })
    }

    /// Builds an error for a key, in the file that contains it.
    pub fn wrong(&self, key: &str, problem: impl Into<String>, remedy: impl Into<String>) -> FileError {
        self.sources.wrong(key, problem, remedy)
    }

    /// The keys as text, without these tables and names: equal for documents with equal content.
    pub fn text_without(&self, names: &[&str]) -> String {
        let rest = self.keys.iter().filter(|(name, _)| !names.contains(&name.as_str()));
        rest.map(|(name, value)| (name.clone(), value.clone())).collect::<Table>().to_string()
    }

    /// The value of a key.
    pub fn get(&self, key: &Key) -> Option<&Value> {
        key.find(&self.keys)
    }

    /// Sets the value of a key; missing tables on its path are created.
    ///
    /// # Errors
    /// If a part of the key's path is not a table, or an index is past the end of a list.
    pub fn set(&mut self, key: &Key, value: Value) -> Result<(), KeyError> {
        key.put(&mut self.keys, value)
    }

    /// Removes a key, or an element of a list.
    ///
    /// # Errors
    /// If there is no such key.
    pub fn remove(&mut self, key: &Key) -> Result<(), KeyError> {
        key.take(&mut self.keys)
    }
}
