//! An indicator that answers requests for its value.

use std::io::ErrorKind;
use std::time::{Duration, Instant};

use super::frame_seen::of_another_frame;
use super::{Dialect, DisplayUnit, GaugeReading, GaugeReply, LineReader, Port, PresetManner};
use crate::cell::{Indicator, IndicatorError};
use crate::units::{MM, UM};

/// Request protocol of an indicator and the meaning of its numbers.
#[derive(Debug, Clone, PartialEq)]
pub struct IndicatorSettings {
    /// Dialect of the maker.
    pub dialect: Dialect,
    /// True if the value decreases when the plunger is pushed in.
    pub counts_down: bool,
    /// Longest wait for an answer. 2.5 s: waking a sleeping instrument by radio takes 2.1 s (Sylvac MEM-PM 292-1538-01).
    pub timeout: Duration,
    /// Wait for the echo of a command that sets something; some instruments send none. 0.3 s: two connection intervals of a
    /// radio link.
    pub echo: Duration,
}

impl IndicatorSettings {
    /// The usual settings for this dialect.
    pub fn new(dialect: Dialect) -> Self {
        let (timeout, echo) = (Duration::from_millis(2500), Duration::from_millis(300));
        IndicatorSettings { dialect, counts_down: false, timeout, echo }
    }
}

/// Identity and condition of an indicator; `None` where its dialect has no query for it.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Identity {
    /// Name, e.g. `SY289`.
    pub name: Option<String>,
    /// Firmware version.
    pub version: Option<String>,
    /// True if the battery is low.
    pub battery_low: Option<bool>,
    /// Resolution, e.g. `RES1`.
    pub resolution: Option<String>,
}

/// Bytes transferred over a line.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Traffic {
    /// Bytes sent.
    pub sent: u64,
    /// Bytes received.
    pub received: u64,
}

/// Largest deviation of a reading from the preset it should show, m: far above flicker, far below the displacement by a ball.
const PRESET_TAKEN: f64 = 10.0 * UM;

/// After a lost or garbled answer, the line must be quiet for this long before the next request.
const QUIET: Duration = Duration::from_millis(100);

/// Number of attempts at a preset when an answer is lost or garbled.
const PRESET_TRIES: usize = 3;

/// An indicator of the family that answers ASCII requests, e.g. Sylvac, Mahr, Mitutoyo's converters.
///
/// Every request has a deadline, so a silent instrument never blocks the caller. Echoes are skipped. After anything unexpected
/// the line is drained and, if the dialect allows it, the instrument is asked for its identity, so that a late answer is not
/// taken for the next one.
pub struct AsciiIndicator<P> {
    port: P,
    settings: IndicatorSettings,
    lines: LineReader,
    unit: DisplayUnit,
    decimals: Option<usize>,
    name: Option<String>,
    /// Offset added by the driver to the readings of an instrument that keeps no preset, m.
    offset: f64,
    /// Expected echo of a command that was not echoed in time.
    awaited_echo: Option<String>,
    is_in_step: bool,
    traffic: Traffic,
}

impl<P: Port> AsciiIndicator<P> {
    /// Creates an indicator at this port; nothing is sent yet.
    pub fn new(port: P, settings: IndicatorSettings) -> Self {
        AsciiIndicator {
            port,
            settings,
            lines: LineReader::default(),
            unit: DisplayUnit::Millimetre,
            decimals: None,
            name: None,
            offset: 0.0,
            awaited_echo: None,
            is_in_step: true,
            traffic: Traffic::default(),
        }
    }

    /// Asks for the identity and sets the unit to millimetres.
    ///
    /// # Errors
    /// When the indicator does not answer, or stays in another unit.
    pub fn identify(&mut self) -> Result<Identity, IndicatorError> {
        let Dialect { identity, version, battery, resolution, .. } = self.settings.dialect;
        let name = self.words(identity)?;
        self.name.clone_from(&name);
        self.use_millimetres()?;
        let battery_low = self.words(battery)?.map(|words| words.eq_ignore_ascii_case("BAT0"));
        Ok(Identity { name, version: self.words(version)?, battery_low, resolution: self.words(resolution)? })
    }

    /// Bytes transferred so far.
    pub fn traffic(&self) -> Traffic {
        self.traffic
    }

    /// Number of decimals shown; `None` before the first reading.
    pub fn decimals(&self) -> Option<usize> {
        self.decimals
    }

    fn use_millimetres(&mut self) -> Result<(), IndicatorError> {
        let Dialect { unit: Some(query), millimetres: Some(set), .. } = self.settings.dialect else { return Ok(()) };
        let is_mm =
            |words: Option<String>| words.is_some_and(|words| DisplayUnit::parse(&words) == Some(DisplayUnit::Millimetre));
        if is_mm(self.words(Some(query))?) {
            return Ok(());
        }
        self.set(set)?;
        match self.words(Some(query))? {
            words if is_mm(words.clone()) => Ok(()),
            words => {
                let shown = words.unwrap_or_default();
                Err(IndicatorError::Fault { detail: format!("it shows {shown} and cannot be set to millimetres") })
            }
        }
    }

    /// The instrument's answer to a query; `None` if the dialect or the instrument has no such query.
    fn words(&mut self, query: Option<&str>) -> Result<Option<String>, IndicatorError> {
        let Some(query) = query else { return Ok(None) };
        match self.ask(query)? {
            GaugeReply::Words(words) => Ok(Some(words)),
            // An older instrument of the family, without this query.
            GaugeReply::Fault(1) => Ok(None),
            reply => Err(self.refuse(&reply)),
        }
    }

    /// The displayed value, in m and counted inwards, without the driver's own preset.
    fn shown(&mut self) -> Result<f64, IndicatorError> {
        match self.ask(self.settings.dialect.read)? {
            GaugeReply::Reading(reading) if self.decimals.is_none_or(|decimals| decimals == reading.decimals) => {
                self.decimals = Some(reading.decimals);
                Ok(self.inwards() * reading.value * reading.unit.unwrap_or(self.unit).metres())
            }
            reply => Err(self.refuse(&reply)),
        }
    }

    fn inwards(&self) -> f64 {
        if self.settings.counts_down { -1.0 } else { 1.0 }
    }

    /// Sets the instrument's own preset to `value` m and verifies it.
    fn preset_instrument(&mut self, value: f64, store: &str, query: &str, recall: &[&str]) -> Result<(), IndicatorError> {
        let decimals = self.decimals.unwrap_or(3);
        let number = self.inwards() * value / MM;
        self.set(&format!("{store} {number:+.decimals$}"))?;
        let kept = match self.ask(query)? {
            GaugeReply::Reading(GaugeReading { value: kept, .. }) => kept,
            reply => return Err(self.refuse(&reply)),
        };
        // Half of the last digit, plus rounding.
        if (kept - number).abs() > 0.6 * 10_f64.powi(-(decimals as i32)) {
            return Err(IndicatorError::Fault {
                detail: format!("it stores {kept} mm where {number:+.decimals$} mm was sent"),
            });
        }
        for command in recall {
            let known = self.set(command)?;
            if known && (self.shown()? - value).abs() < PRESET_TAKEN {
                return Ok(());
            }
        }
        Err(IndicatorError::Fault { detail: "it stores a preset and does not apply it".into() })
    }

    /// Sends a command that sets something and waits briefly for its echo. Returns false if the instrument does not know the
    /// command.
    fn set(&mut self, command: &str) -> Result<bool, IndicatorError> {
        self.send(command)?;
        self.awaited_echo = None;
        match self.receive(Instant::now() + self.settings.echo)? {
            None => {
                self.awaited_echo = Some(bare(command.as_bytes()));
                Ok(true)
            }
            Some(line) => match self.understood(&line)? {
                GaugeReply::Fault(1) => Ok(false),
                GaugeReply::Words(_) | GaugeReply::Reading(_) => Ok(true),
                reply => Err(self.refuse(&reply)),
            },
        }
    }

    fn ask(&mut self, query: &str) -> Result<GaugeReply, IndicatorError> {
        self.send(query)?;
        let mut deadline = Instant::now() + self.settings.timeout;
        let mut perhaps_echo = None;
        while let Some(line) = self.receive(deadline)? {
            let said = bare(&line);
            if said == bare(query.as_bytes()) {
                continue;
            }
            // Either the late echo of a command, or an answer that is the same word: `MM` sets the unit and names it.
            if self.awaited_echo.take().is_some_and(|echo| echo == said) {
                deadline = deadline.min(Instant::now() + self.settings.echo);
                perhaps_echo = Some(line);
                continue;
            }
            return self.understood(&line);
        }
        if let Some(line) = perhaps_echo {
            return self.understood(&line);
        }
        self.is_in_step = false;
        Err(self.silent())
    }

    /// Error for a missing line; the bytes of an unfinished line may show the cause.
    fn silent(&self) -> IndicatorError {
        of_another_frame(self.lines.unfinished()).map_or(IndicatorError::Silent, |frame| IndicatorError::Garbled { frame })
    }

    /// Parses a line as a reply.
    ///
    /// # Errors
    /// [`IndicatorError::Garbled`] if the line came with another frame (parity, data bits).
    fn understood(&mut self, line: &[u8]) -> Result<GaugeReply, IndicatorError> {
        match GaugeReply::parse(line) {
            GaugeReply::Noise if let Some(words) = of_another_frame(line) => {
                self.is_in_step = false;
                Err(IndicatorError::Garbled { frame: words })
            }
            reply => Ok(reply),
        }
    }

    fn refuse(&mut self, reply: &GaugeReply) -> IndicatorError {
        match reply {
            GaugeReply::Fault(3) => IndicatorError::OverRange,
            // The request was garbled in transmission; the next one may succeed.
            GaugeReply::Fault(2) => IndicatorError::Garbled { frame: "ERR2".into() },
            GaugeReply::Fault(0) => IndicatorError::Fault { detail: "ERR0, of its sensor".into() },
            GaugeReply::Fault(1) => IndicatorError::Fault { detail: "ERR1, it does not know the command".into() },
            GaugeReply::Fault(digit) => IndicatorError::Fault { detail: format!("ERR{digit}") },
            reply => {
                self.is_in_step = false;
                let frame = match reply {
                    GaugeReply::Words(words) => words.clone(),
                    GaugeReply::Reading(reading) => format!("{} with {} decimals", reading.value, reading.decimals),
                    _ => "bytes that no indicator sends".into(),
                };
                IndicatorError::Garbled { frame }
            }
        }
    }

    fn send(&mut self, command: &str) -> Result<(), IndicatorError> {
        if !self.is_in_step {
            self.fall_into_step()?;
        }
        self.lines.clear();
        self.port.discard_input().map_err(gone)?;
        self.transmit(command)
    }

    fn transmit(&mut self, command: &str) -> Result<(), IndicatorError> {
        // Sent in one write: radio links send each write as a packet of its own.
        let request = format!("{command}{}", self.settings.dialect.end);
        self.port.write_all(request.as_bytes()).and_then(|()| self.port.flush()).map_err(gone)?;
        self.traffic.sent += request.len() as u64;
        Ok(())
    }

    /// Waits until the line is quiet, then asks for the identity; whatever comes before that answer belongs to earlier
    /// requests.
    fn fall_into_step(&mut self) -> Result<(), IndicatorError> {
        let deadline = Instant::now() + self.settings.timeout;
        let mut quiet = Instant::now() + QUIET;
        while Instant::now() < quiet.min(deadline) {
            if self.take_in()? > 0 {
                quiet = Instant::now() + QUIET;
            }
        }
        self.lines.clear();
        if let (Some(query), Some(name)) = (self.settings.dialect.identity, self.name.clone()) {
            self.transmit(query)?;
            loop {
                match self.receive(deadline)? {
                    Some(line) if line == name.as_bytes() => break,
                    // If the identity arrives in another frame, so would all later answers; the error reports that
                    // frame.
                    Some(line) => drop(self.understood(&line)?),
                    None => return Err(self.silent()),
                }
            }
        }
        self.is_in_step = true;
        Ok(())
    }

    /// Receives the next line before the deadline.
    fn receive(&mut self, deadline: Instant) -> Result<Option<Vec<u8>>, IndicatorError> {
        loop {
            if let Some(line) = self.lines.line() {
                return Ok(Some(line));
            }
            if Instant::now() >= deadline {
                return Ok(None);
            }
            self.take_in()?;
        }
    }

    /// Reads the available bytes, or waits briefly. Returns their number.
    fn take_in(&mut self) -> Result<usize, IndicatorError> {
        let mut bytes = [0; 64];
        match self.port.read(&mut bytes) {
            Ok(0) => Err(gone(ErrorKind::UnexpectedEof.into())),
            Ok(count) => {
                self.traffic.received += count as u64;
                self.lines.push(&bytes[..count]);
                Ok(count)
            }
            Err(e) if matches!(e.kind(), ErrorKind::TimedOut | ErrorKind::WouldBlock | ErrorKind::Interrupted) => Ok(0),
            Err(e) => Err(gone(e)),
        }
    }
}

impl<P: Port> Indicator for AsciiIndicator<P> {
    fn read(&mut self) -> Result<f64, IndicatorError> {
        Ok(self.shown()? + self.offset)
    }

    fn preset(&mut self, value: f64) -> Result<(), IndicatorError> {
        let mut tries = 1;
        loop {
            let done = match self.settings.dialect.preset {
                PresetManner::Instrument { store, query, recall } => self.preset_instrument(value, store, query, recall),
                PresetManner::Driver => self.shown().map(|shown| self.offset = value - shown),
            };
            match done {
                Err(IndicatorError::Silent | IndicatorError::Garbled { .. }) if tries < PRESET_TRIES => tries += 1,
                done => return done,
            }
        }
    }
}

/// Removes case and blanks, which instruments ignore.
fn bare(line: &[u8]) -> String {
    line.iter().filter(|byte| **byte != b' ').map(|byte| char::from(byte.to_ascii_uppercase())).collect()
}

fn gone(error: std::io::Error) -> IndicatorError {
    IndicatorError::Fault { detail: format!("its port is gone: {error}") }
}
