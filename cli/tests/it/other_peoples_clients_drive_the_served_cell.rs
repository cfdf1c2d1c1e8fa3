//! A client from the crates registry reads and moves the served robot; plain sockets and terminals reach the indicators.
//! (Python clients: `tests/clients/run`.)
#![cfg(unix)]

use std::fs::OpenOptions;
use std::io::{Read, Write};
use std::net::TcpStream;
use std::path::Path;
use std::time::{Duration, Instant};

use crate::served::{Bench, Served};
use calibench::cell::TriCal;
use calibench::cell::gauge::{AsciiIndicator, Dialect, IndicatorSettings, open_socket};
use calibench::measure::campaign::mastering::{Attendant, CalledOff, MasteringSettings, master};
use rs_openshowvar::OpenShowVar;

fn connected(served: &Served) -> OpenShowVar {
    let (host, port) = served.robot();
    let mut client = OpenShowVar::new(host, port);
    client.connect().unwrap();
    client
}

/// Waits until the plain program has completed an action.
fn until_done(client: &mut OpenShowVar) {
    let asked = Instant::now();
    while client.read("COM_ACTION").unwrap() != "0" {
        assert!(asked.elapsed() < Duration::from_secs(20));
        std::thread::sleep(Duration::from_millis(2));
    }
}

#[test]
fn rs_openshowvar_reads_writes_and_moves_the_arm() {
    let bench = Bench::small();
    let served = bench.serve(&["--program", "plain"]);
    let mut client = connected(&served);
    assert_eq!(client.read("$OV_PRO").unwrap(), "100");
    client.write("$OV_PRO", "35").unwrap();
    assert_eq!(client.read("$OV_PRO").unwrap(), "35");
    for wrong in ["101", "-1", "35.5", "NaN", "fast", "\"35\"", "{X 35}"] {
        assert!(client.write("$OV_PRO", wrong).is_err(), "{wrong}");
        assert_eq!(client.read("$OV_PRO").unwrap(), "35", "after {wrong}");
    }
    assert_eq!(client.read("$MODE_OP").unwrap(), "#AUT");
    assert!(client.read("$NOBODY").is_err());
    client.write("COM_E6AXIS", "{A1 10, A2 -80.5, A3 90, A4 0, A5 45, A6 -20}").unwrap();
    client.write("COM_ACTION", "2").unwrap();
    until_done(&mut client);
    let axes = client.read("$AXIS_ACT").unwrap();
    assert!(axes.starts_with("{E6AXIS: A1 10.0, A2 -80.5, A3 90.0, A4 0.0, A5 45.0, A6 -20.0, E1 0.0"), "{axes}");
    assert_eq!(client.read("$AXIS_ACT.A2").unwrap(), "-80.5");
    // A straight line to 20 mm above the tool's position: every other coordinate stays.
    let before = client.read("$POS_ACT").unwrap();
    let z: f64 = client.read("$POS_ACT.Z").unwrap().parse().unwrap();
    client.write("COM_E6POS", &before).unwrap();
    client.write("COM_E6POS.Z", &format!("{:.4}", z + 20.0)).unwrap();
    client.write("COM_ACTION", "3").unwrap();
    until_done(&mut client);
    for member in ["X", "Y", "Z", "A", "B", "C"] {
        let number = |text: &str| text.parse::<f64>().unwrap();
        let is = number(&client.read(&format!("$POS_ACT.{member}")).unwrap());
        let was = number(before.split(&format!("{member} ")).nth(1).unwrap().split(',').next().unwrap());
        let expected = if member == "Z" { was + 20.0 } else { was };
        // Resolution of a float32 of some hundreds, printed with nine digits: 6e-5.
        assert!((is - expected).abs() < 3e-4, "{member}: {is} {expected}");
    }
    // A second client at the same time sees the same robot.
    assert_eq!(connected(&served).read("$AXIS_ACT").unwrap(), client.read("$AXIS_ACT").unwrap());
}

/// The attendant of a served cell, controlled through its standard input.
struct Commands<'a>(&'a mut Served);

impl Attendant for Commands<'_> {
    fn place_master_ball(&mut self) -> Result<(), CalledOff> {
        self.0.tell("ball in");
        Ok(())
    }

    fn remove_master_ball(&mut self) -> Result<(), CalledOff> {
        self.0.tell("ball out");
        Ok(())
    }
}

#[test]
fn a_gauge_is_mastered_again_once_the_master_ball_is_put_back() {
    let bench = Bench::small();
    let mut served = bench.serve(&["--program", "plain", "--indicator-port", "0"]);
    assert_eq!(served.answer("ball"), "in");
    let mut client = connected(&served);
    client.write("COM_E6AXIS", "{A1 10, A2 -80, A3 90, A4 0, A5 45, A6 0}").unwrap();
    client.write("COM_ACTION", "2").unwrap();
    until_done(&mut client);
    assert_eq!(served.answer("ball"), "out", "it is taken away before the robot moves");
    let mut gauges = served.indicators.clone().map(|address| {
        let port = open_socket(&address, Duration::from_secs(5)).unwrap();
        AsciiIndicator::new(port, IndicatorSettings::new(Dialect::SYLVAC))
    });
    let settings = MasteringSettings::default();
    for _ in 0..2 {
        master(&mut gauges, &mut Commands(&mut served), &TriCal::PAPER, &settings, || 0.0).unwrap();
        assert_eq!(served.answer("ball"), "out");
    }
    assert!(served.answer("master in").contains("ball in"), "what is not known is answered by what is");
}

/// Sends a request over a terminal or a socket, and reads up to the carriage return.
fn ask(stream: &mut (impl Read + Write), request: &str) -> String {
    stream.write_all(request.as_bytes()).unwrap();
    let (mut answer, mut byte) = (Vec::new(), [0]);
    while answer.last() != Some(&b'\r') {
        assert_eq!(stream.read(&mut byte).unwrap(), 1);
        answer.push(byte[0]);
    }
    String::from_utf8(answer).unwrap()
}

#[test]
fn indicators_answer_one_client_after_the_other_on_terminals_and_on_sockets() {
    let bench = Bench::small();
    let mut served = bench.serve(&[]);
    let open = |path: &str| OpenOptions::new().read(true).write(true).open(path).unwrap();
    let path = served.indicators[0].clone();
    let mut first = open(&path);
    assert_eq!(ask(&mut first, "id?\r"), "SY289\r");
    assert_eq!(ask(&mut first, "PRE +6.350\r"), "PRE+6.350\r");
    assert_eq!(ask(&mut first, "PRE\r\n"), "PRE\r");
    assert_eq!(ask(&mut first, "what\r"), "ERR1\r");
    let on_ball = ask(&mut first, "?\r");
    assert!(on_ball.starts_with("+006.34") || on_ball.starts_with("+006.35"), "{on_ball}");
    first.write_all(b"PRE +1").unwrap();
    drop(first);
    // A client's unfinished request is dropped after a moment.
    std::thread::sleep(Duration::from_millis(800));
    let mut second = open(&path);
    assert_eq!(ask(&mut second, "PRE?\r"), "+006.3500\r");
    served.tell("ball out");
    let free = ask(&mut second, "?\r");
    assert!(free.starts_with("-006.") || free.starts_with("-005."), "{free}");
    served.tell("ball in");
    assert!(ask(&mut second, "?\r").starts_with("+006.3"));
    let said = served.interrupt();
    assert!(said.contains("indicators: 8 answers"), "{said}");
    assert!(!Path::new(&path).exists(), "the terminal is gone with the server");

    let served = bench.serve(&["--indicator-port", "0"]);
    let mut socket = TcpStream::connect(&served.indicators[2]).unwrap();
    assert_eq!(ask(&mut socket, "NUM?\r"), "SIM3\r");
}
