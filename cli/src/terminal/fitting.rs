//! Output as wide as the terminal: sentences are wrapped between words. A table that is wider wraps its cells, leaves out the
//! columns that may be left out and names them, and becomes a list where not even that fits.

use std::io::IsTerminal;

use calibench_report::{MARK, without_marks};
use comfy_table::{
    CellAlignment, ColumnConstraint, ContentArrangement, Table, Width,
    presets::{NOTHING, UTF8_FULL_CONDENSED},
};

/// Smallest width of a terminal, columns: narrower ones are treated as this wide.
const NARROWEST: usize = 40;

/// The columns that output may have; `None` for as many as it needs: on request, and where no terminal shows it.
pub fn columns(wide: bool) -> Option<usize> {
    if wide {
        return None;
    }
    let stated = std::env::var("COLUMNS").ok().and_then(|columns| columns.parse().ok());
    let shown = || std::io::stdout().is_terminal().then(terminal_size::terminal_size).flatten().map(|(w, _)| usize::from(w.0));
    stated.or_else(shown).map(|columns: usize| columns.max(NARROWEST))
}

/// The text with no line wider than `columns`, as far as its words allow.
pub fn fitted(text: &str, columns: usize) -> String {
    let mut out: Vec<String> = Vec::new();
    let mut lines = text.lines().peekable();
    while let Some(line) = lines.next() {
        if !line.starts_with('┌') {
            out.push(wrapped(line, columns));
            continue;
        }
        let mut table = vec![line];
        while let Some(line) = lines.next_if(|line| line.starts_with(['│', '╞', '├', '└'])) {
            table.push(line);
        }
        let fits = table.iter().all(|line| width(line) <= columns);
        out.push(if fits { without_marks(&table.join("\n")) } else { narrowed(&table, columns) });
    }
    let end = if text.ends_with('\n') { "\n" } else { "" };
    format!("{}{end}", out.join("\n"))
}

fn width(text: &str) -> usize {
    text.chars().filter(|c| !['\n', MARK].contains(c)).count()
}

/// A line, further lines below its beginning.
fn wrapped(line: &str, columns: usize) -> String {
    let indent = width(line) - width(line.trim_start());
    // Tables of Markdown are for files.
    if width(line) <= columns || line.starts_with('|') {
        return line.to_owned();
    }
    let hanging = if indent == 0 { 2 } else { indent + 2 };
    filled(&" ".repeat(indent), line, hanging, columns)
}

/// Words after `label`, in lines that begin `hanging` columns in.
fn filled(label: &str, text: &str, hanging: usize, columns: usize) -> String {
    /// Units and signs that are not separated from the number before them.
    const UNITS: [&str; 7] = ["%", "mm", "µm", "µrad", "deg", "min", "±"];
    let (mut out, mut line) = (String::new(), label.to_owned());
    let words: Vec<&str> = text.split_whitespace().collect();
    let is_unit = |word: &&&str| UNITS.contains(&word.trim_end_matches([',', ';', '.', ')', ':']));
    let mut place = 0;
    while let Some(word) = words.get(place) {
        let number = word.ends_with(|c: char| c.is_ascii_digit());
        let joined = words.get(place + 1).filter(|_| number).filter(is_unit).map(|unit| format!("{word} {unit}"));
        place += if joined.is_some() { 2 } else { 1 };
        let word = joined.as_deref().unwrap_or(word);
        let empty = line.trim().is_empty();
        if !empty && width(&line) + 1 + width(word) > columns {
            out.push_str(&line);
            line = format!("\n{}{word}", " ".repeat(hanging));
        } else {
            line.push_str(if empty { "" } else { " " });
            line.push_str(word);
        }
    }
    out + &line
}

/// The cells of a line of a table.
fn cells(line: &str) -> Vec<String> {
    line.trim_matches('│').split('┆').map(|cell| cell.trim().to_owned()).collect()
}

/// Height of a cell, lines, beyond which columns that may be left out are dropped.
const TALLEST: usize = 2;

/// Height of a header, lines, beyond which they are dropped.
const TALLEST_HEADER: usize = 3;

/// A table that is too wide: with its cells wrapped, without the columns that may be left out, or as a list.
fn narrowed(table: &[&str], columns: usize) -> String {
    let mut rows: Vec<Vec<String>> = table.iter().filter(|line| line.starts_with('│')).map(|line| cells(line)).collect();
    let mut header =
        if table.iter().any(|line| line.starts_with('╞')) && !rows.is_empty() { rows.remove(0) } else { Vec::new() };
    let mut left_out: Vec<String> = Vec::new();
    let fit = loop {
        if let Some(fit) = wrapped_table(&header, &rows, columns) {
            break Some(fit);
        }
        // Columns of one rank mean little without each other.
        let rank = |k: &usize| header[*k].chars().filter(|c| *c == MARK).count();
        let Some(highest) = (0..header.len()).map(|k| rank(&k)).max().filter(|rank| *rank > 0) else { break None };
        for place in (0..header.len()).filter(|k| rank(k) == highest).collect::<Vec<_>>().into_iter().rev() {
            left_out.push(without_marks(&header.remove(place)));
            rows.iter_mut().filter(|row| place < row.len()).for_each(|row| drop(row.remove(place)));
        }
    };
    let fit = fit.or_else(|| tall_table(&header, &rows, columns)).unwrap_or_else(|| listed(&header, &rows, columns));
    if left_out.is_empty() {
        return without_marks(&fit);
    }
    left_out.reverse();
    let rest = filled("", &format!("not shown: {}; --wide shows all", left_out.join(", ")), 2, columns);
    format!("{}\n{rest}", without_marks(&fit))
}

/// The widest word of each column; a value stays with its uncertainty.
fn widest_words(header: &[String], rows: &[Vec<String>]) -> Vec<usize> {
    let count = rows.iter().map(Vec::as_slice).chain([header]).map(<[String]>::len).max().unwrap_or(0);
    let longest = |column: usize| {
        let joined = |cell: &String| cell.replace(" ± ", "_±_").split_whitespace().map(width).max();
        rows.iter().map(Vec::as_slice).chain([header]).filter_map(|row| row.get(column)).filter_map(joined).max().unwrap_or(0)
    };
    (0..count).map(longest).collect()
}

/// The table with cells of no more than a few lines; `None` if that does not fit.
fn wrapped_table(header: &[String], rows: &[Vec<String>], columns: usize) -> Option<String> {
    // A frame is worth a column that may be left out.
    let text = tall_table(header, rows, columns).filter(|text| text.starts_with('┌'))?;
    let (head, row) = heights(rows, &text);
    (head <= TALLEST_HEADER && row <= TALLEST).then_some(text)
}

/// Lines of the header of a framed table, and of a row on average: a few tall ones do no harm.
fn heights(rows: &[Vec<String>], text: &str) -> (usize, usize) {
    let lines: Vec<&str> = text.lines().filter(|line| !line.starts_with(['┌', '└'])).collect();
    let head = lines.iter().position(|line| line.starts_with('╞'));
    let body = lines.len() - head.map_or(0, |head| head + 1);
    (head.unwrap_or(0), body.div_ceil(rows.len().max(1)))
}

/// The table with its cells wrapped, in a frame if there is room for one; `None` if a word would have to be broken.
fn tall_table(header: &[String], rows: &[Vec<String>], columns: usize) -> Option<String> {
    let least = widest_words(header, rows);
    let (count, words) = (least.len(), least.iter().sum::<usize>());
    let (preset, padding) = match columns {
        _ if words + 3 * count < columns => (UTF8_FULL_CONDENSED, (1, 1)),
        _ if words + 2 * count <= columns => (NOTHING, (0, 2)),
        _ => return None,
    };
    let mut out = Table::new();
    out.load_preset(preset).set_content_arrangement(ContentArrangement::Dynamic);
    out.set_width(u16::try_from(columns).unwrap_or(u16::MAX)).set_header(header);
    for row in rows {
        out.add_row(row);
    }
    for (k, column) in out.column_iter_mut().enumerate() {
        let is_number = |cell: &String| cell.is_empty() || cell.starts_with(|c: char| c.is_ascii_digit() || "+-.".contains(c));
        let numbers = k > 0 && rows.iter().all(|row| row.get(k).is_none_or(is_number));
        column.set_cell_alignment(if numbers { CellAlignment::Right } else { CellAlignment::Left });
        column.set_padding(padding);
        column.set_constraint(ColumnConstraint::LowerBoundary(Width::Fixed(u16::try_from(least[k] + 2).unwrap_or(u16::MAX))));
    }
    Some(out.to_string())
}

/// Each row as its first cell, then the others by name.
fn listed(header: &[String], rows: &[Vec<String>], columns: usize) -> String {
    let of_row = |row: &Vec<String>| {
        let named = |(k, cell): (usize, &String)| {
            let name = header.get(k).filter(|name| !name.is_empty());
            name.map_or_else(|| cell.clone(), |name| format!("{name}: {cell}"))
        };
        let rest: Vec<String> = row.iter().enumerate().skip(1).filter(|(_, cell)| !cell.is_empty()).map(named).collect();
        let first = row.first().map_or("", String::as_str);
        let number = first.starts_with(|c: char| c.is_ascii_digit());
        let first = header.first().filter(|_| number).map_or_else(|| first.to_owned(), |name| format!("{name} {first}"));
        format!("{first}\n{}", filled("    ", &rest.join("; "), 4, columns))
    };
    rows.iter().map(of_row).collect::<Vec<_>>().join("\n")
}

#[cfg(test)]
mod tests {
    use calibench_report::plain_table;

    use super::*;

    #[test]
    fn sentences_break_between_words_and_stay_below_their_beginning() {
        let text = "  Do: compare the order with the gear ratio and its double; or add it\nshort\n";
        let fit = fitted(text, 40);
        assert_eq!(fit, "  Do: compare the order with the gear\n    ratio and its double; or add it\nshort\n");
        assert_eq!(fitted(text, 200), text);
    }

    #[test]
    fn a_table_keeps_every_word_at_any_width() {
        let rows = [
            ["harmonic1:1", "a joint errs once per turn", "0.956", "sin -267.473 ± 14.638 µrad"],
            ["bearing_tilt:1", "its bearing tilts under load", "0.020", "k 18.244 ± 4.938 µrad/(N·m)"],
        ];
        let text =
            plain_table(&["effect", "what", "probability", "as it would be fitted"], &rows.map(|row| row.map(String::from)));
        assert!(text.lines().all(|line| width(line) > 80));
        for columns in [80, 60, 40] {
            let fit = fitted(&text, columns);
            assert!(fit.lines().all(|line| width(line) <= columns), "{columns}:\n{fit}");
            for word in rows.concat().iter().flat_map(|cell| cell.split_whitespace()) {
                assert!(fit.contains(word), "{columns}: {word} is not in\n{fit}");
            }
        }
        assert!(fitted(&text, 80).starts_with('┌') && fitted(&text, 40).starts_with("harmonic1:1\n    what: a joint"));
    }
}
