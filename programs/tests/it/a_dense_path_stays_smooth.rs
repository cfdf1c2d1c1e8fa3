//! A smooth path of 2,000 points is compensated without a step; joint limits and singularities are told by stretch.

use std::f64::consts::TAU;
use std::time::Instant;

use calibench_programs::{Dialect, Permissions, RewrittenProgram};

use crate::a_program_is_rewritten_and_nothing_else::Bench;
use crate::programs_are_as_controllers_write_them::rewrite;

/// Points of the path.
const POINTS: usize = 2000;
/// Promised: largest step of the compensation where the path has none, um; a tenth of it is asked for.
const STEP_UM: f64 = 10.0;

fn given() -> Permissions {
    Permissions { tool_given: true, base_given: true, ..Permissions::default() }
}

/// A KRL program of straight motions over points X, Y, Z (mm), A, B, C (deg).
fn krl(points: impl Iterator<Item = [f64; 6]>) -> String {
    let of = |p: [f64; 6]| {
        let numbers: Vec<String> = "XYZABC".chars().zip(p).map(|(name, value)| format!("{name} {value:.7}")).collect();
        format!("LIN {{{}}} C_DIS\r\n", numbers.join(","))
    };
    format!("DEF path()\r\n{}END\r\n", points.map(of).collect::<String>())
}

fn rewritten(bench: &Bench, text: &str) -> RewrittenProgram {
    rewrite(bench, Dialect::Krl, &[("path.src", text.into())], &given()).remove(0)
}

/// A closed curve, its orientation turning with it.
fn curve(k: usize) -> [f64; 6] {
    let t = TAU * k as f64 / POINTS as f64;
    [
        420.0 + 90.0 * t.cos(),
        60.0 + 110.0 * t.sin(),
        420.0 + 40.0 * (3.0 * t).sin(),
        170.0 + 12.0 * t.sin(),
        40.0 + 8.0 * (2.0 * t).cos(),
        175.0,
    ]
}

#[test]
fn a_smooth_path_has_no_step() {
    let bench = Bench::kr6();
    let begun = Instant::now();
    let new = rewritten(&bench, &krl((0..POINTS).map(curve)));
    let took = begun.elapsed();
    let is_of_singularity = new.remarks.iter().all(|remark| remark.reason.starts_with("near a singularity"));
    assert!(new.is_whole() && is_of_singularity && new.remarks.len() <= 4, "{:#?}", new.remarks);
    assert_eq!(new.rewritten.len(), POINTS);
    let shifts: Vec<[f64; 3]> = new.rewritten.iter().map(|one| one.shift().unwrap()).collect();
    let largest = |order: fn(&[[f64; 3]], usize) -> f64, window: usize| {
        shifts.windows(window).map(|w| (0..3).map(|k| order(w, k).powi(2)).sum::<f64>().sqrt()).fold(0.0, f64::max) * 1e6
    };
    let first = largest(|w, k| w[1][k] - w[0][k], 2);
    let second = largest(|w, k| w[2][k] - 2.0 * w[1][k] + w[0][k], 3);
    println!("{POINTS} points in {took:?}: the shift changes by up to {first:.3} um a point, and its change by {second:.4} um");
    // The shift changes along the way; a step would show whole in the change of its change.
    assert!(second < 0.1 * STEP_UM, "{first} {second} um");
}

#[test]
fn limits_and_singularities_are_told_by_stretch() {
    let bench = Bench::kr6();
    // Straight out of reach and back: one stretch of refusals.
    let away = |k: usize| {
        let [_, y, z, a, b, c] = curve(0);
        [500.0 + 0.6 * (k.min(POINTS - k) as f64), y, z, a, b, c]
    };
    let new = rewritten(&bench, &krl((0..POINTS).map(away)));
    let refused: Vec<_> = new.remarks.iter().filter(|remark| remark.blocks).collect();
    let told: Vec<String> = new.remarks.iter().map(|r| format!("{}: {}: {}", r.line, r.what, r.reason)).collect();
    assert!((1..=4).contains(&refused.len()), "{told:#?}");
    let count: usize = refused
        .iter()
        .map(|r| r.reason.rsplit_once('(').and_then(|(_, n)| n.split(' ').next()?.parse::<usize>().ok()).unwrap_or(1))
        .sum();
    assert_eq!(count + new.rewritten.len(), POINTS, "{told:#?}");
    // Along the line on which joint 5 passes zero.
    let wrist = |k: usize| {
        let q5 = -0.12 + 0.24 * k as f64 / POINTS as f64;
        let q = [0.2, -1.2, 1.4, 0.05, q5, 0.1].map(f64::to_degrees);
        format!("PTP {{A1 {},A2 {},A3 {},A4 {},A5 {},A6 {}}}\r\n", q[0], q[1], q[2], q[3], q[4], q[5])
    };
    let text = format!("DEF p()\r\n{}END\r\n", (0..POINTS).map(wrist).collect::<String>());
    let new = rewritten(&bench, &text);
    let told: Vec<String> = new.remarks.iter().map(|r| format!("{}: {}: {}", r.line, r.what, r.reason)).collect();
    assert!((1..=6).contains(&new.remarks.len()) && told.iter().any(|t| t.contains("near a singularity")), "{told:#?}");
}
