//! Sources of a table: text of any delimiter or of columns in white space, a sheet of a workbook, or several of them side by side.

use std::collections::{BTreeMap, HashMap};
use std::io::{BufRead, BufReader, Cursor};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};

use calamine::{Data, Reader, Xlsx, XlsxError};

use super::ImportReport;
use crate::files::disk::{OpenFile, is_folder, open_file};
use crate::files::{FileError, Rows, Transcoded, read_foreign_text};

/// Extensions of workbooks.
const WORKBOOKS: [&str; 2] = ["xlsx", "xlsm"];

/// Most columns of a table.
const MOST_COLUMNS: u32 = 1000;

/// The layout of a source.
#[derive(Debug, Clone, Copy)]
pub(super) struct Layout<'a> {
    /// Separates fields; a space stands for any white space.
    pub delimiter: u8,
    /// True if the first row names the columns.
    pub header: bool,
    /// Sheet of a workbook; the first that holds a table if `None`.
    pub sheet: Option<&'a str>,
    /// Number of lines before the table.
    pub skip_lines: usize,
}

/// Rule by which rows of several files belong together.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Join {
    /// By their order.
    Rows,
    /// By the value of the column with this title.
    Column(String),
}

/// Opens a file as rows of delimited text; a row stands on its line of the file, or of the sheet.
pub(super) fn open_source(path: &Path, layout: Layout<'_>) -> Result<Box<dyn BufRead>, FileError> {
    if is_folder(path) {
        return Err(FileError::whole(path, "is a directory", "name the files in it"));
    }
    if is_workbook(path) {
        let mut lines = Cursor::new(sheet_text(path, layout)?);
        for _ in 0..layout.skip_lines {
            lines.skip_until(b'\n').map_err(|e| FileError::whole(path, format!("cannot be read: {e}"), "check the path"))?;
        }
        return Ok(Box::new(lines));
    }
    if layout.delimiter == b' ' {
        let line = |line: &str| line.split_whitespace().collect::<Vec<_>>().join(" ");
        let lines: Vec<String> = read_foreign_text(path)?.lines().skip(layout.skip_lines).map(line).collect();
        return Ok(Box::new(Cursor::new(lines.join("\n").into_bytes())));
    }
    let unreadable = |e| FileError::whole(path, format!("cannot be read: {e}"), "check the path");
    let mut lines = BufReader::new(Transcoded::new(open_file(path).map_err(unreadable)?));
    for _ in 0..layout.skip_lines {
        lines.skip_until(b'\n').map_err(unreadable)?;
    }
    Ok(Box::new(lines))
}

pub(super) fn is_workbook(path: &Path) -> bool {
    let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase());
    extension.is_some_and(|extension| WORKBOOKS.contains(&extension.as_str()))
}

/// A sheet as delimited text.
fn sheet_text(path: &Path, layout: Layout<'_>) -> Result<Vec<u8>, FileError> {
    let wrong = |problem: String, remedy: &str| FileError::whole(path, problem, remedy);
    let broken = |reason: String| wrong(format!("cannot be read as a workbook: {reason}"), "save it as .csv");
    // A parser of somebody else's that meets a broken file: whatever it does, it ends in one error.
    let read = catch_unwind(AssertUnwindSafe(|| sheets(path, layout.sheet))).map_err(|_| broken("it is broken".into()))?;
    let (names, sheets) = read.map_err(|e| broken(e.to_string()))?;
    if let Some(name) = layout.sheet
        && !names.iter().any(|known| known == name)
    {
        return Err(wrong(format!("there is no sheet '{name}'"), &format!("its sheets are {}", names.join(", "))));
    }
    // A remark is not a table, unless it is requested.
    let is_table = |sheet: &&Sheet| layout.sheet.is_some() || (sheet.len() > 1 && sheet.values().any(|row| row.len() > 1));
    let sheet = sheets.iter().find(is_table).ok_or_else(|| {
        wrong("no sheet holds a table".into(), "give a workbook with a table, or name its `sheet` in the map")
    })?;
    let columns = || sheet.values().flat_map(BTreeMap::keys);
    let (Some(first), Some(last)) = (columns().min(), columns().max()) else { return Ok(Vec::new()) };
    if last - first >= MOST_COLUMNS {
        return Err(wrong(format!("has {} columns", last - first + 1), "give a sheet that holds the table alone"));
    }
    let mut text = Vec::new();
    let mut line = 0;
    for (row, cells) in sheet {
        text.resize(text.len() + (row - line) as usize, b'\n');
        let fields: Vec<String> = (*first..=*last).map(|c| cells.get(&c).cloned().unwrap_or_default()).collect();
        text.extend(delimited(&fields, layout.delimiter));
        line = row + 1;
    }
    Ok(text)
}

/// The text of the cells of a sheet that have any, by row and column, counted from 0.
type Sheet = BTreeMap<u32, BTreeMap<u32, String>>;

/// The names of all sheets, and the cells of those called `name`, or of all. A sheet is read cell by cell: a single cell at its far
/// corner would make a whole one of it that no memory holds.
fn sheets(path: &Path, name: Option<&str>) -> Result<(Vec<String>, Vec<Sheet>), XlsxError> {
    let mut book: Xlsx<BufReader<OpenFile>> = Xlsx::new(BufReader::new(open_file(path)?))?;
    let names = book.sheet_names();
    let mut sheets = Vec::new();
    for of in names.iter().filter(|of| name.is_none_or(|name| name == *of)) {
        let mut sheet = Sheet::new();
        let mut cells = book.worksheet_cells_reader(of)?;
        while let Some(cell) = cells.next_cell()? {
            let text = Data::from(cell.get_value().clone()).to_string().replace(['\n', '\r'], " ");
            if !text.is_empty() {
                let (row, column) = cell.get_position();
                sheet.entry(row).or_default().insert(column, text);
            }
        }
        sheets.push(sheet);
    }
    Ok((names, sheets))
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
        let mut rows = Rows::new(open_source(path, layout)?, path, layout.delimiter).starting_at(layout.skip_lines + 1);
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

/// The number in a cell; a sign of degrees says what title or map say too. `None` of anything else, and of what is not finite.
pub(super) fn finite_number(text: &str, decimal: char) -> Option<f64> {
    text.trim_end_matches(['°', ' ']).replace(decimal, ".").parse::<f64>().ok().filter(|v| v.is_finite())
}
