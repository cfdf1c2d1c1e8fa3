//! The watch page of a measurement: closed to strangers, it says what the arm does, and its stop is the operator's.

#![cfg(unix)]

use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::process::{Child, Stdio};
use std::time::{Duration, Instant};

use serde_json::Value;

use crate::served::Bench;

/// What a server answers: its status, and the text.
fn ask(address: &str, request: &str) -> (String, String) {
    let mut stream = TcpStream::connect(address).unwrap();
    stream.set_read_timeout(Some(Duration::from_secs(30))).unwrap();
    write!(stream, "{request}\r\nHost: {address}\r\nConnection: close\r\n\r\n").unwrap();
    let mut text = String::new();
    stream.read_to_string(&mut text).unwrap();
    let (head, body) = text.split_once("\r\n\r\n").unwrap();
    (head.split(' ').nth(1).unwrap().to_owned(), body.to_owned())
}

/// A page that was announced: address and token.
struct Page {
    address: String,
    token: String,
}

impl Page {
    /// That of a process whose standard error announces it.
    fn of(process: &mut Child) -> Page {
        let mut said = BufReader::new(process.stderr.take().unwrap());
        let mut line = String::new();
        while !line.contains("http://") {
            line.clear();
            assert!(said.read_line(&mut line).unwrap() > 0, "no page is announced");
        }
        // Whoever writes into a closed pipe is ended.
        std::thread::spawn(move || drop(said.read_to_string(&mut String::new())));
        let (address, token) = line.trim().split_once("http://").unwrap().1.split_once("/?token=").unwrap();
        Page { address: address.into(), token: token.into() }
    }

    fn state(&self) -> Value {
        let (status, body) = ask(&self.address, &format!("GET /api/state HTTP/1.1\r\nX-Calibench-Token: {}", self.token));
        assert_eq!(status, "200", "{body}");
        serde_json::from_str(&body).unwrap()
    }
}

/// Measurements of a state that have not failed.
fn measured(state: &Value) -> usize {
    state["results"].as_array().unwrap().iter().filter(|row| row["failure"].is_null()).count()
}

#[test]
fn whoever_has_the_address_sees_the_measurement_and_stops_it() {
    let bench = Bench::small();
    let served = bench.serve(&["--indicator-port", "0", "--time-scale", "40"]);
    bench.write_cell(&served, "", "", "");
    let mut process = bench.measure("watched", &["--watch"]).stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
    let page = Page::of(&mut process);
    let (address, token) = (&page.address, &page.token);
    // Nobody without the token, or by another name, sees or stops anything.
    assert_eq!(ask(address, "GET / HTTP/1.1").0, "401");
    assert_eq!(ask(address, "GET /api/state HTTP/1.1").0, "401");
    assert_eq!(ask(address, "POST /api/stop HTTP/1.1\r\nContent-Type: application/json\r\nContent-Length: 0").0, "401");
    let elsewhere = format!("GET /api/state HTTP/1.1\r\nX-Calibench-Token: {token}\r\nOrigin: http://example.org");
    assert_eq!(ask(address, &elsewhere).0, "403");
    let (status, html) = ask(address, &format!("GET /?token={token} HTTP/1.1"));
    assert!(status == "200" && html.contains("It is not an emergency stop") && !html.contains("@SCRIPT@"), "{status}");

    let began = Instant::now();
    let state = loop {
        let state = page.state();
        if measured(&state) >= 5 {
            break state;
        }
        assert!(began.elapsed() < Duration::from_secs(120), "{state}");
        std::thread::sleep(Duration::from_millis(50));
    };
    assert_eq!((state["what"].as_str(), state["wanted"].as_u64()), (Some("probings"), Some(8)));
    assert_eq!(state["tolerance_mm"], 0.003);
    // An arm that is not calibrated is some tenths to some millimetres off, and every measurement says so.
    let off: Vec<f64> = state["results"].as_array().unwrap().iter().map(|row| row["off_mm"].as_f64().unwrap()).collect();
    assert!(off.iter().all(|mm| (1e-4..10.0).contains(mm)), "{off:?}");

    let stop =
        format!("POST /api/stop HTTP/1.1\r\nX-Calibench-Token: {token}\r\nContent-Type: application/json\r\nContent-Length: 0");
    let (status, body) = ask(address, &stop);
    let asked: Value = serde_json::from_str(&body).unwrap();
    assert!(status == "200" && asked["is_stopping"] == true, "{status} {body}");
    let ended = process.wait().unwrap();
    assert_eq!(ended.code(), Some(3));
    assert!(bench.path("watched.journal").exists());
    assert!(bench.measured("watched", &["--resume", "--mastered"]).status.success());
}
