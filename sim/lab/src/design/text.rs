//! The result of a design as tables.

use calibench_report::{Printout, Table, plain_rows};

use super::{Design, Held, Judged, OnMap};

/// The recommended artifact: compared with others, on the map, and accuracy against size.
/// The recommended artifact, those compared with it, and the map of places.
pub fn design_text(design: &Design) -> Printout {
    let Design { name, question, seed, places: [places, reachable], workspace_poses, best, compared, map, front } = design;
    let mut out = Printout::from(format!(
        "{name}: {question}\nseed {seed}; {places} places, {reachable} of them can be probed; judged at {workspace_poses} poses of the workspace\n\nRECOMMENDED\n"
    ));
    let balls: Vec<Vec<String>> =
        best.balls.iter().map(|(id, at)| std::iter::once(id.clone()).chain(at.map(|v| format!("{v:.1}"))).collect()).collect();
    out.push(plain_rows(["ball", "x mm", "y mm", "z mm"], balls));
    out.push("\n\nUNCERTAINTY of the TCP over the workspace, one-sigma, µm\n");
    let all: Vec<&Judged> = std::iter::once(best).chain(compared).collect();
    let head = ["artifact", "balls", "probings", "worst", "mean", "kg", "size mm"];
    let rows: Vec<Vec<String>> = all.iter().map(|j| row(&j.name, j)).collect();
    out.push(plain_rows(head, rows));
    if all.iter().any(|j| j.verified.is_some()) {
        out.push("\n\nTRIED on the simulated cell: distance of the calibrated TCP from the true one, rms, µm, and its 95 % band;\nwhat the encoders do not see at that moment is in both\n");
        let head = ["artifact", "trials", "all poses: predicted", "measured", "worst pose: predicted", "measured"];
        let rows: Vec<Vec<String>> = all
            .iter()
            .filter_map(|j| j.verified.as_ref().map(|v| (j, v)))
            .map(|(j, v)| {
                let mut row = vec![j.name.clone(), v.trials.to_string()];
                row.extend([v.rms, v.worst].iter().flat_map(held));
                row
            })
            .collect();
        out.push(plain_rows(head, rows));
    }
    if let Some(map) = map {
        out.push("\n\nMAP: worst one-sigma, µm, with the ball at x (down), y (across); the best of the heights\n");
        out.push(map_table(map));
    }
    if !front.is_empty() {
        out.push("\n\nFRONT: accuracy against size\n");
        let head = ["box", "balls", "probings", "worst", "mean", "kg", "size mm"];
        let rows: Vec<Vec<String>> = front
            .iter()
            .map(|f| {
                let share = format!("{:.0} %", 100.0 * f.scale);
                f.judged.as_ref().map_or_else(|| vec![share.clone(), "none".into()], |j| row(&share, j))
            })
            .map(|mut row| {
                row.resize(head.len(), String::new());
                row
            })
            .collect();
        out.push(plain_rows(head, rows));
    }
    out
}

fn row(name: &str, judged: &Judged) -> Vec<String> {
    let Judged { balls, probings, worst_um, mean_um, mass_kg, size_mm: [x, y, z], .. } = judged;
    vec![
        name.to_owned(),
        balls.len().to_string(),
        probings.to_string(),
        format!("{worst_um:.1}"),
        format!("{mean_um:.1}"),
        format!("{mass_kg:.1}"),
        format!("{x:.0} x {y:.0} x {z:.0}"),
    ]
}

fn held(held: &Held) -> [String; 2] {
    let Held { predicted_um, measured_um, band_um: [low, high] } = held;
    [format!("{predicted_um:.1}"), format!("{measured_um:.1} ({low:.1} to {high:.1})")]
}

/// Rows along x, columns along y; a dot where the ball cannot be placed or probed.
fn map_table(map: &[OnMap]) -> Table {
    let distinct = |i: usize| {
        let mut values: Vec<f64> = map.iter().map(|m| m.centre_mm[i]).collect();
        values.sort_by(f64::total_cmp);
        values.dedup();
        values
    };
    let (xs, ys) = (distinct(0), distinct(1));
    let head: Vec<String> = std::iter::once("x \\ y mm".to_owned()).chain(ys.iter().map(|y| format!("{y:.0}"))).collect();
    let best = |x: f64, y: f64| {
        let here = map.iter().filter(|m| m.centre_mm[0] == x && m.centre_mm[1] == y);
        here.filter_map(|m| m.worst_um.map(|w| (w, m.centre_mm[2]))).min_by(|a, b| a.0.total_cmp(&b.0))
    };
    let cell = |x: f64, y: f64| best(x, y).map_or_else(|| ".".to_owned(), |(worst, z)| format!("{worst:.1} at {z:.0}"));
    let rows: Vec<Vec<String>> =
        xs.iter().map(|&x| std::iter::once(format!("{x:.0}")).chain(ys.iter().map(|&y| cell(x, y))).collect()).collect();
    plain_rows(head, rows)
}
