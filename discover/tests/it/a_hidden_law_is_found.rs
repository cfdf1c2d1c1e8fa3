//! A law that nobody listed is found where it is, and none is found where there is none.

use calibench::identify::problem::Use;
use calibench::identify::{Model, identify};
use calibench::measure::dataset::{Dataset, NamedDataset};
use calibench::units::MM;
use calibench_discover::{Discovery, discover};

use super::hidden_laws::{Hidden, LAWS, Place, Without};

fn found(dataset: &Dataset) -> Discovery {
    discover(&[NamedDataset::new("robot", dataset)], &Model::default_for(dataset)).expect("a search")
}

/// Rms error at rows that were not fitted, mm.
fn measured(dataset: &Dataset, model: &Model) -> f64 {
    let named = [NamedDataset::new("robot", dataset)];
    let Ok(fit) = identify(&named, model) else { return f64::NAN };
    let there = fit.predict(&named, Use::Validation).expect("a prediction");
    (there.residuals.iter().map(|r| r.norm_squared()).sum::<f64>() / there.residuals.len() as f64).sqrt() / MM
}

#[test]
#[ignore = "dev"]
fn table_of_laws() {
    let seeds: Vec<u64> = std::env::var("SEEDS").unwrap_or("1".into()).split(',').map(|s| s.parse().unwrap()).collect();
    let only: Option<usize> = std::env::var("LAW").ok().map(|s| s.parse().unwrap());
    let (mut n, mut named, mut placed, mut error) = (0, 0, 0, 0);
    for number in (0..LAWS).filter(|k| only.is_none_or(|o| o == *k)) {
        for &seed in &seeds {
            let hidden = Hidden::law(number, seed);
            let law = hidden.law.as_ref().expect("a law");
            let begun = std::time::Instant::now();
            let found = found(&hidden.dataset);
            let seconds = begun.elapsed().as_secs_f64();
            let mut model = Model::default_for(&hidden.dataset);
            for (k, law) in found.laws.iter().enumerate() {
                let name = format!("law{k}");
                model.own.push(law.effect(&name));
                model = model.with(&name);
            }
            for listed in &found.listed {
                if !listed.contains(' ') && !model.holds(listed) { model = model.with(listed); }
            }
            let before = measured(&hidden.dataset, &Model::default_for(&hidden.dataset));
            let after = measured(&hidden.dataset, &model);
            let oracle = measured(&hidden.known, &Model::default_for(&hidden.dataset));
            let best = found.laws.first();
            let right_place = best.is_some_and(|b| match law.place {
                Place::Joint(j) => b.site == format!("theta:{}", j + 1),
                Place::Tool => b.site.starts_with("flex:6"),
                Place::Base => b.site.starts_with("base"),
            });
            let right = right_place && best.is_some_and(|b| b.variables.iter().all(|v| law.follows.iter().any(|f| v.name.contains(f.as_str()))));
            n += 1; named += usize::from(right); placed += usize::from(right_place); error += usize::from(after <= 1.2 * oracle);
            println!("{number:2} {seed} {} | {} | {:.4} -> {:.4} oracle {:.4} {} | {:.1}s {} | listed {:?}", if right { "OK " } else if right_place { "PL " } else { "-- " }, law.name, before, after, oracle, if after <= 1.2 * oracle { "ok" } else { "HIGH" }, seconds, found.tried, found.listed);
            println!("      hidden {:?} {:?}", law.place, law.follows);
            for l in found.laws.iter().chain(&found.suspected) {
                println!("      p {:.1e} ln {:.1} {} : {} [{:.0} %]", l.p_false, l.ln_odds, l.site, l.formula(), 100.0 * l.explains);
                for r in &l.rivals { println!("          rival {:.2} {}", r.odds, r.words); }
            }
        }
    }
    println!("named {named} placed {placed} error {error} of {n}");
}

#[test]
#[ignore = "dev"]
fn table_of_nothing() {
    let count: u64 = std::env::var("COUNT").unwrap_or("10".into()).parse().unwrap();
    for kind in [Without::White, Without::Correlated, Without::Ordinary] {
        let mut false_laws = 0;
        for seed in 0..count {
            let hidden = Hidden::without(kind, seed);
            let found = found(&hidden.dataset);
            false_laws += usize::from(!found.laws.is_empty());
            for l in found.laws.iter().chain(&found.suspected) {
                println!("   {seed} p {:.1e} ln {:.1} {} : {} [{:.0} %] listed {:?}", l.p_false, l.ln_odds, l.site, l.formula(), 100.0 * l.explains, found.listed);
            }
        }
        println!("{kind:?}: {false_laws} of {count}");
    }
}
