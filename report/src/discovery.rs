//! A search for laws in words.

use calibench::robot::{JointKind, Robot};
use calibench::units::{DEG, MM, Unit, decimal};
use calibench_discover::{Discovery, Doubt, FALSE_LAW_RATE, Law, Rival, TELLS};

/// The law, where it was seen, how sure it is, and what is not told from it: a sentence each.
#[must_use]
pub fn law_sentences(law: &Law, robot: &Robot) -> Vec<String> {
    let unit = if law.turns { Unit::DEG } else { Unit::MM };
    let seen = law.variables.iter().map(|v| {
        let unit = if v.unit.is_empty() { String::new() } else { format!(" {}", v.unit) };
        format!("{} from {} to {}{unit}", v.name.trim_matches(['(', ')']), short(v.range.start), short(v.range.end))
    });
    let mut sentences = vec![
        format!(
            "{} by {} (rms {:.4} {} at the measured postures): it follows {}.",
            crate::capital(&law.place),
            law.formula(),
            unit.from_si(law.rms),
            unit.symbol,
            law.follows()
        ),
        format!("Seen for {}; nothing is known of it elsewhere.", seen.collect::<Vec<_>>().join(", ")),
        format!("It explains {:.0} % of what the model leaves; {}.", 100.0 * law.explains, chance(law)),
    ];
    sentences.extend(law.rivals.iter().map(|rival| rival_sentence(law, rival, robot)));
    sentences
}

/// How often chance makes a law as good.
fn chance(law: &Law) -> String {
    let often = match law.p_false {
        p if p < 2e-4 => "fewer than 1 search in 5,000 finds".into(),
        p if p < 0.05 => format!("1 search in {} finds", thousands(two_digits((1.0 / p).round()))),
        p => format!("{:.0} of 100 searches find", 100.0 * p),
    };
    format!("in data without a law, {often} one as good")
}

/// A number to two digits.
fn two_digits(x: f64) -> usize {
    let unit = 10f64.powf(x.max(1.0).log10().floor() - 1.0).max(1.0);
    ((x / unit).round() * unit) as usize
}

fn rival_sentence(law: &Law, rival: &Rival, robot: &Robot) -> String {
    let place = if rival.site == law.site { "the same with".into() } else { format!("{} by", rival.place) };
    let what = format!("Not told from it: {place} {} (odds {:.2} to 1)", rival.bases.join(", "), rival.odds);
    let at = |q: &[f64]| {
        let shown = |(j, q): (usize, &f64)| {
            if robot.kind(j) == JointKind::Revolute { decimal(q / DEG, 0) } else { format!("{} mm", decimal(q / MM, 0)) }
        };
        q.iter().enumerate().map(shown).collect::<Vec<String>>().join(", ")
    };
    match rival.apart.first() {
        Some(first) if first.sigmas < TELLS => {
            format!("{what}; within the joint limits the two differ by no more than {} mm.", decimal(first.differ / MM, 3))
        }
        Some(first) => {
            let outside = if first.is_outside { ", which is outside the measured ranges," } else { "" };
            format!("{what}; at joints {}{outside} the two differ by {} mm.", at(&first.q), decimal(first.differ / MM, 3))
        }
        None => format!("{what}."),
    }
}

/// What the search says of a law that it does not take, or if there is none.
#[must_use]
pub fn no_law_sentence(found: &Discovery) -> Option<String> {
    if !found.laws.is_empty() && found.suspected.is_none() {
        return None;
    }
    let tried = format!("{} laws were tried on {} samples", thousands(found.tried), found.searched);
    Some(match &found.suspected {
        Some(law) => {
            let best = format!("{} by {}", law.place, law.formula());
            match law.doubt {
                Some(Doubt::Place) => format!(
                    "There is a law, and its place is uncertain: {tried}. With a probability of {:.2}, {best}; {}.",
                    law.p_place,
                    chance(law)
                ),
                Some(Doubt::MuchElse) => format!(
                    "No law is certain: {tried}. The best explains {:.0} % of what is left, and much more than noise remains, so that its shape may be that of something else: {best}.",
                    100.0 * law.explains
                ),
                _ => format!(
                    "No law is certain: {tried}. The best: {best}; {}, and at most {:.0} in 100 is accepted.",
                    chance(law),
                    100.0 * FALSE_LAW_RATE
                ),
            }
        }
        None if found.is_ordinary => format!(
            "No law stands out: {tried}, and none explains more than the catalogue does. More than noise remains, of an amount that is ordinary for effects of the catalogue: `calibench diagnose` names them."
        ),
        None => format!("No law stands out: {tried}, and none explains more than chance does."),
    })
}

/// What cannot be told from a law that is not taken, and the posture that would tell.
#[must_use]
pub fn suspected_sentences(found: &Discovery, robot: &Robot) -> Vec<String> {
    let of = |law: &Law| law.rivals.iter().map(|rival| rival_sentence(law, rival, robot)).collect();
    found.suspected.as_ref().map_or_else(Vec::new, of)
}

/// What the catalogue explains better than any law.
#[must_use]
pub fn listed_sentence(found: &Discovery) -> Option<String> {
    let names: Vec<String> = found.listed.iter().map(|n| format!("`{n}`")).collect();
    (!names.is_empty())
        .then(|| format!("Explained by the catalogue at least as well as by any law, and fitted beside: {}.", names.join(", ")))
}

/// A number to four digits.
fn short(x: f64) -> String {
    decimal(x, if x.abs() < 10.0 { 2 } else { 0 })
}

/// A number with its thousands apart.
fn thousands(n: usize) -> String {
    let digits = n.to_string();
    let groups: Vec<&str> = digits.as_bytes().rchunks(3).rev().filter_map(|g| std::str::from_utf8(g).ok()).collect();
    groups.join(",")
}
