//! Bytes that the manufacturer publishes: what the client sends is what is recorded there, and what is recorded there is read.
//!
//! Source: the tests of UniversalRobots/Universal_Robots_Client_Library (`test_rtde_*.cpp`, `test_primary_parser.cpp`), whose
//! answers were recorded at controllers with the software 5.8.

use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::thread::JoinHandle;
use std::time::Duration;

use calibench_wire::ur::{
    CartesianInfo, Client, ClientError, DataType, Datum, PackageReader, Recipes, StateMessageReader, input_type, output_type,
};

/// Accepted: the version of the protocol, a start and a pause.
const VERSION_ACCEPTED: &str = "00045601";
const STARTED: &str = "00045301";
const PAUSED: &str = "00045001";
/// Software 5.8.0.0.
const SOFTWARE: &str = "0013760000000500000008 0000000000000000";
/// A question for `actual_q` and `actual_qd` 500 times a second.
const OUTPUTS: &str = "001d4f 407f400000000000 61637475616c5f71 2c 61637475616c5f7164";
/// Its answers in general: recipe 1 of DOUBLE,VECTOR6D; a first variable that is not known. The size of the first is 17 in the
/// source, which two bytes of its text exceed.
const OUTPUTS_KNOWN: &str = "00134f 01 444f55424c45 2c 564543544f523644";
const OUTPUTS_NOT_FOUND: &str = "00164f 00 4e4f545f464f554e44 2c 564543544f523644";
/// A question for `speed_slider_mask` and `speed_slider_fraction`.
const INPUTS: &str = "002a49 73706565645f736c696465725f6d61736b 2c 73706565645f736c696465725f6672616374696f6e";
/// Its answers: recipe 1 of UINT32,DOUBLE; both written by another client.
const INPUTS_GIVEN: &str = "001149 01 55494e543332 2c 444f55424c45";
const INPUTS_IN_USE: &str = "001149 00 494e5f555345 2c 494e5f555345";
/// Values of `timestamp` and `actual_q`.
const TIME_AND_JOINTS: &str = "003c55 01 40d0758c49ba5e35 bff99c77d110b460 bffba233d110b460 c0019fbe68885a30 \
                               bfe9db22a22168c0 3ff98587a0000000 bf9fbe74442d1800";
/// Values that a client sends: `speed_slider_mask` 1, alone.
const MASK: &str = "000855 01 00000001";

fn bytes(text: &str) -> Vec<u8> {
    let digits: Vec<u8> = text.bytes().filter(|digit| !digit.is_ascii_whitespace()).collect();
    let pairs = digits.as_chunks::<2>().0.iter();
    pairs.map(|pair| u8::from_str_radix(std::str::from_utf8(pair).unwrap(), 16).unwrap()).collect()
}

/// A controller that says these recorded answers, one to each package; returns what it heard.
fn controller(answers: Vec<Vec<u8>>) -> (TcpStream, JoinHandle<Vec<Vec<u8>>>) {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap();
    let heard = std::thread::spawn(move || {
        let (mut stream, _) = listener.accept().unwrap();
        let mut heard = Vec::new();
        for answer in answers {
            let mut size = [0; 2];
            if stream.read_exact(&mut size).is_err() {
                break;
            }
            let mut package = vec![0; usize::from(u16::from_be_bytes(size)) - size.len()];
            stream.read_exact(&mut package).unwrap();
            heard.push([&size[..], &package].concat());
            stream.write_all(&answer).unwrap();
        }
        heard
    });
    (TcpStream::connect(address).unwrap(), heard)
}

fn session(recipes: &Recipes<'_>, outputs: &str, inputs: &str) -> (Result<Client, ClientError>, Vec<Vec<u8>>) {
    let mut answers = vec![bytes(VERSION_ACCEPTED), bytes(SOFTWARE), bytes(outputs)];
    answers.extend(recipes.inputs.iter().map(|_| bytes(inputs)));
    answers.push(bytes(STARTED));
    let (stream, heard) = controller(answers);
    let client = Client::start(stream, recipes, Duration::from_secs(20));
    (client, heard.join().unwrap())
}

#[test]
fn questions_are_those_of_the_manufacturers_client() {
    let recipes = Recipes { outputs: &["actual_q", "actual_qd"], inputs: &[&["speed_slider_mask", "speed_slider_fraction"]] };
    let (client, heard) = session(&recipes, OUTPUTS_KNOWN, INPUTS_GIVEN);
    assert_eq!(client.unwrap().software(), [5, 8, 0, 0]);
    let version = bytes("0005560002");
    assert_eq!(heard, [version, bytes("000376"), bytes(OUTPUTS), bytes(INPUTS), bytes("000353")]);
}

#[test]
fn answers_are_read_as_the_manufacturers_client_reads_them() {
    let mut reader = PackageReader::default();
    reader.push(&bytes(TIME_AND_JOINTS));
    let package = reader.next_package().unwrap().unwrap();
    let mut values = &package.body[1..];
    let [time, joints] = ["timestamp", "actual_q"].map(|name| Datum::decode(output_type(name).unwrap(), &mut values).unwrap());
    assert!(values.is_empty());
    assert!((time.real() - 16854.1919).abs() < 1e-4, "{time:?}");
    for (is, published) in joints.six().into_iter().zip([-1.6007, -1.7271, -2.203, -0.808, 1.5951, -0.031]) {
        assert!((is - published).abs() < 1e-6, "{is} {published}");
    }
}

#[test]
fn refusals_name_the_variable() {
    let recipes = Recipes { outputs: &["payload_cog", "actual_q"], inputs: &[&["speed_slider_mask", "speed_slider_fraction"]] };
    let (client, _) = session(&recipes, OUTPUTS_NOT_FOUND, INPUTS_GIVEN);
    assert!(matches!(client, Err(ClientError::Unknown { name, .. }) if name == "payload_cog"));
    let (client, _) = session(&recipes, OUTPUTS_KNOWN, INPUTS_IN_USE);
    assert!(matches!(client, Err(ClientError::InUse { name }) if name == "speed_slider_mask"));
}

#[test]
fn packages_are_encoded_as_they_were() {
    let all = [
        VERSION_ACCEPTED,
        STARTED,
        PAUSED,
        SOFTWARE,
        OUTPUTS,
        OUTPUTS_KNOWN,
        OUTPUTS_NOT_FOUND,
        INPUTS,
        INPUTS_GIVEN,
        INPUTS_IN_USE,
    ];
    for text in all.into_iter().chain([TIME_AND_JOINTS, MASK]) {
        let mut reader = PackageReader::default();
        reader.push(&bytes(text));
        let package = reader.next_package().unwrap().unwrap();
        assert_eq!(package.encode(), bytes(text));
        assert_eq!(reader.next_package(), Ok(None), "nothing is left of it");
    }
    let mut mask = vec![1];
    Datum::Integers(vec![1]).encode(input_type("speed_slider_mask").unwrap(), &mut mask);
    assert_eq!(mask, bytes(MASK)[3..]);
    let mut numbers = Vec::new();
    for (value, kind) in
        [(1, DataType::Bool), (0xa5, DataType::Uint8), (0x1234_5678, DataType::Uint32), (-123_456_789, DataType::Int32)]
    {
        Datum::Integers(vec![value]).encode(kind, &mut numbers);
    }
    assert_eq!(numbers, bytes("01 a5 12345678 f8a432eb"));
}

/// The message holds the joints, the tool and the arm's parameters: the tool must be where these parameters put it.
#[test]
fn the_tool_of_the_manufacturers_simulator_is_read() {
    let text: String = include_str!("../data/ursim_5_8_state.hex").lines().filter(|line| !line.starts_with('#')).collect();
    let message = bytes(&text);
    let tool = StateMessageReader::default().push(&message).unwrap();
    let published = CartesianInfo {
        base_from_tool: [
            -0.143_968_656_7,
            -0.435_620_060_8,
            0.202_030_025_4,
            -0.001_221_359_7,
            3.116_276_528_5,
            0.038_891_915_6,
        ],
        flange_from_tool: [0.0; 6],
    };
    for (is, published) in tool.base_from_tool.into_iter().zip(published.base_from_tool) {
        assert!((is - published).abs() < 1e-9, "{is} {published}");
    }
    assert_eq!(tool.flange_from_tool, published.flange_from_tool);
    // In pieces as a network delivers them, and after bytes of another message.
    let mut reader = StateMessageReader::default();
    let pieces = message.chunks(97).map(<[u8]>::to_vec);
    let seen: Vec<CartesianInfo> = pieces.filter_map(|piece| reader.push(&piece)).collect();
    assert_eq!(seen, [tool]);
}
