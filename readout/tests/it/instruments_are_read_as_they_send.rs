//! Instruments that answer a trigger, stream, connect by themselves, break off, and send what they should not.

use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use calibench::units::MM;
use calibench_readout::{Instrument, MeasuredPoint, ReadoutError, read_station};

/// An instrument by the keys of its station file.
fn open(keys: &str) -> Instrument {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("station.toml");
    std::fs::write(&file, format!("format = \"calibench-station/1\"\ncontroller.kind = \"typed\"\n[instrument]\n{keys}"))
        .unwrap();
    Instrument::open(read_station(&file).unwrap().instrument.unwrap()).unwrap()
}

fn point(instrument: &mut Instrument) -> Result<MeasuredPoint, ReadoutError> {
    instrument.point(&mut || true).map(|point| point.unwrap())
}

/// Millimetres of a point.
fn mm(point: &MeasuredPoint) -> [f64; 3] {
    [point.position.x / MM, point.position.y / MM, point.position.z / MM].map(|x| (x * 1e6).round() / 1e6)
}

/// Serves one connection after the other by this function until the process ends.
fn serve(mut talk: impl FnMut(TcpStream) + Send + 'static) -> String {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap().to_string();
    std::thread::spawn(move || listener.incoming().for_each(|stream| talk(stream.unwrap())));
    address
}

/// Answers every trigger of one byte by the next of these texts, the last again and again.
fn answering(texts: &'static [&'static str]) -> String {
    serve(move |mut stream| {
        let mut count = 0;
        while stream.read_exact(&mut [0]).is_ok() {
            stream.write_all(texts[count.min(texts.len() - 1)].as_bytes()).unwrap();
            count += 1;
        }
    })
}

#[test]
fn a_trigger_gives_the_point_that_follows_it() {
    let address = answering(&["P1,1.5,-2.5,3\r\n", "status ok\r\nP2,+4,5,6e0\r\n", "P3;7;8;9\r\n"]);
    let mut instrument =
        open(&format!("address = \"{address}\"\ntrigger = 'M'\nline = \"{{name}},{{x}},{{y}},{{z}}\"\ntimeout_s = 1"));
    let first = point(&mut instrument).unwrap();
    assert_eq!((first.name.as_deref(), mm(&first), first.count), (Some("P1"), [1.5, -2.5, 3.0], 1));
    assert_eq!(mm(&point(&mut instrument).unwrap()), [4.0, 5.0, 6.0]);
    // A line of another form is shown, for whoever corrects the template.
    let said = point(&mut instrument).unwrap_err().to_string();
    assert!(said.contains("sent 'P3;7;8;9'") && said.contains("`line`"), "{said}");
}

#[test]
fn units_commas_and_lines_without_an_end() {
    for (unit, line, text, want) in [
        ("m", "{x} {y} {z}", "0.0015 -0.0025 0.003", [1.5, -2.5, 3.0]),
        ("in", "{x},{y},{z}", "1,2,-1", [25.4, 50.8, -25.4]),
        ("um", "X={x};Y={y};Z={z}", "X=1500,5;Y=0;Z=-2", [1.5005, 0.0, -0.002]),
        ("mm", "{},{x},{y},{z},{}", "12:00:01,1,2,3,0.02", [1.0, 2.0, 3.0]),
    ] {
        let address = answering(Box::leak(Box::new([&*text.to_owned().leak()])));
        let mut instrument = open(&format!("address = \"{address}\"\ntrigger = 'M'\nline = \"{line}\"\nunit = \"{unit}\""));
        assert_eq!(mm(&point(&mut instrument).unwrap()), want, "{line}");
    }
}

#[test]
fn a_stream_is_averaged_and_one_that_moves_is_refused() {
    let moves = Arc::new(AtomicBool::new(false));
    let is_moving = Arc::clone(&moves);
    let address = serve(move |mut stream| {
        for k in 0..100_000_u32 {
            let x = f64::from(k % 2) * 0.02 + if is_moving.load(Ordering::SeqCst) { 0.1 * f64::from(k) } else { 0.0 };
            if stream.write_all(format!("{x},2,3\n").as_bytes()).is_err() {
                return;
            }
            std::thread::sleep(Duration::from_millis(5));
        }
    });
    let mut instrument = open(&format!("address = \"{address}\"\naverage_s = 0.3\nscatter_mm = 0.05"));
    let mean = point(&mut instrument).unwrap();
    assert!(mean.count > 5 && mean.scatter.unwrap() < 0.02 * MM && (mean.position.x / MM - 0.01).abs() < 2e-3, "{mean:?}");
    moves.store(true, Ordering::SeqCst);
    let said = point(&mut instrument).unwrap_err().to_string();
    assert!(said.contains("from their mean") && said.contains("scatter_mm"), "{said}");
}

#[test]
fn what_came_before_is_not_the_point() {
    let address = serve(|mut stream| {
        stream.write_all(b"1,1,1\n2,2,2\n").unwrap();
        let mut byte = [0];
        while stream.read_exact(&mut byte).is_ok() {
            stream.write_all(b"3,3,3\n").unwrap();
        }
    });
    let mut instrument = open(&format!("address = \"{address}\"\ntrigger = 'M'"));
    std::thread::sleep(Duration::from_millis(400));
    assert_eq!(mm(&point(&mut instrument).unwrap()), [3.0; 3]);
}

#[test]
fn a_lost_connection_is_made_again_and_silence_is_said() {
    // Every connection answers once.
    let address = serve(|mut stream| {
        if stream.read_exact(&mut [0]).is_ok() {
            stream.write_all(b"1,2,3\n").unwrap();
        }
    });
    let mut instrument = open(&format!("address = \"{address}\"\ntrigger = 'M'\ntimeout_s = 0.5"));
    assert_eq!(mm(&point(&mut instrument).unwrap()), [1.0, 2.0, 3.0]);
    let mut again = Err(ReadoutError { whom: String::new(), problem: String::new(), remedy: String::new() });
    for _ in 0..100 {
        again = point(&mut instrument);
        if again.is_ok() {
            break;
        }
        std::thread::sleep(Duration::from_millis(100));
    }
    assert_eq!(mm(&again.unwrap()), [1.0, 2.0, 3.0]);

    let silent = serve(std::mem::forget);
    let mut instrument = open(&format!("address = \"{silent}\"\ntrigger = 'M'\ntimeout_s = 0.3"));
    let said = point(&mut instrument).unwrap_err().to_string();
    assert!(said.contains("nothing came within"), "{said}");
    // Whoever waits can stop.
    assert_eq!(instrument.point(&mut || false).unwrap(), None);
}

#[test]
fn an_instrument_may_be_the_one_that_connects() {
    let mut instrument = open("listen = \"127.0.0.1:0\"\ntimeout_s = 20");
    assert!(!instrument.is_connected());
    for k in 0..3 {
        let mut stream = TcpStream::connect(instrument.address()).unwrap();
        std::thread::spawn(move || {
            // Until the point is waited for.
            for _ in 0..200 {
                if stream.write_all(format!("{k},2,3\r\n").as_bytes()).is_err() {
                    return;
                }
                std::thread::sleep(Duration::from_millis(20));
                if k < 2 && stream.set_nodelay(true).is_err() {
                    return;
                }
            }
        });
        let mut seen = -1.0;
        for _ in 0..400 {
            seen = point(&mut instrument).unwrap().position.x / MM;
            if (seen - f64::from(k)).abs() < 1e-9 {
                break;
            }
        }
        assert!((seen - f64::from(k)).abs() < 1e-9, "of connection {k}: {seen}");
    }
}

#[test]
fn an_answer_that_is_late_is_no_other_point() {
    // Every fourth answer comes after the wait has ended.
    let address = serve(|mut stream| {
        std::thread::spawn(move || {
            while stream.read_exact(&mut [0]).is_ok() {
                let k = LATE.fetch_add(1, Ordering::SeqCst);
                if k.is_multiple_of(4) {
                    std::thread::sleep(Duration::from_millis(700));
                }
                if stream.write_all(format!("{k},2,3\n").as_bytes()).is_err() {
                    return;
                }
            }
        });
    });
    let mut instrument = open(&format!("address = \"{address}\"\ntrigger = 'M'\ntimeout_s = 0.5"));
    let (mut seen, mut missed) = (Vec::new(), 0);
    for _ in 0..12 {
        let next = LATE.load(Ordering::SeqCst);
        match point(&mut instrument) {
            Ok(point) => {
                let of = point.position.x / MM;
                assert!((of - next as f64).abs() < 1e-6, "the answer to {of} for {next}");
                seen.push(of);
            }
            Err(_) => missed += 1,
        }
    }
    assert_eq!((seen.len(), missed), (9, 3));
}

/// Triggers counted by the server of late answers.
static LATE: std::sync::atomic::AtomicUsize = std::sync::atomic::AtomicUsize::new(0);

#[test]
fn a_part_of_a_line_is_no_line() {
    // Once a line was ended, all are: a pause is none, and neither is a lost connection.
    let address = serve(|mut stream| {
        let mut count = 0;
        while stream.read_exact(&mut [0]).is_ok() {
            count += 1;
            match count {
                1 => stream.write_all(b"1,2,3\n").unwrap(),
                2 => {
                    stream.write_all(b"1,2,3").unwrap();
                    std::thread::sleep(Duration::from_millis(900));
                    stream.write_all(b"45.6\n").unwrap();
                }
                _ => {
                    stream.write_all(b"1,2,3").unwrap();
                    return;
                }
            }
        }
    });
    let mut instrument = open(&format!("address = \"{address}\"\ntrigger = 'M'\ntimeout_s = 2"));
    assert_eq!(mm(&point(&mut instrument).unwrap()), [1.0, 2.0, 3.0]);
    assert_eq!(mm(&point(&mut instrument).unwrap()), [1.0, 2.0, 345.6]);
    assert!(point(&mut instrument).is_err());
}

#[test]
fn a_comma_that_separates_is_in_no_number() {
    for line in ["1,2,3,4\n", "1,000.5,2,3\n", "1,2\n", "1,2,nan\n", "1,2,1e30\n"] {
        let address = answering(Box::leak(Box::new([line])));
        let mut instrument = open(&format!("address = \"{address}\"\ntrigger = 'M'\ntimeout_s = 0.3"));
        let said = point(&mut instrument).unwrap_err().to_string();
        assert!(said.contains("sent '"), "{line}: {said}");
    }
}

#[test]
fn a_line_that_never_ends_is_not_kept() {
    let address = serve(|mut stream| while stream.write_all(&[b'7'; 1000]).is_ok() {});
    let mut instrument = open(&format!("address = \"{address}\"\ntimeout_s = 1"));
    let said = point(&mut instrument).unwrap_err().to_string();
    assert!(said.contains("not connected") || said.contains("nothing came"), "{said}");
}
