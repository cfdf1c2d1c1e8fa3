//! `import log FILE... --robot ROBOT -o DATASET`: where the arm was in a recording, and what was measured then.

use std::path::Path;

use calibench::files::disk::write_whole;
use calibench::identify::problem::Use;
use calibench::import::{ImportOptions, state_noise};
use calibench::measure::dataset::SampleSet;
use calibench::measure::dataset::file::write_dataset_with;
use calibench_logs::{Excluded, LogTable, MOMENTS, STILLS};
use calibench_report::documents;

use super::{Arguments, holdout};
use crate::arguments::data_gate::gate;
use crate::arguments::logs::table;
use crate::terminal::failure::{Failure, Outcome};
use crate::terminal::output::{print, print_answer, print_detail, print_json};
use crate::terminal::progress::Waiting;

/// The column map by which the table was read.
const MAP: &str = "map.toml";

pub fn run(arguments: &Arguments) -> Result<Outcome, Failure> {
    let other = [
        (!arguments.validation.is_empty(), "--validation"),
        (arguments.map.is_some(), "--map"),
        (arguments.distance.is_some(), "--distance"),
    ];
    if let Some((_, flag)) = other.into_iter().find(|(given, _)| *given) {
        return Err(
            format!("{flag} is not for logs; their columns are known, and --holdout keeps a share for validation").into()
        );
    }
    let Some(named) = arguments.robot.as_ref().and_then(|robot| robot.to_str()) else {
        return Err("log needs the robot; give --robot NAME, a robot file or a URDF".into());
    };
    let folder = &arguments.output;
    let waiting = Waiting::new("reading the log");
    let workplace = tempfile::tempdir()?;
    let LogTable { text, file, guess, said, rows, excluded, shift_s, shift_sigma_s } =
        table(&arguments.files, named, &arguments.log, arguments.noise, workplace.path())?;
    let table = workplace.path().join(file);
    let options =
        ImportOptions { holdout: holdout(arguments), set_up_of: arguments.set_up_of.clone(), ..ImportOptions::default() };
    let (mut dataset, report) = guess.import(&[table], &options)?;
    if let Some(noise) = arguments.noise {
        state_noise(&mut dataset, noise);
    }
    // Also before a refusal: what was understood may be what is wrong.
    if !arguments.json {
        said.iter().try_for_each(print)?;
    }
    let datasets = [(String::new(), dataset)];
    let gate = gate(&datasets, Use::All, arguments.force, arguments.json)?;
    drop(waiting);
    let [(_, dataset)] = datasets;
    let map = if dataset.noise.point.is_some() { guess.map_with(&dataset.noise) } else { guess.map.clone() };
    write_dataset_with(&dataset, folder, &[STILLS, MOMENTS, MAP], |inside| {
        write_whole(&inside.join(file), text.as_bytes())?;
        write_whole(&inside.join(MAP), map.as_bytes())
    })?;
    let kept = dataset.samples.iter().filter(|s| s.set == SampleSet::Validation).count();
    let all = dataset.samples.len();
    if arguments.json {
        let document = documents::ImportReport::new(&report, folder.display().to_string());
        let log = documents::ImportedLog {
            rests: rows,
            shift_s,
            shift_sigma_s,
            understood: said,
            excluded: excluded.iter().map(document_of).collect(),
        };
        let nominal_fit = gate.fits.first().map(|fit| documents::NominalFit::of(&fit.nominal));
        let counted = documents::ImportReport {
            samples: all,
            validation: kept,
            nominal_fit,
            misfit: gate.misfit,
            log: Some(log),
            ..document
        };
        print_json(&counted)?;
        return Ok(Outcome::Done);
    }
    excluded.iter().for_each(|e| print_detail(format!("  {:.2} to {:.2} s: {}", e.from_s, e.to_s, e.why)));
    guess.reasons.iter().for_each(print_detail);
    print_detail(report.to_string());
    gate.tell()?;
    print_answer(format!("{all} samples, {kept} of them for validation; dataset in {}", folder.display()))?;
    // Beside the data of an earlier campaign it is for a check or for what a crash moved.
    if arguments.set_up_of.is_none() {
        print_answer(next(folder))?;
    }
    Ok(Outcome::Done)
}

fn document_of(excluded: &Excluded) -> documents::ExcludedRest {
    documents::ExcludedRest { from_s: excluded.from_s, to_s: excluded.to_s, why: excluded.why.to_owned() }
}

fn next(folder: &Path) -> String {
    format!("Next: `calibench calibrate {} -o FOLDER`.", folder.display())
}
