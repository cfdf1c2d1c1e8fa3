//! Pictures in files, as SVG: a few kilobytes, without script and without fonts of their own. Colours are classes, which the
//! style of a picture or its page explains.

use std::fmt::Write;

/// An axis: values from `low` to `high` lie evenly between two places, px.
#[derive(Debug, Clone, Copy)]
pub struct Scale {
    /// The values at both ends.
    pub values: [f64; 2],
    /// Their places.
    pub places: [f64; 2],
}

impl Scale {
    /// The place of a value.
    pub fn place(&self, value: f64) -> f64 {
        let [[low, high], [from, to]] = [self.values, self.places];
        from + (value - low) / (high - low).max(f64::MIN_POSITIVE) * (to - from)
    }
}

/// A path with round ends, so wide, px; nothing if it is empty.
pub fn stroke(out: &mut String, class: &str, path: &str, width: f64) {
    if !path.is_empty() {
        _ = writeln!(
            out,
            "<path class=\"{class}\" d=\"{path}\" fill=\"none\" stroke-width=\"{width}\" stroke-linecap=\"round\" stroke-linejoin=\"round\"/>"
        );
    }
}

/// A path through places.
pub fn polyline(places: impl Iterator<Item = [f64; 2]>) -> String {
    let places: Vec<String> = places.map(|[x, y]| format!("{x:.1} {y:.1}")).collect();
    format!("M{}", places.join("L"))
}

/// A thin straight line.
pub fn line(out: &mut String, class: &str, [x1, y1, x2, y2]: [f64; 4]) {
    _ = writeln!(out, "<path class=\"{class}\" d=\"M{x1:.1} {y1:.1}L{x2:.1} {y2:.1}\"/>");
}

/// A dot that says something of itself.
pub fn dot(out: &mut String, class: &str, [x, y]: [f64; 2], radius: f64, said: &str) {
    _ = writeln!(
        out,
        "<circle class=\"{class}\" cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"{radius}\"><title>{}</title></circle>",
        escaped(said)
    );
}

/// A text at a place.
pub fn text(out: &mut String, [x, y]: [f64; 2], attributes: &str, content: &str) {
    let space = if attributes.is_empty() { "" } else { " " };
    _ = writeln!(out, "<text x=\"{x:.1}\" y=\"{y:.1}\"{space}{attributes}>{}</text>", escaped(content));
}

/// Text that may stand in markup and in its attributes.
pub fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
