//! Proposed measurements and the detectability of a plan: words and tables.

use super::effect_names::called;
use super::printout::{Printout, Sentence};
use super::tables::{Table, column, optional, plain_table};
use calibench::diagnosis::detectability::Detectability;
use calibench::planning::designer::Criterion;
use calibench::planning::{Offer, Proposal, Step};
use calibench::units::MM;

/// One minute, s.
const MINUTE: f64 = 60.0;

/// A proposal as a table: one row per action, with the outcome expected after 5 / 10 / 20 measurements.
pub fn next_table(p: &Proposal) -> Table {
    let along = |steps: &[Step], of: &dyn Fn(&Step) -> Option<String>| -> String {
        let all: Vec<String> = steps.iter().filter_map(of).collect();
        all.join(" / ")
    };
    let row = |name: String, minutes: [String; 2], steps: &[Step]| {
        let [setup, each] = minutes;
        [
            name,
            setup,
            each,
            along(steps, &|s| Some(s.count.to_string())),
            along(steps, &|s| s.forecast.map(|o| format!("{:.2}", o.truth))),
            along(steps, &|s| s.forecast.map(|o| format!("{:.2}", o.resolved))),
            along(steps, &|s| s.error.map(|e| format!("{:.3}", e / MM))),
        ]
    };
    let mut rows = vec![row("nothing more".into(), [String::new(), String::new()], std::slice::from_ref(&p.now))];
    rows.extend(p.offers.iter().map(|o| {
        let minutes = [o.action.setup_s, o.action.each_s].map(|s| format!("{:.1}", s / MINUTE));
        row(o.action.words(), minutes, &o.steps)
    }));
    plain_table(
        [
            column("measure"),
            optional(2, "set-up min"),
            optional(2, "each min"),
            column("measurements"),
            optional(1, "P(truth)"),
            column("resolved"),
            column("expected over the joint limits with all that may be missing, mm"),
        ],
        rows,
    )
}

/// A proposal in words: the effects in question, the best action, the next best ones, the assumptions.
pub fn next_sentences(p: &Proposal) -> Vec<Sentence> {
    let mut all = Vec::new();
    match p.rivals.as_slice() {
        [] => {
            all.push(Sentence::detail("No effect of the catalogue is in question; measurements are chosen for accuracy alone."))
        }
        [one] => all.push(Sentence::detail(format!(
            "Only one effect is in question, {}; measurements are chosen for accuracy alone.",
            called(&p.registry, &one.effect)
        ))),
        several => {
            let named: Vec<String> = several
                .iter()
                .map(|r| format!("{}, probability {:.2}", called(&p.registry, &r.effect), r.probability))
                .collect();
            all.push(Sentence::answer(format!("To be distinguished: {}.", named.join("; "))));
        }
    }
    let says = |offer: &Offer, step: &Step| {
        let minutes = offer.action.duration(step.count) / MINUTE;
        let what = match (p.criterion, step.forecast, step.error) {
            (Criterion::Discrimination, Some(forecast), _) => format!("resolve with chance {:.2}", forecast.resolved),
            (_, _, Some(error)) => {
                format!("leave {:.3} mm expected over the joint limits, with all that may be missing", error / MM)
            }
            _ => "change nothing that could be measured".into(),
        };
        format!("{} {} {what}, in {minutes:.0} min", step.count, offer.action.words())
    };
    let best = p.best(|_| true);
    if let Some((offer, step)) = best {
        all.push(Sentence::answer(format!("Best: {}.", says(offer, step))));
        let others = p.offers.iter().filter(|o| !std::ptr::eq(*o, offer));
        let mut others: Vec<(&Offer, &Step)> = others.filter_map(|o| p.best(|other| std::ptr::eq(other, o))).collect();
        others.sort_by(|a, b| p.merit(b.1).total_cmp(&p.merit(a.1)));
        for (offer, step) in others.into_iter().take(2) {
            all.push(Sentence::detail(format!("Beside it: {}.", says(offer, step))));
        }
    }
    if p.now.error.is_some() {
        all.push(Sentence::detail(
            "Errors are those of a model that holds the whole library, each effect as large as the data make it.",
        ));
    }
    if p.criterion == Criterion::Discrimination {
        all.push(Sentence::detail("The chances hold if one of the effects in question is the truth."));
    }
    all.push(Sentence::detail("Minutes are assumed."));
    all
}

/// The detectability of effects by a plan as a table, best first, followed by a list of undetectable effects.
pub fn detectability_text(d: &Detectability) -> Printout {
    let seen = d.sights.iter().filter(|s| s.smallest.is_some());
    let rows: Vec<[String; 7]> = seen
        .map(|s| {
            let size = s.smallest_size().map_or(0.0, |v| s.unit.from_si(v));
            [
                s.effect.to_string(),
                d.registry.in_words(&s.effect),
                format!("{:.2}", 100.0 * s.absorbed),
                format!("{:.2}", s.visible),
                s.directions.to_string(),
                format!("{:.2}", s.smallest.unwrap_or(f64::INFINITY)),
                format!("{} {}", significant(size), s.unit.printed()),
            ]
        })
        .collect();
    let header = [
        column("effect"),
        optional(1, "in words"),
        optional(2, "absorbed %"),
        optional(2, "detectability, in noise"),
        optional(3, "directions"),
        column("smallest seen, plausible sizes"),
        column("which is"),
    ];
    let mut out = Printout::from(plain_table(header, rows));
    out.push(format!(
        "\ndetectability: the part of one plausible size that the model does not absorb; smallest: noticed in {:.0} of 100 cases at level {:.1e}",
        100.0 * d.power,
        d.level
    ));
    let unseen: Vec<String> =
        d.sights.iter().filter(|s| s.smallest.is_none()).map(|s| called(&d.registry, &s.effect)).collect();
    if !unseen.is_empty() {
        out.push(format!("\ncannot be seen at all: {}", unseen.join("; ")));
    }
    out
}

/// Formats to three significant digits.
fn significant(value: f64) -> String {
    if value == 0.0 {
        return "0".into();
    }
    let digits = (2.0 - value.abs().log10().floor()).clamp(0.0, 9.0) as usize;
    format!("{value:.digits$}")
}
