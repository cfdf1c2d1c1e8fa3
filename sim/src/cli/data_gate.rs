//! Whether data fit their robot at all: asked by every verb before it fits anything.

use calibench::assess::{DataFit, Misfit, data_fit};
use calibench::identify::Use;
use calibench::measure::Dataset;
use calibench::report::{misfit_json, misfit_sentence, nominal_fit_lines};

use super::{Failure, named, print, print_json};

/// Data that do not fit their robot: nothing is done with them unless it is asked for.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub(super) struct DoNotFit(pub(super) String);

/// What the nominal arm leaves of the data, and why they do not fit, where they do not and the user goes on all the same.
pub(super) struct Gate {
    pub(super) fits: Vec<DataFit>,
    /// The sentence that every result keeps.
    pub(super) misfit: Option<String>,
}

impl Gate {
    /// Prints the nominal fits, and the misfit where there is one, ahead of other text.
    pub(super) fn tell(&self) -> Result<(), Failure> {
        nominal_fit_lines(&self.fits).iter().try_for_each(|line| print(line))?;
        self.misfit.iter().try_for_each(|sentence| print(sentence))
    }

    /// Adds the misfit to a JSON document.
    pub(super) fn mark(&self, document: &mut serde_json::Value) {
        if let Some(sentence) = &self.misfit {
            document["misfit"] = sentence.as_str().into();
        }
    }

    /// Every dataset that does not fit, with its sentence: not all of them need be looked at together.
    pub(super) fn misfits(&self) -> Vec<(String, String)> {
        let misfits = self.fits.iter().filter_map(|fit| fit.misfit.as_ref());
        misfits.map(|m| (m.nominal.dataset.clone(), sentence(m))).collect()
    }
}

/// Whether the data fit their robot at all, judged by the rows that `which` takes; before anything is identified. A dataset that has no
/// folder yet has no name. Times that no session can have are said on standard error: they spoil effects of time alone.
///
/// # Errors
/// Where they do not fit, unless `force`: exit code 2, and with `json` one document on standard output.
pub(super) fn gate(datasets: &[(String, Dataset)], which: Use, force: bool, json: bool) -> Result<Gate, Failure> {
    for (name, dataset) in datasets {
        let file = if name.is_empty() { String::new() } else { format!("{name}/samples.csv: ") };
        dataset.long_sessions().iter().for_each(|session| eprintln!("warning: {file}{session}"));
    }
    // Another arm's data are refused as that.
    let one_arm = datasets.iter().all(|(_, d)| d.robot.is_same_arm(&datasets[0].1.robot));
    let fits = if one_arm { data_fit(&named(datasets), which) } else { Vec::new() };
    let misfit = fits.iter().find_map(|fit| fit.misfit.as_ref());
    if let (Some(misfit), false) = (misfit, force) {
        if json {
            print_json(&misfit_json(misfit))?;
        }
        return Err(Box::new(DoNotFit(sentence(misfit))));
    }
    let misfit = misfit.map(sentence);
    Ok(Gate { fits, misfit })
}

/// The misfit in words, at the file to look into.
fn sentence(misfit: &Misfit) -> String {
    match misfit.nominal.dataset.as_str() {
        "" => misfit_sentence(misfit),
        name => format!("{name}/samples.csv: {}", misfit_sentence(misfit)),
    }
}
