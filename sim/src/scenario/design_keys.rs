//! The keys of a scenario's `[design]`: what an artifact may be made of, and where its balls may stand.

use calibench::files::FileError;
use serde::Deserialize;

use super::keys::ScenarioToml;
use super::sources::Sources;

/// Balls that an artifact may be designed with, fixed ones included.
const BALLS: [usize; 2] = [3, 8];
/// Places of the grid, riser heights included; postures of all of them (their Jacobians then take half a gigabyte).
const MOST_PLACES: usize = 20_000;
const MOST_POSTURES: usize = 400_000;

/// The keys under `[design]`.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(missing_docs)] // described in docs/scenarios.md
pub struct DesignToml {
    pub balls: usize,
    #[serde(default)]
    pub fixed: Vec<String>,
    #[serde(default)]
    pub without: Vec<String>,
    pub min_mm: [f64; 3],
    pub max_mm: [f64; 3],
    pub step_mm: f64,
    pub riser_heights_mm: Vec<f64>,
    pub table_mm: f64,
    #[serde(default = "riser_side")]
    pub riser_side_mm: f64,
    #[serde(default = "stem")]
    pub stem_mm: f64,
    #[serde(default = "stem_radius")]
    pub stem_radius_mm: f64,
    #[serde(default)]
    pub plate_kg_per_m2: f64,
    #[serde(default)]
    pub riser_kg: f64,
    #[serde(default)]
    pub riser_kg_per_m: f64,
    #[serde(default)]
    pub ball_kg: f64,
    pub most_kg: Option<f64>,
    #[serde(default = "probings")]
    pub probings: usize,
    #[serde(default = "pool_per_place")]
    pub pool_per_place: usize,
    #[serde(default = "workspace_poses")]
    pub workspace_poses: usize,
    #[serde(default = "starts")]
    pub starts: usize,
    #[serde(default = "finalists")]
    pub finalists: usize,
    #[serde(default)]
    pub scales: Vec<f64>,
}

fn riser_side() -> f64 {
    80.0
}

fn stem() -> f64 {
    50.0
}

fn stem_radius() -> f64 {
    5.0
}

fn probings() -> usize {
    80
}

fn pool_per_place() -> usize {
    150
}

fn workspace_poses() -> usize {
    200
}

fn starts() -> usize {
    8
}

fn finalists() -> usize {
    3
}

impl DesignToml {
    /// Grid places along each axis of the table, m apart as stated.
    pub fn columns(&self) -> [usize; 2] {
        [0, 1].map(|i| ((self.max_mm[i] - self.min_mm[i]) / self.step_mm + 1e-9).floor() as usize + 1)
    }

    /// Probings of each of that many balls: at least as many in all as stated.
    pub fn poses_per_ball(&self, balls: usize) -> usize {
        self.probings.div_ceil(balls)
    }

    /// That the numbers make sense, and that the balls named are there. Whether the bodies are is asked by who takes them away: of the
    /// scenario with the artifact designed, which extends this one, they are gone.
    pub(super) fn check(&self, toml: &ScenarioToml, sources: &Sources) -> Result<(), FileError> {
        let wrong = |key: &str, problem: String, remedy: &str| Err(sources.wrong(&format!("design.{key}"), problem, remedy));
        let [least, most] = BALLS;
        if !(least..=most).contains(&self.balls) {
            return wrong("balls", format!("is {}", self.balls), "give a whole number from 3 to 8, fixed balls included");
        }
        for (k, id) in self.fixed.iter().enumerate() {
            if !toml.balls.iter().any(|b| b.id == *id) || self.fixed[..k].contains(id) {
                return wrong(
                    "fixed",
                    format!("'{id}' is not a ball, or is named twice"),
                    "name balls of [[ball]] by their id",
                );
            }
        }
        if self.fixed.len() >= self.balls {
            let problem = format!("{} of {} balls are fixed", self.fixed.len(), self.balls);
            return wrong("fixed", problem, "leave at least one ball to be placed");
        }
        if (0..3).any(|i| self.min_mm[i] > self.max_mm[i]) {
            return wrong("min_mm", "lies beyond max_mm".into(), "give the least corner of the box, then the greatest");
        }
        for (key, value) in [
            ("step_mm", self.step_mm),
            ("riser_side_mm", self.riser_side_mm),
            ("stem_mm", self.stem_mm),
            ("stem_radius_mm", self.stem_radius_mm),
            ("most_kg", self.most_kg.unwrap_or(1.0)),
        ] {
            if value <= 0.0 {
                return wrong(key, format!("is {value}"), "give a positive number");
            }
        }
        for (key, value) in [
            ("plate_kg_per_m2", self.plate_kg_per_m2),
            ("riser_kg", self.riser_kg),
            ("riser_kg_per_m", self.riser_kg_per_m),
            ("ball_kg", self.ball_kg),
        ] {
            if value < 0.0 {
                return wrong(key, format!("is {value}"), "give zero or a positive number");
            }
        }
        let heights = &self.riser_heights_mm;
        if heights.is_empty() || heights.iter().any(|h| *h <= 0.0) || (1..heights.len()).any(|k| heights[k] <= heights[k - 1]) {
            return wrong("riser_heights_mm", format!("is {heights:?}"), "list positive heights, lowest first");
        }
        let [columns, rows] = self.columns();
        let places = columns.saturating_mul(rows).saturating_mul(heights.len());
        if places > MOST_PLACES {
            return wrong(
                "step_mm",
                format!("gives {places} places"),
                "take a wider step or a smaller box: at most 20000 places",
            );
        }
        let pool = self.poses_per_ball(self.balls.min(3));
        for (key, count, least, most) in [
            ("probings", self.probings, 12, 2000),
            ("pool_per_place", self.pool_per_place, pool, MOST_POSTURES / places),
            ("workspace_poses", self.workspace_poses, 10, 5000),
            ("starts", self.starts, 1, 1000),
            ("finalists", self.finalists, 1, 100),
        ] {
            if !(least..=most).contains(&count) {
                let remedy = format!("give a whole number from {least} to {most}");
                return wrong(key, format!("is {count}"), &remedy);
            }
        }
        match self.scales.iter().find(|s| !(0.0..=1.0).contains(*s) || **s == 0.0) {
            Some(scale) => wrong("scales", format!("{scale} is not a share"), "give shares of the box, above 0 and up to 1"),
            None => Ok(()),
        }
    }
}
