//! Residuals of every sample at the fitted model: the residual itself, the equivalent angle error of each joint, and the
//! circumstances of the sample.

use std::sync::Arc;

use nalgebra::Vector3;
use serde_json::{Value, json};

use super::space::{ArmPose, space};
use super::{short, shorts};
use calibench::diagnosis::heat_map::Variable;
use calibench::identify::Model;
use calibench::identify::calibration::IdentifyError;
use calibench::identify::fit::fit;
use calibench::identify::problem::{Problem, Use};
use calibench::measure::dataset::{NamedDataset, Sample};
use calibench::residuals::comparison::Comparison;
use calibench::residuals::views::{JointVariable, SeenSample, ViewTest};
use calibench::robot::JointKind;
use calibench::units::{MM, UM, URAD};

/// Shortest usable lever, as a share of the joint's longest in these data: with a shorter one, TCP noise would look like a
/// large angle.
const SHORTEST_LEVER: f64 = 0.2;

/// Lever at or below which the joint's axis is taken to pass through the TCP, m/rad.
const LEAST_LEVER: f64 = 5.0 * MM;

/// Number of points drawn before they merge; of more samples, every n-th is drawn. Means are over all samples.
pub(super) const MOST_POINTS: usize = 1000;

/// One sample.
pub(super) struct Point {
    pub id: String,
    pub setup: usize,
    /// The ball probed.
    pub ball: Option<String>,
    pub time_s: Option<f64>,
    pub q: Vec<f64>,
    pub tau: Vec<f64>,
    /// Measured minus predicted, world axes, m.
    pub residual: Vector3<f64>,
    /// Derivative of the TCP position with respect to each joint angle, m/rad.
    pub levers: Vec<Vector3<f64>>,
    /// Shortest lever of each joint from which its angle is computed, m/rad.
    pub shortest: Arc<[f64]>,
    /// Every variable against which a joint is drawn, SI.
    pub variables: Vec<(JointVariable, Option<f64>)>,
}

impl Point {
    /// The joint angle error equivalent to a displacement of the TCP, `j . d / |j|²`, rad.
    pub fn as_angle(&self, joint: usize, displacement: &Vector3<f64>) -> Option<f64> {
        let lever = self.levers.get(joint)?;
        (lever.norm() > self.shortest[joint]).then(|| lever.dot(displacement) / lever.norm_squared())
    }

    /// Value of a variable of the heat map, SI.
    pub fn value(&self, variable: Variable) -> Option<f64> {
        match variable {
            Variable::Angle(j) | Variable::Slide(j) => self.q.get(j).copied(),
            Variable::Forearm => Some(self.q.get(1)? + self.q.get(2)?),
            Variable::Torque(j) => self.tau.get(j).copied(),
            Variable::Time => self.time_s,
        }
    }
}

/// The samples of a fit.
pub(super) struct Residuals {
    pub joints: usize,
    pub points: Vec<Point>,
    /// Indices of the samples that are drawn, ascending.
    pub shown: Vec<usize>,
    /// The arm at every sample.
    pub stances: Vec<ArmPose>,
}

impl Residuals {
    /// Fits `model` to the rows of set `fit` and collects their residuals; samples for which `spoken_of` is true are always
    /// drawn.
    pub fn new(datasets: &[NamedDataset<'_>], model: &Model, spoken_of: impl Fn(&str) -> bool) -> Result<Self, IdentifyError> {
        let problem = Problem::new(datasets, model, Use::Fit)?;
        let fitted = fit(&problem)?;
        let rows: Vec<&Sample> = datasets.iter().flat_map(|d| d.dataset.samples.iter().filter(|s| Use::Fit.takes(s))).collect();
        let joints = problem.robot().joints();
        let seen = SeenSample::all(&problem, &fitted.values, &rows, datasets);
        let longest = |j: usize| seen.iter().map(|s| s.joint_columns[j].norm()).fold(0.0, f64::max);
        let shortest: Arc<[f64]> = (0..joints)
            .map(|j| match problem.robot().kind(j) {
                JointKind::Revolute => (SHORTEST_LEVER * longest(j)).max(LEAST_LEVER),
                // It has no error of an angle.
                JointKind::Prismatic => f64::INFINITY,
            })
            .collect();
        let point = |s: &SeenSample<'_>| Point {
            id: s.sample.id.clone(),
            setup: s.setup,
            ball: s.ball().map(|b| datasets[s.dataset].dataset.balls[b].id.clone()),
            time_s: s.sample.time_s,
            q: s.sample.q.clone(),
            tau: s.tau.clone(),
            residual: s.residual,
            levers: s.joint_columns.clone(),
            shortest: shortest.clone(),
            variables: (1..=joints).flat_map(JointVariable::of_joint).map(|v| (v, v.of(s))).collect(),
        };
        let points: Vec<Point> = seen.iter().map(point).collect();
        let stride = points.len().div_ceil(MOST_POINTS).max(1);
        let shown = (0..points.len()).filter(|&i| i % stride == 0 || spoken_of(&points[i].id)).collect();
        Ok(Residuals { joints, points, shown, stances: ArmPose::all(&problem, &fitted.values) })
    }

    /// Apparent angle error of every joint in every drawn sample, urad: one list per joint.
    pub fn as_angles(&self, displacement: impl Fn(usize) -> Vector3<f64>) -> Value {
        let of_joint = |j: usize| -> Value {
            let of_point = |&i: &usize| self.points[i].as_angle(j, &displacement(i)).map_or(Value::Null, |a| short(a / URAD));
            self.shown.iter().map(of_point).collect()
        };
        (0..self.joints).map(of_joint).collect()
    }

    /// The samples, the apparent error of each joint, and the comparison's views in which they are drawn.
    pub fn json(&self, comparison: &Comparison) -> Value {
        let samples: Vec<Value> = self
            .shown
            .iter()
            .map(|&i| {
                let (p, r) = (&self.points[i], &comparison.residuals[i]);
                json!({"id": p.id, "number": i + 1, "dataset": comparison.setups[p.setup].dataset, "ball": self.ball_view(p, comparison), "time_s": p.time_s,
                    "residual_um": shorts((0..3).map(|k| p.residual[k] / UM)), "length_um": short(p.residual.norm() / UM),
                    "tool_um": shorts((0..3).map(|k| r.tool[k] / UM)), "normalised": short(r.normalised)})
            })
            .collect();
        let views: Vec<Value> = comparison
            .joints
            .iter()
            .map(|curve| {
                let (unit, si) = curve.against.unit();
                let value = |&i: &usize| self.value(&self.points[i], curve.against).map_or(Value::Null, |x| short(x / si));
                let x: Value = self.shown.iter().map(value).collect();
                let bins: Vec<Value> = curve
                    .bins
                    .iter()
                    .map(|b| json!({"x": short(b.x), "mean_urad": short(b.mean / URAD), "sigma_urad": short(b.sigma / URAD), "n": b.samples}))
                    .collect();
                json!({"joint": curve.joint, "against": curve.against.name(), "what": against(curve.against), "unit": unit, "x": x,
                    "bins": bins, "test": tested(&curve.test)})
            })
            .collect();
        let balls: Vec<Value> = comparison
            .balls
            .iter()
            .map(|b| {
                json!({"ball": b.ball, "dataset": b.dataset, "n": b.samples, "mean_um": shorts((0..3).map(|k| b.mean[k] / UM)),
                    "sigma_um": shorts((0..3).map(|k| b.sigma[k] / UM)), "test": tested(&b.test)})
            })
            .collect();
        json!({"samples": samples, "of": self.points.len(), "angles_urad": self.as_angles(|i| self.points[i].residual), "views": views, "balls": balls,
            "space": space(&self.stances, &self.shown, |i| self.ball_view(&self.points[i], comparison))})
    }

    /// Index of a sample's ball among the comparison's balls.
    pub fn ball_view(&self, point: &Point, comparison: &Comparison) -> Option<usize> {
        let (ball, dataset) = (point.ball.as_ref()?, &comparison.setups[point.setup].dataset);
        comparison.balls.iter().position(|b| b.ball == *ball && b.dataset == *dataset)
    }

    /// Value of a view's variable in a sample, SI.
    pub fn value(&self, point: &Point, variable: JointVariable) -> Option<f64> {
        point.variables.iter().find(|(v, _)| *v == variable).and_then(|(_, x)| *x)
    }
}

/// The parts of a test shown in a picture.
fn tested(t: &ViewTest) -> Value {
    json!({"p_family": t.p_family, "explains": t.explains, "dof": t.dof})
}

/// A variable in words.
fn against(variable: JointVariable) -> String {
    match variable {
        JointVariable::Angle(j) => format!("angle of joint {j}"),
        JointVariable::Torque(j) => format!("gravity torque on joint {j}"),
        JointVariable::Approach(j) => format!("side from which joint {j} came"),
        JointVariable::Lag(j) => format!("commanded minus reported angle of joint {j}"),
        JointVariable::Payload => "payload".into(),
        JointVariable::Time => "time since the session began".into(),
        JointVariable::Temperature => "temperature of the robot".into(),
    }
}
