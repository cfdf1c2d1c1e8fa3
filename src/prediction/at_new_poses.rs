//! Applies an examined fit to measurements that were not taken: effect of every fitted parameter and every candidate on
//! them.

use nalgebra::DMatrix;

use crate::diagnosis::Examination;
use crate::diagnosis::library::missing_somewhere;
use crate::effects::{self, Effect, EffectId, Owner};
use crate::identify::calibration::IdentifyError;
use crate::identify::problem::{Parameter, Problem, SampleContext, Use};
use crate::math::positive_definite::inverse;
use crate::measure::dataset::{Dataset, NamedDataset};

/// The examined problem, set up for other samples of its first set-up.
pub(crate) struct AtNewPoses {
    problem: Problem,
    values: Vec<f64>,
    /// Parameter of `problem` for each fitted parameter and each candidate column of the examination; `None` if it has
    /// no effect on these samples.
    twins: Vec<Option<usize>>,
    /// Scale of each twin: 1 for a fitted parameter, the plausible size for a candidate.
    scales: Vec<f64>,
    /// Parameters of `problem` that are a twin, ascending.
    parameters: Vec<usize>,
}

impl AtNewPoses {
    /// As [`AtNewPoses::new`], for the arm only: ball positions are known only at the places that were measured, so the
    /// artifact's effects are left out.
    pub fn of_the_arm(there: &Dataset, examination: &Examination) -> Result<Self, IdentifyError> {
        AtNewPoses::new(there, examination, |effect| effect.owner() != Owner::Artifact)
    }

    /// Builds the problem for the samples of `there`. Effects that `takes` rejects, or whose data are missing, have no
    /// effect on them. The session keeps its original duration, so effects that build up over the session keep their
    /// rate.
    ///
    /// # Errors
    /// When there is no sample.
    pub fn new(there: &Dataset, examination: &Examination, takes: impl Fn(&dyn Effect) -> bool) -> Result<Self, IdentifyError> {
        let Examination { wide, values, fitted, columns, model, library, .. } = examination;
        let balls = there.ball_ids();
        let subject = model.subject(&there.robot, &balls);
        let named = [NamedDataset::new("elsewhere", there)];
        let counts = |id: &EffectId| {
            effects::build(id, &subject)
                .is_ok_and(|e| takes(e.as_ref()) && missing_somewhere(e.as_ref(), &named, model).is_none())
        };
        let mut of_here = model.clone();
        of_here.effects.retain(&counts);
        of_here.effects.extend(library.candidates.iter().map(|c| c.id.clone()).filter(counts));
        let mut problem = Problem::with_session_durations_of(wide, &named, &of_here, Use::All)?;
        let is_first = |p: &Parameter| p.setup.is_none_or(|setup| setup == 0);
        let twin = |k: usize| {
            let there = &wide.parameters()[k];
            let is_twin = |p: &Parameter| p.spec.name == there.spec.name && p.effect == there.effect;
            problem.parameters().iter().position(|p| is_first(there) && is_twin(p))
        };
        let mut at = problem.start();
        for k in 0..wide.parameters().len() {
            if let Some(p) = twin(k) {
                at[p] = values[k];
            }
        }
        let twins: Vec<Option<usize>> = fitted.iter().copied().chain(columns.iter().map(|c| c.parameter)).map(twin).collect();
        let scales = std::iter::repeat_n(1.0, fitted.len()).chain(columns.iter().map(|c| c.plausible)).collect();
        problem.update_loads(&at);
        let mut parameters: Vec<usize> = twins.iter().flatten().copied().collect();
        parameters.sort_unstable();
        parameters.dedup();
        Ok(AtNewPoses { problem, values: at, twins, scales, parameters })
    }

    /// Points less the positions of the fitted arm, m.
    #[cfg(test)]
    pub fn residuals(&self) -> Vec<nalgebra::Vector3<f64>> {
        self.problem.residuals(&self.values)
    }

    /// Each twin: its index, its place among the parameters, and its scale.
    fn places(&self) -> impl Iterator<Item = (usize, usize, f64)> {
        let twins = self.twins.iter().zip(&self.scales).enumerate();
        twins.filter_map(|(k, (twin, scale))| Some((k, self.parameters.binary_search(twin.as_ref()?).ok()?, *scale)))
    }

    /// Jacobian of the TCP position: three rows per sample (m); one column per fitted parameter (per SI unit), then one
    /// per candidate parameter (per plausible size).
    pub fn fields(&self) -> DMatrix<f64> {
        let jacobian = self.problem.plain_jacobian(&self.values, &self.parameters);
        let mut all = DMatrix::zeros(jacobian.nrows(), self.twins.len());
        for (k, from, scale) in self.places() {
            all.column_mut(k).axpy(scale, &jacobian.column(from), 0.0);
        }
        all
    }

    /// Jacobian of the residuals, whitened by the noise of each sample and transposed: three columns per sample.
    pub fn whitened(&self) -> DMatrix<f64> {
        let rows = self.problem.whitened(&self.values, &self.parameters);
        let mut all = DMatrix::zeros(self.twins.len(), rows.ncols());
        for (mut to, from) in all.column_iter_mut().zip(rows.column_iter()) {
            self.places().for_each(|(k, at, scale)| to[k] = from[at] * scale);
        }
        all
    }

    /// Circumstances of the samples.
    pub fn contexts(&self) -> Vec<SampleContext> {
        self.problem.contexts(&self.values)
    }

    /// Circumstances of the samples with unwhitened columns, m, as in [`AtNewPoses::fields`].
    pub fn plain_contexts(&self) -> Vec<SampleContext> {
        let mut all = self.contexts();
        self.problem.for_each_sample(&self.values, &mut |s| {
            // The whitener of a position was made by inverting a root of its covariance; here there are only positions.
            if let Ok(back) = inverse(s.whitener) {
                for column in &mut all[s.place].joints {
                    let plain = back * column.fixed_rows::<3>(0);
                    column.fixed_rows_mut::<3>(0).copy_from(&plain);
                }
            }
        });
        all
    }
}
