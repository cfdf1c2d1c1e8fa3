//! The heat map: a table of all joints and the variables that their errors may follow, and the best curve as a sparkline.

use super::tables::{Table, plain_rows};
use calibench::diagnosis::heat_map::{Curve, HeatMap, Variable};
use calibench::units::URAD;

/// Table of log evidence against the model discrepancy (background), joints by variables; the best entry is starred.
pub fn heat_map_table(map: &HeatMap) -> Table {
    let mut variables: Vec<Variable> = Vec::new();
    map.cells.iter().for_each(|c| {
        if !variables.contains(&c.variable) {
            variables.push(c.variable);
        }
    });
    let joints = map.cells.iter().map(|c| c.joint + 1).max().unwrap_or(0);
    let cell = |joint: usize, variable: Variable| {
        let place = map.cells.iter().position(|c| c.joint == joint && c.variable == variable);
        place.map_or_else(String::new, |k| {
            let star = if map.best == Some(k) { " *" } else { "" };
            format!("{:+.1}{star}", map.cells[k].ln_evidence_against_background)
        })
    };
    let header: Vec<String> = std::iter::once("joint".to_owned()).chain(variables.iter().map(|v| v.name())).collect();
    let rows: Vec<Vec<String>> = (0..joints)
        .map(|j| std::iter::once((j + 1).to_string()).chain(variables.iter().map(|v| cell(j, *v))).collect())
        .collect();
    plain_rows(header, rows)
}

/// A curve on one line: `joint 3 against tau2, -45 to 12 N·m: ▁▂▄▇█ -80 to +120 urad, one-sigma 12 to 25 urad`.
pub fn curve_line(curve: &Curve) -> String {
    const BARS: [char; 8] = ['▁', '▂', '▃', '▄', '▅', '▆', '▇', '█'];
    let (unit, si) = curve.variable.unit();
    let range = |of: &[f64]| of.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(*x), h.max(*x)));
    let (low, high) = range(&curve.mean);
    let (least, most) = range(&curve.sigma);
    let height = |x: &f64| if high > low { ((x - low) / (high - low) * 7.0).round() as usize } else { 0 };
    let bars: String = curve.mean.iter().map(|x| BARS[height(x).min(7)]).collect();
    let end = |x: Option<&f64>| x.map_or(f64::NAN, |x| x / si);
    format!(
        "joint {} against {}, {:.0} to {:.0} {unit}: {bars} {:+.0} to {:+.0} µrad, one-sigma {:.0} to {:.0} µrad",
        curve.joint + 1,
        curve.variable.name(),
        end(curve.at.first()),
        end(curve.at.last()),
        low / URAD,
        high / URAD,
        least / URAD,
        most / URAD
    )
}
