//! Cost of a probing with the mechanics in closed form and in MuJoCo: approach, contact, some three steps, retreat,
//! each settled.
#![allow(clippy::unwrap_used, missing_docs)]

use std::path::Path;

use calibench_sim::plans::Plans;
use calibench_sim::plans::session_s;
use calibench_sim::random::Streams;
use calibench_sim::scenario::PlantKind;
use calibench_sim::scenario::load_scenario;
use calibench_sim::session::Session;
use criterion::{Criterion, Throughput, criterion_group, criterion_main};

fn probing(c: &mut Criterion) {
    let scenarios = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenarios");
    let mut group = c.benchmark_group("a campaign of 80 probings");
    group.sample_size(10);
    for (name, file) in
        [("closed forms", "table8.toml"), ("MuJoCo", "table8.toml"), ("MuJoCo with friction", "mujoco-friction.toml")]
    {
        let plant = if name == "closed forms" { PlantKind::Analytic } else { PlantKind::Mujoco };
        let scenario = load_scenario(&scenarios.join(file)).unwrap().with_plant(plant);
        let plans = Plans::new(&scenario, 1).unwrap();
        let mut probing = plans.plan.probing;
        probing.poses.retain(|p| !p.reserve);
        probing.poses.truncate(80);
        let session_s = session_s(&scenario, &probing.poses, 0);
        let campaign = || {
            let session = Session::begin(&scenario, Streams { seed: 1, trial: 0 }, session_s).unwrap();
            session.probe(&probing, None, &mut ()).probings.len()
        };
        // A probing that runs into a joint limit is tried again.
        let probings = campaign();
        assert!(probings >= probing.poses.len());
        group.throughput(Throughput::Elements(probings as u64));
        group.bench_function(name, |b| b.iter(campaign));
    }
    group.finish();
}

criterion_group!(benches, probing);
criterion_main!(benches);
