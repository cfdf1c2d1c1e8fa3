//! The driver of KUKA robots, against a scripted controller behind a socket: motions are done once and to the end, and whatever keeps
//! them from it is named, whether the connection, the controller, its program or a person is the reason.

use std::collections::HashMap;
use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use calibench::cell::kuka::{
    Actions, KukaRobot, KukaSettings, LinkError, RobotProgram, Variables, e6axis, frame_of, krl_frame,
};
use calibench::cell::patience::Patience;
use calibench::cell::{Driver, Manipulator, ManipulatorError, StopRequest};
use calibench::robot::FramePose;
use calibench::units::{DEG, MM};
use calibench_wire::kuka::{Call, FrameReader, PROGRAM_NAME, Response, Structure, Value, Verdict, program_files};
use nalgebra::Vector3;

const HOME: [f64; 6] = [0.0, -90.0 * DEG, 90.0 * DEG, 0.0, 0.0, 0.0];

/// Fault of the connection when the driver sends a request.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Accident {
    None,
    /// The order to move is done, but its answer is lost with the connection.
    AnswerLost,
    /// The order is lost with the connection, before it is done.
    OrderLost,
    /// While the arm moves the connection breaks.
    BreaksOnTheWay,
    /// While the arm moves the connection stays open and nothing is answered on it any more.
    HalfOpenOnTheWay,
    /// Each answer is preceded by one to somebody else's request.
    OthersAnswers,
    /// Answers come a byte at a time.
    Dribbles,
    /// The first request ends the server for good.
    Dies,
}

/// Behaviour of the controller.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Temper {
    Obedient,
    /// Gives this result and does not move.
    Refuses(i64),
    /// The emergency stop is pressed on the way.
    EmergencyStop,
    /// The program stops on the way.
    ProgramStops,
    /// Someone turns the key on the way.
    TurnsToT2,
    /// The motion never ends.
    NeverEnds,
}

struct Controller {
    variables: HashMap<String, String>,
    temper: Temper,
    numbered: bool,
    ends: Option<Instant>,
    takes: Duration,
    /// Motions begun.
    motions: usize,
}

impl Controller {
    fn new(temper: Temper, program: RobotProgram) -> Self {
        let zero = FramePose::default();
        let position = FramePose { xyz: [470.0 * MM, 0.0, 750.0 * MM], rz_ry_rx: [0.0, 80.0 * DEG, 0.0] };
        let mut position = krl_frame(&position);
        position.kind = Some("E6POS".into());
        let mut variables: HashMap<String, String> = [
            ("$AXIS_ACT", e6axis(&HOME).to_string()),
            ("$AXIS_ACT_MEAS", e6axis(&HOME).to_string()),
            ("$POS_ACT", position.to_string()),
            ("$TOOL", krl_frame(&zero).to_string()),
            ("$BASE", krl_frame(&zero).to_string()),
            ("$OV_PRO", "10".into()),
            ("$MODE_OP", "#AUT".into()),
            ("$PRO_STATE1", "#P_ACTIVE".into()),
            ("$ALARM_STOP", "TRUE".into()),
            ("COM_ACTION", "0".into()),
            ("COM_E6AXIS", e6axis(&HOME).to_string()),
            ("COM_E6POS", position.to_string()),
            ("COM_FRAME", krl_frame(&zero).to_string()),
        ]
        .map(|(name, value)| (name.to_owned(), value))
        .into();
        let numbered = program == RobotProgram::Calibench;
        if numbered {
            for (name, value) in [("COM_ORDER", "41"), ("COM_DONE", "41"), ("COM_RESULT", "0"), ("COM_CANCEL", "FALSE")] {
                variables.insert(name.into(), value.into());
            }
        }
        Controller { variables, temper, numbered, ends: None, takes: Duration::from_millis(60), motions: 0 }
    }

    fn put(&mut self, name: &str, value: &str) {
        self.variables.insert(name.into(), value.into());
    }

    fn get(&self, name: &str) -> String {
        self.variables.get(name).cloned().unwrap_or_default()
    }

    fn structure(&self, name: &str) -> Structure {
        Value::parse(&self.get(name)).unwrap().structure().unwrap().clone()
    }

    /// Time passes.
    fn live(&mut self) {
        if self.get("COM_ACTION") == "0" {
            return;
        }
        let cancelled = self.numbered && self.get("COM_CANCEL") == "TRUE";
        let Some(ends) = self.ends else {
            if self.numbered && self.get("COM_ORDER") == self.get("COM_DONE") {
                self.put("COM_ACTION", "0");
                return;
            }
            self.motions += 1;
            self.ends = Some(Instant::now() + self.takes);
            return;
        };
        match self.temper {
            Temper::EmergencyStop => self.put("$ALARM_STOP", "FALSE"),
            Temper::ProgramStops => self.put("$PRO_STATE1", "#P_STOP"),
            Temper::TurnsToT2 => self.put("$MODE_OP", "#T2"),
            Temper::NeverEnds if !cancelled => {}
            _ if Instant::now() < ends && !cancelled => {}
            temper => {
                let result = match temper {
                    _ if cancelled => 3,
                    Temper::Refuses(result) => result,
                    _ => {
                        self.do_it();
                        0
                    }
                };
                self.put("COM_RESULT", &result.to_string());
                let order = self.get("COM_ORDER");
                self.put("COM_DONE", &order);
                self.put("COM_CANCEL", "FALSE");
                self.put("COM_ACTION", "0");
                self.ends = None;
            }
        }
    }

    fn do_it(&mut self) {
        let (from, to) = match self.get("COM_ACTION").as_str() {
            "2" => ("COM_E6AXIS", "$AXIS_ACT"),
            "3" => ("COM_E6POS", "$POS_ACT"),
            "5" => ("COM_FRAME", "$TOOL"),
            "14" => ("COM_FRAME", "$BASE"),
            other => panic!("no action {other}"),
        };
        let value = self.get(from);
        self.put(to, &value);
        // Its servos leave nothing.
        let joints = self.get("$AXIS_ACT");
        self.put("$AXIS_ACT_MEAS", &joints);
    }

    /// KUKAVARPROXY's answers; of structures, only the members that are sent change.
    fn answer(&mut self, call: &Call) -> (u8, String) {
        match call {
            Call::Read { name } => (0, self.get(name)),
            Call::Write { name, value } => {
                let new = Value::parse(value).expect("the driver writes values of KRL");
                let shown = match (&new, self.variables.get(name).map(|old| Value::parse(old))) {
                    (Value::Structure(partial), Some(Ok(Value::Structure(mut whole)))) => {
                        whole.update(partial).unwrap();
                        whole.to_string()
                    }
                    _ => new.to_string(),
                };
                self.put(name, &shown);
                (1, value.clone())
            }
            Call::Other { .. } => panic!("the driver only reads and writes"),
        }
    }
}

/// Serves a controller; connections are taken one after the other, as often as they come.
fn serve(temper: Temper, accident: Accident, program: RobotProgram) -> (String, Arc<Mutex<Controller>>) {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap().to_string();
    let controller = Arc::new(Mutex::new(Controller::new(temper, program)));
    let shared = Arc::clone(&controller);
    std::thread::spawn(move || {
        let mut accident = accident;
        let mut kept_open = Vec::new();
        loop {
            let (stream, _) = listener.accept().unwrap();
            match converse(stream, &shared, &mut accident) {
                End::Closed => {}
                End::LeftOpen(stream) => kept_open.push(stream),
                End::Dead => return,
            }
        }
    });
    (address, controller)
}

enum End {
    Closed,
    LeftOpen(TcpStream),
    Dead,
}

fn converse(mut stream: TcpStream, controller: &Mutex<Controller>, accident: &mut Accident) -> End {
    stream.set_nodelay(true).unwrap();
    let mut frames = FrameReader::default();
    let mut bytes = [0; 512];
    loop {
        let Ok(count @ 1..) = stream.read(&mut bytes) else { return End::Closed };
        frames.push(&bytes[..count]);
        while let Some(request) = frames.request().unwrap() {
            if *accident == Accident::Dies {
                return End::Dead;
            }
            let mut controller = controller.lock().unwrap();
            let is_order = matches!(&request.call, Call::Write { name, .. } if name == "COM_ACTION");
            if is_order && *accident == Accident::OrderLost {
                *accident = Accident::None;
                return End::Closed;
            }
            controller.live();
            let (function, value) = controller.answer(&request.call);
            controller.live();
            let moves = controller.ends.is_some();
            match *accident {
                Accident::AnswerLost if is_order => {
                    *accident = Accident::None;
                    return End::Closed;
                }
                Accident::BreaksOnTheWay if moves && !is_order => {
                    *accident = Accident::None;
                    return End::Closed;
                }
                Accident::HalfOpenOnTheWay if moves && !is_order => {
                    *accident = Accident::None;
                    return End::LeftOpen(stream);
                }
                _ => {}
            }
            let response = Response { tag: request.tag, function, value, code: 1, success: true };
            let bytes = response.encode().unwrap();
            if *accident == Accident::OthersAnswers {
                let other = Response { tag: request.tag.wrapping_sub(9), value: "42".into(), ..response };
                stream.write_all(&other.encode().unwrap()).unwrap();
            }
            if *accident == Accident::Dribbles {
                for byte in &bytes {
                    stream.write_all(&[*byte]).unwrap();
                }
            } else if stream.write_all(&bytes).is_err() {
                return End::Closed;
            }
        }
    }
}

/// What ends at all has ended by then, however busy the machine is.
const SOON: Duration = Duration::from_secs(60);

fn settings(address: &str, program: RobotProgram) -> KukaSettings {
    let milliseconds = Duration::from_millis;
    let patience = Patience {
        connect: milliseconds(500),
        answer: milliseconds(300),
        motion: milliseconds(2000),
        poll: milliseconds(2),
        settle: milliseconds(0),
        reconnects: 2,
    };
    KukaSettings { address: address.into(), joints: 6, program, patience, ..KukaSettings::default() }
}

fn robot(temper: Temper, accident: Accident, program: RobotProgram) -> (KukaRobot, Arc<Mutex<Controller>>, StopRequest) {
    let (address, controller) = serve(temper, accident, program);
    let stop = StopRequest::default();
    (KukaRobot::connect(settings(&address, program), stop.clone()).unwrap(), controller, stop)
}

const BOTH: [RobotProgram; 2] = [RobotProgram::Calibench, RobotProgram::Plain];

fn target() -> Vec<f64> {
    vec![10.0 * DEG, -80.0 * DEG, 80.0 * DEG, 5.0 * DEG, 10.0 * DEG, -20.0 * DEG]
}

fn is_at(robot: &mut KukaRobot, target: &[f64]) -> bool {
    // A float32 of degrees.
    robot.joints().unwrap().iter().zip(target).all(|(q, target)| (q - target).abs() < 2e-7)
}

#[test]
fn joints_tools_bases_and_speed_are_set() {
    for program in BOTH {
        let (mut robot, controller, _) = robot(Temper::Obedient, Accident::None, program);
        assert_eq!(robot.joints().unwrap().len(), 6);
        let tool = FramePose { xyz: [60.0 * MM, 0.0, 125.0 * MM], rz_ry_rx: [0.3, -0.2, 0.1] };
        robot.set_tool(&tool).unwrap();
        robot.set_base(&FramePose { xyz: [0.5, 0.0, 0.0], rz_ry_rx: [0.0; 3] }).unwrap();
        assert!((robot.tool_and_base().unwrap().0.xyz[2] - 0.125).abs() < 1e-8);
        robot.set_speed(25).unwrap();
        assert_eq!(robot.kuka_state().unwrap().speed, 25.0);
        robot.move_joints(&target()).unwrap();
        assert!(is_at(&mut robot, &target()));
        assert_eq!(controller.lock().unwrap().motions, 3);
        assert!(robot.traffic().sent > 0 && robot.traffic().received > 0);
    }
}

#[test]
fn the_tool_moves_along_its_own_axes() {
    for program in BOTH {
        let (mut robot, controller, _) = robot(Temper::Obedient, Accident::None, program);
        let before = robot.position().unwrap().pose();
        let steps =
            [Vector3::new(1.0, -2.0, 3.0) * MM, Vector3::new(0.01, 0.0, -0.02) * MM, Vector3::new(0.0, 0.003, 0.0) * MM];
        for step in &steps {
            robot.move_in_tool(step).unwrap();
        }
        let after = robot.position().unwrap().pose();
        let travelled = before.inv_mul(&after);
        // Micrometres at 0.8 m in float32 millimetres: 0.06 um each.
        assert!((travelled.translation.vector - steps.iter().sum::<Vector3<f64>>()).norm() < 0.3e-6, "{travelled}");
        assert!(travelled.rotation.angle() < 1e-6);
        // Partial structures leave the rest of the target alone.
        assert_eq!(controller.lock().unwrap().structure("COM_E6POS").kind.as_deref(), Some("E6POS"));
        assert!(frame_of(&controller.lock().unwrap().structure("COM_E6POS")).is_some());
    }
}

#[test]
fn a_motion_is_done_once_however_the_connection_fares() {
    for accident in [
        Accident::AnswerLost,
        Accident::BreaksOnTheWay,
        Accident::HalfOpenOnTheWay,
        Accident::OthersAnswers,
        Accident::Dribbles,
        Accident::OrderLost,
    ] {
        let (mut robot, controller, _) = robot(Temper::Obedient, accident, RobotProgram::Calibench);
        robot.move_joints(&target()).unwrap_or_else(|e| panic!("{accident:?}: {e}"));
        assert!(is_at(&mut robot, &target()), "{accident:?}");
        robot.move_in_tool(&Vector3::new(1.0 * MM, 0.0, 0.0)).unwrap();
        assert_eq!(controller.lock().unwrap().motions, 2, "{accident:?}");
    }
}

#[test]
fn without_numbers_what_is_not_known_is_not_repeated() {
    for accident in [Accident::AnswerLost, Accident::BreaksOnTheWay, Accident::HalfOpenOnTheWay, Accident::Dribbles] {
        let (mut robot, controller, _) = robot(Temper::Obedient, accident, RobotProgram::Plain);
        robot.move_joints(&target()).unwrap_or_else(|e| panic!("{accident:?}: {e}"));
        assert!(is_at(&mut robot, &target()));
        assert_eq!(controller.lock().unwrap().motions, 1, "{accident:?}");
    }
    let (mut robot, controller, _) = robot(Temper::Obedient, Accident::OrderLost, RobotProgram::Plain);
    assert!(matches!(robot.move_joints(&target()), Err(ManipulatorError::Lost { detail }) if detail.contains("not known")));
    assert_eq!(controller.lock().unwrap().motions, 0);
}

#[test]
fn a_server_that_dies_is_lost_and_soon() {
    let (address, _) = serve(Temper::Obedient, Accident::Dies, RobotProgram::Plain);
    let began = Instant::now();
    let Err(error) = KukaRobot::connect(settings(&address, RobotProgram::Plain), StopRequest::default()) else {
        panic!("there is no robot")
    };
    assert!(error.is_of_connection(), "{error}");
    assert!(began.elapsed() < SOON);
}

#[test]
fn refusals_are_what_the_program_says() {
    type Is = fn(&ManipulatorError) -> bool;
    let cases: [(i64, Is); 5] = [
        (1, |e| matches!(e, ManipulatorError::Refused { .. })),
        (2, |e| matches!(e, ManipulatorError::Unreachable)),
        (3, |e| matches!(e, ManipulatorError::Stopped { .. })),
        (15, |e| matches!(e, ManipulatorError::JointLimit { joint: 5 })),
        (99, |e| matches!(e, ManipulatorError::Refused { reason } if reason.contains("99"))),
    ];
    for (result, is) in cases {
        let (mut robot, ..) = robot(Temper::Refuses(result), Accident::None, RobotProgram::Calibench);
        let error = robot.move_joints(&target()).unwrap_err();
        assert!(is(&error), "{result}: {error}");
    }
}

#[test]
fn a_robot_that_is_stopped_on_the_way_says_why() {
    for program in BOTH {
        for (temper, word) in
            [(Temper::EmergencyStop, "emergency"), (Temper::ProgramStops, "P_STOP"), (Temper::TurnsToT2, "T2")]
        {
            let (mut robot, ..) = robot(temper, Accident::None, program);
            let error = robot.move_joints(&target()).unwrap_err();
            assert!(matches!(&error, ManipulatorError::Stopped { reason } if reason.contains(word)), "{temper:?}: {error}");
            // Nor does it begin another.
            assert!(matches!(robot.move_joints(&target()), Err(ManipulatorError::Stopped { .. })));
        }
    }
}

#[test]
fn a_robot_that_is_unfit_is_not_moved() {
    for (variable, value, word) in [
        ("$ALARM_STOP", "FALSE", "emergency"),
        ("$MODE_OP", "#T2", "T2"),
        ("$PRO_STATE1", "#P_RESET", "P_RESET"),
        ("$OV_PRO", "0", "override"),
        ("COM_ACTION", "7", "busy"),
    ] {
        let (mut robot, controller, _) = robot(Temper::NeverEnds, Accident::None, RobotProgram::Plain);
        controller.lock().unwrap().put(variable, value);
        let error = robot.move_joints(&target()).unwrap_err().to_string();
        assert!(error.contains(word), "{variable}: {error}");
        let controller = controller.lock().unwrap();
        assert_eq!(controller.structure("COM_E6AXIS"), e6axis(&HOME), "{variable}: nothing was even prepared");
    }
}

#[test]
fn an_override_is_not_raised_over_a_motion_that_waits() {
    let (mut robot, controller, _) = robot(Temper::NeverEnds, Accident::None, RobotProgram::Plain);
    controller.lock().unwrap().put("COM_ACTION", "2");
    assert!(matches!(robot.set_speed(50), Err(ManipulatorError::Refused { .. })));
    assert_eq!(controller.lock().unwrap().get("$OV_PRO"), "10");
}

#[test]
fn a_stop_breaks_the_motion_off() {
    for program in BOTH {
        let (mut robot, controller, stop) = robot(Temper::NeverEnds, Accident::None, program);
        let pressed = std::thread::spawn(move || {
            std::thread::sleep(Duration::from_millis(100));
            stop.make();
        });
        let error = robot.move_joints(&target()).unwrap_err();
        pressed.join().unwrap();
        assert!(matches!(&error, ManipulatorError::Stopped { reason } if reason.contains("operator")), "{error}");
        let controller = controller.lock().unwrap();
        if program == RobotProgram::Calibench {
            assert_eq!((controller.get("COM_ACTION"), controller.get("COM_RESULT")), ("0".into(), "3".into()));
        } else {
            assert_eq!(controller.get("$OV_PRO"), "0");
        }
    }
}

/// A session that was called off just as its motion ended leaves the request standing.
#[test]
fn a_request_to_break_off_that_came_too_late_breaks_off_nothing_else() {
    let (mut robot, controller, _) = robot(Temper::Obedient, Accident::None, RobotProgram::Calibench);
    controller.lock().unwrap().put("COM_CANCEL", "TRUE");
    robot.set_speed(50).unwrap();
    robot.move_joints(&target()).unwrap();
    assert!(is_at(&mut robot, &target()));
}

#[test]
fn a_motion_without_end_is_broken_off() {
    let (mut robot, ..) = robot(Temper::NeverEnds, Accident::None, RobotProgram::Plain);
    let began = Instant::now();
    assert!(matches!(robot.move_joints(&target()), Err(ManipulatorError::Stopped { .. })));
    assert!(began.elapsed() < SOON);
}

#[test]
fn a_slow_robot_is_waited_for() {
    let (mut robot, controller, _) = robot(Temper::Obedient, Accident::None, RobotProgram::Calibench);
    controller.lock().unwrap().takes = Duration::from_millis(1200);
    robot.move_joints(&target()).unwrap();
    assert!(is_at(&mut robot, &target()));
}

/// The driver, the program that is handed out, and the guide speak of the same variables and numbers.
#[test]
fn the_program_handed_out_is_the_one_the_driver_speaks_to() {
    let files = program_files();
    let (source, globals) = (&files[0].1, &files[2].1);
    let guide = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/docs/cell.md")).unwrap();
    let variables = Variables::default();
    for (key, name) in variables.needed(RobotProgram::Calibench).filter(|(_, name)| name.starts_with("COM_")) {
        for (what, text) in [("program", source), ("globals", globals), ("guide", &guide)] {
            assert!(text.contains(name), "{key}: the {what} knows no {name}");
        }
    }
    let Actions { joints, line, tool, base } = Actions::default();
    for (number, does) in [(joints, "GOAL = COM_E6AXIS"), (line, "LIN COM_E6POS"), (tool, "$TOOL = "), (base, "$BASE = COM_")] {
        let case = source.split(&format!("CASE {number}\r\n")).nth(1).unwrap_or_default();
        assert!(case.split("CASE").next().unwrap().contains(does), "{number}: {does}");
        assert!(guide.contains(&format!("{number} ")), "the guide does not tell of action {number}");
    }
    for result in [Verdict::UnknownAction, Verdict::Cancelled, Verdict::Done] {
        assert!(source.contains(&format!("COM_RESULT = {}\r\n", result.number())), "{result:?}");
        assert_eq!(Verdict::of(result.number()), result);
    }
    assert!(source.contains("COM_RESULT = 10 + JOINT") && Verdict::of(14) == Verdict::JointLimit(4));
    for (name, text) in &files {
        assert!(text.is_ascii() && text.lines().count() == text.matches("\r\n").count(), "{name}");
    }
    assert!(source.contains(&format!("DEF {PROGRAM_NAME} ( )")));
}

#[test]
fn a_variable_that_is_not_there_is_named_at_once() {
    let (address, _) = serve(Temper::Obedient, Accident::None, RobotProgram::Plain);
    for (change, name) in [
        ((|v: &mut Variables| v.emergency_stop = "$NO_SUCH".into()) as fn(&mut Variables), "$NO_SUCH"),
        (|v| v.joints = "$AXIS_OOPS".into(), "$AXIS_OOPS"),
    ] {
        let mut settings = settings(&address, RobotProgram::Plain);
        change(&mut settings.variables);
        let error = KukaRobot::connect(settings, StopRequest::default()).err().expect("refused");
        assert!(matches!(&error, LinkError::Unknown { name: unknown } if unknown == name), "{error}");
    }
    // Our program is not there: its variables are missing.
    let error = KukaRobot::connect(settings(&address, RobotProgram::Calibench), StopRequest::default()).err().expect("refused");
    assert!(error.to_string().contains("COM_DONE"), "{error}");
}
