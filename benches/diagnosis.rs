//! W7: a whole diagnosis, from the dataset to the verdict, of 80 centrings and of 11,911 points of a tracker.
#![allow(clippy::unwrap_used, missing_docs)]

mod works;

use std::hint::black_box;

use calibench::diagnosis::{Examination, diagnose, diagnose_examined};
use calibench::identify::Model;
use calibench::import::{ImportOptions, import};
use calibench::measure::dataset::{Dataset, NamedDataset};
use criterion::{Criterion, criterion_group, criterion_main};
use works::{golden, oracles};

/// The grid of the UR10 among the public data.
fn ur10() -> Dataset {
    let file = oracles::data("ur10-ipa").join("Series_A/measurements_grid.csv");
    import("ur10-ipa", &[file], &ImportOptions::default()).unwrap().0
}

fn diagnosis(c: &mut Criterion) {
    let centred = works::centred(&golden::golden_model());
    let mut group = c.benchmark_group("W7");
    group.sample_size(10);
    for (name, dataset) in [("80 centrings", centred), ("11,911 points", ur10())] {
        let named = [NamedDataset::new("W7", &dataset)];
        let model = Model::paper();
        let mut bench = |name: String, work: &mut dyn FnMut()| {
            works::print_least(&name, 1, &mut *work);
            group.bench_function(name, |b| b.iter(&mut *work));
        };
        bench(format!("diagnosis of {name}"), &mut || _ = black_box(diagnose(&named, &model).unwrap()));
        bench(format!("  of it fitting and laying out {name}"), &mut || {
            _ = black_box(Examination::new(&named, &model).unwrap());
        });
        let examination = Examination::new(&named, &model).unwrap();
        bench(format!("  of it weighing what may be missing {name}"), &mut || {
            _ = black_box(diagnose_examined(&named, &examination).unwrap());
        });
    }
    group.finish();
}

criterion_group!(benches, diagnosis);
criterion_main!(benches);
