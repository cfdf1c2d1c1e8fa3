//! Output of `sim precision`.

use calibench::units::UM;
use calibench_report::{Printout, Table, plain_table};
use nalgebra::Vector3;
use serde_json::{Value, json};

use super::{Budget, EXPECTED_UM, Largest, PAPER_LARGEST_UM, PrecisionTest, RootMeanSquare, Setup, Source};
use crate::study::Share;

fn um(value: f64) -> String {
    format!("{:.2}", value / UM)
}

fn signed(value: f64) -> String {
    format!("{:+.2}", value / UM)
}

fn band([low, high]: [f64; 2]) -> String {
    format!("{} to {}", um(low), um(high))
}

/// The procedure and its results: the deviations compared with the paper's, their spread, and the budget.
/// The procedure, the deviations that were found, and those of the paper.
pub fn precision_text(scenario: &str, seed: u64, setup: &Setup, test: &PrecisionTest, budget: &Budget) -> Printout {
    let title = format!(
        "Precision of the TriCal of scenario '{scenario}' on a simulated measuring machine, seed {seed}: the procedure of the paper's Table 3\n"
    );
    let mut out = Printout::from(title) + procedure(setup, test);
    out = out + "\n\nDeviation of the datum ball from the master ball, um\n" + deviations(setup, test);
    out.push("\nThe paper prints the largest deviation alone, no coordinates, and does not say whether it is 3-D.");
    out.push(format!(
        "\n\n{}\n\nWhat it is made of: root mean square of the 3-D deviation over {} such tests, µm\n",
        spread(budget),
        budget.trials
    ));
    out + contributions(setup, budget) + "\n" + sum(budget)
}

fn point(v: &Vector3<f64>) -> String {
    format!("{}, {}, {} µm", signed(v.x), signed(v.y), signed(v.z))
}

fn procedure(setup: &Setup, test: &PrecisionTest) -> Table {
    let left = test.repetitions.iter().map(|r| r.left.amax()).fold(0.0, f64::max);
    let steps: Vec<String> = test.repetitions.iter().map(|r| r.steps.to_string()).collect();
    let residual = Vector3::from(test.mastering.preset_residual);
    let row = |step: &str, done: &str, result: String| [step.to_owned(), done.to_owned(), result];
    let rows = vec![
        row("1", "1.5-inch master ball into the trihedral socket", String::new()),
        row("2", "master the three indicators: 6.350 mm", format!("they then read {} more", point(&residual))),
        row("3", "measure the master ball", format!("at {}", point(&test.master))),
        row("4", "master ball out", String::new()),
        row("5", "centre a datum ball on the small arm", format!("steps {}; left at most {} µm", steps.join(", "), um(left))),
        row("6", "measure the datum ball", "see below".to_owned()),
        row("7", "datum ball away", String::new()),
        row("8", "5 to 7 again", format!("{} in all, {:.0} min", setup.repetitions, test.duration_s / 60.0)),
    ];
    plain_table(["step", "what is done", "what came out"], rows)
}

fn deviations(setup: &Setup, test: &PrecisionTest) -> Table {
    let none = || "-".to_owned();
    let mut rows: Vec<[String; 6]> = test
        .repetitions
        .iter()
        .enumerate()
        .map(|(k, r)| {
            let d = &r.deviation;
            let [x, y, z] = [d.x, d.y, d.z].map(signed);
            [format!("repetition {}", k + 1), x, y, z, um(d.norm()), um(r.left.amax())]
        })
        .collect();
    let [x, y, z] = [0, 1, 2].map(|k| um(test.largest_along(k)));
    let left = test.repetitions.iter().map(|r| r.left.amax()).fold(0.0, f64::max);
    rows.push(["largest".into(), x, y, z, um(test.largest()), um(left)]);
    let tolerance = format!("{:.0} allowed", setup.tolerance / UM);
    rows.push([
        "largest, paper (section 4)".into(),
        none(),
        none(),
        none(),
        format!("{PAPER_LARGEST_UM:.0}, about"),
        tolerance,
    ]);
    plain_table(["", "x", "y", "z", "3-D", "left at the stop"], rows)
}

fn spread(budget: &Budget) -> String {
    let line = |what: &str, l: &Largest| {
        let band = match l.median_band {
            [Some(low), Some(high)] => format!(" ({})", band([low, high])),
            _ => String::new(),
        };
        let [low, high] = EXPECTED_UM;
        let inside = share(&l.as_expected);
        format!(
            "{what}: median {} µm{band}, nine in ten within {} µm; {inside} within {low} to {high} µm.",
            um(l.median),
            band_of(l)
        )
    };
    format!(
        "Largest of the repetitions over {} such tests, every error sampled again, 95 % bands in brackets:\n{}\n{}",
        budget.trials,
        line("3-D", &budget.largest),
        line("along one axis", &budget.largest_along_axis)
    )
}

fn band_of(largest: &Largest) -> String {
    band(largest.range)
}

fn share(share: &Share) -> String {
    let [low, high] = share.band().map(|v| 100.0 * v);
    format!("{:.0} % ({low:.0} to {high:.0} %)", 100.0 * share.value())
}

fn contributions(setup: &Setup, budget: &Budget) -> Table {
    let mut all = budget.contributions.clone();
    // The sort is stable: equal shares keep the order of the sources.
    all.sort_by(|a, b| b.share.total_cmp(&a.share));
    let rows: Vec<[String; 6]> = all
        .iter()
        .map(|c| {
            let percent = format!("{:.1}", 100.0 * c.share);
            [
                c.source.words().into(),
                setup.size_of(c.source),
                um(c.alone.value),
                band(c.alone.band),
                percent,
                um(c.without.value),
            ]
        })
        .collect();
    plain_table(["source", "size", "alone", "95 % band", "share, %", "all but it"], rows)
}

fn sum(budget: &Budget) -> String {
    format!(
        "Root sum square of the sources alone {} µm; all at once {} µm ({}).",
        um(budget.root_sum_square),
        um(budget.total.value),
        band(budget.total.band)
    )
}

fn rms_json(rms: &RootMeanSquare) -> Value {
    json!({"rms_um": rms.value / UM, "band_um": rms.band.map(|v| v / UM)})
}

fn largest_json(l: &Largest) -> Value {
    json!({"median_um": l.median / UM, "median_band_um": l.median_band.map(|v| v.map(|v| v / UM)),
        "five_to_ninety_five_percent_um": l.range.map(|v| v / UM), "expected_um": EXPECTED_UM,
        "as_expected": l.as_expected.value(), "as_expected_band": l.as_expected.band()})
}

/// The same as one document, `calibench-precision/1`.
/// The same as a document.
pub fn precision_json(scenario: &str, seed: u64, setup: &Setup, test: &PrecisionTest, budget: &Budget) -> Value {
    let vector = |v: &Vector3<f64>| [v.x / UM, v.y / UM, v.z / UM];
    let along = [0, 1, 2].map(|k| test.largest_along(k) / UM);
    let repetitions: Vec<Value> = test
        .repetitions
        .iter()
        .map(|r| {
            json!({"deviation_um": vector(&r.deviation), "distance_um": r.deviation.norm() / UM,
                "left_um": vector(&r.left), "steps": r.steps})
        })
        .collect();
    let sources: Vec<Value> = budget
        .contributions
        .iter()
        .map(|c| {
            let source: Source = c.source;
            json!({"source": source.name(), "words": source.words(), "size": setup.size_of(source), "alone": rms_json(&c.alone),
                "without": rms_json(&c.without), "share": c.share})
        })
        .collect();
    json!({
        "format": "calibench-precision/1", "scenario": scenario, "seed": seed,
        "test": {"master_um": vector(&test.master), "preset_residual_um": test.mastering.preset_residual.map(|v| v / UM),
            "free_reading_mm": test.mastering.free_reading.map(|v| v * 1e3), "duration_s": test.duration_s,
            "repetitions": repetitions, "largest_um": test.largest() / UM,
            "largest_along_axis_um": along},
        "paper": {"largest_um": PAPER_LARGEST_UM, "source": "Icli, Stepanenko, Bonev, Sensors 20 (2020) 5919, section 4: about 2 um"},
        "budget": {"trials": budget.trials, "total": rms_json(&budget.total), "root_sum_square_um": budget.root_sum_square / UM,
            "largest": largest_json(&budget.largest), "largest_along_axis": largest_json(&budget.largest_along_axis), "sources": sources}
    })
}
