//! The hidden effects of a simulated cell compared with those found, as a table and in the document of a run.

use calibench::diagnosis::Verdict;
use calibench::effects::registry::Registry;
use calibench_report::documents::{HiddenEffect, HiddenParameter, Named};
use calibench_report::{Printout, called, column, optional, plain_table};

use calibench_sim::ground_truth::{GroundTruth, Hidden, HiddenNumber, Met};

/// Number of an effect's values shown individually; more are summarised.
const SHOWN: usize = 3;

/// One line per effect, and the overall result of the diagnosis.
pub fn hidden_text(truth: &GroundTruth) -> Printout {
    if truth.hidden.is_empty() {
        return format!("nothing is hidden in this cell; {}", said(truth)).into();
    }
    let rows: Vec<[String; 5]> = truth.hidden.iter().map(row).collect();
    let header = [column("hidden"), optional(1, "size"), column("found"), column("estimate"), optional(1, "x noise")];
    Printout::from(plain_table(header, rows)) + "\n" + said(truth)
}

fn said(truth: &GroundTruth) -> String {
    let verdict = match truth.verdict {
        Verdict::NothingLeft => "The diagnosis says that nothing is left but noise".to_owned(),
        other => format!("The diagnosis says '{}'", other.in_words()),
    };
    match &truth.named {
        Some((first, false)) => format!("{verdict}, and names {} first, which is there.", called(Registry::catalogue(), first)),
        Some((first, true)) => {
            format!("{verdict}, and names {} first, which is not what is hidden.", called(Registry::catalogue(), first))
        }
        None => format!("{verdict}."),
    }
}

fn row(hidden: &Hidden) -> [String; 5] {
    let found = match hidden.met {
        Met::InModel => "in the model",
        Met::First => "named first",
        Met::InSet => "in the credible set",
        Met::Among => "among the findings",
        Met::SaidSo => "said to be unknown",
        Met::Untestable => "not testable here",
        Met::NotNamed => "not named",
    };
    let visible = hidden.visible.map(|v| format!("{v:.2}")).unwrap_or_default();
    [hidden.effect.clone(), size(hidden), found.into(), estimate(hidden), visible]
}

fn size(hidden: &Hidden) -> String {
    let numbers = &hidden.numbers;
    match hidden.plausible_sizes {
        None => hidden.size.clone(),
        Some(sizes) if numbers.len() > SHOWN => format!("{} numbers, {sizes:.1} plausible sizes", numbers.len()),
        Some(sizes) => format!("{}, {sizes:.1} plausible", listed(hidden, |n| Some(digits(n, n.truth)))),
    }
}

fn estimate(hidden: &Hidden) -> String {
    let numbers = &hidden.numbers;
    if numbers.len() <= SHOWN {
        return listed(hidden, |n| n.found.map(|[value, sigma]| format!("{} ± {}", digits(n, value), digits(n, sigma))));
    }
    let found: Vec<(&HiddenNumber, [f64; 2])> = numbers.iter().filter_map(|n| Some((n, n.found?))).collect();
    let near = found.iter().filter(|(n, [value, sigma])| (value - n.truth).abs() <= 2.0 * sigma).count();
    if found.is_empty() { String::new() } else { format!("{near} of {} within 2 sigma", found.len()) }
}

/// Values with their unit; empty if there are none.
fn listed(hidden: &Hidden, text: impl Fn(&HiddenNumber) -> Option<String>) -> String {
    let all: Vec<String> = hidden.numbers.iter().filter_map(text).collect();
    match hidden.numbers.first() {
        Some(first) if !all.is_empty() => format!("{} {}", all.join(", "), first.unit.printed()),
        _ => String::new(),
    }
}

/// Formats to three decimals, or to one from 10 on.
fn digits(number: &HiddenNumber, value: f64) -> String {
    let value = number.unit.from_si(value);
    if value.abs() >= 10.0 { format!("{value:.1}") } else { format!("{value:.3}") }
}

/// The result of the diagnosis, for the document of a run.
pub fn named(truth: &GroundTruth) -> Named {
    Named {
        verdict: truth.verdict.name().into(),
        named_first: truth.named.as_ref().map(|(name, _)| name.to_string()),
        named_first_is_hidden: truth.named.as_ref().map(|(_, wrongly)| !wrongly),
    }
}

/// The hidden effects, for the document of a run.
pub fn hidden_effects(truth: &GroundTruth) -> Vec<HiddenEffect> {
    let parameter = |n: &HiddenNumber| {
        let [estimate, sigma] = n.found.map_or([None, None], |found| found.map(|v| Some(n.unit.from_si(v))));
        let truth = n.unit.from_si(n.truth);
        HiddenParameter { name: n.name.clone(), truth, estimate, sigma, unit: n.unit.symbol.into() }
    };
    let effect = |h: &Hidden| HiddenEffect {
        effect: h.effect.clone(),
        size: size(h),
        plausible_sizes: h.plausible_sizes,
        parameters: h.numbers.iter().map(parameter).collect(),
        in_model: h.met == Met::InModel,
        found: h.met.name().into(),
        visible_over_noise: h.visible,
    };
    truth.hidden.iter().map(effect).collect()
}
