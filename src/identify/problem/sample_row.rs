//! One sample in the least-squares problem: the target of the TCP, its uncertainty, and the parameters that move it.

use nalgebra::{Matrix3, Vector3, Vector6};

use super::Setup;
use super::cell::{Cell, push};
use super::jacobian_pattern::{JacobianPattern, TermCollector};
use super::orientation::{OrientationPart, SeenOrientation, stated};
use crate::effects::situation::{Kind, Situation};
use crate::math::linalg::LinalgError;
use crate::math::positive_definite::whitener;
use crate::measure::dataset::{Measured, Sample};
use crate::robot::kinematics::{LanePosture, Posture, PostureView};
use crate::robot::sites::SiteIndex;
use crate::robot::statics::{Loads, Payload};
use crate::robot::{Frame, FramePose, Robot};
use crate::units::MM;

/// Standard uncertainty assumed to weight samples whose noise is not stated; their common scale is then estimated from the
/// fit.
pub const UNSTATED_SIGMA: f64 = 0.1 * MM;

/// The inputs needed to compute the loads of one sample's arm besides the sample: the arm as posed, and the gravity loads.
pub(super) struct EvaluationContext<'a> {
    pub robot: &'a Robot,
    pub setup: &'a Setup,
    pub posture: &'a dyn PostureView,
    /// Present compliance of each joint, rad/(N·m).
    pub compliance: &'a [f64],
    /// Name of the sample.
    pub sample: &'a str,
    pub loads: &'a mut Loads,
}

/// The reference with which one sample compares the TCP.
#[derive(Debug, Clone, Copy)]
pub(super) enum Target {
    Position(Vector3<f64>),
    Distance { anchor: Vector3<f64>, distance: f64 },
}

pub(super) struct SampleRow {
    pub cell: usize,
    pub setup: usize,
    /// First scalar residual: three, or one for a distance, or six for a pose.
    pub first_row: usize,
    q: Vec<f64>,
    tool: FramePose,
    target: Target,
    /// W with W^T W = Sigma^-1, lower triangular; only (0, 0) for a distance.
    pub whitener: Matrix3<f64>,
    sigma: Option<f64>,
    /// The orientation, if it was measured.
    pub orientation: Option<Box<OrientationPart>>,
    payload: usize,
    tau: Option<Vec<f64>>,
    /// Index of the ball or anchor.
    ball: Option<usize>,
    anchor: Option<usize>,
    /// Index of the measured point of the tool; `None` for the TCP.
    tool_target: Option<usize>,
    time_s: Option<f64>,
    temp_c: Option<f64>,
    approach: Option<Vec<i8>>,
    plungers: Option<[i8; 3]>,
    reading: Option<Vector3<f64>>,
    q_commanded: Option<Vec<f64>>,
    /// From the samples before it.
    pub inherited: Option<super::order::Inherited>,
}

impl SampleRow {
    /// A sample of set-up `setup`, with its terms still to be collected.
    pub fn new(cells: &[Cell], cell: usize, setup: usize, first_row: usize, sample: &Sample) -> Self {
        let mut row = SampleRow {
            cell,
            setup,
            first_row,
            q: sample.q.clone(),
            tool: FramePose::default(),
            target: Target::Position(Vector3::zeros()),
            whitener: Matrix3::identity(),
            sigma: None,
            orientation: None,
            payload: 0,
            tau: None,
            ball: None,
            anchor: None,
            tool_target: sample.tool_target,
            time_s: None,
            temp_c: None,
            approach: sample.approach.clone(),
            plungers: None,
            reading: None,
            q_commanded: sample.q_commanded.clone(),
            inherited: None,
        };
        row.take(&cells[cell], sample);
        row
    }

    /// Number of scalar residuals.
    pub fn height(&self) -> usize {
        self.positions() + if self.orientation.is_some() { 3 } else { 0 }
    }

    /// Number of those, the first ones, that are of its position.
    pub fn positions(&self) -> usize {
        if self.anchor.is_some() { 1 } else { 3 }
    }

    /// Joint angles, rad.
    pub fn q(&self) -> &[f64] {
        &self.q
    }

    /// True if it shares set-up and cell with another, so that constant terms move both equally.
    pub fn is_set_up_as(&self, other: &SampleRow) -> bool {
        self.setup == other.setup && self.cell == other.cell
    }

    /// True if its noise is stated.
    pub fn noise_stated(&self) -> bool {
        self.sigma.is_some()
    }

    /// True if a sample measures the same thing as this one, with the same conditions recorded.
    pub fn is_like(&self, sample: &Sample) -> bool {
        let (ball, anchor) = aims(&sample.measured);
        ball == self.ball
            && anchor == self.anchor
            && sample.tool_target == self.tool_target
            && (sample.orientation.is_some() || self.orientation.is_none())
            && sample.q.len() == self.q.len()
            && sample.tau.is_some() >= self.tau.is_some()
            && sample.time_s.is_some() == self.time_s.is_some()
            && sample.temp_c.is_some() == self.temp_c.is_some()
            && sample.approach.as_ref().map(Vec::len) == self.approach.as_ref().map(Vec::len)
            && sample.plungers.is_some() >= self.plungers.is_some()
            && sample.q_commanded.is_some() >= self.q_commanded.is_some()
    }

    /// Takes over the measured values of a sample that [is like](SampleRow::is_like) this one.
    pub fn take(&mut self, cell: &Cell, sample: &Sample) {
        self.q.copy_from_slice(&sample.q);
        (self.ball, self.anchor) = aims(&sample.measured);
        self.tool = cell.tool;
        self.reading = None;
        if let Some((_, offset)) = self.tool_target.and_then(|r| cell.tool_targets.get(r)) {
            self.shift_tool(&(cell.tool_turn * offset));
        }
        self.target = match &sample.measured {
            Measured::Ball { ball, reading } => {
                if let Some(reading) = reading {
                    self.reading = Some(*reading);
                    self.shift_tool(&(cell.tool_turn * reading));
                }
                Target::Position(cell.balls[*ball])
            }
            Measured::Point(point) => Target::Position(*point),
            Measured::Distance { anchor, distance } => Target::Distance { anchor: cell.anchors[*anchor], distance: *distance },
        };
        self.sigma = sample.sigma.or(match sample.measured {
            Measured::Ball { .. } => cell.noise.ball,
            Measured::Point(_) | Measured::Distance { .. } => cell.noise.point,
        });
        let orientation = stated(sample, cell.noise.orientation).filter(|_| cell.takes_orientations && !cell.is_aside(sample));
        let at = tool_seeing(cell, sample).filter(|_| orientation.is_some());
        self.orientation = orientation.map(|(o, sigma)| Box::new(OrientationPart::of(o, sigma, cell.tool_turn, at)));
        if at.is_some() {
            self.target = Target::Position(Vector3::zeros());
        }
        self.payload = sample.payload.min(cell.payloads.len() - 1);
        self.tau.clone_from(&sample.tau);
        self.tau = self.tau.take().filter(|_| cell.measured_torques);
        self.time_s = sample.time_s;
        self.temp_c = sample.temp_c;
        self.approach.clone_from(&sample.approach);
        self.plungers = sample.plungers;
        self.q_commanded.clone_from(&sample.q_commanded);
    }

    /// Shifts the measured point of the tool, axes of the last frame, m.
    fn shift_tool(&mut self, shift: &Vector3<f64>) {
        self.tool.xyz.iter_mut().zip(shift).for_each(|(x, s)| *x += s);
    }

    /// The measured point of the tool at the start of a fit, in the last frame, m.
    #[inline]
    fn point(&self, setup: &Setup) -> FramePose {
        let to_origin = self.orientation.as_ref().and_then(|o| o.to_origin(&setup.probe));
        to_origin.map_or(self.tool, |shift| FramePose { xyz: (Vector3::from(self.tool.xyz) + shift).into(), ..self.tool })
    }

    /// Poses the arm at this sample, with its sites deviating by `deviations`.
    #[inline]
    pub fn pose(&self, robot: &Robot, setup: &Setup, posture: &mut Posture, deviations: &[f64]) {
        posture.set(robot, &setup.start, &self.point(setup), &self.q, deviations);
    }

    /// Writes joints (rad), base and TCP of this sample into one lane of a batch.
    #[inline]
    pub fn put<const L: usize>(
        &self,
        lane: usize,
        setup: &Setup,
        base: &mut [[f64; L]; 6],
        tool: &mut [[f64; L]; 3],
        q: &mut [[f64; L]],
    ) {
        base.iter_mut().zip(setup.start.to_array()).for_each(|(base, x)| base[lane] = x);
        tool.iter_mut().zip(self.point(setup).xyz).for_each(|(tool, x)| tool[lane] = x);
        q.iter_mut().zip(&self.q).for_each(|(q, angle)| q[lane] = *angle);
    }

    /// Residual for a TCP at `tcp`, m: three components, or one and two zeros for a distance; with the line of sight for a
    /// distance.
    #[inline]
    pub fn residual(&self, tcp: &Vector3<f64>, target_moved: &Vector3<f64>) -> (Vector3<f64>, Option<Vector3<f64>>) {
        match self.target {
            Target::Position(target) => (target + target_moved - tcp, None),
            Target::Distance { anchor, distance } => {
                let sight = tcp - (anchor + target_moved);
                let length = sight.norm();
                (Vector3::new(distance - length, 0.0, 0.0), Some(sight / length.max(f64::MIN_POSITIVE)))
            }
        }
    }

    /// The orientation as measured beside that of the arm as posed, if it was measured; `turned` is the deviation of the
    /// probe's rotation vector.
    #[inline]
    pub fn seen_orientation(&self, setup: &Setup, flange: &Frame, turned: &Vector3<f64>) -> Option<SeenOrientation> {
        self.orientation.as_ref().map(|o| o.seen(flange, &setup.probe, turned))
    }

    /// Length, m, that weights an angle of its orientation as much as a displacement.
    pub fn lever(&self) -> f64 {
        self.orientation.as_ref().map_or(0.0, |o| o.lever(self.sigma.unwrap_or(UNSTATED_SIGMA)))
    }

    /// Computes the weight of each parameter that moves the TCP in the situation of this sample; returns its terms if they
    /// differ from `pattern`.
    pub fn weighted_terms(
        &self,
        cell: &Cell,
        context: &mut EvaluationContext<'_>,
        pattern: &[JacobianPattern],
        into: &mut Vec<f64>,
    ) -> Option<Vec<JacobianPattern>> {
        let mut weights = std::mem::take(into);
        weights.clear();
        weights.reserve(pattern.len());
        let mut terms = TermCollector { sites: SiteIndex::new(context.robot.joints()), pattern, weights, other: None };
        self.collect_terms(cell, context, &mut terms);
        let TermCollector { weights, mut other, .. } = terms;
        if other.is_none() && weights.len() < pattern.len() {
            other = Some(pattern[..weights.len()].to_vec());
        }
        *into = weights;
        other
    }

    /// The payload on the flange.
    pub fn payload<'a>(&self, cell: &'a Cell) -> &'a Payload {
        &cell.payloads[self.payload]
    }

    /// Adds the plungers' spring forces to gravity's loads on the arm of this sample, posed as in `posture`, or replaces
    /// the torques by measured ones.
    pub fn load_further(&self, cell: &Cell, posture: &dyn PostureView, loads: &mut Loads) {
        if self.ball.is_some() && cell.contact_force != Vector3::zeros() {
            push(loads, posture, &posture.flange().direction(&cell.contact_force));
        }
        if let Some(tau) = &self.tau {
            loads.tau.copy_from_slice(tau);
        }
    }

    /// The ball that it probes, by index in its artifact.
    pub fn ball(&self) -> Option<usize> {
        self.ball
    }

    /// Seconds since its session began.
    pub fn time_s(&self) -> Option<f64> {
        self.time_s
    }

    fn collect_terms(&self, cell: &Cell, context: &mut EvaluationContext<'_>, terms: &mut TermCollector<'_>) {
        let EvaluationContext { robot, setup, posture, compliance, sample, loads } = context;
        self.load_further(cell, *posture, loads);
        let (kind, target) = match self.target {
            Target::Distance { .. } => (Kind::Distance, None),
            Target::Position(place) => (self.ball.map_or(Kind::Point, Kind::Ball), Some(place)),
        };
        let situation = Situation {
            gravity: setup.gravity,
            tool: cell.tool,
            compliance,
            sample: Some(sample),
            tool_target: self.tool_target.and_then(|r| cell.tool_targets.get(r)).map(|(name, _)| name.as_str()),
            kind: Some(kind),
            target,
            artifact: Some(cell.artifact),
            reading: self.reading,
            plungers: self.plungers,
            q_commanded: self.q_commanded.as_deref(),
            q_before: self.inherited.as_ref().and_then(|i| i.q.as_deref()),
            hose: self.inherited.as_ref().map(|i| &i.hose[..]),
            approach: self.approach.as_deref(),
            time_s: self.time_s,
            duration_s: setup.duration_s,
            temp_c: self.temp_c,
            ..Situation::at_rest(robot, &self.q, *posture, loads, self.payload(cell))
        };
        for placed in &cell.effects {
            let first = placed.first[if placed.first.len() > 1 { self.setup } else { 0 }];
            match placed.effect.constant() {
                Some(constant) => terms.add_constant(first, constant),
                None => placed.effect.terms(&situation, &mut |k, site, weight| {
                    if weight != 0.0 {
                        terms.add(first + k, site, weight, false);
                    }
                }),
            }
        }
    }

    /// Computes W with W^T W = Sigma^-1, `Sigma = sigma² I + J_q diag(sigma_q²) J_q^T`, the arm posed as in `posture`.
    /// An error where Sigma is not finite.
    pub fn state_noise<const L: usize>(&mut self, cell: &Cell, posture: &LanePosture<'_, L>) -> Result<(), LinalgError> {
        let sigma = self.sigma.unwrap_or(UNSTATED_SIGMA);
        let joint_sigmas = &cell.noise.joint;
        if let Some(orientation) = &mut self.orientation {
            let moved = |(i, sigma_q): (usize, &f64)| {
                let (shift, turn) = (posture.motion(i) * *sigma_q, posture.turning(posture.postures.joint_site(i)) * *sigma_q);
                Vector6::new(shift.x, shift.y, shift.z, turn.x, turn.y, turn.z)
            };
            orientation.state_noise(sigma, joint_sigmas.iter().enumerate().take(self.q.len()).map(moved))?;
        }
        if joint_sigmas.is_empty() {
            self.whitener = Matrix3::identity() / sigma;
            return Ok(());
        }
        let mut covariance = Matrix3::identity() * (sigma * sigma);
        for (i, &sigma_q) in joint_sigmas.iter().enumerate().take(self.q.len()) {
            let column = posture.motion(i) * sigma_q;
            covariance += column * column.transpose();
        }
        self.whitener = match self.target {
            Target::Distance { anchor, .. } => {
                let sight = (posture.tcp() - anchor).normalize();
                Matrix3::identity() / sight.dot(&(covariance * sight)).max(sigma * sigma).sqrt()
            }
            Target::Position(_) => whitener(covariance)?,
        };
        Ok(())
    }

    /// Whitens columns of the orientation, with the coordinates of the position's columns before these are whitened; `into` holds
    /// three rows.
    pub fn whiten_orientation(&self, [x, y, z]: [&[f64]; 3], turns: &[Vector3<f64>], into: &mut [f64]) {
        let Some(orientation) = &self.orientation else { return };
        for (k, turn) in turns.iter().enumerate() {
            let whitened = orientation.whitened(&Vector3::new(x[k], y[k], z[k]), turn);
            (0..3).for_each(|axis| into[axis * turns.len() + k] = whitened[axis]);
        }
    }

    /// Multiplies the vectors whose coordinates are in `x`, `y`, `z` by the whitener, which is lower triangular.
    #[inline]
    pub fn whiten(&self, x: &mut [f64], y: &mut [f64], z: &mut [f64]) {
        let w = &self.whitener;
        for ((x, y), z) in x.iter_mut().zip(y).zip(z) {
            *z = w[(2, 0)] * *x + w[(2, 1)] * *y + w[(2, 2)] * *z;
            *y = w[(1, 0)] * *x + w[(1, 1)] * *y;
            *x *= w[(0, 0)];
        }
    }
}

/// Where the tool was measured, if it was the tool that saw the world.
fn tool_seeing<'a>(cell: &Cell, sample: &'a Sample) -> Option<&'a Vector3<f64>> {
    match &sample.measured {
        Measured::Point(at) if cell.noise.seen_from_tool && sample.tool_target.is_none() => Some(at),
        _ => None,
    }
}

/// Index of the ball or anchor of a measurement.
fn aims(measured: &Measured) -> (Option<usize>, Option<usize>) {
    match measured {
        Measured::Ball { ball, .. } => (Some(*ball), None),
        Measured::Point(_) => (None, None),
        Measured::Distance { anchor, .. } => (None, Some(*anchor)),
    }
}
