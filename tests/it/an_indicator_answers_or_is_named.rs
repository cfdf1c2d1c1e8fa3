//! The driver of ASCII indicators, against a peer on a real pseudo-terminal or socket that answers as a script says: it gets the value
//! right or says what is wrong, and never waits longer than it was told to.
#![cfg(unix)]

use std::io::{ErrorKind, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::time::{Duration, Instant};

use calibench::cell::gauge::{AsciiIndicator, Dialect, IndicatorSettings, Port, ReadingFormat, open_socket};
use calibench::cell::{Indicator, IndicatorError};
use calibench::units::MM;
use serialport::{SerialPort, TTYPort};

/// Short, so that silence is cheap; long against a loaded machine's hiccups.
const TIMEOUT: Duration = Duration::from_millis(600);
/// What ends at all has ended by then, however busy the machine is.
const SOON: Duration = Duration::from_secs(60);

fn settings(dialect: Dialect) -> IndicatorSettings {
    IndicatorSettings { timeout: TIMEOUT, echo: Duration::from_millis(60), ..IndicatorSettings::new(dialect) }
}

/// A peer that answers each request (upper case, without its CR) as told: what it says is written as it stands.
fn answer(mut port: impl Read + Write + Send + 'static, mut reply: impl FnMut(&str) -> Vec<Vec<u8>> + Send + 'static) {
    std::thread::spawn(move || {
        let mut request = String::new();
        let mut byte = [0];
        loop {
            match port.read(&mut byte) {
                Ok(0) => return,
                // STX is a request by itself.
                Ok(_) if matches!(byte[0], b'\r' | 2) => {
                    let asked = std::mem::take(&mut request).to_ascii_uppercase();
                    let asked = if byte[0] == 2 { "STX".to_owned() } else { asked };
                    for piece in reply(&asked) {
                        if port.write_all(&piece).is_err() {
                            return;
                        }
                        std::thread::sleep(Duration::from_millis(5));
                    }
                }
                Ok(_) => request.push(char::from(byte[0])),
                Err(e) if e.kind() == ErrorKind::TimedOut => {}
                Err(_) => return,
            }
        }
    });
}

fn on_terminal(reply: impl FnMut(&str) -> Vec<Vec<u8>> + Send + 'static) -> Box<dyn SerialPort> {
    let (mut peer, mut ours) = TTYPort::pair().expect("a pseudo-terminal");
    peer.set_timeout(Duration::from_millis(50)).unwrap();
    ours.set_timeout(Duration::from_millis(20)).unwrap();
    answer(peer, reply);
    Box::new(ours)
}

fn on_socket(reply: impl FnMut(&str) -> Vec<Vec<u8>> + Send + 'static) -> TcpStream {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let ours = open_socket(&listener.local_addr().unwrap().to_string(), TIMEOUT).unwrap();
    answer(listener.accept().unwrap().0, reply);
    ours
}

fn said(line: &str) -> Vec<Vec<u8>> {
    vec![line.as_bytes().to_vec()]
}

/// An instrument with its plunger still; `manner` may answer in its place.
struct Sylvac {
    position: f64,
    offset: f64,
    preset: f64,
    unit: &'static str,
    format: ReadingFormat,
    echoes: bool,
    recalls_by: &'static str,
}

impl Default for Sylvac {
    fn default() -> Self {
        let format = ReadingFormat::SYLVAC;
        Sylvac { position: 3.1, offset: 0.0, preset: 0.0, unit: "MM", format, echoes: true, recalls_by: "PRE" }
    }
}

impl Sylvac {
    fn reply(&mut self, request: &str) -> Vec<Vec<u8>> {
        let end = self.format.end;
        let echo = if self.echoes { said(&format!("{request}{end}")) } else { Vec::new() };
        let shown = |value: f64| vec![self.format.encode(value)];
        match request {
            "?" => shown(self.position + self.offset),
            "PRE?" => shown(self.preset),
            "ID?" => said(&format!("SY289{end}")),
            "VER?" => said(&format!("V1.24 11.10.2017{end}")),
            "UNI?" => said(&format!("{}{end}", self.unit)),
            "BAT?" => said(&format!("BAT1{end}")),
            "RES?" => said(&format!("RES1{end}")),
            "MM" => {
                self.unit = "MM";
                echo
            }
            recall if recall == self.recalls_by => {
                self.offset = self.preset - self.position;
                echo
            }
            store if store.strip_prefix("PRE ").is_some_and(|number| number.parse::<f64>().is_ok()) => {
                self.preset = store[4..].parse().unwrap();
                echo
            }
            _ => said(&format!("ERR1{end}")),
        }
    }
}

fn close(value: f64, mm: f64) -> bool {
    (value - mm * MM).abs() < 1e-9
}

fn is_mastered_and_read(mut indicator: AsciiIndicator<impl Port>) {
    let identity = indicator.identify().unwrap();
    assert_eq!((identity.name.as_deref(), identity.battery_low), (Some("SY289"), Some(false)));
    assert!(close(indicator.read().unwrap(), 3.1));
    indicator.preset(6.35 * MM).unwrap();
    assert!(close(indicator.read().unwrap(), 6.35));
    let traffic = indicator.traffic();
    assert!(traffic.sent > 20 && traffic.received > traffic.sent, "{traffic:?}");
}

#[test]
fn every_manner_of_answering_is_understood() {
    let format = ReadingFormat::SYLVAC;
    let manners: Vec<fn() -> Sylvac> = vec![
        Sylvac::default,
        || Sylvac { echoes: false, ..Sylvac::default() },
        || Sylvac { recalls_by: "PRE ON", ..Sylvac::default() },
        || Sylvac { unit: "IN", ..Sylvac::default() },
    ];
    for manner in manners {
        let mut sylvac = manner();
        is_mastered_and_read(AsciiIndicator::new(on_terminal(move |r| sylvac.reply(r)), settings(Dialect::SYLVAC)));
    }
    for format in [
        ReadingFormat { end: "\r\n", ..format },
        ReadingFormat { comma: true, ..format },
        ReadingFormat { after: ">", ..format },
        ReadingFormat { decimals: 3, whole: 1, ..format },
    ] {
        let mut sylvac = Sylvac { format, ..Sylvac::default() };
        is_mastered_and_read(AsciiIndicator::new(on_socket(move |r| sylvac.reply(r)), settings(Dialect::SYLVAC)));
    }
}

#[test]
fn instruments_without_a_preset_are_mastered_by_their_driver() {
    let mahr = ReadingFormat { whole: 1, after: "mm", end: "\r\n", ..ReadingFormat::SYLVAC };
    let mut instrument = Sylvac { format: mahr, ..Sylvac::default() };
    let mut indicator = AsciiIndicator::new(on_terminal(move |r| instrument.reply(r)), settings(Dialect::MAHR));
    assert_eq!(indicator.identify().unwrap().battery_low, None);
    indicator.preset(6.35 * MM).unwrap();
    assert!(close(indicator.read().unwrap(), 6.35));
    let mitutoyo = ReadingFormat { whole: 4, decimals: 3, before: "01A", ..ReadingFormat::SYLVAC };
    let reply = move |request: &str| if request == "1" { vec![mitutoyo.encode(-2.5)] } else { Vec::new() };
    let mut indicator = AsciiIndicator::new(on_terminal(reply), settings(Dialect::MITUTOYO));
    assert_eq!(indicator.identify().unwrap().name, None);
    indicator.preset(6.35 * MM).unwrap();
    assert!(close(indicator.read().unwrap(), 6.35));
}

#[test]
fn indicators_of_other_makers_are_read_as_their_manuals_say() {
    // Eight characters with the point, a blank, a comma, the unit.
    let reply = |request: &str| if request == "R" { said("+006.3512 ,MM\r\n") } else { Vec::new() };
    let mut indicator = AsciiIndicator::new(on_socket(reply), settings(Dialect::CHICAGO));
    assert_eq!(indicator.identify().unwrap().name, None);
    assert!(close(indicator.read().unwrap(), 6.3512));
    let reply = |request: &str| if request == "R" { said("-  0.2500 ,IN\r\n") } else { Vec::new() };
    assert!(close(AsciiIndicator::new(on_socket(reply), settings(Dialect::CHICAGO)).read().unwrap(), -6.35));
    // Sign, ten characters, a blank, the unit, the class, the state; and nothing after STX.
    for (answer, mm) in [
        ("-      5.23  =A\r\n", -5.23),
        ("+    6.3500    \r\n", 6.35),
        ("+   0.25000 \" 1\r\n", 6.35),
        ("+    1.0000  > \r\n", 1.0),
    ] {
        let reply = move |request: &str| if request == "STX" { said(answer) } else { said("NAK\r\n") };
        let mut indicator = AsciiIndicator::new(on_socket(reply), settings(Dialect::HEIDENHAIN));
        assert!(close(indicator.read().unwrap(), mm), "{answer}");
        indicator.preset(6.35 * MM).unwrap();
        assert!(close(indicator.read().unwrap(), 6.35), "{answer}");
    }
    // A signal that is disturbed is no reading.
    let mut indicator = AsciiIndicator::new(on_socket(|_: &str| said("+    1.0000 ?  \r\n")), settings(Dialect::HEIDENHAIN));
    assert!(indicator.read().is_err());
}

#[test]
fn an_indicator_that_counts_down_is_turned_round() {
    let mut sylvac = Sylvac { position: -3.1, ..Sylvac::default() };
    let settings = IndicatorSettings { counts_down: true, ..settings(Dialect::SYLVAC) };
    is_mastered_and_read(AsciiIndicator::new(on_terminal(move |r| sylvac.reply(r)), settings));
}

#[test]
fn inches_that_cannot_be_left_are_a_fault() {
    let reply = |request: &str| match request {
        "UNI?" => said("IN\r"),
        "ID?" => said("SY289\r"),
        _ => said("ERR1\r"),
    };
    let mut indicator = AsciiIndicator::new(on_terminal(reply), settings(Dialect::SYLVAC));
    assert!(matches!(indicator.identify(), Err(IndicatorError::Fault { detail }) if detail.contains("IN")));
}

#[test]
fn silence_ends_when_it_was_said_to() {
    let mut indicator = AsciiIndicator::new(on_terminal(|_| Vec::new()), settings(Dialect::SYLVAC));
    let began = Instant::now();
    assert_eq!(indicator.read(), Err(IndicatorError::Silent));
    assert!((TIMEOUT..SOON).contains(&began.elapsed()), "{:?}", began.elapsed());
    // Someone who talks without being asked, and never ends a line, is not waited for either.
    let chatter = |_: &str| vec![vec![b'x'; 50]; 400];
    let mut indicator = AsciiIndicator::new(on_socket(chatter), settings(Dialect::SYLVAC));
    let began = Instant::now();
    assert!(indicator.read().is_err());
    assert!(indicator.read().is_err());
    assert!(began.elapsed() < SOON, "{:?}", began.elapsed());
}

/// The requests for a value get these answers in turn, then `+001.0000`, `+002.0000` ... as the plunger moves on.
fn after(first: Vec<Vec<Vec<u8>>>) -> AsciiIndicator<Box<dyn SerialPort>> {
    let mut first = first.into_iter();
    let mut moved = 0.0;
    let mut rest = Sylvac::default();
    let reply = move |request: &str| match request {
        "?" => first.next().unwrap_or_else(|| {
            moved += 1.0;
            vec![ReadingFormat::SYLVAC.encode(moved)]
        }),
        other => rest.reply(other),
    };
    let mut indicator = AsciiIndicator::new(on_terminal(reply), settings(Dialect::SYLVAC));
    indicator.identify().unwrap();
    indicator
}

#[test]
fn what_is_mangled_is_named_and_the_next_answer_is_read() {
    for garbage in
        [b"\xff\x00\x13\r".to_vec(), b"+006.35O0\r".to_vec(), b"hello\r".to_vec(), vec![b'z'; 300], b"\x81\r\x82\r\r".to_vec()]
    {
        let mut indicator = after(vec![vec![garbage.clone()]]);
        let answer = indicator.read();
        assert!(matches!(answer, Err(IndicatorError::Garbled { .. })), "{garbage:?}: {answer:?}");
        assert!(close(indicator.read().unwrap(), 1.0));
        assert!(close(indicator.read().unwrap(), 2.0));
    }
    // A digit lost on the way changes the number of decimals, and is noticed once the instrument is known.
    let good = b"+009.0000\r".to_vec();
    let mut indicator = after(vec![vec![good], vec![b"+009.000\r".to_vec()]]);
    assert!(close(indicator.read().unwrap(), 9.0));
    assert!(matches!(indicator.read(), Err(IndicatorError::Garbled { .. })));
    assert!(close(indicator.read().unwrap(), 1.0));
}

#[test]
fn split_answers_are_put_together_and_doubled_ones_are_not_taken_twice() {
    let split = vec![b"+00".to_vec(), b"9.00".to_vec(), b"00".to_vec(), b"\r".to_vec()];
    let mut indicator =
        after(vec![split, vec![b"+008.0000\r+008.0000\r".to_vec()], vec![b"+007.0000\r".to_vec(), b"+007.0000\r".to_vec()]]);
    for mm in [9.0, 8.0, 7.0] {
        assert!(close(indicator.read().unwrap(), mm));
    }
    std::thread::sleep(Duration::from_millis(50));
    assert!(close(indicator.read().unwrap(), 1.0));
}

#[test]
fn an_answer_that_comes_late_is_not_taken_for_the_next_one() {
    let mut late = true;
    let mut rest = Sylvac::default();
    let reply = move |request: &str| match request {
        "?" if late => {
            late = false;
            std::thread::sleep(TIMEOUT + Duration::from_millis(400));
            said("+004.0000\r")
        }
        "?" => said("+005.0000\r"),
        other => rest.reply(other),
    };
    let mut indicator = AsciiIndicator::new(on_terminal(reply), settings(Dialect::SYLVAC));
    indicator.identify().unwrap();
    assert_eq!(indicator.read(), Err(IndicatorError::Silent));
    assert!(close(indicator.read().unwrap(), 5.0));
}

/// As eight data bits show a line with seven and a parity bit.
fn with_parity(line: &[u8], odd: u32) -> Vec<u8> {
    line.iter().map(|b| if b.count_ones() % 2 != odd { b | 0x80 } else { *b }).collect()
}

#[test]
fn the_wrong_parity_is_recognised() {
    // Of the second value only the end of the line betrays it.
    let values = [with_parity(b"+001.2478\r", 0), with_parity(b"+006.3500\r", 0)];
    assert_eq!(values[1], b"+006.3500\x8d");
    let mut indicator = after(values.iter().map(|value| vec![value.clone()]).collect());
    for value in &values {
        let answer = indicator.read();
        assert!(matches!(&answer, Err(IndicatorError::Garbled { frame }) if frame.contains("7E")), "{value:?}: {answer:?}");
    }
    assert!(close(indicator.read().unwrap(), 1.0));
}

/// Asked who it is after the first answer that is not understood, the instrument answers in the wrong frame too.
#[test]
fn a_frame_that_changes_on_the_way_is_recognised_every_time() {
    // The port marks bytes of a wrong parity by NUL; eight data bits without parity look even where seven are expected, so the odd ones
    // are marked, the end of the line among them. Of another parity all are.
    let marked =
        |line: &[u8], odd: u32| line.iter().map(|b| if b.count_ones() % 2 == odd { *b } else { 0 }).collect::<Vec<u8>>();
    type Seen = fn(&[u8], &dyn Fn(&[u8], u32) -> Vec<u8>) -> Vec<u8>;
    let frames: [(&str, Seen); 5] = [
        ("7E, not 8N", |line, _| with_parity(line, 0)),
        ("7O, not 8N", |line, _| with_parity(line, 1)),
        ("8N, not 7E", |line, marked| marked(line, 0)),
        ("8N, not 7E", |line, marked| marked(line, 1)),
        ("another parity", |line, _| vec![0; line.len()]),
    ];
    for (hint, seen) in frames {
        let (mut instrument, mut values) = (Sylvac::default(), 0);
        let reply = move |request: &str| {
            values += usize::from(request == "?");
            let answer = instrument.reply(request);
            if values < 3 { answer } else { answer.iter().map(|piece| seen(piece, &marked)).collect() }
        };
        let mut indicator = AsciiIndicator::new(on_terminal(reply), settings(Dialect::SYLVAC));
        indicator.identify().unwrap();
        assert!(close(indicator.read().unwrap(), 3.1) && close(indicator.read().unwrap(), 3.1));
        for asked in 1..=3 {
            let answer = indicator.read();
            let told = matches!(&answer, Err(IndicatorError::Garbled { frame }) if frame.contains(hint));
            assert!(told, "{hint}, asked {asked} times: {answer:?}");
        }
    }
}

#[test]
fn errors_of_the_instrument_are_told_apart() {
    let error = |digit: u8| vec![format!("ERR{digit}\r").into_bytes()];
    let mut indicator = after((0..4).map(error).collect());
    assert!(matches!(indicator.read(), Err(IndicatorError::Fault { detail }) if detail.contains("sensor")));
    assert!(matches!(indicator.read(), Err(IndicatorError::Fault { detail }) if detail.contains("command")));
    assert!(matches!(indicator.read(), Err(IndicatorError::Garbled { .. })));
    assert_eq!(indicator.read(), Err(IndicatorError::OverRange));
    assert!(close(indicator.read().unwrap(), 1.0));
}

#[test]
fn a_preset_that_is_not_taken_is_a_fault() {
    let mut stores_another = Sylvac::default();
    let reply = move |r: &str| if r == "PRE?" { said("+006.3000\r") } else { stores_another.reply(r) };
    let mut indicator = AsciiIndicator::new(on_terminal(reply), settings(Dialect::SYLVAC));
    assert!(matches!(indicator.preset(6.35 * MM), Err(IndicatorError::Fault { detail }) if detail.contains("stores")));
    let mut never_recalls = Sylvac { recalls_by: "NEVER", ..Sylvac::default() };
    let mut indicator = AsciiIndicator::new(on_terminal(move |r| never_recalls.reply(r)), settings(Dialect::SYLVAC));
    assert!(
        matches!(indicator.preset(6.35 * MM), Err(IndicatorError::Fault { detail }) if detail.contains("does not apply it"))
    );
}

#[test]
fn a_port_that_is_gone_is_a_fault() {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let ours = open_socket(&listener.local_addr().unwrap().to_string(), TIMEOUT).unwrap();
    drop(listener.accept().unwrap());
    let mut indicator = AsciiIndicator::new(ours, settings(Dialect::SYLVAC));
    assert!(matches!(indicator.read(), Err(IndicatorError::Fault { detail }) if detail.contains("gone")));
}
