//! `identify DATASET... [--model M] -o CALIBRATION`.

use std::path::PathBuf;

use calibench::diagnosis::Diagnosis;
use calibench::diagnosis::shifts::Shifts;
use calibench::effects::registry::Registry;
use calibench::identify::calibration::{Calibration, IdentifyError, read_calibration, write_calibration};
use calibench::identify::fit::Outcome as FitOutcome;
use calibench::identify::fleet::identify_with_fleet;
use calibench::identify::identify;
use calibench::identify::problem::Use;
use calibench::residuals::misfit::unbelievable;
use calibench::units::MM;
use calibench_report::{
    Printout, RESIDUAL, abnormal_sentences, documents, fleet_sentence, frames_table, orientation_words, parameter_table,
    shifts_text, unbelievable_sentence, unresolved_sentences, weighing_sentence, wider_sentence,
};

use crate::arguments::data::{dataset, locate_in_data, model_of, named, read_datasets, read_fleet_of, tell_fit};
use crate::arguments::data_gate::{DoNotFit, gate};
use crate::terminal::failure::{Failure, Outcome};
use crate::terminal::output::{check_outputs, print, print_answer, print_json, print_written, warn};
use crate::terminal::progress::Waiting;
use crate::terminal::streams::{input, output};

#[derive(clap::Args)]
pub struct Arguments {
    /// Dataset folders of one robot; each session in each has its own base and tool
    #[arg(required = true, value_parser = dataset())]
    datasets: Vec<PathBuf>,
    /// Model file; the default is the paper's model: base_frame, mdh, joint_compliance
    #[arg(long, value_parser = input())]
    model: Option<PathBuf>,
    /// What robots of this type have in common, made by `keep fleet`: it is taken into account unless this robot is not like them
    #[arg(long, value_parser = input())]
    fleet: Option<PathBuf>,
    /// Output file for the calibration (TOML); an existing file is replaced
    #[arg(short, long, visible_alias = "out", value_parser = output())]
    output: Option<PathBuf>,
    /// Show how every effect missing from the model would shift the parameters at its plausible size
    #[arg(long)]
    shifts: bool,
    /// Continue with data that do not fit the robot; every result says so
    #[arg(long)]
    force: bool,
    /// Print one JSON document instead of tables
    #[arg(long)]
    json: bool,
}

pub fn run(arguments: &Arguments) -> Result<Outcome, Failure> {
    check_outputs(&arguments.output)?;
    let datasets = read_datasets(&arguments.datasets)?;
    let model = model_of(arguments.model.as_deref(), &arguments.datasets, &datasets)?;
    let locate = |e| locate_in_data(&arguments.datasets, &datasets, arguments.model.as_deref(), &e);
    let waiting = Waiting::new("fitting");
    let gate = gate(&datasets, Use::Fit, arguments.force, arguments.json)?;
    let fleet = arguments.fleet.as_deref().map(|path| read_fleet_of(path, &datasets)).transpose()?;
    let identified = match &fleet {
        Some(fleet) => identify_with_fleet(&named(&datasets), &model, fleet).map(|(c, judged)| (c, Some(judged))),
        None => identify(&named(&datasets), &model).map(|c| (c, None)),
    };
    let (mut calibration, fleet) = match identified {
        Err(e @ IdentifyError::Inconsistent { .. }) => return Err(e.into()),
        other => other.map_err(locate)?,
    };
    let shifts = match arguments.shifts {
        true => Some(Shifts::of(&named(&datasets), &model).map_err(locate)?),
        false => None,
    };
    drop(waiting);
    calibration.misfit.clone_from(&gate.misfit);
    tell_fit(&calibration);
    let corrections = unbelievable(&calibration);
    let absurd = unbelievable_sentence(&corrections);
    if let (Some(sentence), false) = (&absurd, arguments.force) {
        if arguments.json {
            print_json(&documents::Misfit::of_corrections(&corrections))?;
        }
        return Err(Box::new(DoNotFit(sentence.clone())));
    }
    if let Some(path) = &arguments.output {
        write_calibration(&calibration, path)?;
        // A device or a pipe cannot be read back.
        if path.is_file() {
            calibration.check_residual(&named(&datasets), &read_calibration(path, Registry::catalogue())?)?;
        }
        print_written(path);
    }
    if arguments.json {
        let shifts = shifts.as_ref().map(documents::Shifts::of);
        let document = documents::Calibration::of(&calibration);
        print_json(&documents::Calibration {
            misfit: gate.misfit,
            shifts,
            fleet: fleet.as_ref().map(documents::FleetUsed::of),
            ..document
        })?;
    } else {
        abnormal_sentences(&Diagnosis::abnormal_in(&named(&datasets), &calibration))
            .iter()
            .try_for_each(|sentence| print_answer(sentence))?;
        gate.tell()?;
        fleet.iter().try_for_each(|judged| print(fleet_sentence(judged)))?;
        absurd.iter().try_for_each(|sentence| print(sentence))?;
        print_answer(fit_text(&calibration))?;
        print(remarks(&calibration))?;
        let weighing = weighing_sentence(&calibration, &named(&datasets));
        if !weighing.is_empty() {
            print(weighing)?;
        }
        shifts.iter().try_for_each(|shifts| print(shifts_text(shifts)))?;
    }
    match calibration.unconverged() {
        None => Ok(Outcome::Done),
        Some(other) => {
            warn(&format!("warning: the fit {}: do not use this calibration", other.in_words()));
            Ok(Outcome::ExpectationFailed)
        }
    }
}

/// A calibration in words and tables.
pub fn story(c: &Calibration) -> Printout {
    fit_text(c) + "\n" + remarks(c)
}

/// The parameters of a fit and, below them, the fit in one sentence.
fn fit_text(c: &Calibration) -> Printout {
    let frames = frames_table(c).map(|table| Printout::from(table) + "\n").unwrap_or_default();
    Printout::from(parameter_table(c)) + "\n" + frames + fit_sentence(c)
}

/// A fit in one sentence.
fn fit_sentence(c: &Calibration) -> String {
    format!(
        "{} samples, {} independent parameters, {} {:.4} mm rms (3-D){}, chi2/dof {:.2} on {} degrees of freedom, {} Gauss-Newton steps, {}",
        c.samples,
        c.rank,
        RESIDUAL.name,
        c.rms / MM,
        orientation_words(c.rms_orientation),
        c.chi2_per_dof,
        c.dof,
        c.iterations,
        c.outcome.map_or("outcome not stated", FitOutcome::name)
    )
}

/// Remarks on a fit.
fn remarks(c: &Calibration) -> String {
    let o = &c.observability;
    let mut out = wider_sentence(c);
    if !c.noise_stated {
        out.push_str(
            "The data do not state their noise: uncertainties are scaled by the residuals, and chi2 says nothing of the fit.\n",
        );
    }
    out.push_str(&format!(
        "Observability (SI): O1 {:.4}, O2 {:.2e}, O3 {:.3}, O4 {:.2e}, O5 {:.4}; condition of the scaled Jacobian {:.0}\n",
        o.o1, o.o2, o.o3, o.o4, o.o5, c.condition
    ));
    let unresolved = unresolved_sentences(c);
    if !unresolved.is_empty() {
        out.push_str("Kept at their nominal values, because these data cannot distinguish them:\n");
        for sentence in unresolved {
            out.push_str(&format!("  {sentence}\n"));
        }
    }
    out
}
