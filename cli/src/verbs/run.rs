//! `run SCENARIO`: the whole procedure in words, from the plan to the paper's Table 9.

use calibench::measure::dataset::NamedDataset;
use std::path::{Path, PathBuf};

use calibench::diagnosis::Examination;
use calibench::files::FileError;
use calibench::files::disk::replace_folder;
use calibench::files::disk::{check_output_folder, write_whole};
use calibench::identify::calibration::write_calibration;
use calibench::identify::model_file::write_model;
use calibench::judgement::ErrorTable;
use calibench::measure::dataset::file::write_dataset;
use calibench::prediction::WorkspacePoses;
use calibench::units::{MM, UM};
use calibench_report::documents::to_value;
use calibench_report::{
    Printout, Table, documents, histogram, judged_alike, plain_table, rows_before, validation_row, validation_table,
};

use super::identify::story;
use super::plan::chosen_sentence;
use crate::arguments::choices::PlantChoice;
use crate::arguments::choices::seed;
use crate::arguments::data::forecast;
use crate::arguments::scenario::read_scenario;
use crate::tables::hidden::{hidden_effects, hidden_text, named};
use crate::terminal::failure::{Failure, Outcome};
use crate::terminal::output::{print, print_answer, print_json, warn};
use crate::terminal::progress::{CampaignBar, Waiting};
#[cfg(feature = "mujoco")]
use calibench::files::with_reasons;
use calibench_sim::compensation::Compensation;
use calibench_sim::ground_truth::{GroundTruth, ground_truth};
use calibench_sim::plans::Plans;
use calibench_sim::random::Streams;
use calibench_sim::run::{Check, Method, Run, RunError, run as procedure};
use calibench_sim::scenario::PlantKind;
use calibench_sim::scenario::Scenario;
use calibench_sim::score::ScoredParameter;

/// The paper's Table 9, mm: mean, maximum, standard deviation.
const PAPER: [(&str, [f64; 3]); 2] = [("trical", [0.326, 0.624, 0.107]), ("tracker", [0.231, 0.539, 0.087])];

/// File of the simulated arm's true positions, for the replay; never read by calibration or judgement.
const TRUE_ARM: &str = "true_arm.csv";

#[derive(clap::Args)]
pub struct Arguments {
    /// Scenario file
    scenario: PathBuf,
    /// Output folder for datasets, calibrations, iterations, result.json and report.html; an existing run is replaced
    #[arg(short, long, visible_alias = "output")]
    out: Option<PathBuf>,
    /// Plant that simulates the mechanics of the cell, overriding the scenario's choice
    #[arg(long, value_enum)]
    plant: Option<PlantChoice>,
    /// Render the cell off screen to cell.png and gauge.png in the run folder (needs MuJoCo)
    #[arg(long, requires = "out")]
    render: bool,
    /// Seed that replaces the scenario's
    #[arg(long, value_parser = seed, allow_negative_numbers = true)]
    seed: Option<u64>,
    /// Print one JSON document instead of text
    #[arg(long)]
    json: bool,
}

pub fn run(arguments: &Arguments) -> Result<Outcome, Failure> {
    if let Some(folder) = &arguments.out {
        check_output_folder(folder, "run", FILES[0])?;
    }
    let mut scenario = read_scenario(&arguments.scenario)?;
    scenario.expect_trical("run")?;
    scenario.plant = arguments.plant.map_or(scenario.plant, PlantKind::from);
    let seed = arguments.seed.unwrap_or(scenario.seed);
    let waiting = Waiting::new("planning");
    let plans = Plans::new(&scenario, seed).map_err(|e| scenario.locate_plan(&e))?;
    drop(waiting);
    let mut bar = CampaignBar::new(plans.plan.wanted());
    let result = procedure(&scenario, plans, Streams { seed, trial: 0 }, &mut bar);
    drop(bar);
    let run = result.map_err(|e| scenario.locate(&e))?;
    let checks = run.checks(&scenario);
    let truth = ground_truth(&scenario, &Streams { seed, trial: 0 }, &run.trical.dataset, &run.trical.calibration)
        .map_err(|e| scenario.locate(&RunError::Identify(e)))?;
    let document = document(&scenario, &run, &checks, &truth);
    if let Some(folder) = &arguments.out {
        write_run(folder, &scenario, &run, &document)?;
        if arguments.render {
            render(&scenario, &run, folder);
        }
        let _waiting = Waiting::new("writing the report");
        super::report::write_report_of(folder)?;
    }
    if arguments.json {
        print_json(&document)?;
    } else {
        tell(&scenario, &run, &checks, &truth)?;
        if let Some(folder) = &arguments.out {
            print_answer(format!("Written to {}", folder.display()))?;
        }
    }
    Ok(if checks.iter().all(Check::met) { Outcome::Done } else { Outcome::ExpectationFailed })
}

/// Draws the first centred ball; a failure does not affect the run.
#[cfg(feature = "mujoco")]
fn render(scenario: &Scenario, run: &Run, folder: &Path) {
    let streams = Streams { seed: run.seed, trial: 0 };
    let Some(first) = run.campaign.samples.first() else { return };
    if let Err(error) = calibench_mujoco::draw(scenario, &streams, &first.q, folder) {
        warn(&format!("warning: no picture: {}", with_reasons(&error)));
    }
}

#[cfg(not(feature = "mujoco"))]
fn render(_: &Scenario, _: &Run, _: &Path) {
    warn(
        "warning: no picture: MuJoCo draws it, and this program was built without; run sim/setup.sh, then build with --features mujoco",
    );
}

/// Describes the whole run, in the order of the work.
fn tell(scenario: &Scenario, run: &Run, checks: &[Check], truth: &GroundTruth) -> Result<(), Failure> {
    print(format!(
        "{}: {}\nrobot {}, {} plant, seed {}\n",
        scenario.name,
        scenario.question,
        scenario.dataset().robot_reference,
        scenario.plant.name(),
        run.seed
    ))?;
    print_answer("POSITION ERRORS, measured, held out: the tracker's validation poses (paper: Table 9)")?;
    print_answer(errors_table(run))?;
    difference(run).iter().try_for_each(|sentence| print(sentence))?;
    print("\nPLAN")?;
    print(chosen_sentence("probings", run.plan.wanted(), &run.plan.chosen))?;
    print(chosen_sentence("tracker poses", run.tracker_plan.identification.poses.len(), &run.tracker_plan.chosen))?;
    print("\nMASTERING")?;
    let free = run.mastering.free_reading.map(|r| r / MM);
    let left = run.mastering.preset_residual.map(|r| r / UM);
    print(format!(
        "free readings {:.4}, {:.4}, {:.4} mm (ideal -6.1500); after the preset the master ball reads {:+.1}, {:+.1}, {:+.1} µm off",
        free[0], free[1], free[2], left[0], left[1], left[2]
    ))?;
    print("\nCENTRING")?;
    print(probings_table(run))?;
    print(centring_summary(run))?;
    print("\nPARAMETERS, by TriCal")?;
    print(story(&run.trical.calibration))?;
    print("\nHISTOGRAM of the TriCal's position errors")?;
    print(histogram(&run.trical.validation, 12))?;
    print(
        "COMPENSATION: targets sent to the robot's own controller, which uses the nominal model; true position error of the tool",
    )?;
    print(compensation_text(run))?;
    print("\nTRUTH against estimate (the simulated cell keeps score)")?;
    print(format!(
        "{:.0} % of {} parameters within 1 sigma, {:.0} % within 2, {:.0} % within 3; a perfect model gives 68, 95, 99.7",
        100.0 * run.trical.score.within(1.0),
        run.trical.score.parameters.len(),
        100.0 * run.trical.score.within(2.0),
        100.0 * run.trical.score.within(3.0)
    ))?;
    print("\nHIDDEN in the simulated cell against what the TriCal's data show of it")?;
    print(hidden_text(truth))?;
    if !checks.is_empty() {
        print_answer("\nEXPECTED")?;
        for c in checks {
            let verdict = if c.met() { "met" } else { "NOT MET" };
            print_answer(format!("  {:18} {:10.4}  in [{}, {}]  {verdict}", c.name, c.value, c.band[0], c.band[1]))?;
        }
    }
    Ok(())
}

/// Position errors before and after calibration, each method's above the paper's.
fn errors_table(run: &Run) -> Table {
    let judged = [NamedDataset::new("validation", &run.validation)];
    let mut rows = rows_before(&ErrorTable::of(&judged, &run.trical.calibration, None));
    for method in [&run.trical, &run.tracker] {
        rows.push(validation_row(title(method.name), &method.validation));
        if let Some((_, paper)) = PAPER.iter().find(|(name, _)| *name == method.name) {
            let [mean, max, std] = paper.map(|v| format!("{v:.3}"));
            rows.push([
                format!("  the paper's {}", title(method.name)),
                mean,
                max,
                std,
                String::new(),
                String::new(),
                String::new(),
            ]);
        }
    }
    validation_table(rows)
}

/// The reason why the TriCal's errors on the validation poses differ from those expected there, if they do.
fn difference(run: &Run) -> Option<String> {
    let Method { dataset, calibration, validation, .. } = &run.trical;
    let fitted = [NamedDataset::new("trical", dataset)];
    let examination = Examination::new(&fitted, &calibration.model).ok()?;
    let at = WorkspacePoses::of(&[NamedDataset::new("validation", &run.validation)]);
    let forecast = forecast(&fitted, &examination, &at).ok()?.ok()?;
    judged_alike(validation, &forecast.error, forecast.extrapolation.outside)
}

fn compensation_text(run: &Run) -> Printout {
    let Some(Compensation { refused, before, after }) = &run.compensation else {
        return "not one target could be compensated".into();
    };
    let rows = vec![validation_row("as they are", before), validation_row("compensated, by TriCal", after)];
    let others = match refused {
        0 => String::new(),
        some => format!("; {some} more were refused: out of a joint's limits, or bent the other way"),
    };
    Printout::from(validation_table(rows)) + format!("\n{} targets{others}", after.samples)
}

fn title(name: &str) -> &str {
    if name == "trical" { "TriCal" } else { "laser tracker" }
}

/// A table of all probings with their readings, one line each.
fn probings_table(run: &Run) -> Table {
    let um = |r: f64| format!("{:+.1}", r / UM);
    let rows: Vec<[String; 7]> = run
        .campaign
        .probings
        .iter()
        .map(|p| {
            let pose = &run.plan.probing.poses[p.pose];
            let ball = pose.ball.map(|ball| run.trical.dataset.balls[ball].id.clone()).unwrap_or_default();
            let time = format!("{:.1}", p.probing.duration_s);
            let arrived = p.probing.first_reading().map_or_else(String::new, |r| format!("{:.3}", r.norm() / MM));
            match &p.probing.outcome {
                Ok(c) => [
                    pose.id.clone(),
                    ball,
                    arrived,
                    (c.steps + 1).to_string(),
                    [um(c.reading.x), um(c.reading.y), um(c.reading.z)].join("  "),
                    time,
                    String::new(),
                ],
                Err(failure) => [pose.id.clone(), ball, arrived, String::new(), String::new(), time, failure.to_string()],
            }
        })
        .collect();
    plain_table(["probing", "ball", "off at first mm", "readings", "left µm", "time s", ""], rows)
}

fn centring_summary(run: &Run) -> String {
    let probings = &run.campaign.probings;
    let time: f64 = probings.iter().map(|p| p.probing.duration_s).sum();
    format!(
        "{} of {} probings centred, {:.2} readings each; {:.1} s a probing, {:.0} min of cell time in all (the paper: about 30 s a probing)",
        run.campaign.samples.len(),
        run.plan.wanted(),
        run.campaign.readings_mean(),
        time / probings.len().max(1) as f64,
        time / 60.0
    )
}

fn document(scenario: &Scenario, run: &Run, checks: &[Check], truth: &GroundTruth) -> documents::Run {
    let validation = documents::Validation::of;
    let compensation = run.compensation.as_ref().map(|c| documents::CompensationErrors {
        refused: c.refused,
        before: validation(&c.before),
        after: validation(&c.after),
    });
    let paper = |(name, [mean_mm, max_mm, std_mm]): (&str, [f64; 3])| {
        (name.to_owned(), documents::PaperErrors { mean_mm, max_mm, std_mm })
    };
    let finite = |x: f64| x.is_finite().then_some(x);
    let check = |c: &Check| documents::ExpectedCheck {
        name: c.name.into(),
        value: finite(c.value),
        band: c.band.map(finite),
        met: c.met(),
    };
    documents::Run {
        format: documents::RunFormat::Current,
        scenario: scenario.name.clone(),
        question: scenario.question.clone(),
        plant: scenario.plant.name().into(),
        seed: run.seed,
        methods: [&run.trical, &run.tracker].map(|m| of_method(m, run)).into(),
        compensation,
        before: documents::BeforeCalibration { mean_mm: run.before.mean / MM, max_mm: run.before.max / MM },
        paper: PAPER.into_iter().map(paper).collect(),
        hidden_against_found: hidden_effects(truth),
        diagnosed: named(truth),
        expect: documents::Expectations { met: checks.iter().all(Check::met), checks: checks.iter().map(check).collect() },
    }
}

fn of_method(m: &Method, run: &Run) -> documents::RunMethod {
    let scored = |p: &ScoredParameter| {
        let unit = m.calibration.estimate(&p.name)?.unit;
        let [truth, estimate, sigma] = [p.truth, p.estimate, p.sigma].map(|x| unit.from_si(x));
        let sigma = sigma.is_finite().then_some(sigma);
        Some(documents::ScoredParameter { name: p.name.clone(), truth, estimate, sigma, unit: unit.symbol.into() })
    };
    documents::RunMethod {
        name: m.name.into(),
        probings: m.dataset.samples.len(),
        readings_mean: (m.name == "trical").then(|| run.campaign.readings_mean()),
        validation: documents::Validation::of(&m.validation),
        calibration: documents::Calibration::of(&m.calibration),
        score: m.score.parameters.iter().filter_map(scored).collect(),
    }
}

/// Contents of a run folder; the first file marks it as such.
pub const FILES: &[&str] = &[
    documents::Run::FILE,
    "trical",
    "tracker",
    "validation",
    "trical.toml",
    "tracker.toml",
    "iterations.csv",
    "probings.csv",
    TRUE_ARM,
    "scene.toml",
    crate::arguments::data::MODEL,
    super::report::FILE,
    "cell.png",
    "gauge.png",
];

/// Writes the run folder, all or nothing.
fn write_run(folder: &Path, scenario: &Scenario, run: &Run, document: &documents::Run) -> Result<(), FileError> {
    replace_folder(folder, "run", FILES, |inside| {
        write_dataset(&run.trical.dataset, &inside.join("trical"))?;
        write_dataset(&run.tracker.dataset, &inside.join("tracker"))?;
        write_dataset(&run.validation, &inside.join("validation"))?;
        write_calibration(&run.trical.calibration, &inside.join("trical.toml"))?;
        write_calibration(&run.tracker.calibration, &inside.join("tracker.toml"))?;
        write_model(&run.trical.calibration.model, &inside.join(crate::arguments::data::MODEL))?;
        run.campaign.write(inside, &run.plan.probing.poses, &scenario.ball_ids())?;
        run.true_arm.write(&run.campaign, &inside.join(TRUE_ARM))?;
        scenario.scene().write(&inside.join("scene.toml"))?;
        write_whole(&inside.join(documents::Run::FILE), format!("{:#}\n", to_value(document)).as_bytes())
    })
}
