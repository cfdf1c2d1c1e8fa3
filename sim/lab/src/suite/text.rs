//! A suite of blind trials as tables.

use std::collections::{BTreeMap, BTreeSet};

use calibench_report::{Printout, plain_table};

use super::{ClassRow, Reliability, Share, Tally};

/// One line per class, the worst first; `by_ladder` tells whether the ladder's advice was followed.
/// A row for each class of what was hidden.
pub fn classes_text(classes: &[ClassRow], by_ladder: bool) -> Printout {
    let header = [
        "class",
        "trials",
        "claimed",
        "right",
        "identified, chi2/dof > 2",
        "band holds",
        "predicted/actual",
        "before mm",
        "after mm",
        "harmed",
        "worst",
    ];
    let rows: Vec<[String; 11]> = classes
        .iter()
        .map(|c| {
            [
                c.class.clone(),
                c.trials.to_string(),
                share(c.claimed),
                share(c.right),
                share(c.identified_but_more),
                share(c.band_holds),
                ratio(c.predicted_over_actual[1]),
                mm(c.before_mm),
                mm(c.after_mm),
                share(c.harmed),
                ratio(c.worst_ratio),
            ]
        })
        .collect();
    let advice = if by_ladder { "what the ladder recommends" } else { "the effect that is claimed, where one is" };
    let mut out =
        Printout::from(format!("CLASSES, the worst first; after: with {advice}\n")) + plain_table(header, rows) + "\n";
    if by_ladder {
        let rows: Vec<[String; 3]> = classes
            .iter()
            .map(|c| [c.class.clone(), share(c.band_holds_after), ratio(c.predicted_over_actual_after[1])])
            .collect();
        let header = ["class, after the ladder", "band holds", "predicted/actual"];
        out = out + "\n" + plain_table(header, rows) + "\n";
    }
    out
}

fn mm(value: f64) -> String {
    if value.is_finite() { format!("{value:.4}") } else { "-".into() }
}

/// Rates, the power curve, and the confusion table.
/// The shares of right answers over all trials.
pub fn suite_text(t: &Tally) -> Printout {
    let mut rows = vec![
        row("nothing hidden, an effect claimed", t.false_alarms),
        row("the same, noise stated too small", t.false_alarms_noise_wrong),
        row("nothing hidden, called unexplained", t.false_unexplained),
        row("one hidden, claimed: the right one first", t.top1_given_detection),
        row("  near-aliases counted as one", t.top1_merged_given_detection),
        row("  among the first three", t.top3_given_detection),
        row("  in the credible set", t.set_covers),
        row("one hidden, detectability at least half the noise: found", t.detected_from_half_sigma),
        row("two hidden, claimed: one of them first", t.two_right),
    ];
    rows.extend(t.clutter_claimed.iter().map(|(case, share)| row(&format!("{case}: an effect claimed"), *share)));
    rows.push(row("every effect at once: the largest contributor named", t.largest_contributor));
    rows.push(row("  workspace error predicted within 25 %", t.predicted_within_25_percent));
    rows.extend(t.unknown_said_so.iter().map(|(case, share)| row(&format!("{case}: reported"), *share)));
    rows.extend(t.unknown_joint.iter().map(|(case, share)| row(&format!("{case}: the joint right"), *share)));
    let mut out = Printout::from(format!("{} blind trials\n\n", t.trials)) + plain_table(["what", "trials", "share"], rows);
    let [low, middle, high] = t.predicted_over_actual.map(ratio);
    out.push(format!(
        "\n\nThe credible set holds {} effects on average. Adding what was found leaves {} of the workspace error (median, where there is more\n\
         than noise), {} times what adding the hidden effect leaves. Predicted over actual error: {middle} ({low} to {high} in eight of ten).\n",
        ratio(t.set_size),
        ratio(t.after_over_before),
        ratio(t.after_over_oracle)
    ));
    out.push("\nPOWER, by how large the hidden effect is beside what the fit absorbs of it\n");
    let power: Vec<[String; 4]> = t
        .power
        .iter()
        .map(|p| {
            let to = if p.visible_to.is_finite() { format!(" to {}", p.visible_to) } else { " and more".into() };
            [format!("{}{to} times the noise", p.visible_from), p.detected.of.to_string(), share(p.detected), share(p.right)]
        })
        .collect();
    out.push(plain_table(["visible", "trials", "found", "found and right"], power));
    out.push("\n\nWHICH EFFECT WAS MISTAKEN FOR WHICH, one effect hidden\n");
    out + plain_table(["hidden", "said", "something else"], confusion(&t.families))
}

/// How often an effect that was named with a probability is a hidden one.
pub fn reliability_text(rows: &[Reliability]) -> Printout {
    let header = ["hidden", "probability said", "claims", "mean", "right", "95 %"];
    let cells = rows.iter().map(|r| {
        [
            if r.kind.is_empty() { "any".into() } else { r.kind.into() },
            format!("{} to {}", r.from, r.to),
            r.right.of.to_string(),
            format!("{:.3}", r.said),
            share(r.right),
            format!("{:.3} to {:.3}", r.right_95[0], r.right_95[1]),
        ]
    });
    Printout::from("RELIABILITY: the probability said of the first effect named, and how often it is a hidden one\n".to_owned())
        + plain_table(header, cells.collect())
}

/// A ratio, or a dash if no trial gives one.
fn ratio(value: f64) -> String {
    if value.is_finite() { format!("{value:.2}") } else { "-".into() }
}

fn share(s: Share) -> String {
    if s.of == 0 { String::new() } else { format!("{:.3}", s.value()) }
}

fn row(what: &str, s: Share) -> [String; 3] {
    [what.to_owned(), s.of.to_string(), share(s)]
}

fn confusion(families: &BTreeMap<String, BTreeMap<String, usize>>) -> Vec<[String; 3]> {
    let line = |(hidden, said): (&String, &BTreeMap<String, usize>)| {
        let others: BTreeSet<&String> = said.keys().filter(|s| *s != hidden).collect();
        let list: Vec<String> = others.iter().map(|s| format!("{s} {}", said[*s])).collect();
        [hidden.clone(), format!("{hidden} {}", said.get(hidden).copied().unwrap_or(0)), list.join(", ")]
    };
    families.iter().map(line).collect()
}
