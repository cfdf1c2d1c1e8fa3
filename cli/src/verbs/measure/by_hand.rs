//! `measure --by-hand STATION -o TABLE`: somebody jogs the robot, the program reads joints and points.

use std::path::Path;
use std::sync::mpsc::RecvTimeoutError;
use std::time::Duration;

use calibench::files::FileError;
use calibench_readout::{Attendant, ByHand, Ended, Journal, Typed, read_station};

use crate::terminal::failure::{Failure, Interrupted, Outcome, hardware};
use crate::terminal::operator::Operator;
use crate::terminal::output::print_answer;
use crate::terminal::progress::Waiting;

/// What is measured by hand.
const POSTURES: &str = "postures";

pub fn run(station: &Path, output: &Path, resume: bool) -> Result<Outcome, Failure> {
    let station = read_station(station)?;
    if output.exists() {
        return Err(FileError::whole(output, "exists already", "give another name, or delete it").into());
    }
    let mut by_hand = ByHand::connect(&station).map_err(|e| hardware(&e))?;
    let mut journal = Journal::open(output, by_hand.units(), None, resume)?;
    let mut person = Person { operator: Operator::who_jogs(), waiting: Waiting::new("") };
    let ended = by_hand.run(&mut journal, &mut person);
    let Person { waiting, .. } = person;
    drop(waiting);
    let (kept, path) = (journal.rows().len(), journal.path().to_owned());
    let interrupted = |why: String| Interrupted { why, what: POSTURES, kept, journal: path.clone() };
    match ended {
        Err(e) => return Err(interrupted(e.to_string()).into()),
        Ok(Ended::Interrupted) => return Err(interrupted("interrupted".into()).into()),
        Ok(Ended::Finished) if kept == 0 => {
            journal.discard_empty()?;
            return Err("nothing was measured".into());
        }
        Ok(Ended::Finished) => journal.finish().map_err(|e| interrupted(e.to_string()))?,
    }
    let table = output.display();
    print_answer(format!("{kept} {} in {table}", if kept == 1 { "posture" } else { POSTURES }))?;
    print_answer(format!("Next: `calibench calibrate {table} --robot ROBOT -o FOLDER`."))?;
    Ok(Outcome::Done)
}

/// Whoever jogs, at the terminal.
struct Person {
    operator: Operator,
    waiting: Waiting,
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

    fn is_stopped(&self) -> bool {
        self.operator.stop().is_made()
    }
}
