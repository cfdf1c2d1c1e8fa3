//! Variables of a robot's controller, under their KRL names.

use std::collections::BTreeMap;

use calibench_wire::kuka::{Structure, Value};

/// Highest number of an input or output.
const MOST_SIGNALS: u32 = 4096;

/// Longest name: KRL names have up to 24 characters, and so may their members.
const LONGEST_NAME: usize = 100;

/// Variables and their values. Names are case-insensitive; `NAME.MEMBER` is a member, `NAME[n]` an element.
#[derive(Debug, Clone, Default)]
pub struct Variables {
    values: BTreeMap<String, (Value, Access)>,
}

/// Write access to a variable.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Access {
    /// Writable by everybody.
    Writable,
    /// Writable by everybody, with a number from 0 to 100.
    Percent,
    /// Writable by the controller only.
    ReadOnly,
}

/// Reasons why a variable was not written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NotWritten {
    /// There is no variable of that name.
    Unknown,
    /// It cannot be written, or not with such a value.
    Refused,
}

impl Variables {
    /// Creates a variable, or sets its value as the controller does.
    pub fn put(&mut self, name: &str, value: Value, access: Access) {
        self.values.insert(name.to_ascii_uppercase(), (value, access));
    }

    /// Creates the variables of a list with one `NAME value` per line.
    pub fn put_all(&mut self, list: &str, access: Access) {
        for (name, value) in list.lines().filter_map(|line| line.trim().split_once(' ')) {
            if let Ok(value) = Value::parse(value) {
                self.put(name, value, access);
            }
        }
    }

    /// Returns the value of a variable, an element or a member.
    pub fn get(&self, name: &str) -> Option<Value> {
        let name = canonical(name)?;
        if let Some((value, _)) = self.values.get(&name) {
            return Some(value.clone());
        }
        if is_signal(&name, &["$IN", "$OUT"]) {
            return Some(Value::Bool(false));
        }
        let (whole, member) = name.rsplit_once('.')?;
        self.get(whole)?.structure()?.get(member).cloned()
    }

    /// Writes a variable, an element, a member, or part of a structure.
    ///
    /// # Errors
    /// If there is no such variable, it may not be written, or the value has another type or is out of range.
    pub fn set(&mut self, name: &str, value: &Value) -> Result<(), NotWritten> {
        let name = canonical(name).ok_or(NotWritten::Unknown)?;
        if let Some((old, access)) = self.values.get_mut(&name) {
            if *access == Access::ReadOnly {
                return Err(NotWritten::Refused);
            }
            let new = fit(old, value).ok_or(NotWritten::Refused)?;
            let in_range = *access != Access::Percent || new.number().is_some_and(|share| (0.0..=100.0).contains(&share));
            *old = if in_range { new } else { return Err(NotWritten::Refused) };
            return Ok(());
        }
        if is_signal(&name, &["$OUT"]) {
            let on = fit(&Value::Bool(false), value).ok_or(NotWritten::Refused)?;
            self.put(&name, on, Access::Writable);
            return Ok(());
        }
        let (whole, member) = name.rsplit_once('.').ok_or(NotWritten::Unknown)?;
        let part = Structure { kind: None, members: vec![(member.into(), value.clone())] };
        match self.get(whole) {
            Some(Value::Structure(old)) if old.get(member).is_some() => self.set(whole, &Value::Structure(part)),
            _ => Err(NotWritten::Unknown),
        }
    }
}

fn canonical(name: &str) -> Option<String> {
    let name = name.trim();
    (name.len() <= LONGEST_NAME).then(|| name.to_ascii_uppercase())
}

fn is_signal(name: &str, kinds: &[&str]) -> bool {
    let number = |kind: &&str| name.strip_prefix(*kind)?.strip_prefix('[')?.strip_suffix(']')?.parse::<u32>().ok();
    kinds.iter().find_map(number).is_some_and(|k| (1..=MOST_SIGNALS).contains(&k))
}

/// Converts a new value to the type of the old one: a REAL is a float32, an INT takes no fraction, a structure accepts
/// a subset of its members.
fn fit(old: &Value, new: &Value) -> Option<Value> {
    Some(match (old, new) {
        (Value::Real(_), _) => Value::Real(f64::from(new.number()? as f32)),
        (Value::Integer(_), Value::Real(number)) if number.fract() == 0.0 && number.abs() < 1e9 => {
            Value::Integer(*number as i64)
        }
        (Value::Integer(_), Value::Integer(_))
        | (Value::Bool(_), Value::Bool(_))
        | (Value::Enumerator(_), Value::Enumerator(_))
        | (Value::Text(_), Value::Text(_)) => new.clone(),
        (Value::Structure(old), Value::Structure(new)) => {
            let mut fitted = Vec::with_capacity(new.members.len());
            for (name, value) in &new.members {
                fitted.push((name.clone(), fit(old.get(name)?, value)?));
            }
            let mut whole = old.clone();
            whole.update(&Structure { kind: None, members: fitted }).ok()?;
            Value::Structure(whole)
        }
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table() -> Variables {
        let mut variables = Variables::default();
        variables.put_all(
            "COUNT 0\nRATE 1.5\nPLACE {FRAME: X 1.0, Y 2.0, Z 3.0, A 0.0, B 0.0, C 0.0}\n$NAME[] \"one\"",
            Access::Writable,
        );
        variables.put_all("$MODE #AUT", Access::ReadOnly);
        variables.put_all("$OV_PRO 100", Access::Percent);
        variables
    }

    fn written(name: &str, value: &str) -> Result<String, NotWritten> {
        let mut variables = table();
        variables.set(name, &Value::parse(value).expect("a value"))?;
        Ok(variables.get(name).map(|v| v.to_string()).unwrap_or_default())
    }

    #[test]
    fn values_keep_their_type() {
        assert_eq!(written("count", "3").as_deref(), Ok("3"));
        assert_eq!(written("COUNT", "3.0").as_deref(), Ok("3"));
        assert_eq!(written("COUNT", "3.5"), Err(NotWritten::Refused));
        assert_eq!(written("RATE", "2").as_deref(), Ok("2.0"));
        assert_eq!(written("RATE", "0.1").as_deref(), Ok("0.100000001"));
        assert_eq!(written("$MODE", "#T1"), Err(NotWritten::Refused));
        assert_eq!(written("$name[]", "\"two\"").as_deref(), Ok("\"two\""));
        assert_eq!(written("$OUT[17]", "TRUE").as_deref(), Ok("TRUE"));
        assert_eq!(written("$IN[17]", "TRUE"), Err(NotWritten::Unknown));
        assert_eq!(written("$OUT[5000]", "TRUE"), Err(NotWritten::Unknown));
        assert_eq!(written("NOBODY", "1"), Err(NotWritten::Unknown));
    }

    #[test]
    fn a_percentage_stays_one() {
        for value in ["0", "35", "35.0", "100"] {
            assert!(written("$OV_PRO", value).is_ok(), "{value}");
        }
        for value in ["-1", "101", "1e9", "35.5", "TRUE", "#T1", "\"50\"", "{X 50}"] {
            assert_eq!(written("$OV_PRO", value), Err(NotWritten::Refused), "{value}");
        }
    }

    #[test]
    fn structures_are_written_whole_in_part_and_by_member() {
        let whole = "{FRAME: X 1.0, Y 7.0, Z 3.0, A 0.0, B 0.0, C 0.0}";
        assert_eq!(written("PLACE", "{Y 7}").as_deref(), Ok(whole));
        assert_eq!(written("PLACE", whole).as_deref(), Ok(whole));
        assert_eq!(written("PLACE", "{Q 7}"), Err(NotWritten::Refused));
        assert_eq!(written("PLACE.Y", "7").as_deref(), Ok("7.0"));
        assert_eq!(written("PLACE.Q", "7"), Err(NotWritten::Unknown));
        assert_eq!(written("PLACE.X.Y", "7"), Err(NotWritten::Unknown));
        assert_eq!(table().get("PLACE.Z").map(|v| v.to_string()).as_deref(), Some("3.0"));
        assert_eq!(table().get("$IN[1]"), Some(Value::Bool(false)));
        assert_eq!(table().get("$IN[0]"), None);
    }
}
