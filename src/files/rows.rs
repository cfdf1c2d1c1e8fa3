//! The rows of a CSV file with the numbers of their first lines, in bounded memory.

use std::io::{BufRead, Read};
use std::path::Path;

use csv::StringRecord;

use super::error::FileError;

/// Longest row, bytes: a row of a seven-joint arm with every column takes about a thousand.
const LONGEST_ROW: u64 = 1 << 20;

/// A row of the file, split into its fields.
pub(crate) struct Record {
    /// First line of the row, counted from 1.
    pub line: usize,
    /// Its fields.
    pub fields: StringRecord,
    /// True if the file ended without ending this line.
    pub cut: bool,
}

impl Record {
    /// Creates an error in this row.
    pub fn wrong(&self, path: &Path, field: &str, problem: impl Into<String>, remedy: impl Into<String>) -> FileError {
        FileError { line: Some(self.line), field: field.into(), ..FileError::whole(path, problem, remedy) }
    }

    /// The column names, if this is the header of a comma-separated table; `otherwise` is the remedy if another separator is
    /// used.
    pub fn titles(&self, path: &Path, otherwise: &str) -> Result<Vec<String>, FileError> {
        let names: Vec<String> = self.fields.iter().map(|t| t.trim().to_owned()).collect();
        for (mark, what) in [(';', "semicolons"), ('\t', "tabs")] {
            if names.len() == 1 && names[0].contains(mark) {
                return Err(self.wrong(path, "", format!("fields are separated by {what}"), otherwise));
            }
        }
        if names.iter().any(|n| n.parse::<f64>().is_ok()) {
            return Err(self.wrong(path, "", "the header is missing", "begin with a line that names the columns"));
        }
        Ok(names)
    }
}

/// Reads the rows of a CSV file with their physical line numbers, in bounded memory.
pub(crate) struct Rows<'a, R> {
    input: R,
    path: &'a Path,
    delimiter: u8,
    next_line: usize,
}

impl<'a, R: BufRead> Rows<'a, R> {
    /// Reads the rows of `input`, the content of `path`.
    pub fn new(input: R, path: &'a Path, delimiter: u8) -> Self {
        Rows { input, path, delimiter, next_line: 1 }
    }

    /// The same, of which the first row stands on this line of the file.
    pub fn starting_at(self, line: usize) -> Self {
        Rows { next_line: line, ..self }
    }

    fn error(&self, line: usize, problem: impl Into<String>, remedy: impl Into<String>) -> FileError {
        FileError { line: Some(line), ..FileError::whole(self.path, problem, remedy) }
    }

    /// Returns the next row that is not blank.
    pub fn next(&mut self) -> Result<Option<Record>, FileError> {
        loop {
            let line = self.next_line;
            let bytes = self.next_bytes()?;
            if bytes.is_empty() {
                return Ok(None);
            }
            let text = if line == 1 { bytes.strip_prefix("\u{feff}".as_bytes()).unwrap_or(&bytes) } else { &bytes[..] };
            if text.trim_ascii().is_empty() {
                continue;
            }
            if text.contains(&0) {
                return Err(self.error(line, "is not text: it holds NUL bytes", "save the file as UTF-8"));
            }
            let fields = fields(text, self.delimiter).map_err(|e| match e.kind() {
                csv::ErrorKind::Utf8 { .. } => self.error(line, "is not UTF-8 text", "save the file as UTF-8"),
                _ => self.error(line, e.to_string(), "correct the row"),
            })?;
            return Ok(Some(Record { line, fields, cut: bytes.last() != Some(&b'\n') }));
        }
    }

    /// Reads the bytes of the next row: one line, or more when quotes contain line breaks. Empty at the end of the file.
    fn next_bytes(&mut self) -> Result<Vec<u8>, FileError> {
        let line = self.next_line;
        let mut bytes = Vec::new();
        let mut quotes = Quotes::FieldStart;
        loop {
            let start = bytes.len();
            // One more than allowed, so that a row that is too long is distinguished from one that just fits.
            let read = Read::take(&mut self.input, LONGEST_ROW + 1 - start as u64)
                .read_until(b'\n', &mut bytes)
                .map_err(|e| FileError::whole(self.path, format!("cannot be read: {e}"), "check the disk"))?;
            if bytes.len() as u64 > LONGEST_ROW {
                return Err(self.error(
                    line,
                    "a row is longer than 1 MiB",
                    "check that quotes are closed and that the file is text",
                ));
            }
            self.next_line += usize::from(bytes[start..].ends_with(b"\n"));
            quotes = bytes[start..].iter().fold(quotes, |state, &b| state.after(b, self.delimiter));
            match (quotes, read) {
                (Quotes::Inside, 0) => return Err(self.error(line, "a quote is opened and never closed", "close it")),
                (Quotes::Inside, _) => {}
                _ => return Ok(bytes),
            }
        }
    }
}

/// Splits one row into fields.
fn fields(row: &[u8], delimiter: u8) -> Result<StringRecord, csv::Error> {
    let line = row.strip_suffix(b"\n").unwrap_or(row);
    let line = line.strip_suffix(b"\r").unwrap_or(line);
    // Constructing a reader costs as much as a hundred rows; only quotes need one.
    if let Ok(text) = std::str::from_utf8(line)
        && !line.iter().any(|b| matches!(b, b'"' | b'\r'))
    {
        return Ok(text.split(char::from(delimiter)).collect());
    }
    let mut fields = StringRecord::new();
    csv::ReaderBuilder::new()
        .has_headers(false)
        .flexible(true)
        .delimiter(delimiter)
        .buffer_capacity(row.len())
        .from_reader(row)
        .read_record(&mut fields)?;
    Ok(fields)
}

/// State of the quotes within a row: a line break between quotes does not end it.
#[derive(Clone, Copy, PartialEq)]
enum Quotes {
    FieldStart,
    Outside,
    Inside,
    /// After a quote between quotes: the end, or the first of an escaped pair.
    Closing,
}

impl Quotes {
    fn after(self, byte: u8, delimiter: u8) -> Quotes {
        match (self, byte) {
            (Quotes::FieldStart | Quotes::Closing, b'"') => Quotes::Inside,
            (Quotes::Inside, b'"') => Quotes::Closing,
            (Quotes::Inside, _) => Quotes::Inside,
            (_, b) if b == delimiter || b == b'\n' => Quotes::FieldStart,
            _ => Quotes::Outside,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_row_without_quotes_is_split_as_the_library_splits_it() {
        for row in ["a,b,c\n", "a,,\r\n", ",", " a , b\r", "1.5,é,\n", "a\rb\n", "\"a,b\",c\n", "x"] {
            let mut expected = StringRecord::new();
            let mut reader = csv::ReaderBuilder::new().has_headers(false).flexible(true).from_reader(row.as_bytes());
            reader.read_record(&mut expected).unwrap();
            assert_eq!(fields(row.as_bytes(), b',').unwrap(), expected, "{row:?}");
        }
        assert!(fields(b"a,\xff\n", b',').is_err());
    }
}
