//! A diagnosis as tables.

use super::finding_notes::sizes;
use super::heat_map::{curve_line, heat_map_table};
use super::printout::Printout;
use super::tables::{column, optional, plain_table};
use calibench::diagnosis::{Diagnosis, Verdict};

/// The tables of a diagnosis for a terminal: the candidates, the contributions and, if requested or if nothing else
/// explains the residual, the heat map.
pub fn diagnosis_tables(d: &Diagnosis, with_heat_map: bool) -> Printout {
    let mut out = Printout::default();
    let rows: Vec<[String; 10]> = d
        .findings
        .iter()
        .map(|f| {
            let h = &f.hypothesis;
            [
                h.in_model.to_string(),
                d.registry.in_words(&h.in_model),
                format!("{:.3}", f.probability),
                format!("{:.0}", 100.0 * h.explains),
                format!("{:+.0}", 100.0 * f.cv_gain),
                format!("{:.1}", 100.0 * h.visible),
                format!("{:+.1}", h.ln_evidence_against_background),
                format!("{:+.1}", h.ln_evidence),
                sizes(f),
                f.rivals.join(", "),
            ]
        })
        .collect();
    out.push(match (rows.is_empty(), d.verdict.is_noise()) {
        (true, _) => "NO CANDIDATES\n",
        (false, true) => "CANDIDATES, none of which is significant\n",
        (false, false) => "CANDIDATES, the best first\n",
    });
    out.push(plain_table(
        [
            column("effect"),
            column("in words"),
            column("probability"),
            column("explains %"),
            optional(1, "cv gain %"),
            optional(1, "detectability %"),
            optional(2, "log evidence vs. background"),
            optional(3, "log evidence vs. noise"),
            optional(2, "as it would be fitted"),
            optional(3, "same in these data"),
        ],
        rows,
    ));
    let rows: Vec<[String; 4]> = d
        .contributions
        .iter()
        .take(10)
        .map(|c| {
            [c.effect.to_string(), d.registry.in_words(&c.effect), format!("{:.1}", 100.0 * c.share), format!("{:.2}", c.size)]
        })
        .collect();
    if !rows.is_empty() {
        out.push("\n\nWHAT CONTRIBUTES MOST when everything is fitted at once\n");
        out.push(plain_table(["effect", "in words", "share of what all explain %", "size, plausible sizes"], rows));
    }
    if with_heat_map || d.verdict == Verdict::Unexplained {
        out.push("\n\nJOINT ERROR BY VARIABLE, of any shape: log evidence vs. background, the best marked with a star\n");
        out.push(heat_map_table(&d.heat_map));
        if let Some(curve) = &d.heat_map.curve {
            out.push(format!("\n{}", curve_line(curve)));
        }
    }
    out
}
