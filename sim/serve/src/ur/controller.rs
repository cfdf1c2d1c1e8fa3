//! The state of a Universal Robot's controller: its modes, its registers, its tool, its program.

use std::cell::{Cell, RefCell};
use std::collections::BTreeMap;
use std::rc::Rc;

use calibench::cell::Manipulator;
use calibench::cell::ur::{numbers_of, pose_of};
use calibench::robot::statics::{DEFAULT_GRAVITY, Loads};
use calibench::robot::{Pose, Robot};
use calibench_wire::ur::modes::{NORMAL, PAUSED, PLAYING, POWER_OFF, PROTECTIVE_STOP, ROBOT_EMERGENCY_STOP, RUNNING, STOPPED};
use calibench_wire::ur::{DataType, Datum, input_type, output_type};
use nalgebra::Vector3;
use tokio::task::JoinHandle;
use tokio::time::Instant;

use crate::arm::{Arm, NotThere};
use crate::floor::Floor;

/// `joint_mode` of a joint that can move.
const JOINT_RUNNING: i64 = 253;

/// Nominal torque of the drives per ampere after the gear, N·m/A: of the size that is measured at these arms (assumed).
const NM_PER_A: [f64; 6] = [12.0, 12.0, 12.0, 9.0, 9.0, 9.0];

/// Deviation of the drives from it (assumed).
const DRIVE_DEVIATION: [f64; 6] = [0.01, -0.02, 0.015, -0.01, 0.02, 0.005];

/// Part of the load that friction holds at rest, N·m (assumed: a fifth of the friction of a slow motion).
const FRICTION_NM: [f64; 6] = [1.0, 1.0, 0.8, 0.3, 0.3, 0.3];

/// Most messages kept for clients.
const MOST_MESSAGES: usize = 1000;

/// The controller of the served robot.
pub struct Controller {
    /// The arm.
    pub arm: Arm,
    /// True if it takes programs from the network.
    pub is_remote: bool,
    /// Inputs that a client writes, each with the client's number.
    pub claimed: RefCell<BTreeMap<String, u64>>,
    inputs: RefCell<BTreeMap<String, Datum>>,
    outputs: RefCell<BTreeMap<String, Datum>>,
    flange_from_tool: Cell<[f64; 6]>,
    payload: Cell<[f64; 4]>,
    speed: Cell<f64>,
    robot_mode: Cell<i64>,
    safety: Cell<i64>,
    runtime: Cell<i64>,
    is_in_freedrive: Cell<bool>,
    program: RefCell<Option<JoinHandle<()>>>,
    name: RefCell<String>,
    messages: RefCell<Vec<String>>,
    began: Instant,
}

impl Controller {
    /// The controller of `robot` in this cell, powered on, with no program running; in remote control or in local control.
    pub fn new(floor: Rc<Floor>, robot: Robot, is_remote: bool) -> Self {
        Controller {
            arm: Arm::new(floor, robot),
            is_remote,
            claimed: RefCell::default(),
            inputs: RefCell::default(),
            outputs: RefCell::default(),
            flange_from_tool: Cell::new([0.0; 6]),
            payload: Cell::new([0.0; 4]),
            speed: Cell::new(1.0),
            robot_mode: Cell::new(RUNNING),
            safety: Cell::new(NORMAL),
            runtime: Cell::new(STOPPED),
            is_in_freedrive: Cell::new(false),
            program: RefCell::default(),
            name: RefCell::default(),
            messages: RefCell::default(),
            began: Instant::now(),
        }
    }

    /// Value of a variable that the controller sends; zero where the twin simulates none.
    pub fn output(&self, name: &str) -> Datum {
        let arm = &self.arm;
        let integer = |value: i64| Datum::Integers(vec![value]);
        let real = |value: f64| Datum::Reals(vec![value]);
        match name {
            "timestamp" => real(self.began.elapsed().as_secs_f64()),
            "actual_q" => Datum::Reals(arm.measured()),
            "target_q" => Datum::Reals(arm.joints()),
            "actual_qd" | "target_qd" => Datum::Reals(arm.speeds()),
            "actual_TCP_pose" => Datum::Reals(numbers_of(&self.tool_at(&arm.measured())).to_vec()),
            "target_TCP_pose" => Datum::Reals(numbers_of(&self.tool_at(&arm.joints())).to_vec()),
            "tcp_offset" => Datum::Reals(self.tool().to_vec()),
            "actual_current" => Datum::Reals(self.currents()),
            "robot_mode" => integer(self.robot_mode.get()),
            "safety_status" | "safety_mode" => integer(self.safety.get()),
            "runtime_state" => integer(self.runtime.get()),
            "robot_status_bits" => integer(
                i64::from(self.robot_mode.get() == RUNNING)
                    | i64::from(self.is_playing()) << 1
                    | i64::from(self.is_in_freedrive.get()) << 2,
            ),
            "safety_status_bits" => integer(1 << (self.safety.get() - 1).clamp(0, 10)),
            "speed_scaling" | "target_speed_fraction" => real(self.speed.get()),
            "payload" => real(self.payload.get()[0]),
            "payload_cog" => Datum::Reals(self.payload.get()[1..].to_vec()),
            "joint_mode" => Datum::Integers(vec![JOINT_RUNNING; 6]),
            "joint_temperatures" => Datum::Reals(vec![arm.floor.world.robot().temperature_c().unwrap_or_default(); 6]),
            _ if name.starts_with("input_") => self.register(&self.inputs, name),
            _ => self.register(&self.outputs, name),
        }
    }

    /// Currents with which the drives hold the arm and its true payload, A. The friction of the gears holds a part of it, on the side
    /// from which the joint came, and no drive has its nominal torque per ampere.
    fn currents(&self) -> Vec<f64> {
        let arm = &self.arm;
        let world = &arm.floor.world;
        let posture = arm.posture(&arm.measured());
        let mut loads = Loads::new(arm.robot.joints());
        loads.compute(&arm.robot, &posture, &world.true_payload(), &DEFAULT_GRAVITY, &Vector3::zeros());
        let signs = world.last_motion();
        let of = |joint: usize| {
            let friction = FRICTION_NM[joint] * f64::from(signs[joint]);
            (friction - loads.tau[joint]) / (NM_PER_A[joint] * (1.0 + DRIVE_DEVIATION[joint]))
        };
        (0..arm.robot.joints().min(NM_PER_A.len())).map(of).collect()
    }

    fn register(&self, registers: &RefCell<BTreeMap<String, Datum>>, name: &str) -> Datum {
        let zero = || Datum::zero(output_type(name).or_else(|| input_type(name)).unwrap_or(DataType::Double));
        registers.borrow().get(name).cloned().unwrap_or_else(zero)
    }

    /// Takes the values of one package from a client.
    pub fn take_inputs(&self, values: impl Iterator<Item = (String, Datum)>) {
        let values: BTreeMap<String, Datum> = values.collect();
        let slider = values.get("speed_slider_mask").filter(|mask| mask.integer() != 0);
        if let Some(fraction) = slider.and(values.get("speed_slider_fraction")) {
            self.speed.set(fraction.real().clamp(0.0, 1.0));
        }
        self.inputs.borrow_mut().extend(values);
    }

    /// Value of a register that clients write.
    pub fn input_register(&self, name: &str) -> Datum {
        self.register(&self.inputs, name)
    }

    /// Value of a register that the program writes.
    pub fn output_register(&self, name: &str) -> Datum {
        self.register(&self.outputs, name)
    }

    /// Writes a register as the program does; one that does not exist stays so.
    pub fn put(&self, name: String, value: Datum) {
        if output_type(&name).is_some() {
            self.outputs.borrow_mut().insert(name, value);
        }
    }

    /// The tool in the flange: m and rotation vector, rad.
    pub fn tool(&self) -> [f64; 6] {
        self.flange_from_tool.get()
    }

    /// Uses this tool from now on.
    pub fn set_tool(&self, flange_from_tool: [f64; 6]) {
        self.flange_from_tool.set(flange_from_tool);
    }

    /// Uses this payload from now on: kg, and its centre of mass in the flange, m.
    pub fn set_payload(&self, payload: [f64; 4]) {
        self.payload.set(payload);
    }

    /// Share of full speed.
    pub fn speed(&self) -> f64 {
        self.speed.get()
    }

    /// Pose of the tool in the base with these joints, rad.
    pub fn tool_at(&self, q: &[f64]) -> Pose {
        self.arm.posture(q).flange().pose() * pose_of(self.tool())
    }

    /// True if a program runs.
    pub fn is_playing(&self) -> bool {
        self.runtime.get() == PLAYING
    }

    /// The controller's state in the dashboard's words: mode, safety, program.
    pub fn words(&self) -> [String; 3] {
        let mode = if self.robot_mode.get() == RUNNING { "RUNNING" } else { "POWER_OFF" };
        let safety = match self.safety.get() {
            PROTECTIVE_STOP => "PROTECTIVE_STOP",
            ROBOT_EMERGENCY_STOP => "ROBOT_EMERGENCY_STOP",
            _ => "NORMAL",
        };
        let program = match self.runtime.get() {
            PLAYING => "PLAYING",
            PAUSED => "PAUSED",
            _ => "STOPPED",
        };
        let name = self.name.borrow();
        let name = if name.is_empty() { "<unnamed>" } else { name.as_str() };
        [mode.into(), safety.into(), format!("{program} {name}")]
    }

    /// A message for all clients.
    pub fn say(&self, words: impl Into<String>) {
        let mut messages = self.messages.borrow_mut();
        if messages.len() < MOST_MESSAGES {
            messages.push(words.into());
        }
    }

    /// The messages from this number on.
    pub fn messages_from(&self, first: usize) -> Vec<String> {
        self.messages.borrow().get(first..).unwrap_or_default().to_vec()
    }

    /// True if it takes a program now: in remote control, and if the arm may move.
    pub fn takes_programs(&self) -> bool {
        self.is_remote && self.robot_mode.get() == RUNNING && self.safety.get() == NORMAL
    }

    /// Notes that a program of this name runs as this task, in place of the one before.
    pub fn play(&self, name: &str, program: JoinHandle<()>) {
        self.stop_program();
        name.clone_into(&mut self.name.borrow_mut());
        self.is_in_freedrive.set(false);
        *self.program.borrow_mut() = Some(program);
        self.runtime.set(PLAYING);
    }

    /// Notes that the program that ran has ended.
    pub fn note_end(&self) {
        self.runtime.set(STOPPED);
    }

    /// Stops the program that runs, and its motion.
    pub fn stop_program(&self) {
        if let Some(program) = self.program.borrow_mut().take() {
            program.abort();
        }
        self.runtime.set(STOPPED);
    }

    /// Notes what stopped the arm. True if the program can go on once its cause is removed.
    pub fn note_stop(&self, reason: NotThere) -> bool {
        match reason {
            NotThere::ProtectiveStop => {
                self.safety.set(PROTECTIVE_STOP);
                self.runtime.set(PAUSED);
            }
            NotThere::Emergency => {
                self.safety.set(ROBOT_EMERGENCY_STOP);
                self.robot_mode.set(POWER_OFF);
            }
            NotThere::PowerOff => self.robot_mode.set(POWER_OFF),
            NotThere::Freedrive => self.is_in_freedrive.set(true),
            NotThere::JointLimit(_) | NotThere::Cancelled | NotThere::Impossible => {}
        }
        reason == NotThere::ProtectiveStop
    }

    /// Releases whatever stops the arm and powers it on, as an operator does, with the program stopped; false if nothing is
    /// stopped.
    pub fn restart(&self) -> bool {
        let is_stopped =
            self.safety.get() != NORMAL || self.robot_mode.get() != RUNNING || self.is_in_freedrive.get() || !self.is_playing();
        if is_stopped {
            self.stop_program();
            self.safety.set(NORMAL);
            self.robot_mode.set(RUNNING);
            self.is_in_freedrive.set(false);
        }
        is_stopped
    }
}
