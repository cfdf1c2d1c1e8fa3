//! A picture of the gallery as SVG, readable on light and on dark.

use super::plot::Plot;
use super::ticks::{label, ticks};
use crate::svg::{Scale, escaped, line, polyline, stroke, text};

/// Width and height of the picture, CSS pixels.
const SIZE: [f64; 2] = [560.0, 330.0];
/// Left, top, right and bottom of the rectangle in which points are drawn, CSS pixels: title above, labels left and below.
const INSIDE: [f64; 4] = [78.0, 58.0, 546.0, 280.0];

/// A diamond about the place at which it is drawn.
const DIAMOND: &str = "m0-4l4 4-4 4-4-4z";

/// Names longer than this are cut.
const LONGEST_NAME: usize = 16;

const STYLE: &str = "\
text{font:12px system-ui,sans-serif;fill:#333}.t{font-size:14px;font-weight:600}.b{fill:#fff}.g{stroke:#ddd}.z{stroke:#999}\
.p{stroke:#0072b2;stroke-opacity:.55}.m{stroke:#d55e00}.c{stroke:#d55e00}\
@media(prefers-color-scheme:dark){text{fill:#ddd}.b{fill:#16191d}.g{stroke:#333a42}.z{stroke:#778}.p{stroke:#6cb8ec}.m,.c{stroke:#ff9d5c}}";

impl Plot {
    /// The picture.
    pub fn svg(&self) -> String {
        let [width, height] = SIZE;
        let mut out = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" width=\"{width}\" height=\"{height}\" role=\"img\">\n\
             <title>{}</title>\n<style>{STYLE}</style>\n<rect class=\"b\" width=\"{width}\" height=\"{height}\"/>\n",
            escaped(&self.title)
        );
        self.heading(&mut out);
        self.axes(&mut out);
        let at = |p: &[f64; 2]| format!("{:.1} {:.1}", self.place(0, p[0]), self.place(1, p[1]));
        let dots = |wanted: bool| -> String {
            let of = self.points.iter().enumerate().filter(|(k, _)| self.marked.contains(k) == wanted);
            of.map(|(_, p)| format!("M{}h0", at(p))).collect()
        };
        stroke(&mut out, "p", &dots(false), 5.0);
        let diamond = |(p, y): (&[f64; 2], &f64)| format!("M{}{DIAMOND}", at(&[p[0], *y]));
        stroke(&mut out, "c", &self.points.iter().zip(&self.taken).map(diamond).collect::<String>(), 1.2);
        stroke(&mut out, "m", &dots(true), 10.0);
        let piece = |points: &Vec<[f64; 2]>| polyline(points.iter().map(|p| [self.place(0, p[0]), self.place(1, p[1])]));
        stroke(&mut out, "c", &self.curve.iter().map(piece).collect::<String>(), 3.0);
        out.push_str("</svg>\n");
        out
    }

    fn heading(&self, out: &mut String) {
        text(out, [INSIDE[0], 20.0], "class=\"t\"", &self.title);
        let effect = if self.marked.is_empty() { "explained by the effect" } else { "the sample with the effect" };
        let [x, y] = [INSIDE[0], 38.0];
        stroke(out, "p", &format!("M{} {}h0", x + 4.0, y), 6.0);
        text(out, [x + 14.0, y + 4.0], "", "residual");
        match (self.marked.is_empty(), self.taken.is_empty()) {
            (true, true) => stroke(out, "c", &format!("M{} {}h22", x + 150.0, y), 3.0),
            (true, false) => stroke(out, "c", &format!("M{} {}{DIAMOND}", x + 161.0, y), 1.2),
            (false, _) => stroke(out, "m", &format!("M{} {}h0", x + 161.0, y), 10.0),
        }
        text(out, [x + 180.0, y + 4.0], "", effect);
    }

    fn axes(&self, out: &mut String) {
        let [left, top, right, bottom] = INSIDE;
        let across = ticks(self.range(1), false);
        for y in &across {
            let at = self.place(1, *y);
            line(out, if *y == 0.0 { "z" } else { "g" }, [left, at, right, at]);
            text(out, [left - 6.0, at + 4.0], "text-anchor=\"end\"", &label(*y, &across));
        }
        let along = ticks(self.range(0), self.degrees);
        let named = self.names.iter().enumerate().map(|(k, name)| (k as f64, cut(name)));
        let numbers = along.iter().map(|x| (*x, label(*x, &along)));
        let places: Vec<(f64, String)> = if self.names.is_empty() { numbers.collect() } else { named.collect() };
        // Names that do not stand side by side are thinned.
        let widest = places.iter().map(|(_, name)| name.chars().count()).max().unwrap_or(1) as f64 * 7.0 + 10.0;
        let every = (widest * places.len() as f64 / (right - left)).ceil().max(1.0) as usize;
        for (x, name) in places.iter().step_by(every) {
            let at = self.place(0, *x);
            line(out, "g", [at, top, at, bottom]);
            text(out, [at, bottom + 17.0], "text-anchor=\"middle\"", name);
        }
        let middle = [0.5 * (left + right), 0.5 * (top + bottom)];
        text(out, [middle[0], SIZE[1] - 10.0], "text-anchor=\"middle\"", &self.x);
        let turned = format!("text-anchor=\"middle\" transform=\"rotate(-90 16 {})\"", middle[1]);
        text(out, [16.0, middle[1]], &turned, &self.y);
    }

    /// Place of a value in the picture.
    fn place(&self, axis: usize, value: f64) -> f64 {
        let [low, high] = self.range(axis);
        let room = if axis == 0 && !self.names.is_empty() { 0.0 } else { 0.04 * (high - low) };
        let [left, top, right, bottom] = INSIDE;
        let places = if axis == 0 { [left, right] } else { [bottom, top] };
        Scale { values: [low - room, high + room], places }.place(value)
    }
}

fn cut(name: &str) -> String {
    if name.chars().count() <= LONGEST_NAME {
        name.to_owned()
    } else {
        name.chars().take(LONGEST_NAME - 1).chain(['…']).collect()
    }
}
