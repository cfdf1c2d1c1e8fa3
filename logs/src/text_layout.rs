//! How a table of text is written, seen from its beginning.

/// The layout of a table.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Text {
    pub delimiter: u8,
    /// True if the decimal sign is a comma.
    pub comma: bool,
    /// Number of lines before the titles.
    pub skipped: usize,
    pub titles: Vec<String>,
}

impl Text {
    /// Bytes at the beginning of a file by which its layout is judged.
    pub const HEAD: usize = 1 << 16;
}

/// Most lines before the titles.
const MOST_SKIPPED: usize = 40;
/// Fewest columns: a time, and what was measured then.
const FEWEST: usize = 3;

/// The layout of a text whose beginning is given; `None` if it is no table with titles.
pub(crate) fn layout(head: &str) -> Option<Text> {
    let lines: Vec<&str> = head.trim_start_matches('\u{feff}').lines().take(MOST_SKIPPED + 2).collect();
    let fields =
        |line: &str, mark: u8| line.split(char::from(mark)).map(|f| f.trim().trim_matches('"').to_owned()).collect::<Vec<_>>();
    for (skipped, line) in lines.iter().enumerate().take(MOST_SKIPPED) {
        for mark in [b';', b'\t', b',', b' '] {
            let titles = fields(line.trim_end(), mark);
            let are_titles = titles.len() >= FEWEST && titles.iter().all(|t| !t.is_empty() && t.parse::<f64>().is_err());
            let Some(next) = lines.get(skipped + 1).filter(|_| are_titles) else { continue };
            let row = fields(next.trim_end(), mark);
            let comma = mark != b',' && row.iter().any(|f| f.contains(',') && f.replace(',', ".").parse::<f64>().is_ok());
            let is_number = |f: &String| f.replace(if comma { ',' } else { '.' }, ".").parse::<f64>().is_ok();
            if row.len() == titles.len() && row.iter().any(is_number) {
                return Some(Text { delimiter: mark, comma, skipped, titles });
            }
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_titles_are_found_below_remarks() {
        let found = layout("Trace of today\n\nt;q1;q2\n0,1;1,5;2,5\n").expect("a table");
        assert_eq!((found.delimiter, found.comma, found.skipped, found.titles.len()), (b';', true, 2, 3));
        let rtde = layout("timestamp actual_q_0 actual_q_1\n0.1 1 2\n").expect("a table");
        assert_eq!((rtde.delimiter, rtde.skipped), (b' ', 0));
        assert_eq!(layout("hello\nworld"), None);
    }
}
