//! Measuring by hand: somebody jogs the arm from posture to posture; the program reads the joints, says when the arm is still, and
//! writes down the point that was measured there.

use std::time::{Duration, Instant};

use calibench::files::FileError;
use calibench::units::MM;
use nalgebra::Point3;

use crate::ReadoutError;
use crate::joints::{Controller, JointReader, JointUnit};
use crate::journal::{Journal, Row, now_s};
use crate::points::{Instrument, MeasuredPoint};
use crate::station::Station;
use crate::stillness::{Motion, Stillness};
use crate::typed;

/// Somebody at the robot.
pub trait Attendant {
    /// Tells a sentence that stays.
    fn tell(&mut self, sentence: &str);
    /// Shows what is going on, in the place of what was shown before.
    fn show(&mut self, status: &str);
    /// What was typed, waited for at most this long.
    fn typed(&mut self, wait: Duration) -> Typed;
    /// True if the measurement is to stop at once.
    fn is_stopped(&self) -> bool;
    /// What the table so far says of the robot, if anything is known of it.
    fn judge(&mut self, _table: &str) -> Option<String> {
        None
    }
}

/// What somebody typed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Typed {
    /// Nothing yet.
    Nothing,
    /// A line.
    Line(String),
    /// Nothing more will come.
    End,
}

/// How a measurement by hand ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ended {
    /// The operator has finished.
    Finished,
    /// It was interrupted, and can go on.
    Interrupted,
}

/// Interval between two readings of the joints.
const LOOK: Duration = Duration::from_millis(200);
/// Wait after an answer that did not come.
const PAUSE: Duration = Duration::from_secs(2);
/// Change of a turning joint that makes another posture, rad: what is measured within it is a repeat.
const ANOTHER_ANGLE: f64 = 0.5 * calibench::units::DEG;
/// Change of a sliding joint that makes another posture, m.
const ANOTHER_LENGTH: f64 = 5.0 * MM;
/// Rows from which on the ranges of the joints are spoken of.
const TELLING: usize = 8;
/// Rows from which on they are compared with the robot: base and tool have nine unknowns.
const JUDGED: usize = 16;
/// Range of a turning joint that is too little to tell its parameters from those of others, rad.
const NARROW_ANGLE: f64 = 30.0 * calibench::units::DEG;

/// A measurement by hand, connected.
pub struct ByHand<'a> {
    station: &'a Station,
    reader: Option<Box<dyn JointReader>>,
    instrument: Option<Instrument>,
    units: Vec<JointUnit>,
}

impl<'a> ByHand<'a> {
    /// Connects to controller and instrument; nothing is written to either.
    ///
    /// # Errors
    /// If one of them does not answer.
    pub fn connect(station: &'a Station) -> Result<Self, ReadoutError> {
        let mut reader = station.controller.open()?;
        let joints = match (&mut reader, &station.controller) {
            (Some(reader), _) => reader.joints()?.len(),
            (None, Controller::Typed(joints)) => *joints,
            (None, _) => 0,
        };
        if ![0, joints].contains(&station.units.len()) {
            let problem = format!("it has {joints} joints, and `units` has {}", station.units.len());
            return Err(ReadoutError::new("controller", problem, "give a unit for each joint, or none"));
        }
        let instrument = station.instrument.clone().map(Instrument::open).transpose()?;
        let units = (0..joints).map(|k| station.unit(k)).collect();
        Ok(ByHand { station, reader, instrument, units })
    }

    /// Units of the joints, in their number.
    pub fn units(&self) -> &[JointUnit] {
        &self.units
    }

    /// Measures until the attendant ends it.
    ///
    /// # Errors
    /// If the journal cannot be written.
    pub fn run(&mut self, journal: &mut Journal, attendant: &mut dyn Attendant) -> Result<Ended, FileError> {
        self.introduce(journal, attendant);
        match self.reader.take() {
            Some(mut reader) => self.with_reader(reader.as_mut(), journal, attendant),
            None => self.with_typed_joints(journal, attendant),
        }
    }

    fn introduce(&self, journal: &Journal, attendant: &mut dyn Attendant) {
        if !journal.rows().is_empty() {
            attendant.tell(&format!("Going on after posture {}.", journal.rows().len()));
        }
        if let Some(instrument) = self.instrument.as_ref().filter(|instrument| !instrument.is_connected()) {
            attendant.tell(&format!("Waiting for the instrument to connect to {}.", instrument.address()));
        }
        if let Some(remark) = self.station.controller.remark() {
            attendant.tell(remark);
        }
        attendant.tell(match (&self.reader, self.station.still.is_automatic) {
            (Some(_), true) => {
                "Jog to a posture and stand still: it is measured. u and Enter takes the last back, q and Enter ends."
            }
            (Some(_), false) => "Jog to a posture, then Enter measures. u and Enter takes the last back, q and Enter ends.",
            (None, _) => "Type or paste the joints of a posture. u takes the last posture back, q ends.",
        });
    }

    fn with_reader(
        &mut self,
        reader: &mut dyn JointReader,
        journal: &mut Journal,
        attendant: &mut dyn Attendant,
    ) -> Result<Ended, FileError> {
        let still = &self.station.still;
        let within = |unit: &JointUnit| if unit.is_length() { still.length } else { still.angle } / unit.si();
        let mut stillness = Stillness::new(still.wait, self.units.iter().map(within).collect());
        // What was taken back by `u` is not measured again by itself.
        let mut last = journal.rows().last().map(|row| row.q.clone());
        let mut is_wanted = false;
        loop {
            if attendant.is_stopped() {
                return Ok(Ended::Interrupted);
            }
            let motion = match self.read(reader) {
                Ok(joints) => stillness.add(Instant::now(), &joints),
                Err(error) => {
                    attendant.tell(&error.to_string());
                    stillness.forget();
                    is_wanted = false;
                    match self.command(attendant, PAUSE, journal)? {
                        Command::End => return Ok(Ended::Finished),
                        _ => continue,
                    }
                }
            };
            attendant.show(&self.status(&motion, journal));
            match self.command(attendant, LOOK, journal)? {
                Command::End => return Ok(Ended::Finished),
                Command::Measure => is_wanted = true,
                Command::Nothing => {}
            }
            let Motion::Still(q) = motion else { continue };
            let q = self.si(&q);
            let is_another = last.as_ref().is_none_or(|last| self.differs(last, &q));
            let is_due = is_wanted || (still.is_automatic && is_another);
            if !is_due {
                continue;
            }
            let point = match self.point(attendant) {
                Ok(Some(point)) => point,
                Ok(None) => {
                    is_wanted = false;
                    continue;
                }
                Err(error) => {
                    attendant.tell(&format!("Not measured: {error}."));
                    is_wanted = false;
                    // Where it is automatic, it is tried again once the arm was still for as long again.
                    stillness.forget();
                    continue;
                }
            };
            is_wanted = false;
            // A point of an arm that moved meanwhile belongs to no posture.
            let after = self.read(reader).map(|joints| stillness.add(Instant::now(), &joints));
            match after {
                Ok(Motion::Moving { joint, .. }) => {
                    attendant.tell(&format!("Not measured: joint {joint} moved while the point was taken."));
                }
                Ok(_) => {
                    last = Some(q.clone());
                    self.keep(q, &point, journal, attendant)?;
                }
                Err(error) => attendant.tell(&format!("Not measured: {error}.")),
            }
            stillness.forget();
        }
    }

    fn with_typed_joints(&mut self, journal: &mut Journal, attendant: &mut dyn Attendant) -> Result<Ended, FileError> {
        let mut q: Option<Vec<f64>> = None;
        loop {
            if attendant.is_stopped() {
                return Ok(Ended::Interrupted);
            }
            let Some(joints) = &q else {
                attendant.show(&format!("{}: the {} joints", ordinal(journal), self.units.len()));
                match attendant.typed(LOOK) {
                    Typed::Nothing => {}
                    Typed::End => return Ok(Ended::Finished),
                    Typed::Line(line) => match self.word(&line, journal, attendant)? {
                        Some(Command::End) => return Ok(Ended::Finished),
                        Some(_) => {}
                        None => match typed::numbers(&line, self.units.len()) {
                            Some(values) => q = Some(self.si(&values)),
                            None => attendant.tell(&format!("These are not {} numbers.", self.units.len())),
                        },
                    },
                }
                continue;
            };
            let joints = joints.clone();
            match self.point(attendant) {
                Ok(Some(point)) => self.keep(joints, &point, journal, attendant)?,
                // What was typed is `u` or `q`, or nothing more comes.
                Ok(None) => {}
                Err(error) => attendant.tell(&format!("Not measured: {error}. Type its joints again.")),
            }
            q = None;
        }
    }

    fn read(&self, reader: &mut dyn JointReader) -> Result<Vec<f64>, ReadoutError> {
        let joints = reader.joints()?;
        if joints.len() == self.units.len() {
            return Ok(joints);
        }
        let problem = format!("{} joints instead of {}", joints.len(), self.units.len());
        Err(ReadoutError::new("controller", problem, "see what its program sends"))
    }

    /// The point, from the instrument or typed; `None` if the operator takes the posture back.
    fn point(&mut self, attendant: &mut dyn Attendant) -> Result<Option<MeasuredPoint>, ReadoutError> {
        if let Some(instrument) = &mut self.instrument {
            attendant.show("measuring the point");
            return instrument.point(&mut || !attendant.is_stopped());
        }
        loop {
            attendant.show("type the point x, y, z");
            if attendant.is_stopped() {
                return Ok(None);
            }
            match attendant.typed(LOOK) {
                Typed::Nothing => {}
                Typed::End => return Ok(None),
                Typed::Line(line) if matches!(line.trim(), "u" | "q" | "") => {
                    attendant.tell("The posture is not measured.");
                    return Ok(None);
                }
                Typed::Line(line) => match typed::numbers(&line, 3) {
                    Some(xyz) => {
                        let unit = self.station.typed_unit;
                        let position = Point3::new(xyz[0] * unit, xyz[1] * unit, xyz[2] * unit);
                        return Ok(Some(MeasuredPoint { name: None, position, count: 1, scatter: None }));
                    }
                    None => attendant.tell("These are not 3 numbers."),
                },
            }
        }
    }

    fn keep(
        &self,
        q: Vec<f64>,
        point: &MeasuredPoint,
        journal: &mut Journal,
        attendant: &mut dyn Attendant,
    ) -> Result<(), FileError> {
        let repeat = journal.rows().iter().rposition(|row| !self.differs(&row.q, &q));
        let point_m = [point.position.x, point.position.y, point.position.z];
        journal.add(Row {
            time_s: now_s(),
            q,
            point_m,
            name: point.name.clone(),
            pose: None,
            q_commanded: None,
            temp_c: None,
            tau: None,
        })?;
        let rows = journal.rows();
        let [x, y, z] = point_m.map(|x| x / MM);
        let mean = match point.scatter {
            Some(scatter) => format!(", mean of {} within {:.3} mm", point.count, scatter / MM),
            None => String::new(),
        };
        let name = point.name.as_ref().map(|name| format!(" '{name}'")).unwrap_or_default();
        let again = repeat.map(|k| format!("; the posture of {} again", k + 1)).unwrap_or_default();
        attendant.tell(&format!("{}: point{name} {x:.3}, {y:.3}, {z:.3} mm{mean}{again}", rows.len()));
        if rows.len() >= TELLING && rows.len().is_multiple_of(TELLING) {
            self.ranges(rows).iter().for_each(|sentence| attendant.tell(sentence));
        }
        if rows.len() >= JUDGED
            && rows.len().is_multiple_of(TELLING)
            && let Some(judgement) = attendant.judge(&journal.table())
        {
            attendant.tell(&judgement);
        }
        Ok(())
    }

    /// Which joints were turned too little so far, if any; once, that none was.
    fn ranges(&self, rows: &[Row]) -> Option<String> {
        let range = |k: usize| {
            let values = || rows.iter().map(|row| row.q[k]);
            values().fold(f64::NEG_INFINITY, f64::max) - values().fold(f64::INFINITY, f64::min)
        };
        let narrow: Vec<String> = (0..self.units.len())
            .filter(|&k| !self.units[k].is_length() && range(k) < NARROW_ANGLE)
            .map(|k| format!("joint {} over {:.0} deg", k + 1, range(k).to_degrees()))
            .collect();
        if narrow.is_empty() {
            let said = format!("Every joint was turned over {:.0} deg or more.", NARROW_ANGLE.to_degrees());
            return (rows.len() == TELLING).then_some(said);
        }
        Some(format!("After {} postures {} only: turn further in the next ones.", rows.len(), narrow.join(", ")))
    }

    /// Readings of the joints in SI.
    fn si(&self, readings: &[f64]) -> Vec<f64> {
        readings.iter().zip(&self.units).map(|(q, unit)| q * unit.si()).collect()
    }

    fn differs(&self, a: &[f64], b: &[f64]) -> bool {
        let limit = |k: usize| if self.units[k].is_length() { ANOTHER_LENGTH } else { ANOTHER_ANGLE };
        a.iter().zip(b).enumerate().any(|(k, (a, b))| (a - b).abs() > limit(k))
    }

    fn status(&self, motion: &Motion, journal: &Journal) -> String {
        let next = ordinal(journal);
        match motion {
            Motion::Moving { joint, by } => {
                let unit = self.units.get(joint - 1).copied().unwrap_or(JointUnit::Deg);
                format!("{next}: joint {joint} moves ({:.2} {})", unit.outside(by * unit.si()), unit.outside_name())
            }
            Motion::Settling => format!("{next}: still, wait"),
            Motion::Still(q) => {
                let q = q.iter().zip(&self.units).map(|(q, unit)| format!("{:.2}", unit.outside(q * unit.si())));
                format!("{next}: still at {}", q.collect::<Vec<_>>().join(" "))
            }
        }
    }

    /// What the operator wants, waited for at most this long.
    fn command(&self, attendant: &mut dyn Attendant, wait: Duration, journal: &mut Journal) -> Result<Command, FileError> {
        match attendant.typed(wait) {
            Typed::Nothing => Ok(Command::Nothing),
            Typed::End => Ok(Command::End),
            Typed::Line(line) if line.trim().is_empty() => Ok(Command::Measure),
            Typed::Line(line) => Ok(self.word(&line, journal, attendant)?.unwrap_or_else(|| {
                attendant.tell("Enter measures, u takes the last posture back, q ends.");
                Command::Nothing
            })),
        }
    }

    /// Obeys `u` and `q`; `None` for another line.
    fn word(&self, line: &str, journal: &mut Journal, attendant: &mut dyn Attendant) -> Result<Option<Command>, FileError> {
        match line.trim().to_ascii_lowercase().as_str() {
            "q" => Ok(Some(Command::End)),
            "u" => {
                let said = match journal.undo()? {
                    Some(_) => format!("Posture {} is taken back.", journal.rows().len() + 1),
                    None => "No posture is measured yet.".to_owned(),
                };
                attendant.tell(&said);
                Ok(Some(Command::Nothing))
            }
            _ => Ok(None),
        }
    }
}

/// What the operator wants.
enum Command {
    Nothing,
    Measure,
    End,
}

/// The number of the next posture, in words.
fn ordinal(journal: &Journal) -> String {
    format!("posture {}", journal.rows().len() + 1)
}
