//! A user's expression in the variables of an effect, such as `sin(17*q3)` or `approach2*abs(tau2)`.
//!
//! The text is parsed here, so that errors are reported with their position and no input can do harm; exmex does the
//! arithmetic.

use exmex::{BinOp, Express, FlatEx, MakeOperators, Operator};
use thiserror::Error;

use super::Needs;
use super::situation::Situation;
use crate::files::nearest_name;

/// Longest expression, characters. A Fourier series is to be written as several terms.
const LONGEST: usize = 500;
/// Deepest nesting of parentheses.
const DEEPEST: usize = 30;
/// Largest number of different variables in one expression.
const MOST_VARIABLES: usize = 32;
/// Range of the absolute value of a non-zero number.
const SIZES: std::ops::RangeInclusive<f64> = 1e-30..=1e30;

/// Functions and operators allowed in an expression.
const FUNCTIONS: [&str; 15] =
    ["abs", "acos", "asin", "atan", "cos", "cosh", "exp", "ln", "sign", "signum", "sin", "sinh", "sqrt", "tan", "tanh"];

/// An error in an expression: what is wrong, where, and how to correct it.
#[derive(Debug, Error, Clone, PartialEq)]
#[error("at character {position}: {problem}; {remedy}")]
pub struct ExpressionError {
    /// Position of the character, counted from 1.
    pub position: usize,
    /// The problem.
    pub problem: String,
    /// The remedy.
    pub remedy: String,
}

/// Ending of the names of joints at the sample before.
pub(super) const BEFORE: &str = "_before";

/// Beginning of the names of the hoses that follow joints with play.
pub(super) const HOSE: &str = "hose";

/// The meaning of a name; joints counted from 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Variable {
    Angle(usize),
    AngleBefore(usize),
    AngleCommanded(usize),
    Torque(usize),
    Approach(usize),
    /// How far a joint is turned against a hose that follows it with play, -1 to 1.
    Hose(usize),
    /// A component of the direction of gravity in the last frame.
    Down(usize),
    /// A coordinate of the TCP in the world.
    Tcp(usize),
    PayloadMass,
    Time,
    Temperature,
}

impl Variable {
    fn all(joints: usize) -> impl Iterator<Item = (String, Variable)> {
        let each = (0..joints).flat_map(|j| {
            [
                ("q", "", Variable::Angle(j)),
                ("tau", "", Variable::Torque(j)),
                ("approach", "", Variable::Approach(j)),
                (HOSE, "", Variable::Hose(j)),
                ("q", BEFORE, Variable::AngleBefore(j)),
                ("q", "_commanded", Variable::AngleCommanded(j)),
            ]
            .map(|(name, ending, variable)| (format!("{name}{}{ending}", j + 1), variable))
        });
        let along = ["x", "y", "z"]
            .into_iter()
            .enumerate()
            .flat_map(|(k, axis)| [(format!("down_{axis}"), Variable::Down(k)), (format!("tcp_{axis}_m"), Variable::Tcp(k))]);
        let others = [("payload_kg", Variable::PayloadMass), ("time_s", Variable::Time), ("temp_c", Variable::Temperature)];
        each.chain(along).chain(others.map(|(name, variable)| (name.to_owned(), variable)))
    }

    fn value(self, at: &Situation<'_>) -> Option<f64> {
        match self {
            Variable::Angle(j) => at.q.get(j).copied(),
            Variable::AngleBefore(j) => at.q_before.and_then(|q| q.get(j)).copied(),
            Variable::AngleCommanded(j) => at.q_commanded.and_then(|q| q.get(j)).copied(),
            Variable::Torque(j) => at.loads.tau.get(j).copied(),
            Variable::Approach(j) => at.approach.and_then(|signs| signs.get(j)).map(|&s| f64::from(s)),
            Variable::Hose(j) => at.hose.and_then(|hose| hose.get(j)).copied(),
            Variable::Down(k) => Some(at.gravity_in_last_frame()[k]),
            Variable::Tcp(k) => Some(at.posture.tcp()[k]),
            Variable::PayloadMass => Some(at.payload.mass),
            Variable::Time => at.time_s,
            Variable::Temperature => at.temp_c,
        }
    }

    fn needs(self) -> Option<Needs> {
        match self {
            Variable::Angle(_)
            | Variable::AngleBefore(_)
            | Variable::Hose(_)
            | Variable::Down(_)
            | Variable::Tcp(_)
            | Variable::PayloadMass => None,
            Variable::AngleCommanded(_) => Some(Needs::Commanded),
            Variable::Torque(_) => Some(Needs::Torques),
            Variable::Approach(_) => Some(Needs::Approach),
            Variable::Time => Some(Needs::Time),
            Variable::Temperature => Some(Needs::Temperature),
        }
    }
}

/// An expression ready for evaluation.
#[derive(Debug)]
pub(super) struct Expression {
    pub text: String,
    compiled: FlatEx<f64, Operators>,
    variables: Vec<Variable>,
}

impl Expression {
    /// Parses an expression for an arm with `joints` joints.
    pub fn parse(text: &str, joints: usize) -> Result<Self, ExpressionError> {
        let chars: Vec<char> = text.chars().collect();
        let mut reader = Reader::new(&chars, joints);
        reader.read()?;
        let compiled = FlatEx::parse(&reader.written).map_err(|e| ExpressionError {
            position: 1,
            problem: format!("is not an expression ({e})"),
            remedy: "write it with numbers, variables, functions, + - * / ^ and parentheses".into(),
        })?;
        Ok(Expression { text: text.into(), compiled, variables: reader.variables })
    }

    /// Returns the value at a sample: `None` if a variable is unknown there, NaN if the expression has no value.
    pub fn at(&self, at: &Situation<'_>) -> Option<f64> {
        let mut values = [0.0; MOST_VARIABLES];
        for (value, variable) in values.iter_mut().zip(&self.variables) {
            *value = variable.value(at)?;
        }
        // exmex folds constant subexpressions when parsing but drops no variable: values are passed for all of them.
        Some(self.compiled.eval(&values[..self.variables.len()]).unwrap_or(f64::NAN))
    }

    /// The requirements of its variables.
    pub fn needs(&self) -> impl Iterator<Item = Needs> {
        self.variables.iter().filter_map(|v| v.needs())
    }
}

/// A factor or a parenthesis not yet complete.
#[derive(Debug, Clone, Copy, Default)]
struct Factor {
    /// Position of its own sign, if it has one.
    sign: Option<usize>,
    /// True if it follows `^`.
    is_exponent: bool,
}

/// Parses an expression and rewrites it in the small subset passed to exmex: variables are `v00` ...
struct Reader<'a> {
    chars: &'a [char],
    joints: usize,
    written: String,
    variables: Vec<Variable>,
    /// Factors around the open parentheses.
    open: Vec<Factor>,
    /// The current factor.
    factor: Factor,
    /// The last complete factor, if an operator must follow.
    complete: Option<Factor>,
}

impl<'a> Reader<'a> {
    fn new(chars: &'a [char], joints: usize) -> Self {
        let (written, variables, open) = (String::new(), Vec::new(), Vec::new());
        Reader { chars, joints, written, variables, open, factor: Factor::default(), complete: None }
    }

    /// Reads the whole expression.
    fn read(&mut self) -> Result<(), ExpressionError> {
        let end = self.chars.len();
        if end > LONGEST {
            return wrong(LONGEST, format!("is longer than {LONGEST} characters"), "split it into several terms");
        }
        let mut k = 0;
        while k < end {
            k = match (self.chars[k], self.complete) {
                (' ', _) => k + 1,
                (_, None) => self.read_factor(k)?,
                (_, Some(last)) => self.read_operator(k, last)?,
            };
        }
        if !self.open.is_empty() {
            return wrong(end, "a parenthesis is not closed".into(), "close it");
        }
        if self.complete.is_none() {
            let problem = if self.chars.iter().all(|c| *c == ' ') { "is empty" } else { "ends too early" };
            return wrong(end, problem.into(), "complete the expression; a constant is written `1`");
        }
        Ok(())
    }

    /// Reads the next part of a factor, from its sign to the number or name that completes it; returns the place after it.
    fn read_factor(&mut self, start: usize) -> Result<usize, ExpressionError> {
        match self.chars[start] {
            c @ ('+' | '-') if self.factor.sign.is_none() => {
                self.factor.sign = Some(start);
                self.written.push(c);
            }
            '(' => {
                if self.open.len() == DEEPEST {
                    return wrong(start, format!("is nested deeper than {DEEPEST}"), "split it into several terms");
                }
                self.open.push(std::mem::take(&mut self.factor));
                self.written.push('(');
            }
            '*' if self.chars[..start].ends_with(&['*']) => {
                return wrong(start, "`**` is not an operator".into(), "write a power as `^`");
            }
            c if c.is_ascii_digit() || c == '.' => return self.read_number(start),
            c if c.is_ascii_alphabetic() => return self.read_name(start),
            c @ ('+' | '-' | '*' | '/' | '^' | ')') => {
                let problem = format!("a number, a variable or a function is missing before `{c}`");
                return wrong(start, problem, "complete the expression");
            }
            c => return no_place(start, c),
        }
        Ok(start + 1)
    }

    /// Reads what follows the complete factor `last`: an operator, or the end of its parenthesis; returns the place after it.
    fn read_operator(&mut self, start: usize, last: Factor) -> Result<usize, ExpressionError> {
        let c = self.chars[start];
        match c {
            ')' => {
                let Some(around) = self.open.pop() else {
                    return wrong(start, "closes a parenthesis that was not opened".into(), "remove it, or open it before");
                };
                self.complete = Some(around);
            }
            '^' if last.sign.is_some() && !last.is_exponent => {
                let sign = last.sign.unwrap_or(start);
                return wrong(sign, "a sign before a power may be read in two ways".into(), "write -(a^b) or (-a)^b");
            }
            '^' if last.is_exponent => {
                return wrong(start, "a power of a power may be read in two ways".into(), "write (a^b)^c or a^(b^c)");
            }
            '+' | '-' | '*' | '/' | '^' => {
                self.factor = Factor { sign: None, is_exponent: c == '^' };
                self.complete = None;
            }
            c if c.is_ascii_alphanumeric() || c == '(' => {
                return wrong(start, format!("an operator is missing before `{c}`"), "write products with `*`");
            }
            c => return no_place(start, c),
        }
        self.written.push(c);
        Ok(start + 1)
    }

    /// Reads a number, which completes a factor; returns the place after it.
    fn read_number(&mut self, start: usize) -> Result<usize, ExpressionError> {
        let end = end_of_number(self.chars, start);
        let digits: String = self.chars[start..end].iter().collect();
        match digits.parse::<f64>() {
            Ok(v) if v == 0.0 || SIZES.contains(&v) => self.written.push_str(&decimal(v)),
            _ => return wrong(start, format!("`{digits}` is not a number of a sensible size"), "write it as 1.5 or 2e-3"),
        }
        self.complete = Some(self.factor);
        Ok(end)
    }

    /// Reads the name of a variable, a constant or a function; returns the place after it.
    fn read_name(&mut self, start: usize) -> Result<usize, ExpressionError> {
        let rest = &self.chars[start..];
        let end = start + rest.iter().take_while(|c| c.is_ascii_alphanumeric() || **c == '_').count();
        let name: String = self.chars[start..end].iter().collect();
        let called = self.chars[end..].iter().find(|c| **c != ' ') == Some(&'(');
        let written = self.write_name(&name, called);
        if written.map_err(|(problem, remedy)| ExpressionError { position: start + 1, problem, remedy })? {
            self.complete = Some(self.factor);
        }
        Ok(end)
    }

    /// Writes a name and returns true if it completes a factor (variable or constant), false if not (function).
    fn write_name(&mut self, name: &str, called: bool) -> Result<bool, (String, String)> {
        if name == "pi" {
            self.written.push_str(&decimal(std::f64::consts::PI));
            return Ok(true);
        }
        if FUNCTIONS.contains(&name) {
            if !called {
                return Err((format!("`{name}` is a function"), format!("write `{name}(...)`")));
            }
            self.written.push_str(if name == "sign" { "signum" } else { name });
            return Ok(false);
        }
        let known: Vec<(String, Variable)> = Variable::all(self.joints).collect();
        let Some((_, variable)) = known.iter().find(|(n, _)| n == name) else {
            let names = known.iter().map(|(n, _)| n.as_str()).chain(FUNCTIONS).chain(["pi"]);
            let remedy = match nearest_name(name, names) {
                Some(near) => format!("did you mean `{near}`?"),
                None => {
                    let n = self.joints;
                    format!(
                        "variables are q1 ... q{n}, tau1 ..., approach1 ..., hose1 ..., q1_before ..., q1_commanded ..., down_x ..., tcp_x_m ..., payload_kg, time_s, temp_c; functions {}",
                        FUNCTIONS.join(", ")
                    )
                }
            };
            return Err((format!("`{name}` is not known"), remedy));
        };
        let place = self.variables.iter().position(|v| v == variable).unwrap_or_else(|| {
            self.variables.push(*variable);
            self.variables.len() - 1
        });
        if place == MOST_VARIABLES {
            return Err((format!("has more than {MOST_VARIABLES} variables"), "split it into several terms".into()));
        }
        self.written.push_str(&format!("v{place:02}"));
        Ok(true)
    }
}

/// The error at a place, counted from 0.
fn wrong<T>(place: usize, problem: String, remedy: &str) -> Result<T, ExpressionError> {
    Err(ExpressionError { position: place + 1, problem, remedy: remedy.into() })
}

/// The error for a character that is in no expression.
fn no_place<T>(place: usize, c: char) -> Result<T, ExpressionError> {
    if c == ',' {
        return wrong(place, "`,` has no place here".into(), "write decimal points, not commas");
    }
    let problem = format!("`{}` has no place in an expression", c.escape_default());
    wrong(place, problem, "use numbers, variables, functions, + - * / ^ and parentheses")
}

/// A number in digits that exmex reads: no exponent, and a digit on either side of the point.
fn decimal(v: f64) -> String {
    format!("{v}")
}

/// End of the number that begins at `start`: digits, a point, an exponent.
fn end_of_number(chars: &[char], start: usize) -> usize {
    let digits = |from: usize| from + chars[from..].iter().take_while(|c| c.is_ascii_digit() || **c == '.').count();
    let end = digits(start);
    if !matches!(chars.get(end), Some('e' | 'E')) {
        return end;
    }
    let sign = usize::from(matches!(chars.get(end + 1), Some('+' | '-')));
    let after = end + 1 + sign;
    let exponent = chars[after.min(chars.len())..].iter().take_while(|c| c.is_ascii_digit()).count();
    if exponent > 0 { after + exponent } else { end }
}

/// The operators and functions of [`FUNCTIONS`].
#[derive(Debug, Clone)]
struct Operators;

impl MakeOperators<f64> for Operators {
    fn make<'a>() -> Vec<Operator<'a, f64>> {
        let bin = |apply: fn(f64, f64) -> f64, prio: i64, is_commutative: bool| BinOp { apply, prio, is_commutative };
        vec![
            Operator::make_bin_unary("+", bin(|a, b| a + b, 0, true), |a| a),
            Operator::make_bin_unary("-", bin(|a, b| a - b, 1, false), |a| -a),
            Operator::make_bin("*", bin(|a, b| a * b, 2, true)),
            Operator::make_bin("/", bin(|a, b| a / b, 3, false)),
            Operator::make_bin("^", bin(f64::powf, 4, false)),
            Operator::make_unary("abs", f64::abs),
            Operator::make_unary("acos", f64::acos),
            Operator::make_unary("asin", f64::asin),
            Operator::make_unary("atan", f64::atan),
            Operator::make_unary("cos", f64::cos),
            Operator::make_unary("cosh", f64::cosh),
            Operator::make_unary("exp", f64::exp),
            Operator::make_unary("ln", f64::ln),
            // Zero at zero, unlike the sign bit of a float.
            Operator::make_unary("signum", |a| if a == 0.0 { 0.0 } else { a.signum() }),
            Operator::make_unary("sin", f64::sin),
            Operator::make_unary("sinh", f64::sinh),
            Operator::make_unary("sqrt", f64::sqrt),
            Operator::make_unary("tan", f64::tan),
            Operator::make_unary("tanh", f64::tanh),
        ]
    }
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;
    use crate::robot::kinematics::Posture;
    use crate::robot::statics::{Loads, Payload};
    use crate::robot::{Robot, built_in};

    /// Joint angles of the test, rad.
    const Q: [f64; 6] = [0.3, -1.2, 0.7, 2.0, -0.4, 1.1];

    fn value(text: &str) -> f64 {
        let robot: Robot = built_in("kr6_r700").expect("built in");
        let (posture, loads, payload) = (Posture::new(&robot), Loads::new(6), Payload { mass: 6.0, ..Payload::none() });
        let mut at = Situation::at_rest(&robot, &Q, &posture, &loads, &payload);
        at.time_s = Some(120.0);
        at.q_before = Some(&Q[1..]);
        Expression::parse(text, 6).unwrap_or_else(|e| panic!("{text}: {e}")).at(&at).expect("all variables are known")
    }

    #[test]
    fn expressions_mean_what_a_reader_of_formulas_takes_them_for() {
        let [q1, q2, q3, ..] = Q;
        for (text, expected) in [
            ("1", 1.0),
            ("sin(17*q3)", (17.0 * q3).sin()),
            ("sin( 2 * q1 )^2 + cos(2*q1)^2", 1.0),
            ("q1 - q2 - q3", q1 - q2 - q3),
            ("q1 - q2 + q3", q1 - q2 + q3),
            ("q1 + q2 - q3 + q1 - q2", q1 + q2 - q3 + q1 - q2),
            ("8/4/2", 1.0),
            ("8/4*2", 4.0),
            ("2*8/4*2", 8.0),
            ("2*3^2", 18.0),
            ("2^-1", 0.5),
            ("-q1*q2", -q1 * q2),
            ("q1*-q2", -q1 * q2),
            ("-(q1^2)", -q1 * q1),
            ("(-q1)^2", q1 * q1),
            ("-sin(q1)", -q1.sin()),
            ("1.5e-3*payload_kg", 9e-3),
            (".5 + 2.", 2.5),
            ("sign(q2) + sign(0)", -1.0),
            ("exp(-time_s/60)", (-2.0_f64).exp()),
            ("abs(sqrt(4) - ln(exp(3))) + tanh(0) + pi", 1.0 + std::f64::consts::PI),
            ("atan(tan(q3))", q3),
            ("q1_before - q2", 0.0),
            ("down_x^2 + down_y^2 + down_z^2", 1.0),
        ] {
            assert!((value(text) - expected).abs() < 1e-12, "{text}: {} against {expected}", value(text));
        }
    }

    #[test]
    fn a_mistake_is_named_with_its_place() {
        for (text, position, remedy) in [
            ("", 1, "complete"),
            ("sin(q3", 7, "close"),
            ("sin q3", 1, "sin(...)"),
            ("sin(q7)", 5, "did you mean"),
            ("q1 +", 5, "complete"),
            ("q1 * * q2", 6, "complete"),
            ("q1**2", 4, "`^`"),
            ("2q1", 2, "`*`"),
            ("(1)(2)", 4, "`*`"),
            ("q1)", 3, "remove"),
            ("-q1^2", 1, "(-a)^b"),
            ("2^3^2", 4, "a^(b^c)"),
            ("1,5*q1", 2, "points"),
            ("q1; q2", 3, "numbers"),
            ("{q1}", 1, "numbers"),
            ("wobble", 1, "variables are"),
            ("1e99*q1", 1, "1.5"),
            ("--q1", 2, "complete"),
        ] {
            let error = Expression::parse(text, 6).expect_err(text);
            assert_eq!(error.position, position, "{text}: {error}");
            assert!(error.remedy.contains(remedy), "{text}: {error}");
        }
        assert!(Expression::parse(&"(".repeat(400), 6).is_err());
        assert!(Expression::parse(&"q1+".repeat(400), 6).is_err());
    }

    #[test]
    fn no_text_does_harm() {
        let mut random = ChaCha8Rng::seed_from_u64(5);
        let pieces = [
            "q1",
            "q6",
            "tau2",
            "approach3",
            "sin",
            "cos(",
            "(",
            "(",
            ")",
            ")",
            "+",
            "-",
            "*",
            "/",
            "^",
            "1",
            "0",
            "2.5",
            "1e3",
            "e",
            ".",
            ",",
            " ",
            "{",
            "}",
            "pi",
            "π",
            "sqrt(",
            "time_s",
            "%",
            "\u{0}",
            "é",
            "_",
            "atan2",
            "9e999",
            "\n",
            "|",
        ];
        let mut read = 0;
        for _ in 0..20_000 {
            let length = random.random_range(0..12);
            let text: String = (0..length).map(|_| pieces[random.random_range(0..pieces.len())]).collect();
            if Expression::parse(&text, 6).is_ok() {
                value(&text.replace("tau2", "q2").replace("approach3", "q3"));
                read += 1;
            }
        }
        assert!(read > 100, "of all those strings only {read} are expressions: the test has lost its teeth");
    }
}
