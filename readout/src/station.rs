//! `station.toml`: where the joints and the points of a measurement by hand come from.

mod keys;

use std::path::{Path, PathBuf};
use std::time::Duration;

use calibench::cell::cell_reading::CellReading;
use calibench::files::{FileError, parse_toml, read_text};
use calibench::measure::campaign::Conditions;
use calibench::measure::dataset::Dataset;
use calibench::units::{DEG, MM};

#[cfg(feature = "schema")]
pub use self::keys::station_schema;
use self::keys::{ControllerKind, ControllerToml, InstrumentToml, StationToml};

use crate::joints::{AbbSettings, Controller, FanucSettings, JointUnit, LogIn, TextSettings};
use crate::line_form::LineForm;
use crate::line_link::End;
use crate::points::{InstrumentSettings, POINT_FIELDS};

/// Name and version of the format.
pub const STATION_FORMAT: &str = "calibench-station/1";

/// A measurement by hand: somebody jogs the arm, the program reads.
#[derive(Debug, Clone, PartialEq)]
pub struct Station {
    /// The file.
    pub file: PathBuf,
    /// Where the joints come from.
    pub controller: Controller,
    /// Unit of each joint; those that are not named have the controller's.
    pub units: Vec<JointUnit>,
    /// Where the points come from; `None` if the operator types them.
    pub instrument: Option<InstrumentSettings>,
    /// Unit of typed points, m.
    pub typed_unit: f64,
    /// When the arm counts as still.
    pub still: StillSettings,
}

/// When an arm counts as still, and when that is measured.
#[derive(Debug, Clone, PartialEq)]
pub struct StillSettings {
    /// No joint may move for this long.
    pub wait: Duration,
    /// Largest range of a turning joint meanwhile, rad.
    pub angle: f64,
    /// Largest range of a sliding joint meanwhile, m.
    pub length: f64,
    /// True if every new posture is measured at once, without Enter.
    pub is_automatic: bool,
}

impl Station {
    /// What must be unchanged when a measurement by hand goes on: the unit and the form of its points.
    #[must_use]
    pub fn conditions(&self) -> Conditions {
        let nothing = Conditions::of(&[], &Dataset::default());
        match &self.instrument {
            Some(instrument) => instrument.added_to(nothing),
            None => nothing.and("instrument.unit", self.typed_unit),
        }
    }

    /// Unit of a joint, counted from 0.
    pub fn unit(&self, joint: usize) -> JointUnit {
        self.units.get(joint).copied().unwrap_or(self.controller.unit())
    }
}

/// Default wait for an arm to be still.
const STILL_S: f64 = 1.0;
/// Default range of a turning joint meanwhile, deg: twice the last digit of a FANUC's page.
const STILL_DEG: f64 = 0.02;
/// Default range of a sliding joint meanwhile, mm.
const STILL_MM: f64 = 0.02;
/// Default wait for a point: somebody may have to aim first.
const POINT_S: f64 = 30.0;
/// Default wait for a line of joints.
const JOINTS_S: f64 = 2.0;
/// Default distance of averaged points from their mean, mm.
const SCATTER_MM: f64 = 0.1;
/// Usual joints of an arm.
const USUAL_JOINTS: usize = 6;
/// Most joints of an arm.
const MOST_JOINTS: usize = 12;

/// Reads a station file.
///
/// # Errors
/// What is wrong, with file, line, key and remedy.
pub fn read_station(path: &Path) -> Result<Station, FileError> {
    let text = read_text(path)?;
    let reading = Reading(CellReading { path, text: &text });
    let StationToml { format, controller, instrument, still } = parse_toml(path, &text)?;
    if format != STATION_FORMAT {
        return Err(reading.wrong("format", format!("'{format}' is not read here"), &format!("give {STATION_FORMAT}")));
    }
    let units = controller.units.clone().unwrap_or_default();
    let typed_unit = instrument.unit.unwrap_or_default().si();
    let station = Station {
        file: path.into(),
        controller: reading.controller(controller)?,
        units,
        instrument: reading.instrument(instrument)?,
        typed_unit,
        still: StillSettings {
            wait: reading.time("still.wait_s", still.wait_s, STILL_S)?,
            angle: reading.positive("still.within_deg", still.within_deg, STILL_DEG)? * DEG,
            length: reading.positive("still.within_mm", still.within_mm, STILL_MM)? * MM,
            is_automatic: still.automatic,
        },
    };
    // Of the web pages it is seen when they answer.
    let known = match &station.controller {
        Controller::Typed(joints) => Some(*joints),
        Controller::Text(settings) => Some(settings.joints()),
        Controller::Kuka(_) | Controller::Ur(_) => Some(USUAL_JOINTS),
        Controller::Fanuc(_) | Controller::Abb(_) => None,
    };
    if let Some(joints) = known.filter(|joints| ![0, *joints].contains(&station.units.len())) {
        let problem = format!("has {} units, and there are {joints} joints", station.units.len());
        return Err(reading.wrong("controller.units", problem, "give one for each joint, or none"));
    }
    match (&station.controller, &station.instrument) {
        (Controller::Typed(_), _) | (_, None) if station.still.is_automatic => {
            let remedy = "remove the key, or connect controller and instrument";
            Err(reading.wrong("still.automatic", "what is typed is not measured by itself", remedy))
        }
        _ => Ok(station),
    }
}

/// The text of a station file while it is read.
struct Reading<'a>(CellReading<'a>);

impl Reading<'_> {
    fn wrong(&self, key: &str, problem: impl Into<String>, remedy: &str) -> FileError {
        self.0.wrong(key, problem, remedy)
    }

    fn controller(&self, keys: ControllerToml) -> Result<Controller, FileError> {
        let ControllerToml {
            kind, address, listen, user, password, group, coupled, unit, ask, line, timeout_s, joints, ..
        } = keys;
        let is_web = matches!(kind, ControllerKind::Fanuc | ControllerKind::Abb);
        let foreign = [
            ("address", address.is_some(), kind != ControllerKind::Typed),
            ("listen", listen.is_some(), kind == ControllerKind::Text),
            ("user", user.is_some(), is_web),
            ("password", password.is_some(), is_web),
            ("group", group.is_some(), kind == ControllerKind::Fanuc),
            ("coupled", coupled.is_some(), kind == ControllerKind::Fanuc),
            ("unit", unit.is_some(), kind == ControllerKind::Abb),
            ("ask", ask.is_some(), kind == ControllerKind::Text),
            ("line", line.is_some(), kind == ControllerKind::Text),
            ("timeout_s", timeout_s.is_some(), kind == ControllerKind::Text),
            ("joints", joints.is_some(), kind == ControllerKind::Typed),
        ];
        if let Some((key, ..)) = foreign.into_iter().find(|&(_, is_given, is_its)| is_given && !is_its) {
            return Err(self.wrong(
                &format!("controller.{key}"),
                "is not a key of this kind",
                "remove it, or give another `kind`",
            ));
        }
        let missing = |key: &str, remedy: &str| self.wrong(&format!("controller.{key}"), "is missing", remedy);
        let of_web = || -> Result<String, FileError> {
            let address = address.clone().ok_or_else(|| missing("address", "add `address = \"HOST\"`"))?;
            let is_one = !address.is_empty() && !address.contains(|c: char| c == '/' || c == '@' || c.is_whitespace());
            if is_one {
                return Ok(address);
            }
            let remedy = "give it as HOST or HOST:PORT, without http://";
            Err(self.wrong("controller.address", format!("'{address}' is not an address"), remedy))
        };
        let of_socket = |port: &str| -> Result<String, FileError> {
            let address = address.clone().ok_or_else(|| missing("address", &format!("add `address = \"HOST:{port}\"`")))?;
            self.address("controller.address", address)
        };
        let log_in = |usual: Option<[&str; 2]>| match (&user, &password) {
            (None, None) => usual.map(|[user, password]| LogIn { user: user.into(), password: password.into() }),
            (user, password) => {
                Some(LogIn { user: user.clone().unwrap_or_default(), password: password.clone().unwrap_or_default() })
            }
        };
        Ok(match kind {
            ControllerKind::Fanuc => {
                let (group, is_coupled) = (group.unwrap_or(1), coupled.unwrap_or(true));
                Controller::Fanuc(FanucSettings { address: of_web()?, group, is_coupled, log_in: log_in(None) })
            }
            ControllerKind::Abb => {
                let unit = unit.unwrap_or_else(|| AbbSettings::UNIT.into());
                if unit.is_empty() || unit.contains(|c: char| !c.is_ascii_alphanumeric() && c != '_') {
                    let remedy = "give its name, as ROB_1";
                    return Err(self.wrong("controller.unit", format!("'{unit}' is not a mechanical unit"), remedy));
                }
                Controller::Abb(AbbSettings { address: of_web()?, unit, log_in: log_in(Some(AbbSettings::USER)) })
            }
            ControllerKind::Kuka => Controller::Kuka(of_socket("7000")?),
            ControllerKind::Ur => Controller::Ur(of_socket("30004")?),
            ControllerKind::Text => {
                let end = self.end("controller", address, listen)?;
                let end = end.ok_or_else(|| missing("address", "add `address = \"HOST:PORT\"`, or `listen`"))?;
                let line = line.ok_or_else(|| missing("line", "add `line = \"{q1},{q2},{q3},{q4},{q5},{q6}\"`"))?;
                let line = self.form("controller.line", &line, TextSettings::is_field)?;
                let timeout = self.time("controller.timeout_s", timeout_s, JOINTS_S)?;
                let settings = TextSettings { end, ask: ask.map(|text| unescaped(&text)), line, timeout };
                if settings.joints() > 0 && settings.joints() < settings.line.names() {
                    let problem = format!("has joints beyond a gap after {{q{}}}", settings.joints());
                    return Err(self.wrong("controller.line", problem, "number the joints from {q1} on without a gap"));
                }
                if settings.joints() == 0 {
                    return Err(self.wrong(
                        "controller.line",
                        "has no field {q1}",
                        "write {q1}, {q2}, ... where the joints are",
                    ));
                }
                Controller::Text(settings)
            }
            ControllerKind::Typed => {
                let joints = joints.unwrap_or(USUAL_JOINTS);
                if !(1..=MOST_JOINTS).contains(&joints) {
                    let remedy = format!("give 1 to {MOST_JOINTS}");
                    return Err(self.wrong("controller.joints", format!("{joints} is not a number of joints"), &remedy));
                }
                Controller::Typed(joints)
            }
        })
    }

    fn instrument(&self, keys: InstrumentToml) -> Result<Option<InstrumentSettings>, FileError> {
        let InstrumentToml { address, listen, trigger, line, unit, average_s, scatter_mm, timeout_s } = keys;
        let Some(end) = self.end("instrument", address, listen)? else {
            let given = [
                ("trigger", trigger.is_some()),
                ("line", line.is_some()),
                ("average_s", average_s.is_some()),
                ("scatter_mm", scatter_mm.is_some()),
                ("timeout_s", timeout_s.is_some()),
            ];
            return match given.into_iter().find(|(_, is_given)| *is_given) {
                None => Ok(None),
                Some((key, _)) => {
                    let remedy = "add `address` or `listen`; without, points are typed";
                    Err(self.wrong(&format!("instrument.{key}"), "is for an instrument that is connected", remedy))
                }
            };
        };
        let line = line.unwrap_or_else(|| "{x},{y},{z}".into());
        let line = self.form("instrument.line", &line, |name| POINT_FIELDS.contains(&name))?;
        if let Some(field) = ["x", "y", "z"].into_iter().find(|field| !line.has(field)) {
            return Err(self.wrong(
                "instrument.line",
                format!("has no field {{{field}}}"),
                "write {x}, {y} and {z} where they are",
            ));
        }
        Ok(Some(InstrumentSettings {
            end,
            trigger: trigger.map(|text| unescaped(&text)),
            line,
            unit: unit.unwrap_or_default().si(),
            average: self.time("instrument.average_s", average_s, 0.0)?,
            scatter: self.positive("instrument.scatter_mm", scatter_mm, SCATTER_MM)? * MM,
            timeout: self.time("instrument.timeout_s", timeout_s, POINT_S)?,
        }))
    }

    fn end(&self, table: &str, address: Option<String>, listen: Option<String>) -> Result<Option<End>, FileError> {
        match (address, listen) {
            (Some(_), Some(_)) => Err(self.wrong(&format!("{table}.listen"), "is given beside `address`", "keep one of them")),
            (Some(address), None) => Ok(Some(End::Connect(self.address(&format!("{table}.address"), address)?))),
            (None, Some(listen)) => Ok(Some(End::Listen(self.address(&format!("{table}.listen"), listen)?))),
            (None, None) => Ok(None),
        }
    }

    fn address(&self, key: &str, address: String) -> Result<String, FileError> {
        self.0.address(key, &address)?;
        Ok(address)
    }

    fn form(&self, key: &str, template: &str, known: impl Fn(&str) -> bool) -> Result<LineForm, FileError> {
        LineForm::parse(template, known).map_err(|problem| self.wrong(key, problem, "write the line as the device does"))
    }

    fn positive(&self, key: &str, value: Option<f64>, usual: f64) -> Result<f64, FileError> {
        self.0.positive(key, value.unwrap_or(usual))
    }

    fn time(&self, key: &str, value: Option<f64>, usual: f64) -> Result<Duration, FileError> {
        self.0.time(key, value.unwrap_or(usual), 1.0)
    }
}

/// A text with `\r`, `\n`, `\t` and `\0` written out, as they are in TOML's literal strings.
fn unescaped(text: &str) -> String {
    [("\\r", "\r"), ("\\n", "\n"), ("\\t", "\t"), ("\\0", "\0")]
        .iter()
        .fold(text.to_owned(), |text, (from, to)| text.replace(from, to))
}
