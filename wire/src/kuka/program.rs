//! The program that runs on the controller and carries out the driver's orders: a variable server alone cannot move an arm.
//!
//! ```text
//! driver                                            program
//! write the target                                  waits until COM_ACTION is not 0
//! write COM_ORDER = n, then COM_ACTION = action     n is COM_DONE already: COM_ACTION = 0, nothing moves
//! read COM_ACTION until it is 0                     judges the target, moves, stops exactly
//! read COM_DONE (n) and COM_RESULT                  COM_RESULT, then COM_DONE = n, then COM_ACTION = 0
//! ```
//!
//! Orders are numbered, so that an order sent again because its answer was lost is not carried out twice. Targets are absolute
//! for the same reason. `COM_CANCEL = TRUE` brakes, and ends the order as cancelled.

/// Module name of the program on the controller.
pub const PROGRAM_NAME: &str = "calibench";

/// `calibench.src`.
const SOURCE: &str = include_str!("program/calibench.src");

/// `calibench.dat`.
const DATA: &str = include_str!("program/calibench.dat");

/// Lines to be added to the controller's `$config.dat`.
const GLOBALS: &str = include_str!("program/config_dat_lines.txt");

/// The files for the controller: names and contents, with the controller's line ends.
pub fn program_files() -> [(&'static str, String); 3] {
    [("calibench.src", SOURCE), ("calibench.dat", DATA), ("config_dat_lines.txt", GLOBALS)]
        .map(|(name, text)| (name, text.lines().flat_map(|line| [line, "\r\n"]).collect()))
}

/// Outcome of an order, as reported by the program in `COM_RESULT`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// 0
    Done,
    /// 1: no such action.
    UnknownAction,
    /// 2: the controller finds no joint angles for the target.
    Unreachable,
    /// 3: interrupted by `COM_CANCEL`.
    Cancelled,
    /// 11 to 16: this joint (counted from 1) would leave its software limits.
    JointLimit(usize),
    /// Any other number.
    Other(i64),
}

impl Verdict {
    /// The verdict of this number.
    pub fn of(number: i64) -> Self {
        match number {
            0 => Verdict::Done,
            1 => Verdict::UnknownAction,
            2 => Verdict::Unreachable,
            3 => Verdict::Cancelled,
            11..=16 => Verdict::JointLimit(usize::try_from(number - 10).unwrap_or(1)),
            other => Verdict::Other(other),
        }
    }

    /// The number of the verdict.
    pub fn number(self) -> i64 {
        match self {
            Verdict::Done => 0,
            Verdict::UnknownAction => 1,
            Verdict::Unreachable => 2,
            Verdict::Cancelled => 3,
            Verdict::JointLimit(joint) => 10 + joint as i64,
            Verdict::Other(number) => number,
        }
    }
}
