//! Points of an instrument that sends them as lines of text: laser trackers through their makers' or others' bridges, total
//! stations, camera systems.

use std::time::{Duration, Instant};

use calibench::measure::campaign::Conditions;
use nalgebra::{Point3, Vector3};

use crate::ReadoutError;
use crate::line_form::LineForm;
use crate::line_link::{End, LineLink};

/// An instrument that sends points.
#[derive(Debug, Clone, PartialEq)]
pub struct InstrumentSettings {
    /// Which side of the connection this program is.
    pub end: End,
    /// What to send for a point; none where it is measured at the instrument, or streamed.
    pub trigger: Option<String>,
    /// The line, with fields `{x}`, `{y}`, `{z}` and perhaps `{name}`.
    pub line: LineForm,
    /// One of its unit, m.
    pub unit: f64,
    /// Points are averaged over this time; the first alone if it is zero.
    pub average: Duration,
    /// Largest distance of an averaged point from their mean, m: the target or the arm moves.
    pub scatter: f64,
    /// Longest wait for a point.
    pub timeout: Duration,
}

impl InstrumentSettings {
    /// What must be unchanged when a measurement goes on: the unit and the form of its points.
    #[must_use]
    pub fn added_to(&self, conditions: Conditions) -> Conditions {
        conditions.and("instrument.unit", self.unit).and("instrument.line", format!("{:?}", self.line))
    }
}

/// Fields of a line with a point.
pub(crate) const POINT_FIELDS: [&str; 4] = ["name", "x", "y", "z"];

/// A point, or the mean of several.
#[derive(Debug, Clone, PartialEq)]
pub struct MeasuredPoint {
    /// Its name, where the instrument sends one.
    pub name: Option<String>,
    /// Where it is, in the instrument's frame, m.
    pub position: Point3<f64>,
    /// Number of points averaged.
    pub count: usize,
    /// Largest distance of one from the mean, m; `None` of a single one.
    pub scatter: Option<f64>,
}

/// A connected instrument.
pub struct Instrument {
    settings: InstrumentSettings,
    whom: String,
    link: LineLink,
}

/// Farthest coordinate of a point, m.
const FARTHEST: f64 = 10_000.0;

/// How long one look at the instrument takes, so that somebody who waits can stop.
const LOOK: Duration = Duration::from_millis(200);

impl Instrument {
    /// Connects, or listens.
    ///
    /// # Errors
    /// If there is no connection.
    pub fn open(settings: InstrumentSettings) -> Result<Self, ReadoutError> {
        let (End::Connect(address) | End::Listen(address)) = &settings.end;
        let whom = format!("instrument at {address}");
        let link = LineLink::open(&whom, &settings.end)?;
        Ok(Instrument { settings, whom, link })
    }

    /// The address connected to or listened at.
    pub fn address(&self) -> &str {
        self.link.address()
    }

    /// True if the instrument is connected now.
    pub fn is_connected(&self) -> bool {
        self.link.is_connected()
    }

    /// Triggers a point, or waits for one that arrives from now on. `None` if `goes_on` says no before it came.
    ///
    /// # Errors
    /// If none comes in time, or those averaged lie apart.
    pub fn point(&mut self, goes_on: &mut dyn FnMut() -> bool) -> Result<Option<MeasuredPoint>, ReadoutError> {
        let asked = Instant::now();
        if let Some(trigger) = &self.settings.trigger {
            self.link.send(trigger)?;
        }
        let mut until = Instant::now() + self.settings.timeout;
        let (mut points, mut first, mut other): (Vec<MeasuredPoint>, Option<Instant>, _) = (Vec::new(), None, None);
        loop {
            let now = Instant::now();
            if now >= until || (first.is_some() && self.settings.average.is_zero()) {
                break;
            }
            if !goes_on() {
                return Ok(None);
            }
            let Some(line) = self.link.line_after(asked, until.min(now + LOOK)) else { continue };
            let Some(point) = self.point_of(&line.text) else {
                other = Some(line.text);
                continue;
            };
            points.push(point);
            if first.is_none() {
                first = Some(line.at);
                until = line.at + self.settings.average;
            }
        }
        if points.is_empty() {
            let remedy = "see whether it measures and sends, and whether its beam is broken";
            let error = match other {
                Some(line) => self.link.other_line(&line),
                None => self.link.silent(self.settings.timeout, remedy),
            };
            // A point that is late belongs to no posture.
            self.settings.trigger.iter().for_each(|_| self.link.hang_up());
            return Err(error);
        }
        self.mean(&points).map(Some)
    }

    /// The point of a line; `None` if it is another line.
    fn point_of(&self, line: &str) -> Option<MeasuredPoint> {
        let fields = self.settings.line.read(line)?;
        let text = |field: &str| fields.iter().find(|(name, _)| *name == field).map(|(_, text)| *text);
        let coordinate =
            |field: &str| text(field).and_then(|text| self.settings.line.number(text)).map(|value| value * self.settings.unit);
        let position = Point3::new(coordinate("x")?, coordinate("y")?, coordinate("z")?);
        // No instrument sees that far.
        if position.coords.amax() > FARTHEST {
            return None;
        }
        let name = text("name").filter(|name| !name.is_empty()).map(str::to_owned);
        Some(MeasuredPoint { name, position, count: 1, scatter: None })
    }

    fn mean(&self, points: &[MeasuredPoint]) -> Result<MeasuredPoint, ReadoutError> {
        let sum: Vector3<f64> = points.iter().map(|p| p.position.coords).sum();
        let position = Point3::from(sum / points.len() as f64);
        let name = points[0].name.clone();
        if points.len() == 1 {
            return Ok(MeasuredPoint { name, position, count: 1, scatter: None });
        }
        let scatter = points.iter().map(|p| (p.position - position).norm()).fold(0.0, f64::max);
        if scatter > self.settings.scatter {
            let problem = format!("the points lie up to {:.3} mm from their mean", scatter / calibench::units::MM);
            return Err(ReadoutError::new(
                &self.whom,
                problem,
                "wait until the target stands still, or give a larger `scatter_mm`",
            ));
        }
        Ok(MeasuredPoint { name, position, count: points.len(), scatter: Some(scatter) })
    }
}
