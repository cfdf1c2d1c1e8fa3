//! `measure --by-hand STATION -o TABLE`: somebody jogs the robot, the program reads joints and points.

use std::path::Path;
use std::sync::mpsc::RecvTimeoutError;
use std::time::Duration;

use calibench::files::FileError;
use calibench::files::disk::write_whole;
use calibench::identify::problem::Use;
use calibench::import::{ImportError, guess};
use calibench::measure::dataset::NamedDataset;
use calibench::residuals::misfit::data_fit;
use calibench::robot::Robot;
use calibench::robot::robot_file::robot as robot_named;
use calibench::units::MM;
use calibench_readout::{Attendant, ByHand, Ended, Journal, Typed, read_station};
use calibench_report::misfit_sentence;

use crate::arguments::data::from_anywhere;
use crate::terminal::failure::{Failure, Interrupted, Outcome, hardware};
use crate::terminal::operator::Operator;
use crate::terminal::output::print_answer;
use crate::terminal::progress::Waiting;

/// What is measured by hand.
const POSTURES: &str = "postures";

pub fn run(station: &Path, robot: Option<&str>, output: &Path, resume: bool) -> Result<Outcome, Failure> {
    let known = robot.map(|named| Ok::<_, Failure>((robot_named(named, Path::new(""))?, from_anywhere(named)))).transpose()?;
    let station = read_station(station)?;
    if output.exists() {
        return Err(FileError::whole(output, "exists already", "give another name, or delete it").into());
    }
    let mut by_hand = ByHand::connect(&station).map_err(|e| hardware(&e))?;
    let mut journal = Journal::open(output, by_hand.units(), Some(&station.conditions()), resume)?;
    let mut person = Person { operator: Operator::who_jogs(), waiting: Waiting::new(""), known };
    let ended = by_hand.run(&mut journal, &mut person);
    let Person { waiting, .. } = person;
    drop(waiting);
    let (kept, path) = (journal.rows().len(), journal.path().to_owned());
    let interrupted = |why: String| Interrupted { why, what: POSTURES, kept, journal: path.clone() };
    match ended {
        Err(e) => return Err(interrupted(e.to_string()).into()),
        Ok(ended) if kept == 0 => {
            journal.discard()?;
            let said = if ended == Ended::Interrupted { "interrupted; nothing was measured" } else { "nothing was measured" };
            return Err(said.into());
        }
        Ok(Ended::Interrupted) => return Err(interrupted("interrupted".into()).into()),
        Ok(Ended::Finished) => journal.finish().map_err(|e| interrupted(e.to_string()))?,
    }
    let table = output.display();
    print_answer(format!("{kept} {} in {table}", if kept == 1 { "posture" } else { POSTURES }))?;
    print_answer(format!("Next: `calibench calibrate {table} --robot {} -o FOLDER`.", robot.unwrap_or("ROBOT")))?;
    Ok(Outcome::Done)
}

/// Whoever jogs, at the terminal.
struct Person {
    operator: Operator,
    waiting: Waiting,
    /// The robot that is measured, and its name, if they are known.
    known: Option<(Robot, String)>,
}

impl Attendant for Person {
    fn tell(&mut self, sentence: &str) {
        self.waiting.say(sentence);
    }

    fn show(&mut self, status: &str) {
        self.waiting.now(status);
    }

    fn typed(&mut self, wait: Duration) -> Typed {
        match self.operator.line(wait) {
            Ok(line) => Typed::Line(line),
            Err(RecvTimeoutError::Timeout) => Typed::Nothing,
            Err(RecvTimeoutError::Disconnected) => Typed::End,
        }
    }

    fn judge(&mut self, table: &str) -> Option<String> {
        let (robot, name) = self.known.as_ref()?;
        let folder = tempfile::tempdir().ok()?;
        let file = folder.path().join("table.csv");
        write_whole(&file, table.as_bytes()).ok()?;
        let unfit = |why: &str| Some(format!("So far this is not {}: {why}", robot.name));
        let found = match guess(&file, robot, name) {
            Ok(found) => found,
            Err(ImportError::File(e)) => return unfit(&format!("{}; {}.", e.problem, e.remedy)),
            Err(e) => return unfit(&format!("{e}.")),
        };
        let fits = data_fit(&[NamedDataset::new("", &found.dataset)], Use::All);
        match fits.iter().find_map(|fit| fit.misfit.as_ref()) {
            // Nothing goes on here but the operator.
            Some(misfit) => Some(format!("So far: {}", misfit_sentence(misfit).replace(", or go on with --force", ""))),
            None => Some(format!(
                "With base and tool fitted the nominal {} is off by {:.3} mm (rms) so far.",
                robot.name,
                found.residual / MM
            )),
        }
    }

    fn is_stopped(&self) -> bool {
        self.operator.stop().is_made()
    }
}
