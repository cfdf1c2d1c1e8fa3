//! The leaderboard as a table of rows and as a page.

use calibench_lab::bench::{Entry, Standing};

/// Every method on every division as CSV, without times: the same seed gives the same bytes.
pub fn table(entries: &[Entry]) -> String {
    let mut out = "robot,division,method,mean_mm,low_mm,high_mm,rms_mm,max_mm,mean_over_default,expected_over_measured,fault\n"
        .to_owned();
    for e in entries {
        let judged = e.judged.as_ref();
        let mm = judged.map(|j| [j.mean_mm, j.interval_mm[0], j.interval_mm[1], j.rms_mm, j.max_mm]);
        let mm = mm.map_or_else(|| ",,,,".to_owned(), |mm| mm.map(|x| format!("{x:.6}")).join(","));
        let expected = number(judged.and_then(|j| j.expected_over_measured), 4, "");
        let fault = if e.fault.is_some() { "no prediction" } else { "" };
        out.push_str(&format!("{},{},{},{mm},{:.6},{expected},{fault}\n", e.robot, e.division, e.method, e.ratio));
    }
    out
}

/// The leaderboard, the worst first, and every division.
pub fn markdown(standings: &[Standing], entries: &[Entry]) -> String {
    let mut out = "| method | mean error / default: mean, 95 % | largest | worse by 2 %, of | no prediction | median mean error mm | expected / measured fair, of | median s |\n|---|---|---|---|---|---|---|---|\n".to_owned();
    for s in standings {
        out.push_str(&format!(
            "| {} | {:.3}, {:.3} to {:.3} | {:.3} | {} of {} | {} | {} | {} | {:.1} |\n",
            s.method,
            s.ratio,
            s.interval[0],
            s.interval[1],
            s.worst,
            s.worse,
            s.divisions,
            s.failed,
            number(s.median_mm, 3, "-"),
            if s.expected > 0 { format!("{} of {}", s.fair, s.expected) } else { "-".into() },
            s.seconds,
        ));
    }
    out.push_str("\n| division | method | mean error mm, 95 % | largest mm | mean error / default | expected / measured | s |\n|---|---|---|---|---|---|---|\n");
    for e in entries {
        let (mean, largest) = e.judged.as_ref().map_or_else(
            || ("no prediction".to_owned(), "-".to_owned()),
            |j| (format!("{:.4}, {:.4} to {:.4}", j.mean_mm, j.interval_mm[0], j.interval_mm[1]), format!("{:.3}", j.max_mm)),
        );
        let expected = number(e.judged.as_ref().and_then(|j| j.expected_over_measured), 2, "-");
        out.push_str(&format!(
            "| {} | {} | {mean} | {largest} | {:.3} | {expected} | {:.2} |\n",
            e.division, e.method, e.ratio, e.seconds
        ));
    }
    out
}

fn number(x: Option<f64>, digits: usize, without: &str) -> String {
    x.map_or_else(|| without.to_owned(), |x| format!("{x:.digits$}"))
}
