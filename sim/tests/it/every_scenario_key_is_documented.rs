//! `docs/scenarios.md` describes every key that a scenario accepts, and no others.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use calibench_sim::hidden::UNKNOWN;
use calibench_sim::scenario::{Quantity, ScenarioToml};
use serde::Deserialize;
use serde::de::{DeserializeSeed, Deserializer, Error, IntoDeserializer, MapAccess, SeqAccess, Visitor};
use serde::forward_to_deserialize_any;
use toml::{Table, Value};

/// Keys by table: `truth.tool` -> { `sigma_um` }.
type Keys = BTreeMap<String, BTreeSet<String>>;

/// Deserialises a TOML value, and notes the keys that every table accepts.
struct Noting<'a> {
    table: String,
    value: Value,
    keys: &'a mut Keys,
}

impl<'de> Deserializer<'de> for Noting<'_> {
    type Error = toml::de::Error;

    fn deserialize_struct<V: Visitor<'de>>(
        self,
        _: &'static str,
        fields: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, Self::Error> {
        self.keys.entry(self.table.clone()).or_default().extend(fields.iter().map(|f| (*f).to_owned()));
        self.deserialize_any(visitor)
    }

    fn deserialize_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Self::Error> {
        match self.value {
            Value::Table(table) => visitor.visit_map(Entries {
                table: self.table,
                entries: table.into_iter().collect::<Vec<_>>().into_iter(),
                next: Value::Boolean(false),
                key: String::new(),
                keys: self.keys,
            }),
            Value::Array(values) => {
                visitor.visit_seq(Elements { table: self.table, values: values.into_iter(), keys: self.keys })
            }
            plain => plain.deserialize_any(visitor),
        }
    }

    fn deserialize_option<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Self::Error> {
        visitor.visit_some(self)
    }

    fn deserialize_newtype_struct<V: Visitor<'de>>(self, _: &'static str, visitor: V) -> Result<V::Value, Self::Error> {
        visitor.visit_newtype_struct(self)
    }

    fn deserialize_enum<V: Visitor<'de>>(
        self,
        name: &'static str,
        variants: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, Self::Error> {
        self.value.deserialize_enum(name, variants, visitor)
    }

    forward_to_deserialize_any! {
        bool i8 i16 i32 i64 i128 u8 u16 u32 u64 u128 f32 f64 char str string bytes byte_buf unit unit_struct seq tuple
        tuple_struct map identifier ignored_any
    }
}

struct Entries<'a> {
    table: String,
    entries: std::vec::IntoIter<(String, Value)>,
    key: String,
    next: Value,
    keys: &'a mut Keys,
}

impl<'de> MapAccess<'de> for Entries<'_> {
    type Error = toml::de::Error;

    fn next_key_seed<K: DeserializeSeed<'de>>(&mut self, seed: K) -> Result<Option<K::Value>, Self::Error> {
        let Some((key, value)) = self.entries.next() else { return Ok(None) };
        (self.key, self.next) = (key.clone(), value);
        seed.deserialize(key.into_deserializer()).map(Some)
    }

    fn next_value_seed<V: DeserializeSeed<'de>>(&mut self, seed: V) -> Result<V::Value, Self::Error> {
        let table = if self.table.is_empty() { self.key.clone() } else { format!("{}.{}", self.table, self.key) };
        let value = std::mem::replace(&mut self.next, Value::Boolean(false));
        seed.deserialize(Noting { table, value, keys: self.keys })
    }
}

struct Elements<'a> {
    table: String,
    values: std::vec::IntoIter<Value>,
    keys: &'a mut Keys,
}

impl<'de> SeqAccess<'de> for Elements<'_> {
    type Error = toml::de::Error;

    fn next_element_seed<T: DeserializeSeed<'de>>(&mut self, seed: T) -> Result<Option<T::Value>, Self::Error> {
        let Some(value) = self.values.next() else { return Ok(None) };
        seed.deserialize(Noting { table: self.table.clone(), value, keys: self.keys }).map(Some)
    }
}

fn read(path: &str) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(path);
    std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

/// Keys that a scenario accepts, noted while the cell of the paper is read, which has every table.
fn accepted() -> Result<Keys, toml::de::Error> {
    let mut value: Table = read("scenarios/kr6-trical.toml").parse()?;
    for (key, given) in [("format", "calibench-scenario/1"), ("name", "paper"), ("question", "what can be said?")] {
        value.insert(key.into(), given.into());
    }
    value.insert("seed".into(), 1.into());
    let hidden = UNKNOWN.into_iter().chain(["third_harmonic", "cross_coupled_wrist"]);
    let sized = |name: &str| (name.to_owned(), Value::Table(Table::from_iter([("rms_urad".to_owned(), 60.into())])));
    let mut hidden: Table = hidden.map(sized).collect();
    hidden.insert("moved_ball".into(), Value::Table(Table::from_iter([("ball".to_owned(), "1".into())])));
    value["truth"].as_table_mut().expect("a table").insert("hidden".into(), Value::Table(hidden));
    let mujoco: Table = "pedestal = { x_urad_per_nm = 1.0, y_urad_per_nm = 1.0 }
        bearing = [{ joint = 1, urad_per_nm = 1.0 }]
        friction = [{ joint = 1, torque_nm = 1.0, presliding_urad = 1.0 }]
        stiffening = [{ joint = 1, share = 0.1, at_nm = 1.0 }]
        backlash = [{ joint = 1, width_urad = 1.0 }]"
        .parse()?;
    value["truth"].as_table_mut().expect("a table").insert("mujoco".into(), Value::Table(mujoco));
    let suite: Table = read("scenarios/blind-suite.toml").parse()?;
    value.insert("suite".into(), suite["suite"].clone());
    let sweep: Table = "[[axis]]\nname = 'x'\n[[axis.case]]\nlabel = 'y'".parse()?;
    value.insert("sweep".into(), Value::Table(sweep));
    value.insert("precision".into(), Value::Table(Table::new()));
    value.insert("instrument".into(), Value::Table(Table::new()));
    let design: Table =
        "balls = 3\nmin_mm = [0, 0, 0]\nmax_mm = [1, 1, 1]\nstep_mm = 1.0\nriser_heights_mm = [1.0]\ntable_mm = 0.0".parse()?;
    value.insert("design".into(), Value::Table(design));
    let mut keys = Keys::new();
    ScenarioToml::deserialize(Noting { table: String::new(), value: Value::Table(value), keys: &mut keys })
        .map_err(|e| toml::de::Error::custom(format!("the cell of the paper cannot be read: {e}")))?;
    // This key is removed before the rest is read.
    keys.entry(String::new()).or_default().insert("extends".into());
    Ok(keys)
}

/// Keys described by the page: rows that begin with a key, under headings that name a table.
fn described() -> Keys {
    let mut keys = Keys::new();
    let mut table = None;
    for line in read("docs/scenarios.md").lines() {
        if line.starts_with("## ") {
            let name = line.split('`').nth(1).map(|quoted| quoted.trim_matches(['[', ']']).to_owned());
            table = name.or_else(|| line.contains("itself").then(String::new));
        } else if line.starts_with("### ") {
            table = None;
        } else if let (Some(table), Some(row)) = (&table, line.strip_prefix("| `")) {
            let key = row.split('`').next().unwrap_or_default().to_owned();
            let rest = row.matches('|').count();
            assert!(keys.entry(table.clone()).or_default().insert(key), "[{table}] describes a key twice: {line}");
            assert!(table == "expect" || rest == 5, "[{table}]: unit, default, meaning, source: {line}");
        }
    }
    keys
}

#[test]
fn every_key_accepted_is_described_and_every_key_described_is_accepted() {
    let mut described = described();
    let checks = described.remove("expect").expect("the page describes the checks");
    let accepted = accepted().expect("readable");
    let hidden: BTreeSet<String> = accepted["truth.hidden"].iter().map(|name| format!("truth.hidden.{name}")).collect();
    let noted = accepted.keys().filter(|table| table.starts_with("truth.hidden.")).cloned().collect();
    assert_eq!(hidden, noted, "every hidden flaw is among the ones read here");
    let mujoco: BTreeSet<String> = accepted["truth.mujoco"].iter().map(|name| format!("truth.mujoco.{name}")).collect();
    let noted = accepted.keys().filter(|table| table.starts_with("truth.mujoco.")).cloned().collect();
    assert_eq!(mujoco, noted, "every flaw of the mechanism is among the ones read here");
    described.insert("truth.hidden".into(), accepted["truth.hidden"].clone());
    // Guards against a reader that notes nothing: these three keys are known to exist.
    for (table, key) in [("", "seed"), ("truth.tracker", "nest_shots"), ("solid", "radius_mm")] {
        assert!(accepted[table].contains(key), "the reader did not note {table}.{key}");
    }
    for (table, keys) in &accepted {
        let page = described.get(table).cloned().unwrap_or_default();
        let missing: Vec<_> = keys.difference(&page).collect();
        assert!(missing.is_empty(), "docs/scenarios.md, [{table}]: describe {missing:?}");
    }
    for (table, keys) in &described {
        let real = accepted.get(table).cloned().unwrap_or_default();
        let invented: Vec<_> = keys.difference(&real).collect();
        assert!(invented.is_empty(), "docs/scenarios.md, [{table}]: no scenario accepts {invented:?}");
    }
    assert_eq!(checks, Quantity::ALL.iter().map(|q| q.name().to_owned()).collect(), "docs/scenarios.md, [expect]");
}

#[test]
fn a_key_that_the_unit_names_is_described_in_that_unit() {
    let suffixes = [
        ("_mm", "mm"),
        ("_um", "um"),
        ("_urad", "urad"),
        ("_deg", "deg"),
        ("_arcsec", "arc s"),
        ("_mrad", "mrad"),
        ("_kg", "kg"),
    ];
    for line in read("docs/scenarios.md").lines().filter(|l| l.starts_with("| `")) {
        let cells: Vec<&str> = line.split('|').map(str::trim).collect();
        let key = cells[1].trim_matches('`');
        for (suffix, unit) in suffixes {
            assert!(
                cells.len() < 7 || !key.ends_with(suffix) || cells[2] == unit,
                "unit of {key} is {unit}, not '{}'",
                cells[2]
            );
        }
    }
}
