//! The context in which each sample was taken, for the diagnosis.

use nalgebra::{Vector3, Vector6};

use super::assembly::Assembly;
use super::{Parameter, Prior, Problem, ProblemError, Use, Workspace};
use crate::identify::Model;
use crate::measure::dataset::NamedDataset;
use crate::robot::sites::Site;
use crate::robot::statics::Loads;

/// The context of a sample: what was recorded with it, and the columns of its whitened residual for the sites that a scan varies.
#[derive(Clone)]
pub(crate) struct SampleContext {
    /// First scalar residual, and their number: three, or one for a distance, or six for a pose.
    pub first_row: usize,
    pub height: usize,
    /// Number of those, the first ones, that are of its position.
    pub positions: usize,
    /// Set-up to which it belongs.
    pub setup: usize,
    /// The ball with unknown position that it probes, by the ball's first parameter.
    pub free_ball: Option<usize>,
    /// The ball that it probes, by index in its artifact.
    pub ball: Option<usize>,
    /// Joint angles, rad (N).
    pub q: Vec<f64>,
    /// Moment of the load about each joint, N·m (N).
    pub tau: Vec<f64>,
    /// Seconds since its session began.
    pub time_s: Option<f64>,
    /// Whitened column of each joint's angle (N); only the first `height` components count.
    pub joints: Vec<Vector6<f64>>,
    /// Whitened columns of the base's position in the world.
    pub base: [Vector6<f64>; 3],
    /// Whitened columns of the TCP's position in the last frame.
    pub tool: [Vector6<f64>; 3],
}

impl SampleContext {
    /// Rescales the whitened columns for noise larger by `1 / weight`.
    pub(crate) fn scale(&mut self, weight: f64) {
        self.joints.iter_mut().chain(&mut self.base).chain(&mut self.tool).for_each(|column| *column *= weight);
    }
}

impl Problem {
    /// Lays out samples as [`Problem::new`] does, each session with the duration of that of `other`, so that a share of the
    /// session means the same in both.
    ///
    /// # Errors
    /// As [`Problem::new`].
    pub(crate) fn with_session_durations_of(
        other: &Problem,
        datasets: &[NamedDataset<'_>],
        model: &Model,
        which: Use,
    ) -> Result<Self, ProblemError> {
        let mut assembly = Assembly::new(datasets, model, which)?;
        assembly.take_session_durations_of(&other.setups);
        assembly.problem()
    }

    /// Circumstances of every sample, the arm posed according to `values`.
    pub(crate) fn contexts(&self, values: &[f64]) -> Vec<SampleContext> {
        let n = self.robot.joints();
        let mut work = Workspace::new(&self.robot);
        let mut loads = Loads::new(n);
        let is_free = |p: usize| {
            let Parameter { effect, knowledge, .. } = &self.parameters[p];
            *knowledge == Prior::Uninformative && effect.ball_name().is_some()
        };
        let state = self.load_state(values);
        let of_row = |(place, row): (usize, &super::SampleRow)| {
            self.pose(place, values, &state, &mut work);
            let pattern = &state.patterns[state.rows[place].pattern];
            let seen = self.seen_orientation(row, &work);
            let sight = self.residual(row, seen.as_ref(), &work).1;
            let column = |site: Site| {
                let axis = work.posture.turning(site);
                let shift = work.posture.column(site) + seen.as_ref().map_or(Vector3::zeros(), |seen| seen.shift(site, &axis));
                let position = match sight {
                    Some(sight) => Vector3::new(row.whitener[(0, 0)] * sight.dot(&shift), 0.0, 0.0),
                    None => row.whitener * shift,
                };
                let turn = seen
                    .as_ref()
                    .zip(row.orientation.as_ref())
                    .map_or(Vector3::zeros(), |(seen, orientation)| orientation.whitened(&shift, &seen.column(site, &axis)));
                Vector6::new(position.x, position.y, position.z, turn.x, turn.y, turn.z)
            };
            let setup = &self.setups[row.setup];
            let cell = &self.cells[row.cell];
            loads.compute(&self.robot, &work.posture, row.payload(cell), &setup.gravity, &Vector3::zeros());
            row.load_further(cell, &work.posture, &mut loads);
            SampleContext {
                first_row: row.first_row,
                height: row.height(),
                positions: row.positions(),
                setup: row.setup,
                free_ball: pattern.iter().map(|moves| moves.parameter).filter(|&p| is_free(p)).min(),
                ball: row.ball(),
                q: row.q().to_vec(),
                tau: loads.tau.clone(),
                time_s: row.time_s(),
                joints: (0..n).map(|j| column(self.robot.joint_site(j))).collect(),
                base: [0, 1, 2].map(|k| column(Site::Base(crate::robot::sites::Axis6::ALL[k]))),
                tool: [0, 1, 2].map(|k| column(Site::tool(k))),
            }
        };
        self.rows.iter().enumerate().map(of_row).collect()
    }
}
