//! The results of a study as tables and as JSON.

use calibench_report::{Printout, plain_rows};
use serde_json::{Map, Value, json};

use super::{Extent, MethodSummary, PERCENT, Quantile, Share, Spread, Summary};

/// Quantiles of the position errors and coverage of the intervals, by point and method.
pub fn study_text(summary: &Summary, extent: Extent) -> Printout {
    let Extent { first, trials } = extent;
    let which = if first == 0 { String::new() } else { format!(" (trials {first} to {})", first + trials - 1) };
    let many = if summary.points.len() == 1 { String::new() } else { format!(" at each of {} points", summary.points.len()) };
    let mut out = Printout::from(format!("{}, seed {}: {trials} trials{many}{which}\n\n", summary.study, summary.seed));
    if summary.is_weighted() {
        return out + rare_text(summary) + failures(summary);
    }
    let mut header = summary.axes.clone();
    header.extend(["method", "done", "mm"].map(String::from));
    header.extend(PERCENT.map(|p| format!("{p} %")));
    header.push("intervals that held the truth".into());
    let mut rows = Vec::new();
    for point in &summary.points {
        for method in &point.methods {
            // For several points only the mean error, with the band of its median.
            let columns: &[(&str, &str)] = if summary.axes.is_empty() {
                &[("mean_mm", "mean"), ("max_mm", "max"), ("std_mm", "std"), ("before_mean_mm", "mean, nominal")]
            } else {
                &[("mean_mm", "mean")]
            };
            for (k, (column, name)) in columns.iter().enumerate() {
                let mut row = point.at.clone();
                row.extend([method.name.clone(), method.done.to_string(), (*name).to_owned()]);
                row.extend(method.spread(column).map_or_else(|| vec![String::new(); PERCENT.len()], |s| quantiles(&s)));
                row.push(if k == 0 { coverage(method) } else { String::new() });
                rows.push(row);
            }
        }
    }
    out.push(plain_rows(header, rows));
    out.push("\n\nIn brackets: where endless trials would have the median, and the share; 95 % bands, by order statistics and by Wilson.\n");
    out + failures(summary)
}

/// The errors that the share requested stay within, by point and method.
fn rare_text(summary: &Summary) -> Printout {
    let mut header = summary.axes.clone();
    header.extend(["method", "robots", "mm", "within", "95 % band", "plain trials"].map(String::from));
    let mut rows = Vec::new();
    let bound = |bound: Option<f64>| bound.map_or_else(|| "?".to_owned(), |v| format!("{v:.4}"));
    for point in &summary.points {
        for method in &point.methods {
            for (name, tail) in method.tails() {
                let mut row = point.at.clone();
                row.extend([
                    method.name.clone(),
                    format!("{} %", Figure(100.0 * tail.share)),
                    name.trim_end_matches("_mm").to_owned(),
                    tail.value.map_or_else(|| "none: more fail".to_owned(), |v| format!("{v:.4}")),
                    format!("[{}, {}]", bound(tail.low), bound(tail.high)),
                    tail.plain_trials.map_or_else(String::new, |n| format!("{n:.0}")),
                ]);
                rows.push(row);
            }
        }
    }
    let note = "\n\nThe worst robots were sampled more often, and weighted accordingly. The band contains the error of endless trials \
                in 95 of 100 studies. Plain trials: how many a study without --rare needs to be as certain.\n";
    Printout::from(plain_rows(header, rows)) + note
}

/// A share in per cent, without the noise of its last bits.
struct Figure(f64);

impl std::fmt::Display for Figure {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let text = format!("{:.6}", self.0);
        f.write_str(text.trim_end_matches('0').trim_end_matches('.'))
    }
}

/// Number of failed trials, by reason.
fn failures(summary: &Summary) -> String {
    let mut out = String::new();
    let mut reasons: std::collections::BTreeMap<&str, u64> = std::collections::BTreeMap::new();
    for (reason, count) in summary.points.iter().flat_map(|p| p.methods.first()).flat_map(|m| &m.failed) {
        *reasons.entry(reason).or_default() += count;
    }
    for (reason, count) in reasons {
        out.push_str(&format!("{count} trials failed: {reason}\n"));
    }
    out
}

fn quantiles(spread: &Spread) -> Vec<String> {
    let cell = |q: &Quantile| match (q.percent, q.low, q.high) {
        (50, Some(low), Some(high)) => format!("{:.4} [{low:.4}, {high:.4}]", q.value),
        _ => format!("{:.4}", q.value),
    };
    spread.quantiles.iter().map(cell).collect()
}

/// Coverage pooled over all parameters, and the least one with its band: the intervals of a trial cover the ground truth
/// jointly, so the pooled share has no band of its own.
fn coverage(method: &MethodSummary) -> String {
    let shares: Vec<Share> = method.coverage().map(|(_, share)| share).collect();
    let all = Share { count: shares.iter().map(|s| s.count).sum(), of: shares.iter().map(|s| s.of).sum() };
    let Some(worst) = shares.iter().min_by(|a, b| a.value().total_cmp(&b.value())) else { return String::new() };
    let [low, high] = worst.band();
    format!("{:.1} %, least {:.1} % [{:.1}, {:.1}]", 100.0 * all.value(), 100.0 * worst.value(), 100.0 * low, 100.0 * high)
}

/// The same as one document.
pub fn study_json(summary: &Summary, extent: Extent) -> Value {
    let points: Vec<Value> = summary
        .points
        .iter()
        .map(|p| {
            let at: Map<String, Value> = summary.axes.iter().cloned().zip(p.at.iter().map(|v| number_or_text(v))).collect();
            json!({"at": at, "methods": p.methods.iter().map(method_json).collect::<Vec<_>>()})
        })
        .collect();
    let mut document = json!({
        "format": "calibench-study/1",
        "study": summary.study,
        "seed": summary.seed,
        "first": extent.first,
        "trials": extent.trials,
        "bands": "95 %: quantiles by order statistics, shares by Wilson",
    });
    if summary.is_weighted() {
        document["bands"] = json!("95 %: where the weighted share beyond, with its standard error, is the one requested");
    }
    if summary.axes.is_empty() {
        document["methods"] = points.first().map_or(Value::Null, |p| p["methods"].clone());
    } else {
        document["axes"] = json!(summary.axes);
        document["points"] = json!(points);
    }
    document
}

fn method_json(method: &MethodSummary) -> Value {
    let mut out = json!({"name": method.name, "done": method.done, "failed": method.failed});
    for (name, tail) in method.tails() {
        out[name] = json!(tail);
    }
    if method.rare.is_some() {
        return out;
    }
    for (name, spread) in method.spreads() {
        out[name] = json!(spread);
    }
    let coverage = method.coverage().map(|(name, share)| {
        let [low, high] = share.band();
        json!({"name": name, "inside": share.count, "of": share.of, "share": share.value(), "low": low, "high": high})
    });
    out["coverage"] = coverage.collect();
    if !method.verdicts.is_empty() {
        out["verdicts"] = json!(method.verdicts);
    }
    out
}

/// A position on an axis, as a number if it is one.
fn number_or_text(text: &str) -> Value {
    text.parse::<f64>().map_or_else(|_| json!(text), |v| json!(v))
}
