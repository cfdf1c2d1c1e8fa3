//! Check that data fit their robot, made by every verb before it fits anything.

use calibench::identify::problem::Use;
use calibench::measure::dataset::Dataset;
use calibench::residuals::misfit::{DataFit, data_fit};
use calibench_report::{documents, masses_sentence, nominal_fit_lines};
use calibench_workbench::{copied_rows, located_misfit};

use super::data::named;
use crate::terminal::failure::Failure;
use crate::terminal::output::{print, print_answer, print_json, warn};

/// Data that do not fit their robot: rejected unless forced.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub(crate) struct DoNotFit(pub(crate) String);

/// The nominal fit of the data and, if they do not fit but the user continues, the reason.
pub(crate) struct Gate {
    pub(crate) fits: Vec<DataFit>,
    /// The sentence repeated in every result.
    pub(crate) misfit: Option<String>,
    /// That the masses of the robot are guessed.
    masses: Option<&'static str>,
}

impl Gate {
    /// Prints the nominal fits, any misfit and whether masses are guessed, ahead of other text.
    pub(crate) fn tell(&self) -> Result<(), Failure> {
        nominal_fit_lines(&self.fits).iter().try_for_each(|line| print(line))?;
        self.masses.iter().try_for_each(|line| print(*line))?;
        self.misfit.iter().try_for_each(|sentence| print_answer(sentence))
    }

    /// All datasets that do not fit, each with its sentence: they need not all be examined together.
    pub(crate) fn misfits(&self) -> Vec<(String, String)> {
        let misfits = self.fits.iter().filter_map(|fit| fit.misfit.as_ref());
        misfits.map(|m| (m.nominal.dataset.clone(), located_misfit(m))).collect()
    }
}

/// Checks, before any identification, that the data fit their robot, based on the rows selected by `which`. A dataset that has
/// no folder yet has no name. Impossible session times, and joints beyond their limits, are reported on standard error: they only spoil effects of time.
///
/// # Errors
/// If the data do not fit, or rows are given twice, unless `force`: exit code 2, and with `json` one document on standard output.
pub(crate) fn gate(datasets: &[(String, Dataset)], which: Use, force: bool, json: bool) -> Result<Gate, Failure> {
    for (name, dataset) in datasets {
        let file = if name.is_empty() { String::new() } else { format!("{name}/samples.csv: ") };
        dataset.long_sessions().iter().for_each(|session| warn(&format!("warning: {file}{session}")));
        // An import says so in its report.
        if !name.is_empty() {
            dataset.beyond_limits().iter().for_each(|joint| warn(&format!("warning: {file}{joint}")));
        }
    }
    if let (Some(copied), false) = (copied_rows(datasets), force) {
        return Err(Box::new(copied));
    }
    // Data of different arms are rejected as such elsewhere.
    let one_arm = datasets.iter().all(|(_, d)| d.robot.is_same_arm(&datasets[0].1.robot));
    let fits = if one_arm { data_fit(&named(datasets), which) } else { Vec::new() };
    let misfit = fits.iter().find_map(|fit| fit.misfit.as_ref());
    if let (Some(misfit), false) = (misfit, force) {
        if json {
            print_json(&documents::Misfit::of(misfit))?;
        }
        return Err(Box::new(DoNotFit(located_misfit(misfit))));
    }
    let misfit = misfit.map(located_misfit);
    let masses = datasets.iter().find_map(|(_, d)| masses_sentence(&d.robot));
    Ok(Gate { fits, misfit, masses })
}
