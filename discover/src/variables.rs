//! What a law may depend on, and the functions of one variable of which it is made.

use calibench::units::{DEG, MM};

/// A quantity known at every sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Variable {
    /// Angle or travel of a joint.
    Joint(usize),
    /// Sum of two angles.
    Sum(usize, usize),
    /// Difference of two angles.
    Difference(usize, usize),
    /// Torque of the load about a joint.
    Torque(usize),
    /// Direction of a joint's last motion.
    Approach(usize),
    /// How far a joint is turned against a hose that follows it with play.
    Hose(usize),
    /// A joint's last move.
    Move(usize),
    /// A component of the direction of gravity in the last frame.
    Down(usize),
    /// A coordinate of the TCP in the world.
    Tcp(usize),
    /// Mass of the payload.
    Payload,
    /// Time since the session began.
    Time,
    /// Temperature of the robot.
    Temperature,
}

/// A unit in which a variable is shown.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Shown {
    /// Its SI value.
    pub si: f64,
    /// Its symbol; empty for a number.
    pub symbol: &'static str,
}

/// Names of three axes.
const AXES: [&str; 3] = ["x", "y", "z"];

impl Variable {
    /// All of an arm with this many joints.
    pub fn all(joints: usize) -> Vec<Variable> {
        let each = (0..joints).flat_map(|j| {
            [Variable::Joint(j), Variable::Torque(j), Variable::Approach(j), Variable::Hose(j), Variable::Move(j)]
        });
        let pairs =
            (0..joints).flat_map(|j| (j + 1..joints).flat_map(move |k| [Variable::Sum(j, k), Variable::Difference(j, k)]));
        let along = (0..3).flat_map(|k| [Variable::Down(k), Variable::Tcp(k)]);
        each.chain(pairs).chain(along).chain([Variable::Payload, Variable::Time, Variable::Temperature]).collect()
    }

    /// As an expression in a model file.
    pub fn expression(self) -> String {
        match self {
            Variable::Joint(j) => format!("q{}", j + 1),
            Variable::Sum(j, k) => format!("(q{}+q{})", j + 1, k + 1),
            Variable::Difference(j, k) => format!("(q{}-q{})", j + 1, k + 1),
            Variable::Torque(j) => format!("tau{}", j + 1),
            Variable::Approach(j) => format!("approach{}", j + 1),
            Variable::Hose(j) => format!("hose{}", j + 1),
            Variable::Move(j) => format!("(q{0}-q{0}_before)", j + 1),
            Variable::Down(k) => format!("down_{}", AXES[k]),
            Variable::Tcp(k) => format!("tcp_{}_m", AXES[k]),
            Variable::Payload => "payload_kg".into(),
            Variable::Time => "time_s".into(),
            Variable::Temperature => "temp_c".into(),
        }
    }

    /// In words.
    pub fn words(self) -> String {
        match self {
            Variable::Joint(_) | Variable::Sum(..) | Variable::Difference(..) => {
                self.expression().trim_matches(['(', ')']).replace('+', " + ").replace('-', " - ")
            }
            Variable::Torque(j) => format!("the load on joint {}", j + 1),
            Variable::Approach(j) => format!("the direction from which joint {} came", j + 1),
            Variable::Hose(j) => format!("what follows joint {} with play", j + 1),
            Variable::Move(j) => format!("the last move of joint {}", j + 1),
            Variable::Down(k) => format!("gravity along the flange's {}", AXES[k]),
            Variable::Tcp(k) => format!("the tool's {} in the world", AXES[k]),
            Variable::Payload => "the payload".into(),
            Variable::Time => "time".into(),
            Variable::Temperature => "temperature".into(),
        }
    }

    /// The unit in which its range is said: its SI value, and its symbol. `turns` for a joint that does.
    pub fn unit(self, turns: bool) -> Shown {
        let (si, symbol) = match self {
            Variable::Joint(_) | Variable::Sum(..) | Variable::Difference(..) | Variable::Move(_) if turns => (DEG, "deg"),
            Variable::Joint(_) | Variable::Sum(..) | Variable::Difference(..) | Variable::Move(_) | Variable::Tcp(_) => {
                (MM, "mm")
            }
            Variable::Torque(_) => (1.0, "N.m"),
            Variable::Payload => (1.0, "kg"),
            Variable::Time => (1.0, "s"),
            Variable::Temperature => (1.0, "degC"),
            Variable::Approach(_) | Variable::Hose(_) | Variable::Down(_) => (1.0, ""),
        };
        Shown { si, symbol }
    }

    /// The joints of which it is an angle; two for a sum.
    pub fn angles(self) -> Vec<usize> {
        match self {
            Variable::Joint(j) => vec![j],
            Variable::Sum(j, k) | Variable::Difference(j, k) => vec![j, k],
            _ => Vec::new(),
        }
    }

    /// True if a function of one is a function of the other.
    pub fn overlaps(self, other: Variable) -> bool {
        let (a, b) = (self.angles(), other.angles());
        self == other || a.iter().any(|j| b.contains(j))
    }
}

/// A function of one variable, which is divided by its scale before.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Function {
    /// x.
    Plain,
    /// x².
    Square,
    /// x³.
    Cube,
    /// The absolute value.
    Abs,
    /// x times its absolute value.
    Odd,
    /// The sign.
    Sign,
    /// tanh of a multiple: saturates.
    Saturation(u8),
    /// Decays with a multiple of x.
    Decay(u8),
    /// Sine of a multiple.
    Sine(u8),
    /// Cosine of a multiple.
    Cosine(u8),
}

impl Function {
    /// Its value.
    pub fn at(self, x: f64) -> f64 {
        match self {
            Function::Plain => x,
            Function::Square => x * x,
            Function::Cube => x * x * x,
            Function::Abs => x.abs(),
            Function::Odd => x * x.abs(),
            Function::Sign if x == 0.0 => 0.0,
            Function::Sign => x.signum(),
            Function::Saturation(k) => (f64::from(k) * x).tanh(),
            Function::Decay(k) => (-f64::from(k) * x).exp(),
            Function::Sine(k) => (f64::from(k) * x).sin(),
            Function::Cosine(k) => (f64::from(k) * x).cos(),
        }
    }

    /// As an expression, of an expression.
    pub fn expression(self, of: &str) -> String {
        let times = |k: u8| if k == 1 { of.trim_matches(['(', ')']).to_owned() } else { format!("{k}*{of}") };
        match self {
            Function::Plain => of.to_owned(),
            Function::Square => format!("{of}^2"),
            Function::Cube => format!("{of}^3"),
            Function::Abs => format!("abs({of})"),
            Function::Odd => format!("{of}*abs({of})"),
            Function::Sign => format!("sign({of})"),
            Function::Saturation(k) => format!("tanh({})", times(k)),
            Function::Decay(k) => format!("exp(-({}))", times(k)),
            Function::Sine(k) => format!("sin({})", times(k)),
            Function::Cosine(k) => format!("cos({})", times(k)),
        }
    }
}
