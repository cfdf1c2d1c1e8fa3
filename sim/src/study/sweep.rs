//! `[sweep]`: the points at which a study is made.

use calibench::files::FileError;
use serde::Deserialize;
use toml::{Table, Value};

use super::key::Key;
use crate::scenario::Document;

/// More points than this are a mistake.
const MOST_POINTS: usize = 10_000;

/// The keys under `[sweep]`.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(missing_docs)] // described in docs/scenarios.md
pub struct SweepToml {
    #[serde(default)]
    pub design: Design,
    pub points: Option<usize>,
    #[serde(rename = "axis")]
    pub axes: Vec<AxisToml>,
}

/// How the points lie.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Design {
    /// Every value of every axis with every value of all others.
    #[default]
    Factorial,
    /// A Sobol sequence, Owen-scrambled: it fills the space evenly with any number of points.
    Sobol,
}

/// One thing that changes from point to point.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(missing_docs)]
pub struct AxisToml {
    pub key: Option<String>,
    pub name: Option<String>,
    pub values: Option<Vec<Value>>,
    pub from: Option<f64>,
    pub to: Option<f64>,
    pub steps: Option<usize>,
    #[serde(default)]
    pub scale: Scale,
    #[serde(rename = "case", default)]
    pub cases: Vec<CaseToml>,
}

/// How a range is divided.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Scale {
    /// By equal differences.
    #[default]
    Linear,
    /// By equal ratios.
    Log,
}

/// Several keys changed at once.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(missing_docs)]
pub struct CaseToml {
    pub label: String,
    #[serde(default)]
    pub set: Table,
    #[serde(default)]
    pub without: Vec<String>,
}

/// One point of a sweep.
#[derive(Debug, Clone)]
pub struct SweepPoint {
    /// The scenario there.
    pub document: Document,
    /// What it is called on each axis: a number, or a label.
    pub at: Vec<String>,
}

/// The axes' names, and every point in order: the last axis changes fastest.
///
/// # Errors
/// One error that names the axis.
pub fn sweep_points(document: &Document, sweep: Option<&SweepToml>) -> Result<(Vec<String>, Vec<SweepPoint>), FileError> {
    let Some(sweep) = sweep else {
        return Ok((Vec::new(), vec![SweepPoint { document: document.clone(), at: Vec::new() }]));
    };
    let wrong = |key: &str, problem: String, remedy: &str| Err(document.wrong(key, problem, remedy));
    if sweep.axes.is_empty() {
        return wrong("sweep", "has no axis".into(), "give at least one [[sweep.axis]]");
    }
    let axes: Vec<Axis> =
        sweep.axes.iter().enumerate().map(|(k, a)| Axis::of(document, k, a, sweep.design)).collect::<Result<_, _>>()?;
    for (k, axis) in axes.iter().enumerate() {
        if axes[..k].iter().any(|other| other.name == axis.name) {
            return wrong(&format!("sweep.axis[{k}]"), format!("is a second one called '{}'", axis.name), "give it a `name`");
        }
    }
    let places: Vec<Vec<f64>> = match (sweep.design, sweep.points) {
        (Design::Factorial, None) => {
            let sizes: Vec<usize> = axes.iter().map(Axis::levels).collect();
            let count = sizes.iter().try_fold(1_usize, |n, &s| n.checked_mul(s)).unwrap_or(usize::MAX);
            if count > MOST_POINTS {
                return wrong(
                    "sweep",
                    format!("has {count} points"),
                    &format!("take at most {MOST_POINTS}, or design = \"sobol\""),
                );
            }
            (0..count).map(|point| factorial(point, &sizes)).collect()
        }
        (Design::Factorial, Some(_)) => {
            return wrong("sweep.points", "is for design = \"sobol\"".into(), "leave it out: the axes say how many there are");
        }
        (Design::Sobol, Some(points)) if (1..=MOST_POINTS).contains(&points) => {
            // Every study of the same axes has the same points, whatever its seed.
            let number = |p: usize, axis: usize| f64::from(sobol_burley::sample(p as u32, axis as u32, 0));
            (0..points).map(|p| (0..axes.len()).map(|axis| number(p, axis)).collect()).collect()
        }
        (Design::Sobol, _) => {
            return wrong("sweep.points", "is missing or out of range".into(), &format!("give 1 to {MOST_POINTS} points"));
        }
    };
    let names = axes.iter().map(|a| a.name.clone()).collect();
    let points = places.iter().map(|place| point(document, &axes, place, sweep.design)).collect::<Result<_, _>>()?;
    Ok((names, points))
}

/// The places on the axes (0 to 1) of the point of that number: in the middle of each level's share.
fn factorial(point: usize, sizes: &[usize]) -> Vec<f64> {
    let mut rest = point;
    let mut places: Vec<f64> = sizes
        .iter()
        .rev()
        .map(|&size| {
            let level = rest % size;
            rest /= size;
            (level as f64 + 0.5) / size as f64
        })
        .collect();
    places.reverse();
    places
}

fn point(document: &Document, axes: &[Axis], place: &[f64], design: Design) -> Result<SweepPoint, FileError> {
    let mut point = SweepPoint { document: document.clone(), at: Vec::with_capacity(axes.len()) };
    for (k, (axis, &place)) in axes.iter().zip(place).enumerate() {
        let label = axis
            .apply(place, design, &mut point.document)
            .map_err(|problem| document.wrong(&format!("sweep.axis[{k}]"), problem, "name a key that the scenario has"))?;
        point.at.push(label);
    }
    Ok(point)
}

/// An axis that has been checked.
struct Axis {
    name: String,
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
    /// Later places of a list before earlier ones.
    without: Vec<Key>,
}

impl Axis {
    fn of(document: &Document, number: usize, toml: &AxisToml, design: Design) -> Result<Self, FileError> {
        let at =
            |key: &str| if key.is_empty() { format!("sweep.axis[{number}]") } else { format!("sweep.axis[{number}].{key}") };
        let wrong = |key: &str, problem: String, remedy: &str| document.wrong(&at(key), problem, remedy);
        let parse = |key: &str, text: &str| -> Result<Key, FileError> {
            let parsed: Key = text.parse().map_err(|e: String| wrong(key, e, "write it as in ball[0].z_mm"))?;
            if ["sweep", "suite", "expect", "format", "name", "question"].contains(&parsed.top()) {
                return Err(wrong(
                    key,
                    format!("`{text}` changes nothing that is measured"),
                    "name a key of the cell or of its truth",
                ));
            }
            Ok(parsed)
        };
        let AxisToml { key, name, values, from, to, steps, scale, cases } = toml;
        let kind = match (key, values, [from, to], cases.is_empty()) {
            (Some(key), Some(values), [None, None], true) if steps.is_none() => {
                if values.is_empty() {
                    return Err(wrong("values", "is empty".into(), "give at least one value"));
                }
                AxisKind::Values(parse("key", key)?, values.clone())
            }
            (Some(text), None, [Some(from), Some(to)], true) => {
                let key = parse("key", text)?;
                if !(from < to) || (*scale == Scale::Log && *from <= 0.0) {
                    return Err(wrong(
                        "from",
                        format!("{from} to {to} is no such range"),
                        "give from below to, above zero where scale = \"log\"",
                    ));
                }
                let levels = match (design, steps) {
                    (Design::Factorial, Some(steps)) if (2..=MOST_POINTS).contains(steps) => *steps,
                    (Design::Sobol, None) => 0,
                    (Design::Factorial, _) => {
                        return Err(wrong("steps", "is missing or out of range".into(), "give at least 2"));
                    }
                    (Design::Sobol, Some(_)) => {
                        return Err(wrong(
                            "steps",
                            "is for a factorial design".into(),
                            "leave it out: sweep.points says how many there are",
                        ));
                    }
                };
                let whole = match document.get(&key) {
                    Some(Value::Integer(_)) => true,
                    Some(Value::Float(_)) | None => false,
                    Some(_) => {
                        return Err(wrong(
                            "key",
                            format!("what the scenario has at `{text}` is no number"),
                            "give `values` or cases",
                        ));
                    }
                };
                AxisKind::Range { key, ends: [*from, *to], levels, scale: *scale, whole }
            }
            (None, None, [None, None], false) if name.is_some() && steps.is_none() => AxisKind::Cases(
                cases
                    .iter()
                    .enumerate()
                    .map(|(c, case)| {
                        let place = format!("case[{c}]");
                        let set = case
                            .set
                            .iter()
                            .map(|(k, v)| Ok((parse(&place, k)?, v.clone())))
                            .collect::<Result<_, FileError>>()?;
                        let mut without =
                            case.without.iter().map(|k| parse(&place, k)).collect::<Result<Vec<_>, FileError>>()?;
                        without.sort_by(|a, b| b.order(a));
                        Ok(Case { label: case.label.clone(), set, without })
                    })
                    .collect::<Result<_, FileError>>()?,
            ),
            _ => {
                let remedy =
                    "give a key with values, or a key with from, to and steps, or a name with [[sweep.axis.case]] tables";
                return Err(wrong("", "is neither a list of values, nor a range, nor a list of cases".into(), remedy));
            }
        };
        Ok(Axis { name: name.clone().or_else(|| key.clone()).unwrap_or_default(), kind })
    }

    /// How many levels it has in a factorial design.
    fn levels(&self) -> usize {
        match &self.kind {
            AxisKind::Values(_, values) => values.len(),
            AxisKind::Range { levels, .. } => *levels,
            AxisKind::Cases(cases) => cases.len(),
        }
    }

    /// Changes a scenario to what it is at that place (0 to 1) of the axis; returns what that is called.
    fn apply(&self, place: f64, design: Design, document: &mut Document) -> Result<String, String> {
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
                    // A list or a table is called by its place among the values, counted from 1.
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

/// A number that is written as it is meant: 0.1 + 2 * 0.1 is 0.3.
fn six_digits(value: f64) -> f64 {
    format!("{value:.5e}").parse().unwrap_or(value)
}
