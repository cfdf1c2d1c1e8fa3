//! The program on the controller that carries out the driver's orders, and the registers by which they talk.
//!
//! ```text
//! driver                                            program
//! writes action and target, then ORDER = n          waits until ORDER differs from DONE; SEEN = n
//! BEGIN = n as soon as SEEN is n                    an order that is not confirmed within 125 cycles is void
//! reads DONE until it is n                          RESULT = under way; moves; RESULT, then DONE = n
//! writes CANCEL = n                                 brakes, and ends order n as cancelled
//! ```
//!
//! Orders are numbered and their targets absolute, so that an order sent again is not carried out twice. A program that is
//! started takes the order that it finds as never carried out, and says so.

/// The program, in URScript.
pub const PROGRAM: &str = include_str!("program/calibench.script");

/// Value of the register `PROGRAM` while this program runs; another version of it has another.
pub const PROGRAM_TOKEN: i64 = 330_001;

/// The general-purpose registers by which driver and program talk. Those from 24 on are for clients of RTDE.
pub mod registers {
    /// Number of the order.
    pub const ORDER: &str = "input_int_register_24";
    /// What to do.
    pub const ACTION: &str = "input_int_register_25";
    /// Number of the order to be broken off.
    pub const CANCEL: &str = "input_int_register_26";
    /// Number of the order that may begin.
    pub const BEGIN: &str = "input_int_register_27";
    /// The target's six numbers; acceleration, rad/s² or m/s²; speed, rad/s or m/s.
    pub const TARGET: [&str; 8] = [
        "input_double_register_24",
        "input_double_register_25",
        "input_double_register_26",
        "input_double_register_27",
        "input_double_register_28",
        "input_double_register_29",
        "input_double_register_30",
        "input_double_register_31",
    ];
    /// Number of the last order that ended.
    pub const DONE: &str = "output_int_register_24";
    /// Its outcome.
    pub const RESULT: &str = "output_int_register_25";
    /// The token of the program.
    pub const PROGRAM: &str = "output_int_register_26";
    /// Counts the program's waiting cycles.
    pub const ALIVE: &str = "output_int_register_27";
    /// Number of the order that the program has seen.
    pub const SEEN: &str = "output_int_register_28";
}

/// What an order asks for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Action {
    /// To these joints, rad, each in a straight line of joint space.
    Joints,
    /// With the tool to this pose in the base (m, rotation vector in rad), in a straight line.
    Line,
    /// Uses this tool in the flange from now on.
    Tool,
    /// Uses this payload from now on: kg, and its centre of mass in the flange, m.
    Payload,
    /// Ends the program.
    End,
}

impl Action {
    /// Its number.
    pub fn number(self) -> i64 {
        match self {
            Action::Joints => 1,
            Action::Line => 2,
            Action::Tool => 3,
            Action::Payload => 4,
            Action::End => 5,
        }
    }
}

/// The outcome of an order.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outcome {
    /// Carried out.
    Done,
    /// No such action.
    UnknownAction,
    /// The target is beyond the safety limits of joints, tool or planes, or beyond reach.
    BeyondLimits,
    /// Broken off.
    Cancelled,
    /// Not ended yet.
    UnderWay,
    /// Seen, and not confirmed yet.
    Seen,
    /// Not confirmed in time: it was not carried out, and will not be.
    Void,
    /// The program was started again after the order had been given; it is not known what became of it.
    Forgotten,
    /// Any other number.
    Other(i64),
}

impl Outcome {
    /// The outcome of this number.
    pub fn of(number: i64) -> Self {
        match number {
            0 => Outcome::Done,
            1 => Outcome::UnknownAction,
            2 => Outcome::BeyondLimits,
            3 => Outcome::Cancelled,
            4 => Outcome::UnderWay,
            5 => Outcome::Void,
            6 => Outcome::Seen,
            9 => Outcome::Forgotten,
            other => Outcome::Other(other),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_program_names_its_token_and_its_registers() {
        let calls = |register: &str, call: &str, then: &str| {
            let (_, number) = register.rsplit_once('_').unwrap();
            assert!(PROGRAM.contains(&format!("{call}({number}{then}")), "{call} {register}");
        };
        for register in [registers::ORDER, registers::ACTION, registers::CANCEL, registers::BEGIN] {
            calls(register, "read_input_integer_register", ")");
        }
        for register in registers::TARGET {
            calls(register, "read_input_float_register", ")");
        }
        for register in [registers::DONE, registers::RESULT, registers::ALIVE, registers::SEEN] {
            calls(register, "write_output_integer_register", ", ");
        }
        calls(registers::PROGRAM, "write_output_integer_register", &format!(", {PROGRAM_TOKEN})"));
        for action in [Action::Joints, Action::Line, Action::Tool, Action::Payload, Action::End] {
            assert!(PROGRAM.contains(&format!("action == {}", action.number())), "{action:?}");
        }
    }
}
