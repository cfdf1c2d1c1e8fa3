//! Reads a table of measurements row by row through a column map.

use std::collections::HashMap;
use std::collections::hash_map::Entry;
use std::io::BufRead;
use std::path::Path;

use csv::StringRecord;
use nalgebra::{Rotation3, Vector3};
use sha2::{Digest, Sha256};

use super::column_map::{ColumnMap, ColumnName, MappedColumn, MappedRotation, Measure, Source};
use super::flange_pose::JointsOfFlange;
use super::rotation::RotationForm;
use super::row_order::timestamp;
use super::source::{finite_number, open_source};
use super::{ImportError, ImportReport, Skipped};
use crate::files::{FileError, Record, Rows};
use crate::measure::dataset::Dataset;
use crate::measure::dataset::columns::Column;
use crate::measure::dataset::samples_file::Row;
use crate::measure::dataset::samples_header::Header;
use crate::measure::dataset::samples_text::number;
use crate::robot::{Pose, Robot};
use crate::units::{DEG, MM, UM};

/// Positions of the numbers of a source in a row.
struct Places {
    column: Option<usize>,
    minus: Option<usize>,
}

/// A file of measurements.
pub(super) struct TableFile<'a> {
    /// Its path.
    pub path: &'a Path,
    /// Label of its rows: ids are `label:line`.
    pub label: &'a str,
    /// Columns of the dataset that are the same in every row.
    pub constants: &'a [(Column, String)],
    /// Its text with the files that are joined to it.
    pub joined: Option<&'a [u8]>,
}

impl TableFile<'_> {
    fn open(&self, map: &ColumnMap) -> Result<Box<dyn BufRead + '_>, FileError> {
        match self.joined {
            Some(text) => Ok(Box::new(text)),
            None => open_source(self.path, map.layout()),
        }
    }
}

/// Reads the rows of a file into `dataset`: a sample for each point of the tool that a row measures.
pub(super) fn read_table(
    table: &TableFile<'_>,
    map: &ColumnMap,
    dataset: &mut Dataset,
    report: &mut ImportReport,
) -> Result<(), ImportError> {
    let &TableFile { path, label, .. } = table;
    let mut rows = Rows::new(table.open(map)?, path, map.delimiter)
        .starting_at(1 + if table.joined.is_none() { map.skip_lines } else { 0 });
    let titles = if map.header { rows.next()? } else { None };
    let titles: Option<Vec<String>> = titles.map(|t| t.fields.iter().map(|t| t.trim().to_owned()).collect());
    let maps = map.by_point();
    let robot = dataset.robot.clone();
    let reader = |(of, map)| PointReader::new(table, of, map, titles.as_deref(), &robot);
    let mut readers = maps.iter().map(|(of, map)| reader((*of, map))).collect::<Result<Vec<_>, FileError>>()?;
    let first = dataset.samples.len();
    let (mut read, mut kept, mut first_reason, mut dated) = (0, 0, None, true);
    while let Some(source) = rows.next()? {
        read += 1;
        let mut problem = None;
        let before = dataset.samples.len();
        for reader in &mut readers {
            match reader.fields(label, &source) {
                Ok(Some(fields)) => {
                    dated &= reader.row.is_dated(&fields);
                    let record = Record { line: source.line, fields: StringRecord::from(fields), cut: false };
                    dataset.samples.push(Row { path, header: &reader.header, record: &record }.sample(dataset)?);
                }
                Ok(None) => {}
                Err(reason) => problem = problem.or(Some(reason)),
            }
        }
        kept += usize::from(dataset.samples.len() > before);
        if let Some(reason) = problem {
            first_reason.get_or_insert_with(|| reason.clone());
            report.skipped.push(Skipped { path: path.into(), line: source.line, reason });
        }
    }
    if kept == 0 {
        let reason = first_reason.unwrap_or_else(|| "there is none".into());
        return Err(ImportError::NothingKept { path: path.into(), rows: read, reason });
    }
    report.rows_read += read;
    report.rows_kept += kept;
    let timed = map.columns.iter().any(|m| m.measure == Some(Measure::Timestamp));
    if timed && !dated {
        dataset.samples[first..].iter_mut().for_each(|s| s.time_s = None);
        report.notes.push(format!("{}: its times of day are not whole, so its rows have no time", path.display()));
    } else if timed {
        let begun = dataset.samples[first..].iter().filter_map(|s| s.time_s).fold(f64::INFINITY, f64::min);
        dataset.samples[first..].iter_mut().for_each(|s| s.time_s = s.time_s.map(|t| t - begun));
    }
    dataset.extra_columns = map.extra.iter().map(|(name, _)| name.clone()).collect();
    Ok(())
}

/// Reads what a row of the file says of one point of the tool.
struct PointReader<'a> {
    /// Name of the point; `None` for the TCP.
    of: Option<&'a str>,
    row: RowReader<'a>,
    /// Text of the columns that are the same in every row, after those of the map.
    constants: Vec<String>,
    /// Computes the joints from the pose of the flange, if there is no column of joints.
    flange: Option<JointsOfFlange<'a>>,
    own_id: bool,
    header: Header,
    /// Lines by their fields.
    /// Line of every row so far, by the digest of its fields.
    seen: HashMap<Digest128, usize>,
}

impl<'a> PointReader<'a> {
    fn new(
        table: &TableFile<'_>,
        of: Option<&'a str>,
        map: &'a ColumnMap,
        titles: Option<&[String]>,
        robot: &'a Robot,
    ) -> Result<Self, FileError> {
        let flange = map.flange.as_ref().map(|flange| JointsOfFlange::new(flange, robot));
        let place = |source: &Source| place(table.path, titles, source);
        let row = RowReader {
            map,
            columns: map.columns.iter().map(|m| place(&m.source)).collect::<Result<_, FileError>>()?,
            rotation: map.rotation.iter().flat_map(|r| &r.numbers).map(|(s, _)| place(s)).collect::<Result<_, FileError>>()?,
            flange: [
                map.flange.iter().flat_map(|f| &f.position).map(|m| place(&m.source)).collect::<Result<_, FileError>>()?,
                map.flange.iter().flat_map(|f| &f.rotation.numbers).map(|(s, _)| place(s)).collect::<Result<_, FileError>>()?,
            ],
            extra: map.extra.iter().map(|(_, source)| place(source)).collect::<Result<_, FileError>>()?,
            titled: titles.map_or(usize::MAX, <[String]>::len),
        };
        let own_id = !map.fills(Column::Id);
        let given = table.constants.iter().filter(|(c, _)| !map.fills(*c));
        let named = of.map(|name| (Column::Target, name.to_owned()));
        // A row has one orientation: its further points are points.
        let kind = |(column, text)| match column {
            Column::Kind if of.is_some() => (column, "point".into()),
            _ => (column, text),
        };
        let (constant, constants): (Vec<Column>, Vec<String>) = given.cloned().map(kind).chain(named).unzip();
        let mapped = map.columns.iter().map(|m| m.column);
        let rotation = (0..if map.rotation.is_some() { 3 } else { 0 }).map(Column::Rotation);
        let joints = (0..if flange.is_some() { robot.joints() } else { 0 }).map(Column::Joint);
        let columns: Vec<Column> =
            mapped.chain(rotation).chain(joints).chain(constant).chain(own_id.then_some(Column::Id)).collect();
        let names: Vec<String> = map.extra.iter().map(|(name, _)| name.clone()).collect();
        let header = Header::new(&columns, &names);
        Ok(PointReader { of, row, constants, flange, own_id, header, seen: HashMap::new() })
    }

    /// The fields of the sample in the order of the header, `None` if the point was not measured in this row, or the reason why
    /// the row cannot be used.
    fn fields(&mut self, label: &str, source: &Record) -> Result<Option<Vec<String>>, String> {
        if self.of.is_some() && self.row.is_without_position(&source.fields) {
            return Ok(None);
        }
        let name = |reason: String| self.of.map_or(reason.clone(), |of| format!("target {of}: {reason}"));
        let mut fields = self.row.fields(&source.fields).map_err(name)?;
        match self.seen.entry(digest(&fields)) {
            Entry::Occupied(first) => return Err(format!("the same as line {}", first.get())),
            Entry::Vacant(place) => _ = place.insert(source.line),
        }
        if let Some(flange) = &mut self.flange {
            fields.extend(flange.at(&self.row.flange(&source.fields)?)?);
        }
        let suffix = self.of.map(|of| format!("/{of}")).unwrap_or_default();
        if let Some(id) = self.row.map.columns.iter().position(|m| m.column == Column::Id) {
            fields[id].push_str(&suffix);
        }
        fields.extend(self.constants.iter().cloned());
        fields.extend(self.own_id.then(|| format!("{label}:{}{suffix}", source.line)));
        fields.extend(self.row.extra_fields(&source.fields));
        Ok(Some(fields))
    }
}

/// Half a SHA-256: a million rows have two of the same by chance once in 10^26 files, and it takes a twentieth of their memory.
type Digest128 = [u8; 16];

fn digest(fields: &[String]) -> Digest128 {
    let mut hash = Sha256::new();
    for field in fields {
        hash.update((field.len() as u64).to_le_bytes());
        hash.update(field);
    }
    let mut half = Digest128::default();
    half.copy_from_slice(&hash.finalize()[..16]);
    half
}

/// Turns a row of the file into the fields of a dataset.
struct RowReader<'a> {
    map: &'a ColumnMap,
    /// Places of the mapped columns.
    columns: Vec<Places>,
    /// Places of the numbers of the orientation.
    rotation: Vec<Places>,
    /// Places of the coordinates of the flange, and of the numbers of its orientation.
    flange: [Vec<Places>; 2],
    /// Places of the extra columns.
    extra: Vec<Places>,
    /// Number of columns with a title.
    titled: usize,
}

impl RowReader<'_> {
    /// The mapped columns, or the reason why the row cannot be used.
    fn fields(&self, source: &StringRecord) -> Result<Vec<String>, String> {
        if source.iter().skip(self.titled).any(|field| !field.trim().is_empty()) {
            return Err(format!("it has {} fields, the header {}", source.len(), self.titled));
        }
        let mapped = self.map.columns.iter().zip(&self.columns);
        let mapped = mapped.map(|(mapped, places)| value(source, places, mapped, self.map.decimal));
        let mut fields: Vec<String> = mapped.collect::<Result<_, String>>()?;
        if let Some(rotation) = &self.map.rotation {
            let vector = vector_of(source, &self.rotation, rotation, self.map.decimal)?;
            if rotation.inverse {
                self.invert_position(&mut fields, &Rotation3::new(vector))?;
            }
            let vector = if rotation.inverse { -vector } else { vector };
            fields.extend(vector.iter().map(|angle| number(*angle, DEG)));
        }
        Ok(fields)
    }

    /// The pose of the flange as stated, from which the joints are computed.
    fn flange(&self, source: &StringRecord) -> Result<Pose, String> {
        let [position, rotation] = &self.flange;
        let map = self.map.flange.as_ref().ok_or("there is no pose of the flange")?;
        let mut at = Vector3::zeros();
        for (k, (mapped, places)) in map.position.iter().zip(position).enumerate() {
            let text = value(source, places, mapped, self.map.decimal)?;
            at[k] = text.parse::<f64>().map_err(|_| "the position of the flange is empty")? * MM;
        }
        let turned = vector_of(source, rotation, &map.rotation, self.map.decimal)?;
        Ok(Pose::from_parts(at.into(), Rotation3::new(turned)))
    }

    /// Replaces the position of the world in the tool by that of the tool in the world.
    fn invert_position(&self, fields: &mut [String], tool_from_world: &Rotation3<f64>) -> Result<(), String> {
        let places = [0, 1, 2].map(|k| self.map.columns.iter().position(|m| m.column == Column::World(k)));
        let mut at = Vector3::zeros();
        for (k, place) in places.iter().enumerate() {
            let text = place.and_then(|p| fields.get(p)).ok_or("there is no position")?;
            at[k] = text.parse().map_err(|_| "the position is empty")?;
        }
        let at = -(tool_from_world.inverse() * at);
        for (place, coordinate) in places.iter().zip(at.iter()) {
            place.and_then(|p| fields.get_mut(p)).into_iter().for_each(|field| *field = number(*coordinate, 1.0));
        }
        Ok(())
    }

    /// True if the position is empty.
    fn is_without_position(&self, source: &StringRecord) -> bool {
        let is_empty = |p: &Places| p.column.and_then(|k| source.get(k)).is_none_or(|text| text.trim().is_empty());
        let mut mapped = self.map.columns.iter().zip(&self.columns);
        mapped.all(|(mapped, places)| !matches!(mapped.column, Column::World(_)) || is_empty(places))
    }

    /// True if every time of day in the fields of a row is whole.
    fn is_dated(&self, fields: &[String]) -> bool {
        let mut mapped = self.map.columns.iter().zip(fields);
        mapped.all(|(mapped, text)| mapped.measure != Some(Measure::Timestamp) || !text.is_empty())
    }

    /// The extra columns.
    fn extra_fields<'s>(&'s self, source: &'s StringRecord) -> impl Iterator<Item = String> + 's {
        let text = |p: &Places| p.column.and_then(|k| source.get(k)).unwrap_or_default().trim();
        self.extra.iter().map(move |p| text(p).replace(self.map.decimal, "."))
    }
}

/// The rotation vector of a rotation as stated, rad.
fn vector_of(
    source: &StringRecord,
    places: &[Places],
    rotation: &MappedRotation,
    decimal: char,
) -> Result<Vector3<f64>, String> {
    let in_si = |(k, (number, measure)): (usize, &(Source, Measure))| {
        let mapped = MappedColumn { column: Column::Rotation(k.min(2)), measure: Some(*measure), source: number.clone() };
        let text = value(source, &places[k], &mapped, decimal)?;
        text.parse::<f64>().map(|v| v * DEG).map_err(|_| "the orientation is empty".to_owned())
    };
    let numbers: Vec<f64> = rotation.numbers.iter().enumerate().map(in_si).collect::<Result<_, String>>()?;
    rotation.form.rotation_vector(&numbers).ok_or_else(|| {
        let what = match rotation.form {
            RotationForm::Matrix => "the matrix is not a rotation (rows of unit length, at right angles, right-handed)",
            _ => "the quaternion is not of unit length",
        };
        what.to_owned()
    })
}

/// Finds a source in the header.
fn place(path: &Path, titles: Option<&[String]>, source: &Source) -> Result<Places, FileError> {
    let find = |name: &ColumnName| match name {
        ColumnName::Place(place) => Ok(Some(place - 1)),
        ColumnName::Title(title) => match titles.unwrap_or_default().iter().position(|t| t == title) {
            None if !source.optional => Err(FileError {
                line: Some(1),
                field: title.clone(),
                ..FileError::whole(
                    path,
                    "there is no such column",
                    match titles.unwrap_or_default() {
                        [] => "the file is empty; name one with a table".to_owned(),
                        titles => format!("this file has {}", titles.join(", ")),
                    },
                )
            }),
            place => Ok(place),
        },
    };
    Ok(Places { column: find(&source.column)?, minus: source.minus.as_ref().map(find).transpose()?.flatten() })
}

/// Text for a column of the dataset; empty if an optional source has no value. The error is the reason why the row cannot be
/// used.
fn value(fields: &StringRecord, places: &Places, mapped: &MappedColumn, decimal: char) -> Result<String, String> {
    let MappedColumn { source, measure, column } = mapped;
    let field = |place: usize| fields.get(place).map(str::trim).unwrap_or_default();
    let Some(text) = places.column.map(field).filter(|t| !t.is_empty()) else {
        return if source.optional { Ok(String::new()) } else { Err(format!("{} is empty", column.quantity())) };
    };
    let parse = |text: &str| {
        finite_number(text, decimal).ok_or_else(|| format!("{}: `{text}` is not a finite number", column.quantity()))
    };
    let Measure::Si(si) = (match measure {
        None => return Ok(text.to_owned()),
        Some(measure) => *measure,
    }) else {
        let is_whole = text.len() == 14 && text.bytes().all(|b| b.is_ascii_digit());
        return match timestamp(text) {
            None if is_whole => Err(format!("{}: there is no date or time of day `{text}`", column.quantity())),
            seconds => Ok(seconds.map(|seconds| seconds.to_string()).unwrap_or_default()),
        };
    };
    let minus = places.minus.map(|place| parse(field(place))).transpose()?.unwrap_or(0.0);
    let value = source.scale * parse(text)? + source.offset - minus;
    let unit = match column.unit().as_deref() {
        Some("deg") => DEG,
        Some("mm") => MM,
        Some("um") => UM,
        _ => 1.0,
    };
    Ok(number(value * si, unit))
}
