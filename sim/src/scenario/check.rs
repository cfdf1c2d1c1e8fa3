//! Checks of a scenario's numbers before anything runs.

use std::collections::BTreeMap;
use std::path::Path;

use calibench::effects::{EffectId, Subject};
use calibench::files::FileError;
use calibench::identify::Model;
use calibench::identify::model_file::{EffectList, check_effects};
use calibench::measure::dataset::Dataset;
use calibench::measure::dataset::file::check_description;
use calibench::units::UM;
use toml::{Table, Value};

use super::expect::{Expectation, Quantity};
use super::keys::{ModelToml, ScenarioToml, TRACKER_POOL};
use super::precision_keys::MOST_REPETITIONS;
use super::sources::Sources;
use crate::contact::TRAVEL;

/// Upper limit of any number of a cell, in mm, um, deg or the unit of its key: a kilometre in um.
const LARGEST: f64 = 1e9;
/// Limit on the balls of one artifact.
const MOST_BALLS: usize = 100;
/// Largest number of poses of one plan.
const MOST_POSES: usize = 2_000;
/// Largest number of candidates for them: their Jacobian then takes 100 MB.
const MOST_CANDIDATES: usize = 100_000;
/// Largest number of starts of the search.
const MOST_STARTS: usize = 100;
/// Largest number of validation poses.
const MOST_VALIDATION_POSES: usize = 20_000;
/// Largest force of an indicator's spring, N.
const MOST_FORCE: f64 = 100.0;
/// Lowest joint speed, deg/s, with which a session still ends.
const SLOWEST: f64 = 1e-3;

/// Checks that no number is absurd, and that no size is negative.
pub(super) fn numbers(merged: &Table, sources: &Sources) -> Result<(), FileError> {
    fn walk(key: String, value: &Value, visit: &mut dyn FnMut(&str, f64) -> Result<(), FileError>) -> Result<(), FileError> {
        match value {
            Value::Float(v) => visit(&key, *v),
            Value::Integer(v) => visit(&key, *v as f64),
            Value::Array(list) => list.iter().enumerate().try_for_each(|(k, v)| walk(format!("{key}[{k}]"), v, visit)),
            Value::Table(table) => table.iter().try_for_each(|(k, v)| {
                let key = if key.is_empty() { k.clone() } else { format!("{key}.{k}") };
                walk(key, v, visit)
            }),
            _ => Ok(()),
        }
    }
    walk(String::new(), &Value::Table(merged.clone()), &mut |key, value| {
        if value.abs() > LARGEST && key != "seed" {
            return Err(sources.wrong(key, format!("{value:e} is absurdly large"), "check its unit, which is in its name"));
        }
        if value < 0.0 && is_a_size(key) {
            return Err(sources.wrong(key, format!("is {value}, below zero"), "give zero or a positive number"));
        }
        Ok(())
    })
}

/// True if a negative number makes no sense for this key.
fn is_a_size(path: &str) -> bool {
    let last = path.rsplit('.').next().unwrap_or(path);
    let size = [
        "sigma_um",
        "noise_um",
        "ball_um",
        "point_um",
        "_arcsec",
        "mass_kg",
        "resolution",
        "hysteresis",
        "preload",
        "full_force",
        "drop_out",
        "_mrad",
        "concurrency_um",
        "ball_diameter_um",
        "ball_form_um",
        "facing_deg",
        "retreat_mm",
        "clearance_mm",
        "cone_deg",
        "settle_s",
        "warm_up_s",
        "scale_error_um",
        "placement_mm",
    ];
    size.iter().any(|s| last.contains(s)) && !path.starts_with("truth.effects") && !path.starts_with("truth.hidden")
}

/// Checks the lengths of lists and the bounds of numbers, for an arm of `joints` joints.
pub(super) fn keys(toml: &ScenarioToml, joints: usize, sources: &Sources) -> Result<(), FileError> {
    payloads_and_balls(toml, sources)?;
    joint_lists(toml, joints, sources)?;
    greatest(toml, sources)?;
    counts(toml, sources)?;
    let wrong = |key: &str, problem: String, remedy: String| Err(sources.wrong(key, problem, remedy));
    if toml.truth.controller.speed_deg_per_s < SLOWEST {
        let remedy = format!("give the joints a speed of at least {SLOWEST} deg/s");
        return wrong("truth.controller.speed_deg_per_s", "is not positive, or as good as zero".into(), remedy);
    }
    let repetitions = toml.precision.repetitions;
    if !(1..=MOST_REPETITIONS).contains(&repetitions) {
        let remedy = format!("give a whole number from 1 to {MOST_REPETITIONS}; the paper repeats it 3 times");
        return wrong("precision.repetitions", format!("is {repetitions}"), remedy);
    }
    for (key, value, most) in toml.precision.bounds() {
        if !(0.0..=most).contains(&value) {
            return wrong(key, format!("is {value}"), format!("give a number from 0 to {most}"));
        }
    }
    toml.instrument.check(sources)?;
    if toml.centring.tolerance_um <= 0.0 {
        return wrong("centring.tolerance_um", "is not positive".into(), "the paper nulls to 3 µm".into());
    }
    Ok(())
}

/// Checks that there are payloads and a sensible number of balls, each with a direction.
fn payloads_and_balls(toml: &ScenarioToml, sources: &Sources) -> Result<(), FileError> {
    let balls = &toml.balls;
    if toml.payloads.is_empty() {
        return Err(sources.wrong("payload", "there is none", "give at least one [[payload]]"));
    }
    if !(1..=MOST_BALLS).contains(&balls.len()) {
        let remedy = format!("give 1 to {MOST_BALLS} [[ball]]");
        return Err(sources.wrong("ball", format!("there are {}", balls.len()), remedy));
    }
    if let Some(k) = balls.iter().position(|ball| ball.outward.iter().all(|&v| v == 0.0)) {
        let key = format!("ball[{k}].outward");
        return Err(sources.wrong(&key, "has no direction", "point it away from the ball's stem"));
    }
    Ok(())
}

/// Checks the lists that hold one number per joint.
fn joint_lists(toml: &ScenarioToml, joints: usize, sources: &Sources) -> Result<(), FileError> {
    let controller = &toml.truth.controller;
    for (key, list) in [
        ("noise.joint_arcsec", &toml.noise.joint_arcsec),
        ("truth.controller.servo_error_arcsec", &controller.servo_error_arcsec),
        ("truth.controller.lost_motion_arcsec", &controller.lost_motion_arcsec),
        ("truth.controller.small_move_play_arcsec", &controller.small_move_play_arcsec),
    ] {
        if list.len() != joints {
            let remedy = format!("give one for each of the {joints} joints");
            return Err(sources.wrong(key, format!("has {} numbers", list.len()), remedy));
        }
    }
    Ok(())
}

/// Checks the upper bounds of a probability, two forces, two angles and a reading.
fn greatest(toml: &ScenarioToml, sources: &Sources) -> Result<(), FileError> {
    for (key, value, most) in [
        ("truth.indicators.drop_out", toml.truth.indicators.drop_out, 1.0),
        ("indicators.preload_n", toml.indicators.preload_n, MOST_FORCE),
        ("indicators.full_force_n", toml.indicators.full_force_n, MOST_FORCE),
        ("plan.cone_deg", toml.plan.cone_deg, 180.0),
        ("tracker.facing_deg", toml.tracker.facing_deg, 180.0),
        // With a tolerance beyond the range of an indicator everything would be centred.
        ("centring.tolerance_um", toml.centring.tolerance_um, TRAVEL / UM),
    ] {
        if value > most {
            return Err(sources.wrong(key, format!("is {value}"), format!("give a number from 0 to {most}")));
        }
    }
    Ok(())
}

/// Checks the numbers of poses, candidates and starts.
fn counts(toml: &ScenarioToml, sources: &Sources) -> Result<(), FileError> {
    let ScenarioToml { plan, tracker, balls, .. } = toml;
    if plan.light_poses > 0 && toml.payloads.len() < 2 {
        let remedy = "give a second [[payload]], or no light poses";
        return Err(sources.wrong("plan.light_poses", "needs a second payload", remedy));
    }
    let poses = MOST_POSES / balls.len();
    let per_ball = plan.poses_per_ball + plan.reserves_per_ball + plan.light_poses.div_ceil(balls.len());
    let reversible = plan.poses_per_ball.saturating_mul(balls.len());
    for (key, count, least, most) in [
        ("plan.poses_per_ball", plan.poses_per_ball, 1, poses),
        ("plan.reserves_per_ball", plan.reserves_per_ball, 0, poses),
        ("plan.light_poses", plan.light_poses, 0, MOST_POSES),
        ("plan.reversed_poses", plan.reversed_poses, 0, reversible),
        ("plan.point_poses", plan.point_poses, 0, TRACKER_POOL),
        ("plan.pool_per_ball", plan.pool_per_ball, per_ball, MOST_CANDIDATES / balls.len()),
        ("plan.starts", plan.starts, 1, MOST_STARTS),
        ("tracker.identification_poses", tracker.identification_poses, 1, TRACKER_POOL),
        ("tracker.validation_poses", tracker.validation_poses, 1, MOST_VALIDATION_POSES),
    ] {
        if !(least..=most).contains(&count) {
            let remedy = format!("give a whole number from {least} to {most}");
            return Err(sources.wrong(key, format!("is {count}"), remedy));
        }
    }
    Ok(())
}

/// Builds the model, after checking that it suits this cell and that the cell's datasets will be valid; errors name the
/// scenario's keys.
pub(super) fn cell(cell: &Dataset, toml: &ScenarioToml, sources: &Sources) -> Result<Model, FileError> {
    let in_model = toml.model.effect.len();
    // The tables `[[effect]]` are numbered after those of the model.
    let place = |field: &str| match field.strip_prefix("model.effect[").and_then(|rest| rest.split_once(']')) {
        Some((k, rest)) => match k.parse::<usize>() {
            Ok(k) if k >= in_model => format!("effect[{}]{rest}", k - in_model),
            _ => field.to_owned(),
        },
        None => field.to_owned(),
    };
    let as_here = |e: FileError| sources.wrong(&place(&e.field), e.problem, e.remedy);
    check_description(cell, &sources.folder_of("robot")).map_err(as_here)?;
    let balls = cell.ball_ids();
    let subject = Subject::new(&cell.robot, &balls);
    let ModelToml { effects, effect } = &toml.model;
    let tables = [effect.as_slice(), &toml.effects].concat();
    let list = EffectList { path: Path::new(""), text: "", key: "model.effects", ids: effects, tables: &tables };
    let (own, effects) = check_effects(&list, &subject).map_err(as_here)?;
    Ok(Model { effects: effects.into_iter().map(EffectId::from).collect(), own, ..Model::default() })
}

/// The expectations, in the order in which they are printed.
pub(super) fn expectations(expect: &BTreeMap<String, [f64; 2]>, sources: &Sources) -> Result<Vec<Expectation>, FileError> {
    let mut all = Vec::with_capacity(expect.len());
    for (name, &band) in expect {
        match Quantity::named(name) {
            Some(quantity) if band[0] <= band[1] => all.push(Expectation { quantity, band }),
            _ => {
                let known = Quantity::ALL.map(Quantity::name).join(", ");
                let remedy = format!("the checks are: {known}");
                return Err(sources.wrong(&format!("expect.{name}"), "is not a check with a band [least, most]", remedy));
            }
        }
    }
    all.sort_by_key(|e| e.quantity);
    Ok(all)
}
