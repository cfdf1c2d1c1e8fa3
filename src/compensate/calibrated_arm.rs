//! The identified arm: pose of its tool at given joints, with every effect of the calibration, at rest under its load.

use nalgebra::{Matrix3xX, Matrix6xX, Vector3};

use super::conditions::Conditions;
use crate::effects::situation::Situation;
use crate::effects::{Effect, EffectId, Needs, Owner, build};
use crate::identify::calibration::Calibration;
use crate::robot::inverse::Kinematics;
use crate::robot::kinematics::Posture;
use crate::robot::rel_tool::screw;
use crate::robot::sites::{Site, SiteIndex};
use crate::robot::statics::{Loads, Payload};
use crate::robot::{FramePose, Pose, Robot};

use super::task::{Setup, TaskError};

/// The arm is at rest if no deviation changes by more than this between two load updates, m and rad.
const AT_REST: f64 = 1e-12;

/// Largest number of load updates; each reduces the change to a thousandth, so four suffice from an unloaded start.
const MOST_WEIGHINGS: usize = 20;

/// An effect with its identified parameters.
struct Identified {
    effect: Box<dyn Effect>,
    /// Index of its first parameter in [`CalibratedArm::values`].
    first: usize,
}

/// The weight with which one parameter moves a site.
struct Moves {
    number: usize,
    site: Site,
    place: usize,
    weight: f64,
}

/// The identified arm in a set-up, with a tool and a payload, under given conditions.
pub struct CalibratedArm<'a> {
    robot: &'a Robot,
    base: FramePose,
    tool: FramePose,
    gravity: Vector3<f64>,
    duration_s: Option<f64>,
    /// The payload on the flange.
    pub payload: Payload,
    /// The conditions at the target.
    pub conditions: Conditions,
    effects: Vec<Identified>,
    /// Every parameter of every effect, as deviation from nominal, SI.
    values: Vec<f64>,
    /// Index of the estimate of each parameter; `None` if the calibration has none, or if its error is irrelevant here.
    estimates: Vec<Option<usize>>,
    compliance: Vec<f64>,
    posture: Posture,
    loads: Loads,
    deviations: Vec<f64>,
    next: Vec<f64>,
    moves: Vec<Moves>,
    /// Index of an effect that had no value.
    undefined: Option<usize>,
}

impl<'a> CalibratedArm<'a> {
    /// The arm of a calibration in one of its set-ups.
    ///
    /// # Errors
    /// When an effect cannot be built, or needs torques that will not be measured.
    pub(super) fn new(calibration: &'a Calibration, setup: &Setup<'_>) -> Result<Self, TaskError> {
        let robot: &Robot = &calibration.robot;
        let n = robot.joints();
        let mut arm = CalibratedArm {
            robot,
            base: setup.measured.base,
            tool: setup.tool,
            gravity: setup.measured.gravity,
            duration_s: setup.measured.duration_s,
            payload: setup.payload.clone(),
            conditions: Conditions::default(),
            effects: Vec::new(),
            values: Vec::new(),
            estimates: Vec::new(),
            compliance: vec![0.0; n],
            posture: Posture::new(robot),
            loads: Loads::new(n),
            deviations: vec![0.0; SiteIndex::new(n).len()],
            next: vec![0.0; SiteIndex::new(n).len()],
            moves: Vec::new(),
            undefined: None,
        };
        let balls = balls(calibration);
        let subject = calibration.model.subject(robot, &balls);
        let mut ids: Vec<&EffectId> = Vec::new();
        for estimate in &calibration.estimates {
            if !ids.contains(&&estimate.effect) {
                ids.push(&estimate.effect);
            }
        }
        for id in ids {
            let effect = build(id, &subject)?;
            // There are no balls here, and errors of another tool do not apply to this one.
            let elsewhere = effect.owner() == Owner::Artifact || (setup.own_tool && TOOL.contains(&id.family()));
            if elsewhere {
                continue;
            }
            if effect.needs().contains(&Needs::Torques) && !robot.has_masses() {
                return Err(TaskError::NoMasses { effect: id.to_string() });
            }
            let first = arm.values.len();
            for spec in effect.parameters() {
                let name = match effect.owner() {
                    Owner::Session => calibration.name_in(setup.measured, &spec.name),
                    _ => spec.name.clone(),
                };
                let place = calibration.estimates.iter().position(|e| e.name == name);
                let start = |e: usize| match base_axis(&spec.name).filter(|_| id == EffectId::BASE_FRAME) {
                    Some(axis) => setup.measured.base.to_array()[axis],
                    None => calibration.estimates[e].nominal,
                };
                arm.values.push(place.map_or(0.0, |e| calibration.estimates[e].value - start(e)));
                // The pose of the base in the world is irrelevant to targets given relative to the base.
                arm.estimates.push(place.filter(|_| setup.in_world || id != EffectId::BASE_FRAME));
            }
            if id.family() == EffectId::JOINT_COMPLIANCE {
                for (k, spec) in effect.parameters().iter().enumerate() {
                    let joint = (0..n).find(|j| spec.name == format!("c{}", j + 1));
                    joint.into_iter().for_each(|j| arm.compliance[j] += arm.values[first + k]);
                }
            }
            arm.effects.push(Identified { effect, first });
        }
        Ok(arm)
    }

    /// The nominal robot.
    pub fn robot(&self) -> &'a Robot {
        self.robot
    }

    /// `world_from_root`: the base as found by the calibration. Later motions of the base (drift, steps, tilting) count as
    /// errors of the arm, not as its pose.
    pub fn world_from_root(&self) -> Pose {
        let mut base = self.base.to_array();
        if let Some(found) = self.effects.iter().find(|i| i.effect.id() == EffectId::BASE_FRAME) {
            for (k, spec) in found.effect.parameters().iter().enumerate() {
                base_axis(&spec.name).into_iter().for_each(|axis| base[axis] += self.values[found.first + k]);
            }
        }
        FramePose::from_array(base).pose()
    }

    /// TCP frame in the last frame, as certified or as given.
    pub fn tool(&self) -> &FramePose {
        &self.tool
    }

    /// The arm as it last came to rest.
    pub fn posture(&self) -> &Posture {
        &self.posture
    }

    /// The effect without a value at the last posture, if any.
    pub fn undefined(&self) -> Option<&str> {
        self.undefined.map(|k| self.effects[k].effect.id())
    }

    /// Effects with their requirements: the quantities to be assumed if a target does not state them.
    pub fn needs(&self) -> impl Iterator<Item = (&str, &[Needs])> {
        self.effects.iter().map(|i| (i.effect.id(), i.effect.needs()))
    }

    /// Deviations of all sites due to only those effects that `takes` accepts, with the arm as it last came to rest.
    pub(super) fn deviations_of(&self, takes: impl Fn(&str) -> bool) -> Vec<f64> {
        let mut deviations = vec![0.0; self.deviations.len()];
        for (k, identified) in self.effects.iter().enumerate() {
            let end = self.effects.get(k + 1).map_or(self.values.len(), |next| next.first);
            let own = |moves: &&Moves| (identified.first..end).contains(&moves.number);
            if takes(identified.effect.id()) {
                self.moves.iter().filter(own).for_each(|m| deviations[m.place] += m.weight * self.values[m.number]);
            }
        }
        deviations
    }

    /// Brings the arm to rest at joints `q` (rad, N) under its load.
    pub fn settle(&mut self, q: &[f64]) {
        for _ in 0..MOST_WEIGHINGS {
            if self.compute(q) < AT_REST {
                return;
            }
        }
        self.posture.set(self.robot, &self.base, &self.tool, q, &self.deviations);
    }

    /// Updates the loads of the arm as posed, and its deviations accordingly; returns the change of the deviations.
    fn compute(&mut self, q: &[f64]) -> f64 {
        let CalibratedArm { robot, base, tool, gravity, payload, conditions, effects, values, .. } = self;
        let CalibratedArm { compliance, posture, loads, deviations, next, moves, undefined, .. } = self;
        posture.set(robot, base, tool, q, deviations);
        loads.compute(robot, posture, payload, gravity, &Vector3::zeros());
        let situation = Situation {
            gravity: *gravity,
            tool: *tool,
            compliance,
            approach: conditions.approach.as_deref(),
            time_s: conditions.time_s.or(self.duration_s),
            duration_s: self.duration_s,
            temp_c: conditions.temp_c,
            ..Situation::at_rest(robot, q, posture, loads, payload)
        };
        let sites = SiteIndex::new(robot.joints());
        moves.clear();
        next.fill(0.0);
        *undefined = None;
        for (k, Identified { effect, first }) in effects.iter().enumerate() {
            effect.terms(&situation, &mut |parameter, site, weight| {
                if weight.is_finite() {
                    let (number, place) = (first + parameter, sites.of(site));
                    next[place] += weight * values[number];
                    moves.push(Moves { number, site, place, weight });
                } else {
                    *undefined = Some(k);
                }
            });
        }
        std::mem::swap(deviations, next);
        deviations.iter().zip(next.iter()).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
    }

    /// Derivatives of the TCP with respect to every estimate of the calibration (3 x estimates, m per SI unit), with the
    /// arm as it last came to rest.
    pub(super) fn columns(&self, columns: &mut Matrix3xX<f64>) {
        columns.fill(0.0);
        for moves in &self.moves {
            if let Some(estimate) = self.estimates[moves.number]
                && !matches!(moves.site, Site::Target(_))
            {
                let mut column = columns.column_mut(estimate);
                column += self.posture.column(moves.site) * moves.weight;
            }
        }
    }
}

impl Kinematics for CalibratedArm<'_> {
    fn joints(&self) -> usize {
        self.robot.joints()
    }

    fn evaluate(&mut self, q: &[f64], jacobian: &mut Matrix6xX<f64>) -> Pose {
        self.settle(q);
        for i in 0..q.len() {
            jacobian.set_column(i, &screw(&self.posture, i));
        }
        self.posture.world_from_tool(&self.tool)
    }
}

/// Effects of the calibrated tool.
const TOOL: [&str; 2] = [EffectId::TOOL_FRAME, EffectId::TOOL_STEP];

/// Index among x, y, z, rz, ry, rx of a base parameter, by its name.
fn base_axis(name: &str) -> Option<usize> {
    crate::robot::sites::Axis6::ALL.iter().position(|axis| name == format!("base_{}", axis.name()))
}

/// Names of the balls to which effects refer: they must be known to build those effects.
fn balls(calibration: &Calibration) -> Vec<String> {
    let mut balls: Vec<String> = Vec::new();
    let effects = calibration.estimates.iter().filter_map(|e| e.effect.ball_of());
    let sites = calibration.model.own.iter().flat_map(|own| &own.terms);
    let of_sites = sites.filter_map(|term| term.site.strip_prefix("ball:")?.rsplit_once(':').map(|(ball, _)| ball));
    for ball in effects.chain(of_sites) {
        if !balls.iter().any(|known| known == ball) {
            balls.push(ball.to_owned());
        }
    }
    balls
}
