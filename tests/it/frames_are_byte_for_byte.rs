//! The drivers send and accept exactly the bytes of the instruments' manuals and of the servers' sources.

use calibench::cell::gauge::{
    Dialect, DigimaticError, DigimaticWord, DisplayUnit, GaugeReading, GaugeReply, LONGEST_LINE, LineReader, LineSettings,
    Parity, ReadingFormat, Tolerance,
};
use calibench::cell::kuka::{e6axis, frame_of, joints_of, krl_frame};
use calibench::robot::FramePose;
use calibench::units::{DEG, MM};
use calibench_wire::kuka::{Call, FrameError, FrameReader, LONGEST_FRAME, Request, Response, Value};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

fn bytes(hex: &str) -> Vec<u8> {
    hex.split_whitespace().map(|byte| u8::from_str_radix(byte, 16).expect("two hexadecimal digits")).collect()
}

fn read(tag: u16, name: &str) -> Request {
    Request { tag, call: Call::Read { name: name.into() } }
}

fn write(tag: u16, name: &str, value: &str) -> Request {
    Request { tag, call: Call::Write { name: name.into(), value: value.into() } }
}

fn response(tag: u16, function: u8, value: &str, code: u16, success: bool) -> Response {
    Response { tag, function, value: value.into(), code, success }
}

/// The first two pairs are those of the protocol's own description, the others were exchanged with programs that are not ours.
fn kuka_examples() -> Vec<(Request, &'static str, Response, &'static str)> {
    vec![
        (
            read(0x100, "$ACCU_STATE"),
            "01 00 00 0E 00 00 0B 24 41 43 43 55 5F 53 54 41 54 45",
            response(0x100, 0, "#CHARGE_OK", 1, true),
            "01 00 00 10 00 00 0A 23 43 48 41 52 47 45 5F 4F 4B 00 01 01",
        ),
        (
            write(0x100, "$OV_PRO", "35"),
            "01 00 00 0E 01 00 07 24 4F 56 5F 50 52 4F 00 02 33 35",
            response(0x100, 1, "35", 1, true),
            "01 00 00 08 01 00 02 33 35 00 01 01",
        ),
        (
            read(0x30, "$OV_PRO"),
            "00 30 00 0A 00 00 07 24 4F 56 5F 50 52 4F",
            response(0x30, 0, "100", 1, true),
            "00 30 00 09 00 00 03 31 30 30 00 01 01",
        ),
        (
            read(3, "PING"),
            "00 03 00 07 00 00 04 50 49 4E 47",
            response(3, 0, "PONG", 1, true),
            "00 03 00 0A 00 00 04 50 4F 4E 47 00 01 01",
        ),
        (
            write(1, "COM_ACTION", "2"),
            "00 01 00 10 01 00 0A 43 4F 4D 5F 41 43 54 49 4F 4E 00 01 32",
            response(1, 1, "2", 1, true),
            "00 01 00 07 01 00 01 32 00 01 01",
        ),
        // A variable that there is not: KUKAVARPROXY says success of nothing.
        (read(4, "X"), "00 04 00 04 00 00 01 58", response(4, 0, "", 1, true), "00 04 00 06 00 00 00 00 01 01"),
        (read(4, "X"), "00 04 00 04 00 00 01 58", response(4, 0, "", 0, false), "00 04 00 06 00 00 00 00 00 00"),
    ]
}

#[test]
fn kuka_frames_are_those_of_the_protocol() {
    for (request, request_bytes, response, response_bytes) in kuka_examples() {
        let (request_bytes, response_bytes) = (bytes(request_bytes), bytes(response_bytes));
        assert_eq!(request.encode().unwrap(), request_bytes, "{request:?}");
        assert_eq!(response.encode().unwrap(), response_bytes, "{response:?}");
        let mut reader = FrameReader::default();
        reader.push(&request_bytes);
        assert_eq!(reader.request().unwrap(), Some(request));
        reader.push(&response_bytes);
        assert_eq!(reader.response().unwrap(), Some(response));
        assert!(!reader.is_amid_frame());
    }
}

#[test]
fn kuka_frames_are_found_however_the_network_cuts_them() {
    let examples = kuka_examples();
    let all: Vec<u8> = examples.iter().flat_map(|(_, request, _, _)| bytes(request)).collect();
    for piece in 1..=all.len() {
        let mut reader = FrameReader::default();
        let mut found = Vec::new();
        for part in all.chunks(piece) {
            reader.push(part);
            while let Some(request) = reader.request().unwrap() {
                found.push(request);
            }
        }
        let expected: Vec<Request> = examples.iter().map(|(request, ..)| request.clone()).collect();
        assert_eq!(found, expected, "in pieces of {piece} bytes");
    }
}

#[test]
fn a_kuka_frame_that_contradicts_itself_is_refused_and_the_next_one_is_read() {
    let mut reader = FrameReader::default();
    // The name would be longer than its frame; then a name followed by a byte too many.
    reader.push(&bytes("00 07 00 04 00 00 09 58  00 08 00 05 00 00 01 58 59  00 09 00 00  00 03 00 07 00 00 04 50 49 4E 47"));
    for tag in [7, 8, 9] {
        assert_eq!(reader.request(), Err(FrameError::Malformed { tag }));
    }
    assert_eq!(reader.request(), Ok(Some(read(3, "PING"))));
    // After a length that cannot be there is nothing that shows where a frame begins.
    reader.push(&bytes("00 01 FF FF 00"));
    for _ in 0..2 {
        assert_eq!(reader.request(), Err(FrameError::TooLong { length: 0xffff }));
        reader.push(&[0; 100]);
    }
    let long = write(1, "A", &"x".repeat(LONGEST_FRAME));
    assert!(matches!(long.encode(), Err(FrameError::TooLong { .. })));
}

#[test]
fn a_function_that_is_not_taken_apart_is_handed_on_whole() {
    let c3_multiple_read = bytes("04 00 00 04 06 02 00 04");
    let mut reader = FrameReader::default();
    reader.push(&c3_multiple_read);
    let request = reader.request().unwrap().unwrap();
    assert_eq!(request.call, Call::Other { function: 6, body: vec![2, 0, 4] });
    assert_eq!(request.encode().unwrap(), c3_multiple_read);
}

#[test]
fn krl_values_are_read_as_clients_and_controllers_write_them() {
    let captured =
        "{E6AXIS: A1 0.0, A2 -90.0, A3 90.0, A4 0.0, A5 0.0, A6 0.0, E1 0.0, E2 0.0, E3 0.0, E4 0.0, E5 0.0, E6 0.0}";
    let value = Value::parse(captured).unwrap();
    assert_eq!(value.to_string(), captured);
    assert_eq!(joints_of(value.structure().unwrap()), Some([0.0, -90.0 * DEG, 90.0 * DEG, 0.0, 0.0, 0.0]));
    assert_eq!(e6axis(&[0.0, -90.0 * DEG, 90.0 * DEG, 0.0, 0.0, 0.0]).to_string(), captured);
    for same in ["{A1 0,A2 -90,A3 90.0,A4 0,A5 0,A6 0}", " {E6AXIS:A1 0.0,A2 -9.0E1 ,  A3 +90,A4 0,A5 .0,A6 0.} "] {
        let value = Value::parse(same).unwrap();
        assert_eq!(joints_of(value.structure().unwrap()).unwrap(), [0.0, -90.0 * DEG, 90.0 * DEG, 0.0, 0.0, 0.0], "{same}");
    }
    let older = "{E6POS: X 1991.282, Y 91.03918, Z 1659.515, A 160.2559, B 63.59148, C 161.3706, S 2, T 35, E1 0.0}";
    let value = Value::parse(older).unwrap();
    let position = value.structure().unwrap();
    let frame = frame_of(position).unwrap();
    assert_eq!(frame.xyz[0], 1991.282 * MM);
    assert_eq!(frame.rz_ry_rx[2], 161.3706 * DEG);
    assert_eq!(position.get("t"), Some(&Value::Integer(35)));
    assert_eq!(Value::parse("{FRAME: S 'B010', T 'H1F'}").unwrap().to_string(), "{FRAME: S 2, T 31}");
    for (text, value) in [
        ("TRUE", Value::Bool(true)),
        ("#T1", Value::Enumerator("T1".into())),
        ("\"#KR6R700 C4\"", Value::Text("#KR6R700 C4".into())),
        ("100", Value::Integer(100)),
        ("-0.5", Value::Real(-0.5)),
    ] {
        assert_eq!(Value::parse(text), Ok(value));
    }
    let nested = "{FDAT: TOOL_NO 1, IPO_FRAME #BASE, POINT2[] \" , }\", LOAD {M 2.5, CM {X 1.0, Y 2.0, Z 3.0}}}";
    assert_eq!(Value::parse(nested).unwrap().to_string(), nested);
}

#[test]
fn what_is_no_krl_value_is_refused() {
    for text in [
        "",
        "{",
        "}",
        "{A1}",
        "{A1 }",
        "{A1 0.0",
        "{:}",
        "nan",
        "inf",
        "-inf",
        "1e999",
        "1 2",
        "'B012'",
        "'X1'",
        "#",
        "\"a",
        "{A1 0.0,}",
        "X",
        "{{{{{{A1 0}}}}}}",
        "{A1 {A1 {A1 {A1 {A1 {A1 0}}}}}}",
    ] {
        assert!(Value::parse(text).is_err(), "{text}: {:?}", Value::parse(text));
    }
    assert!(Value::parse(&"1".repeat(5000)).is_err());
}

#[test]
fn part_of_a_structure_changes_that_part() {
    let mut axes = e6axis(&[0.1; 6]);
    let partial = Value::parse("{e1 -2000.0}").unwrap();
    axes.update(partial.structure().unwrap()).unwrap();
    assert_eq!(axes.get("E1"), Some(&Value::Real(-2000.0)));
    assert_eq!(joints_of(&axes).unwrap()[0], (0.1 / DEG) * DEG);
    let unknown = Value::parse("{A1 5.0, Q 1.0}").unwrap();
    let before = axes.clone();
    assert!(axes.update(unknown.structure().unwrap()).is_err());
    assert_eq!(axes, before);
}

#[test]
fn frames_of_krl_turn_about_z_then_y_then_x() {
    let frame = FramePose { xyz: [470.0 * MM, 0.0, 750.0 * MM], rz_ry_rx: [10.0 * DEG, 20.0 * DEG, 30.0 * DEG] };
    assert_eq!(krl_frame(&frame).to_string(), "{FRAME: X 470.0, Y 0.0, Z 750.0, A 10.0, B 20.0, C 30.0}");
}

fn shown(value: f64, decimals: usize) -> GaugeReading {
    GaugeReading { value, decimals, unit: None, tolerance: None }
}

#[test]
fn indicators_are_understood_in_every_dialect() {
    let mm = Some(DisplayUnit::Millimetre);
    for (line, reply) in [
        // Sylvac MEM-PM 292-1806-01's own example; then a 0.1 um instrument.
        ("+001.234", GaugeReply::Reading(shown(1.234, 3))),
        ("+006.3500", GaugeReply::Reading(shown(6.35, 4))),
        ("-000.0031", GaugeReply::Reading(shown(-0.0031, 4))),
        (" 6.350", GaugeReply::Reading(shown(6.35, 3))),
        ("-0012,345678", GaugeReply::Reading(shown(-12.345678, 6))),
        ("+006.350>", GaugeReply::Reading(GaugeReading { tolerance: Some(Tolerance::Above), ..shown(6.35, 3) })),
        ("+006.350=", GaugeReply::Reading(GaugeReading { tolerance: Some(Tolerance::Within), ..shown(6.35, 3) })),
        // Mahr puts the unit after the value, its C1202 the channel before; Mitutoyo's converters put 01A before.
        ("-12.345mm", GaugeReply::Reading(GaugeReading { unit: mm, ..shown(-12.345, 3) })),
        ("0.24998 in", GaugeReply::Reading(GaugeReading { unit: Some(DisplayUnit::Inch), ..shown(0.24998, 5) })),
        ("1_+123.45_um;", GaugeReply::Reading(GaugeReading { unit: Some(DisplayUnit::Micrometre), ..shown(123.45, 2) })),
        ("01A+0000.123", GaugeReply::Reading(shown(0.123, 3))),
        ("ERR0", GaugeReply::Fault(0)),
        ("err3", GaugeReply::Fault(3)),
        ("SY289", GaugeReply::Words("SY289".into())),
        ("PRE +6.350", GaugeReply::Words("PRE +6.350".into())),
        ("6350", GaugeReply::Words("6350".into())),
        ("+00006.350", GaugeReply::Words("+00006.350".into())),
        ("+006.350.1", GaugeReply::Words("+006.350.1".into())),
        ("++6.350", GaugeReply::Words("++6.350".into())),
        ("+006.35O", GaugeReply::Words("+006.35O".into())),
    ] {
        assert_eq!(GaugeReply::parse(line.as_bytes()), reply, "{line}");
    }
    // The same digits with their parity bit left on, as a port set to 8 data bits would hand them over.
    assert_eq!(GaugeReply::parse(&[0x2b, 0x30, 0x30, 0x36, 0x2e, 0x33, 0x35, 0xb1]), GaugeReply::Noise);
}

#[test]
fn a_value_is_written_as_sylvac_writes_it() {
    let nano = ReadingFormat::SYLVAC;
    assert_eq!(nano.encode(6.35), bytes("2b 30 30 36 2e 33 35 30 30 0d"));
    assert_eq!(nano.encode(-0.0031), bytes("2d 30 30 30 2e 30 30 33 31 0d"));
    assert_eq!(nano.encode(-0.00001), b"+000.0000\r");
    assert_eq!(ReadingFormat { decimals: 3, comma: true, end: "\r\n", ..nano }.encode(-6.15), b"-006,150\r\n");
    assert_eq!(ReadingFormat { whole: 4, decimals: 3, before: "01A", ..nano }.encode(0.123), b"01A+0000.123\r");
    let mut lines = LineReader::default();
    lines.push(&nano.encode(-6.1234));
    assert_eq!(GaugeReply::parse(&lines.line().unwrap()), GaugeReply::Reading(shown(-6.1234, 4)));
}

#[test]
fn a_digimatic_word_is_bit_for_bit_mitutoyo_s() {
    let word = DigimaticWord([0xf, 0xf, 0xf, 0xf, 8, 0, 1, 2, 3, 4, 5, 3, 0]);
    let sent = "1111 1111 1111 1111 0001 0000 1000 0100 1100 0010 1010 1100 0000".replace(' ', "");
    let bits = u64::from_str_radix(&sent, 2).unwrap();
    assert_eq!(word.bits(), bits);
    assert_eq!(DigimaticWord::from_bits(bits), word);
    assert_eq!(DigimaticWord::encode(-12.345, 3, DisplayUnit::Millimetre), Some(word));
    let reading = GaugeReading { unit: Some(DisplayUnit::Millimetre), ..shown(-12.345, 3) };
    assert_eq!(word.decode(), Ok(reading));
    assert_eq!(DigimaticWord::encode(100.0, 4, DisplayUnit::Millimetre), None);
    let mut not_a_word = word;
    not_a_word.0[7] = 0xa;
    assert_eq!(not_a_word.decode(), Err(DigimaticError::Digit { place: 8, digit: 0xa }));
}

#[test]
fn line_settings_are_written_as_on_the_instruments() {
    assert_eq!(LineSettings::parse("4800 7E2"), Some(LineSettings::OPTO_RS));
    assert_eq!(LineSettings::parse("9600 8n1"), Some(LineSettings::VIRTUAL));
    assert_eq!(LineSettings::parse("115200 8O1").map(|line| line.parity), Some(Parity::Odd));
    for text in ["4800", "4800 9E2", "4800 7X2", "0 8N1", "4800 7E22", ""] {
        assert_eq!(LineSettings::parse(text), None, "{text}");
    }
    assert_eq!(Dialect::named("sylvac"), Some(Dialect::SYLVAC));
}

/// Inputs of each kind that are thrown at the parsers; a second or two.
const MANGLED: usize = 100_000;

#[test]
fn whatever_comes_over_a_wire_is_survived() {
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    let mut seeds: Vec<Vec<u8>> = kuka_examples().iter().flat_map(|(_, a, _, b)| [bytes(a), bytes(b)]).collect();
    let texts = [
        "{E6POS: X 284.994965, Y -694.39, S 'B010', T 10}",
        "{FDAT: P[] \" , }\", CM {X 1.0}}",
        "01A+0000.123",
        "-1,5<mm",
        "ERR3\r",
    ];
    seeds.extend(texts.map(|text| text.as_bytes().to_vec()));
    let (mut requests, mut responses, mut lines) = (FrameReader::default(), FrameReader::default(), LineReader::default());
    let mut understood = 0;
    for k in 0..MANGLED {
        // A wrong length swallows what follows; a new connection begins with a frame.
        if k % 4 == 0 {
            (requests, responses) = (FrameReader::default(), FrameReader::default());
        }
        let mut input = seeds[rng.random_range(0..seeds.len())].clone();
        for _ in 0..rng.random_range(0..4) {
            let at = rng.random_range(0..input.len());
            match rng.random_range(0..4) {
                0 => input[at] = rng.random(),
                1 => input.insert(at, rng.random()),
                2 => input.truncate(at + 1),
                _ => input.extend_from_within(at..),
            }
        }
        requests.push(&input);
        responses.push(&input);
        lines.push(&input);
        // A reader takes a frame or an error at a time, and is done when it has neither or is lost.
        while let Some(taken) = requests.request().transpose() {
            match taken {
                Ok(request) => {
                    understood += 1;
                    assert!(request.encode().is_ok());
                }
                Err(FrameError::TooLong { .. }) => break,
                Err(FrameError::Malformed { .. }) => {}
                Err(error) => panic!("{error}"),
            }
        }
        while let Some(taken) = responses.response().transpose() {
            match taken {
                Ok(response) => assert!(response.encode().is_ok()),
                Err(FrameError::TooLong { .. }) => break,
                Err(FrameError::Malformed { .. }) => {}
                Err(error) => panic!("{error}"),
            }
        }
        while let Some(line) = lines.line() {
            assert!(line.len() <= LONGEST_LINE);
            let _ = GaugeReply::parse(&line);
        }
        let text = String::from_utf8_lossy(&input);
        if let Ok(value) = Value::parse(&text) {
            let shown = value.to_string();
            let again = Value::parse(&shown).unwrap_or_else(|e| panic!("{text} is shown as {shown}: {e}"));
            assert_eq!(again.to_string(), shown, "{text}");
        }
        let word = DigimaticWord::from_bits(rng.random());
        assert_eq!(DigimaticWord::from_bits(word.bits()), word);
        if let Ok(reading) = word.decode() {
            assert!(reading.value.abs() < 1e6);
        }
    }
    assert!(understood > MANGLED / 10, "the seeds are still recognised: {understood}");
}
