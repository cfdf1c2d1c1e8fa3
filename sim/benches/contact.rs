//! W6: the three plunger readings of a ball's centre, in closed form.
#![allow(clippy::unwrap_used, missing_docs)]

#[path = "../../tests/it/oracles.rs"]
mod oracles;

use std::hint::black_box;

use calibench::units::MM;
use calibench_sim::contact::{DATUM_RADIUS, readings_closed_form};
use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde_json::Value;

/// Tolerance of the golden readings, m: they are of millimetre size and stored to 1e-16 m.
const TOLERANCE: f64 = 1e-15;

/// Checks that the readings agree with those of the independent programs for their 500 centres.
fn check(golden: &Value) {
    let triple = |value: &Value| -> [f64; 3] { std::array::from_fn(|k| value[k].as_f64().unwrap()) };
    let (centres, readings) = (golden["centres_m"].as_array().unwrap(), golden["reading_analytic_m"].as_array().unwrap());
    for (centre, wanted) in centres.iter().zip(readings) {
        // The reference's disks are on the other side of the ball: both axes and readings are reversed.
        let found = readings_closed_form(triple(centre).map(|c| -c), DATUM_RADIUS).map(|r| -r);
        assert!(found.iter().zip(triple(wanted)).all(|(f, w)| (f - w).abs() < TOLERANCE), "{found:?} {wanted}");
    }
}

fn contact(c: &mut Criterion) {
    let text = std::fs::read_to_string(oracles::folder().join("golden/contact_500.json")).unwrap();
    check(&serde_json::from_str(&text).unwrap());
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let centres: Vec<[f64; 3]> = (0..10_000).map(|_| std::array::from_fn(|_| rng.random_range(-6.0..6.0) * MM)).collect();
    let mut group = c.benchmark_group("W6");
    group.throughput(Throughput::Elements(centres.len() as u64));
    group.bench_function("three readings of 10,000 centres", |b| {
        b.iter(|| centres.iter().for_each(|centre| _ = black_box(readings_closed_form(*centre, DATUM_RADIUS))));
    });
    group.finish();
}

criterion_group!(benches, contact);
criterion_main!(benches);
