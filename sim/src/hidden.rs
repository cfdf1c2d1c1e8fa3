//! Flaws unknown to any model, to test a diagnosis when its catalogue does not contain the cause.
//!
//! Each exists only in the simulated cell, one file each. A flaw of a joint is scaled to its `rms_urad`: the root mean square
//! of the joint's error over the workspace, with all postures within the joint limits weighted equally. [`UNKNOWN`] lists
//! those that no effect of [`calibench::effects::catalogue::CATALOGUE`] resembles; the others have twins there.

mod asymmetric_tooth;
mod beat;
mod bilinear_coupling;
mod cable_spring;
mod cross_coupled_wrist;
mod gear_defect;
mod moved_ball;
mod posture_spring;
mod smooth_field;
mod third_harmonic;

use std::f64::consts::PI;
use std::sync::Arc;

use calibench::effects::EffectId;
use calibench::measure::dataset::Dataset;
use calibench::robot::Robot;
use calibench::robot::kinematics::Posture;
use calibench::robot::sites::{MdhEntry, Site, SiteIndex};
use calibench::robot::statics::{Loads, Payload};
use nalgebra::Vector3;
use serde::Deserialize;

use crate::flaw::Flaw;

pub use asymmetric_tooth::AsymmetricTooth;
pub use beat::Beat;
pub use bilinear_coupling::BilinearCoupling;
pub use cable_spring::CableSpring;
pub use cross_coupled_wrist::CrossCoupledWrist;
pub use gear_defect::GearDefect;
pub use moved_ball::MovedBall;
pub use posture_spring::PostureSpring;
pub use smooth_field::SmoothField;
pub use third_harmonic::ThirdHarmonic;

/// Flaws of a joint that no effect of the catalogue resembles. If one becomes an effect, it leaves this list and another
/// takes its place: there are to be at least five, two of them functions of two variables (`cable_spring`,
/// `bilinear_coupling`, `posture_spring` and `smooth_field` are).
pub const UNKNOWN: [&str; 7] =
    ["asymmetric_tooth", "beat", "bilinear_coupling", "cable_spring", "gear_defect", "posture_spring", "smooth_field"];

/// The keys under `[truth.hidden]`.
#[derive(Debug, Clone, PartialEq, Default, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
#[allow(missing_docs)] // described in docs/scenarios.md
pub struct HiddenToml {
    pub cable_spring: Option<CableSpring>,
    pub third_harmonic: Option<ThirdHarmonic>,
    pub cross_coupled_wrist: Option<CrossCoupledWrist>,
    pub gear_defect: Option<GearDefect>,
    pub smooth_field: Option<SmoothField>,
    pub asymmetric_tooth: Option<AsymmetricTooth>,
    pub beat: Option<Beat>,
    pub bilinear_coupling: Option<BilinearCoupling>,
    pub posture_spring: Option<PostureSpring>,
    pub moved_ball: Option<MovedBall>,
}

/// Description of a hidden flaw: its name under `[truth.hidden]`, its size, and the joints that err (from 1).
#[derive(Debug, Clone, PartialEq)]
pub struct HiddenFlaw {
    /// Name of its table.
    pub name: &'static str,
    /// Its size with unit.
    pub size: String,
    /// Joints, counted from 1; empty if it is not a flaw of a joint.
    pub joints: Vec<usize>,
}

impl HiddenToml {
    /// Descriptions of the flaws given.
    pub fn listed(&self) -> Vec<HiddenFlaw> {
        let of = |name, rms_urad: f64, joints: &[usize]| HiddenFlaw {
            name,
            size: format!("{rms_urad} µrad rms"),
            joints: joints.to_vec(),
        };
        let all = [
            self.asymmetric_tooth.as_ref().map(|f| of("asymmetric_tooth", f.rms_urad, &[f.joint])),
            self.beat.as_ref().map(|f| of("beat", f.rms_urad, &[f.joint])),
            self.bilinear_coupling.as_ref().map(|f| of("bilinear_coupling", f.rms_urad, &[f.joint])),
            self.cable_spring.as_ref().map(|f| of("cable_spring", f.rms_urad, &[f.joint])),
            self.cross_coupled_wrist.as_ref().map(|f| of("cross_coupled_wrist", f.rms_urad, &[3, 4])),
            self.gear_defect.as_ref().map(|f| of("gear_defect", f.rms_urad, &[f.joint])),
            self.moved_ball.as_ref().map(MovedBall::listed),
            self.posture_spring.as_ref().map(|f| of("posture_spring", f.rms_urad, &[f.joint])),
            self.smooth_field.as_ref().map(|f| of("smooth_field", f.rms_urad, &[f.joint])),
            self.third_harmonic.as_ref().map(|f| of("third_harmonic", f.rms_urad, &[f.joint])),
        ];
        all.into_iter().flatten().collect()
    }

    /// The joints that err, from 1.
    pub fn joints(&self) -> Vec<usize> {
        self.listed().into_iter().flat_map(|flaw| flaw.joints).collect()
    }

    /// Members of the catalogue that are the same under another name: naming one of them is correct.
    pub fn twins(&self) -> Vec<String> {
        let third = self.third_harmonic.as_ref().map(|f| format!("{}:{}:3", EffectId::HARMONIC, f.joint));
        let wrist = self
            .cross_coupled_wrist
            .iter()
            .flat_map(|_| ["3:5", "4:5"].map(|joints| EffectId::member(EffectId::CROSS_COMPLIANCE, joints).into()));
        let ball = self.moved_ball.as_ref().map(|f| format!("{}:{}", EffectId::BALL_STEP, f.ball));
        third.into_iter().chain(wrist).chain(ball).collect()
    }
}

/// A key under `[truth.hidden]` that does not fit the robot.
#[derive(Debug, Clone, PartialEq)]
pub struct Misfit {
    /// Key below `truth.hidden`.
    pub key: String,
    /// The problem.
    pub problem: String,
    /// The remedy.
    pub remedy: String,
}

/// A hidden flaw as specified in a scenario.
trait Hidden {
    /// Its table under `[truth.hidden]`.
    const NAME: &'static str;

    /// Builds the flaw for the arm of a cell.
    fn flaw(&self, cell: &Dataset) -> Result<Arc<dyn Flaw>, Misfit>;

    /// Index (from 0) of a joint given by its number (from 1), which must be `among` these numbers.
    fn joint(key: &str, number: usize, among: impl Iterator<Item = usize>) -> Result<usize, Misfit> {
        let possible: Vec<usize> = among.collect();
        if possible.contains(&number) {
            return Ok(number - 1);
        }
        let list: Vec<String> = possible.iter().map(ToString::to_string).collect();
        Err(Self::misfit(key, format!("is {number}"), format!("name a joint of: {}", list.join(", "))))
    }

    /// Checks that the arm has at least this many joints.
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

    /// Checks that a size is positive.
    fn positive(key: &str, value: f64) -> Result<f64, Misfit> {
        if value > 0.0 { Ok(value) } else { Err(Self::misfit(key, format!("is {value}"), "give a positive number".into())) }
    }

    fn misfit(key: &str, problem: String, remedy: String) -> Misfit {
        Misfit { key: format!("{}.{key}", Self::NAME), problem, remedy }
    }
}

impl HiddenToml {
    /// Builds the flaws for the arm of a cell.
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
            built(&self.asymmetric_tooth, cell),
            built(&self.beat, cell),
            built(&self.bilinear_coupling, cell),
            built(&self.posture_spring, cell),
            built(&self.moved_ball, cell),
        ]
        .into_iter()
        .flatten()
        .collect()
    }
}

/// Number of postures for a root mean square, which is then accurate to a per cent.
const POSTURES: usize = 4096;

/// Limits of a joint, rad; a joint without limits, if there is one, gets one turn.
fn limits(robot: &Robot, joint: usize) -> [f64; 2] {
    let limits = robot.links[joint].limits;
    if limits.iter().all(|l| l.is_finite()) { limits } else { [-PI, PI] }
}

/// Middle of a joint's limits, rad.
fn middle(robot: &Robot, joint: usize) -> f64 {
    let [low, high] = limits(robot, joint);
    0.5 * (low + high)
}

/// Gravity torque at a joint (from 0) in a posture (rad), N·m, of the nominal arm with its first payload.
fn torques_at(cell: &Dataset) -> impl FnMut(&[f64], usize) -> f64 + use<'_> {
    let none = vec![0.0; SiteIndex::new(cell.robot.joints()).len()];
    let (mut posture, mut loads) = (Posture::new(&cell.robot), Loads::new(cell.robot.joints()));
    let payload = cell.payloads.first().cloned().unwrap_or_else(Payload::none);
    move |q, joint| {
        posture.set(&cell.robot, &cell.base, &cell.tool, q, &none);
        loads.compute(&cell.robot, &posture, &payload, &cell.gravity, &Vector3::zeros());
        loads.tau[joint]
    }
}

/// The factor by which an error `shape` of the joint angles (rad) must be multiplied to have the root mean square `rms`
/// over the workspace.
fn scale_to(rms: f64, robot: &Robot, mut shape: impl FnMut(&[f64]) -> f64) -> f64 {
    // Multiples of irrational numbers (Weyl) fill the joint limits evenly; square roots of primes are mutually independent.
    /// Primes whose square roots are the steps of the Weyl sequences, one a joint, dimensionless.
    const PRIMES: [f64; 12] = [2.0, 3.0, 5.0, 7.0, 11.0, 13.0, 17.0, 19.0, 23.0, 29.0, 31.0, 37.0];
    let mut q = vec![0.0; robot.joints()];
    let mut squares = 0.0;
    for k in 0..POSTURES {
        for i in 0..q.len() {
            let [low, high] = limits(robot, i);
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
    use calibench::effects::situation::Situation;
    use calibench::units::URAD;

    /// Root mean square of a flaw's contribution to a joint, over postures other than those used to scale it.
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
            loads.compute(robot, &posture, payload, &cell.gravity, &Vector3::zeros());
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
        let listed = |text: &str| toml::from_str::<HiddenToml>(text).expect("keys").listed().remove(0);
        let hidden = |text: &str| toml::from_str::<HiddenToml>(text).expect("keys").flaws(&cell).expect("fits").remove(0);
        let unknown = UNKNOWN.map(|name| (name, listed(&format!("[{name}]\nrms_urad = 60.0")).joints[0]));
        for (name, joint) in unknown.into_iter().chain([("third_harmonic", 2), ("cross_coupled_wrist", 4)]) {
            let flaw = hidden(&format!("[{name}]\nrms_urad = 60.0"));
            let rms = rms(flaw.as_ref(), &cell, joint - 1) / URAD;
            // Two thousand other postures: 2 % by chance, more for a bump that few of them meet.
            assert!((rms - 60.0).abs() < 6.0, "{name}: {rms}");
        }
    }
}
