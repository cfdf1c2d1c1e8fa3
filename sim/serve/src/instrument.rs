//! One plunger indicator as seen by its requests: the ASCII command family of Sylvac and its relatives.
//!
//! Source of the commands: Sylvac MEM-PM 292-1538-01 and 292-1806-02, S_Mike PRO Smart manual, Bowers UniCal manual,
//! Käfer OPTO-RS manual.

use calibench::cell::gauge::{DisplayUnit, ReadingFormat};
use calibench::cell::{Indicator, IndicatorError};
use calibench::units::{MM, UM};

use super::manner::{Maker, Manner};

/// Largest value that can be displayed or preset, m: three digits before the point, the first of them a one.
const LARGEST_PRESET: f64 = 199.999 * MM;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Shows {
    Present,
    Largest,
    Smallest,
}

/// On/off settings: name and factory state.
const SWITCHES: [(&str, bool); 6] =
    [("STO", false), ("KEY", true), ("ECO", false), ("AOFF", true), ("OUT", false), ("TOL", false)];
/// Index of `STO` in [`SWITCHES`]: the display is held.
const HOLD: usize = 0;
/// Index of `OUT` in [`SWITCHES`]: readings are sent continuously.
const OUTPUT: usize = 4;
/// Index of `TOL` in [`SWITCHES`]: readings are compared with limits.
const TOLERANCE: usize = 5;

/// An indicator and its settings.
#[derive(Debug, Clone)]
pub struct Instrument {
    manner: Manner,
    number: String,
    unit: DisplayUnit,
    unit_is_locked: bool,
    /// Digits after the point in millimetres.
    decimals: u8,
    preset: f64,
    preset_is_on: bool,
    counts_backwards: bool,
    switches: [bool; SWITCHES.len()],
    limits: [f64; 2],
    shows: Shows,
    largest: f64,
    smallest: f64,
    held: Option<f64>,
    is_off: bool,
}

impl Instrument {
    /// The indicator with this serial number, in its factory state.
    pub fn new(number: impl Into<String>, manner: Manner) -> Self {
        let mut switches = SWITCHES.map(|(_, on)| on);
        switches[TOLERANCE] = manner.tolerance;
        Instrument {
            manner,
            number: number.into(),
            unit: DisplayUnit::Millimetre,
            unit_is_locked: false,
            decimals: manner.decimals(),
            preset: 0.0,
            preset_is_on: false,
            counts_backwards: false,
            switches,
            limits: [MM, -MM],
            shows: Shows::Present,
            largest: f64::NEG_INFINITY,
            smallest: f64::INFINITY,
            held: None,
            is_off: false,
        }
    }

    /// True if it sends values unrequested.
    pub fn sends_by_itself(&self) -> bool {
        self.switches[OUTPUT] && !self.is_off
    }

    /// True if the request asks for a value.
    pub fn is_for_value(&self, request: &[u8]) -> bool {
        let request = compact(request);
        match self.manner.maker {
            Maker::Digimatic => request == "1",
            Maker::Sylvac | Maker::Mahr => matches!(request.as_str(), "?" | "PRI" | "PRI?"),
        }
    }

    /// Answers a request (given without its line end) with a complete line, or `None` if there is no answer.
    pub fn answer(&mut self, request: &[u8], plunger: &mut dyn Indicator) -> Option<Vec<u8>> {
        if self.is_for_value(request) && !self.is_off {
            return self.value(plunger);
        }
        if self.manner.maker == Maker::Digimatic {
            return None;
        }
        let command = compact(request);
        if self.is_off && command != "ON" {
            return None;
        }
        match self.query(&command) {
            Some(answer) => Some(self.line(&answer)),
            None => match self.set(&command, request, plunger) {
                Ok(()) if self.manner.no_echo => None,
                Ok(()) => Some(self.line(&command)),
                Err(Refusal::Unanswered) => None,
                Err(Refusal::Error(number)) => Some(self.line(&format!("ERR{number}"))),
            },
        }
    }

    /// The line with the displayed value, or with the error code.
    pub fn value(&mut self, plunger: &mut dyn Indicator) -> Option<Vec<u8>> {
        match self.shown(plunger) {
            Ok(value) => Some(self.format(self.verdict(value)).encode(value / self.unit.metres())),
            Err(Refusal::Unanswered) => None,
            Err(Refusal::Error(number)) => Some(self.line(&format!("ERR{number}"))),
        }
    }

    /// The displayed value, m.
    fn shown(&mut self, plunger: &mut dyn Indicator) -> Result<f64, Refusal> {
        let reading = plunger.read()?;
        let reading = if self.counts_backwards { -reading } else { reading };
        self.largest = self.largest.max(reading);
        self.smallest = self.smallest.min(reading);
        let shown = match self.shows {
            Shows::Present => reading,
            Shows::Largest => self.largest,
            Shows::Smallest => self.smallest,
        };
        Ok(if self.switches[HOLD] { *self.held.get_or_insert(shown) } else { shown })
    }

    /// Presets the present position to `value`, m.
    fn recall(&mut self, value: f64, plunger: &mut dyn Indicator) -> Result<(), Refusal> {
        plunger.preset(if self.counts_backwards { -value } else { value })?;
        (self.largest, self.smallest, self.held) = (f64::NEG_INFINITY, f64::INFINITY, None);
        Ok(())
    }

    fn query(&self, command: &str) -> Option<String> {
        let of = |name: &str, on: bool| format!("{name}{}", u8::from(on));
        if let Some((k, (name, _))) =
            SWITCHES.iter().enumerate().find(|(_, (name, _))| command.strip_suffix('?') == Some(*name))
        {
            return Some(of(name, self.switches[k]));
        }
        Some(match command {
            "ID?" => "SY289".into(),
            "VER?" => "V1.0 01.01.2026".into(),
            "UNI?" => self.unit_name().into(),
            "PRE?" => self.number_text(self.preset),
            "SET?" => format!("{} {} {} BAT1", self.unit_name(), of("STO", self.switches[HOLD]), of("KEY", self.switches[1])),
            // RES1 is 0.1 um, RES2 1 um, RES3 10 um.
            "RES?" => format!("RES{}", 5 - self.decimals.clamp(2, 4)),
            "CHA?" => if self.counts_backwards { "CHA-" } else { "CHA+" }.into(),
            "MOD?" => match self.shows {
                Shows::Present => "NOR",
                Shows::Largest => "MAX",
                Shows::Smallest => "MIN",
            }
            .into(),
            "BAT?" => "BAT1".into(),
            "MAC?" => format!("02:00:00:00:00:0{}", self.number.chars().last().unwrap_or('0')),
            "NUM?" => self.number.clone(),
            "LCAL?" | "NCAL?" => "00.00.2000".into(),
            _ => return None,
        })
    }

    fn set(&mut self, command: &str, request: &[u8], plunger: &mut dyn Indicator) -> Result<(), Refusal> {
        if let Some((k, (name, _))) = SWITCHES.iter().enumerate().find(|(_, (name, _))| command.starts_with(name))
            && let Some(on) = switch(&command[name.len()..])
        {
            self.switches[k] = on;
            self.held = None;
            return Ok(());
        }
        match command {
            "MM" | "IN" if self.unit_is_locked => return Err(Refusal::Error(1)),
            "MM" => self.unit = DisplayUnit::Millimetre,
            "IN" => self.unit = DisplayUnit::Inch,
            "UNI0" => self.unit_is_locked = true,
            "UNI1" => self.unit_is_locked = false,
            "PRE" if self.manner.preset_on => return Err(Refusal::Error(1)),
            "PRE" => self.recall(self.preset, plunger)?,
            "PREON" => {
                self.recall(self.preset, plunger)?;
                self.preset_is_on = true;
            }
            "PREOFF" => self.preset_is_on = false,
            "SET" => self.recall(if self.preset_is_on { self.preset } else { 0.0 }, plunger)?,
            "RES1" => self.decimals = 4,
            "RES2" => self.decimals = 3,
            "RES3" => self.decimals = 2,
            "CHA+" => self.counts_backwards = false,
            "CHA-" => self.counts_backwards = true,
            "NOR" => self.shows = Shows::Present,
            "MAX" => self.shows = Shows::Largest,
            "MIN" => self.shows = Shows::Smallest,
            "DEL" => (self.largest, self.smallest) = (f64::NEG_INFINITY, f64::INFINITY),
            "OFF" => self.is_off = true,
            "ON" => self.is_off = false,
            "RST" => *self = Instrument { is_off: false, ..Instrument::new(std::mem::take(&mut self.number), self.manner) },
            _ if command.starts_with("PRE") => self.preset = self.length(&command[3..])?,
            _ if command.starts_with("TOL") => self.limits = self.two_lengths(request)?,
            _ if command.starts_with("NUM") && command.len() <= 11 => self.number = command[3..].into(),
            _ => return Err(Refusal::Error(1)),
        }
        Ok(())
    }

    fn unit_name(&self) -> &'static str {
        if self.unit == DisplayUnit::Inch { "IN" } else { "MM" }
    }

    /// Reads a length, given in the unit of the display; returns m.
    fn length(&self, text: &str) -> Result<f64, Refusal> {
        let plain = text.bytes().all(|b| b.is_ascii_digit() || matches!(b, b'+' | b'-' | b'.' | b','));
        let number: f64 = plain.then(|| text.replace(',', ".").parse().ok()).flatten().ok_or(Refusal::Error(1))?;
        let length = number * self.unit.metres();
        // The tolerance keeps the last digit of the largest value within range.
        if length.abs() > LARGEST_PRESET + 0.05 * UM { Err(Refusal::Error(3)) } else { Ok(length) }
    }

    fn two_lengths(&self, request: &[u8]) -> Result<[f64; 2], Refusal> {
        let text = String::from_utf8_lossy(request);
        let mut words = text.split_ascii_whitespace().skip(1);
        match (words.next(), words.next(), words.next()) {
            (Some(high), Some(low), None) => Ok([self.length(high)?, self.length(low)?]),
            _ => Err(Refusal::Error(1)),
        }
    }

    fn verdict(&self, value: f64) -> &'static str {
        let [high, low] = self.limits;
        match self.switches[TOLERANCE] {
            false => "",
            true if value > high => ">",
            true if value < low => "<",
            true => "=",
        }
    }

    fn format(&self, verdict: &'static str) -> ReadingFormat {
        self.manner.format(self.unit, self.decimals, verdict)
    }

    fn number_text(&self, length: f64) -> String {
        let format = ReadingFormat { before: "", after: "", end: "", ..self.format("") };
        String::from_utf8_lossy(&format.encode(length / self.unit.metres())).into_owned()
    }

    fn line(&self, text: &str) -> Vec<u8> {
        [text.as_bytes(), self.manner.end().as_bytes()].concat()
    }
}

/// Reasons why a request is not carried out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Refusal {
    /// The request is ignored without an answer.
    Unanswered,
    /// `ERR` and this digit: 0 sensor, 1 command, 3 range.
    Error(u8),
}

impl From<IndicatorError> for Refusal {
    fn from(error: IndicatorError) -> Self {
        match error {
            IndicatorError::Silent => Refusal::Unanswered,
            IndicatorError::OverRange => Refusal::Error(3),
            // On the wire every other fault of an indicator is reported as a fault of its sensor.
            _ => Refusal::Error(0),
        }
    }
}

/// Removes blanks and converts to upper case: requests are case-insensitive.
fn compact(request: &[u8]) -> String {
    request.iter().filter(|byte| !byte.is_ascii_whitespace()).map(|&byte| char::from(byte).to_ascii_uppercase()).collect()
}

fn switch(text: &str) -> Option<bool> {
    match text {
        "0" => Some(false),
        "1" => Some(true),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A plunger at a position (m), with a zero that a preset shifts.
    struct Plunger {
        place: f64,
        zero: f64,
    }

    impl Indicator for Plunger {
        fn read(&mut self) -> Result<f64, IndicatorError> {
            if self.place > 12.5 * MM { Err(IndicatorError::OverRange) } else { Ok(self.place + self.zero) }
        }

        fn preset(&mut self, value: f64) -> Result<(), IndicatorError> {
            self.zero = value - self.place;
            Ok(())
        }
    }

    fn converse(manner: Manner, place: f64, requests: &[(&str, &str)]) {
        let (mut instrument, mut plunger) = (Instrument::new("SIM1", manner), Plunger { place, zero: 0.0 });
        for (request, expected) in requests {
            let answer = instrument.answer(request.as_bytes(), &mut plunger).unwrap_or_default();
            assert_eq!(String::from_utf8_lossy(&answer), *expected, "to {request}");
        }
    }

    #[test]
    fn mastering_is_a_preset_stored_and_recalled() {
        converse(
            Manner::default(),
            3.0 * MM,
            &[
                ("?", "+003.0000\r"),
                ("pre +6.350", "PRE+6.350\r"),
                ("PRE?", "+006.3500\r"),
                ("?", "+003.0000\r"),
                (" p r e ", "PRE\r"),
                ("?", "+006.3500\r"),
                ("PRE ON", "PREON\r"),
                ("SET", "SET\r"),
                ("PRI?", "+006.3500\r"),
                ("PRE OFF", "PREOFF\r"),
                ("SET", "SET\r"),
                ("?", "+000.0000\r"),
            ],
        );
    }

    #[test]
    fn what_it_does_not_know_or_cannot_hold_is_an_error() {
        converse(
            Manner::default(),
            13.0 * MM,
            &[
                ("?", "ERR3\r"),
                ("HELLO", "ERR1\r"),
                ("", "ERR1\r"),
                ("PRE 250", "ERR3\r"),
                ("PRE x", "ERR1\r"),
                ("PRE NaN", "ERR1\r"),
                ("PRE 199.999", "PRE199.999\r"),
                ("TOL 2", "ERR1\r"),
                ("PRE", "PRE\r"),
                ("UNI0", "UNI0\r"),
                ("IN", "ERR1\r"),
            ],
        );
    }

    #[test]
    fn units_resolutions_and_directions() {
        converse(
            Manner { no_echo: true, ..Manner::default() },
            6.35 * MM,
            &[
                ("RES?", "RES1\r"),
                ("RES2", ""),
                ("?", "+006.350\r"),
                ("IN", ""),
                ("UNI?", "IN\r"),
                ("?", "+0.25000\r"),
                ("MM", ""),
                ("CHA-", ""),
                ("CHA?", "CHA-\r"),
                ("?", "-006.350\r"),
                ("RST", ""),
                ("?", "+006.3500\r"),
            ],
        );
    }

    #[test]
    fn every_quirk_shows() {
        let manner = Manner { comma: true, crlf: true, tolerance: true, decimals: Some(3), ..Manner::default() };
        converse(
            manner,
            6.35 * MM,
            &[
                ("?", "+006,350>\r\n"),
                ("TOL 7.0 6.0", "TOL7.06.0\r\n"),
                ("?", "+006,350=\r\n"),
                ("TOL0", "TOL0\r\n"),
                ("?", "+006,350\r\n"),
            ],
        );
        converse(Manner { maker: Maker::Mahr, ..Manner::default() }, -MM, &[("?", "-001.0000mm\r\n"), ("ID?", "SY289\r\n")]);
        converse(
            Manner { maker: Maker::Digimatic, ..Manner::default() },
            -MM,
            &[("1", "01A-0001.000\r"), ("PRE", ""), ("?", "")],
        );
    }

    #[test]
    fn hold_memory_output_and_sleep() {
        converse(
            Manner::default(),
            MM,
            &[
                ("STO1", "STO1\r"),
                ("?", "+001.0000\r"),
                ("SET?", "MM STO1 KEY1 BAT1\r"),
                ("STO0", "STO0\r"),
                ("MAX", "MAX\r"),
                ("MOD?", "MAX\r"),
                ("OUT?", "OUT0\r"),
                ("BAT?", "BAT1\r"),
                ("NUM?", "SIM1\r"),
                ("OFF", "OFF\r"),
                ("?", ""),
                ("ON", "ON\r"),
                ("?", "+001.0000\r"),
            ],
        );
    }
}
