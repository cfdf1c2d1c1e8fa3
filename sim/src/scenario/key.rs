//! The address of a number in a scenario: `plan.poses_per_ball`, `ball[3].z_mm`, `truth.effects."harmonic1:2".sin_urad`.

use std::fmt;
use std::str::FromStr;

use toml::{Table, Value};

/// A key of a scenario as a path through tables and lists.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Key {
    text: String,
    /// At least one; the first is a name.
    steps: Vec<Step>,
}

/// A key that cannot be read or followed.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum KeyError {
    /// The text is not a key.
    #[error("'{0}' is not a key: names joined by dots, places in lists counted from 0 in brackets")]
    Malformed(String),
    /// The scenario has nothing there.
    #[error("the scenario has nothing at `{0}`")]
    Nothing(Key),
}

#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
enum Step {
    Name(String),
    /// Counted from 0.
    Place(usize),
}

impl fmt::Display for Key {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}

impl FromStr for Key {
    type Err = KeyError;

    fn from_str(text: &str) -> Result<Self, KeyError> {
        let wrong = || KeyError::Malformed(text.into());
        let mut steps = Vec::new();
        let mut rest = text;
        while !rest.is_empty() {
            if let Some(after) = rest.strip_prefix('[').filter(|_| !steps.is_empty()) {
                let (place, after) = after.split_once(']').ok_or_else(wrong)?;
                steps.push(Step::Place(place.parse().map_err(|_| wrong())?));
                rest = after;
                continue;
            }
            if !steps.is_empty() {
                rest = rest.strip_prefix('.').ok_or_else(wrong)?;
            }
            let name = match rest.strip_prefix('"') {
                Some(quoted) => {
                    let (name, after) = quoted.split_once('"').ok_or_else(wrong)?;
                    rest = after;
                    name
                }
                None => {
                    let end = rest.find(['.', '[']).unwrap_or(rest.len());
                    let (name, after) = rest.split_at(end);
                    rest = after;
                    name
                }
            };
            if name.is_empty() {
                return Err(wrong());
            }
            steps.push(Step::Name(name.into()));
        }
        if steps.is_empty() { Err(wrong()) } else { Ok(Key { text: text.into(), steps }) }
    }
}

impl Key {
    /// The top-level table or key of the scenario that contains it.
    pub fn top(&self) -> &str {
        match &self.steps[0] {
            Step::Name(name) => name,
            Step::Place(_) => "",
        }
    }

    /// Compares keys step by step, so that the later of two elements of one list is the greater.
    pub fn order(&self, other: &Key) -> std::cmp::Ordering {
        self.steps.cmp(&other.steps)
    }

    /// The value of the key.
    pub(crate) fn find<'a>(&self, keys: &'a Table) -> Option<&'a Value> {
        let mut steps = self.steps.iter();
        let mut at = match steps.next() {
            Some(Step::Name(name)) => keys.get(name)?,
            _ => return None,
        };
        for step in steps {
            at = match step {
                Step::Name(name) => at.as_table()?.get(name)?,
                Step::Place(k) => at.as_array()?.get(*k)?,
            };
        }
        Some(at)
    }

    pub(crate) fn put(&self, keys: &mut Table, value: Value) -> Result<(), KeyError> {
        let Some((Step::Name(first), steps)) = self.steps.split_first() else { return Err(self.nothing()) };
        let empty = || Value::Table(Table::new());
        let mut at = keys.entry(first.clone()).or_insert_with(empty);
        for step in steps {
            at = match (step, at) {
                (Step::Name(name), Value::Table(table)) => table.entry(name.clone()).or_insert_with(empty),
                (Step::Place(k), Value::Array(list)) if *k < list.len() => &mut list[*k],
                _ => return Err(self.nothing()),
            };
        }
        *at = value;
        Ok(())
    }

    pub(crate) fn take(&self, keys: &mut Table) -> Result<(), KeyError> {
        let Some((last, before)) = self.steps.split_last() else { return Err(self.nothing()) };
        let mut owner: Option<&mut Value> = None;
        for step in before {
            owner = match (step, owner) {
                (Step::Name(name), None) => keys.get_mut(name),
                (Step::Name(name), Some(Value::Table(table))) => table.get_mut(name),
                (Step::Place(k), Some(Value::Array(list))) => list.get_mut(*k),
                _ => None,
            };
            if owner.is_none() {
                return Err(self.nothing());
            }
        }
        match (last, owner) {
            (Step::Name(name), None) => keys.remove(name).map(drop),
            (Step::Name(name), Some(Value::Table(table))) => table.remove(name).map(drop),
            (Step::Place(k), Some(Value::Array(list))) if *k < list.len() => {
                list.remove(*k);
                Some(())
            }
            _ => None,
        }
        .ok_or_else(|| self.nothing())
    }

    fn nothing(&self) -> KeyError {
        KeyError::Nothing(self.clone())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn keys() -> Table {
        "[plan]\nposes = 4\n[[ball]]\nz = 1.0\n[[ball]]\nz = 2.0\n[truth.effects.\"harmonic1:2\"]\nsin = 3.0"
            .parse()
            .expect("TOML")
    }

    fn key(text: &str) -> Key {
        text.parse().expect("a key")
    }

    #[test]
    fn what_is_put_at_a_key_is_found_there_and_nothing_else_moves() {
        for text in ["plan.poses", "ball[1].z", "truth.effects.\"harmonic1:2\".sin", "truth.effects.\"a new one\".cos", "fresh"]
        {
            let mut changed = keys();
            key(text).put(&mut changed, Value::Integer(9)).expect("a place");
            assert_eq!(key(text).find(&changed), Some(&Value::Integer(9)), "{text}");
            key(text).take(&mut changed).expect("was put");
            assert_eq!(key(text).find(&changed), None, "{text}");
        }
        let mut changed = keys();
        key("ball[0]").take(&mut changed).expect("a ball");
        assert_eq!(key("ball[0].z").find(&changed), Some(&Value::Float(2.0)));
    }

    #[test]
    fn what_is_no_key_or_leads_nowhere_is_said() {
        for text in ["", ".", "a.", "[0]", "a[", "a[-1]", "a[x]", "a..b", "\"a", "a[0]b"] {
            assert!(text.parse::<Key>().is_err(), "{text}");
        }
        for text in ["ball[2].z", "plan[0]", "ball.z", "plan.poses.deeper"] {
            assert!(key(text).put(&mut keys(), Value::Integer(1)).is_err(), "{text}");
            assert!(key(text).take(&mut keys()).is_err(), "{text}");
        }
    }
}
