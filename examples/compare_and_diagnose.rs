//! Why a calibration fails: it is compared with measurements that it has not seen, and a diagnosis says what its model lacks.
//!
//! The arm of this example holds an effect that its model does not: joint 2 errs twice per turn, as an oval gear does. A third of the
//! samples is kept from the fit. Run it with `cargo run --example compare_and_diagnose`.

use std::error::Error;
use std::sync::Arc;

use calibench::diagnosis::{Diagnosis, diagnose};
use calibench::identify::problem::Use;
use calibench::identify::{Model, identify};
use calibench::measure::dataset::{Dataset, Measured, NamedDataset, Noise, Sample, SampleSet};
use calibench::residuals::comparison::Comparison;
use calibench::robot::kinematics::world_from_tool;
use calibench::robot::{FramePose, built_in};
use calibench::units::{MM, UM, URAD};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};

/// One-sigma of each coordinate of a point.
const NOISE: f64 = 20.0 * UM;

/// Amplitude of the error that is hidden in joint 2.
pub const HIDDEN: f64 = 200.0 * URAD;

/// Prints what the comparison says, and what the diagnosis names.
pub fn main() -> Result<(), Box<dyn Error>> {
    let (comparison, diagnosis) = compared_and_diagnosed()?;
    println!("{} samples that were not fitted: {:.3} mm rms", comparison.samples, comparison.rms / MM);
    for sentence in comparison.sentences() {
        println!("  {sentence}");
    }
    println!("the diagnosis says '{}'", diagnosis.verdict.name());
    for finding in diagnosis.findings.iter().take(3) {
        println!("  {:12} probability {:.2}", finding.hypothesis.effect, finding.probability);
        for number in &finding.parameters {
            let [value, sigma] = [number.value, number.sigma].map(|si| number.unit.from_si(si));
            println!("    {} = {value:.0} ± {sigma:.0} {}", number.name, number.unit.symbol);
        }
    }
    Ok(())
}

/// Calibrates, compares with what was kept from the fit, and diagnoses the fit.
pub fn compared_and_diagnosed() -> Result<(Comparison, Diagnosis), Box<dyn Error>> {
    let model = Model::of(&["base_frame", "mdh"]);
    let data = campaign()?;
    let datasets = [NamedDataset::new("campaign", &data)];
    let calibration = identify(&datasets, &model)?;
    Ok((Comparison::of(&calibration, &datasets, Use::Validation)?, diagnose(&datasets, &model)?))
}

/// A hundred and eighty points of an arm whose joint 2 errs twice per turn, and noise.
fn campaign() -> Result<Dataset, Box<dyn Error>> {
    let robot = Arc::new(built_in("kr6_r700").ok_or("no such robot")?);
    let (base, tool) = (FramePose::default(), FramePose { xyz: [0.06, 0.01, -0.125], rz_ry_rx: [0.0; 3] });
    let mut random = ChaCha8Rng::seed_from_u64(3);
    let noise = Normal::new(0.0, NOISE)?;
    let mut measure = |k: usize| {
        let q: Vec<f64> = robot.links.iter().map(|link| random.random_range(link.limits[0]..link.limits[1])).collect();
        let mut true_q = q.clone();
        true_q[1] += HIDDEN * (2.0 * q[1]).sin();
        let point = world_from_tool(&robot, &base, &tool, &true_q).translation.vector;
        let seen = point.map(|x| x + noise.sample(&mut random));
        let set = if k.is_multiple_of(3) { SampleSet::Validation } else { SampleSet::Fit };
        Sample { set, ..Sample::new(format!("p{k}"), q, Measured::Point(seen)) }
    };
    let samples = (0..180).map(&mut measure).collect();
    let noise = Noise { point: Some(NOISE), ..Noise::default() };
    Ok(Dataset { samples, robot, base, tool, noise, ..Dataset::default() })
}
