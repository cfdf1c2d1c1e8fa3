//! The first screen: how bad it was, how good it is now at the same poses, where that is true, what causes it, what to do.

use super::diagnosis_sentences::{cause_words, first};
use super::effect_names::{capital, enumerated, few_of};
use super::figures::{EXPECTED_INSIDE, EXPECTED_OVER, NOT_FITTED, RESIDUAL};
use super::ladder_sentences::unconverged_sentence;
use super::meaning::meaning;
use super::printout::Printout;
use super::recommended::Recommended;
use super::tables::{Table, plain_table, validation_row};
use calibench::diagnosis::{Diagnosis, Verdict};
use calibench::effects::facts::{Intervention, Work};
use calibench::identify::fit::Outcome;
use calibench::judgement::{ErrorRow, ErrorTable, Expectations, Judgement, Loose, NoErrors, Stage};
use calibench::measure::dataset::NamedDataset;
use calibench::prediction::WorkspaceError;
use calibench::residuals::Validation;
use calibench::residuals::noise_floor::NoiseSource;
use calibench::selection::ToDo;
use calibench::units::{DEG, MM, UM};

/// Name of a state on every screen.
#[must_use]
pub fn stage_name(stage: Stage) -> &'static str {
    match stage {
        Stage::AsDelivered => "as delivered",
        Stage::Nominal => "nominal",
        Stage::Calibrated => "calibrated",
        Stage::Recommended => "recommended",
    }
}

/// What a state is, in a few words.
fn stage_remark(stage: Stage) -> &'static str {
    match stage {
        Stage::AsDelivered => "as commanded or stated",
        Stage::Nominal => "base and free tool fitted",
        Stage::Calibrated | Stage::Recommended => "",
    }
}

/// The data of a first screen in a line: what was fitted, what was held out, the noise that the data state, and whether the
/// masses of the arm are guessed.
#[must_use]
pub fn data_line(name: &str, errors: &ErrorTable, datasets: &[NamedDataset<'_>]) -> String {
    let judged = errors.last().map_or(0, |v| v.samples);
    let held_out = if errors.held_out { format!(", {judged} held out") } else { ", none held out".to_owned() };
    let masses = if datasets.iter().any(|d| d.dataset.robot.masses_guessed) { "; masses guessed" } else { "" };
    format!("{name}: {} samples fitted{held_out}; {}{masses}", errors.fitted, noise_words(datasets))
}

/// The noise that the first dataset states, in words.
fn noise_words(datasets: &[NamedDataset<'_>]) -> String {
    let noise = datasets.first().map(|d| &d.dataset.noise);
    let of = |name: &str, size: Option<f64>| size.map(|size| format!("{name} {:.0} µm", size / UM));
    let stated: Vec<String> =
        noise.map_or_else(Vec::new, |n| [of("balls", n.ball), of("points", n.point)].into_iter().flatten().collect());
    if stated.is_empty() {
        "instrument noise not stated".into()
    } else {
        format!("noise stated: {} per axis", stated.join(", "))
    }
}

/// The errors before and after, one row a state: mean, 95 %, max, and how many poses meet a tolerance (m), if there is one.
#[must_use]
pub fn error_table(errors: &ErrorTable, tolerance: Option<f64>) -> Table {
    let title = if errors.held_out { NOT_FITTED } else { RESIDUAL };
    let row = |row: &ErrorRow| {
        let name = stage_name(row.stage).to_owned();
        match &row.errors {
            Ok(v) => {
                let [mean, p95, max] = [v.mean, v.quantiles[4], v.max].map(|x| format!("{:.3}", x / MM));
                [name, mean, p95, max, tolerance.map_or_else(|| stage_remark(row.stage).into(), |t| met(v, t))]
            }
            Err(why) => [name, "-".into(), "-".into(), "-".into(), why.to_string()],
        }
    };
    let is_said = |row: &&ErrorRow| !matches!(row.errors, Err(NoErrors::SameModel));
    let title = format!("{}, mm", title.name);
    plain_table([title.as_str(), "mean", "95 %", "max", ""], errors.rows.iter().filter(is_said).map(row).collect())
}

/// The errors of measured orientations at the same poses, a state after the other; `None` if none were measured.
#[must_use]
pub fn orientation_sentence(errors: &ErrorTable) -> Option<String> {
    let of = |row: &ErrorRow| {
        let orientation = row.errors.as_ref().ok()?.orientation?;
        Some(format!("{} {:.3} deg", stage_name(row.stage), orientation.mean / DEG))
    };
    let known: Vec<String> = errors.rows.iter().filter_map(of).collect();
    (!known.is_empty()).then(|| format!("Orientation at the same poses, mean: {}.", known.join(", ")))
}

/// The rows of a table of errors that come before the calibration: as delivered and nominal, where they are known.
#[must_use]
pub fn rows_before(errors: &ErrorTable) -> Vec<[String; 7]> {
    let of = |row: &ErrorRow| Some(validation_row(stage_name(row.stage), row.errors.as_ref().ok()?));
    errors.rows.iter().take_while(|row| row.stage != Stage::Calibrated).filter_map(of).collect()
}

/// How many poses meet a tolerance (m).
fn met(errors: &Validation, tolerance: f64) -> String {
    format!("{:.3} met by {} of {}", tolerance / MM, errors.within(tolerance), errors.samples)
}

/// The error to expect, at named places.
#[must_use]
pub fn expected_sentence(expected: &Expectations) -> String {
    let part = |error: &Option<WorkspaceError>, name: &str| {
        error.as_ref().map(|e| {
            let [mean, low, high] = [e.mean.expected, e.mean.low, e.mean.high].map(|x| x / MM);
            let least = if e.at_least { "at least " } else { "" };
            format!("{name}: {least}{mean:.3} mm ({low:.3} to {high:.3})")
        })
    };
    let parts: Vec<String> = [part(&expected.inside, EXPECTED_INSIDE.name), part(&expected.over_limits, EXPECTED_OVER.name)]
        .into_iter()
        .flatten()
        .collect();
    let still = match expected.still.as_slice() {
        [] => String::new(),
        [one] => format!("; over the joint limits nothing is predicted, as joint {one} was measured in one place"),
        several => {
            let names: Vec<String> = several.iter().map(ToString::to_string).collect();
            format!("; over the joint limits nothing is predicted, as joints {} were measured in one place", enumerated(&names))
        }
    };
    match parts.as_slice() {
        [] if expected.undetermined.is_empty() => "No error is predicted: no pose of the robot is clear of itself.".into(),
        [] => format!("No error is predicted: these data do not determine {}.", expected.undetermined.join(", ")),
        parts => format!("{}{still}.{}", capital(&parts.join("; ")), loose_words(&expected.loose)),
    }
}

/// Why far more is to be expected elsewhere than at the poses held out; empty if it is not.
fn loose_words(loose: &[Loose]) -> String {
    let named: Vec<String> = loose.iter().map(|l| format!("{} (± {:.1} mm)", l.name, l.sigma / MM)).collect();
    match named.as_slice() {
        [] => String::new(),
        names => format!(
            " These data hardly determine {}: it matters wherever the hand points otherwise; tilt the hand at more poses, or state tool and base.",
            enumerated(names)
        ),
    }
}

/// What to do at the robot about the cause, if it is one and not corrected in the model alone.
fn at_the_robot(cause: &Diagnosis) -> Option<&'static str> {
    let is_named = matches!(cause.verdict_of_the_rest(), Verdict::Identified | Verdict::Partly);
    let first = first(cause).filter(|_| is_named)?;
    let Intervention { work, act, .. } = meaning(&cause.registry, &first.hypothesis.in_model).intervention;
    (work != Work::Model).then_some(act)
}

/// How long a row took, as an example on screens: what a robot needs to move, settle and be measured.
const ROW_TIME: &str = "30s";

/// What to do with a calibration that was written to this file, in order. `noise_stated` is false if the noise of the instrument is
/// only known from the residual.
#[must_use]
pub fn what_to_do_now(judgement: &Judgement, noise_stated: bool, file: &str, commands: &Recommended) -> Vec<String> {
    let Judgement { advice, cause, .. } = judgement;
    let errors = &judgement.errors;
    let mut all = vec![match (errors.does_harm(), errors.gains_nothing()) {
        (true, _) => format!("do not use {file}: at the poses held out it errs more than the nominal arm"),
        (_, true) => format!("{file} gains nothing: at the poses held out it errs no less than the nominal arm"),
        _ if cause.by_row_order.is_some() => format!("otherwise use {file}"),
        _ => format!("use {file}"),
    }];
    if cause.by_row_order.is_some() {
        let again = "if the rows stand in the order of measurement, calibrate again with";
        all.insert(0, format!("{again} `--every {ROW_TIME}`, or how long a row took"));
    } else if cause.verdict_of_the_rest() == Verdict::Unexplained
        && let Some(times) = cause.beyond_noise()
    {
        all.push(format!("check places, units and the stated noise: the residual is {times:.0} times that noise"));
    }
    let suspects: Vec<&str> = cause.scatter.suspects.iter().map(|s| s.sample.as_str()).collect();
    if !suspects.is_empty() {
        all.push(format!("measure {} again, or leave out, and calibrate again", few_of(&suspects)));
    }
    all.extend(at_the_robot(cause).map(|act| format!("at the robot: {act}")));
    match advice.to_do {
        ToDo::Unknown if cause.outcome == Outcome::Converged => {
            return vec!["correct the data, which do not fit the robot, and calibrate again".into()];
        }
        ToDo::Unknown => return vec![unconverged_sentence(cause.outcome).trim_end_matches('.').to_owned()],
        // No further pose tells what happened on the way.
        _ if cause.by_row_order.is_some() => {}
        ToDo::Distinguish => {
            all.push(format!("to know which effect it is, measure what `{}` proposes", commands.verb("plan next")));
        }
        _ if cause.is_thin() && cause.verdict_of_the_rest().is_noise() => {
            all.push(format!(
                "measure more postures, so few cannot show what is missing: `{}` proposes some",
                commands.verb("plan next")
            ));
        }
        _ if judgement.expected.inside.as_ref().is_some_and(|e| e.at_least) => {
            all.push(format!(
                "measure more postures where the robot is to work: `{}` proposes some",
                commands.verb("plan next")
            ));
        }
        ToDo::Stop => all.push(commands.more_measurements().trim_end_matches('.').to_owned()),
        _ => {}
    }
    let of_repeats = Some(&cause.scatter.noise).filter(|noise| noise.source == NoiseSource::Replicates).and_then(|n| n.level);
    if let Some(level) = of_repeats.filter(|_| !noise_stated) {
        all.push(format!(
            "state the noise of the instrument (--noise): what was measured twice scatters by {:.0} µm per axis",
            level.per_axis / UM
        ));
    } else if !noise_stated {
        let explains = judgement.errors.noise().unwrap_or(0.0);
        let per_axis = if judgement.errors.components == 1 { "" } else { " per axis" };
        all.push(format!(
            "state the noise of the instrument (--noise), or measure ten poses twice: {:.0} µm{per_axis} would explain the residual",
            explains / UM
        ));
    }
    // What happened on the way puts good rows far off.
    let has_strays = !errors.far_off.is_empty() && cause.by_row_order.is_none();
    if let (true, Some(half)) = (has_strays, errors.last()) {
        let rows: Vec<String> = errors.far_off.iter().map(|row| format!("{} ({:.3} mm)", row.sample, row.error / MM)).collect();
        all.push(format!(
            "measure again, or leave out, of the rows held out {}: half of them are within {:.3} mm",
            few_of(&rows),
            half.quantiles[2] / MM
        ));
    }
    all
}

/// A first screen without files and advice: the data, the errors before and after, what is to be expected, and what causes the
/// residual of the first model.
#[must_use]
pub fn first_screen(name: &str, datasets: &[NamedDataset<'_>], judgement: &Judgement, tolerance: Option<f64>) -> Printout {
    let Judgement { errors, expected, cause, .. } = judgement;
    Printout::from(data_line(name, errors, datasets) + "\n")
        + error_table(errors, tolerance)
        + orientation_sentence(errors).map_or_else(String::new, |sentence| format!("\n{sentence}"))
        + format!("\n{}\nCause: {}.", expected_sentence(expected), cause_words(cause))
}
