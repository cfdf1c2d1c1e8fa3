//! Output as wide as the terminal: sentences are wrapped between words. A table that is wider wraps its cells, leaves out the
//! columns that may be left out and names them, and becomes a list where not even that fits.

use std::io::IsTerminal;

use calibench_report::{Block, Column, Printout, Table};
use comfy_table::{
    CellAlignment, ColumnConstraint, ContentArrangement, Width,
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
pub fn fitted(printout: &Printout, columns: usize) -> String {
    let fitted = |block: &Block| match block {
        Block::Text(text) => text.split('\n').map(|line| wrapped(line, columns)).collect::<Vec<_>>().join("\n"),
        Block::Table(table) => {
            let whole = table.to_string();
            if whole.lines().all(|line| width(line) <= columns) { whole } else { narrowed(table, columns) }
        }
    };
    printout.blocks().iter().map(fitted).collect()
}

fn width(text: &str) -> usize {
    text.chars().filter(|c| *c != '\n').count()
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

/// Height of a cell, lines, beyond which columns that may be left out are dropped.
const TALLEST: usize = 2;

/// Height of a header, lines, beyond which they are dropped.
const TALLEST_HEADER: usize = 3;

/// A table that is too wide: with its cells wrapped, without the columns that may be left out, or as a list.
fn narrowed(table: &Table, columns: usize) -> String {
    let mut table = trimmed(table);
    let mut left_out: Vec<String> = Vec::new();
    let fit = loop {
        if let Some(fit) = framed(&table, columns).filter(|fit| is_low(fit, table.rows.len())) {
            break Some(fit);
        }
        // Columns of one rank mean little without each other.
        let Some(highest) = table.header.iter().map(|column| column.rank).max().filter(|rank| *rank > 0) else { break None };
        for place in (0..table.header.len()).rev() {
            if table.header[place].rank == highest {
                left_out.push(table.header.remove(place).name);
                table.rows.iter_mut().filter(|row| place < row.len()).for_each(|row| drop(row.remove(place)));
            }
        }
    };
    let fit = fit.or_else(|| framed(&table, columns)).or_else(|| unframed(&table, columns));
    let fit = fit.unwrap_or_else(|| listed(&table, columns));
    if left_out.is_empty() {
        return fit;
    }
    left_out.reverse();
    let rest = filled("", &format!("not shown: {}; --wide shows all", left_out.join(", ")), 2, columns);
    format!("{fit}\n{rest}")
}

/// The table without blanks around its cells, which align them where there is room.
fn trimmed(table: &Table) -> Table {
    let mut table = table.clone();
    let names = table.header.iter_mut().map(|column| &mut column.name);
    names.chain(table.rows.iter_mut().flatten()).for_each(|cell| *cell = cell.trim().to_owned());
    table
}

/// The widest word of each column; a value stays with its uncertainty.
fn widest_words(table: &Table) -> Vec<usize> {
    let widest = |cell: &String| cell.replace(" ± ", "_±_").split_whitespace().map(width).max();
    let of_column = |(k, column): (usize, &Column)| {
        let cells = table.rows.iter().filter_map(|row| row.get(k));
        cells.chain([&column.name]).filter_map(widest).max().unwrap_or(0)
    };
    table.header.iter().enumerate().map(of_column).collect()
}

/// True if a framed table of so many rows has cells of no more than a few lines; of the rows, on average: a few tall ones do no
/// harm.
fn is_low(framed: &str, rows: usize) -> bool {
    let lines = framed.lines().count();
    let header = framed.lines().take_while(|line| !line.starts_with('╞')).count();
    // Besides the header and the rows there are the frame's top, its bottom and the line between them.
    header - 1 <= TALLEST_HEADER && (lines - header - 2).div_ceil(rows.max(1)) <= TALLEST
}

/// The table in a frame, its cells wrapped; `None` if a word would have to be broken.
fn framed(table: &Table, columns: usize) -> Option<String> {
    let least = widest_words(table);
    (least.iter().sum::<usize>() + 3 * least.len() < columns).then(|| wrapped_table(table, &least, columns, Frame::Lines))
}

/// The table without a frame, its cells wrapped; `None` if a word would have to be broken.
fn unframed(table: &Table, columns: usize) -> Option<String> {
    let least = widest_words(table);
    (least.iter().sum::<usize>() + 2 * least.len() <= columns).then(|| wrapped_table(table, &least, columns, Frame::Blanks))
}

/// What parts the columns of a table.
#[derive(Clone, Copy)]
enum Frame {
    /// Lines, with a blank on both sides.
    Lines,
    /// Two blanks.
    Blanks,
}

fn wrapped_table(table: &Table, least: &[usize], columns: usize, frame: Frame) -> String {
    let (preset, padding) = match frame {
        Frame::Lines => (UTF8_FULL_CONDENSED, (1, 1)),
        Frame::Blanks => (NOTHING, (0, 2)),
    };
    let mut out = comfy_table::Table::new();
    out.load_preset(preset).set_content_arrangement(ContentArrangement::Dynamic);
    out.set_width(u16::try_from(columns).unwrap_or(u16::MAX)).set_header(table.header.iter().map(|column| &column.name));
    out.add_rows(&table.rows);
    for (k, column) in out.column_iter_mut().enumerate() {
        column.set_cell_alignment(if table.is_numeric(k) { CellAlignment::Right } else { CellAlignment::Left });
        column.set_padding(padding);
        column.set_constraint(ColumnConstraint::LowerBoundary(Width::Fixed(u16::try_from(least[k] + 2).unwrap_or(u16::MAX))));
    }
    out.to_string()
}

/// Each row as its first cell, then the others by name.
fn listed(table: &Table, columns: usize) -> String {
    let name = |k: usize| table.header.get(k).map(|column| column.name.as_str()).filter(|name| !name.is_empty());
    let of_row = |row: &Vec<String>| {
        let named = |(k, cell): (usize, &String)| name(k).map_or_else(|| cell.clone(), |name| format!("{name}: {cell}"));
        let rest: Vec<String> = row.iter().enumerate().skip(1).filter(|(_, cell)| !cell.is_empty()).map(named).collect();
        let first = row.first().map_or("", String::as_str);
        let number = first.starts_with(|c: char| c.is_ascii_digit());
        let first = match table.header.first().filter(|_| number) {
            Some(column) => format!("{} {first}", column.name),
            None => first.to_owned(),
        };
        format!("{first}\n{}", filled("    ", &rest.join("; "), 4, columns))
    };
    table.rows.iter().map(of_row).collect::<Vec<_>>().join("\n")
}

#[cfg(test)]
mod tests {
    use calibench_report::plain_table;

    use super::*;

    #[test]
    fn sentences_break_between_words_and_stay_below_their_beginning() {
        let text = "  Do: compare the order with the gear ratio and its double; or add it\nshort\n";
        let fit = fitted(&text.into(), 40);
        assert_eq!(fit, "  Do: compare the order with the gear\n    ratio and its double; or add it\nshort\n");
        assert_eq!(fitted(&text.into(), 200), text);
    }

    #[test]
    fn a_table_keeps_every_word_at_any_width() {
        let rows = [
            ["harmonic1:1", "a joint errs once per turn", "0.956", "sin -267.473 ± 14.638 µrad"],
            ["bearing_tilt:1", "its bearing tilts under load", "0.020", "k 18.244 ± 4.938 µrad/(N·m)"],
        ];
        let header = ["effect", "what", "probability", "as it would be fitted"];
        let text = Printout::from(plain_table(header, rows.map(|row| row.map(String::from)).into()));
        assert!(text.to_string().lines().all(|line| width(line) > 80));
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
