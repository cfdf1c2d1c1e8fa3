//! Tests of the advice on held-out postures.

use std::path::{Path, PathBuf};

use calibench::files::disk::write_whole;
use calibench::identify::problem::Use;
use calibench::measure::dataset::NamedDataset;
use calibench_lab::prove::{
    Case, Proof, Proven, Summary, by_blocks, by_campaigns, by_places, by_postures, by_short_campaigns, csv,
};
use serde_json::json;

use super::{Arguments, FOLDS, thin};
use crate::arguments::data::{named, read_datasets};
use crate::terminal::failure::{Failure, Outcome};
use crate::terminal::output::{check_outputs, print_answer, print_json};
use crate::terminal::progress::Waiting;

pub fn run(arguments: &Arguments) -> Result<Outcome, Failure> {
    let rows = arguments.rows.as_ref().map(|folder| folder.join("rows.csv"));
    check_outputs(arguments.output.iter().chain(&rows))?;
    let mut datasets = read_datasets(&arguments.datasets)?;
    for (_, dataset) in &mut datasets {
        thin(dataset, arguments.at_most.unwrap_or(usize::MAX), Use::All);
    }
    let named = named(&datasets);
    let cases = cases(arguments, &named);
    if cases.is_empty() {
        return Err(
            "there is nothing to divide; give data of more postures, or other divisions (--folds, --blocks, --short)".into()
        );
    }
    let waiting = Waiting::new("proving");
    let mut proofs: Vec<Proof> = Vec::with_capacity(cases.len());
    for case in &cases {
        waiting.now(format!("proving {}, {}", case.robot, case.fold));
        let Proven { mut proof, default, .. } = case.prove().map_err(|e| format!("{}, {}: {e}", case.robot, case.fold))?;
        if let Some(folder) = &arguments.rows {
            let path = free_name(folder, &case.file_name(), &proofs);
            write_whole(&path, csv(&case.rows(&default)?).as_bytes())?;
            proof.rows = Some(path);
        }
        proofs.push(proof);
    }
    drop(waiting);
    let table = markdown(&proofs);
    if let Some(path) = &arguments.output {
        write_whole(path, table.as_bytes())?;
    }
    if arguments.json {
        print_json(&json!({"format": "calibench-proof/1", "summary": Summary::of(&proofs), "proofs": proofs}))?;
    } else {
        print_answer(table)?;
    }
    Ok(Outcome::Done)
}

/// All requested divisions.
fn cases<'a>(arguments: &Arguments, named: &[NamedDataset<'a>]) -> Vec<Case<'a>> {
    let Arguments { blocks, places, campaigns, short, draws, seed, .. } = *arguments;
    let mut cases = Vec::new();
    for NamedDataset { name, dataset } in named {
        let folds = arguments.folds.unwrap_or(FOLDS);
        if folds > 1 {
            cases.extend(by_postures(name, dataset, folds, seed));
        }
        if blocks > 1 {
            cases.extend(by_blocks(name, dataset, blocks, seed));
        }
        if places {
            cases.extend(by_places(name, dataset));
        }
        if let Some(postures) = short {
            cases.extend(by_short_campaigns(name, dataset, postures, draws, seed));
        }
    }
    if campaigns {
        cases.extend(by_campaigns(named, seed));
    }
    cases
}

/// A path for the file not yet used by another proof: names that differ only in non-alphanumeric characters coincide.
fn free_name(folder: &Path, name: &str, proofs: &[Proof]) -> PathBuf {
    let stem = name.trim_end_matches(".csv");
    let numbered = (2..).map(|k| folder.join(format!("{stem}-{k}.csv")));
    let is_free = |path: &PathBuf| proofs.iter().all(|p| p.rows.as_ref() != Some(path));
    std::iter::once(folder.join(name)).chain(numbered).find(is_free).unwrap_or_else(|| folder.join(name))
}

/// The proofs as a table, and their summary.
fn markdown(proofs: &[Proof]) -> String {
    let mut out = String::from(
        "| data | left out | postures fitted, judged | geometry mm | default mm | recommended mm | which | ratio | predicted / measured, default | recommended | verdict | s |\n|---|---|---|---|---|---|---|---|---|---|---|---|\n",
    );
    let number = |x: Option<f64>, digits: usize| x.map_or("-".into(), |x| format!("{x:.digits$}"));
    for p in proofs {
        out.push_str(&format!(
            "| {} | {} | {}, {} | {} | {:.4} | {:.4} | {} | {:.3} | {} | {} | {} | {:.1} |\n",
            p.robot,
            p.fold,
            p.postures[0],
            p.postures[1],
            number(p.geometry_mm, 4),
            p.default_mm,
            p.recommended_mm,
            p.kind,
            p.ratio(),
            number(p.predicted_over_measured[0], 2),
            number(p.predicted_over_measured[1], 2),
            p.verdict,
            p.seconds
        ));
    }
    let s = Summary::of(proofs);
    out.push_str(&format!(
        "\n{} divisions: recommended over default {:.3} on average, {:.3} at worst, at most 1.02 in {:.0} %; predicted over measured within 0.8 to 1.25 in {:.0} % (default model) and {:.0} % (recommended).\n",
        s.proofs,
        s.mean_ratio,
        s.worst_ratio,
        100.0 * s.harmless,
        100.0 * s.predictions_fair[0],
        100.0 * s.predictions_fair[1]
    ));
    out
}
