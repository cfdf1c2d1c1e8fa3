//! Colour by meaning: the same few styles on all lines, laid over text that says everything without them.

use anstyle::{AnsiColor, Style};

/// When to use colour.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, clap::ValueEnum)]
pub enum When {
    /// In a terminal, unless NO_COLOR is set; else by CLICOLOR_FORCE
    #[default]
    Auto,
    /// Always
    Always,
    /// Never
    Never,
}

impl When {
    /// True if text for `stream` is coloured.
    pub fn for_stream(self, stream: &impl anstream::stream::RawStream) -> bool {
        match self {
            When::Always => true,
            When::Never => false,
            When::Auto => anstream::AutoStream::choice(stream) != anstream::ColorChoice::Never,
        }
    }
}

/// Meaning of a colour.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Meaning {
    /// As hoped: met, taken, nothing left.
    Good,
    /// To be looked at: something is missing, a value is out of its range, a prediction is a guess.
    Warning,
    /// Not as hoped: not met, refused, an error.
    Error,
    /// To be read first.
    Strong,
    /// Already known.
    Quiet,
}

impl Meaning {
    fn style(self) -> Style {
        match self {
            Meaning::Good => AnsiColor::Green.on_default(),
            Meaning::Warning => AnsiColor::Yellow.on_default(),
            Meaning::Error => AnsiColor::Red.on_default().bold(),
            Meaning::Strong => Style::new().bold(),
            Meaning::Quiet => Style::new().dimmed(),
        }
    }

    fn paint(self, text: &str) -> String {
        let style = self.style();
        format!("{style}{text}{style:#}")
    }
}

/// Beginnings of lines, and what they mean.
const LABELS: [(&str, Meaning); 19] = [
    ("Verdict: nothing left.", Meaning::Good),
    ("Verdict: identified.", Meaning::Good),
    ("Verdict: suspect samples.", Meaning::Error),
    ("Verdict: data do not fit.", Meaning::Error),
    ("Verdict:", Meaning::Warning),
    ("Without them:", Meaning::Warning),
    ("Do:", Meaning::Strong),
    ("Next:", Meaning::Strong),
    ("Best:", Meaning::Strong),
    ("Use ", Meaning::Strong),
    ("Against it:", Meaning::Error),
    ("Note:", Meaning::Warning),
    ("Added.", Meaning::Good),
    ("WARNING:", Meaning::Warning),
    ("warning:", Meaning::Warning),
    ("not rewritten:", Meaning::Error),
    ("calibench:", Meaning::Error),
    ("Not tested:", Meaning::Quiet),
    ("not shown:", Meaning::Quiet),
];

/// Ends of lines, and what they mean.
const ENDS: [(&str, Meaning); 2] = [("  NOT MET", Meaning::Error), ("  met", Meaning::Good)];

/// Words inside a line, and what they mean.
const INSIDE: [(&str, Meaning); 5] = [
    ("WARNING:", Meaning::Warning),
    ("(negative: not physical)", Meaning::Warning),
    ("a symptom of something missing", Meaning::Warning),
    ("chi2/dof", Meaning::Quiet),
    ("NOT MET", Meaning::Error),
];

/// Text with its colours, line by line.
pub fn painted(text: &str) -> String {
    let lines: Vec<String> = text.split('\n').map(line).collect();
    lines.join("\n")
}

fn line(text: &str) -> String {
    if text.starts_with(['┌', '╞', '├', '└']) {
        return text.to_owned();
    }
    if let Some((label, meaning)) = LABELS.iter().find(|(label, _)| text.starts_with(label)) {
        return format!("{}{}", meaning.paint(label), &text[label.len()..]);
    }
    if let Some((end, meaning)) = ENDS.iter().find(|(end, _)| text.ends_with(end)) {
        return format!("{}{}", &text[..text.len() - end.len()], meaning.paint(end));
    }
    if let Some(end) = heading(text) {
        return format!("{}{}", Meaning::Strong.paint(&text[..end]), &text[end..]);
    }
    if let Some((words, meaning)) = INSIDE.iter().find(|(words, _)| text.contains(words)) {
        return text.replacen(words, &meaning.paint(words), 1);
    }
    text.to_owned()
}

/// Byte at which the capitals of a section's heading end, such as `TRUTH against estimate`; `None` for a sentence.
fn heading(text: &str) -> Option<usize> {
    /// Words that may follow a heading of one word; any other word makes it a sentence that begins with an abbreviation.
    const FOLLOW: [&str; 5] = ["of", "against", "in", "after", "by"];
    let is_capital = |word: &str| word.len() > 1 && word.chars().all(|c| c.is_ascii_uppercase() || c == '\'');
    let bare = |word: &'_ str| word.trim_end_matches([',', ':']).len();
    let words: Vec<&str> = text.split(' ').collect();
    let capital = words.iter().take_while(|word| is_capital(&word[..bare(word)])).count();
    let last = words.get(capital.checked_sub(1)?)?;
    let next = words.get(capital);
    let is_heading = capital > 1 || last.len() > bare(last) || next.is_none_or(|next| FOLLOW.contains(next));
    is_heading.then(|| words[..capital].join(" ").len() - (last.len() - bare(last)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plain(text: &str) -> String {
        anstream::adapter::strip_str(text).to_string()
    }

    #[test]
    fn colour_changes_no_letter() {
        let text = "Verdict: partly. Something is missing.\n  rank   31.0  in [31, 31]  met\n  mean  9.0  in [1, 2]  NOT MET\n\
                    CANDIDATES, the best first\nPARAMETERS, by TriCal\nBY BALL (artifact): residual\nordinary\n│ c2 │ mdeg/(N·m)  (negative: not physical) │\n";
        let colours = painted(text);
        assert_eq!(plain(&colours), text);
        assert!(colours.lines().filter(|line| line.contains('\u{1b}')).count() == 7, "{colours:?}");
    }

    #[test]
    fn a_verdict_has_the_colour_of_its_meaning() {
        let of = |text: &str| painted(text).split("Verdict").next().unwrap_or_default().to_owned();
        let good = of("Verdict: nothing left. What remains is noise.");
        assert_eq!(good, format!("{}", Meaning::Good.style()));
        assert_eq!(of("Verdict: partly. More is missing."), format!("{}", Meaning::Warning.style()));
        assert_eq!(of("Verdict: suspect samples. Look."), format!("{}", Meaning::Error.style()));
    }
}
