//! The first probings of a campaign say where the next balls will be met: of Table 8's robots and the paper's, at most two contacts are
//! beyond the gauge's range, and all of those after the first probings of each ball are well within it.

use calibench::measure::campaign::CampaignRecord;
use calibench::units::MM;
use calibench_sim::plans::{Plans, session_s};
use calibench_sim::random::Streams;
use calibench_sim::scenario::load_scenario;
use calibench_sim::session::Session;

/// Probings after which the balls are known to be met: two on each.
const KNOWN: usize = 8;

/// Distances from the ball's centre at the first reading on it, mm, in the order of the campaign.
fn first_contacts(record: &CampaignRecord) -> Vec<f64> {
    record.probings.iter().filter_map(|p| p.probing.first_reading()).map(|r| r.norm() / MM).collect()
}

fn campaign(scenario: &str, seed: u64) -> Vec<f64> {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../scenarios/");
    let mut scenario = load_scenario(format!("{path}{scenario}.toml").as_ref()).unwrap();
    scenario.plan.aimed = true;
    let plans = Plans::new(&scenario, seed).unwrap();
    let session =
        Session::begin(&scenario, Streams { seed, trial: 0 }, session_s(&scenario, &plans.plan.probing.poses, 0)).unwrap();
    let record = session.probe(&plans.plan.probing, None, &mut ());
    assert_eq!((record.samples.len(), &record.aborted), (80, &None), "seed {seed}");
    first_contacts(&record)
}

#[test]
fn few_balls_are_met_beyond_the_range_of_the_gauge() {
    // Seeds that nothing was chosen on.
    for scenario in ["table8", "paper"] {
        for seed in 301..305 {
            let contacts = campaign(scenario, seed);
            let beyond = contacts.iter().filter(|c| **c > 5.0).count();
            let largest = |contacts: &[f64]| contacts.iter().copied().fold(0.0, f64::max);
            let [first, later] = [&contacts[..KNOWN], &contacts[KNOWN..]].map(largest);
            let mean = contacts[KNOWN..].iter().sum::<f64>() / (contacts.len() - KNOWN) as f64;
            println!(
                "{scenario} {seed}: {beyond} beyond 5 mm; largest {first:.2} mm of the first {KNOWN}, then {later:.2} mm, mean {mean:.2} mm"
            );
            assert!(beyond <= 2 && later < 1.5, "{scenario} {seed}: {beyond} beyond 5 mm, {later:.2} mm after the first");
        }
    }
}
