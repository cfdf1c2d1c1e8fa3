//! Sources of a table: text of any delimiter or of columns in white space, a sheet of a workbook, or several of them side by side.

use std::collections::HashMap;
use std::io::{BufRead, BufReader, Cursor};
use std::path::{Path, PathBuf};

use calamine::{Data, Reader, open_workbook_auto};

use super::ImportReport;
use crate::files::{FileError, Rows, open_file, read_text};

/// Extensions of workbooks.
const WORKBOOKS: [&str; 4] = ["xlsx", "xlsm", "xls", "ods"];

/// The layout of a source.
#[derive(Debug, Clone, Copy)]
pub(super) struct Layout<'a> {
    /// Separates fields; a space stands for any white space.
    pub delimiter: u8,
    /// True if the first row names the columns.
    pub header: bool,
    /// Sheet of a workbook; the first that holds a table if `None`.
    pub sheet: Option<&'a str>,
}

/// How the rows of files side by side belong together.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Join {
    /// By their order.
    Rows,
    /// By the value of the column with this title.
    Column(String),
}

/// Opens a file as rows of delimited text; a row stands on its line of the file, or of the sheet.
pub(super) fn open_source(path: &Path, layout: Layout<'_>) -> Result<Box<dyn BufRead>, FileError> {
    if path.is_dir() {
        return Err(FileError::whole(path, "is a directory", "name the files in it"));
    }
    if is_workbook(path) {
        return Ok(Box::new(Cursor::new(sheet_text(path, layout)?)));
    }
    if layout.delimiter == b' ' {
        let line = |line: &str| line.split_whitespace().collect::<Vec<_>>().join(" ");
        let lines: Vec<String> = read_text(path)?.lines().map(line).collect();
        return Ok(Box::new(Cursor::new(lines.join("\n").into_bytes())));
    }
    let file = open_file(path).map_err(|e| FileError::whole(path, format!("cannot be read: {e}"), "check the path"))?;
    Ok(Box::new(BufReader::new(file)))
}

pub(super) fn is_workbook(path: &Path) -> bool {
    let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase());
    extension.is_some_and(|extension| WORKBOOKS.contains(&extension.as_str()))
}

/// A sheet as delimited text.
fn sheet_text(path: &Path, layout: Layout<'_>) -> Result<Vec<u8>, FileError> {
    let wrong = |problem: String, remedy: &str| FileError::whole(path, problem, remedy);
    let mut book = open_workbook_auto(path)
        .map_err(|e| wrong(format!("cannot be read as a workbook: {e}"), "save it as .xlsx or .csv"))?;
    let names = book.sheet_names();
    let mut read = |name: &str| {
        book.worksheet_range(name).map_err(|e| wrong(format!("sheet '{name}' cannot be read: {e}"), "save it as .csv"))
    };
    let range = match layout.sheet {
        Some(name) if !names.iter().any(|known| known == name) => {
            let problem = format!("there is no sheet '{name}'");
            return Err(wrong(problem, &format!("its sheets are {}", names.join(", "))));
        }
        Some(name) => read(name)?,
        None => {
            let ranges = names.iter().map(|name| read(name)).collect::<Result<Vec<_>, _>>()?;
            // A remark is no table.
            let filled = ranges.into_iter().find(|range| range.width() > 1 && range.height() > 1);
            filled.ok_or_else(|| {
                wrong("no sheet holds a table".into(), "give a workbook with a table, or name its `sheet` in the map")
            })?
        }
    };
    let first = range.start().map_or(0, |(row, _)| row as usize);
    let mut text = vec![b'\n'; first];
    for row in range.rows() {
        if row.iter().any(|cell| !matches!(cell, Data::Empty)) {
            text.extend(delimited(&row.iter().map(cell_text).collect::<Vec<_>>(), layout.delimiter));
        } else {
            text.push(b'\n');
        }
    }
    Ok(text)
}

/// The text of a cell on one line.
fn cell_text(cell: &Data) -> String {
    cell.to_string().replace(['\n', '\r'], " ")
}

fn delimited(fields: &[String], delimiter: u8) -> Vec<u8> {
    let mut writer = csv::WriterBuilder::new().delimiter(delimiter).from_writer(Vec::new());
    // Writing to memory does not fail.
    _ = writer.write_record(fields);
    writer.into_inner().unwrap_or_default()
}

/// One of the files to be joined.
struct Part {
    titles: Vec<String>,
    /// Rows with their lines.
    rows: Vec<(usize, Vec<String>)>,
}

impl Part {
    fn read(path: &Path, layout: Layout<'_>) -> Result<Self, FileError> {
        let mut rows = Rows::new(open_source(path, layout)?, path, layout.delimiter);
        let text = |fields: &csv::StringRecord| fields.iter().map(|f| f.trim().to_owned()).collect::<Vec<_>>();
        let titles = if layout.header { rows.next()?.map(|r| text(&r.fields)) } else { None };
        let mut part = Part { titles: titles.unwrap_or_default(), rows: Vec::new() };
        while let Some(row) = rows.next()? {
            part.rows.push((row.line, text(&row.fields)));
        }
        Ok(part)
    }

    /// Number of fields of its rows.
    fn width(&self) -> usize {
        self.rows.iter().map(|(_, fields)| fields.len()).max().unwrap_or(0).max(self.titles.len())
    }

    /// The place of a title.
    fn place(&self, title: &str, path: &Path) -> Result<usize, FileError> {
        self.titles.iter().position(|t| t == title).ok_or_else(|| FileError {
            line: Some(1),
            field: title.into(),
            ..FileError::whole(path, "there is no such column to join by", format!("this file has {}", self.titles.join(", ")))
        })
    }
}

/// Files side by side as one delimited text, whose rows stand on the lines of the first file. A title that an earlier file has is
/// preceded by the name of its file: `points.x`.
pub(super) fn joined(
    paths: &[PathBuf],
    layout: Layout<'_>,
    by: &Join,
    report: &mut ImportReport,
) -> Result<Vec<u8>, FileError> {
    let parts = paths.iter().map(|path| Part::read(path, layout)).collect::<Result<Vec<_>, _>>()?;
    let [first, others @ ..] = parts.as_slice() else { return Ok(Vec::new()) };
    let mut titles = first.titles.clone();
    for (part, path) in others.iter().zip(&paths[1..]) {
        let stem = path.file_stem().unwrap_or_default().to_string_lossy();
        let named = part.titles.iter().map(|t| if first.titles.contains(t) { format!("{stem}.{t}") } else { t.clone() });
        titles.extend(named);
    }
    let found = match by {
        Join::Rows => by_order(&parts, paths)?,
        Join::Column(title) => by_column(&parts, paths, title, report)?,
    };
    let mut text = if layout.header { delimited(&titles, layout.delimiter) } else { Vec::new() };
    let mut line = 1 + usize::from(layout.header);
    for (row, (at, fields)) in first.rows.iter().enumerate() {
        text.resize(text.len() + at.saturating_sub(line), b'\n');
        line = (*at).max(line);
        let Some(places) = &found[row] else { continue };
        let mut all = padded(fields, first.width());
        for (part, &place) in others.iter().zip(places) {
            all.extend(padded(&part.rows[place].1, part.width()));
        }
        text.extend(delimited(&all, layout.delimiter));
        line += 1;
    }
    Ok(text)
}

fn padded(fields: &[String], width: usize) -> Vec<String> {
    let mut fields = fields.to_vec();
    fields.resize(width, String::new());
    fields
}

/// For every row of the first file, the rows of the others; `None` for a row without partners.
type Partners = Vec<Option<Vec<usize>>>;

fn by_order(parts: &[Part], paths: &[PathBuf]) -> Result<Partners, FileError> {
    let rows = parts[0].rows.len();
    if let Some(k) = parts.iter().position(|part| part.rows.len() != rows) {
        let problem = format!("has {} rows where {} has {rows}", parts[k].rows.len(), paths[0].display());
        return Err(FileError::whole(&paths[k], problem, "join files of the same rows, or by a column that both have"));
    }
    Ok((0..rows).map(|row| Some(vec![row; parts.len() - 1])).collect())
}

fn by_column(parts: &[Part], paths: &[PathBuf], title: &str, report: &mut ImportReport) -> Result<Partners, FileError> {
    let mut of_value: Vec<HashMap<&str, usize>> = Vec::new();
    for (part, path) in parts.iter().zip(paths) {
        let place = part.place(title, path)?;
        let mut rows = HashMap::new();
        for (row, (line, fields)) in part.rows.iter().enumerate() {
            let value = fields.get(place).map_or("", String::as_str);
            if rows.insert(value, row).is_some() {
                let problem = format!("'{value}' is there twice");
                let wrong = FileError::whole(path, problem, "join by a column whose values are all different");
                return Err(FileError { line: Some(*line), field: title.into(), ..wrong });
            }
        }
        of_value.push(rows);
    }
    let place = parts[0].place(title, &paths[0])?;
    let partners: Partners = parts[0]
        .rows
        .iter()
        .map(|(_, fields)| {
            let value = fields.get(place).map_or("", String::as_str);
            of_value[1..].iter().map(|rows| rows.get(value).copied()).collect()
        })
        .collect();
    let alone = partners.iter().filter(|p| p.is_none()).count();
    if alone == partners.len() {
        let problem = format!("no value of '{title}' is in all files");
        return Err(FileError::whole(&paths[0], problem, "join by another column, or by rows"));
    }
    if alone > 0 {
        report.notes.push(format!("{}: {alone} rows have no partner by '{title}' and are left out", paths[0].display()));
    }
    Ok(partners)
}
