//! Many runs of one robot in words and tables.

use calibench::effects::EffectId;
use calibench::effects::registry::Registry;
use calibench::identify::calibration::Estimate;
use calibench::monitoring::runs::tables::{EffectInRuns, EffectStatus, ParameterInRuns, ParameterStatus};
use calibench::monitoring::runs::{Difference, Pattern, RunsComparison, RunsTest, RunsVerdict};
use calibench::units::{MM, UM};

use super::effect_names::called;
use super::printout::Printout;
use super::tables::{Table, plain_rows};

/// Number of indistinguishable differences that are named.
const MOST_ALIASES: usize = 4;

/// A chance in words.
fn chance(p: f64) -> String {
    match p {
        p if p < 1e-15 => "under 1e-15".into(),
        p if p < 1e-2 => format!("{p:.0e}"),
        p => format!("{p:.2}"),
    }
}

/// Decimals that show a value to a tenth of its one-sigma.
fn decimals(sigma: f64) -> usize {
    if sigma > 0.0 { (1.0 - sigma.log10().floor()).clamp(0.0, 6.0) as usize } else { 3 }
}

fn with_sigma(value: f64, sigma: f64) -> String {
    let places = decimals(sigma);
    format!("{value:+.places$} ± {sigma:.places$}")
}

fn amount(e: &Estimate) -> String {
    format!("{} {}", e.name.split([' ', '@']).next().unwrap_or(&e.name), size(e))
}

fn size(e: &Estimate) -> String {
    let unit = e.unit.si;
    format!("{} {}", with_sigma((e.value - e.nominal) / unit, e.sigma / unit), e.unit.symbol)
}

/// A difference between runs in a sentence.
#[must_use]
pub fn difference_sentence(registry: &Registry, difference: &Difference, runs: &[&str]) -> String {
    let amounts: Vec<String> = difference.parameters.iter().map(amount).collect();
    let amounts = amounts.join(", ");
    let when = difference.pattern.words(runs);
    let test = format!("chance {} of each of {} differences tried", chance(difference.test.chance), difference.tried);
    if let Some(run) = difference.set_up_of {
        if difference.effect == EffectId::PAYLOAD_MASS {
            return format!(
                "The payload of {} differs from what was entered by {} ({test}), if that of the other runs is right. That is not part of the robot: weigh it, and enter its mass.",
                runs[run],
                difference.parameters.iter().map(size).collect::<Vec<_>>().join(", ")
            );
        }
        let what = match difference.effect.whole() {
            EffectId::TOOL_FRAME => "The tool".to_owned(),
            EffectId::BASE_FRAME => "The base".to_owned(),
            other => called(registry, other),
        };
        return format!(
            "{what} of {} is not where it is stated to be: {amounts} ({test}). That is not part of the robot: measure it again, or state it `free`.",
            runs[run]
        );
    }
    if difference.missing {
        let run = match difference.pattern {
            Pattern::Only(run) | Pattern::Since(run) => runs[run],
            Pattern::Drift => runs[0],
        };
        return format!(
            "{} differs in {run} from the rest: {amounts} ({test}). The model lacks it, and it is refused, since it is not of the robot in all runs: find out what was different in {run}.",
            called(registry, &difference.effect)
        );
    }
    match difference.pattern {
        Pattern::Drift => format!("Drifted, {when}: {amounts} ({test})."),
        _ => format!("Moved, {when}: {amounts} ({test})."),
    }
}

fn test_words(test: &RunsTest) -> String {
    format!("F {:.2} on {:.0} and {:.0} degrees of freedom, chance {}", test.f, test.above, test.below, chance(test.chance))
}

/// Answers in sentences what differs between the runs, and whether one geometry explains them.
pub fn runs_answer(c: &RunsComparison) -> String {
    let names: Vec<&str> = c.runs.iter().map(|run| run.name.as_str()).collect();
    let differences = c.differences.iter().map(|difference| difference_sentence(&c.model.registry, difference, &names));
    differences.chain([verdict_sentence(c)]).collect::<Vec<_>>().join("\n")
}

fn verdict_sentence(c: &RunsComparison) -> String {
    let warmer = c.warmer.map(|apart| {
        format!("the mean temperatures of these runs differ by {apart:.1} K, and no effect of the model depends on it")
    });
    match c.verdict {
        RunsVerdict::OneGeometry => format!("One geometry explains all runs ({}).", test_words(&c.after)),
        RunsVerdict::Changed => format!(
            "One geometry explains all runs but for that ({}; without it chance {}).{}",
            test_words(&c.after),
            chance(c.before.chance),
            warmer.map_or_else(String::new, |warmer| format!(
                " But {warmer}: compare them with `thermal_growth:temp` in the model before this is believed."
            ))
        ),
        RunsVerdict::Several if warmer.is_some() => format!(
            "One geometry does not explain these runs, nor does it with a few changes ({}); but {}: compare them with `thermal_growth:temp` in the model before any of this is believed.",
            test_words(&c.after),
            warmer.unwrap_or_default()
        ),
        RunsVerdict::Several => format!(
            "One geometry does not explain these runs, nor does it with a few changes ({}): another robot, an arm that was taken apart, or runs of different robots. Compare them two by two.",
            test_words(&c.after)
        ),
    }
}

fn runs_table(c: &RunsComparison, dates: &[Option<String>]) -> Table {
    let dated = dates.iter().any(Option::is_some);
    let header =
        ["run", "date", "samples", "postures", "residual mm", "noise \u{b5}m", "from the others mm", "with error curves mm"];
    let row = |(k, run): (usize, &calibench::monitoring::runs::tables::RunOfRobot)| {
        let error = |place: usize| match run.from_others.as_ref().map(|both| &both[place]) {
            Some(Ok(errors)) => format!("{:.3}", errors.rms / MM),
            _ => "-".into(),
        };
        vec![
            run.name.clone(),
            dates[k].clone().unwrap_or_default(),
            run.samples.to_string(),
            run.postures.to_string(),
            format!("{:.3}", run.residual / MM),
            format!("{:.1}", run.noise / UM),
            error(0),
            error(1),
        ]
    };
    let kept = |mut cells: Vec<String>| {
        if !dated {
            cells.remove(1);
        }
        cells
    };
    let rows = c.runs.iter().enumerate().map(row).map(kept).collect();
    plain_rows(kept(header.map(String::from).into()), rows)
}

fn parameter_row(p: &ParameterInRuns, drifts: bool) -> Vec<String> {
    let unit = p.first.unit.si;
    let largest = p.changes.iter().flatten().skip(1).max_by(|a, b| (a[0] / a[1]).abs().total_cmp(&(b[0] / b[1]).abs()));
    let places = decimals(p.first.sigma / unit);
    let mut row = vec![
        p.first.name.clone(),
        format!("{:.places$}", p.last / unit),
        format!("{:.places$}", p.first.sigma / unit),
        largest.map_or_else(|| "-".into(), |[value, sigma]| with_sigma(value / unit, sigma / unit)),
        match p.status {
            ParameterStatus::Stayed => "stayed",
            ParameterStatus::Moved => "moved",
            ParameterStatus::Unseen => "not seen",
        }
        .into(),
        p.first.unit.symbol.into(),
    ];
    if drifts {
        let most = p.drift.map(|d| d.at_most / unit).filter(|most| most.is_finite());
        row.insert(5, most.map_or_else(|| "-".into(), |most| format!("{most:.2e}")));
    }
    row
}

fn effect_sentence(registry: &Registry, e: &EffectInRuns, runs: &[&str]) -> String {
    let name = called(registry, &e.effect);
    let sizes: Vec<String> =
        runs.iter().zip(&e.in_runs).map(|(run, [sigmas, _])| format!("{sigmas:.1} sigma in {run}")).collect();
    let amounts: Vec<String> = e.parameters.iter().map(amount).collect();
    let sizes = sizes.join(", ");
    match e.status {
        EffectStatus::Stayed => format!("{name} stayed: {} ({sizes}).", amounts.join(", ")),
        EffectStatus::Moved => format!("{name} is there and has not stayed ({sizes})."),
        EffectStatus::OnlyIn(run) => {
            format!("{name} is refused: it belongs to {} only ({sizes}), and the other runs would show it.", runs[run])
        }
        EffectStatus::RestsOn(run) => format!("{name} rests on {} alone ({sizes}): the other runs cannot show it.", runs[run]),
        EffectStatus::NotThere => format!("{name} is not there ({sizes}): leave it out of the model."),
    }
}

/// The comparison as text: the error at runs left out, what differs, and every parameter.
#[must_use]
pub fn runs_text(c: &RunsComparison, dates: &[Option<String>]) -> Printout {
    let names: Vec<&str> = c.runs.iter().map(|run| run.name.as_str()).collect();
    let mut out = Printout::default();
    if let [Some(plain), Some(curved)] = c.left_out {
        let best = if c.curves { "with the error curves" } else { "with the model alone" };
        out.push(format!(
            "Every run predicted by the robot of the others: {:.3} mm rms, {:.3} mm with error curves of all joints. The best prediction is {best}.\n",
            plain / MM,
            curved / MM
        ));
    }
    out.push(runs_table(c, dates));
    out.push("\n");
    for run in &c.runs {
        if let Some(because) = run.from_others.iter().flatten().find_map(|r| r.as_ref().err()) {
            out.push(format!("{} cannot be judged: {because}.\n", run.name));
        }
    }
    for difference in &c.differences {
        out.push(format!("{}\n", difference_sentence(&c.model.registry, difference, &names)));
        let (named, others) = difference.aliased.split_at(difference.aliased.len().min(MOST_ALIASES));
        if !named.is_empty() {
            let more = if others.is_empty() { String::new() } else { format!("; and {} others", others.len()) };
            out.push(format!("  These runs cannot distinguish it from: {}{more}.\n", named.join("; ")));
        }
    }
    out.push(format!("{}\n", verdict_sentence(c)));
    for effect in &c.effects {
        out.push(format!("{}\n", effect_sentence(&c.model.registry, effect, &names)));
    }
    let drifts = c.parameters.iter().any(|p| p.drift.is_some());
    let mut header = vec!["parameter", "in the last run", "1 sigma", "largest change since the first", "", "unit"];
    if drifts {
        header.insert(5, "drift a month under");
    }
    let rows: Vec<Vec<String>> = c.parameters.iter().map(|p| parameter_row(p, drifts)).collect();
    out + "\n" + plain_rows(header, rows) + "\n"
}
