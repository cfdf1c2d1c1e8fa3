//! A small CSV file written by this program, read by the names of its columns.

use std::path::Path;

use csv::StringRecord;

use super::error::FileError;
use super::text::read_text;

/// A table in memory.
///
/// ```
/// use calibench::files::csv_table::CsvTable;
///
/// # let folder = tempfile::tempdir()?;
/// # let path = folder.path().join("stops.csv");
/// # std::fs::write(&path, "r1_um,r2_um\n1.5,\n2.5,x\n")?;
/// // stops.csv: r1_um,r2_um / 1.5, / 2.5,x
/// let table = CsvTable::read(&path, &["r1_um", "r2_um"], "give the file as it was written")?;
/// let rows: Vec<_> = table.rows().collect();
/// assert_eq!((rows[0].number("r1_um")?, rows[0].number("r2_um")?), (Some(1.5), None));
/// assert!(rows[1].number("r2_um").is_err_and(|e| e.line == Some(3) && e.field == "r2_um"));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct CsvTable<'a> {
    path: &'a Path,
    header: StringRecord,
    records: Vec<StringRecord>,
    remedy: &'static str,
}

/// A row of a [`CsvTable`].
#[derive(Clone, Copy)]
pub struct CsvRow<'t> {
    table: &'t CsvTable<'t>,
    record: &'t StringRecord,
}

impl<'a> CsvTable<'a> {
    /// Reads a file that must have these columns; `remedy` names the file to give if one is missing.
    ///
    /// # Errors
    /// When the file cannot be read, is not a table, or lacks a column.
    pub fn read(path: &'a Path, columns: &[&str], remedy: &'static str) -> Result<Self, FileError> {
        let text = read_text(path)?;
        let fail = |e: csv::Error| FileError {
            line: e.position().map(|p| p.line() as usize),
            ..FileError::whole(path, e.to_string(), "every row needs the columns of the header")
        };
        let mut reader = csv::Reader::from_reader(text.as_bytes());
        let header = reader.headers().map_err(fail)?.clone();
        let records = reader.records().collect::<Result<_, _>>().map_err(fail)?;
        let table = CsvTable { path, header, records, remedy };
        match columns.iter().find(|column| !table.has(column)) {
            Some(missing) => Err(FileError {
                line: Some(1),
                field: (*missing).into(),
                ..FileError::whole(path, "the column is missing", remedy)
            }),
            None => Ok(table),
        }
    }

    /// True if the table has this column.
    pub fn has(&self, column: &str) -> bool {
        self.header.iter().any(|name| name == column)
    }

    /// The rows, in order.
    pub fn rows(&self) -> impl Iterator<Item = CsvRow<'_>> {
        self.records.iter().map(|record| CsvRow { table: self, record })
    }
}

impl<'t> CsvRow<'t> {
    /// The field in this column; empty if there is no such column.
    pub fn text(&self, column: &str) -> &'t str {
        let place = self.table.header.iter().position(|name| name == column);
        place.and_then(|place| self.record.get(place)).unwrap_or_default()
    }

    /// A finite number; `None` for an empty field.
    ///
    /// # Errors
    /// When the field holds anything else.
    pub fn number(&self, column: &str) -> Result<Option<f64>, FileError> {
        match self.text(column) {
            "" => Ok(None),
            text => match text.parse::<f64>() {
                Ok(value) if value.is_finite() => Ok(Some(value)),
                _ => Err(self.wrong(column, format!("'{text}' is not a finite number"))),
            },
        }
    }

    /// Three numbers; `None` if one of them is missing.
    ///
    /// # Errors
    /// As [`CsvRow::number`].
    pub fn three(&self, columns: [&str; 3]) -> Result<Option<[f64; 3]>, FileError> {
        let [x, y, z] = [self.number(columns[0])?, self.number(columns[1])?, self.number(columns[2])?];
        Ok(x.zip(y).zip(z).map(|((x, y), z)| [x, y, z]))
    }

    /// Creates an error in this field, with the table's remedy.
    pub fn wrong(&self, column: &str, problem: String) -> FileError {
        let line = self.record.position().map(|p| p.line() as usize);
        FileError { line, field: column.into(), ..FileError::whole(self.table.path, problem, self.table.remedy) }
    }
}
