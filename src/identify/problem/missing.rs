//! The requirements of an effect that samples and model do not meet.

use super::Use;
use crate::effects::{Effect, EffectId, Needs};
use crate::identify::Model;
use crate::measure::dataset::{Dataset, Measured, Sample};

/// The first requirement of an effect not met by the samples that `which` selects, or by the model, in the words of the
/// files; `None` if nothing is missing.
///
/// Rows used only for judging ([`Use::Validation`], [`Use::All`]) may lack data whose effect can be of either sign
/// (approach, plungers, readings, commanded joints, kinds of samples): the effect is then taken as zero, its mean.
pub fn missing(effect: &dyn Effect, dataset: &Dataset, model: &Model, which: Use) -> Option<&'static str> {
    let samples = || dataset.samples.iter().filter(|s| which.takes(s));
    let on_balls = || samples().filter(|s| matches!(s.measured, Measured::Ball { .. }));
    let lacks = |has: fn(&Sample) -> bool| samples().any(|s| !has(s));
    let masses = || (!dataset.robot.has_masses()).then_some("link masses in the robot's description");
    let balls = || on_balls().next().is_none().then_some("samples of kind 'ball'");
    let has_sides = |need: &Needs| {
        use Needs::{Approach, Balls, Commanded, Orientations, Plungers, Points, Readings};
        matches!(need, Approach | Plungers | Readings | Commanded | Balls | Points | Orientations)
    };
    effect.needs().iter().filter(|need| which == Use::Fit || !has_sides(need)).find_map(|need| match need {
        Needs::Torques if model.measured_torques => lacks(|s| s.tau.is_some()).then_some("columns tau1_nm ... tauN_nm"),
        Needs::Torques | Needs::Masses => masses(),
        Needs::Compliance if model.measured_torques => {
            Some("torques from link masses: to measured ones a wrong load makes no difference")
        }
        // How far a wrong load bends the arm follows from compliances in rad/(N m): those fitted to guessed masses are in other ones.
        Needs::Compliance if dataset.robot.masses_guessed => {
            Some("listed link masses: those in the robot's description are guessed")
        }
        Needs::Compliance => {
            let sought = model.effects.iter().any(|e| e.family() == EffectId::JOINT_COMPLIANCE);
            masses().or((!sought).then_some("joint_compliance in the model"))
        }
        Needs::Approach => lacks(|s| s.approach.is_some()).then_some("columns approach1 ... approachN"),
        Needs::Plungers => {
            balls().or(on_balls().any(|s| s.plungers.is_none()).then_some("columns plunger1, plunger2, plunger3"))
        }
        Needs::Readings => {
            let unread = |s: &Sample| matches!(s.measured, Measured::Ball { reading: None, .. });
            balls().or(on_balls().any(unread).then_some("columns r1_um, r2_um, r3_um"))
        }
        Needs::Commanded => lacks(|s| s.q_commanded.is_some()).then_some("columns qcmd1_deg ... qcmdN_deg"),
        Needs::Time => lacks(|s| s.time_s.is_some()).then_some("column time_s"),
        Needs::Temperature => lacks(|s| s.temp_c.is_some()).then_some("column temp_c"),
        Needs::Balls => balls(),
        Needs::Orientations => samples().all(|s| s.orientation.is_none()).then_some("samples of kind 'pose'"),
        Needs::Points => samples().all(|s| !matches!(s.measured, Measured::Point(_))).then_some("samples of kind 'point'"),
    })
}
