//! Injections for people: in a terminal, as Markdown, as a page.

use calibench::effects::registry::Registry;
use std::fmt::Write;

use crate::injection::{FamilyRow, Injected, Injections};
use crate::suite::Share;
use calibench_report::{Printout, plain_table, what};

const HEADER: [&str; 7] = ["effect", "injected", "found", "named", "size", "error before, mm", "after"];

/// The tables in a terminal.
pub fn text(found: &Injections) -> Printout {
    let table = plain_table(HEADER, found.families.iter().map(cells).collect());
    let mut out = Printout::from(table) + "\n\n" + legend();
    let missed: Vec<String> = found.effects.iter().filter(|t| !t.named).map(missed).collect();
    if !missed.is_empty() {
        out.push("\n\nNot named:");
        missed.iter().for_each(|missed| out.push(format!("\n  {missed}")));
    }
    if !found.untestable.is_empty() {
        out.push(if missed.is_empty() { "" } else { "\n" });
        out.push("\nNot testable with these data:");
        for (needs, effects) in untestable(found) {
            out.push(format!("\n  without {needs}: {}", effects.join(", ")));
        }
    }
    out
}

/// As Markdown, every effect in a row.
pub fn markdown(found: &Injections, rows: [usize; 2]) -> String {
    let mut out = format!("# What these data can show\n\n{}\n\n{}\n", sentences(found, rows).join("\n"), legend());
    let _ = write!(out, "\n| {} |\n|{}\n", HEADER.join(" | "), "---|".repeat(HEADER.len()));
    for row in &found.families {
        let _ = writeln!(out, "| {} |", cells(row).join(" | "));
    }
    let _ = write!(out, "\n| {} |\n|{}\n", EFFECT_HEADER.join(" | "), "---|".repeat(EFFECT_HEADER.len()));
    for trial in &found.effects {
        let _ = writeln!(out, "| {} |", effect_cells(trial).join(" | "));
    }
    if !found.untestable.is_empty() {
        let _ = write!(out, "\nNot testable with these data:\n\n");
        for (needs, effects) in untestable(found) {
            let _ = writeln!(out, "* without {needs}: {}", effects.join(", "));
        }
    }
    out
}

/// As a page that needs nothing else.
pub fn page(found: &Injections, rows: [usize; 2]) -> String {
    let longest = found.families.iter().filter_map(|r| r.before_mm).fold(f64::MIN_POSITIVE, f64::max);
    let family = |row: &FamilyRow| {
        let [name, tried, seen, named, size, before, after] = cells(row).map(|c| escaped(&c));
        let share = |s: Share| match (s.of, s.hits) {
            (0, _) => "",
            (all, hits) if hits == all => "all",
            (_, 0) => "none",
            _ => "some",
        };
        let bar = |class: &str, mm: Option<f64>| {
            mm.map_or(String::new(), |mm| format!("<i class=\"{class}\" style=\"width:{:.1}%\"></i>", 100.0 * mm / longest))
        };
        format!(
            "<tr><th scope=\"row\"><code>{name}</code><br><small>{}</small></th><td>{tried}</td><td class=\"{}\">{seen}</td>\
             <td class=\"{}\">{named}</td><td class=\"{}\">{size}</td><td>{before}</td><td>{after}</td>\
             <td class=\"bars\">{}{}</td></tr>\n",
            escaped(what(Registry::catalogue(), &row.family)),
            share(row.found),
            share(row.named),
            share(row.within_2_sigma),
            bar("before", row.before_mm),
            bar("after", row.after_mm),
        )
    };
    let cell = |c: &String| format!("<td>{}</td>", escaped(c));
    let effect = |t: &Injected| format!("<tr>{}</tr>\n", effect_cells(t).iter().map(cell).collect::<String>());
    let needs = |(needs, effects): (&str, Vec<&str>)| {
        format!("<li>without {}: {}</li>\n", escaped(needs), escaped(&effects.join(", ")))
    };
    let head = |h: &&str| format!("<th scope=\"col\">{h}</th>");
    let none = "<li>nothing: every effect of the catalogue can be tested</li>".to_owned();
    let untested: Vec<String> = untestable(found).into_iter().map(needs).collect();
    include_str!("injections.html")
        .replace("{{DATA}}", &escaped(&found.datasets.join(", ")))
        .replace(
            "{{SENTENCES}}",
            &sentences(found, rows).iter().map(|s| format!("<p>{}</p>\n", escaped(s))).collect::<String>(),
        )
        .replace("{{LEGEND}}", &escaped(&legend()))
        .replace("{{FAMILY_HEADER}}", &HEADER.iter().map(head).collect::<String>())
        .replace("{{FAMILIES}}", &found.families.iter().map(family).collect::<String>())
        .replace("{{EFFECT_HEADER}}", &EFFECT_HEADER.iter().map(head).collect::<String>())
        .replace("{{EFFECTS}}", &found.effects.iter().map(effect).collect::<String>())
        .replace("{{UNTESTABLE}}", &if untested.is_empty() { none } else { untested.concat() })
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

/// The injections and their results, in sentences.
pub fn sentences(found: &Injections, [used, all]: [usize; 2]) -> [String; 3] {
    let noise = match found.noise.source {
        "stated" => "the stated noise",
        "replicates" => "the noise of its repeats",
        _ => "noise as large as the residual of the fit",
    };
    let of_all = if used < all { format!(" of {all}") } else { String::new() };
    let count = |s: Share| format!("{} of {}", s.hits, s.of);
    let injected = format!(
        "{} effects of the catalogue were injected, one at a time and at one plausible size, into {used}{of_all} fitted rows of {} with \
         {noise}, {:.4} mm rms; the residual of the fit of these data as measured is {:.4} mm rms.",
        found.effects.len(),
        found.datasets.join(", "),
        found.noise.rms_mm,
        found.noise.residual_mm,
    );
    let seen = format!(
        "Found: {}. Named: {}. Size within 2 sigma where named: {} (95 % expected).",
        count(found.found),
        count(found.named),
        count(found.within_2_sigma),
    );
    [injected, seen, format!("With nothing injected, {} trials named an effect.", count(found.false_alarms))]
}

fn legend() -> String {
    "found: the diagnosis says that something is missing. named: first, or as one that these data cannot distinguish from the first. \
     size: the estimates agree with what was injected within 2 sigma. \
     error: mean over the workspace, against the robot that was injected; after: with the first finding added. Medians."
        .into()
}

/// One family in a row.
fn cells(row: &FamilyRow) -> [String; 7] {
    let count = |s: Share| if s.of == 0 { "-".to_owned() } else { s.hits.to_string() };
    let size = row.within_2_sigma;
    let size = if size.of == 0 { "-".to_owned() } else { format!("{} of {}", size.hits, size.of) };
    let [before, after] = [row.before_mm, row.after_mm].map(millimetres);
    [row.family.clone(), row.found.of.to_string(), count(row.found), count(row.named), size, before, after]
}

const EFFECT_HEADER: [&str; 8] =
    ["effect", "size injected", "in units of noise", "found", "first named", "estimate", "error before, mm", "after"];

/// One effect in a row.
fn effect_cells(trial: &Injected) -> [String; 8] {
    let sizes = |of: &dyn Fn(&crate::injection::InjectedParameter) -> Option<String>| {
        trial.parameters.iter().filter_map(of).collect::<Vec<_>>().join(", ")
    };
    let injected = sizes(&|p| Some(format!("{} {:.3} {}", p.name, p.injected, p.unit)));
    let estimate = sizes(&|p| p.found.map(|[value, sigma]| format!("{value:.3} +- {sigma:.3} {}", p.unit)));
    let [before, after] = [trial.before_mm, trial.after_mm].map(millimetres);
    let first = if trial.first.is_empty() { "-" } else { &trial.first };
    let first = if trial.named || trial.first.is_empty() { first.to_owned() } else { format!("{first} (wrong)") };
    let found = if trial.found { "yes" } else { "no" };
    let estimate = if estimate.is_empty() { "-".to_owned() } else { estimate };
    [trial.effect.clone(), injected, format!("{:.2}", trial.visible), found.into(), first, estimate, before, after]
}

/// An effect that was not named, and why.
fn missed(trial: &Injected) -> String {
    let instead = match (trial.first.as_str(), trial.found) {
        ("", false) => "not found".to_owned(),
        ("", true) => "found, but not named".to_owned(),
        (other, _) => format!("mistaken for {other}"),
    };
    let from = match trial.detectable_from {
        Some(size) if size > 1.0 => format!("; seen from {size:.1} plausible sizes"),
        _ => String::new(),
    };
    format!("{} (leaves {:.2} of the noise{from}): {instead}", trial.effect, trial.visible)
}

fn millimetres(mm: Option<f64>) -> String {
    mm.map_or("-".into(), |mm| format!("{mm:.3}"))
}

/// The effects that cannot be tested, by what they need.
fn untestable(found: &Injections) -> Vec<(&str, Vec<&str>)> {
    let mut by_need: Vec<(&str, Vec<&str>)> = Vec::new();
    for u in &found.untestable {
        match by_need.iter_mut().find(|(needs, _)| *needs == u.needs) {
            Some((_, effects)) => effects.push(&u.effect),
            None => by_need.push((u.needs, vec![&u.effect])),
        }
    }
    by_need
}
