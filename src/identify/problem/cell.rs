//! The data common to the samples of one dataset: the cell in which they were taken, and the effects acting on it.

use nalgebra::{Rotation3, Vector3};

use crate::effects::Effect;
use crate::effects::catalogue::set_aside_by;
use crate::effects::situation::ArtifactShape;
use crate::identify::Model;
use crate::measure::dataset::{Dataset, Noise, Sample};
use crate::robot::FramePose;
use crate::robot::kinematics::PostureView;
use crate::robot::sites::Site;
use crate::robot::statics::{Loads, Payload};

/// A joint with a smaller gravity load than this, N·m, is treated as unloaded.
const UNLOADED: f64 = 1e-6;

/// An effect with the parameters assigned to it.
pub(super) struct Placed {
    pub effect: Box<dyn Effect>,
    /// First parameter by set-up; one entry if the owner is the robot or the artifact.
    pub first: Vec<usize>,
}

/// The data common to the samples of one dataset.
pub(super) struct Cell {
    pub effects: Vec<Placed>,
    pub tool: FramePose,
    /// Rotates the tool's axes into those of the last frame.
    pub tool_turn: Rotation3<f64>,
    /// Force of the plungers on the tool when a ball is centred, axes of the last frame, N.
    pub contact_force: Vector3<f64>,
    pub payloads: Vec<Payload>,
    pub balls: Vec<Vector3<f64>>,
    /// Name of each further measured point of the tool, and its nominal place relative to the TCP, tool axes, m.
    pub tool_targets: Vec<(String, Vector3<f64>)>,
    pub artifact: ArtifactShape,
    pub anchors: Vec<Vector3<f64>>,
    pub noise: Noise,
    /// Names of the samples that the model excludes.
    pub aside: Vec<String>,
    pub measured_torques: bool,
    /// False if orientations are left out.
    pub takes_orientations: bool,
}

/// True if the orientations of a dataset count under a model; without them, positions that the tool saw are known badly.
pub(crate) fn takes_orientations(dataset: &Dataset, model: &Model) -> bool {
    !model.only_weighed_orientations || dataset.noise.seen_from_tool || dataset.weighs_orientations()
}

impl Cell {
    /// The cell of a dataset whose balls are initially assumed at `balls`.
    pub fn of(dataset: &Dataset, balls: Vec<Vector3<f64>>, effects: Vec<Placed>, model: &Model) -> Self {
        let tool_turn = FramePose { xyz: [0.0; 3], ..dataset.tool }.pose().rotation;
        // A sample may name a payload that does not exist; it then carries nothing.
        let aside = effects.iter().filter_map(|p| set_aside_by(p.effect.id())).map(str::to_owned).collect();
        let payloads = dataset.payloads.iter().cloned().chain([Payload::none()]).collect();
        Cell {
            artifact: ArtifactShape::of(&balls),
            aside,
            effects,
            tool: dataset.tool,
            tool_turn,
            contact_force: tool_turn * dataset.contact_force,
            payloads,
            balls,
            tool_targets: dataset.tool_targets.iter().map(|r| (r.id.clone(), r.position)).collect(),
            anchors: dataset.anchors.iter().map(|a| a.position).collect(),
            noise: dataset.noise.clone(),
            measured_torques: model.measured_torques,
            takes_orientations: takes_orientations(dataset, model),
        }
    }

    /// True if the model excludes a sample.
    pub fn is_aside(&self, sample: &Sample) -> bool {
        self.aside.contains(&sample.id)
    }

    /// The user's expression by which an effect moves a site, in words; empty for built-in effects.
    pub fn expression(&self, effect: &str, site: Site) -> String {
        let own = self.effects.iter().find(|p| p.effect.id() == effect).map(|p| &p.effect);
        let text = own.and_then(|e| (0..e.parameters().len()).find_map(|p| e.expression(p, site)));
        text.map(|text| format!(": `{text}` at {site}")).unwrap_or_default()
    }
}

/// Adds a force on the TCP (world, N) to the loads of gravity, except on joints that gravity leaves unloaded: the springs'
/// force is known from a data sheet only, and a compliance determined by nothing else would be a calibration of the
/// springs.
pub(super) fn push(loads: &mut Loads, posture: &dyn PostureView, force: &Vector3<f64>) {
    let tcp = posture.tcp();
    for i in 0..loads.tau.len() {
        let (axis, origin) = posture.joint_axis(i);
        let moment = (tcp - origin).cross(force);
        loads.moment[i + 1] += moment;
        if loads.tau[i].abs() > UNLOADED {
            loads.tau[i] += axis.dot(&moment);
        }
        loads.force[i + 1] += force;
    }
    loads.moment[0] += (tcp - posture.frame(0).o).cross(force);
    loads.force[0] += force;
}
