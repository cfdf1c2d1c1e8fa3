//! The error after each step of a ladder, as a table.

use super::figures::{CROSS_VALIDATED, NOISE_LEFT, NOT_FITTED, RESIDUAL, expected};
use super::ladder_sentences::ladder_step_words;
use super::printout::Printout;
use super::tables::{Column, column, optional, plain_rows};
use calibench::prediction::PoseSource;
use calibench::residuals::Validation;
use calibench::selection::ladder::LadderStep;
use calibench::units::MM;

/// Steps as a table, errors in mm; one column per campaign if there are several, and one per campaign that was not fitted.
/// Without steps there is none.
pub fn ladder_step_table(steps: &[&LadderStep]) -> Printout {
    let Some(first) = steps.first() else { return Printout::default() };
    let mm = |x: f64| format!("{:.4}", x / MM);
    let at = steps.iter().find_map(|r| r.workspace.as_ref()).map_or(PoseSource::Limits, |w| w.at);
    let mut header: Vec<Column> = ["model", RESIDUAL.name, CROSS_VALIDATED.name, expected(at).name].map(column).into();
    let validated = steps.iter().any(|r| r.validation.is_some());
    if validated {
        header.extend(["mean", "max"].map(|of| column(format!("{}, {of}", NOT_FITTED.name))));
    }
    // Without known noise there is only what the best explanation would leave, which is not a figure of the instrument.
    let stated = first.diagnosis.lack_of_fit_p.is_some();
    if stated {
        header.push(optional(1, NOISE_LEFT.name));
        header.push(optional(1, "chi2/dof"));
    }
    let several = first.sessions.len() > 1;
    if several {
        for session in &first.sessions {
            header.push(optional(2, format!("{}, {}", session.name, CROSS_VALIDATED.name)));
            if session.from_others.is_some() {
                header.push(optional(2, format!("{}, from the others", session.name)));
            }
        }
    }
    header.extend(first.checks.iter().map(|c| column(format!("check {}, rms, with base and tool of its own", c.name))));
    let row = |r: &&LadderStep| {
        let workspace = r
            .workspace
            .as_ref()
            .map(|w| format!("{:.3} ({:.3} to {:.3})", w.mean.expected / MM, w.mean.low / MM, w.mean.high / MM));
        let mut row = vec![ladder_step_words(r), mm(r.fit), mm(r.cross_validated), workspace.unwrap_or_default()];
        if validated {
            let of = |f: fn(&Validation) -> f64| r.validation.as_ref().map_or(String::new(), |v| mm(f(v)));
            row.extend([of(|v| v.mean), of(|v| v.max)]);
        }
        if stated {
            row.push(mm(r.noise));
            row.push(format!("{:.2}", r.chi2_per_dof));
        }
        if several {
            for (session, place) in r.sessions.iter().zip(&first.sessions) {
                row.push(mm(session.cross_validated));
                if place.from_others.is_some() {
                    row.push(session.from_others.map_or("-".into(), mm));
                }
            }
        }
        row.extend(r.checks.iter().map(|c| c.result.as_ref().map_or("-".into(), |v| mm(v.rms))));
        row
    };
    plain_rows(header, steps.iter().map(row).collect()).into()
}
