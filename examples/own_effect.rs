//! An effect of one's own: a family that the catalogue does not hold is registered, named by a diagnosis, and fitted.
//!
//! The effect is that of a hose package: beyond 90 degrees it pulls a joint back. A family says its equation to the model and everything
//! else that there is to know about it to tables and warnings. Run it with `cargo run --example own_effect`.

use std::error::Error;
use std::sync::Arc;

use calibench::diagnosis::diagnose;
use calibench::effects::facts::{
    Alias, CurveShape, Follows, Intervention, LinearRange, Meaning, Offered, Period, Physical, Role, Signature, Stray, Work,
};
use calibench::effects::family::{Family, Origin, Scan};
use calibench::effects::registry::Registry;
use calibench::effects::situation::Situation;
use calibench::effects::{Effect, EffectId, Emit, ParameterSpec};
use calibench::identify::calibration::Estimate;
use calibench::identify::{Model, identify};
use calibench::measure::dataset::{Dataset, Measured, NamedDataset, Noise, Sample};
use calibench::robot::kinematics::world_from_tool;
use calibench::robot::sites::{MdhEntry, Site};
use calibench::robot::{FramePose, built_in};
use calibench::units::{DEG, UM, Unit};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};

/// Rotation by which the hoses of the simulated arm pull joint 1 back, rad per rad.
pub const PULL: f64 = 400e-6;

/// `hose_pull:J`.
struct HosePull {
    id: String,
    joint: usize,
    parameters: [ParameterSpec; 1],
}

impl Effect for HosePull {
    fn id(&self) -> &str {
        &self.id
    }

    fn parameters(&self) -> &[ParameterSpec] {
        &self.parameters
    }

    fn terms(&self, at: &Situation<'_>, emit: &mut Emit<'_>) {
        emit(0, Site::mdh(self.joint, MdhEntry::Theta), -beyond(at.q[self.joint]));
    }
}

/// Rotation of a joint beyond 90 degrees, signed, rad.
fn beyond(q: f64) -> f64 {
    q - q.clamp(-90.0 * DEG, 90.0 * DEG)
}

/// The family: its name, equation, size and signature.
pub static HOSE_PULL: Family = Family {
    id: "hose_pull",
    arguments: ":J",
    name: "pull of the hoses on {joint}",
    what: "hoses pull a joint back",
    equation: "theta_J -= s (q_J beyond 90 deg)",
    origin: Origin::Arm,
    scan: Scan::None,
    follows: &[Follows::JointAngle],
    role: Role::Cause,
    offered: Offered::Always,
    physical: Physical::Any,
    linear_range: LinearRange::Si(0.01),
    period: Period::None,
    curve: CurveShape::None,
    meaning: Meaning {
        physics: "the hose package tightens and pulls the joint back",
        intervention: Intervention {
            work: Work::Service,
            act: "look at the hoses",
            verify: "the same postures with the hoses off",
        },
    },
    signature: Signature {
        looks: [
            "The joint stops short beyond a quarter of a turn, on both sides.",
            "Against its own angle the points lie on zero up to there, and then on a line.",
            "It does not grow with the load.",
        ],
        parted_by: "The same postures with the hoses untied.",
    },
    stray: Stray::None,
    alias: Alias::None,
    members: |subject| (1..=subject.robot.joints()).map(|j| format!(":{j}")).collect(),
    build: |id, subject| {
        id.at_most(1)?;
        let pull = ParameterSpec::new(format!("{}.s", id.whole()), Unit::URAD_PER_RAD, 100e-6);
        Ok(Box::new(HosePull { id: id.whole().into(), joint: id.joint(0, subject)?, parameters: [pull] }))
    },
};

/// Prints what the diagnosis names, and how large it is.
pub fn main() -> Result<(), Box<dyn Error>> {
    let (named, pull) = named_and_fitted()?;
    let [value, sigma] = [pull.value, pull.sigma].map(|si| pull.unit.from_si(si));
    println!("the diagnosis names {}", named.join(", "));
    println!("{} = {value:.0} ± {sigma:.0} {} (simulated {:.0})", pull.name, pull.unit.symbol, pull.unit.from_si(PULL));
    Ok(())
}

/// Effects that the diagnosis of a model without the effect names, and the estimate of a model with it.
pub fn named_and_fitted() -> Result<(Vec<EffectId>, Estimate), Box<dyn Error>> {
    let model = Model { registry: Registry::default().with(&HOSE_PULL)?, ..Model::of(&["base_frame", "mdh"]) };
    let data = campaign()?;
    let named = diagnose(&[NamedDataset::new("campaign", &data)], &model)?.set95;
    let calibration = identify(&[NamedDataset::new("campaign", &data)], &model.with("hose_pull:1"))?;
    Ok((named, calibration.estimate("hose_pull:1.s").ok_or("it was not fitted")?.clone()))
}

/// A hundred and twenty points of an arm whose hoses pull joint 1 back, and noise.
pub fn campaign() -> Result<Dataset, Box<dyn Error>> {
    let robot = Arc::new(built_in("kr6_r700").ok_or("no such robot")?);
    let (base, tool) = (FramePose::default(), FramePose { xyz: [0.06, 0.01, -0.125], rz_ry_rx: [0.0; 3] });
    let mut random = ChaCha8Rng::seed_from_u64(2);
    let noise = Normal::new(0.0, 20.0 * UM)?;
    let mut measure = |k: usize| {
        let q: Vec<f64> = robot.links.iter().map(|link| random.random_range(link.limits[0]..link.limits[1])).collect();
        let mut true_q = q.clone();
        true_q[0] -= PULL * beyond(q[0]);
        let point = world_from_tool(&robot, &base, &tool, &true_q).translation.vector;
        Sample::new(format!("p{k}"), q, Measured::Point(point.map(|x| x + noise.sample(&mut random))))
    };
    let samples = (0..120).map(&mut measure).collect();
    let noise = Noise { point: Some(20.0 * UM), ..Noise::default() };
    Ok(Dataset { samples, robot, base, tool, noise, ..Dataset::default() })
}
