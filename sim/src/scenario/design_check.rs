//! Checks of the keys of `[design]`.

use calibench::files::FileError;

use super::design_keys::DesignToml;
use super::keys::ScenarioToml;
use super::sources::Sources;

/// Allowed number of balls of an artifact, fixed ones included.
const BALLS: [usize; 2] = [3, 8];
/// Largest number of places of the grid, riser heights included.
const MOST_PLACES: usize = 20_000;
/// Largest number of postures of all places: their Jacobians then take half a gigabyte.
const MOST_POSTURES: usize = 400_000;

/// Checks that the numbers make sense, and that the balls named exist. The bodies are checked when they are removed: in the
/// scenario with the designed artifact, which extends this one, they are absent.
pub(super) fn check(design: &DesignToml, toml: &ScenarioToml, sources: &Sources) -> Result<(), FileError> {
    let wrong = |key: &str, problem: String, remedy: &str| Err(wrong(sources, key, problem, remedy));
    balls(design, toml, sources)?;
    if (0..3).any(|i| design.min_mm[i] > design.max_mm[i]) {
        return wrong("min_mm", "lies beyond max_mm".into(), "give the least corner of the box, then the greatest");
    }
    signs(design, sources)?;
    let heights = &design.riser_heights_mm;
    if heights.is_empty() || heights.iter().any(|h| *h <= 0.0) || (1..heights.len()).any(|k| heights[k] <= heights[k - 1]) {
        return wrong("riser_heights_mm", format!("is {heights:?}"), "list positive heights, lowest first");
    }
    let [columns, rows] = design.columns();
    let places = columns.saturating_mul(rows).saturating_mul(heights.len());
    if places > MOST_PLACES {
        return wrong("step_mm", format!("gives {places} places"), "take a wider step or a smaller box: at most 20000 places");
    }
    let pool = design.poses_per_ball(design.balls.min(3));
    for (key, count, least, most) in [
        ("probings", design.probings, 12, 2000),
        ("pool_per_place", design.pool_per_place, pool, MOST_POSTURES / places),
        ("workspace_poses", design.workspace_poses, 10, 5000),
        ("starts", design.starts, 1, 1000),
        ("finalists", design.finalists, 1, 100),
    ] {
        if !(least..=most).contains(&count) {
            let remedy = format!("give a whole number from {least} to {most}");
            return wrong(key, format!("is {count}"), &remedy);
        }
    }
    match design.scales.iter().find(|s| !(0.0..=1.0).contains(*s) || **s == 0.0) {
        Some(scale) => wrong("scales", format!("{scale} is not a share"), "give shares of the box, above 0 and up to 1"),
        None => Ok(()),
    }
}

/// An error for a key of `[design]`.
fn wrong(sources: &Sources, key: &str, problem: String, remedy: &str) -> FileError {
    sources.wrong(&format!("design.{key}"), problem, remedy)
}

/// Checks the number of balls and the fixed ones.
fn balls(design: &DesignToml, toml: &ScenarioToml, sources: &Sources) -> Result<(), FileError> {
    let wrong = |key: &str, problem: String, remedy: &str| Err(wrong(sources, key, problem, remedy));
    let [least, most] = BALLS;
    if !(least..=most).contains(&design.balls) {
        return wrong("balls", format!("is {}", design.balls), "give a whole number from 3 to 8, fixed balls included");
    }
    for (k, id) in design.fixed.iter().enumerate() {
        if !toml.balls.iter().any(|b| b.id == *id) || design.fixed[..k].contains(id) {
            return wrong("fixed", format!("'{id}' is not a ball, or is named twice"), "name balls of [[ball]] by their id");
        }
    }
    if design.fixed.len() >= design.balls {
        let problem = format!("{} of {} balls are fixed", design.fixed.len(), design.balls);
        return wrong("fixed", problem, "leave at least one ball to be placed");
    }
    Ok(())
}

/// Checks that lengths and the greatest mass are positive, and that no other mass is negative.
fn signs(design: &DesignToml, sources: &Sources) -> Result<(), FileError> {
    for (key, value) in [
        ("step_mm", design.step_mm),
        ("riser_side_mm", design.riser_side_mm),
        ("stem_mm", design.stem_mm),
        ("stem_radius_mm", design.stem_radius_mm),
        ("most_kg", design.most_kg.unwrap_or(1.0)),
    ] {
        if value <= 0.0 {
            return Err(wrong(sources, key, format!("is {value}"), "give a positive number"));
        }
    }
    for (key, value) in [
        ("plate_kg_per_m2", design.plate_kg_per_m2),
        ("riser_kg", design.riser_kg),
        ("riser_kg_per_m", design.riser_kg_per_m),
        ("ball_kg", design.ball_kg),
    ] {
        if value < 0.0 {
            return Err(wrong(sources, key, format!("is {value}"), "give zero or a positive number"));
        }
    }
    Ok(())
}
