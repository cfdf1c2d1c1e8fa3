//! How a line of text is written, as a template: `{name}, {x}, {y}, {z}`.

/// A line of text with fields in it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LineForm {
    /// Text before the first field.
    before: String,
    /// Each field with the text after it.
    fields: Vec<Slot>,
}

#[derive(Debug, Clone, PartialEq, Eq)]
struct Slot {
    /// Empty for a field that is passed over.
    name: String,
    /// Empty after the last field, if nothing follows it.
    after: String,
}

impl LineForm {
    /// Reads a template. `{}` is a field that is passed over; a blank stands for one or more.
    ///
    /// # Errors
    /// What is wrong with it, in words.
    pub fn parse(template: &str, known: impl Fn(&str) -> bool) -> Result<Self, String> {
        let mut pieces = template.trim().split('{');
        let before = pieces.next().unwrap_or_default().to_owned();
        let mut fields: Vec<Slot> = Vec::new();
        for piece in pieces {
            let Some((name, after)) = piece.split_once('}') else { return Err(format!("'{{{piece}' is not closed")) };
            if !name.is_empty() && !known(name) {
                return Err(format!("'{{{name}}}' is not a field"));
            }
            if !name.is_empty() && fields.iter().any(|slot| slot.name == name) {
                return Err(format!("'{{{name}}}' occurs twice"));
            }
            if let Some(slot) = fields.last().filter(|slot| slot.after.is_empty()) {
                return Err(format!("nothing separates '{{{}}}' and '{{{name}}}'", slot.name));
            }
            fields.push(Slot { name: name.to_owned(), after: after.to_owned() });
        }
        Ok(LineForm { before, fields })
    }

    /// True if the template has this field.
    pub fn has(&self, name: &str) -> bool {
        self.fields.iter().any(|slot| slot.name == name)
    }

    /// Number of fields with names.
    pub fn names(&self) -> usize {
        self.fields.iter().filter(|slot| !slot.name.is_empty()).count()
    }

    /// A number in a line; `None` if the text is not one. A comma that separates fields is in no number.
    pub fn number(&self, text: &str) -> Option<f64> {
        let separates = self.before.contains(',') || self.fields.iter().any(|slot| slot.after.contains(','));
        number(text).filter(|_| !(separates && text.contains(',')))
    }

    /// The fields of a line by their names; `None` if the line is of another form.
    pub fn read<'l>(&self, line: &'l str) -> Option<Vec<(&str, &'l str)>> {
        let mut rest = line.trim();
        if !self.before.is_empty() {
            let (skipped, after) = split_at(rest, &self.before)?;
            if !skipped.trim().is_empty() {
                return None;
            }
            rest = after;
        }
        let mut read = Vec::with_capacity(self.fields.len());
        for slot in &self.fields {
            let (value, after) = if slot.after.is_empty() { (rest, "") } else { split_at(rest, &slot.after)? };
            rest = after.trim_start();
            if !slot.name.is_empty() {
                read.push((slot.name.as_str(), value.trim()));
            }
        }
        rest.is_empty().then_some(read)
    }
}

/// Splits a text at the first place of a mark; blanks of the mark stand for one or more, those around it for any number.
fn split_at<'l>(text: &'l str, mark: &str) -> Option<(&'l str, &'l str)> {
    let text = text.trim_start();
    if mark.trim().is_empty() {
        let at = text.find(char::is_whitespace).unwrap_or(text.len());
        return Some((&text[..at], text[at..].trim_start()));
    }
    text.split_once(mark.trim())
}

/// A number as instruments write it, with a point or a comma; `None` if the text is not one, or not finite.
pub fn number(text: &str) -> Option<f64> {
    let text = text.trim();
    let plain = text.strip_prefix('+').unwrap_or(text);
    // A comma at the end is the mark of a field more.
    let pointed = if plain.contains('.') || plain.ends_with(',') { plain.to_owned() } else { plain.replacen(',', ".", 1) };
    // Words such as `inf` are numbers to the parser of the language, and not to anybody else.
    if pointed.contains(|c: char| c.is_alphabetic() && !matches!(c, 'e' | 'E')) {
        return None;
    }
    pointed.parse().ok().filter(|number: &f64| number.is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn form(template: &str) -> LineForm {
        LineForm::parse(template, |name| ["name", "x", "y", "z"].contains(&name)).expect(template)
    }

    #[test]
    fn lines_as_instruments_write_them() {
        let cases = [
            ("{x},{y},{z}", "1.5, -2,3e1", vec![("x", "1.5"), ("y", "-2"), ("z", "3e1")]),
            ("{x} {y} {z}", "  1.5   -2\t3", vec![("x", "1.5"), ("y", "-2"), ("z", "3")]),
            ("{name};{x};{y};{z};{}", "P 1;1,5;2,5;3,5;ok;x", vec![("name", "P 1"), ("x", "1,5"), ("y", "2,5"), ("z", "3,5")]),
            ("X{x} Y{y} Z{z}", "X 1.0 Y 2.0 Z 3.0", vec![("x", "1.0"), ("y", "2.0"), ("z", "3.0")]),
            ("M,{name}: {x}/{y}/{z} mm", "M,a:1/2/3 mm", vec![("name", "a"), ("x", "1"), ("y", "2"), ("z", "3")]),
        ];
        for (template, line, fields) in cases {
            assert_eq!(form(template).read(line), Some(fields), "{template} of {line}");
        }
        for line in ["1,2", "1,2,3,", "", "hello"] {
            assert!(form("{x},{y},{z}").read(line).is_none_or(|f| f.iter().any(|(_, v)| number(v).is_none())), "{line}");
        }
    }

    #[test]
    fn templates_that_cannot_be_read() {
        for (template, problem) in [
            ("{x},{y", "'{y' is not closed"),
            ("{x}{y}", "nothing separates '{x}' and '{y}'"),
            ("{x},{x}", "'{x}' occurs twice"),
            ("{u}", "'{u}' is not a field"),
        ] {
            let read = LineForm::parse(template, |name| ["x", "y"].contains(&name));
            assert_eq!(read, Err(problem.to_owned()));
        }
    }

    #[test]
    fn numbers_with_points_and_commas() {
        for (text, value) in [("1.5", 1.5), (" +2,25 ", 2.25), ("-1e-3", -1e-3), (".5", 0.5)] {
            assert_eq!(number(text), Some(value), "{text}");
        }
        for text in ["", "inf", "nan", "1.2.3", "1,2,3", "x"] {
            assert_eq!(number(text), None, "{text}");
        }
    }
}
