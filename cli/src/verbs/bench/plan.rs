//! The file of the robots and their divisions, `calibench-bench-plan/1`.

use std::path::Path;

use calibench::files::{FileError, field_error, parse_toml, read_text};
use calibench::measure::dataset::NamedDataset;
use calibench_lab::prove::{Case, by_blocks, by_campaigns, by_places, by_postures, by_short_campaigns};
use serde::Deserialize;

/// The value of the key `format`.
const FORMAT: &str = "calibench-bench-plan/1";

/// All robots.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Plan {
    format: String,
    #[serde(default)]
    pub robot: Vec<RobotEntry>,
}

/// One robot.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RobotEntry {
    /// Its name on the leaderboard.
    pub name: String,
    /// Names of the folders of its datasets.
    pub data: Vec<String>,
    /// Number of random parts of the postures, left out one after the other.
    #[serde(default)]
    folds: usize,
    /// Number of blocks of joint space, left out one after the other.
    #[serde(default)]
    blocks: usize,
    /// Leave out the places of an artifact.
    #[serde(default)]
    places: bool,
    /// Leave out whole campaigns.
    #[serde(default)]
    campaigns: bool,
    /// Numbers of postures of short campaigns.
    #[serde(default)]
    short: Vec<usize>,
    /// Number of short campaigns of each length.
    #[serde(default = "one")]
    draws: usize,
    /// Largest number of rows of a dataset, spread over it.
    pub at_most: Option<usize>,
}

fn one() -> usize {
    1
}

/// Reads the file.
pub fn read_plan(path: &Path) -> Result<Plan, FileError> {
    let text = read_text(path)?;
    let plan: Plan = parse_toml(path, &text)?;
    if plan.format != FORMAT {
        return Err(field_error(path, &text, "format", format!("is '{}'", plan.format), format!("write \"{FORMAT}\"")));
    }
    Ok(plan)
}

impl RobotEntry {
    /// Its divisions.
    pub fn cases<'a>(&self, named: &[NamedDataset<'a>], seed: u64) -> Vec<Case<'a>> {
        let mut cases = Vec::new();
        for NamedDataset { name, dataset } in named {
            if self.folds > 1 {
                cases.extend(by_postures(name, dataset, self.folds, seed));
            }
            if self.blocks > 1 {
                cases.extend(by_blocks(name, dataset, self.blocks, seed));
            }
            if self.places {
                cases.extend(by_places(name, dataset));
            }
            for postures in &self.short {
                cases.extend(by_short_campaigns(name, dataset, *postures, self.draws, seed));
            }
        }
        if self.campaigns {
            cases.extend(by_campaigns(named, seed));
        }
        cases
    }
}
