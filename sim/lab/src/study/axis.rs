//! One axis of a sweep, and the changes it makes to a scenario.

use calibench::files::FileError;
use toml::Value;

use super::rows::is_of_every_study;
use calibench_sim::scenario::{AxisToml, CaseToml, Design, Document, Key, KeyError, Scale};

/// Largest accepted number of points; more are a mistake.
pub(super) const MOST_POINTS: usize = 10_000;

/// A validated axis.
pub(super) struct Axis {
    /// Name of its column.
    pub name: String,
    kind: AxisKind,
}

enum AxisKind {
    Values(Key, Vec<Value>),
    Range { key: Key, ends: [f64; 2], levels: usize, scale: Scale, whole: bool },
    Cases(Vec<Case>),
}

struct Case {
    label: String,
    set: Vec<(Key, Value)>,
    /// Later list elements before earlier ones.
    without: Vec<Key>,
}

/// An axis as written in the file, and its location.
struct Written<'a> {
    document: &'a Document,
    /// Counted from 0.
    number: usize,
    design: Design,
}

impl Written<'_> {
    fn wrong(&self, key: &str, problem: impl Into<String>, remedy: &str) -> FileError {
        let dot = if key.is_empty() { "" } else { "." };
        self.document.wrong(&format!("sweep.axis[{}]{dot}{key}", self.number), problem, remedy)
    }

    fn key(&self, at: &str, text: &str) -> Result<Key, FileError> {
        let key: Key = text.parse().map_err(|e: KeyError| self.wrong(at, e.to_string(), "write it as in ball[0].z_mm"))?;
        if ["sweep", "suite", "expect", "format", "name", "question"].contains(&key.top()) {
            let problem = format!("`{text}` changes nothing that is measured");
            return Err(self.wrong(at, problem, "name a key of the cell or of its truth"));
        }
        Ok(key)
    }

    fn values(&self, key: &str, values: &[Value]) -> Result<AxisKind, FileError> {
        if values.is_empty() {
            return Err(self.wrong("values", "is empty", "give at least one value"));
        }
        Ok(AxisKind::Values(self.key("key", key)?, values.to_vec()))
    }

    fn range(&self, text: &str, ends: [f64; 2], steps: Option<usize>, scale: Scale) -> Result<AxisKind, FileError> {
        let key = self.key("key", text)?;
        let [from, to] = ends;
        if from >= to || (scale == Scale::Log && from <= 0.0) {
            let problem = format!("{from} to {to} is not such a range");
            return Err(self.wrong("from", problem, "give from below to, above zero where scale = \"log\""));
        }
        let levels = match (self.design, steps) {
            (Design::Factorial, Some(steps)) if (2..=MOST_POINTS).contains(&steps) => steps,
            (Design::Factorial, _) => return Err(self.wrong("steps", "is missing or out of range", "give at least 2")),
            (Design::Sobol, None) => 0,
            (Design::Sobol, Some(_)) => {
                let remedy = "leave it out: sweep.points says how many there are";
                return Err(self.wrong("steps", "is for a factorial design", remedy));
            }
        };
        let whole = match self.document.get(&key) {
            Some(Value::Integer(_)) => true,
            Some(Value::Float(_)) | None => false,
            Some(_) => {
                let problem = format!("what the scenario has at `{text}` is not a number");
                return Err(self.wrong("key", problem, "give `values` or cases"));
            }
        };
        Ok(AxisKind::Range { key, ends, levels, scale, whole })
    }

    fn case(&self, place: usize, case: &CaseToml) -> Result<Case, FileError> {
        let at = format!("case[{place}]");
        let set = case.set.iter().map(|(key, value)| Ok((self.key(&at, key)?, value.clone())));
        let set = set.collect::<Result<_, FileError>>()?;
        let mut without = case.without.iter().map(|key| self.key(&at, key)).collect::<Result<Vec<_>, _>>()?;
        without.sort_by(|a, b| b.order(a));
        Ok(Case { label: case.label.clone(), set, without })
    }
}

impl Axis {
    /// Validates axis `number` of a scenario.
    pub fn of(document: &Document, number: usize, toml: &AxisToml, design: Design) -> Result<Self, FileError> {
        let written = Written { document, number, design };
        let AxisToml { key, name, values, from, to, steps, scale, cases } = toml;
        let kind = match (key, values, [from, to], cases.is_empty()) {
            (Some(key), Some(values), [None, None], true) if steps.is_none() => written.values(key, values)?,
            (Some(key), None, [Some(from), Some(to)], true) => written.range(key, [*from, *to], *steps, *scale)?,
            (None, None, [None, None], false) if name.is_some() && steps.is_none() => {
                let cases = cases.iter().enumerate().map(|(k, case)| written.case(k, case));
                AxisKind::Cases(cases.collect::<Result<_, _>>()?)
            }
            _ => {
                let remedy =
                    "give a key with values, or a key with from, to and steps, or a name with [[sweep.axis.case]] tables";
                return Err(written.wrong("", "is neither a list of values, nor a range, nor a list of cases", remedy));
            }
        };
        let name = name.clone().or_else(|| key.clone()).unwrap_or_default();
        if is_of_every_study(&name) {
            let problem = format!("is called '{name}', as a column of every study");
            return Err(written.wrong("", problem, "give it another `name`"));
        }
        Ok(Axis { name, kind })
    }

    /// Number of its levels in a factorial design.
    pub fn levels(&self) -> usize {
        match &self.kind {
            AxisKind::Values(_, values) => values.len(),
            AxisKind::Range { levels, .. } => *levels,
            AxisKind::Cases(cases) => cases.len(),
        }
    }

    /// Sets a scenario to the position `place` (0 to 1) on the axis and returns the position's label.
    ///
    /// # Errors
    /// If the scenario lacks the key.
    pub fn apply(&self, place: f64, design: Design, document: &mut Document) -> Result<String, KeyError> {
        let level = |count: usize| ((place * count as f64) as usize).min(count - 1);
        match &self.kind {
            AxisKind::Values(key, values) => {
                let level = level(values.len());
                document.set(key, values[level].clone())?;
                Ok(match &values[level] {
                    Value::Integer(v) => v.to_string(),
                    Value::Float(v) => v.to_string(),
                    Value::String(v) => v.clone(),
                    Value::Boolean(v) => v.to_string(),
                    // A list or table is labelled by its index among the values, from 1.
                    _ => format!("value {}", level + 1),
                })
            }
            AxisKind::Range { key, ends: [from, to], levels, scale, whole } => {
                let share = match design {
                    Design::Factorial => level(*levels) as f64 / (levels - 1) as f64,
                    Design::Sobol => place,
                };
                let value = match scale {
                    Scale::Linear => from + share * (to - from),
                    Scale::Log => from * (to / from).powf(share),
                };
                let value = if *whole { Value::Integer(value.round() as i64) } else { Value::Float(six_digits(value)) };
                document.set(key, value.clone())?;
                Ok(value.to_string())
            }
            AxisKind::Cases(cases) => {
                let case = &cases[level(cases.len())];
                case.set.iter().try_for_each(|(key, value)| document.set(key, value.clone()))?;
                case.without.iter().try_for_each(|key| document.remove(key))?;
                Ok(case.label.clone())
            }
        }
    }
}

/// Rounds a number to the value intended: 0.1 + 2 * 0.1 is 0.3.
fn six_digits(value: f64) -> f64 {
    format!("{value:.5e}").parse().unwrap_or(value)
}
