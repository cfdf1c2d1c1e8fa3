//! A diagnosis as tables.

use super::diagnosis_sentences::{sentences, sizes};
use super::heat_map::{curve_line, heat_map_text};
use super::recommended::Recommended;
use super::tables::plain_table;
use super::workspace::{Forecast, NoForecast};
use calibench::assess::{Diagnosis, Verdict};

/// A diagnosis as tables for a terminal; `forecast` is the expected error over the workspace, or the reason why it cannot be
/// predicted.
pub fn diagnosis_text(
    d: &Diagnosis,
    forecast: &Result<Forecast, NoForecast>,
    commands: &Recommended,
    with_heat_map: bool,
) -> String {
    let mut out = String::new();
    for sentence in
        sentences(d, commands).into_iter().chain([forecast.as_ref().map_or_else(NoForecast::to_string, Forecast::sentence)])
    {
        out.push_str(&sentence);
        out.push('\n');
    }
    let rows: Vec<[String; 9]> = d
        .findings
        .iter()
        .map(|f| {
            let h = &f.hypothesis;
            [
                h.in_model.clone(),
                format!("{:.3}", f.probability),
                format!("{:+.1}", h.ln_evidence_against_background),
                format!("{:+.1}", h.ln_evidence),
                format!("{:.0}", 100.0 * h.explains),
                format!("{:+.0}", 100.0 * f.cv_gain),
                format!("{:.1}", 100.0 * h.visible),
                sizes(f),
                f.rivals.join(", "),
            ]
        })
        .collect();
    out.push_str("\nEFFECTS THAT STAND OUT\n");
    out.push_str(&plain_table(
        &[
            "effect",
            "probability",
            "log evidence vs. background",
            "log evidence vs. noise",
            "explains %",
            "cv gain %",
            "detectability %",
            "as it would be fitted",
            "same in these data",
        ],
        &rows,
    ));
    let rows: Vec<[String; 3]> = d
        .contributions
        .iter()
        .take(10)
        .map(|c| [c.effect.clone(), format!("{:.1}", 100.0 * c.share), format!("{:.2}", c.size)])
        .collect();
    out.push_str("\n\nWHAT CONTRIBUTES MOST when everything is fitted at once\n");
    out.push_str(&plain_table(&["effect", "share of the residual %", "size, plausible sizes"], &rows));
    if with_heat_map || d.verdict == Verdict::Unexplained {
        out.push_str("\n\nJOINT ERROR BY VARIABLE, of any shape: log evidence vs. background, the best marked with a star\n");
        out.push_str(&heat_map_text(&d.heat_map));
        if let Some(curve) = &d.heat_map.curve {
            out.push_str(&format!("\n{}", curve_line(curve)));
        }
    }
    out
}
