//! Builds the machine that MuJoCo simulates from a scenario: constant effects of the truth are built in, truths that are no
//! part of a mechanism are refused.

use calibench::effects::{self, Kind, Situation};
use calibench::measure::Dataset;
use calibench::robot::{FramePose, Loads, MdhEntry, Payload, Posture, Site, SiteIndex};

use super::flaws::MujocoFlaws;
use super::mjcf::{Machine, stiffness};
use super::scenery::Scenery;
use calibench_sim::flaw::TrueEffect;
use calibench_sim::hidden::HiddenToml;
use calibench_sim::plant::{Parts, PlantError};
use calibench_sim::random::Streams;
use calibench_sim::scenario::Scenario;

/// Effects of the catalogue that are constant parameters of the cell: they are built into the machine.
const BUILT_IN: [&str; 4] = ["base_frame", "mdh", "tool_frame", "ball"];

/// The machine that a scenario describes, with the constant effects of its truth built in.
///
/// # Errors
/// When the truth contains something that is no part of a mechanism.
pub fn machine(scenario: &Scenario, streams: &Streams, parts: &Parts) -> Result<Machine, PlantError> {
    let truth = scenario.truth();
    if truth.keys().hidden != HiddenToml::default() {
        return Err(PlantError::Unsuited {
            key: "truth.hidden".into(),
            problem: "is no part of the mechanism that MuJoCo plays".into(),
            remedy: "take it out, or run the analytic plant".into(),
        });
    }
    let Parts { nominal, mut robot, mut tool, payload, gauge, .. } = parts.clone();
    let joints = robot.joints();
    let compliance = truth.flaws(streams, joints).compliance;
    let stiffnesses: Vec<f64> = compliance.iter().map(|c| stiffness(*c)).collect();
    let mut base = nominal.base.to_array();
    let mut balls = parts.balls.clone();
    for effect in truth.drawn(streams) {
        let id = effect.effect.id();
        let family = effects::family(id).map_or(id, |family| family.id);
        if ["joint_compliance", "hysteresis"].contains(&family) {
            continue; // the gears have the one, the controller's joints the other
        }
        if !BUILT_IN.contains(&family) {
            return Err(PlantError::Unsuited {
                key: format!("truth.effects.{id}"),
                problem: "is no part of the mechanism that MuJoCo plays".into(),
                remedy: format!(
                    "take it out, or run the analytic plant; MuJoCo knows: {}, joint_compliance, hysteresis",
                    BUILT_IN.join(", ")
                ),
            });
        }
        let kinds = (0..balls.len()).map(Kind::Ball);
        constant(&effect, &nominal, None, &mut |site, by| match site {
            Site::Base(axis) => base[axis as usize] += by,
            Site::Tool(k) => tool.xyz[usize::from(k)] += by,
            Site::Mdh(i, entry) => {
                let mdh = &mut robot.links[usize::from(i)].mdh;
                *match entry {
                    MdhEntry::Alpha => &mut mdh.alpha,
                    MdhEntry::A => &mut mdh.a,
                    MdhEntry::Beta => &mut mdh.beta,
                    MdhEntry::Theta => &mut mdh.theta,
                    MdhEntry::D => &mut mdh.d,
                } += by;
            }
            Site::Flex(..) | Site::Target(_) => {}
        });
        for (ball, kind) in balls.iter_mut().zip(kinds) {
            constant(&effect, &nominal, Some(kind), &mut |site, by| {
                if let Site::Target(k) = site {
                    ball.centre[usize::from(k)] += by;
                }
            });
        }
    }
    Ok(Machine {
        name: nominal.robot.name.clone(),
        gravity: nominal.gravity,
        base: FramePose::from_array(base),
        scenery: Scenery::new(&robot.solids, joints, &scenario.surroundings(), &scenario.surroundings_without_artifact()),
        flaws: MujocoFlaws::new(&truth.keys().mujoco, stiffnesses),
        robot,
        compliance,
        tool,
        payload,
        balls,
        gauge,
    })
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
