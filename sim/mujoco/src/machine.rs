//! Builds the machine that MuJoCo simulates from a scenario: constant effects of the truth are built in; truths that
//! are not part of a mechanism are refused.

use calibench::effects::EffectId;
use calibench::effects::situation::{Kind, Situation};
use calibench::measure::dataset::Dataset;
use calibench::robot::FramePose;
use calibench::robot::kinematics::Posture;
use calibench::robot::sites::{MdhEntry, Site, SiteIndex};
use calibench::robot::statics::{Loads, Payload};

use super::flaws::MujocoFlaws;
use super::mjcf::{Machine, stiffness};
use super::scenery::Scenery;
use calibench_sim::flaw::TrueEffect;
use calibench_sim::hidden::HiddenToml;
use calibench_sim::mechanics::{Parts, PlantError};
use calibench_sim::random::Streams;
use calibench_sim::scenario::Scenario;

/// Effects that the gears and the joints of the controller have.
const BY_JOINTS: [&str; 2] = [EffectId::JOINT_COMPLIANCE, EffectId::HYSTERESIS];

/// Effects of the catalogue that are constant parameters of the cell: they are built into the machine.
const BUILT_IN: [&str; 4] = [EffectId::BASE_FRAME, EffectId::MDH, EffectId::TOOL_FRAME, EffectId::BALL];

/// The machine that a scenario describes, with the constant effects of its truth built in.
///
/// # Errors
/// When the truth contains something that is not part of a mechanism.
pub fn machine(scenario: &Scenario, streams: &Streams, parts: &Parts) -> Result<Machine, PlantError> {
    let truth = scenario.truth();
    if truth.keys().hidden != HiddenToml::default() {
        return Err(unsuited("truth.hidden".into(), "remove it, or run the analytic plant".into()));
    }
    let effects = built_in(truth.drawn(streams))?;
    let Parts { nominal, robot, tool, payload, balls, gauge } = parts.clone();
    let joints = robot.joints();
    let compliance = truth.flaws(streams, joints).compliance;
    let stiffnesses: Vec<f64> = compliance.iter().map(|c| stiffness(*c)).collect();
    let mut machine = Machine {
        name: nominal.robot.name.clone(),
        gravity: nominal.gravity,
        base: nominal.base,
        scenery: Scenery::new(&robot.solids, joints, &scenario.surroundings(), &scenario.surroundings_without_artifact()),
        flaws: MujocoFlaws::new(&truth.keys().mujoco, stiffnesses),
        robot,
        compliance,
        tool,
        payload,
        balls,
        gauge,
    };
    effects.iter().for_each(|effect| build_in(&mut machine, effect, &nominal));
    Ok(machine)
}

/// Error for a truth that only the analytic plant can simulate.
fn unsuited(key: String, remedy: String) -> PlantError {
    PlantError::Unsuited { key, problem: "is not part of the mechanism that MuJoCo simulates".into(), remedy }
}

/// The effects that are built into the machine; the gears have the compliance, the controller's joints the hysteresis.
fn built_in(drawn: Vec<TrueEffect>) -> Result<Vec<TrueEffect>, PlantError> {
    let mut effects = Vec::new();
    for effect in drawn {
        let id = EffectId::new(effect.effect.id());
        if BUILT_IN.contains(&id.family()) {
            effects.push(effect);
        } else if !BY_JOINTS.contains(&id.family()) {
            let known = [&BUILT_IN[..], &BY_JOINTS].concat().join(", ");
            let remedy = format!("remove it, or run the analytic plant; MuJoCo knows: {known}");
            return Err(unsuited(format!("truth.effects.{id}"), remedy));
        }
    }
    Ok(effects)
}

/// Moves base, tool, links and balls by a constant effect.
fn build_in(machine: &mut Machine, effect: &TrueEffect, nominal: &Dataset) {
    constant(effect, nominal, None, &mut |site, by| match site {
        Site::Base(axis) => {
            let mut base = machine.base.to_array();
            base[axis as usize] += by;
            machine.base = FramePose::from_array(base);
        }
        Site::Tool(k) => machine.tool.xyz[usize::from(k)] += by,
        Site::Mdh(i, entry) => {
            let mdh = &mut machine.robot.links[usize::from(i)].mdh;
            *match entry {
                MdhEntry::Alpha => &mut mdh.alpha,
                MdhEntry::A => &mut mdh.a,
                MdhEntry::Beta => &mut mdh.beta,
                MdhEntry::Theta => &mut mdh.theta,
                MdhEntry::D => &mut mdh.d,
            } += by;
        }
        Site::Flex(..) | Site::Target(_) | Site::Probe(_) => {}
    });
    for (k, ball) in machine.balls.iter_mut().enumerate() {
        constant(effect, nominal, Some(Kind::Ball(k)), &mut |site, by| {
            if let Site::Target(k) = site {
                ball.centre[usize::from(k)] += by;
            }
        });
    }
}

/// Calls `moved` with the contributions of an effect that do not depend on the situation.
fn constant(effect: &TrueEffect, nominal: &Dataset, kind: Option<Kind>, moved: &mut dyn FnMut(Site, f64)) {
    let robot = &nominal.robot;
    let joints = robot.joints();
    let (mut posture, loads, q) = (Posture::new(robot), Loads::new(joints), vec![0.0; joints]);
    posture.set(robot, &nominal.base, &nominal.tool, &q, &vec![0.0; SiteIndex::new(joints).len()]);
    let payload = Payload::none();
    let situation = Situation { kind, ..Situation::at_rest(robot, &q, &posture, &loads, &payload) };
    effect.effect.terms(&situation, &mut |k, site, weight| moved(site, weight * effect.sizes[k]));
}
