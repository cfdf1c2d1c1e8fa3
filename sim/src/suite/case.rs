//! What is hidden in one trial.

use std::fmt;

use calibench::assess::Library;
use calibench::measure::Dataset;

use crate::scenario::SuiteToml;

/// What kind of thing.
#[derive(Debug, Clone, PartialEq)]
#[allow(missing_docs)] // fields are said in the variants' own words
pub enum Kind {
    /// Nothing at all; the noise is larger than stated by this factor.
    Nothing { noise_wrong: f64 },
    /// Effects of the catalogue, by id, all at this many plausible sizes. `@` stands for an order, a moment or a sample to be drawn.
    Effects { ids: Vec<String>, size: f64 },
    /// Every effect of the catalogue at a normal size, so many plausible sizes one-sigma.
    Clutter { size: f64 },
    /// Every effect of the catalogue, sizes of every order of magnitude.
    Dense,
    /// A flaw that no catalogue holds, at this many plausible sizes.
    Unknown { flaw: String, size: f64 },
}

/// One trial of a suite.
#[derive(Debug, Clone, PartialEq)]
pub struct Case {
    /// What is hidden.
    pub kind: Kind,
}

impl fmt::Display for Kind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Kind::Nothing { noise_wrong } if *noise_wrong == 1.0 => write!(f, "nothing"),
            Kind::Nothing { noise_wrong } => write!(f, "nothing, noise x{noise_wrong}"),
            Kind::Effects { ids, size } => write!(f, "{} x{size}", ids.join(" + ")),
            Kind::Clutter { size } => write!(f, "clutter x{size}"),
            Kind::Dense => write!(f, "dense"),
            Kind::Unknown { flaw, size } => write!(f, "unknown {flaw} x{size}"),
        }
    }
}

/// Flaws that no catalogue holds.
pub const UNKNOWN: [&str; 5] = ["cable_spring", "third_harmonic", "cross_coupled_wrist", "gear_defect", "smooth_field"];

/// Effects whose place is drawn.
fn scanned(joints: usize) -> Vec<String> {
    let steps = (1..=joints).map(|j| format!("joint_step:{j}:@"));
    let ripples = (1..=joints).map(|j| format!("harmonic:{j}:@"));
    ["base_step:@", "tool_step:@", "outlier:@"].map(String::from).into_iter().chain(steps).chain(ripples).collect()
}

/// Every case of a suite.
pub(super) fn all(library: &Library, cell: &Dataset, spec: &SuiteToml) -> Vec<Case> {
    let mut ids: Vec<String> = library.candidates.iter().map(|c| c.id.clone()).collect();
    ids.extend(scanned(cell.robot.joints()));
    let mut kinds = Vec::new();
    for _ in 0..spec.trials_of_nothing {
        kinds.push(Kind::Nothing { noise_wrong: 1.0 });
        kinds.push(Kind::Nothing { noise_wrong: spec.noise_wrong });
    }
    for id in &ids {
        for &size in &spec.sizes {
            kinds.extend((0..spec.trials_per_effect).map(|_| Kind::Effects { ids: vec![id.clone()], size }));
        }
    }
    for k in 0..spec.trials_of_two {
        // Pairs far apart in the catalogue, each effect about as often as any other.
        let pair = [k * 7, k * 7 + 13 + k % 29].map(|i| ids[i % ids.len()].clone());
        kinds.push(Kind::Effects { ids: pair.to_vec(), size: 2.0 });
    }
    for &size in &spec.clutter {
        kinds.extend((0..spec.trials_of_clutter).map(|_| Kind::Clutter { size }));
    }
    kinds.extend((0..spec.trials_of_dense).map(|_| Kind::Dense));
    for flaw in UNKNOWN {
        for &size in &spec.unknown_sizes {
            kinds.extend((0..spec.trials_of_unknown).map(|_| Kind::Unknown { flaw: flaw.into(), size }));
        }
    }
    kinds.into_iter().map(|kind| Case { kind }).collect()
}
