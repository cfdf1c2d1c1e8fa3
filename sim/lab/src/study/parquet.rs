//! The table of a study as a Parquet file: typed, compressed columns, readable by every table program.

use std::path::Path;
use std::sync::Arc;

use calibench::files::FileError;
use calibench::files::disk::write_streamed;
use csv::StringRecord;
use parquet::basic::{Compression, LogicalType, Repetition, Type as Physical};
use parquet::data_type::{ByteArray, ByteArrayType, DoubleType, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::Type;

use super::RowsReader;

/// Number of rows held at once.
const ROWS: usize = 8192;

/// Integer columns and text columns; all others except the axes are floating-point numbers.
const WHOLE: [&str; 8] = ["points", "point", "trial", "seed", "dof", "rank", "measured", "failed"];
const TEXT: [&str; 6] = ["study", "method", "methods", "outcome", "verdict", "finding"];

/// Type of a column.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Holds {
    Whole,
    Number,
    Text,
}

/// Refuses an output that this build cannot write: with the feature `parquet` it can.
///
/// # Errors
/// Without the feature, always.
pub fn expect_parquet(_output: &Path) -> Result<(), FileError> {
    Ok(())
}

/// Writes the rows of one or more files, in that order, as one Parquet file; an empty field is a null. An axis is numeric if
/// all its values are numbers.
///
/// # Errors
/// If a table cannot be read, or the file cannot be written.
pub fn write_parquet(tables: &[&Path], output: &Path) -> Result<(), FileError> {
    let Some(first) = tables.first() else { return Ok(()) };
    let header = RowsReader::open(first)?.header().clone();
    let holds = holds(tables, &header)?;
    let fail = |e: ParquetError| calibench::files::cannot_be_written(output, e);
    write_streamed(output, |file| {
        let columns = header.iter().zip(&holds).map(|(name, holds)| column(name, *holds).map(Arc::new));
        let schema = columns
            .collect::<Result<Vec<_>, _>>()
            .and_then(|columns| Type::group_type_builder("study").with_fields(columns).build())
            .map_err(fail)?;
        let properties = WriterProperties::builder().set_compression(Compression::SNAPPY).build();
        let mut writer = SerializedFileWriter::new(file, Arc::new(schema), Arc::new(properties)).map_err(fail)?;
        let mut rows: Vec<StringRecord> = Vec::with_capacity(ROWS);
        for table in tables {
            let mut reader = RowsReader::open(table)?;
            while let Some(row) = reader.next_row()? {
                rows.push(row.clone());
                if rows.len() == ROWS {
                    write_group(&mut writer, &holds, &rows).map_err(fail)?;
                    rows.clear();
                }
            }
        }
        if !rows.is_empty() {
            write_group(&mut writer, &holds, &rows).map_err(fail)?;
        }
        writer.close().map_err(fail).map(drop)
    })
}

fn holds(tables: &[&Path], header: &StringRecord) -> Result<Vec<Holds>, FileError> {
    let place = |name: &str| header.iter().position(|h| h == name).unwrap_or(0);
    let axes = place("point") + 1..place("trial");
    let mut holds: Vec<Holds> = header
        .iter()
        .enumerate()
        .map(|(k, name)| match name {
            _ if axes.contains(&k) => Holds::Number,
            _ if WHOLE.contains(&name) => Holds::Whole,
            _ if TEXT.contains(&name) => Holds::Text,
            _ => Holds::Number,
        })
        .collect();
    // The first trial contains every point.
    let mut reader = RowsReader::open(tables[0])?;
    while let Some(row) = reader.next_row()?.cloned() {
        for axis in axes.clone() {
            if row[axis].parse::<f64>().is_err() {
                holds[axis] = Holds::Text;
            }
        }
        if reader.is_whole() {
            break;
        }
    }
    Ok(holds)
}

fn column(name: &str, holds: Holds) -> Result<Type, ParquetError> {
    let (physical, logical) = match holds {
        Holds::Whole => (Physical::INT64, Some(LogicalType::integer(64, false))),
        Holds::Number => (Physical::DOUBLE, None),
        Holds::Text => (Physical::BYTE_ARRAY, Some(LogicalType::String)),
    };
    Type::primitive_type_builder(name, physical).with_repetition(Repetition::OPTIONAL).with_logical_type(logical).build()
}

fn write_group<W: std::io::Write + Send>(
    writer: &mut SerializedFileWriter<W>,
    holds: &[Holds],
    rows: &[StringRecord],
) -> Result<(), ParquetError> {
    let mut group = writer.next_row_group()?;
    for (k, holds) in holds.iter().enumerate() {
        let Some(mut column) = group.next_column()? else { break };
        let there = || rows.iter().map(|row| &row[k]);
        let levels: Vec<i16> = there().map(|v| i16::from(!v.is_empty())).collect();
        let values = there().filter(|v| !v.is_empty());
        let unread = |v: &str| ParquetError::General(format!("'{v}' is not a number"));
        match holds {
            Holds::Whole => {
                // Parquet preserves the bits.
                let bits = |v: &str| v.parse::<u64>().map(|v| v as i64).map_err(|_| unread(v));
                let values = values.map(bits).collect::<Result<Vec<i64>, _>>()?;
                column.typed::<Int64Type>().write_batch(&values, Some(&levels), None)?;
            }
            Holds::Number => {
                let values = values.map(|v| v.parse().map_err(|_| unread(v))).collect::<Result<Vec<f64>, _>>()?;
                column.typed::<DoubleType>().write_batch(&values, Some(&levels), None)?;
            }
            Holds::Text => {
                let values: Vec<ByteArray> = values.map(ByteArray::from).collect();
                column.typed::<ByteArrayType>().write_batch(&values, Some(&levels), None)?;
            }
        }
        column.close()?;
    }
    group.close().map(drop)
}
