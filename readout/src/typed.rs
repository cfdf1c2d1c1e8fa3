//! Numbers as people type or paste them: `J1 = 12.3, J2 = -90`, `12,5 -90 0`.

use crate::line_form::number;

/// The numbers of a typed line; `None` unless there are exactly `count`. Words, units and labels such as `J1:` are passed over;
/// a comma is a separator or a decimal sign, whichever gives the count.
pub fn numbers(line: &str, count: usize) -> Option<Vec<f64>> {
    [[',', ';'], [';', ';']].into_iter().find_map(|marks| {
        let is_mark = |c: char| c.is_whitespace() || marks.contains(&c) || matches!(c, '[' | ']' | '{' | '}' | '(' | ')' | '"');
        // `J1:-12.3`, `J1 = -12.3` and `1: -12.3` are labels with a number.
        let line = line.replace('=', ":").replace(" :", ":");
        let words = line.split(is_mark).flat_map(|word| word.split_inclusive(':')).filter(|word| !word.is_empty());
        let found: Option<Vec<f64>> = words.filter_map(word_number).collect();
        found.filter(|found| found.len() == count)
    })
}

/// The number of a word: nothing for a label or a word without digits, `Some(None)` for one that cannot be read.
fn word_number(word: &str) -> Option<Option<f64>> {
    if word.ends_with(':') || !word.contains(|c: char| c.is_ascii_digit()) || word.starts_with(char::is_alphabetic) {
        return None;
    }
    let bare = word.trim_end_matches(|c: char| c.is_alphabetic() || c == '°');
    Some(number(bare))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_as_people_paste_them() {
        let six = [12.5, -90.0, 90.25, 0.0, -45.0, 180.0];
        for line in [
            "12.5 -90 90.25 0 -45 180",
            "12.5, -90, 90.25, 0, -45, 180",
            "12,5\t-90\t90,25\t0\t-45\t180",
            "12,5; -90; 90,25; 0; -45; 180",
            "J1: 12.5 J2: -90 J3: 90.25 J4: 0 J5: -45 J6: 180",
            "J1 = 12.5, J2 = -90, J3 = 90.25, J4 = 0, J5 = -45, J6 = 180",
            "Joint 1: 12.5 Joint 2: -90.00 Joint 3: 90.25 Joint 4: 0.00 Joint 5: -45.00 Joint 6: 180.00",
            "{E6AXIS: A1 12.5, A2 -90.0, A3 90.25, A4 0.0, A5 -45.0, A6 180.0}",
            "[[12.5,-90,90.25,0,-45,180]]",
            "12.5deg -90deg 90.25deg 0deg -45deg 180°",
        ] {
            assert_eq!(numbers(line, 6).as_deref(), Some(&six[..]), "{line}");
        }
        for line in ["", "1 2 3 4 5", "1 2 3 4 5 6 7", "1 2 3 4 5 6.7.8", "hello"] {
            assert_eq!(numbers(line, 6), None, "{line}");
        }
    }
}
