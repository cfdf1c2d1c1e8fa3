//! A client of RTDE against a scripted controller behind a socket: whatever keeps the exchange from beginning is named, and what
//! arrives is the newest.

use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::time::{Duration, Instant};

use calibench_wire::ur::{Client, ClientError, DataType, Datum, Package, PackageKind, PackageReader, Recipes};

/// How the scripted controller answers.
#[derive(Clone)]
struct Script {
    speaks_version: u8,
    software: [u32; 4],
    outputs: &'static str,
    inputs: &'static str,
    starts: u8,
    /// Number of packages that it sends once it has started, each with two numbers that follow one another.
    sends: u32,
    /// Bytes that it sends in place of its first answer.
    instead: Option<&'static [u8]>,
}

/// A controller that can be used.
fn sound() -> Script {
    Script {
        speaks_version: 1,
        software: [5, 12, 2, 0],
        outputs: "DOUBLE,DOUBLE",
        inputs: "INT32",
        starts: 1,
        sends: 5_000,
        instead: None,
    }
}

fn serve(script: Script) -> TcpStream {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap();
    std::thread::spawn(move || {
        let (mut stream, _) = listener.accept().unwrap();
        let (mut reader, mut buffer) = (PackageReader::default(), [0; 4096]);
        while let Ok(length @ 1..) = stream.read(&mut buffer) {
            if let Some(bytes) = script.instead {
                drop(stream.write_all(bytes));
                continue;
            }
            reader.push(&buffer[..length]);
            while let Ok(Some(Package { kind, body })) = reader.next_package() {
                let answer = match kind {
                    PackageKind::ProtocolVersion => vec![script.speaks_version],
                    PackageKind::ControllerVersion => script.software.iter().flat_map(|n| n.to_be_bytes()).collect(),
                    PackageKind::Outputs => {
                        let frequency: f64 = if script.software[0] < 5 { 125.0 } else { 500.0 };
                        assert_eq!(body[..8], frequency.to_be_bytes(), "as often as this controller can");
                        [&[1], script.outputs.as_bytes()].concat()
                    }
                    PackageKind::Inputs => [&[7], script.inputs.as_bytes()].concat(),
                    PackageKind::Start => vec![script.starts],
                    _ => continue,
                };
                drop(stream.write_all(&Package { kind, body: answer }.encode()));
                if kind == PackageKind::Start {
                    for number in 0..script.sends {
                        let mut body = vec![1];
                        for value in [f64::from(number), f64::from(number + 1)] {
                            Datum::Reals(vec![value]).encode(DataType::Double, &mut body);
                        }
                        drop(stream.write_all(&Package::message("a message amid the values", "controller", 3).encode()));
                        if stream.write_all(&Package { kind: PackageKind::Data, body }.encode()).is_err() {
                            return;
                        }
                        std::thread::sleep(Duration::from_millis(1));
                    }
                }
            }
        }
    });
    TcpStream::connect(address).unwrap()
}

fn client(script: Script) -> Result<Client, ClientError> {
    let recipes = Recipes { outputs: &["timestamp", "payload"], inputs: &[&["input_int_register_24"]] };
    Client::start(serve(script), &recipes, Duration::from_millis(300))
}

fn said(script: Script) -> String {
    client(script).err().unwrap().to_string()
}

#[test]
fn a_sound_one_is_heard() {
    for software in [[5, 12, 2, 0], [3, 15, 8, 0]] {
        let mut client = client(Script { software, ..sound() }).unwrap();
        assert_eq!(client.software(), software);
        let mut last = 0.0;
        for _ in 0..10 {
            let seen = client.fresh().unwrap();
            let [time, payload] = [seen.real("timestamp"), seen.real("payload")];
            assert!(time > last && payload == time + 1.0, "newer, and of one package: {time} {payload} after {last}");
            last = time;
        }
        assert!(client.messages().iter().all(|words| words == "a message amid the values"));
        assert!(matches!(client.write(0, &[]), Err(ClientError::Recipe)), "as many values as names");
        client.write(0, &[Datum::Integers(vec![1])]).unwrap();
    }
}

#[test]
fn what_is_wrong_is_said() {
    let old = "the controller does not speak version 2 of RTDE; its software is older than 3.2.19171 or 5.0";
    assert_eq!(said(Script { speaks_version: 0, ..sound() }), old);
    let unknown = "the controller has no variable 'payload'; its software 3.9.1 is too old";
    assert_eq!(said(Script { software: [3, 9, 1, 0], outputs: "DOUBLE,NOT_FOUND", ..sound() }), unknown);
    let taken = "another client writes 'input_int_register_24': end that client, or the fieldbus or program that writes it";
    assert_eq!(said(Script { inputs: "IN_USE", ..sound() }), taken);
    assert_eq!(said(Script { outputs: "DOUBLE", ..sound() }), "a package is not what was agreed on");
    assert_eq!(said(Script { starts: 0, ..sound() }), "the controller does not start the exchange");
    assert_eq!(
        said(Script { instead: Some(b"HTTP/1.1 400 Bad Request"), ..sound() }),
        "a package of 18516 bytes is not one of RTDE: is this the port of RTDE, 30004?"
    );
    let silent = said(Script { instead: Some(b""), ..sound() });
    assert!(silent.starts_with("no answer within 0."), "{silent}");
}

#[test]
fn one_that_falls_silent_is_not_waited_for() {
    let mut client = client(Script { sends: 1, ..sound() }).unwrap();
    let began = Instant::now();
    assert!(matches!(client.fresh(), Err(ClientError::Silent { .. })));
    assert!(began.elapsed() < Duration::from_secs(20), "the deadline is 0.3 s");
}
