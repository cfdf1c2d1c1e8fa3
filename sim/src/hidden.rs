//! Flaws that no model may know: what a diagnosis does when its catalogue does not hold the cause.
//!
//! None of them is in [`calibench::effects::CATALOGUE`]. Each is written for the simulated cell alone, one file each, and is as large as
//! its `rms_urad` says: the root mean square of the joint's error over the workspace, every posture within the joint limits alike.

mod cable_spring;
mod cross_coupled_wrist;
mod gear_defect;
mod smooth_field;
mod third_harmonic;

use std::f64::consts::PI;
use std::sync::Arc;

use calibench::measure::Dataset;
use calibench::robot::{MdhEntry, Robot, Site};
use serde::Deserialize;

use crate::flaw::Flaw;

pub use cable_spring::CableSpring;
pub use cross_coupled_wrist::CrossCoupledWrist;
pub use gear_defect::GearDefect;
pub use smooth_field::SmoothField;
pub use third_harmonic::ThirdHarmonic;

/// The keys under `[truth.hidden]`.
#[derive(Debug, Clone, PartialEq, Default, Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(missing_docs)] // described in docs/scenarios.md
pub struct HiddenToml {
    pub cable_spring: Option<CableSpring>,
    pub third_harmonic: Option<ThirdHarmonic>,
    pub cross_coupled_wrist: Option<CrossCoupledWrist>,
    pub gear_defect: Option<GearDefect>,
    pub smooth_field: Option<SmoothField>,
}

impl HiddenToml {
    /// The joints that err, from 1.
    pub fn joints(&self) -> Vec<usize> {
        let one = [
            self.cable_spring.as_ref().map(|f| f.joint),
            self.third_harmonic.as_ref().map(|f| f.joint),
            self.gear_defect.as_ref().map(|f| f.joint),
            self.smooth_field.as_ref().map(|f| f.joint),
        ];
        let wrist = self.cross_coupled_wrist.iter().flat_map(|_| [3, 4]);
        one.into_iter().flatten().chain(wrist).collect()
    }
}

impl HiddenToml {
    /// Members of the catalogue that are the same under another name: to name one of them is right.
    pub fn twins(&self) -> Vec<String> {
        let third = self.third_harmonic.as_ref().map(|f| format!("harmonic:{}:3", f.joint));
        let wrist =
            self.cross_coupled_wrist.iter().flat_map(|_| ["cross_compliance:3:5", "cross_compliance:4:5"].map(String::from));
        third.into_iter().chain(wrist).collect()
    }
}

/// A key under `[truth.hidden]` that does not fit the robot.
#[derive(Debug, Clone, PartialEq)]
pub struct Misfit {
    /// Below `truth.hidden`.
    pub key: String,
    /// What is wrong with it.
    pub problem: String,
    /// What to do.
    pub remedy: String,
}

/// A hidden flaw as written.
trait Hidden {
    /// Its table under `[truth.hidden]`.
    const NAME: &'static str;

    /// The flaw of an arm in a cell.
    fn flaw(&self, cell: &Dataset) -> Result<Arc<dyn Flaw>, Misfit>;

    /// A joint by its number, from 0.
    fn joint(key: &str, number: usize, among: impl Iterator<Item = usize>) -> Result<usize, Misfit> {
        let possible: Vec<usize> = among.collect();
        if possible.contains(&number) {
            return Ok(number - 1);
        }
        let list: Vec<String> = possible.iter().map(ToString::to_string).collect();
        Err(Self::misfit(key, format!("is {number}"), format!("name a joint of: {}", list.join(", "))))
    }

    /// That the arm has so many joints.
    fn needs_joints(cell: &Dataset, joints: usize) -> Result<(), Misfit> {
        let has = cell.robot.joints();
        if has < joints {
            let key = Self::NAME.into();
            return Err(Misfit {
                key,
                problem: format!("is of arms with {joints} joints"),
                remedy: format!("this one has {has}"),
            });
        }
        Ok(())
    }

    /// That a size is larger than zero.
    fn positive(key: &str, value: f64) -> Result<f64, Misfit> {
        if value > 0.0 { Ok(value) } else { Err(Self::misfit(key, format!("is {value}"), "give a positive number".into())) }
    }

    fn misfit(key: &str, problem: String, remedy: String) -> Misfit {
        Misfit { key: format!("{}.{key}", Self::NAME), problem, remedy }
    }
}

impl HiddenToml {
    /// The flaws of an arm in a cell.
    ///
    /// # Errors
    /// When one does not fit the arm.
    pub fn flaws(&self, cell: &Dataset) -> Result<Vec<Arc<dyn Flaw>>, Misfit> {
        fn built(hidden: &Option<impl Hidden>, cell: &Dataset) -> Option<Result<Arc<dyn Flaw>, Misfit>> {
            hidden.as_ref().map(|h| h.flaw(cell))
        }
        [
            built(&self.cable_spring, cell),
            built(&self.third_harmonic, cell),
            built(&self.cross_coupled_wrist, cell),
            built(&self.gear_defect, cell),
            built(&self.smooth_field, cell),
        ]
        .into_iter()
        .flatten()
        .collect()
    }
}

/// Postures over which a root mean square is taken; it is then good to a per cent.
const POSTURES: usize = 4096;

/// What an error `shape` of the joint angles (rad) is to be multiplied by for its root mean square over the workspace to be `rms`.
fn scale_to(rms: f64, robot: &Robot, mut shape: impl FnMut(&[f64]) -> f64) -> f64 {
    // Multiples of irrational numbers (Weyl) fill the joint limits evenly; roots of primes have no relation to each other.
    const PRIMES: [f64; 12] = [2.0, 3.0, 5.0, 7.0, 11.0, 13.0, 17.0, 19.0, 23.0, 29.0, 31.0, 37.0];
    let mut q = vec![0.0; robot.joints()];
    let mut squares = 0.0;
    for k in 0..POSTURES {
        for (i, link) in robot.links.iter().enumerate() {
            // A joint without limits, should there be one, turns once.
            let [low, high] = if link.limits.iter().all(|l| l.is_finite()) { link.limits } else { [-PI, PI] };
            let share = ((k as f64 + 0.5) * (PRIMES[i % PRIMES.len()] + (i / PRIMES.len()) as f64).sqrt()).fract();
            q[i] = low + (high - low) * share;
        }
        squares += shape(&q).powi(2);
    }
    if squares > 0.0 { rms / (squares / POSTURES as f64).sqrt() } else { 0.0 }
}

/// The angle of joint `j`, counted from 0.
fn theta(j: usize) -> Site {
    Site::mdh(j, MdhEntry::Theta)
}

#[cfg(test)]
mod tests {
    use super::*;
    use calibench::effects::Situation;
    use calibench::robot::{Loads, Payload, Posture, SiteIndex};
    use calibench::units::URAD;
    use nalgebra::Vector3;

    /// Root mean square of what a flaw adds to a joint, over postures other than those that it was scaled on.
    fn rms(flaw: &dyn Flaw, cell: &Dataset, joint: usize) -> f64 {
        let robot = &cell.robot;
        let (mut posture, mut loads) = (Posture::new(robot), Loads::new(robot.joints()));
        let none = vec![0.0; SiteIndex::new(robot.joints()).len()];
        let payload = &cell.payloads[0];
        let mut squares = 0.0;
        for k in 0..2000 {
            let share = |i: usize| ((k as f64) * [0.618_034, 0.754_878, 0.819_173, 0.856_675, 0.881_271, 0.898_654][i]).fract();
            let q: Vec<f64> =
                robot.links.iter().enumerate().map(|(i, l)| l.limits[0] + (l.limits[1] - l.limits[0]) * share(i)).collect();
            posture.set(robot, &cell.base, &cell.tool, &q, &none);
            loads.weigh(robot, &posture, payload, &cell.gravity, &Vector3::zeros());
            let at = Situation::at_rest(robot, &q, &posture, &loads, payload);
            flaw.moves(&at, &mut |site, by| squares += if site == theta(joint) { by * by } else { 0.0 });
        }
        (squares / 2000.0).sqrt()
    }

    #[test]
    fn every_hidden_flaw_is_as_large_as_it_says() {
        let robot = calibench::robot::built_in("kr6_r700").expect("is built in");
        let payload = Payload { name: "heavy".into(), mass: 6.0, com: Vector3::new(0.025, 0.0, -0.07) };
        let cell = Dataset { robot: Arc::new(robot), payloads: vec![payload], ..Dataset::default() };
        let hidden = |text: &str| toml::from_str::<HiddenToml>(text).expect("keys").flaws(&cell).expect("fits").remove(0);
        for (name, joint) in
            [("cable_spring", 5), ("third_harmonic", 2), ("cross_coupled_wrist", 4), ("gear_defect", 3), ("smooth_field", 2)]
        {
            let flaw = hidden(&format!("[{name}]\nrms_urad = 60.0"));
            let rms = rms(flaw.as_ref(), &cell, joint - 1) / URAD;
            // Two thousand other postures: 2 % of chance, more for a bump that few of them meet.
            assert!((rms - 60.0).abs() < 6.0, "{name}: {rms}");
        }
    }
}
