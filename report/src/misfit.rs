//! Agreement of data with their robot: the nominal fit on one line and, if it fails, the reason as a sentence.

use super::finding_notes::digits_of;
use calibench::residuals::misfit::{Abnormal, Cause, DataFit, Measure, Misfit, NominalFit, SlipTried, Unbelievable};
use calibench::units::{DEG, MM};

/// Smallest reach, m, in parts of which a residual is said: links shorter than that are those of a hand with crossing axes.
const LEAST_REACH: f64 = 10.0 * MM;

/// Residuals that differ by no more than this share are the same: no digit of those that are printed tells them apart.
const SAME: f64 = 0.01;

/// The residual of the nominal arm on a dataset, on one line.
pub fn nominal_fit_line(fit: &NominalFit) -> String {
    // Two joints with crossing axes reach nowhere, and a share of that says nothing.
    let share =
        (fit.reach >= LEAST_REACH).then(|| format!("{:.2} % of the reach", 100.0 * fit.residual / fit.reach)).into_iter();
    let all = (fit.plain > 1.02 * fit.residual).then(|| format!("{} with all rows", length(fit.plain)));
    let more = share.chain(all).collect::<Vec<_>>().join("; ");
    let more = if more.is_empty() { more } else { format!(" ({more})") };
    let expected = match fit.left_out {
        None => format!("up to {} is expected", length(fit.expected)),
        Some(left) => format!(
            "that is more than the {} of a poorly assembled arm, and errors of an arm explain it: they predict half of the rows that were left out within {}",
            length(fit.expected),
            length(left)
        ),
    };
    format!("The nominal arm, its base and a free tool fitted, leaves {} rms{more}; {expected}.", length(fit.residual))
}

/// The nominal fits of the datasets, one line each, with names if there are several.
pub fn nominal_fit_lines(fits: &[DataFit]) -> Vec<String> {
    let named = |f: &DataFit| {
        let line = nominal_fit_line(&f.nominal);
        if fits.len() > 1 { format!("{}: {line}", f.nominal.dataset) } else { line }
    };
    fits.iter().map(named).collect()
}

/// Explains why data do not fit their robot, with the remedy.
pub fn misfit_sentence(misfit: &Misfit) -> String {
    let Misfit { nominal, measure, left, most, cause, slips, within_expected } = misfit;
    let size = |value: f64| if *measure == Measure::Orientations { angle(value) } else { length(value) };
    let first = slips.first();
    let remedy = "Correct the data, or go on with --force.";
    let of = match measure {
        Measure::Places | Measure::Rows => "",
        Measure::Orientations => " in its orientations",
        Measure::BallDistances => " in the stated distances between its balls",
        Measure::Targets => " in the places of the targets on its tool",
    };
    match cause {
        Cause::Slips if *measure == Measure::Rows => {
            let SlipTried { slip, residual, words } = first.cloned().unwrap_or_default();
            let apart = if residual > 0.0 {
                format!(", and the places measured there are up to {} apart: the joints were not read anew", length(residual))
            } else {
                String::new()
            };
            format!(
                "These data contradict themselves: {words}{apart} ({slip}). The nominal arm leaves {} rms in all {} rows. {remedy}",
                length(nominal.plain),
                nominal.rows
            )
        }
        Cause::Slips => {
            let others: Vec<&str> = slips.iter().skip(1).map(|s| s.slip.as_str()).collect();
            let is_same = |a: f64, b: f64| (a - b).abs() <= SAME * a.max(b);
            let or = match slips.as_slice() {
                [] | [_] => String::new(),
                [first, second] if is_same(first.residual, second.residual) => {
                    format!(", or {} ({}), which leaves the same", second.words.trim_end_matches(','), second.slip)
                }
                _ => format!(", and these data cannot distinguish it from {}", others.join(", ")),
            };
            let why = if *within_expected { ", and a slip would explain it" } else { "" };
            let explained = first.map_or(String::new(), |s| format!("{} leaves {}", s.words, size(s.residual)));
            format!(
                "These data do not fit this robot{of}{why}: {explained} instead of {} ({}){or}; up to {} is expected of the nominal arm. {remedy}",
                size(*left),
                first.map_or("", |s| s.slip.as_str()),
                size(*most)
            )
        }
        Cause::Base => {
            let names: Vec<&str> = slips.iter().map(|s| s.slip.as_str()).collect();
            format!(
                "These data do not fit this robot with the base as stated: the base found from them is not where it is stated, and {} puts it there ({}). Correct the data or the base, or go on with --force.",
                first.map_or("", |s| s.words.as_str()),
                names.join(" or ")
            )
        }
        Cause::Rows(gross) => {
            let named: Vec<&str> = slips.iter().map(|s| s.slip.as_str()).collect();
            let others = gross.saturating_sub(named.len());
            let others = if others == 0 { String::new() } else { format!(" and {others} more") };
            let rest = if *measure == Measure::Orientations { first.map_or(*left, |s| s.residual) } else { nominal.residual };
            format!(
                "These data do not fit this robot{of} in {gross} of {} rows: without {}{others} the nominal arm leaves {} instead of {}. Correct these rows or leave them out, or go on with --force.",
                nominal.rows,
                named.join(", "),
                size(rest),
                size(*left)
            )
        }
        Cause::Unknown => {
            let tried = |s: &SlipTried| format!("{} leaves {} ({})", s.words, size(s.residual), s.slip);
            let best: Vec<String> = slips.iter().map(tried).collect();
            let best = if best.is_empty() { String::new() } else { format!(", the best tries: {}", best.join("; ")) };
            format!(
                "These data do not fit this robot{of}: the nominal arm, its base and a free tool fitted, leaves {}, and up to {} is expected; no usual slip explains it{best}. Check robot, units and signs, or go on with --force.",
                size(*left),
                size(*most)
            )
        }
        other => format!("These data do not fit this robot ({}). {remedy}", other.name()),
    }
}

/// States that the sizes of corrections are implausible; `None` if there are no such corrections.
pub fn unbelievable_sentence(corrections: &[Unbelievable]) -> Option<String> {
    let first = corrections.first()?;
    let others = match corrections.len() {
        1 => String::new(),
        n => format!(" ({} more like it)", n - 1),
    };
    Some(format!(
        "These data do not fit this robot: they would correct {} by {:.4} {}, {:.0} plausible sizes{others}, which is not believable at this size. Check signs, zeros and units of the joints, or go on with --force.",
        first.parameter,
        first.unit.from_si(first.deviation),
        first.unit.printed(),
        first.sizes
    ))
}

/// The parameters of the links that are abnormal for an arm of its kind, each with what to do: the first that is said of a
/// fit; nothing where there are none.
#[must_use]
pub fn abnormal_sentences(abnormal: &[Abnormal]) -> Vec<String> {
    let sentence = |a: &Abnormal| {
        let unit = a.unit.printed();
        let [off, sigma] = [a.deviation, a.sigma].map(|x| a.unit.from_si(x));
        let digits = digits_of(sigma);
        let known = format!("± {sigma:.digits$}, {:.0} times what is usual", a.sizes);
        match a.zero_of {
            Some(joint) => format!(
                "Joint {joint}'s zero is off by {off:+.2} {unit} ({known}): enter {:+.2} {unit} in the mastering, which is what the controller shows where the joint is at its true zero, and measure again.",
                -off
            ),
            None => format!(
                "{} is off by {off:+.2} {unit} ({known}): check the nominal value of the arm's description, then the arm itself.",
                a.parameter
            ),
        }
    };
    abnormal.iter().map(sentence).collect()
}

/// A length for display, to three significant digits.
fn length(m: f64) -> String {
    let mm = m / MM;
    match mm {
        mm if mm >= 10_000.0 => format!("{:.0} m", mm / 1000.0),
        mm if mm >= 100.0 => format!("{mm:.0} mm"),
        mm if mm >= 10.0 => format!("{mm:.1} mm"),
        mm if mm >= 0.01 => format!("{mm:.2} mm"),
        mm => format!("{mm:.4} mm"),
    }
}

/// An angle for display.
fn angle(rad: f64) -> String {
    let deg = rad / DEG;
    if deg >= 10.0 { format!("{deg:.0} deg") } else { format!("{deg:.2} deg") }
}
