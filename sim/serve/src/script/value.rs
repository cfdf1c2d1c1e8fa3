//! The values that a program computes with.

use std::fmt;

use tokio::sync::watch;
use tokio::task::AbortHandle;

use super::trouble::Trouble;

/// The largest size of one value: list elements and characters of text, nested ones included.
pub const MAX_SIZE: usize = 4096;

/// How deep lists may hold lists.
const MAX_NESTING: usize = 16;

/// A value of a program.
#[derive(Debug, Clone, PartialEq, Default)]
pub enum Value {
    /// What a function without a result returns.
    #[default]
    None,
    /// True or False.
    Bool(bool),
    /// A whole number.
    Integer(i64),
    /// A number with a fraction.
    Float(f64),
    /// A text.
    Text(String),
    /// A list; its elements are numbers in nearly all programs.
    List(Vec<Value>),
    /// A position (m) and a rotation vector (rad).
    Pose([f64; 6]),
    /// A thread that the program started.
    Thread(Thread),
}

/// A thread that a program started, running or ended.
#[derive(Debug, Clone)]
pub struct Thread {
    id: u64,
    abort: AbortHandle,
    ended: watch::Receiver<()>,
}

impl PartialEq for Thread {
    fn eq(&self, other: &Self) -> bool {
        self.id == other.id
    }
}

impl Thread {
    pub(crate) fn new(id: u64, abort: AbortHandle, ended: watch::Receiver<()>) -> Self {
        Self { id, abort, ended }
    }

    /// The number of the thread, unique within one run of a program.
    pub fn id(&self) -> u64 {
        self.id
    }

    /// Returns once the thread has ended.
    pub(crate) async fn join(&self) {
        // Nothing is ever sent: the thread owns the sender, so an error says that the thread is gone.
        let mut ended = self.ended.clone();
        while ended.changed().await.is_ok() {}
    }

    /// Ends the thread, and returns once what it was doing has been dropped: the next move must not meet the old one.
    pub(crate) async fn kill(&self) {
        self.abort.abort();
        self.join().await;
    }
}

impl Value {
    /// The number, whole or not.
    pub fn number(&self) -> Option<f64> {
        match self {
            Self::Integer(number) => Some(*number as f64),
            Self::Float(number) => Some(*number),
            _ => None,
        }
    }

    /// The whole number; a fractional number counts if nothing follows its point.
    pub fn integer(&self) -> Option<i64> {
        match self {
            Self::Integer(number) => Some(*number),
            // Up to 2^53 a double holds every whole number.
            Self::Float(number) if number.fract() == 0.0 && number.abs() <= 9_007_199_254_740_992.0 => Some(*number as i64),
            _ => None,
        }
    }

    /// The truth value.
    pub fn boolean(&self) -> Option<bool> {
        match self {
            Self::Bool(truth) => Some(*truth),
            _ => None,
        }
    }

    /// The text.
    pub fn text(&self) -> Option<&str> {
        match self {
            Self::Text(text) => Some(text),
            _ => None,
        }
    }

    /// The numbers of a list or a pose.
    pub fn numbers(&self) -> Option<Vec<f64>> {
        match self {
            Self::List(elements) => elements.iter().map(Self::number).collect(),
            Self::Pose(pose) => Some(pose.to_vec()),
            _ => None,
        }
    }

    /// The pose; a list of six numbers is none, because functions tell joint positions from poses by the type.
    pub fn pose(&self) -> Option<[f64; 6]> {
        match self {
            Self::Pose(pose) => Some(*pose),
            _ => None,
        }
    }

    /// What kind of value it is, for messages.
    pub fn kind(&self) -> &'static str {
        match self {
            Self::None => "nothing",
            Self::Bool(_) => "a truth value",
            Self::Integer(_) => "a whole number",
            Self::Float(_) => "a number",
            Self::Text(_) => "a text",
            Self::List(_) => "a list",
            Self::Pose(_) => "a pose",
            Self::Thread(_) => "a thread",
        }
    }

    /// The value itself if it is of a permitted size: a program in a loop could otherwise fill the memory.
    pub(crate) fn limited(self) -> Result<Self, Trouble> {
        match self.size(MAX_NESTING) {
            Some(size) if size <= MAX_SIZE => Ok(self),
            Some(_) => Err(Trouble::new(format!("a value is larger than {MAX_SIZE} elements or characters"))),
            None => Err(Trouble::new(format!("lists are nested deeper than {MAX_NESTING}"))),
        }
    }

    /// How much it counts of what a program may store.
    pub(crate) fn weight(&self) -> usize {
        self.size(MAX_NESTING).unwrap_or(MAX_SIZE)
    }

    fn size(&self, levels: usize) -> Option<usize> {
        match self {
            Self::Text(text) => Some(text.len().saturating_add(1)),
            Self::List(elements) => {
                let levels = levels.checked_sub(1)?;
                elements.iter().try_fold(1_usize, |total, element| Some(total.saturating_add(element.size(levels)?)))
            }
            _ => Some(1),
        }
    }
}

/// The part of the permitted size that is not used yet, while values are being collected: the sum is checked before it has grown.
pub(crate) struct Allowance {
    left: usize,
}

impl Allowance {
    pub(crate) fn new() -> Self {
        Self { left: MAX_SIZE }
    }

    pub(crate) fn take(&mut self, value: &Value) -> Result<(), Trouble> {
        let left = self.left.checked_sub(value.weight());
        self.left = left.ok_or_else(|| Trouble::new(format!("more than {MAX_SIZE} elements or characters together")))?;
        Ok(())
    }
}

impl fmt::Display for Value {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::None => f.write_str("None"),
            Self::Bool(true) => f.write_str("True"),
            Self::Bool(false) => f.write_str("False"),
            Self::Integer(number) => write!(f, "{number}"),
            Self::Float(number) => f.write_str(&six_digits(*number)),
            Self::Text(text) => f.write_str(text),
            Self::List(elements) => {
                let elements: Vec<String> = elements.iter().map(ToString::to_string).collect();
                write!(f, "[{}]", elements.join(", "))
            }
            Self::Pose(pose) => write!(f, "p[{}]", pose.map(six_digits).join(", ")),
            Self::Thread(thread) => write!(f, "thread {}", thread.id),
        }
    }
}

/// Six significant digits, as the controller writes numbers into texts.
fn six_digits(number: f64) -> String {
    if !number.is_finite() {
        return number.to_string();
    }
    let scientific = format!("{number:.5e}");
    let (mantissa, exponent) = scientific.split_once('e').unwrap_or((&scientific, "0"));
    let exponent: i32 = exponent.parse().unwrap_or(0);
    if !(-4..6).contains(&exponent) {
        let sign = if exponent < 0 { '-' } else { '+' };
        return format!("{}e{sign}{:02}", without_zeros(mantissa), exponent.unsigned_abs());
    }
    let decimals = usize::try_from(5 - exponent).unwrap_or(0);
    without_zeros(&format!("{number:.decimals$}")).to_owned()
}

fn without_zeros(digits: &str) -> &str {
    if digits.contains('.') { digits.trim_end_matches('0').trim_end_matches('.') } else { digits }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_written_with_six_digits() {
        let texts = [2.123_456_123, 10.0, 0.0, -0.5, 1.0e-7, 1.0e9, 123_456.7].map(|number| Value::Float(number).to_string());
        assert_eq!(texts, ["2.12346", "10", "0", "-0.5", "1e-07", "1e+09", "123457"]);
        assert_eq!(Value::Pose([1.0, 2.0, 0.0, 0.0, 0.25, 0.0]).to_string(), "p[1, 2, 0, 0, 0.25, 0]");
        assert_eq!(Value::List(vec![Value::Bool(true), Value::Integer(3)]).to_string(), "[True, 3]");
    }

    #[test]
    fn sizes_are_limited() {
        assert!(Value::Text("x".repeat(MAX_SIZE)).limited().is_err());
        let mut nested = Value::List(Vec::new());
        for _ in 0..MAX_NESTING {
            nested = Value::List(vec![nested]);
        }
        assert!(nested.limited().is_err());
    }
}
