//! Values of KRL variables as text: as shown by the controller, and as accepted by it.

use std::fmt;

use thiserror::Error;

/// Longest text accepted as a value, bytes: a position with all its external axes has 200.
const LONGEST_VALUE: usize = 4096;

/// Deepest nesting of structures: a KRL path point has two levels, more is not a value of this kind.
const DEEPEST: usize = 4;

/// A value of a KRL variable.
#[derive(Debug, Clone, PartialEq)]
pub enum Value {
    /// INT, also when written `'B010'` or `'H1F'`.
    Integer(i64),
    /// REAL, stored by the controller as a float32.
    Real(f64),
    /// BOOL.
    Bool(bool),
    /// An enumerator without its `#`, e.g. `T1` of `$MODE_OP`.
    Enumerator(String),
    /// CHAR\[\], without the quotes.
    Text(String),
    /// E6AXIS, E6POS, FRAME and similar.
    Structure(Structure),
}

/// Named members and the name of their type.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Structure {
    /// Type, e.g. `E6POS`; servers show it, clients may omit it.
    pub kind: Option<String>,
    /// Members in the order of the text.
    pub members: Vec<(String, Value)>,
}

/// Reason why text is not a value.
#[derive(Debug, Error, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub enum ValueError {
    /// The text is longer than any value.
    #[error("{length} bytes are too long for a value")]
    TooLong {
        /// Length, bytes.
        length: usize,
    },
    /// The text is not a value.
    #[error("'{text}' is not a KRL value")]
    NotAValue {
        /// The text.
        text: String,
    },
    /// A structure has no such member.
    #[error("there is no member '{member}'")]
    NoSuchMember {
        /// Name of the member.
        member: String,
    },
}

impl Value {
    /// Parses a value: the type name of a structure is optional, and blanks are allowed anywhere between words.
    ///
    /// # Errors
    /// When the text is not a value.
    pub fn parse(text: &str) -> Result<Self, ValueError> {
        if text.len() > LONGEST_VALUE {
            return Err(ValueError::TooLong { length: text.len() });
        }
        value(text.trim(), 0).ok_or_else(|| ValueError::NotAValue { text: text.trim().into() })
    }

    /// The value as a number, if it is one.
    pub fn number(&self) -> Option<f64> {
        match self {
            Value::Integer(whole) => Some(*whole as f64),
            Value::Real(number) => Some(*number),
            _ => None,
        }
    }

    /// The value as a structure, if it is one.
    pub fn structure(&self) -> Option<&Structure> {
        match self {
            Value::Structure(structure) => Some(structure),
            _ => None,
        }
    }
}

impl Structure {
    /// Creates a structure of numbers, e.g. an E6AXIS.
    pub fn of_reals<'a>(kind: &str, members: impl IntoIterator<Item = (&'a str, f64)>) -> Self {
        let members = members.into_iter().map(|(name, number)| (name.to_owned(), Value::Real(number))).collect();
        Structure { kind: Some(kind.into()), members }
    }

    /// Returns a member by its name; KRL ignores case.
    pub fn get(&self, member: &str) -> Option<&Value> {
        self.members.iter().find(|(name, _)| name.eq_ignore_ascii_case(member)).map(|(_, value)| value)
    }

    /// Returns these members as numbers; `None` unless all are.
    pub fn numbers<const N: usize>(&self, members: [&str; N]) -> Option<[f64; N]> {
        let mut numbers = [0.0; N];
        for (number, member) in numbers.iter_mut().zip(members) {
            *number = self.get(member)?.number()?;
        }
        Some(numbers)
    }

    /// Takes over the members named in `partial`; the others keep their values, as when the controller is sent part of a
    /// structure.
    ///
    /// # Errors
    /// [`ValueError::NoSuchMember`], and then nothing is changed.
    pub fn update(&mut self, partial: &Structure) -> Result<(), ValueError> {
        if let Some((member, _)) = partial.members.iter().find(|(name, _)| self.get(name).is_none()) {
            return Err(ValueError::NoSuchMember { member: member.clone() });
        }
        for (name, value) in &mut self.members {
            if let Some(new) = partial.get(name) {
                *value = new.clone();
            }
        }
        Ok(())
    }
}

impl fmt::Display for Value {
    /// Formats as KSS 8 does.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Value::Integer(whole) => write!(f, "{whole}"),
            Value::Real(number) => f.write_str(&real(*number)),
            Value::Bool(yes) => f.write_str(if *yes { "TRUE" } else { "FALSE" }),
            Value::Enumerator(name) => write!(f, "#{name}"),
            Value::Text(text) => write!(f, "\"{text}\""),
            Value::Structure(structure) => structure.fmt(f),
        }
    }
}

impl fmt::Display for Structure {
    /// Formats as KSS 8 does: `{E6AXIS: A1 0.0, A2 -90.0}`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("{")?;
        if let Some(kind) = &self.kind {
            write!(f, "{kind}: ")?;
        }
        for (k, (name, value)) in self.members.iter().enumerate() {
            write!(f, "{}{name} {value}", if k == 0 { "" } else { ", " })?;
        }
        f.write_str("}")
    }
}

/// Formats a REAL as KSS 8 does: the nearest float32, nine significant digits as by C's `%.9g`, `.0` after whole numbers.
///
/// Reproduces the digits of captured replies (1339.905 is shown as 1339.90503).
fn real(number: f64) -> String {
    // The controller cannot hold a value outside the range of a float32 either; the nearest one it holds is shown.
    let number = f64::from(number.clamp(f64::from(f32::MIN), f64::from(f32::MAX)) as f32);
    if !number.is_finite() {
        return "0.0".into();
    }
    let scientific = format!("{number:.8e}");
    let (digits, exponent) = scientific.split_once('e').unwrap_or((&scientific, "0"));
    let exponent: i32 = exponent.parse().unwrap_or(0);
    let trimmed = |text: &str| text.trim_end_matches('0').trim_end_matches('.').to_owned();
    if !(-4..9).contains(&exponent) {
        let sign = if exponent < 0 { '-' } else { '+' };
        return format!("{}e{sign}{:02}", trimmed(digits), exponent.abs());
    }
    let decimals = usize::try_from(8 - exponent).unwrap_or(0);
    let fixed = format!("{number:.decimals$}");
    let short = if fixed.contains('.') { trimmed(&fixed) } else { fixed };
    if short.contains('.') { short } else { format!("{short}.0") }
}

fn value(text: &str, depth: usize) -> Option<Value> {
    if let Some(inside) = text.strip_prefix('{') {
        return structure(inside.strip_suffix('}')?, depth).map(Value::Structure);
    }
    if let Some(name) = text.strip_prefix('#') {
        return is_name(name).then(|| Value::Enumerator(name.into()));
    }
    if let Some(inside) = text.strip_prefix('"') {
        let inside = inside.strip_suffix('"')?;
        return (!inside.contains('"')).then(|| Value::Text(inside.into()));
    }
    if let Some(inside) = text.strip_prefix('\'') {
        let inside = inside.strip_suffix('\'')?;
        let (base, digits) = inside.split_at_checked(1)?;
        let radix = match base {
            "B" | "b" => 2,
            "H" | "h" => 16,
            _ => return None,
        };
        return digits
            .bytes()
            .all(|b| b.is_ascii_hexdigit())
            .then(|| i64::from_str_radix(digits, radix).ok())?
            .map(Value::Integer);
    }
    if text.eq_ignore_ascii_case("TRUE") || text.eq_ignore_ascii_case("FALSE") {
        return Some(Value::Bool(text.eq_ignore_ascii_case("TRUE")));
    }
    // The parser of floats accepts "inf" and "nan"; no number of KRL begins with a letter.
    if !text.starts_with(|c: char| c.is_ascii_digit() || matches!(c, '+' | '-' | '.')) || text.contains(['n', 'N', 'i', 'I']) {
        return None;
    }
    if let Ok(whole) = text.parse() {
        return Some(Value::Integer(whole));
    }
    text.parse().ok().filter(|number: &f64| number.is_finite()).map(Value::Real)
}

fn structure(text: &str, depth: usize) -> Option<Structure> {
    if depth == DEEPEST {
        return None;
    }
    // The name of the type ends at a colon before the first blank, comma or brace.
    let (kind, text) = match text.split_once(':') {
        Some((kind, rest)) if is_name(kind.trim()) => (Some(kind.trim().to_owned()), rest),
        _ => (None, text),
    };
    let mut members = Vec::new();
    if !text.trim().is_empty() {
        for member in split_members(text)? {
            let (name, rest) = member.trim().split_once(char::is_whitespace)?;
            if !is_name(name.strip_suffix("[]").unwrap_or(name)) {
                return None;
            }
            members.push((name.to_owned(), value(rest.trim(), depth + 1)?));
        }
    }
    Some(Structure { kind, members })
}

/// Splits at the commas outside inner structures and texts.
fn split_members(text: &str) -> Option<Vec<&str>> {
    let (mut braces, mut quoted, mut start) = (0_usize, false, 0);
    let mut members = Vec::new();
    for (k, byte) in text.bytes().enumerate() {
        match byte {
            b'"' => quoted = !quoted,
            b'{' if !quoted => braces += 1,
            b'}' if !quoted => braces = braces.checked_sub(1)?,
            b',' if !quoted && braces == 0 => {
                members.push(&text[start..k]);
                start = k + 1;
            }
            _ => {}
        }
    }
    members.push(&text[start..]);
    (braces == 0 && !quoted).then_some(members)
}

fn is_name(text: &str) -> bool {
    text.starts_with(|c: char| c.is_ascii_alphabetic() || matches!(c, '$' | '_'))
        && text.chars().all(|c| c.is_ascii_alphanumeric() || matches!(c, '$' | '_'))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reals_are_shown_as_captured() {
        for (number, shown) in [
            (1339.905, "1339.90503"),
            (284.994_965, "284.994965"),
            (-694.394_653, "-694.394653"),
            (41.247_829_4, "41.2478294"),
            (-0.019_154_319_5, "-0.0191543195"),
            (179.992_111, "179.992111"),
            (0.0, "0.0"),
            (-90.0, "-90.0"),
            (100.0, "100.0"),
            (1e-5, "9.99999975e-06"),
            (1e10, "1e+10"),
            (1e12, "9.99999996e+11"),
        ] {
            assert_eq!(real(number), shown);
        }
    }

    #[test]
    fn what_is_shown_is_read_back() {
        let text = "{E6POS: X 284.994965, Y -694.394653, Z 41.2478294, A 131.430344, B -0.0191543195, C 179.992111, S 2, T 10, E1 0.0}";
        let value = Value::parse(text).unwrap_or(Value::Bool(false));
        assert_eq!(value.to_string(), text);
    }
}
