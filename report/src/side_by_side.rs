//! Calibrations side by side: their errors on the same rows, which is better, and how far apart they place the tool.

use super::figures::{CROSS_VALIDATED, NOT_FITTED};
use super::printout::Printout;
use super::tables::{Table, plain_rows};
use super::workspace::map_table;
use calibench::judgement::side_by_side::{Apart, Judged, JudgedOn, PairedDifference, SideBySide};
use calibench::prediction::PoseSource;
use calibench::units::MM;

/// The rows that judge, in words.
fn judged_on(all: &SideBySide) -> String {
    let poses = all.all.first().map_or(0, |one| one.errors.samples);
    match all.judged_on {
        JudgedOn::HeldOut => format!("{poses} poses held out of every fit"),
        JudgedOn::OtherData => format!("{poses} poses to which none was fitted"),
        JudgedOn::LeftOut => format!("{poses} fitted poses, each predicted by a fit without it and its neighbours"),
    }
}

/// Which of two is better, and by how much.
#[must_use]
pub fn paired_sentence(pair: &PairedDifference, [a, b]: [&str; 2], judged_on: JudgedOn) -> String {
    let (size, error) = (pair.mean.abs() / MM, pair.two_errors / MM);
    let rows = match judged_on {
        JudgedOn::HeldOut | JudgedOn::OtherData => "rows not fitted",
        JudgedOn::LeftOut => "rows left out of the fit in turn",
    };
    if !error.is_finite() {
        return format!("A single pose that was not fitted cannot tell whether {a} or {b} is better.");
    }
    match pair.better() {
        Some(k) => {
            let [better, worse] = if k == 0 { [a, b] } else { [b, a] };
            format!(
                "Better on {rows}: {better}. Its mean error at {} poses is {size:.4} ± {error:.4} mm smaller than that of {worse} (pose by pose, two standard errors).",
                pair.poses
            )
        }
        None => format!(
            "{rows} do not tell which is better: at {} poses the mean errors of {a} and {b} differ by {size:.4} ± {error:.4} mm (pose by pose, two standard errors). Of two models that predict alike, the one with fewer parameters is the safer.",
            pair.poses,
            rows = super::effect_names::capital(rows)
        ),
    }
}

fn errors_table(all: &SideBySide) -> Table {
    let figure = if all.judged_on == JudgedOn::LeftOut { CROSS_VALIDATED } else { NOT_FITTED };
    let first = all.all.first().map_or("", |one| one.name.as_str());
    let header = [format!("{}, mm", figure.name), "mean".into(), "95 %".into(), "max".into()];
    let header = header.into_iter().chain([format!("mean, against {first}"), "better at".into()]);
    let row = |one: &Judged| {
        let [mean, p95, max] = [one.errors.mean, one.errors.quantiles[4], one.errors.max].map(|x| format!("{:.3}", x / MM));
        let [against, better] = one.difference.map_or_else(Default::default, |d| {
            let two_errors = if d.two_errors.is_finite() { format!(" ± {:.3}", d.two_errors / MM) } else { String::new() };
            [format!("{:+.3}{two_errors}", d.mean / MM), format!("{} of {}", d.better_at, d.poses)]
        });
        vec![one.name.clone(), mean, p95, max, against, better]
    };
    plain_rows(header.collect::<Vec<String>>(), all.all.iter().map(row).collect())
}

/// How far apart the first and another place the tool.
fn apart_sentence(first: &str, one: &Judged) -> Option<String> {
    let part = |apart: &Apart| {
        let place = match apart.at {
            PoseSource::Validation => "at the poses held out",
            PoseSource::Ranges => "inside the measured ranges",
            PoseSource::Limits => "over the joint limits",
        };
        format!("{:.3} mm {place} (at most {:.3})", apart.mean / MM, apart.max / MM)
    };
    let parts: Vec<String> = one.apart.iter().map(part).collect();
    (!parts.is_empty())
        .then(|| format!("Mean distance between the tool of {} and that of {first}: {}.", one.name, parts.join("; ")))
}

/// The comparison: errors, differences, and maps of where two calibrations place the tool differently.
#[must_use]
pub fn side_by_side_text(all: &SideBySide) -> Printout {
    let first = all.all.first().map_or("", |one| one.name.as_str());
    let mut out = Printout::from(format!("{}:\n", judged_on(all))) + errors_table(all) + "\n";
    for one in &all.all {
        let better = one.difference.as_ref().map(|pair| paired_sentence(pair, [first, &one.name], all.judged_on));
        better.into_iter().chain(apart_sentence(first, one)).for_each(|sentence| out.push(format!("{sentence}\n")));
    }
    for one in &all.all {
        if let Some(apart) = one.apart.last() {
            out.push(format!(
                "\nDistance between the tool of {} and that of {first}, mean over the joint limits, mm:\n",
                one.name
            ));
            out.push(map_table(&apart.map));
        }
    }
    out
}
