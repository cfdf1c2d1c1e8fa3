//! Writing of `samples.csv`: the columns filled by some sample, in a fixed order.

use super::columns::Column;
use super::{Dataset, Measured, Sample, SampleSet};
use crate::units::{DEG, MM, UM, readable};

/// The content of the file with a dataset's samples.
pub(super) fn samples_text(dataset: &Dataset) -> Result<Vec<u8>, csv::Error> {
    let used: Vec<Column> = Column::all(&dataset.robot)
        .into_iter()
        .filter(|column| match column {
            Column::Id | Column::Kind => true,
            column => dataset.samples.iter().any(|s| !cell(dataset, s, *column).is_empty()),
        })
        .collect();
    let mut writer = csv::Writer::from_writer(Vec::new());
    writer.write_record(used.iter().map(|c| c.name()).chain(dataset.extra_columns.iter().cloned()))?;
    for sample in &dataset.samples {
        writer.write_record(used.iter().map(|c| cell(dataset, sample, *c)).chain(sample.extra.iter().cloned()))?;
    }
    writer.into_inner().map_err(|e| e.into_error().into())
}

/// Text for a column of a sample; empty if it has none. A name that is not in the dataset is written as its index.
fn cell(dataset: &Dataset, sample: &Sample, column: Column) -> String {
    fn name<'a>(list: impl Iterator<Item = &'a str>, place: usize) -> String {
        let mut list = list;
        list.nth(place).map_or_else(|| format!("#{place}"), str::to_owned)
    }
    fn of<T>(list: Option<&[T]>, k: usize, show: impl Fn(&T) -> String) -> String {
        list.and_then(|l| l.get(k)).map(show).unwrap_or_default()
    }
    let signs = |list: Option<&[i8]>, k| of(list, k, i8::to_string);
    let numbers = |list: Option<&[f64]>, k, unit| of(list, k, |v| number(*v, unit));
    match (column, &sample.measured) {
        (Column::Id, _) => sample.id.clone(),
        (Column::Kind, Measured::Ball { .. }) => "ball".into(),
        (Column::Kind, Measured::Point(_)) if sample.orientation.is_some() => "pose".into(),
        (Column::Kind, Measured::Point(_)) => "point".into(),
        (Column::Kind, Measured::Distance { .. }) => "distance".into(),
        (Column::Joint(k), _) => numbers(Some(&sample.q), k, DEG),
        (Column::Slide(k), _) => numbers(Some(&sample.q), k, MM),
        (Column::Ball, Measured::Ball { ball, .. }) => name(dataset.balls.iter().map(|b| b.id.as_str()), *ball),
        (Column::Target, _) => {
            sample.tool_target.map_or_else(String::new, |r| name(dataset.tool_targets.iter().map(|r| r.id.as_str()), r))
        }
        (Column::Reading(k), Measured::Ball { reading: Some(r), .. }) => number(r[k], UM),
        (Column::World(k), Measured::Point(p)) => number(p[k], MM),
        (Column::Rotation(k), _) => sample.orientation.map_or_else(String::new, |o| number(o.rotation[k], DEG)),
        (Column::Anchor, Measured::Distance { anchor, .. }) => name(dataset.anchors.iter().map(|a| a.id.as_str()), *anchor),
        (Column::Distance, Measured::Distance { distance, .. }) => number(*distance, MM),
        (Column::Set, _) if sample.set == SampleSet::Validation => "validation".into(),
        (Column::Payload, _) if sample.payload > 0 => name(dataset.payloads.iter().map(|p| p.name.as_str()), sample.payload),
        (Column::Time, _) => sample.time_s.map(|t| number(t, 1.0)).unwrap_or_default(),
        (Column::Temperature, _) => sample.temp_c.map(|t| number(t, 1.0)).unwrap_or_default(),
        (Column::Approach(k), _) => signs(sample.approach.as_deref(), k),
        (Column::Plunger(k), _) => signs(sample.plungers.as_ref().map(<[i8; 3]>::as_slice), k),
        (Column::Posture, _) => sample.posture.clone().unwrap_or_default(),
        (Column::Repeat, _) => sample.repeat.clone().unwrap_or_default(),
        (Column::Session, _) => sample.session.clone().unwrap_or_default(),
        (Column::Commanded(k), _) => numbers(sample.q_commanded.as_deref(), k, DEG),
        (Column::CommandedPoint(k), _) => sample.commanded.map_or_else(String::new, |p| number(p[k], MM)),
        (Column::CommandedSlide(k), _) => numbers(sample.q_commanded.as_deref(), k, MM),
        (Column::Torque(k) | Column::Force(k), _) => numbers(sample.tau.as_deref(), k, 1.0),
        (Column::Sigma, _) => sample.sigma.map(|s| number(s, UM)).unwrap_or_default(),
        (Column::SigmaOrientation, _) => sample.orientation.and_then(|o| o.sigma).map_or_else(String::new, |s| number(s, DEG)),
        (Column::Ball | Column::Reading(_) | Column::World(_) | Column::Anchor | Column::Distance, _) => String::new(),
        (Column::Set | Column::Payload, _) => String::new(),
    }
}

/// Formats a quantity as a decimal number, in scientific notation where plain digits would be unreadable.
pub(crate) fn number(si: f64, unit: f64) -> String {
    let value = readable(si, unit);
    let size = value.abs();
    if size == 0.0 || (1e-7..1e15).contains(&size) { format!("{value}") } else { format!("{value:e}") }
}
