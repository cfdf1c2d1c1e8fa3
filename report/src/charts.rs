//! Control charts over the checks of a robot: in words, as a table, and as a page.

use std::fmt::Write;

use calibench::monitoring::check::charts::{Chart, ChartPoint, Charts, RUN_LENGTH};
use calibench::monitoring::check::conditions::Elementary;
use calibench::units::{DEG, UM};

use super::printout::Printout;
use super::svg::{Scale, dot, escaped, line, polyline, stroke, text};
use super::tables::plain_rows;

/// Axes by number.
const AXES: [&str; 3] = ["x", "y", "z"];

/// An elementary change in words.
#[must_use]
pub fn elementary_words(of: Elementary) -> String {
    match of {
        Elementary::Joint(joint) => format!("zero of joint {joint}"),
        Elementary::Tool(axis) => format!("tool along {} of the flange", AXES[axis % 3]),
        Elementary::Base(axis) => format!("base or artifact along {} of the world", AXES[axis % 3]),
        Elementary::Growth => "size of the arm".into(),
    }
}

/// Its name in files.
#[must_use]
pub fn elementary_name(of: Elementary) -> String {
    match of {
        Elementary::Joint(joint) => format!("joint:{joint}"),
        Elementary::Tool(axis) => format!("tool:{}", AXES[axis % 3]),
        Elementary::Base(axis) => format!("base:{}", AXES[axis % 3]),
        Elementary::Growth => "growth".into(),
    }
}

/// The unit in which it is printed, with its name in files and on screens.
#[must_use]
pub fn elementary_unit(of: Elementary) -> (f64, &'static str, &'static str) {
    match of {
        Elementary::Joint(_) => (DEG / 1000.0, "mdeg", "mdeg"),
        Elementary::Growth => (1e-6, "ppm", "ppm"),
        _ => (UM, "um", "\u{b5}m"),
    }
}

/// The charts as text: what drifts, and the latest value of each.
#[must_use]
pub fn charts_text(days: &[String], charts: &Charts) -> Printout {
    let mut out = Printout::from("\n");
    let checks = days.len();
    let plural = if checks == 1 { "check" } else { "checks" };
    let signals = charts.signals();
    if signals.is_empty() {
        out.push(format!(
            "Control charts of {checks} {plural}: nothing drifts (a false signal once in {RUN_LENGTH:.0} checks on average).\n"
        ));
    }
    for (chart, at) in &signals {
        let day = days.get(*at).map_or("", String::as_str);
        out.push(format!(
            "Drift: {}, signalled by the check of {day} (a false signal once in {RUN_LENGTH:.0} checks on average).\n",
            elementary_words(chart.of)
        ));
    }
    let header = ["chart", "latest change", "moving average", "limit"];
    let row = |chart: &Chart| {
        let (unit, _, printed) = elementary_unit(chart.of);
        let last = chart.points.last();
        let change = last.filter(|p| p.sigma.is_finite()).map_or_else(
            || "not seen at these poses".into(),
            |p| format!("{:+.1} \u{b1} {:.1} {printed}", p.estimate / unit, p.sigma / unit),
        );
        let average = last.map_or(0.0, |p| p.average);
        vec![elementary_words(chart.of), change, format!("{average:+.2}"), format!("{:.2}", charts.limit)]
    };
    let rows: Vec<Vec<String>> = charts.charts.iter().map(row).collect();
    out + "\n" + plain_rows(header, rows)
}

const STYLE: &str = "\
:root{color-scheme:light dark;--ink:#22262b;--paper:#fff;--grid:#d5d9de;--line:#0b62a3;--alarm:#b3400a}\
@media(prefers-color-scheme:dark){:root{--ink:#dde2e8;--paper:#16191d;--grid:#3a424b;--line:#6cb8ec;--alarm:#ff9d5c}}\
body{font:16px/1.5 system-ui,sans-serif;color:var(--ink);background:var(--paper);margin:0 auto;max-width:70rem;padding:1rem}\
h1{font-size:1.4rem}main{display:grid;grid-template-columns:repeat(auto-fill,minmax(20rem,1fr));gap:1rem}\
figure{margin:0}figcaption{font-size:.95rem}svg{width:100%;height:auto}table{border-collapse:collapse}\
td,th{text-align:left;padding:.2rem .8rem .2rem 0;border-bottom:1px solid var(--grid)}\
.a{stroke:var(--line)}.l{stroke:var(--alarm);stroke-dasharray:5 4}.z{stroke:var(--grid)}\
.d{fill:var(--line)}.s{fill:var(--alarm)}text{fill:var(--ink);font:11px system-ui,sans-serif}";

/// The charts as a page of its own, without scripts; `verdicts` hold the condition named by each check, and whether anything
/// had changed.
#[must_use]
pub fn charts_page(robot: &str, days: &[String], verdicts: &[(String, bool)], charts: &Charts) -> String {
    let signals = charts.signals();
    let headline = match signals.first() {
        None => "Nothing drifts".to_owned(),
        Some((chart, _)) if signals.len() == 1 => format!("Drift: {}", elementary_words(chart.of)),
        Some(_) => format!("{} charts have signalled", signals.len()),
    };
    let mut out = format!(
        "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<meta name=\"viewport\" content=\"width=device-width,initial-scale=1\">\n\
         <title>Checks of {robot}</title>\n<style>{STYLE}</style>\n</head>\n<body>\n<h1>{robot}: {headline}</h1>\n\
         <p>Moving averages (weight 0.2) of the changes since all measurements before, in their standard deviations. \
         While nothing changes, one of these charts leaves its limits of \u{b1} {:.2} once in {RUN_LENGTH:.0} checks on average.</p>\n<main>\n",
        charts.limit,
        robot = escaped(robot),
        headline = escaped(&headline),
    );
    for chart in charts.charts.iter().filter(|chart| chart.points.iter().any(|p| p.sigma.is_finite())) {
        out.push_str(&figure(chart, days, charts.limit));
    }
    out.push_str("</main>\n<h2>Checks</h2>\n<table>\n<tr><th>day</th><th>verdict</th></tr>\n");
    for (day, (condition, changed)) in days.iter().zip(verdicts) {
        let verdict = if *changed { format!("changed: {condition}") } else { "the calibration holds".into() };
        _ = writeln!(out, "<tr><td>{}</td><td>{}</td></tr>", escaped(day), escaped(&verdict));
    }
    out.push_str("</table>\n</body>\n</html>\n");
    out
}

/// Width and height of a chart, units of its viewBox.
const SIZE: [f64; 2] = [340.0, 150.0];
/// Width at the left for the labels of the ordinate, units of the viewBox.
const LEFT: f64 = 34.0;
/// Margin on all four sides, units of the viewBox.
const MARGIN: f64 = 10.0;

fn figure(chart: &Chart, days: &[String], limit: f64) -> String {
    let [width, height] = SIZE;
    let count = chart.points.len();
    let most = chart.points.iter().map(|p| p.average.abs()).fold(1.25 * limit, f64::max);
    let last = count.saturating_sub(1).max(1) as f64;
    let along = Scale { values: [0.0, last], places: [LEFT + MARGIN, width - MARGIN] };
    let x = |k: usize| along.place(if count > 1 { k as f64 } else { 0.5 });
    let up = Scale { values: [-most, most], places: [height - MARGIN, MARGIN] };
    let signal = chart.signal(limit);
    let said = match signal.and_then(|k| days.get(k)) {
        Some(day) => format!("signalled by the check of {day}"),
        None => "within its limits".to_owned(),
    };
    let mut out = format!(
        "<figure>\n<figcaption><b>{words}</b>, {said}</figcaption>\n<svg viewBox=\"0 0 {width} {height}\" role=\"img\" aria-label=\"{words}, {said}\">\n",
        words = elementary_words(chart.of)
    );
    for (class, at) in [("l", limit), ("z", 0.0), ("l", -limit)] {
        line(&mut out, class, [LEFT, up.place(at), width - MARGIN, up.place(at)]);
        text(&mut out, [2.0, up.place(at) + 4.0], "", &format!("{at:+.1}"));
    }
    let place = |(k, p): (usize, &ChartPoint)| [x(k), up.place(p.average)];
    stroke(&mut out, "a", &polyline(chart.points.iter().enumerate().map(place)), 2.0);
    let (unit, _, printed) = elementary_unit(chart.of);
    for (k, p) in chart.points.iter().enumerate() {
        let class = if p.average.abs() > limit { "s" } else { "d" };
        let day = days.get(k).map_or("", String::as_str);
        let said = format!("{day}: {:+.1} \u{b1} {:.1} {printed}", p.estimate / unit, p.sigma / unit);
        dot(&mut out, class, place((k, p)), 3.5, &said);
    }
    out.push_str("</svg>\n</figure>\n");
    out
}
