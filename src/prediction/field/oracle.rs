//! A small field whose numbers another program computed: `tests/data/golden/joint_field.py`.

use nalgebra::{DMatrix, DVector};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use serde_json::Value;

use super::basis::{Basis, JointFacts};
use super::rows::{Groups, Rows};
use super::{evidence, gibbs, kernels, left_out};
use crate::effects::error_field::JointFunctions;

struct Golden {
    numbers: Value,
    rows: Rows,
    groups: Groups,
    y: DVector<f64>,
}

fn golden() -> Golden {
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/golden/joint_field.json");
    let numbers = serde_json::from_str(&std::fs::read_to_string(file).unwrap()).unwrap();
    let (samples, joints) = (14, 3);
    let q = |s: usize| -> Vec<f64> {
        let s = s as f64;
        (0..joints).map(|j| 1.2 * (0.7 + 1.3 * s + 2.1 * j as f64 + 0.37 * s * j as f64).sin()).collect()
    };
    let tau = |s: usize| -> Vec<f64> {
        (0..joints).map(|j| 10.0 * j as f64 * (0.4 + 0.9 * s as f64 + 1.7 * j as f64).cos()).collect()
    };
    let lever = |r: usize, j: usize| 6e4 * (1.0 + 0.5 * r as f64 + 0.8 * j as f64).sin();
    let load = |j: usize| (0..samples).map(|s| tau(s)[j].powi(2)).sum::<f64>() / samples as f64;
    let facts = (0..joints).map(|j| JointFacts { turns: true, lever: 1.0, load: load(j).sqrt() });
    let basis = Basis::of(&facts.collect::<Vec<_>>());
    let groups = Groups::of(&basis, &[2]);
    let functions = basis.joints.iter().map(|own| {
        let mut transposed = DMatrix::zeros(own.width(), samples);
        for (s, mut to) in transposed.column_iter_mut().enumerate() {
            basis.write(own, &q(s), &tau(s), to.as_mut_slice());
        }
        transposed.transpose()
    });
    let n = 3 * samples;
    let rows = Rows {
        samples: (0..samples).map(|s| 3 * s..3 * s + 3).collect(),
        smooth: DMatrix::from_fn(n, 2, |r, k| 3.0 * (0.3 * r as f64 * (k + 1) as f64 + k as f64).cos()),
        effects: DMatrix::from_fn(n, 2, |r, k| 1.5 * (0.45 * r as f64 * (k + 1) as f64 + 2.0 * k as f64).sin()),
        levers: (0..joints).map(|j| DVector::from_fn(n, |r, _| lever(r, j))).collect(),
        functions: functions.collect(),
    };
    let y = DVector::from_fn(n, |r, _| {
        let q = q(r / 3);
        2.0 * rows.smooth[(r, 0)] - rows.smooth[(r, 1)]
            + 1.2e-4 * lever(r, 0) * (2.0 * q[0] + 0.3).sin() * (2.0 * q[1]).sin()
            + 6e-5 * lever(r, 1) * q[1].cos()
            + 1.1 * (0.31 * (r * r) as f64 + 0.2).sin()
    });
    Golden { numbers, rows, groups, y }
}

fn list(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect()
}

fn assert_near(ours: impl IntoIterator<Item = f64>, theirs: &[f64], tolerance: f64) {
    let largest = theirs.iter().fold(0.0_f64, |a, x| a.max(x.abs()));
    let ours: Vec<f64> = ours.into_iter().collect();
    assert_eq!(ours.len(), theirs.len());
    for (k, (a, b)) in ours.iter().zip(theirs).enumerate() {
        assert!((a - b).abs() <= tolerance * largest, "{k}: {a} {b}");
    }
}

#[test]
fn kernels_are_those_of_their_formulas() {
    let Golden { numbers, rows, groups, .. } = golden();
    let kernels = kernels::Kernels::new(&rows, &groups);
    let sizes: Vec<f64> = (0..groups.all.len()).map(|g| 0.01 * (g + 1) as f64).collect();
    let mut sum = DMatrix::zeros(rows.count(), rows.count());
    kernels.sum(&rows, &groups, &sizes, &mut kernels::Room::new(&rows), &mut sum);
    for (c, theirs) in numbers["covariance"].as_array().unwrap().iter().enumerate() {
        for (r, theirs) in (c..).zip(list(theirs)) {
            let near = 1e-9 * (sum[(c, c)] * sum[(r, r)]).sqrt();
            assert!((sum[(r, c)] - theirs).abs() < near, "{r} {c}: {} {theirs}", sum[(r, c)]);
        }
    }
    // The same by columns.
    let whole = rows.covariance(&rows, &groups, &sizes);
    let diagonal: Vec<f64> = sum.diagonal().iter().copied().collect();
    assert_near(whole.diagonal().iter().copied(), &diagonal, 1e-9);
    assert_near(rows.variance(&groups, &sizes).iter().copied(), &diagonal, 1e-9);
}

#[test]
fn sizes_by_evidence_and_left_out_parts_agree_with_numpy() {
    let Golden { numbers, rows, groups, y } = golden();
    let weights = vec![1.0; rows.samples.len()];
    let found = evidence::of_groups(&rows, &groups, &y, &weights, Some(1.0)).unwrap();
    assert_near(found.sizes.groups.iter().copied(), &list(&numbers["evidence"]["sizes"]), 1e-7);
    assert_near([found.sizes.noise], &[numbers["evidence"]["noise"].as_f64().unwrap()], 1e-7);
    assert_near(rows.applied(&found.mean).iter().copied(), &list(&numbers["evidence"]["moved"]), 1e-7);
    for part in numbers["left_out"].as_array().unwrap() {
        let samples: Vec<usize> = list(&part["samples"]).into_iter().map(|s| s as usize).collect();
        let own: Vec<usize> = samples.iter().flat_map(|s| 3 * s..3 * s + 3).collect();
        let (errors, covariance) = left_out::errors(&found, &own).unwrap();
        assert_near(errors.iter().copied(), &list(&part["errors"]), 1e-7);
        assert_near(covariance.diagonal().iter().copied(), &list(&part["variances"]), 1e-7);
    }
    let alone = evidence::of_model(&rows.of_model(), &y, &weights, Some(1.0)).unwrap();
    assert_near([alone.sizes.noise], &[numbers["alone"].as_f64().unwrap()], 1e-7);
}

#[test]
fn draws_scatter_about_the_mean_as_the_covariance_has_it() {
    let Golden { rows, groups, y, .. } = golden();
    let found = evidence::of_groups(&rows, &groups, &y, &vec![1.0; rows.samples.len()], Some(1.0)).unwrap();
    let random = &mut ChaCha8Rng::seed_from_u64(4);
    let mean = rows.applied(&found.mean);
    let count = 400;
    let (mut sum, mut squares) = (DVector::zeros(rows.count()), 0.0);
    for _ in 0..count {
        let off = rows.applied(&found.draw(&rows, &groups, &y, random)) - &mean;
        squares += off.norm_squared() / f64::from(count);
        sum += off / f64::from(count);
    }
    let expected: f64 = found.variances(&rows, &groups, &rows).iter().sum();
    assert!((squares / expected - 1.0).abs() < 0.1, "{squares} {expected}");
    assert!(sum.norm_squared() < 3.0 * expected / f64::from(count), "{sum}");
}

#[test]
fn sizes_by_sampling_agree_with_another_sampler() {
    let Golden { numbers, rows, groups, y } = golden();
    let numbers = &numbers["sampled"];
    let chains = 12;
    let mut moved = DVector::zeros(rows.count());
    let mut logs = vec![0.0; groups.all.len()];
    for seed in 0..chains {
        let sampled = gibbs::sample(&rows, &groups, &y, Some(1.0), seed).unwrap();
        moved += rows.applied(&sampled.mean) / chains as f64;
        logs.iter_mut().zip(&sampled.sizes.groups).for_each(|(log, v)| *log += v.ln() / chains as f64);
    }
    let theirs = DVector::from_vec(list(&numbers["moved"]));
    assert!((&moved - &theirs).norm() < 0.03 * theirs.norm(), "{moved} {theirs}");
    // Twelve chains of a hundred sweeps know the mean of a size's logarithm to a fraction of its spread.
    let [means, spreads] = ["log_sizes", "log_spreads"].map(|name| list(&numbers[name]));
    for (g, ((ours, theirs), spread)) in logs.iter().zip(means).zip(spreads).enumerate() {
        assert!((ours - theirs).abs() < 0.5 * spread, "{:?}: {ours} {theirs} {spread}", groups.all[g]);
    }
}

#[test]
fn joints_that_slide_have_no_functions() {
    let of = |turns: [bool; 4]| {
        Basis::of(&turns.map(|turns| JointFacts { turns, lever: 1.0, load: if turns { 5.0 } else { 400.0 } }))
    };
    let basis = of([false, true, true, true]);
    assert_eq!(basis.joints.iter().map(|j| j.joint).collect::<Vec<_>>(), [1, 2, 3]);
    let of_first = &basis.joints[0].groups;
    assert!(of_first.contains(&JointFunctions::Angles { joint: 1, of: [1, 2] }));
    assert_eq!(of_first.len(), 5 + 1 + 2);
    assert!(of([false; 4]).joints.is_empty());
}

#[test]
fn a_bad_sample_counts_less() {
    let rows = golden().rows.of_model();
    let mut y = DVector::from_fn(rows.count(), |r, _| (0.31 * (r * r) as f64).sin());
    y[7] += 30.0;
    let weights = evidence::weights(&rows, &y).unwrap();
    for (s, weight) in weights.iter().enumerate() {
        assert!(if s == 2 { *weight < 0.1 } else { *weight == 1.0 }, "{weights:?}");
    }
}
